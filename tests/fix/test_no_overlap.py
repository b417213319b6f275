"""The largest overlap at every step, from the dump alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lammps_inelastic.analysis import Spheres, largest_pair_overlap
from tests.helpers.lammps_run import Run, Runner
from tests.helpers.scenes import (
    DUMP_CONTACTS,
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

RADIUS = 0.055
EPS = 0.0005 * RADIUS
# Positions are doubles: overlaps are as deep as the tolerance up to round-off.
SLACK = 1 + 1e-6
CENTRES = ((0.06, 0.94), (0.06, 4.9), (0.06, 0.94))

# Depth of spheres in the walls: positions, radii, time.
Depth = Callable[[FloatArray, FloatArray, float], float]


def largest_overlap(folder: Path, in_walls: Depth, timestep: float = 0.005) -> tuple[float, float]:
    """Largest overlap of two spheres and of a sphere with a wall, over all frames."""
    of_pairs = of_walls = 0.0
    for frame in read_dump(folder / "particles.dump"):
        radii = frame["radius"]
        of_pairs = max(of_pairs, deepest_pair(frame.positions, radii))
        of_walls = max(of_walls, in_walls(frame.positions, radii, frame.step * timestep))
    return of_pairs, of_walls


def in_box(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in the walls of the usual box."""
    return deepest_in_box(positions, radii)


def settled(result: Run) -> None:
    """See to it that the scene was one: impacts, then many contacts."""
    energy = result.thermo["KinEng"]
    assert energy[-1] < 0.05 * energy.max()
    assert result.thermo["f_contact[5]"][-1] > 100


def test_own_formula_agrees_with_the_analysis() -> None:
    points = np.random.default_rng(1).uniform(0, 1, (200, 3))
    radii = np.random.default_rng(2).uniform(0.02, 0.1, 200)
    assert deepest_pair(points, radii) == pytest.approx(
        largest_pair_overlap(Spheres(points, radii)).depth,
        rel=1e-12,  # round-off
    )


@pytest.mark.parametrize(
    ("timestep", "speed", "options", "skin", "steps"),
    [
        pytest.param(0.005, 0, "", 0.11, 300, id="fall"),
        pytest.param(0.02, 0, "", 0.5, 100, id="four-times-the-step"),
        pytest.param(0.005, 100, "", 0.9, 200, marks=pytest.mark.slow, id="ten-times-the-speed"),
        pytest.param(0.005, 100, "shorten yes", 0.11, 250, id="ten-times-the-speed-shortened"),
        pytest.param(
            0.005, 0, "solver uzawa maxiter 1000000", 0.11, 220, marks=pytest.mark.slow, id="uzawa"
        ),
    ],
)
def test_fall_impact_and_rest(
    timestep: float,
    speed: float,
    options: str,
    skin: float,
    steps: int,
    tmp_path: Path,
    lmp: Runner,
) -> None:
    deck = scene(
        random_points(250, CENTRES, 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        timestep=timestep,
        velocities=[0, -speed, 0],
        skin=skin,
        fixes="fix drag all viscous 0.001",
        options="region container " + options,
    )
    result = lmp(deck + DUMP_PARTICLES + f"run {steps}\n")
    of_pairs, of_walls = largest_overlap(tmp_path, in_box)
    assert of_pairs <= EPS * SLACK
    assert of_walls <= EPS * SLACK
    # What the fix reports is what the dump shows.
    reported = result.thermo["f_contact[4]"].max()
    assert reported == pytest.approx(max(of_pairs, of_walls), abs=1e-6 * EPS)
    if "uzawa" not in options:
        settled(result)


@pytest.mark.parametrize("ratio", [1.2, 5])
def test_different_radii_and_masses(ratio: float, tmp_path: Path, lmp: Runner) -> None:
    # The small ones at random, then larger ones that fall on them.
    small = random_points(180, ((0.06, 0.94), (0.06, 0.5), (0.06, 0.94)), 0.08, seed=2)
    large = random_points(20, ((0.2, 0.8), (0.8, 4.6), (0.2, 0.8)), 0.08 * ratio, seed=3)
    radii = np.r_[np.full(180, 0.04), np.full(20, 0.04 * ratio)]
    deck = scene(
        np.vstack([small, large]),
        radii,
        tmp_path,
        tolerance=EPS,
        skin=0.2,
        fixes="fix drag all viscous 0.001",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 250\n")
    of_pairs, of_walls = largest_overlap(tmp_path, in_box)
    assert max(of_pairs, of_walls) <= EPS * SLACK
    assert result.thermo["f_contact[5]"][-1] > 100


BOWL = 0.8
CONE_SLOPE = 1.0  # radius per height


def in_cylinder(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in a cylinder of radius 0.5 along y, closed at 0 and 3."""
    rho = np.hypot(positions[:, 0], positions[:, 2])
    y = positions[:, 1]
    return float(np.max(radii - np.minimum.reduce([0.5 - rho, y, 3 - y])))


def in_ball(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in a ball of radius 0.8 about the origin."""
    return float(np.max(radii - (BOWL - np.linalg.norm(positions, axis=1))))


def in_cone(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in a cone of radius 0.1 at y = 0 that opens by 45 degrees, closed at 0 and 1.5."""
    rho = np.hypot(positions[:, 0], positions[:, 2])
    y = positions[:, 1]
    side = (0.1 + CONE_SLOPE * y - rho) / np.hypot(1, CONE_SLOPE)
    return float(np.max(radii - np.minimum.reduce([side, y, 1.5 - y])))


def in_hopper(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in the cone of in_cone below y = 0.4, continued by a cylinder of radius 0.5."""
    rho = np.hypot(positions[:, 0], positions[:, 2])
    y = positions[:, 1]
    side = (0.1 + CONE_SLOPE * y - rho) / np.hypot(1, CONE_SLOPE)
    return float(np.max(radii - np.minimum.reduce([side, 0.5 - rho, y, 3 - y])))


def in_silo(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in a cylinder of radius 0.5 along y from 0.5 to 3 with a half ball below."""
    rho = np.hypot(positions[:, 0], positions[:, 2])
    y = positions[:, 1]
    below = np.hypot(rho, np.minimum(y - 0.5, 0))
    return float(np.max(radii - np.minimum(0.5 - below, 3 - y)))


CONTAINERS = {
    "cylinder": ("region a cylinder y 0 0 0.5 0 3", "a", in_cylinder),
    "ball": (f"region a sphere 0 0 0 {BOWL}", "a", in_ball),
    "cone": ("region a cone y 0 0 0.1 1.6 0 1.5", "a", in_cone),
    "smooth-union": (
        "region b cylinder y 0 0 0.5 0.5 3\nregion c sphere 0 0.5 0 0.5\nregion a union 2 b c",
        "a",
        in_silo,
    ),
    "hopper-of-two-regions": (
        "region a cylinder y 0 0 0.5 0 3\nregion b cone y 0 0 0.1 3.1 0 3",
        "a b",
        in_hopper,
    ),
}


def points_in_container(name: str, number: int) -> FloatArray:
    """Centres (number, 3) of spheres of radius 0.05 that touch neither one another nor a wall."""
    _, _, depth = CONTAINERS[name]
    return random_points(
        number,
        ((-0.75, 0.75), (-0.7, 2.6) if name != "cone" else (0.1, 1.4), (-0.75, 0.75)),
        0.1,
        seed=4,
        inside=lambda x: np.array([depth(p[None], np.full(1, 0.051), 0) < 0 for p in x]),
    )


@pytest.mark.parametrize("name", CONTAINERS)
@pytest.mark.parametrize(
    "speed", [0, pytest.param(20, marks=pytest.mark.slow), pytest.param(80, marks=pytest.mark.slow)]
)
def test_inside_concave_walls(name: str, speed: float, tmp_path: Path, lmp: Runner) -> None:
    regions, names, depth = CONTAINERS[name]
    random = np.random.default_rng(7)
    points = points_in_container(name, 100)
    deck = scene(
        points,
        0.05,
        tmp_path,
        tolerance=EPS,
        box=((-1, 1), (-1, 3), (-1, 1)),
        velocities=random.normal(0, speed, points.shape),
        skin={0: 0.1, 20: 0.6, 80: 3}[speed],
        options=f"region {names} shorten yes",
        fixes="fix drag all viscous 0.001",
    )
    deck = deck.replace("fix contact", regions + "\nfix contact")
    result = lmp(deck + DUMP_PARTICLES + "run 200\n")
    of_pairs, of_walls = largest_overlap(tmp_path, depth)
    assert of_pairs <= EPS * SLACK
    assert of_walls <= 2 * EPS * SLACK
    assert result.thermo["f_contact[5]"][-1] > 30  # a heap has formed
    # Gravity gives at most its potential energy; nothing else may.
    potential = 100 * mass(0.05) * GRAVITY * 3.7
    assert result.thermo["KinEng"].max() <= result.thermo["KinEng"][0] + potential


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTAINERS)
def test_concave_walls_only_take_energy(name: str, tmp_path: Path, lmp: Runner) -> None:
    regions, names, _ = CONTAINERS[name]
    points = points_in_container(name, 60)
    deck = scene(
        points,
        0.05,
        tmp_path,
        tolerance=EPS,
        box=((-1, 1), (-1, 3), (-1, 1)),
        velocities=np.random.default_rng(7).normal(0, 10, points.shape),
        skin=0.4,
        gravity=False,
        options=f"region {names}",
    ).replace("fix contact", regions + "\nfix contact")
    lmp(deck + DUMP_PARTICLES + "run 150\n")
    # The velocities that moved the spheres: LAMMPS shows the mean of two steps'.
    positions = np.array([frame.positions for frame in read_dump(tmp_path / "particles.dump")])
    energy = (np.diff(positions, axis=0) ** 2).sum(axis=(1, 2)) / 0.005**2 / 2
    assert energy[-1] < 0.5 * energy[0]
    # Each contact may leave a speed of up to tolerance / h (0.0055), twice that after an overlap.
    assert np.diff(energy).max() <= 60 * (2 * EPS / 0.005) * 10


@pytest.mark.parametrize("axis", ["y", "z"])
def test_edges_inside_a_union_are_warned_of_and_give_no_energy(
    axis: str, tmp_path: Path, lmp: Runner
) -> None:
    """LAMMPS shows a cone's wall only to centres inside the cone: no fix can see it from above.

    It may still refuse such a region, but not throw the sphere about.
    """
    down = "xyz".index(axis)
    deck = scene(
        np.roll([2, 0, 0.7], down),
        0.2,
        tmp_path,
        tolerance=EPS,
        gravity=False,
        box=((-1, 4),) * 3,
        fixes="fix pull all gravity 9.81 vector {} {} {}".format(*(-np.eye(3)[down])),
        setup=f"region upper cylinder {axis} 0 0 1 1 4\n"
        f"region lower cone {axis} 0 0 0.3 1 0.3 1\nregion hopper union 2 upper lower",
        options="region hopper",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 400\n", must_pass=False)
    if result.status != 0:
        assert "union" in result.errors[0], result.errors
        return
    assert any("re-entrant" in warning for warning in result.warnings)
    frames = read_dump(tmp_path / "particles.dump")
    energy = [
        0.5 * (frame.velocities**2).sum() + GRAVITY * frame.positions[0, down] for frame in frames
    ]
    # Per mass. A push out of an overlap lifts the sphere by at most its depth, below its radius.
    assert max(energy) <= energy[0] + GRAVITY * 0.2


FACES = [
    (f"block {' '.join(['-0.5 0.5'] * 3)}", 2 * axis + end + 1, axis, 2 * end - 1, 0.5)
    for axis in range(3)
    for end in range(2)
] + [
    (shape.format("xyz"[axis]), end + 1, axis, 2 * end - 1, 0.5)
    for shape in ("cylinder {} 0 0 0.5 -0.5 0.5", "cone {} 0 0 0.5 0.6 -0.5 0.5")
    for axis in range(3)
    for end in range(2)
]


@pytest.mark.parametrize(("region", "wall", "axis", "sign", "distance"), FACES)
def test_flat_faces_hold_a_sphere(
    region: str, wall: int, axis: int, sign: int, distance: float, tmp_path: Path, lmp: Runner
) -> None:
    pull = np.zeros(3)
    pull[axis] = sign
    start = 0.2 * pull + 0.1 * (1 - np.abs(pull)) * np.array([1, -1, 0.5])
    deck = scene(
        start,
        0.1,
        tmp_path,
        tolerance=EPS,
        gravity=False,
        box=((-1, 1),) * 3,
        fixes="fix pull all gravity 9.81 vector {} {} {}".format(*pull),
        setup=f"region tub {region}",
        options="region tub",
    )
    lmp(deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 60\n")
    end = read_dump(tmp_path / "particles.dump")[-1].positions[0]
    expected = np.where(pull != 0, pull * (distance - 0.1), start)
    assert end == pytest.approx(expected, abs=EPS * SLACK)
    contact = read_dump(tmp_path / "contacts.dump")[-1]
    assert contact["id2"].tolist() == [-wall]
    assert contact.vectors("nx ny nz")[0] == pytest.approx(-pull, abs=1e-15)  # round-off


@pytest.mark.slow
@pytest.mark.parametrize(("region", "wall", "axis", "sign", "distance"), FACES)
def test_faces_of_a_turned_region(
    region: str, wall: int, axis: int, sign: int, distance: float, tmp_path: Path, lmp: Runner
) -> None:
    about = np.array([1, 2, -1]) / np.sqrt(6)
    turn = Rotation.from_rotvec(0.7 * about)
    pull = turn.apply(sign * np.eye(3)[axis])
    start = 0.2 * pull
    deck = scene(
        start,
        0.1,
        tmp_path,
        tolerance=EPS,
        gravity=False,
        box=((-1, 1),) * 3,
        fixes="fix pull all gravity 9.81 vector {:.17g} {:.17g} {:.17g}".format(*pull),
        setup=f"variable turn equal 0.7\nregion tub {region} rotate v_turn 0 0 0 1 2 -1",
        options="region tub",
    )
    lmp(deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 60\n")
    end = read_dump(tmp_path / "particles.dump")[-1].positions[0]
    assert end == pytest.approx(pull * (distance - 0.1), abs=2 * EPS * SLACK)
    contact = read_dump(tmp_path / "contacts.dump")[-1]
    assert contact["id2"].tolist() == [-wall]
    assert contact.vectors("nx ny nz")[0] == pytest.approx(-pull, abs=1e-9)  # off-axis look


def test_a_sphere_on_the_axis_of_a_cone_sees_its_side(tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        [0, 0, 0.5],
        0.1,
        tmp_path,
        tolerance=EPS,
        gravity=False,
        box=((-1, 1),) * 3,
        fixes="fix pull all gravity 9.81 vector 0 0 -1",
        setup="region funnel cone z 0 0 0.01 1.01 0 1",
        options="region funnel",
    )
    lmp(deck + DUMP_PARTICLES + "run 80\n")
    x, y, z = read_dump(tmp_path / "particles.dump")[-1].positions[0]
    side = (0.01 + z - np.hypot(x, y)) / np.sqrt(2)
    assert min(side, z) >= 0.1 - 2 * EPS * SLACK


def moving_scene(
    tmp_path: Path,
    region: str,
    points: FloatArray,
    radius: float,
    options: str = "",
    gravity: bool = True,
) -> str:
    return scene(
        points,
        radius,
        tmp_path,
        tolerance=EPS,
        skin=2 * radius,
        setup=region,
        gravity=gravity,
        box=((-2, 3), (-2, 5), (-2, 3)),
        options=f"region {options}",
    )


def test_oscillating_floor(tmp_path: Path, lmp: Runner) -> None:
    deck = moving_scene(
        tmp_path,
        "variable up equal 0.1*sin(20*time)\nregion tub block 0 1 0 5 0 1 move NULL v_up NULL",
        random_points(200, ((0.06, 0.94), (0.06, 1.5), (0.06, 0.94)), 0.11, seed=1),
        RADIUS,
        "tub",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 250\n")

    def depth(positions: FloatArray, radii: FloatArray, time: float) -> float:
        up = 0.1 * np.sin(20 * time)
        return deepest_in_box(positions - [0, up, 0], radii)

    of_pairs, of_walls = largest_overlap(tmp_path, depth)
    assert of_pairs <= EPS * SLACK
    assert of_walls <= 2 * EPS * SLACK
    # The floor moves at up to 2; what it gives the spheres stays of that order.
    assert result.thermo["f_contact[6]"][-1] > 5
    last = read_dump(tmp_path / "particles.dump")[-1]
    assert np.abs(last.velocities).max() < 6


@pytest.mark.parametrize("radii", ["0.3 0.2", "0.2 0.3"])
@pytest.mark.parametrize("axis", "xyz")
def test_a_sphere_on_the_axis_of_a_cone_lies_on_its_cap(
    axis: str, radii: str, tmp_path: Path, lmp: Runner
) -> None:
    """From outside LAMMPS divides by the distance from the axis."""
    along = np.eye(3)["xyz".index(axis)]
    deck = scene(
        0.8 * along,
        0.1,
        tmp_path,
        tolerance=EPS,
        gravity=False,
        box=((-1, 1),) * 3,
        fixes="fix pull all gravity 9.81 vector {} {} {}".format(*-along),
        setup=f"region post cone {axis} 0 0 {radii} -0.5 0.5 side out",
        options="region post",
    )
    lmp(deck + DUMP_PARTICLES + "run 80\n")
    end = read_dump(tmp_path / "particles.dump")[-1].positions[0]
    assert end == pytest.approx(0.6 * along, abs=EPS * SLACK)


def test_a_union_of_parts_that_turn(tmp_path: Path, lmp: Runner) -> None:
    """Only its parts turn; LAMMPS turns the union by an angle that nobody has set."""
    deck = scene(
        [0.2, -0.3, 0.1],
        0.1,
        tmp_path,
        tolerance=EPS,
        box=((-2, 2),) * 3,
        setup="variable turn equal 2*time\n"
        "region large sphere 0 0 0 1 rotate v_turn 0 0 0 0 1 0\n"
        "region small sphere 0.1 0 0 0.5 rotate v_turn 0 0 0 0 1 0\n"
        "region inner union 2 small large\nregion tub union 2 inner small",
        options="region tub shorten yes",
    )
    # What is not set is then neither zero nor small.
    lmp(deck + DUMP_PARTICLES + "run 150\n", environment={"MALLOC_PERTURB_": "165"})
    away = [np.linalg.norm(f.positions[0]) for f in read_dump(tmp_path / "particles.dump")]
    assert max(away) <= 0.9 + 2 * EPS * SLACK
    assert max(away) >= 0.9 - EPS


@pytest.mark.parametrize("region", ["plane 0 0 0 0 1 0", "block 0 1 0 5 0 1"])
@pytest.mark.parametrize("gravity", [True, False])
def test_a_rising_floor_gives_the_spheres_its_velocity(
    region: str, gravity: bool, tmp_path: Path, lmp: Runner
) -> None:
    grid = np.stack(np.meshgrid([0.2, 0.5, 0.8], [0.1, 0.25], [0.2, 0.5, 0.8]), axis=-1)
    deck = moving_scene(
        tmp_path,
        f"variable up equal 0.6*time\nregion floor {region} move NULL v_up NULL",
        grid.reshape(-1, 3),
        RADIUS,
        "floor",
        gravity,
    )
    lmp(deck + DUMP_PARTICLES + "run 200\n")
    frames = read_dump(tmp_path / "particles.dump")

    def depth(positions: FloatArray, radii: FloatArray, time: float) -> float:
        return float(np.max(radii - (positions[:, 1] - 0.6 * time)))

    of_pairs, of_walls = largest_overlap(tmp_path, depth)
    assert of_pairs <= EPS * SLACK
    assert of_walls <= EPS * SLACK  # flat
    # Each of two contacts in a column is met within the tolerance, now and a step ago.
    error = 4 * EPS / 0.005
    assert frames[-1].velocities == pytest.approx(
        np.tile([0, 0.6, 0], (len(grid.reshape(-1, 3)), 1)), abs=error
    )


@pytest.mark.parametrize("speed", [0.3, 30.0])
def test_an_obstacle_behind_a_periodic_boundary(speed: float, tmp_path: Path, lmp: Runner) -> None:
    """A sphere that leaves a periodic box meets what stands on the other side."""
    text = scene(
        [[0.8, 0.5, 0.5]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        velocities=[[speed, 0, 0]],
        box=((0, 1),) * 3,
        boundary="p p p",
        gravity=False,
        skin=0.3,
        setup="region post block 0.1 0.3 -1 2 -1 2 side out units box",
        options="region post shorten yes",
        timestep=0.01,
    )
    lmp(text + DUMP_PARTICLES + "run 100\n")
    frames = read_dump(tmp_path / "particles.dump")
    ends = [(frame["x"][0] + 0.6) % 1 - 0.6 for frame in frames]
    farthest = max(ends)
    assert farthest <= 0.1 - RADIUS + EPS * SLACK
    assert farthest >= 0.1 - RADIUS - 2 * EPS  # it has met the post


@pytest.mark.parametrize("along", ["x", "y"])
def test_an_obstacle_behind_a_tilted_boundary(along: str, tmp_path: Path, lmp: Runner) -> None:
    """The period along y of a triclinic box also shifts along x, here by 0.5."""
    # The image of the obstacle that the sphere meets head-on lies beyond the boundary.
    start, rock, image = {
        "x": ((3.8, 2.0), (0.95, 2.0), (4.95, 2.0)),
        "y": ((2.0, 3.8), (1.5, 0.7), (2.0, 4.7)),
    }[along]
    deck = f"""
units lj
atom_style sphere
region space prism 0 4 0 4 0 4 0.5 0 0
create_box 1 space
create_atoms 1 single {start[0]} {start[1]} 2
set group all diameter {2 * RADIUS} density 1
velocity all set {int(along == "x")} {int(along == "y")} 0
pair_style zero {2 * RADIUS}
pair_coeff * *
neighbor 0.3 bin
timestep 0.01
region rock sphere {rock[0]} {rock[1]} 2 0.5 side out
fix contact all inelastic {EPS} region rock
fix motion all nve
dump particles all custom 1 particles.dump id xu yu
dump_modify particles format float %.17g
"""
    lmp(deck + "run 120\n")
    path = np.array(
        [[frame["xu"][0], frame["yu"][0]] for frame in read_dump(tmp_path / "particles.dump")]
    )
    distance = np.linalg.norm(path - image, axis=1)
    assert distance.min() >= 0.5 + RADIUS - EPS * SLACK
    assert distance.min() <= 0.5 + RADIUS + EPS  # it has met the obstacle


def test_a_floor_that_leaves_is_seen_where_it_stands(tmp_path: Path, lmp: Runner) -> None:
    """The overlap that is reported is that of now, however fast the floor falls away."""
    deck = moving_scene(
        tmp_path,
        "variable up equal -500*time\nregion floor plane 0 0 0 0 1 0 move NULL v_up NULL",
        np.array([[0.5, RADIUS - 0.5 * EPS, 0.5]]),
        RADIUS,
        "floor",
        False,
    )
    result = lmp(deck + "run 0\n")
    # Round-off of positions.
    assert result.thermo["f_contact[4]"][0] == pytest.approx(0.5 * EPS, abs=1e-12)


@pytest.mark.parametrize("shape", ["block", "cylinder"])
def test_a_rotating_container(shape: str, tmp_path: Path, lmp: Runner) -> None:
    region = {
        "block": "block -0.4 0.4 -0.4 0.4 -0.4 0.4",
        "cylinder": "cylinder x 0 0 0.4 -0.4 0.4",
    }[shape]
    points = random_points(
        80,
        ((-0.35, 0.35),) * 3,
        0.08,
        seed=5,
        inside=lambda x: np.hypot(x[:, 1], x[:, 2]) < 0.35,
    )
    deck = moving_scene(
        tmp_path,
        f"variable turn equal 3*time\nregion tub {region} rotate v_turn 0 0 0 0 0 1",
        points,
        0.04,
        "tub",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 250\n")

    def depth(positions: FloatArray, radii: FloatArray, time: float) -> float:
        # Seen from the container, the spheres turn the other way.
        c, s = np.cos(3 * time), np.sin(3 * time)
        seen = positions @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        if shape == "block":
            return deepest_in_box(seen, radii, ((-0.4, 0.4),) * 3)
        rho = np.hypot(seen[:, 1], seen[:, 2])
        return float(np.max(radii - np.minimum(0.4 - rho, 0.4 - np.abs(seen[:, 0]))))

    of_pairs, of_walls = largest_overlap(tmp_path, depth)
    assert of_pairs <= EPS * SLACK
    assert of_walls <= 2 * EPS * SLACK
    assert result.thermo["f_contact[6]"][-1] > 3


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("term", ["c_top", "bound(all,ymax)", "ke", "f_contact[5]"])
def test_a_wall_moved_by_a_variable_that_communicates(
    ranks: int, term: str, tmp_path: Path, lmp: Runner
) -> None:
    points = random_points(40, ((-0.3, 0.3),) * 3, 0.11, seed=1)
    deck = moving_scene(
        tmp_path,
        "processors * 1 1",
        points,
        RADIUS,
        "tub shorten yes",
        gravity=False,
    ).replace(
        "fix contact",
        f"compute top all reduce max vy\nvariable up equal 0*{term}+0.1*sin(10*time)\n"
        "region tub cylinder y 0 0 0.5 -0.5 0.6 move v_up NULL NULL\n"
        # Spheres of one rank alone run into the wall.
        "group right id 1\nregion right block 0.1 9 INF INF INF INF\n"
        "group right region right\nvelocity right set 0 0 20\nfix contact",
    )
    lmp(deck + "run 60\n", ranks=ranks, timeout=20)


def test_a_moving_wall_while_steps_are_shortened(tmp_path: Path, lmp: Runner) -> None:
    """The wall's place follows the simulated time, not the number of steps."""
    deck = moving_scene(
        tmp_path,
        "variable up equal 2*time\nregion floor plane 0 0 0 0 1 0 move NULL v_up NULL",
        np.array([[0.5, 0.8, 0.5], [0.5, 1.2, 0.5]]),
        RADIUS,
        "floor shorten yes",
        gravity=False,
    ).replace(f"neighbor {2 * RADIUS:.17g} bin", "neighbor 0.02 bin")
    deck += "velocity all set 0 0 0\nvelocity all ramp vy 0 -5 y 0.8 1.2\n"
    deck += "thermo_style custom step time f_contact[10]\nthermo_modify format float %.17g\n"
    result = lmp(deck + DUMP_PARTICLES + "run 150\n")
    assert result.thermo["f_contact[10]"][-1] > 3
    times = result.thermo["Time"]
    assert times[-1] < 150 * 0.005
    for frame, time in zip(read_dump(tmp_path / "particles.dump"), times, strict=True):
        assert np.min(frame.positions[:, 1] - 2 * time) >= RADIUS - EPS * SLACK
        assert deepest_pair(frame.positions, frame["radius"]) <= EPS * SLACK


def off_ball(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in a ball of radius 0.3 about (0.5, 0.5, 0.5)."""
    return float(np.max(radii + 0.3 - np.linalg.norm(positions - 0.5, axis=1)))


def distance_to_brick(positions: FloatArray, low: object, high: object) -> FloatArray:
    """Distance of points to a block with edges along the axes (a face, where it has no depth)."""
    outside = np.maximum(0, np.maximum(np.array(low) - positions, positions - np.array(high)))
    return np.linalg.norm(outside, axis=1)


def off_brick(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in the block [0.3, 0.7] x [0.2, 0.6] x [0.3, 0.7]: its edges are seen as well."""
    return float(np.max(radii - distance_to_brick(positions, (0.3, 0.2, 0.3), (0.7, 0.6, 0.7))))


def off_plate(positions: FloatArray, radii: FloatArray, time: float) -> float:
    """Depth in a plate that is thinner than a step is long."""
    return float(np.max(radii + 0.005 - np.abs(positions[:, 1] - 0.595)))


OBSTACLES = {
    "ball": ("sphere 0.5 0.5 0.5 0.3", off_ball),
    "brick": ("block 0.3 0.7 0.2 0.6 0.3 0.7", off_brick),
    "plate": ("block -1 2 0.59 0.6 -1 2", off_plate),
}


@pytest.mark.parametrize("name", OBSTACLES)
@pytest.mark.parametrize("speed", [0, pytest.param(60, marks=pytest.mark.slow)])
def test_convex_obstacles(name: str, speed: float, tmp_path: Path, lmp: Runner) -> None:
    region, depth = OBSTACLES[name]
    deck = scene(
        random_points(120, ((0.06, 0.94), (1, 4), (0.06, 0.94)), 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        velocities=[0, -speed, 0],
        skin=0.8 if speed else 0.11,
        setup=f"region obstacle {region} side out",
        options="region container obstacle",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 180\n")
    of_pairs, of_obstacle = largest_overlap(tmp_path, depth)
    _, of_walls = largest_overlap(tmp_path, in_box)
    assert max(of_pairs, of_obstacle, of_walls) <= EPS * SLACK
    assert result.thermo["f_contact[6]"][-1] > 50


def test_an_open_box_with_rims(tmp_path: Path, lmp: Runner) -> None:
    """Spheres fall into a box without a lid, on its rims and past it."""
    faces = [
        ((0, 0, 0), (1, 0, 1)),
        ((0, 0, 0), (0, 1, 1)),
        ((1, 0, 0), (1, 1, 1)),
        ((0, 0, 0), (1, 1, 0)),
        ((0, 0, 1), (1, 1, 1)),
    ]

    def depth(positions: FloatArray, radii: FloatArray, time: float) -> float:
        return max(float(np.max(radii - distance_to_brick(positions, *face))) for face in faces)

    deck = scene(
        random_points(150, ((-0.3, 1.3), (1.1, 4), (-0.3, 1.3)), 0.111, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        box=((-4, 5), (-19, 8), (-4, 5)),
        skin=0.11,
        setup="region tub block 0 1 0 1 0 1 open 4",
        options="region tub",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 200\n")
    of_pairs, of_walls = largest_overlap(tmp_path, depth)
    assert of_pairs <= EPS * SLACK
    assert of_walls <= 2 * EPS * SLACK
    assert result.thermo["f_contact[6]"].max() > 40


@pytest.mark.parametrize("rebuild", ["every 100000 delay 100000 check no", "once yes"])
def test_lists_are_rebuilt_in_time_whatever_the_deck_says(
    rebuild: str, tmp_path: Path, lmp: Runner
) -> None:
    deck = scene(
        random_points(150, CENTRES, 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.11,
    ).replace("neigh_modify delay 0 every 1 check yes", f"neigh_modify {rebuild}")
    lmp(deck + DUMP_PARTICLES + "run 200\n")
    assert max(largest_overlap(tmp_path, in_box)) <= EPS * SLACK


def test_discs_in_two_dimensions(tmp_path: Path, lmp: Runner) -> None:
    points = random_points(40, ((0.06, 0.94), (0.06, 3), (0, 1e-9)), 2 * RADIUS, seed=1)
    points[:, 2] = 0
    deck = scene(
        points,
        RADIUS,
        tmp_path,
        tolerance=EPS,
        boundary="f f p",
        box=((0, 1), (0, 4), (-0.5, 0.5)),
        setup="dimension 2\nregion frame block 0 1 0 4 -9 9",
        options="region frame",
        fixes="fix flat all enforce2d",
        skin=0.1,
    )
    result = lmp(deck + DUMP_PARTICLES + "run 200\n")
    of_pairs, of_walls = largest_overlap(
        tmp_path, lambda x, r, t: deepest_in_box(x, r, ((0, 1), (0, 4), (-9, 9)))
    )
    assert max(of_pairs, of_walls) <= EPS * SLACK
    assert not read_dump(tmp_path / "particles.dump")[-1]["z"].any()
    assert result.thermo["f_contact[5]"][-1] > 40


def test_a_frozen_sphere_that_moves_pushes(tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        [[0.2, 0.5, 0.5], [0.4, 0.5, 0.5]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        gravity=False,
        velocities=[[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]],
        options="region container frozen pusher",
        motion="group pusher id 1\ngroup free id 2\nfix push pusher move linear 0.5 0 0\n"
        "fix motion free nve",
    )
    lmp(deck + DUMP_PARTICLES + "run 140\n")
    frames = read_dump(tmp_path / "particles.dump")
    assert max(deepest_pair(f.positions, f["radius"]) for f in frames) <= EPS * SLACK
    assert frames[-1].positions[0] == pytest.approx([0.55, 0.5, 0.5], abs=1e-12)  # round-off
    # Pushed with the pusher's speed: to the tolerance over the step.
    assert frames[-1].velocities[1] == pytest.approx([0.5, 0, 0], abs=2 * EPS / 0.005)
