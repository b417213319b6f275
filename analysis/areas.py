"""Exact areas of discs and dimers of discs cut by rectangles: packings in two dimensions.

A rectangle cuts a disc into a figure bounded by straight edges and by arcs. Seen from the disc's
centre, its area is a signed sum over the edges of the cutting polygon and over each edge's ends: of
the disc's part in the triangle whose corners are the centre, its foot on the line of the edge, and
the end. Two distances and the radius say everything; see `_disc_in_triangles`. Nothing depends on
how the rectangle lies to the disc.

A dimer, the union of two discs, is cut by the line on which the two circles meet: on each side lies
a part of one disc only, and a rectangle cut by a line is a polygon, too. The pieces are those of
`volumes.py`, whose spheres have their centres in a plane of constant z: there the circles meet
where the spheres do.
"""

from __future__ import annotations

import numpy as np

from .errors import InputError
from .geometry import BoolArray, FloatArray
from .volumes import BLOCK, Pieces

# Counterclockwise around a rectangle, its lower and upper edge along x and its left and right edge
# along y run up (1) or down (-1) their axis.
TURNS = (((1,), (-1,)), ((-1,), (1,)))


def areas(pieces: Pieces) -> FloatArray:
    """Return the pieces' areas, (m,), length^2: the segment beyond the line is cut off.

    Parameters
    ----------
    pieces : discs, whole or cut by a line in their plane of constant z

    Raises InputError for a line out of that plane: the two spheres of a dimer differ in z.
    """
    tilted = np.flatnonzero(pieces.normals[:, 2])
    if len(tilted):
        raise InputError(
            "areas are those of discs and dimers in a plane of constant z: the two spheres of "
            f"the particle with index {pieces.particles[tilted[0]]} differ in z"
        )
    radius = pieces.radii
    offset = np.clip(pieces.offsets, -radius, radius)
    # Half of the chord on the line, and half of the angle of the arc that is kept: unlike the
    # cosine, the tangent gives it exactly where the line all but touches the circle.
    half = np.sqrt((radius - offset) * (radius + offset))
    kept: FloatArray = radius**2 * np.arctan2(half, -offset) + offset * half
    return kept


def areas_in(pieces: Pieces, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return the area of each piece in a rectangle of its own, (m,), length^2.

    The areas are exact up to rounding, about 1e-15 r^2, however the rectangle cuts the pieces. A
    disc that reaches over no edge counts as `areas` has it, to the last bit. Nothing is periodic.

    Parameters
    ----------
    pieces : discs, whole or cut by a line in their plane of constant z
    lower, upper : (m, 2) or (2,), bounds of the rectangles, which may be infinite, length; a third
        column, of z, does not matter. A rectangle with a lower bound that is not below the upper
        one is empty.

    Raises InputError as `areas` does.
    """
    radius = pieces.radii
    centres, size = pieces.centres[:, :2], radius[:, None]
    # An edge beyond the radius cannot cut the disc: it may come closer. With this, rounding is that
    # of lengths up to the radius, however large the rectangle is.
    low = np.clip(lower[..., :2] - centres, -size, size)
    high = np.clip(upper[..., :2] - centres, -size, size)
    offset = np.clip(pieces.offsets, -radius, radius)
    # An area that is exactly nothing, the piece or the rectangle is not left to rounding.
    nearest = np.maximum(np.maximum(low, -high), 0)
    farthest = np.maximum(-low, high)
    squared = radius**2
    apart: BoolArray = np.any(low >= high, axis=1) | ((nearest**2).sum(axis=1) >= squared)
    within: BoolArray = np.all((low == -size) & (high == size), axis=1)
    covered = ((farthest**2).sum(axis=1) <= squared) & (offset == radius)
    whole = areas(pieces)
    rectangle = (high - low).prod(axis=1)
    found: FloatArray = np.select([apart, within, covered], [0, whole, rectangle], np.nan)
    rows = np.flatnonzero(~(apart | within | covered))
    for start in range(0, len(rows), BLOCK):
        block = rows[start : start + BLOCK]
        cut = _discs_in_polygons(
            radius[block],
            low[block].T,
            high[block].T,
            pieces.normals[block, :2].T,
            offset[block],
        )
        # Rounding may leave an area a little below zero or above the whole.
        found[block] = np.clip(cut, 0, np.minimum(whole, rectangle)[block])
    return found


def _discs_in_polygons(
    radius: FloatArray, low: FloatArray, high: FloatArray, normal: FloatArray, offset: FloatArray
) -> FloatArray:
    """Return areas of discs in rectangles and behind lines, (m,).

    Every corner of a rectangle is kept or cut off. An edge between a kept and a lost corner ends
    where it meets the line, and there the chord on the line begins or ends. The edge and the chord
    are given the same point, so that the polygon is closed even where rounding decides which corner
    is kept.

    Parameters
    ----------
    radius : (m,)
    low, high : (2, m), bounds of the rectangles from the centres, -radius to radius
    normal : (2, m), unit vectors, out of what is kept; 0 where the offset alone says whether
        everything is kept, radius, or nothing, -radius
    offset : (m,), distance of the lines from the centres along the normals, -radius to radius
    """
    bounds = np.stack([low, high], axis=1)
    outward = np.stack([-low, high], axis=1)
    # `height`, (2, 2, m), is the distance of each corner in front of the line. Sums of floats are
    # monotone, so that no rectangle can have both ends of one diagonal kept and of the other one
    # lost: it has no crossed edge or two.
    x, y = normal[:, None] * bounds
    height = (x - offset)[:, None] + y[None]
    kept = height <= 0
    # The chord runs counterclockwise, too, around what is kept.
    chord = np.stack([-normal[1], normal[0]])
    total = np.zeros_like(radius)
    for along, turn in enumerate(TURNS):
        other = 1 - along
        (lower, upper), beside = bounds[along], bounds[other]
        start, stop = np.moveaxis(height, along, 0)
        starts, stops = np.moveaxis(kept, along, 0)
        crossed = starts != stops
        share = np.where(crossed, start, 0) / np.where(crossed, start - stop, 1)
        crossing = lower + share * (upper - lower)
        # Of an edge that is lost, nothing is left between two equal ends.
        first = np.where(starts, lower, crossing)
        last = np.where(stops, upper, crossing)
        total += _disc_in_triangles(outward[other], last, radius).sum(axis=0)
        total -= _disc_in_triangles(outward[other], first, radius).sum(axis=0)
        # The chord begins where the boundary leaves what is kept, and ends where it comes back.
        sign = (stops.astype(float) - starts) * turn
        end = chord[along] * crossing + chord[other] * beside
        total += (sign * _disc_in_triangles(offset, end, radius)).sum(axis=0)
    return total


def _disc_in_triangles(edge: FloatArray, end: FloatArray, radius: FloatArray) -> FloatArray:
    """Return signed areas of discs in triangles with a right angle, length^2.

    The corners are the disc's centre, its foot on a line at the distance h, and the point of the
    line t further on. The area is odd in each distance.

    Within the disc, up to t^2 = r^2 - h^2, it is that of a triangle, h t / 2; beyond, that of a
    sector: r^2 / 2 times the angle that the rest of the line takes up.

    Parameters
    ----------
    edge : h, -radius to radius
    end : t
    radius : r
    """
    height = abs(edge)
    reach = np.sqrt((radius - height) * (radius + height))
    inner = np.clip(end, -reach, reach)
    angle = np.arctan2(end, height) - np.arctan2(inner, height)
    signed: FloatArray = (edge * inner + np.sign(edge) * radius**2 * angle) / 2
    return signed
