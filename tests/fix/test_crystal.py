"""A jammed crystal whose spheres get velocities takes no more iterations than other scenes.

See tests/validation/test_crystal.py for larger ones.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.crystals import assert_solved, run_crystal


@pytest.mark.parametrize("temperature", [0, 1e-4, 1e-2, 1])
def test_a_small_crystal(temperature: float, tmp_path: Path) -> None:
    """Of 32 spheres: fewer than 1000 iterations a step, and no overlap above the tolerance."""
    assert_solved(run_crystal(tmp_path, 2, temperature))
