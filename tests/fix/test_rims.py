"""Rims and tips of cones stop what slides or falls; walls that LAMMPS shows wrong are refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.exact_scenes import path, spheres_of
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import DUMP_PARTICLES

EPS, RIM = 1e-4, 1.5  # the sphere's radius is 0.5


def sliding(folder: Path, table: str, regions: str = "table") -> str:
    """Return a deck in which a sphere slides off a table at y = 0 whose top is a cap."""
    return spheres_of(
        [1.0, 0.5, 0.0],
        folder,
        velocities=[1.0, 0.0, 0.0],
        tolerance=EPS,
        timestep=0.005,
        setup="",
        fixes=f"{table}\n",
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
    ("radii", "place"),
    [((0.0, 1.0), (0.2, -0.6, 0.1)), ((1.0, 0.0), (0.2, 2.6, 0.1))],
    ids=["lower", "upper"],
)
@pytest.mark.parametrize("shrinking", [False, True])
def test_a_sphere_falls_on_the_tip_of_a_cone(
    radii: tuple[float, float],
    place: tuple[float, float, float],
    shrinking: bool,
    tmp_path: Path,
    lmp: Runner,
) -> None:
    """The tip points at the sphere, which comes a little beside the axis and slides off."""
    command = f"region table cone y 0 0 {radii[0]} {radii[1]} 0 2 side out"
    if shrinking:  # to a tip, while the sphere is on its way
        sizes = [f"v_size{k}" if radius == 0 else radius for k, radius in enumerate(radii)]
        command = (
            f"variable size{radii.index(0.0)} equal 1e-12*(step<5)\n"
            f"region table cone y 0 0 {sizes[0]} {sizes[1]} 0 2 side out"
        )
    deck = spheres_of(
        place,
        tmp_path,
        velocities=[0.0, 1.0 if radii[0] == 0 else -1.0, 0.0],
        tolerance=EPS,
        timestep=0.005,
        gravity=False,
        setup="",
        fixes=f"{command}\n",
        options="region table shorten yes",
    )
    lmp(deck + DUMP_PARTICLES + "run 400\n")
    places = path(tmp_path)[:, 0, :3]
    along = places[:, 1] if radii[0] == 0 else 2 - places[:, 1]
    away = np.linalg.norm(places[:, [0, 2]], axis=1)
    # The side goes from (0, 0) to (1, 2) in the plane of the axis and the sphere.
    part = np.clip((away + 2 * along) / 5, 0, 1)
    distance = np.hypot(away - part, along - 2 * part)
    assert distance.min() >= 0.5 - 2 * EPS  # what the page promises at curved walls
    assert (distance < 0.5 + 2 * EPS).sum() > 3  # it touched


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("end", [0.0, 4.0], ids=["lower", "upper"])
@pytest.mark.parametrize("aside", [-0.4, 0.4])
def test_a_sphere_flies_against_the_cap_of_a_cone_in_a_union(
    axis: str, end: float, aside: float, tmp_path: Path, lmp: Runner
) -> None:
    """The cap belongs to the union where the sphere is; a ball is beside the sphere."""
    k = "xyz".index(axis)
    across = [d for d in range(3) if d != k]
    away = 1.0 if end == 0 else -1.0
    start, velocity, ball = np.zeros((3, 3))
    start[k], start[across[1]] = end + 0.8 * away, aside
    velocity[k] = -away
    # Half the sphere's radius farther than its surface, and so far into the cone
    ball[k], ball[across[1]] = end + 0.5 * away, 5 * aside
    deck = spheres_of(
        start,
        tmp_path,
        velocities=velocity,
        tolerance=EPS,
        timestep=0.005,
        gravity=False,
        setup="",
        fixes=f"region cone cone {axis} 0 0 2 2 0 4\n"
        f"region ball sphere {ball[0]} {ball[1]} {ball[2]} 1.2\n"
        "region table union 2 cone ball\n",
        options="region table shorten yes",
    )
    lmp(deck + DUMP_PARTICLES + "run 100\n")
    height = np.abs(path(tmp_path)[:, 0, k] - end)
    assert height.min() >= 0.5 - 2 * EPS  # what the page promises at unions
    assert height[-1] < 0.5 + 2 * EPS


def test_a_cone_pushes_where_it_grows_to(tmp_path: Path, lmp: Runner) -> None:
    """A radius of 0.2 grows to 1.7, a reach of LAMMPS from the first one and more."""
    deck = spheres_of(
        [1.5, 0.0, 0.0],
        tmp_path,
        tolerance=EPS,
        timestep=0.005,
        gravity=False,
        setup="",
        fixes="variable size equal 0.2+time\nregion table cone y 0 0 v_size v_size -2 2 side out\n",
        options="region table",
    )
    lmp(deck + DUMP_PARTICLES + "run 300\n")
    place = path(tmp_path)[-1, 0, :3]
    assert np.linalg.norm(place[[0, 2]]) >= 1.7 + 0.5 - EPS  # exact outside an obstacle


ROOM = "region room block -9 9 -9 9 -9 9\n"
OPEN = " ".join(f"open {face}" for face in range(1, 7))
# What LAMMPS shows wrong: the command, and what the error must say beside the names
WRONG = {
    "open-cylinder": (f"cylinder y 0 0 {RIM} 0 6 open 3", "cylinder with an open side"),
    "ellipsoid": ("ellipsoid 0 0 0 2 3 4", "ellipsoid"),
    "endless-cone": ("cone y 0 0 1 1 INF 0", "cone with an end at infinity"),
    "endless-cone-out": ("cone x 0 0 1 2 -3 INF side out", "cone with an end at infinity"),
    "endless-open-cone": ("cone z 0 0 1 1 INF INF open 1", "cone with an end at infinity"),
    "endless-open-block": ("block -9 9 INF INF -9 -1 open 6", "block with open faces"),
    "endless-open-block-out": ("block -9 INF 0 1 0 0 side out open 1", "block with open faces"),
    "endless-prism-out": ("prism -9 9 INF INF -9 -1 0 1 0 side out", "prism with faces"),
    "prism-without-a-lower-face": ("prism -9 9 INF 9 -9 9 0 0 0", "prism with faces"),
    "open-faces-alone": (f"block 0 1 0 1 0 1 {OPEN}", "all faces open"),
    "a-tip-and-open-faces": ("cone y 0 0 0 1 0 1 open 2 open 3", "all faces open"),
}


@pytest.mark.parametrize("name", WRONG)
def test_walls_that_lammps_shows_wrong_are_refused(
    name: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    shape, said = WRONG[name]
    error = refused(sliding(tmp_path, f"region table {shape}") + "run 1\n")
    assert said in error
    assert "region table is" in error


@pytest.mark.parametrize("how", ["union", "intersect"])
@pytest.mark.parametrize(
    "name", ["open-cylinder", "ellipsoid", "endless-cone", "endless-open-block"]
)
def test_so_they_are_as_parts_of_others(
    how: str, name: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    shape, said = WRONG[name]
    table = f"region part {shape}\n{ROOM}region table {how} 2 part room"
    error = refused(sliding(tmp_path, table) + "run 1\n")
    assert said in error
    assert "region part, a part of region table, is" in error


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("region table union 2 part room side out", "union seen from outside"),
        ("region inner union 2 part room\nregion table intersect 2 inner room side out",
         "region inner, a part of region table, is a union seen from outside"),
        ("region table intersect 2 part room open 1", "with open faces"),
    ],
)  # fmt: skip
def test_joined_regions_that_lammps_shows_wrong_are_refused(
    table: str, said: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    table = f"region part sphere 0 0 0 1\n{ROOM}{table}"
    assert said in refused(sliding(tmp_path, table) + "run 1\n")


@pytest.mark.parametrize(
    "shape",
    [
        "cylinder y 0 0 6 INF INF",
        "cylinder y 0 0 6 INF INF open 1",
        "block INF INF -9 9 INF INF",
        "block INF INF -9 -1 INF INF side out",
        "block -9 9 -9 INF -9 9 open 1 open 2 open 4 open 5 open 6",  # the floor alone
        "prism -9 9 -9 INF INF INF 1 0 0",
        "prism INF INF -9 9 -9 9 0 0 2",
        "cone y 0 0 6 7 -1e5 1e5",
        "cone y 0 0 1e-6 2 -9 -1 side out",
        "cone y 0 0 0 6 -9 9",
        "sphere 0 0 0 6 open 1",
    ],
)
def test_what_lammps_shows_right_serves(shape: str, tmp_path: Path, lmp: Runner) -> None:
    lmp(sliding(tmp_path, f"region table {shape}") + "run 1\n")
