"""What the core's Python module refuses, and how it says so."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lammps_inelastic import core
from tests.core.contact_problems import Floats

NOT_FINITE = [np.nan, np.inf, -np.inf]


def arguments(**changes: Any) -> dict[str, Any]:
    """Return a good problem, two particles and a floor, with some arguments changed."""
    return {
        "predicted_velocity": np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]),
        "inverse_mass": np.array([1.0, 0.5]),
        "first": np.array([0, 1]),
        "second": np.array([1, -1]),
        "normal": np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
        "gap": np.array([0.0, 0.1]),
        "timestep": 0.01,
        "tolerance": 1e-9,
        **changes,
    }


def project(**changes: Any) -> core.Projection:
    return core.project(**arguments(**changes))


def residual(**changes: Any) -> Any:
    given = arguments(**{"impulse": np.zeros(2), **changes})
    del given["tolerance"]
    return core.residual(**given)


def largest_eigenvalue(**changes: Any) -> float:
    given = arguments(**changes)
    for name in ("predicted_velocity", "gap", "tolerance"):
        del given[name]
    return core.largest_eigenvalue(**given)


ALL = pytest.mark.parametrize("function", [project, residual, largest_eigenvalue])


def test_these_arguments_are_fine() -> None:
    assert project().converged
    assert residual() == (pytest.approx(0.02, abs=1e-15), 0)  # both approach at 1: 2 h
    assert largest_eigenvalue() > 0


@pytest.mark.parametrize("length", [0, 1, 3])
@pytest.mark.parametrize(
    ("function", "name"),
    [
        (project, "inverse_mass"),
        (project, "first"),
        (project, "second"),
        (project, "normal"),
        (project, "impulse"),
        (project, "compliance"),
        (project, "least_impulse"),
        (residual, "compliance"),
        (residual, "least_impulse"),
        (residual, "inverse_mass"),
        (residual, "impulse"),
        (largest_eigenvalue, "second"),
        (largest_eigenvalue, "normal"),
    ],
)
def test_wrong_length(function: Callable[..., object], name: str, length: int) -> None:
    wrong = np.zeros(
        (length, 3) if name == "normal" else length,
        np.int64 if name in ("first", "second") else float,
    )
    with pytest.raises(ValueError, match=f"{name} must have length 2, not {length}"):
        function(**{name: wrong})


@pytest.mark.parametrize(
    ("function", "name", "message"),
    [
        (project, "gap", "first must have length 3, not 2"),
        (project, "predicted_velocity", "inverse_mass must have length 3, not 2"),
        (largest_eigenvalue, "first", "second must have length 3, not 2"),
    ],
)
def test_one_too_many(function: Callable[..., object], name: str, message: str) -> None:
    good = arguments()[name]
    with pytest.raises(ValueError, match=message):
        function(**{name: np.concatenate([good, good[:1]])})


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("predicted_velocity", (2, 2)),
        ("predicted_velocity", (6,)),
        ("inverse_mass", (2, 1)),
        ("first", (2, 1)),
        ("second", ()),
        ("normal", (3, 2)),
        ("normal", (6,)),
        ("gap", (1, 2)),
        ("impulse", (2, 1)),
    ],
)
def test_wrong_shape(name: str, shape: tuple[int, ...]) -> None:
    wrong = np.zeros(shape, np.int64 if name in ("first", "second") else float)
    # nanobind looks for a function that takes such an array: a TypeError that lists the shapes.
    with pytest.raises((ValueError, TypeError), match="shape"):
        project(**{name: wrong})


@pytest.mark.parametrize("value", NOT_FINITE)
@pytest.mark.parametrize("name", ["predicted_velocity", "inverse_mass", "normal", "gap", "impulse"])
def test_not_finite_in_an_array(name: str, value: Any) -> None:
    array = np.ones(2) if name == "impulse" else arguments()[name].copy()
    array.flat[-1] = value
    with pytest.raises(ValueError, match=r"finite|cannot move"):
        project(**{name: array})


@pytest.mark.parametrize("value", NOT_FINITE)
def test_not_finite_without_contacts(value: Any) -> None:
    none = {
        "first": np.zeros(0, np.int64),
        "second": np.zeros(0, np.int64),
        "normal": np.zeros((0, 3)),
        "gap": np.zeros(0),
    }
    with pytest.raises(ValueError, match="finite"):
        project(**none, inverse_mass=np.array([1.0, value]))
    with pytest.raises(ValueError, match="finite"):
        project(**none, predicted_velocity=np.full((2, 3), value))


@ALL
@pytest.mark.parametrize("value", [0.0, -0.01, *NOT_FINITE])
def test_timestep(function: Callable[..., object], value: Any) -> None:
    with pytest.raises(ValueError, match="timestep must be"):
        function(timestep=value)


@pytest.mark.parametrize("value", [0.0, -1e-9, *NOT_FINITE])
def test_tolerance(value: Any) -> None:
    with pytest.raises(ValueError, match="tolerance must be"):
        project(tolerance=value)


@pytest.mark.parametrize("name", ["", "APGD", "gauss-seidel"])
def test_unknown_solver(name: str) -> None:
    with pytest.raises(ValueError, match=f"solver must be apgd or uzawa, not {name}"):
        project(solver=name)


@ALL
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("first", -1),
        ("first", 2),
        ("second", -2),
        ("second", 2),
        ("first", 2**40),
        ("second", 2**40),
    ],
)
def test_index_out_of_range(function: Callable[..., object], name: str, value: Any) -> None:
    indices = arguments()[name].copy()
    indices[1] = value
    with pytest.raises(ValueError, match=r"contact 1 names a particle outside 0 \.\.\. 1"):
        function(**{name: indices})


@ALL
def test_contact_between_frozen_particles(function: Callable[..., object]) -> None:
    # Contact 0 is between both, contact 1 between particle 1 and the floor.
    with pytest.raises(ValueError, match="contact 0 is between particles that cannot move"):
        function(inverse_mass=np.zeros(2))
    with pytest.raises(ValueError, match="contact 1 is between particles that cannot move"):
        function(inverse_mass=np.array([1.0, 0.0]))


@ALL
def test_negative_mass(function: Callable[..., object]) -> None:
    # Particle 0 makes the sum over contact 0 positive.
    with pytest.raises(ValueError, match="inverse_mass"):
        function(inverse_mass=np.array([2.0, -1.0]), second=np.array([1, 0]))


@pytest.mark.parametrize("function", [project, residual])
def test_negative_compliance(function: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="compliance must not be negative"):
        function(compliance=np.array([0.0, -1e-9]))


@pytest.mark.parametrize("function", [project, residual])
def test_positive_least_impulse(function: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="least_impulse must not be positive"):
        function(least_impulse=np.array([0.0, 1e-9]))


@ALL
def test_contact_of_a_particle_with_itself(function: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="contact 1"):
        function(second=np.array([1, 1]))


@pytest.mark.parametrize("solver", ["apgd", "uzawa"])
def test_negative_first_guess_does_not_pull(solver: str) -> None:
    # The floor is far below: with this guess it would pull, and the residual would be zero.
    impulse, gap = np.array([0.0, -1.0]), np.array([10.0, 10.0])
    projection = project(impulse=impulse, gap=gap, solver=solver)
    assert projection.impulse.min() >= 0


@pytest.mark.parametrize("solver", ["apgd", "uzawa"])
def test_overflow_is_not_convergence(solver: str) -> None:
    # h V overflows: gaps are -inf, then not numbers.
    projection = project(
        predicted_velocity=np.array([[0.0, 0.0, -1e300], [0.0, 0.0, 0.0]]),
        timestep=1e300,
        solver=solver,
        max_iterations=10,
    )
    assert not projection.converged
    assert not projection.feasibility <= 1e-9


def test_arguments_may_be_strided_and_are_not_changed() -> None:
    good = arguments()
    expected = core.project(**good)
    strided = dict(good)
    for name in ("predicted_velocity", "inverse_mass", "first", "second", "normal", "gap"):
        twice = np.repeat(good[name], 2, axis=0)
        strided[name] = twice[::2]
        strided[name].setflags(write=False)
    projection = core.project(**strided)
    assert np.array_equal(projection.velocity, expected.velocity)
    for name, value in arguments().items():
        assert np.array_equal(good[name], value)


def test_first_guess_is_not_changed() -> None:
    guess = np.array([1.0, 1.0])
    project(impulse=guess)
    assert np.array_equal(guess, [1.0, 1.0])


def bodies(**changes: Any) -> dict[str, Any]:
    """Return arguments about bodies, with some changed, that go with a third particle.

    A hinge and a ball, on particles 2 and 1: the inverse inertia of neither is regular.
    """
    return {
        "body": np.array([-1, 1, 0]),
        "arm": np.array([[np.nan] * 3, [0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]),
        "body_inverse_mass": np.array([0.0, 0.5]),
        "body_inverse_inertia": np.array([np.diag([0.0, 2.0, 0.0]), np.zeros((3, 3))]),
        "predicted_velocity": np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]),
        "inverse_mass": np.array([1.0, np.nan, -1.0]),
        **changes,
    }


BODIES = ["body", "arm", "body_inverse_mass", "body_inverse_inertia"]


def test_these_bodies_are_fine() -> None:
    # What is not read is neither finite nor positive.
    assert project(**bodies()).converged
    assert residual(**bodies()) == (pytest.approx(0.02, abs=1e-15), 0)  # both approach at 1: 2 h
    assert largest_eigenvalue(**bodies()) > 0


@ALL
@pytest.mark.parametrize("names", [BODIES[:1], BODIES[1:], BODIES[:3], BODIES[2:3]])
def test_only_some_of_the_arguments_about_bodies(
    function: Callable[..., object], names: list[str]
) -> None:
    given = bodies(inverse_mass=np.array([1.0, 0.5, 0.0]))
    for name in names:
        del given[name]
    with pytest.raises(ValueError, match="body, arm, body_inverse_mass and body_inverse_inertia"):
        function(**given)


@ALL
@pytest.mark.parametrize("name", ["body", "arm", "body_inverse_inertia"])
@pytest.mark.parametrize("change", [-1, 1])
def test_wrong_length_of_an_argument_about_bodies(
    function: Callable[..., object], name: str, change: int
) -> None:
    good = bodies()[name]
    wrong = good[:-1] if change < 0 else np.concatenate([good, good[:1]])
    message = f"{name} must have length {len(good)}, not {len(good) + change}"
    with pytest.raises(ValueError, match=message):
        function(**bodies(**{name: wrong}))


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("body", (3, 1)),
        ("arm", (3, 2)),
        ("arm", (9,)),
        ("body_inverse_mass", (2, 1)),
        ("body_inverse_inertia", (2, 6)),
        ("body_inverse_inertia", (2, 3, 2)),
    ],
)
def test_wrong_shape_of_an_argument_about_bodies(name: str, shape: tuple[int, ...]) -> None:
    wrong = np.zeros(shape, np.int64 if name == "body" else float)
    # As in test_wrong_shape.
    with pytest.raises((ValueError, TypeError), match="shape"):
        project(**bodies(**{name: wrong}))


@ALL
@pytest.mark.parametrize("value", NOT_FINITE)
@pytest.mark.parametrize("name", BODIES[1:])
def test_not_finite_in_an_argument_about_bodies(
    function: Callable[..., object], name: str, value: Any
) -> None:
    wrong = bodies()[name].copy()
    wrong.flat[-1] = value
    with pytest.raises(ValueError, match=f"^{name} holds a number that is not finite"):
        function(**bodies(**{name: wrong}))


@ALL
@pytest.mark.parametrize("value", [np.nan, -1.0])
def test_inverse_mass_of_a_free_particle_among_bodies(
    function: Callable[..., object], value: Any
) -> None:
    with pytest.raises(ValueError, match=r"^inverse_mass"):
        function(**bodies(inverse_mass=np.array([value, 1.0, 1.0])))


@ALL
@pytest.mark.parametrize("value", [-2, 2, 2**40])
def test_body_out_of_range(function: Callable[..., object], value: Any) -> None:
    with pytest.raises(ValueError, match=r"particle 1 is in a body outside -1 \.\.\. 1"):
        function(**bodies(body=np.array([-1, value, 0])))


@ALL
def test_body_without_particles(function: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="body 1 has no particle"):
        function(**bodies(body=np.array([-1, -1, 0]), inverse_mass=np.ones(3)))


@ALL
def test_negative_mass_of_a_body(function: Callable[..., object]) -> None:
    with pytest.raises(ValueError, match="body_inverse_mass must not be negative"):
        function(**bodies(body_inverse_mass=np.array([-0.1, 1.0])))


NOT_POSITIVE = {
    "negative": np.diag([1.0, 1.0, -1e-3]),
    "negative first": np.diag([-1e-3, 1.0, 1.0]),
    "negative between two axes": np.array([[1.0, 0, 1.01], [0, 1, 0], [1.01, 0, 1]]),
    "no diagonal": np.array([[0.0, 0, 1], [0, 0, 0], [1, 0, 0]]),
    "negative along the diagonal": np.eye(3) - 0.4,
    "not symmetric": np.array([[1.0, 0, 0], [0, 1, 1e-3], [0, 0, 1]]),
}


@ALL
@pytest.mark.parametrize("inertia", NOT_POSITIVE.values(), ids=NOT_POSITIVE)
@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e100])
def test_inverse_inertia_that_no_body_has(
    function: Callable[..., object], inertia: Floats, scale: float
) -> None:
    wrong = np.array([np.zeros((3, 3)), scale * inertia])
    message = "body_inverse_inertia of body 1 is not symmetric and positive semi-definite"
    with pytest.raises(ValueError, match=message):
        function(**bodies(body_inverse_inertia=wrong))


@pytest.mark.parametrize("rank", [0, 1, 2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_inverse_inertia_may_have_any_rank_and_rounding(seed: int, rank: int) -> None:
    generator = np.random.default_rng(seed)
    axes = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    inertia = axes @ np.diag(generator.uniform(0.1, 10, 3) * (np.arange(3) < rank)) @ axes.T
    inertia += 1e-15 * generator.uniform(-10, 10, (3, 3)) * (rank > 0)
    given = bodies(body_inverse_inertia=np.array([np.zeros((3, 3)), inertia]))
    assert project(**given).converged


@ALL
def test_contact_within_a_body(function: Callable[..., object]) -> None:
    one = bodies(
        body=np.array([0, 0, -1]),
        arm=np.zeros((3, 3)),
        body_inverse_mass=np.ones(1),
        body_inverse_inertia=np.zeros((1, 3, 3)),
        inverse_mass=np.ones(3),
    )
    with pytest.raises(ValueError, match="contact 0 is between two particles of one body"):
        function(**one)


@ALL
def test_contact_of_bodies_that_cannot_move(function: Callable[..., object]) -> None:
    # A hinge moves no particle along its arm, and a body of no mobility none at all.
    hinged = {"first": np.array([0, 2]), "second": np.array([1, -1])}
    along = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="contact 1 is between particles that cannot move"):
        function(**bodies(**hinged, normal=along))
    function(**bodies(**hinged))  # across its arm it moves
    with pytest.raises(ValueError, match="contact 1 is between particles that cannot move"):
        function(**bodies(body_inverse_mass=np.zeros(2)))


def test_arguments_about_bodies_may_be_strided_and_are_not_changed() -> None:
    expected = project(**bodies())
    strided = {name: np.repeat(value, 2, axis=0)[::2] for name, value in bodies().items()}
    for value in strided.values():
        value.setflags(write=False)
    projection = project(**strided)
    assert np.array_equal(projection.velocity, expected.velocity)
    for name, value in bodies().items():
        assert np.array_equal(strided[name], value, equal_nan=True)
