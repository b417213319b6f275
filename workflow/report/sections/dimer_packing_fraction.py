"""The paper's Figure 11: the packing fraction of dimers, with and without their necks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..blocks import Content, Statement, Text
from ..columns import Column, table
from ..curves import top
from ..data import Data
from ..figures import Curve, Figure, Panel, curve
from ..groups import count_of
from ..quantities import PACKING_FRACTION, PACKING_FRACTION_WITH_NECKS, Quantity
from ..statistics import Difference, all_hold
from ..text import as_count, as_measured, as_sample, as_short, as_span
from .aspect_ratios import HEAD, POOLED, Row, against_aspect, rows_of, shaken

# Dimers are densest between these aspect ratios, whatever shakes them.
AROUND = 1.2, 1.6
# The paper says "about", with one decimal.
ABOUT = 0.1
QUANTITIES = (PACKING_FRACTION, PACKING_FRACTION_WITH_NECKS)


def _column(quantity: Quantity) -> Column[Row]:
    def cell(row: Row) -> str:
        return as_sample(row.numbers[quantity.name], quantity.decimals)

    return Column(quantity.heading, cell, quantity.unit)


COLUMNS: Sequence[Column[Row]] = (*HEAD, *map(_column, QUANTITIES))


def dimer_packing_fraction(data: Data) -> Content:
    """Show the packing fraction against the aspect ratio, and where it is largest."""
    forces = shaken(data)
    if not forces:
        return Content()
    raw = against_aspect(forces, PACKING_FRACTION, "raw, {force}")
    necks = against_aspect(forces, PACKING_FRACTION_WITH_NECKS, "with necks, {force}")
    curves = [*raw, *necks]
    elsewhere = data.paper["elsewhere"]
    stated = data.paper["dimers"]["phi_peak_at_aspect_ratio"]
    said = "; ".join(f"{_top(one)} ({one.label})" for one in curves if _is_known(one))
    particles = count_of(list(forces[0].groups.values())[-1])
    return Content(
        [
            Figure(
                "figure-11",
                f"Packing fraction against aspect ratio, {as_count(particles)} particles, by the "
                "random force that has shaken them; with necks: the volume at the waist that no "
                "sphere can reach counts as solid. Spheres at L/d = 1. Grey: largest packing "
                "fractions from mean-field theory (Baule et al. 2013); ellipsoids (Donev et al. "
                "2004): largest, at its aspect ratio.",
                [_panel(curves, elsewhere, stated)],
            ),
            table(
                "Packing fraction against aspect ratio",
                COLUMNS,
                rows_of(forces, QUANTITIES),
                (POOLED,),
            ),
            Text(
                f"Paper: φ grows, and falls above about L/d = {stated}; the curve with necks looks "
                f"alike and lies higher. Ours is largest, by a cubic through L/d = "
                f"{as_short(AROUND[0])} to {as_short(AROUND[1])}, at "
                f"{said or 'a place that too few aspect ratios tell'}. "
                f"Elsewhere: {elsewhere['baule2013']['source']}; "
                f"{elsewhere['donev2004']['source']}."
            ),
        ],
        statements=_statements(raw, necks, stated),
    )


def _statements(raw: Sequence[Curve], necks: Sequence[Curve], stated: float) -> list[Statement]:
    """Say whether φ grows up to about the paper's aspect ratio and falls from there."""
    said = f"The packing fraction grows with L/d and falls above about {as_short(stated)}."
    alike = "With the volume of the necks the curve is qualitatively the same."
    places = as_span([_place(one)[0] for one in raw if _is_known(one)], 2)
    return [
        Statement(
            said,
            all_hold(_turns_at(one, stated) for one in raw),
            _tops(raw),
            f"largest at L/d = {places}, not at about {as_short(stated)}" if places else "",
        ),
        Statement(alike, all_hold(_rises_and_falls(one, stated) for one in necks), _tops(necks)),
    ]


def _is_known(one: Curve) -> bool:
    return not math.isnan(_place(one)[0])


def _rises_and_falls(one: Curve, stated: float) -> bool | None:
    """Say whether a curve has a top; not known where little was run beyond the paper's place."""
    if _is_known(one):
        return True
    enough = len(one.x) > 4 and np.sum(one.x >= stated) > 1
    return False if enough and np.argmax(one.y) in (0, len(one.y) - 1) else None


def _turns_at(one: Curve, stated: float) -> bool | None:
    """Say whether a curve has its top where the paper says, which is as good as its one decimal."""
    if not _is_known(one):
        return _rises_and_falls(one, stated)
    place, error = _place(one)
    return Difference(place - stated, error, math.inf).is_within(ABOUT)


def _place(one: Curve) -> tuple[float, float]:
    """Return where a curve is largest, and the standard error of that; see `top`."""
    near = (one.x >= AROUND[0]) & (one.x <= AROUND[1])
    errors = np.full(len(one.x), math.nan) if one.error is None else one.error
    return top(one.x[near].tolist(), one.y[near].tolist(), errors[near].tolist())


def _tops(curves: Sequence[Curve]) -> str:
    return "; ".join(f"{one.label}: largest at {_top(one)}" for one in curves if _is_known(one))


def _panel(ours: Sequence[Curve], elsewhere: Mapping[str, Any], stated: float) -> Panel:
    """Return our curves with the largest packing fractions that others found."""
    theory, ellipsoids = elsewhere["baule2013"], elsewhere["donev2004"]
    of_ellipsoids = curve(
        "ellipsoids (Donev 2004)",
        [ellipsoids["ellipsoids_peak_aspect_ratio"]],
        [PACKING_FRACTION.factor * ellipsoids["ellipsoids_largest_phi"]],
        kind="apart",
    )
    return Panel(
        "aspect ratio L/d",
        "packing fraction [%]",
        [*ours, of_ellipsoids],
        moments=[("paper: falls above", stated)],
        references=[
            (name, PACKING_FRACTION.factor * theory[f"{key}_largest_phi"])
            for name, key in (
                ("dimers, theory", "dimers"),
                ("spherocylinders, theory", "spherocylinders"),
            )
        ],
    )


def _top(one: Curve) -> str:
    return as_measured(*_place(one), 2)
