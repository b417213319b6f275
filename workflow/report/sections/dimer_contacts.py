"""The paper's Figures 13 and 14: contacts and neighbours of dimers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...store import Result
from ..blocks import Block, Cell, Comparison, Content, Text
from ..columns import RUNS, Column, table
from ..data import Data, arrays_of
from ..figures import Curve, Figure, Panel, curve
from ..groups import unlike
from ..quantities import (
    COORDINATION_NUMBER,
    COORDINATION_NUMBER_WITHOUT_RATTLERS,
    MEAN_RESOLUTION,
    NEIGHBOURS,
    RATTLERS,
)
from ..statistics import FloatArray, Sample, Stated, mean_distribution, numbers, pooled_numbers
from ..text import DASH, as_sample, as_short, as_text
from .aspect_ratios import (
    POOLED,
    ByAspect,
    against_aspect,
    by_aspect,
    cell_of,
    listed,
    name_of,
    true_dimers,
)


@dataclass(frozen=True)
class _Row:
    """The runs of one aspect ratio, and numbers of theirs with the pooled scatter."""

    aspect: float
    group: Sequence[Result]
    contacts: Sample
    neighbours: Sample
    without_rattlers: Sample

    def is_outside(self, stated: Stated) -> bool:
        """Say whether dimers have more or fewer contacts than the paper's range."""
        return self.aspect > 1 and abs(self.contacts.mean - stated.value) > stated.error


def _columns(stated: Stated) -> Sequence[Column[_Row]]:
    return (
        Column("L/d", lambda row: cell_of(row.aspect)),
        RUNS,
        Column(
            "contacts z",
            lambda row: Cell(as_sample(row.contacts, 3), marked=row.is_outside(stated)),
        ),
        Column("neighbours", lambda row: as_sample(row.neighbours, 3)),
        MEAN_RESOLUTION,
        Column(
            RATTLERS.heading,
            lambda row: as_text(RATTLERS.over(row.group).mean, RATTLERS.decimals),
            RATTLERS.unit,
        ),
        Column("z without rattlers", lambda row: as_sample(row.without_rattlers, 3)),
    )


def contacts_and_neighbours(data: Data) -> Content:
    """Show contacts and neighbours of a particle against the aspect ratio."""
    known = {
        aspect: group
        for aspect, group in by_aspect(data).items()
        if numbers(group, "coordination_number").n
    }
    if not known:
        return Content()
    stated = data.paper["dimers"]
    per_particle = stated["contacts_per_particle"]
    of_paper = Stated(per_particle["value"], per_particle["tolerance"])
    paper_range = f"{as_short(of_paper.value)} ± {as_short(of_paper.error)}"
    means = [numbers(group, "neighbours").mean for group in true_dimers(known).values()]
    most = max(means, default=math.nan)
    blocks: list[Block] = [
        Figure(
            "figure-13",
            "Contacts and neighbours of a particle against the aspect ratio; several contacts "
            "with one neighbour count apart. Shaded: the paper's range for dimers.",
            [_panel(known, of_paper, paper_range)],
        ),
        table(
            "Contacts and neighbours against aspect ratio",
            _columns(of_paper),
            _rows(known),
            (
                f"{POOLED} Marked: outside {paper_range}. Near L/d = 1 the two contacts of a dimer "
                "with a neighbour lie close together, and only a tolerance well below ε = 0.005 "
                "(L/d - 1) r tells both.",
                "Rattlers: particles that carry nothing.",
            ),
        ),
        Text(
            f"Paper: z = {paper_range} for every L/d above 1, twice the degrees of "
            "freedom, and 6 at L/d = 1: a jump. The number of neighbours grows from 6 without "
            f"a jump, falls again, and stays below {stated['neighbours_mean_below']}. Ours: at "
            f"most {as_text(most, 2)} neighbours in the mean."
        ),
    ]
    return Content(blocks, _compared(true_dimers(known), of_paper, stated["count"]))


def _rows(known: ByAspect) -> list[_Row]:
    contacts, neighbours, without_rattlers = (
        pooled_numbers(known, quantity.name)
        for quantity in (COORDINATION_NUMBER, NEIGHBOURS, COORDINATION_NUMBER_WITHOUT_RATTLERS)
    )
    return [
        _Row(aspect, group, contacts[aspect], neighbours[aspect], without_rattlers[aspect])
        for aspect, group in known.items()
    ]


def _panel(known: ByAspect, of_paper: Stated, paper_range: str) -> Panel:
    return Panel(
        "aspect ratio L/d",
        "number per particle",
        [
            against_aspect("contacts", known, COORDINATION_NUMBER),
            against_aspect("neighbours", known, NEIGHBOURS),
        ],
        bounds=(
            f"paper: {paper_range}",
            of_paper.value - of_paper.error,
            of_paper.value + of_paper.error,
        ),
    )


def _compared(dimers: ByAspect, of_paper: Stated, particles: int) -> list[Comparison]:
    """Compare the contacts of all dimers with the paper's one number for them."""
    runs = [result for group in dimers.values() for result in group]
    if not runs:
        return []
    return [
        Comparison(
            f"z of dimers, mean over {len(dimers)} aspect ratios",
            of_paper,
            COORDINATION_NUMBER.over(runs),
            COORDINATION_NUMBER.decimals,
            COORDINATION_NUMBER.unit,
            unlike(runs, particles),
        )
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
        centre = float((self.counts * self.shares).sum())
        return math.sqrt(float(((self.counts - centre) ** 2 * self.shares).sum()))

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
    """The distributions of one aspect ratio, by the names of the numbers."""

    aspect: float
    group: Sequence[Result]
    distributions: Mapping[str, _Distribution]


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
        _Curves(aspect, group, _distributions(group, ranges))
        for aspect, group in listed(data, by_aspect(data)).items()
        if arrays_of(group, "distribution/contacts")
    ]
    if not rows:
        return Content()
    columns: list[Column[_Curves]] = [Column("curve", lambda row: name_of(row.aspect)), RUNS]
    for name, stated_range in ranges.items():
        columns += _distribution_columns(name, stated_range)
    contacts, neighbours = ranges["contacts"], ranges["neighbours"]
    return Content(
        [
            Figure(
                "figure-14",
                "Share of the particles in the box with so many contacts (left) and neighbours "
                "(right); error bars: standard error over the runs.",
                [
                    Panel(f"number of {name}", "share of particles", _curves(rows, name))
                    for name in ranges
                ],
            ),
            table("Distributions", columns, rows),
            Text(
                "Paper: the distribution of contacts is almost the same for all dimers, from "
                f"{contacts[0]} to {contacts[1]} in most runs and most probable at "
                f"{stated['contacts_most_probable']}, and slightly narrower for two curves, "
                "printed as d/L = 0.4 and 0.6 (perhaps L/d 1.4 and 1.6); neighbours range from "
                f"{neighbours[0]} to {neighbours[1]} and depend on the aspect ratio."
            ),
        ]
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
