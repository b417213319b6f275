"""The projection problem of one time step: arrays that are checked where they are given."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

WALL = -1  # the second side of a contact with a wall
FREE = -1  # the body of a particle that is in none
# A relative error of a matrix, or of a squared length, that is far above round-off.
FLAW = 1e-6


@dataclass(frozen=True, eq=False, init=False)
class Bodies:
    """Rigid bodies, b of them, each made of some of a problem's n particles.

    Attributes
    ----------
    body : number of the body of each particle, 0 to b - 1; -1 for a free one, (n,)
    arm : from the centre of mass of its body to each particle; not read for free ones, length,
        (n, 3)
    inverse_mass : 0 for a body that is held at a point or altogether, 1/mass, (b,)
    inverse_inertia : symmetric and positive semi-definite, about the centre of mass; for point
        masses on a line the pseudo-inverse of the inertia, 1/(mass length^2), (b, 3, 3)

    The arrays are copies that cannot be written to.

    Raises ValueError for another shape, numbers that are not finite or not allowed, and a body
    without a particle.
    """

    body: Indices
    arm: Floats
    inverse_mass: Floats
    inverse_inertia: Floats

    def __init__(
        self,
        body: ArrayLike,
        arm: ArrayLike,
        inverse_mass: ArrayLike,
        inverse_inertia: ArrayLike,
    ) -> None:
        indices = _indices("body", body, ("n",))
        masses = _floats("bodies.inverse_mass", inverse_mass, ("b",))
        n, b = indices.size, masses.size
        inertia = _floats("inverse_inertia", inverse_inertia, (b, 3, 3))
        arms = _floats("arm", arm, (n, 3))
        _require("body", indices, (indices >= FREE) & (indices < b), f"must be from -1 to {b - 1}")
        _require_finite("arm", arms, where=(indices != FREE)[:, None])
        _require_inverse_mass("bodies.inverse_mass", masses)
        _require_finite("inverse_inertia", inertia)
        _require_inertia(inertia)
        sizes = np.bincount(indices[indices != FREE], minlength=b)
        if np.any(sizes == 0):
            raise ValueError(f"body {np.argmin(sizes)} has no particle")
        _keep(self, body=indices, arm=arms, inverse_mass=masses, inverse_inertia=inertia)


@dataclass(frozen=True, eq=False, init=False)
class Problem:
    """The projection problem of a time step: n particles and m contacts.

    The projection is that of ``predicted_velocity`` onto the velocities V with

    gap + timestep normal . (V_first - V_second) + compliance impulse >= 0

    of every contact (docs/method/projection.md). Names and units are those of a record
    (docs/reference/record.md), with indices in place of IDs. Lists will do for arrays, and one
    number for all particles or contacts where a default is named, and for ``inverse_mass``.

    Attributes
    ----------
    timestep : h > 0, time
    predicted_velocity : without contacts, length/time, (n, 3)
    inverse_mass : 0 for a particle that nothing moves; not read in a body, 1/mass, (n,)
    first, second : particles of each contact, 0 to n - 1; second is -1 for a wall, (m,)
    normal : unit vectors from the second side to the first, (m, 3)
    gap : distance of the surfaces, negative for an overlap; what a wall moves towards the particle
        in the step is taken off, length, (m,)
    impulse_guess : from which "sweeps" and "apgd" start; 0 by default, mass length/time, (m,)
    least_impulse : at most 0; contacts can pull by as much; 0 by default, mass length/time, (m,)
    compliance : at least 0, makes springs of contacts; 0 by default, time/mass, (m,)
    refinement : above 0 to 1; the part of ``Limits.accuracy`` that a contact has; 1 by default,
        (m,)
    bodies : rigid bodies; none by default

    The arrays are copies that cannot be written to.

    Raises ValueError for another shape, numbers that are not finite or not allowed, and contacts of
    a particle with itself, within a body, or between two sides that cannot move.
    """

    timestep: float
    predicted_velocity: Floats
    inverse_mass: Floats
    first: Indices
    second: Indices
    normal: Floats
    gap: Floats
    impulse_guess: Floats
    least_impulse: Floats
    compliance: Floats
    refinement: Floats
    bodies: Bodies | None

    def __init__(
        self,
        *,
        timestep: float,
        predicted_velocity: ArrayLike,
        inverse_mass: ArrayLike,
        first: ArrayLike,
        second: ArrayLike,
        normal: ArrayLike,
        gap: ArrayLike,
        impulse_guess: ArrayLike = 0.0,
        least_impulse: ArrayLike = 0.0,
        compliance: ArrayLike = 0.0,
        refinement: ArrayLike = 1.0,
        bodies: Bodies | None = None,
    ) -> None:
        velocities = _floats("predicted_velocity", predicted_velocity, ("n", 3))
        gaps = _floats("gap", gap, ("m",))
        n, m = len(velocities), gaps.size
        _keep(
            self,
            timestep=positive("timestep", timestep),
            predicted_velocity=velocities,
            inverse_mass=_floats("inverse_mass", inverse_mass, (n,), one_for_all=True),
            first=_indices("first", first, (m,)),
            second=_indices("second", second, (m,)),
            normal=_floats("normal", normal, (m, 3)),
            gap=gaps,
            impulse_guess=_floats("impulse_guess", impulse_guess, (m,), one_for_all=True),
            least_impulse=_floats("least_impulse", least_impulse, (m,), one_for_all=True),
            compliance=_floats("compliance", compliance, (m,), one_for_all=True),
            refinement=_floats("refinement", refinement, (m,), one_for_all=True),
            bodies=bodies,
        )
        self._check_particles()
        self._check_contacts()

    def _check_particles(self) -> None:
        """Check velocities, masses and that the bodies are of as many particles."""
        n = len(self.predicted_velocity)
        if self.bodies is not None and self.bodies.body.size != n:
            raise ValueError(f"bodies are of {self.bodies.body.size} particles, not of {n}")
        free = np.ones(n, bool) if self.bodies is None else self.bodies.body == FREE
        _require_finite("predicted_velocity", self.predicted_velocity)
        _require_inverse_mass("inverse_mass", self.inverse_mass, where=free)

    def _check_contacts(self) -> None:
        """Check all arrays of contacts, each number by itself and then with the others."""
        n = len(self.predicted_velocity)
        first, second = self.first, self.second
        for name in ("normal", "gap", "impulse_guess", "least_impulse", "compliance", "refinement"):
            _require_finite(name, getattr(self, name))
        _require("least_impulse", self.least_impulse, self.least_impulse <= 0, "must be at most 0")
        _require("compliance", self.compliance, self.compliance >= 0, "must be at least 0")
        allowed = (self.refinement > 0) & (self.refinement <= 1)
        _require("refinement", self.refinement, allowed, "must be above 0 and at most 1")
        particles = f"must be one of the {n} particles from 0 on"
        _require("first", first, (first >= 0) & (first < n), particles)
        _require(
            "second", second, (second >= WALL) & (second < n), f"{particles}, or -1 for a wall"
        )
        _refuse(first == second, "is of a particle with itself")
        if self.bodies is not None:
            body = np.append(self.bodies.body, FREE)  # a wall's -1 is the last one
            within = (body[first] == body[second]) & (body[first] != FREE)
            _refuse(within, "is between two particles of one body")
        square = np.einsum("ij,ij->i", self.normal, self.normal)
        _refuse(np.abs(square - 1) > FLAW, "has a normal that is not of length 1")
        mobility = self._mobility(first) + self._mobility(second)
        _refuse(~(mobility > 0), "is between two sides that cannot move")

    def _mobility(self, side: Indices) -> Floats:
        """Return what a unit impulse of each contact adds to the speed of a side, 1/mass, (m,)."""
        alone = np.append(self.inverse_mass, 0.0)[side]  # a wall's -1 is the last one
        if self.bodies is None:
            return alone
        body = np.append(self.bodies.body, FREE)[side]
        inside = body != FREE
        of = body[inside]
        turn = np.cross(self.bodies.arm[side[inside]], self.normal[inside])
        turning = np.einsum("ci,cij,cj->c", turn, self.bodies.inverse_inertia[of], turn)
        alone[inside] = self.bodies.inverse_mass[of] + turning
        return alone


def impulses_of(problem: Problem, impulse: ArrayLike) -> Floats:
    """Return impulses of the contacts as an array, (m,). Raises ValueError if they are none."""
    impulses = _floats("impulse", impulse, problem.gap.shape, one_for_all=True)
    _require_finite("impulse", impulses)
    return impulses


def require_number(name: str, value: object, kind: type = Real) -> None:
    """Raise ValueError for what is no number of a kind, real or whole."""
    if not isinstance(value, kind) or isinstance(value, bool):
        raise ValueError(f"{name} must be a {'real' if kind is Real else 'whole'} number")


def positive(name: str, value: float) -> float:
    """Return a number. Raises ValueError unless it is finite and greater than 0."""
    require_number(name, value)
    if not 0 < value < np.inf:
        raise ValueError(f"{name} is {value}: it must be finite and greater than 0")
    return float(value)


def _keep(self: Bodies | Problem, **values: object) -> None:
    """Set the attributes of an object that is frozen."""
    for name, value in values.items():
        object.__setattr__(self, name, value)


def _given(
    name: str, values: ArrayLike, shape: tuple[int | str, ...], one_for_all: bool
) -> NDArray[Any]:
    """Return real numbers of a shape, in which letters stand for any length."""
    try:
        given = np.asarray(values)
    except ValueError:  # lists of different lengths
        given = np.array(None)
    if given.dtype.kind not in "iuf":
        raise ValueError(f"{name} must be an array of real numbers")
    known = [length for length in shape if isinstance(length, int)]
    if one_for_all and given.ndim == 0:
        return np.broadcast_to(given, known)
    if len(given.shape) != len(shape) or any(
        isinstance(length, int) and length != found
        for length, found in zip(shape, given.shape, strict=True)
    ):
        wanted = ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "")
        raise ValueError(f"{name} must have the shape ({wanted}), not {given.shape}")
    return given


def _floats(
    name: str, values: ArrayLike, shape: tuple[int | str, ...], *, one_for_all: bool = False
) -> Floats:
    """Return a copy that cannot be written to."""
    with np.errstate(over="ignore"):  # what a double cannot hold is infinite, and refused
        copy = np.array(_given(name, values, shape, one_for_all), np.float64, order="C")
    copy.setflags(write=False)
    return copy


def _indices(name: str, values: ArrayLike, shape: tuple[int | str, ...]) -> Indices:
    """Return a copy that cannot be written to."""
    given = _given(name, values, shape, False)
    with np.errstate(invalid="ignore"):  # what is no whole number differs from its copy
        copy = np.array(given, np.int64, order="C")
    _require(name, given, copy == given, "must be a whole number")
    copy.setflags(write=False)
    return copy


def _require(name: str, values: NDArray[Any], good: NDArray[np.bool_], allowed: str) -> None:
    """Refuse an array for the first of its numbers that is not good."""
    if not np.all(good):
        at = tuple(map(int, np.argwhere(~good)[0]))
        raise ValueError(f"{name}[{', '.join(map(str, at))}] is {values[at]:g}: it {allowed}")


def _require_finite(name: str, values: Floats, where: NDArray[np.bool_] | bool = True) -> None:
    _require(name, values, np.isfinite(values) | ~np.asarray(where), "must be finite")


def _require_inverse_mass(
    name: str, values: Floats, where: NDArray[np.bool_] | bool = True
) -> None:
    _require_finite(name, values, where)
    _require(name, values, (values >= 0) | ~np.asarray(where), "must be at least 0")


def _require_inertia(inertia: Floats) -> None:
    """Refuse matrices that are not symmetric and positive semi-definite, but for round-off."""
    size = np.abs(inertia).max(axis=(1, 2), initial=0.0)
    scaled = inertia / np.where(size > 0, size, 1.0)[:, None, None]
    skew = np.abs(scaled - scaled.transpose(0, 2, 1)).max(axis=(1, 2), initial=0.0)
    wrong = (skew > FLAW) | (np.linalg.eigvalsh(scaled)[:, 0] < -FLAW)
    if np.any(wrong):
        raise ValueError(
            f"inverse_inertia of body {np.argmax(wrong)} is not symmetric and positive "
            "semi-definite"
        )


def _refuse(wrong: NDArray[np.bool_], why: str) -> None:
    """Refuse contacts for the first one that is wrong."""
    if np.any(wrong):
        raise ValueError(f"contact {np.argmax(wrong)} {why}")
