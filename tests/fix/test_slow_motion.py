"""Coming to rest takes no momentum from heavy grains that a light one drives apart, slowly.

See tests/validation/test_slow_motion.py for more ratios of the masses, and more time steps.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.slow_scenes import (
    OTHERS,
    assert_exact_way,
    assert_goes_on,
    assert_no_momentum,
    wedge,
)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize(("density", "timestep"), [(30, 0.05), (100, 0.01), (1e3, 0.05)])
@pytest.mark.parametrize("more", [1, 10])
def test_a_wedge(density: float, timestep: float, more: float, ranks: int, tmp_path: Path) -> None:
    """A sphere drives two apart, of which one has `more` times the mass, as with `rest no`."""
    assert_goes_on(wedge(density, more * density), tmp_path, timestep, ranks)


@pytest.mark.parametrize("density", [1e4, 1e5])
@pytest.mark.parametrize("timestep", [0.01, 0.05])
def test_a_wedge_of_far_heavier_ones(density: float, timestep: float, tmp_path: Path) -> None:
    """Forces of 1e-5 of a weight move what they act on."""
    assert_goes_on(wedge(density), tmp_path, timestep)


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("density", [1e2, 1e3])
def test_other_scenes(name: str, density: float, tmp_path: Path) -> None:
    """Large spheres, blocks, a row, one beside a wall and dimers go as far as with `rest no`."""
    assert_goes_on(OTHERS[name](density), tmp_path, 0.01)


@pytest.mark.parametrize("more", [2, 10])
@pytest.mark.parametrize("density", [10, 1e3, 1e4])
def test_momentum_along_the_floor(density: float, more: float, tmp_path: Path) -> None:
    """It is 0 in every step where one of two heavy spheres is heavier."""
    assert_no_momentum(wedge(density, more * density), tmp_path, 0.02)


@pytest.mark.parametrize("name", OTHERS)
def test_the_exact_way(name: str, tmp_path: Path) -> None:
    """With `rest no` grains follow the exact equations that tests compare with."""
    scene = OTHERS[name](300)
    assert_exact_way(scene, scene.run(tmp_path, 0.01, "rest no"))
