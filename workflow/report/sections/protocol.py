"""Whether a packing depends on what the paper does not state: time step, random force, drag."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...results.store import Result
from ..blocks import Content, Text
from ..columns import RUNS, Column, difference_cell, table
from ..data import Data
from ..figures import Figure, Panel, points
from ..groups import count_of, grouped
from ..quantities import COORDINATION_NUMBER, MEAN_RESOLUTION, PACKING_FRACTION
from ..statistics import SIGNIFICANT, UNKNOWN, Difference, adjusted, difference, numbers
from ..text import as_count, as_short, as_text

# The variables that are changed, and what stands before a changed value.
PROTOCOL = {"dt": "h =", "random_force": "random force", "drag": "drag"}


@dataclass(frozen=True)
class _Row:
    """The runs of one protocol.

    Attributes
    ----------
    values : of the variables, in their order
    label : what is not as in the standard protocol
    group : the runs
    phi_apart, z_apart : differences from the standard protocol; unknown for itself
    """

    values: tuple[float, ...]
    label: str
    group: Sequence[Result]
    phi_apart: Difference
    z_apart: Difference


COLUMNS: Sequence[Column[_Row]] = (
    Column("time step h", lambda row: as_short(row.values[0])),
    Column("random force", lambda row: as_short(row.values[1])),
    Column("drag", lambda row: as_short(row.values[2])),
    RUNS,
    PACKING_FRACTION.column(),
    Column("difference", lambda row: difference_cell(row.phi_apart), "SE"),
    COORDINATION_NUMBER.column(),
    Column("difference", lambda row: difference_cell(row.z_apart), "SE"),
    MEAN_RESOLUTION,
)


def protocol(data: Data) -> Content:
    """Show packings with one value of the protocol changed at a time."""
    results = data.results("protocol")
    if not results:
        return Content()
    rows = _rows(results)
    apart = [one for row in rows[1:] for one in (row.phi_apart, row.z_apart)]
    significant = sum(one.is_significant for one in apart)
    remaining = sum(p < SIGNIFICANT for p in adjusted([one.p for one in apart]))
    return Content(
        [
            Figure(
                "protocol",
                "Packing fraction and coordination number of "
                f"{as_count(count_of(results))} spheres with one value of the protocol changed at "
                "a time; error bars: standard error.",
                [_panel(rows, name) for name in ("packing_fraction", "coordination_number")],
            ),
            table(
                "What the paper does not state: does the packing depend on it?",
                COLUMNS,
                rows,
                (
                    "Mean ± standard deviation (standard error). Differences from the first row, "
                    "in standard errors of the difference; marked: p below "
                    f"{SIGNIFICANT} by Student's t.",
                ),
            ),
            Text(
                f"{significant} of {len(apart)} differences are marked; chance alone would mark "
                f"about {as_text(SIGNIFICANT * len(apart), 1)}. With Holm's correction for their "
                f"number {remaining} remain. All rows are compared with the same first one, which "
                "that correction allows for."
            ),
        ]
    )


def _rows(results: Sequence[Result]) -> list[_Row]:
    """Return a row for each protocol; the first rows of the study have the deck's own values."""
    groups = grouped(results, lambda r: tuple(map(r.setting, PROTOCOL)))
    standard, *_ = groups
    usual = groups[standard]
    rows = []
    for values, group in groups.items():
        changed = [
            f"{word} {as_short(value)}"
            for word, value, normal in zip(PROTOCOL.values(), values, standard, strict=True)
            if value != normal and not math.isnan(value)
        ]
        rows.append(
            _Row(
                values,
                ", ".join(changed) or "standard",
                group,
                difference(PACKING_FRACTION.over(group), PACKING_FRACTION.over(usual))
                if changed
                else UNKNOWN,
                difference(COORDINATION_NUMBER.over(group), COORDINATION_NUMBER.over(usual))
                if changed
                else UNKNOWN,
            )
        )
    return rows


def _panel(rows: Sequence[_Row], name: str) -> Panel:
    """Return a number, as it is stored, for each protocol."""
    text = name.replace("_", " ")
    found = [numbers(row.group, name) for row in rows]
    return Panel(
        "protocol",
        text,
        [points(text, np.arange(len(found)), found, "apart")],
        ticks=[row.label for row in rows],
        references=[("standard", found[0].mean)],
    )
