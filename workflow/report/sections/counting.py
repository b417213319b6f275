"""How the number of contacts at the loosest tolerance of Table 1 depends on the way to count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...results.store import Result
from ..blocks import Comparison, Content, Text
from ..columns import RUNS, Column, table
from ..data import RUNS_OF_TABLE_1, SPHERES, Data, deck_defaults
from ..groups import (
    by_value,
    count_of,
    grouped,
    is_agitated,
    matching,
    solver_of,
)
from ..quantities import COORDINATION_NUMBER, MEAN_RESOLUTION, PACKING_FRACTION, compared
from ..statistics import Stated
from ..text import as_count, as_mean, as_short

STEPS = ("dt", "dt_resting", "dt_measuring")


@dataclass(frozen=True)
class _Row:
    """The runs of one solver, of the same time steps in each phase, and of one way to count.

    Attributes
    ----------
    steps : time steps while agitated, while at rest, and while contacts are counted
    counted_at : tolerance with which contacts are counted, over the radius
    solver : as the deck names it
    group : the runs
    z : their coordination number beside the paper's
    """

    steps: tuple[float, ...]
    counted_at: float
    solver: str
    group: Sequence[Result]
    z: Comparison

    @property
    def is_of_one_step(self) -> bool:
        """Whether all phases have the same time step."""
        return len(set(self.steps)) == 1

    @property
    def is_tight(self) -> bool:
        """Whether contacts were counted at a tighter tolerance than that of the packing."""
        return self.counted_at < self.group[0].setting("tolerance")


Z: Sequence[Column[_Row]] = compared(COORDINATION_NUMBER, lambda row: row.z)
COLUMNS: Sequence[Column[_Row]] = (
    Column("h", lambda row: as_short(row.steps[0])),
    Column("h at rest", lambda row: as_short(row.steps[1])),
    Column("h of the count", lambda row: as_short(row.steps[2])),
    Column("ε of the count / r", lambda row: as_short(row.counted_at)),
    Column("solver", lambda row: row.solver),
    RUNS,
    PACKING_FRACTION.column(),
    *Z,
    MEAN_RESOLUTION,
)


def counting(data: Data) -> Content:
    """Compare the paper's row of the loosest tolerance with other ways to count its contacts."""
    rows = _rows(data)
    if not rows:
        return Content()
    loosest = as_short(_loosest(data)["eps_over_r"])
    return Content(
        [
            table(
                f"{as_count(count_of(rows[0].group))} spheres packed at {loosest} r",
                COLUMNS,
                rows,
                (
                    "Mean ± standard deviation (standard error). Difference from the paper's row "
                    f"of ε = {loosest} r.",
                ),
            ),
            Text(
                "Packings have small gaps of every size, and one below ε may carry a force as a "
                "contact does. How many of them do so when a step is solved is no property of the "
                "packing: it depends on the time step (the deck rests and counts with longer ones "
                "than it shakes with; the paper names none), on the solver, and on where it stops "
                "(measured in docs/measured/contacts.md). Counted at a tight ε the same packings "
                "have the coordination number of all others."
            ),
        ]
    )


def cause(data: Data, solver: str) -> str:
    """Say what becomes of the coordination number of the loosest tolerance, counted otherwise."""
    rows = _rows(data)
    if not rows:
        return "at a loose ε the count depends on how it is made: see the study counting"
    parts = [
        f"the packings counted at {as_short(row.counted_at)} r have {as_mean(row.z.ours, 2)}"
        for row in rows
        if row.is_tight
    ]
    same = [r for r in rows if r.is_of_one_step and not r.is_tight and r.solver == solver]
    if same:
        steps = ", ".join(as_short(row.steps[0]) for row in same)
        found = ", ".join(as_mean(row.z.ours, 2) for row in same)
        parts.append(f"with one time step throughout ({steps}) it is {found}")
    return "the way to count: " + "; ".join(parts)


def counted_at_its_own(data: Data) -> dict[float, list[Result]]:
    """Return the agitated runs of our solver whose contacts are counted at their own tolerance.

    They are those with the time steps of Table 1, by tolerance.
    """
    runs = {
        result.case: result
        for study in ("table-1", "counting")
        for result in data.results(study)
        if is_agitated(result) and solver_of(result) == data.our_solver
    }
    usual = _usual_steps(data)
    own = [
        r
        for r in runs.values()
        if r.setting("tolerance_measuring") == r.setting("tolerance") and _steps_of(r) == usual
    ]
    return grouped(own, by_value("tolerance"))


def _usual_steps(data: Data) -> tuple[float, ...]:
    """Return the time steps of most runs of Table 1; of today's deck where there are none."""
    found = Counter(map(_steps_of, data.results("table-1")))
    if found:
        return found.most_common(1)[0][0]
    return tuple(float(deck_defaults(SPHERES)[name]) for name in STEPS)


def _steps_of(result: Result) -> tuple[float, ...]:
    return tuple(map(result.setting, STEPS))


def _loosest(data: Data) -> Mapping[str, Any]:
    """Return the paper's row of the loosest tolerance, which has a random force."""
    shaken: list[Mapping[str, Any]] = [row for row in data.paper["table1"] if row["random_force"]]
    return max(shaken, key=lambda row: float(row["eps_over_r"]))


def _rows(data: Data) -> list[_Row]:
    """Return the rows, by solver, tolerance and time step of the count."""
    stated = _loosest(data)
    of_paper = Stated.of_series(stated["z"]["mean"], stated["z"]["std"], RUNS_OF_TABLE_1)
    if not data.results("counting"):
        return []
    known = {
        result.case: result
        for study in ("counting", "table-1")
        for result in matching(data.results(study), tolerance=stated["eps_over_r"])
        if is_agitated(result)
    }
    groups = grouped(
        known.values(),
        lambda r: (solver_of(r), r.setting("tolerance_measuring"), *map(r.setting, STEPS[::-1])),
    )
    return [
        _Row(
            tuple(steps[::-1]),
            counted_at,
            solver,
            group,
            Comparison(
                "z", of_paper, COORDINATION_NUMBER.over(group), COORDINATION_NUMBER.decimals
            ),
        )
        for (solver, counted_at, *steps), group in sorted(groups.items())
    ]
