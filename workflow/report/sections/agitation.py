"""Coordination number of spheres while the random force acts, and at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ...results.store import Result
from ..blocks import Block, Content, Statement, Text
from ..columns import RUNS, Column, table
from ..data import SPHERES, Data, deck_defaults
from ..groups import count_of, grouped, is_agitated, solver_of
from ..quantities import AGITATED_COORDINATION_NUMBER, COORDINATION_NUMBER
from ..statistics import SIGNIFICANT, Sample, Stated, adjusted, difference, sample
from ..text import as_count, as_mean, as_sample, as_short

# The paper says that the coordination number is too small by about so much.
STATED_DROP = 0.5


class _Kind(NamedTuple):
    """The parameters that the runs of one row have in common."""

    particles: int
    diameter: float
    tolerance: float
    solver: str
    dt: float
    force: float

    @property
    def strength(self) -> float:
        """The square of the force times the step: so goes the energy that it feeds in."""
        return self.force**2 * self.dt


@dataclass(frozen=True)
class _Row:
    """The runs of one kind, and z at rest less z while agitated."""

    kind: _Kind
    group: Sequence[Result]
    drop: Sample


COLUMNS: Sequence[Column[_Row]] = (
    Column("spheres", lambda row: as_count(row.kind.particles)),
    Column("d", lambda row: as_short(row.kind.diameter)),
    Column("ε / r", lambda row: as_short(row.kind.tolerance)),
    Column("solver", lambda row: row.kind.solver),
    Column("time step h", lambda row: as_short(row.kind.dt)),
    Column("random force A", lambda row: as_short(row.kind.force)),
    Column("A² h", lambda row: as_short(row.kind.strength)),
    RUNS,
    AGITATED_COORDINATION_NUMBER.column(),
    COORDINATION_NUMBER.column("z at rest"),
    Column("difference", lambda row: as_sample(row.drop, 3)),
)


def agitation(data: Data) -> Content:
    """Compare the coordination number while agitated with that at rest."""
    groups = grouped(_agitated(data), _kind_of)
    rows = [_Row(kind, group, _drop(group)) for kind, group in sorted(groups.items())]
    if not rows:
        return Content()
    blocks: list[Block] = [
        table(
            "Coordination number while the random force acts, and at rest",
            COLUMNS,
            rows,
            (
                "Mean ± standard deviation (standard error) over the runs. Agitated: mean over "
                "the second half of the phase with random force.",
            ),
        ),
        Text(
            "Paper: with the random force the coordination number is too small by about "
            f"{as_short(STATED_DROP)}. How much it is depends on how strong the force is, which "
            "the paper does not state, and on the time step. The force is drawn anew in each step, "
            "so that the energy that it feeds in goes with A² h. A contact is what has touched "
            "within a step: shaken spheres that touch now and then do so in more of the longer "
            "steps, and z depends on the step even where A² h is the same. While the spheres are "
            "agitated the count is made with the larger tolerance."
        ),
    ]
    return Content(blocks, statements=_statements(rows, data))


def _agitated(data: Data) -> list[Result]:
    """Return the runs of the deck's own drag whose agitation was measured."""
    usual = deck_defaults(SPHERES)
    results = [
        result
        for study in ("table-1", "table-2", "protocol")
        for result in data.results(study)
        if is_agitated(result)
        and result.variables.get("drag") == usual.get("drag")
        and not math.isnan(result.number("coordination_number_agitated"))
    ]
    # Some cases are in more than one of these studies.
    return list({result.case: result for result in results}.values())


def _kind_of(result: Result) -> _Kind:
    return _Kind(
        count_of([result]),
        result.setting("diameter"),
        result.setting("tolerance"),
        solver_of(result),
        result.setting("dt"),
        result.setting("random_force"),
    )


def _drop(group: Sequence[Result]) -> Sample:
    return sample(COORDINATION_NUMBER.of(r) - AGITATED_COORDINATION_NUMBER.of(r) for r in group)


def _statements(rows: Sequence[_Row], data: Data) -> list[Statement]:
    """Say for which forces z is as much too small as the paper says."""
    known = [
        row
        for row in rows
        if row.kind.solver == data.our_solver and row.kind.tolerance == data.usual_tolerance
    ]
    fewest = [row for row in known if row.kind.particles == min(r.kind.particles for r in known)]
    weakest_first = sorted(fewest, key=lambda row: row.kind.strength)
    apart = [difference(row.drop, Stated(0.0)) for row in weakest_first]
    corrected = adjusted([one.p for one in apart])
    if not apart:
        return []
    fewer = all(one.value > 0 for one in apart)
    sure = all(p < SIGNIFICANT for p in corrected)
    return [
        Statement(
            "With the random force the coordination number is too small (the paper: by about "
            f"{as_short(STATED_DROP)}, of a force that is not stated).",
            fewer if sure else None,
            f"{as_count(weakest_first[0].kind.particles)} spheres: "
            + "; ".join(
                f"{as_mean(row.drop, 2)} at A = {as_short(row.kind.force)}, "
                f"h = {as_short(row.kind.dt)}"
                for row in weakest_first
            ),
        )
    ]
