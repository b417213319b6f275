"""Writes study files."""

from __future__ import annotations

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
