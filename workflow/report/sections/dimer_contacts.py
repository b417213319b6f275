"""The paper's Figures 13 and 14: contacts and neighbours of dimers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...results.store import Result
from ..blocks import Block, Cell, Comparison, Content, Statement, Text
from ..columns import RUNS, Column, table
from ..curves import FloatArray, mean_distribution
from ..data import Data, arrays_of
from ..figures import Curve, Figure, Panel, curve
from ..groups import by_value, grouped, unlike
from ..quantities import (
    COORDINATION_NUMBER,
    COORDINATION_NUMBER_WITHOUT_RATTLERS,
    MEAN_RESOLUTION,
    NEIGHBOURS,
    RATTLERS,
)
from ..statistics import SIGNIFICANT, Sample, Stated, adjusted, difference, numbers, sample
from ..text import DASH, as_mean, as_sample, as_short, as_text
from .aspect_ratios import (
    HEAD,
    POOLED_BY_KIND,
    Row,
    Shaken,
    against_aspect,
    listed,
    name_of,
    rows_of,
    shaken,
)

# The paper's two narrower distributions are perhaps those of these aspect ratios.
NARROW = 1.4, 1.6
SHOWN = (COORDINATION_NUMBER, NEIGHBOURS, COORDINATION_NUMBER_WITHOUT_RATTLERS)


def _is_outside(row: Row, stated: Stated) -> bool:
    """Say whether dimers have more or fewer contacts than the paper's range, beyond their error."""
    contacts = row.numbers[COORDINATION_NUMBER.name]
    margin = 0.0 if math.isnan(contacts.margin) else contacts.margin
    return row.aspect > 1 and abs(contacts.mean - stated.value) - margin > stated.error


def _columns(stated: Stated) -> Sequence[Column[Row]]:
    return (
        *HEAD,
        Column(
            "contacts z",
            lambda row: Cell(
                as_sample(row.numbers[COORDINATION_NUMBER.name], 3), marked=_is_outside(row, stated)
            ),
        ),
        Column("neighbours", lambda row: as_sample(row.numbers[NEIGHBOURS.name], 3)),
        MEAN_RESOLUTION,
        Column(
            RATTLERS.heading,
            lambda row: as_text(RATTLERS.over(row.group).mean, RATTLERS.decimals),
            RATTLERS.unit,
        ),
        Column(
            "z without rattlers",
            lambda row: as_sample(row.numbers[COORDINATION_NUMBER_WITHOUT_RATTLERS.name], 3),
        ),
    )


def contacts_and_neighbours(data: Data) -> Content:
    """Show contacts and neighbours of a particle against the aspect ratio."""
    forces = [
        one.kept({a: g for a, g in one.groups.items() if numbers(g, "coordination_number").n})
        for one in shaken(data)
    ]
    forces = [one for one in forces if one.groups]
    if not forces:
        return Content()
    stated = data.paper["dimers"]
    per_particle = stated["contacts_per_particle"]
    of_paper = Stated.of_range(per_particle["value"], per_particle["tolerance"])
    paper_range = f"{as_short(of_paper.value)} ± {as_short(of_paper.error)}"
    rows = rows_of(forces, SHOWN)
    most = max((row.numbers[NEIGHBOURS.name].mean for row in rows), default=math.nan)
    blocks: list[Block] = [
        Figure(
            "figure-13",
            "Contacts and neighbours of a particle against the aspect ratio, by the random force; "
            "several contacts with one neighbour count apart. Shaded: the paper's range for "
            "dimers.",
            [_panel(forces, of_paper, paper_range)],
        ),
        table(
            "Contacts and neighbours against aspect ratio",
            _columns(of_paper),
            rows,
            (
                f"{POOLED_BY_KIND} Marked: outside {paper_range} by more than the 95 % margin of "
                "ours. Near L/d = 1 the two contacts of a dimer with a neighbour lie close to one "
                "another, and only a tolerance well below ε = 0.005 (L/d - 1) r tells both.",
                "Rattlers: particles with fewer contacts than hold them in any direction (4 a "
                "sphere, 6 a dimer), taken out again and again.",
            ),
        ),
        Text(
            f"Paper: z = {paper_range} for every L/d above 1, twice the degrees of "
            "freedom, and 6 at L/d = 1: a jump. The number of neighbours grows from 6 without "
            f"a jump, falls again, and stays below {stated['neighbours_mean_below']}. Ours: at "
            f"most {as_text(most, 2)} neighbours in the mean."
        ),
    ]
    dimers = [row for row in rows if row.aspect > 1]
    return Content(
        blocks,
        _compared(dimers, of_paper, stated["count"]),
        _statements(rows, of_paper, stated["neighbours_mean_below"], _counted_tightly(data)),
    )


def _panel(forces: Sequence[Shaken], of_paper: Stated, paper_range: str) -> Panel:
    return Panel(
        "aspect ratio L/d",
        "number per particle",
        [
            one
            for quantity in (COORDINATION_NUMBER, NEIGHBOURS)
            for one in against_aspect(forces, quantity)
        ],
        bounds=(
            f"paper: {paper_range}",
            of_paper.value - of_paper.error,
            of_paper.value + of_paper.error,
        ),
    )


def _compared(dimers: Sequence[Row], of_paper: Stated, particles: int) -> list[Comparison]:
    """Compare the contacts of all dimers with the paper's one number for them."""
    runs = [result for row in dimers for result in row.group]
    if not runs:
        return []
    of_aspect: dict[float, list[float]] = {}
    for row in dimers:
        of_aspect.setdefault(row.aspect, []).append(row.numbers[COORDINATION_NUMBER.name].mean)
    means = [sample(values).mean for values in of_aspect.values()]
    return [
        Comparison(
            f"z of dimers, mean over {len(means)} aspect ratios",
            of_paper,
            sample(means),
            COORDINATION_NUMBER.decimals,
            COORDINATION_NUMBER.unit,
            "; ".join(
                text
                for text in (unlike(runs, particles), "the scatter is that of aspect ratios")
                if text
            ),
        )
    ]


def _counted_tightly(data: Data) -> str:
    """Write the contacts of the reference packings of dimers, which a tight tolerance counts."""
    dimers = [r for r in data.results("reference") if r.setting("aspect_ratio", 1.0) > 1]
    parts = []
    for aspect, group in sorted(grouped(dimers, by_value("aspect_ratio")).items()):
        z = COORDINATION_NUMBER.over(group)
        tolerance = as_short(group[0].setting("tolerance_measuring"))
        parts.append(f"{as_text(z.mean, 3)} at L/d = {as_short(aspect)} counted at {tolerance} r")
    return "".join(f"; {part}" for part in parts)


def _statements(
    rows: Sequence[Row], of_paper: Stated, below: float, tightly: str
) -> list[Statement]:
    """Compare contacts and neighbours with the paper's ranges; `tightly` adds to the evidence."""
    dimers = [row for row in rows if row.aspect > 1]
    if not dimers:
        return []
    z = [row.numbers[COORDINATION_NUMBER.name].mean for row in dimers]
    neighbours = [row.numbers[NEIGHBOURS.name].mean for row in dimers]
    paper_range = f"{as_short(of_paper.value)} ± {as_short(of_paper.error)}"
    return [
        Statement(
            f"A dimer has {paper_range} contacts at every L/d above 1, as isostaticity wants it.",
            not any(_is_outside(row, of_paper) for row in dimers),
            f"{as_text(min(z), 3)} to {as_text(max(z), 3)}, from L/d = "
            f"{as_short(min(row.aspect for row in dimers))} on{tightly}",
        ),
        Statement(
            f"The mean number of neighbours is below {as_short(below)}.",
            max(neighbours) < below,
            f"{as_text(min(neighbours), 2)} to {as_text(max(neighbours), 2)}",
        ),
    ]


@dataclass(frozen=True, eq=False)
class _Distribution:
    """The mean distribution of one number over some runs.

    Attributes
    ----------
    shares : (k,), share of the particles with 0, 1, ...
    errors : (k,), standard errors; None of a single run
    stated : the paper's smallest and largest number
    """

    shares: FloatArray
    errors: FloatArray | None
    stated: tuple[int, int]

    @property
    def counts(self) -> FloatArray:
        """The numbers 0, 1, ..., (k,)."""
        return np.arange(len(self.shares), dtype=np.float64)

    @property
    def width(self) -> float:
        """The standard deviation of the number."""
        return math.sqrt(self._moment(2))

    def error_of_width(self, particles: float) -> float:
        """Return the standard error of the width, of so many particles: that of a sample."""
        spread = self._moment(4) / self._moment(2) ** 2 - 1 if self._moment(2) else 0.0
        return self.width * math.sqrt(max(spread, 0.0) / (4 * particles))

    def _moment(self, order: int) -> float:
        centre = float((self.counts * self.shares).sum())
        return float(((self.counts - centre) ** order * self.shares).sum())

    def may_be_most_probable(self, number: int, particles: float) -> bool:
        """Say whether a number is the most probable one, or as good as that.

        Of so many particles the share of the most probable one is larger by at most two standard
        errors of the difference, sqrt((p + q - (p - q)^2) / particles).
        """
        p = float(self.shares.max())
        q = float(self.shares[number]) if number < len(self.shares) else 0.0
        return p - q <= 2 * math.sqrt((p + q - (p - q) ** 2) / particles)

    @property
    def outside(self) -> float:
        """The share of the particles whose number the paper does not have."""
        low, high = self.stated
        return float(self.shares[(self.counts < low) | (self.counts > high)].sum())

    @property
    def extent(self) -> str:
        """The smallest and the largest number that occur."""
        filled = np.flatnonzero(self.shares > 0)
        return f"{filled[0]} to {filled[-1]}"


@dataclass(frozen=True)
class _Curves:
    """The distributions of one random force and aspect ratio, by the names of the numbers."""

    force: float
    aspect: float
    group: Sequence[Result]
    distributions: Mapping[str, _Distribution]

    @property
    def particles(self) -> float:
        """The number of particles in the box, of all runs."""
        return sum(max(1.0, result.number("particles_in_box")) for result in self.group)

    @property
    def width(self) -> Sample:
        """The width of the distribution of contacts; its error is that of so many particles."""
        of_contacts = self.distributions["contacts"]
        return Sample(of_contacts.width, of_contacts.error_of_width(self.particles), 1, math.inf)


def _distribution_columns(name: str, stated: tuple[int, int]) -> list[Column[_Curves]]:
    low, high = stated
    return [
        Column(
            f"{name}: most probable", lambda row: int(np.argmax(row.distributions[name].shares))
        ),
        Column(
            f"{name}: standard deviation", lambda row: as_text(row.distributions[name].width, 3)
        ),
        Column(f"{name}: from, to", lambda row: row.distributions[name].extent),
        Column(
            f"{name}: outside {low} to {high}",
            lambda row: (
                as_text(row.distributions[name].outside * 100, 3) if row.aspect > 1 else DASH
            ),
            "%",
        ),
    ]


def distributions(data: Data) -> Content:
    """Show how many contacts and neighbours the particles have."""
    stated = data.paper["dimers"]
    ranges: dict[str, tuple[int, int]] = {
        "contacts": tuple(stated["contacts_range"]),
        "neighbours": tuple(stated["neighbours_range"]),
    }
    rows = [
        _Curves(one.force, aspect, group, _distributions(group, ranges))
        for number, one in enumerate(shaken(data))
        for aspect, group in listed(data, one.groups).items()
        if arrays_of(group, "distribution/contacts") and (aspect > 1 or number == 0)
    ]
    if not rows:
        return Content()
    weakest = [row for row in rows if row.force == rows[0].force]
    columns: list[Column[_Curves]] = [
        Column("random force", lambda row: as_short(row.force) if row.aspect > 1 else DASH),
        Column("curve", lambda row: name_of(row.aspect)),
        RUNS,
    ]
    for name, stated_range in ranges.items():
        columns += _distribution_columns(name, stated_range)
    contacts, neighbours = ranges["contacts"], ranges["neighbours"]
    return Content(
        [
            Figure(
                "figure-14",
                "Share of the particles in the box with so many contacts (left) and neighbours "
                f"(right), random force {as_short(rows[0].force)}; error bars: standard error "
                "over the runs. Dotted: what the paper says of dimers.",
                [
                    Panel(
                        f"number of {name}",
                        "share of particles",
                        _curves(weakest, name),
                        moments=_moments(name, stated),
                    )
                    for name in ranges
                ],
            ),
            table("Distributions", columns, rows),
            Text(
                "Paper: the distribution of contacts is almost the same for all dimers, from "
                f"{contacts[0]} to {contacts[1]} in most runs and most probable at "
                f"{stated['contacts_most_probable']}, and slightly narrower for two curves, "
                "printed as d/L = 0.4 and 0.6 (perhaps L/d 1.4 and 1.6); neighbours range from "
                f"{neighbours[0]} to {neighbours[1]} and depend on the aspect ratio. Three "
                "neighbours that touch it twice each can hold a dimer; few are held so."
            ),
        ],
        statements=_statements_on_distributions(weakest, stated),
    )


def _moments(name: str, stated: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Return the paper's range of a number, and the most probable one if it states that."""
    low, high = stated[f"{name}_range"]
    ends = [("paper: from", float(low)), ("paper: to", float(high))]
    most = stated.get(f"{name}_most_probable")
    return ends if most is None else [*ends, ("paper: most probable", float(most))]


def _statements_on_distributions(
    rows: Sequence[_Curves], stated: Mapping[str, Any]
) -> list[Statement]:
    dimers = [row for row in rows if row.aspect > 1]
    if not dimers:
        return []
    found = []
    for name in ("contacts", "neighbours"):
        low, high = stated[f"{name}_range"]
        of_runs = [
            _Distribution(shares, None, (low, high))
            for row in dimers
            for shares in arrays_of(row.group, f"distribution/{name}")
        ]
        within = sum(one.outside == 0 for one in of_runs)
        outside = max(row.distributions[name].outside for row in dimers)
        found.append(
            Statement(
                f"The number of {name} ranges from {low} to {high} (in most runs).",
                within > len(of_runs) / 2,
                f"in {within} of {len(of_runs)} runs; at most {as_text(100 * outside, 2)} % of the "
                "dimers of an L/d lie outside",
            )
        )
    probable = stated["contacts_most_probable"]
    tops = {int(np.argmax(row.distributions["contacts"].shares)) for row in dimers}
    likely = [
        row.distributions["contacts"].may_be_most_probable(probable, row.particles)
        for row in dimers
    ]
    return [
        Statement(
            f"The most probable number of contacts is {probable}.",
            all(likely),
            f"as probable as any other number, within two standard errors, in {sum(likely)} of "
            f"{len(likely)} curves; largest shares at {', '.join(map(str, sorted(tops)))}",
        ),
        *found,
        _statement_on_widths(dimers),
    ]


def _statement_on_widths(dimers: Sequence[_Curves]) -> Statement:
    """Say whether the two distributions that the paper calls narrower are so."""
    widths = {row.aspect: row.width for row in dimers}
    narrow = [one for aspect, one in widths.items() if aspect in NARROW]
    others = [one for aspect, one in widths.items() if aspect not in NARROW]
    apart = [difference(other, one) for other in others for one in narrow]
    holds: bool | None = None
    if len(narrow) == len(NARROW) and apart:
        corrected = adjusted([one.p for one in apart])
        sure = [p < SIGNIFICANT for p in corrected]
        if any(s and one.value < 0 for s, one in zip(sure, apart, strict=True)):
            holds = False
        elif all(sure):
            holds = True
    return Statement(
        "The distribution of contacts is slightly narrower for two aspect ratios, printed as "
        "d/L = 0.4 and 0.6 (perhaps L/d = 1.4 and 1.6).",
        holds,
        "standard deviation: "
        + ", ".join(f"{as_mean(w, 2)} at {as_short(a)}" for a, w in widths.items()),
        "the distribution at L/d = "
        f"{' and '.join(map(as_short, NARROW))} is not narrower than all others",
    )


def _distributions(
    group: Sequence[Result], ranges: Mapping[str, tuple[int, int]]
) -> dict[str, _Distribution]:
    return {
        name: _Distribution(
            *mean_distribution(arrays_of(group, f"distribution/{name}")),
            stated_range,
        )
        for name, stated_range in ranges.items()
    }


def _curves(rows: Sequence[_Curves], name: str) -> list[Curve]:
    return [
        curve(name_of(row.aspect), one.counts, one.shares, one.errors, "distribution")
        for row in rows
        for one in (row.distributions[name],)
    ]
