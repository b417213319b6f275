"""The rim of a round table stops what slides off it, judged by the geometry of a disc."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.fix.exact_scenes import path, spheres_of
from tests.fix.lammps_run import Runner
from tests.fix.scenes import DUMP_PARTICLES

EPS, RIM = 1e-4, 1.5  # the sphere's radius is 0.5


def sliding(folder: Path, table: str, regions: str = "table") -> str:
    """Return a deck in which a sphere slides off a table at y = 0 whose top is a cap."""
    return spheres_of(
        [1.0, 0.5, 0.0],
        folder,
        velocities=[1.0, 0.0, 0.0],
        tolerance=EPS,
        timestep=0.005,
        setup=f"{table}\n",
        options=f"region {regions} shorten yes",
    )


# Axes along x and z lie in the table.
TABLES = {
    "down": f"region table cone y 0 0 {RIM} {RIM} 0 6 open 2 open 3",
    "up": f"region table cone y 0 0 {RIM} {RIM} -6 0 open 1 open 3",
}


@pytest.mark.parametrize("name", TABLES)
def test_a_sphere_slides_off_a_round_table(name: str, tmp_path: Path, lmp: Runner) -> None:
    lmp(sliding(tmp_path, TABLES[name]) + DUMP_PARTICLES + "run 200\n")
    places = path(tmp_path)[:, 0, :3]
    across = np.linalg.norm(places[:, [0, 2]], axis=1)
    distance = np.hypot(np.maximum(0.0, across - RIM), places[:, 1])
    assert distance.min() >= 0.5 - 2 * EPS
    # It touched the rim, and fell beside it.
    beyond = across > RIM + 1e-3
    assert (distance[beyond] < 0.5 + 2 * EPS).sum() > 3
    assert places[-1, 1] < 0


@pytest.mark.parametrize(
    ("table", "regions"),
    [
        (f"region table cylinder y 0 0 {RIM} 0 6 open 3", "table"),
        (f"region part cylinder z 0 0 {RIM} 0 6 open 1 open 3\nregion room block -9 9 -9 9 -9 9\n"
         "region table union 2 part room", "table"),
        (f"region part cylinder x 0 0 {RIM} 0 6 open 2 open 3\nregion room block -9 9 -9 9 -9 9\n"
         "region table intersect 2 part room", "table"),
        ("region part ellipsoid 0 0 0 2 3 4\nregion room block -9 9 -9 9 -9 9\n"
         "region table union 2 part room", "table"),
    ],
)  # fmt: skip
def test_walls_that_lammps_does_not_show_are_refused(
    table: str, regions: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    error = refused(sliding(tmp_path, table, regions) + "run 1\n")
    shape = table.split()[2]
    assert shape in error
    assert "region table" in error
    assert ("region part" in error) == ("part" in table)
