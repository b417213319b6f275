"""Where heavy spheres lie on light ones at rest, the floor carries all weights in every step.

See tests/validation/test_heavy_on_light.py for more columns, and greater ratios of the masses.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.heavy_scenes import COLUMNS, PILES, assert_carried, doubling

SHORTEN = ("shorten no", "shorten yes")


@pytest.mark.parametrize("shorten", SHORTEN)
@pytest.mark.parametrize("ratio", [1e3, 1e6])
@pytest.mark.parametrize("n", [5, 20])
@pytest.mark.parametrize("kind", COLUMNS)
def test_a_column(kind: str, n: int, ratio: float, shorten: str, tmp_path: Path) -> None:
    """The heavy one is on top or below, or they alternate: to 1 %, from the third step on."""
    assert_carried(COLUMNS[kind](n, ratio), tmp_path, shorten)


@pytest.mark.parametrize("shorten", SHORTEN)
def test_ten_million_on_five(shorten: str, tmp_path: Path) -> None:
    """Five carry ten million times their mass."""
    assert_carried(COLUMNS["on top"](5, 1e7), tmp_path, shorten, borne=1e7)


@pytest.mark.parametrize("shorten", SHORTEN)
def test_each_is_twice_as_heavy_as_the_one_below(shorten: str, tmp_path: Path) -> None:
    """Ten in a column, the upper one of 512 times the mass of the lower one."""
    assert_carried(doubling(10), tmp_path, shorten)


@pytest.mark.parametrize("shorten", SHORTEN)
@pytest.mark.parametrize("ratio", [1e3, 1e6])
@pytest.mark.parametrize("name", PILES)
def test_a_pile(name: str, ratio: float, shorten: str, tmp_path: Path) -> None:
    """A heavy sphere or dimer lies on a few light spheres that walls hold."""
    assert_carried(PILES[name](ratio), tmp_path, shorten)
