"""The paper's Figure 6: the packing fraction of spheres near a wall, and Mueller's formula."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from lammps_inelastic.analysis import mueller_packing_fraction

from ...results.store import Result
from ..blocks import Content, Statement, Table, Text
from ..columns import Column, table
from ..curves import (
    MeanCurve,
    mean_curve,
    root_mean_square_difference,
    scatter_of_difference,
)
from ..data import Data, profiles
from ..figures import Curve, Figure, Panel, curve
from ..groups import by_size, is_agitated, matching
from ..text import as_count, as_runs, as_short, as_text

# Mueller's formula is for cylinders of at least so many diameters.
NARROWEST = 2.02
# Curves are one if their difference, less what the scatter of the runs makes of it, is a smaller
# part of their oscillation.
COLLAPSED = 0.1


@dataclass(frozen=True, eq=False)
class _Profile:
    """The mean wall profile of the runs of one size.

    Attributes
    ----------
    label : number of spheres, diameter and number of runs
    mean : distance over the diameter, packing fraction, its standard error
    width : width of the container over the diameter
    """

    label: str
    mean: MeanCurve
    width: float

    def apart_from(self, other: _Profile) -> float:
        """Return the root mean square difference from another profile."""
        return root_mean_square_difference(self.mean[:2], other.mean[:2])

    def scatter_with(self, other: _Profile) -> float:
        """Return the root mean square difference that the scatter of the runs alone would make."""
        return scatter_of_difference(self.mean, other.mean)

    def oscillation_beside(self, other: _Profile) -> float:
        """Return the standard deviation of φ as far from the wall as both profiles reach."""
        x, y, _ = self.mean
        return float(np.std(y[x <= other.mean[0][-1]]))

    def apart_from_mueller(self, width: float | None) -> float:
        """Return the root mean square difference from Mueller's formula for a width over d.

        It is NaN for a width for which there is no formula; None is an infinite width.
        """
        if width is not None and width < NARROWEST:
            return math.nan
        x, y, _ = self.mean
        return float(np.sqrt(np.mean((y - mueller_packing_fraction(x, width)) ** 2)))


PAIR_COLUMNS: Sequence[Column[tuple[_Profile, _Profile]]] = (
    Column("curve", lambda pair: pair[0].label),
    Column("and curve", lambda pair: pair[1].label),
    Column("up to", lambda pair: as_text(min(float(one.mean[0][-1]) for one in pair), 2), "d"),
    Column(
        "root mean square difference in φ", lambda pair: as_text(pair[0].apart_from(pair[1]), 4)
    ),
    Column("by scatter alone", lambda pair: as_text(pair[0].scatter_with(pair[1]), 4)),
)
MUELLER_COLUMNS: Sequence[Column[_Profile]] = (
    Column("curve", lambda one: one.label),
    Column("infinite width", lambda one: as_text(one.apart_from_mueller(None), 4)),
    Column("D / d", lambda one: as_short(one.width)),
    Column("of this width", lambda one: as_text(one.apart_from_mueller(one.width), 4)),
)


def sphere_wall(data: Data) -> Content:
    """Show the wall profiles of spheres of several diameters beside Mueller's formula."""
    width = float(data.paper["protocol"]["container"][0])
    means = _means(_results(data), width)
    if not means:
        return Content()
    return Content(
        [
            Figure(
                "figure-6",
                "Packing fraction in slabs at the distance of their middle from the wall x = 0, "
                "over the diameter; bands: one standard error over the runs. Mueller (1992): "
                "empirical, for cylinders; the narrow one is that whose width over d is the "
                "container's for the largest spheres.",
                [Panel("distance from the wall / d", "packing fraction", _curves(means))],
            ),
            _collapse_table(means),
            table(
                "Root mean square difference in φ from Mueller's formula",
                MUELLER_COLUMNS,
                means,
                (
                    "The constants of the formula could not be compared with Mueller's article: "
                    "see mueller_packing_fraction in analysis/profile.py.",
                ),
            ),
            Text(
                "Paper: a damped oscillation; the curves of the three diameters collapse; "
                "Mueller's formula for infinite width agrees, the one for finite width less so. "
            ),
        ],
        statements=_statements(means),
    )


def _results(data: Data) -> list[Result]:
    results = [r for r in data.results("table-2") if "profile/distance" in r.values]
    if not matching(results, diameter=0.11):
        # The study of Table 1 has the same cases.
        more = matching(data.results("table-1"), diameter=0.11, tolerance=data.usual_tolerance)
        results += [result for result in more if is_agitated(result)]
    return results


def _means(results: Sequence[Result], width: float) -> list[_Profile]:
    """Return the mean profile of each size, from few spheres to many."""
    found = {size: profiles(group) for size, group in by_size(results).items()}
    return [
        _Profile(
            f"d = {as_short(diameter)} ({as_count(particles)} spheres, {as_runs(len(curves))})",
            mean_curve(curves),
            width / diameter,
        )
        for (particles, diameter), curves in found.items()
        if curves
    ]


def _curves(means: Sequence[_Profile]) -> list[Curve]:
    """Return the profiles and Mueller's formula for an infinite and for the smallest width."""
    along = np.linspace(0, max(float(one.mean[0][-1]) for one in means), 400)
    curves = [curve(one.label, *one.mean, kind="profile") for one in means]
    curves.append(curve("Mueller, infinite width", along, mueller_packing_fraction(along)))
    narrow = min(one.width for one in means)
    if narrow >= NARROWEST:
        curves.append(
            curve(
                f"Mueller, D = {as_short(narrow)} d",
                along,
                mueller_packing_fraction(along, narrow),
            )
        )
    return curves


def _collapse_table(means: Sequence[_Profile]) -> Table:
    return table(
        "Do the curves collapse?",
        PAIR_COLUMNS,
        combinations(means, 2),
        ("By scatter alone: what the standard errors over the runs would make of it.",),
    )


def _statements(means: Sequence[_Profile]) -> list[Statement]:
    """Say whether the curves collapse, and which of Mueller's formulas is nearer."""
    found = []
    pairs = list(combinations(means, 2))
    if pairs:
        apart = [(one.apart_from(other), one.scatter_with(other)) for one, other in pairs]
        left = [math.sqrt(max(0.0, whole**2 - chance**2)) for whole, chance in apart]
        waves = [one.oscillation_beside(other) for one, other in pairs]
        differences = ", ".join(
            f"{as_text(whole, 3)} ({as_text(chance, 3)})" for whole, chance in apart
        )
        found.append(
            Statement(
                "The packing fraction oscillates near a wall, and the curves of several diameters "
                "collapse.",
                all(one < COLLAPSED * wave for one, wave in zip(left, waves, strict=True)),
                f"root mean square differences (by scatter alone) {differences}; oscillations "
                f"{as_text(min(waves), 3)} to {as_text(max(waves), 3)}",
            )
        )
    wide = [one for one in means if one.width >= NARROWEST]
    if wide:
        nearer = [one.apart_from_mueller(None) < one.apart_from_mueller(one.width) for one in wide]
        found.append(
            Statement(
                "Mueller's formula for an infinite width agrees better than that for the width.",
                all(nearer),
                f"it is nearer for {sum(nearer)} of {len(nearer)} diameters",
            )
        )
    return found
