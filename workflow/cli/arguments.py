"""Arguments that several subcommands have in common, and what they are turned into."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..errors import StudyError, WorkflowError, meant
from ..running.one_case import Options
from ..running.processes import cores
from ..shipped import shipped_studies
from ..study import Case, Study, read_study
from ..study.starting_points import STUDY_ENDING

# A longer timeout is a slip of the pen [seconds].
LONGEST_TIMEOUT = 1e9


def add_studies(parser: argparse.ArgumentParser) -> None:
    """Add the studies that a subcommand works on."""
    parser.add_argument(
        "studies",
        type=Path,
        nargs="+",
        metavar="STUDY",
        help="a TOML file, or the name of a shipped study",
    )


def add_out(parser: argparse.ArgumentParser, default: str = "studies", what: str = "cases") -> None:
    """Add the folder for all that studies leave."""
    parser.add_argument(
        "--out",
        type=Path,
        default=Path(default),
        metavar="DIR",
        help=f"folder for all {what} and results (default: {default})",
    )


def add_frame(parser: argparse.ArgumentParser) -> None:
    """Add which frame of a dump is taken."""
    frames = parser.add_mutually_exclusive_group()
    frames.add_argument(
        "--frame",
        type=int,
        metavar="N",
        help="frame, counted from 0, or from the end: -1 is the last (default: the last)",
    )
    frames.add_argument("--step", type=int, metavar="N", help="frame of this time step")


def add_running(parser: argparse.ArgumentParser) -> None:
    """Add how cases are run."""
    parser.add_argument(
        "--at-once",
        type=whole_number,
        default=None,
        help="cases at a time (default: the number of cores over that of --ranks, at least 1)",
    )
    parser.add_argument(
        "--ranks", type=whole_number, default=1, help="MPI ranks of each (default: 1)"
    )
    parser.add_argument(
        "--timeout", type=seconds, help="give up a case after so many seconds (default: never)"
    )


def running_options(options: argparse.Namespace, *, in_job: bool = False) -> Options:
    """Return how cases are run: as many at a time as is asked for, or as the cores allow.

    Parameters
    ----------
    options : options of a subcommand, with those that `add_running` adds
    in_job : whether an MPI job, which may have more cores than this machine, runs the cases
    """
    available = cores()
    if options.ranks > available and not in_job:
        raise WorkflowError(
            f"--ranks {options.ranks}: each rank needs one of the {available} cores"
        )
    at_once = max(1, available // options.ranks) if options.at_once is None else options.at_once
    return Options(at_once, options.ranks, options.timeout)


def read_studies(paths: Sequence[Path]) -> list[Study]:
    """Read study files, or shipped studies by their names.

    Raises StudyError with the mistakes of all files, and WorkflowError if two have the same name.
    """
    studies: list[Study] = []
    mistakes: list[str] = []
    for path in paths:
        try:
            studies.append(read_study(study_path(path)))
        except StudyError as error:
            mistakes += error.mistakes
    if mistakes:
        raise StudyError(mistakes)
    if len({study.name for study in studies}) < len(studies):
        raise WorkflowError("two studies have the same file name; it is the name of their results")
    return studies


def warn(studies: Iterable[Study]) -> None:
    """Print on stderr what is expected to go wrong in studies, once in an MPI job."""
    if os.environ.get("PMI_RANK", "0") == "0":
        for warning in (line for study in studies for line in study.warnings):
            print(f"warning: {warning}", file=sys.stderr)


def study_path(path: Path) -> Path:
    """Return a study's path: as given, or of a shipped study of that name."""
    if path.exists():
        return path
    shipped = shipped_studies()
    if str(path) not in shipped:
        file = path.suffix == STUDY_ENDING
        near = meant(path.stem if file else str(path), shipped)
        there = f" that is there (`inelastic new {path}` writes one)" if file else ""
        raise WorkflowError(
            f"no study {path}{near}: it must be a TOML file{there} or {', '.join(shipped)}"
        )
    return shipped[str(path)]


def as_cases(cases: Sequence[Case]) -> str:
    """Say how many cases there are."""
    return f"{len(cases)} case" + ("" if len(cases) == 1 else "s")


def whole_number(text: str) -> int:
    """Return the whole number from 1 to 999999999 that an argument is."""
    # Digits of other scripts are digits too, and superscripts: but no numbers.
    if not (text.isascii() and text.isdigit() and len(text) < 10) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 1 to 999999999")
    return int(text)


def seconds(text: str) -> float:
    """Return the time limit that an argument is, seconds."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value <= LONGEST_TIMEOUT:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no number of seconds above 0, and up to {LONGEST_TIMEOUT:g}"
        )
    return value
