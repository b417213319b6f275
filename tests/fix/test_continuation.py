"""A run that is interrupted, restarted or divided goes on as if nothing had happened.

Contacts amplify round-off; at a tolerance of 5e-9 r, 100 steps must agree within 0.0005 r.
"""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic import core
from tests.helpers.lammps_run import Runner, run_lmp
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    GRAVITY,
    FloatArray,
    deepest_in_box,
    deepest_pair,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.06
EXACT = 5e-9 * RADIUS
SAME = 0.0005 * RADIUS
BOX = ((0.0, 0.77), (0.0, 1.0), (0.0, 0.77))
STEPS = 100
FORCES = "fix agitation all random/force 5 77"


def cloud(folder: Path, **options: object) -> str:
    """Return the deck of 120 shaken spheres that fall and are piled up after 60 steps."""
    points = random_points(120, ((0.07, 0.7), (0.07, 0.95), (0.07, 0.7)), 2 * RADIUS, seed=6)
    settings: dict[str, object] = {"tolerance": EXACT, "box": BOX, "fixes": FORCES} | options
    return scene(points, RADIUS, folder, **settings) + "thermo 10\n"  # type: ignore[arg-type]


DUMP_LAST = DUMP_PARTICLES.replace("custom 1 ", f"custom {STEPS} ")


def last_positions(folder: Path) -> FloatArray:
    """Positions at step 100."""
    frame = read_dump(folder / "particles.dump")[-1]
    assert frame.step == STEPS
    return frame.positions


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> FloatArray:
    """Return the positions after 100 steps in one go."""
    folder = tmp_path_factory.mktemp("undisturbed")
    result = run_lmp(folder, cloud(folder) + DUMP_LAST + f"run {STEPS}\n")
    assert result.thermo["f_contact[5]"][-1] > 120
    return last_positions(folder)


def assert_same(positions: FloatArray, others: FloatArray) -> None:
    """Fail where a sphere is further than SAME from where it should be on an axis."""
    assert np.abs(positions - others).max() <= SAME


def test_two_ranks(undisturbed: FloatArray, tmp_path: Path, lmp: Runner) -> None:
    lmp(cloud(tmp_path) + DUMP_LAST + f"run {STEPS}\n", ranks=2)
    assert_same(last_positions(tmp_path), undisturbed)


@pytest.mark.parametrize(
    "runs",
    [
        "run 50\nrun 50",
        "run 50\nrun 50 pre no",
        "run 50\nrun 0\nrun 50",
        "run 50\nunfix contact\nfix contact all inelastic {eps} region container\nrun 50",
        "run 50\nfix_modify contact tolerance {eps}\nrun 50",
        "run 50\nwrite_restart a.restart\nwrite_data a.data\nrun 50",
        'run 100 every 20 "print again"',
        "run 31 post no\nrun 69 post no",
    ],
)
def test_two_runs(runs: str, undisturbed: FloatArray, tmp_path: Path, lmp: Runner) -> None:
    lmp(cloud(tmp_path) + DUMP_LAST + runs.format(eps=EXACT) + "\n")
    assert_same(last_positions(tmp_path), undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["restart", "data"])
@pytest.mark.parametrize("ranks", [1, 2])
def test_from_a_file(
    kind: str, ranks: int, undisturbed: FloatArray, tmp_path: Path, lmp: Runner
) -> None:
    deck = cloud(tmp_path)
    write = {"restart": "write_restart half.restart", "data": "write_data half.data nocoeff"}[kind]
    lmp(deck + f"run 50\n{write}\n", ranks=3 - ranks)
    second = deck.replace("read_data spheres.data", f"read_{kind} half.{kind}")
    if kind == "data":
        second += "reset_timestep 50\n"
    lmp(second + DUMP_LAST + "run 50\n", ranks=ranks)
    assert_same(last_positions(tmp_path), undisturbed)


def simulated(
    positions: FloatArray,
    radii: FloatArray,
    velocities: FloatArray,
    runs: list[tuple[int, float]],
    tolerance: float,
) -> list[FloatArray]:
    """Return the positions at every step, computed by the equations of a step alone.

    Each run is a number of steps and a time step. LAMMPS holds whole-step velocities between runs.
    """
    x, v = positions.copy(), velocities.copy()
    m = mass(radii)
    gravity = np.array([0, -GRAVITY, 0])
    pairs = np.array(list(combinations(range(len(x)), 2)), dtype=np.int64)

    def projected(predicted: FloatArray, step: float) -> FloatArray:
        apart = x[pairs[:, 0]] - x[pairs[:, 1]]
        distance = np.linalg.norm(apart, axis=1)
        normals = [apart / distance[:, None]]
        gaps = [distance - radii[pairs].sum(axis=1)]
        first, second = [pairs[:, 0]], [pairs[:, 1]]
        for axis, (low, high) in enumerate(BOX):
            for sign, face in ((1.0, low), (-1.0, high)):
                normal = np.zeros_like(x)
                normal[:, axis] = sign
                normals.append(normal)
                gaps.append(sign * (x[:, axis] - face) - radii)
                first.append(np.arange(len(x)))
                second.append(np.full(len(x), -1))
        problem = core.Problem(
            timestep=step,
            predicted_velocity=predicted,
            inverse_mass=1 / m,
            first=np.concatenate(first),
            second=np.concatenate(second),
            normal=np.concatenate(normals),
            gap=np.concatenate(gaps),
        )
        result = core.project(problem, core.Limits(tolerance))
        assert result.converged
        return result.velocity

    frames = [x.copy()]
    for count, step in runs:
        moving = projected(v + step / 2 * gravity, step)
        for _ in range(count):
            x += step * moving
            frames.append(x.copy())
            following = projected(moving + step * gravity, step)
            v = (moving + following) / 2
            moving = following
    return frames


@pytest.mark.parametrize(
    "runs",
    [
        [(100, 0.005)],
        [(50, 0.005), (50, 0.0025)],
        [(37, 0.0025), (21, 0.01), (42, 0.004)],
        [(1, 0.005), (1, 0.01), (30, 0.003), (0, 0.01), (40, 0.005)],
    ],
)
def test_against_a_few_lines_of_numpy(
    runs: list[tuple[int, float]], tmp_path: Path, lmp: Runner
) -> None:
    points = random_points(12, ((0.1, 0.45), (0.1, 0.4), (0.1, 0.45)), 0.15, seed=9)
    random = np.random.default_rng(10)
    radii = random.uniform(0.05, 0.075, len(points))
    velocities = random.normal(0, 0.5, points.shape)
    deck = scene(points, radii, tmp_path, tolerance=EXACT, velocities=velocities, box=BOX, skin=0.1)
    deck += DUMP_PARTICLES
    for count, step in runs:
        deck += f"timestep {step}\nrun {count}\n"
    lmp(deck)
    frames = read_dump(tmp_path / "particles.dump")
    steps = [frame.step for frame in frames]
    positions = [frame.positions for frame in frames]
    expected = simulated(points, radii, velocities, runs, EXACT)
    assert steps == list(range(len(expected)))
    worst = max(np.abs(a - b).max() for a, b in zip(positions, expected, strict=True))
    assert worst <= 0.0005 * radii.min()


def test_a_new_timestep_without_set_up_is_no_silent_mistake(tmp_path: Path, lmp: Runner) -> None:
    deck = cloud(tmp_path, tolerance=1e-5)
    result = lmp(deck + DUMP_PARTICLES + "run 10\ntimestep 0.01\nrun 10 pre no\n", must_pass=False)
    # LAMMPS's manual tells users not to do this. If it works, then with the new step.
    if result.status == 0:
        frames = read_dump(tmp_path / "particles.dump")
        highest = np.argmax(frames[-1]["y"])
        y = [frame["y"][highest] for frame in frames]
        assert (y[-1] - y[-2]) / (y[9] - y[8]) > 1.5
    else:
        assert len(result.errors) == 1


def test_the_tolerance_changes_between_runs(tmp_path: Path, lmp: Runner) -> None:
    loose, tight = 0.0005 * RADIUS, 1e-5 * RADIUS
    deck = cloud(tmp_path, tolerance=loose, fixes="fix drag all viscous 0.01")
    result = lmp(
        deck
        + "thermo 1\nrun 200\n"
        + f"fix_modify contact tolerance {tight}\nrun 1\n{DUMP_PARTICLES}run 20\n"
        + f"fix_modify contact tolerance {loose}\nrun 3\n"
    )
    for frame in read_dump(tmp_path / "particles.dump")[:21]:
        radii = frame["radius"]
        # The slack is round-off of the positions.
        assert deepest_pair(frame.positions, radii) <= tight * (1 + 1e-6)
        assert deepest_in_box(frame.positions, radii, BOX) <= tight * (1 + 1e-6)
    # What the accuracy leaves of it.
    assert 0 < result.runs[0]["f_contact[4]"][-1] <= loose * (1 + 1e-6)
    # The warm start is kept: a new run starts as cheaply as a step in the midst of one.
    # The median, for single steps take up to three times as many as most; so does a cold start.
    usual, after = (np.median(run["f_contact[1]"]) for run in result.runs[2:4])
    assert after <= 1.5 * usual


def deep_in_one_another(folder: Path) -> str:
    """Return the deck of two spheres that are pushed apart for more than three steps."""
    points = [[0.3, 0.5, 0.3], [0.36, 0.5, 0.3]]
    return scene(points, RADIUS, folder, tolerance=1e-5, box=BOX, gravity=False)


def test_a_restart_in_the_midst_of_pushing_apart_keeps_no_speed(
    tmp_path: Path, lmp: Runner
) -> None:
    deck = deep_in_one_another(tmp_path)
    lmp(deck + "run 3\nwrite_restart half.restart\n")
    second = deck.replace("read_data spheres.data", "read_restart half.restart")
    result = lmp(second + DUMP_PARTICLES + "run 60\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    # Pushed by up to 0.05 of the sum of radii a step: a speed of 1.2. What stays is the
    # tolerance over the time step.
    assert np.abs(end.velocities).max() <= 2 * 1e-5 / 0.005
    assert result.thermo["f_contact[4]"][-1] <= 1e-5 * (1 + 1e-6)  # round-off


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("step", [1, 2, 3])
def test_from_a_file_written_while_a_run_pushes_apart(
    step: int, ranks: int, undisturbed: FloatArray, tmp_path: Path, lmp: Runner
) -> None:
    """Spheres start 0.14 r deep in the lid, and three steps take them out."""
    deck = cloud(tmp_path)
    first = lmp(deck + "thermo 1\nrestart 1 here.*.restart\nrun 5\n", ranks=3 - ranks)
    assert first.thermo["f_contact[4]"][2] > 0.01 * RADIUS
    second = deck.replace("read_data spheres.data", f"read_restart here.{step}.restart")
    lmp(second + DUMP_LAST + f"run {STEPS - step}\n", ranks=ranks)
    assert_same(last_positions(tmp_path), undisturbed)


def test_velocities_set_after_reading_such_a_file_count(tmp_path: Path, lmp: Runner) -> None:
    deck = deep_in_one_another(tmp_path)
    lmp(deck + "restart 1 here.*.restart\nrun 3\n")
    second = deck.replace(
        "read_data spheres.data", "read_restart here.2.restart\nvelocity all set 0 0.25 0"
    )
    lmp(second + DUMP_PARTICLES + "run 60\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    # What stays of the push is the tolerance over the time step.
    assert np.abs(end.velocities - [0, 0.25, 0]).max() <= 2 * 1e-5 / 0.005


def test_velocities_set_during_pushing_apart_count(tmp_path: Path, lmp: Runner) -> None:
    """A velocity command replaces all velocity, whatever part of it was a push."""
    deck = scene(
        [[0.3, 0.5, 0.3], [0.3, 0.53, 0.3], [0.36, 0.5, 0.3]],
        RADIUS,
        tmp_path,
        tolerance=1e-5,
        box=BOX,
        gravity=False,
    )
    result = lmp(deck + "run 3\nvelocity all set 0 0 0\n" + DUMP_PARTICLES + "run 60\n")
    # At rest and pushed apart, they end at rest to the tolerance over the time step.
    end = read_dump(tmp_path / "particles.dump")[-1]
    assert np.abs(end.velocities).max() <= 3 * 1e-5 / 0.005
    assert result.thermo["f_contact[4]"][-1] <= 1e-5 * (1 + 1e-6)  # round-off
