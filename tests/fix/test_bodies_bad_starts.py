"""Bodies that overlap at the start are pushed apart, and that speed is no momentum."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.bodies import (
    BENT,
    BODY_THERMO,
    DUMP_BODY_SPHERES,
    INERTIAS,
    TETRAHEDRON,
    Bodies,
    body_scene,
    dimer,
    placed,
    random_bodies,
)
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import deepest_in_box, deepest_pair, mass, read_dump

RADIUS = 0.055
EPS = 0.0005 * RADIUS
STEP = 0.005
SLACK = 1 + 1e-6  # round-off of positions
BOX = ((0.0, 0.8), (0.0, 2.0), (0.0, 0.8))
SPHERE = np.zeros((1, 3))
ENERGY = (
    "compute moving bodies ke/rigid bodies\ncompute turning bodies erotate/rigid bodies\n"
    f"thermo_style custom {BODY_THERMO} c_moving c_turning\n"
    "thermo_modify norm no lost error format float %.17g\n"
)
# What may be left in the end: each contact of a body, at a lever of its size, lets the tolerance
# over h pass.
AT_REST = 20 * EPS / STEP


@pytest.mark.slow
@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize(
    "shapes",
    [
        pytest.param([dimer(1.05)] * 60, id="dimers-1.05"),
        pytest.param([dimer(1.5)] * 60, id="dimers-1.5"),
        pytest.param([TETRAHEDRON] * 30, id="tetrahedra"),
        pytest.param([dimer(1.5), SPHERE, BENT] * 20, id="mixture"),
    ],
)
def test_random_places(shapes: list[np.ndarray], inertia: str, tmp_path: Path, lmp: Runner) -> None:
    centres = np.array(BOX) + np.array([0.2 * RADIUS, -0.2 * RADIUS])
    centres[1, 1] = 0.8
    bodies = random_bodies(shapes, RADIUS, centres, seed=1, distance=0.3 * RADIUS)
    deck = body_scene(
        bodies,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        gravity=False,
        box=BOX,
        skin=0.11,
        options="region container shorten yes",
    )
    result = lmp(deck + ENERGY + DUMP_BODY_SPHERES + "run 150\n")
    frames = read_dump(tmp_path / "particles.dump")
    depth = [deepest_pair(f.positions, f["radius"], molecules=f["mol"]) for f in frames]
    walls = [deepest_in_box(f.positions, f["radius"], BOX) for f in frames]
    assert depth[0] > RADIUS
    assert walls[0] > 0.3 * RADIUS
    assert depth[-1] <= 2 * EPS * SLACK
    assert walls[-1] <= 2 * EPS * SLACK
    end = frames[-1]
    assert np.abs(end.velocities).max() <= AT_REST
    # After the last run the push is out of the bodies too: what they have is energy at rest.
    total = mass(end["radius"]).sum()
    energy = result.thermo["c_moving"] + result.thermo["c_turning"]
    assert energy[-1] <= 0.5 * total * AT_REST**2


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("angle", [90, 60, 20])
def test_dimers_through_each_other(angle: float, inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """Their middles nearly coincide: as a cross, or nearly along each other."""
    shape = 2 * RADIUS * dimer(1.9)
    one = placed(shape, [0.4, 1.0, 0.4])
    two = placed(shape, [0.4, 1.0 + 0.1 * RADIUS, 0.4], [0, np.radians(angle), 0])
    both = one.joined(two)
    deck = body_scene(
        both,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        gravity=False,
        box=BOX,
    )
    lmp(deck + DUMP_BODY_SPHERES + "run 100\n")
    frames = read_dump(tmp_path / "particles.dump")
    depth = np.array([deepest_pair(f.positions, f["radius"], molecules=f["mol"]) for f in frames])
    assert depth[0] > 0.1 * RADIUS
    # A pair that is not the deepest may get deeper while a body turns, but not beyond it.
    assert np.diff(depth).max() <= EPS
    assert depth[-1] <= 2 * EPS * SLACK
    assert np.abs(frames[-1].velocities).max() <= AT_REST
    middle = frames[-1].positions.mean(axis=0)
    assert middle == pytest.approx(both.positions.mean(axis=0), abs=1e-13)  # round-off


@pytest.mark.parametrize("inertia", INERTIAS)
def test_bodies_fall_while_they_are_pushed(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    bodies = random_bodies(
        [dimer(1.5)] * 50, RADIUS, ((0.06, 0.74), (0.06, 0.8), (0.06, 0.74)), 2, distance=RADIUS
    )
    deck = body_scene(bodies, RADIUS, tmp_path, inertia=inertia, tolerance=EPS, box=BOX, skin=0.15)
    result = lmp(deck + ENERGY + DUMP_BODY_SPHERES + "run 150\n")
    frames = read_dump(tmp_path / "particles.dump")
    m = float(mass(RADIUS))
    height = np.array([m * 9.81 * frame.positions[:, 1].sum() for frame in frames])
    energy = height + result.thermo["c_moving"] + result.thermo["c_turning"]
    # While a push lasts its speed is in the energies. It lifts some; nothing else may add energy.
    # The bound is a tenth of a radius for the mean height.
    apart = result.thermo["f_contact[4]"] <= 2 * EPS
    assert apart[-100:].all()
    assert energy[apart].max() <= energy[0] + m * len(bodies.positions) * 9.81 * 0.1 * RADIUS
    end = frames[-1]
    assert deepest_pair(end.positions, end["radius"], molecules=end["mol"]) <= 2 * EPS * SLACK
    assert deepest_in_box(end.positions, end["radius"], BOX) <= 2 * EPS * SLACK


@pytest.mark.parametrize("inertia", INERTIAS)
def test_the_push_ends_with_the_run(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """A run that ends in the midst of pushing apart hands on momentum alone."""
    one = placed(2 * RADIUS * dimer(1.5), [0.4, 1.0, 0.4])
    two = placed(2 * RADIUS * dimer(1.5), [0.43, 1.0 + RADIUS, 0.4], [0, 0.4, 0.2])
    ends = []
    for name, runs in {
        "one": "run 60",
        "two": "run 3\nrun 57",
        "three": "run 2\nrun 0\nrun 58",
    }.items():
        deck = body_scene(
            one.joined(two),
            RADIUS,
            tmp_path / name,
            inertia=inertia,
            tolerance=EPS,
            gravity=False,
            box=BOX,
        )
        lmp(deck + DUMP_BODY_SPHERES + runs + "\n", into=name)
        end = read_dump(tmp_path / name / "particles.dump")[-1]
        assert np.abs(end.velocities).max() <= AT_REST
        assert deepest_pair(end.positions, end["radius"], molecules=end["mol"]) <= 2 * EPS * SLACK
        ends.append(end.positions)
    # The same push, but for the tolerance of each step.
    assert ends[1] == pytest.approx(ends[0], abs=60 * EPS)
    assert ends[2] == pytest.approx(ends[0], abs=60 * EPS)


@pytest.mark.parametrize("inertia", INERTIAS)
def test_a_body_keeps_its_motion_while_it_is_pushed(
    inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    """Two overlapping bodies drift together: pushing takes nothing from the drift."""
    one = placed(2 * RADIUS * dimer(1.5), [0.1, 1.0, 0.4])
    two = placed(2 * RADIUS * dimer(1.5), [0.1, 1.0 + RADIUS, 0.43], [0, 0.4, 0.2])
    both: Bodies = one.joined(two)
    drift = np.array([0.5, 0.1, -0.2])
    deck = body_scene(
        both,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        gravity=False,
        box=BOX,
        velocities=drift,
    )
    lmp(deck + DUMP_BODY_SPHERES + "run 100\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    moved = end.positions.mean(axis=0) - both.positions.mean(axis=0)
    assert moved == pytest.approx(100 * STEP * drift, abs=1e-12)  # round-off
    assert end.velocities == pytest.approx(np.tile(drift, (4, 1)), abs=AT_REST)
    assert deepest_pair(end.positions, end["radius"], molecules=end["mol"]) <= 2 * EPS * SLACK


def fix_first(deck: str) -> str:
    """Define the fix before the run that gives point masses their diameters, if there is one."""
    before, run, after = deck.partition("run 0\n")
    if not run:
        return deck
    diameters, deleted, after = after.partition("delete\n")
    scene, fix, after = after.partition("fix contact ")
    options, end, after = after.partition("\n")
    return "".join([before, scene, fix, options, end, run, diameters, deleted, after])


@pytest.mark.slow
@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("ranks", [1, 2])
def test_from_a_file_written_while_a_run_pushes_apart(
    ranks: int, inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    one = placed(2 * RADIUS * dimer(1.5), [0.4, 1.0, 0.4])
    two = placed(2 * RADIUS * dimer(1.5), [0.43, 1.0 + RADIUS, 0.4], [0, 0.4, 0.2])
    deck = body_scene(one.joined(two), RADIUS, tmp_path, inertia=inertia, tolerance=EPS, box=BOX)
    first = lmp(deck + "restart 1 here.*.restart\n" + DUMP_BODY_SPHERES + "run 40\n")
    # In the midst of it.
    assert first.thermo["f_contact[4]"][3] > 10 * EPS
    end = read_dump(tmp_path / "particles.dump")[-1]
    for step in (1, 3):
        second = fix_first(deck).replace(
            "read_data spheres.data", f"read_restart here.{step}.restart"
        )
        lmp(second + DUMP_BODY_SPHERES + f"run {40 - step}\n", ranks=ranks)
        again = read_dump(tmp_path / "particles.dump")[-1]
        assert again.step == end.step
        # Each step keeps what there was to within a tolerance.
        assert np.abs(again.positions - end.positions).max() <= (40 - step) * EPS


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("kind", ["restart", "data"])
def test_a_file_written_in_the_midst_of_pushing_apart_keeps_no_speed(
    kind: str, inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    one = placed(2 * RADIUS * dimer(1.5), [0.4, 1.0, 0.4])
    two = placed(2 * RADIUS * dimer(1.5), [0.43, 1.0 + RADIUS, 0.4], [0, 0.4, 0.2])
    deck = body_scene(
        one.joined(two), RADIUS, tmp_path, inertia=inertia, tolerance=EPS, gravity=False, box=BOX
    )
    lmp(deck + "run 3\nwrite_restart half.restart\nwrite_data half.data nocoeff\n")
    second = deck.replace("read_data spheres.data", f"read_{kind} half.{kind}")
    lmp(second + DUMP_BODY_SPHERES + "run 60\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    assert deepest_pair(end.positions, end["radius"], molecules=end["mol"]) <= 2 * EPS * SLACK
    assert np.abs(end.velocities).max() <= AT_REST
