"""The study of dimers by aspect ratio: what its sections share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ...store import Result
from ..data import SPHERES, Data
from ..figures import Curve, Kind, points
from ..groups import grouped
from ..quantities import Quantity
from ..statistics import pooled_numbers
from ..text import as_short

# This note stands below tables with few runs a row.
POOLED = (
    "Mean ± standard deviation (standard error); the standard deviation of rows of fewer than four "
    "runs is that of all rows, pooled."
)
ByAspect = Mapping[float, Sequence[Result]]


def by_aspect(data: Data) -> ByAspect:
    """Return the results of the study of dimers by aspect ratio; spheres at 1."""
    known = [result for result in data.results("dimers") if not math.isnan(_aspect(result))]
    return dict(sorted(grouped(known, _aspect).items()))


def _aspect(result: Result) -> float:
    return 1.0 if result.record["deck"] == SPHERES else result.setting("aspect_ratio")


def listed(data: Data, groups: ByAspect) -> ByAspect:
    """Return the aspect ratios that the paper's Figures 12 and 14 show."""
    wanted = data.paper["dimers"]["wall_profile_aspect_ratios"]
    return {aspect: group for aspect, group in groups.items() if aspect in wanted}


def true_dimers(groups: ByAspect) -> ByAspect:
    """Return the results without those of spheres."""
    return {aspect: group for aspect, group in groups.items() if aspect > 1}


def name_of(aspect: float) -> str:
    """Return the name of a curve."""
    return "spheres" if aspect == 1 else f"L/d = {as_short(aspect)}"


def cell_of(aspect: float) -> str:
    """Write an aspect ratio in a column of aspect ratios."""
    return as_short(aspect) if aspect > 1 else "1 (spheres)"


def against_aspect(
    label: str, groups: ByAspect, quantity: Quantity, kind: Kind = "points"
) -> Curve:
    """Return a number, as it is stored, against the aspect ratio, where it is known."""
    found = pooled_numbers(groups, quantity.name)
    known = {aspect: one for aspect, one in found.items() if one.n}
    return points(label, list(known), known.values(), kind)
