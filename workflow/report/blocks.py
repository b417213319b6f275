"""The parts of a report beside its figures: text, tables, comparisons, sections."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from .figures import Figure, Pictures
from .statistics import Difference, Sample, Stated, difference
from .text import NOT_RUN

# A column with a word of three letters in it is set as text, not as numbers.
_WORD = re.compile(r"[A-Za-z]{3}")


@dataclass(frozen=True)
class Text:
    """A paragraph; a missing part is a note of what has not been run yet."""

    text: str
    missing: bool = False

    @property
    def kind(self) -> str:
        """The name by which the template tells blocks apart."""
        return "text"


@dataclass(frozen=True)
class Listing:
    """Text of a file or commands, shown as it is, and folded up if it has a title."""

    text: str
    title: str = ""

    @property
    def kind(self) -> str:
        """The name by which the template tells blocks apart."""
        return "listing"


@dataclass(frozen=True)
class Cell:
    """One entry of a table.

    Attributes
    ----------
    text : what is written
    marked : whether it calls for attention
    link : the anchor of the section to which it leads; empty for none
    """

    text: str
    marked: bool = False
    link: str = ""


@dataclass(frozen=True)
class Table:
    """A table; `columns.table` makes one.

    Attributes
    ----------
    caption : the line above the table
    head : names of the columns, with units
    rows : one cell for each column
    notes : lines below the table
    """

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    notes: Sequence[str] = ()

    @property
    def kind(self) -> str:
        """The name by which the template tells blocks apart."""
        return "table"

    @property
    def is_text(self) -> list[bool]:
        """Say of each column whether words stand in it, not numbers."""
        return [
            any(_WORD.search(row[i].text) and row[i].text != NOT_RUN for row in self.rows)
            for i in range(len(self.head))
        ]


@dataclass(frozen=True)
class Packing:
    """A packing to turn, which is drawn when it is unfolded.

    Attributes
    ----------
    name : the name of the figure
    caption : what is seen
    page : its HTML page, which needs nothing else
    """

    name: str
    caption: str
    page: str

    @property
    def kind(self) -> str:
        """The name by which the template tells blocks apart."""
        return "packing"


Block = Text | Listing | Table | Figure | Pictures | Packing


@dataclass(frozen=True)
class Comparison:
    """A number of the paper beside ours.

    Attributes
    ----------
    what : the name of the number, with the case that it belongs to
    stated : the paper's number
    ours : mean and scatter over our runs
    decimals : how many decimals of ours are shown
    unit : the unit of both; empty for a pure number
    note : what of our runs is not as in the paper
    why : where a large difference comes from, as far as it is known
    topic : what it belongs to in the verdict; empty for the topic of its section
    place : where the verdict finds it, such as a tolerance; alike ones are told together
    """

    what: str
    stated: Stated
    ours: Sample
    decimals: int = 2
    unit: str = ""
    note: str = ""
    why: str = ""
    topic: str = ""
    place: str = ""

    @property
    def difference(self) -> Difference:
        """Ours less the paper's."""
        return difference(self.ours, self.stated)


@dataclass(frozen=True)
class Statement:
    """A sentence of the paper in words of ours, and whether our runs bear it out.

    Attributes
    ----------
    text : what the paper says
    holds : whether it does here; None where nothing was run that could tell
    evidence : the numbers by which that is decided
    otherwise : what is so instead, for the verdict; empty where the evidence says it
    topic : what it belongs to in the verdict; empty for the topic of its section
    """

    text: str
    holds: bool | None
    evidence: str
    otherwise: str = ""
    topic: str = ""


@dataclass(frozen=True)
class Content:
    """The content of a section, without its title.

    Attributes
    ----------
    blocks : from top to bottom; none where nothing has been run
    comparisons : the section's numbers in the summary
    statements : the section's sentences in the summary
    """

    blocks: Sequence[Block] = ()
    comparisons: Sequence[Comparison] = ()
    statements: Sequence[Statement] = ()


@dataclass(frozen=True)
class Section:
    """One section of the report.

    Attributes
    ----------
    anchor : the section's name in links
    title : the section's heading
    blocks : from top to bottom
    comparisons : the section's numbers in the summary
    studies : names of the studies that the section needs
    statements : the section's sentences in the summary
    topic : what its numbers and sentences belong to in the verdict, where they do not say it
    """

    anchor: str
    title: str
    blocks: Sequence[Block]
    comparisons: Sequence[Comparison] = ()
    studies: Sequence[str] = ()
    statements: Sequence[Statement] = ()
    topic: str = ""

    @property
    def is_missing(self) -> bool:
        """Whether the section only says that nothing has been run."""
        return all(isinstance(block, Text) and block.missing for block in self.blocks)


def missing(command: str) -> Text:
    """Return the note of a study that has no results, with the command that makes them."""
    return Text(f"Not run yet. To make it: {command}", missing=True)


def nothing_run() -> Text:
    """Return the note of a section that shows any study, where there is none."""
    return Text("No study has results.", missing=True)
