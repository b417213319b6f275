"""Each grain's velocity in recorded steps of whole runs against the exact solution of the step."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.grainwise import assert_kept, compare_folder
from tests.helpers.pouring import recording, run_deck, shipped_deck

pytestmark = pytest.mark.validation

EVERY = 10  # steps between records
NO_DUMP: dict[str, object] = {"dump_every": 100000}

# The accuracy of which the promise is; decks ask for less while beds move.
PROMISED: dict[str, object] = {
    "accuracy": 0.001,
    "accuracy_agitated": 0.001,
    "tolerance_agitated": 0.0005,
}

# Gravity 9.81 and diameters of 0.1, as in the shipped decks. 2,000 spheres make two to three
# layers; after 20 time units they lie. (Where the box is ten diameters wide their rows fit it, and
# some are held so weakly that a residual of 1e-5 g h^2 leaves them a g h.) Then one falls with 100
# diameters per time, one diameter a step, on the end where x is small. The fix is defined again so
# that only what follows is recorded, in every step; in the first half the layer still lies alone.
LAYER = """
units lj
atom_style sphere
boundary f f f
region box block -1 8 -1 3 -1 21
region container block 0 7 0 1.43 0 20
region start block 0.06 6.94 0.06 1.37 0.06 3
create_box 1 box
create_atoms 1 random 2000 4711 start overlap 0.1 maxtry 5000
set group all diameter 0.1 density 1
pair_style zero 0.1
pair_coeff * *
neighbor 0.2 bin
timestep 0.01
variable damping equal PI*0.001/6
fix gravity all gravity 9.81 vector 0 0 -1
fix drag all viscous ${damping}
fix contact all inelastic 2.5e-5 region container shorten yes
fix motion all nve
log log.lammps
thermo 100
thermo_style custom step ke f_contact[1] f_contact[4]
run 2000
reset_timestep 0
fix contact all inelastic 2.5e-5 region container shorten yes record problem.*.npz every 1
run 100
create_atoms 1 single 0.5 0.715 1.5
set atom 2001 diameter 0.1 density 1
group falling id 2001
velocity falling set 0 0 -10
run 100
"""


@pytest.mark.parametrize(("particles", "diameter"), [(1000, 0.11), (10000, 0.052)])
def test_spheres(particles: int, diameter: float, tmp_path: Path) -> None:
    """The deck of spheres in all its phases, with the fix's own accuracy, every tenth step."""
    values: dict[str, object] = {"particles": particles, "diameter": diameter, **PROMISED}
    run_deck(tmp_path, recording(shipped_deck("spheres"), EVERY), NO_DUMP | values)
    assert_kept({f"{particles:,} spheres": compare_folder(tmp_path)})


@pytest.mark.parametrize("aspect_ratio", [1.01, 1.5])
def test_dimers(aspect_ratio: float, tmp_path: Path) -> None:
    """The deck of dimers in all its phases, as exact: their centres, and each of their spheres."""
    values: dict[str, object] = {"aspect_ratio": aspect_ratio, **PROMISED}
    run_deck(tmp_path, recording(shipped_deck("dimers"), EVERY), NO_DUMP | values)
    assert_kept({f"dimers of {aspect_ratio}": compare_folder(tmp_path)})


def test_layer_that_a_sphere_falls_on(tmp_path: Path) -> None:
    """2,000 spheres at rest, on one end of which a sphere falls at 100 diameters per time."""
    run_deck(tmp_path, LAYER, {})
    assert_kept({"layer of 2,000": compare_folder(tmp_path)})
