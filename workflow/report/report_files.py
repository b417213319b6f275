"""The files of a report: its page, its figures, and the numbers of these."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ..errors import WorkflowError
from ..files import check_target, write_text, writing
from .contents import all_sections
from .data import read_data
from .figures import Figure, Pictures
from .markdown import render_markdown
from .page import render, summarise


def write_report(
    files: Sequence[Path], out: Path, figures: Path | None, markdown: Path | None = None
) -> None:
    """Write a report, and print where it is.

    Parameters
    ----------
    files : HDF5 files of studies
    out : HTML file to write
    figures : folder for the figures and their numbers; None writes none
    markdown : file for the tables as text; None writes none

    Raises WorkflowError if a file cannot be written, or would replace results or the page.
    """
    for target in (out, markdown):
        if target is not None:
            check_target(target, hdf5=False)
    if markdown is not None and markdown.resolve() == out.resolve():
        raise WorkflowError(f"{markdown}: page and tables need a file each: they have the same")
    data = read_data(files)
    sections = all_sections(data, [path.name for path in files])
    text = render(data, sections)
    write_text(out, text)
    summary = summarise(sections)
    if summary is not None:
        print(
            f"{summary.remaining} of {summary.compared} numbers differ from the paper's; "
            f"{summary.held} of {summary.told} sentences hold"
        )
    if figures is not None:
        with writing(figures):
            figures.mkdir(parents=True, exist_ok=True)
        drawn = [b for one in sections for b in one.blocks if isinstance(b, Figure | Pictures)]
        for figure in drawn:
            figure.write(figures)
        print(f"{len(drawn)} figures: {figures}")
    if markdown is not None:
        shown = "" if figures is None else os.path.relpath(figures, markdown.parent)
        write_text(markdown, render_markdown(data, sections, shown))
        print(f"tables: {markdown}")
    print(f"written: {out}")
