"""Bodies of several spheres: who belongs together, where they are, whom they touch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    InputError,
    Spheres,
    contact_counts,
    coordination_number,
    group_spheres,
)

# A dimer (body 7), a free sphere, a trimer (body 3), a body of one sphere (body 9).
BODIES = [7, 0, 3, 7, 3, 9, 3]
IDS = [10, 20, 30, 40, 50, 60, 70]


def test_particles_in_the_order_of_their_first_spheres() -> None:
    particles = group_spheres(BODIES)
    assert particles.index.tolist() == [0, 1, 2, 0, 2, 3, 2]
    assert particles.sizes.tolist() == [2, 1, 3, 1]
    assert particles.bodies.tolist() == [7, 0, 3, 9]
    assert len(particles) == 4
    assert particles.composite


@pytest.mark.parametrize("bodies", [[0, 0, 0], [3, 1, 2], [0, 5, 0]])
def test_particles_of_one_sphere(bodies: list[Any]) -> None:
    particles = group_spheres(bodies)
    assert particles.index.tolist() == [0, 1, 2]
    assert particles.bodies.tolist() == bodies
    assert not particles.composite


def test_centres() -> None:
    positions = [[0, 0, 0], [0.1, 0.2, 0.3], [3, 0, 1], [1, 2, 4], [4, 1, 0], [9, 9, 9], [2, 2, 2]]
    # Equality: these means are exact in float64, and a free sphere keeps its position.
    assert group_spheres(BODIES).centres(positions).tolist() == [
        [0.5, 1, 2],
        [0.1, 0.2, 0.3],
        [3, 1, 1],
        [9, 9, 9],
    ]


def test_a_particle_is_inside_by_its_centre() -> None:
    # Both spheres of body 1 lie outside, both of body 2 inside; of body 3 one lies inside.
    positions = np.outer([-1, 2, 0.2, 0.8, 0.9, 2], [1, 0, 0])
    spheres = Spheres(positions, np.ones(6), group_spheres([1, 1, 2, 2, 3, 3]))
    assert spheres.particles_in([[0, 1]] * 3).tolist() == [True, True, False]


def test_several_contacts_with_one_neighbour() -> None:
    # The dimer 10-40 touches the trimer 30-50-70 four times, the free sphere 20 twice and wall 3
    # with both spheres; 60 touches nothing.
    contacts = [[10, 30], [50, 10], [40, 50], [70, 40], [20, 10], [20, 40], [10, -3], [40, -3]]
    counts = contact_counts(contacts, IDS, group_spheres(BODIES))
    assert counts.particles.tolist() == [6, 2, 4, 0]
    assert counts.neighbours.tolist() == [2, 1, 1, 0]
    assert counts.walls.tolist() == [2, 0, 0, 0]


def test_free_spheres_need_no_bodies() -> None:
    contacts = [[10, 20], [30, 20], [10, -3], [30, -1], [30, -3]]
    alone = contact_counts(contacts, [30, 10, 20])
    grouped = contact_counts(contacts, [30, 10, 20], group_spheres([0, 0, 0]))
    for counts in (alone, grouped):
        assert counts.particles.tolist() == [1, 1, 2]
        assert counts.neighbours.tolist() == [1, 1, 2]
        assert counts.walls.tolist() == [2, 1, 0]


def test_no_contacts() -> None:
    counts = contact_counts(np.empty((0, 2)), IDS, group_spheres(BODIES))
    for numbers in (counts.particles, counts.neighbours, counts.walls):
        assert numbers.tolist() == [0, 0, 0, 0]


def test_walls_only() -> None:
    counts = contact_counts([[70, -2], [30, -2]], IDS, group_spheres(BODIES))
    assert counts.particles.tolist() == [0, 0, 0, 0]
    assert counts.walls.tolist() == [0, 0, 2, 0]


@pytest.mark.parametrize("seed", range(5))
def test_same_counts_as_by_looking_at_every_contact(seed: int) -> None:
    generator = np.random.default_rng(seed)
    # Bodies of 1 to 4 spheres and free spheres, with numbers, ids and spheres in no order.
    sizes = generator.integers(1, 5, 40)
    numbers = generator.choice(np.arange(1, 1000), len(sizes), replace=False)
    bodies = generator.permutation(np.r_[np.repeat(numbers, sizes), np.zeros(25, int)])
    ids = generator.permutation(np.arange(1, 4 * len(bodies)))[: len(bodies)]
    one, other = np.triu_indices(len(bodies), k=1)
    apart = (bodies[one] != bodies[other]) | (bodies[one] == 0)
    pairs = generator.choice(np.column_stack([ids[one], ids[other]])[apart], 400, replace=False)
    with_walls = np.column_stack([generator.choice(ids, 60), -generator.integers(1, 7, 60)])
    contacts = generator.permutation(np.vstack([generator.permuted(pairs, axis=1), with_walls]))

    # A particle is named by its body, a free sphere by minus its id.
    name_of = {a: b if b else -a for a, b in zip(ids.tolist(), bodies.tolist(), strict=True)}
    names = list(dict.fromkeys(name_of.values()))
    touched: dict[str, Any] = {name: [] for name in names}
    walls = dict.fromkeys(names, 0)
    for first, second in contacts.tolist():
        if second < 0:
            walls[name_of[first]] += 1
        else:
            touched[name_of[first]].append(name_of[second])
            touched[name_of[second]].append(name_of[first])

    counts = contact_counts(contacts, ids, group_spheres(bodies))
    assert counts.particles.tolist() == [len(touched[name]) for name in names]
    assert counts.neighbours.tolist() == [len(set(touched[name])) for name in names]
    assert counts.walls.tolist() == [walls[name] for name in names]
    # The data are worth looking at: some pairs of bodies touch several times.
    assert counts.neighbours.sum() < counts.particles.sum()


def test_mean_over_bodies_and_free_spheres() -> None:
    contacts = [[10, 30], [10, 50], [40, 20]]
    counts = contact_counts(contacts, IDS, group_spheres(BODIES))
    # Three contacts are six sides, two pairs of neighbours are four, for four particles.
    assert coordination_number([counts.particles], [True] * 4).mean == 1.5
    assert coordination_number([counts.neighbours], [True] * 4).mean == 1


def test_contact_within_a_body() -> None:
    message = "spheres 70 and 30 are in contact, but both belong to body 3"
    with pytest.raises(InputError, match=message):
        contact_counts([[10, 20], [70, 30]], IDS, group_spheres(BODIES))


def test_unknown_sphere() -> None:
    with pytest.raises(InputError, match="names sphere 7, which does not exist"):
        contact_counts([[7, 10]], IDS, group_spheres(BODIES))


def test_other_number_of_spheres() -> None:
    particles = group_spheres(BODIES)
    with pytest.raises(InputError, match="2 sphere ids, but 7 spheres in particles"):
        contact_counts([[1, 2]], [1, 2], particles)
    with pytest.raises(InputError, match="1 positions, but 7 spheres in particles"):
        particles.centres([[0, 0, 0]])


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        ([], r"bodies must have shape \(n,\) with n >= 1, not \(0,\)"),
        ([[1, 1]], r"n >= 1, not \(1, 2\)"),
        ([1, -2], "a body's number must not be negative, not -2"),
    ],
)
def test_wrong_bodies(bodies: list[Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        group_spheres(bodies)
