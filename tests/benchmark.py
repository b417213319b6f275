"""Measures iterations and times on this machine: `make bench`.

Ratios come from one run and hold on a noisy machine; seconds are those of this machine.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic import core
from pouring import (
    Recorded,
    dimers_deck,
    projections,
    read_record,
    recording,
    records,
    run_deck,
    spheres_deck,
)

FEWEST_ACTIVE = 100  # smaller problems say little about a solver


def sedimentation() -> None:
    """10,000 spheres, 500 steps of 0.005 at 0.0005 r: the yardstick of the project."""
    with tempfile.TemporaryDirectory() as folder:
        log = run_deck(
            Path(folder),
            spheres_deck(),
            {
                "particles": 10000,
                "diameter": 0.052,
                "dt": 0.005,
                "steps_agitated": 300,
                "steps_settling": 200,
                "steps_tightening": 0,
                "steps_measuring": 0,
                "dump_every": 1000,
            },
        )
    runs = projections(log)[1:3]  # the agitated and the settling steps
    iterations = sum(run.iterations for run in runs)
    seconds = sum(run.seconds for run in runs)
    print(
        "10,000 spheres, 500 steps of 0.005 at 0.0005 r: "
        f"{iterations} iterations, {seconds:.1f} s, "
        f"{1e3 * seconds / iterations:.3f} ms an iteration all told",
        flush=True,
    )


def iteration(problem: Recorded, bodies: dict[str, NDArray]) -> float:
    """Seconds for an iteration of the accelerated gradient."""
    iterations = 300
    start = time.perf_counter()
    core.project(
        *problem.spheres,
        **bodies,
        timestep=problem.timestep,
        tolerance=1e-300,  # never reached
        max_iterations=iterations,
    )
    return (time.perf_counter() - start) / iterations


def dimers() -> None:
    """1,000 dimers, 600 steps; what bodies cost, and what they cost where there are none."""
    steps = {"steps_tightening": 0, "steps_measuring": 0, "dump_every": 1000}
    steps |= {"steps_agitated": 400, "steps_settling": 200}
    with tempfile.TemporaryDirectory() as name:
        runs = projections(run_deck(Path(name), recording(dimers_deck(), 100), steps))[1:4]
        iterations = sum(run.iterations for run in runs)
        seconds = sum(run.seconds for run in runs)
        print(
            f"1,000 dimers, L/d 1.5, 600 steps of 0.01 at 0.0005 r: {iterations} iterations, "
            f"{seconds:.1f} s",
            flush=True,
        )
        problem = read_record(records(Path(name))[-1])
    with tempfile.TemporaryDirectory() as name:
        run_deck(Path(name), recording(spheres_deck(), 100), steps)
        free = read_record(records(Path(name))[-1])
    nothing = {
        "body": np.full(len(free.arrays["id"]), -1),
        "arm": np.zeros((len(free.arrays["id"]), 3)),
        "body_inverse_mass": np.zeros(0),
        "body_inverse_inertia": np.zeros((0, 3, 3)),
    }
    repeats = range(21)
    cost = [iteration(problem, problem.bodies) / iteration(problem, {}) for _ in repeats]
    empty = [iteration(free, nothing) / iteration(free, {}) for _ in repeats]
    print(
        f"an iteration on {len(problem.first)} constraints of 1,000 dimers takes "
        f"{statistics.median(cost):.2f} times as long as with 2,000 free spheres; with an empty "
        f"list of bodies {statistics.median(empty):.2f} times as long as without one",
        flush=True,
    )


def solvers(every: int) -> None:
    """Accelerated gradient as it ran (warm start) against Uzawa on the same problems."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run_deck(
            folder,
            recording(spheres_deck(), every),
            {
                "dt": 0.005,
                "steps_agitated": 400,
                "steps_settling": 200,
                "steps_tightening": 0,
                "steps_measuring": 0,
                "dump_every": 1000,
            },
        )
        ratios, time_ratios = [], []
        for path in records(folder):
            problem = read_record(path)
            if (problem.arrays["impulse"] > 0).sum() <= FEWEST_ACTIVE:
                continue
            arguments = problem.spheres
            options = {"timestep": problem.timestep, "tolerance": problem.tolerance}
            start = time.perf_counter()
            uzawa = core.project(*arguments, **options, solver="uzawa", max_iterations=10_000_000)
            middle = time.perf_counter()
            cold = core.project(*arguments, **options)
            end = time.perf_counter()
            warm = int(problem.arrays["iterations"])
            # A step that the last impulses solve takes none; it counts as one.
            ratios.append(uzawa.iterations / max(1, warm))
            time_ratios.append((middle - start) / (end - middle))
            print(
                f"  step {int(problem.arrays['step']):4d}  contacts "
                f"{(problem.arrays['impulse'] > 0).sum():5d}  apgd {warm:4d} (from zero "
                f"{cold.iterations:4d})  uzawa {uzawa.iterations:6d}  ratio {ratios[-1]:6.1f}",
                flush=True,
            )
    quartiles = statistics.quantiles(ratios, n=4)
    print(
        f"1,000 spheres, {len(ratios)} recorded problems with more than {FEWEST_ACTIVE} contacts: "
        f"Uzawa needs {quartiles[1]:.1f} times the iterations of apgd (median; quartiles "
        f"{quartiles[0]:.1f} and {quartiles[2]:.1f}) and, both from zero, "
        f"{statistics.median(time_ratios):.1f} times its time"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=8, help="record every N steps (default 8)")
    arguments = parser.parse_args()
    dimers()
    solvers(arguments.every)
    sedimentation()
    return 0


if __name__ == "__main__":
    sys.exit(main())
