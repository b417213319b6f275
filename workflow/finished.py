"""What the record of a finished run says of its files, and whether they are still the same."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lammps_inelastic.analysis import RunFiles, RunFilesError, RunLog, at_steps
from lammps_inelastic.analysis.dump_text import open_dump
from lammps_inelastic.analysis.run_files import AGAIN

from .decks import SETTLING, SHIPPED

FINISHED = "finished.json"
PARTICLES, CONTACTS = "particles.lammpsdump", "contacts.lammpsdump"
LOG = "log.lammps"
# What is read from a finished run.
FILES = (LOG, PARTICLES, CONTACTS)
# Dumps keep 12 digits and more.
SAME = 1e-9


def checksums(folder: Path, stages: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return a checksum of each file that is measured, by its path in a run's folder.

    Parameters
    ----------
    folder : of the run
    stages : of its record
    """
    names = [str(Path(stage["folder"]) / name) for stage in stages for name in FILES]
    return {name: checksum(folder / name) for name in names if (folder / name).is_file()}


def checksum(path: Path) -> str:
    """Return a checksum of what a file says, also of one that gzip has compressed since."""
    found = hashlib.sha256()
    with open_dump(path) as lines:
        for line in lines:
            found.update(line)
    return found.hexdigest()


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
    folder : of the run
    record : of the run, all of it
    stage : one of its stages
    files, log : of the stage

    Raises RunFilesError with one line.
    """
    if stage["deck"] in SHIPPED:
        _check_log(files, log)
        _check_variables(stage, files, log)
    frame = files.particles[-1]
    files.check_last(frame)
    check_unchanged(folder, record, stage)


def unchanged(folder: Path) -> None:
    """See that the files in the folder of a study's run, or of one of its stages, are unchanged.

    Raises RunFilesError with one line. Says nothing of a folder that has no record.
    """
    for where in (folder, folder.absolute().parent):
        try:
            record = json.loads((where / FINISHED).read_text())
            stages = {(where / stage["folder"]).resolve(): stage for stage in record["stages"]}
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if folder.resolve() in stages:
            check_unchanged(where, record, stages[folder.resolve()])
            return


def other_run(folder: Path, record: Mapping[str, Any]) -> str:
    """Say that a result is of another run than the one in a case's folder; nothing if it is not.

    Parameters
    ----------
    folder : of the case
    record : of the result
    """
    try:
        there = json.loads((folder / FINISHED).read_text())
    except (OSError, ValueError):
        return ""
    if not isinstance(there, dict) or there == record:
        return ""
    return f"of the run of {record['started']}, but {folder} is that of {there.get('started')}"


def check_unchanged(folder: Path, record: Mapping[str, Any], stage: Mapping[str, Any]) -> None:
    """See that the files of a stage are those that the run has left.

    Raises RunFilesError with one line. A record without checksums says nothing of the files.
    """
    for name in FILES:
        path = str(Path(stage["folder"]) / name)
        wanted = record.get("files", {}).get(path)
        if wanted is not None and checksum(folder / path) != wanted:
            raise RunFilesError(
                f"{folder / path}: is not the file that the run of {FINISHED} has left; {AGAIN}"
            )


def _check_log(files: RunFiles, log: RunLog) -> None:
    """See that a log of one of our decks is there from its beginning to its end."""
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
        if last != steps:
            said.append((log.path, "steps in all", steps, last))
    diameter = 2 * float(frame.radii.max())
    if not np.isclose(diameter, variables["diameter"], rtol=SAME, atol=0):
        said.append((files.particles.path, "diameter", variables["diameter"], diameter))
    # A data file brings its own number.
    if variables.get("start", "random") in ("random", "regular") and "particles" in variables:
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
