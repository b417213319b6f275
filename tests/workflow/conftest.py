"""Writes study files, and copies the folder of one that has been run."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest


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
