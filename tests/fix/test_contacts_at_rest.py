"""Columns at rest stay where they are and give nothing back, and beds are quiet.

See "What each tolerance bounds" and "What is at rest" in docs/method.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    GRAVITY,
    deepest_in_box,
    deepest_pair,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.05
STEP = 0.0025
EPS = 1e-3 * 2 * RADIUS
WEIGHT = float(mass(RADIUS)) * GRAVITY
COLUMN = [[0.5, RADIUS * (1 + 2 * k), 0.5] for k in range(8)]
# Steps after which a column is at rest.
RESTED = 60


def column(folder: Path, **settings: object) -> str:
    defaults: dict[str, object] = {"tolerance": EPS, "timestep": STEP, "skin": 0.1}
    return scene(COLUMN, RADIUS, folder, **(defaults | settings))  # type: ignore[arg-type]


def test_a_column_stays_where_it_is(tmp_path: Path, lmp: Runner) -> None:
    deck = column(tmp_path, options="region container record step*.npz every 100")
    lmp(deck + DUMP_PARTICLES + "run 400\n")
    frames = read_dump(tmp_path / "particles.dump")
    start, end = frames[RESTED].positions, frames[-1].positions
    with np.load(tmp_path / "step400.npz") as file:
        record = dict(file)
    # At rest nothing moves, to round-off.
    assert np.abs(end - start).max() <= 1e-15
    assert np.abs(frames[-1].velocities).max() <= 1e-12 * GRAVITY * STEP
    assert np.abs(record["gap_now"]).max() <= 0.5 * EPS
    # Each contact carries what is above it, to the accuracy of the mean contact.
    above = np.sort(record["impulse"])[::-1] / (WEIGHT * STEP)
    exact = np.arange(len(COLUMN), 0, -1)
    assert above == pytest.approx(exact, abs=1e-3 * exact.mean())


def test_an_impact_elsewhere_is_not_felt(tmp_path: Path, lmp: Runner) -> None:
    """What is at rest has no velocity, whatever happens beside it."""
    points = [*COLUMN, [0.8, RADIUS + 0.4, 0.8]]
    velocities = np.zeros((len(points), 3))
    velocities[-1, 1] = -0.5
    deck = scene(
        points, RADIUS, tmp_path, tolerance=EPS, velocities=velocities, timestep=STEP, skin=0.1
    )
    lmp(deck + DUMP_PARTICLES + "run 200\n")
    frames = read_dump(tmp_path / "particles.dump")
    fastest = max(float(-frame.velocities[-1, 1]) for frame in frames)
    assert fastest > 2.0
    assert np.linalg.norm(frames[-1].velocities[-1]) < 0.01  # it has met the floor
    speeds = [np.abs(frame.velocities[:-1]).max() for frame in frames[RESTED:]]
    # Round-off of a velocity that gravity gives and the column takes away.
    assert max(speeds) <= 1e-12 * GRAVITY * STEP


def test_a_column_gives_nothing_back(tmp_path: Path, lmp: Runner) -> None:
    """Its weight goes from one step to the next."""
    lmp(column(tmp_path) + DUMP_PARTICLES + "run 200\nunfix gravity\nrun 200\n")
    frames = read_dump(tmp_path / "particles.dump")
    fastest = max(np.abs(frame.velocities).max() for frame in frames[201:])
    print(f"its spheres leave at up to {fastest / (GRAVITY * STEP):.2f} g h")
    # Contacts that close at no force are resolved to a sixteenth of the accuracy of 0.001.
    assert fastest <= 0.001 / 16 * GRAVITY * STEP


@pytest.mark.parametrize(("above", "velocity"), [(0.02, 1.0), (0.05, 1.0), (0.8, -2.5)])
def test_what_a_column_gives_back_of_an_impact(
    above: float, velocity: float, tmp_path: Path, lmp: Runner
) -> None:
    """A sphere falls on it after it has rested, with a long step and with a short one."""
    points = [*COLUMN, [0.5, COLUMN[-1][1] + 2 * RADIUS + above, 0.5]]
    velocities = np.zeros((len(points), 3))
    velocities[-1, 1] = velocity
    rebounds = []
    for shorter in (1, 4):
        deck = scene(
            points,
            RADIUS,
            tmp_path / str(shorter),
            tolerance=EPS,
            velocities=velocities,
            timestep=STEP / shorter,
            skin=0.1,
        )
        lmp(deck + DUMP_PARTICLES + f"run {3 * RESTED * shorter}\n", into=str(shorter))
        frames = read_dump(tmp_path / str(shorter) / "particles.dump")
        falling = [float(-frame.velocities[-1, 1]) for frame in frames]
        fastest = max(falling)
        assert fastest > 1.0
        hit = falling.index(fastest)
        upward = np.array([frame.velocities[:, 1] for frame in frames[hit:]])
        rebounds.append(float(upward.max()))
        opening = np.diff(upward, axis=1, prepend=0.0).max()
        # Each contact leaves 1e-3 of the approach.
        assert opening <= 1e-3 * fastest
        for frame in frames:
            depth = deepest_pair(frame.positions, frame["radius"])
            assert depth <= EPS * (1 + 1e-9)  # round-off
    print(f"falling at {fastest:.2f}, comes back at {rebounds[0]:.4f} and {rebounds[1]:.4f}")


BED_BOX = ((0, 0.7), (0, 2), (0, 0.7))


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_bed_is_quiet_and_cheap(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    inside = tuple((low + RADIUS, high - RADIUS) for low, high in BED_BOX)
    deck = scene(
        random_points(300, inside, 2 * RADIUS, seed=2),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        timestep=STEP,
        skin=0.1,
        box=BED_BOX,
        fixes=f"fix drag all viscous {4 * float(mass(RADIUS))}",
        options="region container shorten yes",
    )
    deck = deck.replace("thermo 1\n", "thermo 50\n")
    result = lmp(deck + "run 5000\n" + DUMP_PARTICLES + "thermo 1\nrun 200\n", ranks=ranks)
    # That a run begins, with half a kick, disturbs nothing: the energy is that of its own scatter,
    # and of a sphere that moves no faster than what may be at rest.
    slow = 0.5 * float(mass(RADIUS)) * (5e-3 * GRAVITY * STEP) ** 2
    # (Later on a single sphere may begin to slide, as the exact solution does.)
    beginning = result.runs[-1]["KinEng"][:100]
    assert beginning.max() <= 5 * result.runs[-2]["KinEng"][-20:].mean() + slow
    mean = np.sqrt(2 * result.runs[-1]["KinEng"].mean() / (300 * float(mass(RADIUS))))
    # The bound of the validation of beds at rest
    assert mean <= 0.02 * GRAVITY * STEP
    # Held grains take no iteration; one that slides on takes some in each step, 39 on one of the
    # processors tried. As in that validation, a tenth of what the fall takes.
    assert np.median(result.runs[-1]["f_contact[1]"]) <= 100
    frames = read_dump(tmp_path / "particles.dump")
    for frame in frames:
        depth = deepest_pair(frame.positions, frame["radius"])
        depth = max(depth, deepest_in_box(frame.positions, frame["radius"], BED_BOX))
        assert depth <= EPS * (1 + 1e-9)  # round-off
