"""The contact solver of ``fix inelastic`` as a Python module.

The module projects predicted velocities onto those that keep every contact apart, without LAMMPS.
The tests judge the solvers with it, and it can be used on its own (docs/reference/core.md).
"""

from lammps_inelastic.core._core import uniform_vector
from lammps_inelastic.core.problem import Bodies, Problem
from lammps_inelastic.core.projection import (
    Limits,
    Projection,
    Solver,
    Status,
    largest_eigenvalue,
    project,
    residual,
)
from lammps_inelastic.core.record import Record, read_record

__all__ = [
    "Bodies",
    "Limits",
    "Problem",
    "Projection",
    "Record",
    "Solver",
    "Status",
    "largest_eigenvalue",
    "project",
    "read_record",
    "residual",
    "uniform_vector",
]
