"""The paper's Figure 12: the packing fraction of dimers near a wall."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..blocks import Block, Content, Text
from ..columns import Column, table
from ..data import Data, profiles
from ..figures import Figure, Panel, curve
from ..statistics import FloatArray, MeanCurve, mean_curve, root_mean_square_difference
from ..text import as_text
from .aspect_ratios import by_aspect, listed, name_of


@dataclass(frozen=True)
class _Row:
    """A curve beside that of spheres.

    Attributes
    ----------
    label : the name of the curve
    runs : number of runs
    apart : root mean square difference from the curve of spheres
    minimum, maximum : places of the first minimum and of the maximum after it, diameters
    """

    label: str
    runs: int
    apart: float
    minimum: float
    maximum: float


COLUMNS: Sequence[Column[_Row]] = (
    Column("curve", lambda row: row.label),
    Column("runs", lambda row: row.runs),
    Column("root mean square difference in φ", lambda row: as_text(row.apart, 4)),
    Column("first minimum", lambda row: as_text(row.minimum, 2), "d"),
    Column("second maximum", lambda row: as_text(row.maximum, 2), "d"),
)


def dimer_wall(data: Data) -> Content:
    """Show the wall profiles of dimers beside that of spheres."""
    groups = listed(data, by_aspect(data))
    found = {aspect: curves for aspect, group in groups.items() if (curves := profiles(group))}
    if not found:
        return Content()
    means = {aspect: mean_curve(curves) for aspect, curves in found.items()}
    blocks: list[Block] = [
        Figure(
            "figure-12",
            "Packing fraction in slabs at the distance of their middle from the wall x = 0, "
            "over the diameter of a sphere; bands: one standard error over the runs.",
            [
                Panel(
                    "distance from the wall / d",
                    "packing fraction",
                    [curve(name_of(a), *mean, kind="profile") for a, mean in means.items()],
                )
            ],
        )
    ]
    if 1.0 in means:
        rows = [
            _Row(name_of(aspect), len(found[aspect]), apart, *_turns(*means[aspect][:2]))
            for aspect, apart in _apart_from_spheres(means).items()
        ]
        blocks.append(table("How near each curve is to that of spheres", COLUMNS, rows))
    blocks.append(
        Text(
            "Paper: near L/d = 1 the curve is that of spheres with a larger period; in between "
            "only the first period is clear; near 2 it is very close to that of spheres again. "
            + _nearest_to_spheres(means)
        )
    )
    return Content(blocks)


def _apart_from_spheres(means: Mapping[float, MeanCurve]) -> dict[float, float]:
    """Return the root mean square difference of each curve from that of spheres."""
    spheres = means[1.0][:2]
    return {
        aspect: root_mean_square_difference(spheres, mean[:2]) for aspect, mean in means.items()
    }


def _turns(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return the x of the first minimum and of the maximum after it; the wall itself is none."""
    top = int(np.argmax(y[: max(1, int(np.searchsorted(x, 1.0)))]))
    falls = np.flatnonzero(np.diff(y[top:]) > 0)
    if len(falls) == 0:
        return math.nan, math.nan
    low = top + int(falls[0])
    rises = np.flatnonzero(np.diff(y[low:]) < 0)
    high = float(x[low + int(rises[0])]) if len(rises) else math.nan
    return float(x[low]), high


def _nearest_to_spheres(means: Mapping[float, MeanCurve]) -> str:
    if 1.0 not in means or 1.95 not in means or len(means) < 3:
        return ""
    apart = {a: distance for a, distance in _apart_from_spheres(means).items() if a > 1}
    order = sorted(apart, key=lambda aspect: apart[aspect])
    return f"Ours, from the nearest to spheres: {', '.join(map(name_of, order))}."
