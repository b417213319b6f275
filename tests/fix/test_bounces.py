"""With a restitution of 1 nothing gains energy, and a single sphere loses none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.exact_scenes import MASS, spheres_of
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import DUMP_CONTACTS, DUMP_PARTICLES, read_dump

# Of the default
ACCURACY = 1e-3


@pytest.mark.parametrize("tolerance", [1e-5, 1e-2])
@pytest.mark.parametrize("speed", [0.55, 0.7, 1.0, 1.3])
def test_to_and_fro(speed: float, tolerance: float, tmp_path: Path, lmp: Runner) -> None:
    """Between a frozen sphere and its periodic image it keeps its speed for 440 bounces or more."""
    deck = spheres_of(
        [[0.3, 0, 0], [1.55, 0, 0]],
        tmp_path,
        velocities=[[0, 0, 0], [speed, 0, 0]],
        tolerance=tolerance,
        skin=0.3,
        box=((0.0, 2.5), (-3.0, 3.0), (-3.0, 3.0)),
        boundary="p f f",
        setup="",
        gravity=False,
        motion="group held id 1\ngroup flying id 2\nfix motion flying nve",
        options="frozen held law restitution 1",
        thermo="step v_speed",
        fixes="variable speed equal abs(vx[2])\n",
    )
    now = lmp(deck + "thermo 10\nrun 40000\n").thermo["v_speed"][1:].reshape(-1, 100)
    # In a step in which it turns back it shows the mean of both velocities.
    part = np.median(now, axis=1) / speed
    print(f"{part[-1]:.5f} of its speed at the end, {part.min():.5f} to {part.max():.5f} before")
    assert part == pytest.approx(np.ones(len(part)), abs=0.01)


@pytest.mark.parametrize(
    ("speed", "timestep"), [(0.1, 0.05), (1.0, 0.02), (1.0, 0.005), (10.0, 0.005), (10.0, 0.001)]
)
def test_a_gas(speed: float, timestep: float, tmp_path: Path, lmp: Runner) -> None:
    """64 spheres in a box: only what has turned past one another may part faster."""
    edges = 1.45 + 1.9 * np.arange(4)
    points = np.stack(np.meshgrid(edges, edges, edges), axis=-1).reshape(-1, 3)
    random = np.random.default_rng(4711).normal(size=points.shape)
    deck = spheres_of(
        points,
        tmp_path,
        velocities=random * speed,
        skin=0.8,
        box=((0.0, 9.0),) * 3,
        timestep=timestep,
        setup="",
        gravity=False,
        options="region container law restitution 1",
    )
    # A sphere flies some ten diameters.
    steps = min(2000, round(10 / speed / timestep))
    lmp(deck + DUMP_PARTICLES + DUMP_CONTACTS + f"run {steps}\n")
    start = read_dump(tmp_path / "particles.dump")[0].velocities
    kinetic = 0.5 * MASS * float((start**2).sum())
    gained, turned, taken = [], [], []
    frames = zip(
        read_dump(tmp_path / "particles.dump"), read_dump(tmp_path / "contacts.dump"), strict=True
    )
    # The first step begins with half a kick.
    for particles, contacts in list(frames)[1:]:
        first, second = contacts["id1"].astype(int) - 1, contacts["id2"].astype(int) - 1
        pair = second >= 0
        impulse, normal = contacts["force"] * timestep, contacts.vectors("nx ny nz")
        change = np.zeros_like(start)
        np.add.at(change, first, impulse[:, None] * normal / MASS)
        np.add.at(change, second[pair], -(impulse[:, None] * normal)[pair] / MASS)
        # What is shown is in the middle of the step's change.
        before, after = particles.velocities - change / 2, particles.velocities + change / 2
        gained.append(0.5 * MASS * float((after**2).sum() - (before**2).sum()))
        other = np.where(pair[:, None], before[second * pair], 0.0)
        parting = ((before[first] - other) * normal).sum(axis=1)
        opened = np.maximum(0, contacts["gap"]) / timestep
        # At walls nothing turns.
        more = np.where(pair & (parting > 0), np.maximum(0, parting - opened), 0.0)
        turned.append(0.5 * float(impulse @ more))
        taken.append(0.5 * float(impulse @ np.abs(parting)))
    excess = (np.array(gained) - turned) / kinetic
    print(
        f"energy {1 + sum(gained) / kinetic:.6f}, turned {sum(turned) / kinetic:.1e}, "
        f"{sum(taken) / kinetic:.2f} exchanged; a step gains up to {excess.max():.1e}, "
        f"{(np.array(gained) - turned - ACCURACY * np.array(taken)).max() / kinetic:.1e} too much"
    )
    round_off = 1e-12
    # Of what a step's contacts exchange they are resolved to the accuracy.
    assert (excess <= ACCURACY * np.array(taken) / kinetic + round_off).all()
    # As a sphere to and fro: 1 % of its speed in 560 bounces.
    assert excess.sum() <= 0.02 / 560 * sum(taken) / kinetic + round_off
