"""The measuring process as seen from outside: its command, and what it says of a finished run.

What it does stands in `results/measure.py`. It is a process of its own, since it takes memory and
time, may have to be killed, and runs beside the LAMMPS of other cases.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from ..provenance.finished import NOT_WHOLE, REMARKS
from .processes import Command, exit_reason, last_lines

MODULE = "lammps_inelastic.workflow.results.measure"
# The process prints into this file: what went wrong, or what the result lacks.
OUTPUT = "measure.out"


def command_for(run: Path, target: Path, outputs: str) -> Command:
    """Return the command that measures a finished run.

    Parameters
    ----------
    run : folder of the run
    target : the result's file
    outputs : what is asked for, as JSON
    """
    words = [sys.executable, "-m", MODULE, ".", str(target.resolve()), outputs]
    return Command(words, run, run / OUTPUT)


def remarks_in(lines: Sequence[str]) -> list[str]:
    """Return the lines in which the process says what to know of a result."""
    return [line for line in lines if line.startswith(REMARKS)]


def last_failure(run: Path) -> str:
    """Return the line in which the last process said what went wrong; empty if none did."""
    return _failure_in(last_lines(run / OUTPUT))


def unmeasurable(code: int, lines: Sequence[str], run: Path) -> str:
    """Say why a finished run gives no result, and what to do about it.

    Parameters
    ----------
    code : exit status of the process
    lines : what it has printed
    run : folder of the run
    """
    reason = _failure_in(lines)
    if code == NOT_WHOLE:
        return f"cannot be measured: {reason}; delete {run} to run it again"
    if not reason:
        # Without room the process could not even say so.
        full = f"{run}: nothing can be written there: the disk is full, or read-only"
        reason = exit_reason(code) if _is_room_in(run) else full
    return f"cannot be measured: {reason}; the run is kept, and is measured the next time"


def timed_out(run: Path, limit: float) -> str:
    """Note in the run's folder, for `status`, that the process took longer than the limit [s].

    Returns that as a reason, with what to do about it.
    """
    line = f"timed out after {limit:g} s"
    # There may be no room for a note.
    with suppress(OSError):
        (run / OUTPUT).write_text(f"{line}\n")
    return (
        f"cannot be measured: {line}; the run is kept, and is measured the next time if --timeout "
        "allows"
    )


def _failure_in(lines: Sequence[str]) -> str:
    return next((line for line in reversed(lines) if not line.startswith(REMARKS)), "")


def _is_room_in(folder: Path) -> bool:
    """Say whether a file can be written in a folder."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"0")
            file.flush()
    except OSError:
        return False
    return True
