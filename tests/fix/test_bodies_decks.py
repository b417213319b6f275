"""inputs/dimers.in and inputs/clusters.in as they are, on one rank and on two."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    Spheres,
    group_spheres,
    iterate_contact_frames,
    largest_pair_overlap,
    read_particle_frame,
)
from tests.helpers.lammps_run import Runner
from tests.helpers.pouring import FEW_STEPS

TIGHT = 0.00002  # [radii] the decks' tolerance in the last phase

CASES = {
    "dimers, 2 ranks": ("dimers.in", 2, {"particles": 1000}, 1000, 2),
    "regular": ("dimers.in", 1, {"particles": 300, "start": "regular"}, 300, 2),
    "solid": ("dimers.in", 1, {"particles": 300, "inertia": "solid", "aspect_ratio": 2}, 300, 2),
    "nearly spheres": ("dimers.in", 1, {"particles": 300, "aspect_ratio": 1.05}, 300, 2),
    "tetrahedra": ("clusters.in", 1, {"particles": 200}, 200, 4),
    "trimers, 2 ranks": (
        "clusters.in",
        2,
        {
            "particles": 200,
            "shape": "trimer.txt",
            "extent": 1.2,
            "inertia": "point",
            "steps_settling": 250,  # they are thrown higher
        },
        200,
        3,
    ),
}
# The others see two ranks, and dimers, too.
SLOW = {"dimers, 2 ranks", "nearly spheres"}
TRIMER = """# bent trimer, lengths in diameters

3 atoms

Coords

1 -0.5 0 0
2 0.3 0 0
3 0.5 0.6 0

Types

1 1
2 1
3 1
"""


def deck(name: str) -> str:
    return (files("lammps_inelastic.inputs") / name).read_text()


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=pytest.mark.slow if case in SLOW else ()) for case in CASES]
)
def test_the_decks_run(case: str, lmp: Runner, tmp_path: Path) -> None:
    """Bodies fall and settle; the dumps hold every sphere, and overlaps stay within two tolerances.

    On two ranks hundreds of bodies lie across the boundary.
    """
    name, ranks, variables, particles, spheres = CASES[case]
    (tmp_path / "trimer.txt").write_text(TRIMER)
    steps = FEW_STEPS | variables
    # Two ranks of 600 spheres wait for one another more than they work.
    result = lmp(deck(name), ranks=ranks, variables=steps, timeout=60.0 * ranks**2)
    last = steps["steps_agitated"] + steps["steps_settling"] + 50 + 8
    frame = read_particle_frame(result.folder / "out" / "particles.lammpsdump")
    assert frame.step == last
    assert frame.bodies is not None
    assert np.array_equal(np.bincount(frame.bodies)[1:], np.full(particles, spheres))
    overlap = largest_pair_overlap(
        Spheres(frame.positions, frame.radii, group_spheres(frame.bodies))
    ).depth
    assert overlap <= 2 * TIGHT * frame.radii[0] * (1 + 1e-6)  # round-off of the dump
    contacts = list(iterate_contact_frames(result.folder / "out" / "contacts.lammpsdump"))
    assert [frame.step for frame in contacts] == [last - 3, last - 2, last - 1, last]
    assert len(contacts[-1].ids) > particles


@pytest.mark.parametrize(
    ("name", "variables", "message"),
    [
        (
            "dimers.in",
            {"start": "regular", "particles": 2000, "aspect_ratio": 2},
            "no room for a regular",
        ),
        ("dimers.in", {"diameter": 0.7}, "dimers are too long"),
        ("dimers.in", {"diameter": 0.2}, "no room"),
        ("clusters.in", {"extent": 5}, "too large for the container"),
        ("clusters.in", {"shape": "missing.txt"}, "missing.txt"),
    ],
)
def test_wrong_parameters(
    name: str, variables: dict[str, object], message: str, refused: Callable[..., str]
) -> None:
    """One line says what is wrong and what is allowed."""
    assert message in refused(deck(name), variables=variables)
