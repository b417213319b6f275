"""Rigid bodies: impulses, forces on walls and contacts that can be computed by hand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import iterate_contact_frames
from tests.helpers.bodies import (
    DUMP_BODIES,
    DUMP_BODY_SPHERES,
    INERTIAS,
    TETRAHEDRON,
    Bodies,
    body_scene,
    dimer,
    placed,
    random_bodies,
    rigid_velocities,
)
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DUMP_CONTACTS,
    DUMP_FORCES,
    GRAVITY,
    FloatArray,
    mass,
    read_dump,
    wall_force_variables,
)

RADIUS = 0.055
MASS = float(mass(RADIUS))  # of a sphere
WEIGHT = MASS * GRAVITY
STEP = 0.005
TIGHT = 1e-13
# A force is known to tolerance / h^2 times the mass; levers and walls together give some of these.
FORCE_ERROR = 10 * TIGHT / (GRAVITY * STEP**2)
# A velocity is known to tolerance / h.
VELOCITY_ERROR = 4 * TIGHT / STEP
HALF = 0.5 * RADIUS  # from a dimer's middle to its centres, at an aspect ratio of 1.5
SHAPE = 2 * RADIUS * dimer(1.5)
ASIDE = np.pi / 2 * np.array([0, 1, 0])  # from along x to along z
UPRIGHT = np.pi / 2 * np.array([0, 0, 1])  # from along x to along y


def moment(inertia: str) -> float:
    """Return the moment of inertia of a dimer about an axis across it."""
    return 2 * MASS * (HALF**2 + (0.4 * RADIUS**2 if inertia == "solid" else 0))


def across(inertia: str) -> tuple[float, float]:
    """Return the velocities that an impulse of 1 on one end, across, gives to it and the other."""
    turn = HALF**2 / moment(inertia)
    return 1 / (2 * MASS) + turn, 1 / (2 * MASS) - turn


WALLS: dict[str, Any] = {
    "setup": wall_force_variables(6),
    "thermo": "step " + " ".join(f"v_w{axis}{wall}" for wall in range(1, 7) for axis in "xyz"),
}


def on_walls(thermo: dict[str, FloatArray], row: int = -1) -> FloatArray:
    """Return the force on each of the six walls, (6, 3)."""
    return np.array([[thermo[f"v_w{axis}{wall}"][row] for axis in "xyz"] for wall in range(1, 7)])


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("height", [0.0, 0.4])
def test_a_dimer_dropped_flat(height: float, inertia: str, tmp_path: Path, lmp: Runner) -> None:
    body = placed(SHAPE, [0.5, RADIUS + height, 0.4])
    deck = body_scene(body, RADIUS, tmp_path, inertia=inertia, tolerance=TIGHT, **WALLS)
    result = lmp(deck + DUMP_BODY_SPHERES + DUMP_CONTACTS + "run 100\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    # Round-off of the fall.
    assert end.positions == pytest.approx(body.positions - [0, height, 0], abs=2 * TIGHT + 1e-14)
    assert np.abs(end.velocities).max() <= VELOCITY_ERROR
    expected = np.zeros((6, 3))
    expected[2, 1] = -2 * WEIGHT
    assert on_walls(result.thermo) == pytest.approx(expected, abs=FORCE_ERROR * WEIGHT)
    contacts = list(iterate_contact_frames(tmp_path / "contacts.dump"))[-1]
    assert sorted(contacts.ids.tolist()) == [[1, -3], [2, -3]]
    assert contacts.forces == pytest.approx([WEIGHT, WEIGHT], rel=FORCE_ERROR)
    assert contacts.normals == pytest.approx(np.array([[0, 1, 0]] * 2), abs=1e-15)  # round-off
    assert contacts.points[:, 1] == pytest.approx([0, 0], abs=2 * TIGHT)


@pytest.mark.parametrize("inertia", INERTIAS)
def test_a_dimer_lands_on_its_end(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    body = placed(SHAPE, [0.5, 0.5, 0.4], UPRIGHT)
    deck = body_scene(body, RADIUS, tmp_path, inertia=inertia, tolerance=TIGHT, **WALLS)
    result = lmp(deck + DUMP_BODY_SPHERES + DUMP_CONTACTS + "run 80\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    # It falls over as exp(t sqrt(g / length)): round-off grows by a thousand in 0.4.
    assert end.positions == pytest.approx(
        np.array([[0.5, RADIUS, 0.4], [0.5, RADIUS + 2 * HALF, 0.4]]), abs=2 * TIGHT + 1e-13
    )
    assert on_walls(result.thermo)[2] == pytest.approx(
        [0, -2 * WEIGHT, 0], abs=2 * FORCE_ERROR * WEIGHT
    )
    contacts = list(iterate_contact_frames(tmp_path / "contacts.dump"))[-1]
    assert contacts.ids.tolist() == [[1, -3]]
    assert contacts.forces == pytest.approx([2 * WEIGHT], rel=FORCE_ERROR)


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("angle", [20, 45, 70])
def test_a_dimer_leans_on_a_wall(angle: float, inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """A ladder without friction, as it starts to slide: one degree of freedom."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    ladder = np.array([[RADIUS, RADIUS + 2 * HALF * s, 0.5], [RADIUS + 2 * HALF * c, RADIUS, 0.5]])
    body = Bodies(ladder, np.ones(2, dtype=np.int64))
    deck = body_scene(body, RADIUS, tmp_path, inertia=inertia, tolerance=TIGHT, **WALLS)
    result = lmp(deck + DUMP_CONTACTS + "run 1\n")
    # The middle moves on a circle about the corner.
    m = 2 * MASS
    falling = m * GRAVITY * HALF * c / (m * HALF**2 + moment(inertia))
    expected = np.zeros((6, 3))
    expected[0, 0] = -m * HALF * s * falling
    expected[2, 1] = -m * GRAVITY + m * HALF * c * falling
    assert on_walls(result.thermo, 0) == pytest.approx(expected, abs=FORCE_ERROR * WEIGHT)
    contacts = next(iter(iterate_contact_frames(tmp_path / "contacts.dump")))
    assert sorted(contacts.ids.tolist()) == [[1, -1], [2, -3]]


@pytest.mark.parametrize("inertia", INERTIAS)
def test_a_dimer_rests_in_a_corner(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """It comes in, tumbles, and lies in an edge of the box in the end: gravity is oblique."""
    body = placed(SHAPE, [0.3, 0.3, 0.25], [0.3, 0.2, 1])
    down = np.array([-2, -3, -1]) / np.sqrt(14)
    deck = body_scene(
        body,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=1e-9,
        gravity=False,
        fixes="fix pull all gravity {} vector {} {} {}\nfix drag all viscous 0.005".format(
            GRAVITY, *down
        ),
        **WALLS,
    )
    result = lmp(deck + "run 700\n")
    expected = np.zeros((6, 3))
    expected[[0, 2, 4], [0, 1, 2]] = 2 * WEIGHT * down
    # The slow end of its motion is left: a hundredth of the weight is far above that.
    assert on_walls(result.thermo) == pytest.approx(expected, abs=0.01 * WEIGHT)


@dataclass(frozen=True, eq=False)
class Hit:
    """What is recorded of a collision."""

    velocity: FloatArray  # of every sphere after it
    impulse: FloatArray
    pairs: list[list[int]]


def collide(
    bodies: Bodies, velocities: FloatArray, inertia: str, folder: Path, lmp: Runner, **settings: str
) -> Hit:
    """Let bodies collide that touch after one step, without gravity.

    The contact acts in step 1, from V- = V* to the projection.
    """
    before = bodies.positions - STEP * velocities
    deck = body_scene(
        Bodies(before, bodies.molecules),
        RADIUS,
        folder,
        inertia=inertia,
        tolerance=TIGHT,
        gravity=False,
        velocities=velocities,
        options=f"{settings.get('options', '')} record step*.npz every 1",
        setup=settings.get("setup", ""),
    )
    lmp(deck + DUMP_BODY_SPHERES + DUMP_CONTACTS + DUMP_BODIES + "run 2\n")
    with np.load(folder / "step1.npz") as record:
        velocity, impulse = record["velocity"], record["impulse"]
        ids = np.sort(np.stack([record["id1"], record["id2"]], axis=1), axis=1)
        assert record["predicted_velocity"] == pytest.approx(velocities, abs=SLOW)
    active = impulse > 0
    # The same in what LAMMPS gives out: force = impulse / h, and what moved the spheres.
    contacts = list(iterate_contact_frames(folder / "contacts.dump"))[1]
    assert contacts.forces * STEP == pytest.approx(impulse[active], rel=1e-12)
    frames = read_dump(folder / "particles.dump")
    moved = (frames[2].positions - frames[1].positions) / STEP
    assert moved == pytest.approx(velocity, abs=SLOW)
    order = np.lexsort(ids[active].T)
    return Hit(velocity, impulse[active][order], ids[active][order].tolist())


SPEED = 0.001
DOWN = np.array([0, -SPEED, 0])
# Bodies turn by this angle in a step, and the constraint follows them: relative error of all that
# is computed with directions that stay.
TURN = SPEED * STEP / HALF
SLOW = TURN * SPEED


@pytest.mark.parametrize("inertia", INERTIAS)
def test_an_obstacle_under_one_end(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """Of two point masses, the one that is hit stops and the other does not notice."""
    body = placed(SHAPE, [0.5, 0.5, 0.5])
    low = body.positions[1] - [0, RADIUS + 0.2, 0]
    hit = collide(
        body,
        np.array([DOWN] * 2),
        inertia,
        tmp_path,
        lmp,
        setup="region peg sphere {} {} {} 0.2 side out".format(*low),
        options="region peg",
    )
    here, there = across(inertia)
    impulse = SPEED / here
    assert hit.impulse == pytest.approx([impulse], rel=TURN)
    assert hit.pairs == [[-1, 2]]
    expected = np.zeros((2, 3))
    expected[0, 1] = -SPEED + impulse * there
    assert hit.velocity == pytest.approx(expected, abs=SLOW)
    if inertia == "point":
        assert hit.velocity[0, 1] == pytest.approx(-SPEED, abs=SLOW)


@pytest.mark.parametrize("inertia", INERTIAS)
def test_crossed_dimers_touch_at_one_pair_of_ends(
    inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    lower = placed(SHAPE, [0.5, 0.5, 0.5])
    upper = placed(SHAPE, [0.5, 0.5, 0.5], ASIDE)
    lift = lower.positions[1] - upper.positions[1] + [0, 2 * RADIUS, 0]
    both = lower.joined(Bodies(upper.positions + lift, upper.molecules))
    hit = collide(both, np.array([[0, 0, 0]] * 2 + [DOWN] * 2), inertia, tmp_path, lmp)
    here, there = across(inertia)
    impulse = SPEED / (2 * here)
    assert hit.pairs == [[2, 4]]
    assert hit.impulse == pytest.approx([impulse], rel=TURN)
    assert hit.velocity[:, 1] == pytest.approx(
        [-impulse * there, -SPEED / 2, -SPEED + impulse * there, -SPEED / 2], abs=SLOW
    )
    assert hit.velocity[:, [0, 2]] == pytest.approx(np.zeros((4, 2)), abs=SLOW)


@pytest.mark.parametrize("inertia", INERTIAS)
def test_crossed_dimers_touch_at_four_pairs(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    height = np.sqrt(4 * RADIUS**2 - 2 * HALF**2)
    lower = placed(SHAPE, [0.5, 0.5, 0.5])
    both = lower.joined(placed(SHAPE, [0.5, 0.5 + height, 0.5], ASIDE))
    hit = collide(both, np.array([[0, 0, 0]] * 2 + [DOWN] * 2), inertia, tmp_path, lmp)
    assert sorted(hit.pairs) == [[1, 3], [1, 4], [2, 3], [2, 4]]
    expected = np.zeros((4, 3))
    expected[:, 1] = -SPEED / 2
    assert hit.velocity == pytest.approx(expected, abs=SLOW)
    upward = height / (2 * RADIUS)
    # Four forces for three constraints: only their sum is given.
    assert hit.impulse.sum() * upward == pytest.approx(MASS * SPEED, rel=TURN)


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("where", ["end", "tip"])
def test_a_free_sphere_hits_a_dimer(where: str, inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """From above onto one end, or along the dimer's axis."""
    body = placed(SHAPE, [0.5, 0.5, 0.5], UPRIGHT if where == "tip" else (0, 0, 0))
    place = body.positions[1] + [0, 2 * RADIUS, 0]
    scene_of_both = body.joined(Bodies(place[None], np.zeros(1, dtype=np.int64)))
    velocities = np.array([[0, 0, 0]] * 2 + [DOWN])
    hit = collide(scene_of_both, velocities, inertia, tmp_path, lmp)
    here, there = across(inertia) if where == "end" else (1 / (2 * MASS),) * 2
    impulse = SPEED / (1 / MASS + here)
    assert hit.pairs == [[2, 3]]
    assert hit.impulse == pytest.approx([impulse], rel=TURN)
    expected = np.zeros((3, 3))
    expected[:, 1] = [-impulse * there, -impulse * here, -SPEED + impulse / MASS]
    assert hit.velocity == pytest.approx(expected, abs=SLOW)


@pytest.mark.parametrize("inertia", INERTIAS)
def test_different_radii_in_one_body(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """A body of a large and a small sphere falls on a peg that is under its centre of mass."""
    radii = np.array([2 * RADIUS, RADIUS])
    apart = 2.5 * RADIUS
    masses = mass(radii)
    arms = apart * np.array([-masses[1], masses[0]]) / masses.sum()
    body = Bodies(
        np.array([[0.5 + arms[0], 0.5, 0.5], [0.5 + arms[1], 0.5, 0.5]]),
        np.ones(2, dtype=np.int64),
    )
    # Under the small sphere: it stops, as if alone, where masses are points.
    deck = body_scene(
        body.moved([0, SPEED * STEP, 0]),
        radii,
        tmp_path,
        inertia=inertia,
        tolerance=TIGHT,
        gravity=False,
        velocities=DOWN,
        setup="region peg sphere {} {} {} {} side out".format(
            *(body.positions[1] - [0, 1.5 * RADIUS, 0]), RADIUS / 2
        ),
        options="region peg record step*.npz every 1",
    )
    lmp(deck + DUMP_BODY_SPHERES + "run 1\n")
    assert (read_dump(tmp_path / "particles.dump")[-1]["radius"] == radii).all()
    of_points = masses @ arms**2
    turns = of_points + (0.4 * masses @ radii**2 if inertia == "solid" else 0)
    here = 1 / masses.sum() + arms[1] ** 2 / turns
    there = 1 / masses.sum() + arms[0] * arms[1] / turns
    with np.load(tmp_path / "step1.npz") as record:
        assert record["velocity"][:, 1] == pytest.approx(
            [-SPEED + SPEED / here * there, 0], abs=SLOW
        )
        assert record["mass"] == pytest.approx(masses, rel=1e-14)  # round-off


@pytest.mark.parametrize("inertia", INERTIAS)
def test_a_dimer_lies_on_frozen_spheres(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """Each end is in the notch between two of them."""
    half = 0.6 * RADIUS
    height = np.sqrt(4 * RADIUS**2 - half**2)
    notch = np.array([[0, 0, -half], [0, 0, half]])
    body = placed(SHAPE, [0.5, 0.5, 0.5])
    frozen = np.vstack([end - [0, height, 0] + notch for end in body.positions])
    # They overlap one another, as frozen spheres may.
    everything = body.joined(Bodies(frozen, np.zeros(4, dtype=np.int64)))
    deck = body_scene(
        everything,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=TIGHT,
        options="region container frozen free",
    ).replace("fix motion free nve", "")
    lmp(deck + DUMP_BODY_SPHERES + DUMP_CONTACTS + DUMP_FORCES + "run 50\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    # Each step is met within the tolerance.
    assert end.positions == pytest.approx(everything.positions, abs=100 * TIGHT)
    forces = read_dump(tmp_path / "forces.dump")[-1].rows
    assert forces[:, 1:3].tolist() == [[2, 0]] * 2 + [[1, 0]] * 4
    assert forces[:2, 4] == pytest.approx([WEIGHT] * 2, rel=FORCE_ERROR)
    each = WEIGHT / 2 * np.array([0, -1, half / height])
    assert forces[3::2, 3:] == pytest.approx(np.array([each] * 2), abs=FORCE_ERROR * WEIGHT)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("inertia", INERTIAS)
def test_momentum_changes_by_wall_forces_and_weight(
    inertia: str, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    box = ((0, 0.6), (0, 0.6), (0, 0.6))
    shapes = [dimer(1.5), TETRAHEDRON, np.zeros((1, 3))] * 5
    bodies = random_bodies(shapes, RADIUS, np.array(box) + np.array([RADIUS, -RADIUS]), seed=3)
    random = np.random.default_rng(5)
    number = int(bodies.molecules.max())
    velocities, spins = rigid_velocities(
        bodies, RADIUS, random.normal(0, 1, (number, 3)), random.normal(0, 5, (number, 3))
    )
    deck = body_scene(
        bodies,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=1e-5,
        box=box,
        velocities=velocities,
        spins=spins,
        **WALLS,
    )
    result = lmp(deck + DUMP_BODY_SPHERES + DUMP_FORCES + "run 80\n", ranks=ranks)
    frames = read_dump(tmp_path / "particles.dump")
    momentum = MASS * np.array([frame.velocities.sum(axis=0) for frame in frames])
    walls = np.array([on_walls(result.thermo, row).sum(axis=0) for row in range(81)])
    force = np.array([0, -len(bodies.positions) * WEIGHT, 0]) - walls
    # Half a kick before and half a kick after each move; only round-off is left.
    expected = STEP / 2 * (force[:-1] + force[1:])
    scale = np.abs(momentum).max()
    assert np.diff(momentum, axis=0) == pytest.approx(expected, abs=1e-11 * scale)
    # The per-atom forces hold the same: contacts between spheres cancel.
    per_atom = np.array(
        [frame.vectors("fx fy fz").sum(axis=0) for frame in read_dump(tmp_path / "forces.dump")]
    )
    assert per_atom == pytest.approx(-walls, abs=1e-11 * np.abs(walls).max())  # round-off
