"""Neighbours: which spheres are near each other, and contacts by a distance that is stated.

A contact in a packing that the fix made carries a force. Other simulations' dumps often hold only
the spheres: there a contact can be no more than a gap below some length, and the coordination
number depends on that length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import KDTree

from .bodies import Particles
from .errors import InputError
from .geometry import FloatArray, IntArray, as_box, as_integers, as_spheres

# One reach for all spheres is the fastest up to this ratio of the largest to the smallest radius.
SIMILAR_RADII = 1.5


@dataclass(frozen=True, eq=False)
class DistanceContacts:
    """Contacts by distance: gaps below a criterion. The forces are not known; m may be 0.

    Attributes
    ----------
    sides : (m, 2), indices of the spheres on both sides; the second is -k for wall k, k >= 1.
        These are contact ids if the spheres' ids are 0 to n - 1
    points : (m, 3), in the middle of the gap between two spheres, on the wall for a wall, length
    normals : (m, 3), unit vector from side 2 to side 1
    gaps : (m,), negative where the two overlap, length
    criterion : the gap below which two touch, length
    """

    sides: IntArray
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


def contacts_by_distance(
    positions: ArrayLike,
    radii: ArrayLike,
    criterion: float,
    particles: Particles | None = None,
    walls: ArrayLike | None = None,
) -> DistanceContacts:
    """Find the contacts of spheres whose gaps are below a criterion. Nothing is periodic.

    Spheres of one body never touch each other. Contacts between spheres come first, ordered by
    their sides.

    Parameters
    ----------
    positions : (n, 3), length
    radii : (n,), length; they may differ
    criterion : two touch where |x_i - x_j| - r_i - r_j is below this, and a sphere and a wall
        likewise, length; 0: only what overlaps touches
    particles : which spheres make up which particle; None: all spheres are free
    walls : (3, 2), a box around the spheres: its faces xlo, xhi, ylo, ... are the walls 1 to 6,
        length; None: no walls

    Raises InputError for arrays of other shapes, for a criterion that is negative or not finite,
    and for two centres in one place.
    """
    centres, radius = as_spheres(positions, radii)
    if not (criterion >= 0 and math.isfinite(criterion)):
        raise InputError(f"the gap of a contact must not be negative, and finite: {criterion:g}")
    pairs = near_pairs(centres, radius, criterion)
    if particles is not None:
        particles.checked(centres)
        owner = particles.index
        pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    apart = centres[pairs[:, 0]] - centres[pairs[:, 1]]
    distance = np.linalg.norm(apart, axis=1)
    gaps = distance - radius[pairs].sum(axis=1)
    touch = gaps < criterion
    pairs, apart, distance, gaps = pairs[touch], apart[touch], distance[touch], gaps[touch]
    if (distance == 0).any():
        one, other = pairs[int(np.argmin(distance))]
        raise InputError(f"the centres {one} and {other} are the same: there is no normal")
    normals = apart / distance[:, None]
    points = centres[pairs[:, 1]] + (radius[pairs[:, 1]] + gaps / 2)[:, None] * normals
    if walls is not None:
        at_walls = _wall_contacts(centres, radius, criterion, as_box(walls))
        pairs, points, normals, gaps = (
            np.concatenate(both)
            for both in zip((pairs, points, normals, gaps), at_walls, strict=True)
        )
    return DistanceContacts(pairs, points, normals, gaps, float(criterion))


def near_pairs(centres: FloatArray, radii: FloatArray, gap: float) -> IntArray:
    """Return all pairs of spheres whose gap is at most `gap` >= 0, and some others, (m, 2).

    A pair is a row of indices (i, j) with i < j; each is there once, in ascending order.
    """
    tree = KDTree(centres)
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
