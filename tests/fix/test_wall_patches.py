"""The closed forms of distances to patches, against brute force over samples of the surface."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.helpers.wall_patches import (
    Disc,
    FloatArray,
    Motion,
    Parallelogram,
    Part,
    Patch,
    Plane,
    Side,
    Sphere,
    Wall,
    cone,
    plane,
    prism,
    sphere,
)

TILTED = np.array([2.0, -1.0, 2.0]) / 3
PATCHES: dict[str, Patch] = {
    "rectangle": Parallelogram(
        np.array([0.1, 0, 0.2]), np.array([0.7, 0, 0]), np.array([0, 0.5, 0])
    ),
    "parallelogram": Parallelogram(
        np.array([0.1, 0, -0.2]), np.array([0.7, 0.1, 0]), np.array([0.4, 0.5, 0.3])
    ),
    "plane": Plane(np.array([0.1, 0.2, 0.1]), TILTED),
    "disc": Disc(np.array([0.1, 0.2, -0.1]), TILTED, 0.6),
    "cylinder": Side(np.array([0.1, -0.2, 0.0]), TILTED, 0.8, 0.4, 0.4),
    "cone": Side(np.array([0.1, -0.2, 0.0]), np.eye(3)[1], 0.8, 0.5, 0.2),
    "tip": Side(np.array([0.1, -0.2, 0.0]), np.eye(3)[0], 0.8, 0.0, 0.5),
    "sphere": Sphere(np.array([0.1, -0.2, 0.0]), 0.5),
}


def least_distance(patch: Patch, point: FloatArray) -> float:
    """Search for the nearest place of a patch on finer and finer grids of its parameters."""
    count = 31
    window, best = np.full(2, 0.5), np.full(2, 0.5)
    distance = np.inf
    for _ in range(18):
        axes = [
            best[k] + window[k] * np.linspace(-1, 1, count)
            if patch.periodic[k]
            else np.clip(best[k] + window[k] * np.linspace(-1, 1, count), 0, 1)
            for k in range(2)
        ]
        u, v = (grid.ravel() for grid in np.meshgrid(*axes))
        distances = np.linalg.norm(patch.at(u, v) - point, axis=1)
        k = int(distances.argmin())
        distance, best = float(distances[k]), np.array([u[k], v[k]])
        window *= 0.4  # several spacings to either side
    return distance


@pytest.mark.parametrize("name", PATCHES)
def test_nearest_places_are_the_nearest(name: str) -> None:
    patch = PATCHES[name]
    points = np.random.default_rng(3).uniform(-1, 1, (60, 3))
    places, rim = patch.nearest(points)
    found = np.linalg.norm(points - places, axis=1)
    expected = [least_distance(patch, point) for point in points]
    # The last grid has a spacing of 1e-8; a nearest place may be missed by some of them.
    assert found == pytest.approx(expected, abs=1e-6)
    if name in ("plane", "sphere"):
        assert not rim.any()
    else:
        assert 5 < rim.sum() < 60
    # A nearest place is on the patch.
    again, _ = patch.nearest(places)
    assert again == pytest.approx(places, abs=1e-14)  # round-off of numbers of order 1


@pytest.mark.parametrize("name", PATCHES)
def test_from_centres_and_axes(name: str) -> None:
    """Where all directions are as near, one of them is taken."""
    patch = PATCHES[name]
    corner = getattr(patch, "centre", getattr(patch, "base", np.zeros(3)))
    axis = getattr(patch, "axis", TILTED)
    points = corner + np.outer([0, 0.1, 0.5, 1, -1], axis)
    places, _ = patch.nearest(points)
    expected = [least_distance(patch, point) for point in points]
    assert np.linalg.norm(points - places, axis=1) == pytest.approx(expected, abs=1e-6)  # as above


BOX = ((-0.5, 0.4), (-0.3, 0.5), (-0.4, 0.4))
SOLIDS: dict[str, Callable[..., Part]] = {
    "block": lambda **more: prism(BOX, **more),
    "prism": lambda **more: prism(BOX, (0.3, -0.2, 0.25), **more),
    "sphere": lambda **more: sphere((0.1, 0, 0.1), 0.6, **more),
    "plane": lambda **more: plane((0.1, 0, 0.1), (1, 2, -1), **more),
    "cylinder": lambda **more: cone("x", (0.1, 0), (0.4, 0.4), (-0.5, 0.5), **more),
    "cone": lambda **more: cone("y", (0.1, 0), (0.5, 0.2), (-0.5, 0.5), **more),
    "tip": lambda **more: cone("z", (0.1, 0), (0, 0.5), (-0.5, 0.5), **more),
}
TURNING = Motion((0.1, 0.2, -0.1), 3.0, 2.0, (1, 1, 2), (0.2, 0, 0.1))


def assert_watertight(wall: Wall, time: float = 0.0) -> None:
    """Whoever leaves what is allowed passes a patch, or the edge of one."""
    random = np.random.default_rng(5)
    start = random.uniform(-0.9, 0.9, (40_000, 3))
    step = random.normal(0, 0.03, start.shape)
    before, after = (wall.allowed(x, time) > 0 for x in (start, start + step))
    leaves = before & ~after
    assert leaves.sum() > 100
    length = np.linalg.norm(step, axis=1)
    distance = wall.seen(start, time).distance.min(axis=0)
    # Round-off of coordinates of order 1
    assert (distance[leaves] <= length[leaves] + 1e-12).all()
    # Nobody leaves who is farther away than the step is long.
    assert after[before & (distance > length + 1e-12)].all()


@pytest.mark.parametrize("outside", [False, True])
@pytest.mark.parametrize("motion", [Motion(), TURNING], ids=["at rest", "turning"])
@pytest.mark.parametrize("name", SOLIDS)
def test_patches_enclose_the_solid(name: str, motion: Motion, outside: bool) -> None:
    assert_watertight(Wall((SOLIDS[name](motion=motion, outside=outside),)), time=0.4)


def test_intersections_and_unions_are_closed() -> None:
    ball, box = SOLIDS["sphere"](motion=TURNING), SOLIDS["block"]()
    # From inside an intersection, and from outside a union, its edges are never nearest.
    assert_watertight(Wall((ball, box), "intersect"), time=0.4)
    assert_watertight(Wall((SOLIDS["sphere"](), SOLIDS["prism"]()), "intersect"))
    assert_watertight(Wall((ball, box), "union", outside=True), time=0.4)


@pytest.mark.parametrize("joined", ["union", "intersect"])
def test_samples_of_a_joined_wall_are_on_it(joined: str) -> None:
    parts = SOLIDS["sphere"](motion=TURNING), SOLIDS["block"]()
    wall = Wall(parts, joined)
    samples = np.concatenate(wall.samples(0.4))
    assert len(samples) > 1000
    # Round-off of coordinates of order 1, times the size of a block
    assert wall.allowed(samples, 0.4) == pytest.approx(0, abs=1e-9)
    assert wall.seen(samples, 0.4).distance.min(axis=0) == pytest.approx(0, abs=1e-9)


def test_the_faces_that_are_open() -> None:
    at_rest = np.zeros((1, 3))
    for face in range(1, 7):
        walls = [prism(BOX, (0.3, 0, 0), open_faces=(face,)), prism(BOX, (0.3, 0, 0))]
        distances = [Wall((wall,)).seen(at_rest).distance[:, 0].tolist() for wall in walls]
        del distances[1][face - 1]
        assert distances[0] == distances[1]
    # The lower cap, the upper one, the side
    whole = [0.5, 0.4, 0.3]
    for face in (1, 2, 3):
        tube = cone("y", (0, 0), (0.3, 0.3), (-0.5, 0.4), open_faces=(face,))
        expected = [distance for k, distance in enumerate(whole, 1) if k != face]
        assert Wall((tube,)).seen(at_rest).distance[:, 0] == pytest.approx(expected, abs=1e-15)


def test_a_motion_turns_first_and_is_undone() -> None:
    motion = Motion((1, 0, 0), np.pi / 2, np.pi / 2, (0, 0, 1), (0, 1, 0))
    # About (0, 1, 0) by a quarter turn: (1, 1, 0) goes to (0, 2, 0), then by 1 along x.
    moved = motion.forth(np.array([[1.0, 1.0, 0.0]]), 1.0)
    assert moved == pytest.approx(np.array([[1.0, 2.0, 0.0]]), abs=1e-15)
    points = np.random.default_rng(1).normal(size=(20, 3))
    assert TURNING.back(TURNING.forth(points, 0.7), 0.7) == pytest.approx(points, abs=1e-14)
