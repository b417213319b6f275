"""Writes study files, and copies the folder of one that has been run."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.helpers.study_run import run_few


@pytest.fixture(scope="session")
def two_cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a study of two cases that has been run. It is for all files to read."""
    return run_few(tmp_path_factory.mktemp("two_cases"), "[1, 2]")


@pytest.fixture
def write_study(tmp_path: Path) -> Callable[..., Path]:
    """Return the writer of a study file in the test's folder."""

    def write(text: str, name: str = "few.toml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture
def study(done: Path, tmp_path: Path) -> Path:
    """Return a copy of the folder of a study that has been run, the fixture `done` of a module."""
    shutil.copytree(done, tmp_path / "study")
    return tmp_path / "study"
