"""Contacts by distance, by hand, against a look at all pairs, and against contacts with forces."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    InputError,
    Spheres,
    contact_counts,
    contacts_by_distance,
    exact_packing_fraction,
    group_spheres,
)

# Sums and differences of numbers near 1 in float64.
ROUNDING = 1e-15


def test_two_spheres_of_different_size() -> None:
    found = contacts_by_distance(Spheres([[0, 0, 0], [0, 1.6, 0], [9, 9, 9]], [1, 0.5, 1]), 0.2)
    assert found.sides.tolist() == [[0, 1]]
    assert found.gaps == pytest.approx([0.1], abs=ROUNDING)
    assert found.normals == pytest.approx(np.array([[0, -1, 0]]), abs=ROUNDING)
    # Between the surfaces at 1 and at 1.1.
    assert found.points == pytest.approx(np.array([[0, 1.05, 0]]), abs=ROUNDING)
    assert found.criterion == 0.2


def test_the_gap_must_be_below_the_criterion() -> None:
    # Numbers that float64 holds exactly: gaps of 0 and of 0.125.
    centres, radii = [[0, 0, 0], [1, 0, 0], [2.125, 0, 0]], [0.5] * 3
    assert contacts_by_distance(Spheres(centres, radii), 0).sides.tolist() == []
    assert contacts_by_distance(Spheres(centres, radii), 0.125).sides.tolist() == [[0, 1]]
    assert contacts_by_distance(Spheres(centres, radii), 0.126).sides.tolist() == [[0, 1], [1, 2]]


def test_walls_have_the_numbers_of_a_block() -> None:
    # A sphere in each of two opposite corners; the first overlaps its walls by 0.01.
    centres = [[0.09, 0.09, 0.09], [0.9, 4.9, 0.9]]
    found = contacts_by_distance(Spheres(centres, [0.1, 0.1]), 1e-9, walls=[[0, 1], [0, 5], [0, 1]])
    assert found.sides.tolist() == [[0, -1], [1, -2], [0, -3], [1, -4], [0, -5], [1, -6]]
    assert found.gaps == pytest.approx([-0.01, 0] * 3, abs=ROUNDING)
    assert found.points[:2].tolist() == [[0, 0.09, 0.09], [1, 4.9, 0.9]]
    assert found.normals[:3].tolist() == [[1, 0, 0], [-1, 0, 0], [0, 1, 0]]


def test_spheres_of_a_body_do_not_touch() -> None:
    centres = [[0, 0, 0], [0.5, 0, 0], [1.4, 0, 0], [1.9, 0, 0], [2.8, 0, 0], [3.3, 0, 0]]
    particles = group_spheres([7, 7, 8, 8, 0, 0])
    found = contacts_by_distance(Spheres(centres, [0.5] * 6, particles), 0.01)
    # The last two are free spheres: they touch although both have the number 0.
    assert found.sides.tolist() == [[1, 2], [3, 4], [4, 5]]
    counts = contact_counts(found.sides, range(6), particles)
    assert counts.particles.tolist() == [1, 2, 2, 1]


def test_ids_of_the_sides() -> None:
    found = contacts_by_distance(
        Spheres([[0.5, 0, 0], [1.5, 0, 0]], [0.5, 0.5]), 0.1, walls=[[0, 9]] * 3
    )
    assert found.ids([30, 20])[:2].tolist() == [[30, 20], [30, -1]]


@pytest.mark.parametrize("spread", [0.05, 1.0], ids=["similar radii", "very different radii"])
def test_same_contacts_as_by_looking_at_all(spread: float) -> None:
    generator = np.random.default_rng(3)
    centres = generator.uniform(0, 1, (500, 3))
    radii = 0.05 * 10 ** generator.uniform(-spread, 0, 500)
    gaps = np.linalg.norm(centres[:, None] - centres, axis=2) - radii[:, None] - radii
    expected = np.argwhere(np.triu(gaps < 0.01, k=1))
    found = contacts_by_distance(Spheres(centres, radii), 0.01)
    assert len(expected) > 50
    assert found.sides.tolist() == expected.tolist()
    assert found.gaps == pytest.approx(gaps[tuple(expected.T)], abs=ROUNDING)
    one, other = found.sides.T
    # The point is half the gap away from both surfaces, and the normal points from 2 to 1.
    for side, sign in ((one, 1), (other, -1)):
        surface = centres[side] - sign * radii[side, None] * found.normals
        middle = surface - sign * found.gaps[:, None] / 2 * found.normals
        assert found.points == pytest.approx(middle, abs=ROUNDING)


def test_a_hundred_thousand_spheres_take_about_a_second() -> None:
    places = np.indices((47, 47, 47)).reshape(3, -1).T[:100_000]
    start = time.perf_counter()
    found = contacts_by_distance(Spheres(places, np.full(100_000, 0.5)), 0.01)
    # 0.5 s where this was written; ten times that on a slow or busy machine.
    assert time.perf_counter() - start < 5
    counts = contact_counts(found.sides, np.arange(100_000)).particles
    assert counts.max() == 6
    # Inside of the lattice.
    assert (counts[np.all((places > 0) & (places < 44), axis=1)] == 6).all()


@pytest.mark.parametrize(
    ("places", "arguments", "message"),
    [
        ([[0, 0, 0]], (-0.1,), "must not be negative, and finite: -0.1"),
        ([[0, 0, 0]], (np.nan,), "must not be negative, and finite: nan"),
        ([[0, 0, 0], [0, 0, 0]], (0,), "the centres 0 and 1 are the same"),
        ([[0, 0, 0]], (0, [[1, 0]] * 3), "xlo = 1 must be less than xhi = 0"),
    ],
)
def test_wrong_input(places: Any, arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        contacts_by_distance(Spheres(places, np.ones(len(places))), *arguments)


def test_arrays_in_the_place_of_spheres() -> None:
    """A call of 0.2 says what is asked for now."""
    ask: Any = contacts_by_distance
    with pytest.raises(InputError, match="contacts_by_distance: spheres must be of the class Sphe"):
        ask([[0, 0, 0], [1, 0, 0]], [0.5, 0.5], 1e-4)
    ask = exact_packing_fraction
    with pytest.raises(InputError, match=r"not ndarray: Spheres\(positions, radii\) makes them"):
        ask(spheres=np.zeros((2, 3)))


def test_as_many_spheres_as_in_particles() -> None:
    with pytest.raises(InputError, match="1 positions, but 2 spheres in particles"):
        Spheres([[0, 0, 0]], [1], group_spheres([1, 1]))
