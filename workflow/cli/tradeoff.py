"""The subcommand `inelastic tradeoff`: how fast, how accurate, hard contacts beside soft ones."""

from __future__ import annotations

import argparse
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..decks import find_deck
from ..files import write_text, writing
from ..progress import Display
from ..results.store import Result, read_result, write_studies
from ..running.folder import Folder
from ..running.gather import gather_results
from ..running.launch import run_study
from ..running.locks import held
from ..running.one_case import Options
from ..running.run_and_gather import print_outcome
from ..shipped import SETTLING
from ..study import Outputs, Study
from ..tradeoff.advice import recommendations
from ..tradeoff.comparison import compare
from ..tradeoff.options import read_plan
from ..tradeoff.plan import Plan, Run, command_line, label_of, runs_of
from ..tradeoff.states import (
    MOMENTS,
    Solved,
    curves_of,
    problems_of,
    read_states,
    recording_case,
    solve_state,
    write_states,
)
from ..tradeoff.table import (
    TITLE,
    as_csv,
    as_markdown,
    never_at_rest,
    out_of_bed,
    print_comparison,
    print_states,
    states_as_csv,
    states_as_markdown,
)
from .arguments import add_out, seconds

STORE, ROWS, PAGE, FIGURE = "tradeoff.h5", "tradeoff.csv", "tradeoff.md", "tradeoff"
STATES = "states"
LOCK = Path(".locks", "results")
# Only the result of a run is kept: the dumps of many would fill a disk. Random points are not
# needed where the exact packing fraction is known.
OUTPUTS = Outputs(points=10_000, structure=False, keep="results")
# Recorded problems are files of the run.
RECORDING = Outputs(points=10_000, structure=False, evolution=False, keep="everything")


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    tradeoff = commands.add_parser(
        "tradeoff",
        help="measure time against accuracy, hard contacts beside LAMMPS's soft ones",
        description="Let the same starts settle with several tolerances, hard contacts and soft "
        "ones, one run at a time; print a table of time and accuracy and what to take, and write "
        f"it with a plot ({PAGE}, {ROWS}, {STORE}, {FIGURE}.png, {FIGURE}.svg). Then solve "
        "recorded contact problems to several tolerances, compare them with their exact "
        f"solutions, and write that ({PAGE}, {STATES}.csv, {STATES}.png, {STATES}.svg). LIST is "
        "values with commas between them. It can be interrupted at any moment: the next time does "
        "what is left.",
    )

    def add(name: str, default: str | None, metavar: str, what: str) -> None:
        tradeoff.add_argument(
            name, default=default, metavar=metavar, help=what.format(default=default)
        )

    add_out(tradeoff, "tradeoff", "runs")
    rules = find_deck(SETTLING, Path()).rules
    add("--particle", "spheres", "WORD", f"{rules['particle'].allowed} (default: {{default}})")
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
    solvers = ", ".join(rules["solver"].words)
    add("--solvers", "apgd", "LIST", f"of hard contacts: {solvers} (default: {{default}})")
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
    tradeoff.add_argument(
        "--no-states", action="store_true", help="leave out the recorded contact problems"
    )
    tradeoff.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run what is missing, print, write, draw; 1 if any run has failed, else 0.

    Two comparisons in one folder follow one another: beside each other they would take each
    other's time, and the last to write would replace whole tables by its own with gaps.
    """
    plan = read_plan(options)
    lock = options.out / LOCK
    with writing(lock):
        lock.parent.mkdir(parents=True, exist_ok=True)
    with held(lock, f"{options.out}: somebody else compares there; this one waits"):
        return _compare(plan, options)


def _compare(plan: Plan, options: argparse.Namespace) -> int:
    results, left_out, failed = _run_all(plan, options.out, options.timeout)
    comparison = compare(results)
    lines = [*left_out, *never_at_rest(comparison), *out_of_bed(comparison)]
    lines += recommendations(comparison)
    print_comparison(comparison, lines)
    states: list[Solved] = []
    lost: list[str] = []
    if not options.no_states:
        states, lost = _solve_states(plan, options.out, options.timeout)
    curves = curves_of(states)
    for line in lost:
        print(line)
    if curves:
        print_states(curves)
    write_text(options.out / ROWS, as_csv(comparison))
    page = as_markdown(plan, comparison, lines) + states_as_markdown(states, lost)
    write_text(options.out / PAGE, page)
    names = [STORE, ROWS, PAGE]
    # Drawing takes a while to import, for which the other subcommands need not wait.
    from ..tradeoff.figure import draw_states, draw_tradeoff

    if comparison.rows:
        names += [path.name for path in draw_tradeoff(comparison, options.out / FIGURE)]
    if curves:
        write_text(options.out / f"{STATES}.csv", states_as_csv(states))
        names.append(f"{STATES}.csv")
        names += [path.name for path in draw_states(curves, options.out / STATES)]
    print(f"written: {', '.join(names)} in {options.out}")
    return 1 if failed or lost else 0


def _solve_states(plan: Plan, out: Path, timeout: float | None) -> tuple[list[Solved], list[str]]:
    """Record problems of each start and solve them, unless that was done before.

    Returns the solutions, and one line for each start without any.
    """
    folder = Folder(out / STATES)
    cases = tuple(recording_case(plan, start) for start in plan.starts)
    study = Study(STATES, TITLE, command_line(plan), cases, RECORDING)
    with Display(len(cases)) as display:
        outcome = run_study(study, cases, folder, Options(timeout=timeout), display)
    print_outcome(study, outcome)
    states: list[Solved] = []
    lost = [f"left out: {name}: {reason}" for name, reason in outcome.failed.items()]
    lost += [f"left out: {name}: somebody else runs it" for name in outcome.elsewhere]
    with Display(None) as display:
        for start, case in zip(plan.starts, cases, strict=True):
            if not folder.is_measured(study, case):
                continue
            done = {name: folder.case(case) / f"solved-{name}.json" for name in MOMENTS}
            solved: dict[str, list[Solved]] = {}
            for moment, path in done.items():
                with suppress(ValueError):
                    solved[moment] = read_states(path)
            left = [moment for moment in MOMENTS if moment not in solved]
            try:
                # What is solved needs neither the log of its run nor its problem.
                problems = problems_of(folder.case(case), left) if left else {}
                for moment, problem in problems.items():
                    display.say(f"solves {case.name}, {moment}")
                    solved[moment] = list(solve_state(label_of(start), moment, problem))
                    write_states(done[moment], solved[moment])
            except ValueError as error:
                lost.append(f"left out: {case.name}: {error}")
            states += [one for moment in MOMENTS for one in solved.get(moment, ())]
    return states, lost


def _run_all(
    plan: Plan, out: Path, timeout: float | None
) -> tuple[list[tuple[Run, Result]], list[str], bool]:
    """Run what has no result yet, one run at a time, and write all results to one file.

    Returns the results, one line for each run without one, and whether any has failed.
    """
    runs = runs_of(plan)
    failed: dict[str, str] = {}
    elsewhere: list[str] = []
    results: list[tuple[Run, Result]] = []
    stored = []
    for ranks in plan.ranks:
        chosen = [one for one in runs if one.configuration.ranks == ranks]
        folder = Folder(out / f"ranks-{ranks}")
        cases = tuple(one.case for one in chosen)
        study = Study(folder.root.name, TITLE, command_line(plan), cases, OUTPUTS)
        with Display(len(cases)) as display:
            # Runs beside each other would take each other's time.
            limits = Options(at_once=1, ranks=ranks, timeout=timeout)
            outcome = run_study(study, cases, folder, limits, display)
        print_outcome(study, outcome)
        failed |= outcome.failed
        elsewhere += outcome.elsewhere
        results += [
            (one, read_result(folder.result(study, one.case)))
            for one in chosen
            if folder.is_measured(study, one.case)
        ]
        stored.append(gather_results(study, folder))
    write_studies(out / STORE, stored)
    left_out = [f"left out: {name}: {reason}" for name, reason in failed.items()]
    left_out += [f"left out: {name}: somebody else runs it" for name in elsewhere]
    return results, left_out, bool(failed)
