"""Rattlers, by hand, and what is left without them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    InputError,
    backbone,
    contact_counts,
    contacts_to_hold,
    coordination_number,
    group_spheres,
)

# Six spheres of which each touches the four that are not opposite: an octahedron.
OCTAHEDRON = [pair for pair in itertools.combinations(range(1, 7), 2) if sum(pair) != 7]


def test_an_octahedron_has_no_rattlers() -> None:
    found = backbone(OCTAHEDRON, range(1, 7))
    assert not found.rattlers.any()
    assert found.rounds == 0
    assert found.counts.particles.tolist() == [4] * 6


def test_removal_goes_on() -> None:
    # 7 rests on three of the octahedron, 8 on 7 and two others, 9 on nothing.
    contacts = [*OCTAHEDRON, (7, 1), (7, 2), (7, 3), (8, 7), (8, 4), (8, 5)]
    found = backbone(contacts, range(1, 10))
    # 8 has three contacts, 7 four: it goes once 8 has gone.
    assert found.rattlers.tolist() == [False] * 6 + [True] * 3
    assert found.rounds == 2
    assert found.counts.particles.tolist() == [4] * 6 + [0] * 3
    assert contact_counts(contacts, range(1, 10)).particles.tolist() == [5] * 5 + [4, 4, 3, 0]

    # The coordination number without rattlers.
    number = coordination_number([found.counts.particles], ~found.rattlers)
    assert (number.mean, number.particles) == (4, 6)


def test_one_rattler_takes_the_others_with_it() -> None:
    # Without one contact the whole octahedron falls apart.
    found = backbone(OCTAHEDRON[1:], range(1, 7))
    assert found.rattlers.all()
    assert found.counts.particles.tolist() == [0] * 6


def test_walls_hold() -> None:
    # Three contacts with walls and one with another sphere, which has three and a wall.
    contacts = [(1, -1), (1, -3), (1, -5), (1, 2), (2, -2), (2, -4), (2, -6)]
    found = backbone(contacts, [1, 2])
    assert not found.rattlers.any()
    assert found.counts.walls.tolist() == [3, 3]
    assert backbone(contacts[1:], [1, 2]).rattlers.all()


def test_a_weight_needs_three() -> None:
    contacts = [(1, -1), (1, -3), (1, -5)]
    assert backbone(contacts, [1]).rattlers.tolist() == [True]
    assert backbone(contacts, [1], fewest=3).rattlers.tolist() == [False]


def test_contacts_to_hold() -> None:
    particles = group_spheres([0, 1, 1, 2, 2, 2, 3, 3, 3, 3, 4])
    assert contacts_to_hold(particles).tolist() == [4, 6, 7, 7, 4]


@pytest.mark.parametrize(("walls", "rattles"), [(5, True), (6, False)])
def test_a_dimer_is_held_by_six(walls: int, rattles: bool) -> None:
    particles = group_spheres([1, 1])
    contacts = [(1 + wall % 2, -1 - wall) for wall in range(walls)]
    assert backbone(contacts, [1, 2], particles).rattlers.tolist() == [rattles]


def test_one_number_for_each_particle() -> None:
    assert backbone([(1, -1), (2, -1)], [1, 2], fewest=[1, 2]).rattlers.tolist() == [False, True]


def test_no_contacts() -> None:
    assert backbone(np.empty((0, 2)), [1, 2]).rattlers.all()


def test_wrong_shape() -> None:
    with pytest.raises(InputError, match=r"one number or have shape \(2,\), not \(3,\)"):
        backbone([(1, 2)], [1, 2], fewest=[4, 4, 4])
