"""The compiled solver: it checks nothing, since Problem and Limits have done so."""

from lammps_inelastic.core.problem import Floats, Problem
from lammps_inelastic.core.projection import Status

def project(
    problem: Problem,
    solver: str,
    *,
    tolerance: float,
    accuracy: float,
    max_iterations: int,
    reach: float,
) -> tuple[Floats, Floats, int, Status, float, float]:
    """Return the attributes of projection.Projection in their order."""

def residual(problem: Problem, impulse: Floats) -> tuple[float, float]:
    """Return the feasibility and the complementarity of impulses (m,) [length]."""

def largest_eigenvalue(problem: Problem) -> float:
    """Return the largest eigenvalue of A [time / mass]."""

def uniform_vector(seed: int, particle: int, step: int) -> tuple[float, float, float]:
    """Return the three numbers, uniform in [-1, 1], of one particle in ``fix random/force``.

    The seed has 32 bits, the other two 64; a number below 0 or beyond is a TypeError.
    """
