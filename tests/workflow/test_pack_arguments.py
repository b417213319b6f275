"""`pack` refuses what cannot be packed with one line, before anything runs; sizes and places."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from lammps_inelastic.workflow import Ball, Box, Cluster, Cylinder, Dimer, Sphere, pack
from lammps_inelastic.workflow.errors import PackingError
from lammps_inelastic.workflow.packing.containers import as_container
from lammps_inelastic.workflow.packing.shapes import volume_of
from lammps_inelastic.workflow.packing.sizes import diameters_of
from lammps_inelastic.workflow.packing.start import write_start
from lammps_inelastic.workflow.running.processes import cores

MISTAKES: list[tuple[dict[str, Any], str]] = [
    ({"particles": 0}, "particles must be a whole number of at least 1, not 0"),
    ({"particles": -5}, "particles must be a whole number of at least 1, not -5"),
    ({"particles": 1e4}, "particles must be a whole number of at least 1, not 10000.0"),
    ({"particles": "many"}, "particles must be a whole number of at least 1, not 'many'"),
    ({"particles": True}, "particles must be a whole number of at least 1, not True"),
    ({"shape": "dimer"}, "shape must be Sphere(), Dimer(aspect_ratio) or Cluster(centres), not 'd"),
    ({"shape": Sphere}, "shape must be Sphere(), Dimer(aspect_ratio) or Cluster(centres), not <cl"),
    ({"container": (1, 1, 5)}, "container must be Box(width, depth, height), Cylinder("),
    ({"container": Box(0.1)}, "is too narrow: to be placed in any direction the largest of these"),
    ({"container": Cylinder(0.2), "shape": Dimer(2)}, "needs more than 0.22 along each side"),
    ({"container": Ball(0.3)}, "no room: 100 spheres would fill 4.93 of a ball of diameter 0.3"),
    ({"container": Box(1, 1, 0.1)}, "a box of 1 x 0.1 x 1 is too narrow"),
    ({"container": Box(1e3, 1e3, 1e3)}, "is too large for these sizes: it has room for 7.5e+11"),
    ({"sizes": 0}, "sizes must be a positive number, not 0"),
    ({"sizes": -1.0}, "sizes must be a positive number, not -1.0"),
    ({"sizes": float("nan")}, "sizes must be a positive number, not nan"),
    ({"sizes": "0.1"}, "sizes must be a diameter, a list of diameters, pairs of a diameter and"),
    ({"sizes": [0.1] * 99}, "sizes has 99 diameters, but there are 100 particles"),
    ({"sizes": [0.1] * 99 + [0.0]}, "a diameter in sizes must be positive, not 0"),
    ({"sizes": [0.1] * 99 + [np.inf]}, "a diameter in sizes must be positive, not inf"),
    ({"sizes": [0.1] * 99 + [10.0]}, "from 0.1 to 10 differ 100 times; at most 20 times are"),
    ({"sizes": [(1, 0.5), (2, 0.4)]}, "shares in sizes must be from 0 to 1 and add up to 1, not"),
    ({"sizes": [(1, 1.5), (2, -0.5)]}, "shares in sizes must be from 0 to 1 and add up to 1, not"),
    ({"sizes": [(1, 2, 3)] * 100}, "sizes must be a diameter, 100 diameters, pairs of a diameter"),
    ({"sizes": [[1], [2, 3]]}, "sizes must be a diameter, a list of diameters, pairs of"),
    ({"sizes": lambda random, count: 1.0}, "or a distribution of that many diameters, not 1.0"),
    ({"sizes": stats.norm(1, 1)}, "a diameter in sizes must be positive, not -"),
    ({"sizes": None}, "sizes must be a diameter, a list of diameters, pairs of"),
    ({"seed": 0}, "seed must be a whole number from 1 to 800000000, not 0"),
    ({"seed": 1.5}, "seed must be a whole number from 1 to 800000000, not 1.5"),
    ({"tolerance": 0}, "tolerance must be from 1e-10 to 0.1 radii, not 0"),
    ({"tolerance": 0.5}, "tolerance must be from 1e-10 to 0.1 radii, not 0.5"),
    ({"density": 0}, "density must be a positive number, not 0"),
    ({"gravity": [9.81, 0]}, "gravity must be a positive number, not [9.81, 0]"),
    ({"ranks": 0}, f"ranks must be from 1 to {cores()}, the number of cores here, not 0"),
    ({"ranks": 10_000}, f"ranks must be from 1 to {cores()}, the number of cores here, not 10000"),
    ({"folder": "."}, "is there already; name a folder that is not"),
]


@pytest.mark.parametrize(("arguments", "message"), MISTAKES)
def test_mistakes_are_told_in_one_line(
    arguments: dict[str, Any],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Nothing is printed or written."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(PackingError) as caught:
        pack(**{"particles": 100, **arguments})
    (line,) = str(caught.value).splitlines()
    assert message in line
    assert len(line) < 250
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []


# Arguments of other types than those that mypy allows.
NONE: Any = None
WORD: Any = "long"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Box(0), "the width of a container must be a positive number, not 0"),
        (lambda: Box(1, -1), "the depth of a container must be a positive number, not -1"),
        (lambda: Box(WORD), "the width of a container must be a positive number, not 'long'"),
        (lambda: Box(NONE), "the width of a container must be a positive number, not None"),
        (lambda: Cylinder(1, float("inf")), "the height of a container must be a positive number"),
        (lambda: Cylinder(-1), "the diameter of a container must be a positive number, not -1"),
        (lambda: Ball(1e40), "the diameter of a container must be a positive number, not 1e+40"),
        (lambda: Dimer(1), "must be above 1: 1 is that of Sphere()"),
        (lambda: Dimer(2.5), "must be above 1 and at most 2, not 2.5"),
        (lambda: Dimer(WORD), "must be above 1 and at most 2, not 'long'"),
        (lambda: Cluster([[0, 0, 0]]), "must be two or more points x, y, z, in diameters, not"),
        (lambda: Cluster([[0, 0], [1, 1]]), "must be two or more points x, y, z, in diameters"),
        (lambda: Cluster("tetrahedron"), "must be two or more points x, y, z, in diameters"),
        (lambda: Cluster([[0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]]), "must be finite, and below 1000"),
        (lambda: Cluster([[0, 0, 0], [0, 0, 0]]), "must not have the same centre"),
    ],
)
def test_shapes_and_containers_refuse_what_is_none(make: Any, message: str) -> None:
    with pytest.raises(PackingError) as caught:
        make()
    (line,) = str(caught.value).splitlines()
    assert message in line


def drawn(sizes: Any, count: int) -> Any:
    return diameters_of(sizes, count, np.random.default_rng(1))


def test_sizes_of_every_kind() -> None:
    assert drawn(2, 3).tolist() == [2, 2, 2]
    assert drawn([3, 1, 2.5], 3).tolist() == [3, 1, 2.5]
    assert drawn(np.array([3.0, 1.0]), 2).tolist() == [3, 1]
    # Of two particles a pair of numbers is two diameters, not a diameter and its share.
    assert drawn([0.5, 0.5], 2).tolist() == [0.5, 0.5]
    assert Counter(drawn([(1, 0.5), (2, 0.3), (5, 0.2)], 10).tolist()) == {1: 5, 2: 3, 5: 2}
    # 3.33, 3.33 and 3.34 of ten: one of them is four, and they are ten.
    assert sorted(Counter(drawn([(1, 0.333), (2, 0.333), (3, 0.334)], 10)).values()) == [3, 3, 4]
    uniform = drawn(lambda random, count: random.uniform(1, 2, count), 1000)
    assert (uniform >= 1).all()
    assert (uniform < 2).all()
    frozen = drawn(stats.uniform(1, 1), 1000)
    # The mean of 1,000 numbers with a deviation of 1/sqrt(12) is within five standard errors.
    assert frozen.mean() == pytest.approx(1.5, abs=5 / np.sqrt(12 * 1000))
    assert np.array_equal(frozen, drawn(stats.uniform(1, 1), 1000))


def test_the_usual_container_is_that_of_the_decks() -> None:
    """1 x 5 x 1 for 1,000 spheres of 0.11, in any unit of length; else it has as much room."""
    sphere = Sphere()
    usual = as_container(None, volume_of(sphere, np.full(1000, 0.11)), 0.11)
    assert usual == Box(1.0, 1.0, 5.0)
    scaled = as_container(None, volume_of(sphere, np.full(1000, 110.0)), 110.0)
    # Round-off.
    assert np.allclose(scaled.bounds, np.array([[0, 1e3], [0, 5e3], [0, 1e3]]), rtol=1e-12)
    narrow = as_container(Cylinder(2.0), 100.0, 1.0)
    # The share of the container that the decks' spheres fill.
    assert 100.0 / narrow.volume == pytest.approx(1000 * np.pi / 6 * 0.11**3 / 5, rel=1e-12)
    assert as_container(Box(100.0), 100.0, 1.0).height == 5.0
    assert as_container(Box(1.0, height=7.0), 100.0, 1.0) == Box(1.0, 1.0, 7.0)


def test_the_volume_of_a_cluster() -> None:
    """Two spheres have that of two without the lens in which they overlap."""
    apart, near = (Cluster([[0.0, 0.0, 0.0], [0.0, 0.0, z]]) for z in (1.5, 0.7))
    lens = np.pi * 2.7 * 0.3**2 / 12
    # Five standard errors of a million random points.
    assert apart.volume == pytest.approx(np.pi / 3, rel=0.005)
    assert near.volume == pytest.approx(np.pi / 3 - lens, rel=0.005)
    assert Cluster().extent == pytest.approx(0.7, rel=1e-8)


CORNER = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
CONTAINERS = [Box(4.0, 3.0, 7.0), Cylinder(5.0, 9.0), Ball(6.0)]


def outside(container: Box | Cylinder | Ball, points: Any, radii: Any) -> Any:
    """How far spheres reach beyond the walls, by formulas of their own."""
    x, y, z = points.T
    if isinstance(container, Ball):
        return np.sqrt(x**2 + y**2 + z**2) + radii - container.diameter / 2
    low, high = radii - y, y + radii - container.height
    if isinstance(container, Cylinder):
        return np.max([low, high, np.sqrt(x**2 + z**2) + radii - container.diameter / 2], axis=0)
    sides = [radii - x, x + radii - container.width, radii - z, z + radii - container.depth]
    return np.max([low, high, *sides], axis=0)


@pytest.mark.parametrize("container", CONTAINERS)
@pytest.mark.parametrize("shape", [Sphere(), Dimer(1.8), Cluster(CORNER)])
def test_starts_lie_inside_and_everywhere(container: Any, shape: Any, tmp_path: Path) -> None:
    """Of several sizes: each where it fits, as often in each half, bodies whole and turned."""
    diameters = np.tile([0.1, 0.3, 0.6], 500)
    random = np.random.default_rng(1)
    write_start(tmp_path / "start", shape, diameters, container, 2.0, random)
    rows = np.loadtxt(tmp_path / "start", skiprows=10)
    each = len(shape.points)
    assert len(rows) == 1500 * each
    # Of one sphere the columns are diameter, density, place; of bodies place, diameter, density.
    at_size, at_place = (2, 4) if each == 1 else (5, 2)
    size, density = rows[:, at_size : at_size + 2].T
    places = rows[:, at_place : at_place + 3]
    assert np.array_equal(size, np.repeat(diameters, each))
    assert (density == 2).all()
    # Round-off of lengths of 10.
    assert outside(container, places, size / 2).max() < 1e-14
    middle = container.bounds.mean(axis=1)
    bodies = places.reshape(1500, each, 3)
    # 1,500 throws of a coin are within five standard deviations of a half.
    share = (bodies.mean(axis=1) > middle).mean(axis=0)
    assert np.abs(share - 0.5).max() < 5 / np.sqrt(4 * 1500)
    if each > 1:
        assert np.array_equal(rows[:, 7], np.repeat(np.arange(1, 1501), each))
        arm = (bodies[:, 1] - bodies[:, 0]) / diameters[:, None]
        length = np.linalg.norm(shape.points[1] - shape.points[0])
        assert np.allclose(np.linalg.norm(arm, axis=1), length, rtol=1e-12)
        # Directions have no mean: five standard errors of components with a variance of 1/3.
        assert np.abs(arm.mean(axis=0)).max() < 5 * length / np.sqrt(3 * 1500)


@pytest.mark.parametrize("container", CONTAINERS)
def test_distances_to_walls(container: Any) -> None:
    points = container.draw(np.full(1000, 0.1), np.random.default_rng(2))
    # Round-off of lengths of 10.
    assert np.allclose(
        container.distances(points), -outside(container, points, 0.0 * points[:, 0]), atol=1e-14
    )
    for box in container.columns:
        corners = np.array(np.meshgrid(*box)).reshape(3, -1).T
        assert outside(container, corners, np.zeros(8)).max() < 1e-12
