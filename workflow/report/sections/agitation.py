"""Coordination number of spheres while the random force acts, and at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ...store import Result
from ..blocks import Block, Comparison, Content, Text
from ..columns import RUNS, Column, table
from ..data import SPHERES, Data, deck_defaults
from ..groups import count_of, grouped, is_agitated, our_solver, solver_of
from ..quantities import AGITATED_COORDINATION_NUMBER, COORDINATION_NUMBER
from ..statistics import Sample, Stated, sample
from ..text import as_count, as_sample, as_short

# The paper says that the coordination number is too small by about so much.
STATED_DROP = 0.5


class _Kind(NamedTuple):
    """The parameters that the runs of one row have in common."""

    particles: int
    diameter: float
    tolerance: float
    solver: str
    force: float


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
    Column("random force", lambda row: as_short(row.kind.force)),
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
            "the paper does not state. While the spheres are agitated the count is made with the "
            "larger tolerance."
        ),
    ]
    return Content(blocks, [_compared(row) for row in rows if _is_as_in_the_paper(row.kind, data)])


def _agitated(data: Data) -> list[Result]:
    """Return the runs of the deck's own time step and drag whose agitation was measured."""
    usual = deck_defaults(SPHERES)
    results = [
        result
        for study in ("table-1", "table-2", "protocol")
        for result in data.results(study)
        if is_agitated(result)
        and all(result.variables.get(name) == usual.get(name) for name in ("dt", "drag"))
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
        result.setting("random_force"),
    )


def _drop(group: Sequence[Result]) -> Sample:
    return sample(COORDINATION_NUMBER.of(r) - AGITATED_COORDINATION_NUMBER.of(r) for r in group)


def _is_as_in_the_paper(kind: _Kind, data: Data) -> bool:
    return (
        kind.solver == our_solver()
        and kind.tolerance == data.usual_tolerance
        and kind.force == deck_defaults(SPHERES).get("random_force")
    )


def _compared(row: _Row) -> Comparison:
    return Comparison(
        f"z at rest less z while agitated, {as_count(row.kind.particles)} spheres",
        Stated(STATED_DROP),
        row.drop,
        2,
        "",
        f"the paper says about {as_short(STATED_DROP)}, and not how strong its random force is",
        "it depends on that, and on the number of spheres: see the section on it",
    )
