"""A deck that LAMMPS refuses ends a measurement with one line; what has run before it is kept."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests import tables
from tests.benchmark import __main__ as benchmark
from tests.helpers.pouring import run_deck, shipped_deck


def refused(folder: Path) -> None:
    run_deck(folder, shipped_deck("spheres"), {"seed": 0})


def table(folder: Path) -> Iterator[str]:
    yield "a line"
    refused(folder)


@pytest.mark.parametrize(
    ("main", "part"), [(benchmark.main, "machine"), (tables.main, "speed")], ids=["bench", "tables"]
)
def test_one_line_says_why(
    main: Callable[[], int],
    part: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(benchmark.machine, "measure", lambda: refused(tmp_path))
    monkeypatch.setattr(tables, "TABLES", {"speed": lambda seeds: table(tmp_path)})
    monkeypatch.setattr(sys, "argv", ["program", part])
    assert main() == 1
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert f"{part}: ERROR: Parameter seed must be a whole number from 1 to" in said[0]
