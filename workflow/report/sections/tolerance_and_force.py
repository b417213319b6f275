"""The paper's Table 1: spheres with several tolerances, with and without a random force."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...results.store import Result
from .. import verdict
from ..blocks import Comparison, Content, Statement, Table
from ..columns import RUNS, RUNS_OF_PAPER, Column, table
from ..data import RUNS_OF_TABLE_1, Data
from ..figures import Curve, Figure, Panel, curve, points
from ..groups import (
    count_of,
    grouped,
    is_agitated,
    matching,
    solver_of,
    unlike,
)
from ..quantities import (
    COORDINATION_NUMBER,
    MEAN_RESOLUTION,
    PACKING_FRACTION,
    Quantity,
    compared,
)
from ..statistics import (
    SIGNIFICANT,
    Difference,
    Stated,
    adjusted,
    all_hold,
    difference,
    paired_difference,
)
from ..text import as_count, as_mean, as_measured, as_probability, as_short, as_text
from .counting import cause, counted_at_its_own

# The paper's rows are of so many spheres.
SPHERES_OF_PAPER = 1000
# This is why a packing fraction of nine runs of 1,000 spheres may be far from ours.
CHANCE = "chance in few runs: see Table 1 with more seeds"
# Rows that the paper does not have hold this in place of its number.
NOTHING_STATED = Stated(math.nan)


@dataclass(frozen=True)
class _Row:
    """The runs of one tolerance, random force and solver.

    Attributes
    ----------
    tolerance : the allowed overlap over the radius
    force : `yes` or `no` in rows of the paper, else the largest random acceleration
    solver : as the deck names it
    group : the runs; none for a row of the paper that has not been run
    phi, z : packing fraction in % and coordination number, with those of the paper
    """

    tolerance: float
    force: str
    solver: str
    group: Sequence[Result]
    phi: Comparison
    z: Comparison


TOLERANCE: Column[_Row] = Column("ε / r", lambda row: as_short(row.tolerance))
FORCE: Column[_Row] = Column("random force", lambda row: row.force)
PHI: Sequence[Column[_Row]] = compared(PACKING_FRACTION, lambda row: row.phi)
Z: Sequence[Column[_Row]] = compared(COORDINATION_NUMBER, lambda row: row.z)
COLUMNS: Sequence[Column[_Row]] = (
    TOLERANCE,
    FORCE,
    Column("solver", lambda row: row.solver),
    RUNS_OF_PAPER,
    *PHI,
    *Z,
    MEAN_RESOLUTION,
)
COLUMNS_OF_MORE_SEEDS: Sequence[Column[_Row]] = (TOLERANCE, FORCE, RUNS, *PHI, *Z)


def tolerance_and_force(data: Data) -> Content:
    """Compare packing fraction and coordination number with the paper's Table 1."""
    results = data.results("table-1")
    of_paper = _rows_of_paper(data, results)
    more = _rows_of_more_seeds(data)
    tables: list[Table] = []
    if results:
        rows = [*of_paper, *_other_rows(results, of_paper)]
        tables.append(_table(data, results, rows))
    if more:
        tables.append(
            table(
                "The same with more seeds",
                COLUMNS_OF_MORE_SEEDS,
                more,
                ("The runs of the table above are among these.",),
            )
        )
    run = [row for row in (*of_paper, *more) if row.group]
    return Content(
        [*_figure(data, more or of_paper), *tables],
        [one for row in run for one in (row.phi, row.z)],
        [
            *_statements_on_force(more),
            # With the more seeds, where they have as many tolerances.
            *(_statements_on_tolerance(data, more) or _statements_on_tolerance(data, of_paper)),
        ],
    )


def _figure(data: Data, rows: Sequence[_Row]) -> list[Figure]:
    """Return both numbers of our solver against the tolerance beside the paper's."""
    known = [row for row in rows if row.group and row.solver == data.our_solver]
    forces = {"yes": "random force", "no": "no random force"}
    kinds = [([r for r in known if r.force == force], words) for force, words in forces.items()]
    if not known:
        return []
    return [
        Figure(
            "table-1",
            "Packing fraction and coordination number against the tolerance; error bars: standard "
            "error.",
            [
                Panel(
                    "ε / r",
                    label,
                    [
                        one
                        for of_kind, words in kinds
                        if of_kind
                        for one in _pair(of_kind, words, [number(row) for row in of_kind])
                    ],
                    log_x=True,
                )
                for label, number in (
                    ("packing fraction [%]", _phi),
                    ("coordination number", _z),
                )
            ],
        )
    ]


def _phi(row: _Row) -> Comparison:
    return row.phi


def _z(row: _Row) -> Comparison:
    return row.z


def _pair(rows: Sequence[_Row], words: str, compared: Sequence[Comparison]) -> list[Curve]:
    """Return our curve of some rows, and the paper's points."""
    places = [row.tolerance for row in rows]
    return [
        points(f"ours, {words}", places, [one.ours for one in compared]),
        curve(
            f"paper, {words}",
            places,
            [one.stated.value for one in compared],
            [one.stated.error for one in compared],
            "apart",
        ),
    ]


def _statements_on_force(more: Sequence[_Row]) -> list[Statement]:
    """Compare the rows with many seeds: with the random force, and without."""
    still = next((row for row in more if row.force == "no"), None)
    if still is None:
        return []
    others = (row for row in more if row.force == "yes" and row.tolerance == still.tolerance)
    shaken = next(others, None)
    if shaken is None:
        return []
    phi = _of_pairs(still.group, shaken.group, PACKING_FRACTION)
    z = _of_pairs(still.group, shaken.group, COORDINATION_NUMBER)
    # What the paper could tell: two standard errors of the difference of its two numbers.
    reach = 2 * math.hypot(still.z.stated.error, shaken.z.stated.error)
    same = z.is_within(reach)
    return [
        Statement(
            "The packing fraction is smaller without random force (the paper: not significantly).",
            phi.value < 0 if phi.is_significant else None,
            f"by {as_measured(-phi.value, phi.error, 2)} percentage points, "
            f"p {as_probability(phi.p)}, {len(still.group)} and {len(shaken.group)} runs, in pairs "
            "from the same start",
            topic=verdict.PACKING_FRACTION,
        ),
        Statement(
            "At rest, the coordination number is the same with and without random force.",
            same,
            f"without less with, in pairs from the same start: {as_measured(z.value, z.error, 3)} "
            f"(p {as_probability(z.p)})"
            + (f", within the ± {as_text(reach, 2)} of the paper's own errors" if same else ""),
            topic=verdict.CONTACTS,
        ),
    ]


def _of_pairs(one: Sequence[Result], other: Sequence[Result], quantity: Quantity) -> Difference:
    """Return the mean difference of runs with the same seed, which have the same start."""
    return paired_difference(
        *({r.variables.get("seed"): quantity.of(r) for r in group} for group in (one, other))
    )


def _statements_on_tolerance(data: Data, rows: Sequence[_Row]) -> list[Statement]:
    """Compare the rows of our solver with random force, one tolerance with another."""
    known = sorted(
        (row for row in rows if row.group and row.force == "yes" and row.solver == data.our_solver),
        key=lambda row: row.tolerance,
    )
    if len(known) < 3:
        return []
    pairs = list(itertools.combinations(known, 2))
    apart = [difference(a.phi.ours, b.phi.ours) for a, b in pairs]
    corrected = adjusted([one.p for one in apart])
    largest = max(apart, key=lambda one: abs(one.value))
    # What the paper could tell: two standard errors of the difference of its two numbers.
    reach = max(2 * math.hypot(a.phi.stated.error, b.phi.stated.error) for a, b in pairs)
    within = [one.is_within(reach) for one in apart]
    return [
        Statement(
            f"From ε = {as_short(known[-1].tolerance)} r down the tolerance has a negligible "
            "effect on the packing fraction.",
            all_hold(within),
            f"the largest of {len(apart)} differences is "
            f"{as_measured(abs(largest.value), largest.error, 2)} percentage points (smallest p, "
            f"Holm: {as_probability(min(corrected))}); the paper's own errors tell ± "
            f"{as_text(reach, 2)}",
            topic=verdict.PACKING_FRACTION,
        ),
        *_statement_on_contacts(data, [row.tolerance for row in known]),
    ]


def _statement_on_contacts(data: Data, tolerances: Sequence[float]) -> list[Statement]:
    """Compare the coordination numbers of packings that are each counted at their own tolerance.

    The paper counts so. Our Table 1 counts at a tight one where it can.
    """
    tight, middle, loose = tolerances[0], tolerances[1], tolerances[-1]
    counted = counted_at_its_own(data)
    if not all(counted.get(one) for one in (tight, middle, loose)):
        return []
    z = {one: COORDINATION_NUMBER.over(counted[one]) for one in (tight, middle, loose)}
    close, far = difference(z[tight], z[middle]), difference(z[tight], z[loose])
    known = not (math.isnan(close.p) or math.isnan(far.p))
    return [
        Statement(
            f"For the coordination number ε = {as_short(middle)} r is needed.",
            far.is_significant and not close.is_significant if known else None,
            "each packing counted at its own ε: "
            + ", ".join(f"{as_mean(z[one], 3)} at {as_short(one)} r" for one in z),
            topic=verdict.CONTACTS,
        )
    ]


def _table(data: Data, results: Sequence[Result], rows: Sequence[_Row]) -> Table:
    count = count_of(results)
    return table(
        "1,000 spheres, d = 0.11; mean ± standard deviation (standard error of our mean)"
        if count == SPHERES_OF_PAPER
        else f"{as_count(count)} spheres; the paper has {as_count(SPHERES_OF_PAPER)}",
        COLUMNS,
        rows,
        (
            "SE: standard errors, sqrt(ours² + the paper's²); the paper's is its standard "
            f"deviation over the root of {RUNS_OF_TABLE_1} runs. Marked: p below {SIGNIFICANT}.",
            f"Solver: {data.paper_solver} is the paper's, {data.our_solver} ours. Within a loose ε "
            "they may leave different contacts.",
            "ε / (g h²), with ε that of the count, says how well a contact is told from a "
            "gap: in a step a free sphere falls g h². It should be at most 0.01; above it, "
            "what counts as a contact depends on ε.",
        ),
    )


def _rows_of_paper(data: Data, results: Sequence[Result]) -> list[_Row]:
    """Return a row for each row of the paper and solver; our solver's where nothing was run."""
    return [
        _row(data, stated, solver, group)
        for stated in data.paper["table1"]
        for solver, group in (
            grouped(_like(results, stated), solver_of) or {data.our_solver: []}
        ).items()
    ]


def _other_rows(results: Sequence[Result], of_paper: Sequence[_Row]) -> list[_Row]:
    """Return a row for each tolerance, random force and solver that the paper does not have."""
    seen = {result.case for row in of_paper for result in row.group}
    others = [result for result in results if result.case not in seen]
    groups = grouped(
        others, lambda r: (r.setting("tolerance"), r.setting("random_force"), solver_of(r))
    )
    return [
        _Row(
            tolerance,
            as_short(force),
            solver,
            group,
            Comparison("φ", NOTHING_STATED, PACKING_FRACTION.over(group), 2),
            Comparison("z", NOTHING_STATED, COORDINATION_NUMBER.over(group), 3),
        )
        for (tolerance, force, solver), group in groups.items()
    ]


def _rows_of_more_seeds(data: Data) -> list[_Row]:
    """Compare rows of the paper's Table 1 with more runs of our own than it has."""
    results = data.results("more-seeds")
    return [
        _row(data, stated, data.our_solver, group, more_seeds=True)
        for stated in data.paper["table1"]
        if (group := _like(results, stated))
    ]


def _like(results: Sequence[Result], stated: Mapping[str, Any]) -> list[Result]:
    """Return the results with the tolerance and the random force of a row of Table 1."""
    return [
        result
        for result in matching(results, tolerance=stated["eps_over_r"])
        if is_agitated(result) == stated["random_force"]
    ]


def _counted(group: Sequence[Result]) -> str:
    """Say at which tolerance contacts were counted, if that is not the packing's own."""
    found = {(r.setting("tolerance"), r.setting("tolerance_measuring")) for r in group}
    others = {at for own, at in found if not math.isnan(at) and at != own}
    return f"counted at {as_short(min(others))} r" if others else ""


def _loosest(data: Data) -> float:
    return float(max(row["eps_over_r"] for row in data.paper["table1"]))


def _row(
    data: Data,
    stated: Mapping[str, Any],
    solver: str,
    group: Sequence[Result],
    more_seeds: bool = False,
) -> _Row:
    """Compare packing fraction and coordination number with a row of the paper's Table 1."""
    place = f"ε = {as_short(stated['eps_over_r'])} r"
    words = f"{place}, {'with' if stated['random_force'] else 'no'} random force"
    if solver != data.our_solver:
        words += f", {solver}"
    if more_seeds:
        words += f", {len(group)} seeds"
    phi, z = stated["phi_percent"], stated["z"]
    note = unlike(group, SPHERES_OF_PAPER, 0 if more_seeds else RUNS_OF_TABLE_1)
    of_z = "; ".join(text for text in (note, _counted(group)) if text)
    return _Row(
        stated["eps_over_r"],
        "yes" if stated["random_force"] else "no",
        solver,
        group,
        Comparison(
            f"φ, {words}",
            Stated.of_series(phi["mean"], phi["std"], RUNS_OF_TABLE_1),
            PACKING_FRACTION.over(group),
            PACKING_FRACTION.decimals,
            PACKING_FRACTION.unit,
            note,
            "" if more_seeds else CHANCE,
            verdict.PACKING_FRACTION,
            place,
        ),
        Comparison(
            f"z, {words}",
            Stated.of_series(z["mean"], z["std"], RUNS_OF_TABLE_1),
            COORDINATION_NUMBER.over(group),
            COORDINATION_NUMBER.decimals,
            COORDINATION_NUMBER.unit,
            of_z,
            cause(data, solver) if stated["eps_over_r"] == _loosest(data) else "",
            verdict.CONTACTS,
            place,
        ),
    )
