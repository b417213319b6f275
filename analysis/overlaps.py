"""Largest overlap, from positions and radii alone: nothing here comes from the contact solver.

A depth is positive where two things overlap, minus the gap; 0 means that nothing overlaps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .geometry import as_walls
from .neighbours import near_pairs
from .spheres import Spheres, takes_spheres

FACES = ("xlo", "xhi", "ylo", "yhi", "zlo", "zhi")


@dataclass(frozen=True)
class PairOverlap:
    """The deepest overlap between two spheres.

    Attributes
    ----------
    depth : r_i + r_j - |x_i - x_j| > 0, length; 0 if no two spheres overlap
    pair : indices (i, j) with i < j, or None; i = j for a sphere and its own image
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


@takes_spheres
def largest_pair_overlap(spheres: Spheres) -> PairOverlap:
    """Find the two spheres of different particles that overlap most, across periodic faces too.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell: spheres of one body may
        overlap freely, but not with an image of their body

    Raises InputError for too many images.
    """
    near = near_pairs(spheres, 0.0)
    near = near[near.between_particles(spheres)]
    distance = np.linalg.norm(near.apart(spheres), axis=1)
    depth = spheres.radii[near.first] + spheres.radii[near.second] - distance
    if len(depth) == 0 or depth.max() <= 0:
        return PairOverlap(0.0, None)
    deepest = np.argmax(depth)
    return PairOverlap(float(depth[deepest]), (int(near.first[deepest]), int(near.second[deepest])))


@takes_spheres
def largest_wall_overlap(spheres: Spheres, container: ArrayLike) -> WallOverlap:
    """Find the sphere that overlaps most with one of the planes that bound a container.

    Parameters
    ----------
    spheres : the spheres
    container : (3, 2), lower and upper plane per axis, infinite where there is none, length; the
        spheres belong between them

    Raises InputError for an array of another shape.
    """
    planes = as_walls(container)
    centres, size = spheres.positions, spheres.radii[:, None]
    # The depths have the shape (n, 3, 2); the last two axes run in the order of FACES.
    depth = np.stack([size - (centres - planes[:, 0]), size - (planes[:, 1] - centres)], axis=2)
    particle, face = divmod(int(np.argmax(depth)), len(FACES))
    deepest = float(depth.max())
    if deepest <= 0:
        return WallOverlap(0.0, None, None)
    return WallOverlap(deepest, particle, FACES[face])
