"""Notebooks are their pages, whose blocks are run: the same text, the same blocks in one order."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.helpers.blocks import Block, blocks_of
from tests.notebook import PAGES, TUTORIALS, notebook_of

from .test_blocks import run_page


def code_of(page: Path) -> list[str]:
    """Return the texts of the code cells of a page's notebook."""
    cells = json.loads(page.with_suffix(".ipynb").read_text())["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_notebook_is_its_page(page: Path) -> None:
    assert page.with_suffix(".ipynb").read_text() == notebook_of(page.read_text(), PAGES[page]), (
        "run python -m tests.notebook"
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_that_runs_is_a_cell(page: Path) -> None:
    code = code_of(page)
    if PAGES[page] is not None:
        assert code.pop(0) == PAGES[page]
    blocks = [block for block in blocks_of(page.read_text()) if block.is_run or block.is_file]
    assert len(code) == len(blocks)
    for cell, block in zip(code, blocks, strict=True):
        assert cell.endswith(block.text.rstrip("\n"))
        if block.language != "python":
            assert cell.startswith(("%%sh\n", f"%%writefile {block.file}\n"))


@pytest.mark.slow
def test_the_notebook_of_pack_runs(tmp_path: Path) -> None:
    """Cell by cell, from any folder: it needs no clone and no deck."""
    cells = []
    for number, text in enumerate(code_of(TUTORIALS / "pack.md")):
        shell = text.startswith("%%sh\n")
        language, body = ("sh", text.removeprefix("%%sh\n")) if shell else ("python", text)
        cells.append(Block(language, body, number, None, None, False))
    assert len(cells) >= 4
    assert run_page(cells, tmp_path) == ""
    assert (tmp_path / "packing-run" / "contacts.lammpsdump").is_file()
