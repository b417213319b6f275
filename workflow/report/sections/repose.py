"""The angle of repose of a bed without friction: what slope is left when gravity is tilted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...results.store import Result
from ..blocks import Content, Text
from ..columns import RUNS, Column, table
from ..data import Data
from ..figures import Figure, Panel, points
from ..groups import by_value, count_of, grouped
from ..statistics import Sample, pooled, sample
from ..text import as_count, as_mean, as_sample, as_short

# A bed that was tilted by less than this may not have moved at all [degrees].
FLOWED = 10.0


@dataclass(frozen=True)
class _Row:
    """The runs of one tilt, and the angle between the surface and the horizontal, in degrees."""

    angle: float
    group: Sequence[Result]
    slope: Sample

    @property
    def left(self) -> Sample:
        """The angle that the surface keeps to the horizontal of the tilted gravity."""
        return Sample(
            self.angle - self.slope.mean, self.slope.std, self.slope.n, self.slope.freedom
        )


COLUMNS: Sequence[Column[_Row]] = (
    Column("gravity tilted by", lambda row: as_short(row.angle), "°"),
    RUNS,
    Column("surface turned by", lambda row: as_sample(row.slope, 2), "°"),
    Column("left", lambda row: as_sample(row.left, 2), "°"),
)


def repose(data: Data) -> Content:
    """Show by how much the surface of a bed lags behind the gravity that was tilted."""
    results = [r for r in data.results("repose") if not math.isnan(r.number("centre_x"))]
    if not results:
        return Content()
    width = float(data.paper["protocol"]["container"][0])
    groups = sorted(grouped(results, by_value("angle")).items())
    turned = {angle: sample(_turned(r, width) for r in group) for angle, group in groups}
    # Where the bed flows the slopes of two runs differ by ten times as much.
    slopes = {
        angle: one
        for flows in (False, True)
        for angle, one in pooled(
            {angle: one for angle, one in turned.items() if (angle > FLOWED) == flows}
        ).items()
    }
    rows = [_Row(angle, group, slopes[angle]) for angle, group in groups]
    mean = _left_where_it_flowed(results, width)
    return Content(
        [
            Figure(
                "repose",
                f"Angle by which the surface of a bed of {as_count(count_of(results))} spheres has "
                "turned when gravity was tilted and the bed has come to rest.",
                [
                    Panel(
                        "gravity tilted by [°]",
                        "surface turned by [°]",
                        [
                            points("bed", [row.angle for row in rows], [r.slope for r in rows]),
                            points(
                                "a liquid",
                                [row.angle for row in rows],
                                [Sample(row.angle, math.nan, 1) for row in rows],
                            ),
                        ],
                    )
                ],
            ),
            table(
                "Slope after a tilt",
                COLUMNS,
                rows,
                (
                    "From the mean position of all spheres: a bed between the side walls, of mean "
                    "height H and with a plane surface of slope s, has its centre s W² / (12 H) "
                    "off the middle; the slope before the tilt is taken off. Mean ± standard "
                    f"deviation (standard error), pooled below and above {as_short(FLOWED)}°.",
                ),
            ),
            Text(
                "Spheres without friction still have an angle of repose: the surface stays behind "
                f"by {as_mean(mean, 1)}° where the bed has flowed ({mean.n} beds), an upper bound: "
                "it still creeps when the run ends. Peyneau and Roux (Phys. Rev. E "
                "78 (2008) 011307) found an angle of internal friction of 5.8 ± 0.2° for "
                "assemblies of such spheres under slow shear."
            ),
        ]
    )


def _left_where_it_flowed(results: Sequence[Result], width: float) -> Sample:
    """Return the angle that is left, in the mean over the tilts at which each bed has flowed.

    The tilts of one bed begin with the same packing: they are one value.
    """
    beds: dict[Any, list[float]] = {}
    for result in results:
        angle = result.setting("angle")
        if angle > FLOWED:
            beds.setdefault(result.variables.get("seed"), []).append(angle - _turned(result, width))
    return sample(sum(left) / len(left) for left in beds.values())


def _turned(result: Result, width: float) -> float:
    """Return the angle by which the surface has turned, in degrees."""
    return _slope(result, width) - (0.0 if result.before is None else _slope(result.before, width))


def _slope(result: Result, width: float) -> float:
    """Return the angle of the surface to the horizontal, from the mean position, in degrees.

    With y = H + s (x - W/2) the centre of what lies below is at x = W/2 + s W^2 / (12 H) and at
    y = H/2 + s^2 W^2 / (24 H), from which s and H follow.
    """
    off = result.number("centre_x") - width / 2
    height = 2 * result.number("centre_y")
    slope = 0.0
    for _ in range(50):
        slope = 12 * height * off / width**2
        height = result.number("centre_y") + math.sqrt(
            max(result.number("centre_y") ** 2 - (slope * width) ** 2 / 12, 0.0)
        )
    return math.degrees(math.atan(slope))
