"""A grain stays where its own contacts hold it, and nowhere else.

That it lies beside others at rest, or that forces balance on it by far greater than its weight, is
no reason to stop it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tests.helpers.exact_scenes import FLOOR, RADIUS, STEP, WEIGHT, attraction, path, spheres_of
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import DUMP_PARTICLES, GRAVITY, FloatArray

EPS = 1e-3
KICK = GRAVITY * STEP
# Of what exact mechanics says: round-off, and overlaps that turn a force by as little.
EXACT = 1e-6


@dataclass(frozen=True)
class Cluster:
    """Spheres that touch, and that attract one another by twos."""

    points: ArrayLike
    attract: tuple[tuple[str, str], ...]
    bodies: tuple[int, ...] | None = None

    def placed(self, at: ArrayLike) -> FloatArray:
        """Return the centres, and that of a sphere that lies alone on the floor, the last one."""
        return np.vstack([np.asarray(self.points) + at, [20.0, RADIUS, 0.0]])

    def with_the_last(self) -> list[int] | None:
        """Return the body of each sphere."""
        return None if self.bodies is None else [*self.bodies, 0]


CLUSTERS = {
    "pair-x": Cluster([[-0.5, 0, 0], [0.5, 0, 0]], (("1", "2"),)),
    "row": Cluster([[-1, 0, 0], [0, 0, 0], [1, 0, 0]], (("1", "2"), ("2", "3"))),
    "dimers": Cluster(
        [[-0.5, 0, -0.25], [-0.5, 0, 0.25], [0.5, 0, -0.25], [0.5, 0, 0.25]],
        (("1 2", "3 4"),),
        (1, 1, 2, 2),
    ),
    "pair-y": Cluster([[0, -0.5, 0], [0, 0.5, 0]], (("1", "2"),)),
    "pair-oblique": Cluster([[-0.24, -0.18, -0.4], [0.24, 0.18, 0.4]], (("1", "2"),)),
}
LYING = ("pair-x", "row", "dimers")


def moved(
    cluster: Cluster,
    at: ArrayLike,
    velocity: ArrayLike,
    weights: float,
    steps: int,
    folder: Path,
    lmp: Runner,
    ranks: int = 1,
    **settings: object,
) -> FloatArray:
    """Let a cluster move; (steps + 1, n, 6) positions and velocities of its spheres."""
    points = cluster.placed(at)
    velocities = np.zeros_like(points)
    velocities[:-1] = velocity
    deck = spheres_of(
        points,
        folder,
        bodies=cluster.with_the_last(),
        velocities=velocities,
        setup=f"{FLOOR}processors {ranks} 1 1\n",
        fixes=attraction(cluster.attract, weights) + str(settings.pop("fixes", "")),
        **settings,
    )
    lmp(deck + DUMP_PARTICLES + f"run {steps}\n", ranks=ranks)
    return path(folder)[:, :-1]


def assert_rigid(steps: FloatArray, mean: FloatArray) -> None:
    """A cluster that does not turn moves as a whole: every sphere as the centre of mass should."""
    offset = steps[:, :, :3] - steps[:1, :, :3] - mean[:, None, :]
    # The contacts of a row of three may each be off by a tolerance.
    assert np.abs(offset).max() <= 2 * EPS


@pytest.mark.parametrize("weights", [150, 250, 1e4])
def test_a_sphere_pressed_to_a_wall_falls_with_its_floor(
    weights: float, tmp_path: Path, lmp: Runner
) -> None:
    """The floor under it is taken away between two runs."""
    deck = spheres_of(
        [RADIUS, 50 + RADIUS, 0],
        tmp_path,
        setup="region side plane 0 0 0 1 0 0\nregion floor plane 0 50 0 0 1 0\n",
        fixes=f"fix press all addforce {-weights * WEIGHT:.17g} 0 0",
        options="region side floor",
    )
    away = "region floor delete\nregion floor plane 0 -90 0 0 1 0\n"
    lmp(deck + "run 200\n" + away + DUMP_PARTICLES + "run 300\n")
    steps = path(tmp_path)[:, 0]
    assert steps[0, 1] - steps[-1, 1] == pytest.approx(GRAVITY * 3**2 / 2, rel=EXACT)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("up", [0.0, 10.0])
@pytest.mark.parametrize("weights", [250, 1e4])
@pytest.mark.parametrize("name", CLUSTERS)
def test_grains_that_attract_one_another_fall(
    name: str, weights: float, up: float, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """A cluster that is let go, or thrown up, falls freely while a sphere lies on the floor."""
    steps = moved(CLUSTERS[name], [0, 60, 0], [0, up, 0], weights, 250, tmp_path, lmp, ranks)
    time = STEP * np.arange(len(steps))
    exact = np.outer(up * time - GRAVITY * time**2 / 2, [0, 1, 0])
    mean = steps[:, :, :3].mean(axis=1) - steps[0, :, :3].mean(axis=0)
    assert mean == pytest.approx(exact, abs=EXACT * np.abs(exact).max())
    assert_rigid(steps, exact)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("speed", [0.01, 0.4, 4.0])
@pytest.mark.parametrize("name", LYING)
@pytest.mark.parametrize("weights", [250, 1e4])
def test_grains_that_attract_one_another_slide(
    name: str, weights: float, speed: float, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """On a floor, at a velocity in g h along the line of their centres and across it."""
    # The attraction lifts what lies higher by as much of its strength: by a tenth of a weight at
    # most if it lies a tolerance higher.
    settings = {"tolerance": min(EPS, 0.1 / weights)}
    velocity = speed * KICK * np.array([0.6, 0, 0.8])
    at = [0, RADIUS, 0]
    steps = moved(CLUSTERS[name], at, velocity, weights, 400, tmp_path, lmp, ranks, **settings)
    mean = steps[:, :, 3:].mean(axis=1)
    # In each step what they attract one another with is added, and taken away, to round-off.
    assert mean[:, [0, 2]] == pytest.approx(
        np.tile(velocity[[0, 2]], (len(steps), 1)), abs=1e-15 * weights * KICK * len(steps)
    )
    assert_rigid(steps, np.outer(STEP * np.arange(len(steps)), velocity))


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("weights", [1, 1e4])
def test_a_cluster_that_nothing_touches_keeps_its_momentum(
    weights: float, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """Twelve around one, which attracts them all, drift by 0.001 g h a step.

    They can twist, to first order, and what their contacts carry is not determined by the forces.
    Some 300 steps later, from round-off, they do, and steps take thousands of iterations.
    """
    places = np.array([[0, a, b] for a in (-1, 1) for b in (-1, 1)]) / np.sqrt(2)
    shell = [np.roll(places, turn, axis=1) for turn in range(3)]
    around = Cluster(
        np.vstack([np.zeros((1, 3)), *shell]), tuple(("1", str(k)) for k in range(2, 14))
    )
    velocity = 1e-3 * KICK * np.array([2, 3, 6]) / 7
    alone = f"group lying id 14\nfix gravity lying gravity {GRAVITY} vector 0 -1 0\n"
    steps = moved(
        around,
        [0.2, 10, 0],
        velocity,
        weights,
        250,
        tmp_path,
        lmp,
        ranks,
        gravity=False,
        fixes=alone,
    )
    mean = steps[:, :, 3:].mean(axis=1)
    # In each step the forces of twelve are added up, to round-off.
    assert mean == pytest.approx(
        np.tile(velocity, (len(steps), 1)), abs=12e-15 * weights * KICK * len(steps)
    )


@pytest.mark.parametrize(("speed", "slope"), [(0.01, 0), (0.14, 0), (0, 0.25)])
def test_what_a_run_begins_with_is_kept(
    speed: float, slope: float, tmp_path: Path, lmp: Runner
) -> None:
    """Between two runs one of two spheres at rest gets a velocity [g h], or gravity turns."""
    deck = spheres_of([[10, RADIUS, 0], [-10, RADIUS, 0]], tmp_path)
    change = f"group one id 1\nvelocity one set {speed * KICK:.17g} 0 0\n" * (speed > 0)
    change += f"fix gravity all gravity {GRAVITY} vector {slope} -1 0\n"
    lmp(deck + "run 200\n" + change + DUMP_PARTICLES + "run 100\n")
    steps = path(tmp_path)
    down = GRAVITY * slope / np.hypot(1, slope) * 100 * STEP
    assert steps[-1, :, 3] == pytest.approx([speed * KICK + down, down], rel=EXACT)


@pytest.mark.parametrize("rested", [0, 200])
@pytest.mark.parametrize(
    ("options", "taken"),
    # Of the weight; without a rest a kick is added to a velocity in each of 300 steps: round-off.
    [("accuracy 1e-5", 1e-5), ("rest no", 1e-13), ("accuracy 1e-1 rest no", 1e-13)],
)
@pytest.mark.parametrize("slope", [1e-5, 1e-3, 0.05, 0.3])
def test_a_grain_alone_on_a_slope(
    slope: float, options: str, taken: float, rested: int, tmp_path: Path, lmp: Runner
) -> None:
    """It slides from the start, or when gravity turns after it has rested."""
    deck = spheres_of([0, RADIUS, 0], tmp_path, options=f"region floor {options}")
    turned = f"fix gravity all gravity {GRAVITY} vector {slope} -1 0\n"
    rest = f"run {rested}\n" if rested else ""
    lmp(deck + rest + turned + DUMP_PARTICLES + "run 300\n")
    steps = path(tmp_path)[:, 0]
    time = STEP * np.arange(len(steps))
    exact = GRAVITY * slope / np.hypot(1, slope) * time
    assert np.abs(steps[:, 3] - exact).max() <= taken * GRAVITY * time[-1]


@pytest.mark.parametrize(
    ("options", "taken"), [("", 1e-3), ("accuracy 1e-5", 1e-5), ("rest no", 1e-13)]
)
def test_gravity_that_turns_slowly(options: str, taken: float, tmp_path: Path, lmp: Runner) -> None:
    """No static friction above the accuracy: after a rest, to a slope of 0.01 in 2000 steps."""
    deck = spheres_of(
        [0, RADIUS, 0],
        tmp_path,
        gravity=False,
        fixes="variable slope equal 0.01*(step-200)/2000*(step>200)\n"
        f"fix gravity all gravity {GRAVITY} vector v_slope -1 0\n",
        options=f"region floor {options}",
    )
    lmp(deck + DUMP_PARTICLES + "run 2200\n")
    speed = path(tmp_path)[:, 0, 3]
    number = np.arange(len(speed))
    slope = 0.01 * np.maximum(number - 200, 0) / 2000
    kick = GRAVITY * slope / np.hypot(1, slope) * STEP
    exact = np.concatenate([[0], np.cumsum((kick[1:] + kick[:-1]) / 2)])
    assert (speed <= exact * (1 + 1e-9)).all()  # round-off
    # What the accuracy of the weight could have taken since gravity turns.
    assert (exact - speed <= taken * KICK * np.maximum(number - 200, 0) + 1e-15).all()
