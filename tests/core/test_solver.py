"""The solvers where the answer can be worked out by hand, and a few that must not be solved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from scipy.optimize import isotonic_regression

from lammps_inelastic import core
from tests.helpers.contact_problems import (
    UP,
    WALL,
    Contact,
    Floats,
    Problem,
    assert_within,
    column,
    in_bodies,
    problem,
    residual_left,
    row,
)

# Solves a problem; returns the projection and how accurate its speeds are.
Solve = Callable[[Problem], tuple[core.Projection, float]]
# [diameters] 1e-9 of one step's motion, far above the rounding of gaps near 0.01.
TOLERANCE = 1e-11
# Velocities and impulses near 1 after a few dozen additions.
ROUNDING = 1e-14


@pytest.fixture(params=["sweeps", "apgd", "uzawa"])
def solve(request: pytest.FixtureRequest) -> Solve:
    """Return a function that solves a problem and says how accurate the result is.

    It gives the projection and the speed to which the relative velocity of a pressed contact is
    right: what is left of the residuals in one step (Uzawa's complementarity can be any number).
    """

    def solved(given: Problem) -> tuple[core.Projection, float]:
        projection = given.project(TOLERANCE, solver=request.param)
        assert projection.converged
        assert projection.feasibility <= TOLERANCE
        if request.param != "uzawa":
            assert projection.complementarity <= TOLERANCE
        return projection, residual_left(projection) / given.timestep + ROUNDING

    return solved


@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
def test_sphere_on_a_spring(solver: core.Solver) -> None:
    # gap + h V + C lambda = 0 and V = -3 + lambda / m: lambda = 0.02 / (h / m + C).
    given = problem([(0, 0, -3)], [2], [(0, WALL, UP, 0.01)], timestep=0.01)
    projection = given.project(TOLERANCE, solver=solver, compliance=np.array([0.005]))
    assert projection.converged
    assert_within(projection.impulse, [2], 2 * TOLERANCE / 0.01)
    assert_within(projection.velocity, [[0, 0, -2]], 2 * TOLERANCE / 0.01)
    # The compliance times the impulse is part of what is judged.
    assert projection.feasibility <= TOLERANCE


@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
@pytest.mark.parametrize(
    ("least", "impulse", "speed"),
    [(0, 0, 3), (-4, -4, 1), (-6, -6, 0), (-60, -6, 0)],
    ids=["pushes only", "lets go", "just holds", "holds"],
)
def test_sphere_held_by_the_floor(
    solver: core.Solver, least: float, impulse: float, speed: float
) -> None:
    # m V = 2 3 upwards, of which the floor takes at most -l.
    given = problem([(0, 0, 3)], [2], [(0, WALL, UP, 0)], timestep=0.01)
    projection = given.project(TOLERANCE, solver=solver, least_impulse=np.array([least], float))
    assert projection.converged
    assert_within(projection.velocity, [[0, 0, speed]], 2 * TOLERANCE / 0.01)
    assert_within(projection.impulse, [impulse], 4 * TOLERANCE / 0.01)


def test_sphere_falling_on_the_floor(solve: Solve) -> None:
    # It may use up the gap: V = -gap / h = -1, and m (-1 - (-3)) stops the rest.
    projection, accuracy = solve(problem([(0.5, 0, -3)], [2], [(0, WALL, UP, 0.01)]))
    assert_within(projection.velocity, [[0.5, 0, -1]], accuracy)
    assert_within(projection.impulse, [4], 2 * accuracy)


def test_uzawa_solves_one_contact_in_one_step() -> None:
    # Its step, one over the only eigenvalue, is exact.
    given = problem([(0, 0, -1), (0, 0, 1)], [1, 3], [(0, 1, UP, 0)])
    projection = given.project(TOLERANCE, solver="uzawa")
    assert projection.iterations == 1
    assert_within(projection.velocity, [(0, 0, 0.5)] * 2, ROUNDING)


def test_overlap_is_pushed_out(solve: Solve) -> None:
    # An overlap of 0.02 is undone in one step of 0.01: speed 2.
    projection, accuracy = solve(problem([(0, 0, 0)], [3], [(0, WALL, UP, -0.02)]))
    assert_within(projection.velocity, [[0, 0, 2]], accuracy)
    assert_within(projection.impulse, [6], 3 * accuracy)


def test_free_flight_is_untouched(solve: Solve) -> None:
    velocity = [(0.1, -0.2, 0.3), (1 / 3, 1e-300, -1e10)]
    projection, _ = solve(problem(velocity, [1, 2], []))
    assert np.array_equal(projection.velocity, velocity)
    assert projection.impulse.shape == (0,)
    assert projection.iterations == 0


def test_contact_out_of_reach_is_untouched(solve: Solve) -> None:
    # Speed 3 uses up 0.03 of the gap of 0.04.
    projection, _ = solve(problem([(0.1, 0.2, -3)], [1], [(0, WALL, UP, 0.04)]))
    assert np.array_equal(projection.velocity, [(0.1, 0.2, -3)])
    assert np.array_equal(projection.impulse, [0])
    assert projection.iterations == 0


def test_nothing_at_all(solve: Solve) -> None:
    projection, _ = solve(problem([], [], []))
    assert projection.velocity.shape == (0, 3)
    assert projection.impulse.shape == (0,)


@pytest.mark.parametrize(("light", "heavy"), [(1, 1), (1, 3), (1e-3, 1e3)])
def test_head_on_pair_moves_on_together(solve: Solve, light: float, heavy: float) -> None:
    given = problem([(2, 1, 0), (-1, 0, 0)], [light, heavy], [(1, 0, (1, 0, 0), 0)])
    projection, accuracy = solve(given)
    common = (2 * light - heavy) / (light + heavy)
    assert_within(projection.velocity, [(common, 1, 0), (common, 0, 0)], accuracy)
    # Their reduced mass changes its relative velocity from 3 to 0.
    reduced = light * heavy / (light + heavy)
    assert_within(projection.impulse, [3 * reduced], reduced * accuracy)


def test_head_on_pair_uses_up_the_gap(solve: Solve) -> None:
    # Each may go on at half of gap / h = 1.
    given = problem([(2, 0, 0), (-2, 0, 0)], [1, 1], [(1, 0, (1, 0, 0), 0.01)])
    projection, accuracy = solve(given)
    assert_within(projection.velocity, [(0.5, 0, 0), (-0.5, 0, 0)], accuracy)


@pytest.mark.parametrize("mass", [np.ones(10), np.linspace(1, 4, 7), [1, 0.1, 5, 0.1, 1]])
def test_column_carries_the_weight_above(solve: Solve, mass: Floats) -> None:
    mass = np.array(mass)
    fall = 0.1  # g h
    projection, accuracy = solve(column(mass, [-fall] * mass.size))
    # A sphere's velocity is the sum of the relative velocities below it.
    accuracy *= mass.size
    assert_within(projection.velocity, np.zeros((mass.size, 3)), accuracy)
    weight_above = fall * np.cumsum(mass[::-1])[::-1]
    assert_within(projection.impulse, weight_above, mass.sum() * accuracy)


def test_heavy_sphere_on_a_light_one() -> None:
    # A mass ratio of 1e6; only apgd, because Uzawa would take millions of iterations.
    projection = column([1e-6, 1], [0, -1]).project(TOLERANCE)
    assert projection.converged
    assert_within(projection.velocity, np.zeros((2, 3)), 2 * TOLERANCE / 0.01 + ROUNDING)
    assert_within(projection.impulse, [1, 1], 2 * TOLERANCE / 0.01 + ROUNDING)


@pytest.mark.parametrize("slopes", [(45, 45), (30, 60), (80, 20), (10, 10)])
def test_sphere_in_a_wedge(solve: Solve, slopes: tuple[float, float]) -> None:
    left, right = np.deg2rad(slopes)
    normals = np.array([(np.sin(left), 0, np.cos(left)), (-np.sin(right), 0, np.cos(right))])
    mass, fall = 2, 0.7
    projection, accuracy = solve(
        problem([(0, 0.3, -fall)], [mass], [(0, WALL, normal, 0) for normal in normals])
    )
    # Two relative velocities fix the two components across the wedge; no friction along it.
    inverse_norm = float(np.linalg.norm(np.linalg.inv(normals[:, ::2]), np.inf))
    assert_within(projection.velocity, [(0, 0.3, 0)], inverse_norm * accuracy)
    # Equilibrium of three forces: the law of sines.
    impulse = mass * fall * np.sin([right, left]) / np.sin(left + right)
    inverse_norm_of_forces = float(np.linalg.norm(np.linalg.inv(normals[:, ::2].T), np.inf))
    assert_within(
        projection.impulse, impulse, mass * inverse_norm_of_forces * inverse_norm * accuracy
    )


def test_sphere_leaves_the_wall_that_it_moves_away_from(solve: Solve) -> None:
    # Along the left wall of a wedge, down to nothing: only that wall pushes.
    left = (np.sqrt(0.5), 0, np.sqrt(0.5))
    right = (-np.sqrt(0.5), 0, np.sqrt(0.5))
    given = problem([(-1, 0, 0)], [1], [(0, WALL, left, 0), (0, WALL, right, 0)])
    projection, accuracy = solve(given)
    assert_within(projection.velocity, [(-0.5, 0, 0.5)], accuracy)
    assert_within(projection.impulse, [np.sqrt(0.5), 0], accuracy)


@pytest.mark.parametrize("count", [2, 5, 20])
def test_cradle_without_bounce_shares_the_momentum(solve: Solve, count: int) -> None:
    projection, accuracy = solve(row(np.ones(count), [1, *[0] * (count - 1)]))
    accuracy *= count  # relative velocities add up along the row
    assert_within(projection.velocity, [(1 / count, 0, 0)] * count, accuracy)
    # What passes each contact is the momentum of all spheres beyond it.
    beyond = np.arange(count - 1, 0, -1) / count
    assert_within(projection.impulse, beyond, count * accuracy)


@pytest.mark.parametrize("seed", range(5))
def test_row_of_random_speeds_is_isotonic_regression(solve: Solve, seed: int) -> None:
    # The nearest speeds that do not decrease along the row: SciPy pools adjacent violators.
    generator = np.random.default_rng(seed)
    mass, speed = generator.uniform(0.5, 2, 30), generator.uniform(-1, 1, 30)
    projection, accuracy = solve(row(mass, speed))
    expected = isotonic_regression(speed, weights=mass).x
    # Relative velocities add up along a pool of spheres; random speeds leave no contact undecided.
    assert_within(projection.velocity[:, 0], expected, speed.size * accuracy)


@pytest.mark.parametrize("dimers", [False, True])
def test_push_reaches_spheres_far_away(solve: Solve, dimers: bool) -> None:
    """Along a row with gaps: each is many tolerances wide until the one before it has closed."""
    # The first sphere would go on by 1. Those that it reaches end in contact: by momentum
    # k x - width (0 + 1 + ... + k - 1) = 1 with x how far the first one goes, and k as many as
    # still are pushed forward, x > width (k - 1).
    count, width, timestep = 60, 0.002, 0.01
    pushed = max(k for k in range(1, count) if width * k * (k - 1) / 2 < 1)
    reach = (1 + width * pushed * (pushed - 1) / 2) / pushed
    speeds = np.maximum(0, reach - width * np.arange(count)) / timestep
    speeds[pushed:] = 0
    contacts = [(k + 1, k, (1, 0, 0), width) for k in range(count - 1)]
    given = problem([(100, 0, 0)] + [(0, 0, 0)] * (count - 1), np.ones(count), contacts)
    if dimers:  # both spheres of a dimer are pushed: the same motion
        twice = problem(
            np.repeat(given.predicted_velocity, 2, axis=0),
            np.ones(2 * count),
            [(2 * a + side, 2 * b + side, n, gap) for a, b, n, gap in contacts for side in (0, 1)],
        )
        places = [(k, side, 0) for k in range(count) for side in (0, 1)]
        given = in_bodies(twice, places, [(2 * k, 2 * k + 1) for k in range(count)])
        speeds = np.repeat(speeds, 2)
    projection, accuracy = solve(given)
    # Relative velocities add up along the spheres in contact.
    assert_within(projection.velocity[:, 0], speeds, pushed * accuracy)


def test_frozen_particle_acts_like_a_wall(solve: Solve) -> None:
    velocity = [(0.2, 0.1, -3), (0, 0, 0)]
    on_particle, _ = solve(problem(velocity, [2, np.inf], [(0, 1, UP, 0.01)]))
    on_wall, _ = solve(problem(velocity, [2, np.inf], [(0, WALL, UP, 0.01)]))
    assert np.array_equal(on_particle.velocity, on_wall.velocity)
    assert np.array_equal(on_particle.impulse, on_wall.impulse)


def test_frozen_particle_keeps_its_velocity(solve: Solve) -> None:
    frozen = (0.3, 0, 0.7)
    # It comes from below, first as the second side of the contact, then as the first.
    down = (0, 0, -1)
    for contact in [(0, 1, UP, 0), (1, 0, down, 0)]:
        projection, accuracy = solve(problem([(0, 0, -1), frozen], [1, np.inf], [contact]))
        assert np.array_equal(projection.velocity[1], frozen)
        assert_within(projection.velocity[0], (0, 0, 0.7), accuracy)
        assert_within(projection.impulse, [1.7], accuracy)


def test_moving_wall_is_in_the_gap(solve: Solve) -> None:
    # A floor that rises at 0.7 will be 0.007 higher at the end of the step.
    projection, accuracy = solve(problem([(0, 0, -1)], [1], [(0, WALL, UP, -0.007)]))
    assert_within(projection.velocity, [(0, 0, 0.7)], accuracy)
    assert_within(projection.impulse, [1.7], accuracy)


def test_contact_given_three_times(solve: Solve) -> None:
    contact = (0, WALL, UP, 0.01)
    projection, accuracy = solve(problem([(0, 0, -3)], [2], [contact] * 3))
    assert_within(projection.velocity, [(0, 0, -1)], accuracy)
    assert_within(projection.impulse.sum(), 4, 2 * accuracy)
    assert np.all(projection.impulse >= 0)


@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
def test_no_room_is_not_converged(solver: core.Solver) -> None:
    # Two walls leave 0.01 less than a diameter: one overlap is at least half of that.
    given = problem([(0, 0, 0)], [1], [(0, WALL, UP, 0), (0, WALL, (0, 0, -1), -0.01)])
    projection = given.project(TOLERANCE, solver=solver, max_iterations=100)
    assert not projection.converged
    assert projection.iterations == 100
    assert projection.feasibility >= 0.005 - ROUNDING


def test_uzawa_looks_at_feasibility_only() -> None:
    # Ten equal floors make the first step small for the eleventh contact, a steep wall, which is
    # still pressed when the floors' push has lifted the sphere off it.
    steep = (np.sin(0.5), 0, np.cos(0.5))
    contacts = [(0, WALL, UP, -0.01)] * 10 + [(0, WALL, steep, -0.001)]
    given = problem([(0, 0, 0)], [1], contacts)
    tolerance = 1e-3
    uzawa = given.project(tolerance, solver="uzawa")
    assert uzawa.converged
    assert uzawa.feasibility <= tolerance
    assert uzawa.complementarity > 5 * tolerance
    apgd = given.project(tolerance)
    assert apgd.complementarity <= tolerance


def test_uzawa_with_one_stiff_contact_among_many() -> None:
    # The largest eigenvalue (a light sphere on the floor) hides behind 20,000 others (pairs at
    # rest); a step of twice 1 / L would make the light sphere bounce back at its own speed.
    pairs = 20_000
    contacts = [(2 * k, 2 * k + 1, UP, 0) for k in range(pairs)] + [(2 * pairs, WALL, UP, 0)]
    velocity = np.zeros((2 * pairs + 1, 3))
    velocity[-1, 2] = -1
    mass = np.ones(2 * pairs + 1)
    mass[-1] = 0.25
    projection = problem(velocity, mass, contacts).project(TOLERANCE, solver="uzawa")
    # The step may be wrong by as much as the eigenvalue's documented accuracy, about 1e-3.
    assert_within(projection.velocity[-1], (0, 0, 0), 2e-3)


def rod(
    count: int,
    contacts: Sequence[Contact],
    *,
    velocity: Any = (0, 0, -1),
    radius: float = 0.0,
) -> Problem:
    """Unit masses on the x axis, one apart and joined, that move like one."""
    position = [(k, 0, 0) for k in range(count)]
    given = problem([velocity] * count, [1] * count, contacts)
    return in_bodies(given, position, [range(count)], radius)


def test_dimer_hit_at_one_end(solve: Solve) -> None:
    # m / 2 moves and m d^2 / 2 turns as if the other end were not there.
    projection, accuracy = solve(rod(2, [(1, WALL, UP, 0)]))
    assert_within(projection.velocity, [(0, 0, -1), (0, 0, 0)], accuracy)
    assert_within(projection.impulse, [1], accuracy)


def test_solid_dimer_hit_at_one_end(solve: Solve) -> None:
    # Inertia 14/5 m r^2: mobility (1/2 + 5/14) / m at this end, (1/2 - 5/14) / m at the other.
    projection, accuracy = solve(rod(2, [(1, WALL, UP, 0)], radius=0.5))
    assert_within(projection.velocity, [(0, 0, -5 / 6), (0, 0, 0)], accuracy)
    assert_within(projection.impulse, [7 / 6], 2 * accuracy)


@pytest.mark.parametrize("radius", [0, 0.5])
def test_dimer_hit_along_its_axis(solve: Solve, radius: float) -> None:
    # Both stop, and what they do across goes on.
    given = rod(2, [(1, WALL, (-1, 0, 0), 0)], velocity=(1, 0.5, 0), radius=radius)
    projection, accuracy = solve(given)
    assert_within(projection.velocity, [(0, 0.5, 0)] * 2, accuracy)
    assert_within(projection.impulse, [2], 2 * accuracy)


@pytest.mark.parametrize("radius", [0, 0.5])
def test_rod_hit_at_its_centre(solve: Solve, radius: float) -> None:
    projection, accuracy = solve(rod(3, [(1, WALL, UP, 0)], radius=radius))
    assert_within(projection.velocity, np.zeros((3, 3)), accuracy)
    assert_within(projection.impulse, [3], 3 * accuracy)


def test_rod_of_five_hit_at_one_end(solve: Solve) -> None:
    # Inertia 10 m a^2, arm 2 a: mobility (1/5 + 4/10) / m; the speeds left are linear along it.
    projection, accuracy = solve(rod(5, [(4, WALL, UP, 0)]))
    expected = [(0, 0, -4 / 3), (0, 0, -1), (0, 0, -2 / 3), (0, 0, -1 / 3), (0, 0, 0)]
    assert_within(projection.velocity, expected, accuracy)
    assert_within(projection.impulse, [5 / 3], 5 / 3 * accuracy)


@pytest.mark.parametrize("radius", [0, 0.5])
def test_rod_of_five_lands_flat(solve: Solve, radius: float) -> None:
    # On five floors, of which two are enough: only the sum and the moment of the impulses are known
    # (but not with what error of the speeds, hence the factors of 5).
    projection, accuracy = solve(rod(5, [(k, WALL, UP, 0) for k in range(5)], radius=radius))
    assert_within(projection.velocity, np.zeros((5, 3)), 5 * accuracy)
    assert_within(projection.impulse.sum(), 5, 25 * accuracy)
    assert_within(projection.impulse @ np.arange(-2, 3), 0, 25 * accuracy)


@pytest.mark.parametrize("slope", [20, 45, 80])
def test_dimer_leans_on_a_wall_and_slides(solve: Solve, slope: float) -> None:
    """A ladder that falls at speed 1, its foot on a smooth floor and its top at a smooth wall.

    Foot and top can only go at s sin(slope) and -s cos(slope); s = cos(slope) is nearest to (0, -1)
    for both. The impulses are what momentum is left for floor and wall.
    """
    sine, cosine = np.sin(np.deg2rad(slope)), np.cos(np.deg2rad(slope))
    ladder = problem([(0, 0, -1)] * 2, [1, 1], [(0, WALL, UP, 0), (1, WALL, (1, 0, 0), 0)])
    given = in_bodies(ladder, [(cosine, 0, 0), (0, 0, sine)], [(0, 1)])
    projection, accuracy = solve(given)
    # Errors of two relative velocities, through the inverse of the matrix between the impulses.
    masses = float(np.linalg.norm(np.linalg.inv(given.delassus() / given.timestep), np.inf))
    expected = [(sine * cosine, 0, 0), (0, 0, -(cosine**2))]
    assert_within(projection.velocity, expected, 2 * masses * accuracy)
    assert_within(projection.impulse, [1 + sine**2, sine * cosine], masses * accuracy)


def test_crossed_dimers_touch_at_their_ends(solve: Solve) -> None:
    # The first falls on the second, at right angles: both ends that touch act like free spheres.
    position = [(0, 0, 1), (1, 0, 1), (0, 0, 0), (0, 1, 0)]
    falling = [(0, 0, -1)] * 2 + [(0, 0, 0)] * 2
    pair = problem(falling, [1] * 4, [(0, 2, UP, 0)])
    projection, accuracy = solve(in_bodies(pair, position, [(0, 1), (2, 3)]))
    expected = [(0, 0, -0.5), (0, 0, -1), (0, 0, -0.5), (0, 0, 0)]
    assert_within(projection.velocity, expected, accuracy)
    assert_within(projection.impulse, [0.5], accuracy)


# Regular: inertia 8 m about every axis for unit masses, their squared distance 3 from the centre.
TETRAHEDRON = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])


def tetrahedron(contacts: Sequence[Contact], velocity: Any) -> Problem:
    return in_bodies(problem([velocity] * 4, [1] * 4, contacts), TETRAHEDRON, [range(4)])


def test_tetrahedron_lands_on_a_corner(solve: Solve) -> None:
    outwards = TETRAHEDRON[0] / np.sqrt(3)
    projection, accuracy = solve(tetrahedron([(0, WALL, -outwards, 0)], outwards))
    assert_within(projection.velocity, np.zeros((4, 3)), accuracy)
    assert_within(projection.impulse, [4], 4 * accuracy)


def test_tetrahedron_is_hit_sideways_at_a_corner(solve: Solve) -> None:
    # Mobility 1/4 + 3/8. It turns at 1/8 of the moment, which is along the first arm x sideways.
    sideways = np.array([1, -1, 0]) / np.sqrt(2)
    projection, accuracy = solve(tetrahedron([(0, WALL, -sideways, 0)], sideways))
    turn = np.cross(TETRAHEDRON[0], -1.6 * sideways) / 8
    assert_within(projection.impulse, [1.6], 1.6 * accuracy)
    expected = sideways * (1 - 0.4) + np.cross(turn, TETRAHEDRON)
    assert_within(projection.velocity, expected, 2 * accuracy)  # corners 2 sqrt(2) from each other


def test_tetrahedron_lands_on_a_face(solve: Solve) -> None:
    down = TETRAHEDRON[0] / np.sqrt(3)  # the face opposite to corner 0 is across this
    contacts = [(k, WALL, down, 0) for k in (1, 2, 3)]
    projection, accuracy = solve(tetrahedron(contacts, -down))
    # Three relative velocities make a plane; corner 0 is over its middle.
    assert_within(projection.velocity, np.zeros((4, 3)), 3 * accuracy)
    assert_within(projection.impulse, [4 / 3] * 3, 3 * 4 * accuracy)


@pytest.mark.parametrize("inertia", [0.1, np.inf])
def test_body_of_one_sphere_is_a_free_sphere(solve: Solve, inertia: float) -> None:
    given = column([1, 3, 2, 1], [-1, -2, 0.5, -3])
    spheres = in_bodies(given, np.zeros((4, 3)), [(2,), (0,)])
    spheres.bodies.inverse_inertia[:] = np.eye(3) / inertia
    free, accuracy = solve(given)
    joined, accuracy_joined = solve(spheres)
    # Sweeps take bodies for what they are, and round otherwise; velocities add up along the column.
    both = accuracy + accuracy_joined
    assert_within(joined.velocity, free.velocity, 4 * both)
    assert_within(joined.impulse, free.impulse, 4 * 4 * 3 * both)


def test_body_that_cannot_move_acts_like_a_wall(solve: Solve) -> None:
    free = problem([(0.2, 0.1, -3)], [2], [(0, WALL, UP, 0.01)])
    on_wall, accuracy = solve(free)
    given = problem([(0.2, 0.1, -3), (0, 0, 0), (0, 0, 0)], [2, 1, 1], [(0, 1, UP, 0.01)])
    given = in_bodies(given, [(0, 0, 1), (0, 0, 0), (1, 0, 0)], [(1, 2)])
    given.bodies.inverse_mass[:] = 0
    given.bodies.inverse_inertia[:] = 0
    on_body, accuracy_on_body = solve(given)
    # Sweeps round bodies otherwise than spheres: each is as accurate as its own residual.
    assert_within(on_body.velocity[0], on_wall.velocity[0], accuracy + accuracy_on_body)
    assert np.array_equal(on_body.velocity[1:], np.zeros((2, 3)))
    assert_within(on_body.impulse, on_wall.impulse, 2 * (accuracy + accuracy_on_body))


def test_seesaw_hands_the_motion_on(solve: Solve) -> None:
    # A hinged beam without weight of its own: what lands on one arm throws up what lies on the
    # other, at twice the speed because that arm is twice as long.
    heavy, light = 4, 0.5
    contacts = [(0, 1, UP, 0), (3, 2, UP, 0)]
    given = problem([(0, 0, -1), *[(0, 0, 0)] * 3], [heavy, 1, 1, light], contacts)
    given = in_bodies(given, [(-1, 0, 1), (-1, 0, 0), (2, 0, 0), (2, 0, 1)], [(1, 2)])
    given.bodies.arm[1:3] = [(-1, 0, 0), (2, 0, 0)]
    inertia = 5
    given.bodies.inverse_mass[:] = 0
    given.bodies.inverse_inertia[:] = np.diag([0, 1 / inertia, 0])
    projection, accuracy = solve(given)
    # Angular momentum about the hinge, shared by all.
    turn = heavy / (heavy + inertia + light * 2**2)
    expected = [(0, 0, -turn), (0, 0, -turn), (0, 0, 2 * turn), (0, 0, 2 * turn)]
    accuracy *= heavy / light  # at most, of the errors of two relative velocities
    assert_within(projection.velocity, expected, accuracy)
    assert_within(projection.impulse, [heavy * (1 - turn), light * 2 * turn], heavy * accuracy)


SINGLE_CONTACTS = {
    "dimer's end": rod(2, [(1, WALL, UP, 0)]),
    "dimer's end, along it": rod(2, [(1, WALL, (-1, 0, 0), 0)], velocity=(1, 0, 0)),
    "solid dimer": rod(2, [(1, WALL, UP, 0)], radius=0.5),
    "rod of 30": rod(30, [(29, WALL, UP, 0)]),
    "tetrahedron": tetrahedron([(0, WALL, UP, 0)], (0, 0, -1)),
    "light end of a dimer": in_bodies(
        problem([(0, 0, -1)] * 2, [1, 1e-6], [(1, WALL, UP, 0)]),
        [(0, 0, 0), (1, 0, 0)],
        [(0, 1)],
    ),
    "two dimers": in_bodies(
        problem([(0, 0, -1)] * 2 + [(0, 0, 0)] * 2, [1, 1e-3, 10, 1], [(1, 2, UP, 0)]),
        [(0, 0, 0), (1, 0, 1), (1, 0, 0), (0, 1, 0.5)],
        [(0, 1), (2, 3)],
    ),
}


@pytest.mark.parametrize("given", SINGLE_CONTACTS.values(), ids=SINGLE_CONTACTS)
def test_single_contact_takes_as_long_whatever_the_shape(given: Problem) -> None:
    # Divided by the mobility of its particles it is always the same problem, except for rounding
    # where an iteration ends at the tolerance.
    free = problem([(0, 0, -1)], [1], [(0, WALL, UP, 0)]).project(TOLERANCE, solver="apgd")
    assert abs(given.project(TOLERANCE, solver="apgd").iterations - free.iterations) <= 1
    # Sweeps solve it at once. A second one shows it, and at most three searches do so in turn,
    # since single precision does not reach the tolerance.
    assert given.project(TOLERANCE, solver="sweeps").iterations <= 3 * 3
