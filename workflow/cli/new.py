"""The subcommand `inelastic new`: a small study as a start for one's own."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import Any

from ..study.starting_points import write_first_study


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    new = commands.add_parser(
        "new",
        help="write a small study, to change it and run it",
        description="Write a small study with comments, which `inelastic run` runs as it is. "
        "Nothing is overwritten.",
    )
    new.add_argument("file", type=Path, metavar="FILE", help="file to write, such as my-study.toml")
    new.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Write the study, and print what to do next; 0, or a WorkflowError."""
    file: Path = options.file
    write_first_study(file)
    study, out = shlex.quote(str(file)), shlex.quote(file.stem)
    print(f"Written: {file}")
    print(f"Next: inelastic run {study} --out {out}")
    return 0
