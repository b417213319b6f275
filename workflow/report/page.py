"""From sections to one HTML file that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from importlib.resources import files

from jinja2 import Environment, StrictUndefined, select_autoescape

from .blocks import (
    DASH,
    Cell,
    Comparison,
    Section,
    Table,
    as_difference,
    as_sample,
    as_short,
    as_text,
    cells,
)
from .data import Data
from .provenance import as_time, commands
from .statistics import LARGE, computing_seconds

TEMPLATE = "template.html.j2"


@dataclass(frozen=True)
class Summary:
    """The table at the top, and what it amounts to."""

    table: Table
    compared: int
    large: int


def render(data: Data, sections: Sequence[Section]) -> str:
    """Return the page."""
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
        version=version("lammps-inelastic"),
    )


def summarise(sections: Sequence[Section]) -> Summary | None:
    """Return the table of all comparisons; None if there are none."""
    rows: list[list[Cell]] = []
    compared: list[Comparison] = []
    for section in sections:
        for one in section.comparisons:
            rows.append(_row(section, one))
            if as_difference(one.difference).text != DASH:
                compared.append(one)
    if not rows:
        return None
    return Summary(
        Table(
            "Paper and ours",
            ("number", "paper", "ours", "runs", "difference [SE]", "not as in the paper, and why"),
            rows,
            (
                "Ours: mean ± standard deviation (standard error). SE: standard errors, "
                "sqrt(ours² + the paper's²); a ± that the paper states as such is taken for its "
                "standard error. Where it states no scatter, ours alone. Marked: more than "
                f"{LARGE:g}. Dash: a single run has no standard error.",
            ),
        ),
        len(compared),
        sum(one.is_large for one in compared),
    )


def _row(section: Section, one: Comparison) -> list[Cell]:
    stated = one.stated
    if stated.n:
        paper = f"{as_text(stated.value, 2)} ± {stated.std:g}"
    elif not math.isnan(stated.error):
        # As many decimals as the error has.
        error = f"{stated.error:.2g}"
        decimals = len(error.partition(".")[2])
        paper = f"{as_text(stated.value, decimals)} ± {error}"
    else:
        paper = as_short(stated.value)
    unit = f" {one.unit}" if one.unit else ""
    return [
        Cell(one.what, link=section.anchor),
        *cells(paper + unit, as_sample(one.ours, one.decimals) + unit, one.ours.n),
        as_difference(one.difference),
        Cell("; ".join(text for text in (one.note, one.why if one.is_large else "") if text)),
    ]
