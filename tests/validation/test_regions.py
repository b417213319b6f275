"""Regions as walls, judged by geometry of our own: tests/wall_patches.py, nothing of LAMMPS's.

Grains of several sizes are driven onto the faces, the edges and the rims of a region and along
them. In every step the overlap of each with each patch of the wall is at most two tolerances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.lammps_run import Run, run_lmp
from tests.helpers.scenes import (
    DUMP_FORCES,
    DUMP_PARTICLES,
    FloatArray,
    deepest_pair,
    read_dump,
    scene,
)
from tests.helpers.wall_patches import (
    AXES,
    REST,
    SAMPLES,
    Motion,
    Part,
    Plane,
    Side,
    Sphere,
    Wall,
    cone,
    plane,
    prism,
    sphere,
)

pytestmark = pytest.mark.validation

EPS = 1e-5
STEP, STEPS = 0.002, 400
# Grains in and about open regions are shaken in all directions: acceleration
SHAKE, SHAKE_STEPS = 20.0, 600
RADII = (0.08, 0.12)
SLACK = 1 + 1e-6  # round-off of positions
ALLOWED = 2 * EPS * SLACK  # what the documentation promises of curved walls
START_GAP = 0.01  # at the start, of grains from patches and from one another
# Nearer than the tolerance to the wall, with as much of overlap: it touches
TOUCHES = 2 * EPS
INSIDE = 12  # grains in a region with open faces, at the start
WALL_SPEED = 2.5  # of moving and turning walls, at most
TOUCHED = 40  # grains times steps, at least
EVERY = 50  # of the steps in which the edges of joined walls are looked at


@dataclass(frozen=True)
class Scene:
    """A wall, the commands that make it, and how the grains are driven.

    Attributes
    ----------
    commands : define the region named wall
    wall : the same by our own geometry
    steps : how long it runs
    centre : of the driving forces, three lengths
    pull : towards the centre (away from it if negative), acceleration / length
    swirl : about an axis through the centre, acceleration / length
    shake : acceleration whose direction goes round
    size : grains start within this distance of the origin along each axis, length
    grains : at most so many
    untouched : so many patches no grain need reach, by default one in three: they may be in the lee
    rims : whether grains must have been on rims or edges
    pushed_beyond : from inside an open region LAMMPS shows a flat face beyond its edges, where the
        next one is open and slanting away: grains are held by nothing there
    """

    commands: str
    wall: Wall
    steps: int = STEPS
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pull: float = 12.0
    swirl: tuple[float, float, float] = (2.0, 3.5, 1.5)
    shake: float = 0.0
    size: float = 1.1
    grains: int = 24
    untouched: int | None = None
    rims: bool = False
    pushed_beyond: bool = False


def moved(motion: Motion) -> tuple[str, str]:
    """Return the variables of a motion, and the keywords of a region that has it."""
    lines, words = "", ""
    if any(motion.swing):
        for name, swing in zip("xyz", motion.swing, strict=True):
            lines += f"variable to{name} equal {swing}*sin({motion.frequency}*time)\n"
        words += " move v_tox v_toy v_toz"
    if motion.rate:
        lines += f"variable turned equal {motion.rate}*time\n"
        words += " rotate v_turned " + " ".join(str(x) for x in (*motion.point, *motion.axis))
    return lines, words


def words(part: Part, open_faces: Sequence[int] = ()) -> str:
    """Return the keywords of a region."""
    side = " side out" if part.outside else ""
    return side + "".join(f" open {face}" for face in open_faces) + moved(part.motion)[1]


@dataclass(frozen=True)
class Shape:
    """A region command and its parts by our own geometry."""

    command: str
    part: Part

    def defined(self, name: str) -> str:
        """Return the commands that define it."""
        style, _, rest = self.command.partition(" ")
        return f"{moved(self.part.motion)[0]}region {name} {style} {rest} units box\n"


def numbers(*values: object) -> str:
    """Return all numbers of nested sequences."""
    return " ".join(f"{x:g}" for value in values for x in np.ravel(np.asarray(value, dtype=float)))


def block(
    faces: Sequence[Sequence[float]] = ((-0.6, 0.5), (-0.45, 0.6), (-0.5, 0.55)),
    *,
    open_faces: Sequence[int] = (),
    outside: bool = False,
    motion: Motion = REST,
) -> Shape:
    part = prism(faces, open_faces=open_faces, outside=outside, motion=motion)
    return Shape(f"block {numbers(faces)}{words(part, open_faces)}", part)


def tilted(
    tilt: Sequence[float] = (0.3, -0.2, 0.25),
    faces: Sequence[Sequence[float]] = ((-0.6, 0.5), (-0.5, 0.6), (-0.5, 0.55)),
    *,
    open_faces: Sequence[int] = (),
    outside: bool = False,
    motion: Motion = REST,
) -> Shape:
    part = prism(faces, tilt, open_faces=open_faces, outside=outside, motion=motion)
    return Shape(f"prism {numbers(faces, tilt)}{words(part, open_faces)}", part)


def half_space(normal: Sequence[float], *, outside: bool = False, motion: Motion = REST) -> Shape:
    part = plane((0.05, -0.1, 0.1), normal, outside=outside, motion=motion)
    return Shape(f"plane {numbers((0.05, -0.1, 0.1), normal)}{words(part)}", part)


def ball(
    radius: float = 0.6,
    centre: Sequence[float] = (0.05, -0.05, 0.1),
    *,
    outside: bool = False,
    motion: Motion = REST,
) -> Shape:
    part = sphere(centre, radius, outside=outside, motion=motion)
    return Shape(f"sphere {numbers(centre, radius)}{words(part)}", part)


def tube(
    axis: str,
    radius: float = 0.5,
    ends: Sequence[float] = (-0.6, 0.5),
    centre: Sequence[float] = (0.05, -0.05),
    *,
    open_faces: Sequence[int] = (),
    outside: bool = False,
    motion: Motion = REST,
) -> Shape:
    part = cone(
        axis, centre, (radius,) * 2, ends, open_faces=open_faces, outside=outside, motion=motion
    )
    command = f"cylinder {axis} {numbers(centre, radius, ends)}{words(part, open_faces)}"
    return Shape(command, part)


def funnel(
    axis: str,
    radii: Sequence[float] = (0.65, 0.3),
    ends: Sequence[float] = (-0.6, 0.6),
    centre: Sequence[float] = (0.05, -0.05),
    *,
    open_faces: Sequence[int] = (),
    outside: bool = False,
    motion: Motion = REST,
) -> Shape:
    part = cone(axis, centre, radii, ends, open_faces=open_faces, outside=outside, motion=motion)
    command = f"cone {axis} {numbers(centre, radii, ends)}{words(part, open_faces)}"
    return Shape(command, part)


FAR = (-50.0, 50.0)
SOON = 200  # steps: before grains that are driven along a wall without an end leave the box


def endless(shape: Shape) -> Shape:
    """Write faces beyond the box as INF."""
    return replace(shape, command=shape.command.replace("-50", "INF").replace("50", "INF"))


def alone(shape: Shape, **options: Any) -> Scene:
    """Return a scene with one region: grains inside are driven outwards, others inwards."""
    wall = Wall((shape.part,))
    drive: dict[str, Any]
    if shape.part.has_open_faces:  # through the open faces both ways, and along the rims
        middle = np.mean([places.mean(axis=0) for places in wall.samples()], axis=0)
        drive = {"centre": tuple(middle), "grains": 32}
        if len(wall.parts[0].patches) == 1 and not isinstance(shape.part.patches[0], Side):
            drive |= {"rims": True}  # drawn to the middle of one sheet, and off its rim
        else:
            drive |= {"shake": SHAKE, "steps": SHAKE_STEPS}
    elif shape.part.outside or isinstance(shape.part.patches[0], Plane):
        drive = {"rims": not isinstance(shape.part.patches[0], Plane | Sphere)}
    else:
        drive = {"pull": -12.0}
    return replace(Scene(shape.defined("wall"), wall), **drive | options)


def joined(how: str, *shapes: Shape, outside: bool = False, **options: Any) -> Scene:
    """Return a scene with a union or an intersection."""
    names = [f"part{k}" for k in range(len(shapes))]
    lines = [shape.defined(name) for name, shape in zip(names, shapes, strict=True)]
    side = " side out" if outside else ""
    lines.append(f"region wall {how} {len(shapes)} {' '.join(names)}{side}\n")
    wall = Wall(tuple(shape.part for shape in shapes), how, outside)
    pull = 12.0 if outside else -12.0
    return replace(Scene("".join(lines), wall, pull=pull), **options)


def name_of(open_faces: Sequence[int]) -> str:
    return "-open-" + "".join(map(str, open_faces))


CAPS = ((1,), (2,), (1, 2))
SIDES = ((3,), (1, 3), (2, 3))
# Displaced by 0.2 at speeds up to 1, turned by a radian about an axis beside the centre
SWINGS = Motion(swing=(0.15, -0.1, 0.12), frequency=5.0)
TURNS = Motion(rate=1.3, axis=(1.0, 2.0, -1.0), point=(0.1, 0.0, -0.1))
BOTH = replace(SWINGS, rate=-1.1, axis=(2.0, -1.0, 1.0), point=(0.0, 0.1, 0.1))
MOTIONS = {"swings": SWINGS, "turns": TURNS, "swings-and-turns": BOTH}


def scenes() -> dict[str, Scene]:
    """All regions that must work."""
    found: dict[str, Scene] = {}
    for side, outside in (("in", False), ("out", True)):
        found[f"block-{side}"] = alone(block(outside=outside))
        found[f"prism-{side}"] = alone(tilted((0, 0, 0), outside=outside))
        found[f"tilted-prism-{side}"] = alone(tilted(outside=outside))
        found[f"far-tilted-prism-{side}"] = alone(tilted((-0.5, 0.4, 0.5), outside=outside))
        found[f"sphere-{side}"] = alone(ball(outside=outside))
        for k, normal in enumerate([(0, 1, 0), (1, 0, -2), (-1, 2, 3)]):
            found[f"plane-{k}-{side}"] = alone(half_space(normal, outside=outside))
        for axis in AXES:
            found[f"cylinder-{axis}-{side}"] = alone(tube(axis, outside=outside))
            found[f"cone-{axis}-{side}"] = alone(funnel(axis, outside=outside))
            found[f"equal-radii-{axis}-{side}"] = alone(funnel(axis, (0.5, 0.5), outside=outside))
        for name, motion in MOTIONS.items():
            more: dict[str, Any] = {"outside": outside, "motion": motion}
            found[f"block-{side}-{name}"] = alone(block(**more))
            found[f"tilted-prism-{side}-{name}"] = alone(tilted(**more))
            found[f"sphere-{side}-{name}"] = alone(ball(**more))
            found[f"plane-{side}-{name}"] = alone(half_space((-1, 2, 3), **more))
            found[f"cylinder-x-{side}-{name}"] = alone(tube("x", **more))
            found[f"cone-y-{side}-{name}"] = alone(funnel("y", **more))
    for faces in (
        (1,),
        (4,),
        (5,),
        (1, 2),
        (5, 6),
        (1, 3),
        (1, 3, 5),
        (1, 2, 3, 4),
        (2, 3, 4, 5, 6),
    ):
        found["block" + name_of(faces)] = alone(block(open_faces=faces))
        found["tilted-prism" + name_of(faces)] = alone(tilted(open_faces=faces), pushed_beyond=True)
    options: dict[str, Any]
    for axis in AXES:
        for faces in CAPS:
            found[f"cylinder-{axis}{name_of(faces)}"] = alone(tube(axis, open_faces=faces))
        for faces in CAPS + SIDES:
            wider = faces in SIDES[:2]
            few = {"untouched": 1} if faces == (3,) else {}
            found[f"cone-{axis}{name_of(faces)}"] = alone(
                funnel(axis, open_faces=faces), pushed_beyond=wider, **few
            )
            equal = funnel(axis, (0.5, 0.5), open_faces=faces)
            found[f"equal-radii-{axis}{name_of(faces)}"] = alone(equal)
        found[f"tip-{axis}-in"] = alone(funnel(axis, (0.0, 0.7)))
        found[f"small-tip-{axis}-out"] = alone(funnel(axis, (1e-6, 0.7), outside=True))
        # The cap without extent is seen as no place at all by LAMMPS if it is not open.
        # So slowly turned that grains stay at the upper tips, too
        slow = {"swirl": (0.5, 0.8, 0.3), "shake": 2.0}
        for end, radii, options in (("", (0.0, 0.7), {}), ("upper-", (0.7, 0.0), slow)):
            found[f"{end}tip-{axis}-out"] = alone(funnel(axis, radii, outside=True), **options)
            for faces in CAPS:
                tip = funnel(axis, radii, open_faces=faces)
                found[f"{end}tip-{axis}{name_of(faces)}"] = alone(tip)
    for name, motion in MOTIONS.items():
        open_block = block(open_faces=(4,), motion=motion)
        found[f"block-open-4-{name}"] = alone(open_block)
        found[f"cylinder-z-open-2-{name}"] = alone(tube("z", open_faces=(2,), motion=motion))
        found[f"cone-y-open-12-{name}"] = alone(funnel("y", open_faces=(1, 2), motion=motion))
        found[f"cone-x-open-3-{name}"] = alone(
            funnel("x", (0.5, 0.5), open_faces=(3,), motion=motion)
        )
        found[f"tip-y-out-{name}"] = alone(funnel("y", (0.0, 0.7), outside=True, motion=motion))
    found |= long_scenes()
    found |= joined_scenes()
    return found


def long_scenes() -> dict[str, Scene]:
    """Regions that reach far beyond the box, and those of them that serve with INF, too."""
    found: dict[str, Scene] = {}
    more: dict[str, Any]
    options: dict[str, Any]
    for side, more in (
        ("in", {}),
        ("out", {"outside": True}),
        ("open-12", {"open_faces": (1, 2)}),
    ):
        # Its caps no grain reaches; grains inside would leave the box.
        options = {"untouched": 0 if side == "open-12" else 2, "rims": False}
        if side == "in":
            options["steps"] = SOON
        found[f"far-cone-{side}"] = alone(funnel("x", (0.5, 0.5), FAR, **more), **options)
        pipe = endless(tube("x", 0.5, FAR, **more))
        found[f"endless-cylinder-{side}"] = alone(pipe, **options)
    slab = (FAR, FAR, (-0.4, 0.4))
    found["far-block-open-5"] = alone(block(slab, open_faces=(5,)), size=1.0, untouched=4)
    across = (FAR, (-0.45, 0.6), (-0.5, 0.55))
    for side, outside in (("in", False), ("out", True)):
        shapes = {
            "far-block": block(across, outside=outside),
            "endless-block": endless(block(across, outside=outside)),
            "far-prism": tilted((0, 0, 0.25), across, outside=outside),
        }
        if not outside:
            shapes["endless-prism"] = endless(tilted((0, 0, 0.25), across))
        for name, shape in shapes.items():
            steps = STEPS if outside else SOON
            found[f"{name}-{side}"] = alone(shape, untouched=2, steps=steps)
    return found


def joined_scenes() -> dict[str, Scene]:
    """Unions and intersections. Where re-entrant edges are, no grain comes near to them."""
    found: dict[str, Scene] = {}
    # Inside an intersection, where no edge is re-entrant
    for name, shapes in {
        "block-and-sphere": (block(), ball(0.65)),
        "cylinder-and-sphere": (tube("x"), ball(0.6)),
        "two-cylinders": (tube("x"), tube("z")),
        "prism-and-cone": (tilted(), funnel("x")),
        "cone-y-and-slot": (funnel("y"), block(((-2, 2), (-2, 2), (-0.125, 0.125)))),
        "cone-y-and-sphere": (funnel("y"), ball(0.65)),
        "cone-and-half-space": (funnel("z"), half_space((1, 2, -1))),
        "turning-block-and-sphere": (block(motion=TURNS), ball(0.65)),
        "turning-cylinder-and-cylinder": (tube("x", motion=BOTH), tube("z")),
    }.items():
        found[f"intersect-{name}"] = joined("intersect", *shapes)
    less = (block(((-0.8, 0.8),) * 3), ball(0.3, outside=True))
    found["intersect-block-less-sphere"] = joined("intersect", *less, pull=4.0, shake=SHAKE)
    # A cylinder and two balls that continue its side
    for k, axis in enumerate(AXES):
        centres = [np.insert([0.05, -0.05], k, end) for end in (-0.6, 0.5)]
        for name, motion in {"": REST, "-swings": SWINGS, "-turns": TURNS}.items():
            balls = [ball(0.5, tuple(centre), motion=motion) for centre in centres]
            capsule = (tube(axis, motion=motion), *balls)
            found[f"union-capsule-{axis}{name}"] = joined("union", *capsule)
            of_cone = (funnel(axis, (0.5, 0.5), (-0.6, 0.5), motion=motion), *balls)
            found[f"union-capsule-of-cone-{axis}{name}"] = joined("union", *of_cone)
    apart = (ball(0.45, (-0.7, 0, 0)), block(((0.1, 1.1), (-0.5, 0.5), (-0.6, 0.5))))
    found["union-apart"] = joined("union", *apart)
    # An obstacle: grains lie on its faces only
    slab = (block(((-3, 3), (-3, -0.2), (-3, 3))), ball(5, (0, 0, 0)))
    found["intersect-obstacle"] = joined("intersect", *slab, outside=True, size=0.6, untouched=6)
    return found


SCENES = scenes()


def start(scene_: Scene, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return centres (n, 3) and radii (n,) of grains that touch nothing."""
    random = np.random.default_rng(seed)
    centres, radii = np.empty((0, 3)), np.empty(0)
    for point in random.uniform(-scene_.size, scene_.size, (4000, 3)):
        radius = random.uniform(*RADII)
        if scene_.wall.allowed(point[None])[0] <= 0:
            continue
        # Of what is open the first grains are inside.
        within = scene_.wall.parts[0].depth(point[None])[0] > 0
        if scene_.wall.parts[0].has_open_faces and not within and len(radii) < INSIDE:
            continue
        nearest = scene_.wall.seen(point[None]).distance.min()
        apart = np.linalg.norm(centres - point, axis=1) - radii
        if min(nearest, *apart, np.inf) < radius + START_GAP:
            continue
        centres, radii = np.vstack([centres, point]), np.append(radii, radius)
        if len(radii) == scene_.grains:
            break
    assert len(radii) >= 5
    return centres, radii


def deck(scene_: Scene, folder: Path, seed: int = 1, only: FloatArray | None = None) -> str:
    """Return a deck up to its `run`; with `only` it has one grain at rest, there."""
    centres, radii = start(scene_, seed) if only is None else (only[None], np.full(1, RADII[1]))
    speed = 0.5 if only is None else 0.0
    w, centre = (scene_.swirl, scene_.centre) if only is None else ((0, 0, 0), (0, 0, 0))
    rounds = {"x": "cos(6*time)", "y": "sin(6*time)", "z": "cos(4*time+1)"}
    away = [f"({name}-({place:.17g}))" for name, place in zip(AXES, centre, strict=True)]
    drive = []
    for name, (i, j) in zip("xyz", ((1, 2), (2, 0), (0, 1)), strict=True):
        turning = f"({w[i]})*{away[j]}-({w[j]})*{away[i]}"
        shake = f"{scene_.shake if only is None else 0}*{rounds[name]}"
        pull = f"({-scene_.pull})*{away[AXES.index(name)]}"
        drive.append(f"variable f{name} atom mass*({pull}+{turning}+{shake})\n")
    return (
        scene(
            centres,
            radii,
            folder,
            tolerance=EPS,
            timestep=STEP,
            velocities=np.random.default_rng(seed + 1).normal(0, speed, centres.shape),
            box=((-5, 5),) * 3,
            gravity=False,
            fixes=f"{scene_.commands}{''.join(drive)}fix drive all addforce v_fx v_fy v_fz\n",
            options="region wall shorten yes",
            thermo="step time f_contact[5] f_contact[6] f_contact[11]",
        )
        + DUMP_PARTICLES
        + DUMP_FORCES
    )


@dataclass(frozen=True)
class Judged:
    """What all steps of a run showed; overlaps in tolerances, touches in grains times steps."""

    overlap: float
    step: int
    grain: int
    patch: int
    of_edges: float
    of_pairs: float
    touches: tuple[int, ...]
    on_rims: int
    # Largest gap of a grain at the end of a step in which a wall pushed it, in what tangent planes
    # may leave
    pushed_from: float

    def __str__(self) -> str:
        return (
            f"overlap {self.overlap:.3f} eps (step {self.step}, grain {self.grain}, patch "
            f"{self.patch}), edges {self.of_edges:.3f} eps, pairs {self.of_pairs:.3f} eps, touches "
            f"{' '.join(map(str, self.touches))}, {self.on_rims} on rims, "
            f"pushed from {self.pushed_from:.2f}"
        )


def judged(scene_: Scene, result: Run) -> Judged:
    """Look at every step."""
    frames = read_dump(result.folder / "particles.dump")
    forces = read_dump(result.folder / "forces.dump")
    times = result.thermo["Time"]
    assert len(frames) == len(forces) == len(times)
    overlap, where = -np.inf, (0, 0, 0)
    of_edges = of_pairs = pushed_from = -np.inf
    touches = np.zeros(sum(len(part.patches) for part in scene_.wall.parts), dtype=int)
    before = frames[0].positions
    on_rims, pushed = 0, np.zeros(len(frames[0].rows), dtype=bool)
    for step, (frame, force, time) in enumerate(zip(frames, forces, times, strict=True)):
        seen = scene_.wall.seen(frame.positions, time)
        gap = seen.distance - frame["radius"]
        if -gap.min() > overlap:
            overlap = float(-gap.min())
            patch, grain = np.unravel_index(int(gap.argmin()), gap.shape)
            where = (step, int(grain) + 1, int(patch) + 1)
        touching = np.abs(gap) <= TOUCHES
        touches += touching.sum(axis=1)
        on_rims += int((touching & seen.rim).sum())
        of_pairs = max(of_pairs, deepest_pair(frame.positions, frame["radius"]))
        if pushed.any():
            moved_by = np.linalg.norm(frame.positions - before, axis=1) + WALL_SPEED * STEP
            # By moving along the plane, away from an edge
            left = np.hypot(frame["radius"], moved_by) - frame["radius"] + ALLOWED
            pushed_from = max(pushed_from, float((gap.min(axis=0) / left)[pushed].max()))
        before = frame.positions
        pushed = force["walls"] > 0
        if len(scene_.wall.parts) > 1 and step % EVERY == 0:
            samples = np.concatenate(scene_.wall.samples(time))
            away = np.linalg.norm(frame.positions[:, None] - samples, axis=2).min(axis=1)
            of_edges = max(of_edges, float((frame["radius"] - away).max()))
    return Judged(
        overlap / EPS,
        *where,
        of_edges / EPS,
        of_pairs / EPS,
        tuple(touches.tolist()),
        on_rims,
        pushed_from,
    )


def assert_sound(scene_: Scene, result: Run, name: str) -> None:
    """No overlap in any step, and all that there is of the wall has been touched."""
    found = judged(scene_, result)
    print(f"{name}: {found}")
    assert found.of_pairs * EPS <= ALLOWED
    assert found.overlap * EPS <= ALLOWED
    assert found.of_edges * EPS <= ALLOWED
    # More than a seam with another part
    shown = [len(places) > SAMPLES**2 / 10 for places in scene_.wall.samples()]
    touched = np.array(found.touches)[shown] > 0
    left_out = len(touched) // 3 if scene_.untouched is None else scene_.untouched
    assert touched.sum() >= len(touched) - left_out
    assert sum(found.touches) >= TOUCHED
    if scene_.rims:
        assert found.on_rims > 0
    if not scene_.pushed_beyond:
        assert found.pushed_from <= 1


@pytest.mark.parametrize("name", SCENES)
def test_no_grain_overlaps_a_patch(name: str, tmp_path: Path) -> None:
    scene_ = SCENES[name]
    result = run_lmp(tmp_path, deck(scene_, tmp_path) + f"run {scene_.steps}\n", timeout=300.0)
    assert_sound(scene_, result, name)


def assert_refused(result: Run, *regions: str) -> None:
    """One line, before the first step, that names the region or a part of it."""
    assert result.status != 0
    assert len(result.errors) == 1, result.screen[-2000:]
    assert any(f"region {region}" in result.errors[0] for region in regions), result.errors
    dump = result.folder / "particles.dump"
    assert not dump.exists() or len(read_dump(dump)) == 0


# LAMMPS does not set the nearest place of a cylinder whose side is open where it is on a rim; loses
# in the round-off of 1e20 where a grain is along a cone, or a face of an open block or a prism.
REFUSED = (
    {
        f"cylinder-{axis}{name_of(faces)}": alone(tube(axis, open_faces=faces))
        for axis in AXES
        for faces in SIDES
    }
    | {
        f"{how}-with-{name}": joined(how, part, ball(0.65))
        for how in ("union", "intersect")
        for name, part in {
            "open-cylinder": tube("x", open_faces=(3,)),
            "endless-cone": endless(funnel("z", (0.5, 0.5), FAR)),
        }.items()
    }
    | {
        f"endless-cone-{axis}-{name}": alone(endless(funnel(axis, (0.5, 0.5), FAR, **options)))
        for axis in AXES
        for name, options in (
            ("in", {}),
            ("out", {"outside": True}),
            ("open-12", {"open_faces": (1, 2)}),
        )
    }
    | {
        "endless-block-open-5": alone(
            endless(block((FAR, FAR, (-0.4, 0.4)), open_faces=(5,))), size=1.0
        ),
        "endless-prism-out": alone(
            endless(tilted((0, 0, 0.25), (FAR, (-0.5, 0.6), (-0.5, 0.55)), outside=True))
        ),
        "prism-without-a-lower-face": alone(
            endless(tilted((0, 0, 0), ((-50, 0.5), (-0.5, 0.6), (-0.5, 0.55))))
        ),
    }
)


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str, tmp_path: Path) -> None:
    text = deck(REFUSED[name], tmp_path) + "run 1\n"
    assert_refused(run_lmp(tmp_path, text, must_pass=False), "wall", "part0")


AXIAL = {
    f"{name}-{axis}": alone(shape(axis))
    for axis in AXES
    for name, shape in {
        "cylinder-out": lambda axis: tube(axis, centre=(0, 0), outside=True),
        "cone-out": lambda axis: funnel(axis, centre=(0, 0), outside=True),
        "cone-out-upwards": lambda axis: funnel(axis, (0.2, 0.6), centre=(0, 0), outside=True),
        "tip-out": lambda axis: funnel(axis, (0.6, 0.0), centre=(0, 0), outside=True),
        "tip-out-upwards": lambda axis: funnel(axis, (0.0, 0.6), centre=(0, 0), outside=True),
        "cone-open-1": lambda axis: funnel(axis, centre=(0, 0), open_faces=(1,)),
        "cone-open-3": lambda axis: funnel(axis, centre=(0, 0), open_faces=(3,)),
        "cylinder-open-1": lambda axis: tube(axis, centre=(0, 0), open_faces=(1,)),
        "sphere-out": lambda axis: ball(0.5, (0, 0, 0), outside=True),
    }.items()
}


@pytest.mark.parametrize("name", AXIAL)
def test_from_an_axis(name: str, tmp_path: Path) -> None:
    """From there no direction to the side is nearest, and LAMMPS divides by zero."""
    along = np.eye(3)[AXES.index(name[-1])]
    text = deck(AXIAL[name], tmp_path, only=along) + f"run {STEPS}\n"
    result = run_lmp(tmp_path, text)
    found = judged(AXIAL[name], result)
    print(f"{name}: {found}")
    assert found.overlap * EPS <= ALLOWED
    assert sum(found.touches) > STEPS / 4
    # Exactly on the axis: nothing has pushed it aside by more than what avoids the division.
    aside = np.cross(read_dump(tmp_path / "particles.dump")[-1].positions[0], along)
    assert np.abs(aside).max() <= 1e-10


GROWING = {
    "sphere": "0 0 0 v_size",
    "cylinder": "z 0 0 v_size -1 1",
    "cone": "z 0 0 v_size v_size -1 1",
}


@pytest.mark.parametrize("outside", [False, True], ids=["in", "out"])
@pytest.mark.parametrize("rate", [-0.1, 0.5])
@pytest.mark.parametrize("style", GROWING)
def test_a_wall_that_grows_or_shrinks(
    style: str, rate: float, outside: bool, tmp_path: Path
) -> None:
    """Its radius is a variable."""
    size = 0.5
    side = "out" if outside else "in"
    command = f"region wall {style} {GROWING[style]} side {side} units box\n"
    wall = ball(size, (0, 0, 0)) if style == "sphere" else tube("z", size, (-1, 1), (0, 0))
    scene_ = Scene(
        f"variable size equal {size}+{rate}*time\n{command}",
        Wall((replace(wall.part, outside=outside),)),
        pull=12.0 if outside else -12.0,
        swirl=(0, 0, 2.0),
        size=0.8,
        grains=24 if outside else 6,  # those inside must have room at the end
    )
    result = run_lmp(tmp_path, deck(scene_, tmp_path) + f"run {STEPS}\n", timeout=300.0)
    touches = 0
    frames = read_dump(tmp_path / "particles.dump")
    for frame, time in zip(frames, result.thermo["Time"], strict=True):
        columns = "x y z" if style == "sphere" else "x y"
        distance = np.linalg.norm(frame.vectors(columns), axis=1) - size - rate * time
        gap = (distance if outside else -distance) - frame["radius"]
        assert gap.min() >= -ALLOWED
        touches += int((gap <= TOUCHES).sum())
    assert touches > STEPS
