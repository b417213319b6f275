"""The study of dimers by aspect ratio and random force: what its sections share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...results.store import Result
from ..columns import RUNS, Column
from ..data import SPHERES, Data
from ..figures import Curve, points
from ..groups import grouped
from ..quantities import (
    COORDINATION_NUMBER,
    COORDINATION_NUMBER_WITHOUT_RATTLERS,
    NEIGHBOURS,
    Quantity,
)
from ..statistics import FEW, Sample, pooled_numbers
from ..text import DASH, as_short

# This note stands below tables with few runs a row.
_FEW_RUNS = (
    "Mean ± standard deviation (standard error); the standard deviation of rows of fewer than "
    f"{FEW} runs is that of all rows"
)
POOLED = f"{_FEW_RUNS}, pooled."
# Contacts of dimers below this aspect ratio come in pairs that lie close together: they scatter as
# those of spheres do, which is less than half of what those of longer dimers do.
LONG = 1.1
POOLED_BY_KIND = (
    f"{_FEW_RUNS} of their kind, pooled: spheres, dimers below L/d = {LONG}, longer ones."
)
BY_KIND = (COORDINATION_NUMBER, COORDINATION_NUMBER_WITHOUT_RATTLERS, NEIGHBOURS)
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


def samples_of(
    forces: Sequence[Shaken], quantity: Quantity
) -> Mapping[tuple[float, float], Sample]:
    """Return a number as it is shown, by force and aspect ratio, with the scatter of all, pooled.

    That of contacts and neighbours is pooled by kind: see LONG.
    """
    by_kind: dict[str, dict[tuple[float, float], Sequence[Result]]] = {}
    for number, one in enumerate(forces):
        for aspect, group in one.groups.items():
            # The same spheres are in the groups of each force.
            if aspect > 1 or number == 0:
                kind = _kind(aspect) if quantity in BY_KIND else ""
                by_kind.setdefault(kind, {})[one.force, aspect] = group
    found = {
        key: one.scaled(quantity.factor)
        for groups in by_kind.values()
        for key, one in pooled_numbers(groups, quantity.name).items()
    }
    spheres = next((one for (_, aspect), one in found.items() if aspect == 1), None)
    if spheres is not None:
        found |= {(one.force, 1.0): spheres for one in forces}
    return found


def _kind(aspect: float) -> str:
    if aspect == 1:
        return "spheres"
    return "long" if aspect >= LONG else "short"


def rows_of(forces: Sequence[Shaken], quantities: Sequence[Quantity]) -> list[Row]:
    """Return a row for each force and aspect ratio, spheres once; see `samples_of`."""
    found = {quantity.name: samples_of(forces, quantity) for quantity in quantities}
    return [
        Row(aspect, one.force, group, {name: of[one.force, aspect] for name, of in found.items()})
        for number, one in enumerate(forces)
        for aspect, group in one.groups.items()
        if aspect > 1 or number == 0
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
    forces: Sequence[Shaken], quantity: Quantity, names: str = "{name}, {force}"
) -> list[Curve]:
    """Return for each force the curve of a number, as it is shown, where it is known.

    Parameters
    ----------
    forces : whose runs, spheres at an aspect ratio of 1
    quantity : the number
    names : of the curves, with the places {name} and {force}
    """
    found = samples_of(forces, quantity)
    curves = []
    for one in forces:
        known = {a: found[one.force, a] for a in one.groups if found[one.force, a].n}
        if known:
            label = names.format(name=quantity.heading, force=one.label)
            curves.append(points(label, list(known), known.values()))
    return curves
