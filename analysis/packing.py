"""Packing fraction: the share of a box's volume that lies inside spheres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import KDTree

from .errors import InputError
from .geometry import FloatArray, as_box, as_spheres

# Points are drawn in batches: the memory stays small, however many are asked for.
BATCH = 250_000


@dataclass(frozen=True)
class PackingFraction:
    """A packing fraction measured by counting random points.

    Attributes
    ----------
    value : share of the points that lie inside a sphere, 0 to 1
    uncertainty : standard deviation of `value` over choices of the points (binomial)
    points : number of points
    """

    value: float
    uncertainty: float
    points: int


def packing_fraction(
    positions: ArrayLike,
    radii: ArrayLike,
    box: ArrayLike,
    *,
    points: int = 1_000_000,
    seed: int = 0,
) -> PackingFraction:
    """Measure the packing fraction in a box with uniform random points.

    Overlaps count once, spheres that stick out of the box with their part inside. Nothing is
    periodic.

    Parameters
    ----------
    positions : (n, 3), length
    radii : (n,), length
    box : (3, 2), lower and upper bound per axis, length
    points : number of random points
    seed : of numpy's default generator
    """
    centres, radius = as_spheres(positions, radii)
    bounds = as_box(box)
    if points < 1:
        raise InputError(f"at least one point is needed, not {points}")

    size = radius[:, None]
    reaches_box = np.all(
        (centres + size > bounds[:, 0]) & (centres - size < bounds[:, 1]),
        axis=1,
    )
    if not reaches_box.any():
        return PackingFraction(0.0, 0.0, points)
    covers = _Cover(centres[reaches_box], radius[reaches_box])

    generator = np.random.default_rng(seed)
    inside = 0
    for start in range(0, points, BATCH):
        batch = min(BATCH, points - start)
        inside += covers.count(generator.uniform(bounds[:, 0], bounds[:, 1], (batch, 3)))
    value = inside / points
    return PackingFraction(value, math.sqrt(value * (1 - value) / points), points)


class _Cover:
    """The union of spheres of any radii, as one nearest-neighbour search in four dimensions.

    The nearest centre decides nothing when the radii differ. A point p is in sphere i exactly if
    |p - c_i|^2 - r_i^2 <= 0. With R the largest radius and a fourth coordinate
    w_i = sqrt(R^2 - r_i^2) for centres and 0 for points, this is |p - c_i|^2 + w_i^2 <= R^2: the
    nearest centre in four dimensions is the sphere in which p lies deepest.
    """

    def __init__(self, centres: FloatArray, radii: FloatArray) -> None:
        self._largest = float(radii.max())
        lift = np.sqrt(self._largest**2 - radii**2)
        self._tree = KDTree(np.column_stack([centres, lift]))

    def count(self, points: FloatArray) -> int:
        """Count the points, (k, 3), that lie in a sphere."""
        lifted = np.column_stack([points, np.zeros(len(points))])
        # Points without a neighbour within the bound come back at infinity.
        distance, _ = self._tree.query(lifted, distance_upper_bound=self._largest)
        return int(np.count_nonzero(np.isfinite(distance)))
