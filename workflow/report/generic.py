"""A section for any study: its cases over their seeds, and plots against what varies."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ..store import Result, StoredStudy
from .blocks import Block, Section, Table, as_sample, cells, missing
from .data import profiles, series
from .figures import Curve, Figure, Panel, Pictures, curve
from .spheres import step_pictures
from .statistics import (
    as_value,
    by_value,
    by_variables,
    grouped,
    labelled,
    mean_curve,
    mean_distribution,
    numbers,
    varying,
)

# Of curves in one plot: more cannot be told apart.
MOST_CURVES = 7

# Columns of the table where they were measured: name, heading, factor, decimals.
COLUMNS = (
    ("packing_fraction", "φ [%]", 100.0, 2),
    ("packing_fraction_with_necks", "φ with necks [%]", 100.0, 2),
    ("coordination_number", "z", 1.0, 3),
    ("neighbours", "neighbours", 1.0, 3),
    ("rattlers", "rattlers [%]", 100.0, 2),
    ("largest_overlap", "largest overlap / r", 1.0, 6),
    ("resolution", "ε / (g h²)", 1.0, 4),
)


def study_section(study: StoredStudy) -> Section:
    """Return the section of a study that is none of the paper's."""
    groups = labelled(study.results)
    anchor = f"study-{re.sub(r'[^a-z0-9]+', '-', study.name.lower())}"
    blocks: list[Block] = []
    if groups:
        blocks.append(_table(groups))
        blocks += _against(study, varying(study.results), anchor)
        blocks += _evolution(groups, anchor)
        blocks += _distributions(groups, anchor)
        blocks += _profiles(groups, anchor)
        for number, (label, group) in enumerate(groups.items(), 1):
            blocks += step_pictures(group, f"{anchor}-pictures-{number}", label)
            drawn = [r.pictures["network"] for r in group if "network" in r.pictures]
            if drawn:
                caption = f"Network of contacts: {label}"
                name = f"{anchor}-network-{number}"
                blocks.append(Pictures(name, caption, {"": drawn[0]}, trimmed=True))
    return Section(
        anchor,
        f"{study.title} ({study.name})",
        blocks or [missing(f"{study.name}.toml")],
        studies=(study.name,),
    )


def _table(groups: dict[str, list[Result]]) -> Table:
    known = [
        column
        for column in COLUMNS
        if any(numbers(group, column[0]).n for group in groups.values())
    ]
    return Table(
        "All cases, means over seeds",
        ("case", "runs", *(heading for _, heading, _, _ in known)),
        [
            cells(
                label,
                len(group),
                *(
                    as_sample(numbers(group, name).scaled(factor), decimals)
                    for name, _, factor, decimals in known
                ),
            )
            for label, group in groups.items()
        ],
        ("Mean ± standard deviation (standard error); what all cases have alike is not named.",),
    )


def _against(study: StoredStudy, names: Sequence[str], anchor: str) -> list[Block]:
    """Return a figure for each parameter that varies as a number."""
    figures: list[Block] = []
    for name in names:
        with_it = [r for r in study.results if isinstance(r.variables.get(name), int | float)]
        others = [other for other in names if other != name]
        # One curve for each choice of what else varies.
        lines = grouped(with_it, by_variables(others))
        drawn: dict[str, list[Curve]] = {"packing_fraction": [], "coordination_number": []}
        for key, results in lines.items():
            points = dict(sorted(grouped(results, by_value(name)).items()))
            if len(points) < 2:
                continue
            label = ", ".join(
                [key[0]]
                + [
                    f"{other} = {as_value(value)}"
                    for other, value in zip(others, key[1:], strict=True)
                    if value is not None
                ]
            )
            for number, curves in drawn.items():
                found = [numbers(group, number) for group in points.values()]
                if any(one.n for one in found):
                    curves.append(
                        curve(
                            label,
                            list(points),
                            [one.mean for one in found],
                            [one.error for one in found],
                            "points",
                        )
                    )
        panels = [
            Panel(name, text, drawn[number][:MOST_CURVES])
            for number, text in (
                ("packing_fraction", "packing fraction"),
                ("coordination_number", "coordination number"),
            )
            if drawn[number]
        ]
        if panels:
            caption = f"Packing fraction and coordination number against {name}; error bars: "
            caption += f"standard error over the runs.{_left_out(drawn['packing_fraction'])}"
            figures.append(Figure(f"{anchor}-{name}", caption, panels))
    return figures


def _evolution(groups: dict[str, list[Result]], anchor: str) -> list[Block]:
    drawn: dict[str, list[Curve]] = {"packing_fraction": [], "coordination_number": []}
    for label, group in groups.items():
        for number, curves in drawn.items():
            # The first run of each: a mean over seeds would hide how a packing comes to rest.
            for result in group[:1]:
                steps, values = series(result, "evolution/step"), None
                if steps is not None:
                    values = series(result, f"evolution/{number}")
                if steps is not None and values is not None:
                    curves.append(curve(label, steps, values))
    if not drawn["packing_fraction"]:
        return []
    caption = "Packing fraction and coordination number in the box against the step, the first run "
    caption += f"of each.{_left_out(drawn['packing_fraction'])}"
    return [
        Figure(
            f"{anchor}-evolution",
            caption,
            [
                Panel("step", "packing fraction", drawn["packing_fraction"][:MOST_CURVES]),
                Panel("step", "coordination number", drawn["coordination_number"][:MOST_CURVES]),
            ],
        )
    ]


def _distributions(groups: dict[str, list[Result]], anchor: str) -> list[Block]:
    curves = []
    for label, group in groups.items():
        found = [
            np.asarray(r.values["distribution/contacts"], dtype=float)
            for r in group
            if "distribution/contacts" in r.values
        ]
        if found:
            mean, error = mean_distribution(found)
            curves.append(curve(label, np.arange(len(mean)), mean, error, "distribution"))
    if not curves:
        return []
    caption = f"Share of the particles in the box with so many contacts.{_left_out(curves)}"
    panel = Panel("number of contacts", "share of particles", curves[:MOST_CURVES])
    return [Figure(f"{anchor}-contacts", caption, [panel])]


def _profiles(groups: dict[str, list[Result]], anchor: str) -> list[Block]:
    curves = [
        curve(label, *mean_curve(found), kind="profile")
        for label, group in groups.items()
        if (found := profiles(group))
    ]
    if not curves:
        return []
    caption = f"Packing fraction against the distance from a wall.{_left_out(curves)}"
    panel = Panel("distance from the wall / d", "packing fraction", curves[:MOST_CURVES])
    return [Figure(f"{anchor}-profile", caption, [panel])]


def _left_out(curves: Sequence[Curve]) -> str:
    more = len(curves) - MOST_CURVES
    return f" {more} more cases are in the table only." if more > 0 else ""
