"""The contact solver of ``fix inelastic`` as a Python module.

Projects predicted velocities onto those that keep every contact apart, without LAMMPS: what the
tests judge the solvers with, and usable on its own. See ``_core.pyi`` for shapes and units.
"""

from lammps_inelastic.core._core import (
    Projection,
    largest_eigenvalue,
    project,
    residual,
    uniform_vector,
    write_npz,
)

__all__ = [
    "Projection",
    "largest_eigenvalue",
    "project",
    "residual",
    "uniform_vector",
    "write_npz",
]
