"""Where dimers are densest: poured without a random force, with hard and with soft contacts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...results.store import Result
from ..blocks import Content, Text
from ..columns import RUNS, Column, table
from ..curves import top
from ..data import Data
from ..figures import Curve, Figure, Panel, points
from ..groups import by_value, count_of, grouped
from ..quantities import PACKING_FRACTION
from ..statistics import Sample, pooled_numbers
from ..text import as_count, as_measured, as_sample, as_short
from .aspect_ratios import POOLED, ByAspect, shaken

# The others found the densest dimers between these aspect ratios.
KURBAN_AND_BAULE = 1.4, 1.5


@dataclass(frozen=True)
class _Row:
    """The runs of one kind of contacts and aspect ratio, and their packing fraction in %."""

    contacts: str
    aspect: float
    group: Sequence[Result]
    phi: Sample


COLUMNS: Sequence[Column[_Row]] = (
    Column("contacts", lambda row: row.contacts),
    Column("L/d", lambda row: as_short(row.aspect)),
    RUNS,
    Column("φ", lambda row: as_sample(row.phi, PACKING_FRACTION.decimals), PACKING_FRACTION.unit),
)


def dimers_soft(data: Data) -> Content:
    """Show the packing fraction of dimers that were not shaken, with either kind of contacts."""
    results = [r for r in data.results("dimers-soft") if "contacts" in r.variables]
    if not results:
        return Content()
    groups = {
        (kind, aspect): group
        for kind, of_kind in grouped(results, lambda r: str(r.variables["contacts"])).items()
        for aspect, group in sorted(grouped(of_kind, by_value("aspect_ratio")).items())
    }
    found = pooled_numbers(groups, PACKING_FRACTION.name)
    rows = [
        _Row(*key, group, found[key].scaled(PACKING_FRACTION.factor))
        for key, group in groups.items()
    ]
    kinds = list(dict.fromkeys(row.contacts for row in rows))
    curves = [
        points(
            f"{kind} contacts, not shaken",
            [row.aspect for row in rows if row.contacts == kind],
            [row.phi for row in rows if row.contacts == kind],
        )
        for kind in kinds
    ]
    low, high = KURBAN_AND_BAULE
    return Content(
        [
            Figure(
                "dimers-soft",
                f"Packing fraction of {as_count(count_of(results))} dimers that fell from random "
                "places and were not shaken, with hard contacts and with LAMMPS's soft ones "
                "(gran/hooke, no friction), from the same starts.",
                [Panel("aspect ratio L/d", "packing fraction [%]", curves)],
            ),
            table("Packing fraction of dimers that were not shaken", COLUMNS, rows, (POOLED,)),
            Text(
                "Kurban and Baule (arXiv:2111.03538) poured dimers without friction in LAMMPS with "
                f"soft contacts, and found the densest at L/d = {as_short(low)} to "
                f"{as_short(high)}. A cubic through all points is highest at "
                + "; ".join(f"{_top(one)} ({one.label})" for one in curves)
                + "".join(
                    f"; {_top_of_shaken(one.label, curve)}"
                    for one in shaken(data)
                    if (curve := _near(one.groups, [row.aspect for row in rows])) is not None
                )
                + "."
            ),
        ]
    )


def _near(groups: ByAspect, aspects: Sequence[float]) -> Curve | None:
    """Return the packing fraction of shaken dimers at the same aspect ratios."""
    same = {aspect: groups[aspect] for aspect in dict.fromkeys(aspects) if aspect in groups}
    if len(same) < 3:
        return None
    found = pooled_numbers(same, PACKING_FRACTION.name)
    factor = PACKING_FRACTION.factor
    return points("", list(found), [one.scaled(factor) for one in found.values()])


def _top_of_shaken(label: str, one: Curve) -> str:
    return f"{_top(one)} (shaken by a {label})"


def _top(one: Curve) -> str:
    """Write where a cubic through all points is largest, with its standard error."""
    errors = [math.nan] * len(one.x) if one.error is None else one.error.tolist()
    place, error = top(one.x.tolist(), one.y.tolist(), errors)
    return "a place that cannot be told" if math.isnan(place) else as_measured(place, error, 2)
