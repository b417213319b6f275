"""The subcommand `inelastic validate`: study files are checked, and nothing is run."""

from __future__ import annotations

import argparse
from typing import Any

from .arguments import add_studies, as_cases, read_studies, warn


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    validate = commands.add_parser(
        "validate",
        help="check study files",
        description="Check study files; one line for each mistake.",
    )
    add_studies(validate)
    validate.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Say that the studies are fine, with warnings; 0, or a StudyError with their mistakes."""
    studies = read_studies(options.studies)
    warn(studies)
    for study, path in zip(studies, options.studies, strict=True):
        print(f"{path}: fine, {as_cases(study.cases)}")
    return 0
