"""The notebooks of pages: their texts and their blocks as cells.

python -m tests.notebook        # writes docs/tutorials/first-hour.ipynb and pack.ipynb
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from tests.helpers.blocks import BLOCK, Block, blocks_of

ROOT = Path(__file__).parents[1]
TUTORIALS = ROOT / "docs" / "tutorials"
# A notebook starts in its own folder, a reader of the page in the clone.
IN_CLONE = "%cd ../.."
# The pages that are notebooks, and the first cell, for those that need the clone.
PAGES = {TUTORIALS / "first-hour.md": IN_CLONE, TUTORIALS / "pack.md": None}
LINK_TO_ITSELF = re.compile(r"\s+The same page is a \[notebook\]\([\w-]+\.ipynb\)\.")


def notebook_of(page: str, first: str | None) -> str:
    """Return a page as a notebook: files are written by cells, outputs come of themselves.

    `first` is the text of a cell before all others, or None.
    """
    cells = [] if first is None else [_cell("code", first)]
    end = 0
    for match, block in zip(BLOCK.finditer(page), blocks_of(page), strict=True):
        cells += _text(page[end : match.start()])
        end = match.end()
        cells += _code(block)
    cells += _text(page[end:])
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"
    notebook = {
        "cells": cells,
        "metadata": {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


def _text(text: str) -> list[dict[str, object]]:
    stripped = re.sub(r"\s+$", "", LINK_TO_ITSELF.sub("", text)).strip("\n")
    return [_cell("markdown", stripped)] if stripped else []


def _code(block: Block) -> list[dict[str, object]]:
    if block.is_file:
        return [_cell("code", f"%%writefile {block.file}\n{block.text}")]
    if not block.is_run:
        return []
    return [_cell("code", block.text if block.language == "python" else f"%%sh\n{block.text}")]


def _cell(kind: str, text: str) -> dict[str, object]:
    cell: dict[str, object] = {
        "cell_type": kind,
        "metadata": {},
        "source": text.rstrip("\n").splitlines(keepends=True),
    }
    return cell | ({"execution_count": None, "outputs": []} if kind == "code" else {})


if __name__ == "__main__":
    for path, first in PAGES.items():
        path.with_suffix(".ipynb").write_text(notebook_of(path.read_text(), first))
