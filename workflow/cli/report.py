"""The subcommand `inelastic report`: results beside the paper's, as one page and as figures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    report = commands.add_parser(
        "report",
        help="write a page with all tables and figures of some results",
        description="Write one HTML page from files that `inelastic run` and `inelastic collect` "
        "write: the shipped studies beside the paper's numbers, any other study with tables and "
        "plots of its own. What has not been run is left out, with a note.",
    )
    report.add_argument("files", type=Path, nargs="+", metavar="FILE", help="HDF5 file of studies")
    report.add_argument(
        "--out",
        type=Path,
        default=Path("report.html"),
        metavar="FILE",
        help="page to write (default: report.html)",
    )
    report.add_argument(
        "--figures",
        type=Path,
        metavar="DIR",
        help="write each figure there too, as PDF and PNG, and its numbers as CSV",
    )
    report.add_argument(
        "--markdown", type=Path, metavar="FILE", help="write the tables there too, as text"
    )
    report.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Write the page and the figures, and print where they are; 0, or a WorkflowError."""
    # Drawing takes a while to import, for which the other subcommands need not wait.
    from ..report.report_files import write_report

    write_report(options.files, options.out, options.figures, options.markdown)
    return 0
