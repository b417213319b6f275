"""Heavy particles on light ones: what every contact carries, and how long that takes."""

from __future__ import annotations

import numpy as np
import pytest

from lammps_inelastic import core

# [length / time^2, time, length]
GRAVITY, TIMESTEP, TOLERANCE = 9.81, 0.005, 1e-6


def loaded_column(count: int, ratio: float, guess: float = 0.0) -> core.Problem:
    """Return `count` particles of mass 1 that touch on a floor, and one of mass `ratio` on top."""
    masses = np.append(np.ones(count), ratio)
    velocities = np.zeros((count + 1, 3))
    velocities[:, 1] = -GRAVITY * TIMESTEP
    normals = np.tile([0.0, 1.0, 0.0], (count + 1, 1))
    return core.Problem(
        timestep=TIMESTEP,
        predicted_velocity=velocities,
        inverse_mass=1 / masses,
        first=np.arange(count + 1),
        second=np.arange(count + 1) - 1,  # -1 is the floor
        normal=normals,
        gap=np.zeros(count + 1),
        impulse_guess=guess * carried(count, ratio),
    )


def carried(count: int, ratio: float) -> np.ndarray:
    """Return the impulses: what lies on each contact, from the floor up."""
    masses = np.append(np.ones(count), ratio)
    return np.asarray(np.cumsum(masses[::-1])[::-1] * GRAVITY * TIMESTEP)


@pytest.mark.parametrize("solver", ["sweeps", "apgd"])
@pytest.mark.parametrize(
    ("count", "ratio"), [(2, 1e3), (5, 1e8), (20, 1e6), (20, 1e10), (30, 1e6), (100, 1e8)]
)
def test_a_column_is_carried(count: int, ratio: float, solver: core.Solver) -> None:
    """Every contact carries what lies on it, from no first guess, after a thousand iterations."""
    problem = loaded_column(count, ratio)
    found = core.project(problem, core.Limits(TOLERANCE, accuracy=1e-3), solver=solver)
    assert found.converged
    # A particle keeps at most the residuals of the contacts below it, of A / 16 of g h each.
    left = np.abs(found.velocity[:, 1]) / (GRAVITY * TIMESTEP)
    assert left.max() <= (count + 1) * 1e-3 / 16 * (1 + 1e-6)
    # The same, of the weights that a contact carries.
    assert found.impulse == pytest.approx(carried(count, ratio), rel=(count + 1) * 1e-3 / 16)
    # Conjugate gradients take as many as there are contacts, after some hundreds of others.
    assert found.iterations <= 1000


def test_a_column_that_was_carried_takes_no_iteration() -> None:
    """The forces of the last step solve the next one."""
    problem = loaded_column(20, 1e6, guess=1.0)
    found = core.project(problem, core.Limits(TOLERANCE, accuracy=1e-3))
    assert found.converged
    assert found.iterations == 0


def test_a_column_of_equal_masses_is_carried() -> None:
    """Without heavy particles sweeps find what 300 contacts in series carry."""
    found = core.project(loaded_column(300, 1.0), core.Limits(TOLERANCE, accuracy=1e-3))
    assert found.converged
    # Residuals of A / 16 of g h each add up along the column, of which they are a part again.
    assert found.impulse == pytest.approx(carried(300, 1.0), rel=300 * 1e-3 / 16)
