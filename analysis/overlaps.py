"""Largest overlap, from positions and radii alone: nothing here comes from the contact solver.

A depth is positive where two things overlap, minus the gap; 0 means that nothing overlaps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError
from .geometry import as_box, as_integers, as_spheres
from .neighbours import near_pairs

FACES = ("xlo", "xhi", "ylo", "yhi", "zlo", "zhi")


@dataclass(frozen=True)
class PairOverlap:
    """The deepest overlap between two spheres.

    Attributes
    ----------
    depth : r_i + r_j - |x_i - x_j| > 0, length; 0 if no two spheres overlap
    pair : indices (i, j) with i < j, or None
    """

    depth: float
    pair: tuple[int, int] | None


@dataclass(frozen=True)
class WallOverlap:
    """The deepest overlap of a sphere with a face of its container.

    Attributes
    ----------
    depth : r minus the distance of the centre from the face > 0, length; 0 if there is no overlap
    particle : index of the sphere, or None
    face : xlo, xhi, ylo, yhi, zlo or zhi, or None
    """

    depth: float
    particle: int | None
    face: str | None


def largest_pair_overlap(
    positions: ArrayLike, radii: ArrayLike, bodies: ArrayLike | None = None
) -> PairOverlap:
    """Find the two spheres that overlap most. Nothing is periodic.

    Parameters
    ----------
    positions : (n, 3), length
    radii : (n,), length
    bodies : (n,), body of each sphere, 0 for none; spheres of one body may overlap freely

    Raises InputError for arrays of other shapes.
    """
    centres, radius = as_spheres(positions, radii)
    count = len(radius)
    first, second = near_pairs(centres, radius, 0.0).T
    if bodies is not None:
        body = as_integers(bodies, "bodies")
        if body.shape != (count,):
            raise InputError(f"bodies must have shape ({count},), not {body.shape}")
        free = (body[first] != body[second]) | (body[first] == 0)
        first, second = first[free], second[free]
    distance = np.linalg.norm(centres[first] - centres[second], axis=1)
    depth = radius[first] + radius[second] - distance
    if len(depth) == 0 or depth.max() <= 0:
        return PairOverlap(0.0, None)
    deepest = np.argmax(depth)
    return PairOverlap(float(depth[deepest]), (int(first[deepest]), int(second[deepest])))


def largest_wall_overlap(
    positions: ArrayLike, radii: ArrayLike, container: ArrayLike
) -> WallOverlap:
    """Find the sphere that overlaps most with one of the six planes that bound a container.

    Parameters
    ----------
    positions : (n, 3), length
    radii : (n,), length
    container : (3, 2), lower and upper plane per axis, length; the spheres belong between them

    Raises InputError for arrays of other shapes.
    """
    centres, radius = as_spheres(positions, radii)
    planes = as_box(container)
    size = radius[:, None]
    # The depths have the shape (n, 3, 2); the last two axes run in the order of FACES.
    depth = np.stack([size - (centres - planes[:, 0]), size - (planes[:, 1] - centres)], axis=2)
    particle, face = divmod(int(np.argmax(depth)), len(FACES))
    deepest = float(depth.max())
    if deepest <= 0:
        return WallOverlap(0.0, None, None)
    return WallOverlap(deepest, particle, FACES[face])
