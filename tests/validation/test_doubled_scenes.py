"""Two independent halves in one scene, one violent: each moves as it would alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from lammps_inelastic.core import read_record
from lammps_inelastic.workflow.tradeoff.states import records_in
from tests.helpers.grainwise import assert_kept, compare, part_of
from tests.helpers.pouring import run_deck

pytestmark = pytest.mark.validation

# Gravity 9.81 and diameters of 0.1, as in the shipped decks. Where x < 2.13 a bed settles for 8
# time units, and so do 1,000 spheres beyond a partition. Those are then shaken for 4 time units and
# get up to 1.5 length/time in each direction in a step: they reach 100 diameters per time.
MIDDLE = 2.38
HALVES = """
units lj
{style}
boundary f f f
region box block -1 6 -1 3 -1 9
region container block 0 3.7 0 1.07 0 8
region partition block 2.13 2.63 -1 3 -1 9 side out
region here block 0.1 2.03 0.1 0.97 0.1 4
region there block 2.69 3.64 0.06 1.01 0.06 5
create_box 1 box
{quiet}
group quiet id <= {members}
create_atoms 1 random 1000 4712 there overlap 0.1 maxtry 5000
group violent subtract all quiet
set group all diameter 0.1 density 1
pair_style zero 0.1
pair_coeff * *
neighbor 0.25 bin
neigh_modify delay 0 every 1 check yes
timestep 0.01
variable damping equal PI*0.001/6
fix gravity all gravity 9.81 vector 0 0 -1
fix drag all viscous ${{damping}}
{motion}
fix fly violent nve
fix shaking violent random/force 0 17
fix contact all inelastic 2.5e-5 region container partition shorten yes {bodies} &
    record problem.*.npz every 10
log log.lammps
thermo 50
compute fastest violent reduce maxabs vx vy vz
thermo_style custom step time ke c_fastest[*] f_contact[1] f_contact[4]
run 800
fix shaking violent random/force 150 17
run 400
"""
SPHERES = HALVES.format(
    style="atom_style sphere",
    quiet="create_atoms 1 random 1000 4711 here overlap 0.1 maxtry 5000",
    members=1000,
    motion="fix lie quiet nve",
    bodies="",
)
DIMERS = HALVES.format(
    style="atom_style hybrid sphere 1 molecular\natom_modify map array\ncomm_modify cutoff 0.6",
    quiet="""mass 1 1.0
molecule dimer dimer.mol
create_atoms 0 random 1000 4711 here mol dimer 4711 overlap 0.1 maxtry 5000""",
    members=2000,
    motion="fix lie quiet rigid/small molecule",
    bodies="rigid lie solid",
)
DIMER = """two spheres

2 atoms

Coords

1 -0.025 0 0
2 0.025 0 0

Types

1 1
2 1
"""


@pytest.mark.parametrize(("bed", "deck"), [("spheres", SPHERES), ("dimers", DIMERS)])
def test_each_half_moves_as_alone(bed: str, deck: str, tmp_path: Path) -> None:
    """At every recorded step each half's velocities are those of that half, solved alone."""
    (tmp_path / "dimer.mol").write_text(DIMER)
    run_deck(tmp_path, deck, {})
    quiet, violent = [], []
    for path in records_in(tmp_path):
        record = read_record(path)
        here = record.arrays["position"][:, 0] < MIDDLE
        quiet.append(compare(part_of(record, here)))
        violent.append(compare(part_of(record, ~here)))
    assert_kept({f"bed of {bed}": quiet, f"violent half beside the bed of {bed}": violent})
