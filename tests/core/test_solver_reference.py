"""The solvers against an interior-point method, the largest eigenvalue against LAPACK."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lammps_inelastic import core
from tests.helpers.contact_problems import (
    Problem,
    assert_within,
    bricks,
    column,
    cubic_crystal,
    dense_crystal,
    heap,
    problem,
    row,
)
from tests.helpers.reference_solver import reference

# [diameters] A ten-thousand-millionth of one step's motion, not far above what float64 resolves.
TOLERANCE = 1e-13


def three_times(given: Problem) -> Problem:
    return given.with_contacts(np.repeat(np.arange(given.gap.size), 3))


def lopsided(given: Problem, seed: int) -> Problem:
    """Give the bodies inertias that have nothing to do with where their spheres are."""
    root = np.random.default_rng(seed).normal(size=given.bodies.inverse_inertia.shape)
    inertia = root @ root.transpose(0, 2, 1) + np.eye(3)
    return replace(given, bodies=replace(given.bodies, inverse_inertia=inertia))


PAIRS = [2] * 25  # and 10 single spheres
MIXED = [2] * 8 + [3] * 8 + [4] * 8  # and 28 single spheres

PROBLEMS = {
    **{f"heap {seed}": heap(seed) for seed in range(5)},
    **{f"overlapping {seed}": heap(seed, overlap=0.01) for seed in range(5)},
    "large": heap(5, particles=200, overlap=0.01),
    "without a floor": heap(6, floor=False, overlap=0.01),
    "frozen": heap(7, frozen=10),
    "mass ratio 100": heap(8, overlap=0.01, mass_ratio=1e2),
    "mass ratio 1e6": heap(9, mass_ratio=1e6),
    "every contact three times": three_times(heap(10, overlap=0.01)),
    "crystal on a floor": cubic_crystal(4, 11),
    "crystal in a box": cubic_crystal(4, 12, walls=6),
    "dense crystal": dense_crystal(5, 13),
    "dense crystal, every contact three times": three_times(dense_crystal(4, 14)),
    **{f"dimers, overlapping {k}": heap(20 + k, bodies=PAIRS, overlap=0.002) for k in range(3)},
    **{f"solid dimers {k}": heap(23 + k, bodies=PAIRS, radius=0.5) for k in range(3)},
    **{f"lopsided dimers {k}": lopsided(heap(43 + k, bodies=PAIRS), k) for k in range(3)},
    **{f"trimers {k}": heap(26 + k, bodies=[3] * 18) for k in range(3)},
    **{f"tetrahedra {k}": heap(29 + k, bodies=[4] * 13) for k in range(3)},
    **{f"mixed, frozen {k}": heap(32 + k, 100, bodies=MIXED, frozen=8) for k in range(3)},
    "mixed without a floor": heap(35, 100, bodies=MIXED, radius=0.5, floor=False, overlap=0.002),
    "mixed, mass ratio 100": heap(36, 100, bodies=MIXED, mass_ratio=1e2),
    "mixed, mass ratio 1e6": heap(37, 100, bodies=MIXED, mass_ratio=1e6),
    "mixed, every contact three times": three_times(heap(38, 100, bodies=MIXED)),
    "bricks on a floor": bricks(4, 39, length=2),
    "rods in a box": bricks(6, 40, length=3, radius=0.5, walls=6),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_velocities_of_an_interior_point_method(name: str) -> None:
    given = PROBLEMS[name]
    velocity, _ = reference(given)
    projection = given.project(TOLERANCE)
    assert projection.converged
    # The interior-point method's own error: the root of its duality gap, 1e-11 of the energy.
    assert_within(projection.velocity, velocity, 1e-6 * given.fastest)


@pytest.mark.parametrize("name", [name for name in PROBLEMS if "overlapping" in name])
def test_impulses_of_an_interior_point_method(name: str) -> None:
    # Only where they are unique: the pressed contacts are independent.
    given = PROBLEMS[name]
    _, impulse = reference(given)
    projection = given.project(TOLERANCE)
    pressed = projection.impulse > 0
    softest = np.linalg.eigvalsh(given.delassus()[np.ix_(pressed, pressed)])[0]
    assert softest > 1e-6
    # A (lambda - lambda') = w - w', of which both solvers leave less than ten times TOLERANCE.
    assert_within(projection.impulse, impulse, 10 * TOLERANCE * pressed.sum() / softest)


@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
@pytest.mark.parametrize("name", ["overlapping 0", "dense crystal", "mixed, frozen 0"])
def test_springs(name: str, solver: core.Solver) -> None:
    """Every other contact is a spring, soft or stiff; their impulses are unique."""
    given = PROBLEMS[name]
    diagonal = np.diag(given.delassus())
    softness = np.random.default_rng(5).choice([0.0, 1e-3, 0.03, 1.0], given.gap.size)
    compliance = softness * diagonal
    velocity, impulse = reference(given, compliance)
    projection = given.project(TOLERANCE, solver=solver, compliance=compliance)
    assert projection.converged
    assert_within(projection.velocity, velocity, 1e-6 * given.fastest)
    springs = compliance > 0
    # The opening of a spring is known to 1e-6 of the fastest in a step, and its gap to TOLERANCE.
    accuracy = (2e-6 * given.fastest * given.timestep + TOLERANCE) / compliance[springs].min()
    assert_within(projection.impulse[springs], impulse[springs], accuracy)
    # With impulses that are right its end differs from that of a rigid contact.
    rigid, _ = reference(given)
    assert np.abs(velocity - rigid).max() > 1e-4 * given.fastest


@pytest.mark.parametrize(
    ("name", "solver"),
    [(name, solver) for name in PROBLEMS for solver in ("sweeps", "apgd")]
    + [(name, "uzawa") for name in ("overlapping 0", "mixed, frozen 0")],
)
def test_contacts_that_pull(name: str, solver: core.Solver) -> None:
    """Every other contact may pull, by more or less than it takes to hold it."""
    given = PROBLEMS[name]
    # What stops the two sides of a contact from the fastest velocity.
    strength = given.fastest * given.timestep / np.diag(given.delassus())
    parts = np.random.default_rng(6).choice([0.0, 0.05, 0.3, 3.0], given.gap.size)
    least = -parts * strength
    velocity, _ = reference(given, least=least)
    projection = given.project(TOLERANCE, solver=solver, least_impulse=least)
    assert projection.converged
    assert projection.feasibility <= TOLERANCE
    # The interior-point method's own error, as for contacts that only push.
    assert_within(projection.velocity, velocity, 1e-6 * given.fastest)
    assert (projection.impulse >= least).all()
    holding = (least < 0) & (projection.impulse > least)
    assert holding.any()
    assert np.abs(given.gap_at_end(projection.velocity)[holding]).max() <= 2 * TOLERANCE
    assert (projection.impulse < 0).any()
    # With contacts that only push the velocities are others, unless nothing can move in a box.
    pushed, _ = reference(given)
    changed = np.abs(velocity - pushed).max() > 1e-4 * given.fastest
    assert changed != ("in a box" in name)


@pytest.mark.parametrize("name", ["overlapping 0", "mixed, frozen 0"])
def test_uzawa_gives_the_same_velocities(name: str) -> None:
    given = PROBLEMS[name]
    velocity, _ = reference(given)
    projection = given.project(TOLERANCE, solver="uzawa")
    assert projection.converged
    assert_within(projection.velocity, velocity, 1e-6 * given.fastest)


# Of the largest eigenvalue, relative: documented as "about 1e-3".
EIGENVALUE_ACCURACY = 2e-3


def largest_eigenvalue(given: Problem) -> float:
    return core.largest_eigenvalue(given.for_core())


@pytest.mark.parametrize(
    "given",
    [*(given for name, given in PROBLEMS.items() if "overlapping" not in name)]
    + [column(np.ones(count), np.zeros(count)) for count in (3, 10, 30, 100)],
    ids=[*(name for name in PROBLEMS if "overlapping" not in name)]
    + [f"column of {count}" for count in (3, 10, 30, 100)],
)
def test_largest_eigenvalue(given: Problem) -> None:
    estimate = largest_eigenvalue(given)
    exact = np.linalg.eigvalsh(given.delassus())[-1]
    # A Rayleigh quotient is never above the largest eigenvalue, except for rounding.
    assert (1 - EIGENVALUE_ACCURACY) * exact <= estimate <= (1 + 1e-13) * exact


def test_largest_eigenvalues_known_by_hand() -> None:
    timestep = 0.01
    one = problem([(0, 0, 0)], [4], [(0, -1, (0, 0, 1), 0)])
    assert_within(largest_eigenvalue(one), timestep / 4, 1e-17)  # one rounding of 0.0025
    pair = problem([(0, 0, 0)] * 2, [4, 1], [(0, 1, (0, 0, 1), 0)])
    assert_within(largest_eigenvalue(pair), timestep * 1.25, 1e-17)  # the same
    three = row([1, 1, 1], [0, 0, 0])  # h [[2, -1], [-1, 2]]
    assert_within(largest_eigenvalue(three), 3 * timestep, EIGENVALUE_ACCURACY * 3 * timestep)
    assert largest_eigenvalue(problem([], [], [])) == 0


def test_largest_eigenvalue_of_one_contact_among_many() -> None:
    # Its share of the start vector is below 1e-4, the change of the estimate to stop at.
    pairs = 20_000
    contacts = [(2 * k, 2 * k + 1, (0, 0, 1), 0) for k in range(pairs)]
    contacts.append((2 * pairs, -1, (0, 0, 1), 0))
    mass = np.ones(2 * pairs + 1)
    mass[-1] = 0.25
    given = problem(np.zeros((mass.size, 3)), mass, contacts, timestep=1.0)
    assert_within(largest_eigenvalue(given), 4, 4 * EIGENVALUE_ACCURACY)
