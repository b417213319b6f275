"""A grain that is pressed between nearly parallel walls: how long that takes."""

from __future__ import annotations

import numpy as np
import pytest

from lammps_inelastic import core

TOLERANCE, ACCURACY = 1e-6, 1e-3
WALLS = 6


def wedged(angle: float) -> core.Problem:
    """Return a row of three spheres, the last of which drives the first one between six walls.

    The normals of the walls are at an angle to the row, at random around it.
    """
    draw = np.random.default_rng(1).uniform(0.5, 1.0, (2, WALLS))
    around = np.linspace(0.0, 2 * np.pi, WALLS, endpoint=False)
    across = np.sin(angle) * draw * [np.cos(around), np.sin(around)]
    walls = np.column_stack([np.full(WALLS, np.cos(angle)), *across])
    row = np.tile([-0.995, 0.07, 0.06], (2, 1))
    normals = np.vstack([walls, row])
    return core.Problem(
        timestep=0.01,
        predicted_velocity=[[0.0, 0.1, 0.0], [0.0, 0.1, 0.0], [-100.0, 0.1, 0.0]],
        inverse_mass=1.0,
        first=[0] * WALLS + [0, 1],
        second=[-1] * WALLS + [1, 2],
        normal=normals / np.linalg.norm(normals, axis=1)[:, None],
        gap=np.zeros(WALLS + 2),
    )


@pytest.mark.parametrize("solver", ["sweeps", "apgd"])
@pytest.mark.parametrize("angle", [0.3, 0.003])
def test_a_wedged_grain_takes_less_than_a_thousand_iterations(
    angle: float, solver: core.Solver
) -> None:
    """Conjugate gradients solve what others take thousands for, and to the accuracy."""
    problem = wedged(angle)
    found = core.project(problem, core.Limits(TOLERANCE, ACCURACY), solver=solver)
    assert found.converged
    # Some hundreds of others pass before they are tried.
    assert found.iterations <= 1000
    exact = core.project(problem, core.Limits(1e-13), solver=solver)
    # A thousandth of what gives the impact.
    assert np.abs(found.velocity - exact.velocity).max() <= 1e-3 * 100.0
