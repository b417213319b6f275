"""The checker passes what the fix wrote, and finds each falsification of it."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.bodies import BENT, body_scene, dimer, random_bodies, rigid_velocities
from tests.helpers.scenes import random_points, scene
from tests.random_scenes.scene_checker import Report, check, read_thermo
from tests.random_scenes.scene_generator import (
    BODY_COLUMNS,
    CONTACTS,
    computes,
    random_scene,
    redump,
)
from tests.random_scenes.scene_loop import installed, judge
from tests.random_scenes.scene_run import REFUSALS, Answer, answer, finding
from tests.random_scenes.scene_walls import views

RADIUS, EPS = 0.06, 3e-5
BOX = ((0.0, 0.5), (0.0, 2.0), (0.0, 0.5))
FACTS = {
    "words": [], "acceleration_of_force": 1.0, "pressure_of_energy": 1.0, "walls": 6,
    "periodic": [False] * 3, "inertia": None, "solver": "sweeps", "warn": False, "shorten": False,
    "bad_start": False, "closing": False, "smallest": RADIUS, "largest": RADIUS, "spread": 1.0,
    "shapes": [{"kind": "block", "faces": BOX, "inside": True, "number": 1}],
}  # fmt: skip


@dataclass(frozen=True)
class Good:
    """A scene that ran well: its folder, and what LAMMPS printed."""

    folder: Path
    facts: dict[str, Any]
    screen: str


def ran(deck: str, bodies: bool, folder: Path, walls: int = 6) -> Good:
    """Let a deck run for 25 steps with the dumps that the checker reads."""
    (folder / "redump.in").write_text(redump(bodies))
    lines = [deck, "variable part loop 0 99 pad", f"variable eps string {EPS}"]
    lines += [*computes(bodies, walls), "include redump.in", "run 25", 'print "@end"', ""]
    (folder / "deck.in").write_text("\n".join(lines))
    programs = installed()
    result = answer(folder, 1, programs.program, programs.environment)
    assert "@end" in result.screen, result.screen[-2000:]
    return Good(folder, FACTS | {"inertia": "solid" if bodies else None}, result.screen)


@dataclass
class Dump:
    """A dump that can be changed and written again."""

    path: Path
    heads: list[list[str]] = field(default_factory=list)
    frames: list[np.ndarray] = field(default_factory=list)
    columns: list[str] = field(default_factory=list)

    def write(self) -> None:
        lines = []
        for head, rows in zip(self.heads, self.frames, strict=True):
            lines += [*head[:3], str(len(rows)), *head[4:]]
            lines += [" ".join(f"{value:.17g}" for value in row) for row in rows]
        self.path.write_text("\n".join(lines) + "\n")

    def of(self, name: str) -> int:
        return self.columns.index(name)


def dump(folder: Path, kind: str, names: str = "") -> Dump:
    """Read the first part's dump."""
    given = Dump(folder / f"{kind}.01.dump")
    lines = given.path.read_text().splitlines()
    at = 0
    while at < len(lines):
        count = int(lines[at + 3])
        given.heads.append(lines[at : at + 9])
        given.columns = names.split() or lines[at + 8].split()[2:]
        rows = [line.split() for line in lines[at + 9 : at + 9 + count]]
        given.frames.append(np.array(rows, dtype=float).reshape(count, len(given.columns)))
        at += 9 + count
    return given


SETTINGS: dict[str, Any] = {"tolerance": EPS, "box": BOX, "timestep": 0.01, "skin": 0.2}
ROOM = np.array(BOX) + np.array([RADIUS, -RADIUS])
STORED = "fix before all store/force"


@pytest.fixture(scope="module")
def spheres(tmp_path_factory: pytest.TempPathFactory) -> Good:
    folder = tmp_path_factory.mktemp("spheres")
    points = random_points(12, (ROOM[0], (RADIUS, 0.5), ROOM[2]), 2 * RADIUS, seed=3)
    random = np.random.default_rng(4)
    velocities = random.normal([0, -2, 0], 0.5, points.shape)
    return ran(
        scene(points, RADIUS, folder, velocities=velocities, fixes=STORED, **SETTINGS),
        False,
        folder,
    )


@pytest.fixture(scope="module")
def of_bodies(tmp_path_factory: pytest.TempPathFactory) -> Good:
    folder = tmp_path_factory.mktemp("bodies")
    bodies = random_bodies([dimer(1.5), BENT, np.zeros((1, 3))] * 3, RADIUS, ROOM, seed=6)
    velocities, spins = rigid_velocities(bodies, RADIUS, [0, -3, 0], [1, 2, 3])
    settings = {**SETTINGS, "inertia": "solid", "velocities": velocities, "spins": spins}
    return ran(body_scene(bodies, RADIUS, folder, fixes=STORED, **settings), True, folder)


@pytest.fixture(scope="module")
def on_a_floor(tmp_path_factory: pytest.TempPathFactory) -> Good:
    """Spheres that nothing holds along x and z, where the box is periodic; the last one flies."""
    folder = tmp_path_factory.mktemp("on_a_floor")
    points = random_points(30, (ROOM[0], (RADIUS, 1.0), ROOM[2]), 2 * RADIUS, seed=5)
    points = np.vstack([points, [0.25, 1.7, 0.25]])
    velocities = np.random.default_rng(6).normal([0, -1, 0], 0.3, points.shape)
    floor = "region floor plane 0 0 0 0 1 0 side in units box"
    settings = SETTINGS | {"fixes": f"{floor}\n{STORED}", "options": "region floor"}
    deck = scene(points, RADIUS, folder, velocities=velocities, boundary="p f p", **settings)
    good = ran(deck, False, folder, 1)
    shape = {"kind": "plane", "through": [0.0] * 3, "normal": [0.0, 1.0, 0.0]}
    facts = {"walls": 1, "periodic": [True, False, True]}
    shapes = [shape | {"inside": True, "number": 1}]
    return Good(folder, good.facts | facts | {"shapes": shapes}, good.screen)


def kinds(report: Report) -> set[str]:
    return {problem.split(": ")[0] for problem in report.problems}


def test_a_good_run_passes(spheres: Good, of_bodies: Good) -> None:
    for good in (spheres, of_bodies):
        report = check(good.folder, good.facts, good.screen)
        assert report.problems == []
        assert report.seen["frames"] > 4
        assert report.seen["contacts"] > 5
    assert report.seen["momenta of bodies"] > 0


def pair_row(contacts: Dump) -> int:
    """A contact of two spheres in the last frame."""
    return int(np.flatnonzero(contacts.frames[-1][:, 1] > 0)[0])


def scaled(column: str, factor: float) -> Callable[[Dump, float], None]:
    def change(given: Dump, eps: float) -> None:
        given.frames[-1][pair_row(given), given.of(column)] *= factor

    return change


def dropped(contacts: Dump, eps: float) -> None:
    contacts.frames[-1] = np.delete(contacts.frames[-1], pair_row(contacts), axis=0)


def twice(contacts: Dump, eps: float) -> None:
    row = contacts.frames[-1][pair_row(contacts)]
    contacts.frames[-1] = np.vstack([contacts.frames[-1], row])


def swapped(contacts: Dump, eps: float) -> None:
    row = contacts.frames[-1][pair_row(contacts)]
    row[:2] = row[1::-1].copy()


def nobody(contacts: Dump, eps: float) -> None:
    contacts.frames[-1][pair_row(contacts), 1] = 99_999


def turned(contacts: Dump, eps: float) -> None:
    row = contacts.frames[-1][pair_row(contacts)]
    normal = row[5:8] + 1e-6 * np.array([row[6], -row[5], 0.3])
    row[5:8] = normal / np.linalg.norm(normal)


def moved_point(contacts: Dump, eps: float) -> None:
    contacts.frames[-1][pair_row(contacts), 3] += eps


def displaced(particles: Dump, eps: float) -> None:
    particles.frames[-1][0, particles.of("x")] += 3 * eps


def at(column: str, change: Callable[[float], float]) -> Callable[[Dump, float], None]:
    def apply(given: Dump, eps: float) -> None:
        column_number = given.of(column)
        rows = given.frames[-1]
        # The row in which the change is largest.
        row = int(np.argmax(np.abs(rows[:, column_number])))
        rows[row, column_number] = change(rows[row, column_number])

    return apply


FALSIFIED = {
    "a contact dropped": ("contacts", dropped, "contacts of a sphere"),
    "a contact twice": ("contacts", twice, "contact"),
    "a force by 1.001": ("contacts", scaled("force", 1.001), "force on a sphere"),
    "a force by 1 + 1e-9": ("contacts", scaled("force", 1 + 1e-9), "force on a sphere"),
    "an attraction": ("contacts", scaled("force", -1.0), "force of a contact"),
    "a gap": ("contacts", scaled("gap", 1.5), "line of the centres"),
    "IDs swapped": ("contacts", swapped, "line of the centres"),
    "an ID that is not there": ("contacts", nobody, "contact IDs"),
    "a normal turned": ("contacts", turned, "line of the centres"),
    "a normal that is longer": ("contacts", scaled("nx", 1 + 1e-6), "normal's length"),
    "a point beside the line": ("contacts", moved_point, "contact point"),
    "a sphere displaced by 3 EPS": ("particles", displaced, "motion"),
    "a velocity": ("particles", at("vy", lambda v: v * (1 + 1e-9)), "velocity"),
    "a velocity that is not a number": ("particles", at("vy", lambda v: np.nan), "not a number"),
    "a force that no contact gave": (
        "particles",
        at("f_before[2]", lambda f: f * (1 + 1e-9)),
        "force added to a sphere",
    ),
    "a number of contacts": (
        "particles",
        at("f_contact[1]", lambda n: n + 1),
        "contacts of a sphere",
    ),
    "a number of walls": ("particles", at("f_contact[2]", lambda n: n - 1), "walls of a sphere"),
    "a sum of forces": ("particles", at("f_contact[4]", lambda f: f * 1.001), "force on a sphere"),
    "a virial": ("particles", at("c_stress[2]", lambda s: s * 1.001), "virial of a sphere"),
}


def changed(good: Good, into: Path) -> Path:
    folder = into / "changed"
    shutil.copytree(good.folder, folder)
    return folder


def tolerance(good: Good) -> float:
    found = re.search(r"@part 1 eps (\S+)|@part 01 eps (\S+)", good.screen)
    assert found
    return float(found.group(1) or found.group(2))


@pytest.mark.parametrize("name", FALSIFIED)
def test_a_falsified_dump(name: str, spheres: Good, tmp_path: Path) -> None:
    kind, change, expected = FALSIFIED[name]
    folder = changed(spheres, tmp_path)
    given = dump(folder, kind, CONTACTS if kind == "contacts" else "")
    change(given, tolerance(spheres))
    given.write()
    assert expected in kinds(check(folder, spheres.facts, spheres.screen))


def largest_cluster(folder: Path) -> list[int]:
    """Rows of the spheres that contacts connect in the last frame, by hand."""
    given = dump(folder, "contacts", CONTACTS)
    pairs = [{int(one), int(other)} for one, other in given.frames[-1][:, :2] if other > 0]
    clusters: list[set[int]] = []
    for pair in pairs:
        joined = [cluster for cluster in clusters if cluster & pair]
        clusters = [cluster for cluster in clusters if not cluster & pair]
        clusters.append(pair.union(*joined))
    # The dump is sorted by the numbers, which begin with 1.
    largest = max(clusters, key=lambda cluster: len(cluster))
    return [number - 1 for number in sorted(largest)]


def stop(folder: Path, rows: list[int], part: float, apart: float = 0.0) -> None:
    """Let spheres have one velocity in the last step: a part of their momentum along x and z.

    The velocities before it stay what they are. That of a sphere without walls is larger by a part
    `apart`.
    """
    given, h = dump(folder, "particles"), SETTINGS["timestep"]
    v = [given.of(name) for name in ("vx", "vy", "vz")]
    force = [given.of(name) for name in ("fx", "fy", "fz")]
    outer = [given.of(f"f_before[{k}]") for k in (1, 2, 3)]
    spheres = given.frames[-1][rows]
    mass = spheres[:, [given.of("mass")]]
    earlier = spheres[:, v] - 0.5 * h * spheres[:, force] / mass
    momentum = (mass * earlier + h * spheres[:, outer]).sum(axis=0)
    later = np.tile(part * momentum * [1, 0, 1] / mass.sum(), (len(rows), 1))
    inside = np.flatnonzero(spheres[:, given.of("f_contact[2]")] == 0)
    later[inside[0]] *= 1 + apart
    spheres[:, v] = 0.5 * (earlier + later)
    spheres[:, force] = mass * (later - earlier) / h
    given.frames[-1][rows] = spheres
    given.write()


STOPPED = {
    "a cluster goes on as it did": ((1.0,), set()),
    "a cluster is slower by 1e-9": ((1 - 1e-9,), {"momentum of a cluster"}),
    "a cluster stands still": ((0.0,), {"momentum of a cluster"}),
    "a sphere is faster than its cluster": (
        (1.0, 1e-6),
        {"force added to a sphere", "momentum of a cluster"},
    ),
}


@pytest.mark.parametrize("name", STOPPED)
def test_what_is_stopped_keeps_the_momentum_of_its_cluster(
    name: str, on_a_floor: Good, tmp_path: Path
) -> None:
    """Along x and z, where no wall holds the cluster; along y its momentum may be taken away."""
    how, expected = STOPPED[name]
    assert check(on_a_floor.folder, on_a_floor.facts, on_a_floor.screen).problems == []
    folder = changed(on_a_floor, tmp_path)
    rows = largest_cluster(folder)
    assert len(rows) > 2
    stop(folder, rows, *how)
    found = kinds(check(folder, on_a_floor.facts, on_a_floor.screen))
    assert found & {"force added to a sphere", "momentum of a cluster"} == expected


def test_a_grain_that_flies_is_stopped(on_a_floor: Good, tmp_path: Path) -> None:
    """Only its momentum tells: what stands still may be held, and have forces of no contact."""
    folder = changed(on_a_floor, tmp_path)
    given = dump(folder, "particles")
    touching = given.frames[-1][:, [given.of("f_contact[1]"), given.of("f_contact[2]")]]
    assert touching[-1].tolist() == [0, 0]
    stop(folder, [len(touching) - 1], 0.0)
    found = kinds(check(folder, on_a_floor.facts, on_a_floor.screen))
    assert found == {"momentum of a cluster"}


def test_a_push_that_is_kept(tmp_path: Path) -> None:
    """Two spheres are deep in one another; when they no longer are, one is faster."""
    folder = tmp_path / "pushed"
    points = [[0.2, 1.0, 0.2], [0.26, 1.0, 0.2]]
    good = ran(scene(points, RADIUS, folder, fixes=STORED, **SETTINGS), False, folder)
    facts = good.facts | {"bad_start": True}
    report = check(folder, facts, good.screen)
    assert report.problems == []
    assert report.seen["ends of pushing"] == 1
    assert "overlap at the start" in kinds(check(folder, good.facts, good.screen))
    _, thermo = read_thermo(good.screen)[1]
    overlaps = [thermo[step]["f_contact[4]"] for step in sorted(thermo)]
    parted = next(k for k, overlap in enumerate(overlaps) if overlap <= 2 * EPS)
    given = dump(folder, "particles")
    given.frames[parted][0, given.of("fx")] *= 1.001
    given.write()
    assert "push kept" in kinds(check(folder, facts, good.screen))


BODY_CHANGES = {
    "momentum of a body": ("vy", 1 + 1e-9),
    "angular momentum of a body": ("angmomx", 1 + 1e-7),
    "mass of a body": ("mass", 1.001),
}


@pytest.mark.parametrize("expected", BODY_CHANGES)
def test_a_falsified_body(expected: str, of_bodies: Good, tmp_path: Path) -> None:
    column, factor = BODY_CHANGES[expected]
    folder = changed(of_bodies, tmp_path)
    given = dump(folder, "bodies", BODY_COLUMNS)
    at(column, lambda value: value * factor)(given, 0.0)
    given.write()
    assert expected in kinds(check(folder, of_bodies.facts, of_bodies.screen))


def thermo_changed(good: Good, column: str) -> str:
    """The screen with the largest value of a column, in the first part, a thousandth larger."""
    lines = good.screen.splitlines()
    begin = next(k for k, line in enumerate(lines) if re.match(r"@part 0?1 ", line))
    header = next(k for k in range(begin, len(lines)) if re.match(r"\s*Step\b", lines[k]))
    index = lines[header].split().index(column)
    end = next(k for k in range(header, len(lines)) if lines[k].startswith("Loop time"))
    size = len(lines[header].split())
    rows = [k for k in range(header + 1, end) if len(lines[k].split()) == size]
    row = max(rows, key=lambda k: abs(float(lines[k].split()[index])))
    fields = lines[row].split()
    fields[index] = f"{float(fields[index]) * 1.001:.17g}"
    lines[row] = " ".join(fields)
    return "\n".join(lines)


def test_falsified_thermo_output(spheres: Good) -> None:
    for column, expected in (
        ("f_contact[4]", "reported overlap"),
        ("f_contact[5]", "contacts in all"),
        ("f_contact[6]", "wall contacts in all"),
        ("c_press[2]", "virial"),
        ("Dt", "motion"),
    ):
        report = check(spheres.folder, spheres.facts, thermo_changed(spheres, column))
        assert expected in kinds(report), column
    # The floor is wall 3.
    screen = thermo_changed(spheres, "f_contact[3][2]")
    assert "force on a wall" in kinds(check(spheres.folder, spheres.facts, screen))


def test_a_smaller_tolerance_is_not_met(spheres: Good) -> None:
    """Gaps under a force, and overlaps, are within EPS, and not within a thousandth of it."""
    eps = tolerance(spheres)
    screen = re.sub(
        r"@part (\d+) eps \S+",
        lambda found: f"@part {found.group(1)} eps {eps / 1000}",
        spheres.screen,
    )
    found = kinds(check(spheres.folder, spheres.facts, screen))
    assert found >= {"complementarity", "overlap with a wall"}, found


def test_walls_that_are_somewhere_else(spheres: Good) -> None:
    facts = json.loads(json.dumps(spheres.facts))
    for shape in facts["shapes"]:
        shape["faces"] = [
            [low + 0.1 * spheres.facts["smallest"], high] for low, high in shape["faces"]
        ]
    found = kinds(check(spheres.folder, facts, spheres.screen))
    assert {"reported overlap", "overlap with a wall"} & found


SHAPES: list[dict[str, Any]] = [
    {"kind": "block", "faces": [[0, 1], [0, 2], [-1, 1]]},
    {"kind": "prism", "faces": [[0, 1], [0, 2], [-1, 1]], "tilt": [0.3, -0.2, 0.5]},
    {"kind": "sphere", "centre": [0.2, 0.4, 0.1], "radius": 0.8},
    {"kind": "cylinder", "axis_name": "y", "centre": [0.3, 0.1], "radius": 0.5, "ends": [0, 1.5]},
    {"kind": "cone", "axis_name": "x", "centre": [0.3, 0.1], "radii": [0.7, 0.2], "ends": [0, 1]},
    {"kind": "cone", "axis_name": "z", "centre": [0.3, 0.1], "radii": [0, 0.6], "ends": [0, 1]},
]


@pytest.mark.parametrize("number", range(len(SHAPES)))
@pytest.mark.parametrize(
    "motion", [{}, {"velocity": [0.1, 0, 0.3]}, {"turn": 0.7, "axis": [1, 1, 0]}]
)
def test_shapes(number: int, motion: dict[str, Any]) -> None:
    """From outside, the point found is of the solid, and no other is nearer (it is convex)."""
    random = np.random.default_rng(number)
    time = 1.3
    inside = {**SHAPES[number], **motion, "inside": True, "number": 1}
    outside = {**inside, "inside": False}
    points = random.uniform(-1.5, 2.5, (3000, 3))
    depth = np.min([view.distance for view in views(inside, points, time)], axis=0)
    (view,) = views(outside, points, time)
    solid = depth >= 0
    assert solid.sum() > 10
    assert view.distance[solid].max() <= 1e-12  # round-off
    found = (points - view.distance[:, None] * view.normal)[~solid]
    depth_found = np.min([view.distance for view in views(inside, found, time)], axis=0)
    assert depth_found == pytest.approx(0, abs=1e-12)  # round-off
    others = points[solid][None] - found[:, None]
    assert (others * view.normal[~solid][:, None]).sum(axis=2).max() <= 1e-12  # round-off


# Obstacles, and the least radius of curvature of their walls.
OBSTACLES = {
    "sphere": ({"kind": "sphere", "centre": [0.0] * 3, "radius": 1.0}, 1.0),
    "cylinder": (
        {"kind": "cylinder", "axis_name": "z", "centre": [0.0, 0.0], "ends": [-9.0, 9.0],
         "radius": 1.0},
        1.0,
    ),
    "cone": (
        {"kind": "cone", "axis_name": "y", "centre": [0.0, 0.0], "ends": [-1.0, 1.0],
         "radii": [1.5, 0.2]},
        0.0,
    ),
    "block": ({"kind": "block", "faces": [[-1.0, 1.0]] * 3}, 0.0),
}  # fmt: skip


@pytest.mark.parametrize("name", OBSTACLES)
def test_what_passes_an_obstacle_parts_faster_than_its_gap_has_grown(name: str) -> None:
    """By up to h v^2 / d, as the page of the laws says of pairs and of obstacles."""
    parameters, curvature = OBSTACLES[name]
    shape = parameters | {"inside": False, "number": 1}
    random = np.random.default_rng(7)
    size, steps = 0.5, np.linspace(0, 1, 21)
    start, motion = random.uniform(-3, 3, (2, 20000, 3))
    paths = start[None] + steps[:, None, None] * motion[None]
    away = np.array([views(shape, points, 0.0)[0].distance for points in paths])
    # Those that touch nothing before the end, where their gap is small.
    passing = (away > size).all(axis=0) & (away[-1] < size + 0.3)
    end = views(shape, paths[-1], 0.0)[0]
    opening = (end.normal * motion).sum(axis=1)
    excess = (opening - (end.distance - size))[passing]
    speed = np.linalg.norm(motion, axis=1)[passing]
    bound = speed**2 / (away.min(axis=0)[passing] + curvature)
    parting = opening[passing] > 0
    assert parting.sum() > 20
    assert (excess <= bound)[parting].all()
    assert excess[parting].max() > 0


def test_answers() -> None:
    facts = {
        "shorten": True, "closing": False, "bad_start": False, "spread": 1.0, "warn": False,
        "words": [], "pull": 1.0, "tightest": 1e-3, "smallest": 1.0,
    }  # fmt: skip
    reach = "ERROR: Fix inelastic: step 3: spheres move ... further than the neighbour list reaches"

    def said(status: int | None, screen: str) -> str:
        return finding(Answer(status, screen, 1.0), facts)

    assert said(0, "@end\n") == ""
    assert "hangs" in said(None, "")
    assert "crash" in said(-11, "Step 0")
    assert "sanitizer" in said(1, "==1==ERROR: AddressSanitizer: heap-buffer-overflow")
    assert "no scene should meet" in said(1, "ERROR: Non-numeric positions")
    assert "does not fit" in said(1, reach)
    facts["shorten"] = False
    assert said(1, reach) == ""
    assert "two different" in said(1, reach + "\nERROR: another\n")
    lost = "ERROR: Lost atoms: original 6 current 0"
    unsolved = "WARNING: Fix inelastic: step 0: 5000 iterations left a gap short by 11.5\n"
    assert "no scene should meet" in said(1, unsolved + lost)
    facts["warn"] = True
    assert "no scene should meet" in said(1, lost)
    assert said(1, unsolved + lost) == ""
    for _, condition in REFUSALS:
        assert condition(facts) in (True, False)


def test_another_number_of_ranks_than_drawn(tmp_path: Path) -> None:
    """A grid that was drawn for two ranks is no finding on one."""
    drawn = random_scene(700027)
    assert drawn.ranks == 2
    assert "\nprocessors " in drawn.deck
    verdict = judge(700027, tmp_path / "scene", installed(), ranks=1)
    assert verdict is not None
    assert (verdict.ranks, verdict.problems) == (1, [])
