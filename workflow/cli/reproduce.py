"""The subcommand `inelastic reproduce`: all shipped studies, one HDF5 file, one report."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..errors import WorkflowError
from ..results.store import write_studies
from ..running.folder import Folder
from ..running.gather import adopt_results, gather_results
from ..running.run_and_gather import run_and_gather
from ..shipped import (
    QUICK_FOLDER,
    RESULTS,
    RESULTS_VARIABLE,
    STUDIES,
    STUDIES_FOLDER,
    find_stored_results,
)
from ..study import read_study
from .arguments import add_out, add_running, running_options

STORE, REPORT, TABLES, FIGURES = "paper.h5", "report.html", "report.md", "figures"


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    reproduce = commands.add_parser(
        "reproduce",
        help="run the studies of the paper, and write one HDF5 file and one report",
        description=f"Run the shipped studies, and write {STORE}, {REPORT}, its tables as text in "
        f"{TABLES}, and the folder {FIGURES}. It can be interrupted at any moment: the next time "
        "does what is left.",
    )
    add_out(reproduce, "paper")
    which = reproduce.add_mutually_exclusive_group()
    which.add_argument(
        "--quick", action="store_true", help="fewer cases and smaller packings: 10 to 20 minutes"
    )
    which.add_argument(
        "--stored",
        action="store_true",
        help="take the stored results, and run only what they lack",
    )
    which.add_argument(
        "--stored-only", action="store_true", help="take the stored results, and run nothing"
    )
    reproduce.add_argument(
        "--results",
        type=Path,
        metavar="DIR",
        help=f"where the stored results are (default: the environment variable {RESULTS_VARIABLE}, "
        f"or the folder {RESULTS} of the repository)",
    )
    add_running(reproduce)
    reproduce.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run what is missing, and write the report; 1 if any case has failed, else 0."""
    stored = None
    if options.stored or options.stored_only:
        stored = find_stored_results(options.results)
        print(f"stored results: {stored}")
    elif options.results is not None:
        raise WorkflowError("--results: only --stored and --stored-only take results")
    where = QUICK_FOLDER if options.quick else STUDIES_FOLDER
    folder = Folder(options.out)
    running = running_options(options)
    studies = [read_study(where / f"{name}.toml") for name in STUDIES]
    if stored is not None:
        for study in studies:
            count = adopt_results(study, folder, stored, of_any_code=options.stored_only)
            print(f"{study.name}: {count} stored results of {len(study.cases)} taken")
    outcomes = []
    if not options.stored_only:
        outcomes = run_and_gather([(study, study.cases) for study in studies], folder, running)
    store = folder.root / STORE
    with folder.gathering():
        write_studies(
            store, [gather_results(study, folder, options.stored_only) for study in studies]
        )
    print(f"results: {store}")
    # Drawing takes a while to import, for which the other subcommands need not wait.
    from ..report.report_files import write_report

    root = folder.root
    write_report([store], root / REPORT, root / FIGURES, root / TABLES)
    return 1 if any(outcome.failed for outcome in outcomes) else 0
