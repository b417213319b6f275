"""What the report is made of, beside figures: text, tables, comparisons, sections."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from .figures import Figure, Pictures
from .statistics import LARGE, Sample, Stated, difference_in_errors


@dataclass(frozen=True)
class Text:
    """A paragraph; a missing part is a note of what has not been run yet."""

    text: str
    missing: bool = False

    @property
    def kind(self) -> str:
        """For the template."""
        return "text"


@dataclass(frozen=True)
class Listing:
    """Text of a file or commands, shown as it is, and folded up if it has a title."""

    text: str
    title: str = ""

    @property
    def kind(self) -> str:
        """For the template."""
        return "listing"


@dataclass(frozen=True)
class Cell:
    """One entry of a table; `marked` where it calls for attention."""

    text: str
    marked: bool = False
    link: str = ""


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes
    ----------
    caption : above it
    head : names of the columns, with units
    rows : one cell for each column
    notes : below it
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    notes: Sequence[str] = ()

    @property
    def kind(self) -> str:
        """For the template."""
        return "table"

    @property
    def is_text(self) -> list[bool]:
        """Say of each column whether words stand in it, not numbers."""
        return [
            any(_WORD.search(row[i].text) and row[i].text != NOT_RUN for row in self.rows)
            for i in range(len(self.head))
        ]


# What stands where nothing is known, and before negative numbers.
NOT_RUN = "not run yet"
DASH, MINUS = "\N{EN DASH}", "\N{MINUS SIGN}"

_WORD = re.compile(r"[A-Za-z]{3}")

Block = Text | Listing | Table | Figure | Pictures


@dataclass(frozen=True)
class Comparison:
    """A number of the paper beside ours.

    Attributes
    ----------
    what : is compared
    stated : the paper's
    ours : over our runs
    decimals : that are shown
    unit : behind both; empty for a pure number
    note : what is not as in the paper
    why : where a large difference comes from, as far as it is known
    """

    what: str
    stated: Stated
    ours: Sample
    decimals: int = 2
    unit: str = ""
    note: str = ""
    why: str = ""

    @property
    def difference(self) -> float:
        """In standard errors; NaN where none is known."""
        return difference_in_errors(self.ours, self.stated)

    @property
    def is_large(self) -> bool:
        """Whether the difference is more than two standard errors."""
        return abs(self.difference) > LARGE


@dataclass(frozen=True)
class Section:
    """One section of the report.

    Attributes
    ----------
    anchor : its name in links
    title : its heading
    blocks : its content
    comparisons : its rows of the summary
    studies : names of the studies that it needs
    """

    anchor: str
    title: str
    blocks: Sequence[Block]
    comparisons: Sequence[Comparison] = field(default=())
    studies: Sequence[str] = ()

    @property
    def is_missing(self) -> bool:
        """Whether it only says that nothing has been run."""
        return all(isinstance(block, Text) and block.missing for block in self.blocks)


def cells(*values: str | int | Cell) -> list[Cell]:
    """Return a row of cells."""
    return [value if isinstance(value, Cell) else Cell(str(value)) for value in values]


def as_text(value: float, decimals: int) -> str:
    """Write a number, a dash where it is not known."""
    if math.isnan(value):
        return DASH
    text = f"{value:.{decimals}f}"
    # Not -0.00.
    return text.replace("-", MINUS) if float(text) else text.removeprefix("-")


def as_short(value: float) -> str:
    """Write a number in as few digits as it needs, at most four."""
    if math.isnan(value) or value == 0:
        return DASH if math.isnan(value) else "0"
    # Fixed notation, which is read more easily, for all that occurs here.
    decimals = 3 - math.floor(math.log10(abs(value)))
    text = f"{value:.{max(decimals, 0)}f}" if decimals < 12 else f"{value:.4g}"
    return (text.rstrip("0").rstrip(".") if "." in text else text).replace("-", MINUS)


def as_sample(ours: Sample, decimals: int) -> str:
    """Write mean ± standard deviation (standard error)."""
    text = as_text(ours.mean, decimals)
    if math.isnan(ours.std):
        return text
    return f"{text} ± {as_text(ours.std, decimals)} ({as_text(ours.error, decimals + 1)})"


def as_difference(value: float) -> Cell:
    """Write a difference in standard errors, marked where it is large."""
    if math.isnan(value):
        return Cell(DASH)
    sign = "+" if value > 0 else ""
    return Cell(f"{sign}{as_text(value, 1)}", marked=abs(value) > LARGE)


def missing(study: str, what: str = "") -> Text:
    """Return the note of a study, or a part of it, that has no results."""
    part = f"{what}: not run yet. " if what else "Not run yet. "
    return Text(f"{part}To make it: inelastic run {study} --out DIR", missing=True)
