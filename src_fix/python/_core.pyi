"""The projection problem: see src_fix/core/contact_problem.h for the equations.

There are n particles and m contacts. ``first`` and ``second`` (m,) int64 are indices of particles;
``second`` is -1 for a wall. ``normal`` (m, 3) are unit vectors that point from the second side to
the first. ``gap`` (m,) [length] is negative for an overlap. ``inverse_mass`` (n,) [1 / mass] is
zero for a frozen particle. All arrays but those of indices are float64, and all are C-contiguous.
The functions raise TypeError for arrays of another dimension. They raise ValueError for wrong
lengths, indices out of range, numbers that are not finite, negative masses, normals that have not
length 1, a contact of a particle with itself, and contacts between two sides that cannot move.

Particles may be in b rigid bodies. Four more arguments describe the bodies; either all are given
or none. ``body`` (n,) int64 names each particle's body, 0 ... b - 1, or is -1 for a free particle;
a body has at least one particle. ``arm`` (n, 3) [length] points from the body's centre of mass to
the particle and is not read for free particles. ``body_inverse_mass`` (b,) has the unit [1 /
mass]. ``body_inverse_inertia`` (b, 3, 3) [1 / (mass length^2)] is symmetric and positive semi-
definite; for point masses on a line it is the pseudo-inverse of the inertia. The ``inverse_mass``
of particles in bodies is not read. A contact between two particles of one body is a ValueError
too.
"""

import numpy as np
from numpy.typing import NDArray

class Projection:
    @property
    def velocity(self) -> NDArray[np.float64]:
        """The projected velocities (n, 3) [length / time]."""

    @property
    def impulse(self) -> NDArray[np.float64]:
        """The impulses (m,) [mass length / time]; none is below its least one."""

    @property
    def iterations(self) -> int:
        """The number of iterations that the solver made."""

    @property
    def converged(self) -> bool:
        """Whether the residuals that the solver looks at are within the tolerance."""

    @property
    def feasibility(self) -> float:
        """The largest overlap that is left at the end of the step [length]."""

    @property
    def complementarity(self) -> float:
        """The largest gap that is left where an impulse acts [length]."""

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
    accuracy: float = 0.0,
    solver: str = "apgd",
    max_iterations: int = 100000,
    impulse: NDArray[np.float64] | None = None,
    compliance: NDArray[np.float64] | None = None,
    least_impulse: NDArray[np.float64] | None = None,
    body: NDArray[np.int64] | None = None,
    arm: NDArray[np.float64] | None = None,
    body_inverse_mass: NDArray[np.float64] | None = None,
    body_inverse_inertia: NDArray[np.float64] | None = None,
) -> Projection:
    """Project ``predicted_velocity`` (n, 3) onto the velocities that keep every contact apart.

    The solver stops when both residuals, or with "uzawa" the feasibility alone, are within
    ``tolerance`` [length] and within what the ``accuracy`` A, a fraction, asks for: A max(m/10, r),
    with m and r as on the page of fix inelastic (what each tolerance bounds); 0 asks for nothing.
    It gives up after ``max_iterations``, or earlier if the tolerance is out of reach; ``converged``
    is then False. ``impulse`` (m,) is a first guess for "apgd". ``compliance`` (m,) [time / mass],
    not negative, makes contacts springs; without it all are rigid. ``least_impulse`` (m,)
    [mass length / time], not positive, lets contacts pull by as much; without it all only push.
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
    compliance: NDArray[np.float64] | None = None,
    least_impulse: NDArray[np.float64] | None = None,
    body: NDArray[np.int64] | None = None,
    arm: NDArray[np.float64] | None = None,
    body_inverse_mass: NDArray[np.float64] | None = None,
    body_inverse_inertia: NDArray[np.float64] | None = None,
) -> tuple[float, float]:
    """Return the feasibility and the complementarity [length] of given impulses.

    Of a contact with a compliance the impulse times the compliance is added to the gap.
    """

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
    """Return the largest eigenvalue of h G M^-1 G^T [time / mass].

    The estimate comes from below and is mostly within a relative 1e-3.
    """

def uniform_vector(seed: int, particle: int, step: int) -> tuple[float, float, float]:
    """Return the three numbers, uniform in [-1, 1], of one particle in ``fix random/force``."""
