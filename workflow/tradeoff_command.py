"""The subcommand `inelastic tradeoff`: how fast, how accurate, hard contacts beside soft ones."""

from __future__ import annotations

import argparse
import csv
import io
import math
import os
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from .decks import SETTLING, Rule, Value, as_value, find_deck, read_rule
from .errors import StudyError
from .files import is_file, whole
from .folder import Folder
from .launch import Options, run_study
from .progress import Display
from .store import Result, read_result, write_studies
from .study import MOST_CASES, Outputs, Study, is_word
from .study_commands import WIDEST, gathered, seconds, tell
from .tradeoff import (
    COMPARED,
    MEASURED,
    Comparison,
    Plan,
    Row,
    Run,
    compare,
    described,
    ratio_text,
    recommendations,
    runs_of,
)

STORE, ROWS, PAGE, FIGURE = "tradeoff.h5", "tradeoff.csv", "tradeoff.md", "tradeoff"
TITLE = "Time and accuracy of hard and soft contacts"
# Of a run only its result is kept: the dumps of many would fill a disk. Random points are not
# needed where the exact packing fraction is known.
OUTPUTS = Outputs(points=10_000, structure=False, keep="results")
NONE = "none"
MISSING = "-"


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    tradeoff = commands.add_parser(
        "tradeoff",
        help="measure time against accuracy, hard contacts beside LAMMPS's soft ones",
        description="Let the same starts settle with several tolerances, hard contacts and soft "
        "ones, one run at a time; print a table of time and accuracy and what to take, and write "
        f"it with a plot ({PAGE}, {ROWS}, {STORE}, {FIGURE}.png, {FIGURE}.svg). LIST is values "
        "with commas between them. It can be interrupted at any moment: the next time does what "
        "is left.",
    )

    def add(name: str, default: str | None, metavar: str, what: str) -> None:
        tradeoff.add_argument(
            name, default=default, metavar=metavar, help=what.format(default=default)
        )

    tradeoff.add_argument(
        "--out",
        type=Path,
        default=Path("tradeoff"),
        metavar="DIR",
        help="folder for all runs and results (default: tradeoff)",
    )
    add("--particle", "spheres", "WORD", "spheres or dimers (default: {default})")
    add("--particles", "1000", "N", "number of them in a random start (default: {default})")
    add("--diameter", "0.11", "D", "of a sphere; the container is 1 wide (default: {default})")
    add("--aspect-ratio", None, "A", "length of a dimer over its diameter (default: 1.5)")
    add(
        "--tolerances",
        "0.05,0.005,0.0005,0.00005,0.000005,0.0000005",
        "LIST",
        "largest overlaps of hard contacts, radii (default: 0.05 to 5e-7 in decades)",
    )
    add(
        "--soft-tolerances",
        "0.05,0.005,0.0005",
        "LIST",
        "largest overlaps of soft contacts at rest, about, radii; none: no soft contacts "
        "(default: {default})",
    )
    add("--dts", "0.01", "LIST", "longest time steps of hard contacts (default: {default})")
    add("--solvers", "apgd", "LIST", "of hard contacts: apgd, uzawa (default: {default})")
    add("--ranks", "1", "LIST", "MPI ranks; all is run with each number (default: {default})")
    add("--time", "3", "T", "time from the start to the end of a run (default: {default})")
    which = tradeoff.add_mutually_exclusive_group()
    which.add_argument(
        "--seeds", default="3", metavar="N", help="random starts, of seeds 1 to N (default: 3)"
    )
    which.add_argument(
        "--start",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="data files to start from, as the deck's variable start, in the place of seeds",
    )
    tradeoff.add_argument(
        "--timeout", type=seconds, help="give up a run after so many seconds (default: never)"
    )


def run(options: argparse.Namespace) -> int:
    """Run what is missing, print, write, draw; return the exit status."""
    plan = read_plan(options)
    runs = runs_of(plan)
    failed: dict[str, str] = {}
    elsewhere: list[str] = []
    results: list[tuple[Run, Result]] = []
    stored = []
    for ranks in plan.ranks:
        chosen = [one for one in runs if one.configuration.ranks == ranks]
        folder = Folder(options.out / f"ranks-{ranks}")
        cases = tuple(one.case for one in chosen)
        study = Study(folder.root.name, TITLE, command_line(plan), cases, OUTPUTS)
        with Display(len(cases)) as display:
            # One at a time: runs beside each other take each other's time.
            limits = Options(at_once=1, ranks=ranks, timeout=options.timeout)
            outcome = run_study(study, cases, folder, limits, display)
        tell(study, outcome)
        failed |= outcome.failed
        elsewhere += outcome.elsewhere
        results += [
            (one, read_result(folder.result(study, one.case)))
            for one in chosen
            if folder.is_measured(study, one.case)
        ]
        stored.append(gathered(study, folder))
    write_studies(options.out / STORE, stored)
    comparison = compare(results)
    notes = [f"left out: {name}: {reason}" for name, reason in failed.items()]
    notes += [f"left out: {name}: somebody else runs it" for name in elsewhere]
    notes += _not_at_rest(comparison)
    lines = [*notes, *recommendations(comparison)]
    _print(comparison, lines)
    _write(options.out / ROWS, as_csv(comparison))
    _write(options.out / PAGE, as_markdown(plan, comparison, lines))
    names = [STORE, ROWS, PAGE]
    if comparison.rows:
        # Here and not above: drawing takes a while to import.
        from .tradeoff_figure import draw_tradeoff

        names += [path.name for path in draw_tradeoff(comparison, options.out / FIGURE)]
    print(f"written: {', '.join(names)} in {options.out}")
    return 1 if failed else 0


def read_plan(options: argparse.Namespace) -> Plan:
    """Return what the options ask for.

    Raises StudyError with one line for every mistake.
    """
    mistakes: list[str] = []
    settling = find_deck(SETTLING, Path()).rules
    dimers = find_deck("dimers", Path()).rules

    def values_of(
        name: str, text: str, rule: Rule, *, several: bool = True, why: str = ""
    ) -> list[Any]:
        values = [as_value(word.strip()) for word in (text.split(",") if several else [text])]
        mistakes.extend(
            f"{name}: {value} is not allowed: it must be {rule.allowed}{why}"
            for value in values
            if not rule.accepts(value)
        )
        return list(dict.fromkeys(values))

    def value_of(name: str, text: str, rule: Rule) -> Any:
        (value,) = values_of(name, text, rule, several=False)
        return value

    particle = value_of("--particle", options.particle, settling["particle"])
    values: dict[str, Value] = {
        "diameter": value_of("--diameter", options.diameter, settling["diameter"]),
        "time_settling": value_of("--time", options.time, settling["time_settling"]),
    }
    if options.aspect_ratio is not None:
        ratio = value_of("--aspect-ratio", options.aspect_ratio, dimers["aspect_ratio"])
        values["aspect_ratio"] = ratio
        if particle != "dimers":
            mistakes.append("--aspect-ratio: only dimers have one (--particle dimers)")
    particles = value_of("--particles", options.particles, dimers["particles"])
    count = value_of("--seeds", options.seeds, read_rule(f"integer >= 1 <= {MOST_CASES}"))
    seeds: list[int] = []
    files: list[Path] = options.start or []
    for path in files:
        if not is_word(path.name):
            mistakes.append(
                f"--start: {path}: a file's name must be one word, without spaces, quotes, $ and &"
            )
        elif not is_file(path):
            mistakes.append(f"--start: {path}: no such file")
    if len({path.name for path in files}) < len(files):
        mistakes.append("--start: two files have the same name, which tells starts apart")
    words = dimers["start"].words
    mistakes += [
        f"--start: {path}: {path.name} is no name for a file"
        for path in files
        if path.name in words
    ]
    soft = options.soft_tolerances
    tolerances = values_of("--tolerances", options.tolerances, settling["tolerance"])
    soft_tolerances = (
        [] if soft == NONE else values_of("--soft-tolerances", soft, settling["tolerance"])
    )
    dts = values_of("--dts", options.dts, settling["dt"])
    solvers = values_of("--solvers", options.solvers, settling["solver"])
    most = read_rule(f"integer >= 1 <= {cores()}")
    ranks = values_of("--ranks", options.ranks, most, why=", the cores there are")
    if mistakes:
        raise StudyError(mistakes)
    if not files:
        # A data file says itself how many there are.
        values["particles"] = particles
        seeds = list(range(1, count + 1))
    return Plan(particle, values, files or seeds, tolerances, soft_tolerances, dts, solvers, ranks)


def cores() -> int:
    """Return how many cores there are for this process."""
    return len(os.sched_getaffinity(0))


def command_line(plan: Plan) -> str:
    """Return the command that asks for a plan."""

    def joined(values: Sequence[object]) -> str:
        return ",".join(f"{value}" for value in values)

    values = dict(plan.values)
    words = ["inelastic", "tradeoff", "--particle", plan.particle]
    words += ["--time", f"{values.pop('time_settling')}"]
    for name, value in values.items():
        words += [f"--{name.replace('_', '-')}", f"{value}"]
    files = [str(start) for start in plan.starts if isinstance(start, Path)]
    words += ["--start", *files] if files else ["--seeds", str(len(plan.starts))]
    words += ["--tolerances", joined(plan.tolerances)]
    words += ["--soft-tolerances", joined(plan.soft_tolerances) or NONE]
    words += ["--dts", joined(plan.dts), "--solvers", joined(plan.solvers)]
    words += ["--ranks", joined(plan.ranks)]
    return shlex.join(words)


def _number(form: str, name: str) -> Callable[[Row], str]:
    """Return what writes the median of a number."""

    def write(row: Row) -> str:
        value = row.median(name)
        return MISSING if math.isnan(value) else f"{value:{form}}"

    return write


def _at_rest(row: Row) -> str:
    return f"{len(row.values('plateau_time'))} of {len(row.outcomes)}"


# Head, and what it says of a row.
COLUMNS: Sequence[tuple[str, Callable[[Row], str]]] = (
    ("contacts", lambda row: row.configuration.contacts),
    ("solver", lambda row: row.configuration.solver or MISSING),
    ("tolerance / r", lambda row: f"{row.configuration.tolerance:g}"),
    ("dt", lambda row: MISSING if row.configuration.dt is None else f"{row.configuration.dt:g}"),
    ("ranks", lambda row: str(row.configuration.ranks)),
    ("at rest", _at_rest),
    ("overlap / r", _number(".2g", "overlap_at_rest")),
    ("falling", _number(".2g", "overlap_falling")),
    ("seconds", _number(".3g", "plateau_seconds")),
    ("time", _number(".2f", "plateau_time")),
    ("error of phi", _number(".4f", "packing_fraction_error")),
    ("of z", _number(".3f", "coordination_number_error")),
    ("of network", _number(".2f", "network_error")),
    ("complementarity / r", _number(".2g", "complementarity_at_rest")),
    ("drift", _number(".1e", "drift")),
    ("soft/hard time", lambda row: ratio_text(row.slower) if len(row.slower) else MISSING),
)
LEGEND = (
    "Medians over the starts. At rest: starts that came to rest within the run; the others have no "
    "time and no errors. Overlap: largest at rest, and before. Seconds: wall time until at rest; "
    "time: simulated. Errors: difference to the reference from the same start, of packing "
    "fraction (phi), contacts per particle (z) and contact forces (0: the same network, 2: no "
    "contact in common). Complementarity: largest gap under a force. Drift: of the centre of mass "
    "at the end, diameters per time."
)


def _heading(comparison: Comparison) -> list[str]:
    """Say what the errors are compared with, and from where on they mean something."""
    reference = comparison.reference()
    if reference is None:
        return []
    one = reference.configuration
    line = f"Reference: hard contacts, {one.solver}, {one.tolerance:g} r, dt {one.dt:g}."
    scatter = [comparison.scatter(name) for name in ("packing_fraction", "coordination_number")]
    if not math.isnan(scatter[0]):
        line += (
            f" Its scatter between starts (standard deviation): phi {scatter[0]:.4f}, "
            f"z {scatter[1]:.3f}."
        )
    return [line]


def _not_at_rest(comparison: Comparison) -> list[str]:
    """Say which runs did not come to rest, and how they still moved."""
    lines = []
    for row in comparison.rows:
        moving = [one for one in row.outcomes if math.isnan(one.numbers["plateau_time"])]
        if moving:
            one = row.configuration
            drift = max(each.numbers["drift"] for each in moving)
            lines.append(
                f"never at rest: {one.contacts}, {described(one, comparison)}, start "
                f"{', '.join(each.run.start for each in moving)} (drift at the end {drift:.1e}; a "
                "longer --time helps if the packing still sinks, not if it is shaken)"
            )
    return lines


def _print(comparison: Comparison, lines: Sequence[str]) -> None:
    console = Console(highlight=False)
    if comparison.rows:
        table = Table(box=None, pad_edge=False)
        for number, (head, _) in enumerate(COLUMNS):
            table.add_column(head, justify="left" if number < 2 else "right", no_wrap=True)
        for row in comparison.rows:
            table.add_row(*(Text(write(row)) for _, write in COLUMNS))
        # A line may be longer than the terminal is wide, but no column is cut.
        Console(highlight=False, width=WIDEST).print(table)
        lines = [*_heading(comparison), LEGEND, *lines]
    for line in lines:
        console.print(line, markup=False, soft_wrap=not console.is_terminal)


def as_markdown(plan: Plan, comparison: Comparison, lines: Sequence[str]) -> str:
    """Return the table and what it says as a page."""
    head = [name for name, _ in COLUMNS]
    rows = [[write(row) for _, write in COLUMNS] for row in comparison.rows]
    table = [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]
    parts = [
        f"# {TITLE}",
        f"`{command_line(plan)}`",
        "\n".join(table),
        *_heading(comparison),
        LEGEND,
        *lines,
    ]
    return "\n\n".join(parts) + "\n"


def as_csv(comparison: Comparison) -> str:
    """Return all numbers, one row a run."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    own = ("contacts", "solver", "tolerance", "dt", "ranks")
    writer.writerow([*own, "start", "case", *MEASURED, *COMPARED])
    for outcome in (one for row in comparison.rows for one in row.outcomes):
        described = [getattr(outcome.run.configuration, name) for name in own]
        numbers = [outcome.numbers[name] for name in (*MEASURED, *COMPARED)]
        writer.writerow(
            [
                *("" if value is None else value for value in described),
                outcome.run.start,
                outcome.run.case.name,
                *("" if math.isnan(value) else repr(value) for value in numbers),
            ]
        )
    return text.getvalue()


def _write(path: Path, text: str) -> None:
    with whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
