"""From one integer to one scene: a deck, a data file, a number of ranks, and what is known of it.

Of a scene the checker needs what no dump holds: the shapes of the walls, which sphere types are
frozen or outside of the fix's group (2 and 3), the inertia of the bodies, and the keywords.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.helpers.bodies import BENT, BODY_STYLE, ROD, TETRAHEDRON, dimer
from tests.random_scenes.scene_walls import AXES, FloatArray, Shape, moves, views

# Acceleration of a unit of mass by a unit of force, and pressure of a unit of energy per volume
# (LAMMPS's update.cpp: ftm2v, nktv2p).
UNITS = {
    "lj": (1.0, 1.0),
    "si": (1.0, 1.0),
    "cgs": (1.0, 1.0),
    "micro": (1.0, 1.0),
    "nano": (1.0, 1.0),
    "real": (1 / 48.88821291**2, 68568.415),
    "metal": (1 / 1.0364269e-4, 1.6021765e6),
    "electron": (0.937582899, 2.94210108e13),
}
# Of a place for a sphere or a body.
TRIALS = 100
# Seeds below draw no unequal grains: those that have found something stay the scenes that they are.
UNEQUAL_FROM = 5_000_000
# A part of the seeds from there on, and how unequal their grains are at most.
UNEQUAL = 0.2
MASS_RATIO, SIZE_RATIO = 1e4, 20.0
# A fifth of the default: where there is room most steps need far fewer.
ITERATIONS = "maxiter 20000"
FREE, FROZEN, OUTSIDE, CREATED = 1, 2, 3, 4
CONTACTS = "id1 id2 x y z nx ny nz gap force"
BODY_COLUMNS = "mol mass x y z vx vy vz angmomx angmomy angmomz"
WALLS_OF_KIND = {"block": 6, "prism": 6, "cylinder": 3, "cone": 3, "sphere": 1, "plane": 1}


@dataclass
class Scene:
    """One scene.

    Attributes
    ----------
    seed : makes it again
    deck, data : the input script and the data file `spheres.data` that it reads
    files : other files that the deck needs: name -> text
    ranks : how many MPI processes
    words : what it is, for the summary
    facts : what the checker needs; JSON can hold it
    """

    seed: int
    deck: str
    data: str
    files: dict[str, str]
    ranks: int
    words: list[str]
    facts: dict[str, Any]

    def write(self, folder: Path) -> None:
        """Write all that is needed to run and check it again."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "deck.in").write_text(self.deck)
        (folder / "spheres.data").write_text(self.data)
        (folder / "scene.json").write_text(json.dumps(self.facts, indent=1))
        for name, text in self.files.items():
            (folder / name).write_text(text)


def numbers(*values: float) -> str:
    """Text that gives the same doubles again."""
    return " ".join("INF" if np.isinf(v) else f"{float(v):.17g}" for v in values)


def computes(bodies: bool, walls: int) -> list[str]:
    """Commands for what the checker reads, after all fixes; `walls` is their number."""
    lines = ["compute stress all stress/atom NULL fix", "compute press all pressure NULL fix"]
    if bodies:
        # What remains is the virial of the contacts.
        lines.append("fix_modify bodies virial no")
        lines.append(f"compute of_bodies bodies rigid/local bodies {BODY_COLUMNS}")
    columns = "step time dt vol " + " ".join(f"c_press[{k}]" for k in range(1, 7))
    columns += "".join(f" f_contact[{k}]" for k in range(1, 12))
    for wall in range(1, walls + 1):
        columns += "".join(f" f_contact[{wall}][{k}]" for k in (1, 2, 3))
    lines += ["thermo 1", f"thermo_style custom {columns}"]
    return [*lines, "thermo_modify norm no lost error flush yes format float %.17g"]


def redump(bodies: bool) -> str:
    """The file `redump.in`: the next part begins, with dumps of its own."""
    columns = "id type mol" if bodies else "id type"
    columns += " x y z vx vy vz fx fy fz radius mass f_before[1] f_before[2] f_before[3]"
    columns += "".join(f" f_contact[{k}]" for k in range(1, 6))
    columns += "".join(f" c_stress[{k}]" for k in range(1, 7))
    rows = " ".join(f"f_contact[{k}]" for k in range(1, 11))
    lines = [
        "next part",
        'print "@part ${part} eps ${eps}"',
        f"dump particles all custom 1 particles.${{part}}.dump {columns}",
        "dump_modify particles sort id format float %.17g",
        f"dump contacts all local 1 contacts.${{part}}.dump {rows}",
        "dump_modify contacts format float %.17g",
    ]
    names = ["particles", "contacts"]
    if bodies:
        lines.append("dump bodies all local 1 bodies.${part}.dump c_of_bodies[*]")
        lines.append("dump_modify bodies format float %.17g")
        names.append("bodies")
    undump = [f'if "$(is_defined(dump,{name}))" then "undump {name}"' for name in names]
    return "\n".join([*undump, *lines]) + "\n"


def random_scene(seed: int, *, crowded: bool = False) -> Scene:
    """Draw a scene; a `crowded` one is a periodic box of 300 spheres, with more ghosts than that.

    One in which not a single sphere finds a place is drawn again.
    """
    for attempt in range(100):
        with suppress(NoPlaceError):
            return SceneDraw(seed, attempt, crowded).scene()
    raise NoPlaceError


class NoPlaceError(Exception):
    """No sphere fits between the walls."""


@dataclass
class _Spheres:
    x: FloatArray
    v: FloatArray
    w: FloatArray
    r: FloatArray
    density: FloatArray
    kind: list[int]
    molecule: list[int]


@dataclass
class SceneDraw:
    """The drawing of one scene, from the outside inwards."""

    seed: int
    attempt: int = 0
    crowded: bool = False
    words: list[str] = field(default_factory=list)
    sizes: dict[str, int] = field(default_factory=dict)
    shapes: list[Shape] = field(default_factory=list)
    regions: list[tuple[str, list[str]]] = field(default_factory=list)
    walls: int = 0
    # 1 where they are not drawn.
    mass_ratio: float = 1.0
    size_ratio: float = 1.0

    def __post_init__(self) -> None:
        self.random = np.random.default_rng([self.seed, self.attempt])
        # What makes grains unequal is drawn apart from all else, so that scenes without it do not
        # depend on it.
        self.unequal = np.random.default_rng([self.seed, self.attempt, 3])

    # --- chances

    def chance(self, probability: float) -> bool:
        return bool(self.random.random() < probability)

    def log(self, low: float, high: float) -> float:
        return float(10 ** self.random.uniform(low, high))

    def one(self, *of: Any) -> Any:
        return of[self.random.integers(len(of))]

    def direction(self) -> FloatArray:
        v = self.random.normal(size=3)
        return np.asarray(v / np.linalg.norm(v))

    def note(self, word: str) -> None:
        if word not in self.words:
            self.words.append(word)

    # --- the whole

    def scene(self) -> Scene:
        self.units = self.one(*UNITS) if self.chance(0.3) else "lj"
        self.note(self.units)
        self.radius = self.log(-2, 1)
        self.gravity = self.log(-1, 2)
        self.density = self.log(-1, 1)
        self.shorten = self.chance(0.5)
        time = np.sqrt(self.radius / self.gravity)
        size = self.random.random()
        if not self.shorten:
            size = min(size, 0.9)
        # Mostly a fraction of the time in which a sphere falls by its radius; tiny and huge ones.
        self.timestep = time * (
            self.log(-1.5, 0)
            if size < 0.8
            else self.log(-5, -2)
            if size < 0.9
            else self.log(0, 1.5)
        )
        self.bodies = self.chance(0.35)
        self.inertia = self.one("point", "solid") if self.bodies else None
        self.solver = "uzawa" if self.chance(0.1) else self.ours()
        self.spread = self.one(1.0, 1.0, 1.05, 2.0, 5.0, 20.0)
        if self.bodies:
            self.spread = min(self.spread, 3.0)
        self.draw_ratios()
        most = 1.3 if self.solver == "uzawa" else 2.4
        self.count = int(self.log(0.3, most)) if self.chance(0.5) else int(self.log(1, most))
        if self.mass_ratio * self.size_ratio > 1.0:
            # One grain alone is equal to itself.
            self.count = max(self.count, 3)
        self.smallest = self.radius / self.spread
        self.tolerance = self.smallest * self.log(-4 if self.solver == "uzawa" else -8, -2)
        self.bad = self.chance(0.15)
        self.periodic = [self.chance(0.35) for _ in range(3)]
        if self.crowded:
            self.count, self.periodic, self.solver = 300, [True] * 3, self.ours()
            self.spread, self.bad = 1.0, False
            self.tolerance = self.radius * self.log(-5, -3)
        self.draw_units()
        self.draw_space()
        self.place()
        self.start_tolerance = self.tolerance
        self.draw_commands()
        self.draw_timeline()
        return self.finished()

    # --- what is to be placed

    def draw_ratios(self) -> None:
        """Ratios of masses, at one size, and of diameters: of the first, of the second, or both."""
        if self.seed < UNEQUAL_FROM or self.crowded or self.unequal.random() >= UNEQUAL:
            return
        of_masses, of_sizes = [(True, False), (False, True), (True, True)][self.unequal.integers(3)]
        if of_masses:
            self.mass_ratio = float(MASS_RATIO ** self.unequal.uniform(0.25, 1))
        if of_sizes:
            self.size_ratio = float(SIZE_RATIO ** self.unequal.uniform(0.25, 1))
            self.spread = self.size_ratio

    def part_of_radius(self, count: int) -> FloatArray:
        """Radii, as parts of the largest, of units or of the spheres of one."""
        uniform = self.random.uniform(1 / self.spread, 1.0, count)
        if self.size_ratio == 1.0:
            return uniform
        # By the logarithm: as many are small as large.
        return np.asarray(self.size_ratio ** -self.unequal.random(count))

    def densities(self, count: int) -> FloatArray:
        """Of each sphere: between two limits, or one of two substances."""
        part = self.unequal.random(count)
        if self.unequal.random() < 0.5:
            part = np.round(part)
        return np.asarray(self.density * self.mass_ratio ** (part - 0.5))

    def draw_units(self) -> None:
        """Spheres and bodies: radii and offsets of each."""
        self.to_place: list[tuple[FloatArray, FloatArray]] = []
        placed = 0
        while placed < self.count:
            radius = self.radius * float(self.part_of_radius(1)[0])
            if self.spread > 4 and not self.to_place:
                radius = self.radius
            shape = np.zeros((1, 3))
            if self.bodies and self.chance(0.8):
                shape = self.one(
                    dimer(1.5), dimer(2.0), dimer(1 + self.log(-3, -0.3)), TETRAHEDRON, ROD, BENT
                )
            radii = np.full(len(shape), radius)
            offsets = 2 * radius * (shape - shape.mean(axis=0))
            if len(shape) > 1 and self.spread > 1 and self.chance(0.5):
                radii = radius * self.part_of_radius(len(shape))
                if self.size_ratio > 1.0:
                    # A part of a part may be smaller than the ratio tells.
                    radii = np.maximum(radii, self.radius / self.size_ratio)
                self.note("bodies of several radii")
            if self.inertia == "point":
                # Each needs a group and a fix of its own.
                palette = self.radius * np.geomspace(1 / self.spread, 1.0, 5)
                place = palette[np.abs(palette[:, None] - radii).argmin(axis=0)]
                offsets = offsets * (float(place.max() / radii.max()))
                radii = place
            self.to_place.append((offsets, radii))
            placed += len(shape)
        # The largest first: they find room.
        self.to_place.sort(key=lambda unit: -float(unit[1].max()))
        self.extent = max(
            float((np.linalg.norm(offsets, axis=1) + radii).max())
            for offsets, radii in self.to_place
        )
        self.smallest = min(float(radii.min()) for _, radii in self.to_place)
        self.largest = max(float(radii.max()) for _, radii in self.to_place)
        self.tolerance = min(self.tolerance, 0.3 * self.smallest)
        self.skin = self.largest * self.log(-0.7, 0.5)
        if self.chance(0.1):
            self.skin = self.largest * self.log(0.5, 1.0)
        if any(len(radii) > 1 for _, radii in self.to_place):
            self.note(f"bodies {self.inertia}")
        else:
            self.bodies, self.inertia = False, None
        self.arm = max(float(np.linalg.norm(offsets, axis=1).max()) for offsets, _ in self.to_place)
        # Twice the largest distance from a centre of mass, which is not the centroid where radii
        # differ.
        if not self.shorten:
            # Else the run ends at once, as documented; now and then it may.
            self.skin = max(self.skin, self.largest * float(self.random.uniform(0.5, 3)))
            if not self.chance(0.1):
                self.skin = max(self.skin, 6 * self.gravity * self.timestep**2)
        self.ghosts = 2 * self.largest + self.skin + (4.1 * self.arm if self.bodies else 0.0)

    # --- walls

    def draw_space(self) -> None:
        volume = sum(4 / 3 * np.pi * float((radii**3).sum()) for _, radii in self.to_place)
        volume /= self.random.uniform(0.05, 0.4)
        aspect = np.exp(self.random.normal(0, 0.4, 3))
        size = aspect * (volume / aspect.prod()) ** (1 / 3)
        least = 2.6 * self.extent
        size = np.maximum(size, least)
        for axis in range(3):
            if self.periodic[axis]:
                # Narrower ones let a sphere meet another one twice: now and then.
                room = 2.3 if self.chance(0.1) and not self.bodies else 4.5
                size[axis] = max(size[axis], room * self.largest)
                if self.bodies:
                    size[axis] = max(size[axis], 2.05 * self.ghosts)
        widest = float(np.where(self.periodic, size, np.inf).min())
        if self.skin > widest and not self.bodies:
            # Thousands of images of every sphere; steps as long as that are shortened.
            self.skin, self.shorten = widest, True
            self.ghosts = 2 * self.largest + self.skin
        origin = self.random.uniform(-3, 3, 3) * self.radius if self.chance(0.5) else np.zeros(3)
        self.low, self.high = origin, origin + size
        self.closing = False
        self.open_sides = False
        self.draw_container()
        self.draw_obstacles()
        if not self.shapes:
            self.note("no walls")
        for axis in range(3):
            if self.periodic[axis]:
                self.note("periodic")
        self.flags = ["p" if p else "f" for p in self.periodic]
        for axis in range(3):
            if self.flags[axis] == "f" and (self.open_sides or self.chance(0.15)):
                self.flags[axis] = self.one("s", "m") if self.open_sides else "s"
                self.note("shrink-wrapped")
        self.random.shuffle(self.regions)
        self.number_walls()

    def number_walls(self) -> None:
        """Numbers count on in the order of the list."""
        at = 1
        for _, names in self.regions:
            for shape in self.shapes:
                if shape["region"] == names[0]:
                    shape["number"] = at + shape["offset"]
            at += self.sizes[names[0]]
        self.walls = at - 1

    def add(self, name: str, commands: list[str], shapes: list[Shape], size: int) -> None:
        """Add a region of the fix's list; `offset` of each shape: its number in the region."""
        self.sizes[name] = size
        self.regions.append(("\n".join(commands), [name]))
        for shape in shapes:
            shape["region"] = name
            self.shapes.append(shape)

    def command(self, name: str, shape: Shape, motion: str = "") -> str:
        """The region command of a shape."""
        kind = shape["kind"]
        if kind == "block":
            words = numbers(*np.ravel(shape["faces"]))
        elif kind == "prism":
            words = numbers(*np.ravel(shape["faces"]), *shape["tilt"])
        elif kind == "sphere":
            words = numbers(*shape["centre"], shape["radius"])
        elif kind == "plane":
            words = numbers(*shape["through"], *shape["normal"])
        else:
            radii = shape["radii"] if kind == "cone" else [shape["radius"]]
            words = f"{shape['axis_name']} {numbers(*shape['centre'], *radii, *shape['ends'])}"
        side = "in" if shape["inside"] else "out"
        self.note(f"{kind} {side}")
        return f"region {name} {kind} {words} side {side} units box {motion}".rstrip()

    def single(self, name: str, shape: Shape, motion: bool = True) -> None:
        """Add a region of one shape, perhaps moving."""
        lines: list[str] = []
        text = ""
        if motion and self.chance(0.25):
            lines, text = self.motion(name, shape)
        command = self.command(name, shape, text)
        shape["offset"] = 0
        size = WALLS_OF_KIND[shape["kind"]]
        self.add(name, [*lines, command], [shape], size)

    def motion(self, name: str, shape: Shape) -> tuple[list[str], str]:
        """Let a shape move, along directions that are not periodic only."""
        h = self.timestep
        kinds = ["swing", "velocity"]
        if not any(self.periodic) and shape["kind"] != "plane":
            kinds += ["turn", "both"]
        kind = self.one(*kinds)
        if all(self.periodic):
            return [], ""
        may = np.array([0.0 if p else 1.0 for p in self.periodic])
        direction = self.direction() * may
        self.closing = True
        lines, words = [], ""
        formulae = ["", "", ""]
        self.note(f"wall {kind if kind != 'both' else 'turn'}")
        if kind in ("swing", "both"):
            shape["swing"] = list(direction * self.smallest * self.log(-2.5, 0))
            shape["period"] = h * float(self.random.uniform(8, 80))
            for axis in range(3):
                formulae[axis] += (
                    f"+({numbers(shape['swing'][axis])})*sin(2*PI*time/{numbers(shape['period'])})"
                )
        if kind == "velocity":
            shape["velocity"] = list(direction * self.smallest / h * self.log(-3.5, -1))
            for axis in range(3):
                formulae[axis] += f"+({numbers(shape['velocity'][axis])})*time"
        if formulae[0]:
            for axis in range(3):
                lines.append(f"variable {name}{AXES[axis]} equal 0.0{formulae[axis]}")
            words += "move " + " ".join(f"v_{name}{a}" for a in AXES)
        if kind in ("turn", "both"):
            middle = (self.low + self.high) / 2
            reach = float(np.linalg.norm(self.high - self.low))
            shape["turn"] = 0.2 * self.smallest / reach / h * float(self.random.uniform(-1, 1))
            axis_of_turn = self.direction() if self.chance(0.5) else np.eye(3)[self.one(0, 1, 2)]
            shape["axis"], shape["point"] = list(axis_of_turn), list(middle)
            lines.append(f"variable {name}t equal {numbers(shape['turn'])}*time")
            words += f" rotate v_{name}t {numbers(*middle, *axis_of_turn)}"
        return lines, words

    def faces(self) -> list[list[float]]:
        return [
            [-np.inf, np.inf] if self.periodic[a] else [float(self.low[a]), float(self.high[a])]
            for a in range(3)
        ]

    def planes(self, leave_out: tuple[int, int] | None) -> None:
        """A plane for every face that is not periodic, each a region of its own."""
        for axis in range(3):
            for side in range(2):
                if self.periodic[axis] or (axis, side) == leave_out:
                    continue
                through, normal = (self.low + self.high) / 2, np.zeros(3)
                through[axis] = (self.low, self.high)[side][axis]
                normal[axis] = 1.0 - 2.0 * side
                shape = {"kind": "plane", "through": list(through), "normal": list(normal)}
                self.single(f"p{axis}{side}", {**shape, "inside": True})

    def draw_container(self) -> None:
        number = sum(self.periodic)
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        if number == 3:
            return
        kinds = ["block", "block", "planes", "tray"]
        if number == 1:
            kinds += ["cylinder"]
        if number == 0:
            kinds += ["sphere", "cylinder", "cone", "prism", "lens", "list"]
        kind = self.one(*kinds)
        inside = {"inside": True}
        if kind == "tray":
            # A floor and three sides: open above; LAMMPS's box follows the spheres.
            axis = self.one(*[a for a in range(3) if not self.periodic[a]])
            self.open_sides = True
            self.note("open container")
            self.planes((axis, 1))
        elif kind == "planes":
            self.planes(None)
        elif kind == "block":
            self.single("box", {"kind": "block", "faces": self.faces(), **inside})
        elif kind in ("cylinder", "cone"):
            axis = self.periodic.index(True) if number else self.one(0, 1, 2)
            others = [a for a in range(3) if a != axis]
            radius = float(half[others].max())
            for a in others:
                # The container must lie in what becomes LAMMPS's box.
                self.low[a], self.high[a] = middle[a] - radius, middle[a] + radius
            ends = [-np.inf, np.inf] if number else [float(self.low[axis]), float(self.high[axis])]
            shape: Shape = {"kind": kind, "axis_name": AXES[axis], "ends": ends, **inside}
            shape["centre"] = [float(middle[a]) for a in others]
            if kind == "cone":
                radii = [radius, radius * float(self.random.uniform(0, 1))]
                shape["radii"] = radii if self.chance(0.5) else radii[::-1]
                if self.chance(0.1):
                    shape["radii"] = [0.0, radius]
            else:
                shape["radius"] = radius
            self.single("drum", shape)
        elif kind == "sphere":
            radius = float(half.max()) * 1.1
            self.low, self.high = middle - radius, middle + radius
            self.single(
                "ball", {"kind": "sphere", "centre": list(middle), "radius": radius, **inside}
            )
        elif kind == "prism":
            tilt = [float(t) for t in self.random.uniform(-0.4, 0.4, 3) * half[[0, 0, 1]]]
            faces = self.faces()
            self.single("leaning", {"kind": "prism", "faces": faces, "tilt": tilt, **inside})
            # What leans over lies in the box, too.
            self.low = self.low - np.abs(tilt).sum()
            self.high = self.high + np.abs(tilt).sum()
        else:
            # The common part of two spheres, or of a block and a sphere.
            block: Shape = {"kind": "block", "faces": self.faces(), **inside}
            ball: Shape = {"kind": "sphere", "radius": float(half.max()) * 1.25, **inside}
            ball["centre"] = list(middle + 0.2 * half * self.random.uniform(-1, 1, 3))
            other: Shape = {**ball, "centre": list(middle - 0.2 * half)}
            parts = [block, ball] if self.chance(0.5) else [ball, other]
            if parts[0] is ball:
                # LAMMPS's box holds both balls, which reach further than a flat box.
                self.low, self.high = middle - 1.5 * half.max(), middle + 1.5 * half.max()
            if kind == "list":
                for k, part in enumerate(parts):
                    self.single(f"part{k}", part, motion=False)
                return
            self.note("intersect")
            commands, at = [], 0
            for k, part in enumerate(parts):
                part["offset"] = at
                at += WALLS_OF_KIND[part["kind"]]
                commands.append(self.command(f"part{k}", part))
            commands.append(f"region lens intersect {len(parts)} part0 part1")
            self.add("lens", commands, parts, at)

    def draw_obstacles(self) -> None:
        """Convex solids inside of the box, clear of periodic sides."""
        clear = self.largest + self.skin + 2 * self.arm
        low = self.low + [clear if p else 0.0 for p in self.periodic]
        high = self.high - [clear if p else 0.0 for p in self.periodic]
        if (high <= low).any() or not self.chance(0.35):
            return
        found: list[Shape] = []
        for _ in range(self.one(1, 1, 2, 3)):
            size = self.smallest * self.log(-0.5, 0.8)
            size = min(size, float((high - low).min()) / 3)
            centre = self.random.uniform(low + size, high - size)
            kind = self.one("sphere", "block", "cylinder", "cone", "prism")
            shape: Shape = {"kind": kind, "inside": False}
            if kind == "sphere":
                shape |= {"centre": list(centre), "radius": size}
            elif kind in ("block", "prism"):
                half = size * self.random.uniform(0.2, 1, 3)
                shape["faces"] = [
                    [float(c - a), float(c + a)] for c, a in zip(centre, half, strict=True)
                ]
                if kind == "prism":
                    shape["tilt"] = [float(t) for t in self.random.uniform(-0.2, 0.2, 3) * size]
            else:
                axis = self.one(0, 1, 2)
                shape["axis_name"] = AXES[axis]
                shape["centre"] = [float(centre[a]) for a in range(3) if a != axis]
                shape["ends"] = [float(centre[axis] - size), float(centre[axis] + size)]
                if kind == "cone":
                    shape["radii"] = [size, size * float(self.random.uniform(0, 1))]
                else:
                    shape["radius"] = size * float(self.random.uniform(0.2, 1))
            found.append(shape)
        self.note("obstacles")
        for k, shape in enumerate(found):
            self.single(f"o{k}", shape)

    # --- places

    def place(self) -> None:
        """One after the other at random, where there is room; those that find none are left out."""
        x = np.empty((0, 3))
        r = np.empty(0)
        kinds: list[int] = []
        molecules: list[int] = []
        depth = self.log(-2.5, -0.2) if self.bad else 0.0
        period = np.where(self.periodic, self.high - self.low, np.inf)
        wide = np.where(np.isfinite(period), period, 0.0)
        frozen = self.chance(0.2)
        outside = self.chance(0.08)
        for shape in self.shapes:
            shape.setdefault("number", 1)
        self.overlapping = False
        misses = 0
        for offsets, radii in self.to_place:
            trials = self.trials(offsets)
            gaps = self.gaps_at_walls(trials, radii)
            if len(x):
                away = trials[:, :, None] - x
                away -= np.rint(away / period) * wide
                apart = np.linalg.norm(away, axis=3) / (radii[:, None] + r) - 1
                gaps = np.minimum(gaps, apart.min(axis=(1, 2)))
            fits = np.flatnonzero(gaps >= -depth)
            if not len(fits):
                misses += 1
                if misses > 10:
                    break
                continue
            trial, gap = trials[fits[0]], gaps[fits[0]]
            x, r = np.vstack([x, trial]), np.concatenate([r, radii])
            body = len(radii) > 1
            self.overlapping = self.overlapping or gap < 0
            molecules += [max(molecules, default=0) + 1 if body else 0] * len(radii)
            kind = FREE
            if not body and frozen and self.chance(0.2):
                kind = FROZEN
            elif not body and outside and self.chance(0.3):
                kind = OUTSIDE
            kinds += [kind] * len(radii)
        if not len(x):
            raise NoPlaceError
        if self.overlapping:
            self.note("bad start")
        density = np.full(len(x), self.density)
        if self.chance(0.3):
            density *= 10 ** self.random.uniform(-1.5, 1.5, len(x))
            self.note("densities differ")
        numbers_of = np.array(molecules, dtype=int)
        self.has_bodies = bool(numbers_of.any())
        if self.bodies and not self.has_bodies:
            self.bodies, self.inertia = False, None
        if self.mass_ratio > 1.0:
            density = self.densities(len(x))
            self.note("mass ratio")
        if self.size_ratio > 1.0:
            self.note("size ratio")
        speed = np.sqrt(self.gravity * self.radius) * self.log(-1, 0.7)
        if not self.shorten and not self.chance(0.05):
            speed = min(speed, 0.1 * self.skin / self.timestep)
        elif self.chance(0.1):
            speed = self.radius / self.timestep * float(self.random.uniform(0.1, 3))
            self.note("fast")
        if self.chance(0.2):
            speed = 0.0
        v = self.random.normal(size=x.shape) * speed
        if self.chance(0.2):
            v += self.direction() * speed * 3
        w = np.zeros_like(x)
        for molecule in range(1, numbers_of.max(initial=0) + 1):
            mine = numbers_of == molecule
            mass = density[mine] * r[mine] ** 3
            centre = mass @ x[mine] / mass.sum()
            spin = self.random.normal(size=3) * speed / self.radius
            if self.chance(0.1):
                spin *= 5
            v[mine] = v[mine][0] + np.cross(spin, x[mine] - centre)
            w[mine] = spin
        still = np.isin(kinds, (FROZEN, OUTSIDE))
        v[still] = 0.0
        self.frozen = FROZEN in kinds
        self.outside = OUTSIDE in kinds
        self.frozen_moves = ""
        if self.frozen:
            self.note("frozen")
            if self.chance(0.4):
                self.frozen_moves = self.one("nve", "move")
                self.frozen_velocity = self.direction() * self.smallest / self.timestep * 0.1
                v[np.array(kinds) == FROZEN] = self.frozen_velocity
                self.note("frozen moving")
                self.closing = True
                if self.frozen_moves == "move":
                    # Fix move counts steps, not time.
                    self.shorten = False
        if self.outside:
            self.note("outside of the group")
        self.spheres = _Spheres(x, v, w, r, density, kinds, molecules)
        if self.has_bodies and 0 in molecules:
            self.note("bodies and free spheres")

    def trials(self, offsets: FloatArray) -> FloatArray:
        """Some places and orientations of a body, (trials, spheres, 3)."""
        turns = Rotation.from_quat(self.random.normal(size=(TRIALS, 4))).as_matrix()
        turned = np.einsum("tab,sb->tsa", turns, offsets)
        return np.asarray(turned + self.random.uniform(self.low, self.high, (TRIALS, 1, 3)))

    def gaps_at_walls(self, trials: FloatArray, radii: FloatArray) -> FloatArray:
        """The smallest gap of each trial at a wall, in radii of the sphere."""
        gaps = np.full(len(trials), np.inf)
        for shape in self.shapes:
            for view in views(shape, trials.reshape(-1, 3), 0.0):
                gap = view.distance.reshape(len(trials), -1) / radii - 1
                gaps = np.minimum(gaps, gap.min(axis=1))
        return gaps

    # --- commands

    def draw_commands(self) -> None:
        """Everything that is set again after a restart."""
        to_force = 1 / UNITS[self.units][0]
        mass = 4 / 3 * np.pi * self.spheres.density * self.spheres.r**3
        lightest = float(mass.min(initial=1.0))
        self.forces: list[str] = []
        if self.chance(0.85):
            direction = self.direction() if self.chance(0.3) else np.array([0, -1.0, 0])
            if any(self.periodic) and not all(self.periodic) and not self.chance(0.1):
                # Else all spheres fall for ever, faster and faster.
                direction = np.where(self.periodic, 0.0, direction + 1e-3)
            pull = numbers(self.gravity * to_force)
            self.forces.append(f"fix gravity mobile gravity {pull} vector {numbers(*direction)}")
        if self.chance(0.2):
            strength = self.gravity * self.log(-1, 1)
            self.forces.append(
                f"fix agitation mobile random/force {numbers(strength)} {self.one(5, 77, 12345)}"
            )
            self.note("random force")
        if self.chance(0.2):
            drag = lightest / self.timestep * float(self.random.uniform(0, 0.3)) * to_force
            self.forces.append(f"fix drag mobile viscous {numbers(drag)}")
            self.note("drag")
        if self.chance(0.1):
            push = self.direction() * lightest * self.gravity * to_force
            self.forces.append(f"fix push mobile addforce {numbers(*push)}")
            self.note("addforce")
        self.random.shuffle(self.forces)
        self.ranks = 2 if self.chance(0.4) else 1
        if self.ranks == 2:
            self.note("two ranks")
        self.setup: list[str] = []
        if self.chance(0.3) or (self.crowded and self.seed % 2):
            self.setup.append("newton off")
            self.note("newton off")
        widths = [w for w, p in zip(self.high - self.low, self.periodic, strict=True) if p]
        # LAMMPS: such a box must be wider than the cutoff.
        tiled = self.chance(0.25) and min(widths, default=np.inf) > 1.01 * self.ghosts
        if tiled:
            self.setup.append("comm_style tiled")
            self.note("tiled")
        elif self.ranks == 2 and self.chance(0.5):
            self.setup.append(f"processors {self.one('2 1 1', '1 2 1', '1 1 2')}")
        balance = ""
        if self.chance(0.2):
            balance = "rcb" if tiled else f"shift {self.one('x', 'y', 'z', 'xyz')} 10 1.0"
            self.note("balance")
        self.map = self.one("array", "hash")
        sort = self.one("", "", "atom_modify sort 0 0.0", f"atom_modify sort {self.one(1, 7)} 0.0")
        if sort:
            self.setup.append(sort)
        largest = 2 * self.largest
        lines = [text for text, _ in self.regions]
        soft = not self.frozen_moves and not self.outside and self.chance(0.08)
        if soft:
            self.note("pair forces")
            energy = lightest * self.gravity * self.radius * to_force
            lines += [f"pair_style soft {numbers(largest)}", f"pair_coeff * * {numbers(energy)}"]
        else:
            lines += [f"pair_style zero {numbers(largest)}", "pair_coeff * *"]
        list_style = self.one(*["bin"] * 17, "nsq", "nsq", "multi")
        if "s" in self.flags or "m" in self.flags or self.skin > 200 * self.largest:
            # LAMMPS makes no bins in a box that few spheres have shrunk, or far wider than it.
            list_style = "nsq"
        lines.append(f"neighbor {numbers(self.skin)} {list_style}")
        often = self.one(
            *["delay 0 every 1 check yes"] * 4,
            "delay 10 every 1 check yes",
            "delay 0 every 5 check yes",
            "delay 0 every 3 check no",
            "delay 0 every 1 check no",
        )
        lines.append(f"neigh_modify {often}")
        if self.chance(0.1) or self.skin > 2 * self.largest:
            # Narrow periodic boxes show the same spheres many times.
            lines.append("neigh_modify one 20000 page 400000")
        if self.chance(0.1) and list_style == "bin":
            width = (largest + self.skin) * float(self.random.uniform(0.3, 1.5))
            lines.append(f"neigh_modify binsize {numbers(width)}")
        if self.has_bodies or self.chance(0.15):
            lines.append(f"comm_modify cutoff {numbers(1.001 * self.ghosts)}")
        lines.append("timestep ${step}")
        lines += [f"group frozen type {FROZEN}", f"group outside type {OUTSIDE}"]
        still = "frozen outside"
        if self.has_bodies:
            lines.append("group bodies molecule > 0")
            still += " bodies"
            if self.chance(0.5):
                lines.append("neigh_modify exclude molecule/intra bodies")
        lines += ["group mobile subtract all frozen outside", f"group free subtract all {still}"]
        lines.append(f"group grains type {FREE} {FROZEN} {CREATED}")
        lines += self.forces
        nve = self.one("nve", "nve", "nve/sphere")
        motion = [f"fix motion free {nve}"]
        if self.frozen_moves == "nve":
            motion.append("fix carry frozen nve")
        elif self.frozen_moves == "move":
            lines.append(f"velocity frozen set {numbers(*self.frozen_velocity)} units box")
            motion.append(
                f"fix carry frozen move linear {numbers(*self.frozen_velocity)} units box"
            )
        set_up: list[str] = []
        if self.has_bodies:
            definition, set_up = self.rigid()
            motion += definition
        # Without free spheres the fix may be defined before point masses are set up.
        self.contact_first = 0 not in self.spheres.molecule and self.chance(0.5)
        lines += motion
        if balance:
            lines.append(f"fix balance all balance {self.one(3, 7)} 1.0 {balance}")
        contact = ["fix before all store/force", self.contact()]
        lines += [*contact, *set_up] if self.contact_first else [*set_up, *contact]
        lines += computes(self.has_bodies, self.walls)
        self.settings = "\n".join(lines) + "\n"

    def contact(self) -> str:
        words = []
        if self.regions:
            names = [name for _, names in self.regions for name in names]
            words.append("region " + " ".join(names))
        if self.has_bodies:
            words.append(f"rigid bodies {self.inertia}")
        if self.frozen:
            words.append("frozen frozen")
        if self.shorten:
            words.append("shorten yes")
            self.note("shorten")
        if self.solver == "uzawa":
            words.append("solver uzawa")
            self.note("uzawa")
        self.warn = self.solver == "uzawa" or self.chance(0.15)
        if self.warn:
            words.append(f"maxiter {self.one(500, 5000, 20000)} warn")
            self.note("warn")
        group = "grains" if self.outside else "all"
        words += self.law()
        self.random.shuffle(words)
        if not self.warn:
            # A step that needs more ends the run, with a line that is allowed, within the minute.
            words.append(ITERATIONS)
        if self.solver == "apgd":
            # After the shuffle, which with one more to shuffle would change what is drawn below.
            words.append("solver apgd")
            self.note("apgd")
        return f"fix contact {group} inelastic ${{eps}} {' '.join(words)}"

    def ours(self) -> str:
        """A solver of ours, drawn apart from all else, so that scenes do not depend on it."""
        random = np.random.default_rng([self.seed, self.attempt, 2])
        return "apgd" if random.random() < 0.25 else "sweeps"

    def law(self) -> list[str]:
        """The contact law, drawn apart from all else, so that scenes do not depend on it."""
        random = np.random.default_rng([self.seed, self.attempt, 1])
        kind = random.choice(["inelastic", "gluey", "restitution"], p=[0.6, 0.2, 0.2])
        if kind == "inelastic":
            return []
        self.note(f"law {kind}")
        if kind == "restitution":
            return [f"law restitution {random.choice([0.0, 0.5, 0.9, 1.0])}"]
        limit = 10.0 ** random.uniform(-9, 0)
        return [random.choice(["law gluey", f"law gluey limit {limit:.3g}"])]

    def rigid(self) -> tuple[list[str], list[str]]:
        """The commands that define the bodies, and those that set up point masses, a run 0."""
        if self.inertia == "solid":
            return ["fix bodies bodies rigid/small molecule"], []
        lines = ["thermo_style custom step", "set group bodies diameter 0"]
        lines.append("fix bodies bodies rigid/small molecule reinit no")
        ends = ["run 0"]
        sizes = np.array(self.spheres.r)
        members = np.array(self.spheres.molecule) > 0
        for k, size in enumerate(np.unique(sizes[members])):
            ids = " ".join(map(str, np.flatnonzero(members & (sizes == size)) + 1))
            lines += [f"group size{k} id {ids}", f"variable size{k} equal {numbers(2 * size)}"]
            lines += [f"fix grow{k} size{k} adapt 0 atom diameter v_size{k} mass no"]
            ends += [f"unfix grow{k}", f"group size{k} delete"]
        return lines, ends

    # --- runs and what comes between them

    def draw_timeline(self) -> None:
        self.body: list[str] = []
        step = 0
        steps = int(self.random.integers(5, 40))
        moving = any(moves(shape) for shape in self.shapes) or self.frozen_moves == "move"
        files = 0
        parts = self.one(1, 1, 2, 3, 4)
        # Whether LAMMPS may go on without setting up again.
        ready = False
        for part in range(parts):
            length = max(1, steps // parts)
            last = part + 1 == parts
            way = self.random.random()
            # Speed that pushes point masses apart is known to a fix that was there before them.
            midway = not last and way < 0.15 and (self.inertia != "point" or self.contact_first)
            at = step + int(self.random.integers(1, length + 1))
            if midway:
                self.body.append(f"restart {at} mid.*.restart")
            if ready and way > 0.5:
                self.body.append(f"run {length} pre no")
                self.note("pre no")
                every = False
            else:
                self.body.append("include redump.in")
                every = 0.15 < way < 0.35
                if every:
                    each = max(1, length // 3)
                    self.body.append(f'run {length} every {each} "include redump.in"')
                    self.note("run every")
                else:
                    self.body.append(f"run {length}")
            step += length
            ready = not every
            if last:
                break
            if midway:
                self.read("restart", f"mid.{at}.restart")
                self.note("restart within a run")
                step, ready = at, False
                continue
            what = self.one(
                *("nothing", "nothing", "tolerance", "timestep", "velocity", "restart"),
                *("data", "create", "delete", "again", "balance", "renumber", "order"),
            )
            if self.has_bodies and what in ("velocity", "create", "delete", "renumber"):
                what = "nothing"
            if self.inertia == "point" and what == "again":
                what = "nothing"
            if what == "nothing":
                continue
            ready = False
            if what == "tolerance":
                self.tolerance *= self.log(-3, 1)
                self.tolerance = min(max(self.tolerance, 1e-8 * self.smallest), 0.3 * self.smallest)
                if self.solver == "uzawa":
                    self.tolerance = max(self.tolerance, 1e-4 * self.smallest)
                self.body.append(f"variable eps string {numbers(self.tolerance)}")
                self.body.append("fix_modify contact tolerance ${eps}")
                self.note("tolerance changed")
            elif what == "timestep" and self.frozen_moves != "move":
                factor = self.log(-0.7, 0.7 if self.shorten else 0.1)
                self.body.append(f"variable step string {numbers(self.timestep * factor)}")
                self.body.append("timestep ${step}")
                self.note("timestep changed")
            elif what == "velocity":
                speed = numbers(*(self.direction() * np.sqrt(self.gravity * self.radius)))
                self.body.append(f"velocity free set {speed} sum yes units box")
                self.note("velocity changed")
            elif what == "restart":
                files += 1
                self.body.append(f"write_restart between{files}.restart")
                self.read("restart", f"between{files}.restart")
                self.note("restart")
            elif what == "data" and not moving:
                files += 1
                masses = "\n".join(f"mass {k} 1.0" for k in range(1, 5)) + "\n"
                masses = masses if self.has_bodies else ""
                self.body.append(f"{masses}write_data between{files}.data nocoeff")
                self.read("data", f"between{files}.data")
                step = 0
                self.note("data file")
            elif what == "create":
                place = self.random.uniform(self.low, self.high)
                diameter = numbers(2 * self.random.uniform(self.smallest, self.largest))
                self.body += [
                    f"create_atoms {CREATED} single {numbers(*place)} units box",
                    f"set type {CREATED} diameter {diameter}",
                    f"set type {CREATED} density {numbers(self.density)}",
                    f"group free type {CREATED}",
                    f"group mobile type {CREATED}",
                    f"group grains type {CREATED}",
                ]
                self.note("created")
                self.created = True
            elif what == "delete":
                compress = self.one("yes", "no")
                self.body.append(
                    f"delete_atoms random fraction 0.3 yes free NULL {self.one(1, 2, 3)} "
                    f"compress {compress}"
                )
                self.note("deleted")
            elif what == "again":
                self.body += ["unfix contact", self.contact_again()]
                self.note("defined again")
            elif what == "balance":
                self.body.append(
                    "balance 1.0 rcb"
                    if "comm_style tiled" in self.setup
                    else "balance 1.0 shift x 10 1.0"
                )
                self.note("balance")
            elif what == "renumber":
                self.body.append("reset_atoms id")
                self.note("renumbered")

    def contact_again(self) -> str:
        return next(line for line in self.settings.splitlines() if line.startswith("fix contact"))

    def read(self, kind: str, name: str) -> None:
        self.body += [
            'print "@between"',
            "clear",
            self.head(),
            f"read_{kind} {name}",
            self.settings.rstrip(),
        ]

    # --- the files

    def style(self) -> str:
        return BODY_STYLE if self.has_bodies else "atom_style sphere"

    def head(self) -> str:
        lines = [f"units {self.units}", self.style(), f"atom_modify map {self.map}"]
        flags = self.flags
        if len(self.spheres.r) == 1:
            # LAMMPS itself can end in a box that shrinks to a point, with and without our fix.
            flags = ["m" if flag == "s" else flag for flag in flags]
        lines += [f"boundary {' '.join(flags)}", *self.setup]
        return "\n".join(lines)

    def finished(self) -> Scene:
        deck = "\n".join(
            [
                f"# random scene {self.seed}: {', '.join(self.words)}",
                "variable part loop 0 99 pad",
                f"variable eps string {numbers(self.start_tolerance)}",
                f"variable step string {numbers(self.timestep)}",
                self.head(),
                "read_data spheres.data",
                self.settings.rstrip(),
                *self.body,
                'print "@end"',
            ]
        )
        to_v, to_pressure = UNITS[self.units]
        facts = {
            "seed": self.seed,
            "words": self.words,
            "ranks": self.ranks,
            "acceleration_of_force": to_v,
            "pressure_of_energy": to_pressure,
            "periodic": self.periodic,
            "shapes": self.shapes,
            "timestep": self.timestep,
            "walls": self.walls,
            "inertia": self.inertia,
            "solver": self.solver,
            "warn": self.warn,
            "shorten": self.shorten,
            "bad_start": self.bad_start_possible(),
            "closing": self.closing,
            "spread": float(self.largest / self.smallest),
            "smallest": self.smallest,
            "pull": self.gravity * self.timestep**2,
            "tightest": min(self.start_tolerance, self.tolerance),
            "largest": self.largest,
        }
        return Scene(
            self.seed,
            deck + "\n",
            self.data(),
            {"redump.in": redump(self.has_bodies)},
            self.ranks,
            self.words,
            _plain(facts),
        )

    def bad_start_possible(self) -> bool:
        return self.overlapping or any(
            word in self.words for word in ("tolerance changed", "created")
        )

    def data(self) -> str:
        of = self.spheres
        lines = ["# random scene", "", f"{len(of.x)} atoms", "4 atom types", ""]
        margin = np.array([0.0 if p else 1.0 for p in self.periodic]) * (
            6 * self.largest + (self.high - self.low)
        )
        margin = margin * (5 if self.closing else 1)
        for axis, name in enumerate(AXES):
            low, high = self.low[axis] - margin[axis], self.high[axis] + margin[axis]
            lines.append(f"{numbers(low, high)} {name}lo {name}hi")
        lines += ["", "Atoms", ""]
        for k, (x, r, density) in enumerate(zip(of.x, of.r, of.density, strict=True)):
            size = numbers(2 * r, density)
            line = (
                f"{k + 1} {of.kind[k]} {numbers(*x)} {size} {of.molecule[k]}"
                if self.has_bodies
                else f"{k + 1} {of.kind[k]} {size} {numbers(*x)}"
            )
            lines.append(line)
        lines += ["", "Velocities", ""]
        for k, (v, w) in enumerate(zip(of.v, of.w, strict=True)):
            lines.append(f"{k + 1} {numbers(*v, *w)}")
        return "\n".join(lines) + "\n"


def _plain(value: Any) -> Any:
    """The same without NumPy's numbers, which JSON does not know."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value
