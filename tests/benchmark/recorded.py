"""Recorded contact problems: iterations and times of the solvers, outside LAMMPS.

Starts of spheres and of dimers settle (inputs/settling.in) and their contact problems at three
moments are kept: the impact, when most of the particles fall onto those that lie; the settling; and
the rest. Each is solved to several tolerances by `sweeps`, the default of the fix, and by `apgd`,
from the impulses of the step before and from zero, and by the paper's Uzawa from zero; and once by
the first two as in a run, from the impulses of the step before and with the accuracy of the fix.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Mapping
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
ACCURACY = 1e-3  # the default of the fix
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
    """Iterations and seconds, the median of three, of a solution."""

    iterations: int
    seconds: float

    def words(self, name: str) -> str:
        """Return both, with a name before them."""
        return f"{name} {self.iterations:6d} in {1e3 * self.seconds:8.1f} ms"


# How many times as long as `sweeps` others take, one number a problem, by start and solver.
Ratios = dict[str, list[float]]


def _solve(problem: core.Problem, limits: core.Limits, solver: core.Solver) -> Solved | None:
    """Return what a solution took; None if it was not reached."""
    result, seconds = timed(problem, limits, solver)
    if solver == "uzawa":
        # Its step size is not counted as a part of it.
        start = time.process_time()
        core.largest_eigenvalue(problem)
        seconds -= time.process_time() - start
    return Solved(result.iterations, seconds) if result.converged else None


def _compare(
    words: str, sweeps: Solved | None, others: Mapping[str, Solved | None]
) -> dict[str, float]:
    """Print a line; return how many times as long as `sweeps` the others take, by their names."""
    said = ["sweeps not reached" if sweeps is None else sweeps.words("sweeps")]
    ratios = {}
    for name, other in others.items():
        if other is None:
            said.append(f"{name} not reached")
        elif sweeps is None:
            said.append(other.words(name))
        else:
            ratios[name] = other.seconds / sweeps.seconds
            said.append(f"{other.words(name)}: {ratios[name]:.2f} times as long")
    print(f"    {words}: {', '.join(said)}", flush=True)
    return ratios


def compare(scene: Scene, problems: Mapping[str, core.Record]) -> Ratios:
    """Print lines for each problem; return the ratios at the tolerance of the run."""
    found: Ratios = {}
    for moment, recorded in problems.items():
        warm, zero = recorded.problem, from_zero(recorded.problem)
        radius = float(recorded.arrays["radius"].min())
        contacts = int((recorded.arrays["impulse"] > 0).sum())
        print(
            f"  {scene.name}, {moment}: {warm.gap.size:,} constraints, {contacts:,} contacts",
            flush=True,
        )
        for tolerance in TOLERANCES:
            limits = core.Limits(tolerance * radius, max_iterations=MOST_ITERATIONS)
            uzawa: dict[str, Solved | None] = {}
            if tolerance in UZAWA_TOLERANCES:
                # It starts from zero in any case.
                uzawa["uzawa"] = _solve(zero, limits, "uzawa")
            for start, problem in (("from the last step's impulses", warm), ("from zero", zero)):
                ratios = _compare(
                    f"{tolerance:g} r, {start}",
                    _solve(problem, limits, "sweeps"),
                    {"apgd": _solve(problem, limits, "apgd"), **uzawa},
                )
                if tolerance == TOLERANCE:
                    for name, ratio in ratios.items():
                        found.setdefault(f"{start} {name}", []).append(ratio)
        limits = core.Limits(TOLERANCE * radius, ACCURACY, MOST_ITERATIONS)
        apgd = _solve(warm, limits, "apgd")
        ratios = _compare("as in a run", _solve(warm, limits, "sweeps"), {"apgd": apgd})
        for name, ratio in ratios.items():
            found.setdefault(f"as in a run {name}", []).append(ratio)
    return found


def measure(particles: int, diameter: float) -> None:
    """Print iterations and times on recorded problems, and the ratios to `sweeps`."""
    found: Ratios = {}
    for scene in scenes(particles, diameter):
        with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
            for words, ratios in compare(scene, record(scene, Path(name))).items():
                found.setdefault(words, []).extend(ratios)
    for words, ratios in found.items():
        print(
            f"{len(ratios)} problems at {TOLERANCE:g} r: {words} takes "
            f"{statistics.median(ratios):.2f} times as long ({min(ratios):.2f} to "
            f"{max(ratios):.2f}) as sweeps",
            flush=True,
        )
