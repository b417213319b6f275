"""The projection problem: see src_fix/core/contact_problem.h for the equations.

There are n particles and m contacts. ``first`` and ``second`` (m,) int64 are indices of particles;
``second`` is -1 for a wall. ``normal`` (m, 3) are unit vectors that point from the second side to
the first. ``gap`` (m,) [length] is negative for an overlap. ``inverse_mass`` (n,) [1 / mass] is
zero for a frozen particle. Arrays of other real types, orders and strides are converted to float64
or int64, C-contiguous; of a number in an array of indices only the whole part is taken.

The functions raise TypeError for arrays of another shape than is said here, for complex ones and
for lists. They raise ValueError

- for arrays of wrong lengths, and for numbers that are not finite;
- for negative inverse masses, negative compliances and positive least impulses;
- for a time step or a tolerance that is not finite and above 0, for an accuracy that is below 0, 1
  or above, for another solver, and for a negative number of iterations;
- for a contact with indices out of range, of a particle with itself, with a normal that has not
  length 1, and between two sides that cannot move;
- with bodies: if some of their four arguments are missing, for a body's number out of range, a body
  without a particle, an inverse inertia that is not symmetric and positive semi-definite, and a
  contact between two particles of one body.

Particles may be in b rigid bodies. Four more arguments describe the bodies; either all are given
or none. ``body`` (n,) int64 names each particle's body, 0 ... b - 1, or is -1 for a free particle;
a body has at least one particle. ``arm`` (n, 3) [length] points from the body's centre of mass to
the particle and is not read for free particles. ``body_inverse_mass`` (b,) has the unit [1 /
mass]. ``body_inverse_inertia`` (b, 3, 3) [1 / (mass length^2)] is symmetric and positive semi-
definite; for point masses on a line it is the pseudo-inverse of the inertia. The ``inverse_mass``
of particles in bodies is not read.
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
        """Whether the residuals that the solver looks at are within the tolerance.

        These are both, and of "uzawa" the feasibility alone.
        """

    @property
    def feasibility(self) -> float:
        """The most that is lacking of a gap at the end of the step [length]; 0 if nothing is.

        Of rigid contacts that is the largest overlap. Of springs the impulse times the compliance
        is added to the gap first. Contacts with a least impulse below 0 whose impulse is above it
        hold, and their gaps count as well.
        """

    @property
    def complementarity(self) -> float:
        """The largest gap that is left where an impulse is above its least one [length].

        The least impulse is 0, if no other is given. The gap of a spring is that of feasibility.
        """

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

    The solver stops when the residual of every contact, or with "uzawa" what is lacking of its gap,
    is within ``tolerance`` [length] and within what the ``accuracy`` A, at least 0 and below 1,
    asks for: the contact's own target, as on the page of fix inelastic (what each tolerance
    bounds), but not less than round-off; 0 asks for nothing.
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

    Both are as in ``Projection``. They are infinite where a number of the result is not finite.
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
    """Return the three numbers, uniform in [-1, 1], of one particle in ``fix random/force``.

    The seed has 32 bits, the other two 64; a number below 0 or beyond is a TypeError.
    """
