"""How bodies move: what a collision conserves, free flight, and the limit of small steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tests.helpers.bodies import (
    BENT,
    BODY_THERMO,
    DUMP_BODIES,
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
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    GRAVITY,
    FloatArray,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.055
STEP = 0.005
SPACE: dict[str, Any] = {"box": ((-9, 10),) * 3, "gravity": False, "skin": 0.4, "options": ""}
SPHERE = np.zeros((1, 3))
PAIRS = {
    "dimers": (dimer(1.5), dimer(1.5)),
    "bent-trimers": (BENT, BENT),
    "dimer-and-sphere": (dimer(1.5), SPHERE),
    "rod-and-tetrahedron": (ROD, TETRAHEDRON),
}
ENERGIES = (
    "compute moving bodies ke/rigid bodies\ncompute turning bodies erotate/rigid bodies\n"
    f"thermo_style custom {BODY_THERMO} c_moving c_turning\n"
    "thermo_modify norm no lost error format float %.17g\n"
)


def about_to_collide(
    pair: str, seed: int, speed: float = 1.0
) -> tuple[Bodies, FloatArray, FloatArray]:
    """Return two bodies that tumble towards each other, and all velocities and spins."""
    random = np.random.default_rng(seed)
    one, two = (2 * RADIUS * shape for shape in PAIRS[pair])
    aside = random.uniform(-RADIUS, RADIUS, 2)
    first = placed(one, [0.3, 0.5, 0.5], random.normal(size=3))
    second = placed(two, [0.8, 0.5 + aside[0], 0.5 + aside[1]], random.normal(size=3))
    if len(two) == 1:
        second = Bodies(second.positions, np.zeros(1, dtype=np.int64))
    both = first.joined(second)
    spins = random.normal(0, 5 * speed, (2, 3))
    towards = np.array([[speed, 0, 0], [-speed, 0, 0]])
    number = int(both.molecules.max())
    velocities, turning = rigid_velocities(both, RADIUS, towards[:number], spins[:number])
    velocities[both.molecules == 0] = towards[1]
    return both, velocities, turning


def momenta(folder: Path) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Total momentum and angular momentum about the origin, and the energy of free spheres."""
    linear, angular, energy = [], [], []
    dumps = (read_dump(folder / name) for name in ("bodies.dump", "particles.dump"))
    for bodies, particles in zip(*dumps, strict=True):
        p = bodies["mass"][:, None] * bodies.velocities
        moments = np.cross(bodies.positions, p) + bodies.vectors("lx ly lz")
        free = particles["mol"] == 0
        m = mass(particles["radius"])[free, None]
        v = particles.velocities[free]
        linear.append(p.sum(axis=0) + (m * v).sum(axis=0))
        angular.append(moments.sum(axis=0) + np.cross(particles.positions[free], m * v).sum(axis=0))
        energy.append(0.5 * (m * v**2).sum())
    return np.array(linear), np.array(angular), np.array(energy)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("pair", PAIRS)
def test_what_a_collision_conserves(
    pair: str, inertia: str, seed: int, tmp_path: Path, lmp: Runner
) -> None:
    both, velocities, spins = about_to_collide(pair, seed)
    deck = body_scene(
        both,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=1e-10,
        velocities=velocities,
        spins=spins,
        **SPACE,
    )
    result = lmp(deck + ENERGIES + DUMP_BODY_SPHERES + DUMP_BODIES + "run 300\n")
    assert result.thermo["f_contact[5]"].max() > 0
    linear, angular, energy = momenta(tmp_path)
    # Round-off of 300 steps; the momenta of the two nearly cancel.
    scale = float(mass(RADIUS)) * np.abs(velocities).max()
    assert linear == pytest.approx(np.tile(linear[0], (301, 1)), abs=1e-12 * scale)
    assert angular == pytest.approx(np.tile(angular[0], (301, 1)), abs=1e-12 * scale)
    energy += result.thermo["c_moving"] + result.thermo["c_turning"]
    # Turning bodies are integrated to second order in h: 1e-4 of the energy at this step.
    assert np.diff(energy).max() <= 1e-3 * energy[0]
    assert energy[-1] < 0.9 * energy[0]


@pytest.mark.slow
@pytest.mark.parametrize("inertia", INERTIAS)
def test_bodies_stay_rigid(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    both, velocities, spins = about_to_collide("rod-and-tetrahedron", 1)
    deck = body_scene(
        both,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=1e-5,
        velocities=velocities,
        spins=spins,
        **SPACE,
    )
    lmp(deck + DUMP_BODY_SPHERES + "run 1000\n")
    distances = np.array(
        [
            np.linalg.norm(frame.positions[:, None] - frame.positions, axis=2)
            for frame in read_dump(tmp_path / "particles.dump")
        ]
    )
    same = (both.molecules[:, None] == both.molecules) & (distances[0] > 0)
    # Round-off of positions up to 10, in distances of 0.07.
    assert distances[:, same] == pytest.approx(np.tile(distances[0][same], (1001, 1)), rel=1e-12)


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("timestep", [0.001, 0.005, 0.01])
def test_free_flight(timestep: float, inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """A body of three different moments tumbles; the fix compares each step with its prediction."""
    body = placed(2 * RADIUS * BENT, [0.5, 0.5, 0.5], [0.3, 1.2, -0.4])
    velocities, spins = rigid_velocities(body, RADIUS, [0.1, -0.2, 0.3], [5, -9, 4])
    deck = body_scene(
        body,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=1e-8,
        velocities=velocities,
        spins=spins,
        timestep=timestep,
        **SPACE,
    )
    lmp(deck + DUMP_BODY_SPHERES + DUMP_BODIES + "run 1000\n")
    linear, angular, _ = momenta(tmp_path)
    # Round-off of 1,000 steps.
    assert linear == pytest.approx(np.tile(linear[0], (1001, 1)), rel=1e-11)
    assert angular == pytest.approx(
        np.tile(angular[0], (1001, 1)), abs=1e-11 * np.abs(angular[0]).max()
    )
    directions = np.array(
        [
            frame.positions[2] - frame.positions[0]
            for frame in read_dump(tmp_path / "particles.dump")
        ]
    )
    assert np.ptp(directions, axis=0).min() > RADIUS  # it does tumble


def sliding(
    body: Bodies, inertia: str, spin: FloatArray, times: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Positions of the spheres at some times, and the force on the floor: by an ODE solver.

    The lowest sphere stays on a floor without friction. `spin` at the start; the centre of mass
    moves so that this sphere does not.
    """
    m = float(mass(RADIUS))
    centre = body.positions.mean(axis=0)
    arms = body.positions - centre
    low = int(np.argmin(arms[:, 1]))
    of_points = m * sum(np.dot(r, r) * np.eye(3) - np.outer(r, r) for r in arms)
    balls = len(arms) * 0.4 * m * RADIUS**2 if inertia == "solid" else 0
    moments = of_points + balls * np.eye(3)
    total = len(arms) * m
    up = np.array([0.0, 1, 0])

    def forces(state: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Angular velocity, moment about the centre, force on the lowest sphere."""
        turn = Rotation.from_quat(state[:4]).as_matrix()
        inverse = np.linalg.inv(turn @ moments @ turn.T)
        w = inverse @ state[4:7]
        arm = turn @ arms[low]
        # The sphere's height stays: a_y + (w' x r)_y + (w x (w x r))_y = 0 with the force N up,
        # M a_y = N - M g and I w' = r x N - w x L.
        free = inverse @ -np.cross(w, state[4:7])
        at_rest = -GRAVITY + np.cross(free, arm)[1] + np.cross(w, np.cross(w, arm))[1]
        per_force = 1 / total + np.cross(inverse @ np.cross(arm, up), arm)[1]
        force = -at_rest / per_force
        return w, force * np.cross(arm, up), force

    def rate(_: float, state: FloatArray) -> FloatArray:
        w, moment, force = forces(state)
        q = state[:4]
        turning = 0.5 * np.r_[w * q[3] + np.cross(w, q[:3]), -w @ q[:3]]
        return np.array([*turning, *moment, *state[10:13], 0, force / total - GRAVITY, 0])

    drift = np.r_[0, -np.cross(spin, arms[low])[1], 0]
    start = np.r_[0, 0, 0, 1, moments @ spin, centre, drift]
    solution = solve_ivp(
        rate, (0, times[-1]), start, t_eval=times, rtol=1e-11, atol=1e-13, method="DOP853"
    )
    positions = np.array(
        [state[7:10] + Rotation.from_quat(state[:4]).apply(arms) for state in solution.y.T]
    )
    return positions, np.array([forces(state)[2] for state in solution.y.T])


@pytest.mark.slow
@pytest.mark.parametrize("inertia", INERTIAS)
def test_a_body_that_slides_on_the_floor_converges(
    inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    """A bent trimer falls over on one of its ends; the ODE of that motion is the limit."""
    body = placed(2 * RADIUS * BENT, [0.5, 0.5, 0.5], [0.9, 0.5, 1.1])
    low = int(np.argmin(body.positions[:, 1]))
    body = body.moved([0, RADIUS - body.positions[low, 1], 0])
    spin = np.array([2.0, 3.0, -1.0])
    drift = [0, -np.cross(spin, body.positions[low] - body.positions.mean(axis=0))[1], 0]
    velocities, spins = rigid_velocities(body, RADIUS, drift, spin)
    length = 0.08
    steps = np.array([10, 20, 40, 80])
    errors, force_errors = [], []
    for count in steps:
        folder = tmp_path / str(count)
        deck = body_scene(
            body,
            RADIUS,
            folder,
            inertia=inertia,
            tolerance=1e-13,
            velocities=velocities,
            spins=spins,
            timestep=length / count,
            setup="variable floor equal -f_contact[3][2]",
            thermo="step f_contact[4] f_contact[6] v_floor",
        )
        result = lmp(deck + DUMP_BODY_SPHERES + f"run {count}\n", into=str(count))
        assert (result.thermo["f_contact[6]"] == 1).all()
        times = np.linspace(0, length, count + 1)
        exact, force = sliding(body, inertia, spin, times)
        found = np.array([frame.positions for frame in read_dump(folder / "particles.dump")])
        errors.append(np.abs(found - exact).max())
        # A step leaves a gap of order h^2 above the floor, which the next one takes back: only the
        # first begins without, and two forces are settled afterwards.
        force_errors.append(np.abs(result.thermo["v_floor"] - force)[2:].max())
    moved = np.abs(exact[-1] - exact[0]).max()
    assert moved > 0.5 * RADIUS
    assert errors[-1] < 0.02 * moved
    # First order at least: half the step, half the error, within a fifth.
    assert (np.divide(errors[1:], errors[:-1]) < 0.6).all()
    assert (np.divide(force_errors[1:], force_errors[:-1]) < 0.6).all()


def test_spheres_do_not_notice_a_body_far_away(tmp_path: Path, lmp: Runner) -> None:
    points = random_points(60, ((0.06, 0.5), (0.06, 1.2), (0.06, 0.5)), 2 * RADIUS, seed=1)
    box = ((0, 0.57), (0, 4), (0, 0.57))
    settings: dict[str, Any] = {
        "tolerance": 5e-9 * RADIUS,
        "box": box,
        "skin": 0.1,
        "gravity": False,
    }
    pull = "fix pull {} gravity 9.81 vector 0 -1 0"
    alone = scene(points, RADIUS, tmp_path / "alone", fixes=pull.format("all"), **settings)
    lmp(alone + DUMP_PARTICLES + "run 100\n", into="alone")
    spheres = Bodies(points, np.zeros(len(points), dtype=np.int64))
    # It hangs in the air: gravity pulls the spheres alone.
    body = placed(2 * RADIUS * dimer(1.5), [0.3, 3.5, 0.3])
    deck = body_scene(
        spheres.joined(body),
        RADIUS,
        tmp_path / "with",
        inertia="point",
        fixes="group spheres molecule 0\n" + pull.format("spheres"),
        **settings,
    )
    lmp(deck + DUMP_PARTICLES + "run 100\n", into="with")
    frames = [read_dump(tmp_path / name / "particles.dump") for name in ("alone", "with")]
    for one, two in zip(*frames, strict=True):
        # In a scene with bodies the first rounds of a step are coarse, and the last ones begin from
        # there: what is left of forces differs, as between numbers of ranks, and grows by the step.
        assert one.positions == pytest.approx(two.positions[: len(points)], abs=0.0005 * RADIUS)
    assert frames[0][-1].positions[:, 1].mean() < 0.7 * points[:, 1].mean()


@pytest.mark.parametrize("inertia", INERTIAS)
def test_a_body_falls_and_turns_by_the_time_while_steps_are_shortened(
    inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    """One dimer falls and turns while two spheres race: its path is that of LAMMPS's time."""
    shape = 2 * RADIUS * dimer(1.5)
    body = placed(shape, [0.1, 1.8, 0.1])
    spheres = Bodies(np.array([[0.5, 0.5, 0.5], [0.5, 0.8, 0.5]]), np.zeros(2, dtype=np.int64))
    both = body.joined(spheres)
    spin = 3.0
    velocities, spins = rigid_velocities(both, RADIUS, [0, 0, 0], [0, spin, 0])
    velocities[2:, 1] = [-9, 9]
    deck = body_scene(
        both,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=1e-5,
        box=((0, 1), (-50, 50), (0, 1)),
        velocities=velocities,
        spins=spins,
        skin=0.02,
        options="shorten yes",
        thermo="step time f_contact[10]",
    )
    result = lmp(deck + DUMP_BODY_SPHERES + "run 100\n")
    time = result.thermo["Time"]
    assert result.thermo["f_contact[10]"][-1] > 50
    frames = read_dump(tmp_path / "particles.dump")
    height = np.array([frame["y"][:2].mean() for frame in frames])
    # Velocity-Verlet with steps that change is exact to first order in a step at worst.
    assert height == pytest.approx(1.8 - 9.81 * time**2 / 2, abs=9.81 * time[-1] * STEP)
    angle = [np.arctan2(*(frame.positions[0] - frame.positions[1])[[2, 0]]) for frame in frames]
    turned = np.unwrap(angle)
    # Second order in the angle of a step, 0.015.
    assert turned[0] - turned == pytest.approx(spin * time, abs=1e-3 * spin * time[-1])


@pytest.mark.parametrize("seed", [1, 2])
def test_no_gap_goes_to_and_fro_until_it_is_stopped(seed: int, tmp_path: Path, lmp: Runner) -> None:
    """Nearly round dimers turn by radians in a step; their gaps still settle in a few rounds."""
    width = 0.57
    bodies = random_bodies(
        [dimer(1.01)] * 60,
        RADIUS,
        ((RADIUS, width - RADIUS), (RADIUS, 3.8), (RADIUS, width - RADIUS)),
        seed=seed,
    )
    deck = body_scene(
        bodies,
        RADIUS,
        tmp_path,
        inertia="point",
        tolerance=0.0005 * RADIUS,
        box=((0, width), (0, 4), (0, width)),
        options="region container shorten yes",
        fixes=f"fix shake all random/force 200 {seed}",
        thermo="step f_contact[8]",
    )
    rounds = lmp(deck + "run 150\n").thermo["f_contact[8]"]
    # Gaps are raised again in the first twenty rounds. They settle in at most 11, in six such beds;
    # where each round goes the whole way, 23 to 25 are needed in each of them.
    assert rounds.max() < 20
