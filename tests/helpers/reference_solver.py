"""The projection by Clarabel, an interior-point method that shares nothing with ours."""

from __future__ import annotations

import clarabel
import numpy as np
from scipy import sparse

from tests.helpers.contact_problems import Problem


class NotSolvedError(Exception):
    """Clarabel has given up: where no velocities leave all gaps open, it may."""


def reference(
    given: Problem,
    compliance: np.ndarray | None = None,
    duality_gap: float = 1e-11,
    *,
    least: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Velocities and impulses from the primal problem, in V = V* + R y with M^-1 = R R^T:

    minimise 1/2 (y . y + s . s)  subject to  (gap / h + G V*) + G R y + (C / h)^1/2 s >= 0

    with s only where contacts have a compliance. Clarabel's dual variables are the impulses:
    y - R^T G^T z = 0, and s = (C / h)^1/2 z, which adds C z to the gap. Where contacts may pull by
    as much as -l, opening them costs - l . G R y more, and the impulses are z + l. The velocities
    are known to about the root of the duality gap, which is a part of what is minimised.
    """
    if given.gap.size == 0:
        return given.predicted_velocity, np.zeros(0)
    root = given.root()
    springs = np.zeros((given.gap.size, 0))
    if compliance is not None:
        springs = np.diag(np.sqrt(compliance / given.timestep))
    rows = np.hstack([given.jacobian() @ root, springs])
    pulls = np.zeros(given.gap.size) if least is None else least
    assert compliance is None or least is None
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = duality_gap
    solution = clarabel.DefaultSolver(
        sparse.identity(rows.shape[1], format="csc"),
        -rows.T @ pulls,
        sparse.csc_matrix(-rows),
        given.gap_at_end(given.predicted_velocity) / given.timestep,
        [clarabel.NonnegativeConeT(given.gap.size)],
        settings,
    ).solve()
    if solution.status != clarabel.SolverStatus.Solved:
        raise NotSolvedError(solution.status)
    change = (root @ np.array(solution.x)[: root.shape[1]]).reshape(-1, 3)
    return given.predicted_velocity + change, np.array(solution.z) + pulls
