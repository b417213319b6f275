"""The same command gives the same bytes: of dumps, contacts, records and the log's numbers."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import pytest

from tests.helpers.bodies import body_scene, dimer, random_bodies
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import DUMP_CONTACTS, DUMP_FORCES, DUMP_PARTICLES, random_points, scene

RADIUS = 0.06
EPS = 0.0005 * RADIUS
BOX = ((0.0, 0.77), (0.0, 1.0), (0.0, 0.77))
INSIDE = ((0.07, 0.7), (0.07, 0.95), (0.07, 0.7))
SHAKEN = "fix agitation all random/force 5 77"
STEPS = 150


def spheres(folder: Path) -> str:
    """Free spheres on a floor that moves, with two records in files."""
    points = random_points(120, INSIDE, 2 * RADIUS, seed=6)
    return scene(
        points,
        RADIUS,
        folder,
        tolerance=EPS,
        box=BOX,
        setup="variable lift equal 0.02*sin(20*time)\n"
        "region floor plane 0 0 0 0 1 0 move NULL v_lift NULL",
        fixes=SHAKEN,
        options="region container floor record step*.npz every 50",
    )


def dimers(folder: Path, inertia: str) -> str:
    """Dimers and free spheres, with shortened steps."""
    shapes = [dimer(1.5)] * 30 + [[[0, 0, 0]]] * 20
    bodies = random_bodies(shapes, RADIUS, INSIDE, seed=8)
    return body_scene(
        bodies,
        RADIUS,
        folder,
        inertia=inertia,
        tolerance=EPS,
        box=BOX,
        fixes=SHAKEN,
        options="region container shorten yes record step*.npz every 50",
    )


def digest(folder: Path, screen: str) -> dict[str, str]:
    """Return a hash of each file, and of the lines of numbers in the output."""
    files = [*folder.glob("*.dump"), *folder.glob("*.npz")]
    found = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
    table = [line for line in screen.splitlines() if re.match(r"\s*\d+ +[-0-9.e+ ]+$", line)]
    assert len(table) > STEPS
    return found | {"thermo": hashlib.sha256("\n".join(table).encode()).hexdigest()}


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize(
    "kind", ["spheres", pytest.param("point", marks=pytest.mark.slow), "solid"]
)
def test_the_same_bytes_twice(kind: str, ranks: int, tmp_path: Path, lmp: Runner) -> None:
    found = []
    for name in ("one", "other"):
        folder = tmp_path / name
        deck = spheres(folder) if kind == "spheres" else dimers(folder, kind)
        deck += DUMP_PARTICLES + DUMP_CONTACTS + DUMP_FORCES + f"run {STEPS}\n"
        result = lmp(deck, into=name, ranks=ranks)
        assert result.thermo["f_contact[5]"][-1] > 50
        found.append(digest(folder, result.screen))
    assert len(found[0]) == 7
    assert found[0] == found[1]
