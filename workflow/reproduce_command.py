"""The subcommand `inelastic reproduce`: all shipped studies, one HDF5 file, one report."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .folder import Folder
from .launch import Options
from .report_command import write_report
from .store import write_studies
from .study import read_study
from .study_commands import (
    SHIPPED,
    add_options_of_run,
    adopt_results,
    at_once,
    gathered,
    run_one,
)

# In the order of the paper.
STUDIES = (
    "table-1",
    "more-seeds",
    "table-2",
    "figure-4",
    "figure-8",
    "dimers",
    "figure-10",
    "dimers-agitation",
    "response",
    "protocol",
)
QUICK, RESULTS = "quick", "results"
STORE, REPORT, FIGURES = "paper.h5", "report.html", "figures"


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    reproduce = commands.add_parser(
        "reproduce",
        help="run the studies of the paper, and write one HDF5 file and one report",
        description=f"Run the shipped studies, and write {STORE}, {REPORT} and the folder "
        f"{FIGURES}. It can be interrupted at any moment: the next time does what is left.",
    )
    reproduce.add_argument(
        "--out",
        type=Path,
        default=Path("paper"),
        metavar="DIR",
        help="folder for all cases and results (default: paper)",
    )
    which = reproduce.add_mutually_exclusive_group()
    which.add_argument(
        "--quick", action="store_true", help="fewer cases and smaller packings: about ten minutes"
    )
    which.add_argument(
        "--stored",
        action="store_true",
        help="take the results that come with the program, and run only what they lack",
    )
    which.add_argument(
        "--stored-only",
        action="store_true",
        help="take the results that come with the program, and run nothing",
    )
    add_options_of_run(reproduce)


def run(options: argparse.Namespace) -> int:
    """Run what is missing, and write the report; return the exit status."""
    where = SHIPPED / QUICK if options.quick else SHIPPED
    folder = Folder(options.out)
    limits = Options(at_once(options), options.ranks, options.timeout)
    studies = [read_study(where / f"{name}.toml") for name in STUDIES]
    failed = 0
    for number, study in enumerate(studies, 1):
        print(f"study {number} of {len(studies)}: {study.name}, {study.title}")
        if options.stored or options.stored_only:
            count = adopt_results(study, folder, SHIPPED / RESULTS)
            print(f"{study.name}: {count} stored results of {len(study.cases)} taken")
        if not options.stored_only:
            failed += len(run_one(study, study.cases, folder, limits).failed)
    store = folder.root / STORE
    write_studies(store, [gathered(study, folder) for study in studies])
    print(f"results: {store}")
    write_report([store], folder.root / REPORT, folder.root / FIGURES)
    return 1 if failed else 0
