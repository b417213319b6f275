"""The largest overlap of spheres of different bodies, and with walls, at every step."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.bodies import (
    DUMP_BODY_SPHERES,
    INERTIAS,
    ROD,
    TETRAHEDRON,
    Bodies,
    body_scene,
    dimer,
    placed,
    random_bodies,
    rigid_velocities,
)
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import FloatArray, deepest_in_box, deepest_pair, read_dump

RADIUS = 0.055
EPS = 0.0005 * RADIUS
SLACK = 1 + 1e-6  # round-off of positions
WIDTH = 0.57
BOX = ((0.0, WIDTH), (0.0, 4.0), (0.0, WIDTH))
CENTRES = ((RADIUS, WIDTH - RADIUS), (RADIUS, 3.8), (RADIUS, WIDTH - RADIUS))
SPHERE = np.zeros((1, 3))
MIXTURES = {
    "dimers-1.05": [dimer(1.05)] * 60,
    "dimers-1.5": [dimer(1.5)] * 60,
    "dimers-2": [dimer(2.0)] * 60,
    "tetrahedra": [TETRAHEDRON] * 40,
    "rods": [ROD] * 30,
    "mixture": [dimer(1.5), SPHERE, TETRAHEDRON, SPHERE] * 15,
}


def in_block(positions: FloatArray, radii: FloatArray) -> float:
    """Depth in the walls of the box."""
    return deepest_in_box(positions, radii, BOX)


def in_cylinder(positions: FloatArray, radii: FloatArray) -> float:
    """Depth in a cylinder along y that fits into the box."""
    middle = WIDTH / 2
    rho = np.hypot(positions[:, 0] - middle, positions[:, 2] - middle)
    y = positions[:, 1]
    return max(0.0, float(np.max(radii - np.minimum.reduce([middle - rho, y, 4 - y]))))


CONTAINERS = {
    "block": ("", "region container", in_block),
    "cylinder": (
        "region tub cylinder y {0} {0} {0} 0 4".format(WIDTH / 2),
        "region tub",
        in_cylinder,
    ),
}


def pour(
    mixture: str, container: str, inertia: str, speed: float, folder: Path, **settings: Any
) -> str:
    """Return the deck of bodies that fall into a container, and spin about at random."""
    inside = CONTAINERS[container][2]
    bodies = random_bodies(
        MIXTURES[mixture],
        RADIUS,
        CENTRES,
        seed=3,
        inside=lambda x: np.array([inside(p[None], np.full(1, RADIUS)) == 0 for p in x]),
    )
    velocities, spins = thrown(bodies, speed)
    regions, names, _ = CONTAINERS[container]
    options = f"{names} {settings.pop('options', '')}"
    deck = body_scene(
        bodies,
        RADIUS,
        folder,
        inertia=inertia,
        tolerance=EPS,
        box=BOX,
        velocities=velocities,
        spins=spins,
        options=options,
        **settings,
    )
    return deck.replace("fix contact", regions + "\nfix contact")


def thrown(bodies: Bodies, speed: float) -> tuple[FloatArray, FloatArray]:
    """Random velocities of all, and spins about a diameter."""
    random = np.random.default_rng(5)
    number = int(bodies.molecules.max())
    of_bodies = random.normal(0, speed, (number, 3))
    turning = random.normal(0, speed / (4 * RADIUS), (number, 3))
    velocities, spins = rigid_velocities(bodies, RADIUS, of_bodies, turning)
    free = bodies.molecules == 0
    velocities[free] = random.normal(0, speed, (int(free.sum()), 3))
    return velocities, spins


def overlaps(folder: Path, container: str) -> tuple[FloatArray, FloatArray]:
    """Largest overlap of two spheres of different bodies, and of a sphere with a wall, per step."""
    depth = CONTAINERS[container][2]
    found = [
        (
            deepest_pair(frame.positions, frame["radius"], molecules=frame["mol"]),
            depth(frame.positions, frame["radius"]),
        )
        for frame in read_dump(folder / "particles.dump")
    ]
    of_pairs, of_walls = np.array(found).T
    return of_pairs, of_walls


@pytest.mark.parametrize("mixture", MIXTURES)
@pytest.mark.parametrize(
    ("container", "inertia", "speed"),
    [
        pytest.param("block", "point", 0, marks=pytest.mark.slow, id="block-point-fall"),
        pytest.param("cylinder", "solid", 0, marks=pytest.mark.slow, id="cylinder-solid-fall"),
        pytest.param(
            "cylinder", "point", 60, marks=pytest.mark.slow, id="cylinder-point-ten-times-the-speed"
        ),
        pytest.param("block", "solid", 60, id="block-solid-ten-times-the-speed"),
    ],
)
def test_fall_impact_and_rest(
    mixture: str, container: str, inertia: str, speed: float, tmp_path: Path, lmp: Runner
) -> None:
    deck = pour(
        mixture,
        container,
        inertia,
        speed,
        tmp_path,
        options="shorten yes",
        fixes="fix drag all viscous 0.004",
        skin=0.5 if speed else 0.11,
    )
    result = lmp(deck + DUMP_BODY_SPHERES + "run 250\n")
    of_pairs, of_walls = overlaps(tmp_path, container)
    assert of_pairs.max() <= 2 * EPS * SLACK
    assert of_walls.max() <= 2 * EPS * SLACK
    # What the fix reports is what the dump shows.
    assert result.thermo["f_contact[4]"] == pytest.approx(
        np.maximum(of_pairs, of_walls), abs=1e-6 * EPS
    )
    assert result.thermo["f_contact[11]"].max() == 0
    # It was a scene: bodies meet one another and the walls.
    assert result.thermo["f_contact[5]"].max() > 10
    assert result.thermo["f_contact[6]"].max() > 15


@pytest.mark.slow
def test_what_is_left_is_said(tmp_path: Path, lmp: Runner) -> None:
    """Steps that are too long, and may not be shortened.

    Bodies may spin by ten radians in a step, and the gaps at its end are then not always to be had
    together, which is an error that says so.
    """
    largest = 0.0
    unsolved = 0
    for seed, mixture in itertools.product((11, 12), ("dimers-1.5", "dimers-2", "rods", "mixture")):
        folder = tmp_path / f"{mixture}-{seed}"
        deck = pour(
            mixture,
            "block",
            "solid",
            seed,
            folder,
            fixes="fix drag all viscous 0.004",
            skin=8,
            timestep=0.04,
        )
        run = deck + DUMP_BODY_SPHERES + "run 40\n"
        result = lmp(run, into=folder.name, must_pass=False)
        if result.errors:
            assert "Bodies spin by up to" in result.errors[0]
            unsolved += 1
            continue
        overlap = np.maximum(*overlaps(folder, "block"))
        assert result.thermo["f_contact[4]"] == pytest.approx(overlap, abs=1e-6 * EPS)
        regular = overlap[:-1] <= 2 * EPS * SLACK
        excess = result.thermo["f_contact[11]"][:-1]
        # The excess of a step is what the next one starts with.
        assert excess[regular] == pytest.approx(
            np.maximum(0, overlap[1:] - 2 * EPS)[regular], abs=1e-6 * EPS
        )
        largest = max(largest, excess.max())
        # What the last step has left is said as well, though no step starts with it.
        said = result.thermo["f_contact[11]"].max()
        if said > 0:
            assert f"overlaps of up to {said:.6g} beyond" in result.screen
        # What is too deep is taken out again, and goes no deeper, but for rods that turn by radians
        # while they are deep in one another: what is between these waits.
        deeper = overlap[1:] - np.maximum(overlap[:-1], 2 * EPS * SLACK)
        assert mixture == "rods" or deeper[~regular].max(initial=0) <= 0, mixture
    assert largest > EPS
    assert unsolved <= 1


@pytest.mark.parametrize("inertia", INERTIAS)
def test_different_radii(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    bodies = random_bodies(MIXTURES["mixture"], RADIUS, CENTRES, seed=3)
    radii = np.random.default_rng(4).choice([0.4, 0.7, 1.0], len(bodies.positions)) * RADIUS
    deck = body_scene(bodies, radii, tmp_path, inertia=inertia, tolerance=EPS, box=BOX, skin=0.1)
    result = lmp(deck + DUMP_BODY_SPHERES + "run 250\n")
    assert np.max(overlaps(tmp_path, "block")) <= 2 * EPS * SLACK
    assert (read_dump(tmp_path / "particles.dump")[-1]["radius"] == radii).all()
    assert result.thermo["f_contact[5]"][-1] > 20


def test_with_uzawa(tmp_path: Path, lmp: Runner) -> None:
    deck = pour("dimers-1.5", "block", "point", 0, tmp_path, options="solver uzawa")
    lmp(deck + DUMP_BODY_SPHERES + "run 120\n")
    assert np.max(overlaps(tmp_path, "block")) <= 2 * EPS * SLACK


def off_ball(positions: FloatArray, radii: FloatArray) -> float:
    """Depth in a ball of radius 0.2 on the floor."""
    return float(np.max(radii + 0.2 - np.linalg.norm(positions - [0.28, 0.2, 0.28], axis=1)))


def off_brick(positions: FloatArray, radii: FloatArray) -> float:
    """Depth in a brick with edges: [0.2, 0.4] x [0, 0.3] x [0.1, 0.3]."""
    low, high = np.array([0.2, 0.0, 0.1]), np.array([0.4, 0.3, 0.3])
    outside = np.maximum(0, np.maximum(low - positions, positions - high))
    return float(np.max(radii - np.linalg.norm(outside, axis=1)))


OBSTACLES = {
    "ball": ("sphere 0.28 0.2 0.28 0.2", off_ball),
    "brick": ("block 0.2 0.4 0 0.3 0.1 0.3", off_brick),
}


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("name", OBSTACLES)
def test_convex_obstacles(name: str, inertia: str, tmp_path: Path, lmp: Runner) -> None:
    region, depth = OBSTACLES[name]
    bodies = random_bodies(MIXTURES["mixture"][:40], RADIUS, CENTRES, seed=3).moved([0, 0.5, 0])
    velocities, spins = thrown(bodies, 2)
    deck = body_scene(
        bodies,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        box=((0.0, WIDTH), (0.0, 5.0), (0.0, WIDTH)),
        skin=0.15,
        velocities=velocities,
        spins=spins,
        setup=f"region obstacle {region} side out",
        options="region container obstacle shorten yes",
    )
    result = lmp(deck + DUMP_BODY_SPHERES + "run 200\n")
    frames = read_dump(tmp_path / "particles.dump")
    assert max(depth(frame.positions, frame["radius"]) for frame in frames) <= 2 * EPS * SLACK
    assert overlaps(tmp_path, "block")[0].max() <= 2 * EPS * SLACK
    assert result.thermo["f_contact[6]"][-1] > 10


@pytest.mark.parametrize("inertia", INERTIAS)
def test_a_rotating_box_and_a_floor_that_oscillates(
    inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    bodies = random_bodies([dimer(1.5), TETRAHEDRON] * 15, RADIUS, ((-0.32, 0.32),) * 3, seed=5)
    turn, lift = "3*time", "0.05*sin(20*time)"
    deck = body_scene(
        bodies,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        box=((-2, 3), (-2, 5), (-2, 3)),
        skin=0.15,
        setup=f"variable turn equal {turn}\nvariable up equal {lift}\n"
        "region tub block -0.4 0.4 -0.4 0.4 -0.4 0.4 move NULL v_up NULL "
        "rotate v_turn 0 0 0 0 0 1",
        options="region tub shorten yes",
        thermo="step time f_contact[6] f_contact[10]",
    )
    result = lmp(deck + DUMP_BODY_SPHERES + "run 200\n")
    assert result.thermo["f_contact[6]"].max() > 10
    frames = read_dump(tmp_path / "particles.dump")
    for frame, time in zip(frames, result.thermo["Time"], strict=True):
        # Seen from the box, the spheres turn the other way.
        c, s = np.cos(3 * time), np.sin(3 * time)
        seen = frame.positions - [0, 0.05 * np.sin(20 * time), 0]
        seen = seen @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        assert deepest_in_box(seen, frame["radius"], ((-0.4, 0.4),) * 3) <= 2 * EPS * SLACK
    assert overlaps(tmp_path, "block")[0].max() <= 2 * EPS * SLACK


@pytest.mark.parametrize("inertia", INERTIAS)
def test_dimers_of_discs(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    random = np.random.default_rng(1)
    places = np.array([[x, y, 0] for y in np.arange(0.12, 2, 0.2) for x in (0.12, 0.32, 0.52)])
    turns = [[0, 0, angle] for angle in random.uniform(0, np.pi, len(places))]
    bodies = placed(2 * RADIUS * dimer(1.5), places[0], turns[0])
    for place, turn in zip(places[1:], turns[1:], strict=True):
        bodies = bodies.joined(placed(2 * RADIUS * dimer(1.5), place, turn))
    deck = body_scene(
        bodies,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        boundary="f f p",
        box=((0, 0.64), (0, 4), (-0.5, 0.5)),
        setup="dimension 2\nregion frame block 0 0.64 0 4 -9 9",
        options="region frame",
        skin=0.08,
    )
    # Fix rigid/small must be defined before it.
    deck = deck.replace("fix contact", "fix flat all enforce2d\nfix contact", 1)
    result = lmp(deck + DUMP_BODY_SPHERES + "run 150\n")
    for frame in read_dump(tmp_path / "particles.dump"):
        radii = frame["radius"]
        assert deepest_pair(frame.positions, radii, molecules=frame["mol"]) <= 2 * EPS * SLACK
        depth = deepest_in_box(frame.positions, radii, ((0, 0.64), (0, 4), (-9, 9)))
        assert depth <= 2 * EPS * SLACK
        assert not frame["z"].any()
    assert result.thermo["f_contact[5]"][-1] > 10


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("inertia", INERTIAS)
def test_between_runs(inertia: str, ranks: int, tmp_path: Path, lmp: Runner) -> None:
    """Bodies are deleted, the time step and the tolerance change."""
    deck = pour("dimers-1.5", "block", inertia, 0, tmp_path)
    changes = ("group gone molecule 1 5 30\ndelete_atoms group gone", "timestep 0.003")
    runs = "run 40\n" + "".join(f"{change}\nrun 40\n" for change in changes)
    tight = 0.1 * EPS
    last = f"fix_modify contact tolerance {tight}\nrun 5\nundump particles\n"
    lmp(deck + DUMP_BODY_SPHERES + runs + last, ranks=ranks)
    assert np.max(overlaps(tmp_path, "block")) <= 2 * EPS * SLACK
    end = read_dump(tmp_path / "particles.dump")[-1]
    assert len(end.rows) == 114
    assert deepest_pair(end.positions, end["radius"], molecules=end["mol"]) <= 2 * tight * SLACK
