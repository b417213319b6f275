"""Packing fraction against the distance from a wall."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    InputError,
    Particles,
    Spheres,
    exact_packing_fraction,
    group_spheres,
    mueller_packing_fraction,
    wall_profile,
    wall_profile_monte_carlo,
)
from lammps_inelastic.analysis.geometry import FloatArray

WALLS = ["xlo", "xhi", "ylo", "yhi", "zlo", "zhi"]


def random_dimers(
    count: int, radius: float, distance: float, seed: int
) -> tuple[FloatArray, FloatArray, Particles]:
    generator = np.random.default_rng(seed)
    centres = generator.uniform(0, 1, (count, 3))
    arms = generator.normal(size=(count, 3))
    arms *= distance / 2 / np.linalg.norm(arms, axis=1)[:, None]
    numbers = np.arange(1, count + 1)
    positions = np.vstack([centres - arms, centres + arms])
    return positions, np.full(2 * count, radius), group_spheres(np.r_[numbers, numbers])


def test_one_sphere_at_the_wall() -> None:
    radius = 0.1
    found = wall_profile(
        Spheres([[0.1, 0.5, 0.5]], [radius]),
        [[0, 0.25], [0, 1], [0, 1]],
        wall="xlo",
        thickness=0.01,
    )
    assert len(found.values) == 25
    # A product of two.
    assert found.distances == pytest.approx(np.arange(0.005, 0.25, 0.01), rel=1e-14)
    assert found.scaled == pytest.approx(found.distances / 0.2, rel=1e-14)
    # Between two planes, a ball has pi (r^2 x - x^3 / 3).
    planes = np.clip(np.arange(26) * 0.01 - 0.1, -radius, radius)
    volumes = np.diff(np.pi * (radius**2 * planes - planes**3 / 3))
    # Rounding of terms of 0.004, over slabs of 0.01.
    assert found.values == pytest.approx(volumes / 0.01, abs=1e-14)
    assert found.uncertainties is None


@pytest.mark.parametrize("wall", WALLS)
def test_slabs_are_boxes(wall: str) -> None:
    positions, radii, dimers = random_dimers(60, 0.15, 0.2, seed=1)
    box = np.array([[0.1, 0.5], [0.2, 0.9], [-0.1, 0.45]])
    found = wall_profile(
        Spheres(positions, radii, dimers), box, wall=wall, thickness=0.06, diameter=0.5
    )
    axis, upper = "xyz".index(wall[0]), wall[1:] == "hi"
    assert len(found.values) == int((box[axis, 1] - box[axis, 0]) / 0.06)
    assert found.scaled == pytest.approx(found.distances / 0.5, rel=1e-14)
    for distance, value in zip(found.distances, found.values, strict=True):
        slab = box.copy()
        middle = box[axis, 1] - distance if upper else box[axis, 0] + distance
        slab[axis] = middle - 0.03, middle + 0.03
        # The bounds of the slab, and so the volume, differ by rounding.
        expected = exact_packing_fraction(Spheres(positions, radii, dimers), slab).value
        assert value == pytest.approx(expected, rel=1e-12)


def test_slabs_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    positions, radii, dimers = random_dimers(200, 0.1, 0.15, seed=2)
    box = [[0, 0.5], [0.25, 0.75], [0.25, 0.75]]
    whole = exact_packing_fraction(Spheres(positions, radii, dimers), box).value
    usual = wall_profile(Spheres(positions, radii, dimers), box, wall="xlo", thickness=0.005)
    assert len(usual.values) == 100
    # The volumes of 400 pieces in 100 slabs, each rounded at 1e-18.
    assert usual.values.mean() == pytest.approx(whole, rel=1e-12)
    # Small groups give the same.
    monkeypatch.setattr("lammps_inelastic.analysis.profile.PAIRS", 100)
    grouped = wall_profile(Spheres(positions, radii, dimers), box, wall="xlo", thickness=0.005)
    assert grouped.values == pytest.approx(usual.values, rel=1e-12)


@pytest.mark.parametrize("wall", ["xlo", "yhi"])
def test_random_points(wall: str) -> None:
    # On a grid, so that no dimers overlap.
    grid = (np.mgrid[:5, :5, :5].reshape(3, -1).T + 0.5) / 5
    arms = np.random.default_rng(3).normal(size=grid.shape)
    arms *= 0.03 / np.linalg.norm(arms, axis=1)[:, None]
    positions, radii = np.vstack([grid - arms, grid + arms]), np.full(250, 0.06)
    dimers = group_spheres(np.tile(np.arange(1, 126), 2))
    box = [[0, 0.3], [0.1, 1], [0, 0.5]]
    exact = wall_profile(Spheres(positions, radii, dimers), box, wall=wall, thickness=0.05)
    measured = wall_profile_monte_carlo(
        Spheres(positions, radii), box, wall=wall, thickness=0.05, points=50_000
    )
    assert (measured.distances == exact.distances).all()
    assert (measured.scaled == exact.scaled).all()
    # The seed is fixed; four standard deviations in any of 18 slabs are passed by chance once in
    # 800 seeds.
    assert (abs(measured.values - exact.values) < 4 * measured.uncertainties).all()
    # Each slab has points of its own: no two deviations are alike.
    deviations = (measured.values - exact.values) / measured.uncertainties
    assert len(np.unique(deviations.round(6))) == len(deviations)


def test_thickness_of_the_paper() -> None:
    # 0.25 / 0.005 and 0.3 / 0.1 are not whole numbers in floating point.
    one = [[0.1, 0.5, 0.5]]
    box = [[0, 0.25], [0.25, 0.75], [0.25, 0.75]]
    assert len(wall_profile(Spheres(one, [0.1]), box, wall="xlo", thickness=0.005).values) == 50
    box[0] = [0, 0.3]
    assert len(wall_profile(Spheres(one, [0.1]), box, wall="xlo", thickness=0.1).values) == 3
    box[0] = [0, 0.39]
    assert len(wall_profile(Spheres(one, [0.1]), box, wall="xlo", thickness=0.1).values) == 3


def test_many_dimers_are_fast() -> None:
    positions, radii, dimers = random_dimers(10_000, 0.026, 0.04, seed=4)
    box = [[0, 0.25], [0.25, 0.75], [0.25, 0.75]]
    begin = time.process_time()
    wall_profile(Spheres(positions, radii, dimers), box, wall="xlo", thickness=0.005)
    # 0.1 s on one old core; a loop over the pairs of dimer and slab takes minutes.
    assert time.process_time() - begin < 5


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"wall": "left"}, "a wall must be one of xlo, xhi, ylo, yhi, zlo, zhi, not left"),
        ({"thickness": 0}, "thicker than 0 and fit into the box's 1 along y, not 0"),
        ({"thickness": 1.1}, "fit into the box's 1 along y, not 1.1"),
        ({"diameter": -1}, "a diameter must be positive and finite, not -1"),
        (
            {"spheres": Spheres(np.eye(2, 3), [1, 2])},
            "the spheres differ in size: say which diameter",
        ),
        ({"box": [[0, 1]]}, r"a box must have shape \(3, 2\)"),
    ],
)
def test_wrong_input(changes: dict[str, Any], message: str) -> None:
    usual = {"spheres": Spheres(np.eye(2, 3), [1, 1]), "box": [[0, 1]] * 3}
    with pytest.raises(InputError, match=message):
        wall_profile(**(usual | {"wall": "ylo", "thickness": 0.1} | changes))
    with pytest.raises(InputError, match=message):
        wall_profile_monte_carlo(**(usual | {"wall": "ylo", "thickness": 0.1} | changes))


def test_mueller_wide() -> None:
    assert mueller_packing_fraction(0) == 0
    # exp(-0.315 s) is 2e-14 at s = 100.
    assert mueller_packing_fraction([100]) == pytest.approx([0.635], abs=1e-13)
    distances = np.linspace(0, 1, 1001)
    values = mueller_packing_fraction(distances)
    # Spheres at the wall are half a diameter from it. J0 is lowest at 3.83 = 7.45 * 0.514.
    assert distances[values.argmax()] == pytest.approx(0.51, abs=0.01)
    # 1 - 0.365 + 0.635 * 0.4028 * exp(-0.315 * 0.514): the lowest value of J0 is -0.4028.
    assert values.max() == pytest.approx(0.853, abs=0.001)


def test_mueller_narrow() -> None:
    # By hand: D/d = 10, s = 1. a = 7.135, b = 0.2425, e_b = 0.387. J0(7.135) = 0.29799.
    expected = 1 - 0.387 - 0.613 * 0.29799 * np.exp(-0.2425)
    # J0 is given to five digits.
    assert mueller_packing_fraction(1, 10) == pytest.approx(expected, abs=1e-5)
    # D/d = 20, s = 1. a = 6.8875, b = 0.27875, e_b = 0.376. J0(6.8875) = 0.29764.
    expected = 1 - 0.376 - 0.624 * 0.29764 * np.exp(-0.27875)
    assert mueller_packing_fraction(1, 20) == pytest.approx(expected, abs=1e-5)
    # D/d = 1e9 is as good as infinity: the difference is about ten times d/D.
    distances = np.linspace(0, 5, 30)
    assert mueller_packing_fraction(distances, 1e9) == pytest.approx(
        mueller_packing_fraction(distances), abs=1e-7
    )


def test_mueller_wrong_input() -> None:
    with pytest.raises(InputError, match=r"cylinders of D/d >= 2.02, not 2"):
        mueller_packing_fraction(1, 2)
    with pytest.raises(InputError, match="must not be negative or NaN"):
        mueller_packing_fraction([0, -1])
