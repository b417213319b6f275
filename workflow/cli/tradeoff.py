"""The subcommand `inelastic tradeoff`: how fast, how accurate, hard contacts beside soft ones."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..decks import find_deck
from ..files import writing
from ..running.locks import held
from ..shipped import SETTLING
from ..tradeoff.comparison import compare
from ..tradeoff.options import read_plan
from ..tradeoff.pages import ERRORS_FIGURE, FIGURE, PAGE, ROWS, notes_of, print_solutions, write_all
from ..tradeoff.plan import Plan
from ..tradeoff.recorded_states import STATES, Solutions, solve_all
from ..tradeoff.recorded_steps import MeasuredSteps, measure_all
from ..tradeoff.settling_runs import STORE, run_all
from ..tradeoff.table import print_comparison
from .arguments import add_out, seconds

LOCK = Path(".locks", "results")


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
    settling = find_deck(SETTLING, Path())
    rules = settling.rules
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
    longest = f"{settling.parameters['dt']}"
    add("--dts", longest, "LIST", "longest time steps of hard contacts (default: {default})")
    accuracy = f"{settling.parameters['accuracy']}"
    add(
        "--accuracies",
        accuracy,
        "LIST",
        "parts of an approach that hard contacts may leave (default: {default})",
    )
    solvers = ", ".join(rules["solver"].words)
    add("--solvers", "sweeps", "LIST", f"of hard contacts: {solvers} (default: {{default}})")
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
    tradeoff.add_argument(
        "--step-errors",
        action="store_true",
        help="make each run with hard contacts once more, record its steps, and compare their "
        f"velocities and forces with the exact ones ({ERRORS_FIGURE}.png, {ERRORS_FIGURE}.svg)",
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
    settled = run_all(plan, options.out, options.timeout)
    steps = MeasuredSteps()
    if plan.step_errors:
        steps = measure_all(plan, options.out, options.timeout)
    comparison = compare(settled.results, steps.numbers)
    notes = notes_of(settled, steps, comparison)
    print_comparison(comparison, notes)
    solutions = Solutions()
    if not options.no_states:
        solutions = solve_all(plan, options.out, options.timeout)
    print_solutions(solutions)
    write_all(options.out, plan, comparison, notes, solutions)
    return 1 if settled.failed or steps.lost or solutions.lost else 0
