"""Starts that overlap are pushed apart at a bounded speed, and that speed is no momentum."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    deepest_in_box,
    deepest_pair,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.055
EPS = 0.0005 * RADIUS
STEP = 0.005
SLACK = 1 + 1e-6  # round-off of positions
LARGEST_PUSH = 0.05 * 2 * RADIUS  # per step, of the sum of radii: the fix's documented bound


@pytest.mark.parametrize("overlap", [0.001, 0.01, 0.1, 0.5, 1.9])
def test_two_spheres(overlap: float, tmp_path: Path, lmp: Runner) -> None:
    direction = np.array([2, -1, 2]) / 3
    half = RADIUS * (1 - overlap / 2) * direction
    middle = np.array([0.5, 2, 0.5])
    deck = scene(
        [middle - half, middle + half],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        gravity=False,
    )
    lmp(deck + DUMP_PARTICLES + "run 60\n")
    frames = read_dump(tmp_path / "particles.dump")
    depth = [deepest_pair(frame.positions, frame["radius"]) for frame in frames]
    assert depth[0] == pytest.approx(overlap * RADIUS, rel=1e-9)  # round-off
    assert np.diff(depth).max() <= 1e-15  # round-off: never deeper
    assert max(-np.diff(depth)) <= LARGEST_PUSH + 2 * EPS
    assert depth[-1] <= EPS * SLACK
    # The centre of mass stays, and so do both spheres in the end: to the tolerance over h.
    assert frames[-1].positions.mean(axis=0) == pytest.approx(middle, abs=1e-14)
    assert np.abs(frames[-1].velocities).max() <= 2 * EPS / STEP


@pytest.mark.parametrize("options", ["", " shorten yes", " solver uzawa"])
def test_two_hundred_random_points(options: str, tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        np.random.default_rng(1).uniform((0.01, 0.01, 0.01), (0.99, 1.99, 0.99), (200, 3)),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        gravity=False,
        skin=0.11,
        options="region container" + options,
    )
    result = lmp(deck + DUMP_PARTICLES + "run 80\n")
    frames = read_dump(tmp_path / "particles.dump")
    start = deepest_pair(frames[0].positions, frames[0]["radius"])
    assert start > 0.5 * RADIUS
    end = frames[-1]
    assert deepest_pair(end.positions, end["radius"]) <= EPS * SLACK
    assert deepest_in_box(end.positions, end["radius"]) <= EPS * SLACK
    # No sphere gets away: in the end each contact leaves at most the tolerance over h.
    assert np.abs(end.velocities).max() <= 5 * EPS / STEP
    # While they are pushed, the bound on each contact's push bounds the motion of a sphere: a
    # sphere is moved by several at once.
    assert max(np.abs(frame.velocities).max() for frame in frames) <= 10 * LARGEST_PUSH / STEP
    assert result.thermo["f_contact[4]"][-1] <= EPS * SLACK


@pytest.mark.parametrize("ranks", [1, 2])
def test_different_radii_fall_while_they_are_pushed(
    ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    random = np.random.default_rng(2)
    points = random_points(80, ((0.08, 0.92), (0.08, 1.2), (0.08, 0.92)), 0.09, seed=4)
    radii = random.uniform(0.04, 0.075, 80)
    deck = scene(points, radii, tmp_path, tolerance=EPS, skin=0.12)
    lmp(deck + DUMP_PARTICLES + "run 100\n", ranks=ranks)
    frames = read_dump(tmp_path / "particles.dump")
    assert deepest_pair(frames[0].positions, radii) > 0.3 * radii.min()
    m = mass(radii)
    energy = [
        0.5 * m @ (frame.velocities**2).sum(axis=1) + 9.81 * m @ frame.positions[:, 1]
        for frame in frames
    ]
    # Pushing lifts some spheres; nothing else may add energy. The bound is a tenth of the
    # largest radius for the mean height.
    assert max(energy) <= energy[0] + 9.81 * m.sum() * 0.1 * radii.max()
    end = frames[-1]
    assert deepest_pair(end.positions, radii) <= EPS * SLACK
    assert deepest_in_box(end.positions, radii) <= EPS * SLACK


def test_walls_push_too(tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        [[0.02, 0.01, 0.05], [0.5, 4.98, 0.999]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        gravity=False,
    )
    lmp(deck + DUMP_PARTICLES + "run 60\n")
    frames = read_dump(tmp_path / "particles.dump")
    depth = [deepest_in_box(frame.positions, frame["radius"]) for frame in frames]
    assert np.diff(depth).max() <= 1e-15  # round-off: never deeper
    assert depth[-1] <= EPS * SLACK
    assert np.abs(frames[-1].velocities).max() <= 2 * EPS / STEP


def test_a_box_without_walls_may_hold_less_than_the_spheres(tmp_path: Path, lmp: Runner) -> None:
    """They can be pushed out of it, as far as LAMMPS lets them."""
    points = np.random.default_rng(3).uniform(0.1, 0.4, (40, 3))
    box = ((-0.5, 1.0), (-0.5, 1.0), (-0.5, 1.0))  # the scene's box is larger by 1
    deck = scene(points, 1.2, tmp_path, tolerance=EPS, box=box, gravity=False, skin=1.2, options="")
    result = lmp(deck + "run 2\n")
    assert np.all(np.diff(result.thermo["f_contact[4]"]) < 0)


@pytest.mark.parametrize("ranks", [1, 2])
def test_coincident_centres_are_refused(
    ranks: int, tmp_path: Path, refused: Callable[..., str]
) -> None:
    deck = scene([[0.5, 1, 0.5]] * 2 + [[0.2, 1, 0.5]], RADIUS, tmp_path, tolerance=EPS)
    error = refused(deck + "run 1\n", ranks=ranks)
    assert "centres of atoms" in error
    assert "1 and 2" in error or "2 and 1" in error


def test_a_sphere_that_overlaps_its_own_image_is_refused(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    deck = scene(
        [[0.05, 0.5, 0.05]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        box=((0, 0.1), (0, 1), (0, 0.5)),
        boundary="p f p",
        options="",
    )
    assert "periodic image" in refused(deck + "run 1\n")


@pytest.mark.parametrize("seed", range(1, 9))
def test_a_dense_random_start_opens(seed: int, tmp_path: Path, lmp: Runner) -> None:
    """Random centres in a periodic box at a packing fraction of 0.60, below that of a jam.

    (Of so few: 40 spheres jam below that in one start of ten.) On the way, too, spheres jam for a
    moment, and give way to one another.
    """
    number, eps = 60, 1e-4
    width = (number * np.pi / 6 / 0.60) ** (1 / 3)
    deck_text = f"""
atom_style sphere
boundary p p p
region space block 0 {width:.17g} 0 {width:.17g} 0 {width:.17g}
create_box 1 space
create_atoms 1 random {number} {seed} space
set group all diameter 1
set group all density 1
pair_style zero 1
pair_coeff * *
timestep 0.01
neighbor 0.4 bin
fix drag all viscous 0.5
fix contact all inelastic {eps} shorten yes
fix motion all nve
thermo 1
thermo_style custom step f_contact[4] f_contact[12]
run 200
"""
    thermo = lmp(deck_text).thermo
    # It was a bad start, for many steps.
    assert thermo["f_contact[12]"][-1] > 10
    assert thermo["f_contact[4]"][-1] <= eps * (1 + 1e-6)  # round-off of positions


@pytest.mark.parametrize("number", [120, 200])
def test_walls_hold_where_spheres_jam(number: int, tmp_path: Path, lmp: Runner) -> None:
    """What one trial of a push has found is known to the next ones: nobody passes a wall."""
    radius, box = 0.12, ((0, 1),) * 3
    points = np.random.default_rng(1).uniform(1.1 * radius, 1 - 1.1 * radius, (number, 3))
    deck = scene(points, radius, tmp_path, tolerance=5e-4 * radius, skin=0.4, box=box)
    lmp(deck + DUMP_PARTICLES + "run 6\n")
    for frame in read_dump(tmp_path / "particles.dump"):
        # Regular overlaps are up to two tolerances.
        assert deepest_in_box(frame.positions, frame["radius"], box) <= 1e-3 * radius


def crystal(folder: Path, squeeze: float) -> str:
    """Touching spheres of diameter 1 as dense as can be, in a periodic cell; then it shrinks."""
    cell = np.array([[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]]) / np.sqrt(2)
    corners = np.sqrt(2) * np.indices((3, 3, 3)).reshape(3, -1).T[:, None]
    box = ((0, 3 * np.sqrt(2)),) * 3
    deck = scene(
        (corners + cell).reshape(-1, 3),
        0.5,
        folder,
        tolerance=5e-4,
        box=box,
        boundary="p p p",
        gravity=False,
        skin=0.3,
        options="shorten yes",
        thermo="step f_contact[4] f_contact[12]",
    )
    scale = 1 - squeeze
    return f"{deck}run 5\nchange_box all x scale {scale} y scale {scale} z scale {scale} remap\n"


@pytest.mark.parametrize("runs", ["run 20\n", "run 2\n" * 10, "run 0\nrun 1\n" * 10])
@pytest.mark.parametrize("squeeze", [0.002, 0.02])
def test_where_nothing_opens_there_is_no_room(
    squeeze: float, runs: str, tmp_path: Path, lmp: Runner
) -> None:
    """Spheres that touch are squeezed: an error within ten steps, however these are run."""
    result = lmp(crystal(tmp_path, squeeze) + runs, must_pass=False)
    (error,) = result.errors
    # Each of 108 spheres touches twelve others.
    assert "648 overlaps of up to" in error
    assert "The scene leaves no room for the spheres" in error
    step = int(error.split("step ")[1].split(":")[0])
    assert 5 <= step <= 15
    assert all(" are left " in line or "no earlier step" in line for line in result.warnings)


def test_overlaps_that_are_left_are_named(tmp_path: Path, lmp: Runner) -> None:
    """At the end of each run: their number, the largest, and whose it is."""
    half = 0.3 * RADIUS
    deck = scene(
        [[0.5, 2 - half, 0.5], [0.5, 2 + half, 0.5], [0.2, 1, 0.5]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        gravity=False,
    )
    result = lmp(deck + "run 2\nrun 40\n")
    warning, *more = [line for line in result.warnings if " are left " in line]
    assert not more
    assert "1 overlaps of more than 2 tolerances" in warning
    assert "atoms 1 and 2" in warning or "atoms 2 and 1" in warning
    depth = float(warning.split("up to ")[1].split()[0])
    left = result.runs[1]["f_contact[4]"][0]
    assert depth == pytest.approx(left, rel=1e-3)  # it is printed with four digits
    assert result.runs[1]["f_contact[4]"][-1] <= EPS * SLACK


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("growth", [1.03, 1.1])
def test_a_bed_whose_spheres_grow_swells(
    growth: float, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """Spheres of a bed with free height grow: overlaps give way to one another, and all open."""
    radius, box = 0.1, ((0, 1), (0, 4), (0, 1))
    points = random_points(150, [[0.1, 0.9], [0.1, 3.9], [0.1, 0.9]], 2 * radius, seed=3)
    drag = f"fix drag all viscous {float(mass(radius)):.17g}\n"
    deck = scene(
        points,
        radius,
        tmp_path,
        tolerance=5e-4 * radius,
        box=box,
        timestep=0.01,
        skin=0.2,
        fixes=drag,
        options="region container shorten yes",
        setup=f"processors {ranks} 1 1\n",
    ).replace("pair_style zero 0.2", "pair_style zero 0.22")
    grow = f"set group all diameter {2 * radius * growth}\n"
    result = lmp(deck + "run 300\n" + grow + DUMP_PARTICLES + "run 100\n", ranks=ranks)
    depth = [
        max(
            deepest_in_box(frame.positions, frame["radius"], box),
            deepest_pair(frame.positions, frame["radius"]),
        )
        for frame in read_dump(tmp_path / "particles.dump")
    ]
    # All overlap at first, by the growth.
    assert depth[0] >= 0.9 * 2 * radius * (growth - 1)
    assert depth[-1] <= 5e-4 * radius * SLACK
    assert not any(" are left " in line for line in result.warnings)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_flat_layer_without_room_in_its_plane_buckles(
    ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """Spheres on a floor that fill it overlap, and have room above: all overlaps open.

    No small push opens them: the normals of their overlaps all lie in the plane.
    """
    across, number = 2 * RADIUS, 8
    width = across * number
    rows = np.arange(number)
    points = [[(x + 0.5) * across, RADIUS, (z + 0.5) * across] for x in rows for z in rows]
    deck = scene(
        points,
        RADIUS,
        tmp_path,
        tolerance=EPS,
        timestep=0.01,
        skin=0.1,
        box=((0, width), (0, 1), (0, width)),
        boundary="p f p",
        setup=f"processors {ranks} 1 1\nregion floor plane 0 0 0 0 1 0\n",
        options="region floor shorten yes",
        gravity=False,
    ).replace(f"pair_style zero {across:.17g}", "pair_style zero 0.12")
    grow = f"set group all diameter {1.03 * across}\n"
    result = lmp(deck + "run 5\n" + grow + DUMP_PARTICLES + "run 100\n", ranks=ranks)
    depth = result.runs[1]["f_contact[4]"]
    # Each overlaps its four neighbours by the growth, or most of it (after the first step).
    assert depth[0] >= 0.02 * across
    assert depth[-1] <= EPS * SLACK
    assert not any(" are left " in line for line in result.warnings)
    # No push is kept as momentum: what is left are overlaps with four neighbours of at most 2 EPS.
    assert np.abs(read_dump(tmp_path / "particles.dump")[-1].velocities).max() <= 4 * 2 * EPS / 0.01
