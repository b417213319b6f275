"""The subcommands that work on studies: validate, run, status, collect, slurm."""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from .errors import StudyError, WorkflowError
from .files import is_file, whole, writing
from .finished import other_run
from .folder import Folder, last_lines
from .launch import MEASURED, Options, Outcome, run_study
from .progress import Display
from .slurm import job_script
from .store import StoredStudy, origin_of, read_result, write_studies
from .study import Case, Study, read_study

WIDEST = 10_000
# How an HDF5 file begins.
HDF5 = b"\x89HDF\r\n\x1a\n"
LONGEST_TIMEOUT = 1e9
SHIPPED = Path(str(files("lammps_inelastic.inputs") / "studies"))


def add_parsers(commands: argparse._SubParsersAction[Any]) -> None:
    """Add these subcommands to those of `inelastic`."""
    validate = commands.add_parser(
        "validate",
        help="check study files",
        description="Check study files; one line for each mistake.",
    )
    _add_studies(validate)

    run = commands.add_parser(
        "run",
        help="run and measure the cases of a study that have no result yet",
        description="Run the cases of a study that are missing, and measure them. It can be "
        "interrupted at any moment: the next run does what is left.",
    )
    _add_studies(run)
    _add_out(run)
    add_options_of_run(run)
    run.add_argument(
        "--mpi",
        action="store_true",
        help="inside mpiexec: split the job's ranks into groups of --ranks, one case each",
    )
    run.add_argument(
        "--case",
        action="append",
        metavar="NAME",
        help="only this case: a name, or a number from 1 as `status` counts; may be repeated",
    )
    run.add_argument(
        "--dry-run", action="store_true", help="print the commands and folders, run nothing"
    )

    status = commands.add_parser(
        "status", help="say how far a study has come", description="Say how far a study has come."
    )
    _add_studies(status)
    _add_out(status)

    collect = commands.add_parser(
        "collect",
        help="gather a study's results in one HDF5 file",
        description="Gather the results of studies in one HDF5 file.",
    )
    _add_studies(collect)
    _add_out(collect)
    collect.add_argument(
        "--file", type=Path, help="the file (default: the study's name in the --out folder)"
    )

    slurm = commands.add_parser(
        "slurm",
        help="write a job-array script for a Slurm cluster",
        description="Print a job-array script that runs the cases of a study that have no result.",
    )
    _add_studies(slurm)
    _add_out(slurm)
    slurm.add_argument("--ranks", type=_count, default=1, help="MPI ranks of each case")
    slurm.add_argument("--time", default="24:00:00", help="limit of one case (default: 24:00:00)")


def run_command(options: argparse.Namespace) -> int:
    """Run one of these subcommands; return its exit status."""
    if options.command == "slurm" and len(options.studies) > 1:
        raise WorkflowError("slurm: one study at a time")
    studies: list[Study] = []
    mistakes: list[str] = []
    for path in options.studies:
        try:
            studies.append(read_study(_found(path)))
        except StudyError as error:
            mistakes += error.mistakes
    if mistakes:
        raise StudyError(mistakes)
    if len({study.name for study in studies}) < len(studies):
        raise WorkflowError("two studies have the same file name; it is the name of their results")
    if options.command == "validate":
        for study, path in zip(studies, options.studies, strict=True):
            print(f"{path}: fine, {_cases(study.cases)}")
        return 0
    folder = Folder(options.out)
    if options.command == "status":
        for study in studies:
            _print_status(study, folder)
        return 0
    if options.command == "collect":
        file = options.file or folder.root / f"{'+'.join(study.name for study in studies)}.h5"
        _check_target(file)
        stored = [gathered(study, folder) for study in studies]
        write_studies(file, stored)
        for study, found in zip(studies, stored, strict=True):
            print(f"{study.name}: {len(found.results)} of {_cases(study.cases)}")
        print(f"written: {file}")
        return 0
    if options.command == "slurm":
        path = _found(options.studies[0])
        script = job_script(studies[0], path, folder, options.ranks, options.time)
        with writing(folder.root):
            # Slurm does not make the folder for its output, and a job without one fails unseen.
            folder.root.mkdir(parents=True, exist_ok=True)
        print(script)
        return 0
    return _run(options, studies, folder)


def _check_target(file: Path) -> None:
    """Raise WorkflowError if a file that would be replaced is no HDF5 file."""
    if not is_file(file):
        return
    with file.open("rb") as opened:
        start = opened.read(len(HDF5))
    if start and start != HDF5:
        raise WorkflowError(f"{file}: this file is no HDF5 file, and is not replaced")


def _run(options: argparse.Namespace, studies: Sequence[Study], folder: Folder) -> int:
    choices = [(study, _chosen(study, options.case)) for study in studies]
    if options.dry_run:
        for study, cases in choices:
            for case in cases:
                print(f"# {folder.state(study, case)}")
                print(f"cd {shlex.quote(str(folder.part(case)))}")
                for command in case.commands(options.ranks):
                    print(shlex.join(command))
        return 0
    run = Options(at_once(options), options.ranks, options.timeout)
    failed = 0
    for study, cases in choices:
        outcome = run_one(study, cases, folder, run, in_job=options.mpi)
        failed += len(outcome.failed)
    return 1 if failed else 0


def run_one(
    study: Study,
    cases: Sequence[Case],
    folder: Folder,
    options: Options,
    *,
    in_job: bool = False,
) -> Outcome:
    """Run the cases of a study, gather its results, and say what became of them."""
    first = True
    with Display(None if in_job else len(cases)) as display:
        if in_job:
            from mpi4py import MPI

            from .mpi_route import run_in_job

            first = MPI.COMM_WORLD.rank == 0
            outcome = run_in_job(study, cases, folder, options, display)
        else:
            outcome = run_study(study, cases, folder, options, display)
    if first:
        tell(study, outcome)
        file = folder.root / f"{study.name}.h5"
        write_studies(file, [gathered(study, folder)])
        print(f"results: {file}")
    return outcome


def tell(study: Study, outcome: Outcome) -> None:
    """Print what became of a study's cases, and why some failed."""
    parts = [
        (len(outcome.measured), "done"),
        (len(outcome.kept), "there before"),
        (len(outcome.elsewhere), "run by somebody else"),
        (len(outcome.failed), "failed"),
    ]
    print(f"{study.name}: " + (", ".join(f"{n} {what}" for n, what in parts if n) or "nothing"))
    for name, reason in outcome.failed.items():
        print(f"  failed: {name}: {reason}")


def gathered(study: Study, folder: Folder) -> StoredStudy:
    """Return the results that there are of a study, in the order of its cases.

    What is damaged is left out, and named on stderr.
    """
    results = []
    for case in study.cases:
        if folder.is_measured(study, case):
            path = folder.result(study, case)
            results.append(read_result(path))
            if said := other_run(folder.case(case), results[-1].record):
                print(f"WARNING: {path} is {said}; delete it to measure that", file=sys.stderr)
        elif damage := folder.damage(study, case):
            print(f"inelastic: left out: {damage}", file=sys.stderr)
    return StoredStudy(study.name, study.title, study.text, results)


def adopt_results(study: Study, folder: Folder, source: Path) -> int:
    """Copy results that were kept elsewhere, for cases that have none; return how many."""
    count = 0
    for case in study.cases:
        kept, target = source / study.name / f"{case.name}.h5", folder.result(study, case)
        if folder.is_measured(study, case) or not kept.is_file():
            continue
        try:
            origin_of(kept)
        except WorkflowError as error:
            print(f"not taken: {error}")
            continue
        for line in folder.set_aside(study, case):
            print(line)
        with whole(target) as temporary:
            shutil.copyfile(kept, temporary)
        count += 1
    return count


def _print_status(study: Study, folder: Folder) -> None:
    table = Table("", "case", "state", "", title=Text(study.title), title_justify="left", box=None)
    states: Counter[str] = Counter()
    other = 0
    for number, case in enumerate(study.cases, 1):
        state = folder.state(study, case)
        states[state] += 1
        note = ""
        if state == "failed":
            note = folder.reason(case)
        elif state == "finished" and (lines := last_lines(folder.case(case) / MEASURED)):
            note = f"cannot be measured: {lines[-1]}"
        elif state == "measured":
            record = read_result(folder.result(study, case)).record
            note = f"{record['wall_seconds']:.0f} s"
            if record["fingerprint"] != case.fingerprint:
                other += 1
                note += ", by another version of the deck"
        if damage := folder.damage(study, case):
            note = f"{note}; {damage}" if note else damage
        table.add_row(str(number), Text(case.name), state, Text(note))
    # A name is there to be copied, whole: a line may be longer than the terminal is wide.
    Console(highlight=False, width=WIDEST).print(table)
    print(f"{study.name}: " + ", ".join(f"{count} {state}" for state, count in states.items()))
    if other:
        print(
            f"{other} results are of other versions of the decks; they are kept. Delete them in "
            f"{folder.root / 'results' / study.name} to run these cases again."
        )


def _chosen(study: Study, wanted: Iterable[str] | None) -> list[Case]:
    if wanted is None:
        return list(study.cases)
    cases = {case.name: case for case in study.cases}
    cases |= {str(number): case for number, case in enumerate(study.cases, 1)}
    chosen = []
    for name in wanted:
        if name not in cases:
            raise WorkflowError(
                f"--case {name}: {study.name} has no such case; it must be a name that "
                f"`inelastic status` shows, or a number from 1 to {len(study.cases)}"
            )
        # Once, however often and by whichever of its names it was asked for.
        if cases[name] not in chosen:
            chosen.append(cases[name])
    return chosen


def _found(path: Path) -> Path:
    """Return a study's path: as given, or of a shipped study of that name."""
    if path.exists():
        return path
    shipped = {file.stem: file for file in sorted(SHIPPED.glob("*.toml"))}
    if str(path) not in shipped:
        raise WorkflowError(f"no study {path}: it must be a TOML file or {', '.join(shipped)}")
    return shipped[str(path)]


def at_once(options: argparse.Namespace) -> int:
    """Return how many cases may run at a time: as asked, or as the cores allow."""
    cores = len(os.sched_getaffinity(0))
    if options.ranks > cores and not getattr(options, "mpi", False):
        raise WorkflowError(f"--ranks {options.ranks}: each rank needs one of the {cores} cores")
    if options.at_once is not None:
        return int(options.at_once)
    return max(1, cores // int(options.ranks))


def _cases(cases: Sequence[Case]) -> str:
    return f"{len(cases)} case" + ("" if len(cases) == 1 else "s")


def add_options_of_run(parser: argparse.ArgumentParser) -> None:
    """Add how cases are run."""
    parser.add_argument(
        "--at-once", type=_count, default=None, help="cases at a time (default: all cores)"
    )
    parser.add_argument("--ranks", type=_count, default=1, help="MPI ranks of each (default: 1)")
    parser.add_argument(
        "--timeout", type=seconds, help="give up a case after so many seconds (default: never)"
    )


def _add_studies(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "studies",
        type=Path,
        nargs="+",
        metavar="STUDY",
        help="a TOML file, or the name of a shipped study",
    )


def _add_out(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("studies"),
        metavar="DIR",
        help="folder for all cases and results (default: studies)",
    )


def _count(text: str) -> int:
    # Digits of other scripts are digits too, and superscripts: but no numbers.
    if not (text.isascii() and text.isdigit() and len(text) < 10) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number of at least 1")
    return int(text)


def seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value <= LONGEST_TIMEOUT:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no number of seconds above 0, and up to {LONGEST_TIMEOUT:g}"
        )
    return value
