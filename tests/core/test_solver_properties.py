"""What must hold for any contact problem, on random ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contact_problems import WALL, Problem, assert_within, cubic_crystal, dense_crystal, heap
from lammps_inelastic import core

# [diameters] One step's motion is 0.01.
TOLERANCE = 1e-10
# Velocities and impulses near 1 (up to 200 for large mass ratios), after sums of about 100 terms.
ROUNDING = 1e-12

PROBLEMS = {
    "heap": heap(1),
    "heap without a floor": heap(2, floor=False),
    "overlapping": heap(3, overlap=0.01),
    "overlapping without a floor": heap(4, floor=False, overlap=0.01),
    "with frozen ones": heap(5, frozen=8),
    "mass ratio 100": heap(6, mass_ratio=100.0),
    "large": heap(7, particles=200),
    "crystal": cubic_crystal(4, 8),
    "crystal in a box": cubic_crystal(4, 9, walls=6),
    "dense crystal": dense_crystal(5, 10),
}
IN_FREE_SPACE = ["heap without a floor", "overlapping without a floor"]


@pytest.fixture(params=PROBLEMS.values(), ids=PROBLEMS.keys())
def given(request) -> Problem:
    return request.param


@pytest.fixture(params=["apgd", "uzawa"])
def solver(request) -> str:
    return request.param


def test_both_residuals_meet_the_tolerance(given):
    for tolerance in (1e-3, 1e-6, 1e-13):
        projection = given.project(tolerance)
        assert projection.converged
        assert projection.feasibility <= tolerance
        assert projection.complementarity <= tolerance


def test_residuals_by_independent_formulas(given, solver):
    for max_iterations in (0, 1, 10, 100_000):
        projection = given.project(TOLERANCE, solver=solver, max_iterations=max_iterations)
        reported = projection.feasibility, projection.complementarity
        # Gaps are sums of numbers near h V = 0.01.
        assert_within(reported, given.residual(projection.impulse), 1e-15)
        assert reported == core.residual(
            *given.arguments, projection.impulse, timestep=given.timestep
        )


def test_velocity_belongs_to_the_impulses(given, solver):
    projection = given.project(TOLERANCE, solver=solver, max_iterations=10)
    assert_within(projection.velocity, given.velocity(projection.impulse), ROUNDING)


def test_impulses_are_never_negative(given, solver):
    for max_iterations in (1, 2, 3, 10, 100_000):
        projection = given.project(TOLERANCE, solver=solver, max_iterations=max_iterations)
        assert projection.impulse.min() >= 0


def test_max_iterations(given, solver):
    for max_iterations in (0, 1, 7):
        projection = given.project(1e-14, solver=solver, max_iterations=max_iterations)
        assert projection.iterations == max_iterations
        assert not projection.converged
    needed = given.project(TOLERANCE, solver=solver).iterations
    exactly = given.project(TOLERANCE, solver=solver, max_iterations=needed)
    assert exactly.converged
    assert exactly.iterations == needed


@pytest.mark.parametrize("name", IN_FREE_SPACE)
def test_momentum_is_kept(name, solver):
    given = PROBLEMS[name]
    for max_iterations in (3, 100_000):
        projection = given.project(TOLERANCE, solver=solver, max_iterations=max_iterations)
        assert_within(
            given.mass @ projection.velocity, given.mass @ given.predicted_velocity, ROUNDING
        )


def test_kinetic_energy_does_not_rise(given, solver):
    """T(V) = T(V*) + sum lambda (w - gap) / h - 1/2 (V - V*)^T M (V - V*).

    Because V = V* + M^-1 G^T lambda gives T(V*) = T(V) - lambda . G V + 1/2 (V - V*)^T M (V - V*),
    and G V = (w - gap) / h. With w <= complementarity wherever lambda > 0 and nothing moving that
    is frozen, T can rise only by what overlaps (gap < 0) and the residual allow.
    """
    projection = given.project(TOLERANCE, solver=solver)
    impulse = projection.impulse
    before = given.kinetic_energy(given.predicted_velocity)
    after = given.kinetic_energy(projection.velocity)
    pushed_out = impulse @ np.maximum(-given.gap, 0) / given.timestep
    residuals_share = impulse.sum() * projection.complementarity / given.timestep
    lost = given.kinetic_energy(projection.velocity - given.predicted_velocity)
    rounding = ROUNDING * before
    assert after <= before + pushed_out + residuals_share - lost + rounding

    gap_at_end = given.gap_at_end(projection.velocity)
    work = impulse @ (gap_at_end - given.gap) / given.timestep
    assert_within(after, before + work - lost, rounding)


def test_kinetic_energy_falls_without_overlaps(solver):
    given = PROBLEMS["heap"]
    projection = given.project(TOLERANCE, solver=solver)
    before = given.kinetic_energy(given.predicted_velocity)
    # Not by next to nothing either: most particles of a heap meet somebody.
    assert given.kinetic_energy(projection.velocity) < 0.95 * before


# Where the order of sums may matter, a fixed number of iterations is compared: enough for all of
# the solver's decisions to have been taken, few enough for rounding not to have grown.
ITERATIONS = 30


def after_some_iterations(given: Problem, **options) -> core.Projection:
    projection = given.project(1e-300, max_iterations=ITERATIONS, **options)
    assert projection.iterations == ITERATIONS
    return projection


@pytest.mark.parametrize("seed", range(3))
def test_order_of_contacts_does_not_matter(given, seed):
    order = np.random.default_rng(seed).permutation(given.gap.size)
    usual = after_some_iterations(given)
    shuffled = after_some_iterations(given.with_contacts(order))
    assert_within(shuffled.velocity, usual.velocity, ROUNDING)
    assert_within(shuffled.impulse, usual.impulse[order], ROUNDING)


@pytest.mark.parametrize("seed", range(3))
def test_names_of_particles_do_not_matter(given, seed):
    order = np.random.default_rng(seed).permutation(given.inverse_mass.size)
    new_name = np.argsort(order)
    usual = after_some_iterations(given)
    renamed = after_some_iterations(
        replace(
            given,
            predicted_velocity=given.predicted_velocity[order],
            inverse_mass=given.inverse_mass[order],
            first=new_name[given.first],
            second=np.where(given.second == WALL, WALL, new_name[given.second]),
        )
    )
    assert_within(renamed.velocity, usual.velocity[order], ROUNDING)
    assert_within(renamed.impulse, usual.impulse, ROUNDING)


def test_sides_of_a_contact_do_not_matter(given):
    turned = (given.second != WALL) & (np.arange(given.gap.size) % 2 == 0)
    usual = after_some_iterations(given)
    swapped = after_some_iterations(
        replace(
            given,
            first=np.where(turned, given.second, given.first),
            second=np.where(turned, given.first, given.second),
            normal=np.where(turned[:, None], -given.normal, given.normal),
        )
    )
    assert_within(swapped.velocity, usual.velocity, ROUNDING)
    assert_within(swapped.impulse, usual.impulse, ROUNDING)


def test_galilean_invariance(given, solver):
    # Walls move along: what they go in the step is taken off their gaps.
    drift = np.array([3.0, -2.0, 1.0])
    wall = given.second == WALL
    moved_by_wall = np.where(wall, given.timestep * given.normal @ drift, 0)
    usual = after_some_iterations(given, solver=solver)
    moving = after_some_iterations(
        replace(
            given,
            predicted_velocity=given.predicted_velocity + drift,
            gap=given.gap - moved_by_wall,
        ),
        solver=solver,
    )
    assert_within(moving.velocity - drift, usual.velocity, ROUNDING)
    assert_within(moving.impulse, usual.impulse, ROUNDING)


def test_units_of_powers_of_two_change_no_bit(given, solver):
    length, time, mass = 2.0**-20, 2.0**9, 2.0**31
    speed = length / time
    usual = given.project(TOLERANCE, solver=solver)
    scaled = replace(
        given,
        predicted_velocity=given.predicted_velocity * speed,
        inverse_mass=given.inverse_mass / mass,
        gap=given.gap * length,
        timestep=given.timestep * time,
    ).project(TOLERANCE * length, solver=solver)
    assert scaled.iterations == usual.iterations
    assert np.array_equal(scaled.velocity, usual.velocity * speed)
    assert np.array_equal(scaled.impulse, usual.impulse * mass * speed)
    assert scaled.feasibility == usual.feasibility * length
    assert scaled.complementarity == usual.complementarity * length


def test_own_result_as_first_guess_needs_no_iteration(given):
    first = given.project(TOLERANCE)
    second = given.project(TOLERANCE, impulse=first.impulse)
    assert second.iterations == 0
    assert np.array_equal(second.impulse, first.impulse)
    assert np.array_equal(second.velocity, first.velocity)


def test_same_answer_from_any_first_guess(given):
    """||V - V'||^2_M = (lambda - lambda') . (w - w') / h, and every product of an impulse with an
    end-of-step gap is at most sum lambda times the residual.
    """
    guess = np.random.default_rng(0).uniform(0, 2, given.gap.size)
    first = given.project(1e-14)
    second = given.project(1e-14, impulse=guess)
    assert second.converged
    total = first.impulse.sum() + second.impulse.sum()
    apart = np.sqrt(2 * given.kinetic_energy(first.velocity - second.velocity))
    assert apart <= np.sqrt(2e-14 * total / given.timestep)


def test_uzawa_starts_from_zero(given):
    guess = np.random.default_rng(0).uniform(0, 2, given.gap.size)
    cold = given.project(TOLERANCE, solver="uzawa")
    guessed = given.project(TOLERANCE, solver="uzawa", impulse=guess)
    assert guessed.iterations == cold.iterations
    assert np.array_equal(guessed.impulse, cold.impulse)


def test_same_bits_twice(given, solver):
    once, again = (given.project(TOLERANCE, solver=solver) for _ in range(2))
    assert np.array_equal(once.velocity, again.velocity)
    assert np.array_equal(once.impulse, again.impulse)


@pytest.mark.parametrize("name", ["dense crystal", "crystal in a box"])
def test_acceleration_saves_iterations(name):
    # Measured: 82 and 11 times fewer. Without restarts or with a wrong momentum apgd converges too.
    accelerated = PROBLEMS[name].project(TOLERANCE)
    plain = PROBLEMS[name].project(TOLERANCE, solver="uzawa")
    assert accelerated.iterations < plain.iterations / 5


@pytest.mark.parametrize("seed", range(3))
def test_mass_ratio_of_a_million(seed):
    given = heap(seed, mass_ratio=1e6)
    projection = given.project(TOLERANCE)
    assert projection.converged
    assert projection.impulse.min() >= 0
    # Gaps are sums of impulses up to 200 times inverse masses up to 1e3 times h, within rounding.
    reported = projection.feasibility, projection.complementarity
    assert_within(reported, given.residual(projection.impulse), 1e-12)


def test_results_are_not_shared():
    projection = PROBLEMS["heap"].project(TOLERANCE)
    projection.velocity[:] = np.nan
    assert np.isfinite(projection.velocity).all()
