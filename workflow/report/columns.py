"""Tables as lists of columns: a column is a heading and a function that gives the cell of a row.

What a row is depends on the table: a small dataclass with the runs of a case, and what else the
columns show. Heading and cell stand in one place, and a table is `table(caption, columns, rows)`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from ..results.store import Result
from .blocks import Cell, Comparison, Table
from .statistics import Difference
from .text import NOT_RUN, as_difference, as_sample

Row = TypeVar("Row")
# A column that needs little of a row fits all rows that have more.
AnyRow = TypeVar("AnyRow", contravariant=True)


@dataclass(frozen=True)
class Column(Generic[AnyRow]):
    """One column of a table.

    Attributes
    ----------
    heading : the column's heading, without the unit
    cell : the function that gives the cell of a row; text.py formats its numbers
    unit : the unit, behind the heading; empty for words and pure numbers
    """

    heading: str
    cell: Callable[[AnyRow], Cell | str | int]
    unit: str = ""

    @property
    def head(self) -> str:
        """Heading with unit."""
        return f"{self.heading} [{self.unit}]" if self.unit else self.heading


def table(
    caption: str, columns: Sequence[Column[Row]], rows: Iterable[Row], notes: Sequence[str] = ()
) -> Table:
    """Return a table with a cell for each row and column."""
    return Table(
        caption,
        [column.head for column in columns],
        [[_as_cell(column.cell(row)) for column in columns] for row in rows],
        notes,
    )


def _as_cell(value: Cell | str | int) -> Cell:
    return value if isinstance(value, Cell) else Cell(str(value))


class Grouped(Protocol):
    """A row that shows the runs of one case."""

    @property
    def group(self) -> Sequence[Result]:
        """The runs."""


@dataclass(frozen=True)
class LabelledRuns:
    """A row with the runs of one case and a name for them."""

    label: str
    group: Sequence[Result]


RUNS: Column[Grouped] = Column("runs", lambda row: len(row.group))
# The paper has these cases, so that a missing one is said to be missing.
RUNS_OF_PAPER: Column[Grouped] = Column("runs", lambda row: len(row.group) or NOT_RUN)


def difference_cell(one: Difference) -> Cell:
    """Return a difference in standard errors, marked where chance would hardly make it."""
    return Cell(as_difference(one.in_errors), marked=one.is_significant)


def ours_text(comparison: Comparison) -> str:
    """Write the number of our runs in a comparison."""
    return as_sample(comparison.ours, comparison.decimals)
