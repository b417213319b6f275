"""From sections to one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.resources import files

from jinja2 import Environment, StrictUndefined, select_autoescape

from ..provenance import THIS, versions
from .blocks import Cell, Comparison, Section, Table
from .columns import Column, difference_cell, ours_text, table
from .data import Data
from .sections.provenance import codes_line, commands
from .statistics import LARGE, SHARE_ABOVE_LARGE, computing_seconds
from .text import as_short, as_stated, as_text, as_time

TEMPLATE = "template.html.j2"


@dataclass(frozen=True)
class Summary:
    """The table at the top of a report, and its sum.

    Attributes
    ----------
    table : all comparisons with the paper
    compared : how many of them have a difference in standard errors
    large : how many of these differences are large
    """

    table: Table
    compared: int
    large: int

    @property
    def large_by_chance(self) -> str:
        """How many differences would be large if nothing but chance made them."""
        return as_text(SHARE_ABOVE_LARGE * self.compared, 1)


@dataclass(frozen=True)
class _Row:
    """A comparison and the section that it stands in."""

    section: Section
    comparison: Comparison

    def with_unit(self, text: str) -> str:
        """Write the unit of the comparison behind a number."""
        unit = self.comparison.unit
        return f"{text} {unit}" if unit else text

    @property
    def remarks(self) -> str:
        """The differences from the paper's case, and why a large difference is large."""
        one = self.comparison
        return "; ".join(text for text in (one.note, one.why if one.is_large else "") if text)


COLUMNS: Sequence[Column[_Row]] = (
    Column("number", lambda row: Cell(row.comparison.what, link=row.section.anchor)),
    Column("paper", lambda row: row.with_unit(as_stated(row.comparison.stated))),
    Column("ours", lambda row: row.with_unit(ours_text(row.comparison))),
    Column("runs", lambda row: row.comparison.ours.n),
    Column("difference", lambda row: difference_cell(row.comparison.difference), "SE"),
    Column("not as in the paper, and why", lambda row: row.remarks),
)


def render(data: Data, sections: Sequence[Section]) -> str:
    """Return the page.

    Parameters
    ----------
    data : what the files hold
    sections : made from that data, from top to bottom
    """
    environment = Environment(
        autoescape=select_autoescape(default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text = (files("lammps_inelastic.workflow.report") / TEMPLATE).read_text(encoding="utf-8")
    results = [result for study in data.studies.values() for result in study.results]
    # A case of several studies was computed once.
    once = {result.case: result for result in results}.values()
    return environment.from_string(text).render(
        paper=data.paper["source"],
        sections=sections,
        summary=summarise(sections),
        commands=partial(commands, data),
        studies=data.studies,
        cases=len(once),
        time=as_time(computing_seconds(once)),
        written=datetime.now(UTC).strftime("%Y-%m-%d"),
        version=versions()[THIS],
        codes=codes_line(list(once)),
    )


def summarise(sections: Sequence[Section]) -> Summary | None:
    """Return the table of all comparisons; None if there are none."""
    rows = [_Row(section, one) for section in sections for one in section.comparisons]
    if not rows:
        return None
    compared = [row.comparison for row in rows if row.comparison.is_known]
    return Summary(
        table(
            "Paper and ours",
            COLUMNS,
            rows,
            (
                "Ours: mean ± standard deviation (standard error). SE: standard errors, "
                "sqrt(ours² + the paper's²); a ± that the paper states as such is taken for its "
                "standard error. Where it states no scatter, ours alone. Marked: more than "
                f"{as_short(LARGE)}. Dash: a single run has no standard error.",
            ),
        ),
        len(compared),
        sum(one.is_large for one in compared),
    )
