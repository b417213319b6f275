"""From sections to one HTML file that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.resources import files

from jinja2 import Environment, StrictUndefined, select_autoescape

from ..provenance.run_record import THIS, versions
from .blocks import Block, Cell, Comparison, Section, Statement, Table, Text
from .columns import Column, difference_cell, ours_text, table
from .data import Data
from .figures import Figure, Pictures
from .sections.provenance import codes_line, commands
from .statistics import SIGNIFICANT, adjusted, computing_seconds
from .text import DASH, as_probability, as_stated, as_text, as_time
from .verdict import Verdict, differs, verdict

TEMPLATE = "template.html.j2"
# The headings of a report, and of what compares it with the paper where there is anything to.
OF_RESULTS, OF_COMPARISON = "Hard random packings: results", "Does it reproduce the paper?"
OF_NUMBERS = "The paper's numbers and sentences"
# A table of more rows is folded up.
MOST_ROWS = 16


@dataclass(frozen=True)
class Summary:
    """The answer at the top of a report: does it reproduce the paper?

    Attributes
    ----------
    verdict : the answer in words
    numbers : the paper's numbers beside ours
    compared : how many of them have a difference whose error is known
    significant : how many of these differences chance alone would hardly make, each by itself
    remaining : how many of them are left when they are corrected for how many were compared
    statements : the paper's sentences, and whether they hold here; None where there are none
    held, told : how many of the sentences hold, and of how many it is known
    """

    verdict: Verdict
    numbers: Table
    compared: int
    significant: int
    remaining: int
    statements: Table | None
    held: int
    told: int

    @property
    def by_chance(self) -> str:
        """How many differences would be significant if nothing but chance made them."""
        return as_text(SIGNIFICANT * self.compared, 1)


@dataclass(frozen=True)
class _Row:
    """A comparison, its corrected probability, and the section that it stands in."""

    section: Section
    comparison: Comparison
    corrected: float

    def with_unit(self, text: str) -> str:
        """Write the unit of the comparison behind a number."""
        unit = self.comparison.unit
        return f"{text} {unit}" if unit else text

    @property
    def verdict(self) -> str:
        """Whether both numbers agree; see `adjusted`."""
        if math.isnan(self.comparison.difference.p):
            return DASH
        if not self.comparison.difference.is_significant:
            return "agrees"
        if differs(self.comparison, self.corrected):
            return "differs"
        return "differs, perhaps by chance"

    @property
    def remarks(self) -> str:
        """The differences from the paper's case, and why a large difference is large."""
        one = self.comparison
        why = one.why if one.difference.is_significant else ""
        return "; ".join(text for text in (one.note, why) if text)


COLUMNS: Sequence[Column[_Row]] = (
    Column("number", lambda row: Cell(row.comparison.what, link=row.section.anchor)),
    Column("paper", lambda row: row.with_unit(as_stated(row.comparison.stated))),
    Column("ours", lambda row: row.with_unit(ours_text(row.comparison))),
    Column("runs", lambda row: row.comparison.ours.n),
    Column("difference", lambda row: difference_cell(row.comparison.difference), "SE"),
    Column("p", lambda row: as_probability(row.comparison.difference.p)),
    Column("verdict", lambda row: row.verdict),
    Column("not as in the paper, and why", lambda row: row.remarks),
)


@dataclass(frozen=True)
class _Said:
    """A statement, and the section that it stands in."""

    section: Section
    statement: Statement

    @property
    def verdict(self) -> Cell:
        """Whether the sentence holds."""
        holds = self.statement.holds
        if holds is None:
            return Cell("not known")
        return Cell("holds" if holds else "does not hold", marked=not holds)


STATEMENT_COLUMNS: Sequence[Column[_Said]] = (
    Column("the paper says", lambda said: Cell(said.statement.text, link=said.section.anchor)),
    Column("here", lambda said: said.verdict),
    Column("by what", lambda said: said.statement.evidence),
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
        of_results=OF_RESULTS,
        of_comparison=OF_COMPARISON,
        of_numbers=OF_NUMBERS,
        most_rows=MOST_ROWS,
        side_by_side=side_by_side,
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


def side_by_side(blocks: Sequence[Block]) -> list[list[Block]]:
    """Return the blocks in groups: a narrow figure with what belongs to it, or one block.

    Tables and texts below a figure belong to it; without any, the next narrow figure does.

    The page shows a group side by side where it is wide enough.
    """
    groups: list[list[Block]] = []
    for block in blocks:
        before = groups[-1] if groups else []
        of_figure = isinstance(block, Table | Text) and before and _is_narrow(before[0])
        if of_figure or (len(before) == 1 and _is_narrow(before[0]) and _is_narrow(block)):
            groups[-1].append(block)
        else:
            groups.append([block])
    return groups


def _is_narrow(block: Block) -> bool:
    if isinstance(block, Pictures):
        return len(block.pictures) == 1
    return isinstance(block, Figure) and not block.is_wide


def summarise(sections: Sequence[Section]) -> Summary | None:
    """Return all comparisons and statements; None if there are none."""
    pairs = [(section, one) for section in sections for one in section.comparisons]
    said = [_Said(section, one) for section in sections for one in section.statements]
    if not pairs and not said:
        return None
    probabilities = [one.difference.p for _, one in pairs]
    corrected = adjusted(probabilities)
    rows = [_Row(*pair, p) for pair, p in zip(pairs, corrected, strict=True)]
    told = [one.statement.holds for one in said if one.statement.holds is not None]
    return Summary(
        verdict(sections),
        table(
            "The paper's numbers and ours",
            COLUMNS,
            rows,
            (
                "Ours: mean ± standard deviation (standard error). SE: standard errors, sqrt(ours² "
                "+ the paper's²). Where the paper states no scatter, ours alone; where it states a "
                "range, ours alone beyond the range. p: how often chance alone would make a "
                "difference at least as large, by "
                f"Student's t (Welch). Marked: p below {SIGNIFICANT}. Rows share runs, and there "
                "are many: a number differs only if p is below that after Holm's correction, "
                "which holds whatever rows share.",
            ),
        ),
        sum(not math.isnan(p) for p in probabilities),
        sum(p < SIGNIFICANT for p in probabilities),
        sum(p < SIGNIFICANT for p in corrected),
        table("The paper's sentences", STATEMENT_COLUMNS, said) if said else None,
        sum(told),
        len(told),
    )
