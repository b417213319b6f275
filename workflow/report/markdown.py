"""From sections to a text in Markdown: the tables, sentences and figures of a report."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from .blocks import Cell, Section, Table, Text
from .data import Data
from .figures import Figure
from .page import OF_COMPARISON, OF_RESULTS, Summary, summarise
from .sections.provenance import codes_line, commands

# These sections hold all that is needed to repeat the runs: the page has them.
LEFT_OUT = frozenset({"provenance", "checks"})


def render_markdown(data: Data, sections: Sequence[Section], figures: str = "") -> str:
    """Return the text. It depends on the results alone: not on the day or the version that draws.

    Parameters
    ----------
    data : what the files hold
    sections : made from that data, from top to bottom
    figures : folder in which the figures are, as seen from the text; empty shows none
    """
    results = [result for study in data.studies.values() for result in study.results]
    once = list({result.case: result for result in results}.values())
    summary = summarise(sections)
    heading = OF_RESULTS if summary is None else OF_COMPARISON
    blocks = [f"# {heading}", codes_line(once)]
    if summary is not None:
        blocks += _summary(summary)
    for section in sections:
        if section.anchor in LEFT_OUT or section.is_missing:
            continue
        blocks.append(f"## {section.title}")
        blocks += _blocks(section, figures)
        if section.studies:
            blocks.append("\n".join(["```sh", *commands(data, section.studies), "```"]))
    return "\n\n".join(block for block in blocks if block) + "\n"


def _summary(summary: Summary) -> Iterator[str]:
    yield _escaped(summary.verdict.text)
    if summary.verdict.exceptions:
        yield "\n".join(f"- {_escaped(line)}" for line in summary.verdict.exceptions)
    yield (
        f"{summary.compared} comparisons of a number of the paper with ours. {summary.remaining} "
        f"differ; {summary.significant} would if each were the only one, of which chance alone "
        f"would make about {summary.by_chance}. Of {summary.told} sentences {summary.held} hold."
    )
    yield from _table(summary.numbers)
    if summary.statements is not None:
        yield from _table(summary.statements)


def _blocks(section: Section, figures: str) -> Iterator[str]:
    for block in section.blocks:
        if isinstance(block, Text):
            yield _escaped(block.text)
        elif isinstance(block, Table):
            yield from _table(block)
        elif isinstance(block, Figure) and figures:
            yield f"![{_escaped(block.caption)}]({figures}/{block.name}.png)"


def _table(table: Table) -> Iterator[str]:
    yield f"**{_escaped(table.caption)}**"
    left = table.is_text
    rules = ["---" if words else "---:" for words in left]
    rows = [_row(table.head), _row(rules), *(_row(map(_cell, row)) for row in table.rows)]
    yield "\n".join(rows)
    yield from map(_escaped, table.notes)


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(cell: Cell) -> str:
    text = _escaped(cell.text)
    return f"**{text}**" if cell.marked and text else text


def _escaped(text: str) -> str:
    """Write a text so that Markdown shows it as it is."""
    for character in "\\|*_<":
        text = text.replace(character, f"\\{character}")
    return text
