"""The notebook is its page, whose blocks are run: the same text, the same blocks in one order."""

from __future__ import annotations

import json

from .blocks import blocks_of
from .notebook import FIRST, NOTEBOOK, PAGE, notebook_of


def test_the_notebook_is_its_page() -> None:
    assert NOTEBOOK.read_text() == notebook_of(PAGE.read_text()), (
        "run python -m tests.docs.notebook"
    )


def test_every_block_that_runs_is_a_cell() -> None:
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    blocks = [block for block in blocks_of(PAGE.read_text()) if block.is_run or block.is_file]
    assert code[0] == FIRST
    assert len(code) == 1 + len(blocks)
    for cell, block in zip(code[1:], blocks, strict=True):
        assert cell.endswith(block.text.rstrip("\n"))
        if block.language != "python":
            assert cell.startswith(("%%sh\n", f"%%writefile {block.file}\n"))
