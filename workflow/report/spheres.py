"""The tables and figures of the paper's section 2, about spheres."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from lammps_inelastic.analysis import AnalysisError, mueller_packing_fraction, plateau

from ..store import Result
from .blocks import (
    DASH,
    NOT_RUN,
    Block,
    Cell,
    Comparison,
    Section,
    Table,
    Text,
    as_difference,
    as_sample,
    as_short,
    as_text,
    cells,
    missing,
)
from .data import (
    OUR_SOLVER,
    PAPER_SOLVER,
    SPHERES,
    Data,
    by_size,
    count_of,
    deck_defaults,
    nearest_size,
    profiles,
    series,
    solver_of,
    unlike,
)
from .figures import Curve, Figure, Panel, Pictures, curve
from .statistics import (
    Stated,
    grouped,
    matching,
    mean_curve,
    numbers,
    root_mean_square_difference,
    sample,
)

# Of the final mean, as the paper says of its two curves.
BAND_OF_PHI, BAND_OF_Z = 0.001, 0.0005

# Columns of Table 1 that `_beside` fills, twice
BESIDE_EACH_OTHER = (
    *("φ, paper [%]", "φ, ours [%]", "difference [SE]"),
    *("z, paper", "z, ours", "difference [SE]"),
)
# Of a packing fraction of the nine runs of 1,000 spheres
CHANCE = "chance in few runs: see Table 1 with more seeds"


def spheres_sections(data: Data) -> list[Section]:
    """Return the sections in the order of the paper."""
    return [
        _figure_4(data),
        _figure_5(data),
        _table_1(data),
        _agitated(data),
        _table_2(data),
        _figure_6(data),
        _figure_7(data),
        _figure_8(data),
    ]


def step_pictures(results: Sequence[Result], name: str, caption: str) -> list[Block]:
    """Return the pictures of the first result that has any, in the order of their steps."""
    for result in results:
        steps = sorted(step for step in result.pictures if step.isdigit())
        if steps:
            shown = {f"step {int(step):,}": result.pictures[step] for step in steps}
            return [Pictures(name, caption, shown)]
    return []


def _figure_4(data: Data) -> Section:
    results = data.results("figure-4")
    blocks: list[Block] = []
    if results:
        blocks += step_pictures(
            results,
            "figure-4",
            f"{count_of(results):,} spheres fall; the colour is the number of contacts. The paper "
            "shows four steps of 100,000 spheres and does not say which.",
        )
    return _section("figure-4", "Figure 4: spheres fall", blocks, (), "figure-4")


def _figure_5(data: Data) -> Section:
    stated = data.paper["protocol"]
    with_frames = [r for r in data.results("table-2") if series(r, "evolution/step") is not None]
    results = nearest_size(with_frames, 10_000)
    blocks: list[Block] = []
    if results:
        curves: dict[str, list[Curve]] = {"packing_fraction": [], "coordination_number": []}
        rows = []
        for result in results:
            label = f"seed {result.variables.get('seed', DASH)}"
            row = [f"{count_of([result]):,}", label]
            for name, band in (
                ("packing_fraction", BAND_OF_PHI),
                ("coordination_number", BAND_OF_Z),
            ):
                steps = series(result, "evolution/step")
                values = series(result, f"evolution/{name}")
                assert steps is not None
                assert values is not None
                curves[name].append(curve(label, steps, values))
                row += _plateau(steps, values, band)
            rows.append(cells(*row))
        moments = [
            ("paper: plateau", float(stated["plateau_reached_at_step"])),
            ("paper: constant", float(stated["plateau_step"])),
        ]
        off = results[0].variables.get("steps_agitated")
        if off is not None:
            moments.append(("random force off", float(off)))
            if "steps_settling" in results[0].variables:
                count = off + results[0].variables["steps_settling"]
                moments.append(("smaller ε, count", float(count)))
        blocks = [
            Figure(
                "figure-5",
                f"Packing fraction and coordination number in the box against the step, "
                f"{count_of(results):,} spheres. The two steps that the paper names are those of "
                "its own code.",
                [
                    Panel("step", "packing fraction", curves["packing_fraction"], moments=moments),
                    Panel(
                        "step",
                        "coordination number",
                        curves["coordination_number"],
                        moments=moments,
                    ),
                ],
            ),
            Table(
                "From which step on the packing stays as it is",
                (
                    "spheres",
                    "run",
                    f"φ within ±{BAND_OF_PHI:.1%} from step",
                    "mean φ [%]",
                    f"z within ±{BAND_OF_Z:.2%} from step",
                    "mean z",
                ),
                rows,
                (
                    "The mean is that of the last quarter of the frames. Dash: not even the last "
                    "frame.",
                ),
            ),
            Text(
                f"Paper: a plateau after about {stated['plateau_reached_at_step']} steps; from "
                f"step {stated['plateau_step']} on φ is constant within 0.1 % and z within 0.05 %. "
                "A step of the paper's code and one of ours need not last the same time, and "
                "nothing states how long the paper's is: the shapes can be compared, the numbers "
                "of steps cannot. z is that of single frames, and until the count it is taken with "
                "the larger ε, with which single frames scatter."
            ),
        ]
    return _section("figure-5", "Figure 5: the packing comes to rest", blocks, (), "table-2")


def _plateau(steps: np.ndarray, values: np.ndarray, band: float) -> tuple[str, str]:
    decimals, factor = (2, 100) if band == BAND_OF_PHI else (3, 1)
    try:
        found = plateau(steps, values, band=band)
    except AnalysisError:  # NaN at the end: an empty box
        return DASH, DASH
    when = DASH if found.step is None else f"{found.step:,}"
    return when, as_text(found.mean * factor, decimals)


def _table_1(data: Data) -> Section:
    results = data.results("table-1")
    rows: list[list[Cell]] = []
    comparisons: list[Comparison] = []
    seen: set[str] = set()
    for stated in data.paper["table1"]:
        tolerance, force = stated["eps_over_r"], stated["random_force"]
        matched = _of_row(results, stated)
        seen |= {result.case for result in matched}
        for solver, group in (grouped(matched, solver_of) or {OUR_SOLVER: []}).items():
            pair = _of_table_1(stated, solver, group)
            if group:
                comparisons += pair
            rows.append(
                cells(as_short(tolerance), "yes" if force else "no", solver)
                + cells(len(group) or NOT_RUN)
                + [cell for one in pair for cell in _beside(one)]
                + cells(as_short(numbers(group, "resolution").mean))
            )
    others = [result for result in results if result.case not in seen]
    for key, group in grouped(others, _tolerance_and_force).items():
        phi, z = (
            numbers(group, "packing_fraction").scaled(100),
            numbers(group, "coordination_number"),
        )
        rows.append(
            cells(as_short(key[0]), as_short(key[1]), solver_of(group[0]), len(group))
            + cells(DASH, as_sample(phi, 2), DASH, DASH, as_sample(z, 3), DASH)
            + cells(as_short(numbers(group, "resolution").mean))
        )
    blocks: list[Block] = []
    if results:
        blocks = [
            Table(
                "1,000 spheres, d = 0.11; mean ± standard deviation (standard error of our mean)"
                if count_of(results) == 1000
                else f"{count_of(results):,} spheres; the paper has 1,000",
                (
                    "ε / r",
                    "random force",
                    "solver",
                    "runs",
                    *BESIDE_EACH_OTHER,
                    "ε / (g h²)",
                ),
                rows,
                (
                    "SE: standard errors, sqrt(ours² + the paper's²); the paper's is its standard "
                    "deviation over the root of 9 runs. Marked: more than 2.",
                    f"Solver: {PAPER_SOLVER} is the paper's, {OUR_SOLVER} ours. Within a loose ε "
                    "they may leave different contacts.",
                    "ε / (g h²), with ε that of the count, says how well a contact is told from a "
                    "gap: in a step a free sphere falls g h². It should be at most 0.01; above it, "
                    "what counts as a contact depends on ε.",
                ),
            )
        ]
    more, more_compared = _more_seeds(data)
    blocks += more
    comparisons += more_compared
    return _section(
        "table-1",
        "Table 1: tolerance and random force",
        blocks,
        comparisons,
        "table-1",
        "more-seeds",
    )


def _of_row(results: Sequence[Result], stated: Mapping[str, Any]) -> list[Result]:
    """Return the results with the tolerance and the random force of a row of Table 1."""
    return [
        result
        for result in matching(results, tolerance=stated["eps_over_r"])
        if (result.variables.get("random_force", 0) > 0) == stated["random_force"]
    ]


def _more_seeds(data: Data) -> tuple[list[Block], list[Comparison]]:
    """Compare rows of the paper's Table 1 with more runs of our own than it has."""
    results = data.results("more-seeds")
    rows: list[list[Cell]] = []
    comparisons: list[Comparison] = []
    for stated in data.paper["table1"]:
        group = _of_row(results, stated)
        if not group:
            continue
        pair = _of_table_1(stated, OUR_SOLVER, group, f", {len(group)} seeds")
        comparisons += pair
        rows.append(
            cells(
                as_short(stated["eps_over_r"]),
                "yes" if stated["random_force"] else "no",
                len(group),
            )
            + [cell for one in pair for cell in _beside(one)]
        )
    if not rows:
        return [], []
    table = Table(
        "The same with more seeds",
        ("ε / r", "random force", "runs", *BESIDE_EACH_OTHER),
        rows,
        ("The runs of the table above are among these.",),
    )
    return [table], comparisons


def _of_table_1(
    stated: Mapping[str, Any], solver: str, group: Sequence[Result], seeds: str = ""
) -> tuple[Comparison, Comparison]:
    """Compare packing fraction and coordination number with a row of the paper's Table 1."""
    words = f"ε = {as_short(stated['eps_over_r'])} r, "
    words += f"{'with' if stated['random_force'] else 'no'} random force"
    if solver != OUR_SOLVER:
        words += f", {solver}"
    words += seeds
    phi, z = stated["phi_percent"], stated["z"]
    note = unlike(group, 1000, 0 if seeds else 9)
    return (
        Comparison(
            f"φ, {words}",
            Stated.of_series(phi["mean"], phi["std"], 9),
            numbers(group, "packing_fraction").scaled(100),
            2,
            "%",
            note,
            "" if seeds else CHANCE,
        ),
        Comparison(
            f"z, {words}",
            Stated.of_series(z["mean"], z["std"], 9),
            numbers(group, "coordination_number"),
            3,
            "",
            note,
            f"at a loose ε the count is the solver's: {PAPER_SOLVER} is the paper's"
            if solver == OUR_SOLVER
            else "",
        ),
    )


def _tolerance_and_force(result: Result) -> tuple[float, float, str]:
    values = result.variables
    return (
        float(values.get("tolerance", math.nan)),
        float(values.get("random_force", math.nan)),
        solver_of(result),
    )


def _beside(one: Comparison) -> list[Cell]:
    """Return the cells of a comparison with a series: paper, ours, difference."""
    paper = f"{as_text(one.stated.value, 2)} ± {as_short(one.stated.std)}"
    return [Cell(paper), Cell(as_sample(one.ours, one.decimals)), as_difference(one.difference)]


def _agitated(data: Data) -> Section:
    usual = deck_defaults(SPHERES)
    results = [
        result
        for name in ("table-1", "table-2", "protocol")
        for result in data.results(name)
        if result.variables.get("random_force", 0) > 0
        and all(result.variables.get(name) == usual.get(name) for name in ("dt", "drag"))
        and not math.isnan(result.number("coordination_number_agitated"))
    ]
    # Some cases are in both studies.
    results = list({result.case: result for result in results}.values())
    rows = []
    comparisons: list[Comparison] = []
    groups = grouped(
        results,
        lambda r: (
            count_of([r]),
            float(r.variables.get("diameter", math.nan)),
            float(r.variables.get("tolerance", math.nan)),
            solver_of(r),
            float(r.variables.get("random_force", math.nan)),
        ),
    )
    for (particles, diameter, tolerance, solver, force), group in sorted(groups.items()):
        drop = sample(
            r.number("coordination_number") - r.number("coordination_number_agitated")
            for r in group
        )
        rows.append(
            cells(
                f"{particles:,}",
                as_short(diameter),
                as_short(tolerance),
                solver,
                as_short(force),
                len(group),
                as_sample(numbers(group, "coordination_number_agitated"), 3),
                as_sample(numbers(group, "coordination_number"), 3),
                as_sample(drop, 3),
            )
        )
        as_in_the_paper = tolerance == data.paper["protocol"]["default_eps_over_r"]
        if solver == OUR_SOLVER and as_in_the_paper and force == usual.get("random_force"):
            comparisons.append(
                Comparison(
                    f"z at rest less z while agitated, {particles:,} spheres",
                    Stated(0.5),
                    drop,
                    2,
                    "",
                    "the paper says about 0.5, and not how strong its random force is",
                    "it depends on that, and on the number of spheres: see the section on it",
                )
            )
    blocks: list[Block] = []
    if rows:
        blocks = [
            Table(
                "Coordination number while the random force acts, and at rest",
                (
                    "spheres",
                    "d",
                    "ε / r",
                    "solver",
                    "random force",
                    "runs",
                    "z agitated",
                    "z at rest",
                    "difference",
                ),
                rows,
                (
                    "Mean ± standard deviation (standard error) over the runs. Agitated: mean over "
                    "the second half of the phase with random force.",
                ),
            ),
            Text(
                "Paper: with the random force the coordination number is too small by about 0.5. "
                "How much it is depends on how strong the force is, which the paper does not "
                "state. While the spheres are agitated the count is made with the larger tolerance."
            ),
        ]
    return _section(
        "agitated",
        "Contacts while agitated and at rest",
        blocks,
        comparisons,
        "table-1",
        "table-2",
        "protocol",
    )


def _of_table_2(data: Data, stated: Mapping[str, Any]) -> Stated:
    """Return a packing fraction of the paper's Table 2, with its scatter where Table 1 has it."""
    for row in data.paper["table1"] if stated["spheres"] == 1000 else ():
        phi = row["phi_percent"]
        same = row["eps_over_r"] == stated["eps_over_r"] and row["random_force"]
        if same and round(phi["mean"], 1) == stated["phi_percent"]:
            return Stated.of_series(phi["mean"], phi["std"], stated["runs"])
    return Stated(stated["phi_percent"])


def _table_2(data: Data) -> Section:
    results = data.results("table-2")
    rows = []
    comparisons: list[Comparison] = []
    seen: set[str] = set()
    for stated in data.paper["table2"]:
        group = matching(
            results,
            particles=stated["spheres"],
            diameter=stated["diameter"],
            tolerance=stated["eps_over_r"],
        )
        seen |= {result.case for result in group}
        one = Comparison(
            f"φ, {stated['spheres']:,} spheres",
            _of_table_2(data, stated),
            numbers(group, "packing_fraction").scaled(100),
            2,
            "%",
            unlike(group, stated["spheres"], stated["runs"]),
            CHANCE,
        )
        if group:
            comparisons.append(one)
        rows.append(
            cells(
                f"{stated['spheres']:,}",
                as_short(stated["diameter"]),
                as_short(stated["eps_over_r"]),
                stated["runs"],
                len(group) or NOT_RUN,
                as_text(stated["phi_percent"], 1),
                as_sample(one.ours, 2),
                as_difference(one.difference),
                as_sample(numbers(group, "coordination_number"), 3),
                as_short(numbers(group, "resolution").mean),
            )
        )
    others = [result for result in results if result.case not in seen]
    for (particles, diameter), group in by_size(others).items():
        for tolerance, part in grouped(group, lambda r: r.variables.get("tolerance")).items():
            rows.append(
                cells(
                    f"{int(particles):,}",
                    as_short(diameter),
                    as_short(float(tolerance or math.nan)),
                    DASH,
                    len(part),
                    DASH,
                    as_sample(numbers(part, "packing_fraction").scaled(100), 2),
                    DASH,
                    as_sample(numbers(part, "coordination_number"), 3),
                    as_short(numbers(part, "resolution").mean),
                )
            )
    bulk = _bulk(results)
    blocks: list[Block] = []
    if results:
        whole = data.paper["spheres"]["phi_percent"]
        if bulk:
            comparisons.append(
                Comparison(
                    "φ in bulk, spheres",
                    Stated(whole["value"], whole["tolerance"]),
                    numbers(bulk, "packing_fraction").scaled(100),
                    2,
                    "%",
                    unlike(bulk, 10_000),
                )
            )
        blocks = [
            Table(
                "Packing fraction against the number of spheres",
                (
                    "spheres",
                    "d",
                    "ε / r",
                    "runs, paper",
                    "runs, ours",
                    "φ, paper [%]",
                    "φ, ours [%]",
                    "difference [SE]",
                    "z, ours",
                    "ε / (g h²)",
                ),
                rows,
                (
                    "Ours: mean ± standard deviation (standard error). The paper gives no scatter "
                    "here, but for 1,000 spheres in its Table 1; elsewhere the difference is in "
                    "our standard errors alone. A single run has none, two give it roughly.",
                ),
            ),
            Text(
                f"Paper: {whole['value']} ± {whole['tolerance']} % in bulk, hardly any change from "
                "10,000 spheres on; few spheres pack less, because the walls are near."
            ),
        ]
    return _section("table-2", "Table 2: number of spheres", blocks, comparisons, "table-2")


def _bulk(results: Sequence[Result]) -> list[Result]:
    """Return the runs of 10,000 spheres, or of the most that there are."""
    return nearest_size(results, 10_000)


def _figure_6(data: Data) -> Section:
    width = float(data.paper["protocol"]["container"][0])
    results = [r for r in data.results("table-2") if "profile/distance" in r.values]
    if not matching(results, diameter=0.11):
        # The same cases, in the other study.
        more = matching(data.results("table-1"), diameter=0.11, tolerance=0.0005)
        results += [r for r in more if r.variables.get("random_force", 0) > 0]
    groups = {size: found for size, group in by_size(results).items() if (found := profiles(group))}
    blocks: list[Block] = []
    if groups:
        means = {size: mean_curve(found) for size, found in groups.items()}
        labels = {
            size: f"d = {as_short(size[1])} ({int(size[0]):,} spheres, {_runs(len(groups[size]))})"
            for size in groups
        }
        curves = [curve(labels[size], *means[size], kind="profile") for size in groups]
        reach = max(float(x[-1]) for x, _, _ in means.values())
        along = np.linspace(0, reach, 400)
        curves.append(curve("Mueller, infinite width", along, mueller_packing_fraction(along)))
        narrowest = max(size[1] for size in groups)
        if width / narrowest >= 2.02:
            curves.append(
                curve(
                    f"Mueller, D = {as_short(width / narrowest)} d",
                    along,
                    mueller_packing_fraction(along, width / narrowest),
                )
            )
        blocks = [
            Figure(
                "figure-6",
                "Packing fraction in slabs at the distance of their middle from the wall x = 0, "
                "over the diameter; bands: one standard error over the runs. Mueller (1992): "
                "empirical, for cylinders; the narrow one is that whose width over d is the "
                "container's for the largest spheres.",
                [Panel("distance from the wall / d", "packing fraction", curves)],
            ),
            _collapse_table(means, labels),
            _mueller_table(means, labels, width),
            Text(
                "Paper: a damped oscillation; the curves of the three diameters collapse; "
                "Mueller's formula for infinite width agrees, the one for finite width less so. "
                + _mueller_verdict(means, width)
            ),
        ]
    return _section("figure-6", "Figure 6: packing fraction near a wall", blocks, (), "table-2")


_Means = dict[tuple[float, float], tuple[np.ndarray, np.ndarray, np.ndarray | None]]


def _collapse_table(means: _Means, labels: dict[tuple[float, float], str]) -> Table:
    rows = []
    for one, other in combinations(means, 2):
        apart = root_mean_square_difference(means[one][:2], means[other][:2])
        last = min(float(means[one][0][-1]), float(means[other][0][-1]))
        rows.append(cells(labels[one], labels[other], as_text(last, 2), as_text(apart, 4)))
    notes = [
        f"Root mean square of the standard error of {labels[size]}: "
        f"{float(np.sqrt(np.mean(error**2))):.4f}."
        for size, (_, _, error) in means.items()
        if error is not None
    ]
    return Table(
        "Do the curves collapse?",
        ("curve", "and curve", "up to [d]", "root mean square difference in φ"),
        rows,
        notes,
    )


def _mueller_apart(mean: tuple[np.ndarray, np.ndarray], width: float | None) -> float:
    x, y = mean
    if width is not None and width < 2.02:
        return math.nan
    return float(np.sqrt(np.mean((y - mueller_packing_fraction(x, width)) ** 2)))


def _mueller_table(means: _Means, labels: dict[tuple[float, float], str], width: float) -> Table:
    rows = []
    for size, mean in means.items():
        ratio = width / size[1]
        rows.append(
            cells(
                labels[size],
                as_text(_mueller_apart(mean[:2], None), 4),
                as_short(ratio),
                as_text(_mueller_apart(mean[:2], ratio), 4),
            )
        )
    return Table(
        "Root mean square difference in φ from Mueller's formula",
        ("curve", "infinite width", "D / d", "of this width"),
        rows,
        (
            "The constants of the formula could not be compared with Mueller's article: see "
            "mueller_packing_fraction in analysis/profile.py.",
        ),
    )


def _mueller_verdict(means: _Means, width: float) -> str:
    nearer = [
        _mueller_apart(mean[:2], None) < _mueller_apart(mean[:2], width / size[1])
        for size, mean in means.items()
        if width / size[1] >= 2.02
    ]
    return f"Ours: infinite width agrees better for {sum(nearer)} of {len(nearer)} diameters."


def _figure_7(data: Data) -> Section:
    stated = data.paper["spheres"]
    runs = [r for r in data.results("table-2") if series(r, "distribution/contacts") is not None]
    results = nearest_size(runs, 10_000)
    blocks: list[Block] = []
    comparisons: list[Comparison] = []
    if results:
        never = stated["z_never"]
        curves = []
        rows = []
        for result in results:
            shares = np.asarray(result.values["distribution/contacts"], dtype=float)
            label = f"seed {result.variables.get('seed', DASH)}"
            curves.append(curve(label, np.arange(len(shares)), shares, kind="distribution"))
            spheres = result.number("particles_in_box")
            found = [float(shares[k]) if k < len(shares) else 0.0 for k in never]
            rows.append(
                cells(
                    label,
                    f"{spheres:,.0f}",
                    as_text(result.number("coordination_number"), 3),
                    int(np.argmax(shares)),
                    *(Cell(as_text(share * spheres, 1), marked=share > 0) for share in found),
                )
            )
        mean = numbers(results, "coordination_number")
        comparisons.append(
            Comparison(
                "z, spheres",
                Stated(stated["z"]["value"], stated["z"]["tolerance"]),
                mean,
                3,
                "",
                unlike(results, 10_000),
            )
        )
        blocks = [
            Figure(
                "figure-7",
                f"Share of the spheres in the box with so many contacts, {count_of(results):,} "
                f"spheres, {_runs(len(results))}.",
                [Panel("number of contacts", "share of spheres", curves)],
            ),
            Table(
                "Numbers of contacts, mean over the frames of the count",
                (
                    "run",
                    "spheres in the box",
                    "mean z",
                    "most probable",
                    *tuple(f"spheres with {k}" for k in never),
                ),
                rows,
            ),
            Text(
                f"Paper: z = {stated['z']['value']:.2f} ± {stated['z']['tolerance']}; most "
                f"probable {stated['z_most_probable']}; no sphere with {_list(never)}. "
                + (
                    "Ours: none either."
                    if not any(cell.marked for row in rows for cell in row)
                    else "Ours: such spheres are marked in the table."
                )
            ),
        ]
    return _section(
        "figure-7", "Figure 7: distribution of contacts", blocks, comparisons, "table-2"
    )


def _figure_8(data: Data) -> Section:
    blocks: list[Block] = []
    for result in data.results("figure-8"):
        if "network" in result.pictures:
            blocks = [
                Pictures(
                    "figure-8",
                    f"Contacts of {count_of([result]):,} spheres, lower half of the packing; width "
                    "and colour grow with the force.",
                    {"": result.pictures["network"]},
                    trimmed=True,
                )
            ]
            break
    return _section("figure-8", "Figure 8: network of contacts", blocks, (), "figure-8")


def _section(
    anchor: str,
    title: str,
    blocks: Sequence[Block],
    comparisons: Sequence[Comparison],
    *studies: str,
) -> Section:
    return section(anchor, title, blocks, comparisons, studies)


def section(
    anchor: str,
    title: str,
    blocks: Sequence[Block],
    comparisons: Sequence[Comparison],
    studies: Sequence[str],
) -> Section:
    """Return a section, with a note in it if there is nothing to show."""
    return Section(anchor, title, blocks or [missing(studies[0])], tuple(comparisons), studies)


def _runs(count: int) -> str:
    return f"{count} run{'' if count == 1 else 's'}"


def _list(values: Sequence[int]) -> str:
    return ", ".join(map(str, values[:-1])) + f" or {values[-1]}"
