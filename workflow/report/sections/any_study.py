"""A section for any study: its cases over their seeds, and plots against what varies."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence

import numpy as np

from ...results.store import Result, StoredStudy
from ..blocks import Block, Cell, Section, Table, missing
from ..columns import RUNS, Column, LabelledRuns, table
from ..curves import mean_curve, mean_distribution
from ..data import arrays_of, profiles, series
from ..figures import Curve, Figure, Panel, curve, points
from ..groups import box_is_in_bed, by_value, by_variables, grouped, labelled, varying
from ..quantities import OF_ANY_STUDY
from ..statistics import numbers
from ..text import as_value
from .pictures import kept_packing, network_picture, step_pictures
from .provenance import commands_of

# One plot has at most so many curves: more cannot be told apart.
MOST_CURVES = 7
# The numbers that are plotted, with the labels of their axes.
PLOTTED = {"packing_fraction": "packing fraction", "coordination_number": "coordination number"}

# What tells a group of runs from the others, and its runs.
Groups = Sequence[tuple[str, Sequence[Result]]]


def study_section(study: StoredStudy) -> Section:
    """Return the section of a study that is none of the paper's."""
    groups = labelled(study.results)
    anchor = _anchor(study.name)
    blocks: list[Block] = []
    if groups:
        blocks.append(_table(groups))
        # A number of empty space is no number of the packing: it is in the table, and not drawn.
        drawn = [(label, group) for label, group in groups if box_is_in_bed(group)]
        kept = {result.case for _, group in drawn for result in group}
        results = [result for result in study.results if result.case in kept]
        blocks += _against(results, varying(study.results), anchor)
        blocks += _evolution(drawn, anchor)
        blocks += _distributions(drawn, anchor)
        blocks += _profiles(drawn, anchor)
        for number, (label, group) in enumerate(groups, 1):
            blocks += step_pictures(group, f"{anchor}-pictures-{number}", label)
            caption = f"Network of contacts: {label}"
            blocks += network_picture(group, f"{anchor}-network-{number}", caption)
        blocks += kept_packing(study.results, f"{anchor}-packing")
    return Section(
        anchor,
        f"{study.title} ({study.name})",
        blocks or [missing(commands_of(study)[0])],
        studies=(study.name,),
    )


def _anchor(name: str) -> str:
    """Return a study's name for links and files; two names, such as a_b and a-b, differ in it."""
    plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
    digest = hashlib.sha256(name.encode()).hexdigest()[:8]
    return f"study-{plain}" if plain == name else f"study-{plain}-{digest}"


def _table(groups: Groups) -> Table:
    known = [
        quantity for quantity in OF_ANY_STUDY if any(quantity.over(group).n for _, group in groups)
    ]
    columns: list[Column[LabelledRuns]] = [
        Column("case", lambda case: Cell(case.label, marked=not box_is_in_bed(case.group))),
        RUNS,
    ]
    columns += [quantity.column() for quantity in known]
    notes = ["Mean ± standard deviation (standard error); what all cases have alike is not named."]
    if not all(box_is_in_bed(group) for _, group in groups):
        notes.append(_out_of_bed([result for _, group in groups for result in group]))
    return table(
        "All cases, means over seeds",
        columns,
        [LabelledRuns(label, group) for label, group in groups],
        notes,
    )


def _out_of_bed(results: Sequence[Result]) -> str:
    """Say what is wrong with marked cases, and which box lies inside the bed in all runs."""
    said = (
        "Marked: in a run of the case the measuring box reaches out of the bed. Its numbers are "
        "partly of empty space, and the plots leave the case out."
    )
    boxes = [result.values.get("bed/box") for result in results]
    known = np.array([box for box in boxes if box is not None])
    inside = np.column_stack([known[..., 0].max(axis=0), known[..., 1].min(axis=0)])
    if len(known) < len(boxes) or not (inside[:, 0] < inside[:, 1]).all():
        return f"{said} No box is known to lie inside in all runs."
    bounds = ", ".join(f"{bound:g}" for bound in inside.ravel())
    return f"{said} Inside in all runs lies box = [{bounds}]."


def _against(results: Sequence[Result], names: Sequence[str], anchor: str) -> list[Block]:
    """Return a figure for each parameter that varies as a number."""
    figures: list[Block] = []
    for name in names:
        others = [other for other in names if other != name]
        drawn = _curves_against(results, name, others)
        panels = [
            Panel(name, text, drawn[number][:MOST_CURVES])
            for number, text in PLOTTED.items()
            if drawn[number]
        ]
        if panels:
            caption = f"Packing fraction and coordination number against {name}; error bars: "
            caption += f"standard error over the runs.{_left_out(drawn['packing_fraction'])}"
            figures.append(Figure(f"{anchor}-against-{name}", caption, panels))
    return figures


def _curves_against(
    results: Sequence[Result], name: str, others: Sequence[str]
) -> dict[str, list[Curve]]:
    """Return curves of each plotted number, one for each choice of what else varies."""
    drawn: dict[str, list[Curve]] = {number: [] for number in PLOTTED}
    with_it = [r for r in results if isinstance(r.variables.get(name), int | float)]
    for key, group in grouped(with_it, by_variables(others)).items():
        places = dict(sorted(grouped(group, by_value(name)).items()))
        if len(places) < 2:
            continue
        deck, *values = key
        words = [
            f"{other} = {as_value(value)}"
            for other, value in zip(others, values, strict=True)
            if value is not None
        ]
        for number, curves in drawn.items():
            found = [numbers(runs, number) for runs in places.values()]
            if any(one.n for one in found):
                curves.append(points(", ".join([deck, *words]), list(places), found))
    return drawn


def _evolution(groups: Groups, anchor: str) -> list[Block]:
    drawn: dict[str, list[Curve]] = {number: [] for number in PLOTTED}
    for label, group in groups:
        # A mean over seeds would hide how a packing comes to rest: the first run is shown.
        first = group[0]
        steps = series(first, "evolution/step")
        for number, curves in drawn.items():
            values = series(first, f"evolution/{number}")
            if steps is not None and values is not None:
                curves.append(curve(label, steps, values))
    if not drawn["packing_fraction"]:
        return []
    caption = "Packing fraction and coordination number in the box against the step, the first run "
    caption += f"of each.{_left_out(drawn['packing_fraction'])}"
    panels = [Panel("step", text, drawn[number][:MOST_CURVES]) for number, text in PLOTTED.items()]
    return [Figure(f"{anchor}-evolution", caption, panels)]


def _distributions(groups: Groups, anchor: str) -> list[Block]:
    curves = []
    for label, group in groups:
        found = arrays_of(group, "distribution/contacts")
        if found:
            mean, error = mean_distribution(found)
            curves.append(curve(label, np.arange(len(mean)), mean, error, "distribution"))
    if not curves:
        return []
    caption = f"Share of the particles in the box with so many contacts.{_left_out(curves)}"
    panel = Panel("number of contacts", "share of particles", curves[:MOST_CURVES])
    return [Figure(f"{anchor}-contacts", caption, [panel])]


def _profiles(groups: Groups, anchor: str) -> list[Block]:
    curves = [
        curve(label, *mean_curve(found), kind="profile")
        for label, group in groups
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
