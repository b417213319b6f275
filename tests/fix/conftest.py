"""Fixtures that run decks in the test's own folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.helpers.lammps_run import Run, Runner, run_lmp


@pytest.fixture
def lmp(tmp_path: Path) -> Runner:
    """Return run_lmp for the test's folder, or for a folder in it: lmp(deck, into="name")."""

    def run(deck: str, into: str = ".", **options: object) -> Run:
        return run_lmp(tmp_path / into, deck, **options)  # type: ignore[arg-type]

    return run


@pytest.fixture
def refused(lmp: Runner) -> Callable[..., str]:
    """Return a function that runs a deck which must be refused, and returns the error's line."""

    def run(deck: str, **options: object) -> str:
        result = lmp(deck, must_pass=False, **options)
        assert result.status != 0, result.screen[-2000:]
        # LAMMPS repeats the line on stderr; a second, different one would bury the first.
        assert len(result.errors) == 1, result.screen[-2000:]
        return result.errors[0]

    return run
