"""The contact solver of ``fix inelastic`` as a Python module.

The module projects predicted velocities onto those that keep every contact apart, without LAMMPS.
The tests judge the solvers with it, and it can be used on its own. ``_core.pyi`` documents shapes
and units.
"""

from lammps_inelastic.core._core import (
    Projection,
    largest_eigenvalue,
    project,
    residual,
    uniform_vector,
)

__all__ = [
    "Projection",
    "largest_eigenvalue",
    "project",
    "residual",
    "uniform_vector",
]
