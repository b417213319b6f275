"""Contacts in space: from which sphere to which image of another, or to which point of a wall.

A contact dump names two spheres and the contact point. Across a periodic face one of the two is an
image, and only the point tells which: so it is found here, for drawings and for other programs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .coordination import contact_sides
from .errors import InputError
from .geometry import FloatArray, IntArray, as_floats
from .spheres import Spheres, takes_spheres


@dataclass(frozen=True, eq=False)
class ContactLines:
    """The lines between the centres of spheres in contact, or from a centre to a wall.

    Attributes
    ----------
    sides : (m, 2), indices of the spheres on both sides; the second is -k for wall k
    images : (m, 3), by how many periods of the cell the second sphere is moved; 0 for a wall
    ends : (m, 2, 3), centre of the first sphere, in its own place, and that of the image of the
        second, or the contact point on a wall, length
    """

    sides: IntArray
    images: IntArray
    ends: FloatArray


@takes_spheres
def contact_lines(
    contact_ids: ArrayLike, sphere_ids: ArrayLike, spheres: Spheres, points: ArrayLike
) -> ContactLines:
    """Find where both ends of contacts are.

    Parameters
    ----------
    contact_ids : (m, 2), such as `ContactFrame.ids`: the second is -k for wall k
    sphere_ids : (n,), ids of the spheres, in their order
    spheres : the spheres, the particles that they make up, and their cell
    points : (m, 3), contact points, such as `ContactFrame.points`, in any image, length

    Raises InputError as `contact_sides` does, and for points of another shape or not finite.
    """
    places = as_floats(points, "contact points")
    sides = contact_sides(contact_ids, sphere_ids, images=spheres.has_images)
    if places.shape != (len(sides), 3):
        raise InputError(f"contact points must have shape ({len(sides)}, 3), not {places.shape}")
    if not np.isfinite(places).all():
        raise InputError("contact points hold NaN or infinity")
    first, at_wall = sides[:, 0], sides[:, 1] < 0
    second = np.where(at_wall, first, sides[:, 1])
    starts, ends = spheres.positions[first], spheres.positions[second]
    images = np.zeros((len(sides), 3), dtype=np.int64)
    if spheres.cell is not None and spheres.has_images:
        cell = spheres.cell
        # A contact point is nearer to the image of a sphere that it belongs to than to others. One
        # image of the point belongs to the first sphere in its own place. It may lie half-way
        # between two images of the second, or of the same sphere: that one is touched whose centre
        # is on the other side of the point.
        arms = cell.nearest(places - starts)
        near = starts + arms
        length = np.linalg.norm(arms, axis=1)
        beyond = arms * (spheres.radii[second] / np.where(length > 0, length, 1))[:, None]
        images = cell.nearest_images(ends - (near + beyond))
        images[at_wall] = 0
        ends = ends + images @ cell.vectors
        places = near
    ends = np.where(at_wall[:, None], places, ends)
    return ContactLines(sides, images, np.stack([starts, ends], axis=1))
