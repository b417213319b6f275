"""The paper's Figure 11: the packing fraction of dimers, with and without their necks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..blocks import Content, Statement, Text
from ..columns import Column, table
from ..curves import peak
from ..data import Data
from ..figures import Curve, Figure, Panel, curve
from ..groups import count_of
from ..quantities import PACKING_FRACTION, PACKING_FRACTION_WITH_NECKS, Quantity
from ..text import as_count, as_measured, as_sample, as_short, as_text
from .aspect_ratios import HEAD, POOLED, Row, against_aspect, rows_of, shaken

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
    curves = [
        against_aspect(f"{name}, {one.label}", one.groups, quantity)
        for one in forces
        for name, quantity in zip(("raw", "with necks"), QUANTITIES, strict=True)
    ]
    curves = [one for one in curves if len(one.x)]
    elsewhere = data.paper["elsewhere"]
    stated = data.paper["dimers"]["phi_peak_at_aspect_ratio"]
    said = "; ".join(_largest(one) for one in curves if len(one.x) > 4)
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
                [_panel(curves, elsewhere)],
            ),
            table(
                "Packing fraction against aspect ratio",
                COLUMNS,
                rows_of(forces, QUANTITIES),
                (POOLED,),
            ),
            Text(
                f"Paper: φ grows, and falls above about L/d = {stated}; the curve with necks looks "
                f"alike and lies higher. Ours: {said or 'too few aspect ratios'}. "
                f"Elsewhere: {elsewhere['baule2013']['source']}; "
                f"{elsewhere['donev2004']['source']}."
            ),
        ],
        statements=_statements(curves, stated),
    )


def _statements(curves: Sequence[Curve], stated: float) -> list[Statement]:
    """Say whether φ grows up to some aspect ratio, and falls beyond the paper's."""
    known = [one for one in curves if len(one.x) > 4 and np.sum(one.x >= stated) > 1]
    raw = [one for one in known if one.label.startswith("raw")]
    necks = [one for one in known if not one.label.startswith("raw")]
    return [
        Statement(
            f"The packing fraction grows with L/d and falls above about {as_short(stated)}.",
            all(_rises_and_falls(one, stated) for one in raw) if raw else None,
            "; ".join(f"{one.label}: largest at {_top(one, 2)}" for one in raw),
        ),
        Statement(
            "With the volume of the necks the curve is qualitatively the same.",
            all(_rises_and_falls(one, stated) for one in necks) if necks else None,
            "; ".join(f"{one.label}: largest at {_top(one, 2)}" for one in necks),
        ),
    ]


def _rises_and_falls(one: Curve, stated: float) -> bool:
    """Say whether a curve is larger near the stated place than at either end, and falls beyond it.

    It falls if each value there is below the one before, or above it by no more than two standard
    errors of their difference.
    """
    best = float(one.y.max())
    ends = 0 < int(np.argmax(one.y)) < len(one.y) - 1
    errors = np.zeros(len(one.y)) if one.error is None else np.nan_to_num(one.error)
    beyond = np.flatnonzero(one.x >= stated)
    falls = all(
        one.y[j] - one.y[i] <= 2 * math.hypot(errors[i], errors[j])
        for i, j in itertools.pairwise(beyond)
    )
    return bool(ends and falls and one.y[beyond[-1]] < best)


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
