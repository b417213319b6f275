"""Checks of every case of every study: the largest overlap, and how well contacts are resolved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...results.store import Result
from ...shipped import DECKS
from ..blocks import Cell, Content
from ..columns import RUNS, Column, table
from ..data import Data
from ..groups import labelled
from ..quantities import COORDINATION_NUMBER, RESOLUTION
from ..text import as_short, as_text

# Bodies turn, and may overlap by two tolerances, as spheres may with a curved wall; free spheres
# among themselves and at the flat walls of our decks by one.
ALLOWED_OF_BODIES, ALLOWED_OF_SPHERES = 2.0, 1.0
# Overlap and tolerance are rounded numbers of different programs: so much more is the same.
ROUNDING = 1e-6
# A contact is told from a gap well up to a resolution of 0.01; the rest is rounding.
WORST_RESOLUTION = 0.0101


@dataclass(frozen=True)
class _Row:
    """The runs of one case of a study."""

    study: str
    label: str
    group: Sequence[Result]

    @property
    def tolerance(self) -> float:
        """The loosest tolerance of a run, radii; NaN if the deck has none."""
        names = ("tolerance", "tolerance_agitated", "tolerance_measuring")
        values = [self.group[0].setting(name) for name in names]
        return max((value for value in values if not math.isnan(value)), default=math.nan)

    @property
    def overlap(self) -> float:
        """The largest overlap of the runs, radii."""
        return max((_overlap(result) for result in self.group), default=math.nan)

    @property
    def allowed(self) -> float:
        """The allowed overlap, tolerances."""
        flat = all(stage["deck"] in DECKS for one in self.group for stage in one.record["stages"])
        bodies = any(one.number("particles") < one.number("spheres") for one in self.group)
        return ALLOWED_OF_SPHERES if flat and not bodies else ALLOWED_OF_BODIES

    @property
    def in_bed(self) -> float:
        """The smallest share of a run's measuring box inside the bed; NaN where it is not known."""
        shares = [one.number("box_in_bed") for one in self.group]
        return min((share for share in shares if not math.isnan(share)), default=math.nan)

    @property
    def at_rest(self) -> float:
        """The share of the runs that end at rest; NaN where it is not known."""
        told = [value for one in self.group if not math.isnan(value := one.number("at_rest"))]
        return sum(told) / len(told) if told else math.nan

    @property
    def resolution(self) -> float:
        """The mean resolution of the runs."""
        return RESOLUTION.over(self.group).mean


def _overlap(result: Result) -> float:
    """Return the largest overlap of all steps; of the last frame where that is not known."""
    whole = result.number("largest_overlap_of_all_steps")
    return whole if not math.isnan(whole) else result.number("largest_overlap")


def _overlap_cell(row: _Row) -> Cell:
    ratio = row.overlap / row.tolerance
    return Cell(as_text(ratio, 3), marked=ratio > row.allowed * (1 + ROUNDING))


COLUMNS: Sequence[Column[_Row]] = (
    Column("study", lambda row: row.study),
    Column("case", lambda row: row.label),
    RUNS,
    Column("ε / r", lambda row: as_short(row.tolerance)),
    Column("largest overlap / r", lambda row: as_short(row.overlap)),
    Column("overlap / ε", _overlap_cell),
    COORDINATION_NUMBER.column(),
    Column(
        RESOLUTION.heading,
        lambda row: Cell(as_short(row.resolution), marked=row.resolution > WORST_RESOLUTION),
    ),
)
NOTE = (
    "ε: the loosest of a run. Marked: an overlap of more than ε (2 ε where there are bodies, which "
    "turn, or a deck of your own, whose walls may be curved), or a count whose ε / (g h²) is above "
    "0.01."
)
# Results of before this was measured have no such column.
IN_BED: Column[_Row] = Column(
    "box in the bed",
    lambda row: Cell(as_text(100 * row.in_bed, 0), marked=row.in_bed < 1),
    "%",
)

# Nor this one.
AT_REST: Column[_Row] = Column("at rest", lambda row: _rest_cell(row), "% of the runs")


def _rest_cell(row: _Row) -> Cell:
    if row.at_rest < 1:
        return Cell(f"NOT AT REST: {as_text(100 * row.at_rest, 0)}", marked=True)
    return Cell(as_text(100 * row.at_rest, 0))


def checks(data: Data) -> Content:
    """Show overlap and resolution of every case."""
    rows = [
        _Row(study.name, label, group)
        for study in data.studies.values()
        for label, group in labelled(study.results)
    ]
    if not rows:
        return Content()
    columns, notes = list(COLUMNS), [NOTE]
    if not all(math.isnan(row.in_bed) for row in rows):
        columns.append(IN_BED)
        notes.append(
            "Box in the bed: the least share of a run's measuring box; below 100 % the numbers of "
            "the box are partly of empty space."
        )
    if not all(math.isnan(row.at_rest) for row in rows):
        columns.append(AT_REST)
        notes.append(
            "At rest: the share of the runs that end with an rms speed of at most 0.1 g h and "
            "forces that miss the weight by at most 0.01 of it."
        )
    caption = "Largest overlap at any step of any run, and how well contacts are resolved"
    return Content([table(caption, columns, rows, notes)])
