"""Contacts take away the approaching velocity, however slow, at every time step and tolerance.

Velocities are given in tolerances a step: in units of EPS / h. Without forces the time step is then
only a unit of time, which the tests show, too.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tests.helpers.bodies import (
    DUMP_BODY_SPHERES,
    Bodies,
    body_scene,
    dimer,
    placed,
    random_bodies,
    rigid_velocities,
)
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    FloatArray,
    Frame,
    deepest_pair,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.5
SOLVERS = ("sweeps", "apgd", "uzawa")
# Tolerances a step, tolerance [diameters], time step.
SPEEDS = (1e-3, 1e-2, 0.3, 1.0, 30.0, 1e3)
TOLERANCES = (1e-2, 1e-5, 1e-8)
TIMESTEPS = (0.1, 1e-5)
GRID = [(speed, tolerance, 0.01) for speed in SPEEDS for tolerance in TOLERANCES] + [
    (speed, 1e-3, timestep) for speed in SPEEDS for timestep in TIMESTEPS
]
# Of the solvers that are not the default a fifth of the grid shows whether they do the same.
BY_SOLVERS = [
    pytest.param(case, solver, marks=[pytest.mark.slow] * (solver != SOLVERS[0] and k % 5 > 0))
    for solver in SOLVERS
    for k, case in enumerate(GRID)
]
# What is left of the approach: the accuracy of the default.
LEFT = 1e-3
SLACK = 1 + 1e-6  # round-off of positions, in a tolerance of 1e-8
WIDE = ((-30.0, 30.0),) * 3


def free_scene(
    points: ArrayLike,
    velocities: ArrayLike,
    case: tuple[float, float, float],
    folder: Path,
    **settings: object,
) -> str:
    """Return a deck of spheres without gravity; velocities in units of the approach."""
    speed, tolerance, timestep = case
    step = speed * tolerance
    options = {"options": "", **settings}
    return scene(
        points,
        RADIUS,
        folder,
        tolerance=tolerance,
        velocities=np.asarray(velocities) * step / timestep,
        box=WIDE,
        timestep=timestep,
        skin=0.3 + 3 * step,
        gravity=False,
        **options,  # type: ignore[arg-type]
    )


def moved(lmp: Runner, deck: str, steps: int, dump: str = DUMP_PARTICLES) -> list[Frame]:
    result = lmp(deck + dump + f"run {steps}\n")
    assert not any("inelastic" in line for line in result.warnings)
    return read_dump(result.folder / "particles.dump")


def relative_to_approach(frame: Frame, case: tuple[float, float, float]) -> FloatArray:
    """Velocities in units of the approach."""
    speed, tolerance, timestep = case
    return frame.velocities * timestep / (speed * tolerance)


def assert_momentum_kept(frames: list[Frame]) -> None:
    """To the round-off of a sum of velocities, relative to the largest."""
    start, end = frames[0].velocities, frames[-1].velocities
    assert np.abs(end.sum(axis=0) - start.sum(axis=0)).max() <= 1e-13 * np.abs(start).max() * len(
        start
    )


def assert_no_overlap(
    frames: list[Frame], case: tuple[float, float, float], molecules: object = None
) -> None:
    allowed = case[1] if molecules is None else 2 * case[1]
    for frame in frames:
        depth = deepest_pair(frame.positions, frame["radius"], molecules=molecules)  # type: ignore[arg-type]
        # Round-off of coordinates of the order of 1.
        assert depth <= allowed * SLACK + 4e-16


@pytest.mark.parametrize("shorter", [8, 64])
def test_a_pair_after_the_time_step_was_lowered(shorter: int, tmp_path: Path, lmp: Runner) -> None:
    """What is left in long steps, in which another pair meets, says nothing of a short one."""
    step, timestep = 0.01, 0.01
    case = (1e2, 1e-4, timestep)
    apart = [2 * RADIUS + 1.5 * step, 2 * RADIUS + 0.3 * step / shorter]
    points = np.array([[0, 0, 0], [apart[0], 0, 0], [0, 5, 0], [apart[1], 5, 0]])
    velocities = np.diag([1, 0, 0, 0])[:, :3]
    deck = free_scene(points, velocities, case, tmp_path) + DUMP_PARTICLES
    lmp(
        deck + f"run 3\ntimestep {timestep / shorter}\ngroup third id 3\n"
        f"velocity third set {step / timestep} 0 0\nrun 10\n"
    )
    last = relative_to_approach(read_dump(tmp_path / "particles.dump")[-1], case)[:, 0]
    assert last.sum() == pytest.approx(2, abs=1e-12)  # the momenta of both pairs, to round-off
    assert abs(last[0] - last[1]) <= LEFT
    # The set-up of the second run is a step of its own, whose overlap the first step gives back.
    assert abs(last[2] - last[3]) <= 2 * LEFT


@pytest.mark.parametrize(("case", "solver"), BY_SOLVERS, ids=str)
def test_a_pair(case: tuple[float, float, float], solver: str, tmp_path: Path, lmp: Runner) -> None:
    step = case[0] * case[1]
    along = np.array([2, 3, 6]) / 7
    points = np.outer([-0.5 - 0.65 * step, 0.5 + 0.65 * step], along)
    deck = free_scene(
        points, [0.5 * along, -0.5 * along], case, tmp_path, options=f"solver {solver}"
    )
    frames = moved(lmp, deck, 12)
    v = relative_to_approach(frames[-1], case)
    assert np.linalg.norm(v[1] - v[0]) <= LEFT
    assert_momentum_kept(frames)
    assert_no_overlap(frames, case)


@pytest.mark.parametrize(("case", "solver"), BY_SOLVERS, ids=str)
def test_a_wall(case: tuple[float, float, float], solver: str, tmp_path: Path, lmp: Runner) -> None:
    step = case[0] * case[1]
    deck = free_scene(
        [[0.5 + 1.3 * step, 0, 0]],
        [-1, 0, 0],
        case,
        tmp_path,
        setup="region floor plane 0 0 0 1 0 0",
        options=f"region floor solver {solver}",
    )
    frames = moved(lmp, deck, 12)
    assert np.linalg.norm(relative_to_approach(frames[-1], case)) <= LEFT
    for frame in frames:
        assert RADIUS - frame.positions[0, 0] <= case[1] * SLACK + 4e-16


@pytest.mark.parametrize("case", GRID, ids=str)
def test_three_in_a_row(case: tuple[float, float, float], tmp_path: Path, lmp: Runner) -> None:
    """The first runs into two that rest beside one another."""
    step = case[0] * case[1]
    places = np.array([-1.0 - 1.3 * step, 0, 1 + 0.2 * step])
    points = np.column_stack([places, np.zeros(3), np.zeros(3)])
    frames = moved(lmp, free_scene(points, [[1, 0, 0], [0] * 3, [0] * 3], case, tmp_path), 8)
    v = relative_to_approach(frames[-1], case)[:, 0]
    assert np.abs(np.diff(v)).max() <= LEFT
    assert v == pytest.approx(1 / 3, abs=LEFT)
    assert_momentum_kept(frames)
    assert_no_overlap(frames, case)


@pytest.mark.parametrize("case", GRID, ids=str)
def test_a_wedge(case: tuple[float, float, float], tmp_path: Path, lmp: Runner) -> None:
    """It meets one of two planes before the other, and slides along it."""
    step = case[0] * case[1]
    height = np.sqrt(0.5)
    deck = free_scene(
        [[0.4 * step, height + 2 * step, 0]],
        [0, -1, 0],
        case,
        tmp_path,
        setup="region left plane 0 0 0 1 1 0\nregion right plane 0 0 0 -1 1 0",
        options="region left right",
    )
    frames = moved(lmp, deck, 15)
    assert np.linalg.norm(relative_to_approach(frames[-1], case)) <= LEFT
    for frame in frames:
        x, y, _ = frame.positions[0]
        depth = RADIUS - min(y + x, y - x) * np.sqrt(0.5)
        assert depth <= case[1] * SLACK + 4e-16


# In longer steps the whole dimer would pass the floor: shorten yes is for that.
SHORT = [case for case in GRID if case[0] * case[1] <= 0.3]


@pytest.mark.parametrize("inertia", ["point", "solid"])
@pytest.mark.parametrize("case", SHORT, ids=str)
def test_a_dimer_on_one_end(
    case: tuple[float, float, float], inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    """Its lower sphere meets the floor, and stays there while the dimer turns."""
    speed, tolerance, timestep = case
    step = speed * tolerance
    turn = 0.6
    start = placed(dimer(1.5), [0, 0, 0], [0, 0, turn])
    lower = int(start.positions[:, 1].argmin())
    start = start.moved([0, RADIUS + 1.3 * step - start.positions[lower, 1], 0])
    v, w = rigid_velocities(start, RADIUS, [0, -step / timestep, 0], [0, 0, 0])
    deck = body_scene(
        start,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=tolerance,
        velocities=v,
        spins=w,
        box=WIDE,
        timestep=timestep,
        skin=0.3 + 3 * step,
        gravity=False,
        setup="region floor plane 0 0 0 0 1 0",
        options="region floor",
    )
    frames = moved(lmp, deck, 6, DUMP_BODY_SPHERES)
    left = [relative_to_approach(frame, case)[lower, 1] for frame in frames[3:]]
    # The lower end is on an arc: a dimer that meets the floor under an angle a turns with w =
    # speed / arm x cos a / (1 + cos(a)^2) (point masses; solid spheres turn less), at most 0.5
    # speed / arm, and the end then rises with w^2 arm, for at most six steps.
    arm = 0.5 * RADIUS
    assert np.abs(left).max() <= LEFT + 6 * 0.5**2 * step / arm
    energy = [float((frame.velocities**2).sum()) for frame in frames]
    assert max(energy) <= energy[0] * (1 + 1e-9)  # round-off of rotation
    for frame in frames:
        assert RADIUS - frame.positions[:, 1].min() <= 2 * tolerance * SLACK + 4e-16


def kinetic_energy(frames: list[Frame]) -> FloatArray:
    """Of free spheres, or of bodies of point masses."""
    return np.array(
        [0.5 * float(mass(f["radius"]) @ (f.velocities**2).sum(axis=1)) for f in frames]
    )


def assert_cools(energy: FloatArray) -> None:
    assert energy.max() <= energy[0] * (1 + 1e-12)  # a sum of squares
    assert (energy[10:] - energy[:-10]).max() <= 1e-4 * energy[0]
    assert energy[-1] < 0.95 * energy[0]


# Wider than where the centres start: no two overlap across a boundary.
PERIODIC = ((0.0, 6.001),) * 3
# Steps in which a sphere moves about half a diameter, near neighbours are 1e-3 diameters away.
GASES = ((0.3, 1e-2, 300), (3.0, 1e-3, 300), (100.0, 1e-3, 30), (1e3, 1e-4, 30), (1.0, 1e-2, 100))


def gas_of_spheres(
    folder: Path, seed: int, speed: float, tolerance: float, options: str = ""
) -> str:
    """Return a deck of 85 spheres; the mean square of each component is `speed` squared."""
    points = random_points(85, ((0.0, 5.0),) * 3, 2 * RADIUS * 1.001, seed=seed)
    velocities = np.random.default_rng(seed).normal(size=points.shape)
    return scene(
        points,
        RADIUS,
        folder,
        tolerance=tolerance,
        velocities=(velocities - velocities.mean(axis=0)) * speed * tolerance / 0.01,
        box=PERIODIC,
        boundary="p p p",
        timestep=0.01,
        gravity=False,
        options=f"{options} shorten yes",
    )


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("gas", GASES, ids=str)
def test_a_gas_of_spheres(
    gas: tuple[float, float, int], solver: str, tmp_path: Path, lmp: Runner
) -> None:
    speed, tolerance, steps = gas
    deck = gas_of_spheres(tmp_path, 3, speed, tolerance, f"solver {solver}")
    frames = moved(lmp, deck, steps)
    assert_cools(kinetic_energy(frames))
    assert_momentum_kept(frames)


@pytest.mark.parametrize("gas", GASES, ids=str)
def test_a_gas_of_dimers(gas: tuple[float, float, int], tmp_path: Path, lmp: Runner) -> None:
    speed, tolerance, steps = gas
    start: Bodies = random_bodies(
        [dimer(1.5)] * 40, RADIUS, ((0.5, 5.5),) * 3, 3, distance=2 * RADIUS * 1.001
    )
    random = np.random.default_rng(3)
    v, w = rigid_velocities(start, RADIUS, random.normal(size=(40, 3)), random.normal(size=(40, 3)))
    deck = body_scene(
        start,
        RADIUS,
        tmp_path,
        inertia="point",
        tolerance=tolerance,
        velocities=v * speed * tolerance / 0.01,
        spins=w * speed * tolerance / 0.01,
        box=((-0.1, 6.1),) * 3,
        boundary="p p p",
        timestep=0.01,
        gravity=False,
        options="shorten yes",
    )
    assert_cools(kinetic_energy(moved(lmp, deck, steps, DUMP_BODY_SPHERES)))


@pytest.mark.parametrize("violent", [1.0, 1e3])
def test_a_slow_pair_beside_a_violent_one(violent: float, tmp_path: Path, lmp: Runner) -> None:
    """What the slow one keeps is a part of the fast one's velocity, and stops in the end."""
    slow, tolerance, timestep = 1e-2, 1e-3, 0.01
    step = np.array([slow, violent]) * tolerance
    points = [
        [-0.5 - 0.65 * step[0], 5, 0],
        [0.5 + 0.65 * step[0], 5, 0],
        [-0.5 - 3.65 * step[1], -5, 0],
        [0.5 + 3.65 * step[1], -5, 0],
    ]
    along = np.array([1, 0, 0])
    v = [0.5 * k * s * along / timestep for s in step for k in (1, -1)]
    deck = scene(
        points,
        RADIUS,
        tmp_path,
        tolerance=tolerance,
        velocities=v,
        box=WIDE,
        timestep=timestep,
        skin=0.3 + 3 * step[1],
        gravity=False,
        options="",
    )
    frames = moved(lmp, deck, 60)
    end = frames[-1].velocities[:, 0] * timestep / tolerance
    assert abs(end[1] - end[0]) <= LEFT * slow
    assert abs(end[3] - end[2]) <= LEFT * violent


@pytest.mark.parametrize("accuracy", [1e-6, 1e-4, 0.1])
def test_accuracy(accuracy: float, tmp_path: Path, lmp: Runner) -> None:
    """A keyword sets how much of the approach may be left."""
    case = (0.1, 1e-3, 0.01)
    step = case[0] * case[1]
    # Five in a ring around one: no solver finds the end in a few iterations.
    angles = 2 * np.pi * np.arange(5) / 5
    ring = (1 + 1.2 * step) * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = np.vstack([[0, 0, 0], ring])
    velocities = np.vstack([[0.3, 0.1, 0], -ring / np.linalg.norm(ring[0])])
    deck = free_scene(points, velocities, case, tmp_path, options=f"accuracy {accuracy:g}")
    v = relative_to_approach(moved(lmp, deck, 25)[-1], case)
    opening = [(v[k] - v[0]) @ points[k] for k in range(1, 6)]
    # It is a part of the largest approach, 1.3, and what an overlap gives back is as much again.
    assert max(map(abs, opening)) <= 2.6 * accuracy


def test_overlaps_of_the_start_are_no_velocity(tmp_path: Path, lmp: Runner) -> None:
    """A restart file, or a data file, may hold overlaps that were allowed."""
    case = (0.1, 1e-3, 0.01)
    points = np.array([[-0.5 + 4e-4, 0, 0], [0.5 - 4e-4, 0, 0]])
    frames = moved(lmp, free_scene(points, np.zeros((2, 3)), case, tmp_path), 30)
    # What an overlap gives back is what velocities are resolved to, and here nothing moves.
    assert np.abs(relative_to_approach(frames[-1], case)).max() <= LEFT


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_gas_in_parts(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    """Divided runs, and one that goes on from a restart file: no energy comes in between."""
    deck = gas_of_spheres(tmp_path, 4, 1.0, 1e-2)
    first = lmp(deck + 4 * "run 15\n" + "write_restart half.restart\n", ranks=ranks)
    again = deck.replace("read_data spheres.data", "read_restart half.restart")
    second = lmp(again + 4 * "run 15\n", ranks=ranks)
    energy = np.concatenate([part["KinEng"] for run in (first, second) for part in run.runs])
    assert_cools(energy)
