"""Neighbours: which spheres are near each other, and contacts by a distance that is stated.

A contact in a packing that the fix made carries a force. Other simulations' dumps often hold only
the spheres: there a contact can be no more than a gap below some length, and the coordination
number depends on that length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .errors import InputError
from .geometry import BoolArray, FloatArray, IntArray, as_integers, as_walls
from .spheres import Spheres, takes_spheres

# One reach for all spheres is the fastest up to this ratio of the largest to the smallest radius.
SIMILAR_RADII = 1.5


@dataclass(frozen=True, eq=False)
class DistanceContacts:
    """Contacts by distance: gaps below a criterion. The forces are not known; m may be 0.

    Attributes
    ----------
    sides : (m, 2), indices of the spheres on both sides; the second is -k for wall k, k >= 1.
        These are contact ids if the spheres' ids are 0 to n - 1
    images : (m, 3), by how many periods of the cell the second sphere is moved; 0 for a wall
    points : (m, 3), in the middle of the gap between two spheres, on the wall for a wall, length
    normals : (m, 3), unit vector from side 2 to side 1
    gaps : (m,), negative where the two overlap, length
    criterion : the gap below which two touch, length
    """

    sides: IntArray
    images: IntArray
    points: FloatArray
    normals: FloatArray
    gaps: FloatArray
    criterion: float

    def ids(self, sphere_ids: ArrayLike) -> IntArray:
        """Return the sides as (m, 2) ids, as in a `ContactFrame`; -k stays for wall k.

        Parameters
        ----------
        sphere_ids : (n,), ids of the spheres in the order of the indices

        Raises InputError for an array of another shape, or with fewer ids than spheres in contact.
        """
        number = as_integers(sphere_ids, "sphere ids")
        if number.ndim != 1 or len(number) <= self.sides.max(initial=-1):
            raise InputError(
                f"sphere ids must be those of all spheres, not of shape {number.shape}"
            )
        between_spheres = self.sides >= 0
        return np.where(
            between_spheres, number[np.where(between_spheres, self.sides, 0)], self.sides
        )


@takes_spheres
def contacts_by_distance(
    spheres: Spheres, criterion: float, walls: ArrayLike | None = None
) -> DistanceContacts:
    """Find the contacts of spheres whose gaps are below a criterion, across periodic faces too.

    Spheres of one body never touch each other, but may touch an image of their body; a sphere may
    touch several images of another. Contacts between spheres come first, ordered by their sides.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    criterion : two touch where |x_i - x_j| - r_i - r_j is below this, and a sphere and a wall
        likewise, length; 0: only what overlaps touches
    walls : (3, 2), a box around the spheres: its faces xlo, xhi, ylo, ... are the walls 1 to 6,
        infinite where there is none, length; None: no walls

    Raises InputError for a criterion that is negative or not finite, for walls of another shape,
    and for two centres in one place.
    """
    if not (criterion >= 0 and math.isfinite(criterion)):
        raise InputError(f"the gap of a contact must not be negative, and finite: {criterion:g}")
    centres, radius = spheres.positions, spheres.radii
    near = near_pairs(spheres, criterion)
    apart = near.apart(spheres)
    distance = np.linalg.norm(apart, axis=1)
    gaps = distance - (radius[near.first] + radius[near.second])
    touch = (gaps < criterion) & near.between_particles(spheres)
    near, apart, distance, gaps = near[touch], apart[touch], distance[touch], gaps[touch]
    if (distance == 0).any():
        closest = int(np.argmin(distance))
        raise InputError(
            f"the centres {near.first[closest]} and {near.second[closest]} are the same: there is "
            "no normal"
        )
    normals = apart / distance[:, None]
    other = near.places(spheres)
    points = other + (radius[near.second] + gaps / 2)[:, None] * normals
    sides, images = np.column_stack([near.first, near.second]), near.images
    if walls is not None:
        at_walls = _wall_contacts(centres, radius, criterion, as_walls(walls))
        images = np.concatenate([images, np.zeros((len(at_walls[0]), 3), dtype=np.int64)])
        sides, points, normals, gaps = (
            np.concatenate(both)
            for both in zip((sides, points, normals, gaps), at_walls, strict=True)
        )
    return DistanceContacts(sides, images, points, normals, gaps, float(criterion))


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of spheres that are near each other, each once, in ascending order.

    Attributes
    ----------
    first, second : (m,), indices of both spheres, first <= second; the same for a sphere and its
        own image
    images : (m, 3), by how many periods of the cell the second sphere is moved
    """

    first: IntArray
    second: IntArray
    images: IntArray

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.first)

    def __getitem__(self, rows: IntArray | BoolArray) -> Pairs:
        """Return some of the pairs."""
        return Pairs(self.first[rows], self.second[rows], self.images[rows])

    def places(self, spheres: Spheres) -> FloatArray:
        """Return where the second sphere of each pair is, (m, 3), length."""
        places = spheres.positions[self.second]
        if spheres.cell is None or not spheres.has_images:
            return places
        moved: FloatArray = places + self.images @ spheres.cell.vectors
        return moved

    def apart(self, spheres: Spheres) -> FloatArray:
        """Return the first centre less the second one of each pair, (m, 3), length."""
        difference: FloatArray = spheres.positions[self.first] - self.places(spheres)
        return difference

    def between_particles(self, spheres: Spheres) -> BoolArray:
        """Say which pairs are of two particles, or of a particle and its own image, (m,)."""
        owner = spheres.particles.index
        apart: BoolArray = (owner[self.first] != owner[self.second]) | self.images.any(axis=1)
        return apart


def near_pairs(spheres: Spheres, gap: float) -> Pairs:
    """Return all pairs of spheres whose gap is at most `gap` >= 0, and some others.

    Two spheres may be a pair by several images of the second; each is there once.

    Parameters
    ----------
    spheres : the spheres; those of one particle make pairs, too
    gap : length

    Raises InputError for too many images.
    """
    cell, centres, radii = spheres.cell, spheres.positions, spheres.radii
    count = len(centres)
    if cell is None or not cell.has_images:
        one, other = pairs_among(centres, radii, gap).T
        return Pairs(one, other, np.zeros((len(one), 3), dtype=np.int64))
    inside = cell.wrapped(centres)
    # By how many periods each sphere was moved into the cell.
    home = np.rint((inside - centres) @ np.linalg.inv(cell.vectors)).astype(np.int64)
    owner, moves = cell.images_near_cell(inside, radii + float(radii.max()) + gap)
    everywhere = np.concatenate([inside, inside[owner] + moves @ cell.vectors])
    owner = np.concatenate([np.arange(count), owner])
    moves = np.concatenate([np.zeros((count, 3), dtype=np.int64), moves])
    near = pairs_among(everywhere, radii[owner], gap)
    # The first is in its own place now: images among themselves are pairs a period away.
    near = near[near[:, 0] < count]
    one, other, images = near[:, 0], owner[near[:, 1]], moves[near[:, 1]]
    # A pair across a face is found from both sides, a sphere and its own image twice as well.
    sign = np.sign(images[np.arange(len(images)), np.argmax(images != 0, axis=1)])
    once = (one < other) | ((one == other) & (sign > 0))
    one, other, images = one[once], other[once], images[once]
    images = images + home[other] - home[one]
    order = np.lexsort((images[:, 2], images[:, 1], images[:, 0], other, one))
    return Pairs(one[order], other[order], images[order])


def pairs_among(centres: FloatArray, radii: FloatArray, gap: float) -> IntArray:
    """Return all pairs of spheres whose gap is at most `gap` >= 0, and some others, (m, 2).

    Nothing is periodic.

    A pair is a row of indices (i, j) with i < j; each is there once, in ascending order.
    """
    tree = scipy.spatial.KDTree(centres)
    largest = float(radii.max())
    if largest <= SIMILAR_RADII * float(radii.min()):
        pairs = tree.query_pairs(2 * largest + gap, output_type="ndarray").astype(np.int64)
    else:
        # r_i + r_j is at most twice the larger radius: seen from its larger sphere, a near pair is
        # within 2 r + gap. One reach for all would list far too many pairs of small spheres.
        found = tree.query_ball_point(centres, 2 * radii + gap, return_sorted=False)
        larger = np.repeat(np.arange(len(radii)), [len(near) for near in found])
        smaller = np.concatenate(found).astype(np.int64)
        once = (radii[smaller] < radii[larger]) | (
            (radii[smaller] == radii[larger]) & (smaller > larger)
        )
        pairs = np.sort(np.column_stack([larger[once], smaller[once]]), axis=1)
    ordered: IntArray = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    return ordered


def _wall_contacts(
    centres: FloatArray, radii: FloatArray, criterion: float, walls: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """Return sides, points, normals and gaps of the contacts with the faces of a box."""
    parts: list[tuple[IntArray, FloatArray, FloatArray, FloatArray]] = []
    for axis, faces in enumerate(walls):
        for face, inward in zip((0, 1), (1.0, -1.0), strict=True):
            gaps = inward * (centres[:, axis] - faces[face]) - radii
            touching = np.flatnonzero(gaps < criterion)
            sides = np.column_stack([touching, np.full(len(touching), -(2 * axis + face + 1))])
            points = centres[touching]
            points[:, axis] = faces[face]
            normals = np.zeros((len(touching), 3))
            normals[:, axis] = inward
            parts.append((sides, points, normals, gaps[touching]))
    sides, points, normals, gaps = (np.concatenate(part) for part in zip(*parts, strict=True))
    return sides, points, normals, gaps
