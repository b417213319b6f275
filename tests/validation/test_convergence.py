"""Motions that are known exactly: shorter steps are more accurate, at every tolerance."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from tests.helpers.convergence import SCENES, STEPS, TOLERANCES

pytestmark = pytest.mark.validation


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("name", SCENES)
def test_error_falls_with_the_time_step(name: str, tolerance: float, tmp_path: Path) -> None:
    exact = SCENES[name]()
    errors = [exact.error(tmp_path, tolerance, steps, accuracy=1e-7) for steps in STEPS]
    print(f"{name}, eps {tolerance:g} d: errors", " ".join(f"{error:.1e}" for error in errors))
    # In so many diameters: positions follow velocities that are known to 1e-7, and overlaps of up
    # to a tolerance, where turning surfaces leave them, stay (a tenth more for what comes on top).
    floor = max(1e-6, 1.1 * tolerance)
    # Where within a step two spheres meet changes the error by a few percent.
    for longer, shorter in pairwise(errors):
        assert shorter <= max(1.05 * longer, floor)
    assert errors[-1] <= max(0.01 * errors[0], floor)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("name", SCENES)
def test_error_of_the_default_accuracy(name: str, tolerance: float, tmp_path: Path) -> None:
    """Four collisions each leave at most a thousandth of the velocity 1, for a time of about 1."""
    exact = SCENES[name]()
    coarse, fine = (exact.error(tmp_path, tolerance, n, accuracy=1e-3) for n in (128, STEPS[-1]))
    print(f"{name}, eps {tolerance:g} d, default accuracy: errors {coarse:.1e} {fine:.1e}")
    assert fine <= max(coarse, 4e-3)
