"""A packing that moves is named, one that rests is not: beds that are stopped, and packings.

What counts as moving is taken from the dumps alone: an rms speed above a tenth of g h, or a floor
that carries a hundredth more or less than the weight.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import ContactFrame, ParticleFrame, read_run_log
from lammps_inelastic.analysis import iterate_contact_frames as contacts_in
from lammps_inelastic.analysis import read_particle_frame as frame_in
from lammps_inelastic.workflow import Ball, Box, Cluster, Cylinder, Dimer, Sphere, pack
from tests.helpers.lammps_run import run_lmp

GRAVITY = 9.81
FAST, OFF = 0.1, 0.01
BEDS = 100
INPUTS = Path(__file__).parents[2] / "inputs"


def moves(frame: ParticleFrame, contacts: ContactFrame, step: float) -> bool:
    """Whether a bed of equal spheres, or bodies of them, moves; `step` is the time step."""
    assert frame.velocities is not None
    speed = np.sqrt((frame.velocities**2).sum(axis=1).mean())
    weight = GRAVITY * (4 / 3 * np.pi * frame.radii**3).sum()
    walls = contacts.ids[:, 1] < 0
    carried = (contacts.forces[walls, None] * contacts.normals[walls]).sum(axis=0)
    missing = np.linalg.norm(carried - [0, weight, 0]) / weight
    return bool(speed > FAST * GRAVITY * step or missing > OFF)


@pytest.mark.validation
@pytest.mark.parametrize("deck", ["spheres", "dimers", "clusters"])
def test_beds_that_are_stopped_are_named(deck: str, tmp_path: Path) -> None:
    """Each of a third of 100 beds that move where the deck ends: by the deck, and in the log."""
    random = np.random.default_rng(1)
    found = seed = 0
    while found < BEDS // 3 + 1:
        seed += 1
        steps = {
            "steps_agitated": int(random.integers(10, 60)),
            "steps_settling": int(random.integers(0, 120)),
            "steps_resting": int(random.integers(0, 20)),
            "waiting": 0,
            "steps_tightening": 0,
            "steps_measuring": 0,
            "dt_measuring": 0.01,
        }
        few = {"particles": int(random.integers(20, 100)), "diameter": 0.18, "seed": seed}
        result = run_lmp(tmp_path, (INPUTS / f"{deck}.in").read_text(), variables={**few, **steps})
        out = tmp_path / "out"
        frame = frame_in(out / "particles.lammpsdump")
        *_, contacts = contacts_in(out / "contacts.lammpsdump")
        if not moves(frame, contacts, 0.01):
            continue
        found += 1
        unrest = read_run_log(out / "log.lammps").unrest_at(frame.step)
        assert unrest is not None
        assert not unrest.at_rest, (seed, unrest)
        assert any("NOT AT REST" in line for line in result.warnings), seed


@pytest.mark.validation
@pytest.mark.parametrize("number", range(BEDS))
def test_packings_at_rest_are_not_named(number: int) -> None:
    """`pack` returns them, in containers of all kinds, and their dumps agree."""
    shape = (Sphere(), Dimer(1.5), Cluster())[number % 3]
    container = (Box(5.0), Cylinder(6.0), Ball(9.0))[number // 3 % 3]
    particles = 20 + 7 * (number % 10)
    packing = pack(
        particles, shape=shape, sizes=1.0, container=container, seed=number + 1, progress=False
    )
    assert packing.at_rest
    # In its last phase, with times scaled as the deck says.
    clock = np.sqrt(float(np.diff(packing.container.bounds[1]).item()) / 5)
    assert not moves(packing.frame, packing.contacts, 0.1 * clock)
