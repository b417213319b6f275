"""Walls as sets of patches, by the definitions of their shapes: no formula of LAMMPS is used here.

A patch is a piece of a surface: a parallelogram, a disc, the side of a cone or cylinder, a sphere,
a plane. A part is what one `region` command makes: the patches of its closed faces, its solid, and
its motion. A wall is one part, or a union or an intersection of parts: of each patch there is then
only what belongs to the joined surface. All lengths are in units of the deck, angles in radians.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
AXES = "xyz"
# A point of a patch that is nearer to another part's surface than this lies on it: far above
# round-off, far below the tolerances of runs.
ON_SURFACE = 1e-9
# Of coordinates of order 1, with room to spare
ROUND_OFF = 1e-12
# Where a plane is sampled: farther than any grain of a test goes.
PLANE_SAMPLED = 4.0
SAMPLES = 40  # along each of the two parameters of a patch


class Patch(Protocol):
    """A piece of a surface."""

    # Which of the two parameters of `at` go round: 0 and 1 are then the same place.
    periodic: tuple[bool, bool]

    def nearest(self, points: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return the nearest places of the patch, (n, 3), and whether they are on its rim, (n,)."""
        ...

    def at(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """Return the places (n, 3) that belong to parameters (n,), each in [0, 1]."""
        ...


def _unit(vector: ArrayLike) -> FloatArray:
    array = np.asarray(vector, dtype=float)
    return array / np.linalg.norm(array)


def _across(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors that are perpendicular to a unit vector, and to each other."""
    first = _unit(np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))]))
    return first, np.cross(axis, first)


def _about(
    centre: FloatArray, axis: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distance from an axis (n,), place along it (n,), unit vectors away from it (n, 3)."""
    away = points - centre
    along = away @ axis
    flat = away - along[:, None] * axis
    distance = np.linalg.norm(flat, axis=1)
    # All directions are as near; that of a vector of mere round-off need not be perpendicular.
    on_axis = distance < ROUND_OFF
    outward = flat / np.where(on_axis, 1.0, distance)[:, None]
    outward[on_axis] = _across(axis)[0]
    return distance, along, outward


@dataclass(frozen=True, eq=False)
class Parallelogram:
    """The corner + s a + t b, with s and t from 0 to 1."""

    corner: FloatArray
    a: FloatArray
    b: FloatArray
    periodic = (False, False)

    def nearest(self, points: FloatArray) -> tuple[FloatArray, BoolArray]:
        """See Patch."""
        edges = np.array([self.a, self.b])
        parts = (points - self.corner) @ edges.T @ np.linalg.inv(edges @ edges.T)
        within = ((parts > 0) & (parts < 1)).all(axis=1)
        best = self.corner + parts @ edges
        closest = np.where(within, 0.0, np.inf)
        around = [
            self.corner + s * self.a + t * self.b for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))
        ]
        for start, end in pairwise([*around, around[0]]):
            edge = end - start
            part = np.clip((points - start) @ edge / (edge @ edge), 0.0, 1.0)
            place = start + part[:, None] * edge
            distance = np.linalg.norm(points - place, axis=1)
            nearer = distance < closest
            best[nearer], closest = place[nearer], np.minimum(distance, closest)
        return best, ~within

    def at(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """See Patch."""
        return self.corner + u[:, None] * self.a + v[:, None] * self.b


@dataclass(frozen=True, eq=False)
class Plane:
    """All places through a point, perpendicular to a unit vector."""

    through: FloatArray
    normal: FloatArray
    periodic = (False, False)

    def nearest(self, points: FloatArray) -> tuple[FloatArray, BoolArray]:
        """See Patch."""
        height = (points - self.through) @ self.normal
        return points - height[:, None] * self.normal, np.zeros(len(points), dtype=bool)

    def at(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """See Patch."""
        a, b = _across(self.normal)
        places = (2 * u[:, None] - 1) * a + (2 * v[:, None] - 1) * b
        return self.through + PLANE_SAMPLED * places


@dataclass(frozen=True, eq=False)
class Disc:
    """All places within a radius of a centre, perpendicular to a unit vector."""

    centre: FloatArray
    axis: FloatArray
    radius: float
    periodic = (False, True)

    def nearest(self, points: FloatArray) -> tuple[FloatArray, BoolArray]:
        """See Patch."""
        distance, _, outward = _about(self.centre, self.axis, points)
        inwards = np.minimum(distance, self.radius)
        return self.centre + inwards[:, None] * outward, distance >= self.radius

    def at(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """See Patch."""
        a, b = _across(self.axis)
        turn = 2 * np.pi * v[:, None]
        return self.centre + self.radius * u[:, None] * (np.cos(turn) * a + np.sin(turn) * b)


@dataclass(frozen=True, eq=False)
class Side:
    """The side of a cone or a cylinder: from a centre along a unit vector, between two radii."""

    base: FloatArray
    axis: FloatArray
    length: float
    radius_at_base: float
    radius_at_end: float
    periodic = (False, True)

    def nearest(self, points: FloatArray) -> tuple[FloatArray, BoolArray]:
        """See Patch. The nearest place is in the half plane of the axis and the point."""
        distance, along, outward = _about(self.base, self.axis, points)
        widening = self.radius_at_end - self.radius_at_base
        part = (distance - self.radius_at_base) * widening + along * self.length
        part = np.clip(part / (widening**2 + self.length**2), 0.0, 1.0)
        radius = self.radius_at_base + part * widening
        places = self.base + self.length * part[:, None] * self.axis + radius[:, None] * outward
        return places, (part == 0) | (part == 1)

    def at(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """See Patch."""
        a, b = _across(self.axis)
        turn = 2 * np.pi * v[:, None]
        radius = self.radius_at_base + u * (self.radius_at_end - self.radius_at_base)
        around = np.cos(turn) * a + np.sin(turn) * b
        return self.base + self.length * u[:, None] * self.axis + radius[:, None] * around


@dataclass(frozen=True, eq=False)
class Sphere:
    """All places at a distance from a centre."""

    centre: FloatArray
    radius: float
    periodic = (False, True)

    def nearest(self, points: FloatArray) -> tuple[FloatArray, BoolArray]:
        """See Patch."""
        away = points - self.centre
        length = np.linalg.norm(away, axis=1, keepdims=True)
        outward = np.where(length > 0, away / np.where(length > 0, length, 1.0), np.eye(3)[0])
        return self.centre + self.radius * outward, np.zeros(len(points), dtype=bool)

    def at(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """See Patch."""
        polar, turn = np.pi * u, 2 * np.pi * v
        flat = np.sin(polar)
        places = np.stack([flat * np.cos(turn), flat * np.sin(turn), np.cos(polar)], axis=1)
        return self.centre + self.radius * places


@dataclass(frozen=True)
class Motion:
    """Displaced by swing sin(frequency t), turned before by rate t about an axis through a point.

    Attributes
    ----------
    swing : largest displacement, three lengths
    frequency : angle / time
    rate : angle / time
    axis : of the rotation, three numbers
    point : on that axis, three lengths
    """

    swing: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frequency: float = 0.0
    rate: float = 0.0
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def shift(self, time: float) -> FloatArray:
        """Return the displacement at a time, (3,)."""
        return np.array(self.swing) * np.sin(self.frequency * time)

    def rotation(self, time: float) -> Rotation:
        """Return the rotation at a time."""
        return Rotation.from_rotvec(self.rate * time * _unit(self.axis))

    def back(self, points: FloatArray, time: float) -> FloatArray:
        """Return places (n, 3) at a time as they are in the region that has not moved yet."""
        about = np.array(self.point)
        return self.rotation(time).inv().apply(points - self.shift(time) - about) + about

    def forth(self, points: FloatArray, time: float) -> FloatArray:
        """Return where places (n, 3) of the region that has not moved are at a time."""
        about = np.array(self.point)
        return self.rotation(time).apply(points - about) + about + self.shift(time)


REST = Motion()


@dataclass(frozen=True, eq=False)
class Part:
    """What one `region` command makes.

    Attributes
    ----------
    patches : of the closed faces
    depth : of points (n, 3) in the solid of all faces: positive inside, negative outside; of its
        size only the sign and the place of zero are exact
    outside : whether grains are outside (`side out`)
    has_open_faces : grains may then be anywhere
    motion : of the patches and the solid
    """

    patches: tuple[Patch, ...]
    depth: Callable[[FloatArray], FloatArray]
    outside: bool = False
    has_open_faces: bool = False
    motion: Motion = REST

    def allowed(self, points: FloatArray, time: float = 0.0) -> FloatArray:
        """Depth of points (n, 3) in what is left for grains, like `depth`."""
        if self.has_open_faces:
            return np.full(len(points), np.inf)
        inside = self.depth(self.motion.back(points, time))
        return -inside if self.outside else inside


@dataclass(frozen=True, eq=False)
class Seen:
    """All patches of a wall from some points.

    Attributes
    ----------
    distance : (patches, n); infinite where the nearest place of a patch is not of the joined wall
    rim : whether the nearest place is on the rim of the patch, (patches, n)
    """

    distance: FloatArray
    rim: BoolArray


@dataclass(frozen=True, eq=False)
class Wall:
    """One part, or a union or an intersection of the space that several leave for grains.

    In a union or an intersection with `side out`, `outside` tells so, and the parts are those of
    the command.
    """

    parts: tuple[Part, ...]
    joined: str = "single"
    outside: bool = False

    def allowed(self, points: FloatArray, time: float = 0.0) -> FloatArray:
        """Depth of points (n, 3) in what is left for grains."""
        depths = [part.allowed(points, time) for part in self.parts]
        depth = np.max(depths, axis=0) if self.joined == "union" else np.min(depths, axis=0)
        return np.asarray(-depth if self.outside else depth)

    def _belongs(self, k: int, places: FloatArray, time: float) -> BoolArray:
        """Tell which places (n, 3) on part k are on the joined surface."""
        belongs = np.ones(len(places), dtype=bool)
        for other, part in enumerate(self.parts):
            if other == k or part.has_open_faces:
                continue
            depth = part.allowed(places, time)
            belongs &= (depth <= ON_SURFACE) if self.joined == "union" else (depth >= -ON_SURFACE)
        return belongs

    def seen(self, points: FloatArray, time: float = 0.0) -> Seen:
        """Look at all patches as they stand at a time.

        For unions and intersections this leaves out their edges where they are no rims of
        patches, from where the nearest place of the patch is cut off; see `samples`.
        """
        distances, rims = [], []
        for k, part in enumerate(self.parts):
            at_rest = part.motion.back(points, time)
            for patch in part.patches:
                places, rim = patch.nearest(at_rest)
                distance = np.linalg.norm(at_rest - places, axis=1)
                belongs = self._belongs(k, part.motion.forth(places, time), time)
                distances.append(np.where(belongs, distance, np.inf))
                rims.append(rim)
        return Seen(np.array(distances), np.array(rims))

    def samples(self, time: float = 0.0) -> list[FloatArray]:
        """Return places (n, 3) of each patch that are of the joined wall, its edges included."""
        u, v = (grid.ravel() for grid in np.meshgrid(*[np.linspace(0, 1, SAMPLES)] * 2))
        found = []
        for k, part in enumerate(self.parts):
            for patch in part.patches:
                places = part.motion.forth(patch.at(u, v), time)
                found.append(places[self._belongs(k, places, time)])
        return found


# ---------------------------------------------------------------- the shapes of region commands


def _closed(patches: Sequence[Patch], open_faces: Sequence[int]) -> tuple[Patch, ...]:
    return tuple(patch for face, patch in enumerate(patches, 1) if face not in open_faces)


def prism(
    faces: ArrayLike,
    tilt: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    open_faces: Sequence[int] = (),
    outside: bool = False,
    motion: Motion = REST,
) -> Part:
    """Return a parallelepiped, without tilt a block.

    Parameters
    ----------
    faces : lower and upper bounds before tilting, (3, 2), length
    tilt : xy, xz, yz: where the edges along y, z, z lead to in the directions x, x, y
    open_faces : of 1 to 6: xlo, xhi, ylo, yhi, zlo, zhi
    """
    bounds = np.asarray(faces, dtype=float)
    size = bounds[:, 1] - bounds[:, 0]
    xy, xz, yz = tilt
    corner = bounds[:, 0]
    edges = np.array([[size[0], 0, 0], [xy, size[1], 0], [xz, yz, size[2]]])
    patches = [
        Parallelogram(corner + end * edges[k], edges[(k + 1) % 3], edges[(k + 2) % 3])
        for k in range(3)
        for end in (0, 1)
    ]

    def depth(points: FloatArray) -> FloatArray:
        parts = (points - corner) @ np.linalg.inv(edges)
        return np.asarray(np.minimum(parts, 1 - parts).min(axis=1))

    return Part(_closed(patches, open_faces), depth, outside, bool(open_faces), motion)


def plane(
    through: ArrayLike, normal: ArrayLike, *, outside: bool = False, motion: Motion = REST
) -> Part:
    """Return a half space; the inside is where the normal points."""
    patch = Plane(np.asarray(through, dtype=float), _unit(normal))

    def depth(points: FloatArray) -> FloatArray:
        return np.asarray((points - patch.through) @ patch.normal)

    return Part((patch,), depth, outside, motion=motion)


def sphere(
    centre: ArrayLike, radius: float, *, outside: bool = False, motion: Motion = REST
) -> Part:
    """Return a ball."""
    patch = Sphere(np.asarray(centre, dtype=float), radius)

    def depth(points: FloatArray) -> FloatArray:
        return np.asarray(radius - np.linalg.norm(points - patch.centre, axis=1))

    return Part((patch,), depth, outside, motion=motion)


def cone(
    axis: str,
    centre: Sequence[float],
    radii: Sequence[float],
    ends: Sequence[float],
    *,
    open_faces: Sequence[int] = (),
    outside: bool = False,
    motion: Motion = REST,
) -> Part:
    """Return a cone, with equal radii a cylinder.

    Parameters
    ----------
    axis : x, y or z
    centre : the other two coordinates of the axis, length
    radii : at the lower and the upper end, length
    ends : places along the axis, length
    open_faces : of 1 to 3: lower cap, upper cap, side
    """
    number = AXES.index(axis)
    along = np.eye(3)[number]
    base = np.insert(np.asarray(centre, dtype=float), number, ends[0])
    length = ends[1] - ends[0]
    caps = [Disc(base + end * length * along, along, radii[end]) for end in (0, 1)]
    patches: list[Patch] = [*caps, Side(base, along, length, radii[0], radii[1])]
    # A tip is a place of the side.
    tips = [face for face, radius in enumerate(radii, 1) if radius == 0]

    def depth(points: FloatArray) -> FloatArray:
        distance, height, _ = _about(base, along, points)
        radius = radii[0] + height / length * (radii[1] - radii[0])
        return np.minimum.reduce([height, length - height, radius - distance])

    closed = _closed(patches, [*open_faces, *tips])
    return Part(closed, depth, outside, bool(open_faces), motion)
