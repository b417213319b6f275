"""The study of dimers by aspect ratio and random force: what its sections share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...store import Result
from ..columns import RUNS, Column
from ..data import SPHERES, Data
from ..figures import Curve, Kind, points
from ..groups import grouped
from ..quantities import Quantity
from ..statistics import FEW, Sample, pooled_numbers
from ..text import DASH, as_short

# This note stands below tables with few runs a row.
POOLED = (
    "Mean ± standard deviation (standard error); the standard deviation of rows of fewer than "
    f"{FEW} runs is that of all rows, pooled."
)
ByAspect = Mapping[float, Sequence[Result]]


@dataclass(frozen=True)
class Shaken:
    """The dimers that one random force has shaken.

    Attributes
    ----------
    force : largest random acceleration, per direction
    groups : the runs by aspect ratio; spheres, which have their own force, at 1
    """

    force: float
    groups: ByAspect

    @property
    def label(self) -> str:
        """The name of the force in legends."""
        return f"force {as_short(self.force)}"

    def kept(self, groups: ByAspect) -> Shaken:
        """Return the same with some of the groups."""
        return Shaken(self.force, groups)


@dataclass(frozen=True)
class Row:
    """The runs of one aspect ratio and random force, and numbers of theirs with pooled scatter.

    Attributes
    ----------
    aspect, force : of the runs; spheres have an aspect ratio of 1
    group : the runs
    numbers : samples by the names of the quantities
    """

    aspect: float
    force: float
    group: Sequence[Result]
    numbers: Mapping[str, Sample]


FORCE: Column[Row] = Column(
    "random force", lambda row: as_short(row.force) if row.aspect > 1 else DASH
)
ASPECT: Column[Row] = Column("L/d", lambda row: cell_of(row.aspect))
HEAD: Sequence[Column[Row]] = (FORCE, ASPECT, RUNS)


def shaken(data: Data) -> list[Shaken]:
    """Return the study of dimers by random force, the weakest first; none if nothing was run.

    The weakest is compared with the paper, whose dimers lie as ours do with it.
    """
    known = [result for result in data.results("dimers") if not math.isnan(_aspect(result))]
    spheres = [result for result in known if _aspect(result) == 1]
    dimers = [result for result in known if _aspect(result) > 1]
    by_force = grouped(dimers, lambda result: result.setting("random_force", 0.0))
    found = []
    for force, results in sorted(by_force.items()):
        groups = dict(sorted(grouped(results, _aspect).items()))
        found.append(Shaken(force, ({1.0: spheres} if spheres else {}) | groups))
    return found or ([Shaken(0.0, {1.0: spheres})] if spheres else [])


def _aspect(result: Result) -> float:
    return 1.0 if result.record["deck"] == SPHERES else result.setting("aspect_ratio")


def rows_of(forces: Sequence[Shaken], quantities: Sequence[Quantity]) -> list[Row]:
    """Return a row for each force and aspect ratio, spheres once; the scatter is that of all."""
    groups = {
        (one.force, aspect): group
        for number, one in enumerate(forces)
        for aspect, group in one.groups.items()
        if aspect > 1 or number == 0
    }
    found = {quantity.name: pooled_numbers(groups, quantity.name) for quantity in quantities}
    return [
        Row(
            aspect,
            force,
            group,
            {
                quantity.name: found[quantity.name][force, aspect].scaled(quantity.factor)
                for quantity in quantities
            },
        )
        for (force, aspect), group in groups.items()
    ]


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
