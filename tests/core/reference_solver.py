"""The projection by Clarabel, an interior-point method that shares nothing with ours."""

from __future__ import annotations

import clarabel
import numpy as np
from scipy import sparse

from tests.core.contact_problems import Problem


class NotSolvedError(Exception):
    """Clarabel has given up: where no velocities leave all gaps open, it may."""


def reference(given: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Velocities and impulses from the primal problem, in V = V* + R y with M^-1 = R R^T:

    minimise 1/2 y . y  subject to  (gap / h + G V*) + G R y >= 0

    Clarabel's dual variables are the impulses: y - R^T G^T z = 0.
    """
    if given.gap.size == 0:
        return given.predicted_velocity, np.zeros(0)
    root = given.root()
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    solution = clarabel.DefaultSolver(
        sparse.identity(root.shape[1], format="csc"),
        np.zeros(root.shape[1]),
        sparse.csc_matrix(-given.jacobian() @ root),
        given.gap_at_end(given.predicted_velocity) / given.timestep,
        [clarabel.NonnegativeConeT(given.gap.size)],
        settings,
    ).solve()
    if solution.status != clarabel.SolverStatus.Solved:
        raise NotSolvedError(solution.status)
    change = (root @ solution.x).reshape(-1, 3)
    return given.predicted_velocity + change, np.array(solution.z)
