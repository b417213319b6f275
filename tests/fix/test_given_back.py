"""What a step gives back of overlaps adds little energy, whatever room there is for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.lammps_run import Run, Runner
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    deepest_pair,
    mass,
    random_points,
    read_dump,
    scene,
)

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


@pytest.mark.parametrize("shape", ["cylinder", "cone", "sphere"])
def test_overlaps_with_curved_walls_stay_within_the_tolerance(
    shape: str, tmp_path: Path, lmp: Runner
) -> None:
    """At every step of a bed that falls, slides and comes to rest, as at flat walls."""
    radius, eps, wide = 0.1, 2e-5, 0.5
    regions = {
        "cylinder": f"cylinder y 0 0 {wide} 0 4",
        "cone": f"cone y 0 0 0.2 {wide} 0 4",
        "sphere": f"sphere 0 {wide} 0 {wide}",
    }
    inside = ((-0.3, 0.3), (0.25, 0.8 if shape == "sphere" else 3.9), (-0.3, 0.3))
    points = random_points(20 if shape == "sphere" else 60, inside, 0, seed=2)
    if shape == "cone":
        points[:, [0, 2]] *= 0.2
    deck = scene(
        points,
        radius,
        tmp_path,
        tolerance=eps,
        box=((-1.0, 1.0), (-0.5, 4.5), (-1.0, 1.0)),
        timestep=0.01,
        skin=0.2,
        options="region curved",
        setup="",
        fixes=f"region curved {regions[shape]}\nfix drag all viscous {float(mass(radius)):.17g}",
    )
    # The start is pushed apart first.
    lmp(deck + "run 60\n" + DUMP_PARTICLES + "run 300\n")
    for frame in read_dump(tmp_path / "particles.dump"):
        x, y, z = frame.positions.T
        across = np.hypot(x, z)
        if shape == "cylinder":
            gaps = [wide - across, y]
        elif shape == "cone":
            # The distance from its straight side, which leans outwards.
            lean = np.hypot(wide - 0.2, 4.0)
            gaps = [((0.2 + (wide - 0.2) / 4 * y) - across) * 4.0 / lean, y]
        else:
            gaps = [wide - np.sqrt(across**2 + (y - wide) ** 2)]
        # Round-off of positions.
        assert min(gap.min() for gap in gaps) - radius >= -eps * (1 + 1e-6)
        assert deepest_pair(frame.positions, frame["radius"]) <= eps * (1 + 1e-6)


def test_what_the_last_step_leaves_is_no_jam(tmp_path: Path, lmp: Runner) -> None:
    """Spheres over a floor that shakes with 250 g: all steps are solved, and no room is missing.

    A sphere that has left another one keeps a trace of the impulse that threw it, within the
    accuracy, while it gives an overlap of a thousandth of a tolerance back.
    """
    radius, timestep = 0.055, 0.005
    deck = scene(
        random_points(200, ((0.06, 0.94), (0.06, 2), (0.06, 0.94)), 2 * radius, seed=1),
        radius,
        tmp_path,
        tolerance=0.0005 * radius,
        timestep=timestep,
        skin=0.6,
        box=((0, 1), (-1, 30), (0, 1)),
        setup=f"variable up equal 0.1*sin({np.pi / (4 * timestep):.17g}*time)\n"
        "region floor plane 0 0 0 0 1 0 move NULL v_up NULL\n",
        options="region container floor",
    )
    result = lmp(deck + "run 150\n")
    assert not result.errors
    assert "no room" not in result.screen
