"""How dimers lie: against the aspect ratio, and against the random force.

The root mean square a_x, a_y, a_z of the components of the vector between the two spheres of a
dimer is shown over its isotropic value, which it has if no direction is preferred.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...results.store import Result
from ..blocks import Block, Comparison, Content, Statement, Text
from ..columns import RUNS, Column, table
from ..data import Data
from ..figures import Curve, Figure, Panel, curve, points
from ..groups import by_size, by_value, grouped
from ..quantities import COORDINATION_NUMBER, PACKING_FRACTION
from ..statistics import (
    LEAST_FREEDOM,
    SIGNIFICANT,
    Difference,
    Sample,
    Stated,
    adjusted,
    difference,
    numbers,
    sample,
    slope,
)
from ..text import (
    DASH,
    as_count,
    as_mean,
    as_measured,
    as_probability,
    as_short,
    as_text,
)
from .aspect_ratios import shaken, true_dimers

AXES = "xyz"
# The paper's dimers are made of spheres of this diameter.
DIAMETER = 0.052
# From this aspect ratio on a dimer is so long that it matters how it lies.
LONG = 1.2
# Two components are the same that differ by less: those of the paper do by 0.009.
SAME = 0.02
# So much of the order that a start leaves without a random force counts as none.
REMEMBERED = 0.2


def ratio_over_isotropic(group: Sequence[Result], axis: str) -> Sample:
    """Return a_x, a_y or a_z over its isotropic value.

    Its standard error is that between the runs, or that which the number of dimers leaves if this
    is larger, or if there are only two: a few runs may agree by chance. The latter is known from
    many dimers, so that its degrees of freedom are unlimited.
    """
    known = [result for result in group if not math.isnan(result.number(f"a_{axis}"))]
    found = sample(result.number(f"a_{axis}") / result.number("a_isotropic") for result in known)
    if not known:
        return found
    of_dimers = _error_of_a_run(known, axis)
    if found.freedom >= LEAST_FREEDOM and found.std > of_dimers:
        return found
    return Sample(found.mean, of_dimers, found.n, math.inf)


def ratio_apart(group: Sequence[Result], axis: str, other: str) -> Difference:
    """Return the difference of two of the ratios a_x, a_y and a_z over isotropic.

    The components are not independent: their squares A_x, A_y and A_z add up to the square of the
    distance of the two centres. Of two of them and the third, l, therefore var(A_i - A_k) =
    2 var(A_i) + 2 var(A_k) - var(A_l). The standard error is that between the runs if it is larger.
    """
    (third,) = set(AXES) - {axis, other}
    found, from_dimers = [], []
    for result in group:
        a = {one: result.number(f"a_{one}") for one in AXES}
        squares = {one: (2 * a[one] * result.number(f"a_{one}_error")) ** 2 for one in AXES}
        variance = 2 * squares[axis] + 2 * squares[other] - squares[third]
        isotropic = result.number("a_isotropic")
        found.append((a[axis] - a[other]) / isotropic)
        from_dimers.append(
            math.sqrt(max(0.0, variance)) / (a[axis] + a[other]) / isotropic
            if not math.isnan(variance)
            else math.nan
        )
    between = sample(found)
    of_dimers = sample(from_dimers).mean
    if between.freedom >= LEAST_FREEDOM and between.std > of_dimers:
        return Difference(between.mean, between.error, between.freedom)
    return Difference(between.mean, of_dimers / math.sqrt(max(1, between.n)), math.inf)


def _error_of_a_run(group: Sequence[Result], axis: str) -> float:
    """Return the standard error of one run that comes from its number of dimers."""
    return numbers(group, f"a_{axis}_error").mean / numbers(group, "a_isotropic").mean


def _compared(
    stated: Mapping[str, Any], group: Sequence[Result], words: str = ""
) -> list[Comparison]:
    """Compare a_x, a_y and a_z with the paper's, of runs of the aspect ratio that it means."""
    consistent = stated["consistent_aspect_ratio"]
    return [
        Comparison(
            f"a_{axis} over isotropic, L/d = {as_short(consistent)}{words}",
            Stated(_stated_ratio(stated, axis), _error_of_a_run(group, axis)),
            ratio_over_isotropic(group, axis),
            3,
            "",
            f"paper prints L/d = {stated['stated_aspect_ratio']}; the numbers are those of "
            f"{consistent}; its error is taken to be that of one of our runs",
            "it depends on the random force: see the section on it",
        )
        for axis in AXES
    ]


def _stated_ratio(stated: Mapping[str, Any], axis: str) -> float:
    return float(stated[f"a_{axis}"] / stated["isotropic"])


@dataclass(frozen=True)
class _Orientation:
    """A row of the table against the aspect ratio: runs of ours, or the paper's numbers.

    Attributes
    ----------
    force : largest random acceleration, per direction; NaN of the paper
    value : the aspect ratio; NaN of the paper
    aspect : the aspect ratio, with what else is to be said of it
    group : runs of ours; none for the paper
    components : a_x, a_y, a_z, length
    isotropic : each of them where no direction is preferred, length
    ratios : a_x, a_y, a_z over that; the paper's are of no runs
    """

    force: float
    value: float
    aspect: str
    group: Sequence[Result]
    components: Mapping[str, float]
    isotropic: float
    ratios: Mapping[str, Sample]


@dataclass(frozen=True)
class _Agitated:
    """A row of the table against the random force: the runs of one size, start and force."""

    particles: float
    start: str
    force: float
    group: Sequence[Result]
    ratios: Mapping[str, Sample]


def _component_column(axis: str) -> Column[_Orientation]:
    return Column(f"a_{axis}", lambda row: as_text(row.components[axis], 4))


def _ratio_column(axis: str) -> Column[_Orientation | _Agitated]:
    def cell(row: _Orientation | _Agitated) -> str:
        ratio = row.ratios[axis]
        return as_mean(ratio, 3) if ratio.n else as_text(ratio.mean, 3)

    return Column(f"a_{axis} / isotropic", cell)


COLUMNS: Sequence[Column[_Orientation]] = (
    Column("random force", lambda row: as_short(row.force)),
    Column("L/d", lambda row: row.aspect),
    Column("runs", lambda row: len(row.group) or DASH),
    *(_component_column(axis) for axis in AXES),
    Column("isotropic", lambda row: as_text(row.isotropic, 4)),
    *(_ratio_column(axis) for axis in AXES),
)
AGITATED_COLUMNS: Sequence[Column[_Agitated]] = (
    Column("dimers", lambda row: as_count(row.particles)),
    Column("start", lambda row: row.start),
    Column("random force", lambda row: as_short(row.force)),
    RUNS,
    *(_ratio_column(axis) for axis in AXES),
    PACKING_FRACTION.column(),
    COORDINATION_NUMBER.column(),
)


def against_aspect(data: Data) -> Content:
    """Show the orientation of dimers against the aspect ratio, beside the paper's numbers."""
    stated = data.paper["dimers"]["anisotropy"]
    forces = {
        one.force: {
            aspect: group
            for aspect, group in true_dimers(one.groups).items()
            if not math.isnan(numbers(group, "a_isotropic").mean)
        }
        for one in shaken(data)
    }
    forces = {force: dimers for force, dimers in forces.items() if dimers}
    if not forces:
        return Content()
    consistent = stated["consistent_aspect_ratio"]
    rows = [
        _our_row(force, aspect, group)
        for force, dimers in forces.items()
        for aspect, group in dimers.items()
    ]
    blocks: list[Block] = [
        _figure(rows, stated),
        table(
            "Orientation of dimers in the box",
            COLUMNS,
            [*rows, _row_of_paper(stated)],
            (
                "± standard error: over the runs, or what the number of dimers leaves if that "
                "is larger.",
            ),
        ),
        _remark(stated),
    ]
    comparisons = [
        one
        for force, dimers in forces.items()
        if consistent in dimers
        for one in _compared(stated, dimers[consistent], f", random force {as_short(force)}")
    ]
    weakest = min(forces)
    return Content(
        blocks, comparisons, _statements([row for row in rows if row.force == weakest], weakest)
    )


def _figure(rows: Sequence[_Orientation], stated: Mapping[str, Any]) -> Figure:
    """Return a figure of the components against the aspect ratio, by the random force."""
    consistent = stated["consistent_aspect_ratio"]
    forces = list(dict.fromkeys(row.force for row in rows))
    return Figure(
        "anisotropy",
        "Root mean square of the components of the vector between the two spheres of a "
        "dimer, over what each would be if no direction was preferred, by the random force. y "
        f"is along gravity. The paper's numbers are those of L/d = {as_short(consistent)}.",
        [
            Panel(
                "aspect ratio L/d",
                "a / isotropic a",
                [
                    points(
                        f"a_{axis}",
                        [row.value for row in rows if row.force == force],
                        [row.ratios[axis] for row in rows if row.force == force],
                    )
                    for axis in AXES
                ]
                + [
                    curve(
                        f"a_{axis}, paper",
                        [consistent],
                        [_stated_ratio(stated, axis)],
                        kind="apart",
                    )
                    for axis in AXES
                ],
                references=[("isotropic", 1.0)],
                title=f"random force {as_short(force)}",
            )
            for force in forces
        ],
    )


def _remark(stated: Mapping[str, Any]) -> Text:
    """Return a remark on the aspect ratio of the paper's numbers."""
    consistent, printed = stated["consistent_aspect_ratio"], stated["stated_aspect_ratio"]
    return Text(
        "Paper: dimers lie down, a_y < a_x = a_z, and more so the longer they are. Its "
        f"four numbers are printed for L/d = {printed}, but a_x² + a_y² + a_z² is the "
        "square of the distance of the two centres, and theirs is that of L/d = "
        f"{consistent}: compare with that row. For {printed} the isotropic value is "
        f"{as_text((printed - 1) * DIAMETER / math.sqrt(3), 4)}, not "
        f"{as_text(stated['isotropic'], 4)}."
    )


def _statements(rows: Sequence[_Orientation], force: float) -> list[Statement]:
    """Say whether the dimers of one random force lie as the paper's do."""
    level = [ratio_apart(row.group, "x", "z") for row in rows]
    lying = [ratio_apart(row.group, "y", "x") for row in rows]
    if not rows or any(math.isnan(one.p) for one in (*level, *lying)):
        return []
    mean = Difference(
        sum(one.value for one in level) / len(level),
        math.hypot(*(one.error for one in level)) / len(level),
        math.inf,
    )
    alone = adjusted([one.p for one in level])
    most = min(range(len(rows)), key=lambda k: alone[k])
    down = adjusted([one.p for one in lying])
    long = [row for row in rows if row.value >= LONG]
    a_y = [row.ratios["y"] for row in long]
    lie = [
        one.value < 0 and p < SIGNIFICANT
        for row, one, p in zip(rows, lying, down, strict=True)
        if row.value >= LONG
    ]
    return [
        Statement(
            "a_x and a_z are the same.",
            mean.is_within(SAME),
            f"random force {as_short(force)}: a_x less a_z over isotropic is "
            f"{as_measured(mean.value, mean.error, 3)} in the mean over {len(rows)} aspect ratios; "
            f"the least probable alone is {as_measured(level[most].value, level[most].error, 3)} "
            f"at L/d = {rows[most].aspect} (p {as_probability(alone[most])}, Holm)",
        ),
        Statement(
            "a_y is smaller: dimers lie down.",
            all(lie) if long else None,
            f"a_y / isotropic: {as_text(min(one.mean for one in a_y), 3)} to "
            f"{as_text(max(one.mean for one in a_y), 3)} from L/d = {as_short(LONG)} on"
            if long
            else "",
        ),
        _statement_on_length([row.value for row in long], a_y),
    ]


def _statement_on_length(aspects: Sequence[float], a_y: Sequence[Sample]) -> Statement:
    """Say whether dimers lie down more the longer they are, up to the longest."""
    line, end = slope(aspects, a_y), slope(aspects, a_y, degree=2)
    holds: bool | None = None
    if end.is_significant and end.value > 0:
        holds = False
    elif line.is_significant:
        holds = line.value < 0
    return Statement(
        "They lie down more the longer they are.",
        holds,
        f"a_y / isotropic goes as {as_measured(line.value, line.error, 3)} times L/d from "
        f"{as_short(LONG)} on (p {as_probability(line.p)}), but by a parabola as "
        f"{as_measured(end.value, end.error, 2)} at the longest (p {as_probability(end.p)})"
        if not math.isnan(end.p)
        else "",
        "the longest lie down less again"
        if end.value > 0 and line.value < 0
        else "they lie down less the longer they are",
    )


def _ratios(group: Sequence[Result]) -> Mapping[str, Sample]:
    return {axis: ratio_over_isotropic(group, axis) for axis in AXES}


def _our_row(force: float, aspect: float, group: Sequence[Result]) -> _Orientation:
    return _Orientation(
        force,
        aspect,
        as_short(aspect),
        group,
        {axis: numbers(group, f"a_{axis}").mean for axis in AXES},
        numbers(group, "a_isotropic").mean,
        _ratios(group),
    )


def _row_of_paper(stated: Mapping[str, Any]) -> _Orientation:
    return _Orientation(
        math.nan,
        math.nan,
        f"paper, printed as {stated['stated_aspect_ratio']}",
        (),
        {axis: stated[f"a_{axis}"] for axis in AXES},
        stated["isotropic"],
        {axis: Sample(_stated_ratio(stated, axis), math.nan, 0) for axis in AXES},
    )


def against_force(data: Data) -> Content:
    """Show the orientation against the random force, which the paper does not state."""
    results = [r for r in data.results("dimers-agitation") if "random_force" in r.variables]
    if not results:
        return Content()
    stated = data.paper["dimers"]["anisotropy"]
    aspect = results[0].setting("aspect_ratio")
    rows = _agitated_rows(results)
    blocks: list[Block] = [
        Figure(
            "dimers-agitation",
            f"As above for L/d = {as_short(aspect)}, against the largest random acceleration "
            "of a sphere. Lines: the paper's numbers.",
            [
                Panel(
                    "random force [length/time²]",
                    "a / isotropic a",
                    _agitated_curves(rows),
                    references=[(f"a_{axis}, paper", _stated_ratio(stated, axis)) for axis in AXES],
                )
            ],
        ),
        table(
            "Orientation of dimers against the random force",
            AGITATED_COLUMNS,
            rows,
            ("± standard error; φ and z: mean ± standard deviation (standard error).",),
        ),
        Text(
            "The paper does not say how strong its random force is: compare where its numbers "
            "lie with how ours change."
        ),
    ]
    return Content(blocks, statements=_statements_on_starts(rows))


def _statements_on_starts(rows: Sequence[_Agitated]) -> list[Statement]:
    """Compare dimers that started in one orientation with those of a random start.

    The difference is that of the vertical component, on which the starts differ most, as a part of
    what is left of it where no force has acted.
    """
    forces = sorted({row.force for row in rows})
    if len(forces) < 2 or forces[0] > 0:
        return []
    still, shaken = (_regular_less_random(rows, force) for force in forces[:2])
    if still is None or shaken is None or not still.is_significant:
        return []
    part = Difference(shaken.value / still.value, shaken.error / abs(still.value), shaken.freedom)
    return [
        Statement(
            "Where the random force acts, dimers do not remember how they started.",
            part.is_within(REMEMBERED),
            f"random force {as_short(forces[1])}, regular less random start: a_y differs by "
            f"{as_measured(shaken.value, shaken.error, 3)}, which is "
            f"{as_measured(part.value, part.error, 2)} of what it differs by without the force "
            f"({as_measured(still.value, still.error, 3)}); up to {as_short(REMEMBERED)} of it "
            "counts as none",
        )
    ]


def _regular_less_random(rows: Sequence[_Agitated], force: float) -> Difference | None:
    """Return the difference of a_y / isotropic of two starts; None where one was not run."""
    a_y = {row.start: row.ratios["y"] for row in rows if row.force == force}
    if not {"regular", "random"} <= a_y.keys():
        return None
    return difference(a_y["regular"], a_y["random"])


def _agitated_rows(results: Iterable[Result]) -> list[_Agitated]:
    """Return a row for each size, start and random force, sizes and forces ascending."""
    return [
        _Agitated(particles, start, force, group, _ratios(group))
        for (particles, _), of_size in by_size(results).items()
        for start, of_start in grouped(of_size, lambda r: str(r.variables.get("start"))).items()
        for force, group in sorted(grouped(of_start, by_value("random_force")).items())
    ]


def _agitated_curves(rows: Sequence[_Agitated]) -> list[Curve]:
    """Return a curve for each size, start and axis."""
    kinds: dict[tuple[float, str], list[_Agitated]] = {}
    for row in rows:
        kinds.setdefault((row.particles, row.start), []).append(row)
    return [
        points(
            f"a_{axis}, {as_count(particles)} dimers, {start} start",
            [row.force for row in of_kind],
            [row.ratios[axis] for row in of_kind],
        )
        for (particles, start), of_kind in kinds.items()
        for axis in AXES
    ]
