"""Beds at rest between periodic side walls: the motion that is left, and what a step costs.

Particles of diameter 0.1 fall on a flat floor, with a drag whose rate is 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tests.helpers.pouring import run_deck

DIAMETER, GRAVITY = 0.1, 9.81
# Frictionless beds give way here and there long after the fall. A bed is at rest when the fix says
# so at the end of a period of 2.5 time units; what is left is measured in the next one.
ROUNDS = 31  # of 2.5 time units, after which a bed that is not at rest is measured as it is

SPHERES_AT_REST = """
atom_style sphere
region start block 0 1 0 1 0.06 2.5
boundary p p f
region box block 0 1 0 1 0 4
create_box 1 box
create_atoms 1 random 1000 ${seed} start overlap 0.08 maxtry 5000
set group all diameter 0.1 density 1
fix motion all nve
variable bodies string ""
compute energy all ke
variable energy equal c_energy
"""
DIMERS_AT_REST = (
    """
atom_style hybrid sphere molecular
region start block 0 1 0 1 0.1 4
boundary p p f
region box block 0 1 0 1 0 5
create_box 1 box
mass 1 1.0
print """
    + '"""'
    + """{"application": "LAMMPS", "format": "molecule", "revision": 1, "title": "dimer",
"coords": {"format": ["atom-id", "x", "y", "z"], "data": [[1, -0.025, 0, 0], [2, 0.025, 0, 0]]},
"types": {"format": ["atom-id", "type"], "data": [[1, 1], [2, 1]]}}"""
    + '"""'
    + """ file dimer.json screen no
molecule dimer dimer.json
create_atoms 0 random 500 ${seed} start mol dimer ${seed} overlap 0.08 maxtry 5000
set group all diameter 0.1 density 1
comm_modify cutoff 0.3
fix motion all rigid/small molecule
variable bodies string "rigid motion solid"
compute slide all ke/rigid motion
compute spin all erotate/rigid motion
variable energy equal c_slide+c_spin
"""
)
REST = f"""
pair_style zero 0.1
pair_coeff * *
neighbor 0.1 bin
timestep ${{h}}
region floor plane 0 0 0 0 0 1
variable damping equal PI*0.001/6
fix gravity all gravity {GRAVITY} vector 0 0 -1
fix drag all viscous ${{damping}}
fix contact all inelastic ${{eps}} region floor shorten yes ${{bodies}}
variable speed equal sqrt(2*v_energy/mass(all))/({GRAVITY}*v_h)
variable iterations equal f_contact[1]
variable n equal round(2.5/v_h)
thermo $n
fix means all ave/time 1 $n $n v_speed v_iterations
thermo_style custom step time v_energy f_means[1] f_means[2]
thermo_modify norm no
log log.lammps
variable rounds loop {ROUNDS}
label round
run $n
if "$(f_contact[13]) == 1" then "jump SELF rested"
next rounds
jump SELF round
label rested
run $n
print "means $(time-2.5) $(f_means[1]) $(f_means[2])"
"""
BEDS = {"1,000 spheres": SPHERES_AT_REST, "500 dimers": DIMERS_AT_REST}


@dataclass(frozen=True)
class Left:
    """What is left of the motion, as a mean over 2.5 time units in which the bed is at rest.

    Attributes
    ----------
    rested : time when it was found at rest, the start of what is measured
    speed : root mean square of the particles' speed [g times the time step]
    iterations : iterations of a step
    """

    rested: float
    speed: float
    iterations: float


def at_rest(folder: Path, bed: str, tolerance: float, timestep: float, seed: int) -> Left:
    """Let one of the BEDS come to rest; the tolerance is in diameters."""
    variables = {"h": timestep, "eps": DIAMETER * tolerance, "seed": seed}
    log = run_deck(folder, BEDS[bed] + REST, variables)
    (means,) = (line for line in log.splitlines() if line.startswith("means "))
    return Left(*(float(value) for value in means.split()[1:]))
