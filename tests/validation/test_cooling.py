"""A gas without forces only cools, along the same curve in time for every time step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.lammps_run import run_lmp
from tests.helpers.scenes import FloatArray, mass, random_points, scene

pytestmark = pytest.mark.validation

RADIUS, COUNT, EDGE = 0.5, 60, 5.4
SEEDS = (1, 2, 3, 4)
SAMPLES = 20
# The distance that a sphere moves at first, in the whole run [diameters].
DISTANCE = 4.0


def cooling(folder: Path, seed: int, tolerance: float, steps: int) -> FloatArray:
    """Return the kinetic energy over its start at SAMPLES + 1 times; the time is 1 in all."""
    points = random_points(COUNT, ((0.0, EDGE - 1.001),) * 3, 2 * RADIUS * 1.0001, seed=seed)
    velocities = np.random.default_rng(seed).normal(size=points.shape)
    velocities -= velocities.mean(axis=0)
    velocities *= DISTANCE / np.sqrt((velocities**2).sum(axis=1).mean())
    deck = scene(
        points,
        RADIUS,
        folder,
        tolerance=tolerance,
        velocities=velocities,
        box=((0.0, EDGE),) * 3,
        boundary="p p p",
        timestep=1 / steps,
        gravity=False,
        options="shorten yes",
        thermo="step ke",
    )
    every = steps // SAMPLES
    # Every ten steps, for the bound; the samples of the curve are among them.
    result = run_lmp(folder, deck + f"thermo 10\nrun {steps}\n", timeout=300)
    energy = result.thermo["KinEng"]
    start = 0.5 * float(mass(RADIUS)) * float((velocities**2).sum())
    assert energy[0] == pytest.approx(start, rel=1e-12)  # a sum of squares
    assert energy.max() <= energy[0] * (1 + 1e-12)
    assert np.diff(energy).max() <= 1e-4 * energy[0]
    assert not any("inelastic" in line for line in result.warnings)
    return np.asarray(energy[:: every // 10] / energy[0])


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_the_same_curve_for_every_time_step(tolerance: float, tmp_path: Path) -> None:
    """With h, h / 4 and h / 16; between the first and the last EPS / h changes by 16."""
    curves = {
        steps: np.array([cooling(tmp_path, seed, tolerance, steps) for seed in SEEDS])
        for steps in (400, 1600, 6400)
    }
    for steps, found in curves.items():
        means = " ".join(f"{value:.4f}" for value in found.mean(axis=0)[::5])
        print(f"eps {tolerance:g} d, {steps} steps: kinetic energy at 0, 1/4 ... 1: {means}")
    first, *others = curves.values()
    error = first.std(axis=0, ddof=1) / np.sqrt(len(SEEDS))
    for other in others:
        # The seeds are the same, so that their scatter is more than the curves may differ by.
        assert (np.abs(other.mean(axis=0) - first.mean(axis=0)) <= 3 * error + 1e-3).all()
    # Collisions go on to the end, where clusters have formed: nothing stalls or heats.
    mean = first.mean(axis=0)
    assert mean[-1] < 0.5 * mean[SAMPLES // 4]
