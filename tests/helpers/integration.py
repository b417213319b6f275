"""Volumes of balls and dimers in boxes by numerical integration: nothing here is the package's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lammps_inelastic.analysis.geometry import FloatArray

# Gauss's rule, with x = -cos(t) on [-1, 1]: what starts like a square root at an end of a piece,
# as everything round does, is smooth in t. 24 points then integrate a piece to rounding.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_ANGLES = (_NODES + 1) * np.pi / 2
POINTS, WEIGHTS = -np.cos(_ANGLES), _WEIGHTS * np.sin(_ANGLES) * np.pi / 2


def integrate(
    function: Callable[[FloatArray], ArrayLike], lower: float, upper: float, breaks: ArrayLike
) -> float:
    """Integrate a function of an array between points at which it need not be smooth."""
    breaks = np.asarray(breaks, dtype=float)
    inner = breaks[(breaks > lower) & (breaks < upper)]  # NaN is left out
    ends = np.r_[lower, np.sort(inner), upper]
    middle, half = (ends[1:] + ends[:-1]) / 2, (ends[1:] - ends[:-1]) / 2
    x = middle[:, None] + half[:, None] * POINTS
    values = np.asarray(function(x.ravel())).reshape(x.shape)
    return float((values @ WEIGHTS * half).sum())


def root(square: float) -> float:
    """Return the square root, NaN where there is none."""
    return np.sqrt(square) if square >= 0 else np.nan


def quadrant(radius: float, y: float, z: float) -> float:
    """Return the area of the disc of this radius where Y < y and Z < z."""
    if radius <= 0:
        return 0.0

    def segment(h: float) -> float:
        """Return the area where the coordinate is below h."""
        h = np.clip(h, -radius, radius)
        return h * root(radius**2 - h**2) + radius**2 * (np.arcsin(h / radius) + np.pi / 2)

    if y**2 + z**2 >= radius**2:
        # The corner is outside of the disc: it takes away one side, both or all.
        if y < 0 and z < 0:
            return 0.0
        if y < 0 or z < 0:
            # In the quadrant beside the disc, nothing; else the side of the smaller one.
            if y < 0:
                return segment(y) if z >= 0 else 0.0
            return segment(z)
        return segment(y) + segment(z) - np.pi * radius**2
    # From the left end of the line Z = z, up to which the whole chord counts, to y.
    left = -root(radius**2 - z**2)

    def half(h: float) -> float:
        return (h * root(radius**2 - h**2) + radius**2 * np.arcsin(h / radius)) / 2

    below = segment(left) if z >= 0 else 0.0
    return below + half(y) - half(left) + z * (y - left)


def ball_in_box(centre: ArrayLike, radius: float, box: ArrayLike) -> float:
    """Return the volume of a ball in a box: the areas of discs in a rectangle, over x."""
    low, high = (np.asarray(box, dtype=float) - np.asarray(centre)[:, None]).T
    (_, y0, z0), (_, y1, z1) = low, high
    squares = [y**2 for y in (y0, y1)] + [z**2 for z in (z0, z1)]
    squares += [y**2 + z**2 for y in (y0, y1) for z in (z0, z1)]
    breaks = [sign * root(radius**2 - square) for square in squares for sign in (-1, 1)]

    def area(x: Any) -> Any:
        discs = np.sqrt(np.maximum(radius**2 - x**2, 0))
        return [
            quadrant(r, y1, z1) - quadrant(r, y0, z1) - quadrant(r, y1, z0) + quadrant(r, y0, z0)
            for r in discs
        ]

    lower, upper = max(low[0], -radius), min(high[0], radius)
    return integrate(area, lower, upper, breaks) if lower < upper else 0.0


def dimer_in_box(centres: ArrayLike, radii: Sequence[float], box: ArrayLike) -> float:
    """Return the volume of the union of two balls in a box: lengths along z, over y, over x."""
    centres, box = np.asarray(centres, dtype=float), np.asarray(box, dtype=float)
    (y0, y1), (z0, z1) = box[1:]
    # The circle on which the spheres meet: its middle, radius and axis.
    axis = centres[1] - centres[0]
    distance = np.linalg.norm(axis)
    axis = axis / distance
    share = (distance**2 + radii[0] ** 2 - radii[1] ** 2) / (2 * distance)
    middle = centres[0] + share * axis
    meet = root(radii[0] ** 2 - share**2)

    breaks = [middle[0] + sign * meet * root(1 - axis[0] ** 2) for sign in (-1, 1)]
    for along in (1, 2):
        # Where the circle crosses the planes of the faces, with the plane's direction in it.
        slope = np.eye(3)[along] - axis[along] * axis
        steep = np.linalg.norm(slope)
        if np.isfinite(meet) and steep > 1e-12:
            other = np.cross(axis, slope / steep)
            for bound in box[along]:
                up = (bound - middle[along]) / steep
                flat = root(meet**2 - up**2)
                breaks += [(middle + up * slope / steep + s * flat * other)[0] for s in (-1, 1)]
    for centre, radius in zip(centres, radii, strict=True):
        dy, dz = box[1:] - centre[1:, None]
        squares = [0, *dy**2, *dz**2, *(y**2 + z**2 for y in dy for z in dz)]
        breaks += [centre[0] + s * root(radius**2 - square) for square in squares for s in (-1, 1)]

    def area(x: Any) -> Any:
        discs = [root(r**2 - (x - c[0]) ** 2) for c, r in zip(centres, radii, strict=True)]
        discs = [0.0 if np.isnan(disc) else disc for disc in discs]
        bounds = []
        for centre, disc in zip(centres, discs, strict=True):
            heights = [disc, *(root(disc**2 - (z - centre[2]) ** 2) for z in (z0, z1))]
            bounds += [centre[1] + s * height for height in heights for s in (-1, 1)]
        # Where the two circles of this plane cross.
        flat = centres[1, 1:] - centres[0, 1:]
        apart = np.linalg.norm(flat)
        if apart > 1e-12:
            part = (apart**2 + discs[0] ** 2 - discs[1] ** 2) / (2 * apart)
            height = root(discs[0] ** 2 - part**2)
            foot = centres[0, 1:] + part * flat / apart
            bounds += [foot[0] + s * height * flat[1] / apart for s in (-1, 1)]

        def length(y: FloatArray) -> FloatArray:
            ends = []
            for centre, disc in zip(centres, discs, strict=True):
                square = disc**2 - (y - centre[1]) ** 2
                half = np.sqrt(np.maximum(square, 0))
                low = np.maximum(centre[2] - half, z0)
                high = np.minimum(centre[2] + half, z1)
                ends.append((low, np.where(square > 0, np.maximum(high, low), low)))
            (low1, high1), (low2, high2) = ends
            both = np.minimum(high1, high2) - np.maximum(low1, low2)
            return high1 - low1 + high2 - low2 - np.maximum(both, 0)

        return integrate(length, y0, y1, bounds)

    low, high = box[0]
    return integrate(lambda x: [area(one) for one in x], low, high, breaks)
