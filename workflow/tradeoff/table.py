"""The table of a comparison of time and accuracy: printed, as Markdown, and all numbers as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Literal

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..wide_table import print_wide
from .advice import described, ratio_text
from .comparison import COMPARED, MEASURED, OF_STEPS, Comparison, Row
from .plan import Plan, command_line
from .states import MEDIANS, Solved, WayMedians, curves_of

TITLE = "Time and accuracy of hard and soft contacts"
MISSING = "-"


def _number(form: str, name: str) -> Callable[[Row], str]:
    """Return a function that writes the median of a number."""

    def write(row: Row) -> str:
        value = row.median(name)
        return MISSING if math.isnan(value) else f"{value:{form}}"

    return write


def _setting(value: float | None) -> str:
    return MISSING if value is None else f"{value:g}"


def _at_rest(row: Row) -> str:
    return f"{len(row.values('plateau_time'))} of {len(row.runs)}"


# Each column has a heading, and a function that writes a row's cell.
COLUMNS: Sequence[tuple[str, Callable[[Row], str]]] = (
    ("contacts", lambda row: row.configuration.contacts),
    ("solver", lambda row: row.configuration.solver or MISSING),
    ("tolerance / r", lambda row: f"{row.configuration.tolerance:g}"),
    ("dt", lambda row: _setting(row.configuration.dt)),
    ("accuracy", lambda row: _setting(row.configuration.accuracy)),
    ("ranks", lambda row: str(row.configuration.ranks)),
    ("at rest", _at_rest),
    ("overlap / r", _number(".2g", "overlap_at_rest")),
    ("falling", _number(".2g", "overlap_falling")),
    ("seconds", _number(".3g", "plateau_seconds")),
    ("time", _number(".2f", "plateau_time")),
    ("error of phi", _number(".4f", "packing_fraction_error")),
    ("of z", _number(".3f", "coordination_number_error")),
    ("of network", _number(".2f", "network_error")),
    ("of velocities / g h", _number(".1e", "velocity_error")),
    ("of forces", _number(".1e", "force_error")),
    ("complementarity / r", _number(".2g", "complementarity_at_rest")),
    ("drift", _number(".1e", "drift")),
    ("soft/hard time", lambda row: ratio_text(row.slower) if len(row.slower) else MISSING),
)
# These are there where steps were recorded.
STEP_COLUMNS = ("of velocities / g h", "of forces")
# The first so many of them say which configuration a row is of.
KEYS = 6
LEGEND = (
    "Medians over the starts. At rest: starts that came to rest within the run; the others have no "
    "time and no errors, nor is anything compared with them. Overlap: largest at rest, and before. "
    "Seconds: wall time until at rest; time: simulated. Errors: difference to the reference from "
    "the same start, of packing fraction (phi), contacts per particle (z) and contact forces (0: "
    "the same network, 2: no contact in common). Complementarity: largest gap under a force. "
    "Drift: of the centre of mass at the end, diameters per time."
)
STEP_LEGEND = (
    "Velocities, forces: of recorded steps of hard contacts, against the exact solutions of these "
    "steps: root mean square over the spheres, and sum of the differences over that of the forces."
)


def _heading(comparison: Comparison) -> list[str]:
    """Return what the errors are compared with, and from where on they mean something."""
    reference = comparison.reference()
    if reference is None:
        return []
    one = reference.configuration
    line = (
        f"Reference: hard contacts, {one.solver}, {one.tolerance:g} r, dt {one.dt:g}, accuracy "
        f"{one.accuracy:g}."
    )
    scatter = [comparison.scatter(name) for name in ("packing_fraction", "coordination_number")]
    if not math.isnan(scatter[0]):
        line += (
            f" Its scatter between starts (standard deviation): phi {scatter[0]:.4f}, "
            f"z {scatter[1]:.3f}."
        )
    return [line]


def _columns(comparison: Comparison) -> list[tuple[str, Callable[[Row], str]]]:
    """Return the columns for which there is something to tell."""
    steps = comparison.has_steps
    return [column for column in COLUMNS if steps or column[0] not in STEP_COLUMNS]


def _legend(comparison: Comparison) -> str:
    return f"{LEGEND} {STEP_LEGEND}" if comparison.has_steps else LEGEND


def never_at_rest(comparison: Comparison) -> list[str]:
    """Return one line for each configuration with runs that did not come to rest."""
    lines = []
    for row in comparison.rows:
        moving = [one for one in row.runs if not one.at_rest]
        if moving:
            one = row.configuration
            drift = max(each.numbers["drift"] for each in moving)
            lines.append(
                f"never at rest: {one.contacts}, {described(one, comparison)}, start "
                f"{', '.join(each.run.start for each in moving)} (drift at the end {drift:.1e}; a "
                "longer --time helps if the packing still sinks, not if it is shaken)"
            )
    return lines


def out_of_bed(comparison: Comparison) -> list[str]:
    """Return a line if the measuring box reaches out of the bed after some run."""
    runs = [one for row in comparison.rows for one in row.runs]
    out = [one for one in runs if one.at_rest and one.numbers["box_in_bed"] < 1]
    if not out:
        return []
    least = min(one.numbers["box_in_bed"] for one in out)
    return [
        f"out of the bed: after {len(out)} of {len(runs)} runs the measuring box, [0.25, 0.75]^3, "
        f"is not all in the bed, {least:.0%} of it in the worst: phi and z are partly of empty "
        "space; take more particles (--particles)"
    ]


def print_comparison(comparison: Comparison, lines: Sequence[str]) -> None:
    """Print the table, what its columns mean, and more lines."""
    console = Console(highlight=False)
    if comparison.rows:
        table = Table(box=None, pad_edge=False)
        columns = _columns(comparison)
        for number, (head, _) in enumerate(columns):
            table.add_column(head, justify="left" if number < 2 else "right", no_wrap=True)
        for row in comparison.rows:
            table.add_row(*(Text(write(row)) for _, write in columns))
        print_wide(table, keys=KEYS)
        lines = [*_heading(comparison), _legend(comparison), *lines]
    for line in lines:
        console.print(line, markup=False, soft_wrap=not console.is_terminal)


def as_markdown(plan: Plan, comparison: Comparison, lines: Sequence[str]) -> str:
    """Return the table and more lines as a page of Markdown."""
    columns = _columns(comparison)
    head = [name for name, _ in columns]
    rows = [[write(row) for _, write in columns] for row in comparison.rows]
    table = [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]
    parts = [
        f"# {TITLE}",
        f"`{command_line(plan)}`",
        "\n".join(table),
        *_heading(comparison),
        _legend(comparison),
        *lines,
    ]
    return "\n\n".join(parts) + "\n"


def as_csv(comparison: Comparison) -> str:
    """Return all numbers as CSV, one row a run."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    own = ("contacts", "solver", "tolerance", "dt", "accuracy", "ranks")
    names = (*MEASURED, *COMPARED, *OF_STEPS)
    writer.writerow([*own, "start", "case", *names])
    for one in (run for row in comparison.rows for run in row.runs):
        described = [getattr(one.run.configuration, name) for name in own]
        numbers = [one.numbers[name] for name in names]
        writer.writerow(
            [
                *("" if value is None else value for value in described),
                one.run.start,
                one.run.case.name,
                *("" if math.isnan(value) else repr(value) for value in numbers),
            ]
        )
    return text.getvalue()


STATES_TITLE = "Recorded states: solutions against the exact one"
STATES_LEGEND = (
    "Contact problems of a few steps, solved outside of LAMMPS; medians over the states. "
    "Tolerances are in radii, accuracies fractions. Errors: of velocities, root mean square over "
    "that of what contacts change; of forces, summed, over the sum of the forces; missed and "
    "false: parts of the contacts."
)
_STATES_HEADINGS = (
    "way",
    "value",
    "iterations",
    "ms",
    "error of velocities",
    "of forces",
    "missed",
    "false",
)


def _states_cells(curves: Sequence[WayMedians]) -> list[list[str]]:
    """Return the cells of a row for each value of each way."""
    rows = []
    for curve in curves:
        for k, value in enumerate(curve.values):
            iterations, seconds, *errors = (float(curve.medians[name][k]) for name in MEDIANS)
            cells = [curve.way, f"{value:g}", f"{iterations:.0f}", f"{1e3 * seconds:.3g}"]
            rows.append([*cells, *(MISSING if math.isnan(e) else f"{e:.1e}" for e in errors)])
    return rows


def print_states(curves: Sequence[WayMedians]) -> None:
    """Print the medians over the states."""
    console = Console(highlight=False)
    table = Table(box=None, pad_edge=False)
    for heading in _STATES_HEADINGS:
        justify: Literal["left", "right"] = "left" if heading == "way" else "right"
        table.add_column(heading, justify=justify, no_wrap=True)
    for cells in _states_cells(curves):
        table.add_row(*(Text(cell) for cell in cells))
    console.print(f"{STATES_TITLE}.", markup=False)
    print_wide(table, keys=2)
    console.print(STATES_LEGEND, markup=False, soft_wrap=not console.is_terminal)


def states_as_markdown(states: Sequence[Solved], lines: Sequence[str]) -> str:
    """Return the medians over the states as a section of Markdown."""
    curves = curves_of(states)
    if not curves and not lines:
        return ""
    number = len({(one.start, one.moment) for one in states})
    text = [f"\n## {STATES_TITLE}\n", f"{number} states. {STATES_LEGEND}\n"]
    if curves:
        text.append(f"| {' | '.join(_STATES_HEADINGS)} |")
        text.append("|" + "---|" * len(_STATES_HEADINGS))
        text += [f"| {' | '.join(cells)} |" for cells in _states_cells(curves)]
    text += [f"\n{line}" for line in lines]
    return "\n".join(text) + "\n"


def states_as_csv(states: Sequence[Solved]) -> str:
    """Return all numbers of all solutions as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = [field.name for field in fields(Solved)]
    writer.writerow(names)
    writer.writerows([getattr(one, name) for name in names] for one in states)
    return text.getvalue()
