"""Coordination numbers, counted by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    InputError,
    Spheres,
    contact_counts,
    coordination_number,
)

# A chain 10 - 20 - 30 with 10 and 40 on the floor (wall 3), 40 in a corner (walls 1 and 3).
IDS = [10, 20, 30, 40]
CONTACTS = [[10, 20], [30, 20], [10, -3], [40, -1], [40, -3]]


def test_both_sides_count_and_walls_stand_apart() -> None:
    counts = contact_counts(CONTACTS, IDS)
    assert counts.particles.tolist() == [1, 2, 1, 0]
    assert counts.walls.tolist() == [1, 0, 0, 2]


def test_result_follows_the_order_of_the_particles() -> None:
    counts = contact_counts(CONTACTS, [40, 30, 20, 10])
    assert counts.particles.tolist() == [0, 1, 2, 1]
    assert counts.walls.tolist() == [2, 0, 0, 1]


def test_no_contacts() -> None:
    counts = contact_counts(np.empty((0, 2)), IDS)
    assert counts.particles.tolist() == [0, 0, 0, 0]


def test_contacts_with_particles_outside_the_box_count() -> None:
    positions = [[0.1, 0, 0], [0.5, 0, 0], [0.9, 0, 0], [5, 0, 0]]
    inside = Spheres(positions, np.ones(4)).particles_in([[0.3, 0.7], [-1, 1], [-1, 1]])
    assert inside.tolist() == [False, True, False, False]
    number = coordination_number([contact_counts(CONTACTS, IDS).particles], inside)
    assert (number.mean, number.particles) == (2.0, 1)


def test_faces_belong_to_the_box() -> None:
    spheres = Spheres([[0, 0, 0], [1, 1, 1], [1, 1, 1.001]], np.ones(3))
    assert spheres.particles_in([[0, 1]] * 3).tolist() == [True, True, False]


def test_mean_and_scatter_over_frames() -> None:
    number = coordination_number([[4, 6, 0], [5, 7, 9], [6, 8, 9]], [True, True, False])
    assert number.per_frame.tolist() == [5, 6, 7]
    assert number.mean == 6
    assert number.scatter == 1
    assert number.frames == 3


def test_distribution_over_all_frames() -> None:
    number = coordination_number([[0, 1, 1, 2], [0, 1, 4, 2]], [True] * 4)
    assert number.distribution.tolist() == [2 / 8, 3 / 8, 2 / 8, 0, 1 / 8]
    assert number.particles_with(0, 1) == 2.5
    assert number.particles_with(4, 9) == 0.5


def test_one_frame_has_no_scatter() -> None:
    assert coordination_number([[3, 5]], [True, True]).scatter is None


def test_all_particles_in_the_mean() -> None:
    # Two contacts between four particles are four sides: one for each in the mean.
    number = coordination_number([contact_counts(CONTACTS, IDS).particles], [True] * 4)
    assert number.mean == 1


def test_unknown_particle() -> None:
    with pytest.raises(InputError, match="names sphere 25, which does not exist"):
        contact_counts([[10, 25]], IDS)
    with pytest.raises(InputError, match="names sphere 41"):
        contact_counts([[41, -1]], IDS)


@pytest.mark.parametrize(
    ("frames", "chosen", "message"),
    [
        ([[1, 2]], [False, False], "no particle is chosen"),
        ([], [True, True], "at least one frame"),
        ([[1, 2, 3]], [True, True], r"must have shape \(2,\), not \(3,\)"),
    ],
)
def test_wrong_input(frames: Any, chosen: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        coordination_number(frames, chosen)


def test_wrong_shapes() -> None:
    with pytest.raises(InputError, match=r"contact ids must have shape \(m, 2\), not \(2,\)"):
        contact_counts([1, 2], IDS)
    with pytest.raises(InputError, match=r"sphere ids must have shape \(n,\)"):
        contact_counts([[1, 2]], [])
