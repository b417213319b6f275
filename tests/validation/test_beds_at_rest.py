"""A bed at rest: hardly any motion is left, at every tolerance and time step, whatever the seed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.beds import BEDS, at_rest

pytestmark = pytest.mark.validation


@pytest.mark.parametrize("timestep", [0.01, 0.0025])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
@pytest.mark.parametrize("bed", BEDS)
def test_motion_that_is_left(bed: str, tolerance: float, timestep: float, tmp_path: Path) -> None:
    found = [at_rest(tmp_path, bed, tolerance, timestep, seed) for seed in (1, 2, 3)]
    speeds = " ".join(f"{one.speed:.4f}" for one in found)
    iterations = " ".join(f"{one.iterations:.0f}" for one in found)
    times = " ".join(f"{one.rested:.0f}" for one in found)
    print(
        f"{bed}, eps {tolerance:g} d, h = {timestep}: v_rms {speeds} g h, "
        f"{iterations} iterations a step, at rest after {times}"
    )
    # What a step leaves of its residual, in units of the speed that it takes away from every sphere
    assert max(one.speed for one in found) <= 0.02
