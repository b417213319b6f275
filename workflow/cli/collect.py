"""The subcommand `inelastic collect`: the results of studies in one HDF5 file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..files import check_target
from ..results.store import write_studies
from ..running.folder import Folder
from ..running.gather import gather_results
from .arguments import add_out, add_studies, as_cases, read_studies


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    collect = commands.add_parser(
        "collect",
        help="gather a study's results in one HDF5 file",
        description="Gather the results of studies in one HDF5 file.",
    )
    add_studies(collect)
    add_out(collect)
    collect.add_argument(
        "--file", type=Path, help="the file (default: the study's name in the --out folder)"
    )
    collect.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Write the file, and print how many results are in it; return 0.

    Raises WorkflowError without the folder.
    """
    studies = read_studies(options.studies)
    folder = Folder(options.out)
    folder.check_there()
    file = options.file or folder.root / f"{'+'.join(study.name for study in studies)}.h5"
    check_target(file, hdf5=True)
    with folder.gathering():
        stored = [gather_results(study, folder) for study in studies]
        write_studies(file, stored)
    for study, found in zip(studies, stored, strict=True):
        print(f"{study.name}: {len(found.results)} of {as_cases(study.cases)}")
    print(f"written: {file}")
    return 0
