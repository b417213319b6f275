"""The fenced blocks of a page, and what a reader does with them.

    ```sh        commands, run by sh in the page's folder
    ```python    run in the same Python as all others of the page
    ```lammps, ```toml, ```text
                 the file that the comment in the first line names, `# mine.in`
    ```text      directly after a block that is run: what it prints. Numbers may be others, and
                 `...` stands for any lines

A block that is not run has a line above it that says why: `<!-- not run: it needs a cluster -->`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

RUN = ("sh", "python")
FILES = ("lammps", "toml", "text")
BLOCK = re.compile(
    r"(?:^<!-- not run: (?P<reason>[^\n]+?) -->\n+)?"
    r"^```(?P<language>[^\n`]*)\n(?P<text>.*?)^```[ ]*$",
    re.MULTILINE | re.DOTALL,
)
NAMED = re.compile(r"# (?P<name>[\w.-]+\.\w+)\n")
# A number, and what a number of it may have become: digits, a point, an exponent.
NUMBER = re.compile(r"[-+]?\d[\d,]*(?:\.\d*)?(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, its text, the line of the page where it begins."""

    language: str
    text: str
    line: int
    # Why it is not run, or None.
    reason: str | None
    # The file that it is, or None.
    file: str | None
    # Whether it is what the block before it prints.
    output: bool

    @property
    def is_run(self) -> bool:
        """Return whether it is run."""
        return self.reason is None and self.language in RUN

    @property
    def is_file(self) -> bool:
        """Return whether it is written to a file."""
        return self.reason is None and self.file is not None


def blocks_of(page: str) -> list[Block]:
    """Return the blocks of a page, in order."""
    blocks: list[Block] = []
    end = 0
    for match in BLOCK.finditer(page):
        language, text = match["language"].strip(), match["text"]
        named = NAMED.match(text) if language in FILES else None
        follows = bool(blocks) and not page[end : match.start()].strip()
        output = language == "text" and follows and blocks[-1].language in RUN and named is None
        blocks.append(
            Block(
                language=language,
                text=text,
                line=page.count("\n", 0, match.start("language")) + 1,
                reason=match["reason"],
                file=named["name"] if named else None,
                output=output,
            )
        )
        end = match.end()
    return blocks


def unexplained(block: Block) -> str | None:
    """Return what a block lacks that neither runs, nor is a file or an output, nor says why."""
    if block.reason is not None or block.is_run or block.file or block.output:
        return None
    return (
        f"line {block.line}: a block of {block.language or 'no language'} that is not run says so "
        "in the line above: <!-- not run: why -->"
    )


def prints(expected: str, printed: str) -> str | None:
    """Return the first line of a printed block that did not come out, or None."""
    lines = iter(_shape(line) for line in printed.splitlines())
    for line in expected.splitlines():
        if line.strip() in ("", "..."):
            continue
        if _shape(line) not in lines:
            return line
    return None


def _shape(line: str) -> str:
    """Return a line with one space for many, and one sign for every number."""
    return " ".join(NUMBER.sub("#", line).split())
