"""inputs/response.in: a packing without its side walls, and under tilted gravity."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    ParticleDump,
    Spheres,
    iterate_contact_frames,
    largest_pair_overlap,
    read_particle_frame,
)
from tests.helpers.lammps_run import Runner, run_lmp

PARTICLES, RADIUS = 250, 0.055
PACKING = {
    "particles": PARTICLES,
    "steps_agitated": 200,
    "steps_settling": 300,
    "steps_resting": 0,
    "steps_tightening": 1,
    "steps_measuring": 1,
}


def shipped(name: str) -> str:
    return (files("lammps_inelastic.inputs") / name).read_text()


@pytest.fixture(scope="module")
def packing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The restart file of a small packing at rest."""
    folder = tmp_path_factory.mktemp("packing")
    run_lmp(folder, shipped("spheres.in"), variables=PACKING)
    return folder / "out" / "packing.restart"


def test_tilted_gravity_ends_on_the_walls(packing: Path, lmp: Runner) -> None:
    """At rest the walls carry the weight, in the direction in which gravity points now."""
    result = lmp(
        shipped("response.in"),
        variables={"packing": packing, "change": "tilt", "angle": 20, "steps_changing": 600},
    )
    *_, contacts = iterate_contact_frames(result.folder / "response" / "contacts.lammpsdump")
    wall = contacts.ids[:, 1] < 0
    carried = contacts.forces[wall] @ contacts.normals[wall]
    weight = PARTICLES * math.pi / 6 * (2 * RADIUS) ** 3 * 9.81
    angle = math.radians(20)
    # Frictionless spheres still slide a little: a hundredth of their weight is not at rest yet.
    assert carried == pytest.approx(
        weight * np.array([-math.sin(angle), math.cos(angle), 0.0]), abs=0.01 * weight
    )


def test_without_side_walls_the_packing_flows_out(packing: Path, lmp: Runner) -> None:
    """Spheres without friction end as one layer on the tray, none overlapping at any frame."""
    result = lmp(shipped("response.in"), variables={"packing": packing, "steps_changing": 500})
    dump = ParticleDump(result.folder / "response" / "particles.lammpsdump")
    first, last = dump[0], dump[-1]
    assert (first.positions[:, [0, 2]] >= RADIUS - 1e-4).all()  # still between the walls
    assert np.ptp(last.positions[:, 0]) > 1.5
    # One layer: every centre a radius above the floor, up to what is still rolling down.
    assert np.median(last.positions[:, 1]) == pytest.approx(RADIUS, abs=1e-3 * RADIUS)
    deepest = max(largest_pair_overlap(Spheres(f.positions, f.radii)).depth for f in dump)
    assert deepest <= 0.0005 * RADIUS * (1 + 1e-6)  # the tolerance; 1e-6 for round-off


@pytest.mark.parametrize(
    ("variables", "named"),
    [
        ({"diameter": 0.1}, "diameter must be that of the largest sphere"),
    ],
)
def test_wrong_parameters(
    variables: dict[str, object], named: str, packing: Path, refused: Callable[..., str]
) -> None:
    """One line says what is wrong."""
    assert named in refused(shipped("response.in"), variables={"packing": packing, **variables})


def test_a_data_file_is_a_start(packing: Path, lmp: Runner) -> None:
    """The spheres of a data file fall like others; what is wrong with it takes one line."""
    data = packing.with_name("packing.data")
    lmp(f"read_restart {packing}\nwrite_data {data} nocoeff", into="convert")
    few = {**PACKING, "steps_agitated": 20, "steps_settling": 5, "start": data}
    result = lmp(shipped("spheres.in"), variables=few)
    frame = read_particle_frame(result.folder / "out" / "particles.lammpsdump", 0)
    before = read_particle_frame(packing.with_name("particles.lammpsdump"))
    # Nothing overlaps, so nothing is pushed: only what the packing still moved goes on for a step.
    assert before.velocities is not None
    motion = 2 * 0.01 * np.abs(before.velocities).max()
    assert frame.positions == pytest.approx(before.positions, abs=motion)
    assert motion < 0.1 * RADIUS
    wrong = lmp(shipped("spheres.in"), variables={**few, "diameter": 0.12}, must_pass=False)
    assert wrong.errors[0].startswith("ERROR: diameter must be that of the largest sphere")
