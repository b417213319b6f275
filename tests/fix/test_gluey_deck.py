"""inputs/gluey.in: a packing that is glued, and hangs for as long as it was pressed."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import ParticleDump, iterate_contact_frames, read_run_log
from tests.fix.test_response_deck import PACKING, PARTICLES, RADIUS, shipped
from tests.helpers.lammps_run import run_lmp

WEIGHT = PARTICLES * math.pi / 6 * (2 * RADIUS) ** 3 * 9.81


@pytest.fixture(scope="module")
def hung(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small packing that was pressed for 30 steps and then turned over."""
    folder = tmp_path_factory.mktemp("gluey")
    run_lmp(folder, shipped("spheres.in"), variables=PACKING)
    variables = {"steps_pressed": 30, "steps_turned": 60, "dump_every": 1}
    run_lmp(folder, shipped("gluey.in"), variables=variables)
    return folder / "gluey"


def test_it_hangs_for_as_long_as_it_was_pressed(hung: Path) -> None:
    *_, pressed, turned = [run for run in read_run_log(hung / "log.lammps").runs if run.steps]
    # A packing of this deck still gives way a little.
    assert pressed.thermo["force_floor"][-1] == pytest.approx(-WEIGHT, rel=0.1)
    assert turned.thermo["force_floor"][15] == pytest.approx(WEIGHT, rel=0.1)
    let_go = np.flatnonzero(turned.thermo["force_floor"] == 0)[0]
    # Some contacts are given more impulse than the weight while others are given less.
    assert 29 <= let_go <= 40
    assert turned.thermo["held"][20] > 0.9 * pressed.thermo["held"][-1]
    assert turned.thermo["pressed"][20] < pressed.thermo["pressed"][-1]
    # All of it has left the floor, together.
    frames = {frame.step: frame for frame in ParticleDump(hung / "particles.lammpsdump")}
    rising = frames[90].positions[:, 1] - frames[75].positions[:, 1]
    assert rising.min() > 0


def test_its_contacts_are_read(hung: Path) -> None:
    frames = {frame.step: frame for frame in iterate_contact_frames(hung / "contacts.lammpsdump")}
    hanging = frames[45]
    assert hanging.stored is not None
    assert hanging.stored.max() <= 0
    floor = hanging.ids[:, 1] == -3
    assert hanging.forces[floor].sum() == pytest.approx(-WEIGHT, rel=0.1)
    assert (hanging.stored[hanging.forces < 0] <= 0).all()
