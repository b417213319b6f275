"""Scenes with an exact motion: how far the spheres are from it, against time step and tolerance.

All spheres have density 1. Lengths are in diameters of the larger spheres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from tests.helpers.bodies import DUMP_BODY_SPHERES, body_scene, dimer, placed, rigid_velocities
from tests.helpers.lammps_run import run_lmp
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    GRAVITY,
    FloatArray,
    mass,
    read_dump,
    scene,
)

RADIUS = 0.5
SAMPLES = 16  # times, at which positions are compared
# What a collision leaves of a velocity stays for ever, whatever the time step.
ACCURACIES = (1e-7, 1e-3)
BOX = ((-6.0, 6.0),) * 3


@dataclass(frozen=True, eq=False)
class Exact:
    """A scene whose motion is known.

    Attributes
    ----------
    duration : time
    deck : the deck up to its run, of a folder, a tolerance, a time step and an accuracy
    dump : the dump command of the deck
    positions : centres (spheres, 3) at a time
    """

    duration: float
    deck: Callable[[Path, float, float, float], str]
    dump: str
    positions: Callable[[float], FloatArray]

    def error(self, folder: Path, tolerance: float, steps: int, accuracy: float) -> float:
        """Run it in so many steps, a multiple of SAMPLES; return the largest error [length]."""
        every = steps // SAMPLES
        deck = self.deck(folder, tolerance, self.duration / steps, accuracy)
        deck = deck.replace("thermo 1\n", "")
        dump = self.dump.replace("custom 1 ", f"custom {every} ")
        run_lmp(folder, deck + dump + f"run {steps}\n", timeout=300)
        errors = [
            np.abs(frame.positions - self.positions(frame.step * self.duration / steps)).max()
            for frame in read_dump(folder / "particles.dump")
        ]
        assert len(errors) == SAMPLES + 1
        return float(max(errors))


def tipping_dimer(inertia: str) -> Exact:
    """A dimer stands on one end, tips over while it slides, and comes to lie on the floor.

    Without friction its centre of mass moves on at its velocity along the floor. With the angle q
    from the vertical, half the distance of the centres a, and the inertia J / M per mass about the
    centre, the Lagrangian is L / M = (a^2 sin^2 q + J / M) q'^2 / 2 - g a cos q; the lower sphere
    stays on the floor. When the upper one meets it the rotation of point masses ends at once,
    because a push on one of them leaves the other at rest. Solid spheres would rock from then on:
    their motion ends just before.
    """
    shape, tilt, speed = dimer(1.5), 0.3, 0.7
    a = 0.5 * float(np.ptp(shape[:, 0])) * 2 * RADIUS
    inertia_per_mass = a**2 + (0.4 * RADIUS**2 if inertia == "solid" else 0.0)

    def change(_: float, state: FloatArray) -> list[float]:
        q, w = state
        s, c = np.sin(q), np.cos(q)
        return [w, (GRAVITY * a * s - a**2 * s * c * w**2) / (a**2 * s**2 + inertia_per_mass)]

    def flat(_: float, state: FloatArray) -> float:
        return float(state[0] - 0.5 * np.pi)

    flat.terminal = True
    fall = solve_ivp(
        change,
        (0, 10),
        [tilt, 0.0],
        events=flat,
        rtol=1e-12,
        atol=1e-13,
        dense_output=True,
        method="DOP853",
    )
    landing = float(fall.t_events[0][0])

    def positions(time: float) -> FloatArray:
        angle = float(fall.sol(time)[0]) if time < landing else 0.5 * np.pi
        axis = np.array([np.sin(angle), np.cos(angle), 0.0])
        centre = np.array([speed * time, RADIUS + a * np.cos(angle), 0.0])
        return np.array([centre - a * axis, centre + a * axis])

    def deck(folder: Path, tolerance: float, timestep: float, accuracy: float) -> str:
        start = placed(shape, positions(0.0).mean(axis=0), [0, 0, 0.5 * np.pi - tilt])
        v, w = rigid_velocities(start, RADIUS, [speed, 0, 0], [0, 0, 0])
        return body_scene(
            start,
            RADIUS,
            folder,
            inertia=inertia,
            tolerance=tolerance,
            velocities=v,
            spins=w,
            box=BOX,
            timestep=timestep,
            setup="region floor plane 0 0 0 0 1 0",
            options=f"region floor accuracy {accuracy:g}",
            thermo="step",
        )

    return Exact(
        (1.4 if inertia == "point" else 0.98) * landing, deck, DUMP_BODY_SPHERES, positions
    )


def oblique_pair() -> Exact:
    """A small sphere meets a larger one that rests, obliquely; no gravity."""
    radii = np.array([0.5, 0.3])
    start = np.array([[0.0, 0.0, 0.0], [-1.7, 0.35, 0.11]])
    velocity = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    x, v = start[1] - start[0], velocity[1] - velocity[0]
    # |x + v t| = r_1 + r_2
    b, c = x @ v, x @ x - radii.sum() ** 2
    meeting = (-b - np.sqrt(b**2 - (v @ v) * c)) / (v @ v)
    normal = x + v * meeting
    normal /= np.linalg.norm(normal)
    inverse = 1 / mass(radii)
    impulse = -(v @ normal) / inverse.sum() * normal
    after = velocity + np.outer([-inverse[0], inverse[1]], impulse)

    def positions(time: float) -> FloatArray:
        before = min(time, meeting)
        return start + velocity * before + after * (time - before)

    def deck(folder: Path, tolerance: float, timestep: float, accuracy: float) -> str:
        return scene(
            start,
            radii,
            folder,
            tolerance=tolerance,
            velocities=velocity,
            box=BOX,
            timestep=timestep,
            skin=1.0,
            gravity=False,
            options=f"accuracy {accuracy:g}",
            thermo="step",
        )

    return Exact(2.1 * float(meeting), deck, DUMP_PARTICLES, positions)


def chain() -> Exact:
    """Four spheres in a row fly at a wall; each stops where it meets what has stopped before."""
    gaps = np.array([0.37, 0.11, 0.23, 0.05])
    ends = RADIUS + 2 * RADIUS * np.arange(4)
    start = ends + gaps.cumsum()

    def positions(time: float) -> FloatArray:
        along = np.maximum(ends, start - time)
        return np.column_stack([along, np.zeros(4), np.zeros(4)])

    def deck(folder: Path, tolerance: float, timestep: float, accuracy: float) -> str:
        return scene(
            positions(0.0),
            RADIUS,
            folder,
            tolerance=tolerance,
            velocities=[-1.0, 0, 0],
            box=BOX,
            timestep=timestep,
            skin=1.0,
            gravity=False,
            setup="region wall plane 0 0 0 1 0 0",
            options=f"region wall accuracy {accuracy:g}",
            thermo="step",
        )

    return Exact(1.13, deck, DUMP_PARTICLES, positions)


SCENES: dict[str, Callable[[], Exact]] = {
    "tipping dimer of point masses": lambda: tipping_dimer("point"),
    "tipping dimer of solid spheres": lambda: tipping_dimer("solid"),
    "two unequal spheres, oblique": oblique_pair,
    "four in a row, at a wall": chain,
}
TOLERANCES = (1e-3, 1e-5, 1e-7)
STEPS = (32, 128, 512, 2048, 8192)
