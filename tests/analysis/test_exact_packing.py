"""Exact packing fraction: against random points, and what overlaps do to it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from lammps_inelastic.analysis import (
    InputError,
    PackingFraction,
    Particles,
    Spheres,
    exact_packing_fraction,
    group_spheres,
    packing_fraction,
)
from lammps_inelastic.analysis.geometry import FloatArray

UNIT = [[0, 1]] * 3
# Boxes for particles on a grid in the unit box: none is cut, and all cuts occur.
BOXES = [UNIT, [[0.1, 0.9]] * 3, [[0.32, 0.35], [0, 1], [0.1, 0.6]], [[0.27, 0.52]] * 3]


def dimers_on_grid(
    distance: float, radius: float, cells: int = 6, seed: int = 6
) -> tuple[FloatArray, FloatArray, Particles]:
    """Return dimers of random orientation on a grid, where no two of them overlap."""
    grid = (np.mgrid[:cells, :cells, :cells].reshape(3, -1).T + 0.5) / cells
    arms = np.random.default_rng(seed).normal(size=grid.shape)
    arms *= distance / 2 / np.linalg.norm(arms, axis=1)[:, None]
    numbers = np.arange(1, len(grid) + 1)
    positions = np.vstack([grid - arms, grid + arms])
    return positions, np.full(len(positions), radius), group_spheres(np.r_[numbers, numbers])


def assert_within_four_sigma(measured: PackingFraction, exact: float) -> None:
    # The seed is fixed, so this is not a lottery; four standard deviations are passed by chance
    # once in 16,000 seeds.
    assert abs(measured.value - exact) < 4 * measured.uncertainty


@pytest.mark.slow
@pytest.mark.parametrize("box", BOXES)
def test_spheres_and_random_points(box: ArrayLike) -> None:
    positions, radii, _ = dimers_on_grid(0, 0.08)
    exact = exact_packing_fraction(Spheres(positions[:216], radii[:216]), box)
    measured = packing_fraction(Spheres(positions, radii), box, points=400_000)
    assert_within_four_sigma(measured, exact.value)
    assert exact.overlap == 0


@pytest.mark.slow
@pytest.mark.parametrize("box", BOXES)
@pytest.mark.parametrize(("distance", "radius"), [(0.02, 0.07), (0.06, 0.05), (0.08, 0.04)])
def test_dimers_and_random_points(distance: float, radius: float, box: ArrayLike) -> None:
    positions, radii, dimers = dimers_on_grid(distance, radius)
    exact = exact_packing_fraction(Spheres(positions, radii, dimers), box)
    assert_within_four_sigma(
        packing_fraction(Spheres(positions, radii), box, points=400_000), exact.value
    )
    assert exact.overlap == 0


@pytest.mark.parametrize("distance", [0.02, 0.06, 0.1])
def test_known_number_of_dimers_in_the_box(distance: float) -> None:
    # Remark 1.3 of the paper: particles of known volume, none of which the box cuts.
    radius = 0.05
    lens = np.pi / 12 * (4 * radius + distance) * max(2 * radius - distance, 0) ** 2
    positions, radii, dimers = dimers_on_grid(distance, radius, cells=5)
    exact = exact_packing_fraction(Spheres(positions, radii, dimers), UNIT)
    # A sum of 250 numbers.
    assert exact.value == pytest.approx(125 * (8 / 3 * np.pi * radius**3 - lens), rel=1e-13)
    measured = packing_fraction(Spheres(positions, radii), UNIT, points=400_000)
    assert_within_four_sigma(measured, exact.value)


def test_overlap_of_two_spheres() -> None:
    radius, distance = 0.25, 0.3
    lens = np.pi / 12 * (4 * radius + distance) * (2 * radius - distance) ** 2
    for middle, share in ((0.5, 1), (0, 1 / 2)):
        # Along y, so that the face at x = 0 halves everything.
        positions = [[middle, 0.5 - distance / 2, 0.5], [middle, 0.5 + distance / 2, 0.5]]
        found = exact_packing_fraction(Spheres(positions, [radius, radius]), UNIT)
        # A few operations.
        assert found.value == pytest.approx(share * 8 / 3 * np.pi * radius**3, rel=1e-13)
        assert found.overlap == pytest.approx(share * lens, rel=1e-13)
        as_dimer = exact_packing_fraction(
            Spheres(positions, [radius] * 2, group_spheres([1, 1])), UNIT
        )
        assert as_dimer.value == pytest.approx(found.value - found.overlap, rel=1e-13)
        assert as_dimer.overlap == 0


def test_sphere_in_a_sphere() -> None:
    found = exact_packing_fraction(Spheres([[0.5, 0.5, 0.5], [0.55, 0.5, 0.5]], [0.4, 0.1]), UNIT)
    # A few operations.
    assert found.overlap == pytest.approx(4 / 3 * np.pi * 0.1**3, rel=1e-13)


@pytest.mark.parametrize("grouped", [False, True])
def test_covered_share_lies_within_the_overlap(grouped: Any) -> None:
    generator = np.random.default_rng(8)
    positions, radii = generator.uniform(-0.1, 1.1, (60, 3)), generator.uniform(0.05, 0.15, 60)
    bodies = np.r_[np.repeat(np.arange(1, 21), 2), np.zeros(20, int)]
    # Half of the dimers overlap within themselves.
    positions[1:20:2] = positions[0:20:2] + 0.05
    particles = group_spheres(bodies) if grouped else None
    exact = exact_packing_fraction(Spheres(positions, radii, particles), UNIT)
    measured = packing_fraction(Spheres(positions, radii), UNIT, points=300_000)
    assert 0 < exact.overlap < exact.value
    # Random points are uncertain; four standard deviations.
    margin = 4 * measured.uncertainty
    assert exact.value - exact.overlap - margin < measured.value < exact.value + margin


def test_empty_box() -> None:
    found = exact_packing_fraction(Spheres([[3, 3, 3]], [0.5]), UNIT)
    assert (found.value, found.overlap) == (0, 0)


def test_larger_bodies_are_refused() -> None:
    with pytest.raises(InputError, match="in body 2 is 3; packing_fraction measures any body"):
        exact_packing_fraction(Spheres(np.eye(4, 3), [1] * 4, group_spheres([0, 2, 2, 2])), UNIT)
