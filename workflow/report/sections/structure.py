"""Whether packings are random, and how their contact forces are distributed."""

from __future__ import annotations

import math
from collections.abc import Sequence

from lammps_inelastic.analysis.structure import MOST_CRYSTALLINE, Q6_OF_CRYSTALS

from ...results.store import Result
from ..blocks import Block, Cell, Content
from ..columns import RUNS, Column, LabelledRuns, table
from ..curves import FloatArray, mean_curve
from ..data import Data, curves_of
from ..figures import Curve, Figure, Panel, curve
from ..groups import by_size
from ..quantities import CRYSTALLINE, Q4, Q6
from ..statistics import numbers
from ..text import as_count, as_short
from .aspect_ratios import shaken

# The first peak of g(r) is cut off here: it is high and narrow, and says little.
HIGHEST_G = 4.0
# Dimers of these aspect ratios are shown beside spheres.
SHOWN_ASPECTS = (1.1, 1.5, 2.0)


def _verdict(case: LabelledRuns) -> Cell:
    crystallised = numbers(case.group, CRYSTALLINE.name).mean > MOST_CRYSTALLINE
    return Cell("crystallised" if crystallised else "not crystallised", marked=crystallised)


COLUMNS: Sequence[Column[LabelledRuns]] = (
    Column("packing", lambda case: case.label),
    RUNS,
    Q4.column(),
    Q6.column(),
    CRYSTALLINE.column(),
    Column("", _verdict),
)


def structure(data: Data) -> Content:
    """Show the radial distribution function and the order of the twelve nearest spheres."""
    cases = _cases(data)
    curves = [
        curve(case.label, *mean_curve(found)[:2])
        for case in cases
        if (found := _radial_distributions(case.group))
    ]
    blocks: list[Block] = []
    if curves:
        blocks.append(
            Figure(
                "structure",
                "Radial distribution function of the particles' centres in the box, mean over the "
                "runs; the first peak is cut off. A random packing of spheres has a split second "
                "peak, at about 1.73 and 2 d, and no peak at 1.41 d, as the densest crystals have.",
                [Panel("r / d", "g(r)", curves, references=[("no order", 1.0)], top=HIGHEST_G)],
            )
        )
    ordered = [case for case in cases if CRYSTALLINE.over(case.group).n]
    if ordered:
        crystals = ", ".join(f"{name} {value}" for name, value in Q6_OF_CRYSTALS.items())
        blocks.append(
            table(
                "Bond-orientational order of spheres, from their twelve nearest",
                COLUMNS,
                ordered,
                (
                    f"q6 of the densest crystals: {crystals}. Crystalline: spheres whose order "
                    "agrees with that of eight or more of their neighbours.",
                ),
            )
        )
    return Content(blocks)


def forces(data: Data) -> Content:
    """Show the probability density of the contact force over its mean."""
    curves = [
        _force_curve(case.label, found)
        for case in _cases(data)
        if (found := curves_of(case.group, "forces/ratio", "forces/density"))
    ]
    if not curves:
        return Content()
    return Content(
        [
            Figure(
                "forces",
                "Probability density of the contact force over its mean, contacts between "
                "particles of which at least one is in the box.",
                [Panel("f / ⟨f⟩", "P(f / ⟨f⟩)", curves, log=True)],
            )
        ]
    )


def _cases(data: Data) -> list[LabelledRuns]:
    """Return spheres by their number and dimers by aspect ratio."""
    spheres = [
        LabelledRuns(f"{as_count(particles)} spheres", group)
        for (particles, _), group in by_size(data.results("table-2", "table-1")).items()
    ]
    dimers = [
        LabelledRuns(f"dimers, L/d = {as_short(aspect)}", group)
        for one in shaken(data)[:1]
        for aspect, group in one.groups.items()
        if aspect in SHOWN_ASPECTS
    ]
    return [*spheres, *dimers]


def _radial_distributions(group: Sequence[Result]) -> list[tuple[FloatArray, FloatArray]]:
    """Return distances over the diameter and g(r), (b,) each, of those runs that have them."""
    return [
        (distance / result.setting("diameter"), g)
        for result in group
        if not math.isnan(result.setting("diameter"))
        for distance, g in curves_of(
            [result], "structure/distance", "structure/radial_distribution"
        )
    ]


def _force_curve(label: str, found: Sequence[tuple[FloatArray, FloatArray]]) -> Curve:
    x, mean, error = mean_curve(found)
    # An empty bin has no place on a logarithmic axis.
    filled = mean > 0
    return curve(label, x[filled], mean[filled], None if error is None else error[filled])
