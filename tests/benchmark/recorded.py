"""Recorded contact problems: iterations and times of the solvers, outside LAMMPS.

Starts of spheres and of dimers settle (inputs/settling.in) and their contact problems at three
moments are kept: the impact, when most of the particles fall onto those that lie; the settling; and
the rest. Each is solved to several tolerances by the accelerated gradient and by the paper's Uzawa,
both from zero impulses, and once by the accelerated gradient from the impulses of the step before,
as it does in a run.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from lammps_inelastic import core
from lammps_inelastic.workflow.tradeoff.states import (
    MOMENTS,
    RECORD_EVERY,
    TOLERANCE,
    from_zero,
    problems_of,
    timed,
)
from tests.helpers.pouring import NO_STEPS, run_deck, shipped_deck

TOLERANCES = (5e-3, 5e-4, 5e-5, 5e-6, 5e-7)  # [radii]
UZAWA_TOLERANCES = (5e-3, 5e-4)  # it takes about ten times as long for each digit
MOST_ITERATIONS = 1_000_000


@dataclass(frozen=True)
class Scene:
    """What settles.

    Attributes
    ----------
    particle : spheres or dimers
    particles : how many
    diameter : of a sphere, length
    aspect_ratio : of dimers
    """

    particle: str
    particles: int
    diameter: float
    aspect_ratio: float | None = None

    @property
    def name(self) -> str:
        """In words."""
        kind = "" if self.aspect_ratio is None else f" of L/d {self.aspect_ratio:g}"
        return f"{self.particles:,} {self.particle}{kind}"


def scenes(particles: int, diameter: float) -> list[Scene]:
    """Spheres, and dimers near to spheres and far from them."""
    return [
        Scene("spheres", particles, diameter),
        Scene("dimers", particles, diameter, 1.01),
        Scene("dimers", particles, diameter, 1.5),
    ]


def record(scene: Scene, folder: Path) -> dict[str, core.Record]:
    """Let a start settle in `folder`; return its problems at the three moments."""
    values: dict[str, object] = {"particles": scene.particles, "diameter": scene.diameter}
    if scene.aspect_ratio is not None:
        values["aspect_ratio"] = scene.aspect_ratio
    run_deck(folder / "start", shipped_deck(scene.particle), values | NO_STEPS)
    run_deck(
        folder,
        shipped_deck("settling"),
        {
            "packing": "start/packing.restart",
            "particle": scene.particle,
            "diameter": scene.diameter,
            "tolerance": TOLERANCE,
            "record_every": RECORD_EVERY,
            "time_settling": max(MOMENTS.values()),
        },
    )
    return problems_of(folder)


@dataclass(frozen=True)
class Solved:
    """Iterations and seconds to a tolerance; None where it was not reached."""

    iterations: int
    seconds: float


def _solve(
    problem: core.Problem, tolerance: float, solver: core.Solver = "sweeps"
) -> Solved | None:
    limits = core.Limits(tolerance, max_iterations=MOST_ITERATIONS)
    result, seconds = timed(problem, limits, solver)
    return Solved(result.iterations, seconds) if result.converged else None


def _power_iteration(problem: core.Problem) -> float:
    """Seconds that Uzawa's step size takes, which is not counted as part of it."""
    start = time.perf_counter()
    core.largest_eigenvalue(problem)
    return time.perf_counter() - start


def compare(scene: Scene, problems: dict[str, core.Record]) -> tuple[list[float], list[float]]:
    """Print a line for each problem and tolerance.

    Returns
    -------
    How many times as long as the accelerated gradient Uzawa takes at the tolerance of the run, one
    number a problem: with the accelerated gradient from the last step's impulses, and from zero.
    """
    warm_ratios, cold_ratios = [], []
    for moment, recorded in problems.items():
        problem, zero = recorded.problem, from_zero(recorded.problem)
        radius = float(recorded.arrays["radius"].min())
        contacts = int((recorded.arrays["impulse"] > 0).sum())
        print(
            f"  {scene.name}, {moment}: {problem.gap.size:,} constraints, {contacts:,} contacts",
            flush=True,
        )
        step_size = _power_iteration(problem)
        for tolerance in TOLERANCES:
            cold = _solve(zero, tolerance * radius)
            warm = _solve(problem, tolerance * radius)
            uzawa = None
            if tolerance in UZAWA_TOLERANCES:
                uzawa = _solve(problem, tolerance * radius, "uzawa")
            words = [
                f"{name} {solved.iterations:6d} in {1e3 * solved.seconds:8.1f} ms"
                for name, solved in (("warm", warm), ("from zero", cold))
                if solved is not None
            ]
            if uzawa is not None and cold is not None and warm is not None:
                seconds = uzawa.seconds - step_size
                words.append(
                    f"Uzawa {uzawa.iterations:6d} in {1e3 * seconds:8.1f} ms: "
                    f"{seconds / warm.seconds:.1f} and {seconds / cold.seconds:.1f} times as long"
                )
                if tolerance == TOLERANCE:
                    warm_ratios.append(seconds / warm.seconds)
                    cold_ratios.append(seconds / cold.seconds)
            print(f"    {tolerance:g} r: {', '.join(words)}", flush=True)
    return warm_ratios, cold_ratios


def measure(particles: int, diameter: float) -> None:
    """Print iterations and times on recorded problems, and the ratios to Uzawa."""
    warm, cold = [], []
    for scene in scenes(particles, diameter):
        with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
            ratios = compare(scene, record(scene, Path(name)))
        warm += ratios[0]
        cold += ratios[1]
    print(
        f"{len(warm)} problems at {TOLERANCE:g} r: Uzawa takes {statistics.median(warm):.0f} times "
        f"as long ({min(warm):.0f} to {max(warm):.0f}) as the accelerated gradient from the last "
        f"step's impulses, {statistics.median(cold):.0f} times ({min(cold):.0f} to "
        f"{max(cold):.0f}) from zero",
        flush=True,
    )
