"""The subcommand `inelastic run`: the cases of studies are run and measured."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterable, Sequence
from typing import Any

from ..errors import WorkflowError, meant
from ..running.folder import Folder
from ..running.run_and_gather import run_and_gather
from ..study import Case, Study
from .arguments import add_out, add_running, add_studies, read_studies, running_options, warn


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    parser = commands.add_parser(
        "run",
        help="run and measure the cases of a study that have no result yet",
        description="Run the cases of a study that are missing, and measure them. It can be "
        "interrupted at any moment: the next run does what is left.",
    )
    add_studies(parser)
    add_out(parser)
    add_running(parser)
    parser.add_argument(
        "--mpi",
        action="store_true",
        help="inside mpiexec: split the job's ranks into groups of --ranks, one case each",
    )
    parser.add_argument(
        "--case",
        action="append",
        metavar="NAME",
        help="only this case: a name, or a number from 1 as `status` counts; may be repeated",
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="print the commands and folders, run nothing"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the cases, or print how they would be; 1 if any has failed, else 0."""
    studies = read_studies(options.studies)
    warn(studies)
    folder = Folder(options.out)
    choices = [(study, _chosen(study, options.case)) for study in studies]
    if options.dry_run:
        for study, cases in choices:
            _print_commands(study, cases, folder, options.ranks)
        return 0
    running = running_options(options, in_job=options.mpi)
    outcomes = run_and_gather(choices, folder, running, in_job=options.mpi)
    return 1 if any(outcome.failed for outcome in outcomes) else 0


def _print_commands(study: Study, cases: Sequence[Case], folder: Folder, ranks: int) -> None:
    for case in cases:
        print(f"# {folder.state(case, folder.found(study, case))}")
        print(f"cd {shlex.quote(str(folder.part(case)))}")
        for command in case.commands(ranks):
            print(shlex.join(command))


def _chosen(study: Study, wanted: Iterable[str] | None) -> list[Case]:
    """Return the cases that are asked for, each once; all if none is."""
    if wanted is None:
        return list(study.cases)
    # Scripts may hold names that version 0.2 has shown.
    cases = {name: case for case in study.cases for name in (case.name_before, case.name)}
    cases |= {str(number): case for number, case in enumerate(study.cases, 1)}
    chosen = []
    for name in wanted:
        if name not in cases:
            raise WorkflowError(
                f"--case {name}: {study.name} has no such case{meant(name, cases)}; it must be a "
                f"name that `inelastic status` shows, or a number from 1 to {len(study.cases)}"
            )
        # A case may be asked for by its name and by its number.
        if cases[name] not in chosen:
            chosen.append(cases[name])
    return chosen
