"""Problems that are hard for coloured sweeps: they are solved, or given to the other solver."""

from __future__ import annotations

import numpy as np
import pytest

from lammps_inelastic import core
from tests.helpers.contact_problems import (
    UP,
    WALL,
    Floats,
    Problem,
    assert_within,
    column,
    dense_crystal,
    heap,
    in_bodies,
    problem,
)

TOLERANCE = 1e-9


def directions(count: int) -> Floats:
    """Unit vectors that are spread evenly over a sphere, by the golden angle, (count, 3)."""
    k = np.arange(count)
    height = 1 - (2 * k + 1) / count
    around = np.pi * (1 + 5**0.5) * k
    across = np.sqrt(1 - height**2)
    return np.column_stack([across * np.cos(around), across * np.sin(around), height])


def hub(count: int, mass: float = 1.0) -> Problem:
    """A sphere that so many others meet from all sides, at speeds from 1 to 2."""
    normals = directions(count)
    speeds = np.linspace(1, 2, count)
    velocities = np.vstack([[(0.1, 0.2, 0.3)], -speeds[:, None] * normals])
    contacts = [(k + 1, 0, normal, 0.001) for k, normal in enumerate(normals)]
    return problem([tuple(v) for v in velocities], [mass] + [1.0] * count, contacts)


def held_body(count: int) -> Problem:
    """A rod whose two spheres are met by so many others each."""
    one = hub(2 * count)
    given = problem(
        [(0, 0, 0), (0, 0, 0), *(tuple(v) for v in one.predicted_velocity[1:])],
        [1.0] * (2 * count + 2),
        [(k + 2, k % 2, one.normal[k], 0.001) for k in range(2 * count)],
    )
    arms = np.zeros((2 * count + 2, 3))
    arms[0], arms[1] = (0.5, 0, 0), (-0.5, 0, 0)
    return in_bodies(given, arms, [(0, 1)])


def assert_solved(given: Problem, solver: core.Solver = "sweeps") -> core.Projection:
    """Judge a projection by dense products, which share no code with the solvers."""
    found = given.project(TOLERANCE, solver=solver)
    assert found.converged
    feasibility, complementarity = given.residual(found.impulse)
    # Round-off of the dense products
    assert max(feasibility, complementarity) <= TOLERANCE * (1 + 1e-6) + 1e-15
    return found


HARD = {
    # A colour holds one contact of a sphere: the last 17 of 80 find none.
    "80 contacts on one sphere": hub(80),
    "80 contacts on a heavy sphere": hub(80, 1e6),
    "80 contacts on a light sphere": hub(80, 1e-3),
    "100 contacts on a body": held_body(50),
    "a light sphere under a heavy one": column([1e-6, 1], [0, -1]),
    "a heavy heap": heap(9, mass_ratio=1e6),
    "a crystal at rest": dense_crystal(6, 1),
}


@pytest.mark.parametrize("given", HARD.values(), ids=HARD)
def test_hard_problems_are_solved(given: Problem) -> None:
    found = assert_solved(given)
    other = assert_solved(given, "apgd")
    # Residuals in series, along up to 200 contacts
    assert_within(found.velocity, other.velocity, 200 * TOLERANCE / given.timestep)


@pytest.mark.parametrize("given", [hub(2000), held_body(1000)], ids=["sphere", "body"])
def test_contacts_that_cannot_be_visited_together_are_left_to_the_other_solver(
    given: Problem,
) -> None:
    """To the last bit: of 2,000 contacts of one sphere 1,937 would fill a group each."""
    found = assert_solved(given)
    other = assert_solved(given, "apgd")
    assert found.iterations == other.iterations
    assert np.array_equal(found.impulse, other.impulse)


def test_what_sweeps_do_not_solve_goes_to_the_other_solver() -> None:
    """Light spheres between heavy ones: thousands of sweeps bring nothing."""
    given = column([1, 1e-7, 1, 1e-7, 1], [0, 0, -1, 0, -2])
    assert_solved(given)


def test_a_wall_that_was_far_stops_what_is_squeezed_out() -> None:
    """A heavy sphere presses a light one out of a wedge, six times as fast as itself, to a wall.

    The wall is farther than sweeps look at the start, and they end before they look again: the
    residuals in double precision bring it in.
    """
    slope, far, tolerance = 0.15, 5.5, 0.1
    aside = (slope, 0, -np.sqrt(1 - slope**2))
    contacts = [(1, 0, aside, 0), (1, WALL, UP, 0), (1, WALL, (-1, 0, 0), far)]
    given = problem([(0, 0, -1), (0, 0, 0)], [1000, 1], contacts, timestep=1)
    found = given.project(tolerance)
    assert found.converged
    assert max(given.residual(found.impulse)) <= tolerance
    assert found.impulse[2] > 0
    # The wall lets it go as far as the tolerance beyond the gap.
    assert far - tolerance <= found.velocity[1, 0] <= far + tolerance


def test_the_same_bits_from_run_to_run() -> None:
    given = heap(3, particles=200, overlap=0.01)
    one, other = given.project(TOLERANCE), given.project(TOLERANCE)
    assert one.iterations == other.iterations
    assert np.array_equal(one.velocity, other.velocity)
    assert np.array_equal(one.impulse, other.impulse)


def test_the_order_of_contacts_is_of_no_account() -> None:
    """Colours follow it; the solution does not."""
    given = heap(4, particles=200, overlap=0.01)
    found = assert_solved(given).velocity
    order = np.random.default_rng(1).permutation(given.gap.size)
    turned = assert_solved(given.with_contacts(order)).velocity
    # Residuals in series, along some tens of contacts
    assert_within(turned, found, 100 * TOLERANCE / given.timestep)


def test_no_room_is_said_by_the_other_solver() -> None:
    """A sphere between two walls that are too close shares the overlap out evenly."""
    given = problem([(0, 0, 0)], [1], [(0, WALL, UP, -0.01), (0, WALL, (0, 0, -1), 0.0)])
    limits = core.Limits(TOLERANCE, reach=1.0)
    found = core.project(given.for_core(), limits)
    assert found.status == "infeasible"
    gaps = given.gap_at_end(found.velocity)
    assert_within(gaps, [-0.005, -0.005], 1e-3)
