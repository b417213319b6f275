"""Text that fits a terminal: tables, parted where they are wider, and notes in several lines.

In a file or a pipe a table keeps one line a row. No cell is ever cut: names in it are there to be
copied.
"""

from __future__ import annotations

import textwrap

from rich.console import Console
from rich.table import Table

# A terminal shows so many letters in a line, as all pages take it.
COLUMNS = 100
# No line is longer than this [letters].
WIDEST = 10_000
# No note is wrapped at fewer letters, however much stands before it.
NARROWEST = 30


def on_terminal() -> bool:
    """Say whether stdout is a terminal."""
    return Console().is_terminal


def width_of(table: Table) -> int:
    """Return how long the longest line of a table is [letters]."""
    return Console(width=WIDEST).measure(table).maximum


def print_wide(table: Table, keys: int = 0) -> None:
    """Print a table: in parts on a terminal that it does not fit, else whole.

    Parameters
    ----------
    table : a table without a box
    keys : so many columns say what a row is, and are repeated in each part
    """
    console = Console(highlight=False, width=WIDEST)
    for number, part in enumerate(parted(table, keys) if on_terminal() else [table]):
        if number:
            console.print()
        console.print(part)


def parted(table: Table, keys: int = 0) -> list[Table]:
    """Return a table as tables of at most so many letters as a terminal shows.

    One that has but one column beside the keys may be wider.
    """
    if width_of(table) <= COLUMNS:
        return [table]
    first = [*range(keys)]
    parts: list[list[int]] = []
    for column in range(keys, len(table.columns)):
        if parts and width_of(_chosen(table, [*first, *parts[-1], column])) <= COLUMNS:
            parts[-1].append(column)
        else:
            parts.append([column])
    return [_chosen(table, [*first, *part]) for part in parts]


def wrapped(before: str, note: str) -> str:
    """Return a line whose note goes on below itself where a terminal's line would end."""
    width = max(COLUMNS - len(before), NARROWEST)
    # Neither a path nor an option of a command is broken.
    lines = textwrap.wrap(note, width, break_long_words=False, break_on_hyphens=False)
    return f"\n{' ' * len(before)}".join([before + "".join(lines[:1]), *lines[1:]])


def _chosen(table: Table, columns: list[int]) -> Table:
    """Return a table of some columns of another one."""
    chosen = Table(box=None, pad_edge=table.pad_edge)
    for column in (table.columns[index] for index in columns):
        chosen.add_column(column.header, justify=column.justify, no_wrap=column.no_wrap)
    cells = [list(table.columns[index].cells) for index in columns]
    for row in zip(*cells, strict=True):
        chosen.add_row(*row)
    return chosen
