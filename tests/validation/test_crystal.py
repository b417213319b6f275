"""A jammed crystal whose spheres get velocities takes no more iterations than other scenes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.crystals import assert_solved, run_crystal

pytestmark = pytest.mark.validation


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("temperature", [0, 1e-4, 1e-2, 1])
@pytest.mark.parametrize("cells", [2, 3])
def test_a_crystal(cells: int, temperature: float, ranks: int, tmp_path: Path) -> None:
    """Of 32 or 108 spheres: fewer than 1000 iterations a step, no overlap above the tolerance."""
    assert_solved(run_crystal(tmp_path, cells, temperature, ranks))
