"""What is at rest costs nothing beside what moves, however loose the accuracy is."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import random_points, scene

RADIUS = 0.05
STEPS = 120
# Steps after which the bed lies and the lone sphere has been at rest for long.
AFTER_THE_FALL = 60


def fenced(folder: Path, lone: bool) -> str:
    """Return a deck: a bed is poured behind a fence of frozen spheres, a lone one lies beyond."""
    bed = random_points(250, [[0.06, 0.94], [0.06, 1.6], [0.06, 0.94]], 0.1, seed=5)
    heights, depths = np.meshgrid(np.arange(12), np.arange(10))
    fence = np.column_stack(
        [
            np.full(heights.size, 1.0 + RADIUS),
            RADIUS + 2 * RADIUS * heights.ravel(),
            RADIUS + 2 * RADIUS * depths.ravel(),
        ]
    )
    points = np.vstack([bed, fence, [[1.4, RADIUS, 0.5]]])
    first, last = len(bed) + 1, len(bed) + len(fence)
    frozen = f"group fence id {first}:{last}" + ("" if lone else f" {len(points)}")
    return scene(
        points,
        RADIUS,
        folder,
        tolerance=5e-4 * RADIUS,
        box=((0.0, 1.5), (0.0, 2.0), (0.0, 1.0)),
        timestep=0.02,
        skin=2 * RADIUS,
        motion=f"{frozen}\ngroup moving subtract all fence\nfix motion moving nve",
        options="region container frozen fence accuracy 0.03 shorten yes",
    )


def test_a_lone_sphere_at_rest_costs_no_iterations(tmp_path: Path, lmp: Runner) -> None:
    """A bed that settles takes as many iterations as beside a sphere that is frozen there."""
    made = []
    for lone in (True, False):
        thermo = lmp(fenced(tmp_path, lone) + f"run {STEPS}\n").thermo
        made.append(float(np.median(thermo["f_contact[1]"][AFTER_THE_FALL:])))
    beside, alone = made
    assert alone > 30
    # Steps that look whether more comes to rest take more, and are fewer than half.
    assert beside <= 1.2 * alone
