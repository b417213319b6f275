"""Contact problems to solve, and dense formulas to judge the solutions with, in plain NumPy.

Lengths are in sphere diameters, velocities near 1, masses near 1, time steps near 0.01.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lammps_inelastic import core

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
# First and second particle, normal and gap.
Contact = tuple[int, int, ArrayLike, float]

WALL = -1
UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Bodies:
    """What ``core.Bodies`` takes, in arrays that can be written to."""

    body: Indices
    arm: Floats
    inverse_mass: Floats
    inverse_inertia: Floats

    @property
    def members(self) -> list[Indices]:
        """The particles of each body."""
        return [np.flatnonzero(self.body == b) for b in range(self.inverse_mass.size)]


def no_bodies(particles: int) -> Bodies:
    return Bodies(
        np.full(particles, -1), np.zeros((particles, 3)), np.zeros(0), np.zeros((0, 3, 3))
    )


@dataclass(frozen=True)
class Problem:
    """What ``core.Problem`` takes, in arrays that can be written to.

    The inverse masses of particles in bodies are those of the body's parts.
    """

    predicted_velocity: Floats
    inverse_mass: Floats
    first: Indices
    second: Indices
    normal: Floats
    gap: Floats
    timestep: float
    bodies: Bodies

    def for_core(self, **contacts: Any) -> core.Problem:
        """Return the problem as the core takes it, with more about its contacts.

        What the core says that it does not read is no number.
        """
        given = self.bodies
        free = given.body < 0
        arm = np.where(free[:, None], np.nan, given.arm)
        bodies = core.Bodies(given.body, arm, given.inverse_mass, given.inverse_inertia)
        return core.Problem(
            timestep=self.timestep,
            predicted_velocity=self.predicted_velocity,
            inverse_mass=np.where(free, self.inverse_mass, np.nan),
            first=self.first,
            second=self.second,
            normal=self.normal,
            gap=self.gap,
            bodies=bodies if given.inverse_mass.size else None,
            **contacts,
        )

    @property
    def mass(self) -> Floats:
        """Mass of each particle; zero where frozen, so that sums leave those out."""
        movable = self.inverse_mass > 0
        return np.where(movable, 1 / np.where(movable, self.inverse_mass, 1), 0)

    @property
    def fastest(self) -> float:
        return float(np.abs(self.predicted_velocity).max())

    def project(
        self,
        tolerance: float,
        *,
        solver: core.Solver = "sweeps",
        accuracy: float = 0.0,
        max_iterations: int = 100_000,
        **contacts: Any,
    ) -> core.Projection:
        limits = core.Limits(tolerance, accuracy, max_iterations)
        return core.project(self.for_core(**contacts), limits, solver=solver)

    def jacobian(self) -> Floats:
        """G (m, 3 n), dense: (G V)_c = n_c . (v_first - v_second)."""
        rows = np.zeros((self.gap.size, self.inverse_mass.size + 1, 3))
        contacts = np.arange(self.gap.size)
        rows[contacts, self.first] += self.normal
        rows[contacts, self.second] -= self.normal  # a wall's -1 is the last, dropped particle
        return rows[:, :-1].reshape(self.gap.size, 3 * self.inverse_mass.size)

    def root(self) -> Floats:
        """R (3 n, 3 n + 6 b), dense, with M^-1 = R R^T: V = R y for coordinates y of unit mass.

        Those of free particles are their velocities times the root of the mass. Those of a body are
        its velocity and its angular velocities about the axes of inertia, so scaled; about the line
        of point masses there is no motion, and the column is zero.
        """
        bodies = self.bodies
        free = np.where(bodies.body < 0, self.inverse_mass, 0)
        columns = [np.diag(np.sqrt(np.repeat(free, 3)))]
        for b, members in enumerate(bodies.members):
            inverse_moment, axes = np.linalg.eigh(bodies.inverse_inertia[b])
            inverse_moment[inverse_moment < 1e-9 * inverse_moment[-1]] = 0
            turns = (axes * np.sqrt(inverse_moment)).T
            block = np.zeros((self.inverse_mass.size, 3, 6))
            block[members, :, :3] = np.sqrt(bodies.inverse_mass[b]) * np.eye(3)
            block[members, :, 3:] = np.cross(turns, bodies.arm[members, None]).transpose(0, 2, 1)
            columns.append(block.reshape(-1, 6))
        return np.hstack(columns)

    def delassus(self) -> Floats:
        """A = h G M^-1 G^T (m, m), dense."""
        product = self.jacobian() @ self.root()
        return self.timestep * product @ product.T

    def velocity(self, impulse: Floats) -> Floats:
        """V* + M^-1 G^T lambda."""
        root = self.root()
        change = root @ (root.T @ (self.jacobian().T @ impulse))
        return self.predicted_velocity + change.reshape(-1, 3)

    def gap_at_end(self, velocity: Floats) -> Floats:
        return self.gap + self.timestep * self.jacobian() @ velocity.ravel()

    def residual(self, impulse: Floats) -> tuple[float, float]:
        """Feasibility and complementarity [length]."""
        gap = self.gap_at_end(self.velocity(impulse))
        return -gap.min(initial=0.0), gap[impulse > 0].max(initial=0.0)

    def kinetic_energy(self, velocity: Floats) -> float:
        """Of rigid motions of the bodies; without the spin of spheres in a row about their line."""
        coordinates = np.linalg.lstsq(self.root(), velocity.ravel(), rcond=1e-9)[0]
        return float(0.5 * coordinates @ coordinates)

    def with_contacts(self, order: Indices) -> Problem:
        """Return the problem with these of its contacts, in this order; one may come twice."""
        return replace(
            self,
            first=self.first[order],
            second=self.second[order],
            normal=self.normal[order],
            gap=self.gap[order],
        )


def assert_within(actual: ArrayLike, expected: ArrayLike, bound: float) -> None:
    """Fail, naming the worst offender, where two arrays differ by more than the bound."""
    actual, expected = np.broadcast_arrays(np.asarray(actual, float), np.asarray(expected, float))
    difference = np.abs(actual - expected)
    if difference.size == 0:
        return
    worst = np.unravel_index(np.argmax(difference), difference.shape)  # a NaN, if there is one
    assert difference[worst] <= bound, (
        f"{actual[worst]:.17g} instead of {expected[worst]:.17g} at {tuple(map(int, worst))}: "
        f"off by {difference[worst]:.3g}, allowed {bound:.3g}"
    )


def residual_left(projection: core.Projection) -> float:
    """Return to what length each end-of-step gap of an active contact is known to be zero."""
    return max(projection.feasibility, projection.complementarity)


def problem(
    velocity: ArrayLike,
    mass: Sequence[float] | Floats,
    contacts: Sequence[Contact],
    timestep: float = 0.01,
) -> Problem:
    """Write out a small problem: contacts are (first, second, normal, gap) each.

    A particle of infinite mass is frozen.
    """
    first, second, normal, gap = zip(*contacts, strict=True) if contacts else ((), (), (), ())
    return Problem(
        np.array(velocity, float).reshape(-1, 3),
        1 / np.array(mass, float),
        np.array(first, np.int64),
        np.array(second, np.int64),
        np.array(normal, float).reshape(-1, 3),
        np.array(gap, float),
        timestep,
        no_bodies(len(mass)),
    )


def in_bodies(
    given: Problem,
    position: ArrayLike,
    groups: Sequence[Sequence[int] | Indices],
    radius: float = 0.0,
) -> Problem:
    """Join each group of particles, point masses or solid spheres of a radius, to a rigid body.

    It has their momentum and their angular momentum, without spins. Contacts within it go.
    """
    position = np.array(position, float)
    velocity = given.predicted_velocity.copy()
    bodies = no_bodies(given.inverse_mass.size)
    inverse_mass, inverse_inertia = [], []
    for b, group in enumerate(groups):
        members = np.array(group)
        mass = given.mass[members]
        inverse_mass.append(1 / mass.sum())
        arm = position[members] - mass @ position[members] / mass.sum()
        common = mass @ velocity[members] / mass.sum()
        solid = 0.4 * mass.sum() * radius**2 + mass @ (arm**2).sum(axis=1)
        inertia = solid * np.eye(3) - (mass * arm.T) @ arm
        inverse_inertia.append(np.linalg.pinv(inertia, rtol=1e-9, hermitian=True))
        turn = inverse_inertia[-1] @ (mass @ np.cross(arm, velocity[members]))
        velocity[members] = common + np.cross(turn, arm)
        bodies.body[members] = b
        bodies.arm[members] = arm
    bodies = replace(
        bodies,
        inverse_mass=np.array(inverse_mass),
        inverse_inertia=np.array(inverse_inertia).reshape(-1, 3, 3),
    )
    first, second = bodies.body[given.first], bodies.body[given.second]
    apart = (given.second == WALL) | (first < 0) | (first != second)
    joined = replace(given, predicted_velocity=velocity, bodies=bodies)
    return joined.with_contacts(np.flatnonzero(apart))


def column(mass: Sequence[float] | Floats, velocity: Sequence[float] | Floats) -> Problem:
    """Spheres on top of each other, the lowest on a floor, all just touching."""
    count = len(mass)
    contacts = [(k, k - 1, UP, 0.0) for k in range(count)]  # the lowest sphere's k - 1 is the wall
    return problem([(0, 0, v) for v in velocity], mass, contacts)


def row(mass: Sequence[float] | Floats, velocity: Sequence[float] | Floats) -> Problem:
    """Spheres side by side along x, all just touching, with these speeds along x."""
    contacts = [(k + 1, k, (1, 0, 0), 0.0) for k in range(len(mass) - 1)]
    return problem([(v, 0, 0) for v in velocity], mass, contacts)


def heap(
    seed: int,
    particles: int = 60,
    *,
    floor: bool = True,
    frozen: int = 0,
    overlap: float = 0.0,
    mass_ratio: float = 1.0,
    bodies: Sequence[int] = (),
    radius: float = 0.0,
) -> Problem:
    """Random points, each in contact with those nearby and the lower ones with a floor.

    About three contacts per particle. Gaps lie between -overlap and one step's motion, and are
    positive without overlap, so that V = 0 is admissible; with overlap, nothing frozen and no
    bodies, V pointing away from the origin is. Frozen particles have no velocity. Each number in
    ``bodies`` joins so many particles that are near to each other (see ``in_bodies``).
    """
    generator = np.random.default_rng(seed)
    timestep = 0.01
    position = generator.uniform(0, (particles / 0.9) ** (1 / 3), (particles, 3))
    separation = position[:, None] - position
    distance = np.linalg.norm(separation, axis=2)
    first, second = np.nonzero(np.triu(distance < 1.2, 1))
    normal = separation[first, second] / distance[first, second, None]
    if floor:
        low = np.flatnonzero(position[:, 2] < 0.8)
        first = np.concatenate([first, low])
        second = np.concatenate([second, np.full(low.size, WALL)])
        normal = np.concatenate([normal, np.tile(UP, (low.size, 1))])
    inverse_mass = mass_ratio ** generator.uniform(-0.5, 0.5, particles)
    inverse_mass[:frozen] = 0
    velocity = generator.uniform(-1, 1, (particles, 3))
    velocity[:frozen] = 0
    movable = np.maximum(first, second) >= frozen  # a wall has second = -1
    first, second, normal = first[movable], second[movable], normal[movable]
    gap = generator.uniform(-overlap if overlap else 0.02 * timestep, timestep, first.size)
    free = np.arange(frozen, particles)
    groups = []
    for size in bodies:
        nearest = np.argsort(distance[free[0], free])[:size]
        groups.append(free[nearest])
        free = np.delete(free, nearest)
    given = Problem(
        velocity, inverse_mass, first, second, normal, gap, timestep, no_bodies(particles)
    )
    return in_bodies(given, position, groups, radius)


def cubic_crystal(side: int, seed: int, *, walls: int = 1) -> Problem:
    """A cube of side^3 touching spheres of random velocities on a floor, or in a box of 6 walls.

    With six walls there are more contacts than degrees of freedom: the impulses are not unique.
    """
    index = np.arange(side**3).reshape(side, side, side)
    contacts: list[Contact] = []
    for axis in range(3):
        normal = np.eye(3)[axis]
        layers = np.moveaxis(index, axis, 0)
        if axis == 2 or walls == 6:
            contacts += [(i, WALL, normal, 0.0) for i in layers[0].ravel()]
        if walls == 6:
            contacts += [(i, WALL, -normal, 0.0) for i in layers[-1].ravel()]
        for below, above in pairwise(layers):
            contacts += [
                (j, i, normal, 0.0)
                for i, j in zip(below.ravel().tolist(), above.ravel().tolist(), strict=True)
            ]
    velocity = np.random.default_rng(seed).uniform(-1, 1, (side**3, 3))
    return problem(velocity, np.ones(side**3), contacts)


def bricks(side: int, seed: int, *, length: int, radius: float = 0.0, walls: int = 1) -> Problem:
    """A cubic crystal of rods, each of this many spheres on top of each other."""
    position = np.moveaxis(np.indices((side,) * 3), 0, -1).reshape(-1, 3)
    rods = np.arange(side**3).reshape(-1, length).tolist()
    return in_bodies(cubic_crystal(side, seed, walls=walls), position, rods, radius)


def dense_crystal(side: int, seed: int) -> Problem:
    """A face-centred cubic crystal of touching spheres on a floor, all rushing to its middle.

    Twice as many contacts as degrees of freedom, most of them pressed.
    """
    generator = np.random.default_rng(seed)
    cells = np.moveaxis(np.indices((side,) * 3), 0, -1).reshape(-1, 3)
    position = cells[cells.sum(axis=1) % 2 == 0] / np.sqrt(2)
    separation = position[:, None] - position
    distance = np.linalg.norm(separation, axis=2)
    contacts = [
        (i, j, separation[i, j], 0.0) for i, j in np.argwhere(np.triu(distance < 1.01, 1)).tolist()
    ]
    contacts += [(i, WALL, UP, 0.0) for i in np.flatnonzero(position[:, 2] == 0).tolist()]
    velocity = position.mean(axis=0) - position + generator.uniform(-1, 1, position.shape)
    return problem(velocity, np.ones(len(position)), contacts)
