"""The paper's Figure 11: the packing fraction of dimers, with and without their necks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...store import Result
from ..blocks import Content, Text
from ..columns import RUNS, Column, table
from ..data import Data
from ..figures import Curve, Figure, Panel, curve
from ..groups import count_of
from ..quantities import PACKING_FRACTION, PACKING_FRACTION_WITH_NECKS
from ..statistics import Sample, peak, pooled_numbers
from ..text import as_count, as_measured, as_sample, as_short, as_text
from .aspect_ratios import POOLED, ByAspect, against_aspect, by_aspect, cell_of


@dataclass(frozen=True)
class _Row:
    """The runs of one aspect ratio, and their packing fractions with the pooled scatter."""

    aspect: float
    group: Sequence[Result]
    phi: Sample
    with_necks: Sample


COLUMNS: Sequence[Column[_Row]] = (
    Column("L/d", lambda row: cell_of(row.aspect)),
    RUNS,
    Column("φ", lambda row: as_sample(row.phi.scaled(100), 2), "%"),
    Column("φ with necks", lambda row: as_sample(row.with_necks.scaled(100), 2), "%"),
)


def dimer_packing_fraction(data: Data) -> Content:
    """Show the packing fraction against the aspect ratio, and where it is largest."""
    groups = by_aspect(data)
    if not groups:
        return Content()
    raw = against_aspect("raw", groups, PACKING_FRACTION)
    necks = against_aspect("with necks", groups, PACKING_FRACTION_WITH_NECKS)
    elsewhere = data.paper["elsewhere"]
    stated = data.paper["dimers"]["phi_peak_at_aspect_ratio"]
    said = "; ".join(_largest(one) for one in (raw, necks) if len(one.x) > 4)
    return Content(
        [
            Figure(
                "figure-11",
                "Packing fraction against aspect ratio, "
                f"{as_count(count_of(list(groups.values())[-1]))} "
                "particles; with necks: the volume at the waist that no sphere can reach counts as "
                "solid. Spheres at L/d = 1. Grey: largest packing fractions from mean-field theory "
                "(Baule et al. 2013); ellipsoids (Donev et al. 2004): largest, at its aspect "
                "ratio.",
                [_panel([raw, necks] if len(necks.x) else [raw], elsewhere)],
            ),
            table("Packing fraction against aspect ratio", COLUMNS, _rows(groups), (POOLED,)),
            Text(
                f"Paper: φ grows, and falls above about L/d = {stated}; the curve with necks looks "
                f"alike and lies higher. Ours: {said or 'too few aspect ratios'}. "
                f"Elsewhere: {elsewhere['baule2013']['source']}; "
                f"{elsewhere['donev2004']['source']}."
            ),
        ]
    )


def _rows(groups: ByAspect) -> list[_Row]:
    phi = pooled_numbers(groups, PACKING_FRACTION.name)
    with_necks = pooled_numbers(groups, PACKING_FRACTION_WITH_NECKS.name)
    return [
        _Row(aspect, group, phi[aspect], with_necks[aspect]) for aspect, group in groups.items()
    ]


def _panel(ours: Sequence[Curve], elsewhere: Mapping[str, Any]) -> Panel:
    """Return our curves with the largest packing fractions that others found."""
    theory, ellipsoids = elsewhere["baule2013"], elsewhere["donev2004"]
    of_ellipsoids = curve(
        "ellipsoids (Donev 2004)",
        [ellipsoids["ellipsoids_peak_aspect_ratio"]],
        [ellipsoids["ellipsoids_largest_phi"]],
        kind="apart",
    )
    return Panel(
        "aspect ratio L/d",
        "packing fraction",
        [*ours, of_ellipsoids],
        references=[
            ("dimers, theory", theory["dimers_largest_phi"]),
            ("spherocylinders, theory", theory["spherocylinders_largest_phi"]),
        ],
    )


def _largest(one: Curve) -> str:
    """Say where a curve is largest: at one of its points, and by two parabolas."""
    return (
        f"{one.label}, largest φ at L/d = {as_short(float(one.x[np.argmax(one.y)]))} "
        f"({as_text(100 * float(one.y.max()), 2)} %), by a parabola through it and one "
        f"neighbour to either side at {_top(one, 1)}, through two at {_top(one, 2)}"
    )


def _top(one: Curve, reach: int) -> str:
    """Write where a curve is largest, with its standard error; see `peak`."""
    errors = [math.nan] * len(one.x) if one.error is None else one.error.tolist()
    place, error = peak(one.x.tolist(), one.y.tolist(), errors, reach)
    return as_measured(place, error, 2)
