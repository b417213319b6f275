"""Largest overlaps, by hand and against a look at all pairs."""

from __future__ import annotations

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    InputError,
    PairOverlap,
    Spheres,
    WallOverlap,
    group_spheres,
    largest_pair_overlap,
    largest_wall_overlap,
)

# Sums and differences of numbers near 1 in float64.
ROUNDING = 1e-15


def test_deepest_of_two_overlaps() -> None:
    found = largest_pair_overlap(
        Spheres([[0, 0, 0], [0.9, 0, 0], [0.9, 0.8, 0], [9, 9, 9]], [0.5] * 4)
    )
    assert found.pair == (1, 2)
    assert found.depth == pytest.approx(0.2, abs=ROUNDING)


def test_spheres_apart_do_not_overlap() -> None:
    assert largest_pair_overlap(Spheres([[0, 0, 0], [1.5, 0, 0]], [0.5, 0.5])) == PairOverlap(
        0.0, None
    )
    assert largest_pair_overlap(Spheres([[0, 0, 0]], [0.5])) == PairOverlap(0.0, None)


def test_touching_spheres_do_not_overlap() -> None:
    assert largest_pair_overlap(Spheres([[0, 0, 0], [1, 0, 0]], [0.5, 0.5])) == PairOverlap(
        0.0, None
    )


def test_same_place() -> None:
    assert largest_pair_overlap(Spheres([[1, 1, 1], [1, 1, 1]], [0.5, 0.25])) == PairOverlap(
        0.75, (0, 1)
    )


def test_small_sphere_in_a_large_one() -> None:
    # The centres are further apart than twice the small radius.
    found = largest_pair_overlap(Spheres([[0.9, 0, 0], [0, 0, 0]], [0.01, 1]))
    assert found.pair == (0, 1)
    assert found.depth == pytest.approx(0.11, abs=ROUNDING)


@pytest.mark.parametrize("seed", range(5))
def test_same_pair_as_by_looking_at_all(seed: int) -> None:
    generator = np.random.default_rng(seed)
    centres = generator.uniform(0, 1, (400, 3))
    radii = 10 ** generator.uniform(-3, -1.3, 400)
    distances = np.linalg.norm(centres[:, None] - centres, axis=2)
    depths = np.triu(radii[:, None] + radii - distances, k=1)
    found = largest_pair_overlap(Spheres(centres, radii))
    deepest: object = np.unravel_index(np.argmax(depths), depths.shape)
    assert found.pair == deepest
    assert found.depth == pytest.approx(depths.max(), abs=ROUNDING)


def test_spheres_of_one_body_may_overlap() -> None:
    centres = [[0, 0, 0], [0.5, 0, 0], [1.4, 0, 0], [1.9, 0, 0]]
    found = largest_pair_overlap(Spheres(centres, [0.5] * 4, group_spheres([7, 7, 8, 8])))
    assert found.pair == (1, 2)
    assert found.depth == pytest.approx(0.1, abs=ROUNDING)


def test_body_zero_is_no_body() -> None:
    found = largest_pair_overlap(
        Spheres([[0, 0, 0], [0.5, 0, 0]], [0.5, 0.5], group_spheres([0, 0]))
    )
    assert found == PairOverlap(0.5, (0, 1))


def test_wrong_number_of_bodies() -> None:
    with pytest.raises(InputError, match="2 positions, but 1 spheres in particles"):
        largest_pair_overlap(Spheres([[0, 0, 0], [1, 0, 0]], [0.5, 0.5], group_spheres([1])))


@pytest.mark.parametrize(
    ("centre", "face"),
    [
        ((0.2, 2, 1.5), "xlo"),
        ((0.8, 2, 1.5), "xhi"),
        ((0.5, 0.2, 1.5), "ylo"),
        ((0.5, 4.8, 1.5), "yhi"),
        ((0.5, 2, 0.2), "zlo"),
        ((0.5, 2, 2.8), "zhi"),
    ],
)
def test_each_face(centre: list[float], face: str) -> None:
    centres = [(0.5, 2, 1.5), centre]
    found = largest_wall_overlap(Spheres(centres, [0.3, 0.3]), [[0, 1], [0, 5], [0, 3]])
    assert (found.particle, found.face) == (1, face)
    assert found.depth == pytest.approx(0.1, abs=ROUNDING)


def test_a_sphere_that_escaped_is_deeper_than_its_radius() -> None:
    found = largest_wall_overlap(Spheres([[0.5, -1, 0.5]], [0.25]), [[0, 1]] * 3)
    assert found == WallOverlap(1.25, 0, "ylo")


def test_no_wall_is_touched() -> None:
    found = largest_wall_overlap(Spheres([[0.5, 0.5, 0.5]], [0.5]), [[0, 1]] * 3)
    assert found == WallOverlap(0.0, None, None)
