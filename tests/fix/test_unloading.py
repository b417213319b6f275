"""When a load goes, hard inelastic spheres stay where they are, however great it was.

See tests/validation/test_unloaded_beds.py for beds.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.helpers.exact_scenes import (
    UNLOADING,
    Column,
    assert_nothing_leaps,
    seed_at_rest,
    settling_bed,
)
from tests.helpers.lammps_run import run_lmp
from tests.helpers.scenes import GRAVITY


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


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("kind", ["spheres", "dimers"])
def test_a_bed_at_rest_rests_on(kind: str, ranks: int, tmp_path: Path) -> None:
    """With steps in which gravity adds a hundredth of the tolerance, and 40 times the gravity.

    It came to rest with steps of four tolerances. Nothing falls through a gap that a contact has
    had all along, though it loses its force for a step; scaled forces balance in the same places.
    """
    step, rested = 0.001, 50
    changes = f"1+39*(v_s>=0)*(v_s<{rested})"
    size: dict[str, Any] = {"number": 100, "side": 4.0}
    seed = seed_at_rest(kind, tmp_path, step, rested, ranks, **size)
    deck = settling_bed(kind, tmp_path, changes, loaded_after=rested, seed=seed, **size)
    deck += f"unfix drag\ntimestep {step}\nthermo 1\nrun {3 * rested}\n"
    thermo = run_lmp(tmp_path, deck, ranks).thermo
    assert (thermo["f_contact[13]"] == 1.0)[-rested:].all()
    # 0.1 g h is what a bed that gives way exceeds at once; 1e-5 of the load is a hundredth of A.
    assert (thermo["c_fastest"] <= 0.1 * GRAVITY * step).all()
