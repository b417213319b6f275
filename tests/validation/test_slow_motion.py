"""Coming to rest takes no momentum from what moves slowly, at any ratio of masses and time step."""

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

pytestmark = pytest.mark.validation

DENSITIES = (3, 10, 30, 100, 300, 1000, 1e4, 1e5)
TIMESTEPS = (1e-3, 5e-3, 0.01, 0.02, 0.05)


@pytest.mark.parametrize(
    ("timestep", "ranks"), [*((timestep, 1) for timestep in TIMESTEPS), (0.01, 2), (0.05, 2)]
)
@pytest.mark.parametrize("density", DENSITIES)
def test_a_wedge(density: float, timestep: float, ranks: int, tmp_path: Path) -> None:
    """A sphere drives two apart as with `rest no`, and as the exact equations say."""
    assert_goes_on(wedge(density), tmp_path, timestep, ranks)


@pytest.mark.parametrize("more", [2, 10])
@pytest.mark.parametrize("timestep", TIMESTEPS)
@pytest.mark.parametrize("density", DENSITIES)
def test_an_unequal_wedge(density: float, more: float, timestep: float, tmp_path: Path) -> None:
    """One of the two is heavier: both go as they should, and nothing takes their momentum."""
    scene = wedge(density, more * density)
    assert_goes_on(scene, tmp_path, timestep)
    assert_no_momentum(scene, tmp_path / "momentum", timestep)


@pytest.mark.parametrize("timestep", [2e-3, 0.01, 0.05])
@pytest.mark.parametrize("density", [3, 10, 100, 1000, 1e4])
@pytest.mark.parametrize("name", OTHERS)
def test_other_scenes(name: str, density: float, timestep: float, tmp_path: Path) -> None:
    """Large spheres, blocks, a row, one beside a wall and dimers go as far as with `rest no`."""
    # The accuracy is that of the light one's velocity: of two forces on it, which may differ by
    # 0.001 of its weight in the first steps, each moves a heavy one.
    assert_goes_on(OTHERS[name](density), tmp_path, timestep, exact=density <= 1000)


@pytest.mark.parametrize("density", [3, 10, 100, 1000, 1e4])
@pytest.mark.parametrize("name", OTHERS)
def test_other_scenes_solved_more_accurately(name: str, density: float, tmp_path: Path) -> None:
    """With a tenth of the accuracy they follow the exact equations, however heavy."""
    scene = OTHERS[name](density)
    assert_exact_way(scene, scene.run(tmp_path, 0.01, "accuracy 1e-4"))


@pytest.mark.parametrize("timestep", [1e-3, 0.01])
@pytest.mark.parametrize("density", DENSITIES)
def test_the_exact_way(density: float, timestep: float, tmp_path: Path) -> None:
    """With `rest no` a wedge follows the exact equations that tests compare with."""
    scene = wedge(density)
    assert_exact_way(scene, scene.run(tmp_path, timestep, "rest no"))
