"""A scene at rest does not move and costs no iteration; what disturbs it moves it at once.

See "What is at rest" in docs/method.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tests.helpers.bodies import INERTIAS, body_scene, dimer, random_bodies
from tests.helpers.lammps_run import Run, Runner
from tests.helpers.scenes import DUMP_PARTICLES, GRAVITY, mass, random_points, read_dump, scene

RADIUS = 0.05
STEP = 0.005
EPS = 1e-3 * 2 * RADIUS
DRAG = f"fix drag all viscous {4 * float(mass(RADIUS)):.17g}"
# f_contact[13] tells whether the scene is at rest.
THERMO = "step f_contact[1] f_contact[13] f_contact[5] f_contact[6]"
# So many steps are quiet before a scene may come to rest.
PATIENCE = 100
# Of the velocity that gravity adds in a step, with the default accuracy: what is slower may be at
# rest. Of a weight: what a sphere at rest does not notice.
UNNOTICED = 5e-3

BED_BOX = ((0, 0.5), (0, 1.2), (0, 0.5))


def spheres(points: ArrayLike, folder: Path, **settings: object) -> str:
    """The deck of a scene of these spheres, (n, 3) centres."""
    defaults: dict[str, object] = {
        "tolerance": EPS,
        "timestep": STEP,
        "skin": 0.1,
        "thermo": THERMO,
    }
    return scene(points, RADIUS, folder, **(defaults | settings))  # type: ignore[arg-type]


def bed(folder: Path) -> str:
    """100 spheres that fall, with a drag."""
    inside = tuple((low + RADIUS, high - RADIUS) for low, high in BED_BOX)
    points = random_points(100, inside, 2 * RADIUS, seed=2)
    return spheres(points, folder, box=BED_BOX, fixes=DRAG)


def one_on_the_floor(folder: Path, **settings: object) -> str:
    return spheres([[0.5, RADIUS, 0.5]], folder, **settings)


def until_rest(result: Run, run: int = 0) -> int:
    """The step from which on the scene is at rest in one of the runs, until that run ends.

    A bed that is at rest may give way again, where a sphere that nothing holds rolls on.
    """
    moves = np.flatnonzero(result.runs[run]["f_contact[13]"] == 0)
    first = int(moves[-1]) + 1 if moves.size else 0
    assert first < len(result.runs[run]["f_contact[13]"])
    return first


def longest_rest(result: Run, run: int = 0) -> tuple[int, int]:
    """The longest time at rest of one of the runs: its first step, and the first one after it."""
    moves = np.flatnonzero(result.runs[run]["f_contact[13]"] == 0)
    edges = np.concatenate([[-1], moves, [len(result.runs[run]["f_contact[13]"])]])
    longest = int(np.argmax(np.diff(edges)))
    return int(edges[longest]) + 1, int(edges[longest + 1])


def drift(steps: int) -> float:
    """How far what nothing holds may go in a scene at rest [length]."""
    return UNNOTICED * GRAVITY * STEP**2 * steps


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_bed_at_rest_costs_nothing(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    result = lmp(
        bed(tmp_path) + DUMP_PARTICLES + "variable floor equal f_contact[3][2]\n"
        "thermo_style custom step ke f_contact[1] f_contact[13] v_floor\nrun 6000\n",
        ranks=ranks,
    )
    # Single spheres that roll on may end a rest, and begin another one.
    first, end = longest_rest(result)
    print(f"at rest from step {first} to {end}")
    assert end - first >= 200
    # What rolls on beside it costs single iterations.
    assert result.thermo["f_contact[1]"][first + 20 : end].mean() <= 2
    frames = read_dump(tmp_path / "particles.dump")[first + 1 : end]
    moved = np.max([np.abs(frame.positions - frames[0].positions) for frame in frames], axis=(0, 2))
    # Round-off: but for the few that nothing holds positions do not change. How many these are is
    # up to the bed, and the bed to the processor: 0 to 7 in 24 of them, so three times as many.
    assert np.count_nonzero(moved > 1e-13) <= 20
    assert moved.max() <= drift(len(frames))
    # What is not noticed of each sphere's weight.
    weight = 100 * float(mass(RADIUS)) * GRAVITY
    floor = -result.thermo["v_floor"][first + 1 : end]
    assert floor == pytest.approx(weight, rel=UNNOTICED)
    assert "the scene was at rest, and nothing moved" in result.screen


@pytest.mark.slow
@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_bed_of_dimers(inertia: str, ranks: int, tmp_path: Path, lmp: Runner) -> None:
    inside = tuple((low + 1.5 * RADIUS, high - 1.5 * RADIUS) for low, high in BED_BOX)
    bodies = random_bodies([dimer(1.5)] * 30, RADIUS, inside, seed=3)
    deck = body_scene(
        bodies,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        timestep=STEP,
        box=BED_BOX,
        fixes=DRAG,
        thermo=THERMO,
    )
    result = lmp(deck + DUMP_PARTICLES + "run 4000\n", ranks=ranks)
    first, end = longest_rest(result, -1)
    print(f"at rest from step {first} to {end}")
    assert end - first >= 200
    frames = read_dump(tmp_path / "particles.dump")[first + 1 : end]
    moved = np.max([np.abs(frame.positions - frames[0].positions) for frame in frames], axis=(0, 2))
    # Round-off of bodies, whose spheres are placed anew in every step. How many of the 60 creep on
    # until something holds them is up to the bed, and the bed to the processor: 5 on average in 120
    # of them, 20 at the most, so half of all.
    moving = np.count_nonzero(moved > 1e-11)
    assert moving <= 30
    # Where all rest nothing is solved; a dimer that slides on takes some tens of iterations a step.
    iterations = result.thermo["f_contact[1]"][first + 20 : end].mean()
    assert iterations <= (100 if moving else 1)
    assert moved.max() <= drift(len(frames))


def test_a_run_that_is_divided_stays_at_rest(tmp_path: Path, lmp: Runner) -> None:
    result = lmp(one_on_the_floor(tmp_path) + "run 200\nrun 10\nrun 5 pre no\n")
    assert until_rest(result) <= PATIENCE + 1
    for later in result.runs[1:]:
        assert later["f_contact[13]"].all()
        assert later["f_contact[1]"].sum() == 0


def test_a_restarted_run_comes_to_rest_again(tmp_path: Path, lmp: Runner) -> None:
    deck = bed(tmp_path)
    before = lmp(deck + "run 6000\nwrite_restart bed.restart\n")
    assert before.thermo["f_contact[13]"].any()
    head, tail = deck.split("read_data spheres.data")
    units = head[: head.index("units")] + "units lj\natom_modify map array\n"
    after = lmp(units + "read_restart bed.restart" + tail + "run 6000\n")
    at_rest = after.thermo["f_contact[13]"] == 1
    assert after.thermo["f_contact[1]"][at_rest].min() == 0


def test_a_smaller_tolerance_holds_at_once(tmp_path: Path, lmp: Runner) -> None:
    """What rests ends the next step within it, too, however slowly it then rises."""
    # An overlap of half a tolerance stays, and is more than one of those to come. It is given back
    # at a hundredth of what may be at rest.
    loose = 1e-3 * GRAVITY * STEP**2
    tight = loose / 2.8
    deck = spheres([[0.5, RADIUS - 0.5 * loose, 0.5]], tmp_path, tolerance=loose)
    lower = f"fix_modify contact tolerance {tight:.17g}\n"
    result = lmp(deck + "run 200\n" + lower + DUMP_PARTICLES + "run 40\n")
    assert result.runs[0]["f_contact[13]"][-1] == 1
    height = [frame.positions[0, 1] for frame in read_dump(tmp_path / "particles.dump")]
    # Round-off of positions.
    assert min(height[1:]) >= RADIUS - tight - 1e-15
    # It rests again.
    assert result.runs[1]["f_contact[13]"][-1] == 1


@pytest.mark.parametrize(
    ("slope", "settings"), [(0.02, ""), (0.002, ""), (0.002, " accuracy 1e-4")]
)
def test_a_slope(slope: float, settings: str, tmp_path: Path, lmp: Runner) -> None:
    """Gravity turns while a sphere rests: no contact holds it along the floor, and it slides."""
    deck = one_on_the_floor(tmp_path, options="region container" + settings)
    across = f"fix gravity all gravity {GRAVITY} vector {slope} -1 0\n"
    result = lmp(deck + "run 200\n" + across + DUMP_PARTICLES + "run 60\n")
    until_rest(result)
    speed = read_dump(tmp_path / "particles.dump")[-1].velocities[0, 0]
    down = GRAVITY * slope / np.hypot(1, slope)
    # All 60 kicks count; of the half kick at the start of a run half of a velocity is shown.
    assert speed == pytest.approx(60 * STEP * down, abs=1.01 * STEP * down)


def test_a_slope_from_the_start(tmp_path: Path, lmp: Runner) -> None:
    """Hundred steps are long: what gains less than the limit in one step does move."""
    slope = 1e-3
    gravity = f"fix gravity all gravity {GRAVITY} vector {slope} -1 0\n"
    deck = one_on_the_floor(tmp_path, gravity=False, fixes=gravity)
    result = lmp(deck + DUMP_PARTICLES + "run 400\n")
    assert not result.thermo["f_contact[13]"].any()
    speed = read_dump(tmp_path / "particles.dump")[-1].velocities[0, 0]
    assert speed == pytest.approx(400 * STEP * GRAVITY * slope, rel=0.01)  # half a step of 400


def test_a_sphere_that_slides_goes_on(tmp_path: Path, lmp: Runner) -> None:
    """At four times what may be at rest."""
    speed = 4 * UNNOTICED * GRAVITY * STEP
    deck = one_on_the_floor(tmp_path, velocities=[[speed, 0, 0]])
    result = lmp(deck + DUMP_PARTICLES + "run 1000\n")
    assert not result.thermo["f_contact[13]"].any()
    frames = read_dump(tmp_path / "particles.dump")
    # Nothing acts along the floor.
    assert frames[-1].velocities[0, 0] == pytest.approx(speed, rel=1e-9)


def test_a_sphere_that_drifts_keeps_its_velocity(tmp_path: Path, lmp: Runner) -> None:
    """At a fifth of what may be at rest the scene counts as at rest; it goes on, all the same."""
    speed = 0.2 * UNNOTICED * GRAVITY * STEP
    deck = one_on_the_floor(tmp_path, velocities=[[speed, 0, 0]])
    result = lmp(deck + DUMP_PARTICLES + "run 200\n")
    assert until_rest(result) <= PATIENCE
    frames = read_dump(tmp_path / "particles.dump")
    # Nothing acts along the floor.
    assert frames[-1].velocities[0, 0] == pytest.approx(speed, rel=1e-9)


def test_a_heavy_load_elsewhere_hides_nothing(tmp_path: Path, lmp: Runner) -> None:
    """One of two spheres carries ten thousand weights; the other slides."""
    speed = 4 * UNNOTICED * GRAVITY * STEP
    load = 1e4 * float(mass(RADIUS)) * GRAVITY
    deck = spheres(
        [[0.2, RADIUS, 0.5], [0.5, RADIUS, 0.5]],
        tmp_path,
        velocities=np.array([[0.0, 0, 0], [speed, 0, 0]]),
        fixes=f"group loaded id 1\nfix load loaded addforce 0 {-load:.17g} 0\n",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 1000\n")
    assert not result.thermo["f_contact[13]"].any()
    frames = read_dump(tmp_path / "particles.dump")
    # Nothing acts along the floor.
    assert frames[-1].velocities[1, 0] == pytest.approx(speed, rel=1e-9)


def test_a_frozen_plate_that_moves_is_followed(tmp_path: Path, lmp: Runner) -> None:
    """A sphere on a frozen one that rises by less than anybody notices."""
    velocity = 0.1 * UNNOTICED * GRAVITY * STEP
    deck = spheres(
        [[0.5, 1.0, 0.5], [0.5, 1.0 + 2 * RADIUS, 0.5]],
        tmp_path,
        options="frozen plate",
        motion="group plate id 1\ngroup free id 2\nfix motion free nve\n"
        f"fix rise plate move linear 0 {velocity:.17g} 0\n",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 1000\n")
    assert not result.thermo["f_contact[13]"].any()
    frames = read_dump(tmp_path / "particles.dump")
    risen = frames[-1].positions[1, 1] - frames[0].positions[1, 1]
    assert risen == pytest.approx(1000 * STEP * velocity, abs=EPS)


def test_a_force_on_one_sphere_wakes(tmp_path: Path, lmp: Runner) -> None:
    weight = float(mass(RADIUS)) * GRAVITY
    push = "variable push equal 0.0\nfix push all addforce v_push 0 0\n"
    deck = one_on_the_floor(tmp_path, fixes=push)
    pushed = f"variable push equal {0.05 * weight:.17g}\nrun 50\nvariable push equal 0.0\nrun 50\n"
    result = lmp(deck + "run 200\n" + DUMP_PARTICLES + pushed)
    until_rest(result)
    speed = read_dump(tmp_path / "particles.dump")[-1].velocities[0, 0]
    # One kick of fifty: a run starts with half of one.
    assert speed == pytest.approx(50 * STEP * 0.05 * GRAVITY, rel=0.02)


def test_an_impact_wakes(tmp_path: Path, lmp: Runner) -> None:
    """A sphere falls beside two that touch, one of which it pushes away."""
    points = [[0.45, RADIUS, 0.5], [0.55, RADIUS, 0.5], [0.53, 3.0, 0.5]]
    weight = float(mass(RADIUS)) * GRAVITY
    hold = (
        f"group high id 3\nvariable hold equal {weight:.17g}\nfix hold high addforce 0 v_hold 0\n"
    )
    deck = spheres(points, tmp_path, skin=0.3, fixes=hold)
    result = lmp(deck + "run 200\nvariable hold equal 0\n" + DUMP_PARTICLES + "run 300\n")
    until_rest(result)
    frames = read_dump(tmp_path / "particles.dump")
    assert max(float(frame.velocities[1, 0]) for frame in frames) > 0.1


@pytest.mark.parametrize("speed", [1e-3, 1e-2])
def test_a_moving_floor_carries(speed: float, tmp_path: Path, lmp: Runner) -> None:
    """However slowly it rises [g h]."""
    velocity = speed * GRAVITY * STEP
    deck = one_on_the_floor(
        tmp_path,
        options="region floor",
        fixes=f"variable rise equal {velocity:.17g}*{STEP}*step\n"
        "region floor plane 0 0 0 0 1 0 move NULL v_rise NULL\n",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 1000\n")
    assert not result.thermo["f_contact[13]"].any()
    frames = read_dump(tmp_path / "particles.dump")
    risen = frames[-1].positions[0, 1] - frames[0].positions[0, 1]
    assert risen == pytest.approx(1000 * STEP * velocity, abs=EPS)


def test_momentum_without_support(tmp_path: Path, lmp: Runner) -> None:
    """Two spheres that are pressed together in free space go on drifting, however slowly."""
    points = [[0.45, 2.0, 0.5], [0.55, 2.0, 0.5]]
    drift = 1e-6
    press = float(mass(RADIUS)) * GRAVITY
    deck = spheres(
        points,
        tmp_path,
        gravity=False,
        velocities=[[0, drift, 0]] * 2,
        options="",
        fixes="group left id 1\ngroup right id 2\n"
        f"fix l left addforce {press:.17g} 0 0\nfix r right addforce {-press:.17g} 0 0\n",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 500\n")
    assert not result.thermo["f_contact[13]"].any()
    velocities = read_dump(tmp_path / "particles.dump")[-1].velocities
    assert velocities[:, 1] == pytest.approx([drift, drift], rel=1e-9)  # round-off
