"""What a comparison shows: printed, and written as a page, as tables and as figures."""

from __future__ import annotations

from pathlib import Path

from ..files import write_text
from .advice import recommendations
from .comparison import Comparison
from .plan import Plan
from .recorded_states import STATES, Solutions
from .recorded_steps import MeasuredSteps
from .settling_runs import STORE, Settled
from .states import curves_of
from .table import (
    as_csv,
    as_markdown,
    never_at_rest,
    out_of_bed,
    print_states,
    states_as_csv,
    states_as_markdown,
)

ROWS, PAGE, FIGURE, ERRORS_FIGURE = "tradeoff.csv", "tradeoff.md", "tradeoff", "errors"


def notes_of(settled: Settled, steps: MeasuredSteps, comparison: Comparison) -> list[str]:
    """Return the lines below the table: what is left out, what to mind, what to take."""
    doubtful = [*never_at_rest(comparison), *out_of_bed(comparison)]
    told = [*settled.left_out, *steps.lost, *settled.before_accuracy]
    return [*told, *doubtful, *recommendations(comparison)]


def print_solutions(solutions: Solutions) -> None:
    """Print the starts without solutions, and a table of the others."""
    for line in solutions.lost:
        print(line)
    if curves := curves_of(solutions.states):
        print_states(curves)


def write_all(
    out: Path, plan: Plan, comparison: Comparison, notes: list[str], solutions: Solutions
) -> None:
    """Write page, tables and figures into a folder, and print which files are there.

    Parameters
    ----------
    out : the folder
    plan : what was asked for
    comparison, notes : the settling runs, and the lines below their table
    solutions : of recorded problems
    """
    # Drawing takes a while to import, for which the other subcommands need not wait.
    from .figure import draw_errors, draw_states, draw_tradeoff

    states, curves = solutions.states, curves_of(solutions.states)
    write_text(out / ROWS, as_csv(comparison))
    page = as_markdown(plan, comparison, notes) + states_as_markdown(states, solutions.lost)
    write_text(out / PAGE, page)
    names = [STORE, ROWS, PAGE]
    if comparison.rows:
        names += [path.name for path in draw_tradeoff(comparison, out / FIGURE)]
    if comparison.has_steps:
        names += [path.name for path in draw_errors(comparison, out / ERRORS_FIGURE)]
    if curves:
        write_text(out / f"{STATES}.csv", states_as_csv(states))
        names.append(f"{STATES}.csv")
        names += [path.name for path in draw_states(curves, out / STATES)]
    print(f"written: {', '.join(names)} in {out}")
