"""Columns of the thermo output of all runs of a log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import RunLog

FloatArray = NDArray[np.float64]


def read_thermo(log: RunLog, *names: str) -> dict[str, FloatArray]:
    """Return columns of a log and the steps of their lines, (k,) each, in ascending order.

    Runs that lack one of the columns are left out; k is 0 where all do. A step that two runs have,
    the last of one and the first of the next, is there once, as the later one has it.

    Parameters
    ----------
    log : log of LAMMPS
    names : names of the columns, as the log's header has them
    """
    wanted = ("Step", *names)
    lines: dict[int, tuple[float, ...]] = {}
    for run in log.runs:
        if all(name in run.thermo for name in wanted):
            rows = zip(*(run.thermo[name].tolist() for name in wanted), strict=True)
            lines |= {int(row[0]): row for row in rows}
    table = np.array([lines[step] for step in sorted(lines)]).reshape(-1, len(wanted))
    return dict(zip(wanted, table.T, strict=True))


def cumulated(log: RunLog, name: str) -> dict[str, FloatArray]:
    """Return a column that each run counts from zero, such as CPU, counted through all runs.

    Steps and values are as `read_thermo` returns them: what a run had reached in its last line is
    added to the lines of the next ones.
    """
    lines: dict[int, float] = {}
    before = 0.0
    for run in log.runs:
        if name not in run.thermo or len(run.thermo["Step"]) == 0:
            continue
        values = run.thermo[name]
        lines |= {
            int(step): before + float(value)
            for step, value in zip(run.thermo["Step"], values, strict=True)
        }
        before += float(values[-1])
    table = np.array(sorted(lines.items())).reshape(-1, 2)
    return {"Step": table[:, 0], name: table[:, 1]}
