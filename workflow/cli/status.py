"""The subcommand `inelastic status`: how far studies have come."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

from ..provenance.run_record import differs
from ..results.store import read_result
from ..running.folder import Folder
from ..running.gather import other_code
from ..running.measuring import last_failure
from ..study import Case, Study
from ..wide_table import COLUMNS, on_terminal, print_wide, width_of, wrapped
from .arguments import add_out, add_studies, read_studies


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    status = commands.add_parser(
        "status", help="say how far a study has come", description="Say how far a study has come."
    )
    add_studies(status)
    add_out(status)
    status.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Print the state of every case; return 0. Raises WorkflowError without the folder."""
    studies = read_studies(options.studies)
    folder = Folder(options.out)
    folder.check_there()
    for study in studies:
        _print_status(study, folder)
    return 0


def _print_status(study: Study, folder: Folder) -> None:
    rows: list[tuple[str, str, str, str]] = []
    states: Counter[str] = Counter()
    other = 0
    for number, case in enumerate(study.cases, 1):
        found = folder.found(study, case)
        state = folder.state(case, found)
        states[state] += 1
        note = ""
        if state == "failed":
            note = folder.reason(case)
        elif state == "finished" and (said := last_failure(folder.case(case))):
            note = f"cannot be measured: {said}"
        elif state == "measured":
            note, same = _of_result(study, case, folder)
            other += not same
        if found.damage:
            note = f"{note}; {found.damage}" if note else found.damage
        rows.append((str(number), case.name, state, note))
    _print_rows(study.title, rows)
    print(f"{study.name}: " + ", ".join(f"{count} {state}" for state, count in states.items()))
    if other:
        print(other_code(other, folder.result_folder(study)))


def _print_rows(title: str, rows: Sequence[tuple[str, str, str, str]]) -> None:
    """Print number, name, state and note of each case; in two lines where one is too wide."""
    table = Table("", "case", "state", "", title=Text(title), title_justify="left", box=None)
    for number, name, state, note in rows:
        table.add_row(number, Text(name), state, Text(note))
    if not on_terminal() or width_of(table) <= COLUMNS:
        print_wide(table)
        return
    print(title)
    wide, widest = (max(len(row[column]) for row in rows) for column in (0, 2))
    for number, name, state, note in rows:
        print(wrapped(f"{number:>{wide}}  {state:<{widest}}  ", note).rstrip())
        print(f"{' ' * wide}  {name}")


def _of_result(study: Study, case: Case, folder: Folder) -> tuple[str, bool]:
    """Say how long a case took, and whether its code was that of today."""
    record = read_result(folder.result(study, case)).record
    note = f"{record['wall_seconds']:.0f} s"
    if other := differs(case, record):
        return f"{note}, by {other}", False
    return note, True
