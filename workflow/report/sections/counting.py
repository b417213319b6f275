"""How the number of contacts at the loosest tolerance of Table 1 depends on the time step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...store import Result
from ..blocks import Comparison, Content, Text
from ..columns import RUNS, Column, table
from ..data import RUNS_OF_TABLE_1, Data
from ..groups import count_of, grouped, is_agitated, matching, solver_of
from ..quantities import COORDINATION_NUMBER, MEAN_RESOLUTION, PACKING_FRACTION, compared
from ..statistics import Stated, difference
from ..text import as_count, as_difference, as_mean, as_probability, as_short

STEPS = ("dt", "dt_resting", "dt_measuring")


@dataclass(frozen=True)
class _Row:
    """The runs of one solver and of the same time steps in each phase.

    Attributes
    ----------
    steps : time steps while agitated, while at rest, and while contacts are counted
    solver : as the deck names it
    group : the runs
    z : their coordination number beside the paper's
    """

    steps: tuple[float, ...]
    solver: str
    group: Sequence[Result]
    z: Comparison

    @property
    def is_of_one_step(self) -> bool:
        """Whether all phases have the same time step, as in the paper."""
        return len(set(self.steps)) == 1


Z: Sequence[Column[_Row]] = compared(COORDINATION_NUMBER, lambda row: row.z)
COLUMNS: Sequence[Column[_Row]] = (
    Column("h", lambda row: as_short(row.steps[0])),
    Column("h at rest", lambda row: as_short(row.steps[1])),
    Column("h of the count", lambda row: as_short(row.steps[2])),
    Column("solver", lambda row: row.solver),
    RUNS,
    PACKING_FRACTION.column(),
    *Z,
    MEAN_RESOLUTION,
)


def counting(data: Data) -> Content:
    """Compare the paper's row of the loosest tolerance with runs of several time steps."""
    rows = _rows(data)
    if not rows:
        return Content()
    loosest = _loosest(data)["eps_over_r"]
    return Content(
        [
            table(
                f"{as_count(count_of(rows[0].group))} spheres, contacts counted at "
                f"{as_short(loosest)} r",
                COLUMNS,
                rows,
                (
                    "Mean ± standard deviation (standard error). Difference from the paper's row "
                    f"of ε = {as_short(loosest)} r.",
                ),
            ),
            Text(
                "The deck rests and counts with longer steps than it shakes with. The paper names "
                "no time step, and no change of it. Packings have small gaps of every size, and a "
                "gap below ε may carry a force as a contact does: z is the larger, the more of "
                "them close within a step. A tighter ε leaves none: see Table 1."
            ),
        ]
    )


def cause(data: Data, solver: str) -> str:
    """Say what becomes of a difference in z at the loosest tolerance with one time step."""
    rows = [row for row in _rows(data) if row.is_of_one_step and row.solver == solver]
    if not rows:
        return "at a loose ε the count depends on the time step: see the study counting"
    parts = []
    for row in rows:
        apart = difference(row.z.ours, row.z.stated)
        parts.append(
            f"{as_mean(row.z.ours, 2)} with h = {as_short(row.steps[0])} "
            f"({as_difference(apart.in_errors)} SE, p {as_probability(apart.p)})"
        )
    return f"the time step of the count; with one step throughout: {', '.join(parts)}"


def _loosest(data: Data) -> Mapping[str, Any]:
    """Return the paper's row of the loosest tolerance, which has a random force."""
    shaken: list[Mapping[str, Any]] = [row for row in data.paper["table1"] if row["random_force"]]
    return max(shaken, key=lambda row: float(row["eps_over_r"]))


def _rows(data: Data) -> list[_Row]:
    """Return the rows, by solver and from the shortest step of the count to the longest."""
    stated = _loosest(data)
    of_paper = Stated.of_series(stated["z"]["mean"], stated["z"]["std"], RUNS_OF_TABLE_1)
    known = {
        result.case: result
        for study in ("counting", "table-1")
        for result in matching(data.results(study), tolerance=stated["eps_over_r"])
        if is_agitated(result)
    }
    if not data.results("counting"):
        return []
    groups = grouped(known.values(), lambda r: (solver_of(r), tuple(map(r.setting, STEPS[::-1]))))
    return [
        _Row(
            steps[::-1],
            solver,
            group,
            Comparison(
                "z",
                of_paper,
                COORDINATION_NUMBER.over(group),
                COORDINATION_NUMBER.decimals,
            ),
        )
        for (solver, steps), group in sorted(groups.items())
    ]
