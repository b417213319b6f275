"""The figures of the paper's section 3, about dimers: two overlapping spheres each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from lammps_inelastic.analysis.plots import draw_dimer, draw_dimer_section

from ..store import Result
from .blocks import (
    DASH,
    Block,
    Cell,
    Comparison,
    Section,
    Table,
    Text,
    as_sample,
    as_short,
    as_text,
    cells,
)
from .data import SPHERES, Data, by_size, count_of, profiles, unlike
from .figures import Curve, Figure, Panel, curve
from .spheres import section, step_pictures
from .statistics import (
    FloatArray,
    Sample,
    Stated,
    by_value,
    grouped,
    mean_curve,
    mean_distribution,
    numbers,
    peak,
    pooled_numbers,
    root_mean_square_difference,
    sample,
)

POOLED = (
    "Mean ± standard deviation (standard error); the standard deviation of rows of fewer than four "
    "runs is that of all rows, pooled."
)
# Of the dimer that is drawn.
DRAWN = 1.8
ByAspect = Mapping[float, Sequence[Result]]


def dimers_sections(data: Data) -> list[Section]:
    """Return the sections in the order of the paper."""
    groups = by_aspect(data)
    return [
        _figure_9(),
        _figure_10(data),
        _anisotropy(data, groups),
        _agitation(data),
        _figure_11(data, groups),
        _figure_12(data, groups),
        _figure_13(data, groups),
        _figure_14(data, groups),
    ]


def by_aspect(data: Data) -> ByAspect:
    """Return the results of the study of dimers by aspect ratio; spheres at 1."""
    groups = grouped(data.results("dimers"), _aspect)
    groups.pop(math.nan, None)
    return dict(sorted(groups.items()))


def _aspect(result: Result) -> float:
    if result.record["deck"] == SPHERES:
        return 1.0
    return float(result.variables.get("aspect_ratio", math.nan))


def _true_dimers(groups: ByAspect) -> ByAspect:
    return {aspect: group for aspect, group in groups.items() if aspect > 1}


def _figure_9() -> Section:
    return Section(
        "figure-9",
        "Figure 9: one dimer",
        [
            Figure(
                "figure-9",
                f"A dimer of aspect ratio L/d = {DRAWN}: two overlapping spheres of diameter d, L "
                "long. Right: its section, with the neck (hatched), the volume at the waist that "
                "no sphere of the same size (dashed) can reach.",
                drawing=[
                    partial(draw_dimer, aspect_ratio=DRAWN),
                    partial(draw_dimer_section, aspect_ratio=DRAWN),
                ],
            ),
            Text("Drawn from the formulas; no run is needed."),
        ],
    )


def _figure_10(data: Data) -> Section:
    results = data.results("figure-10")
    blocks: list[Block] = []
    if results:
        variables = results[0].variables
        blocks += step_pictures(
            results,
            "figure-10",
            f"{count_of(results):,} dimers of L/d = "
            f"{as_short(variables.get('aspect_ratio', math.nan))} fall; the colour is the number "
            "of contacts. The paper shows four steps and does not say which.",
        )
    return section("figure-10", "Figure 10: dimers fall", blocks, (), ("figure-10",))


def _components(group: Sequence[Result], axis: str) -> Sample:
    """Return a_x, a_y or a_z over its isotropic value.

    Its standard error is that between the runs, or that which the number of dimers leaves if this
    is larger: two runs may agree by chance.
    """
    known = [result for result in group if not math.isnan(result.number(f"a_{axis}"))]
    found = sample(result.number(f"a_{axis}") / result.number("a_isotropic") for result in known)
    if not known:
        return found
    of_dimers = _error_of_a_run(known, axis)
    std = of_dimers if math.isnan(found.std) else max(found.std, of_dimers)
    return Sample(found.mean, std, found.n)


def _error_of_a_run(group: Sequence[Result], axis: str) -> float:
    """Return the standard error of one run that comes from its number of dimers."""
    return numbers(group, f"a_{axis}_error").mean / numbers(group, "a_isotropic").mean


def _compared(
    stated: Mapping[str, Any], aspect: float, group: Sequence[Result], words: str = ""
) -> list[Comparison]:
    """Compare a_x, a_y and a_z of runs with the paper's."""
    return [
        Comparison(
            f"a_{axis} over isotropic, L/d = {as_short(aspect)}{words}",
            Stated(stated[f"a_{axis}"] / stated["isotropic"], _error_of_a_run(group, axis)),
            _components(group, axis),
            3,
            "",
            f"paper prints L/d = {stated['stated_aspect_ratio']}; the numbers are those of "
            f"{stated['consistent_aspect_ratio']}; its error is taken to be that of one of our "
            "runs",
            "it depends on the random force: see the section on it",
        )
        for axis in "xyz"
    ]


def _anisotropy(data: Data, groups: ByAspect) -> Section:
    stated = data.paper["dimers"]["anisotropy"]
    dimers = {
        aspect: group
        for aspect, group in groups.items()
        if not math.isnan(numbers(group, "a_isotropic").mean)
    }
    consistent, printed = stated["consistent_aspect_ratio"], stated["stated_aspect_ratio"]
    rows = []
    comparisons: list[Comparison] = []
    for aspect, group in dimers.items():
        ratios = [_components(group, axis) for axis in "xyz"]
        absolute = [numbers(group, f"a_{axis}").mean for axis in "xyz"]
        rows.append(
            cells(
                as_short(aspect),
                len(group),
                *(as_text(a, 4) for a in absolute),
                as_text(numbers(group, "a_isotropic").mean, 4),
                *(f"{as_text(r.mean, 3)} ± {as_text(r.error, 3)}" for r in ratios),
            )
        )
        if aspect == consistent:
            comparisons += _compared(stated, aspect, group)
    blocks: list[Block] = []
    if rows:
        paper = [stated[f"a_{axis}"] for axis in "xyz"]
        rows.append(
            cells(
                f"paper, printed as {printed}",
                DASH,
                *(f"{a:.4f}" for a in paper),
                f"{stated['isotropic']:.4f}",
                *(f"{a / stated['isotropic']:.3f}" for a in paper),
            )
        )
        aspects = list(dimers)
        curves = []
        for axis in "xyz":
            ratios = [_components(dimers[aspect], axis) for aspect in aspects]
            curves.append(
                curve(
                    f"a_{axis}",
                    aspects,
                    [ratio.mean for ratio in ratios],
                    [ratio.error for ratio in ratios],
                    "points",
                )
            )
        blocks = [
            Figure(
                "anisotropy",
                "Root mean square of the components of the vector between the two spheres of a "
                "dimer, over what each would be if no direction was preferred. y is along gravity.",
                [
                    Panel(
                        "aspect ratio L/d",
                        "a / isotropic a",
                        curves,
                        references=[("isotropic", 1.0)],
                    )
                ],
            ),
            Table(
                "Orientation of dimers in the box",
                (
                    "L/d",
                    "runs",
                    "a_x",
                    "a_y",
                    "a_z",
                    "isotropic",
                    *tuple(f"a_{axis} / isotropic" for axis in "xyz"),
                ),
                rows,
                (
                    "± standard error: over the runs, or what the number of dimers leaves if that "
                    "is larger.",
                ),
            ),
            Text(
                "Paper: dimers lie down, a_y < a_x = a_z, and more so the longer they are. Its "
                f"four numbers are printed for L/d = {printed}, but a_x² + a_y² + a_z² is the "
                "square of the distance of the two centres, and theirs is that of L/d = "
                f"{consistent}: compare with that row. For {printed} the isotropic value is "
                f"{(printed - 1) * 0.052 / math.sqrt(3):.4f}, not {stated['isotropic']:.4f}."
            ),
        ]
    return section("anisotropy", "Orientation of dimers", blocks, comparisons, ("dimers",))


def _agitation(data: Data) -> Section:
    """Show the study of the random force, which the paper does not state, beside its numbers."""
    results = [r for r in data.results("dimers-agitation") if "random_force" in r.variables]
    stated = data.paper["dimers"]["anisotropy"]
    blocks: list[Block] = []
    comparisons: list[Comparison] = []
    consistent = stated["consistent_aspect_ratio"]
    aspect = results[0].variables.get("aspect_ratio", math.nan) if results else math.nan
    rows = []
    curves = []
    for (particles, _), of_size in by_size(results).items():
        groups = dict(sorted(grouped(of_size, by_value("random_force")).items()))
        if particles == data.paper["dimers"]["count"] and aspect == consistent:
            for force, group in groups.items():
                words = f", random force {as_short(force)}"
                comparisons += _compared(stated, consistent, group, words)
        ratios = {axis: [_components(group, axis) for group in groups.values()] for axis in "xyz"}
        rows += [
            cells(
                f"{particles:,.0f}",
                as_short(force),
                len(group),
                *(f"{as_text(r.mean, 3)} ± {as_text(r.error, 3)}" for r in lie),
                as_sample(numbers(group, "packing_fraction").scaled(100), 2),
                as_sample(numbers(group, "coordination_number"), 3),
            )
            for (force, group), *lie in zip(groups.items(), *ratios.values(), strict=True)
        ]
        curves += [
            curve(
                f"a_{axis}, {particles:,.0f} dimers",
                list(groups),
                [ratio.mean for ratio in of_axis],
                [ratio.error for ratio in of_axis],
                "points",
            )
            for axis, of_axis in ratios.items()
        ]
    if rows:
        blocks = [
            Figure(
                "dimers-agitation",
                f"As above for L/d = {as_short(aspect)}, against the largest random acceleration "
                "of a sphere. Lines: the paper's numbers.",
                [
                    Panel(
                        "random force",
                        "a / isotropic a",
                        curves,
                        references=[
                            (f"a_{axis}, paper", stated[f"a_{axis}"] / stated["isotropic"])
                            for axis in "xyz"
                        ],
                    )
                ],
            ),
            Table(
                "Orientation of dimers against the random force",
                (
                    "dimers",
                    "random force",
                    "runs",
                    *tuple(f"a_{axis} / isotropic" for axis in "xyz"),
                    "φ [%]",
                    "z",
                ),
                rows,
                ("± standard error; φ and z: mean ± standard deviation (standard error).",),
            ),
            Text(
                "The paper does not say how strong its random force is: compare where its numbers "
                "lie with how ours change."
            ),
        ]
    return section(
        "dimers-agitation",
        "Orientation of dimers and the random force",
        blocks,
        comparisons,
        ("dimers-agitation",),
    )


def _against(label: str, groups: ByAspect, name: str, kind: Any = "points") -> Curve:
    """Return a number against the aspect ratio, where it is known."""
    found = pooled_numbers(groups, name)
    known = {aspect: one for aspect, one in found.items() if one.n}
    return curve(
        label,
        list(known),
        [one.mean for one in known.values()],
        [one.error for one in known.values()],
        kind,
    )


def _top(one: Curve, reach: int) -> str:
    """Write where a curve is largest, with its standard error; see `peak`."""
    errors = [math.nan] * len(one.x) if one.error is None else one.error.tolist()
    place, error = peak(one.x.tolist(), one.y.tolist(), errors, reach)
    return f"{as_text(place, 2)} ± {as_text(error, 2)}"


def _figure_11(data: Data, groups: ByAspect) -> Section:
    stated = data.paper["dimers"]["phi_peak_at_aspect_ratio"]
    elsewhere = data.paper["elsewhere"]
    blocks: list[Block] = []
    if groups:
        raw = _against("raw", groups, "packing_fraction")
        necks = _against("with necks", groups, "packing_fraction_with_necks")
        ellipsoids = elsewhere["donev2004"]
        shown = [raw, necks] if len(necks.x) else [raw]
        shown.append(
            curve(
                "ellipsoids (Donev 2004)",
                [ellipsoids["ellipsoids_peak_aspect_ratio"]],
                [ellipsoids["ellipsoids_largest_phi"]],
                kind="apart",
            )
        )
        phi = pooled_numbers(groups, "packing_fraction")
        with_necks = pooled_numbers(groups, "packing_fraction_with_necks")
        rows = [
            cells(
                as_short(aspect) if aspect > 1 else "1 (spheres)",
                len(group),
                as_sample(phi[aspect].scaled(100), 2),
                as_sample(with_necks[aspect].scaled(100), 2),
            )
            for aspect, group in groups.items()
        ]
        said = [
            f"{label}, largest φ at L/d = {as_short(float(one.x[np.argmax(one.y)]))} "
            f"({as_text(100 * float(one.y.max()), 2)} %), by a parabola through it and one "
            f"neighbour to either side at {_top(one, 1)}, through two at {_top(one, 2)}"
            for label, one in (("raw", raw), ("with necks", necks))
            if len(one.x) > 4
        ]
        mean_field = elsewhere["baule2013"]
        blocks = [
            Figure(
                "figure-11",
                f"Packing fraction against aspect ratio, {count_of(list(groups.values())[-1]):,} "
                "particles; with necks: the volume at the waist that no sphere can reach counts as "
                "solid. Spheres at L/d = 1. Grey: largest packing fractions from mean-field theory "
                "(Baule et al. 2013); ellipsoids (Donev et al. 2004): largest, at its aspect "
                "ratio.",
                [
                    Panel(
                        "aspect ratio L/d",
                        "packing fraction",
                        shown,
                        references=[
                            ("dimers, theory", mean_field["dimers_largest_phi"]),
                            ("spherocylinders, theory", mean_field["spherocylinders_largest_phi"]),
                        ],
                    )
                ],
            ),
            Table(
                "Packing fraction against aspect ratio",
                ("L/d", "runs", "φ [%]", "φ with necks [%]"),
                rows,
                (POOLED,),
            ),
            Text(
                f"Paper: φ grows, and falls above about L/d = {stated}; the curve with necks looks "
                "alike and lies higher. Ours: "
                + ("; ".join(said) or "too few aspect ratios")
                + ". "
                f"Elsewhere: {mean_field['source']}; {ellipsoids['source']}."
            ),
        ]
    return section(
        "figure-11", "Figure 11: packing fraction against aspect ratio", blocks, (), ("dimers",)
    )


def _listed(data: Data, groups: ByAspect) -> ByAspect:
    """Return the aspect ratios that the paper's Figures 12 and 14 show."""
    wanted = data.paper["dimers"]["wall_profile_aspect_ratios"]
    return {aspect: group for aspect, group in groups.items() if aspect in wanted}


def _name(aspect: float) -> str:
    return "spheres" if aspect == 1 else f"L/d = {as_short(aspect)}"


def _figure_12(data: Data, groups: ByAspect) -> Section:
    found = {a: made for a, group in _listed(data, groups).items() if (made := profiles(group))}
    blocks: list[Block] = []
    if found:
        means = {aspect: mean_curve(made) for aspect, made in found.items()}
        blocks = [
            Figure(
                "figure-12",
                "Packing fraction in slabs at the distance of their middle from the wall x = 0, "
                "over the diameter of a sphere; bands: one standard error over the runs.",
                [
                    Panel(
                        "distance from the wall / d",
                        "packing fraction",
                        [curve(_name(a), *mean, kind="profile") for a, mean in means.items()],
                    )
                ],
            )
        ]
        if 1.0 in means:
            rows = [
                cells(
                    _name(aspect),
                    len(found[aspect]),
                    as_text(root_mean_square_difference(means[1.0][:2], mean[:2]), 4),
                    *(as_text(place, 2) for place in _turns(mean[0], mean[1])),
                )
                for aspect, mean in means.items()
            ]
            blocks.append(
                Table(
                    "How near each curve is to that of spheres",
                    (
                        "curve",
                        "runs",
                        "root mean square difference in φ",
                        "first minimum [d]",
                        "second maximum [d]",
                    ),
                    rows,
                )
            )
        blocks.append(
            Text(
                "Paper: near L/d = 1 the curve is that of spheres with a larger period; in between "
                "only the first period is clear; near 2 it is very close to that of spheres again. "
                + _closest(means)
            )
        )
    return section("figure-12", "Figure 12: dimers near a wall", blocks, (), ("dimers",))


def _turns(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return where the first minimum and the maximum after it are; the wall itself is none."""
    top = int(np.argmax(y[: max(1, int(np.searchsorted(x, 1.0)))]))
    falls = np.flatnonzero(np.diff(y[top:]) > 0)
    if len(falls) == 0:
        return math.nan, math.nan
    low = top + int(falls[0])
    rises = np.flatnonzero(np.diff(y[low:]) < 0)
    high = float(x[low + int(rises[0])]) if len(rises) else math.nan
    return float(x[low]), high


def _closest(means: Mapping[float, tuple[FloatArray, FloatArray, FloatArray | None]]) -> str:
    if 1.0 not in means or 1.95 not in means or len(means) < 3:
        return ""
    apart = {
        aspect: root_mean_square_difference(means[1.0][:2], mean[:2])
        for aspect, mean in means.items()
        if aspect > 1
    }
    order = sorted(apart, key=lambda aspect: apart[aspect])
    return f"Ours, from the nearest to spheres: {', '.join(_name(aspect) for aspect in order)}."


def _figure_13(data: Data, groups: ByAspect) -> Section:
    stated = data.paper["dimers"]
    per_particle = stated["contacts_per_particle"]
    value, tolerance = per_particle["value"], per_particle["tolerance"]
    blocks: list[Block] = []
    comparisons: list[Comparison] = []
    known = {a: group for a, group in groups.items() if numbers(group, "coordination_number").n}
    if known:
        rows = []
        firm = pooled_numbers(known, "coordination_number_without_rattlers")
        contacts = pooled_numbers(known, "coordination_number")
        touched = pooled_numbers(known, "neighbours")
        for aspect, group in known.items():
            z, neighbours = contacts[aspect], touched[aspect]
            outside = aspect > 1 and abs(z.mean - value) > tolerance
            rows.append(
                cells(
                    as_short(aspect) if aspect > 1 else "1 (spheres)",
                    len(group),
                    Cell(as_sample(z, 3), marked=outside),
                    as_sample(neighbours, 3),
                    as_short(numbers(group, "resolution").mean),
                    as_text(numbers(group, "rattlers").mean * 100, 2),
                    as_sample(firm[aspect], 3),
                )
            )
        dimers = [result for group in _true_dimers(known).values() for result in group]
        if dimers:
            comparisons.append(
                Comparison(
                    f"z of dimers, mean over {len(_true_dimers(known))} aspect ratios",
                    Stated(value, tolerance),
                    numbers(dimers, "coordination_number"),
                    3,
                    "",
                    unlike(dimers, stated["count"]),
                )
            )
        most = max(
            (numbers(group, "neighbours").mean for group in _true_dimers(known).values()),
            default=math.nan,
        )
        blocks = [
            Figure(
                "figure-13",
                "Contacts and neighbours of a particle against the aspect ratio; several contacts "
                "with one neighbour count apart. Shaded: the paper's range for dimers.",
                [
                    Panel(
                        "aspect ratio L/d",
                        "number per particle",
                        [
                            _against("contacts", known, "coordination_number"),
                            _against("neighbours", known, "neighbours"),
                        ],
                        bounds=(
                            f"paper: {value:g} ± {tolerance:g}",
                            value - tolerance,
                            value + tolerance,
                        ),
                    )
                ],
            ),
            Table(
                "Contacts and neighbours against aspect ratio",
                (
                    "L/d",
                    "runs",
                    "contacts z",
                    "neighbours",
                    "ε / (g h²)",
                    "rattlers [%]",
                    "z without rattlers",
                ),
                rows,
                (
                    f"{POOLED} Marked: outside {value:g} ± "
                    f"{tolerance:g}. Near L/d = 1 the two contacts of a dimer with a neighbour lie "
                    "close together, and only a tolerance well below ε = 0.005 (L/d - 1) r tells "
                    "both.",
                    "Rattlers: particles that carry nothing.",
                ),
            ),
            Text(
                f"Paper: z = {value:g} ± {tolerance:g} for every L/d above 1, twice the degrees of "
                "freedom, and 6 at L/d = 1: a jump. The number of neighbours grows from 6 without "
                f"a jump, falls again, and stays below {stated['neighbours_mean_below']}. Ours: at "
                f"most {as_text(most, 2)} neighbours in the mean."
            ),
        ]
    return section(
        "figure-13", "Figure 13: contacts and neighbours", blocks, comparisons, ("dimers",)
    )


def _figure_14(data: Data, groups: ByAspect) -> Section:
    stated = data.paper["dimers"]
    found = {
        aspect: group
        for aspect, group in _listed(data, groups).items()
        if any("distribution/contacts" in result.values for result in group)
    }
    blocks: list[Block] = []
    if found:
        panels = []
        rows: dict[float, list[Cell]] = {}
        for name, low, high in (
            ("contacts", *stated["contacts_range"]),
            ("neighbours", *stated["neighbours_range"]),
        ):
            curves = []
            for aspect, group in found.items():
                shares = [
                    np.asarray(result.values[f"distribution/{name}"], dtype=float)
                    for result in group
                    if f"distribution/{name}" in result.values
                ]
                mean, error = mean_distribution(shares)
                which = np.arange(len(mean))
                curves.append(curve(_name(aspect), which, mean, error, "distribution"))
                centre = float((which * mean).sum())
                width = math.sqrt(float(((which - centre) ** 2 * mean).sum()))
                filled = np.flatnonzero(mean > 0)
                beyond = float(mean[(which < low) | (which > high)].sum())
                rows.setdefault(aspect, cells(_name(aspect), len(group))).extend(
                    cells(
                        int(np.argmax(mean)),
                        as_text(width, 3),
                        f"{filled[0]} to {filled[-1]}",
                        as_text(beyond * 100, 3) if aspect > 1 else DASH,
                    )
                )
            panels.append(Panel(f"number of {name}", "share of particles", curves))
        contacts, neighbours = stated["contacts_range"], stated["neighbours_range"]
        blocks = [
            Figure(
                "figure-14",
                "Share of the particles in the box with so many contacts (left) and neighbours "
                "(right); error bars: standard error over the runs.",
                panels,
            ),
            Table(
                "Distributions",
                (
                    "curve",
                    "runs",
                    "contacts: most probable",
                    "contacts: standard deviation",
                    "contacts: from, to",
                    f"contacts: outside {contacts[0]} to {contacts[1]} [%]",
                    "neighbours: most probable",
                    "neighbours: standard deviation",
                    "neighbours: from, to",
                    f"neighbours: outside {neighbours[0]} to {neighbours[1]} [%]",
                ),
                list(rows.values()),
            ),
            Text(
                "Paper: the distribution of contacts is almost the same for all dimers, from "
                f"{contacts[0]} to {contacts[1]} in most runs and most probable at "
                f"{stated['contacts_most_probable']}, and {_narrower(data)}; neighbours range from "
                f"{neighbours[0]} to {neighbours[1]} and depend on the aspect ratio."
            ),
        ]
    return section(
        "figure-14", "Figure 14: distribution of contacts and neighbours", blocks, (), ("dimers",)
    )


def _narrower(data: Data) -> str:
    return (
        "slightly narrower for two curves, printed as d/L = 0.4 and 0.6 (perhaps L/d 1.4 and 1.6)"
    )
