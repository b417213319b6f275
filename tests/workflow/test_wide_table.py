"""What is printed on a terminal fits 100 columns, and no name in it is cut."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from rich.table import Table

from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.tradeoff.table import COLUMNS as TRADEOFF
from lammps_inelastic.workflow.tradeoff.table import KEYS
from lammps_inelastic.workflow.wide_table import parted, print_wide, width_of, wrapped

BIN = Path(sys.executable).parent
STUDY = """title = "wide"
deck = "spheres"
[parameters]
particles = 100
tolerance = [0.005, 0.0005]
tolerance_measuring = 0.0005
random_force = 12.5
drag = 0.25
dt_measuring = 0.05
"""


def table_of(*widths: int, rows: int = 2) -> Table:
    table = Table(box=None, pad_edge=False)
    for number, width in enumerate(widths):
        table.add_column(f"{number}".ljust(width, "-"), no_wrap=True)
    for row in range(rows):
        table.add_row(*(f"{row}.{number}" for number in range(len(widths))))
    return table


def headings(table: Table) -> list[str]:
    return [str(column.header).rstrip("-") for column in table.columns]


def test_a_table_that_fits_stays_whole() -> None:
    table = table_of(49, 49)
    assert width_of(table) == 100
    assert parted(table) == [table]


def test_a_wider_one_is_parted_and_its_keys_are_repeated() -> None:
    parts = parted(table_of(10, 20, 40, 40, 20, 90), keys=2)
    assert [headings(part) for part in parts] == [
        ["0", "1", "2"],
        ["0", "1", "3", "4"],
        # This column alone is too wide: it is printed as it is.
        ["0", "1", "5"],
    ]
    assert [width_of(part) <= 100 for part in parts] == [True, True, False]
    for part in parts:
        for column in part.columns:
            number = str(column.header).rstrip("-")
            assert list(column.cells) == [f"{row}.{number}" for row in range(2)]


def test_the_table_of_the_tradeoff_fits_in_parts() -> None:
    """With the widest cells of its columns, all of them are there once, behind the keys."""
    cells = {"soft/hard time": "117.7 (117.5 to 117.9)", "tolerance / r": "0.00000005"}
    table = Table(box=None, pad_edge=False)
    for heading, _ in TRADEOFF:
        table.add_column(heading, no_wrap=True)
    table.add_row(*(cells.get(heading, "1.23e-07") for heading, _ in TRADEOFF))
    assert width_of(table) > 100
    parts = parted(table, KEYS)
    assert max(map(width_of, parts)) <= 100
    names = [str(column.header) for part in parts for column in part.columns[KEYS:]]
    assert names == [heading for heading, _ in TRADEOFF[KEYS:]]
    for part in parts:
        assert [str(column.header) for column in part.columns[:KEYS]] == [
            heading for heading, _ in TRADEOFF[:KEYS]
        ]


@pytest.mark.parametrize("terminal", [True, False])
def test_a_pipe_gets_one_line_a_row(
    terminal: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lammps_inelastic.workflow.wide_table.on_terminal", lambda: terminal)
    print_wide(table_of(40, 40, 40))
    lines = capsys.readouterr().out.splitlines()
    # Two parts with a line between them, or one.
    assert len(lines) == (3 + 1 + 3 if terminal else 3)
    assert (max(len(line.rstrip()) for line in lines) <= 100) == terminal


def test_a_note_goes_on_below_itself() -> None:
    note = "a-b " * 40 + "/path" * 30
    first, *others = wrapped("name  value  ", note).splitlines()
    assert first.startswith("name  value  a-b")
    assert all(line.startswith(" " * 13) and line[13] != " " for line in others)
    assert " ".join(line.strip() for line in (first[13:], *others)) == note
    assert [len(line) <= 100 for line in (first, *others)] == [True] * len(others) + [False]
    assert wrapped("name  ", "") == "name  "


def on_a_terminal(folder: Path, *arguments: str) -> list[str]:
    """Return the lines that a command prints on a terminal of its own, without colours."""
    terminal, end = os.openpty()
    try:
        command = [str(BIN / "inelastic"), *arguments]
        subprocess.run(command, cwd=folder, stdout=end, timeout=60, check=True)
        text = os.read(terminal, 1_000_000).decode()
    finally:
        os.close(end)
        os.close(terminal)
    return re.sub(r"\x1b\[[\d;]*m", "", text).splitlines()


def test_the_states_of_long_names_take_two_lines_on_a_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A name is in a line of its own, whole: it can be given to `--case`."""
    (tmp_path / "wide.toml").write_text(STUDY)
    (tmp_path / "out").mkdir()
    title, *lines, last = on_a_terminal(tmp_path, "status", "wide.toml", "--out", "out")
    assert title == "wide"
    assert last == "wide: 2 missing"
    assert [line.split() for line in lines[::2]] == [["1", "missing"], ["2", "missing"]]
    names = [line.strip() for line in lines[1::2]]
    assert all(re.fullmatch(r"spheres_\S+_[0-9a-f]{8}", name) for name in names)
    monkeypatch.chdir(tmp_path)
    assert main(["status", "wide.toml", "--out", "out"]) == 0
    piped = capsys.readouterr().out
    assert all(re.search(rf"{re.escape(name)} +missing", piped) for name in names)
