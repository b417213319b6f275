"""Heavy on light, up to a ratio of 1e8: the floor carries all weights, or the run says why not.

Up to a ratio of 1e6 it has to carry them. Nothing goes on with a wrong force.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.heavy_scenes import COLUMNS, PILES, assert_carried, doubling

pytestmark = pytest.mark.validation

SHORTEN = ("shorten no", "shorten yes")
RATIOS = (1e3, 1e4, 1e6, 1e8)


@pytest.mark.parametrize("shorten", SHORTEN)
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("n", [2, 5, 20, 30])
@pytest.mark.parametrize("kind", COLUMNS)
def test_a_column(kind: str, n: int, ratio: float, shorten: str, tmp_path: Path) -> None:
    """The heavy one is on top or below, or they alternate."""
    assert_carried(COLUMNS[kind](n, ratio), tmp_path, shorten)


@pytest.mark.parametrize("shorten", SHORTEN)
@pytest.mark.parametrize("n", [5, 20, 30])
def test_each_is_twice_as_heavy_as_the_one_below(n: int, shorten: str, tmp_path: Path) -> None:
    """The ratio is 2^19 = 5e5 for twenty, which have to be borne, and 2^29 = 5e8 for thirty."""
    assert_carried(doubling(n), tmp_path, shorten)


@pytest.mark.parametrize("shorten", SHORTEN)
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("name", PILES)
def test_a_pile(name: str, ratio: float, shorten: str, tmp_path: Path) -> None:
    """A heavy sphere or dimer lies on a few light spheres that walls hold."""
    assert_carried(PILES[name](ratio), tmp_path, shorten)
