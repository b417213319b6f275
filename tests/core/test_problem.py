"""What the core's Python module takes, what it refuses, and how it says so."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from lammps_inelastic import core
from tests.helpers.contact_problems import UP, WALL, Floats, heap, problem

NOT_FINITE = [np.nan, np.inf, -np.inf]


@contextmanager
def refused(message: str) -> Iterator[None]:
    """A ValueError with this message, which is one line."""
    with pytest.raises(ValueError, match=r"^.*\Z") as caught:
        yield
    assert str(caught.value) == message


def arguments(**changes: Any) -> dict[str, Any]:
    """Return a good problem, two particles and a floor, with some arguments changed."""
    return {
        "timestep": 0.01,
        "predicted_velocity": np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]),
        "inverse_mass": np.array([1.0, 0.5]),
        "first": np.array([0, 1]),
        "second": np.array([1, -1]),
        "normal": np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
        "gap": np.array([0.0, 0.1]),
        **changes,
    }


def make(**changes: Any) -> core.Problem:
    return core.Problem(**arguments(**changes))


LIMITS = core.Limits(1e-9)


def test_this_problem_is_fine() -> None:
    given = make()
    assert core.project(given, LIMITS).converged
    # Both approach at 1: 2 h.
    assert core.residual(given, np.zeros(2)) == pytest.approx((0.02, 0), abs=1e-15)
    assert core.largest_eigenvalue(given) > 0


def test_lists_and_one_number_for_all() -> None:
    """They make the arrays that stand there otherwise, with the documented defaults."""
    lists = {name: np.array(value).tolist() for name, value in arguments().items()}
    listed = core.Problem(**lists | {"inverse_mass": 0.5, "compliance": 0.25})
    written = make(
        inverse_mass=np.full(2, 0.5),
        compliance=np.full(2, 0.25),
        impulse_guess=np.zeros(2),
        least_impulse=np.zeros(2),
        refinement=np.ones(2),
    )
    for name in (field.name for field in fields(core.Problem)):
        one, other = getattr(listed, name), getattr(written, name)
        assert np.array_equal(one, other)
        assert getattr(one, "dtype", None) == getattr(other, "dtype", None)
    assert core.residual(written, 2.0) == core.residual(written, [2.0, 2.0])


def test_arrays_are_copies_that_cannot_be_written_to() -> None:
    given = arguments()
    made = core.Problem(**given)
    given["gap"][:] = -1
    assert made.gap.tolist() == [0.0, 0.1]
    with pytest.raises(ValueError, match="read-only"):
        made.gap[0] = 1.0
    with pytest.raises(AttributeError):
        made.gap = np.zeros(2)  # type: ignore[misc]


def test_strides_and_other_types() -> None:
    good = arguments()
    expected = core.project(core.Problem(**good), LIMITS)
    strided = {
        name: np.repeat(value, 2, axis=0)[::2] for name, value in good.items() if name != "timestep"
    }
    strided["first"] = strided["first"].astype(np.uint8)
    strided["second"] = strided["second"].astype(np.float32)
    found = core.project(make(**strided), LIMITS)
    assert np.array_equal(found.velocity, expected.velocity)
    assert np.array_equal(found.impulse, expected.impulse)


OF_CONTACTS = ["first", "second", "impulse_guess", "least_impulse", "compliance", "refinement"]


@pytest.mark.parametrize("length", [0, 1, 3])
@pytest.mark.parametrize("name", ["inverse_mass", *OF_CONTACTS])
def test_wrong_length(name: str, length: int) -> None:
    with refused(f"{name} must have the shape (2,), not ({length},)"):
        make(**{name: np.zeros(length)})
    with refused(f"normal must have the shape (2, 3), not ({length}, 3)"):
        make(normal=np.zeros((length, 3)))
    with refused(f"impulse must have the shape (2,), not ({length},)"):
        core.residual(make(), np.zeros(length))


@pytest.mark.parametrize(
    ("name", "shape", "wanted"),
    [
        ("predicted_velocity", (2, 2), "(n, 3)"),
        ("predicted_velocity", (6,), "(n, 3)"),
        ("inverse_mass", (2, 1), "(2,)"),
        ("first", (2, 1), "(2,)"),
        ("second", (), "(2,)"),
        ("normal", (3, 2), "(2, 3)"),
        ("normal", (3,), "(2, 3)"),
        ("gap", (1, 2), "(m,)"),
        ("gap", (), "(m,)"),
        ("impulse_guess", (2, 1), "(2,)"),
    ],
)
def test_wrong_shape(name: str, shape: tuple[int, ...], wanted: str) -> None:
    with refused(f"{name} must have the shape {wanted}, not {shape}"):
        make(**{name: np.zeros(shape)})


@pytest.mark.parametrize(
    "value", [None, "wide", [0.1, "a"], [[0.1], [0.1, 0.2]], [1j, 0], [True] * 2]
)
@pytest.mark.parametrize("name", ["predicted_velocity", "gap", "first"])
def test_no_numbers(name: str, value: Any) -> None:
    with refused(f"{name} must be an array of real numbers"):
        make(**{name: value})


@pytest.mark.parametrize("value", NOT_FINITE)
@pytest.mark.parametrize("name", ["inverse_mass", "gap", "impulse_guess", "least_impulse"])
def test_not_finite(name: str, value: Any) -> None:
    with refused(f"{name}[1] is {value}: it must be finite"):
        make(**{name: np.array([0.0, value])})
    with refused(f"impulse[1] is {value}: it must be finite"):
        core.residual(make(), np.array([0.0, value]))


@pytest.mark.parametrize("value", NOT_FINITE)
@pytest.mark.parametrize("name", ["predicted_velocity", "normal"])
def test_not_finite_in_a_vector(name: str, value: Any) -> None:
    array = arguments()[name].copy()
    array[1, 2] = value
    with refused(f"{name}[1, 2] is {value}: it must be finite"):
        make(**{name: array})


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("inverse_mass", -0.1, "must be at least 0"),
        ("compliance", -1e-9, "must be at least 0"),
        ("least_impulse", 1e-9, "must be at most 0"),
        ("refinement", 0.0, "must be above 0 and at most 1"),
        ("refinement", 1.5, "must be above 0 and at most 1"),
        ("first", 0.5, "must be a whole number"),
        ("first", np.nan, "must be a whole number"),
        ("first", np.uint64(2**64 - 1), "must be a whole number"),
    ],
)
def test_numbers_that_are_not_allowed(name: str, value: Any, allowed: str) -> None:
    # Particle 0 makes the sum over contact 0 positive.
    numbers = np.array([1, value]) if name != "first" else np.array([value, value])
    at = 0 if name == "first" else 1
    with refused(f"{name}[{at}] is {value:g}: it {allowed}"):
        make(**{name: numbers if name != "least_impulse" else -numbers * [1, -1]})


@pytest.mark.parametrize("value", [0.0, -0.01, *NOT_FINITE])
def test_timestep_and_tolerance(value: Any) -> None:
    with refused(f"timestep is {value}: it must be finite and greater than 0"):
        make(timestep=value)
    with refused(f"tolerance is {value}: it must be finite and greater than 0"):
        core.Limits(value)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("accuracy", -0.1, "must be at least 0 and below 1"),
        ("accuracy", 1.0, "must be at least 0 and below 1"),
        ("accuracy", np.nan, "must be at least 0 and below 1"),
        ("max_iterations", -1, "must be at least 0 and below 2^63"),
        ("max_iterations", 2**63, "must be at least 0 and below 2^63"),
        ("reach", 0.0, "must be greater than 0"),
        ("reach", np.nan, "must be greater than 0"),
    ],
)
def test_limits(name: str, value: Any, allowed: str) -> None:
    with refused(f"{name} is {value}: it {allowed}"):
        core.Limits(1e-9, **{name: value})


@pytest.mark.parametrize("value", ["1", None, True, np.ones(2), 1j])
def test_what_is_one_number(value: Any) -> None:
    with refused("timestep must be a real number"):
        make(timestep=value)
    with refused("tolerance must be a real number"):
        core.Limits(value)
    for name, kind in (("accuracy", "real"), ("reach", "real"), ("max_iterations", "whole")):
        with refused(f"{name} must be a {kind} number"):
            core.Limits(1e-9, **{name: value})


@pytest.mark.parametrize("value", [1.5, 10.0])
def test_whole_number_of_iterations(value: Any) -> None:
    with refused("max_iterations must be a whole number"):
        core.Limits(1e-9, max_iterations=value)
    given = core.Limits(np.float32(1e-9), max_iterations=np.int32(1000))  # type: ignore[arg-type]
    assert core.project(make(), given).status == "converged"


@pytest.mark.parametrize("name", ["", "APGD", "gauss-seidel"])
def test_unknown_solver(name: Any) -> None:
    with refused(f"solver is {name!r}: it must be 'sweeps', 'apgd' or 'uzawa'"):
        core.project(make(), LIMITS, solver=name)


@pytest.mark.parametrize(
    ("name", "value", "wall"),
    [
        ("first", -1, ""),
        ("first", 2, ""),
        ("second", -2, ", or -1 for a wall"),
        ("second", 2, ", or -1 for a wall"),
        ("first", 2**40, ""),
        ("second", 2**40, ", or -1 for a wall"),
    ],
)
def test_index_out_of_range(name: str, value: int, wall: str) -> None:
    indices = arguments()[name].copy()
    indices[1] = value
    with refused(f"{name}[1] is {value:g}: it must be one of the 2 particles from 0 on{wall}"):
        make(**{name: indices})


def test_contact_between_frozen_particles() -> None:
    # Contact 0 is between both, contact 1 between particle 1 and the floor.
    with refused("contact 0 is between two sides that cannot move"):
        make(inverse_mass=0)
    with refused("contact 1 is between two sides that cannot move"):
        make(inverse_mass=[1.0, 0.0])


def test_contact_of_a_particle_with_itself() -> None:
    with refused("contact 1 is of a particle with itself"):
        make(second=[1, 1])


@pytest.mark.parametrize("length", [0.0, 0.99, 2.0])
def test_normal_that_is_no_unit_vector(length: float) -> None:
    with refused("contact 1 has a normal that is not of length 1"):
        make(normal=np.array([UP, np.multiply(length, UP)]))


@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
def test_negative_first_guess_does_not_pull(solver: core.Solver) -> None:
    # The floor is far below: with this guess it would pull, and the residual would be zero.
    given = make(impulse_guess=[0.0, -1.0], gap=[10.0, 10.0])
    assert core.project(given, LIMITS, solver=solver).impulse.min() >= 0


def no_room() -> core.Problem:
    """Two walls leave 0.01 less than a diameter."""
    return problem([(0, 0, 0)], [1], [(0, WALL, UP, 0), (0, WALL, (0, 0, -1), -0.01)]).for_core()


@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
def test_overflow_is_not_convergence(solver: core.Solver) -> None:
    # h V overflows: gaps are -inf, then not numbers.
    fast = make(predicted_velocity=[[0.0, 0.0, -1e300], [0.0, 0.0, 0.0]], timestep=1e300)
    found = core.project(fast, core.Limits(1e-9, max_iterations=10), solver=solver)
    assert found.status == "not finite"
    assert not found.converged
    assert not found.feasibility <= 1e-9


@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
def test_words_for_no_room(solver: core.Solver) -> None:
    """It is infeasible if no step further than some length will do, and never without one."""
    some = core.Limits(1e-9, max_iterations=1000)
    assert core.project(no_room(), some, solver=solver).status == "out of iterations"
    within = replace(some, reach=1.0)
    found = core.project(no_room(), within, solver=solver)
    assert found.status == "infeasible"
    # Half of them by sweeps, where these come first
    assert found.iterations <= 1000


def test_words_for_a_tolerance_below_round_off() -> None:
    # Gaps near 0.01 are known to 1e-18.
    given = heap(3).for_core()
    found = core.project(given, core.Limits(1e-30))
    assert found.status == "round-off"
    assert 0 < max(found.feasibility, found.complementarity) < 1e-15


def test_refinement_is_a_part_of_the_accuracy() -> None:
    """Half of it for all contacts is half the accuracy; Uzawa's end depends on nothing else."""
    given = heap(5).for_core()
    half = replace(given, refinement=np.full(given.gap.size, 0.5))
    loose, tight = (core.Limits(1e-2, accuracy) for accuracy in (2.0**-8, 2.0**-9))
    refined, expected = (
        core.project(half, loose, solver="uzawa"),
        core.project(given, tight, solver="uzawa"),
    )
    assert refined.iterations == expected.iterations
    assert np.array_equal(refined.velocity, expected.velocity)
    assert expected.iterations > core.project(given, loose, solver="uzawa").iterations


BODIES = ["body", "arm", "inverse_mass", "inverse_inertia"]


def body_arguments(**changes: Any) -> dict[str, Any]:
    """Return bodies, with some arguments changed: a hinge and a ball, on particles 2 and 1.

    The inverse inertia of neither is regular.
    """
    return {
        "body": np.array([-1, 1, 0]),
        "arm": np.array([[np.nan] * 3, [0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]),
        "inverse_mass": np.array([0.0, 0.5]),
        "inverse_inertia": np.array([np.diag([0.0, 2.0, 0.0]), np.zeros((3, 3))]),
        **changes,
    }


def bodies(**changes: Any) -> core.Bodies:
    return core.Bodies(**body_arguments(**changes))


def with_bodies(given: core.Bodies | None = None, **changes: Any) -> core.Problem:
    """Return a good problem of three particles, with some arguments changed."""
    three: dict[str, Any] = {
        "predicted_velocity": [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]],
        "inverse_mass": [1.0, np.nan, -1.0],
        "bodies": given or bodies(),
    }
    return make(**three | changes)


def test_these_bodies_are_fine() -> None:
    # What is not read is neither finite nor positive.
    given = with_bodies()
    assert core.project(given, LIMITS).converged
    # Both approach at 1: 2 h.
    assert core.residual(given, np.zeros(2)) == pytest.approx((0.02, 0), abs=1e-15)
    assert core.largest_eigenvalue(given) > 0


@pytest.mark.parametrize(
    ("name", "shape", "wanted"),
    [
        ("body", (3, 1), "(n,)"),
        ("arm", (3, 2), "(3, 3)"),
        ("arm", (2, 3), "(3, 3)"),
        ("arm", (9,), "(3, 3)"),
        ("inverse_mass", (2, 1), "(b,)"),
        ("inverse_inertia", (2, 6), "(2, 3, 3)"),
        ("inverse_inertia", (3, 3, 3), "(2, 3, 3)"),
        ("inverse_inertia", (2, 3, 2), "(2, 3, 3)"),
    ],
)
def test_wrong_shape_of_bodies(name: str, shape: tuple[int, ...], wanted: str) -> None:
    label = "bodies.inverse_mass" if name == "inverse_mass" else name
    with refused(f"{label} must have the shape {wanted}, not {shape}"):
        bodies(**{name: np.zeros(shape)})


def test_bodies_of_another_number_of_particles() -> None:
    with refused("bodies are of 3 particles, not of 2"):
        make(bodies=bodies())


@pytest.mark.parametrize("value", NOT_FINITE)
@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("arm", "arm[2, 2]"),
        ("inverse_mass", "bodies.inverse_mass[1]"),
        ("inverse_inertia", "inverse_inertia[1, 2, 2]"),
    ],
)
def test_not_finite_in_bodies(name: str, place: str, value: Any) -> None:
    wrong = body_arguments()[name].copy()
    wrong.flat[-1] = value
    with refused(f"{place} is {value}: it must be finite"):
        bodies(**{name: wrong})


@pytest.mark.parametrize(
    ("value", "allowed"), [(np.nan, "must be finite"), (-1.0, "must be at least 0")]
)
def test_inverse_mass_of_a_free_particle_among_bodies(value: Any, allowed: str) -> None:
    with refused(f"inverse_mass[0] is {value:g}: it {allowed}"):
        with_bodies(inverse_mass=[value, 1.0, 1.0])


@pytest.mark.parametrize("value", [-2, 2, 2**40])
def test_body_out_of_range(value: int) -> None:
    with refused(f"body[1] is {value:g}: it must be from -1 to 1"):
        bodies(body=[-1, value, 0])


def test_body_without_particles() -> None:
    with refused("body 1 has no particle"):
        bodies(body=[-1, -1, 0])


def test_negative_mass_of_a_body() -> None:
    with refused("bodies.inverse_mass[0] is -0.1: it must be at least 0"):
        bodies(inverse_mass=[-0.1, 1.0])


NOT_POSITIVE = {
    "negative": np.diag([1.0, 1.0, -1e-3]),
    "negative first": np.diag([-1e-3, 1.0, 1.0]),
    "negative between two axes": np.array([[1.0, 0, 1.01], [0, 1, 0], [1.01, 0, 1]]),
    "no diagonal": np.array([[0.0, 0, 1], [0, 0, 0], [1, 0, 0]]),
    "negative along the diagonal": np.eye(3) - 0.4,
    "not symmetric": np.array([[1.0, 0, 0], [0, 1, 1e-3], [0, 0, 1]]),
}


@pytest.mark.parametrize("inertia", NOT_POSITIVE.values(), ids=NOT_POSITIVE)
@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e100])
def test_inverse_inertia_that_no_body_has(inertia: Floats, scale: float) -> None:
    with refused("inverse_inertia of body 1 is not symmetric and positive semi-definite"):
        bodies(inverse_inertia=[np.zeros((3, 3)), scale * inertia])


@pytest.mark.parametrize("rank", [0, 1, 2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_inverse_inertia_may_have_any_rank_and_rounding(seed: int, rank: int) -> None:
    generator = np.random.default_rng(seed)
    axes = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    inertia = axes @ np.diag(generator.uniform(0.1, 10, 3) * (np.arange(3) < rank)) @ axes.T
    inertia += 1e-15 * generator.uniform(-10, 10, (3, 3)) * (rank > 0)
    given = with_bodies(bodies(inverse_inertia=[np.zeros((3, 3)), inertia]))
    assert core.project(given, LIMITS).converged


def test_contact_within_a_body() -> None:
    one = core.Bodies([0, 0, -1], np.zeros((3, 3)), [1.0], np.zeros((1, 3, 3)))
    with refused("contact 0 is between two particles of one body"):
        with_bodies(one, inverse_mass=1.0)


def test_contact_of_bodies_that_cannot_move() -> None:
    # A hinge moves no particle along its arm, and a body of no mobility none at all.
    hinged: dict[str, Any] = {"first": [0, 2], "second": [1, -1]}
    along = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    with refused("contact 1 is between two sides that cannot move"):
        with_bodies(**hinged, normal=along)
    with_bodies(**hinged)  # across its arm it moves
    with refused("contact 1 is between two sides that cannot move"):
        with_bodies(bodies(inverse_mass=[0.0, 0.0]))


def test_strides_of_bodies() -> None:
    expected = core.project(with_bodies(), LIMITS)
    strided = {name: np.repeat(value, 2, axis=0)[::2] for name, value in body_arguments().items()}
    found = core.project(with_bodies(bodies(**strided)), LIMITS)
    assert np.array_equal(found.velocity, expected.velocity)
    assert not any(getattr(bodies(), name).flags.writeable for name in BODIES)
