"""In a column every contact carries what is above it, in every step, and nothing moves.

The load on its top doubles, halves and ramps. It stands on the floor, hangs from it while gravity
is turned up, or leans on a wall.
"""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.exact_scenes import Column

KINDS: dict[str, dict[str, Any]] = {
    "stands": {},
    "hangs": {"hangs": True},
    "leans": {"lean": pi / 4},
}


CASES = [(1e-3, 0.005), (1e-2, 0.005), (1e-6, 0.005), (1e-3, 0.001), (1e-3, 0.02), (1e-6, 0.02)]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("load", [0.0, 5.0, 500.0])
@pytest.mark.parametrize(
    ("n", "tolerance", "timestep"),
    [
        *((10, *case) for case in CASES),
        (100, *CASES[0]),
        *(pytest.param(100, *case, marks=pytest.mark.slow) for case in CASES[1:]),
    ],
)
def test_a_column(
    n: int, kind: str, tolerance: float, timestep: float, load: float, tmp_path: Path
) -> None:
    """Each force is exact to 1 %, and no sphere is faster than 0.05 g h."""
    column = Column(n, tolerance, timestep, load, **KINDS[kind])
    column.check(column.run(tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("n", [300, 1000])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("load", [0.0, 500.0])
@pytest.mark.parametrize(("tolerance", "timestep"), CASES)
def test_a_high_column(
    n: int, kind: str, tolerance: float, timestep: float, load: float, tmp_path: Path
) -> None:
    """Each force is exact to 5 %, and no sphere is faster than 0.1 g h."""
    column = Column(n, tolerance, timestep, load, **KINDS[kind])
    column.check(column.run(tmp_path, timeout=300))
