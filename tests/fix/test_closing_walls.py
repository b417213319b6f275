"""Walls that close on a layer one grain high: what happens is said in one line."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.exact_scenes import RADIUS, STEP, spheres_of
from tests.helpers.lammps_run import Run, Runner
from tests.helpers.scenes import DUMP_PARTICLES, read_dump

SPEED = 1.0  # of the lid
EPS = 1e-3  # of spheres_of
LAYER = [[1.2 * k, RADIUS, 1.2 * j] for k in range(4) for j in range(3)]
# The same places, two and two of them a body.
PAIRS = np.arange(12) // 2 + 1


def closing(
    folder: Path,
    *,
    angle: float,
    bodies: bool = False,
    one_that_stays: bool = False,
    **settings: object,
) -> str:
    """Return a layer on a floor and under a lid that rises by an angle along x, and comes down.

    There may be one grain more, far off where the lid is higher.
    """
    height = 2 * RADIUS + 0.013
    lid = f"plane 0 {height} 0 {np.sin(angle):.17g} {-np.cos(angle):.17g} 0"
    setup = (
        "region floor plane 0 0 0 0 1 0\n"
        f"variable down equal -{SPEED}*time\nregion lid {lid} move NULL v_down NULL\n"
    )
    common: dict[str, object] = {"setup": setup, "options": "region floor lid", "gravity": False}
    layer = np.array(LAYER)
    if bodies:
        # Along z, where the lid is level.
        layer = np.array([[2.0 * k, RADIUS, 0.8 * j] for k in range(6) for j in range(2)])
    if one_that_stays:
        layer = np.vstack([layer, [20.0, RADIUS, 0.0]])
    return spheres_of(
        layer, folder, bodies=PAIRS if bodies else None, tolerance=EPS, **(common | settings)
    )


def fastest(result: Run) -> float:
    """Return the largest speed of a sphere in all frames."""
    frames = read_dump(result.folder / "particles.dump")
    return max(float(np.linalg.norm(frame.velocities, axis=1).max()) for frame in frames)


@pytest.mark.parametrize("bodies", [False, True], ids=["spheres", "dimers"])
@pytest.mark.parametrize(("options", "ranks"), [("", 1), ("", 2), ("shorten yes", 1)])
def test_parallel_walls_leave_no_room(
    options: str, bodies: bool, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """The error says so, and names a sphere; until then nothing is faster than the lid."""
    text = closing(tmp_path, angle=0.0, bodies=bodies, options=f"region floor lid {options}")
    result = lmp(text + DUMP_PARTICLES + "run 20\n", ranks=ranks, must_pass=False)
    (error,) = result.errors
    assert "leaves no room" in error
    assert re.search(r"atom \d+ and wall [12] overlap", error), error
    # The default accuracy of a contact is a thousandth.
    assert fastest(result) <= SPEED * (1 + 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("bodies", [False, True], ids=["spheres", "dimers"])
def test_a_wedge_squeezes_grains_out(bodies: bool, ranks: int, tmp_path: Path, lmp: Runner) -> None:
    """Between walls at an angle a grain leaves at SPEED / tan(angle), which one line tells."""
    angle = 0.005
    # Impulses that nearly balance hardly differ for a search: by default the speed of the grain has
    # come to within 0.002 when it ends.
    options = "region floor lid shorten yes accuracy 1e-4"
    text = closing(tmp_path, angle=angle, bodies=bodies, options=options, skin=3.0)
    result = lmp(text + DUMP_PARTICLES + "run 2\nrun 1\n", ranks=ranks)
    said = [line for line in result.warnings if "walls that close squeeze atom" in line]
    # Once in the first run; in the second one it is no faster than before.
    assert len(said) == 1, result.warnings
    found = re.search(r"at (\S+), (\S+) times as fast as anything moved", said[0])
    assert found, said
    # What the lid has gone in the step before it met the grain is no motion of the grain's.
    assert 30 < float(found[2]) <= 1.01 / np.tan(angle)
    # What is given by the default accuracy where normals are not nearly opposite
    assert fastest(result) == pytest.approx(SPEED / np.tan(angle), rel=1e-3)


def test_a_wedge_in_a_step_too_long(tmp_path: Path, refused: Callable[..., str]) -> None:
    """Where the neighbour list is too short for it, the error names the walls, not the skin."""
    error = refused(closing(tmp_path, angle=0.005, one_that_stays=True) + "run 20\n")
    assert "walls that close squeeze atom" in error
    assert "skin" not in error


@pytest.mark.parametrize("angle", [0.0, 0.1])
def test_grains_that_have_room_are_not_told_of(angle: float, tmp_path: Path, lmp: Runner) -> None:
    """A heap of two layers is pressed to one, or a layer out of a wide wedge, without a word."""
    random = np.random.default_rng(3)
    heap = np.array([[1.4 * k, RADIUS, 1.4 * j] for k in range(5) for j in range(5)])
    upper = heap[heap[:, 0] < 5] + [0.6, 0.9, 0.65] + random.uniform(0, 0.02, (20, 3))
    lid = f"plane 0 2.1 0 {np.sin(angle):.17g} {-np.cos(angle):.17g} 0"
    text = spheres_of(
        np.vstack([heap, upper]),
        tmp_path,
        tolerance=EPS,
        setup="region floor plane 0 0 0 0 1 0\n"
        f"variable down equal -0.5*time\nregion lid {lid} move NULL v_down NULL\n",
        options="region floor lid shorten yes",
    )
    result = lmp(text + f"run {int(1.0 / (0.5 * STEP))}\n")
    assert not result.warnings
