"""Scenes at the ends of every scale. Each prints one line with what was measured.

Overlaps come from a dump of every step, residuals and energies from the recorded problems, by the
formulas below; nothing is taken from the solver. docs/measured/extremes.md has the numbers.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.bodies import (
    DUMP_BODY_SPHERES,
    INERTIAS,
    TETRAHEDRON,
    Bodies,
    body_scene,
    dimer,
    placed,
    random_bodies,
)
from tests.helpers.lammps_run import Run, run_lmp
from tests.helpers.scenes import (
    DEFAULT_BOX,
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

pytestmark = pytest.mark.validation

RADIUS = 0.055
EPS = 0.0005 * RADIUS
STEP = 0.005
CENTRES = ((0.06, 0.94), (0.06, 2), (0.06, 0.94))
SLACK = 1 + 1e-6  # round-off of positions and of the dump
# Of the largest coordinate: six coordinates of a pair, each rounded by half of the epsilon
ROUND_OFF = 2 * np.finfo(float).eps
RECORD = "record problem.*.npz every 1"


@dataclass(frozen=True)
class Measured:
    """What a run left, lengths in tolerances."""

    overlap: float  # largest of all steps
    feasibility: float
    complementarity: float
    # Kinetic energy of a step's projection beyond what its constraints account for, relative
    energy: float

    def __str__(self) -> str:
        return (
            f"overlap {self.overlap:.7f} eps, residuals {self.feasibility:.4f} and "
            f"{self.complementarity:.4f} eps, unexplained energy {self.energy:.1e}"
        )


def residuals(path: Path, box: object) -> tuple[float, float, float]:
    """Feasibility over all pairs and walls, complementarity, and energy beyond its bound."""
    with np.load(path) as file:
        p = dict(file)
    x, r, v, h = p["position"], p["radius"], p["velocity"], float(p["timestep"])
    eps = float(p["tolerance"])
    i, j = np.triu_indices(len(x), 1)
    seen = p["inverse_mass"][i] + p["inverse_mass"][j] > 0
    if "molecule" in p:
        seen &= (p["molecule"][i] != p["molecule"][j]) | (p["molecule"][i] == 0)
    i, j = i[seen], j[seen]
    away = x[i] - x[j]
    distance = np.linalg.norm(away, axis=1)
    gap = distance - r[i] - r[j]
    opening = h * np.sum(away * (v[i] - v[j]), axis=1) / distance
    # An overlap beyond the tolerance, of turning bodies, need not be given back in a step.
    lacking = [0.0, *(-(np.where(gap < -eps, 0, gap) + opening))]
    for axis, (low, high) in enumerate(np.asarray(box if box is not None else [])):
        for gap, sign in ((x[:, axis] - low - r, 1), (high - x[:, axis] - r, -1)):
            lacking += [*(-(np.where(gap < -eps, 0, gap) + sign * h * v[:, axis]))]

    one = np.searchsorted(p["id"], p["id1"])
    two = np.searchsorted(p["id"], p["id2"]).clip(max=len(x) - 1)
    relative = v[one] - np.where(p["id2"][:, None] > 0, v[two], 0.0)
    under_force = p["impulse"] > 0
    asked = p["gap"]
    w = (asked + h * np.sum(p["normal"] * relative, axis=1))[under_force]
    energy = [0.5 * float(p["mass"] @ (u**2).sum(axis=1)) for u in (p["predicted_velocity"], v)]
    # What constraints may give back: of spheres the present overlap, of turning bodies, whose
    # surfaces do not move along straight lines, what they ask for. Then what gap is left where a
    # force acts.
    straight = np.ones(p["impulse"].shape, dtype=bool)
    if "molecule" in p:
        straight = (p["molecule"][one] == 0) & ((p["id2"] <= 0) | (p["molecule"][two] == 0))
    given = np.where(straight, p["wall_motion"] - p["gap_now"], -asked)
    left = max([0.0, *w])
    explained = float(p["impulse"] @ (np.maximum(0.0, given) + left)) / h
    gained = (energy[1] - energy[0] - explained) / max(energy[0], 1e-300)
    return max(lacking) / eps, left / eps, max(0.0, gained)


def measured(folder: Path, eps: float, box: Any = DEFAULT_BOX) -> Measured:
    """Look at all dumped steps and all recorded problems of a folder."""
    overlap = 0.0
    for frame in read_dump(folder / "particles.dump"):
        molecules = frame["mol"] if "mol" in frame.columns else None
        radii = frame["radius"]
        overlap = max(overlap, deepest_pair(frame.positions, radii, molecules=molecules))
        if box is not None:
            overlap = max(overlap, deepest_in_box(frame.positions, radii, box))
    records = [residuals(path, box) for path in folder.glob("problem.*.npz")]
    assert records
    return Measured(overlap / eps, *(max(column) for column in zip(*records, strict=True)))


def assert_sound(result: Measured, allowed: float = 1.0, round_off: float = 0.0) -> None:
    """Overlap within `allowed` tolerances, residuals within one. `round_off` in tolerances."""
    # The residual here is added up in another order than the solver's.
    assert result.overlap <= allowed * SLACK + round_off
    # A body's overlap of half a tolerance counts as closed, to which the residual is added.
    assert result.feasibility <= min(allowed, 1.5) * SLACK + round_off
    assert result.complementarity <= SLACK + round_off
    # Energies are sums of squares of some thousand velocities.
    assert result.energy <= 1e-12


def run(folder: Path, deck: str, **options: object) -> Run:
    """Run a deck for at most two minutes."""
    return run_lmp(folder, deck, **{"timeout": 120.0, **options})  # type: ignore[arg-type]


def crystal(side: int, apart: float, corner: float = RADIUS) -> FloatArray:
    """Return a simple cubic crystal of points."""
    places = np.moveaxis(np.indices((side,) * 3), 0, -1).reshape(-1, 3)
    return np.asarray(corner + apart * places, dtype=float)


# ---------------------------------------------------------------- shapes, tolerances, time steps


@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("excess", [1e-6, 1e-3, 0.01, 0.5, 1.0])
def test_aspect_ratio(excess: float, inertia: str, tmp_path: Path) -> None:
    bodies = random_bodies([dimer(1 + excess)] * 60, RADIUS, CENTRES, seed=1)
    deck = body_scene(
        bodies,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        skin=0.2,
        options=f"region container shorten yes {RECORD}",
    )
    run(tmp_path, deck + DUMP_BODY_SPHERES + "run 200\n")
    result = measured(tmp_path, EPS)
    print(f"aspect ratio 1 + {excess:g}, {inertia}: {result}")
    if inertia == "solid":  # the record does not hold how fast its solid spheres spin
        result = Measured(result.overlap, result.feasibility, result.complementarity, 0.0)
    assert_sound(result, allowed=2)


@pytest.mark.parametrize("tolerance", [0.1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-13])
def test_tolerance(tolerance: float, tmp_path: Path) -> None:
    eps = tolerance * RADIUS
    deck = scene(
        random_points(60, CENTRES, 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=eps,
        skin=0.2,
        options=f"region container {RECORD}",
    )
    iterations = run(tmp_path, deck + DUMP_PARTICLES + "run 150\n").thermo["f_contact[1]"]
    result = measured(tmp_path, eps)
    print(f"tolerance {tolerance:g} r: {result}, at most {iterations.max():.0f} iterations")
    assert_sound(result, round_off=2 * ROUND_OFF / eps)  # coordinates up to 2


@pytest.mark.parametrize("coordinate", [1.0, 1e3, 1e6])
def test_tolerance_at_the_round_off_of_positions(coordinate: float, tmp_path: Path) -> None:
    """Just above the floor all is well; just below it is an error that names a better value."""
    shift = coordinate - 1.0
    points = crystal(3, 2.05 * RADIUS) + np.array([shift, 0, 0])
    box = ((shift, coordinate), (0, 1), (0, 1))
    floor = ROUND_OFF * (points.max() + RADIUS)

    def deck(eps: float) -> str:
        settings: dict[str, Any] = {
            "box": box,
            "skin": 0.1,
            "options": f"region container {RECORD}",
        }
        return scene(points, RADIUS, tmp_path, tolerance=eps, **settings) + DUMP_PARTICLES

    # The spheres do not move along x by more than their gaps.
    run(tmp_path, deck(1.2 * floor) + "run 30\n")
    result = measured(tmp_path, 1.2 * floor, box)
    refused = run(tmp_path, deck(0.9 * floor) + "run 30\n", must_pass=False)
    print(f"coordinates of {coordinate:g}, tolerance {1.2 * floor:.2g}: {result}; below: refused")
    # The overlaps are known to one tolerance only.
    assert_sound(result, allowed=2, round_off=1)
    (error,) = refused.errors
    assert "below the round-off of positions" in error
    named = float(re.search(r"give at least ([-+.\de]+)", error).group(1))
    assert floor <= named <= 1.2 * floor


def test_tolerance_below_the_round_off_of_forces(tmp_path: Path) -> None:
    """A sphere thrown at 1e6 lengths a step is stopped to within 1e-10, and not better."""

    def deck(eps: float) -> str:
        return scene(
            [0.5, 0.5, 0.5],
            RADIUS,
            tmp_path,
            tolerance=eps,
            timestep=1.0,
            velocities=[-3e5, -8e5, -5e5],
            gravity=False,
            options=f"region container {RECORD}",
        )

    refused = run(tmp_path, deck(1e-14) + "run 3\n", must_pass=False)
    (error,) = refused.errors
    assert "below the round-off of these forces" in error
    named = float(re.search(r"raise it to ([-+.\de]+)", error).group(1))
    run(tmp_path, deck(named) + DUMP_PARTICLES + "run 3\n")
    result = measured(tmp_path, named)
    print(f"a sphere at 1e6 lengths a step, tolerance {named:g} as the error says: {result}")
    assert_sound(result, round_off=0.1)


@pytest.mark.parametrize(
    ("timestep", "skin", "options", "force"),
    [
        (1e-6, 0.1, "", 0),
        (1e-4, 0.1, "", 0),
        (0.05, 2, "", 0),
        (1.0, 30, "", 0),  # g h^2 is twice the height of the box
        (1e4, 0.1, "shorten yes", 0),
        (1e4, 0.1, "shorten yes", 3 * GRAVITY),
    ],
)
def test_time_step(
    timestep: float, skin: float, options: str, force: float, tmp_path: Path
) -> None:
    points = crystal(4, 2 * RADIUS + 1e-6)
    speeds = np.random.default_rng(1).normal(0, 1, points.shape)
    deck = scene(
        points,
        RADIUS,
        tmp_path,
        tolerance=EPS,
        timestep=timestep,
        velocities=speeds,
        skin=skin,
        fixes=f"fix shake all random/force {force} 4711" if force else "",
        options=f"region container {options} {RECORD}",
    )
    thermo = run(tmp_path, deck + DUMP_PARTICLES + "run 60\n").thermo
    result = measured(tmp_path, EPS)
    contacts = thermo["f_contact[5]"].max()
    shaken = f", random force of {force / GRAVITY:g} g" if force else ""
    print(f"time step {timestep:g} {options}{shaken}: {result}, up to {contacts:.0f} contacts")
    assert contacts > 20
    assert_sound(result)


# ---------------------------------------------------------------- masses, columns, arches


def test_mass_ratio_of_a_million_and_radius_ratio_of_fifty(tmp_path: Path) -> None:
    """A large sphere falls on 500 small ones and crushes them away."""
    small = 0.005
    points = random_points(500, ((0.15, 0.45), (0.0051, 0.05), (0.15, 0.45)), 2 * small, seed=1)
    box, eps = ((0, 0.6), (0, 1), (0, 0.6)), 0.0005 * small
    deck = scene(
        np.vstack([[0.3, 0.35, 0.3], points]),
        np.r_[50 * small, np.full(500, small)],
        tmp_path,
        tolerance=eps,
        skin=0.2,
        box=box,
        fixes="set atom 1 density 8",
        # A small sphere under the large one: its condition number is 4 x the ratio of masses.
        options=f"region container shorten yes maxiter 1000000 {RECORD}",
    )
    thermo = run(tmp_path, deck + DUMP_PARTICLES + "run 80\n").thermo
    result = measured(tmp_path, eps, box)
    print(
        f"masses 1:1e6, radii 1:50: {result}, at most {thermo['f_contact[1]'].max():.0f} iterations"
    )
    assert thermo["f_contact[5]"].max() > 300
    assert_sound(result)


@pytest.mark.parametrize("density", [1e2, 1e4])
def test_heavy_sphere_on_light_ones(density: float, tmp_path: Path) -> None:
    points = random_points(250, CENTRES, 2 * RADIUS, seed=1)
    deck = scene(
        np.vstack([[0.5, 3, 0.5], points]),
        np.r_[3 * RADIUS, np.full(250, RADIUS)],
        tmp_path,
        tolerance=EPS,
        skin=0.3,
        fixes=f"set atom 1 density {density}",
        options=f"region container shorten yes {RECORD}",
    )
    thermo = run(tmp_path, deck + DUMP_PARTICLES + "run 250\n").thermo
    result = measured(tmp_path, EPS)
    most = thermo["f_contact[1]"].max()
    print(f"a sphere of {27 * density:g} masses on a bed: {result}, at most {most:.0f} iterations")
    assert_sound(result)


def test_column_of_a_thousand(tmp_path: Path) -> None:
    """Every contact carries what is above it."""
    count, eps = 1000, 1e-9 * RADIUS
    box = ((0, 1), (0, 2 * RADIUS * count + 1), (0, 1))
    heights = RADIUS * (2 * np.arange(count) + 1)
    deck = scene(
        np.c_[np.full(count, 0.5), heights, np.full(count, 0.5)],
        RADIUS,
        tmp_path,
        tolerance=eps,
        skin=0.1,
        box=box,
        options="region container record problem.*.npz every 5",
    )
    thermo = run(tmp_path, deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 20\n").thermo
    result = measured(tmp_path, eps, box)
    contacts = read_dump(tmp_path / "contacts.dump")[-1]
    upper = np.maximum(contacts["id1"], contacts["id2"])
    expected = (count + 1 - upper) * float(mass(RADIUS)) * GRAVITY
    off = np.abs(contacts["force"] - expected).max() / expected.max()
    most = thermo["f_contact[1]"].max()
    print(f"column of 1,000: {result}, force off by {off:.1e} of the weight, {most:.0f} iterations")
    assert len(upper) == count
    # A thousand contacts in a row may each give way by eps in a step.
    assert off <= count * eps / (GRAVITY * STEP**2)
    assert_sound(result, round_off=box[1][1] * ROUND_OFF / eps)


@pytest.mark.parametrize("angle", [0.1, 0.01, 0.001])
def test_sphere_in_a_steep_wedge(angle: float, tmp_path: Path) -> None:
    """Walls at this angle from the vertical carry the weight over twice its sine each."""
    c, s = np.cos(angle), np.sin(angle)
    eps = 1e-6 * RADIUS * angle
    planes = "".join(
        f"region side{k} plane {0.5 - sign * RADIUS * c:.17g} {1 - RADIUS * s:.17g} 0.5 "
        f"{sign * c:.17g} {s:.17g} 0\n"
        for k, sign in enumerate((1, -1))
    )
    deck = scene(
        [0.5, 1, 0.5],
        RADIUS,
        tmp_path,
        tolerance=eps,
        setup=planes,
        options=f"region container side0 side1 {RECORD}",
    )
    run(tmp_path, deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 20\n")
    result = measured(tmp_path, eps)
    force = read_dump(tmp_path / "contacts.dump")[-1]["force"]
    off = np.abs(force * 2 * s / (float(mass(RADIUS)) * GRAVITY) - 1).max()
    print(f"wedge of {angle:g} rad: {result}, force off by {off:.1e}")
    assert len(force) == 2
    # The height is known to eps over the angle.
    assert off <= eps / angle / (GRAVITY * STEP**2)
    assert_sound(result)


def test_arch(tmp_path: Path) -> None:
    """Nine spheres between two frozen ones, on the line of thrust; it holds, for some steps."""
    count, thrust, step, eps = 9, 4.0, 1e-3, 1e-13
    upwards = count / 2 - np.arange(count + 1)  # what each contact carries, in weights
    line = np.c_[np.full(count + 1, thrust), upwards, np.zeros(count + 1)]
    size = np.linalg.norm(line, axis=1)
    points = np.vstack([[0, 0, 0], np.cumsum(2 * RADIUS * line / size[:, None], axis=0)])
    points += [0.5 - points[-1, 0] / 2, 1, 0.5]
    deck = scene(
        points,
        RADIUS,
        tmp_path,
        tolerance=eps,
        timestep=step,
        skin=0.1,
        box=((-1, 2), (0, 5), (0, 1)),
        motion=f"group ends id 1 {count + 2}\ngroup moving subtract all ends\n"
        "fix motion moving nve",
        options=f"region container frozen ends {RECORD}",
    )
    run(tmp_path, deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 5\n")
    result = measured(tmp_path, eps, None)
    contacts = read_dump(tmp_path / "contacts.dump")[-1]
    place = np.minimum(contacts["id1"], contacts["id2"]).astype(int) - 1
    off = np.abs(contacts["force"] / (float(mass(RADIUS)) * GRAVITY) / size[place] - 1).max()
    print(f"arch of nine: {result}, forces off by {off:.1e}")
    assert sorted(place) == list(range(count + 1))
    # eps / (g h^2) = 1e-8 a contact; the arch is weak along one direction.
    assert off <= 1e-6
    assert_sound(result, round_off=2 * ROUND_OFF / eps)


# ---------------------------------------------------------------- few particles, many ranks


@pytest.mark.parametrize(("particles", "ranks"), [(0, 1), (0, 2), (1, 1), (1, 2), (2, 2), (2, 4)])
def test_few_particles(particles: int, ranks: int, tmp_path: Path) -> None:
    """None at all, one, one per rank, and fewer than ranks."""
    points = np.array([[0.2, 0.06, 0.3], [0.8, 0.3, 0.7]])[: max(particles, 1)]
    deck = scene(
        points,
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.1,
        setup="processors * 1 1",
        fixes="" if particles else "delete_atoms group all",
        options=f"region container {RECORD if particles else ''}",
    )
    thermo = run(tmp_path, deck + DUMP_PARTICLES + "run 80\n", ranks=ranks).thermo
    assert thermo["Step"][-1] == 80
    if not particles:
        print(f"no particle on {ranks} ranks: 80 steps")
        return
    result = measured(tmp_path, EPS)
    print(f"{particles} particles on {ranks} ranks: {result}")
    assert thermo["f_contact[6]"][-1] == particles
    assert_sound(result)


def test_all_in_one_corner(tmp_path: Path) -> None:
    deck = scene(
        random_points(120, ((0.06, 0.94), (0.06, 0.94), (0.06, 0.94)), 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.2,
        gravity=False,
        fixes="fix gravity all gravity 50 vector -1 -1 -1\nfix drag all viscous 0.001",
        options=f"region container {RECORD}",
    )
    thermo = run(tmp_path, deck + DUMP_PARTICLES + "run 300\n").thermo
    result = measured(tmp_path, EPS)
    contacts = thermo["f_contact[5]"][-1]
    print(f"all in one corner: {result}, {contacts:.0f} contacts")
    assert contacts > 200
    assert_sound(result)


# ---------------------------------------------------------------- too many constraints


@pytest.mark.parametrize("copies", [1, 3])
def test_crystal_at_rest_in_its_box(copies: int, tmp_path: Path) -> None:
    """6 x 6 x 6 spheres that touch each other and all six walls; the walls once or three times."""
    side, eps = 6, 1e-6 * RADIUS
    width = 2 * RADIUS * side
    box = ((0, width),) * 3
    faces = " ".join(f"{value:.17g}" for value in np.ravel(box))
    more = "".join(f"region again{k} block {faces}\n" for k in range(copies - 1))
    deck = scene(
        crystal(side, 2 * RADIUS),
        RADIUS,
        tmp_path,
        tolerance=eps,
        skin=0.1,
        box=box,
        setup=more,
        options="region container "
        + " ".join(f"again{k}" for k in range(copies - 1))
        + f" {RECORD}",
    )
    run(tmp_path, deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 60\n")
    result = measured(tmp_path, eps, box)
    frames = read_dump(tmp_path / "particles.dump")
    moved = np.abs(frames[-1].positions - frames[0].positions).max()
    contacts = read_dump(tmp_path / "contacts.dump")[-1]
    # What the lid and the floor press a column with is not determined; their difference is.
    floor, lid = (
        contacts["force"][np.isin(contacts["id2"], [wall - 6 * k for k in range(copies)])].sum()
        for wall in (-3, -4)
    )
    off = abs((floor - lid) / (side**3 * float(mass(RADIUS)) * GRAVITY) - 1)
    print(
        f"crystal at rest, walls {copies} times: {result}, moved {moved / eps:.2f} eps, weight off "
        f"by {off:.1e}"
    )
    # A line of six may shift by one tolerance at each contact.
    assert moved <= (side + 1) * eps
    assert off <= side * eps / (GRAVITY * STEP**2)
    assert_sound(result)


@pytest.mark.parametrize("inertia", INERTIAS)
def test_body_with_dozens_of_contacts(inertia: str, tmp_path: Path) -> None:
    """A plate of 36 spheres lies on the floor and carries 36 more."""
    flat = np.array([[k % 6, 0, k // 6] for k in range(36)], dtype=float)
    plate = placed(2 * RADIUS * flat, [0.5, RADIUS, 0.5])
    above = Bodies(plate.positions + np.array([0, 2 * RADIUS, 0]), np.zeros(36, dtype=np.int64))
    eps = 1e-6 * RADIUS
    deck = body_scene(
        plate.joined(above),
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=eps,
        skin=0.1,
        options=f"region container {RECORD}",
    )
    run(tmp_path, deck + DUMP_BODY_SPHERES + DUMP_CONTACTS + "run 40\n")
    result = measured(tmp_path, eps)
    contacts = read_dump(tmp_path / "contacts.dump")[-1]
    floor = contacts["force"][contacts["id2"] == -3].sum()
    off = abs(floor / (72 * float(mass(RADIUS)) * GRAVITY) - 1)
    print(f"plate with 72 contacts, {inertia}: {result}, weight off by {off:.1e}")
    # One layer on the other: each contact gives way by eps.
    assert off <= 2 * eps / (GRAVITY * STEP**2)
    if inertia == "solid":
        result = Measured(result.overlap, result.feasibility, result.complementarity, 0.0)
    assert_sound(result, allowed=2)


@pytest.mark.parametrize("density", [1e12, 1e30, 1e200])
def test_infinitely_heavy_sphere(density: float, tmp_path: Path) -> None:
    """Light spheres hit it, and are held by it as by a wall."""
    deck = scene(
        [[0.5, 0.5, 0.5], [0.5, 1.5, 0.5], [0.5, 1.7, 0.5]],
        [0.2, RADIUS, RADIUS],
        tmp_path,
        tolerance=EPS,
        skin=0.2,
        gravity=False,
        fixes=f"set atom 1 density {density}\ngroup light id 2 3\n"
        "fix gravity light gravity 9.81 vector 0 -1 0",
        options=f"region container {RECORD}",
    )
    run(tmp_path, deck + DUMP_PARTICLES + "run 150\n")
    result = measured(tmp_path, EPS)
    end = read_dump(tmp_path / "particles.dump")[-1]
    moved = np.abs(end.positions[0] - 0.5).max()
    print(f"density {density:g} among 1: {result}, the heavy one moved {moved:.1e}")
    # What the weight of the others would do to it in this time
    ratio = 2 * float(mass(RADIUS)) / (density * float(mass(0.2)))
    assert moved <= ratio * GRAVITY * (150 * STEP) ** 2
    assert end.velocities[1:] == pytest.approx(0, abs=3 * EPS / STEP)
    assert_sound(result)


# ---------------------------------------------------------------- no room


CLOSING = "variable down equal -3*time\nregion lid plane 0 2.2 0 0 -1 0 move NULL v_down NULL\n"


def crushed(name: str, folder: Path, options: str) -> str:
    """Return a scene that has no room, now or after some steps."""
    lid: dict[str, Any] = {"setup": CLOSING, "options": f"region container lid {options}"}
    if name == "one sphere":
        return scene([0.5, RADIUS, 0.5], RADIUS, folder, tolerance=EPS, skin=0.1, **lid)
    if name == "spheres":
        points = random_points(250, CENTRES, 2 * RADIUS, seed=1)
        # Some are squeezed out fast before there is no room: they move by 0.2 in a step.
        return scene(points, RADIUS, folder, tolerance=EPS, skin=0.5, **lid)
    if name == "dimers":
        bodies = random_bodies([dimer(1.5)] * 60, RADIUS, CENTRES, seed=1)
        return body_scene(bodies, RADIUS, folder, inertia="point", tolerance=EPS, skin=0.2, **lid)
    if name == "frozen spheres":
        return scene(
            [[0.3, 0.5, 0.5], [0.5, 0.5, 0.5], [0.7, 0.5, 0.5]],
            RADIUS,
            folder,
            tolerance=EPS,
            skin=0.2,
            gravity=False,
            velocities=[[1, 0, 0], [0, 0, 0], [-1, 0, 0]],
            options=f"region container frozen jaws {options}",
            # Nothing accelerates the frozen ones.
            motion="group jaws id 1 3\nfix motion all nve",
        )
    points = np.random.default_rng(1).uniform(0.06, 0.94, (1500, 3))
    settings: dict[str, Any] = {
        "skin": 0.2,
        "box": ((0, 1),) * 3,
        "options": f"region container {options}",
    }
    return scene(points, RADIUS, folder, tolerance=EPS, **settings)


@pytest.mark.parametrize("options", ["", "shorten yes"])
@pytest.mark.parametrize(
    ("name", "ranks"),
    [
        ("one sphere", 1),
        ("one sphere", 2),
        ("spheres", 1),
        ("spheres", 2),
        ("dimers", 1),
        ("dimers", 2),
        ("frozen spheres", 1),
        ("too many spheres", 1),
    ],
)
def test_no_room(name: str, ranks: int, options: str, tmp_path: Path) -> None:
    """The run ends soon, and its error names two that overlap, and how deep they would."""
    deck = crushed(name, tmp_path, options)
    start = time.perf_counter()
    # With shorter steps crushed ones squeeze past one another for 130 to 215 steps, by the seed, of
    # as many iterations as they may have: spheres take 4 to 75 s on a free machine, dimers 8 to 16.
    most = 600 if name in ("spheres", "dimers") and options else 60
    result = run(tmp_path, deck + "run 400\n", ranks=ranks, must_pass=False, timeout=most)
    seconds = time.perf_counter() - start
    (error,) = result.errors
    if name == "too many spheres":
        # A bad start in which all give way to one another, and that no longer opens.
        found = re.search(
            r"overlaps of up to ([\d.e-]+) .*; (atoms \d+ and \d+)\) do not open", error
        )
        assert found, error
        assert "leaves no room" in error
        assert float(found[1]) > EPS
        assert seconds < 60
        return
    found = re.search(r"(atoms? \d+ and (?:wall )?\d+) overlap by ([-+.\de]+) at its end", error)
    assert found, error
    certain = "no velocities keep the surfaces apart" in error
    print(
        f"no room, {name} on {ranks} ranks {options}: {found[1]} by {found[2]}"
        f"{'' if certain else ' (iterations ran out)'} after {seconds:.1f} s"
    )
    # Of turning bodies it says so only where shorter steps have shown that it is not the turn.
    turning = "none for those at the end of the step" in error
    assert "leaves no room" in error or (turning and name == "dimers" and not options)
    assert float(found[2]) > EPS
    assert seconds < most  # not minutes, on a busy machine either
    # Many spheres can be so fast in the end that the iterations run out before it is certain; and
    # shorter steps, which bodies are tried with, have so little to give that they do, too.
    if name != "spheres" and (name, options) != ("dimers", "shorten yes"):
        assert certain, error
    if name == "one sphere" and not options:
        # The lid comes down by 0.015 in this step, the sphere and the floor share what is missing.
        step = int(re.search(r"step (\d+)", error)[1])
        missing = 2 * RADIUS - (2.2 - 3 * (step + 1) * STEP)
        assert float(found[2]) == pytest.approx(missing / 2, abs=2 * EPS)


def test_no_room_goes_on_with_a_warning(tmp_path: Path) -> None:
    """With maxiter N warn the run goes on; it warns each time, and later there is room again."""
    lid = "variable down equal -2.12*sin(4*time)\n" + CLOSING.splitlines()[1] + "\n"
    deck = scene(
        [0.5, RADIUS, 0.5],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.1,
        setup=lid,
        options="region container lid maxiter 100000 warn",
    )
    result = run(tmp_path, deck + DUMP_PARTICLES + "run 200\n")
    said = [line for line in result.warnings if "no velocities keep the surfaces apart" in line]
    end = read_dump(tmp_path / "particles.dump")[-1]
    depth = deepest_in_box(end.positions, end["radius"])
    print(f"no room for a while, warnings: {len(said)}, overlap at the end {depth / EPS:.2f} eps")
    assert said
    assert depth <= EPS * SLACK


# ---------------------------------------------------------------- bad starts


@pytest.mark.parametrize("overlap", [1e-6, 1e-4, 1e-2, 0.1, 0.5])
def test_overlap_at_the_start(overlap: float, tmp_path: Path) -> None:
    """A crystal whose neighbours overlap by this many radii comes apart and stays at rest."""
    deck = scene(
        crystal(5, (2 - overlap) * RADIUS, 0.3) + np.array([0, 1, 0]),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.2,
        gravity=False,
        options=f"region container {RECORD}",
    )
    run(tmp_path, deck + DUMP_PARTICLES + "run 80\n")
    frames = read_dump(tmp_path / "particles.dump")
    depth = [deepest_pair(frame.positions, frame["radius"]) for frame in frames]
    speeds = [np.linalg.norm(frame.velocities, axis=1).max() for frame in frames]
    print(
        f"overlap of {overlap:g} r: {depth[0] / EPS:.4g} eps at the start, {depth[-1] / EPS:.4f} "
        f"at the end; largest speed {max(speeds) * STEP / RADIUS:.2g} r a step, then "
        f"{speeds[-1] * STEP / EPS:.2g} eps a step"
    )
    assert np.diff(depth).max() <= EPS * SLACK
    assert depth[-1] <= max(EPS, min(overlap * RADIUS, 2 * EPS)) * SLACK
    # At most 0.1 r per contact and step, and four of them between the middle and the face.
    assert max(speeds) * STEP <= 3**0.5 * 4 * 0.1 * RADIUS * 0.5 + 4 * EPS
    assert speeds[-1] <= 4 * EPS / STEP


# ---------------------------------------------------------------- other units


def in_units(folder: Path, length: float, gravity: float, eps: float) -> FloatArray:
    """Trajectory of 120 spheres in these units, in the usual ones: (frames, spheres, 3)."""
    points = random_points(120, CENTRES, 2 * RADIUS, seed=3)
    deck = scene(
        length * points,
        length * RADIUS,
        folder,
        tolerance=length * eps,
        timestep=STEP * np.sqrt(length / gravity),
        velocities=np.sqrt(length * gravity) * np.array([0.0, -3.0, 0.0]),
        skin=length * 0.2,
        box=(length * np.array(DEFAULT_BOX)).tolist(),
        gravity=False,
        fixes=f"fix gravity all gravity {gravity * GRAVITY:.17g} vector 0 -1 0",
    )
    scale_box(folder / "spheres.data", length)
    run(folder, deck + DUMP_PARTICLES + "run 100\n")
    return np.array([frame.positions for frame in read_dump(folder / "particles.dump")]) / length


def scale_box(data: Path, length: float) -> None:
    """Scale LAMMPS's own box, too: it is cut into bins of the size of the spheres."""
    text = data.read_text()
    for (low, high), axis in zip(length * np.array(DEFAULT_BOX), "xyz", strict=True):
        text = re.sub(
            rf".* {axis}lo {axis}hi",
            f"{low - length:.17g} {high + length:.17g} {axis}lo {axis}hi",
            text,
        )
    data.write_text(text)


@pytest.mark.parametrize(
    ("length", "gravity"), [(2.0**-30, 1), (2.0**20, 1), (1, 2.0**-20), (1, 2.0**20)]
)
def test_units_of_powers_of_two_change_no_bit(
    length: float, gravity: float, tmp_path: Path
) -> None:
    usual = in_units(tmp_path / "usual", 1, 1, EPS)
    other = in_units(tmp_path / "other", length, gravity, EPS)
    print(f"length {length:.4g}, gravity {gravity:.4g}: off by {np.abs(usual - other).max():g}")
    assert np.array_equal(usual, other)


def bodies_in_units(folder: Path, length: float, gravity: float, inertia: str) -> FloatArray:
    """Trajectory of 40 dimers and 8 tetrahedra in these units, in the usual ones."""
    shapes = [dimer(1.5)] * 40 + [TETRAHEDRON] * 8
    bodies = random_bodies(shapes, RADIUS, CENTRES, seed=1)
    deck = body_scene(
        Bodies(length * bodies.positions, bodies.molecules),
        length * RADIUS,
        folder,
        inertia=inertia,
        tolerance=length * EPS,
        timestep=STEP * np.sqrt(length / gravity),
        skin=length * 0.2,
        box=(length * np.array(DEFAULT_BOX)).tolist(),
        gravity=False,
        fixes=f"fix gravity all gravity {gravity * GRAVITY:.17g} vector 0 -1 0",
        options="region container shorten yes",
    )
    scale_box(folder / "spheres.data", length)
    run(folder, deck + DUMP_BODY_SPHERES + "run 100\n")
    return np.array([frame.positions for frame in read_dump(folder / "particles.dump")]) / length


@pytest.mark.parametrize(
    ("length", "gravity", "inertia"),
    [
        (2.0**-30, 1, "point"),
        (2.0**-30, 1, "solid"),
        # Fix rigid/small compares the zero moment of point masses on a line with 1e-6: no 2^20.
        (2.0**20, 1, "solid"),
        (1, 2.0**-20, "point"),
        (1, 2.0**20, "solid"),
    ],
)
def test_units_of_powers_of_two_with_bodies(
    length: float, gravity: float, inertia: str, tmp_path: Path
) -> None:
    usual = bodies_in_units(tmp_path / "usual", 1, 1, inertia)
    other = bodies_in_units(tmp_path / "other", length, gravity, inertia)
    off = np.abs(usual - other).max()
    print(f"bodies ({inertia}), length {length:.4g}, gravity {gravity:.4g}: off by {off:g}")
    assert np.array_equal(usual, other)


@pytest.mark.parametrize(("length", "gravity"), [(1e-9, 1), (1e6, 1), (1, 1e-6), (1, 1e6)])
def test_other_units(length: float, gravity: float, tmp_path: Path) -> None:
    eps = 1e-11 * RADIUS  # a packing magnifies it some thousand times in 100 steps
    usual = in_units(tmp_path / "usual", 1, 1, eps)
    other = in_units(tmp_path / "other", length, gravity, eps)
    off = np.abs(usual - other).max() / RADIUS
    print(f"length {length:g}, gravity {gravity:g}: off by {off:.1e} r in 100 steps")
    assert off <= 1e-6


# ---------------------------------------------------------------- long rest, violent motion


def test_long_rest(tmp_path: Path) -> None:
    """100,000 steps of 300 settled spheres, in a bed of about ten layers.

    They have 75 time units to settle, for beds give way late. The drag, with a rate of 1, stops
    spheres that slide in their cages, which nothing else does without friction.
    """
    box = ((0, 0.6), (0, 5), (0, 0.6))
    deck = scene(
        random_points(300, ((0.06, 0.54), (0.06, 4.9), (0.06, 0.54)), 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.1,
        box=box,
        fixes=f"fix drag all viscous {float(mass(RADIUS))}",
        options="region container shorten yes",
    )
    rest, every = 100_000, 1000
    deck = deck.replace("thermo 1\n", f"thermo {every}\n") + "run 15000\nreset_timestep 0\n"
    dump = DUMP_PARTICLES.replace("custom 1 ", f"custom {every} ")
    result = run(tmp_path, deck + dump + f"run {rest}\n", timeout=500)
    frames = read_dump(tmp_path / "particles.dump")
    assert len(frames) == rest // every + 1
    places = np.array([frame.positions for frame in frames])
    moved = np.linalg.norm(places - places[0], axis=2).max(axis=0) / RADIUS
    drift = np.ptp(places.mean(axis=1), axis=0) / EPS
    depth = max(
        max(deepest_pair(f.positions, f["radius"]), deepest_in_box(f.positions, f["radius"], box))
        for f in frames
    )
    speed = np.sqrt(2 * result.thermo["KinEng"].max() / (300 * float(mass(RADIUS))))
    said = float(re.findall(r"largest overlap \S+ = (\S+) tolerances", result.screen)[-1])
    print(
        f"100,000 steps of rest: centre of mass moves by {drift[0]:.1f}, {drift[1]:.1f}, "
        f"{drift[2]:.1f} eps, half of the spheres by less than {np.median(moved):.1e} r, and none "
        f"by more than {moved.max():.1e} r; mean speed up to {speed * STEP / EPS:.1f} eps a step, "
        f"overlap {depth / EPS:.6f} eps (in the dump), {said:g} (of all steps)"
    )
    assert max(drift) <= 1
    assert moved.max() <= 0.01
    # A bed that gives way once more would have 0.1; one that is at rest has 0, which was measured.
    assert speed <= 0.2 * EPS / STEP
    assert max(depth / EPS, said) <= SLACK


def test_random_force_of_a_thousand_weights(tmp_path: Path) -> None:
    deck = scene(
        random_points(250, CENTRES, 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.2,
        fixes=f"fix shake all random/force {1000 * GRAVITY} 5",
        options=f"region container shorten yes {RECORD}",
    )
    thermo = run(tmp_path, deck + DUMP_PARTICLES + "run 150\n").thermo
    result = measured(tmp_path, EPS)
    contacts = thermo["f_contact[5]"].max()
    print(f"random force of 1,000 g: {result}, up to {contacts:.0f} contacts")
    assert_sound(result)


def depth_in_floor(folder: Path, height: Callable[[float], float], timestep: float) -> float:
    """Largest depth in a floor of this height over time."""
    return max(
        float((height(frame.step * timestep) + frame["radius"] - frame["y"]).max())
        for frame in read_dump(folder / "particles.dump")
    )


@pytest.mark.parametrize(
    ("name", "formula", "height"),
    [
        # Five radii a step
        ("at high speed", "55*time", lambda t: 55 * t),
        # A period of eight steps, at 250 g
        ("vibrating", "0.1*sin(157.07963267948966*time)", lambda t: 0.1 * np.sin(np.pi * 50 * t)),
    ],
)
def test_moving_floor(
    name: str, formula: str, height: Callable[[float], float], tmp_path: Path
) -> None:
    box = ((0, 1), (-1, 30), (0, 1))
    floor = f"variable up equal {formula}\nregion floor plane 0 0 0 0 1 0 move NULL v_up NULL\n"
    deck = scene(
        random_points(200, ((0.06, 0.94), (0.06, 2), (0.06, 0.94)), 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.6,
        box=box,
        setup=floor,
        options=f"region container floor {RECORD}",
    )
    steps = 80 if name == "at high speed" else 200
    run(tmp_path, deck + DUMP_PARTICLES + f"run {steps}\n")
    result = measured(tmp_path, EPS, box)
    depth = depth_in_floor(tmp_path, height, STEP) / EPS
    print(f"floor {name}: {result}, {depth:.4f} eps in the floor")
    assert depth <= SLACK
    # The wall does work: energies are not compared.
    assert_sound(Measured(result.overlap, result.feasibility, result.complementarity, 0.0))


def test_wall_that_is_removed(tmp_path: Path) -> None:
    """A bed at rest loses its walls and its lid, and only the floor stays."""
    deck = scene(
        random_points(200, ((0.06, 0.94), (0.06, 2), (0.06, 0.94)), 2 * RADIUS, seed=1),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.3,
        box=((0, 1), (0, 5), (0, 1)),
        setup="boundary s f s\nregion ground plane 0 0 0 0 1 0\n",
        options="region container",
    )
    again = f"fix contact all inelastic {EPS:.17g} region ground shorten yes {RECORD}\n"
    deck += "run 150\n" + again + DUMP_PARTICLES + "reset_timestep 0\nrun 100\n"
    run(tmp_path, deck)
    result = measured(tmp_path, EPS, ((-99, 99), (0, 99), (-99, 99)))
    frames = read_dump(tmp_path / "particles.dump")
    spread = np.ptp(frames[-1].positions[:, 0])
    print(f"walls removed: {result}, the bed spreads to {spread:.2f}")
    assert spread > 1.2
    assert_sound(result)
