"""Recorded states: the contact problems of a few moments, each solved to several tolerances.

What comes out of a run is chaotic: two runs that differ in their tolerance end in two packings.
What comes out of one step is not. Here the problems of a few steps, recorded while a
start settles, are solved outside of LAMMPS, and compared with their exact solution: velocities,
forces and contacts, against the time that a solution takes.
"""

from __future__ import annotations

import json
import math
import statistics
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from lammps_inelastic import core
from lammps_inelastic.analysis import read_run_log

from ..decks import Value, find_deck
from ..files import write_text
from ..provenance.finished import LOG, read_json
from ..shipped import SETTLING
from ..study import Case, Input, stage_of
from .plan import Plan, input_of, start_values

FloatArray = NDArray[np.float64]

# When problems are taken, unless the run ends before [time].
MOMENTS: Mapping[str, float] = {"impact": 0.5, "settling": 1.0, "rest": 2.0}
RECORD_EVERY = 5  # steps
TOLERANCE = 0.0005  # of the runs that are recorded [radii]
# Of the exact solution [radii]: far below all that is compared with it.
EXACT = 1e-12
# A force no more than this part of the largest one is what round-off leaves of none.
ROUND_OFF = 1e-12
TOLERANCES = (0.05, 0.005, 5e-4, 5e-5, 5e-6, 5e-7)  # [radii]
ACCURACIES = (0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
# Uzawa takes some hundred times as many; what it does not reach is left out.
MOST_ITERATIONS = {"sweeps": 1_000_000, "apgd": 1_000_000, "uzawa": 100_000}
MOST_OF_EXACT = 1_000_000
REPEATS = 3


@dataclass(frozen=True)
class Way:
    """A way to solve a problem.

    Attributes
    ----------
    solver : sweeps, apgd or uzawa
    guess : whether it starts from the forces of the step before; otherwise from zero
    by : tolerance or accuracy: what ends the iterations
    """

    solver: core.Solver
    guess: bool
    by: str

    @property
    def name(self) -> str:
        """In words."""
        start = "from the last forces" if self.guess else "from zero"
        by = ", by accuracy" if self.by == "accuracy" else ""
        return f"{self.solver} {start}{by}"


# The default of the fix in all ways, beside the paper's solver and the default before.
WAYS = (
    Way("sweeps", True, "tolerance"),
    Way("sweeps", False, "tolerance"),
    Way("uzawa", False, "tolerance"),
    Way("sweeps", True, "accuracy"),
    Way("apgd", True, "tolerance"),
)


@dataclass(frozen=True)
class Solved:
    """One solution, compared with the exact one.

    Attributes
    ----------
    start : of the run, as in the plan
    moment : of MOMENTS
    contacts : number in the exact solution
    way : name of the way
    value : tolerance, radii, or accuracy
    iterations : that it took
    seconds : that it took, median of REPEATS
    velocity_error : root mean square, over the spheres, of the difference of velocities, over that
        of what contacts change
    force_error : sum of the differences of the forces over the sum of the forces
    missed : part of the contacts of the exact solution that have no force
    false : part of the contacts that have no force in the exact solution
    """

    start: str
    moment: str
    contacts: int
    way: str
    value: float
    iterations: int
    seconds: float
    velocity_error: float
    force_error: float
    missed: float
    false: float


def recording_case(plan: Plan, start: int | Path) -> Case:
    """Return the case that lets a start settle and records its problems."""
    folder = Path()
    inputs: dict[str, Input] = input_of(start)
    settling: dict[str, Value] = {
        **plan.values,
        "particle": plan.particle,
        "tolerance": TOLERANCE,
        "dt": plan.dts[0],
        "accuracy": plan.accuracies[0],
        "record_every": RECORD_EVERY,
    }
    first = stage_of(find_deck(plan.particle, folder), start_values(plan, start))
    return Case((first, stage_of(find_deck(SETTLING, folder), settling)), inputs)


def records_in(folder: Path) -> list[Path]:
    """Return the files of the recorded problems of a deck's run in the order of their steps."""
    return sorted(folder.glob("problem.*.npz"), key=lambda path: int(path.name.split(".")[1]))


def problems_of(folder: Path, moments: Iterable[str] = MOMENTS) -> dict[str, core.Record]:
    """Return the recorded problems of a run that are nearest to some moments, by their names.

    Moments after the end of the run are left out. Raises ValueError if a record is damaged or
    there is none, or if the log cannot be read or lacks a part.
    """
    log = read_run_log(folder / LOG)
    # The deck's last run, of no steps, only completes the dump.
    thermo = log.runs[-2].thermo if len(log.runs) > 1 else {}
    if "Time" not in thermo:
        raise ValueError(
            f"{log.path}: tells of no run that settles and then ends: a part of it is missing"
        )
    times = dict(zip(thermo["Step"], thermo["Time"], strict=True))
    paths = {int(path.name.split(".")[1]): path for path in records_in(folder)}
    paths = {step: path for step, path in paths.items() if step in times}
    if not paths:
        raise ValueError(f"{folder}: no recorded contact problem is there")
    last = max(times.values())
    return {
        moment: core.read_record(
            paths[min(paths, key=lambda step: abs(times[step] - MOMENTS[moment]))]
        )
        for moment in moments
        if MOMENTS[moment] <= last
    }


def from_zero(problem: core.Problem) -> core.Problem:
    """Return a problem without its first guess."""
    return replace(problem, impulse_guess=np.zeros_like(problem.gap))


def solve_state(start: str, moment: str, record: core.Record) -> Iterator[Solved]:
    """Solve a problem in all ways, each from the loosest value until one is not reached.

    Raises ValueError if the exact solution is not to be had.
    """
    radius = float(record.arrays["radius"].min())
    warm, cold = record.problem, from_zero(record.problem)
    exact = core.project(cold, core.Limits(EXACT * radius, max_iterations=MOST_OF_EXACT))
    if not exact.converged:
        raise ValueError(
            f"{moment}: {EXACT:g} r is not reached in {MOST_OF_EXACT:,} iterations: {exact.status}"
        )
    for way in WAYS:
        problem = warm if way.guess else cold
        most = MOST_ITERATIONS[way.solver]
        for value in TOLERANCES if way.by == "tolerance" else ACCURACIES:
            if way.by == "tolerance":
                limits = core.Limits(value * radius, max_iterations=most)
            else:
                # With the loosest tolerance it is the accuracy that decides.
                limits = core.Limits(TOLERANCES[0] * radius, value, most)
            result, seconds = timed(problem, limits, way.solver)
            if not result.converged:
                break
            yield Solved(
                start,
                moment,
                int(carries(exact.impulse).sum()),
                way.name,
                value,
                result.iterations,
                seconds,
                **errors(
                    result.velocity,
                    result.impulse,
                    exact.velocity,
                    exact.impulse,
                    problem.predicted_velocity,
                ),
            )


def carries(impulse: FloatArray) -> NDArray[np.bool_]:
    """Return which contacts have a force, (m,), from their impulses, mass length/time, (m,)."""
    carrying: NDArray[np.bool_] = impulse > ROUND_OFF * impulse.max(initial=0.0)
    return carrying


def errors(
    velocity: FloatArray,
    impulse: FloatArray,
    exact_velocity: FloatArray,
    exact_impulse: FloatArray,
    predicted: FloatArray,
) -> dict[str, float]:
    """Compare a solution with the exact one.

    Parameters
    ----------
    velocity, exact_velocity, predicted : velocities, length/time, (n, 3)
    impulse, exact_impulse : impulses, mass length/time, (m,)

    Returns
    -------
    The errors of Solved by their names; NaN where there is nothing to be compared with.
    """

    def over(part: float, whole: float) -> float:
        return part / whole if whole > 0 else math.nan

    there, exactly = carries(impulse), carries(exact_impulse)
    return {
        "velocity_error": over(
            float(np.linalg.norm(velocity - exact_velocity)),
            float(np.linalg.norm(predicted - exact_velocity)),
        ),
        "force_error": over(
            float(np.abs(impulse - exact_impulse).sum()), float(np.abs(exact_impulse).sum())
        ),
        "missed": over(float((exactly & ~there).sum()), float(exactly.sum())),
        "false": over(float((there & ~exactly).sum()), float(there.sum())),
    }


def timed(
    problem: core.Problem, limits: core.Limits, solver: core.Solver = "sweeps"
) -> tuple[core.Projection, float]:
    """Return a solution, and the median time [s] of three solves; of fewer where they take long.

    It is the processor's time: a solve takes one thread, and other processes may hold it up.
    """
    long = 1.0  # second
    seconds: list[float] = []
    while len(seconds) < REPEATS and sum(seconds) < long:
        start = time.process_time()
        result = core.project(problem, limits, solver=solver)
        seconds.append(time.process_time() - start)
    return result, statistics.median(seconds)


def write_states(path: Path, states: Sequence[Solved]) -> None:
    """Write solutions as JSON."""
    write_text(path, json.dumps([asdict(one) for one in states], indent=1) + "\n")


def read_states(path: Path) -> list[Solved]:
    """Read what write_states has written. Raises ValueError for anything else."""
    return TypeAdapter(list[Solved]).validate_python(read_json(path))


@dataclass(frozen=True)
class WayMedians:
    """The medians over the states of a way, from the loosest value to the tightest, (k,) each.

    Attributes
    ----------
    way : its name
    values : tolerances, radii, or accuracies, which every state has reached
    medians : iterations, seconds and errors by their names
    """

    way: str
    values: FloatArray
    medians: Mapping[str, FloatArray]


MEDIANS = ("iterations", "seconds", "velocity_error", "force_error", "missed", "false")


def _median(values: Sequence[float]) -> float:
    """Return the median of those that are numbers; NaN if none is."""
    numbers = [value for value in values if not math.isnan(value)]
    return statistics.median(numbers) if numbers else math.nan


def curves_of(states: Sequence[Solved]) -> list[WayMedians]:
    """Return a curve for each way. A value that some state has not reached is left out."""
    number = len({(one.start, one.moment) for one in states})
    curves = []
    for way in WAYS:
        mine: dict[float, list[Solved]] = {}
        for one in states:
            if one.way == way.name:
                mine.setdefault(one.value, []).append(one)
        values = [value for value in sorted(mine, reverse=True) if len(mine[value]) == number]
        medians = {
            name: np.array([_median([getattr(s, name) for s in mine[v]]) for v in values])
            for name in MEDIANS
        }
        if values:
            curves.append(WayMedians(way.name, np.array(values), medians))
    return curves
