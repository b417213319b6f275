"""Exact volumes of spheres and dimers cut by boxes.

A box cuts a ball into a solid bounded by planes and by the sphere. Seen from the ball's centre, the
solid is a signed sum of pieces over the faces of the cutting polyhedron and over each face's edges:
the ball inside the tetrahedron whose corners are the centre, its foot on the plane of the face, the
foot of that on the line of the edge, and an end of the edge. Three of these distances and the
radius say everything; see `_ball_in_tetrahedra`. Nothing depends on how the box lies to the ball.

A dimer, the union of two balls, is cut by the plane on which the two spheres meet: on each side
lies a part of one ball only, and a box cut by a plane is a polyhedron, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import ArrayLike

from .bodies import Particles, dimer_spheres
from .errors import InputError
from .geometry import BoolArray, FloatArray, IntArray, as_box
from .spheres import Spheres, takes_spheres

# Rows are worked off in blocks: the temporary arrays of one fit into a processor's cache.
BLOCK = 2048


@dataclass(frozen=True, eq=False)
class Pieces:
    """Balls, each whole or cut by one plane, that fill particles without overlap within one.

    Attributes
    ----------
    centres : (m, 3), of the balls, length
    radii : (m,), of the balls, length
    normals : (m, 3), unit vector normal to the plane, out of the piece; 0 for a whole ball
    offsets : (m,), distance of the plane from the centre along the normal, -r to r, length;
        infinity for a whole ball
    particles : (m,), index of the particle that the piece belongs to
    """

    centres: FloatArray
    radii: FloatArray
    normals: FloatArray
    offsets: FloatArray
    particles: IntArray

    def __len__(self) -> int:
        """Return the number of pieces."""
        return len(self.radii)

    def __getitem__(self, rows: IntArray | BoolArray) -> Pieces:
        """Return some of the pieces; an index may come more than once."""
        return Pieces(
            self.centres[rows],
            self.radii[rows],
            self.normals[rows],
            self.offsets[rows],
            self.particles[rows],
        )

    def volumes(self) -> FloatArray:
        """Return the pieces' volumes, (m,), length^3: the cap beyond the plane is cut off."""
        offset = np.minimum(self.offsets, self.radii)
        cap = np.pi / 3 * (self.radii - offset) ** 2 * (2 * self.radii + offset)
        return 4 / 3 * np.pi * self.radii**3 - cap

    def volumes_in(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return the volume of each piece in a box of its own, (m,), length^3.

        Parameters
        ----------
        lower, upper : (m, 3) or (3,), bounds of the boxes, lower < upper, length
        """
        shape = self.centres.shape
        low = np.broadcast_to(lower, shape) - self.centres
        high = np.broadcast_to(upper, shape) - self.centres
        size = self.radii[:, None]
        # A volume that is exactly nothing, the piece or the box is not left to rounding.
        nearest = np.maximum(np.maximum(low, -high), 0)
        farthest = np.maximum(-low, high)
        squared = self.radii**2
        apart = (nearest**2).sum(axis=1) >= squared
        within: BoolArray = np.all((low <= -size) & (high >= size), axis=1)
        covered = ((farthest**2).sum(axis=1) <= squared) & np.isinf(self.offsets)
        volumes = np.zeros(len(self))
        volumes[within] = self[within].volumes()
        volumes[covered] = (high - low)[covered].prod(axis=1)
        is_cut = ~(apart | within | covered)
        for whole in (True, False):
            rows = np.flatnonzero(is_cut & (np.isinf(self.offsets) == whole))
            for start in range(0, len(rows), BLOCK):
                block = rows[start : start + BLOCK]
                radius = self.radii[block]
                # A face beyond the radius cannot cut the ball: it may come closer. With this,
                # rounding is that of lengths up to the radius, however large the box is.
                bounds = (
                    np.clip(low[block].T, -radius, radius),
                    np.clip(high[block].T, -radius, radius),
                )
                if whole:
                    volumes[block] = _balls_in_boxes(radius, *bounds)
                else:
                    plane = self.normals[block].T, self.offsets[block]
                    volumes[block] = _cut_balls_in_boxes(radius, *bounds, *plane)
        # Rounding may leave a volume a little below zero or above the whole.
        largest = np.minimum(self.volumes(), (high - low).prod(axis=1))
        clipped: FloatArray = np.clip(volumes, 0, largest)
        return clipped


@takes_spheres
def sphere_volumes_in_box(spheres: Spheres, box: ArrayLike) -> FloatArray:
    """Return the volume of each sphere's part in a box, (n,), length^3.

    The volumes are exact up to rounding, about 1e-15 r^3, however the box cuts the spheres. The
    parts of a sphere's images in the box count as its own.

    Parameters
    ----------
    spheres : the spheres, whatever particles they make up, and their cell
    box : (3, 2), lower and upper bound per axis, length

    Raises InputError for a box of another shape, for discs, and for too many images.
    """
    bounds = as_box(box)
    require_balls(spheres)
    images = spheres.around(bounds)
    copies = images.spheres
    volumes = balls(copies.positions, copies.radii).volumes_in(bounds[:, 0], bounds[:, 1])
    sums: FloatArray = np.zeros(len(spheres))
    np.add.at(sums, images.sphere, volumes)
    return sums


@takes_spheres
def particle_volumes_in_box(spheres: Spheres, box: ArrayLike) -> FloatArray:
    """Return the volume of each particle's part in a box, (p,), length^3.

    The volume that both spheres of a dimer cover counts once. The volumes are exact up to rounding,
    about 1e-15 r^3. Bodies of three or more spheres are refused: `packing_fraction` measures these.
    The parts of a particle's images in the box count as its own.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    box : (3, 2), lower and upper bound per axis, length

    Raises InputError for a box of another shape, for a body of three or more spheres, for discs,
    and for too many images.
    """
    bounds = as_box(box)
    require_balls(spheres)
    images = spheres.around(bounds)
    pieces = pieces_of(images.spheres)
    volumes = pieces.volumes_in(bounds[:, 0], bounds[:, 1])
    sums: FloatArray = np.zeros(len(spheres.particles))
    np.add.at(sums, images.particle[pieces.particles], volumes)
    return sums


def balls(centres: FloatArray, radii: FloatArray) -> Pieces:
    """Return each sphere as a piece and a particle of its own."""
    return Pieces(
        centres=centres,
        radii=radii,
        normals=np.zeros_like(centres),
        offsets=np.full_like(radii, np.inf),
        particles=np.arange(len(radii)),
    )


def pieces_of(spheres: Spheres) -> Pieces:
    """Return the pieces of free spheres and dimers; raise InputError for other bodies."""
    centres, radii, particles = spheres.positions, spheres.radii, spheres.particles
    whole = balls(centres, radii)
    require_dimers(particles)
    one, other = dimer_spheres(particles)
    inner, outer = split(centres, radii, one, other)
    normals, offsets = whole.normals, whole.offsets
    for side, sphere in ((inner, one), (outer, other)):
        normals[sphere], offsets[sphere] = side.normals, side.offsets
    # A ball that lies in its partner is covered by it.
    keep = offsets > -np.inf
    return Pieces(centres, radii, normals, offsets, particles.index)[keep]


def require_balls(spheres: Spheres) -> None:
    """Raise InputError for discs of a two-dimensional packing: these have no volume."""
    if spheres.flat:
        raise InputError("the discs of a two-dimensional packing have areas, not volumes")


def require_dimers(particles: Particles) -> None:
    """Raise InputError if there are bodies of three or more spheres."""
    large = np.flatnonzero(particles.sizes > 2)
    if len(large):
        raise InputError(
            "exact volumes and necks are those of spheres and dimers: the number of spheres in "
            f"body {particles.bodies[large[0]]} is {particles.sizes[large[0]]}; "
            "packing_fraction measures any body"
        )


def split(
    centres: FloatArray, radii: FloatArray, one: IntArray, other: IntArray
) -> tuple[Pieces, Pieces]:
    """Return the two parts of the union of two balls, for each of k pairs.

    The plane on which the two spheres meet parts them: each ball keeps the part on its own side.
    Balls that do not meet are whole. If one lies in the other, its offset is minus infinity and the
    other is whole.

    Parameters
    ----------
    centres : (n, 3), length
    radii : (n,), length
    one, other : (k,), indices of the two balls of each pair
    """
    between = centres[other] - centres[one]
    distance = np.linalg.norm(between, axis=1)
    first, second = radii[one], radii[other]
    axis = between / np.where(distance > 0, distance, 1)[:, None]
    # The offset o follows from r1^2 - o^2 = r2^2 - (D - o)^2, the squared radius of the circle on
    # which they meet.
    excess = (first - second) * (first + second) / np.where(distance > 0, 2 * distance, 1)
    offset = np.clip(distance / 2 + excess, -first, first)
    rest = np.clip(distance / 2 - excess, -second, second)
    meet = (distance > abs(first - second)) & (distance < first + second)
    apart = distance >= first + second
    # The first of two equal balls in one place stays.
    stays = apart | (first >= second)
    offset = np.where(meet, offset, np.where(stays, np.inf, -np.inf))
    rest = np.where(meet, rest, np.where(apart | ~stays, np.inf, -np.inf))
    axis = np.where(meet[:, None], axis, 0)
    pair = np.arange(len(one))
    return (
        Pieces(centres[one], first, axis, offset, pair),
        Pieces(centres[other], second, -axis, rest, pair),
    )


def _balls_in_boxes(radius: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return volumes of balls in boxes, (m,).

    Parameters
    ----------
    radius : (m,)
    low, high : (3, m), bounds of the boxes from the centres, -radius to radius
    """
    # The distances of the faces, (3, 2, m), are positive where the centre is on the inner side.
    faces = np.stack([-low, high], axis=1)
    total = np.zeros_like(radius)
    for face, edge, end in permutations(faces):
        parts = _ball_in_tetrahedra(
            face[:, None, None], edge[None, :, None], end[None, None], radius
        )
        total += parts.sum(axis=(0, 1, 2))
    return total


def _cut_balls_in_boxes(
    radius: FloatArray, low: FloatArray, high: FloatArray, normal: FloatArray, offset: FloatArray
) -> FloatArray:
    """Return volumes of balls in boxes and behind planes, (m,).

    Every corner of a box is kept or cut off. An edge between a kept and a lost corner ends where
    it meets the plane. On a face, the two such edges are joined by a chord; the chords bound the
    face that the plane adds. Both faces at an edge or chord are given the same two end points, so
    that the polyhedron is closed even where rounding decides which corner is kept.

    Parameters
    ----------
    radius : (m,)
    low, high : (3, m), bounds of the boxes from the centres, -radius to radius
    normal : (3, m), unit vectors, out of what is kept
    offset : (m,), distance of the planes from the centres along the normals, -radius to radius
    """
    bounds = np.stack([low, high], axis=1)
    outward = np.stack([-low, high], axis=1)
    # `height`, (2, 2, 2, m), is the distance of each corner in front of the plane. Sums of floats
    # are monotone, so that no face can have both ends of one diagonal kept and of the other one
    # lost: each face has no crossed edge or two.
    x, y, z = normal[:, None] * bounds
    height = (x - offset)[:, None, None] + y[None, :, None] + z[None, None]
    total = np.zeros_like(radius)
    leaves, returns = _add_box_edges(total, radius, bounds, outward, height)
    _add_chords(total, radius, outward, normal, offset, leaves, returns)
    return total


def _add_box_edges(
    total: FloatArray,
    radius: FloatArray,
    bounds: FloatArray,
    outward: FloatArray,
    height: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Add the pieces over the parts of the boxes' edges that are kept; return the chords' ends.

    Parameters
    ----------
    total : (m,), the volumes to which the pieces are added
    radius : (m,)
    bounds : (3, 2, m), lower and upper bounds of the boxes from the centres
    outward : (3, 2, m), distances of the faces, positive where the centre is on the inner side
    height : (2, 2, 2, m), distance of each corner in front of the plane; a corner is kept at <= 0

    Returns
    -------
    Two arrays (3, 2, 3, m), by axis and side of a face and by coordinate: the points where the
    boundary of the face, counterclockwise seen along the axis, leaves what is kept, and where it
    comes back
    """
    kept = height <= 0
    leaves = np.zeros((3, 2, 3, len(radius)))
    returns = np.zeros_like(leaves)
    for along in range(3):
        one, other = (along + 1) % 3, (along + 2) % 3
        start, stop = np.moveaxis(height, along, 0)
        starts, stops = np.moveaxis(kept, along, 0)
        crossed = starts != stops
        share = start / np.where(crossed, start - stop, 1)
        lower, upper = bounds[along]
        crossing = lower + share * (upper - lower)
        first = np.where(starts, lower, np.where(stops, crossing, 0))
        last = np.where(stops, upper, np.where(starts, crossing, 0))
        # The axes that are left stand in ascending order in `height`.
        for i, j in product(range(2), repeat=2):
            place = (i, j) if one < other else (j, i)
            begin, end = first[place], last[place]
            for face, edge in (
                (outward[one, i], outward[other, j]),
                (outward[other, j], outward[one, i]),
            ):
                total += _ball_in_tetrahedra(face, edge, end, radius)
                total -= _ball_in_tetrahedra(face, edge, begin, radius)
            point = np.empty((3, len(radius)))
            point[along] = crossing[place]
            point[one], point[other] = bounds[one, i], bounds[other, j]
            out = crossed[place] & starts[place]
            back = crossed[place] & stops[place]
            # Counterclockwise around `other`, whose face has the axes (along, one), edges along
            # the first axis run up at the lower side of the second; around `one`, whose face has
            # the axes (other, along), edges along the second run up at the upper side of the first.
            for axis, side, up in ((other, j, i == 0), (one, i, j == 1)):
                leaves[axis, side] += np.where(out if up else back, point, 0)
                returns[axis, side] += np.where(back if up else out, point, 0)
    return leaves, returns


def _add_chords(
    total: FloatArray,
    radius: FloatArray,
    outward: FloatArray,
    normal: FloatArray,
    offset: FloatArray,
    leaves: FloatArray,
    returns: FloatArray,
) -> None:
    """Add the pieces over the chords that the planes cut into the faces of the boxes.

    Parameters
    ----------
    total : (m,), the volumes to which the pieces are added
    radius, outward : as for `_add_box_edges`
    normal, offset : (3, m) and (m,), as for `_cut_balls_in_boxes`
    leaves, returns : ends of the chords, as `_add_box_edges` returns them
    """
    for axis, side in product(range(3), range(2)):
        # On a lower side, counterclockwise is seen from the other side.
        ends = (leaves, returns) if side else (returns, leaves)
        begin, end = ends[0][axis, side], ends[1][axis, side]
        chord = end - begin
        length = np.sqrt((chord**2).sum(axis=0))
        chord /= np.where(length > 0, length, 1)
        across = np.cross(begin, chord, axis=0)
        from_start, to_end = (begin * chord).sum(axis=0), (end * chord).sum(axis=0)
        for face, edge in (
            (outward[axis, side], across[axis] if side else -across[axis]),
            # The new face lies on the other side of the chord. Run the other way round, it gives
            # the same signs of the ends: the volume is odd in their distances.
            (offset, -(normal * across).sum(axis=0)),
        ):
            total += _ball_in_tetrahedra(face, edge, to_end, radius)
            total -= _ball_in_tetrahedra(face, edge, from_start, radius)


def _ball_in_tetrahedra(
    face: FloatArray, edge: FloatArray, end: FloatArray, radius: FloatArray
) -> FloatArray:
    """Return signed volumes of balls in tetrahedra of three right angles, length^3.

    The corners are the ball's centre, its foot on a plane at the distance d, the foot of that on a
    line in the plane at the distance h, and the point of the line t further on. The volume is odd
    in each distance.

    In the plane, theta is the angle at the foot, from 0 to atan(t / h), and h / cos(theta) = rho
    the distance of the line in that direction. A wedge d(theta) of the tetrahedron is a triangle
    with the angle psi at the centre, tan(psi) = rho / d, and holds of the ball

    - d rho^2 / 6 where the line is in the ball, d^2 + rho^2 <= r^2, and otherwise
    - d (r^2 - d^2) / 6 + r^3 / 3 (d / r - cos(psi)), a cone and beside it a part of the sphere.

    The integrals over theta are elementary: of rho^2, h t; of cos(psi), the angle whose tangent is
    d t / (h sqrt(d^2 + h^2 + t^2)). Beyond t^2 = r^2 - d^2 - h^2 the line is outside the ball.

    Parameters
    ----------
    face : d, -radius to radius
    edge : h
    end : t
    radius : r
    """
    squared = face**2 + edge**2
    reach = np.sqrt(np.maximum(radius**2 - squared, 0))
    inner = np.clip(end, -reach, reach)
    height = abs(edge)
    # The angle of two zeros, which numpy gives as 0, is multiplied by 0 in the end.
    angle = np.arctan2(end, height) - np.arctan2(inner, height)
    arc = np.arctan2(face * end, height * np.sqrt(squared + end**2)) - np.arctan2(
        face * inner, height * np.sqrt(squared + inner**2)
    )
    cone = face * (height * inner + (3 * radius**2 - face**2) * angle) / 6
    volumes: FloatArray = np.sign(edge) * (cone - radius**3 / 3 * arc)
    return volumes
