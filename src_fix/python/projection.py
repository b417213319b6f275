"""The projection of a problem's velocities, and what judges it."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from lammps_inelastic.core import _core
from lammps_inelastic.core.problem import Floats, Problem, impulses_of, positive, require_number

# How a search for the impulses can end.
Status = Literal["converged", "out of iterations", "round-off", "not finite", "infeasible"]
# Coloured sweeps, as in the fix, accelerated gradient, or the paper's Uzawa
# (docs/method/solvers.md).
Solver = Literal["sweeps", "apgd", "uzawa"]


@dataclass(frozen=True)
class Limits:
    """What ends a search for the impulses.

    Attributes
    ----------
    tolerance : largest residual of a solution, > 0, length
    accuracy : from 0 to below 1; what each contact is resolved to beyond the tolerance
        (docs/method/tolerances.md), 0: the tolerance alone counts
    max_iterations : largest number of iterations
    reach : a problem that only steps further than this can solve is infeasible, > 0, length;
        without it none is

    Raises ValueError for other numbers.
    """

    tolerance: float
    accuracy: float = 0.0
    max_iterations: int = 100_000
    reach: float = np.inf

    def __post_init__(self) -> None:
        positive("tolerance", self.tolerance)
        for name in ("accuracy", "reach"):
            require_number(name, getattr(self, name))
        require_number("max_iterations", self.max_iterations, Integral)
        if not 0 <= self.accuracy < 1:
            raise ValueError(f"accuracy is {self.accuracy}: it must be at least 0 and below 1")
        # The solver counts in 64 bits.
        if not 0 <= self.max_iterations < 2**63:
            raise ValueError(
                f"max_iterations is {self.max_iterations}: it must be at least 0 and below 2^63"
            )
        if not self.reach > 0:
            raise ValueError(f"reach is {self.reach}: it must be greater than 0")


@dataclass(frozen=True, eq=False)
class Projection:
    """The projection of a problem's velocities.

    Attributes
    ----------
    velocity : projected velocities, length/time, (n, 3)
    impulse : of the contacts, each at least its least one, mass length/time, (m,)
    iterations : that the solver made
    status : how it ended. "converged": the residuals that the solver looks at, of "uzawa" the
        feasibility alone, are within the limits. "round-off": the tolerance is below that of the
        gaps. "not finite": a number has become infinite, or none. "infeasible": see Limits.reach
    feasibility : the most that is lacking of a gap at the end of the step; of a spring the impulse
        times the compliance is added to the gap before. The gap of a contact that can pull, and
        does so by less than it can, counts as well, length
    complementarity : largest gap left where an impulse is above its least one, length

    Both residuals are infinite where a number of the result is not finite.
    """

    velocity: Floats
    impulse: Floats
    iterations: int
    status: Status
    feasibility: float
    complementarity: float

    @property
    def converged(self) -> bool:
        """Whether the status is "converged"."""
        return self.status == "converged"


def project(problem: Problem, limits: Limits, *, solver: Solver = "sweeps") -> Projection:
    """Project the predicted velocities onto those that keep every contact apart.

    Raises ValueError for another solver.
    """
    if solver not in get_args(Solver):
        raise ValueError(f"solver is {solver!r}: it must be 'sweeps', 'apgd' or 'uzawa'")
    return Projection(
        *_core.project(
            problem,
            solver,
            tolerance=limits.tolerance,
            accuracy=limits.accuracy,
            max_iterations=limits.max_iterations,
            reach=limits.reach,
        )
    )


def residual(problem: Problem, impulse: ArrayLike) -> tuple[float, float]:
    """Return the feasibility and the complementarity of impulses, as in Projection, length.

    Parameters
    ----------
    impulse : impulses of the contacts, mass length/time, (m,), or one for all

    Raises ValueError for another shape, and for numbers that are not finite.
    """
    return _core.residual(problem, impulses_of(problem, impulse))


def largest_eigenvalue(problem: Problem) -> float:
    """Return the largest eigenvalue of A = h G M^-1 G^T + C, time/mass.

    The estimate comes from below and is mostly within a relative 1e-3.
    """
    return _core.largest_eigenvalue(problem)
