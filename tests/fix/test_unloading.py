"""When a load goes, hard inelastic spheres stay where they are, however great it was.

See tests/validation/test_unloaded_beds.py for beds.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fix.exact_scenes import UNLOADING, Column, assert_nothing_leaps
from tests.fix.scenes import GRAVITY


@pytest.mark.parametrize("weights", [10.0, 1e2, 1e3, 1e4, 1e5, 1e6])
@pytest.mark.parametrize("way", UNLOADING)
@pytest.mark.parametrize("tolerance", [2e-3, 1e-5])
def test_a_column_that_was_pressed(
    weights: float, tolerance: float, way: str, tmp_path: Path
) -> None:
    column = Column(20, tolerance, 0.001, weights, changes=UNLOADING[way], steps=800)
    thermo = column.run(tmp_path).thermo
    speed = thermo["c_fastest"] / (GRAVITY * column.timestep)
    assert_nothing_leaps(thermo["v_load"], speed, weights)
