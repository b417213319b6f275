"""Necks of dimers: the closed forms against integrals, random points against both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from lammps_inelastic.analysis import (
    InputError,
    Particles,
    Spheres,
    dimer_volume,
    group_spheres,
    neck_volume,
    packing_fraction,
    packing_fraction_with_necks,
)
from lammps_inelastic.analysis.geometry import FloatArray

UNIT = [[0, 1]] * 3


@pytest.mark.parametrize("distance", [0.01, 0.2, 0.6, 1.0, 1.7, 2.0])
def test_volume_is_the_integral_of_rings(distance: float) -> None:
    radius = 1.0
    circle = np.sqrt(4 * radius**2 - distance**2 / 4)

    def ring(z: float) -> float:
        torus = circle - np.sqrt(radius**2 - z**2)
        return np.pi * (torus**2 - (radius**2 - (distance / 2 - z) ** 2))

    expected = 2 * quad(ring, 0, distance / 4, epsabs=1e-14)[0]
    # The tolerance of the integration; rounding of squares of 4.
    assert neck_volume(radius, distance) == pytest.approx(expected, abs=1e-13)
    # A length of 0.3 instead of 1: a few operations.
    assert neck_volume(0.3, 0.3 * distance) == pytest.approx(
        0.3**3 * neck_volume(1, distance), rel=1e-13
    )


def test_volume_of_a_short_dimer() -> None:
    # sin(b) - b cos(b) is b^3 / 3 to first order in b^2, which is 6e-12 here.
    assert neck_volume(1, 1e-5) == pytest.approx(4 / 3 * np.pi * (1e-5 / 4) ** 3, rel=1e-10)


def test_touching_spheres() -> None:
    # 4 pi (1 / 2 - pi sqrt(3) / 12) for radius 1.
    expected = 4 * np.pi * (0.5 - np.pi * np.sqrt(3) / 12)
    # A few operations.
    assert neck_volume(1, 2) == pytest.approx(expected, rel=1e-13)
    assert dimer_volume(1, 2) == pytest.approx(8 / 3 * np.pi, rel=1e-13)
    # Positions in a dump are rounded.
    assert neck_volume(1, 2 + 1e-9) == neck_volume(1, 2)


@pytest.mark.parametrize("distance", [0.12, 0.2])
def test_no_sphere_reaches_the_neck(distance: float) -> None:
    # A point can be reached if a sphere that contains it overlaps none of the two: if any point at
    # most a radius away is two radii from both centres. The nearest such point lies in the plane of
    # the axis and the point, on the point's side.
    radius, count = 0.1, 300
    generator = np.random.default_rng(1)
    along = generator.uniform(-distance / 3, distance / 3, count)
    across = generator.uniform(0, 1.2 * radius, count)
    free = np.hypot(abs(along) - distance / 2, across) > radius
    along, across = along[free], across[free]

    step = 0.001
    x, rho = np.mgrid[-2 * radius : 2 * radius : step, 0 : 3 * radius : step]
    allowed = np.hypot(abs(x) - distance / 2, rho) >= 2 * radius
    x, rho = x[allowed], rho[allowed]
    nearest = np.array([np.hypot(x - a, rho - b).min() for a, b in zip(along, across, strict=True)])

    centres = [[-distance / 2, 0, 0], [distance / 2, 0, 0]]
    points = np.column_stack([along, across * np.cos(along), across * np.sin(along)])
    dimer = group_spheres([1, 1])
    # Of a box of next to no size, one point says whether it lies in the neck.
    in_neck = np.array(
        [
            packing_fraction_with_necks(
                Spheres(centres, [radius] * 2, dimer),
                np.column_stack([p - 1e-9, p + 1e-9]),
                points=1,
            ).value
            for p in points
        ]
    )
    # The grid of centres does not decide within a diagonal of its cells of the neck's surface.
    clear = abs(nearest - radius) > np.sqrt(2) * step
    assert ((nearest > radius) == (in_neck == 1))[clear].all()
    assert 5 < in_neck[clear].sum() < clear.sum() - 5


def grid_of_dimers(
    distance: float, radius: float, cells: int
) -> tuple[FloatArray, FloatArray, Particles]:
    grid = (np.mgrid[:cells, :cells, :cells].reshape(3, -1).T + 0.5) / cells
    arms = np.random.default_rng(3).normal(size=grid.shape)
    arms *= distance / 2 / np.linalg.norm(arms, axis=1)[:, None]
    numbers = np.arange(1, len(grid) + 1)
    positions = np.vstack([grid - arms, grid + arms])
    return positions, np.full(len(positions), radius), group_spheres(np.r_[numbers, numbers])


@pytest.mark.parametrize(("distance", "radius"), [(0.1, 0.1), (0.16, 0.08)])
def test_random_points_find_the_necks(distance: float, radius: float) -> None:
    positions, radii, dimers = grid_of_dimers(distance, radius, cells=3)
    measured = packing_fraction_with_necks(Spheres(positions, radii, dimers), UNIT, points=300_000)
    expected = len(dimers) * (dimer_volume(radius, distance) + neck_volume(radius, distance))
    # The seed is fixed; four standard deviations are passed by chance once in 16,000 seeds.
    assert abs(measured.value - expected) < 4 * measured.uncertainty
    # The points are those of the packing fraction without necks: the difference is the number of
    # points in the necks, with its own uncertainty. As above.
    without = packing_fraction(Spheres(positions, radii), UNIT, points=300_000)
    necks = measured.value - without.value
    expected_necks = len(dimers) * neck_volume(radius, distance)
    assert abs(necks - expected_necks) < 4 * np.sqrt(expected_necks / measured.points)


def test_necks_are_cut_by_the_box_and_spheres_have_none() -> None:
    # The face at x = 0 halves the dimer; a free sphere lies beside it.
    positions = [[0, 0.4, 0.5], [0, 0.6, 0.5], [0.7, 0.5, 0.5]]
    particles = group_spheres([7, 7, 0])
    measured = packing_fraction_with_necks(
        Spheres(positions, [0.1] * 3, particles), UNIT, points=300_000
    )
    expected = (dimer_volume(0.1, 0.2) + neck_volume(0.1, 0.2)) / 2 + 4 / 3 * np.pi * 0.1**3
    assert abs(measured.value - expected) < 4 * measured.uncertainty
    free = group_spheres([0] * 3)
    alone = packing_fraction_with_necks(Spheres(positions, [0.1] * 3, free), UNIT, points=1000)
    assert alone == packing_fraction(Spheres(positions, [0.1] * 3), UNIT, points=1000)


def test_overlapping_necks_count_once() -> None:
    positions = np.array([[0.5, 0.4, 0.5], [0.5, 0.6, 0.5]] * 2)
    once, twice = (
        packing_fraction_with_necks(
            Spheres(positions[: len(bodies)], [0.1] * len(bodies), group_spheres(bodies)),
            UNIT,
            points=50_000,
        )
        for bodies in ([1, 1], [1, 1, 2, 2])
    )
    assert once == twice


@pytest.mark.parametrize(
    ("radius", "distance", "message"),
    [
        (0, 1, "a radius must be positive and finite, not 0"),
        (np.nan, 1, "a radius must be positive"),
        (1, 0, "above 0 and at most 2, two radii, not 0"),
        (1, 2.01, "above 0 and at most 2, two radii, not 2.01"),
    ],
)
def test_wrong_sizes(radius: float, distance: float, message: str) -> None:
    for function in (neck_volume, dimer_volume):
        with pytest.raises(InputError, match=message):
            function(radius, distance)


@pytest.mark.parametrize(
    ("bodies", "radii", "points", "message"),
    [
        (
            [0, 2, 2],
            [1, 1, 1.1],
            10,
            r"two equal spheres has a neck: the radii in body 2 are 1 and",
        ),
        ([0, 2, 2], [1, 1, 1], 0, "number of points must be at least 1, not 0"),
        ([2, 2, 2], [1, 1, 1], 10, "in body 2 is 3"),
        ([0, 2, 2], [0.5, 0.5, 0.5], 10, "at most 1, two radii, not 1.4"),
    ],
)
def test_wrong_dimers(bodies: list[int], radii: Any, points: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        packing_fraction_with_necks(
            Spheres(np.eye(3), radii, group_spheres(bodies)), UNIT, points=points
        )
