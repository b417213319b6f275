"""The subcommand `inelastic report`: results beside the paper's, as one page and as figures."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .files import whole


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


def run(options: argparse.Namespace) -> int:
    """Write the page and the figures, and print where they are; 0, or a WorkflowError."""
    write_report(options.files, options.out, options.figures)
    return 0


def write_report(files: Sequence[Path], out: Path, figures: Path | None) -> None:
    """Write a report, and print where it is.

    Parameters
    ----------
    files : of studies
    out : the page
    figures : folder for the figures and their numbers; None writes none
    """
    # Here and not above: drawing takes a while to import, and the other commands need not wait.
    from .report import all_sections, read_data, render
    from .report.figures import Figure, Pictures
    from .report.page import summarise

    data = read_data(files)
    sections = all_sections(data, [path.name for path in files])
    text = render(data, sections)
    with whole(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    summary = summarise(sections)
    if summary is not None:
        print(f"{summary.large} of {summary.compared} differences are above two standard errors")
    if figures is not None:
        figures.mkdir(parents=True, exist_ok=True)
        drawn = [b for one in sections for b in one.blocks if isinstance(b, Figure | Pictures)]
        for figure in drawn:
            figure.write(figures)
        print(f"{len(drawn)} figures: {figures}")
    print(f"written: {out}")
