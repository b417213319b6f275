"""Every printed block of the pages for users runs as it is printed, or says why it does not."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.blocks import Block, blocks_of, prints, unexplained

ROOT = Path(__file__).parents[2]
# The reference has tests of its own, which know its tables, its syntax and its decks.
OTHERS = ("reference", "method", "measured")
PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if not set(OTHERS) & set(page.relative_to(ROOT).parts)
    and page.relative_to(ROOT).as_posix() not in ("docs/trouble.md", "docs/how-to/clusters.md")
]
# Pages that take more than some seconds, and run what other pages run, too.
SLOW = {
    "docs/start.md",
    "docs/how-to/cfd-bed.md",
    "docs/how-to/change-a-deck.md",
    "docs/how-to/hard-to-soft.md",
    "docs/how-to/pebble-bed.md",
    "docs/how-to/periodic.md",
    "docs/how-to/polydisperse.md",
    "docs/how-to/stl-walls.md",
    "docs/how-to/two-dimensions.md",
    *(
        f"docs/tutorials/{name}.md"
        for name in ("first-hour", "pack", "pictures", "python", "study")
    ),
}


def name_of(page: Path) -> str:
    """Return a page's path as seen from the root."""
    return page.relative_to(ROOT).as_posix()


def run_page(blocks: list[Block], folder: Path) -> str:
    """Run the blocks of a page in a folder; return what went wrong, or nothing.

    The folder has the decks, as the clone in which a reader starts.
    """
    (folder / "inputs").symlink_to(ROOT / "inputs")
    to_run = [block for block in blocks if block.is_run or block.is_file]
    (folder / "blocks.json").write_text(
        json.dumps([(block.language, block.text, block.file) for block in to_run])
    )
    environment = dict(os.environ)
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"
    environment |= {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"}
    run = subprocess.run(
        [sys.executable, "-m", "tests.helpers.page_run", "blocks.json", "results.json"],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    results_file = folder / "results.json"
    results = json.loads(results_file.read_text()) if results_file.exists() else []
    for block, (code, printed) in zip(to_run, results, strict=False):
        if code:
            return f"line {block.line} ends with {code}:\n{printed[-3000:]}"
        after = blocks[blocks.index(block) + 1 :][:1]
        missing = prints(after[0].text, printed) if after and after[0].output else None
        if missing is not None:
            return f"line {after[0].line}: not printed is {missing!r}, but\n{printed[-3000:]}"
    if len(results) < len(to_run) or run.returncode:
        number = min(len(results), len(to_run) - 1)
        return f"line {to_run[number].line} ended without a word, then: {run.stderr[-3000:]}"
    return ""


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name_of(page), marks=[pytest.mark.slow] * (name_of(page) in SLOW))
        for page in PAGES
    ],
)
def test_blocks_run_as_they_are_printed(page: Path, tmp_path: Path) -> None:
    blocks = blocks_of(page.read_text())
    assert [text for block in blocks if (text := unexplained(block))] == []
    assert run_page(blocks, tmp_path) == ""


def test_shipped_decks_are_printed_as_they_are() -> None:
    decks = [
        (block.text, match[1])
        for page in PAGES
        for block in blocks_of(page.read_text())
        if (match := re.match(r"it is (inputs/\S+\.in)\b", block.reason or ""))
    ]
    assert decks
    assert [name for text, name in decks if (ROOT / name).read_text() != text] == []


def test_the_pages_are_there() -> None:
    names = {name_of(page) for page in PAGES}
    assert {"README.md", "docs/start.md", "docs/can-i.md", "docs/tutorials/first-hour.md"} <= names
    assert len([name for name in names if name.startswith("docs/how-to/")]) > 10
    assert names >= SLOW


PAGE = """
```toml
# mine.toml
value = 3
```

```sh
cat mine.toml; echo shown 1.5 times
```

```text
value = 4
...
shown 12 times
```

<!-- not run: it takes an hour -->

```sh
false
```

```python
number = 1
```

text

```python
assert number == 1
```
"""


def test_files_outputs_and_reasons_are_seen() -> None:
    blocks = blocks_of(PAGE)
    assert [block.file for block in blocks] == ["mine.toml", None, None, None, None, None]
    assert [block.output for block in blocks] == [False, False, True, False, False, False]
    assert [block.is_run for block in blocks] == [False, True, False, False, True, True]
    assert [block.line for block in blocks] == [2, 7, 11, 19, 23, 29]
    assert blocks[3].reason == "it takes an hour"
    assert [unexplained(block) for block in blocks] == [None] * 6


def test_a_right_page_passes(tmp_path: Path) -> None:
    assert run_page(blocks_of(PAGE), tmp_path) == ""


@pytest.mark.parametrize(
    ("page", "wrong"),
    [
        ("```sh\ntrue\nfalse\ntrue\n```\n", "line 1 ends with 1"),
        ("```sh\necho ERROR; exit 3\n```\n", "line 1 ends with 3:\nERROR"),
        ("```python\n1 / 0\n```\n", "ZeroDivisionError"),
        ("```sh\necho one 1\n```\n\n```text\ntwo 1\n```\n", "line 5: not printed is 'two 1'"),
        ("```sh\necho b; echo a\n```\n\n```text\na\nb\n```\n", "not printed is 'b'"),
        ("```python\nimport os; os._exit(0)\n```\n\n```sh\ntrue\n```\n", "ended without a word"),
    ],
    ids=["a line of a block", "what it prints", "python", "output", "order", "a silent end"],
)
def test_a_wrong_page_is_seen(page: str, wrong: str, tmp_path: Path) -> None:
    assert wrong in run_page(blocks_of(page), tmp_path)


@pytest.mark.parametrize("language", ["lammps", "", "text", "console"])
def test_a_block_that_does_not_run_says_why(language: str) -> None:
    (block,) = blocks_of(f"```{language}\nrun 100\n```\n")
    assert "says so" in (unexplained(block) or "")
