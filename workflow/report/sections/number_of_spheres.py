"""The paper's Table 2: the packing fraction against the number of spheres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...results.store import Result
from ..blocks import Block, Comparison, Content, Statement, Text
from ..columns import Column, difference_cell, ours_text, table
from ..data import Data
from ..figures import Figure, Panel, curve, points
from ..groups import by_size, grouped, matching, nearest_size, unlike
from ..quantities import COORDINATION_NUMBER, MEAN_RESOLUTION, PACKING_FRACTION
from ..statistics import Stated, difference
from ..text import DASH, NOT_RUN, as_count, as_measured, as_probability, as_short, as_text
from .tolerance_and_force import CHANCE, NOTHING_STATED

# The paper's two packing fractions from so many spheres on are 0.1 percentage points apart, and
# their range is twice that.
MANY, HARDLY = 10_000, 0.2


@dataclass(frozen=True)
class _Row:
    """The runs of one number of spheres, diameter and tolerance.

    Attributes
    ----------
    spheres, diameter : of the case
    tolerance : the allowed overlap over the radius
    stated : the row of the paper's table; None for a case that it does not have
    group : the runs; none for a row of the paper that has not been run
    phi : the packing fraction in %, with the paper's
    """

    spheres: int
    diameter: float
    tolerance: float
    stated: Mapping[str, Any] | None
    group: Sequence[Result]
    phi: Comparison


COLUMNS: Sequence[Column[_Row]] = (
    Column("spheres", lambda row: as_count(row.spheres)),
    Column("d", lambda row: as_short(row.diameter)),
    Column("ε / r", lambda row: as_short(row.tolerance)),
    Column("runs, paper", lambda row: row.stated["runs"] if row.stated else DASH),
    Column("runs, ours", lambda row: len(row.group) or NOT_RUN),
    Column(
        "φ, paper",
        lambda row: as_text(row.stated["phi_percent"], 1) if row.stated else DASH,
        PACKING_FRACTION.unit,
    ),
    Column("φ, ours", lambda row: ours_text(row.phi), PACKING_FRACTION.unit),
    Column("difference", lambda row: difference_cell(row.phi.difference), "SE"),
    COORDINATION_NUMBER.column("z, ours"),
    MEAN_RESOLUTION,
)


def number_of_spheres(data: Data) -> Content:
    """Compare the packing fraction with the paper's Table 2 and with what it says of the bulk."""
    results = data.results("table-2")
    if not results:
        return Content()
    of_paper = [_row_of_paper(data, results, stated) for stated in data.paper["table2"]]
    comparisons = [row.phi for row in of_paper if row.group]
    whole = data.paper["spheres"]["phi_percent"]
    bulk = nearest_size(results, 10_000, data.usual_tolerance)
    if bulk:
        comparisons.append(
            Comparison(
                "φ in bulk, spheres",
                Stated.of_range(whole["value"], whole["tolerance"]),
                PACKING_FRACTION.over(bulk),
                PACKING_FRACTION.decimals,
                PACKING_FRACTION.unit,
                unlike(bulk, 10_000),
            )
        )
    blocks: list[Block] = [
        *_figure(of_paper),
        table(
            "Packing fraction against the number of spheres",
            COLUMNS,
            [*of_paper, *_other_rows(results, of_paper)],
            (
                "Ours: mean ± standard deviation (standard error). The paper gives no scatter "
                "here, but for 1,000 spheres in its Table 1; elsewhere the difference is in "
                "our standard errors alone. A single run has none, two give it roughly.",
            ),
        ),
        Text(
            f"Paper: {as_short(whole['value'])} ± {as_short(whole['tolerance'])} % in bulk, hardly "
            "any change from 10,000 spheres on; few spheres pack less, because the walls are near."
        ),
    ]
    return Content(blocks, comparisons, _statements(of_paper))


def _figure(rows: Sequence[_Row]) -> list[Block]:
    """Return our packing fractions against the number of spheres beside the paper's."""
    run = [row for row in rows if row.group]
    if not run:
        return []
    return [
        Figure(
            "table-2",
            "Packing fraction against the number of spheres; error bars: standard error over the "
            "runs, where it is known.",
            [
                Panel(
                    "number of spheres",
                    f"packing fraction [{PACKING_FRACTION.unit}]",
                    [
                        points("ours", [row.spheres for row in run], [r.phi.ours for r in run]),
                        curve(
                            "paper",
                            [row.spheres for row in rows],
                            [row.phi.stated.value for row in rows],
                            [row.phi.stated.error for row in rows],
                            "apart",
                        ),
                    ],
                    log_x=True,
                )
            ],
        )
    ]


def _statements(rows: Sequence[_Row]) -> list[Statement]:
    """Say whether the packing fraction changes from 10,000 spheres on."""
    many = [row for row in rows if row.group and row.spheres >= MANY]
    if len(many) < 2:
        return []
    apart = difference(many[-1].phi.ours, many[0].phi.ours)
    return [
        Statement(
            f"From {as_count(MANY)} spheres on φ hardly depends on their number.",
            apart.is_within(HARDLY),
            f"{as_count(many[-1].spheres)} less {as_count(many[0].spheres)}: "
            f"{as_measured(apart.value, apart.error, 2)} percentage points, "
            f"p {as_probability(apart.p)}",
        )
    ]


def _row_of_paper(data: Data, results: Sequence[Result], stated: Mapping[str, Any]) -> _Row:
    spheres, diameter, tolerance = stated["spheres"], stated["diameter"], stated["eps_over_r"]
    group = matching(results, particles=spheres, diameter=diameter, tolerance=tolerance)
    return _Row(
        spheres,
        diameter,
        tolerance,
        stated,
        group,
        Comparison(
            f"φ, {as_count(spheres)} spheres",
            _stated_with_scatter(data, stated),
            PACKING_FRACTION.over(group),
            PACKING_FRACTION.decimals,
            PACKING_FRACTION.unit,
            unlike(group, spheres, stated["runs"]),
            CHANCE,
        ),
    )


def _stated_with_scatter(data: Data, stated: Mapping[str, Any]) -> Stated:
    """Return a packing fraction of the paper's Table 2, with its scatter where Table 1 has it."""
    for row in data.paper["table1"] if stated["spheres"] == 1000 else ():
        phi = row["phi_percent"]
        same = row["eps_over_r"] == stated["eps_over_r"] and row["random_force"]
        if same and round(phi["mean"], 1) == stated["phi_percent"]:
            return Stated.of_series(phi["mean"], phi["std"], stated["runs"])
    return Stated(stated["phi_percent"])


def _other_rows(results: Sequence[Result], of_paper: Sequence[_Row]) -> list[_Row]:
    """Return a row for each size and tolerance that the paper does not have."""
    seen = {result.case for row in of_paper for result in row.group}
    others = [result for result in results if result.case not in seen]
    return [
        _Row(
            int(particles),
            diameter,
            tolerance,
            None,
            part,
            Comparison("φ", NOTHING_STATED, PACKING_FRACTION.over(part), PACKING_FRACTION.decimals),
        )
        for (particles, diameter), group in by_size(others).items()
        for tolerance, part in grouped(group, lambda r: r.setting("tolerance")).items()
    ]
