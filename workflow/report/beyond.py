"""Sections beyond the paper's figures: structure, forces, response, protocol, checks."""

from __future__ import annotations

import math

import numpy as np

from lammps_inelastic.analysis.structure import Q6_OF_CRYSTALS

from ..store import Result
from .blocks import (
    DASH,
    Block,
    Cell,
    Section,
    Table,
    Text,
    as_difference,
    as_sample,
    as_short,
    as_text,
    cells,
)
from .data import Data, by_size, count_of, series
from .dimers import by_aspect
from .figures import Curve, Figure, Panel, curve
from .spheres import section, step_pictures
from .statistics import (
    Sample,
    Stated,
    difference_in_errors,
    grouped,
    labelled,
    mean_curve,
    numbers,
)

# A share of crystalline particles above this is no random packing.
MOST_CRYSTALLINE = 0.5
# The first peak is cut off here: it is high and narrow, and says little.
HIGHEST_G = 4.0
# Aspect ratios whose curves are shown beside those of spheres.
SHOWN_ASPECTS = (1.1, 1.5, 2.0)
# Two bodies that turn may overlap by two tolerances; spheres by one.
ALLOWED_OF_BODIES = 2.0


def beyond_sections(data: Data) -> list[Section]:
    """Return these sections."""
    return [_structure(data), _forces(data), _response(data), _protocol(data), _checks(data)]


def _kinds(data: Data) -> dict[str, list[Result]]:
    """Return groups of results, spheres by their number and dimers by aspect ratio, by a label."""
    groups = {
        f"{int(particles):,} spheres": group
        for (particles, _), group in by_size(data.results("table-2", "table-1")).items()
    }
    for aspect, found in by_aspect(data).items():
        if aspect in SHOWN_ASPECTS:
            groups[f"dimers, L/d = {as_short(aspect)}"] = list(found)
    return groups


def _structure(data: Data) -> Section:
    curves: list[Curve] = []
    rows = []
    for label, group in _kinds(data).items():
        found = [
            (
                r.values["structure/distance"] / float(r.variables["diameter"]),
                r.values["structure/radial_distribution"],
            )
            for r in group
            if "structure/distance" in r.values and "diameter" in r.variables
        ]
        if found:
            curves.append(curve(label, *mean_curve(found)[:2]))
        crystalline = numbers(group, "crystalline")
        if crystalline.n:
            rows.append(
                cells(
                    label,
                    len(group),
                    as_sample(numbers(group, "q4"), 3),
                    as_sample(numbers(group, "q6"), 3),
                    as_sample(crystalline.scaled(100), 2),
                    Cell(
                        "crystallised"
                        if crystalline.mean > MOST_CRYSTALLINE
                        else "not crystallised",
                        marked=crystalline.mean > MOST_CRYSTALLINE,
                    ),
                )
            )
    blocks: list[Block] = []
    if curves:
        blocks.append(
            Figure(
                "structure",
                "Radial distribution function of the particles' centres in the box, mean over the "
                "runs; the first peak is cut off. A random packing of spheres has a split second "
                "peak, at about 1.73 and 2 d, and no peak at 1.41 d, as the densest crystals have.",
                [Panel("r / d", "g(r)", curves, references=[("no order", 1.0)], top=HIGHEST_G)],
            )
        )
    if rows:
        crystals = ", ".join(f"{name} {value}" for name, value in Q6_OF_CRYSTALS.items())
        blocks.append(
            Table(
                "Bond-orientational order of spheres, from their twelve nearest",
                ("packing", "runs", "q4", "q6", "crystalline [%]", ""),
                rows,
                (
                    f"q6 of the densest crystals: {crystals}. Crystalline: spheres whose order "
                    "agrees with that of eight or more of their neighbours.",
                ),
            )
        )
    return section(
        "structure", "Are the packings random? Structure", blocks, (), ("table-2", "dimers")
    )


def _forces(data: Data) -> Section:
    curves = []
    for label, group in _kinds(data).items():
        found = [
            (r.values["forces/ratio"], r.values["forces/density"])
            for r in group
            if "forces/ratio" in r.values
        ]
        if found:
            x, mean, error = mean_curve(found)
            # A logarithm has no room for empty bins.
            filled = mean > 0
            curves.append(
                curve(label, x[filled], mean[filled], None if error is None else error[filled])
            )
    blocks: list[Block] = []
    if curves:
        blocks = [
            Figure(
                "forces",
                "Probability density of the contact force over its mean, contacts between "
                "particles of which at least one is in the box.",
                [Panel("f / ⟨f⟩", "P(f / ⟨f⟩)", curves, log=True)],
            )
        ]
    return section("forces", "Contact forces", blocks, (), ("table-2", "dimers"))


def _response(data: Data) -> Section:
    blocks: list[Block] = []
    rows = []
    for result in data.results("response"):
        before, label = result.before, _change(result)
        if before is None:
            continue
        for name, text, factor, decimals in (
            ("packing_fraction", "φ in the box [%]", 100.0, 2),
            ("coordination_number", "z", 1.0, 3),
            ("rattlers", "rattlers [%]", 100.0, 2),
            ("fabric_x", "fabric, x", 1.0, 4),
            ("fabric_y", "fabric, y", 1.0, 4),
            ("fabric_z", "fabric, z", 1.0, 4),
        ):
            old, new = before.number(name) * factor, result.number(name) * factor
            rows.append(
                cells(
                    label,
                    text,
                    as_text(old, decimals),
                    as_text(new, decimals),
                    as_text(new - old, decimals),
                )
            )
    if rows:
        blocks.append(
            Table(
                "Before and after",
                ("change", "number", "before", "after", "difference"),
                rows,
                (
                    "Fabric: mean square of a component of the contact normals; 1/3 without a "
                    "preferred direction. One run each: no scatter is known.",
                ),
            )
        )
    heights: list[Curve] = []
    contacts: list[Curve] = []
    for result in data.results("response"):
        steps = series(result, "evolution/step")
        height = series(result, "evolution/centre_height")
        z = series(result, "evolution/coordination_number")
        if steps is None or height is None or z is None:
            continue
        heights.append(curve(_change(result), steps, height))
        contacts.append(curve(_change(result), steps, z))
    if heights:
        blocks.append(
            Figure(
                "response",
                "Mean height of the spheres and coordination number in the box after the change.",
                [
                    Panel("step after the change", "mean height [container widths]", heights),
                    Panel("step after the change", "coordination number", contacts),
                ],
            )
        )
    for result in data.results("response"):
        name = f"response-{result.variables.get('change', 'change')}"
        for block in step_pictures([result], name, f"{_change(result)}; steps after the change."):
            blocks.append(block)
    if blocks:
        blocks.insert(
            0,
            Text(
                "The paper's outlook: what a packing does when its stress or its container "
                "changes. A settled packing loses its side walls, or gravity is tilted. Nothing "
                "holds spheres without friction where a wall was: they flow away and leave the "
                "box empty."
            ),
        )
    return section("response", "Response of a packing", blocks, (), ("response",))


def _change(result: Result) -> str:
    change = result.variables.get("change")
    if change == "tilt":
        return f"gravity tilted by {as_short(float(result.variables.get('angle', math.nan)))}°"
    return "side walls removed" if change == "walls" else str(change)


PROTOCOL = ("dt", "random_force", "drag")


def _protocol(data: Data) -> Section:
    results = data.results("protocol")
    groups = grouped(results, lambda r: tuple(r.variables.get(name) for name in PROTOCOL))
    blocks: list[Block] = []
    if groups:
        # The first rows of the study are those with the deck's own values.
        standard, *_ = groups
        usual = {
            name: numbers(groups[standard], name)
            for name in ("packing_fraction", "coordination_number")
        }
        rows, labels = [], []
        for key, group in groups.items():
            phi, z = numbers(group, "packing_fraction"), numbers(group, "coordination_number")
            changed = [
                f"{_WORDS[name]} {as_short(float(value))}"
                for name, value, normal in zip(PROTOCOL, key, standard, strict=True)
                if value != normal
            ]
            labels.append(", ".join(changed) or "standard")
            rows.append(
                cells(
                    *(as_short(float(value)) for value in key),
                    len(group),
                    as_sample(phi.scaled(100), 2),
                    as_difference(_apart(phi, usual["packing_fraction"])) if changed else DASH,
                    as_sample(z, 3),
                    as_difference(_apart(z, usual["coordination_number"])) if changed else DASH,
                    as_short(numbers(group, "resolution").mean),
                )
            )
        large = sum(cell.marked for row in rows for cell in row)
        blocks = [
            Figure(
                "protocol",
                f"Packing fraction and coordination number of {count_of(results):,} spheres with "
                "one value of the protocol changed at a time; error bars: standard error.",
                [
                    Panel(
                        "protocol",
                        text,
                        [_dots(groups, name)],
                        ticks=labels,
                        references=[("standard", usual[name].mean)],
                    )
                    for name, text in (
                        ("packing_fraction", "packing fraction"),
                        ("coordination_number", "coordination number"),
                    )
                ],
            ),
            Table(
                "What the paper does not state: does the packing depend on it?",
                (
                    "time step h",
                    "random force",
                    "drag",
                    "runs",
                    "φ [%]",
                    "difference [SE]",
                    "z",
                    "difference [SE]",
                    "ε / (g h²)",
                ),
                rows,
                (
                    "Mean ± standard deviation (standard error). Differences from the first row, "
                    "in standard errors of the difference; marked: more than 2.",
                ),
            ),
            Text(
                f"{large} of {2 * (len(rows) - 1)} differences are above two standard errors; by "
                f"chance alone about {0.05 * 2 * (len(rows) - 1):.1f} would be."
            ),
        ]
    return section("protocol", "Time step, random force and drag", blocks, (), ("protocol",))


_WORDS = {"dt": "h =", "random_force": "random force", "drag": "drag"}


def _apart(one: Sample, other: Sample) -> float:
    return difference_in_errors(one, Stated(other.mean, other.error))


def _dots(groups: dict[tuple[object, ...], list[Result]], name: str) -> Curve:
    found = [numbers(group, name) for group in groups.values()]
    return curve(
        name.replace("_", " "),
        np.arange(len(found)),
        [one.mean for one in found],
        [one.error for one in found],
        "apart",
    )


def _checks(data: Data) -> Section:
    rows = []
    for study in data.studies.values():
        for label, group in labelled(study.results).items():
            deck = str(group[0].record["deck"])
            tolerance = _loosest(group[0])
            overlap = max((_overlap(r) for r in group), default=math.nan)
            allowed = ALLOWED_OF_BODIES if deck != "spheres" and "response" not in deck else 1.0
            ratio = overlap / tolerance
            resolution = numbers(group, "resolution").mean
            rows.append(
                cells(
                    study.name,
                    label,
                    len(group),
                    as_short(tolerance),
                    as_short(overlap),
                    # A hair: both are rounded numbers of different programs.
                    Cell(as_text(ratio, 3), marked=ratio > allowed * (1 + 1e-6)),
                    as_sample(numbers(group, "coordination_number"), 3),
                    Cell(as_short(resolution), marked=resolution > 0.0101),
                )
            )
    blocks: list[Block] = []
    if rows:
        blocks = [
            Table(
                "Largest overlap at any step of any run, and how well contacts are resolved",
                (
                    "study",
                    "case",
                    "runs",
                    "ε / r",
                    "largest overlap / r",
                    "overlap / ε",
                    "z",
                    "ε / (g h²)",
                ),
                rows,
                (
                    "ε: the loosest of a run. Marked: an overlap of more than ε (2 ε for bodies "
                    "that turn), or a count whose ε / (g h²) is above 0.01.",
                ),
            )
        ]
    return Section(
        "checks",
        "Overlap and resolution of every case",
        blocks or [Text("No study has results.", missing=True)],
    )


def _loosest(result: Result) -> float:
    names = ("tolerance", "tolerance_agitated", "tolerance_measuring")
    values = [float(result.variables[name]) for name in names if name in result.variables]
    return max(values, default=math.nan)


def _overlap(result: Result) -> float:
    whole = result.number("largest_overlap_of_all_steps")
    return whole if not math.isnan(whole) else result.number("largest_overlap")
