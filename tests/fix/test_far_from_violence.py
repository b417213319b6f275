"""A contact is no worse for what happens elsewhere at the same time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tests.helpers.exact_scenes import MASS, RADIUS, SETTLED, WEIGHT, path, spheres_of
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import DUMP_PARTICLES, GRAVITY, FloatArray

# Of the approach of a pair that meets across a gap: half as much again as the accuracy.
LEFT = 1.5e-3


def column_beside_gases(
    folder: Path, gases: int, speed: float, tolerance: float, ranks: int, timestep: float
) -> str:
    """Return a deck of ten spheres that lie on one another, and boxes of 64 that fly, with E = 1.

    The gases have a temperature of the square of `speed`. Walls between the boxes, and one above
    the floor of the gases, keep that floor, wall 3, for the column. It is higher than they fly in a
    step: where both ask for a bounce it is of no matter to the gases which of them carries it.
    """
    edges = 1.45 + 1.9 * np.arange(4)
    gas = np.stack(np.meshgrid(edges, edges, edges), axis=-1).reshape(-1, 3)
    points = [np.column_stack([np.full(10, 15.0), RADIUS + np.arange(10), np.full(10, 5.0)])]
    points += [gas + np.array([-10.0 * k, 4.0, 0.0]) for k in range(gases)]
    random = np.random.default_rng(4711).normal(size=(gases, 64, 3))
    random -= random.mean(axis=1, keepdims=True)
    flying = random.reshape(-1, 3) * speed / np.sqrt(MASS)
    walls = "".join(
        f"region wall{k} block {10 - 10 * k} {11 - 10 * k} -5 35 -5 15 side out\n"
        for k in range(gases)
    )
    walls += f"region under block {-10 * gases} 10.5 -5 4.3 -5 15 side out\n"
    names = " ".join(f"wall{k}" for k in range(gases)) + " under"
    return spheres_of(
        np.vstack(points),
        folder,
        velocities=np.vstack([np.zeros((10, 3)), flying]),
        tolerance=tolerance,
        timestep=timestep,
        skin=0.8,
        box=((10 - 10 * gases, 20), (0, 30), (0, 10)),
        setup=f"processors {ranks} 1 1\n" + walls,
        gravity=False,
        fixes="group column id 1:10\n"
        f"fix gravity column gravity {GRAVITY} vector 0 -1 0\n"
        "variable speed atom sqrt(vx^2+vy^2+vz^2)\n"
        "compute fastest column reduce max v_speed\n"
        "variable floor equal f_contact[3][2]\n",
        options=f"region container {names} shorten yes law restitution 1",
        thermo="step f_contact[1] f_contact[10] v_floor c_fastest",
    )


def check_column(lmp: Runner, deck: str, steps: int, ranks: int, timestep: float) -> None:
    """Its floor carries ten weights, and nothing moves."""
    thermo = lmp(deck + f"run {steps}\n", ranks=ranks, timeout=300).thermo
    floor = -thermo["v_floor"][SETTLED:] / WEIGHT
    fastest = thermo["c_fastest"][SETTLED:].max() / (GRAVITY * timestep)
    print(
        f"floor {floor.min():.4f} to {floor.max():.4f} weights, column {fastest:.4f} g h, "
        f"{thermo['f_contact[10]'][-1]:.0f} steps shortened"
    )
    assert floor == pytest.approx(np.full(len(floor), 10.0), rel=0.01)
    assert fastest <= 0.02


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("timestep", [0.005, 0.001])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0, 40.0])
def test_a_column_beside_a_gas(
    speed: float, tolerance: float, timestep: float, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    deck = column_beside_gases(tmp_path, 1, speed, tolerance, ranks, timestep)
    check_column(lmp, deck, 200, ranks, timestep)


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0, 40.0])
@pytest.mark.parametrize("gases", [1, 2, 10])
def test_a_column_beside_gases(
    gases: int, speed: float, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    deck = column_beside_gases(tmp_path, gases, speed, 1e-3, ranks, 0.005)
    check_column(lmp, deck, 1500, ranks, 0.005)


def parting(
    speeds: ArrayLike,
    gaps: ArrayLike,
    tolerance: float,
    folder: Path,
    lmp: Runner,
    law: str = "inelastic",
) -> FloatArray:
    """(steps, pairs) velocities at which pairs part, after steps in which all have met.

    They are far from one another. One sphere of each flies to the other; velocities in units of
    `speeds`, and `gaps` in units of what it flies in a step.
    """
    timestep = 0.01
    speed, gap = np.broadcast_arrays(np.asarray(speeds, dtype=float), gaps)
    points = np.zeros((2 * len(speed), 3))
    points[::2, 0] = -1 - gap * speed * timestep
    points[:, 1] = 3 * np.repeat(np.arange(len(speed)), 2)
    velocities = np.zeros_like(points)
    velocities[::2, 0] = speed
    deck = spheres_of(
        points,
        folder,
        velocities=velocities,
        tolerance=tolerance,
        timestep=timestep,
        skin=0.3 + 3 * float(speed.max()) * timestep,
        setup="",
        gravity=False,
        options=f"law {law}",
    )
    lmp(deck + DUMP_PARTICLES + "run 12\n")
    v = path(folder)[int(np.max(gap)) + SETTLED :, :, 3]
    return (v[:, 1::2] - v[:, ::2]) / speed


@pytest.mark.parametrize("later", [0, 0.3, 1])
@pytest.mark.parametrize("gap", [0.03, 0.1, 0.2])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5])
@pytest.mark.parametrize("fast", [(1.0,), (10.0,), (100.0,), (1.0, 10.0, 100.0)], ids=str)
def test_a_slow_pair_beside_fast_ones(
    fast: tuple[float, ...], tolerance: float, gap: float, later: float, tmp_path: Path, lmp: Runner
) -> None:
    """They meet in the same step, or the fast ones so many steps later."""
    gaps = [gap, *[gap + later] * len(fast)]
    left = np.abs(parting([0.01, *fast], gaps, tolerance, tmp_path, lmp)).max(axis=0)
    print(f"left {left}")
    assert left.max() <= LEFT


@pytest.mark.parametrize("fast", [1.0, 10.0, 100.0])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5])
@pytest.mark.parametrize("row", [2, 5, 20])
def test_a_slow_row_beside_a_fast_pair(
    row: int, tolerance: float, fast: float, tmp_path: Path, lmp: Runner
) -> None:
    """One meets a row of touching spheres at 0.01: all go on with its share of the momentum."""
    timestep, slow, gap = 0.01, 0.01, 0.1
    step = timestep * np.array([slow, fast])
    points = np.zeros((row + 3, 3))
    points[: row + 1, 0] = np.arange(row + 1)
    points[0, 0] -= gap * step[0]
    points[-2:] = [[-1 - gap * step[1], 5, 0], [0, 5, 0]]
    velocities = np.zeros_like(points)
    velocities[[0, -2], 0] = slow, fast
    deck = spheres_of(
        points,
        tmp_path,
        velocities=velocities,
        tolerance=tolerance,
        timestep=timestep,
        skin=0.3 + 3 * float(step[1]),
        setup="",
        gravity=False,
        options="",
    )
    lmp(deck + DUMP_PARTICLES + "run 12\n")
    v = path(tmp_path)[SETTLED:, :-2, 3] / slow
    parts = np.diff(v, axis=1)
    print(f"neighbours part with {parts.max():.5f} of the approach")
    assert v.mean(axis=1) == pytest.approx(np.full(len(v), 1 / (row + 1)), rel=1e-12)  # round-off
    assert np.abs(parts).max() <= LEFT


@pytest.mark.parametrize("restitution", [0.0, 0.9])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5])
@pytest.mark.parametrize("gap", [0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0])
def test_a_pair_alone(
    gap: float, tolerance: float, restitution: float, tmp_path: Path, lmp: Runner
) -> None:
    """It keeps nothing of its approach, or parts as its law says."""
    law = f"restitution {restitution}" if restitution else "inelastic"
    parts = parting([1.0], [gap], tolerance, tmp_path, lmp, law)
    print(f"parts with {parts[-1, 0]:.5f}")
    assert np.abs(parts - restitution).max() <= LEFT
