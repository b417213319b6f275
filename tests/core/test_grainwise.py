"""What judges the velocities of recorded steps, on problems whose solutions are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lammps_inelastic import core
from tests.helpers.contact_problems import Problem, bricks, column, heap
from tests.helpers.grainwise import (
    ACCURACY,
    QUIET,
    clarabel_impulses,
    compare,
    judged,
    part_of,
    solve,
)

GRAVITY = 10.0  # the predicted velocities here are near 1, and time steps 0.01: g h is 0.1


def recorded(given: Problem, velocity: NDArray[np.float64] | None = None) -> core.Record:
    """Return a problem as a record of the fix, with some velocities for its solution."""
    bodies = given.bodies
    contacts = given.first.size
    arrays: dict[str, NDArray[Any]] = {
        "step": np.array(10.0),
        "timestep": np.array(given.timestep),
        "iterations": np.array(7.0),
        "id": np.arange(1, given.inverse_mass.size + 1),
        "inverse_mass": given.inverse_mass,
        "mass": given.mass,
        "predicted_velocity": given.predicted_velocity,
        "velocity": given.predicted_velocity if velocity is None else velocity,
        "id1": given.first + 1,
        "id2": given.second + 1 - (given.second < 0),  # the walls are number 1
        "normal": given.normal,
        "gap": given.gap,
        "compliance": np.zeros(contacts),
        "impulse": np.zeros(contacts),
        "impulse_guess": np.zeros(contacts),
    }
    if bodies.inverse_mass.size:
        order = [[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        arrays |= {
            "molecule": bodies.body + 1,
            "arm": bodies.arm,
            "body_molecule": np.arange(1, bodies.inverse_mass.size + 1),
            "body_inverse_mass": bodies.inverse_mass,
            "body_inverse_inertia": bodies.inverse_inertia[:, order[0], order[1]],
        }
    return core.Record(arrays)


PROBLEMS = {
    "column": column(np.ones(5), -0.1 * np.ones(5)),
    "heap": heap(3),
    "heap with bodies": heap(4, bodies=(2, 2, 3), radius=0.3),
    "rods of point masses": bricks(3, 5, length=3),
}


def test_a_column_at_rest() -> None:
    """Of a column that falls at g h nothing moves; errors count against g h and the impulses."""
    given = column(np.ones(5), -0.1 * np.ones(5))
    off = np.zeros((5, 3))
    off[4, 2], off[0, 0] = 0.004, 0.003
    found = compare(recorded(given, off), gravity=GRAVITY)
    # The impulses are 5, 4, 3, 2 and 1 times 0.1: 9 on the lowest sphere, 1 on the highest.
    assert found.error == pytest.approx([0.03, 0, 0, 0, 0.04], abs=1e-8)
    assert found.allowed == pytest.approx(QUIET)
    assert found.ratio.max() == pytest.approx(2, abs=1e-6)
    faster = compare(recorded(column(np.ones(5), -10 * np.ones(5)), off), gravity=GRAVITY)
    assert faster.allowed == pytest.approx(ACCURACY * 100 * np.array([9, 7, 5, 3, 1]))


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_residual_is_that_of_the_solver(name: str) -> None:
    """NumPy finds the velocities and the residual that the package finds."""
    record = recorded(PROBLEMS[name])
    impulse = np.random.default_rng(1).uniform(0, 1, record.problem.gap.size)
    residual = core.residual(record.problem, impulse)
    assert judged(record, impulse, 0).residual == pytest.approx(max(residual), rel=1e-12)


@pytest.mark.parametrize("name", PROBLEMS)
def test_no_velocity_is_off_by_more_than_the_bound(name: str) -> None:
    """Rough solutions, and Clarabel's, are off the deep one by less than their own bounds."""
    record = recorded(PROBLEMS[name])
    deep = solve(record, GRAVITY)
    assert deep.bound <= 1e-5
    impulses = [
        core.project(record.problem, core.Limits(tolerance * record.problem.timestep)).impulse
        for tolerance in (1e-3, 1e-4, 1e-6)
    ]
    for impulse in [*impulses, clarabel_impulses(record, GRAVITY)]:
        rough = judged(record, impulse, 0)
        off = compare(
            core.Record({**record.arrays, "velocity": rough.velocity}),
            gravity=GRAVITY,
            exact=deep,
        )
        assert off.error.max() * off.unit <= rough.bound + deep.bound


def test_a_part_is_solved_as_the_whole() -> None:
    """Two columns in one record: each half alone has the velocities that it has in the whole."""
    one = recorded(column(np.ones(3), [-1.0, -2.0, -4.0]))
    arrays = {
        name: np.concatenate([values, values]) if values.ndim else values
        for name, values in one.arrays.items()
    }
    below = one.arrays["id2"]
    arrays |= {
        "id": np.arange(1, 7),
        "id1": np.concatenate([one.arrays["id1"], one.arrays["id1"] + 3]),
        "id2": np.concatenate([below, np.where(below < 0, below, below + 3)]),
        "gap": np.array([0, 0, 0, 0.01, 0, 0.02]),
    }
    two = core.Record(arrays)
    upper = np.arange(6) >= 3
    whole = solve(two, GRAVITY).velocity
    for half in (upper, ~upper):
        assert solve(part_of(two, half), GRAVITY).velocity == pytest.approx(whole[half], abs=1e-9)
    with pytest.raises(ValueError, match="with others"):
        part_of(two, np.arange(6) >= 2)
