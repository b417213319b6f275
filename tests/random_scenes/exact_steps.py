"""Recorded steps of a scene whose walls stand, against exact projections that give nothing back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic import core
from lammps_inelastic.workflow.tradeoff.states import records_in
from tests.helpers.grainwise import MOST, compare
from tests.random_scenes.scene_checker import REGULAR, Table, read_tables
from tests.random_scenes.scene_walls import Shape, views

Array = NDArray[Any]
# Times the fastest speed b at which an overlap is given back: what a grain may be off by.
TIMES_AS_FAST = 10.0


def ends(record: core.Record, after: Table, shapes: list[Shape]) -> Array:
    """The gap of each constraint at the end of its step, from the dump: inf where no wall is seen.

    `after` is the frame of the next step.
    """
    a, problem = record.arrays, record.problem
    order = np.argsort(after["id"])
    place = order[np.searchsorted(after["id"][order], a["id"])]
    x, radius = after["x y z"][place], a["radius"]
    first, second = problem.first, problem.second
    pairs = second >= 0
    end = np.full(len(first), np.inf)
    away = x[first[pairs]] - x[second[pairs]]
    sizes = radius[first[pairs]] + radius[second[pairs]]
    end[pairs] = np.linalg.norm(away, axis=1) - sizes
    rows = np.flatnonzero(~pairs)
    wall = -a["id2"][rows].astype(int)
    for shape in shapes:
        for view in views(shape, x[first[rows]], 0.0):
            gap = np.where(wall == view.number, view.distance - radius[first[rows]], np.inf)
            end[rows] = np.minimum(end[rows], gap)
    return end


def gives_nothing_back(record: core.Record, after: Table, shapes: list[Shape]) -> core.Record:
    """The record with gaps that let overlaps stay as deep as they are.

    Where bodies turn, or walls curve, a constraint is to keep what closes its gap in the step.
    """
    a, problem = record.arrays, record.problem
    second = np.where(problem.second[:, None] >= 0, a["velocity"][problem.second], 0.0)
    opens = np.einsum("ij,ij->i", problem.normal, a["velocity"][problem.first] - second)
    linear = a["gap_now"] - a["wall_motion"] + problem.timestep * opens
    closes = np.maximum(0.0, linear - ends(record, after, shapes))
    kept = np.maximum(problem.gap, -closes - a["wall_motion"])
    # No more than the overlap is given back, however far a body turns.
    kept = np.minimum(kept, problem.gap + np.maximum(0.0, -a["gap_now"]))
    gap = np.where(a["gap_now"] < 0, kept, problem.gap)
    return core.Record({**a, "gap": gap})


def fastest_given_back(record: core.Record, regular_timestep: float) -> float:
    """The speed b: at most that of a regular overlap in a step of ordinary length."""
    a, problem = record.arrays, record.problem
    second = np.where(problem.second[:, None] >= 0, a["velocity"][problem.second], 0.0)
    opens = np.einsum("ij,ij->i", problem.normal, a["velocity"][problem.first] - second)
    opens -= a["wall_motion"] / problem.timestep
    deep = (a["gap_now"] < 0) & (a["impulse"] > 0)
    most = REGULAR * record.tolerance / regular_timestep
    return float(min(opens[deep].max(initial=0.0), most))


@dataclass(frozen=True)
class AgainstExact:
    """How many steps were compared, the largest error of a grain over its bound, and findings."""

    compared: int
    worst: float
    problems: list[str]


def against_exact(
    folder: Path, shapes: list[Shape], gravity: float, timestep: float, *, not_accurate: bool
) -> AgainstExact:
    """Compare the recorded steps of a run in a folder.

    A grain may be off by 10 b, and by what the accuracy promises of any step (grainwise.py).

    Parameters
    ----------
    timestep : of a step of ordinary length
    not_accurate : whether the summary tells of steps in which only the tolerance was reached
    """
    records = [core.read_record(path) for path in records_in(folder)]
    after = {record.step + 1 for record in records}
    tables = read_tables(folder / "particles.01.dump", steps=after)
    frames = {table.step: table for table in tables}
    compared, worst, problems = 0, 0.0, list[str]()
    for record in records:
        deepest = -record.arrays["gap_now"].min(initial=0.0)
        if record.step + 1 not in frames or deepest > REGULAR * record.tolerance:
            continue
        without = gives_nothing_back(record, frames[record.step + 1], shapes)
        found = compare(without, gravity=gravity, nominal_timestep=timestep)
        off = np.maximum(found.error, found.member_error)
        b = fastest_given_back(record, timestep)
        if np.any(off > TIMES_AS_FAST * b / found.unit + MOST * found.allowed):
            own = compare(record, gravity=gravity, nominal_timestep=timestep)
            # What has reached the tolerance alone, which the summary says, is known to no more.
            if not own.kept and not_accurate:
                b = REGULAR * record.tolerance / timestep
        b /= found.unit
        ratio = off / (TIMES_AS_FAST * b + MOST * found.allowed)
        k = int(np.argmax(ratio))
        compared += 1
        worst = max(worst, float(ratio[k]))
        if ratio[k] > 1:
            problems.append(
                f"exact projection: step {record.step}: a grain is off by {off[k]:.4g} g h, where "
                f"10 b is {TIMES_AS_FAST * b:.4g} and {MOST * found.allowed[k]:.4g} is the accuracy"
            )
    return AgainstExact(compared, worst, problems)
