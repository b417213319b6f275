"""Packing fraction against volumes known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import InputError, PackingFraction, Spheres, packing_fraction

UNIT = [[0, 1]] * 3


def assert_within_four_sigma(measured: PackingFraction, exact: float) -> None:
    # The seed is fixed, so this is not a lottery; four standard deviations are passed by chance
    # once in 16,000 seeds.
    assert abs(measured.value - exact) < 4 * measured.uncertainty


def ball(radius: float) -> float:
    return 4 / 3 * np.pi * radius**3


def test_one_sphere() -> None:
    measured = packing_fraction(Spheres([[0.5, 0.5, 0.5]], [0.5]), UNIT)
    assert_within_four_sigma(measured, np.pi / 6)
    assert measured.points == 1_000_000
    assert measured.uncertainty == pytest.approx(
        np.sqrt(np.pi / 6 * (1 - np.pi / 6) / 1e6),
        # Its relative error is that of value (1 - value): less than 1e-4 here.
        rel=1e-4,
    )


def test_overlap_counts_once() -> None:
    radius, distance = 0.3, 0.35
    lens = np.pi / 12 * (4 * radius + distance) * (2 * radius - distance) ** 2
    centres = [[0.5 - distance / 2, 0.5, 0.5], [0.5 + distance / 2, 0.5, 0.5]]
    assert_within_four_sigma(
        packing_fraction(Spheres(centres, [0.3, 0.3]), UNIT), 2 * ball(0.3) - lens
    )


@pytest.mark.parametrize("separation", [0.5, 1.0])
def test_dimers(separation: float) -> None:
    # On a grid, no two dimers overlap. V = 2 (pi d^3 / 6) - lens, where the centres are half a
    # diameter apart, or a diameter (no lens).
    diameter = 0.16
    distance = separation * diameter
    lens = np.pi / 12 * (2 * diameter + distance) * (diameter - distance) ** 2
    grid = (np.mgrid[:3, :3, :3].reshape(3, -1).T + 0.5) / 3
    arms = np.random.default_rng(4).normal(size=grid.shape)
    arms *= distance / 2 / np.linalg.norm(arms, axis=1)[:, None]
    centres = np.vstack([grid - arms, grid + arms])
    measured = packing_fraction(Spheres(centres, np.full(len(centres), diameter / 2)), UNIT)
    assert_within_four_sigma(measured, len(grid) * (2 * np.pi * diameter**3 / 6 - lens))


def test_the_same_sphere_twice_counts_once() -> None:
    once = packing_fraction(Spheres([[0.5, 0.5, 0.5]], [0.4]), UNIT, seed=3)
    twice = packing_fraction(Spheres([[0.5, 0.5, 0.5]] * 2, [0.4, 0.4]), UNIT, seed=3)
    assert once == twice


@pytest.mark.slow
def test_nearest_centre_does_not_decide() -> None:
    # Small spheres line the inside of a large one: most points have a small centre nearest to
    # them, but lie outside it and inside the large one.
    directions = np.random.default_rng(5).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    centres = np.vstack([[0.5, 0.5, 0.5], 0.5 + 0.35 * directions])
    radii = np.r_[0.4, np.full(200, 0.01)]
    assert_within_four_sigma(packing_fraction(Spheres(centres, radii), UNIT), ball(0.4))


def test_same_count_as_by_looking_at_every_sphere() -> None:
    generator = np.random.default_rng(11)
    centres = generator.uniform(-0.2, 1.2, (300, 3))
    radii = generator.uniform(0.01, 0.15, 300)
    points = np.random.default_rng(2).uniform(0, 1, (20_000, 3))
    squared = ((points[:, None] - centres) ** 2).sum(axis=2)
    expected = np.count_nonzero((squared < radii**2).any(axis=1))
    measured = packing_fraction(Spheres(centres, radii), UNIT, points=20_000, seed=2)
    assert measured.value == expected / 20_000


@pytest.mark.parametrize(("sides", "share"), [(1, 1 / 2), (2, 1 / 4), (3, 1 / 8)])
def test_spheres_are_cut_by_the_box(sides: list[float], share: float) -> None:
    centre = [0.0] * sides + [0.5] * (3 - sides)
    assert_within_four_sigma(packing_fraction(Spheres([centre], [0.4]), UNIT), ball(0.4) * share)


def test_box_need_not_be_a_cube() -> None:
    box = [[-1, 1], [2, 2.5], [10, 14]]
    measured = packing_fraction(Spheres([[0.5, 2.25, 11]], [0.25]), box)
    assert_within_four_sigma(measured, ball(0.25) / 4)


def test_nothing_and_everything() -> None:
    assert packing_fraction(Spheres([[3, 3, 3]], [0.5]), UNIT, points=1000).value == 0
    assert packing_fraction(Spheres([[0.5, 0.5, 0.5]], [1.0]), UNIT, points=1000).value == 1


def test_uncertainty_is_the_scatter_between_seeds() -> None:
    runs = [
        packing_fraction(Spheres([[0.5, 0.5, 0.5]], [0.4]), UNIT, points=2000, seed=seed)
        for seed in range(200)
    ]
    scatter = np.std([run.value for run in runs], ddof=1)
    # A standard deviation from 200 values is itself known to 5 %; three of these.
    assert scatter == pytest.approx(runs[0].uncertainty, rel=0.15)


def test_number_of_points_need_not_fill_the_batches() -> None:
    assert packing_fraction(Spheres([[0.5, 0.5, 0.5]], [1.0]), UNIT, points=300_001).value == 1


@pytest.mark.parametrize(
    ("positions", "radii", "box", "message"),
    [
        ([[0, 0]], [1], UNIT, r"positions must have shape \(n, 3\) with n >= 1, not \(1, 2\)"),
        (np.empty((0, 3)), [], UNIT, r"n >= 1, not \(0, 3\)"),
        ([[0, 0, np.nan]], [1], UNIT, "positions hold NaN"),
        ([[0, 0, 0]], [1, 2], UNIT, r"radii must have shape \(1,\), not \(2,\)"),
        ([[0, 0, 0]], [0], UNIT, "radii must be positive"),
        ([[0, 0, 0]], [np.nan], UNIT, "radii must be positive"),
        ([[0, 0, 0]], [1], [0, 1, 0, 1, 0, 1], r"a box must have shape \(3, 2\), not \(6,\)"),
        ([[0, 0, 0]], [1], [[0, 1], [2, 2], [0, 1]], "ylo = 2 must be less than yhi = 2"),
    ],
)
def test_wrong_input(positions: Any, radii: Any, box: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        packing_fraction(Spheres(positions, radii), box)


def test_no_points() -> None:
    with pytest.raises(InputError, match="the number of points must be at least 1, not 0"):
        packing_fraction(Spheres([[0, 0, 0]], [1]), UNIT, points=0)
