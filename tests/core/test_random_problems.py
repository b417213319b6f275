"""The projection on random problems of any kind, degenerate ones too, against Clarabel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.helpers.contact_problems import (
    WALL,
    Floats,
    Problem,
    assert_within,
    in_bodies,
    no_bodies,
)
from tests.helpers.reference_solver import NotSolvedError, reference

# The same examples on every machine.
RANDOM = settings(derandomize=True, deadline=None, max_examples=400)

TIMESTEP = 0.01
# [diameters] One step's motion is 0.01.
TOLERANCE = 1e-10
# Of sums of up to 100 products of numbers near 1, and of velocities after 1,000s of iterations.
ROUNDING = 1e-12

AXES = np.vstack([np.eye(3), -np.eye(3)])


@st.composite
def problems(
    draw: st.DrawFn, mass_decades: float = 2.0, bodies: bool = False
) -> tuple[Problem, Floats]:
    """Particles at random places, contacts between any of them; and velocities that are allowed.

    The normals are not those of spheres in space, so that there are more contacts than degrees of
    freedom, loops, the same contact several times, and contacts that pull against one another. The
    gaps are such that the velocities that are returned leave none of them below zero.
    """
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    count = draw(st.integers(1, 10))
    mass = 10 ** random.uniform(-mass_decades / 2, mass_decades / 2, count)
    inverse_mass = np.where(random.random(count) < draw(st.sampled_from([0, 0.3])), 0, 1 / mass)
    position = random.uniform(0, 2, (count, 3))
    number = draw(st.integers(0, 4 * count))
    first = random.integers(count, size=number)
    second = random.integers(WALL, count, size=number)
    if draw(st.booleans()):
        # A chain that hangs on a wall.
        chain = np.arange(count)
        first, second = np.append(first, chain), np.append(second, chain - 1)
    moves = np.append(inverse_mass, 0) > 0
    keep = (first != second) & (moves[first] | moves[second])
    first, second = first[keep], second[keep]
    normal = random.normal(size=(first.size, 3))
    if draw(st.booleans()):
        normal = AXES[random.integers(6, size=first.size)]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    predicted = np.where(inverse_mass[:, None] > 0, random.uniform(-1, 1, (count, 3)), 0)
    chosen = Problem(
        predicted,
        inverse_mass,
        first,
        second,
        normal,
        np.zeros(first.size),
        TIMESTEP,
        no_bodies(count),
    )
    free = np.flatnonzero(inverse_mass > 0)
    if bodies:
        assume(free.size >= 2)
        size = draw(st.integers(2, min(4, free.size)))
        groups = [free[k : k + size] for k in range(0, free.size - size + 1, size)]
        chosen = in_bodies(chosen, position, groups, draw(st.sampled_from([0.0, 0.5])))
    times = random.integers(1, draw(st.sampled_from([1, 4])) + 1, chosen.gap.size)
    chosen = chosen.with_contacts(np.repeat(np.arange(chosen.gap.size), times))
    # A motion that the bodies can make: what random impulses on all particles would give them.
    root = chosen.root()
    allowed = (root @ random.normal(size=root.shape[1])).reshape(-1, 3)
    slack = random.uniform(0, TIMESTEP, chosen.gap.size)
    slack[random.random(chosen.gap.size) < 0.5] = 0
    moved = TIMESTEP * chosen.jacobian() @ allowed.ravel()
    return replace(chosen, gap=slack - moved), allowed


def assert_projected(chosen: Problem, max_iterations: int = 100_000) -> None:
    """Look at the conditions for the nearest velocities, and compare with Clarabel's.

    With the end-of-step gaps w, w' of impulses l, l': h ||V - V'||^2_M = (l - l') . (w - w'), and
    at the exact solution all four products are zero or, for -l . w', negative.
    """
    projection = chosen.project(TOLERANCE, max_iterations=max_iterations)
    assert projection.converged
    rounding = ROUNDING * scale(chosen)
    assert_within(projection.velocity, chosen.velocity(projection.impulse), rounding)
    gap = chosen.gap_at_end(projection.velocity)
    assert gap.min(initial=0) >= -TOLERANCE - TIMESTEP * rounding
    assert gap[projection.impulse > 0].max(initial=0) <= TOLERANCE + TIMESTEP * rounding
    assert (projection.impulse >= 0).all()
    try:
        velocity, impulse = reference(chosen)
    except NotSolvedError:
        return
    other_gap = chosen.gap_at_end(velocity)
    ours = projection.impulse @ np.maximum(gap, 0) - impulse.sum() * gap.min(initial=0)
    others = np.abs(impulse @ other_gap) - projection.impulse.sum() * other_gap.min(initial=0)
    # It stops at 1e-11 of the energy; otherwise the comparison would say nothing.
    assert others <= 1e-9 * max(1.0, 2 * chosen.kinetic_energy(chosen.predicted_velocity))
    apart = 2 * chosen.kinetic_energy(projection.velocity - velocity)
    assert apart <= (ours + others) / TIMESTEP + rounding**2


def scale(chosen: Problem) -> float:
    """The fastest velocity there may be: light particles are thrown by heavy ones."""
    masses = chosen.mass[chosen.mass > 0]
    return float(np.sqrt(masses.max(initial=1) / masses.min(initial=1))) * 10


@RANDOM
@given(problems())
def test_free_particles(drawn: tuple[Problem, Floats]) -> None:
    assert_projected(drawn[0])


@RANDOM
@given(problems(bodies=True))
def test_bodies(drawn: tuple[Problem, Floats]) -> None:
    assert_projected(drawn[0])


@pytest.mark.slow
@RANDOM
@given(problems(mass_decades=6.0))
def test_masses_of_a_million_to_one(drawn: tuple[Problem, Floats]) -> None:
    assert_projected(drawn[0], max_iterations=1_000_000)


@settings(RANDOM, max_examples=50)
@given(problems())
def test_uzawa(drawn: tuple[Problem, Floats]) -> None:
    """It looks at the overlaps only: at its end the gaps under a force may be anything."""
    chosen, allowed = drawn
    projection = chosen.project(TOLERANCE, solver="uzawa", max_iterations=1_000_000)
    assert projection.converged
    assert chosen.gap_at_end(projection.velocity).min(initial=0) >= -TOLERANCE - 1e-15
    # From zero impulses it goes towards the solution: never further than any allowed velocity.
    far = chosen.kinetic_energy(chosen.predicted_velocity - projection.velocity)
    most = chosen.kinetic_energy(chosen.predicted_velocity - allowed)
    assert far <= most * (1 + 1e-6) + 1e-9


@RANDOM
@given(problems(), st.integers(0, 2**32), st.floats(1e-6, 1.0))
def test_what_cannot_be_is_never_called_solved(
    drawn: tuple[Problem, Floats], seed: int, depth: float
) -> None:
    """A particle between two walls that are closer than it is wide."""
    chosen, _ = drawn
    random = np.random.default_rng(seed)
    movable = np.flatnonzero(chosen.inverse_mass > 0)
    assume(movable.size)
    squeezed = random.choice(movable)
    normal = random.normal(size=3)
    normal /= np.linalg.norm(normal)
    infeasible = replace(
        chosen,
        first=np.append(chosen.first, [squeezed, squeezed]),
        second=np.append(chosen.second, [WALL, WALL]),
        normal=np.vstack([chosen.normal, normal, -normal]),
        gap=np.append(chosen.gap, [0.0, -depth]),
    )
    for solver in ("sweeps", "apgd", "uzawa"):
        projection = infeasible.project(TOLERANCE, solver=solver, max_iterations=2000)
        assert not projection.converged
        # Half of it at least must stay, at one wall or at the other.
        assert projection.feasibility >= depth / 2 * (1 - 1e-9)
        assert np.isfinite(projection.velocity).all()
        assert np.isfinite(projection.impulse).all()
        assert (projection.impulse >= 0).all()
