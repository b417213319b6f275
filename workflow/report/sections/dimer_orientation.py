"""How dimers lie: against the aspect ratio, and against the random force.

The root mean square a_x, a_y, a_z of the components of the vector between the two spheres of a
dimer is shown over its isotropic value, which it has if no direction is preferred.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...store import Result
from ..blocks import Block, Comparison, Content, Text
from ..columns import RUNS, Column, table
from ..data import Data
from ..figures import Curve, Figure, Panel, points
from ..groups import by_size, by_value, grouped
from ..quantities import COORDINATION_NUMBER, PACKING_FRACTION
from ..statistics import Sample, Stated, numbers, sample
from ..text import DASH, as_count, as_mean, as_short, as_text
from .aspect_ratios import by_aspect

AXES = "xyz"
# The paper's dimers are made of spheres of this diameter.
DIAMETER = 0.052


def ratio_over_isotropic(group: Sequence[Result], axis: str) -> Sample:
    """Return a_x, a_y or a_z over its isotropic value.

    Its standard error is that between the runs, or that which the number of dimers leaves if this
    is larger: two runs may agree by chance.
    """
    known = [result for result in group if not math.isnan(result.number(f"a_{axis}"))]
    found = sample(result.number(f"a_{axis}") / result.number("a_isotropic") for result in known)
    if not known:
        return found
    of_dimers = _error_of_a_run(known, axis)
    std = of_dimers if math.isnan(found.std) else max(found.std, of_dimers)
    return Sample(found.mean, std, found.n)


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
    aspect : the aspect ratio, with what else is to be said of it
    runs : how many runs of ours; None for the paper
    components : a_x, a_y, a_z, length
    isotropic : each of them where no direction is preferred, length
    ratios : a_x, a_y, a_z over that; the paper's are of no runs
    """

    aspect: str
    runs: int | None
    components: Mapping[str, float]
    isotropic: float
    ratios: Mapping[str, Sample]


@dataclass(frozen=True)
class _Agitated:
    """A row of the table against the random force: the runs of one size and force."""

    particles: float
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
    Column("L/d", lambda row: row.aspect),
    Column("runs", lambda row: DASH if row.runs is None else row.runs),
    *(_component_column(axis) for axis in AXES),
    Column("isotropic", lambda row: as_text(row.isotropic, 4)),
    *(_ratio_column(axis) for axis in AXES),
)
AGITATED_COLUMNS: Sequence[Column[_Agitated]] = (
    Column("dimers", lambda row: as_count(row.particles)),
    Column("random force", lambda row: as_short(row.force)),
    RUNS,
    *(_ratio_column(axis) for axis in AXES),
    PACKING_FRACTION.column(),
    COORDINATION_NUMBER.column(),
)


def against_aspect(data: Data) -> Content:
    """Show the orientation of dimers against the aspect ratio, beside the paper's numbers."""
    stated = data.paper["dimers"]["anisotropy"]
    dimers = {
        aspect: group
        for aspect, group in by_aspect(data).items()
        if not math.isnan(numbers(group, "a_isotropic").mean)
    }
    if not dimers:
        return Content()
    consistent, printed = stated["consistent_aspect_ratio"], stated["stated_aspect_ratio"]
    ratios = {aspect: _ratios(group) for aspect, group in dimers.items()}
    curves = [
        points(f"a_{axis}", list(ratios), [of_axes[axis] for of_axes in ratios.values()])
        for axis in AXES
    ]
    blocks: list[Block] = [
        Figure(
            "anisotropy",
            "Root mean square of the components of the vector between the two spheres of a "
            "dimer, over what each would be if no direction was preferred. y is along gravity.",
            [Panel("aspect ratio L/d", "a / isotropic a", curves, references=[("isotropic", 1.0)])],
        ),
        table(
            "Orientation of dimers in the box",
            COLUMNS,
            [
                *(_our_row(aspect, group, ratios[aspect]) for aspect, group in dimers.items()),
                _row_of_paper(stated),
            ],
            (
                "± standard error: over the runs, or what the number of dimers leaves if that "
                "is larger.",
            ),
        ),
        Text(
            "Paper: dimers lie down, a_y < a_x = a_z, and more so the longer they are. Its "
            f"four numbers are printed for L/d = {printed}, but a_x² + a_y² + a_z² is the "
            "square of the distance of the two centres, and theirs is that of L/d = "
            f"{consistent}: compare with that row. For {printed} the isotropic value is "
            f"{as_text((printed - 1) * DIAMETER / math.sqrt(3), 4)}, not "
            f"{as_text(stated['isotropic'], 4)}."
        ),
    ]
    same = dimers.get(consistent)
    return Content(blocks, _compared(stated, same) if same else ())


def _ratios(group: Sequence[Result]) -> Mapping[str, Sample]:
    return {axis: ratio_over_isotropic(group, axis) for axis in AXES}


def _our_row(aspect: float, group: Sequence[Result], ratios: Mapping[str, Sample]) -> _Orientation:
    return _Orientation(
        as_short(aspect),
        len(group),
        {axis: numbers(group, f"a_{axis}").mean for axis in AXES},
        numbers(group, "a_isotropic").mean,
        ratios,
    )


def _row_of_paper(stated: Mapping[str, Any]) -> _Orientation:
    return _Orientation(
        f"paper, printed as {stated['stated_aspect_ratio']}",
        None,
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
    as_in_the_paper = [
        row
        for row in rows
        if row.particles == data.paper["dimers"]["count"]
        and aspect == stated["consistent_aspect_ratio"]
    ]
    blocks: list[Block] = [
        Figure(
            "dimers-agitation",
            f"As above for L/d = {as_short(aspect)}, against the largest random acceleration "
            "of a sphere. Lines: the paper's numbers.",
            [
                Panel(
                    "random force",
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
    return Content(
        blocks,
        [
            one
            for row in as_in_the_paper
            for one in _compared(stated, row.group, f", random force {as_short(row.force)}")
        ],
    )


def _agitated_rows(results: Iterable[Result]) -> list[_Agitated]:
    """Return a row for each size and random force, both ascending."""
    return [
        _Agitated(particles, force, group, _ratios(group))
        for (particles, _), of_size in by_size(results).items()
        for force, group in sorted(grouped(of_size, by_value("random_force")).items())
    ]


def _agitated_curves(rows: Sequence[_Agitated]) -> list[Curve]:
    """Return a curve for each size and axis."""
    sizes: dict[float, list[_Agitated]] = {}
    for row in rows:
        sizes.setdefault(row.particles, []).append(row)
    return [
        points(
            f"a_{axis}, {as_count(particles)} dimers",
            [row.force for row in of_size],
            [row.ratios[axis] for row in of_size],
        )
        for particles, of_size in sizes.items()
        for axis in AXES
    ]
