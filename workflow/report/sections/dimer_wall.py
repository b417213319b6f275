"""The paper's Figure 12: the packing fraction of dimers near a wall."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..blocks import Block, Content, Statement, Text
from ..columns import Column, table
from ..curves import FloatArray, MeanCurve, mean_curve, root_mean_square_difference
from ..data import Data, profiles
from ..figures import Figure, Panel, curve
from ..text import DASH, as_short, as_text
from .aspect_ratios import listed, name_of, shaken


@dataclass(frozen=True)
class _Row:
    """A curve beside that of spheres.

    Attributes
    ----------
    force : largest random acceleration, per direction
    aspect : aspect ratio; 1 of spheres
    runs : number of runs
    apart : root mean square difference from the curve of spheres
    minimum, maximum : places of the first minimum and of the maximum after it, diameters
    """

    force: float
    aspect: float
    runs: int
    apart: float
    minimum: float
    maximum: float


COLUMNS: Sequence[Column[_Row]] = (
    Column("random force", lambda row: as_short(row.force) if row.aspect > 1 else DASH),
    Column("curve", lambda row: name_of(row.aspect)),
    Column("runs", lambda row: row.runs),
    Column("root mean square difference in φ", lambda row: as_text(row.apart, 4)),
    Column("first minimum", lambda row: as_text(row.minimum, 2), "d"),
    Column("second maximum", lambda row: as_text(row.maximum, 2), "d"),
)


def dimer_wall(data: Data) -> Content:
    """Show the wall profiles of dimers beside that of spheres."""
    means = {}
    for one in shaken(data):
        groups = listed(data, one.groups)
        found = {aspect: curves for aspect, group in groups.items() if (curves := profiles(group))}
        if found:
            means[one.force] = {a: (mean_curve(curves), len(curves)) for a, curves in found.items()}
    if not means:
        return Content()
    blocks: list[Block] = [
        Figure(
            "figure-12",
            "Packing fraction in slabs at the distance of their middle from the wall x = 0, "
            "over the diameter of a sphere, by the random force; bands: one standard error over "
            "the runs.",
            [
                Panel(
                    "distance from the wall / d",
                    "packing fraction",
                    [curve(name_of(a), *mean, kind="profile") for a, (mean, _) in of_force.items()],
                    title=f"random force {as_short(force)}",
                )
                for force, of_force in means.items()
            ],
        )
    ]
    rows = [
        row
        for number, (force, of_force) in enumerate(means.items())
        for row in _rows(force, of_force)
        if row.aspect > 1 or number == 0  # the same spheres stand beside the dimers of each force
    ]
    if rows:
        blocks.append(table("How near each curve is to that of spheres", COLUMNS, rows))
    blocks.append(
        Text(
            "Paper: near L/d = 1 the curve is that of spheres with a larger period; in between "
            "only the first period is clear; near 2 it is very close to that of spheres again."
        )
    )
    return Content(blocks, statements=_statements(rows))


def _rows(force: float, means: Mapping[float, tuple[MeanCurve, int]]) -> list[_Row]:
    """Return a row for each curve, if there is one of spheres."""
    if 1.0 not in means:
        return []
    apart = _apart_from_spheres({aspect: mean for aspect, (mean, _) in means.items()})
    return [
        _Row(force, aspect, runs, apart[aspect], *_turns(*mean[:2]))
        for aspect, (mean, runs) in means.items()
    ]


def _statements(rows: Sequence[_Row]) -> list[Statement]:
    """Compare the curves of the weakest force with that of spheres."""
    weakest = {row.aspect: row for row in rows if row.force == rows[0].force}
    apart = {aspect: row.apart for aspect, row in weakest.items() if aspect > 1}
    if len(apart) < 3:
        return []
    evidence = "root mean square difference from spheres: " + ", ".join(
        f"{as_text(value, 3)} at {as_short(aspect)}" for aspect, value in apart.items()
    )
    longest, shortest = weakest[max(apart)], weakest[min(apart)]
    spheres = weakest.get(1.0)
    periods = None if spheres is None else (spheres.maximum, shortest.maximum)
    return [
        Statement(
            "Near a wall, dimers of L/d close to 2 pack very much as spheres do.",
            apart[longest.aspect] == min(apart.values()),
            evidence,
        ),
        Statement(
            "Dimers of L/d close to 1 do so, too, with a larger period.",
            None if periods is None else periods[1] > periods[0],
            ""
            if periods is None
            else f"second maximum at {as_text(periods[1], 2)} d for {as_short(shortest.aspect)}, "
            f"at {as_text(periods[0], 2)} d for spheres",
        ),
    ]


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
