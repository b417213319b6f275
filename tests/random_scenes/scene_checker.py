"""Checks what fix inelastic wrote, from the dumps and thermo output alone.

It shares no code with the fix. Between the frames of two steps LAMMPS's leapfrog holds, which makes
momentum exact: with the force F_n of frame n (all forces), the time step h_n (thermo's `dt`, which
the fix may shorten) and the velocity v_n of the whole step,

    V_(n-1/2) = v_n - h_n F_n / 2m
    V_(n+1/2) = v_n + h_n F_n / 2m
    x_(n+1)   = x_n + h_n V_(n+1/2)

and the same for bodies, with their mass and momentum, and with their angular momentum and the
moments of the forces, as `compute rigid/local` gives them. Fix store/force keeps the forces before
the fix. In the first frame of a run v_n has no first half: the fix then projects v_n + h F / 2m.

What pushes a bad start apart is no momentum. Where V_(n+1/2) is more than the kicks by all forces
and the list's contacts give, the rest is that push: there must be none unless something overlaps
by more than 2 EPS.

All forces before the fix are known, and so is what the fix adds: over a step it changes the
momentum of a sphere by h (F - F before), and by nothing else. Of a grain that is not stopped that
is the sum of its contacts. Of a cluster, the grains that contacts with a force connect, it is the
sum of the contacts with walls and frozen spheres, along every direction that none of these has a
part of, whatever is stopped in it. Along the others stopping may take momentum away.
"""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Container, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from tests.random_scenes.scene_generator import BODY_COLUMNS, CONTACTS, FROZEN, OUTSIDE
from tests.random_scenes.scene_walls import Shape, View, moves, turns, views

# Numbers, indices or flags.
Array = NDArray[Any]

# Of lengths and forces that are sums of some terms of that size; doubles have 1.1e-16.
ROUND_OFF = 1e-12
# Of what contacts change: a bound of every target, with the default accuracy.
ACCURACY = 1e-3 / 16
# In EPS. More than this is a bad start for the fix, which knows gaps to round-off as we do.
REGULAR = 2.0
# Dimensions that the spheres of a body need, for forces on them to turn it about every axis.
REAL_TURNING = 2
# [radians] With some room: bodies turn a little faster or slower at the end of a step.
HALF_A_TURN = 3.0
# Of the sum of two radii, the overlap from which bodies are pushed along the line of their centres.
ENTANGLED = 0.05
# Of the sum of two radii, by how much a push opens an overlap at most.
PUSHED = 0.05
# Of the length of a normal at a wall.
NORMAL_AT_WALL = 1e-9
# Contacts hold a direction if their normals have more than such a part along it.
HOLDS = 10 * NORMAL_AT_WALL
# What is at rest may still move along a direction along which they have at most such a part: the
# root of three times what the fix takes for round-off of their squares.
SLIDES = 2e-6


@dataclass
class Report:
    """What was looked at, and what is wrong.

    Attributes
    ----------
    problems : one line each, the first of each kind
    seen : how often something was checked: frames, contacts, pushed frames ...
    """

    problems: list[str] = field(default_factory=list)
    seen: Counter[str] = field(default_factory=Counter)
    _kinds: set[str] = field(default_factory=set)

    def wrong(self, kind: str, where: str, what: str) -> None:
        """Note a problem, once of each kind."""
        self.seen["problems"] += 1
        if kind not in self._kinds:
            self._kinds.add(kind)
            self.problems.append(f"{kind}: {where}: {what}")


@dataclass(frozen=True, eq=False)
class Table:
    """One frame of a dump."""

    step: int
    box: Array
    columns: dict[str, int]
    rows: Array

    def __getitem__(self, names: str) -> Array:
        """One column, or several side by side."""
        wanted = [self.columns[name] for name in names.split()]
        return self.rows[:, wanted[0]] if len(wanted) == 1 else self.rows[:, wanted]


def cross(a: Array, b: Array) -> Array:
    """The vector product; np.cross() takes twenty times as long for a few vectors."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = ay * bz - az * by
    product[..., 1] = az * bx - ax * bz
    product[..., 2] = ax * by - ay * bx
    return product


def numbers_in(lines: list[str]) -> Array:
    """All numbers of some lines; a ValueError where something else is in them."""
    with warnings.catch_warnings():
        # NumPy's fast reader only warns of what is no number, and stops there.
        warnings.simplefilter("error")
        try:
            return np.fromstring(" ".join(lines), sep=" ")
        except DeprecationWarning as error:
            raise ValueError(str(error)) from error


def read_tables(path: Path, names: str = "", steps: Container[int] | None = None) -> list[Table]:
    """Read all whole frames of a text dump, or those of some steps.

    `names` of the columns are in place of those in the file.
    """
    if not path.exists():
        return []
    lines = path.read_text().splitlines()
    found, at = [], 0
    while at + 9 <= len(lines):
        begin, count = at, int(lines[at + 3])
        at += 9 + count
        if at > len(lines):
            break
        step = int(lines[begin + 1])
        if steps is not None and step not in steps:
            continue
        columns = names.split() or lines[begin + 8].split()[2:]
        try:
            rows = numbers_in(lines[begin + 9 : at]).reshape(count, len(columns))
        except ValueError:
            # The last line of a run that was stopped.
            if at < len(lines):
                raise
            break
        box = np.array([line.split()[:2] for line in lines[begin + 5 : begin + 8]], dtype=float)
        found.append(Table(step, box, {name: k for k, name in enumerate(columns)}, rows))
    return found


def read_thermo(screen: str) -> dict[int, tuple[float, dict[int, dict[str, float]]]]:
    """EPS, and the thermo output of each step, of every part that the deck announced."""
    parts: dict[int, tuple[float, dict[int, dict[str, float]]]] = {}
    part, names = 0, None
    for line in screen.splitlines():
        begins = re.match(r"@part (\d+) eps (\S+)", line)
        if begins:
            part = int(begins.group(1))
            parts[part] = (float(begins.group(2)), {})
            names = None
        elif line.startswith("@"):
            part = 0
        elif re.match(r"\s*Step\b", line):
            names = line.split()
        elif line.startswith(("Loop time", "ERROR")):
            names = None
        elif names and part:
            fields = line.split()
            if len(fields) != len(names) or not re.match(r"-?\d+$", fields[0]):
                continue
            values = dict(zip(names, map(float, fields), strict=True))
            parts[part][1][int(fields[0])] = values
    return parts


def read_energy_told(screen: str) -> dict[int, int]:
    """In how many steps of each part collisions added energy, as the summaries of runs count."""
    told: dict[int, int] = {}
    part = 0
    for line in screen.splitlines():
        if begins := re.match(r"@part (\d+) eps", line):
            part = int(begins.group(1))
        elif found := re.match(r"  in (\d+) steps collisions, or bodies that turned far", line):
            told[part] = told.get(part, 0) + int(found.group(1))
    return told


def check(folder: Path, facts: dict[str, Any], screen: str) -> Report:
    """Check all parts of a scene that ran in a folder. See `scene_generator` for the facts."""
    report = Report()
    # The overlaps that steps have left, the last one and each by its number: a part goes on from
    # the last one, or from a restart file of an earlier one.
    left, left_by = 0.0, dict[int, float]()
    energy_told = read_energy_told(screen)
    for number, (tolerance, thermo) in read_thermo(screen).items():
        particles = read_tables(folder / f"particles.{number:02d}.dump")
        contacts = read_tables(folder / f"contacts.{number:02d}.dump", CONTACTS)
        bodies = read_tables(folder / f"bodies.{number:02d}.dump", BODY_COLUMNS)
        begun_with = max(left, left_by.get(particles[0].step, 0.0)) if particles else left
        part = _Part(report, facts, f"part {number}", tolerance, begun_with)
        last: _Frame | None = None
        for k, (table, rows) in enumerate(zip(particles, contacts, strict=False)):
            if table.step != rows.step or table.step not in thermo:
                if table.step != rows.step:
                    report.wrong("frames", part.name, f"steps {table.step} and {rows.step}")
                break
            of_bodies = bodies[k] if k < len(bodies) else None
            if facts["inertia"] and of_bodies is None:
                break
            final = k + 1 == len(particles)
            last = part.frame(table, rows, thermo[table.step], of_bodies, last, final)
            left = last.deepest + last.thermo["f_contact[11]"]
            left_by[last.step] = left
        # Without `shorten` a step may leave more than 2 EPS, which later ones take apart. (The part
        # behind `run every` is empty.)
        part.judge_energy(energy_told.get(number, 0))
    return report


@dataclass(frozen=True, eq=False)
class Clusters:
    """What contacts with a force connect, through bodies, but not through walls, frozen spheres.

    Attributes
    ----------
    of_sphere : (spheres,) number of each one's cluster; -1 of what contacts do not move
    grain : (spheres,) of each one, the first sphere of its body, or itself
    held : (rows,) the sphere of each contact with a force with a wall or a frozen sphere
    normal, force : (rows, 3) of these contacts; the force is that on the sphere
    """

    of_sphere: Array
    grain: Array
    held: Array
    normal: Array
    force: Array

    def __iter__(self) -> Iterator[tuple[Array, Array]]:
        """The spheres of each cluster, and the contacts that hold it."""
        rows = groups(self.of_sphere[self.held])
        none = np.zeros(0, dtype=np.int64)
        for number, spheres in groups(self.of_sphere).items():
            if number >= 0:
                yield spheres, rows.get(number, none)


def groups(numbers: Array) -> dict[int, Array]:
    """Return number -> the places that have it, in ascending order of both."""
    order = np.argsort(numbers, kind="stable")
    found, first = np.unique(numbers[order], return_index=True)
    return dict(zip(found.tolist(), np.split(order, first[1:]), strict=len(found) > 0))


def clusters_of(listed: dict[str, Array], molecule: Array, movable: Array) -> Clusters:
    """The clusters of a list of contacts; `movable` tells which spheres contacts move."""
    count = len(molecule)
    grain = np.arange(count)
    of_bodies = np.flatnonzero(molecule > 0)
    _, first, body = np.unique(molecule[of_bodies], return_index=True, return_inverse=True)
    grain[of_bodies] = of_bodies[first[body]]
    acts = listed["force"] != 0
    i, j, pair, normal = (listed[name][acts] for name in ("i", "j", "pair", "n"))
    force = normal * listed["force"][acts][:, None]
    one, other = movable[i], pair & movable[j]
    both = one & other
    edges = np.concatenate([i[both], np.arange(count)]), np.concatenate([j[both], grain])
    graph = coo_matrix((np.ones(len(edges[0])), edges), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    first, second = one & ~other, other & ~one
    return Clusters(
        np.where(movable, label, -1),
        grain,
        np.concatenate([i[first], j[second]]),
        np.vstack([normal[first], normal[second]]),
        np.vstack([force[first], -force[second]]),
    )


def free_directions(normals: Array) -> Array:
    """(directions, 3) Unit vectors at right angles, along which none of the normals has a part."""
    if not len(normals):
        return np.eye(3)
    _, sizes, directions = np.linalg.svd(
        np.vstack([normals, np.zeros((3, 3))]), full_matrices=False
    )
    return np.asarray(directions[sizes <= HOLDS])


@dataclass(frozen=True, eq=False)
class _Gained:
    """What a step adds to kinetic energies.

    Attributes
    ----------
    clusters : what contacts with a force connect
    sphere : (rows,) of each contact, one that contacts move
    gained, size : (spheres,) of each one, or of its body in the first of its spheres; and what
        round-off is a part of
    speed : the largest at which an overlap is given back
    allowed : (rows,) what each contact may add
    impulse, end : (rows,) of each contact, and its linearised gap at the end
    curved : (rows,) by how much the turns of both bodies without contacts close its gap at most
    """

    clusters: Clusters
    sphere: Array
    gained: Array
    size: Array
    speed: float
    allowed: Array
    impulse: Array
    end: Array
    curved: Array


@dataclass(frozen=True, eq=False)
class _Seen:
    """What shapes show of one wall each from some positions.

    Attributes
    ----------
    count : (rows,) by how many shapes the wall is shown
    shape : (rows,) number of the one that shows it nearest; of this one are
    distance, normal, curved : (rows, ...) as those of a View
    """

    count: Array
    shape: Array
    distance: Array
    normal: Array
    curved: Array


@dataclass(frozen=True, eq=False)
class _Members:
    """The spheres of the bodies of a frame, one body after the other.

    Attributes
    ----------
    sphere, body : (members,) each one's index, and the row of its body
    arm : (members, 3) from the body's centre of mass to its centre
    first : (bodies,) the first sphere of each
    far, largest : (bodies,) the length of the longest arm, and the largest radius
    """

    sphere: Array
    body: Array
    arm: Array
    first: Array
    far: Array
    largest: Array

    def sums(self, values: Array) -> Array:
        """(bodies, ...) Over the members of each body, of a value of each member."""
        total = np.zeros((len(self.first), *values.shape[1:]))
        np.add.at(total, self.body, values)
        return total

    def __getitem__(self, row: int) -> tuple[Array, Array]:
        """The spheres of one body, and their arms."""
        mine = self.body == row
        return self.sphere[mine], self.arm[mine]


def inverse_inertia(mass: Array, radius: Array, members: _Members, *, solid: bool) -> Array:
    """(bodies, 3, 3) About the centre of mass, from mass and radius of each member."""
    arm = members.arm
    round_part = mass * (arm**2).sum(axis=1) + (0.4 * mass * radius**2 if solid else 0.0)
    moments = np.eye(3) * members.sums(round_part)[:, None, None]
    moments -= members.sums(mass[:, None, None] * arm[:, :, None] * arm[:, None, :])
    values, axes = np.linalg.eigh(moments)
    # Point masses on a line do not turn about it.
    turns_about = values > 1e-10 * values.max(axis=1, initial=0.0)[:, None]
    inverse = np.where(turns_about, 1 / np.maximum(values, 1e-300), 0.0)
    return np.asarray((axes * inverse[:, None, :]) @ axes.transpose(0, 2, 1))


@dataclass(eq=False)
class _Frame:
    """One step: what was read, and what follows from it."""

    step: int
    x: Array
    v: Array
    force: Array
    before: Array
    radius: Array
    mass: Array
    id: Array
    kind: Array
    molecule: Array
    h: float
    time: float
    periods: Array
    thermo: dict[str, float]
    first: bool
    deepest: float = 0.0
    # Momentum, as a velocity, of free spheres, and of bodies in the order of their dump.
    momentum: Array = field(default_factory=lambda: np.zeros((0, 3)))
    body_v: Array = field(default_factory=lambda: np.zeros((0, 3)))
    body_l: Array = field(default_factory=lambda: np.zeros((0, 3)))
    # By how much these may be off.
    body_slack: tuple[Array, Array] = (np.zeros(0), np.zeros(0))
    bodies: Table | None = None
    # What the step adds to energies, and the list of its contacts.
    gained: _Gained | None = None
    clusters: Clusters | None = None
    listed_all: dict[str, Any] | None = None
    members: _Members | None = None
    # (bodies, 3, 3)
    inverse_inertia: Array | None = None
    # The list, the linearised gaps at the end of the step, and where these are exact.
    listed: dict[str, Any] | None = None
    ends: Array = field(default_factory=lambda: np.zeros(0))
    plain: Array = field(default_factory=lambda: np.zeros(0, dtype=bool))
    # (spheres,) Whether its grain is stopped, and goes on with the one velocity of its cluster.
    stopped: Array = field(default_factory=lambda: np.zeros(0, dtype=bool))
    # No bad overlap now and in the frame before; none now; the last frame of a run.
    quiet: bool = False
    settled: bool = True
    final: bool = False
    # Momentum without what pushes apart, for bodies; the largest that free spheres had meanwhile.
    kept_v: Array = field(default_factory=lambda: np.zeros((0, 3)))
    kept_l: Array = field(default_factory=lambda: np.zeros((0, 3)))
    momentum_size: Array = field(default_factory=lambda: np.zeros(0))


class _Part:
    """The frames of one run, and of those that go on from it without being set up."""

    def __init__(
        self, report: Report, facts: dict[str, Any], name: str, tolerance: float, left: float
    ) -> None:
        self.report = report
        self.facts = facts
        self.name = name
        self.eps = tolerance
        # The overlap that the part before has left.
        self.left = left
        self.has_pushed = False
        # [time] The longest step of the part so far.
        self.longest = 0.0
        # The largest speed of a sphere of this part so far, pushes included.
        self.fastest = 0.0
        self.push_unknown = self.lines_unknown = False
        # Of each step that gained too much energy, where and how much.
        self.energy_found: dict[int, tuple[str, str]] = {}
        # By the number of a body, which keeps its shape.
        self.in_line: dict[float, bool] = {}
        # By the number of a wall, whether it is_flat(), and whether it is_exact().
        self.flat: dict[int, bool] = {}
        self.exact: dict[int, bool] = {}
        self.shapes: list[Shape] = facts["shapes"]
        self.inside = np.array([shape["inside"] for shape in self.shapes], dtype=bool)
        self.turns = np.array([turns(shape) for shape in self.shapes], dtype=bool)
        self.moves = np.array([moves(shape) for shape in self.shapes], dtype=bool)
        self.to_v = facts["acceleration_of_force"]
        self.curved = (
            any(s["inside"] and s["kind"] in ("sphere", "cylinder", "cone") for s in self.shapes)
            or "intersect" in facts["words"]
        )

    def frame(
        self,
        table: Table,
        rows: Table,
        thermo: dict[str, float],
        bodies: Table | None,
        last: _Frame | None,
        final: bool,
    ) -> _Frame:
        wide = table.box[:, 1] - table.box[:, 0]
        new = _Frame(
            table.step,
            table["x y z"],
            table["vx vy vz"],
            table["fx fy fz"],
            table["f_before[1] f_before[2] f_before[3]"],
            table["radius"],
            table["mass"],
            table["id"],
            table["type"],
            table["mol"] if "mol" in table.columns else np.zeros(len(table.rows)),
            thermo["Dt"],
            thermo["Time"],
            np.where(self.facts["periodic"], wide, 0.0),
            thermo,
            last is None,
        )
        new.bodies, new.final = bodies, final
        self.where = f"{self.name}, step {table.step}"
        self.report.seen["frames"] += 1
        values = [table.rows, rows.rows, np.array(list(thermo.values()))]
        if not all(np.isfinite(v).all() for v in values):
            self.wrong("not a number", "a dump or thermo output holds nan or inf")
            return new
        if last is not None and not np.array_equal(last.id, new.id):
            self.wrong("lost", "IDs differ from those of the frame before")
            return new
        self.overlaps(new, last)
        listed = self.contacts(new, rows)
        if listed is None:
            return new
        self.forces(new, table, listed)
        self.virial(new, table, listed)
        self.motion(new, last, listed)
        if last is not None:
            self.followed(new, last)
            self.energy_gained(new, last)
        return new

    def wrong(self, kind: str, what: str) -> None:
        self.report.wrong(kind, self.where, what)

    def close(self, kind: str, a: ArrayLike, b: ArrayLike, allowed: Any, ids: Any = None) -> None:
        """Note where two arrays differ by more than is allowed; `ids` names the rows."""
        off = np.abs(np.asarray(a) - np.asarray(b))
        beyond = ~(off <= allowed)
        if beyond.any():
            at = np.unravel_index(np.argmax(np.where(beyond, off, -1.0)), off.shape)
            row = f" of {int(ids[at[0]])}" if ids is not None else ""
            self.wrong(
                kind,
                f"{np.asarray(a)[at]:.17g}{row} is not {np.asarray(b)[at]:.17g} (off by "
                f"{off[at]:.3g}, {np.broadcast_to(allowed, off.shape)[at]:.3g} allowed)",
            )

    # --- overlaps

    def lengths(self, frame: _Frame) -> float:
        """The largest length there is: positions are known to a part of it."""
        return float(np.abs(frame.x).max() + frame.radius.max() + frame.periods.max())

    def apart(self, frame: _Frame, i: Any, j: Any) -> Array:
        """Vector from the nearest image of j to i."""
        away = frame.x[i] - frame.x[j]
        for axis, period in enumerate(frame.periods):
            if period > 0:
                away[..., axis] -= period * np.rint(away[..., axis] / period)
        return np.asarray(away)

    def gaps(self, frame: _Frame) -> tuple[Array, Array, Array]:
        """Pairs that see each other, with their gaps."""
        i, j = np.triu_indices(len(frame.x), 1)
        seen = (frame.kind[i] != OUTSIDE) & (frame.kind[j] != OUTSIDE)
        seen &= (frame.kind[i] != FROZEN) | (frame.kind[j] != FROZEN)
        seen &= (frame.molecule[i] != frame.molecule[j]) | (frame.molecule[i] == 0)
        i, j = i[seen], j[seen]
        gap = np.linalg.norm(self.apart(frame, i, j), axis=1) - frame.radius[i] - frame.radius[j]
        return i, j, gap

    def clusters(self, frame: _Frame, listed: dict[str, Array]) -> Clusters:
        """The clusters of a frame, by the list of its contacts."""
        if frame.clusters is None:
            movable = (frame.kind != FROZEN) & (frame.kind != OUTSIDE)
            frame.clusters = clusters_of(listed, frame.molecule, movable)
        return frame.clusters

    def movable(self, frame: _Frame) -> Array:
        """Indices of the spheres that walls hold back."""
        return np.flatnonzero((frame.kind != OUTSIDE) & (frame.kind != FROZEN))

    def overlaps(self, frame: _Frame, last: _Frame | None) -> None:
        """(a) Bounds, and the fix's own number."""
        slack = ROUND_OFF * self.lengths(frame)
        i, j, gap = self.gaps(frame)
        turning = (frame.molecule[i] > 0) | (frame.molecule[j] > 0)
        bound = np.where(turning, REGULAR, 1.0) * self.eps + slack
        self.deep("overlap", frame, last, i, j, -gap, bound)
        frame.deepest = max(0.0, float(-gap.min(initial=0.0)))
        who = self.movable(frame)
        for shape in self.shapes:
            for view in views(shape, frame.x[who], frame.time):
                depth = frame.radius[who] - view.distance
                frame.deepest = max(frame.deepest, float(depth.max(initial=0.0)))
                exact = not (view.curved or self.curved)
                factor = np.where((frame.molecule[who] > 0) | (not exact), REGULAR, 1.0)
                wall = np.full(len(who), -view.number)
                self.deep(
                    "overlap with a wall",
                    frame,
                    last,
                    who,
                    wall,
                    depth,
                    factor * self.eps + slack,
                    shape,
                )
        self.close("reported overlap", frame.thermo["f_contact[4]"], frame.deepest, slack)
        self.report.seen["overlapping frames"] += int(frame.deepest > REGULAR * self.eps)

    def deep(
        self,
        kind: str,
        frame: _Frame,
        last: _Frame | None,
        i: Array,
        j: Array,
        depth: Array,
        bound: Array,
        shape: Shape | None = None,
    ) -> None:
        """Overlaps beyond the bound are those of the frame before.

        Where bad ones cannot all be opened at once they give way to one another: none becomes
        deeper than the deepest was by more than a push may open it.
        """
        if last is None:
            # What a run begins with is the deck's, or that of an earlier tolerance.
            started_well = not (self.facts["bad_start"] or self.facts["warn"])
            if (depth > bound + self.left).any() and started_well:
                worst = int(np.argmax(depth - bound))
                self.wrong(f"{kind} at the start", self.pair(frame, i, j, worst, depth[worst]))
            return
        # What the fix owned up to at the end of the last step.
        bound = bound + last.thermo["f_contact[11]"]
        if last.deepest > REGULAR * self.eps:
            # Beside a bad start regular overlaps are kept, to within the residual.
            bound = np.maximum(bound, (REGULAR + 1) * self.eps)
        lacks, keeps_open = last.thermo["f_contact[2]"], last.thermo["f_contact[3]"]
        if self.facts["warn"] and max(lacks, keeps_open) > self.eps:
            # What an unsolved step lacks comes on top of an overlap that it keeps, and beside a
            # bad start of regular overlaps, which are kept until the push, for which it has no
            # iterations left.
            kept = self.eps if last.deepest <= REGULAR * self.eps else (REGULAR + 1) * self.eps
            bound = bound + max(0.0, lacks - self.eps) + min(last.deepest, kept)
        beyond = np.flatnonzero(depth > bound)
        if not len(beyond):
            return
        if shape is None:
            away = self.apart(last, i[beyond], j[beyond])
            sizes = last.radius[i[beyond]] + last.radius[j[beyond]]
            earlier = sizes - np.linalg.norm(away, axis=1)
        else:
            sizes = last.radius[i[beyond]]
            earlier = np.array(
                [
                    max(
                        last.radius[k] - view.distance[0]
                        for view in views(shape, last.x[k], last.time)
                        if view.number == -wall
                    )
                    for k, wall in zip(i[beyond], j[beyond], strict=True)
                ]
            )
        most = np.maximum(earlier, last.deepest + PUSHED * sizes)
        deeper = depth[beyond] - np.where(earlier > REGULAR * self.eps, most, 0.0) > bound[beyond]
        # What a step has left too deep stays as long as there is no room to give it back.
        deeper &= depth[beyond] > earlier + ROUND_OFF * self.lengths(frame)
        for k in np.flatnonzero(deeper):
            if shape is None:
                deeper[k] = not self.are_entangled(last, i[beyond[k]], j[beyond[k]])
            else:
                hidden = "intersect" in self.facts["words"] and self.is_hidden(
                    last, i[beyond[k]], shape, -int(j[beyond[k]])
                )
                pushed = self.facts["bad_start"] or self.facts["warn"]
                deeper[k] = not (hidden and pushed)
        if deeper.any():
            worst = int(beyond[deeper][np.argmax(depth[beyond][deeper])])
            self.wrong(kind, self.pair(frame, i, j, worst, depth[worst]))

    def is_hidden(self, frame: _Frame, i: int, shape: Shape, number: int) -> bool:
        """Whether LAMMPS does not show a sphere this wall, one of several parts of a region.

        It shows of an intersection the points that lie in all parts. Beside its edge a sphere can
        stick out of a part there alone, which pushing it apart from others may make a little worse,
        and a step that is not solved as well.
        """
        others = [s for s in self.shapes if s["region"] == shape["region"] and s is not shape]
        for view in views(shape, frame.x[i], frame.time):
            point = frame.x[i] - view.distance[0] * view.normal[0]
            for other in others:
                seen = views(other, point, frame.time)
                if view.number == number and min(float(v.distance[0]) for v in seen) < 0:
                    return True
        return False

    def are_entangled(self, frame: _Frame, i: int, j: int) -> bool:
        """Whether two bodies, or a body and a sphere, are deep in one another somewhere.

        The fix pushes these along the line between their centres; what else is between them waits.
        """
        sides = [
            np.flatnonzero(frame.molecule == frame.molecule[k])
            if frame.molecule[k]
            else np.array([k])
            for k in (i, j)
        ]
        if len(sides[0]) + len(sides[1]) == 2:
            return False
        one, other = (side.ravel() for side in np.meshgrid(*sides))
        sizes = frame.radius[one] + frame.radius[other]
        depth = sizes - np.linalg.norm(self.apart(frame, one, other), axis=1)
        return bool((depth > ENTANGLED * sizes).any())

    def pair(self, frame: _Frame, i: Array, j: Array, k: int, depth: float) -> str:
        second = int(frame.id[j[k]]) if j[k] >= 0 else f"wall {-int(j[k])}"
        return (
            f"{int(frame.id[i[k]])} and {second} overlap by {depth:.6g} = {depth / self.eps:.4g} "
            f"EPS"
        )

    # --- the list of contacts

    @staticmethod
    def places(frame: _Frame, ids: Array) -> Array:
        """The index of the sphere with each ID, -1 where there is none."""
        order = np.argsort(frame.id)
        sorted_ids = frame.id[order]
        at = np.minimum(np.searchsorted(sorted_ids, ids), len(order) - 1)
        return np.where(sorted_ids[at] == ids, order[at], -1)

    def contacts(self, frame: _Frame, rows: Table) -> dict[str, Array] | None:
        """(e) Check each row; return the list with indices instead of IDs."""
        first, second = rows["id1"].astype(int), rows["id2"].astype(int)
        self.report.seen["contacts"] += len(first)
        pairs = second > 0
        i, j = self.places(frame, first), self.places(frame, second)
        known = (i >= 0) & ((j >= 0) | ((second < 0) & (second >= -self.facts["walls"])))
        if not known.all():
            row = int(np.flatnonzero(~known)[0])
            self.wrong("contact IDs", f"there is no {first[row]} or {second[row]}")
            return None
        n, gap, force = rows["nx ny nz"], rows["gap"], rows["force"]
        slack = 10 * ROUND_OFF * self.lengths(frame)
        # Vectors to curved walls are small differences of large numbers just inside of the wall.
        unit = np.where(pairs, ROUND_OFF, NORMAL_AT_WALL)
        self.close("normal's length", np.linalg.norm(n, axis=1), np.ones(len(n)), unit, first)
        if (force <= 0).any() and "law gluey" not in self.facts["words"]:
            self.wrong("force of a contact", f"{force.min()} is not greater than 0")
        kinds = frame.kind[i]
        if (kinds == OUTSIDE).any() or (frame.kind[j[pairs]] == OUTSIDE).any():
            self.wrong("group", "a contact of a sphere outside of the group")
        stuck = (kinds == FROZEN) & np.where(pairs, frame.kind[j] == FROZEN, True)
        if stuck.any():
            self.wrong("frozen", "a contact of a frozen sphere with a frozen one or a wall")
        one = pairs & (frame.molecule[i] > 0) & (frame.molecule[i] == frame.molecule[j])
        if one.any():
            self.wrong("body", "a contact within a body")
        # The line between the centres, which may be those of periodic images.
        size = frame.radius[i] + np.where(pairs, frame.radius[j], 0.0)
        image = np.zeros_like(n)
        away = frame.x[i] - frame.x[j] - n * (size + gap)[:, None]
        for axis, period in enumerate(frame.periods):
            if period > 0:
                image[:, axis] = np.rint(away[:, axis] / period)
                away[:, axis] -= period * image[:, axis]
        self.close("line of the centres", away[pairs], 0 * away[pairs], slack, first[pairs])
        to_point = frame.radius[i] + np.where(pairs, gap / 2, gap)
        self.close("contact point", rows["x y z"], frame.x[i] - n * to_point[:, None], slack, first)
        # Each once: with its images a pair may meet twice in a narrow box, and walls curve.
        flip = pairs & (second < first)
        keys = np.column_stack(
            [
                np.minimum(first, second),
                np.maximum(first, second),
                np.where(flip[:, None], -image, image) * pairs[:, None],
            ]
        )
        rounded = np.where(pairs[:, None], 0.0, np.round(n, 9))
        keys = np.column_stack([keys, rounded])
        keys = keys[np.lexsort(keys.T)]
        if (keys[1:] == keys[:-1]).all(axis=1).any():
            self.wrong("contact", "one is listed twice")
        listed = {
            "i": i,
            "j": j,
            "n": n,
            "gap": gap,
            "force": force,
            "pair": pairs,
            "wall": np.where(pairs, 0, -second),
        }
        self.wall_contacts(frame, listed)
        return listed

    def seen_by(self, shape: Shape, number: int, x: Array, time: float) -> View | None:
        """The view of one wall of a shape, if it has that wall."""
        for view in views(shape, x, time):
            if view.number == number:
                return view
        return None

    def seen_from(self, x: Array, walls: Array, time: float) -> _Seen:
        """What the shapes show of wall number `walls` from each position, as seen_by()."""
        count = np.zeros(len(walls), dtype=int)
        which, distance = np.full(len(walls), -1), np.full(len(walls), np.inf)
        normal, curved = np.zeros((len(walls), 3)), np.zeros(len(walls), dtype=bool)
        for number, shape in enumerate(self.shapes if len(walls) else []):
            missing = np.ones(len(walls), dtype=bool)
            for view in views(shape, x, time):
                shown = missing & (walls == view.number)
                if not shown.any():
                    continue
                count += shown
                missing &= ~shown
                nearer = shown & (view.distance < distance)
                which[nearer], curved[nearer] = number, view.curved
                distance[nearer], normal[nearer] = view.distance[nearer], view.normal[nearer]
        return _Seen(count, which, distance, normal, curved)

    def wall_contacts(self, frame: _Frame, listed: dict[str, Array]) -> None:
        """Normals and gaps of walls, where these are not tangent planes added for the end."""
        slack = 10 * ROUND_OFF * self.lengths(frame)
        rows = np.flatnonzero(~listed["pair"])
        seen = self.seen_from(frame.x[listed["i"][rows]], listed["wall"][rows], frame.time)
        if (seen.count != 1).any():
            row = int(np.flatnonzero(seen.count != 1)[0])
            self.wrong("wall", f"there are {seen.count[row]} walls {listed['wall'][rows[row]]}")
        one = seen.count == 1
        rows, shape = rows[one], seen.shape[one]
        distance, normal, curved = seen.distance[one], seen.normal[one], seen.curved[one]
        sphere = listed["i"][rows]
        same = np.linalg.norm(normal - listed["n"][rows], axis=1) < 1e-9
        planar = self.inside[shape] & ~curved & ~self.turns[shape]
        other = planar & ~same
        if other.any():
            row = int(np.flatnonzero(other)[0])
            name = int(frame.id[sphere[row]])
            self.wrong("normal of a wall", f"wall {listed['wall'][rows[row]]}, sphere {name}")
        free_and_still = (frame.molecule[sphere] == 0) & ~self.moves[shape]
        told = same & ~self.turns[shape] & (planar | free_and_still)
        gap = (distance - frame.radius[sphere])[told]
        given = listed["gap"][rows][told]
        self.close("gap at a wall", given, gap, slack + 1e-9 * np.abs(gap))

    # --- forces

    def forces(self, frame: _Frame, table: Table, listed: dict[str, Array]) -> None:
        """(e, g, h) Counts and forces of spheres and walls are those of the list."""
        count = len(frame.x)
        i, j, pair = listed["i"], listed["j"], listed["pair"]
        push = listed["n"] * listed["force"][:, None]
        total, size = np.zeros((count, 3)), np.zeros(count)
        with_spheres, with_walls = np.zeros(count), np.zeros(count)
        np.add.at(total, i, push)
        np.add.at(size, i, np.abs(listed["force"]))
        np.add.at(total, j[pair], -push[pair])
        np.add.at(size, j[pair], np.abs(listed["force"][pair]))
        np.add.at(with_spheres, i[pair], 1)
        np.add.at(with_spheres, j[pair], 1)
        np.add.at(with_walls, i[~pair], 1)
        self.close("contacts of a sphere", table["f_contact[1]"], with_spheres, 0, frame.id)
        self.close("walls of a sphere", table["f_contact[2]"], with_walls, 0, frame.id)
        self.close("contacts in all", frame.thermo["f_contact[5]"], pair.sum(), 0)
        self.close("wall contacts in all", frame.thermo["f_contact[6]"], (~pair).sum(), 0)
        slack = ROUND_OFF * (size + 1e-300)[:, None]
        listed["total"], listed["size"] = total, size
        columns = table["f_contact[3] f_contact[4] f_contact[5]"]
        self.close("force on a sphere", columns, total, slack, frame.id)
        for wall in range(1, self.facts["walls"] + 1):
            mine = listed["wall"] == wall
            given = np.array([frame.thermo[f"f_contact[{wall}][{k}]"] for k in (1, 2, 3)])
            allowed = ROUND_OFF * (np.abs(listed["force"][mine]).sum() + 1e-300)
            self.close("force on a wall", given, -push[mine].sum(axis=0), allowed)

    def virial(self, frame: _Frame, table: Table, listed: dict[str, Array]) -> None:
        """(f) Of the whole and of each sphere, half of a pair's to either."""
        i, j, pair, n = listed["i"], listed["j"], listed["pair"], listed["n"]
        arm = frame.radius[i] + listed["gap"] + np.where(pair, frame.radius[j], 0.0)
        weight = arm * listed["force"]
        of_row = np.stack(
            [
                weight * n[:, a] * n[:, b]
                for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
            ],
            axis=1,
        ).reshape(len(n), 6)
        to_pressure = self.facts["pressure_of_energy"]
        whole = of_row.sum(axis=0) * to_pressure
        given = np.array([frame.thermo[f"c_press[{k}]"] for k in range(1, 7)])
        size = np.abs(weight).sum() * to_pressure
        allowed = ROUND_OFF * (size + 1e-300)
        self.close("virial", given * frame.thermo["Volume"], whole, allowed)
        of_sphere, sizes = np.zeros((len(frame.x), 6)), np.zeros(len(frame.x))
        np.add.at(of_sphere, i, 0.5 * of_row)
        np.add.at(of_sphere, np.where(pair, j, i), 0.5 * of_row)
        np.add.at(sizes, i, np.abs(weight))
        np.add.at(sizes, np.where(pair, j, i), np.abs(weight))
        stress = np.column_stack([table[f"c_stress[{k}]"] for k in range(1, 7)])
        slack = ROUND_OFF * to_pressure * (sizes + 1e-300)[:, None]
        self.close("virial of a sphere", -stress, of_sphere * to_pressure, slack, frame.id)

    # --- motion

    def motion(self, new: _Frame, last: _Frame | None, listed: dict[str, Array]) -> None:
        """(b, c, d) Momentum, energy and complementarity of the step that begins here."""
        residual = new.thermo["f_contact[2]"]
        if self.facts["solver"] != "uzawa":
            residual = max(residual, new.thermo["f_contact[3]"])
        if not self.facts["warn"] and residual > self.eps:
            self.wrong("residual", f"{residual / self.eps:.4g} EPS")
        kick = 0.5 * new.h if last is None else new.h
        quiet = new.deepest <= 1.999 * self.eps and (
            last is None or last.deepest <= 1.999 * self.eps
        )
        # The velocities of bodies in a restart file of a step that pushes hold a part of the push.
        # Without `shorten` bodies leave in good scenes, too, what the next step pushes apart.
        may_hold_push = "restart within a run" in self.facts["words"] and (
            self.facts["bad_start"] or self.facts["warn"] or not self.facts["shorten"]
        )
        quiet = quiet and not (last is None and may_hold_push)
        # A run ends by taking the push out; and begins without.
        accelerate = self.to_v / new.mass[:, None]
        after = new.v + 0.5 * new.h * accelerate * new.force
        if last is not None:
            self.moved(new, last)
            started = last.momentum if not quiet else new.v - 0.5 * new.h * accelerate * new.force
        else:
            started = new.v
        predicted = started + kick * accelerate * new.before
        contact = kick * accelerate * listed["total"]
        momentum = predicted + contact
        sizes = (
            np.linalg.norm(started, axis=1)
            + np.linalg.norm(new.v, axis=1)
            + kick
            * (
                self.to_v
                / new.mass
                * (
                    np.linalg.norm(new.before, axis=1)
                    + np.linalg.norm(new.force, axis=1)
                    + listed["size"]
                )
            )
        )
        alone = (new.molecule == 0) & (new.kind != FROZEN) & (new.kind != OUTSIDE)
        if new.bodies is not None:
            self.turned(new, last)
        new.stopped = np.zeros(len(new.x), dtype=bool)
        if quiet:
            self.added(new, listed, after, sizes, kick)
            self.report.seen["momenta"] += int(alone.sum())
        settled = new.deepest <= 1.999 * self.eps
        if settled and not quiet:
            # Nothing of what pushed spheres apart is left when the overlaps are gone.
            kept = last.momentum_size if last is not None else 0.0
            new.momentum_size = np.maximum(sizes, kept)
            slack = 10 * ROUND_OFF * (new.momentum_size + 1e-300)[:, None]
            # What comes to rest in the step keeps none, either.
            moves = alone & (np.linalg.norm(after, axis=1) > 10 * ROUND_OFF * sizes)
            off = moves & (np.abs(after - momentum) > slack).any(axis=1)
            clusters = self.clusters(new, listed)
            moves &= ~self.stopped(clusters, off, after, sizes)
            self.close("push kept", after[moves], momentum[moves], slack[moves], new.id[moves])
            self.report.seen["ends of pushing"] += 1
        elif not settled and last is not None:
            new.momentum_size = np.maximum(sizes, last.momentum_size)
        else:
            new.momentum_size = sizes
        new.momentum = np.where(alone[:, None], after if quiet else momentum, after)
        new.quiet = quiet
        self.has_pushed = self.has_pushed or not quiet
        if not quiet:
            self.report.seen["pushed frames"] += 1
        if new.bodies is not None:
            self.pushed(new, last, listed, settled)
        velocity = self.velocities(new)
        self.complementary(new, listed, velocity, quiet)
        if quiet:
            self.energy(new, listed, after, velocity, kick, sizes, last)

    def added(
        self, new: _Frame, listed: dict[str, Array], after: Array, sizes: Array, kick: float
    ) -> None:
        """What the fix adds is what contacts give; stopped grains have the cluster's velocity.

        Between one frame and the next are nothing but forces: that is exact, whatever the kick was.
        In a step that pushes apart forces hold the push, too, which the list does not tell.
        """
        scale = (
            np.linalg.norm(new.force, axis=1) + listed["size"] + np.linalg.norm(new.before, axis=1)
        )
        inertia = new.mass / self.to_v / kick * np.linalg.norm(after, axis=1)
        slack = 10 * ROUND_OFF * (scale + inertia + 1e-300)
        movable = (new.kind != FROZEN) & (new.kind != OUTSIDE)
        wanted = np.where(movable[:, None], listed["total"], 0.0)
        clusters = self.clusters(new, listed)
        given = new.force - new.before
        self.cluster_momenta(new, clusters, given, slack)
        # Of what is at rest the velocity is taken away, which no contact force does.
        alike = np.linalg.norm(after, axis=1) > 10 * ROUND_OFF * sizes
        of_grain = after.copy()
        if new.bodies is not None:
            resting = self.resting(new)
            members = self.members(new)
            mine, body = members.sphere, members.body
            of_grain[mine] = new.body_v[body]
            alike[mine] &= ~resting[body]
            # What a push has left in bodies in a line is still being taken away.
            if self.has_pushed:
                alike[mine] &= ~self.are_in_line(new)[body]
            # The round-off of a moment, of forces as far out as the surface, over short arms; all
            # spheres share it.
            largest = np.zeros(len(members.first))
            np.maximum.at(largest, body, slack[mine])
            over = 1 + members.largest / np.maximum(members.far, 1e-300)
            slack[mine] = (over * largest)[body]
        other = (np.abs(given - wanted) > slack[:, None]).any(axis=1)
        new.stopped = self.stopped(clusters, alike & other, of_grain, sizes)
        self.report.seen["stopped spheres"] += int((other & (new.stopped | ~alike)).sum())
        alike &= ~new.stopped
        self.close(
            "force added to a sphere",
            given[alike],
            wanted[alike],
            slack[alike, None],
            new.id[alike],
        )

    def cluster_momenta(self, new: _Frame, clusters: Clusters, given: Array, slack: Array) -> None:
        """Where nothing from outside holds it, a cluster has its momentum, whatever is stopped.

        Allowed is the round-off of all that is added up, 1e-11 of forces and of momenta / h.
        """
        for spheres, rows in clusters:
            free = free_directions(clusters.normal[rows])
            # What holds has a part along these directions that is round-off of its normals.
            lost = free @ (given[spheres].sum(axis=0) - clusters.force[rows].sum(axis=0))
            allowed = slack[spheres].sum()
            self.report.seen["directions of clusters"] += len(free)
            for direction, force in zip(free, lost, strict=True):
                if abs(force) > allowed:
                    self.wrong(
                        "momentum of a cluster",
                        f"nothing holds that of {int(new.id[spheres[0]])}, {len(spheres)} spheres, "
                        f"along {np.round(direction, 6)}, where a force of {force:.3g} is added "
                        f"({allowed:.3g} allowed)",
                    )

    def stopped(self, clusters: Clusters, off: Array, v: Array, sizes: Array) -> Array:
        """(spheres,) Which grains move as their cluster does, of those with forces of no contact.

        Stopped grains have one velocity, along which no wall and no frozen sphere holds them: each
        shares it with another one, or is alone against what holds it.
        """
        found = np.zeros(len(off), dtype=bool)
        for spheres, rows in clusters:
            if not off[spheres].any():
                continue
            slack = 10 * ROUND_OFF * sizes[spheres].max()
            grains = np.unique(clusters.grain[spheres])
            for grain in np.unique(clusters.grain[spheres[off[spheres]]]):
                others = grains[grains != grain]
                shared = np.linalg.norm(v[others] - v[grain], axis=1) <= slack
                own = clusters.normal[rows][clusters.grain[clusters.held[rows]] == grain]
                moves = np.abs(own @ v[grain]) > slack + SLIDES * np.linalg.norm(v[grain])
                if not moves.any() and (shared.any() or len(own)):
                    found |= clusters.grain == grain
        return found

    def moved(self, new: _Frame, last: _Frame) -> None:
        """Positions follow from velocities and forces; and velocities from one kick."""
        accelerate = self.to_v / last.mass[:, None]
        after = last.v + 0.5 * last.h * accelerate * last.force
        alone = (new.molecule == 0) & (new.kind != FROZEN) & (new.kind != OUTSIDE)
        off = new.x - last.x - last.h * after
        for axis, period in enumerate(new.periods):
            if period > 0:
                off[:, axis] -= period * np.rint(off[:, axis] / period)
        step = last.h * np.linalg.norm(after, axis=1) + last.h * np.linalg.norm(last.v, axis=1)
        slack = ROUND_OFF * (self.lengths(new) + step)[:, None]
        self.close("motion", off[alone], 0 * off[alone], slack[alone], new.id[alone])
        now = new.v - 0.5 * new.h * accelerate * new.force
        sizes = np.linalg.norm(new.v, axis=1) + np.linalg.norm(last.v, axis=1)
        sizes += np.linalg.norm(now - new.v, axis=1) + np.linalg.norm(after - last.v, axis=1)
        # A drag that stops a sphere in one step leaves round-off of round-off, whose squares are 0.
        slack = ROUND_OFF * (sizes + 1e-100 * sizes.max(initial=0.0) + 1e-300)[:, None]
        self.close("velocity", now[alone], after[alone], slack[alone], new.id[alone])

    def spin(self, frame: _Frame, momentum: Array) -> Array:
        """(bodies, 3) Angular velocities by angular momenta."""
        if frame.inverse_inertia is None:
            members, solid = self.members(frame), self.facts["inertia"] == "solid"
            mass, radius = frame.mass[members.sphere], frame.radius[members.sphere]
            frame.inverse_inertia = inverse_inertia(mass, radius, members, solid=solid)
        return np.asarray((frame.inverse_inertia @ momentum[:, :, None])[:, :, 0])

    def members(self, frame: _Frame) -> _Members:
        """The spheres of each row of the bodies' dump."""
        if frame.members is None:
            frame.members = self.find_members(frame)
        return frame.members

    @staticmethod
    def find_members(frame: _Frame) -> _Members:
        """Find what members() keeps. The dump is in the order of the numbers of bodies."""
        assert frame.bodies is not None
        names = frame.bodies["mol"]
        row = np.minimum(np.searchsorted(names, frame.molecule), len(names) - 1)
        sphere = np.flatnonzero(names[row] == frame.molecule)
        sphere = sphere[np.argsort(row[sphere], kind="stable")]
        body = row[sphere]
        arm = frame.x[sphere] - frame.bodies["x y z"][body]
        for axis, period in enumerate(frame.periods):
            if period > 0:
                arm[:, axis] -= period * np.rint(arm[:, axis] / period)
        far, largest = np.zeros(len(names)), np.zeros(len(names))
        np.maximum.at(far, body, np.linalg.norm(arm, axis=1))
        np.maximum.at(largest, body, frame.radius[sphere])
        first = sphere[np.searchsorted(body, np.arange(len(names)))]
        return _Members(sphere, body, arm, first, far, largest)

    def turned(self, new: _Frame, last: _Frame | None) -> None:
        """Momentum and angular momentum of every body: one kick by the forces of its spheres."""
        assert new.bodies is not None
        order = np.argsort(new.bodies["mol"])
        new.bodies = Table(new.step, new.bodies.box, new.bodies.columns, new.bodies.rows[order])
        new.members = None
        count, members = len(order), self.members(new)
        mine, arm = members.sphere, members.arm
        of_members = members.sums(new.mass[mine])
        given = new.bodies["mass"]
        self.close("mass of a body", given, of_members, ROUND_OFF * of_members, new.bodies["mol"])
        centre = members.sums(new.mass[mine, None] * arm) / of_members[:, None]
        # The spheres are put in place anew in each step.
        slack = 100 * ROUND_OFF * self.lengths(new)
        self.close("centre of a body", centre, np.zeros((count, 3)), slack, new.bodies["mol"])
        force = members.sums(new.force[mine])
        moment = members.sums(cross(arm, new.force[mine]))
        strong = members.sums(np.linalg.norm(new.force[mine], axis=1))
        length = members.far + members.largest
        sizes = np.column_stack([strong / of_members, strong * length])
        mass = new.bodies["mass"][:, None]
        v, angular = new.bodies["vx vy vz"], new.bodies["angmomx angmomy angmomz"]
        half = 0.5 * new.h * self.to_v
        sizes *= half
        before_v, before_l = v - half * force / mass, angular - half * moment
        new.body_v, new.body_l = v + half * force / mass, angular + half * moment
        names = new.bodies["mol"]
        reach = new.bodies["mass"] * self.facts["largest"] * np.linalg.norm(v, axis=1)
        slack_v = 10 * ROUND_OFF * (sizes[:, 0] + np.linalg.norm(v, axis=1) + 1e-300)
        slack_l = 10 * ROUND_OFF * (sizes[:, 1] + np.linalg.norm(angular, axis=1) + reach + 1e-300)
        # Coordinates round the arms.
        arms = ROUND_OFF * self.lengths(new) / self.facts["smallest"]
        slack_l += arms * (sizes[:, 1] + np.linalg.norm(angular, axis=1))
        new.body_slack = slack_v, slack_l
        if last is None:
            return
        # What is nothing now may be the difference of what was much in the step before.
        slack_v, slack_l = slack_v + last.body_slack[0], slack_l + last.body_slack[1]
        self.close("momentum of a body", before_v, last.body_v, slack_v[:, None], names)
        self.close("angular momentum of a body", before_l, last.body_l, slack_l[:, None], names)
        self.report.seen["momenta of bodies"] += count

    def pushed(
        self, new: _Frame, last: _Frame | None, listed: dict[str, Array], settled: bool
    ) -> None:
        """Of what pushed bodies apart nothing is left when the overlaps are gone, to EPS / h."""
        assert new.bodies is not None
        acting = new.before + listed["total"]
        self.fastest = max(self.fastest, float(np.linalg.norm(new.v, axis=1).max(initial=0.0)))
        kick = (0.5 * new.h if last is None else new.h) * self.to_v
        if last is None:
            kept_v, kept_l = new.bodies["vx vy vz"], new.bodies["angmomx angmomy angmomz"]
            # A restart file of a step that pushes holds a part of the push in these velocities.
            self.push_unknown = "restart within a run" in self.facts["words"] and (
                not settled or not new.quiet
            )
            self.lines_unknown = self.push_unknown
        else:
            kept_v, kept_l = last.kept_v, last.kept_l
        kept_v, kept_l = kept_v.copy(), kept_l.copy()
        members = self.members(new)
        mine, arm = members.sphere, members.arm
        kept_v += kick * members.sums(acting[mine]) / new.bodies["mass"][:, None]
        kept_l += kick * members.sums(cross(arm, acting[mine]))
        lengths = members.far + members.largest
        # Of what is at rest the momentum is taken away.
        resting = self.resting(new) | new.stopped[members.first]
        kept_v[resting], kept_l[resting] = new.body_v[resting], new.body_l[resting]
        was_pushed = last is not None and not last.settled
        # The last step of a run takes the push out of the whole-step velocity, not out of this one.
        if settled and self.push_unknown:
            self.push_unknown = False
            kept_v, kept_l = new.body_v, new.body_l
        elif settled and not (was_pushed and new.final):
            mass = new.bodies["mass"]
            speed = np.linalg.norm(new.body_v, axis=1) + np.linalg.norm(kept_v, axis=1)
            strong = kick * self.to_strength(new, acting) / mass
            # Pushes came and went in velocities of that size.
            allowed = 100 * ROUND_OFF * (speed + strong) + ROUND_OFF * self.fastest + 1e-300
            arms = ROUND_OFF * self.lengths(new) / self.facts["smallest"]
            turning = (100 * ROUND_OFF + 10 * arms) * (
                np.linalg.norm(new.body_l, axis=1) + mass * lengths * (speed + strong)
            )
            turning += ROUND_OFF * mass * lengths * self.fastest + 1e-300
            names = new.bodies["mol"]
            in_line = self.are_in_line(new)
            if was_pushed:
                allowed += 2 * self.eps / new.h
            # What comes to rest in the step keeps none.
            stopped = self.stopped_bodies(new, listed, np.abs(new.body_v - kept_v), allowed)
            kept_v[stopped], kept_l[stopped] = new.body_v[stopped], new.body_l[stopped]
            told = (in_line | was_pushed) & ~(in_line & self.lines_unknown)
            left = self.spin(new, new.body_l - kept_l)
            told_of = told[members.body]
            body = members.body[told_of]
            speeds = np.linalg.norm(cross(left[body], arm[told_of]), axis=1)
            # No force on spheres in a line takes away what lies along it, until the line has
            # turned: what is kept of such bodies is followed from the start.
            slack = np.where(in_line, 2 * self.eps / new.h, 0.0)
            ids = new.id[mine[told_of]]
            self.close("turning push kept", speeds, 0 * speeds, (allowed + slack)[body], ids)
            if not was_pushed:
                free = ~in_line
                self.close(
                    "turning of a body",
                    new.body_l[free],
                    kept_l[free],
                    turning[free, None],
                    names[free],
                )
            self.close("push of a body kept", new.body_v, kept_v, allowed[:, None], names)
            self.report.seen["ends of pushing bodies"] += int(was_pushed)
            kept_v = new.body_v
            kept_l = np.where(in_line[:, None], kept_l, new.body_l)
        new.kept_v, new.kept_l, new.settled = kept_v, kept_l, settled

    def stopped_bodies(
        self, frame: _Frame, listed: dict[str, Array], off: Array, allowed: Array
    ) -> Array:
        """(bodies,) Which bodies, of those whose velocity is off, move as their cluster does."""
        accelerate = self.to_v / frame.mass[:, None]
        velocity = frame.v + 0.5 * frame.h * accelerate * frame.force
        asked = np.zeros(len(frame.x), dtype=bool)
        members = self.members(frame)
        mine, body = members.sphere, members.body
        velocity[mine] = frame.body_v[body]
        asked[mine] = (off > allowed[:, None]).any(axis=1)[body]
        clusters = self.clusters(frame, listed)
        found = self.stopped(clusters, asked, velocity, frame.momentum_size)
        return np.asarray(found[members.first])

    def resting(self, frame: _Frame) -> Array:
        """(bodies,) Whether a body has no velocity in the step, beside the forces on all."""
        assert frame.bodies is not None
        half = 0.5 * frame.h * self.to_v
        mass, v = frame.bodies["mass"], frame.bodies["vx vy vz"]
        size = np.linalg.norm(v, axis=1) + half * self.to_strength(frame, frame.before) / mass
        members = self.members(frame)
        after = v + half * members.sums(frame.force[members.sphere]) / mass[:, None]
        # Sums of the forces on some spheres, and velocities that came from those of others.
        slack = 10 * ROUND_OFF * (10 * size + self.fastest) + 0.01 * ROUND_OFF * size.max(initial=0)
        return np.asarray(np.linalg.norm(after, axis=1) <= slack)

    def are_in_line(self, frame: _Frame) -> Array:
        """(bodies,) Whether its spheres lie on a line, about which no force on them turns it."""
        assert frame.bodies is not None
        names = frame.bodies["mol"].tolist()
        for row, name in enumerate(names):
            if name not in self.in_line:
                _, arm = self.members(frame)[row]
                rank = np.linalg.matrix_rank(arm, tol=1e-6 * self.facts["smallest"])
                self.in_line[name] = bool(rank < REAL_TURNING)
        return np.array([self.in_line[name] for name in names], dtype=bool)

    def to_strength(self, frame: _Frame, forces: Array) -> Array:
        """Sum of the sizes of the forces on each body's spheres."""
        size = np.linalg.norm(forces, axis=1) + np.linalg.norm(frame.force, axis=1)
        members = self.members(frame)
        return members.sums(size[members.sphere])

    def velocities(self, frame: _Frame) -> Array:
        """Of the spheres during the step, from momentum alone; those of bodies by their turning."""
        velocity = frame.momentum.copy()
        fixed = (frame.kind == FROZEN) | (frame.kind == OUTSIDE)
        velocity[fixed] = frame.v[fixed]
        if frame.bodies is None:
            return velocity
        members = self.members(frame)
        spin = self.spin(frame, frame.body_l)[members.body]
        velocity[members.sphere] = frame.body_v[members.body] + cross(spin, members.arm)
        return velocity

    def complementary(
        self, new: _Frame, listed: dict[str, Array], velocity: Array, quiet: bool
    ) -> None:
        """(d) Where a force acts, the gap at the end of the step is within the tolerance."""
        if self.facts["solver"] == "uzawa" or (new.bodies is not None and not quiet):
            return
        if "law restitution" in self.facts["words"]:
            return
        # Glued surfaces that turn are not followed any further after so many rounds, as below.
        if "law gluey" in self.facts["words"] and new.thermo["f_contact[8]"] > 20:
            return
        i, j, pair, n = listed["i"], listed["j"], listed["pair"], listed["n"]
        relative = velocity[i] - np.where(pair[:, None], velocity[j], 0.0)
        asked = np.where(listed["gap"] < -REGULAR * self.eps, 0.0, listed["gap"])
        end = asked + new.h * (n * relative).sum(axis=1)
        end -= self.wall_motion(new, listed)
        ends = np.full(len(i), self.eps)
        if self.facts["warn"]:
            ends = np.maximum(ends, new.thermo["f_contact[3]"])
        large = self.lengths(new) + new.h * np.linalg.norm(relative, axis=1)
        slack = 100 * ROUND_OFF * large
        # Walls that curve or turn, and bodies: the constraint was set for the end of the step.
        plain = (new.molecule[i] == 0) & (~pair | (new.molecule[j] == 0))
        new.listed, new.ends = listed, end
        with_wall = ~pair & plain
        exact = [n for n in np.unique(listed["wall"][with_wall]).tolist() if self.is_exact(n)]
        plain[with_wall] = np.isin(listed["wall"][with_wall], exact)
        new.plain = plain
        borderline = np.abs(listed["gap"] + REGULAR * self.eps) < 1e-3 * self.eps
        checked = plain & ~borderline & (listed["force"] > 0)
        self.report.seen["complementary contacts"] += int(checked.sum())
        beyond = checked & (end > ends * (1 + 1e-9) + slack)
        if beyond.any():
            row = int(np.argmax(np.where(beyond, end, -np.inf)))
            second = int(new.id[j[row]]) if pair[row] else f"wall {listed['wall'][row]}"
            self.wrong(
                "complementarity",
                f"{int(new.id[i[row]])} and {second} keep {end[row] / self.eps:.4g} EPS under a "
                f"force of {listed['force'][row]:.4g}",
            )

    def followed(self, new: _Frame, last: _Frame) -> None:
        """(d) Bodies, and walls that turn: the gap at the end is small, or the linearised one is.

        The fix raises a gap that it lowered for an earlier solution in the first twenty rounds of a
        step, where it is more than 1.1 EPS; what it divides by a cosine of at least 0.5. At walls
        it does so while the body turns by less than half a turn in the step. Beside that and the
        residual of 1 EPS, a gap of up to 1 EPS under a force counts as closed where it is.
        """
        if last.listed is None or not last.quiet or last.thermo["f_contact[8]"] > 20:
            return
        if self.facts["warn"] or "law gluey" in self.facts["words"]:
            return
        listed = last.listed
        slack = 100 * ROUND_OFF * self.lengths(new)
        # Beside the residual's EPS: a lowering of less than 1.1 EPS is not worth raising again.
        for row in np.flatnonzero(~last.plain & (last.ends > 2.1 * self.eps * (1 + 1e-9) + slack)):
            i, j, wall = listed["i"][row], listed["j"][row], int(listed["wall"][row])
            if listed["pair"][row]:
                end = float(np.linalg.norm(self.apart(new, i, j)))
                end -= new.radius[i] + new.radius[j]
            elif not self.is_flat(wall):
                # A tangent plane holds, from which the wall curves away.
                continue
            else:
                seen = [self.seen_by(s, wall, new.x[i : i + 1], new.time) for s in self.shapes]
                (view,) = [view for view in seen if view is not None]
                end = float(view.distance[0] - new.radius[i])
            if wall and self.angle(last, i) >= HALF_A_TURN:
                continue
            self.report.seen["followed contacts"] += 1
            closed = min(max(0.0, float(listed["gap"][row])), self.eps)
            if end > (1.1 + 1.0) * self.eps + closed + slack:
                second = f"wall {wall}" if wall else int(new.id[j])
                self.wrong(
                    "gap under a force",
                    f"{int(new.id[i])} and {second} end the step before {end / self.eps:.4g} EPS "
                    f"apart (linearised {last.ends[row] / self.eps:.4g} EPS), under a force of "
                    f"{listed['force'][row]:.4g}",
                )

    def angle(self, frame: _Frame, sphere: int) -> float:
        """By how much the body of a sphere turns in a step, from its angular momentum.

        A body that is not round changes its angular velocity as it turns. LAMMPS turns it once by
        the angular velocity of the start, and once in two halves, the second by that of the middle
        of the step (Richardson's method): the faster of both counts.
        """
        if frame.bodies is None or not frame.molecule[sphere] > 0:
            return 0.0
        members = self.members(frame)
        row = int(members.body[members.sphere == sphere][0])
        momentum = frame.body_l[row]
        spin = self.spin(frame, frame.body_l)[row]
        # A quaternion is turned by a straight step and made one long again.
        half = Rotation.from_quat([*(frame.h * spin / 4), 1.0])
        turned = replace(members, arm=half.apply(members.arm))
        mass, radius = frame.mass[members.sphere], frame.radius[members.sphere]
        solid = self.facts["inertia"] == "solid"
        middle = inverse_inertia(mass, radius, turned, solid=solid)[row] @ momentum
        return float(frame.h * max(np.linalg.norm(spin), np.linalg.norm(middle)))

    def is_flat(self, number: int) -> bool:
        """Whether a wall is plane, and not the side of an obstacle, which has edges."""
        if number not in self.flat:
            seen = [(s, self.seen_by(s, number, np.zeros((1, 3)), 0.0)) for s in self.shapes]
            self.flat[number] = any(s["inside"] and v and not v.curved for s, v in seen)
        return self.flat[number]

    def is_exact(self, number: int) -> bool:
        """Whether a wall is plane, and keeps its direction."""
        if number not in self.exact:
            seen = [
                view
                for shape in self.shapes
                if shape["inside"] and not turns(shape)
                for view in views(shape, np.zeros((1, 3)), 0.0)
                if view.number == number
            ]
            self.exact[number] = bool(seen) and not seen[0].curved
        return self.exact[number]

    def wall_motion(self, new: _Frame, listed: dict[str, Array]) -> Array:
        """(rows,) How far walls come nearer in the step, seen from where the spheres are now."""
        nearer = np.zeros(len(listed["i"]))
        for row in np.flatnonzero(~listed["pair"]).tolist() if self.moves.any() else []:
            k, number = listed["i"][row], listed["wall"][row]
            for shape in filter(moves, self.shapes):
                now = self.seen_by(shape, number, new.x[k : k + 1], new.time)
                if now is not None:
                    later = self.seen_by(shape, number, new.x[k : k + 1], new.time + new.h)
                    assert later is not None
                    nearer[row] = now.distance[0] - later.distance[0]
                    break
        return nearer

    def energy(
        self,
        new: _Frame,
        listed: dict[str, Array],
        after: Array,
        velocity: Array,
        kick: float,
        sizes: Array,
        last: _Frame | None,
    ) -> None:
        """(c) A cluster of mass M: T(V+) <= T(V*) + 1/2 M (10 b)^2 + sum lambda t / h + ...

        b is the largest speed at which an overlap is given back, at most 2 EPS in a regular step. t
        is the target of a contact, here from above. Contacts that pull close gaps; those of
        restitution add half of lambda (n.u* - D / h) where surfaces were parting, with a gap of EPS
        + D: what has turned past one another, or is pushed back to a wall, parts faster, u*, than
        its gap has grown in a step; with `shorten` a cluster of them may add a hundredth of what
        contacts take and give. What moves by itself works.
        """
        if self.facts["warn"]:
            return
        new.listed_all = listed
        # The velocities at the start of a run may be half way through a collision, and slow there.
        if "law restitution" in self.facts["words"] and kick < new.h:
            return
        movable = (new.kind != FROZEN) & (new.kind != OUTSIDE)
        added = kick * self.to_v * (new.force - new.before)
        before = velocity - np.where(movable[:, None], added / new.mass[:, None], 0.0)
        gained = 0.5 * new.mass * ((velocity**2).sum(axis=1) - (before**2).sum(axis=1))
        size = new.mass * (velocity**2 + sizes[:, None] ** 2).sum(axis=1)
        # By so much a turn that the step would make without contacts takes a sphere off its line.
        curved = np.zeros(len(new.mass))
        if new.bodies is not None:
            members = self.members(new)
            mine, body, arm = members.sphere, members.body, members.arm
            v, momentum, mass = new.body_v, new.body_l, new.bodies["mass"]
            impulses = added[mine]
            contacts = kick * self.to_v * listed["total"][mine]
            besides = np.linalg.norm(members.sums(impulses - contacts), axis=1)
            all_of_them = members.sums(np.linalg.norm(impulses, axis=1))
            # Where it is not stopped the rest is a moment that LAMMPS's integrator needs.
            none_besides = (besides <= ROUND_OFF * all_of_them)[body, None]
            impulses = np.where(none_besides, contacts, impulses)
            v_before = v - members.sums(impulses) / mass[:, None]
            l_before = momentum - members.sums(cross(arm, impulses))
            spin, spin_before = self.spin(new, momentum), self.spin(new, l_before)
            before[mine] = v_before[body] + cross(spin_before[body], arm)
            angle = new.h * np.linalg.norm(spin_before, axis=1)
            bend = np.minimum(0.5 * angle**2, 2.0)
            curved[mine] = np.linalg.norm(arm, axis=1) * bend[body]
            turning = (momentum * spin).sum(axis=1), (l_before * spin_before).sum(axis=1)
            gained[mine] = 0.0
            gained[members.first] = 0.5 * (
                mass * ((v**2).sum(axis=1) - (v_before**2).sum(axis=1)) + turning[0] - turning[1]
            )
            size[members.first] += np.abs(turning[0]) + np.abs(turning[1])
        i, j, pair, n = listed["i"], listed["j"], listed["pair"], listed["n"]
        impulse = listed["force"] * kick * self.to_v
        other = np.where(pair, j, i)
        motion = self.wall_motion(new, listed)
        u = (n * (velocity[i] - np.where(pair[:, None], velocity[j], 0.0))).sum(axis=1)
        u_before = (n * (before[i] - np.where(pair[:, None], before[j], 0.0))).sum(axis=1)
        u, u_before = u - motion / new.h, u_before - motion / new.h
        deep = (listed["gap"] < 0) & (impulse > 0)
        self.longest = max(self.longest, new.h)
        speed = min(u[deep].max(initial=0.0), REGULAR * self.eps / self.longest)
        change = new.h * np.linalg.norm(velocity - before, axis=1)
        lightest = np.where(movable, 1 / new.mass, 0.0)
        load = np.abs(impulse) * new.h * (lightest[i] + np.where(pair, lightest[j], 0.0))
        large = np.maximum(change[i], change[other]) + new.h * np.abs(u_before) + load / 50000
        # What the first guess, the forces of the step before, would do.
        guessed = self.forces_before(new, last) * kick * self.to_v * new.h / new.mass
        guessed[~movable] = 0.0
        large += guessed[i] + np.where(pair, guessed[j], 0.0)
        target = np.minimum(self.eps, ACCURACY * large) + 100 * ROUND_OFF * (
            self.lengths(new) + new.h * np.abs(u)
        )
        allowed = np.where(impulse > 0, np.abs(impulse) * target / new.h, 0.0)
        # A pull closes by up to the accuracy, 1e-3, of what it stops, or of a tenth of what it did,
        # or by as much as turning surfaces would part.
        closes = np.maximum(self.eps, np.maximum(16 * ACCURACY * large, new.h * u_before))
        closes += np.maximum(0, listed["gap"])
        pulls = impulse < 0
        allowed[pulls] += np.abs(impulse[pulls]) * closes[pulls] / new.h
        allowed += np.maximum(0, impulse * motion) / new.h
        if "law restitution" in self.facts["words"]:
            # A gap within EPS counts as closed where it is, and stays so until the surfaces have
            # parted by EPS more (docs/method/tolerances.md).
            open_by = np.maximum(0, listed["gap"] - self.eps)
            turned = np.where(u_before > 0, u_before - open_by / new.h, 0.0)
            # Where a curved wall is met in several places it is left in all of them as asked for.
            met = np.column_stack([i, listed["wall"]])
            _, which, places = np.unique(met, axis=0, return_inverse=True, return_counts=True)
            several = ~pair & (places[which.ravel()] > 1)
            left = np.where(several, np.maximum(0, u) + np.maximum(0, u_before), 0.0)
            allowed += 0.5 * np.maximum(0, impulse) * np.maximum(np.maximum(0, turned), left)
            # docs/reference/laws.md: a hundredth of what contacts take and give; else it is halved.
            if "shorten" in self.facts["words"]:
                allowed += 0.01 * 0.5 * np.abs(impulse) * (np.abs(u) + np.abs(u_before))
        for side, sign in ((i, -1.0), (other, 1.0)):
            frozen = new.kind[side] == FROZEN
            work = sign * (n[frozen] * velocity[side[frozen]]).sum(axis=1)
            allowed[frozen] += np.maximum(0, impulse[frozen] * work)
        new.gained = _Gained(
            self.clusters(new, listed),
            np.where(movable[i], i, other),
            gained,
            size,
            speed,
            allowed,
            impulse,
            listed["gap"] + new.h * u,
            curved[i] + np.where(pair, curved[j], 0.0),
        )

    @staticmethod
    def forces_before(new: _Frame, last: _Frame | None) -> Array:
        """The sum of what contacts did to each sphere in the step before; inf where not known."""
        if last is None or last.listed_all is None:
            return np.full(len(new.mass), np.inf)
        was, sums = last.listed_all, np.zeros(len(new.mass))
        np.add.at(sums, was["i"], np.abs(was["force"]))
        np.add.at(sums, was["j"][was["pair"]], np.abs(was["force"][was["pair"]]))
        return sums

    def energy_gained(self, new: _Frame, last: _Frame) -> None:
        """(c) What the step before gained; its end tells by how much turning has closed gaps.

        Where bodies turn, or walls curve, velocities have to part surfaces by as much more.
        """
        if last.gained is None or last.listed_all is None:
            return
        of, listed = last.gained, last.listed_all
        acts = of.impulse > 0
        closed = np.zeros(len(acts))
        i, j, pair = listed["i"], listed["j"], listed["pair"]
        end = np.linalg.norm(self.apart(new, i, j), axis=1) - new.radius[i] - new.radius[j]
        closed[pair] = of.end[pair] - end[pair]
        rows = np.flatnonzero(acts & ~pair)
        seen = self.seen_from(new.x[i[rows]], listed["wall"][rows], new.time)
        found = seen.count > 0
        closed[rows[found]] = (of.end[rows] - seen.distance + new.radius[i[rows]])[found]
        closed = np.where(acts, np.maximum(of.curved, closed), of.curved)
        turning = np.abs(of.impulse) * closed / last.h
        cluster = of.clusters.of_sphere[of.sphere]
        for spheres, _ in of.clusters:
            mine = cluster == of.clusters.of_sphere[spheres[0]]
            if not mine.any():
                continue
            self.report.seen["energies"] += 1
            mass = last.mass[spheres].sum()
            most = 0.5 * mass * (10 * of.speed) ** 2 + (of.allowed + turning)[mine].sum()
            more = of.gained[spheres].sum()
            if more > most * (1 + 1e-9) + 10 * ROUND_OFF * of.size[spheres].sum():
                what = (
                    f"in the step before the cluster of {int(last.id[spheres[0]])}, {len(spheres)} "
                    f"spheres, gained {more:.6g}, {most:.6g} allowed"
                )
                self.energy_found.setdefault(new.step, (self.where, what))

    def judge_energy(self, told: int) -> None:
        """(c) Report the steps that gained too much.

        With `shorten` the summary counts those in which halving did not keep collisions from it:
        three that meet at once, of which one has just parted from another.
        """
        may = told if {"law restitution", "shorten"} <= set(self.facts["words"]) else 0
        if len(self.energy_found) > may:
            for where, what in self.energy_found.values():
                self.report.wrong("energy", where, what)
