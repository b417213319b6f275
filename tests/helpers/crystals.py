"""A crystal of spheres that touch, exactly as wide as its periodic cell: it is jammed."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import numpy as np

from tests.helpers.exact_scenes import RADIUS, spheres_of
from tests.helpers.lammps_run import Run, run_lmp
from tests.helpers.scenes import GRAVITY, FloatArray

TOLERANCE = 1e-6
TIMESTEP = 0.005
STEPS = 50
# The default of the keyword maxiter, and of what a step may take in the mean: a bed that falls
# takes some hundred.
MOST = 100_000
MEAN = 1000.0


def crystal(cells: int) -> FloatArray:
    """Return the centres of so many cubic cells a side, on a floor at y = 0: 4 cells^3 spheres."""
    basis = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    corners = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    places = sqrt(2) * (corners[:, None] + basis).reshape(-1, 3)
    return np.asarray(places + np.array([0, RADIUS, 0]))


def run_crystal(
    folder: Path, cells: int, temperature: float, ranks: int = 1, options: str = ""
) -> Run:
    """Run it with random velocities of this temperature; v_floor is of the weights."""
    side = cells * sqrt(2)
    points = crystal(cells)
    weights = len(points) * pi / 6 * GRAVITY
    deck = spheres_of(
        points,
        folder,
        tolerance=TOLERANCE,
        timestep=TIMESTEP,
        skin=0.3,
        box=((0.0, side), (-1.0, side + 2.0), (0.0, side)),
        boundary="p f p",
        fixes=f"variable floor equal -f_contact[1][2]/{weights:.17g}\n",
        options=f"region floor shorten yes {options}",
        thermo="step dt f_contact[1] f_contact[4] v_floor",
    )
    heated = f"velocity all create {temperature:g} 4711 dist gaussian\n" if temperature else ""
    return run_lmp(folder, f"{deck}{heated}run {STEPS}\n", ranks, must_pass=False, timeout=600.0)


def assert_solved(run: Run) -> None:
    """Its steps take some hundred iterations, none takes all, and no sphere overlaps."""
    assert run.status == 0, run.errors
    iterations, overlap = run.thermo["f_contact[1]"], run.thermo["f_contact[4]"]
    print(
        f"{iterations.mean():.0f} iterations a step, at most {iterations.max():.0f}; "
        f"the last overlap is {overlap[-1]:.3g}"
    )
    assert len(iterations) == STEPS + 1
    assert iterations.max() < MOST
    assert iterations.mean() < MEAN
    # Round-off of positions.
    assert overlap[-1] <= TOLERANCE * (1 + 1e-6)
