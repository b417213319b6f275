"""In every system of units of LAMMPS the same numbers give the same motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.bodies import BENT, INERTIAS, body_scene, dimer, random_bodies
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import GRAVITY, FloatArray, read_dump

RADIUS = 0.05
EPS = 0.0005 * RADIUS
BOX = ((0.0, 0.57), (0.0, 1.0), (0.0, 0.57))
BODIES = random_bodies(
    [dimer(1.5), np.zeros((1, 3)), BENT] * 5,
    RADIUS,
    np.array(BOX) + np.array([RADIUS, -RADIUS]),
    seed=1,
)
DUMP = """
dump all all custom 60 particles.dump id type x y z radius mass &
     f_contact[3] f_contact[4] f_contact[5]
dump_modify all sort id format float %.17g colname 8 fx colname 9 fy colname 10 fz
run 60
"""
# Acceleration of a unit of mass by a unit of force (LAMMPS's update.cpp: ftm2v); 1 in `lj`.
ACCELERATIONS = {
    "real": 1 / 48.88821291**2,
    "metal": 1 / 1.0364269e-4,
    "electron": 0.937582899,
    "si": 1.0,
    "cgs": 1.0,
    "micro": 1.0,
    "nano": 1.0,
}


def run(units: str, deck: str, folder: Path, lmp: Runner) -> tuple[FloatArray, FloatArray]:
    """Return positions, and contact forces in weights."""
    # Fix gravity wants a force for a unit of mass.
    gravity = GRAVITY / ACCELERATIONS.get(units, 1.0)
    deck = deck.replace("units lj", f"units {units}")
    deck = deck.replace(f"gravity {GRAVITY} ", f"gravity {gravity:.17g} ")
    lmp(deck + DUMP)
    end = read_dump(folder / "particles.dump")[-1]
    forces = np.column_stack([end["fx"], end["fy"], end["fz"]])
    return end.positions, forces / (end["mass"][:, None] * gravity)


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("units", ACCELERATIONS)
def test_units(units: str, inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """Free spheres and bodies fall together, with a random force."""
    deck = body_scene(
        BODIES,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        box=BOX,
        options="region container shorten yes",
        fixes="fix shake all random/force 1 4711",
    )
    positions, forces = run("lj", deck, tmp_path, lmp)
    assert np.abs(forces).max() > 1
    same_positions, same_forces = run(units, deck, tmp_path, lmp)
    # Where round-off of the conversion takes an iteration more or less, a residual of the accuracy
    # makes the difference, which collisions amplify.
    assert np.abs(same_positions - positions).max() <= 1e-6 * RADIUS
    # In weights; the accuracy leaves forces undecided by some 1e-3 of their mean.
    assert np.abs(same_forces - forces).max() <= 1e-4
