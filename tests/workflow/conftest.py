"""Writes study files."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

# Where the helpers that all tests share are imported from.
sys.path.insert(0, str(Path(__file__).parents[1]))


@pytest.fixture
def write_study(tmp_path: Path) -> Callable[..., Path]:
    """Return the writer of a study file in the test's folder."""

    def write(text: str, name: str = "few.toml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write
