"""The projection problem: see src_fix/core/contact_problem.h for the equations.

n particles, m contacts. ``first`` and ``second`` are int64 arrays (m,) of particle indices, second
= -1 for a wall; ``normal`` (m, 3) are unit vectors from second to first; ``gap`` (m,) [length] is
negative for an overlap. ``inverse_mass`` (n,) [1 / mass], zero for a frozen particle. Arrays are
float64 and C-contiguous. TypeError for arrays of another dimension; ValueError for wrong lengths,
indices out of range, numbers that are not finite, negative masses, normals that have not length 1,
a contact of a particle with itself and contacts between two particles that cannot move.

Particles may be in b rigid bodies, by four more arguments, all of them or none. ``body`` (n,) int64
names each particle's body, 0 ... b - 1, or -1 for a free particle; a body has at least one
particle. ``arm`` (n, 3) [length] points from the body's centre of mass to the particle and is not
read for free particles. ``body_inverse_mass`` (b,) [1 / mass]; ``body_inverse_inertia`` (b, 3, 3)
[1 / (mass length^2)] is symmetric and positive semi-definite: the pseudo-inverse of the inertia for
point masses on a line. The ``inverse_mass`` of particles in bodies is not read. ValueError also for
a contact between two particles of one body.
"""

import numpy as np
from numpy.typing import NDArray

class Projection:
    @property
    def velocity(self) -> NDArray[np.float64]: ...  # (n, 3) [length / time]
    @property
    def impulse(self) -> NDArray[np.float64]: ...  # (m,) [mass length / time], >= 0
    @property
    def iterations(self) -> int: ...
    @property
    def converged(self) -> bool: ...
    @property
    def feasibility(self) -> float: ...  # largest overlap left at the end of the step [length]
    @property
    def complementarity(self) -> float: ...  # largest gap where an impulse acts [length]

def project(
    predicted_velocity: NDArray[np.float64],
    inverse_mass: NDArray[np.float64],
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    normal: NDArray[np.float64],
    gap: NDArray[np.float64],
    *,
    timestep: float,
    tolerance: float,
    solver: str = "apgd",
    max_iterations: int = 100000,
    impulse: NDArray[np.float64] | None = None,
    body: NDArray[np.int64] | None = None,
    arm: NDArray[np.float64] | None = None,
    body_inverse_mass: NDArray[np.float64] | None = None,
    body_inverse_inertia: NDArray[np.float64] | None = None,
) -> Projection:
    """Project ``predicted_velocity`` (n, 3) onto the velocities that keep every contact apart.

    Both residuals come down to ``tolerance`` [length] (with "uzawa" only the feasibility), or
    ``converged`` is False after ``max_iterations``. ``impulse`` (m,) is a first guess for "apgd".
    """

def residual(
    predicted_velocity: NDArray[np.float64],
    inverse_mass: NDArray[np.float64],
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    normal: NDArray[np.float64],
    gap: NDArray[np.float64],
    impulse: NDArray[np.float64],
    *,
    timestep: float,
    body: NDArray[np.int64] | None = None,
    arm: NDArray[np.float64] | None = None,
    body_inverse_mass: NDArray[np.float64] | None = None,
    body_inverse_inertia: NDArray[np.float64] | None = None,
) -> tuple[float, float]:
    """Feasibility and complementarity [length] of given impulses."""

def largest_eigenvalue(
    inverse_mass: NDArray[np.float64],
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    normal: NDArray[np.float64],
    *,
    timestep: float,
    body: NDArray[np.int64] | None = None,
    arm: NDArray[np.float64] | None = None,
    body_inverse_mass: NDArray[np.float64] | None = None,
    body_inverse_inertia: NDArray[np.float64] | None = None,
) -> float:
    """Largest eigenvalue of h G M^-1 G^T [time / mass], from below and mostly to 1e-3."""

def uniform_vector(seed: int, particle: int, step: int) -> tuple[float, float, float]:
    """The three numbers, uniform in [-1, 1], that ``fix random/force`` gives one particle."""

def write_npz(path: str, arrays: dict[str, NDArray[np.float64]]) -> None:
    """Write (n, 3) arrays with the core's own .npz writer. RuntimeError when it cannot."""
