"""The paper's Figure 7: how many contacts the spheres have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...results.store import Result
from ..blocks import Block, Cell, Comparison, Content, Statement, Text
from ..columns import Column, table
from ..curves import FloatArray
from ..data import Data, series
from ..figures import Figure, Panel, curve
from ..groups import count_of, nearest_size, seed_label, unlike
from ..quantities import COORDINATION_NUMBER
from ..statistics import Stated
from ..text import as_choice, as_count, as_runs, as_short, as_text


@dataclass(frozen=True, eq=False)
class _Run:
    """One run and its distribution of contacts: the share of spheres with 0, 1, ..., (k,)."""

    result: Result
    shares: FloatArray

    @property
    def label(self) -> str:
        """The name of the run."""
        return seed_label(self.result)

    @property
    def spheres(self) -> float:
        """The number of spheres in the measuring box."""
        return self.result.number("particles_in_box")

    def share(self, contacts: int) -> float:
        """Return the share of spheres with so many contacts."""
        return float(self.shares[contacts]) if contacts < len(self.shares) else 0.0


COLUMNS: Sequence[Column[_Run]] = (
    Column("run", lambda run: run.label),
    Column("spheres in the box", lambda run: as_count(run.spheres)),
    Column("mean z", lambda run: as_text(COORDINATION_NUMBER.of(run.result), 3)),
    Column("most probable", lambda run: int(np.argmax(run.shares))),
)


def sphere_contacts(data: Data) -> Content:
    """Show the distribution of contacts beside what the paper says of it."""
    stated = data.paper["spheres"]
    known = [r for r in data.results("table-2") if series(r, "distribution/contacts") is not None]
    results = nearest_size(known, 10_000, data.usual_tolerance)
    if not results:
        return Content()
    runs = [_Run(r, np.asarray(r.values["distribution/contacts"], dtype=float)) for r in results]
    never, z = stated["z_never"], stated["z"]
    found = any(run.share(contacts) > 0 for run in runs for contacts in never)
    blocks: list[Block] = [
        Figure(
            "figure-7",
            f"Share of the spheres in the box with so many contacts, {as_count(count_of(results))} "
            f"spheres, {as_runs(len(results))}.",
            [
                Panel(
                    "number of contacts",
                    "share of spheres",
                    [
                        curve(
                            run.label, np.arange(len(run.shares)), run.shares, None, "distribution"
                        )
                        for run in runs
                    ],
                    moments=[("paper: most probable", stated["z_most_probable"])],
                )
            ],
        ),
        table(
            "Numbers of contacts, mean over the frames of the count",
            [*COLUMNS, *(_with_contacts(contacts) for contacts in never)],
            runs,
        ),
        Text(
            f"Paper: z = {as_text(z['value'], 2)} ± {as_short(z['tolerance'])}; most "
            f"probable {stated['z_most_probable']}; no sphere with {as_choice(never)}. "
            + ("Ours: such spheres are marked in the table." if found else "Ours: none either.")
        ),
    ]
    comparison = Comparison(
        "z, spheres",
        Stated.of_range(z["value"], z["tolerance"]),
        COORDINATION_NUMBER.over(results),
        COORDINATION_NUMBER.decimals,
        COORDINATION_NUMBER.unit,
        unlike(results, 10_000),
    )
    return Content(blocks, [comparison], _statements(runs, stated))


def _statements(runs: Sequence[_Run], stated: Mapping[str, Any]) -> list[Statement]:
    """Say whether our runs have the paper's distribution."""
    tops = {int(np.argmax(run.shares)) for run in runs}
    never = stated["z_never"]
    spheres = sum(run.spheres for run in runs)
    found = {contacts: sum(run.share(contacts) * run.spheres for run in runs) for contacts in never}
    return [
        Statement(
            f"The most frequent coordination number is {stated['z_most_probable']}.",
            tops == {stated["z_most_probable"]},
            f"most frequent: {', '.join(map(str, sorted(tops)))}",
        ),
        Statement(
            f"No sphere has {as_choice(never)} contacts.",
            not any(found.values()),
            f"of {as_count(spheres)} spheres: "
            + ", ".join(f"{as_text(number, 1)} with {n}" for n, number in found.items()),
        ),
    ]


def _with_contacts(contacts: int) -> Column[_Run]:
    """Return a column with the number of spheres of so many contacts, marked where there are any.

    The paper never finds a sphere with so many.
    """

    def cell(run: _Run) -> Cell:
        share = run.share(contacts)
        return Cell(as_text(share * run.spheres, 1), marked=share > 0)

    return Column(f"spheres with {contacts}", cell)
