"""Rest, weight, wall forces, momentum and virial: all can be computed by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import iterate_contact_frames
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DEFAULT_BOX,
    DUMP_CONTACTS,
    DUMP_FORCES,
    DUMP_PARTICLES,
    GRAVITY,
    mass,
    random_points,
    read_dump,
    scene,
    wall_force_variables,
)

RADIUS = 0.1
WEIGHT = float(mass(RADIUS)) * GRAVITY
STEP = 0.005
TIGHT = 1e-12
# A force is known to tolerance / h^2 times the mass: relative to the weight, tolerance / (g h^2).
FORCE_ERROR = 2 * TIGHT / (GRAVITY * STEP**2)


def test_wall_forces_can_be_asked_for_before_the_first_run(tmp_path: Path, lmp: Runner) -> None:
    deck = scene([0.5, RADIUS, 0.5], RADIUS, tmp_path, tolerance=TIGHT)
    result = lmp(deck + "thermo_style custom step f_contact[3][2] f_contact[1][1]\nrun 1\n")
    assert result.thermo["f_contact[3][2]"][-1] == pytest.approx(-WEIGHT, rel=FORCE_ERROR)


def test_a_dropped_sphere_rests_on_the_floor_with_its_weight(tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        [0.5, 0.5, 0.4],
        RADIUS,
        tmp_path,
        tolerance=TIGHT,
        thermo="step ke v_wx3 v_wy3 v_wz3 v_wy4 f_contact[5] f_contact[6]",
        setup=wall_force_variables(6),
    )
    result = lmp(deck + DUMP_PARTICLES + DUMP_CONTACTS + DUMP_FORCES + "run 100\n")

    end = read_dump(tmp_path / "particles.dump")[-1]
    # The floor is met to the tolerance, and 5 r of fall add round-off.
    assert end.positions[0] == pytest.approx([0.5, RADIUS, 0.4], abs=2 * TIGHT + 1e-15)
    assert np.abs(end.velocities).max() <= 2 * TIGHT / STEP
    forces = read_dump(tmp_path / "forces.dump")[-1].rows[0]
    assert forces[:3] == pytest.approx([1, 0, 1])  # id, contacts with particles, with walls
    assert forces[3:] == pytest.approx([0, WEIGHT, 0], rel=FORCE_ERROR)
    wall = [result.thermo[name][-1] for name in ("v_wx3", "v_wy3", "v_wz3", "v_wy4")]
    assert wall == pytest.approx([0, -WEIGHT, 0, 0], rel=FORCE_ERROR)
    assert result.thermo["f_contact[6]"][-1] == 1

    contact = list(iterate_contact_frames(tmp_path / "contacts.dump"))[-1]
    assert contact.ids.tolist() == [[1, -3]]
    assert contact.points[0] == pytest.approx([0.5, 0, 0.4], abs=2 * TIGHT)
    assert contact.normals[0] == pytest.approx([0, 1, 0], abs=1e-15)  # unit vectors: round-off
    assert contact.gaps[0] == pytest.approx(0, abs=2 * TIGHT)
    assert contact.forces[0] == pytest.approx(WEIGHT, rel=FORCE_ERROR)


def test_no_contact_no_rows(tmp_path: Path, lmp: Runner) -> None:
    deck = scene([0.5, 3, 0.5], RADIUS, tmp_path, tolerance=TIGHT)
    lmp(deck + "dump contacts all local 1 contacts.dump f_contact[1] f_contact[10]\nrun 3\n")
    assert [len(frame.rows) for frame in read_dump(tmp_path / "contacts.dump")] == [0] * 4


@pytest.mark.parametrize(
    ("face", "towards"),
    list(enumerate([(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)], 1)),
)
def test_block_walls_are_numbered_xlo_to_zhi(
    face: int, towards: tuple[int, int, int], tmp_path: Path, lmp: Runner
) -> None:
    direction = " ".join(map(str, towards))
    deck = scene(
        [0.5, 2.5, 0.5],
        RADIUS,
        tmp_path,
        tolerance=TIGHT,
        gravity=False,
        fixes=f"fix pull all gravity {GRAVITY} vector {direction}",
        setup=wall_force_variables(6),
        thermo=f"step v_wx{face} v_wy{face} v_wz{face}",
    )
    result = lmp(deck + DUMP_CONTACTS + "run 160\n")
    wall = [result.thermo[f"v_w{axis}{face}"][-1] for axis in "xyz"]
    assert wall == pytest.approx(WEIGHT * np.array(towards), rel=FORCE_ERROR)
    contact = list(iterate_contact_frames(tmp_path / "contacts.dump"))[-1]
    assert contact.ids.tolist() == [[1, -face]]
    assert contact.normals[0] == pytest.approx(-np.array(towards), abs=1e-15)  # round-off


def test_a_sphere_slides_down_a_plane_without_friction(tmp_path: Path, lmp: Runner) -> None:
    slope = np.radians(30)
    normal = np.array([np.sin(slope), np.cos(slope), 0])
    start = np.array([0.1, 0.1, 0.5]) + RADIUS * normal
    deck = scene(
        start,
        RADIUS,
        tmp_path,
        tolerance=TIGHT,
        setup="region slope plane 0.1 0.1 0.5 {} {} 0".format(*normal[:2]),
        options="region slope",
    )
    lmp(deck + DUMP_PARTICLES + DUMP_CONTACTS + DUMP_FORCES + "run 60\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    along = np.array([np.cos(slope), -np.sin(slope), 0])
    time = 60 * STEP
    # The scheme integrates constant forces exactly; 60 steps each within the tolerance.
    assert end.velocities[0] == pytest.approx(
        GRAVITY * np.sin(slope) * time * along, abs=60 * TIGHT / STEP
    )
    assert end.positions[0] - start == pytest.approx(
        GRAVITY * np.sin(slope) * time**2 / 2 * along, abs=60 * TIGHT
    )
    forces = read_dump(tmp_path / "forces.dump")[-1].rows[0]
    assert forces[3:] == pytest.approx(WEIGHT * np.cos(slope) * normal, rel=FORCE_ERROR)
    (contact,) = list(iterate_contact_frames(tmp_path / "contacts.dump"))[-1].ids.tolist()
    assert contact == [1, -1]


FROZEN = "group frozen id 1\ngroup moving subtract all frozen\n"


def test_a_sphere_rests_on_a_frozen_one(tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        [[0.5, 1, 0.5], [0.5, 1.5, 0.5]],
        [RADIUS, 2 * RADIUS],
        tmp_path,
        tolerance=TIGHT,
        options="region container frozen frozen",
        motion=FROZEN + "fix motion moving nve",
    )
    lmp(deck + DUMP_PARTICLES + DUMP_CONTACTS + DUMP_FORCES + "run 100\n")
    frames = read_dump(tmp_path / "particles.dump")
    assert (frames[-1].positions[0] == [0.5, 1, 0.5]).all()
    assert frames[-1].positions[1] == pytest.approx([0.5, 1.3, 0.5], abs=2 * TIGHT + 1e-15)
    weight = 8 * WEIGHT
    forces = read_dump(tmp_path / "forces.dump")[-1].rows
    assert forces[:, 1:3].tolist() == [[1, 0], [1, 0]]
    assert forces[0, 3:] == pytest.approx([0, -weight, 0], rel=FORCE_ERROR)
    assert forces[1, 3:] == pytest.approx([0, weight, 0], rel=FORCE_ERROR)
    contact = list(iterate_contact_frames(tmp_path / "contacts.dump"))[-1]
    assert sorted(contact.ids[0].tolist()) == [1, 2]
    # The normal points from id2 to id1.
    up = 1 if contact.ids[0, 0] == 2 else -1
    assert contact.normals[0] == pytest.approx([0, up, 0], abs=1e-15)  # round-off
    assert contact.points[0] == pytest.approx([0.5, 1.1, 0.5], abs=2 * TIGHT)


def test_a_hit_is_perfectly_inelastic_and_keeps_momentum(tmp_path: Path, lmp: Runner) -> None:
    before = [[1.0, 0, 0], [-2.0, 0, 0]]
    deck = scene(
        [[0.3, 2, 0.5], [0.6, 2, 0.5]],
        [RADIUS, RADIUS / 2],
        tmp_path,
        tolerance=TIGHT,
        velocities=before,
        gravity=False,
    )
    lmp(deck + DUMP_PARTICLES + "run 20\n")
    m = mass([RADIUS, RADIUS / 2])
    common = m @ np.array(before) / m.sum()
    after = read_dump(tmp_path / "particles.dump")[-1].velocities
    # Relative velocities are known to tolerance / h.
    assert after == pytest.approx(np.vstack([common, common]), abs=2 * TIGHT / STEP)
    assert m @ after == pytest.approx(m @ np.array(before), rel=1e-13)  # round-off


@pytest.mark.parametrize("ranks", [1, 2])
def test_momentum_changes_by_wall_forces_and_weight(
    ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    box = ((0, 0.6), (0, 0.6), (0, 0.6))
    points = random_points(25, np.array(box) + np.array([RADIUS, -RADIUS]), 0.15, seed=3)
    radii = np.random.default_rng(4).uniform(0.04, 0.075, len(points))
    deck = scene(
        points,
        radii,
        tmp_path,
        tolerance=1e-5,
        box=box,
        setup=wall_force_variables(6),
        thermo="step " + " ".join(f"v_w{axis}{wall}" for wall in range(1, 7) for axis in "xyz"),
        velocities=np.random.default_rng(5).normal(0, 1, (len(points), 3)),
    )
    result = lmp(deck + DUMP_PARTICLES + DUMP_FORCES + "run 80\n", ranks=ranks)
    m = mass(radii)
    momentum = np.array([m @ frame.velocities for frame in read_dump(tmp_path / "particles.dump")])
    on_walls = np.array(
        [sum(result.thermo[f"v_w{axis}{wall}"] for wall in range(1, 7)) for axis in "xyz"]
    ).T
    force = np.array([0, -m.sum() * GRAVITY, 0]) - on_walls
    # Half a kick before and half a kick after each move; only round-off is left.
    expected = STEP / 2 * (force[:-1] + force[1:])
    scale = np.abs(momentum).max()
    assert np.diff(momentum, axis=0) == pytest.approx(expected, abs=1e-12 * scale)
    # The per-atom forces hold the same: contacts between particles cancel.
    per_atom = np.array(
        [frame.vectors("fx fy fz").sum(axis=0) for frame in read_dump(tmp_path / "forces.dump")]
    )
    assert per_atom == pytest.approx(-on_walls, abs=1e-11 * np.abs(on_walls).max())  # round-off


PRESSURES = """
compute pressure all pressure NULL virial
compute stress all stress/atom NULL virial
compute sum all reduce sum c_stress[1] c_stress[2] c_stress[3] c_stress[4] c_stress[5] c_stress[6]
thermo_style custom step vol c_pressure[1] c_pressure[2] c_pressure[3] c_pressure[4] &
    c_pressure[5] c_pressure[6] c_sum[1] c_sum[2] c_sum[3] c_sum[4] c_sum[5] c_sum[6]
thermo_modify norm no format float %.17g
"""
TENSOR = range(1, 7)  # xx yy zz xy xz yz


def virials(thermo: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Global virial and the sum of the atoms' shares, each (steps, 6), energy."""
    globally = np.array([thermo[f"c_pressure[{k}]"] for k in TENSOR]).T * thermo["Volume"][:, None]
    return globally, -np.array([thermo[f"c_sum[{k}]"] for k in TENSOR]).T


@pytest.mark.parametrize("ranks", [1, 2])
def test_virial_of_a_static_column(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    heights = RADIUS * np.array([1, 3, 5])
    deck = scene(
        np.column_stack([np.full(3, 0.5), heights, np.full(3, 0.5)]),
        RADIUS,
        tmp_path,
        tolerance=TIGHT,
        # The cut goes through the column.
        setup="processors 1 * 1",
    )
    deck = deck.replace("neigh_modify", "comm_style brick\nneigh_modify")
    result = lmp(deck + PRESSURES + "balance 1.0 y 0.06\n" * (ranks == 2) + "run 2\n", ranks=ranks)
    globally, by_atom = virials(result.thermo)
    # Floor: force 3 w over r. Pairs: 2 w and w over 2 r each.
    expected = np.array([0, (3 + 4 + 2) * WEIGHT * RADIUS, 0, 0, 0, 0])
    # Forces are known to tolerance / (g h^2); the three add up.
    assert globally[-1] == pytest.approx(expected, rel=10 * FORCE_ERROR, abs=1e-15)
    assert by_atom[-1] == pytest.approx(globally[-1], rel=1e-12, abs=1e-15)  # round-off


def test_virial_of_a_sphere_between_a_frozen_one_and_a_wall(tmp_path: Path, lmp: Runner) -> None:
    slope = np.radians(30)
    normal = np.array([np.sin(slope), np.cos(slope), 0])
    upper = np.array([1 - RADIUS, 1, 0.5])
    deck = scene(
        [upper - 2 * RADIUS * normal, upper],
        RADIUS,
        tmp_path,
        tolerance=TIGHT,
        options="region container frozen frozen",
        motion=FROZEN + "fix motion moving nve",
    )
    result = lmp(deck + PRESSURES + "run 1\n")
    globally, by_atom = virials(result.thermo)
    pair = WEIGHT / np.cos(slope)
    tensor = 2 * RADIUS * pair * np.outer(normal, normal)
    tensor[0, 0] += RADIUS * pair * np.sin(slope)  # the wall's share
    expected = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    assert globally[-1] == pytest.approx(expected, rel=10 * FORCE_ERROR, abs=1e-15)
    assert by_atom[-1] == pytest.approx(globally[-1], rel=1e-12, abs=1e-15)  # round-off


def test_virial_is_the_same_on_two_ranks(tmp_path: Path, lmp: Runner) -> None:
    box = ((0, 0.6), (0, 1), (0, 0.6))
    points = random_points(40, ((0.06, 0.54), (0.06, 0.8), (0.06, 0.54)), 0.125, seed=8)
    tensors = []
    for ranks in (1, 2):
        deck = scene(points, 0.06, tmp_path, tolerance=1e-11, box=box)
        result = lmp(deck + PRESSURES + "run 60\n", ranks=ranks)
        globally, by_atom = virials(result.thermo)
        scale = np.abs(globally).max()
        assert by_atom == pytest.approx(globally, abs=1e-12 * scale)  # round-off
        tensors.append(globally)
    # Forces are known to tolerance / (g h^2) = 4e-8 of a weight, in chains of many spheres.
    assert tensors[1] == pytest.approx(tensors[0], abs=1e-4 * np.abs(tensors[0]).max())


def test_boxes_walls_and_their_sum_balance_the_weight_at_rest(tmp_path: Path, lmp: Runner) -> None:
    points = random_points(30, ((0.1, 0.4), (0.1, 1.5), (0.1, 0.4)), 0.17, seed=2)
    deck = scene(
        points,
        0.08,
        tmp_path,
        tolerance=1e-9,
        box=((0, 0.5), DEFAULT_BOX[1], (0, 0.5)),
        fixes="fix drag all viscous 0.01",
        setup=wall_force_variables(6),
        thermo="step ke v_wx1 v_wx2 v_wy3 v_wy4 v_wz5 v_wz6",
    )
    result = lmp(deck + "thermo 50\nrun 600\n")
    wall = {name: values[-1] for name, values in result.thermo.items()}
    weight = float(30 * mass(0.08) * GRAVITY)
    # Slow motion is left after 3 time units: a hundredth of the weight is far above it.
    assert wall["v_wy3"] == pytest.approx(-weight, rel=0.01)
    assert wall["v_wy4"] == 0
    assert wall["v_wx1"] + wall["v_wx2"] == pytest.approx(0, abs=0.01 * weight)
    assert wall["v_wz5"] + wall["v_wz6"] == pytest.approx(0, abs=0.01 * weight)
    assert wall["v_wx1"] < 0 < wall["v_wx2"]
