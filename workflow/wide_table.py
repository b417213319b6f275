"""Tables that are printed whole: names in them are there to be copied."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

# No line is longer than this [letters].
WIDEST = 10_000


def print_wide(table: Table) -> None:
    """Print a table whose lines may be longer than the terminal is wide: no cell is cut."""
    Console(highlight=False, width=WIDEST).print(table)
