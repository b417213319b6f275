"""What a step gives back of overlaps adds little energy, whatever room there is for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.lammps_run import Run, Runner
from tests.helpers.scenes import DUMP_PARTICLES, deepest_pair, read_dump, scene

RADIUS = 0.5
EPS = 1e-6
STEP = 0.01
# The most that a step gives back, as a speed, and ten times that: so fast may all be by it.
GIVEN_BACK = 2 * EPS / STEP
MOST = 10 * GIVEN_BACK


def between_two(
    folder: Path, lmp: Runner, angle: float, depth: float, options: str = "", ranks: int = 1
) -> Run:
    """A sphere between two frozen ones, beside their line by an angle, deep in both by so much.

    It can only go aside, and that by 1 / angle as far as the overlaps open.
    """
    reach = (2 * RADIUS - depth) * np.array([np.cos(angle), np.sin(angle), 0.0])
    middle = np.array([2.0, 2.0, 2.0])
    away = reach * [-1, 1, 1]
    deck = scene(
        [middle, middle + reach, middle + away],
        RADIUS,
        folder,
        tolerance=EPS,
        timestep=STEP,
        gravity=False,
        box=((0, 4), (0, 4), (0, 4)),
        skin=0.5,
        options=f"region container frozen held {options}",
        fixes="group held id 2 3\n",
        motion="group free subtract all held\nfix motion free nve",
        setup=f"processors {ranks} 1 1\n",
    )
    return lmp(deck + DUMP_PARTICLES + "run 50\n", ranks=ranks)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("options", ["", "shorten yes", "solver apgd", "rest no"])
@pytest.mark.parametrize("depth", [0.9, 1.2, 1.9])
@pytest.mark.parametrize("angle", [1e-3, 1e-5])
def test_without_room_overlaps_wait(
    angle: float, depth: float, options: str, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """To open what is beyond a tolerance would throw the sphere out at 1 / angle of that speed."""
    result = between_two(tmp_path, lmp, angle, depth * EPS, options, ranks)
    frames = read_dump(tmp_path / "particles.dump")
    speeds = [float(np.linalg.norm(frame.velocities[0])) for frame in frames]
    assert max(speeds) <= MOST
    # Regular overlaps stay regular.
    deepest = [deepest_pair(frame.positions, frame["radius"]) for frame in frames]
    assert max(deepest) <= 2 * EPS
    stays = "overlaps stayed, since there was no room to give them back" in result.screen
    # Up to a tolerance nothing has to be given back; beyond, the summary says that it is not.
    assert stays == (depth > 1)


def test_with_room_they_are_given_back(tmp_path: Path, lmp: Runner) -> None:
    """In one step, but for half a tolerance and a residual."""
    result = between_two(tmp_path, lmp, 0.5, 1.9 * EPS)
    frames = read_dump(tmp_path / "particles.dump")
    assert deepest_pair(frames[2].positions, frames[2]["radius"]) <= EPS
    assert float(np.linalg.norm(frames[2].velocities[0])) <= MOST
    assert "overlaps stayed" not in result.screen
