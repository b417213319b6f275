"""The record of a finished run, and whether its files are still those that the run has left."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lammps_inelastic.analysis import (
    ParticleDump,
    RunFiles,
    RunFilesError,
    RunLog,
    at_steps,
    open_run,
    read_run_log,
)
from lammps_inelastic.analysis.dump_text import open_dump
from lammps_inelastic.analysis.run_files import AGAIN

from ..decks import find_deck
from ..errors import WorkflowError
from ..files import read_regular
from ..shipped import DECKS, SETTLING

FINISHED = "finished.json"
PARTICLES, CONTACTS = "particles.lammpsdump", "contacts.lammpsdump"
LOG = "log.lammps"
# Our own decks write this file last.
LAST_FILE = "packing.restart"
# A result's record is that of its run, and says under this key which version has measured it.
MEASURED_BY = "measured by"
# The exit status of the measuring process if a run's files are not whole, or not of that run.
NOT_WHOLE = 2
# So begins a line of the measuring process about a number that a result lacks.
NOT_MEASURED = "not measured: "
# And so one about a box that reaches out of the bed.
OUT_OF_BED = "out of the bed: "
# And so one about a bed that moves.
NOT_AT_REST = "NOT AT REST: "
REMARKS = (NOT_MEASURED, OUT_OF_BED, NOT_AT_REST)
# These files of a finished run are read.
FILES = (LOG, PARTICLES, CONTACTS)
# A JSON file holds the texts of the decks, and is not larger than this [bytes].
LARGEST_RECORD = 100_000_000
# Numbers that differ by less, relatively, are the same: dumps keep 12 digits and more.
SAME = 1e-9


def checksums(folder: Path, stages: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return a checksum of each file that is measured, by its path in a run's folder.

    Parameters
    ----------
    folder : folder of the run
    stages : stages of its record
    """
    names = [str(Path(stage["folder"]) / name) for stage in stages for name in FILES]
    return {name: checksum(folder / name) for name in names if (folder / name).is_file()}


def checksum(path: Path) -> str:
    """Return a checksum of a file's content, which gzip may have compressed since."""
    found = hashlib.sha256()
    with open_dump(path) as lines:
        for line in lines:
            found.update(line)
    return found.hexdigest()


def read_json(path: Path) -> Any:
    """Return what a JSON file holds. Raises WorkflowError with one line if it cannot be read."""
    content = read_regular(path, LARGEST_RECORD)
    try:
        return json.loads(content)
    except (ValueError, RecursionError):
        raise WorkflowError(f"{path}: no JSON, or damaged") from None


def json_of(path: Path) -> dict[str, Any] | None:
    """Return what a JSON file holds; None if it cannot be read, or holds no object."""
    try:
        content = read_json(path)
    except WorkflowError:
        return None
    return content if isinstance(content, dict) else None


def open_in_folder(
    dump: ParticleDump, contacts: Path | None, *, over: bool = True, alone: bool = False
) -> RunFiles:
    """Open a run's files as they lie in a folder, with the log and the record that are beside them.

    Parameters
    ----------
    dump : the particle dump
    contacts : path of the contact dump; None where contacts are not needed
    over : whether the run must have ended
    alone : whether the dump was named without its folder, whose record may be of another run

    Raises AnalysisError with one line where the files do not belong together, or are not whole.
    """
    folder = dump.path.parent
    log = read_run_log(folder / LOG) if (folder / LOG).exists() else None
    files = open_run(dump, contacts, log, over=over)
    files.check_last()
    if not alone:
        _check_recorded(folder)
    return files


def check_stage(
    folder: Path,
    record: Mapping[str, Any],
    stage: Mapping[str, Any],
    files: RunFiles,
    log: RunLog,
) -> None:
    """See that the files of a stage are what its record says: of these variables, and unchanged.

    Parameters
    ----------
    folder : folder of the run
    record : record of the run, all of it
    stage : one of its stages
    files, log : files and log of the stage

    Raises RunFilesError with one line.
    """
    if stage["deck"] in DECKS:
        _check_log(files, log)
        _check_variables(stage, files, log)
    files.check_last()
    check_unchanged(folder, record, stage)


def _check_recorded(folder: Path) -> None:
    """See that the files in the folder of a study's run, or of one of its stages, are unchanged.

    A folder without a record cannot be checked. Raises RunFilesError with one line.
    """
    for where in (folder, folder.absolute().parent):
        try:
            record = json_of(where / FINISHED) or {}
            stages = {(where / stage["folder"]).resolve(): stage for stage in record["stages"]}
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if folder.resolve() in stages:
            check_unchanged(where, record, stages[folder.resolve()])
            return


def other_run(folder: Path, record: Mapping[str, Any]) -> str:
    """Return how a result's run differs from the one in a case's folder; empty if they are one.

    Parameters
    ----------
    folder : folder of the case
    record : record of the result
    """
    there = json_of(folder / FINISHED)
    run = {name: value for name, value in record.items() if name != MEASURED_BY}
    if there is None or there == run:
        return ""
    return f"of the run of {record['started']}, but {folder} is that of {there.get('started')}"


def check_unchanged(folder: Path, record: Mapping[str, Any], stage: Mapping[str, Any]) -> None:
    """See that the files of a stage are those that the run has left.

    Files of which the record has no checksum are not compared. Raises RunFilesError with one line.
    """
    known = record.get("files")
    for name in FILES:
        path = str(Path(stage["folder"]) / name)
        wanted = known.get(path) if isinstance(known, Mapping) else None
        if wanted is not None and checksum(folder / path) != wanted:
            raise RunFilesError(
                f"{folder / path}: is not the file that the run of {FINISHED} has left; {AGAIN}"
            )


def _check_log(files: RunFiles, log: RunLog) -> None:
    """See that a log of one of our decks is there from its beginning to its end."""
    if not log.runs:
        raise RunFilesError(f"{log.path}: tells of no run: a part of it is missing; {AGAIN}")
    for path in (files.particles.path, files.contacts):
        if path is not None and not log.names(path):
            raise RunFilesError(
                f"{log.path}: does not tell of {path.name}: a part of it is missing; {AGAIN}"
            )
    if not log.ended:
        raise RunFilesError(
            f"{log.path}: its end is missing (no 'Total wall time' in the last line); {AGAIN}"
        )


def _check_variables(stage: Mapping[str, Any], files: RunFiles, log: RunLog) -> None:
    """Compare what the deck was asked for with what it has done."""
    variables, frame = stage["variables"], files.particles[-1]
    last = log.runs[-1].known
    said: list[tuple[Path, str, float, float]] = []
    if stage["deck"] == SETTLING:
        end = _end(log)
        if not end >= variables["time_settling"] * (1 - SAME):
            said.append((log.path, "time_settling", variables["time_settling"], end))
    else:
        steps = sum(int(v) for name, v in variables.items() if name.startswith("steps_"))
        # While a bed still moves a deck waits, at most so many steps more.
        if not steps <= last <= steps + int(variables.get("waiting", 0)):
            said.append((log.path, "steps in all", steps, last))
    diameter = 2 * float(frame.radii.max())
    if not np.isclose(diameter, variables["diameter"], rtol=SAME, atol=0):
        said.append((files.particles.path, "diameter", variables["diameter"], diameter))
    # A data file has its own number of particles.
    deck = find_deck(stage["deck"], Path())
    from_file = "start" in variables and deck.names_file("start", variables["start"])
    if "particles" in variables and not from_file:
        number = len(frame.particles)
        if number != variables["particles"]:
            said.append((files.particles.path, "particles", variables["particles"], number))
    for path, name, asked, found in said:
        raise RunFilesError(
            f"{path}: {name} {found:g}, but {asked:g} in {FINISHED}: they are of different runs; "
            f"{AGAIN}"
        )


def _end(log: RunLog) -> float:
    """Return the time at the end of the last run that has a column of it, NaN if none has."""
    run = next((run for run in reversed(log.runs) if "Time" in run.thermo), None)
    if run is None:
        return float("nan")
    return float(at_steps(np.array([run.known]), run.thermo["Step"], run.thermo["Time"])[0])
