"""Recorded contact problems with rigid bodies, and an independent solver for them."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import clarabel
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import sparse

from tests.helpers.bodies import (
    DUMP_BODY_SPHERES,
    TETRAHEDRON,
    body_scene,
    dimer,
    random_bodies,
)
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import FloatArray, mass, read_dump

RADIUS = 0.055
EPS = 0.0005 * RADIUS
TIGHT = 1e-10 * RADIUS
BOX = ((0.0, 0.57), (0.0, 1.6), (0.0, 0.57))
SPHERE = np.zeros((1, 3))
SCENES = {
    "dimers-point": ([dimer(1.5)] * 45, "point"),
    "dimers-solid": ([dimer(1.5)] * 45, "solid"),
    "tetrahedra-point": ([TETRAHEDRON] * 20, "point"),
    "mixture-solid": ([dimer(1.1), SPHERE, TETRAHEDRON, SPHERE] * 10, "solid"),
}
Record = dict[str, np.ndarray]


def load(path: Path) -> Record:
    """Read a record."""
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


def inertia_of(record: Record, mine: NDArray[np.int64], inertia: str) -> FloatArray:
    """Inertia of some spheres about their centre of mass, (3, 3)."""
    m, x = record["mass"][mine], record["position"][mine]
    arms = x - m @ x / m.sum()
    tensor = sum(w * (r @ r * np.eye(3) - np.outer(r, r)) for w, r in zip(m, arms, strict=True))
    if inertia == "solid":
        tensor = tensor + 0.4 * m @ record["radius"][mine] ** 2 * np.eye(3)
    return np.asarray(tensor)


def motions(record: Record, inertia: str) -> FloatArray:
    """Velocities of all spheres (3 n, .), one column per degree of freedom, of energy 1/2 each.

    V = V* + B y, and y y / 2 is the kinetic energy of V - V*. A free sphere has 3 columns, a body
    6, or 5 where all its point masses are on a line.
    """
    shapes: list[tuple[NDArray[np.int64], FloatArray]] = []
    for molecule in np.unique(record["molecule"]):
        mine = np.flatnonzero(record["molecule"] == molecule)
        if molecule == 0:
            for free in mine:
                size = np.sqrt(record["mass"][free])
                shapes += [(np.array([free]), axis / size) for axis in np.eye(3)]
            continue
        m, x = record["mass"][mine], record["position"][mine]
        arms = x - m @ x / m.sum()
        moments, axes = np.linalg.eigh(inertia_of(record, mine, inertia))
        for moment, axis in zip(moments, axes.T, strict=True):
            shapes.append((mine, np.tile(axis, (len(mine), 1)) / np.sqrt(m.sum())))
            if moment > 1e-9 * moments.max():
                shapes.append((mine, np.cross(axis, arms) / np.sqrt(moment)))
    basis = np.zeros((len(record["id"]), 3, len(shapes)))
    for k, (mine, shape) in enumerate(shapes):
        basis[mine, :, k] = shape
    return basis.reshape(-1, len(shapes))


def followed_gaps(record: Record) -> dict[tuple[int, int], float]:
    """Return the constraints that follow a turn with their gaps, by the spheres' ids.

    The gap of two spheres of turning bodies is not that of straight motion: where a step would end
    in an overlap, the fix sets the constraint's gap to what makes it exact for the step's end. What
    differs by less than two tolerances is taken from the positions: that are the gap rules.
    """
    return {
        (min(first, second), max(first, second)): float(gap)
        for first, second, gap, now in zip(
            record["id1"], record["id2"], record["gap"], record["gap_now"], strict=True
        )
        if abs(gap - now) > 2 * record["tolerance"]
    }


def constraints(record: Record) -> tuple[FloatArray, FloatArray]:
    """Return G (., 3 n) and D of ALL pairs and walls, built from positions.

    Only the gaps that follow a turn cannot be had from the positions at the start. They are taken
    from the record; test_followed_gaps_are_those_of_the_end sees whether they are right.
    """
    x, radii, molecule = record["position"], record["radius"], record["molecule"]
    number, low, high = record["id"], *np.array(BOX).T
    followed = followed_gaps(record)
    rows, gaps = [], []

    def add(first: int, second: int, parts: dict[int, FloatArray], gap: float) -> None:
        row = np.zeros((len(x), 3))
        for sphere, part in parts.items():
            row[sphere] = part
        rows.append(row.ravel())
        gaps.append(followed.get((min(first, second), max(first, second)), gap))

    for i, j in combinations(range(len(x)), 2):
        if molecule[i] == molecule[j] > 0:
            continue
        apart = x[i] - x[j]
        distance = float(np.linalg.norm(apart))
        normal = apart / distance
        gap = distance - radii[i] - radii[j]
        add(int(number[i]), int(number[j]), {i: normal, j: -normal}, gap)
    for i in range(len(x)):
        for axis in range(3):
            normal = np.eye(3)[axis]
            to_low, to_high = x[i, axis] - low[axis], high[axis] - x[i, axis]
            add(int(number[i]), -1 - 2 * axis, {i: normal}, to_low - radii[i])
            add(int(number[i]), -2 - 2 * axis, {i: -normal}, to_high - radii[i])
    return np.array(rows), np.array(gaps)


def projection(record: Record, inertia: str) -> FloatArray:
    """Project with Clarabel, in the coordinates of bodies."""
    h, predicted = float(record["timestep"]), record["predicted_velocity"]
    g, gaps = constraints(record)
    basis = motions(record, inertia)
    # In units of the radius and the largest mass: y = u r sqrt(m) / h, a u + b >= 0.
    scale = np.sqrt(record["mass"].max())
    a = g @ basis * scale
    b = (gaps + h * (g @ predicted.ravel())) / RADIUS
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    solver = clarabel.DefaultSolver(
        sparse.eye_array(a.shape[1], format="csc"),
        np.zeros(a.shape[1]),
        sparse.csc_array(-a),
        b,
        [clarabel.NonnegativeConeT(len(b))],
        settings,
    )
    solution = solver.solve()
    assert str(solution.status) == "Solved"
    # An interior point is as far off as the square root of its tolerance: solve for the active
    # constraints that it found, and correct those that it took for the wrong kind.
    active = np.array(solution.z) > np.array(solution.s)
    for _ in range(20):
        of_active = a[active]
        multipliers = np.linalg.lstsq(of_active @ of_active.T, -b[active], rcond=None)[0]
        u = of_active.T @ multipliers
        pulling = np.flatnonzero(active)[multipliers < -1e-9]  # of numbers of order 1
        violated = np.flatnonzero(a @ u + b < -1e-11)  # of lengths of order r
        if len(pulling) == len(violated) == 0:
            break
        active[pulling] = False
        active[violated] = True
    assert len(pulling) == len(violated) == 0
    return np.asarray(predicted + (basis @ u * scale * RADIUS / h).reshape(-1, 3))


def poured(name: str, folder: Path, record: str, tolerance: float) -> str:
    """Return the deck of a scene that falls into the box."""
    shapes, inertia = SCENES[name]
    bodies = random_bodies(shapes, RADIUS, np.array(BOX) + np.array([RADIUS, -RADIUS]), seed=3)
    return body_scene(
        bodies,
        RADIUS,
        folder,
        inertia=inertia,
        tolerance=tolerance,
        box=BOX,
        fixes="fix drag all viscous 0.002",
        skin=0.1,
        options=f"region container {record}",
    )


@pytest.mark.parametrize(
    ("name", "ranks"), [(name, 1) for name in SCENES] + [("mixture-solid", 2), ("dimers-point", 2)]
)
def test_what_a_record_holds(name: str, ranks: int, tmp_path: Path, lmp: Runner) -> None:
    _, inertia = SCENES[name]
    deck = poured(name, tmp_path, "record step*.npz every 40", EPS)
    lmp(deck + DUMP_BODY_SPHERES + "run 81\n", ranks=ranks)
    record = load(tmp_path / "step80.npz")
    now, after = read_dump(tmp_path / "particles.dump")[80:82]
    assert (record["position"] == now.positions).all()
    assert (record["molecule"] == now["mol"]).all()
    assert record["mass"] == pytest.approx(mass(RADIUS) * np.ones(len(now.rows)), rel=1e-14)
    molecules = np.unique(record["molecule"][record["molecule"] > 0])
    assert sorted(record["body_molecule"]) == molecules.tolist()
    assert not record["arm"][record["molecule"] == 0].any()
    force = np.zeros_like(record["velocity"])
    index = {int(number): k for k, number in enumerate(record["id"])}
    for c, (first, second) in enumerate(zip(record["id1"], record["id2"], strict=True)):
        force[index[int(first)]] += record["impulse"][c] * record["normal"][c]
        if second > 0:
            force[index[int(second)]] -= record["impulse"][c] * record["normal"][c]
    change = force / record["mass"][:, None]
    for molecule, inverse_mass, tensor in zip(
        record["body_molecule"],
        record["body_inverse_mass"],
        record["body_inverse_inertia"],
        strict=True,
    ):
        mine = np.flatnonzero(record["molecule"] == molecule)
        x, m = record["position"][mine], record["mass"][mine]
        arms = x - m @ x / m.sum()
        assert record["arm"][mine] == pytest.approx(arms, abs=1e-15)  # round-off
        assert inverse_mass == pytest.approx(1 / m.sum(), rel=1e-14)  # round-off
        inverse = tensor[[[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
        expected = np.linalg.pinv(inertia_of(record, mine, inertia), rcond=1e-9, hermitian=True)
        assert inverse == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())  # round-off
        change[mine] = force[mine].sum(axis=0) * inverse_mass + np.cross(
            inverse @ np.cross(arms, force[mine]).sum(axis=0), arms
        )
    speed = np.abs(record["predicted_velocity"]).max()
    assert record["velocity"] == pytest.approx(
        record["predicted_velocity"] + change,
        abs=1e-12 * speed,  # round-off
    )
    # The centres of mass move with it; the spheres turn about them.
    moved = (after.positions - now.positions) / float(record["timestep"])
    for molecule in molecules:
        mine = record["molecule"] == molecule
        assert moved[mine].mean(axis=0) == pytest.approx(
            record["velocity"][mine].mean(axis=0), abs=1e-12 * speed
        )


PHASES = {"falling": 10, "impact": 50, "rest": 300}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_an_independent_solver_agrees(name: str, tmp_path: Path, lmp: Runner) -> None:
    """Falling, on impact and at rest, to 1e-6 of the largest predicted velocity."""
    _, inertia = SCENES[name]
    deck = poured(name, tmp_path, "record step*.npz every 5", EPS)
    for step in PHASES.values():
        deck += f"fix_modify contact tolerance {EPS}\nrun {step - 3} upto\n"
        deck += f"fix_modify contact tolerance {TIGHT}\nrun {step} upto\n"
    result = lmp(deck)
    assert result.runs[-1]["f_contact[5]"][-1] > 30
    for phase, step in PHASES.items():
        record = load(tmp_path / f"step{step}.npz")
        assert record["tolerance"] == TIGHT
        speed = np.linalg.norm(record["predicted_velocity"], axis=1).max()
        off = np.linalg.norm(record["velocity"] - projection(record, inertia), axis=1).max()
        assert off <= 1e-6 * speed, phase


@pytest.mark.parametrize("name", SCENES)
def test_followed_gaps_are_those_of_the_end(name: str, tmp_path: Path, lmp: Runner) -> None:
    """Where the fix followed a turn and a force acts, the spheres touch at the end of the step."""
    tolerance = 1e-6 * RADIUS
    deck = poured(name, tmp_path, "record step*.npz every 1", tolerance)
    lmp(deck + DUMP_BODY_SPHERES + "run 120\n")
    frames = read_dump(tmp_path / "particles.dump")
    low, high = np.array(BOX).T
    left = []
    for step in range(1, 120):
        record = load(tmp_path / f"step{step}.npz")
        index = {int(number): k for k, number in enumerate(record["id"])}
        end = frames[step + 1].positions
        for first, second, gap, now, impulse in zip(
            *(record[key] for key in ("id1", "id2", "gap", "gap_now", "impulse")), strict=True
        ):
            # Without a turn to follow the two differ by at most a regular overlap.
            if abs(gap - now) <= 2 * tolerance or impulse == 0:
                continue
            x = end[index[int(first)]]
            if second > 0:
                there = np.linalg.norm(x - end[index[int(second)]]) - 2 * RADIUS
            else:
                axis, upper = divmod(-int(second) - 1, 2)
                there = (high[axis] - x[axis] if upper else x[axis] - low[axis]) - RADIUS
            left.append(there / tolerance)
    assert len(left) > 20
    # Both residuals are at most the tolerance, and a gap is followed anew that ends 1.1 beyond.
    assert np.abs(left).max() <= 2.2
