"""The neck of a dimer: the volume near its junction that no sphere of the same size can reach.

Section 3.2 of the paper adds it to the particle by thought (the second curve of its Figure 11). A
sphere of radius r that rolls around the junction of a dimer's two spheres of radius r touches both:
its centre runs on a circle of radius sqrt(4 r^2 - D^2 / 4) around the axis, with D the distance of
the two centres. The neck lies between the two spheres and the torus that the rolling sphere sweeps.
"""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .bodies import dimer_spheres
from .errors import InputError
from .geometry import BoolArray, FloatArray, IntArray
from .packing import Cover, PackingFraction, Region, as_points
from .spheres import Spheres, takes_spheres
from .volumes import require_balls, require_dimers

# Positions in a dump are rounded: two spheres that touch may seem apart by this share of a radius,
# and two equal radii may differ by it.
TOLERANCE = 1e-6


def dimer_volume(radius: float, distance: float) -> float:
    """Return the volume of the union of two equal spheres, length^3.

    Parameters
    ----------
    radius : of both spheres, length
    distance : of their centres, 0 < distance <= 2 radius, length

    Raises InputError for a radius or a distance out of its range.
    """
    _check(radius, distance)
    overlap = max(2 * radius - distance, 0)
    return 8 / 3 * math.pi * radius**3 - math.pi / 12 * (4 * radius + distance) * overlap**2


def neck_volume(radius: float, distance: float) -> float:
    """Return the volume of a dimer's neck, length^3.

    At the height z along the axis, from the junction up to a quarter of the distance D on either
    side, the neck is the ring between the sphere, of squared radius r^2 - (D / 2 - |z|)^2, and the
    torus, of radius sqrt(4 r^2 - D^2 / 4) - sqrt(r^2 - z^2). The integral is

        V = 4 pi r^3 (sin(b) - b cos(b)), sin(b) = D / (4 r).

    Parameters
    ----------
    radius : r, of both spheres, length
    distance : D, of their centres, 0 < distance <= 2 radius, length

    Raises InputError for a radius or a distance out of its range.
    """
    _check(radius, distance)
    angle = math.asin(min(distance / (4 * radius), 0.5))
    # This form of sin(b) - b cos(b) has no cancellation where the angle is small.
    return float(4 * math.pi * radius**3 * angle**2 * scipy.special.spherical_jn(1, angle))


@takes_spheres
def packing_fraction_with_necks(
    spheres: Spheres,
    box: ArrayLike | None = None,
    *,
    points: int = 1_000_000,
    seed: int = 0,
) -> PackingFraction:
    """Measure the share of a box that lies in a sphere or in a dimer's neck, with random points.

    Overlaps, also of necks, count once. Free spheres have no neck; bodies of three or more spheres
    and dimers of unequal spheres are refused. With the same seed, the points are those of
    `packing_fraction`.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    box : (3, 2), lower and upper bound per axis, length; None: the whole cell
    points : number of random points, at least 1
    seed : of numpy's default generator, not negative

    Raises InputError for a box of another shape, for points or a seed that are not such whole
    numbers, for bodies without a neck, for discs, and for too many images.
    """
    as_points(points, seed)
    require_balls(spheres)
    region = Region(spheres, box)
    _dimers_with_necks(spheres)
    # A neck lies within a radius of the middle of its dimer, so within the dimer's own extent.
    copies = region.around(0.0)
    if len(copies) == 0:
        return PackingFraction(0.0, 0.0, points)
    cover = Cover(copies.positions, copies.radii)
    necks = _Necks(copies.positions, copies.radii, *_dimers_with_necks(copies))

    def holds(drawn: FloatArray) -> BoolArray:
        inside = cover.holds(drawn)
        left = np.flatnonzero(~inside)
        inside[left] = necks.hold(drawn[left])
        return inside

    return region.share_of_points(holds, points, seed)


def _dimers_with_necks(spheres: Spheres) -> tuple[IntArray, IntArray]:
    """Return the indices of the first and of the second sphere of each dimer, both (k,).

    Raises InputError where a body has no neck that is known.
    """
    centres, radii, particles = spheres.positions, spheres.radii, spheres.particles
    require_dimers(particles)
    one, other = dimer_spheres(particles)
    unequal = np.flatnonzero(abs(radii[one] - radii[other]) > TOLERANCE * radii[one])
    if len(unequal):
        raise InputError(
            "only a dimer of two equal spheres has a neck: the radii in body "
            f"{particles.bodies[particles.index[one[unequal[0]]]]} are "
            f"{radii[one[unequal[0]]]:g} and {radii[other[unequal[0]]]:g}"
        )
    distance = np.linalg.norm(centres[other] - centres[one], axis=1)
    for extreme in (np.argmin, np.argmax):
        if len(distance):
            dimer = extreme(distance / radii[one])
            _check(float(radii[one[dimer]]), float(distance[dimer]))
    return one, other


class _Necks:
    """The necks of some dimers, each within a radius of the middle between its two spheres."""

    def __init__(
        self, centres: FloatArray, radii: FloatArray, one: IntArray, other: IntArray
    ) -> None:
        self._middles = (centres[one] + centres[other]) / 2
        axes = centres[other] - centres[one]
        distance = np.linalg.norm(axes, axis=1)
        self._axes = axes / distance[:, None]
        self._radii = radii[one]
        self._heights = distance / 4
        self._circles = np.sqrt(4 * self._radii**2 - distance**2 / 4)

    def hold(self, points: FloatArray) -> BoolArray:
        """Say which of the points, (k, 3), none in a sphere, lie in a neck."""
        inside = np.zeros(len(points), dtype=np.bool_)
        if len(points) == 0 or len(self._middles) == 0:
            return inside
        # The neck is widest where it meets the spheres, at z = D / 4, and its edge there is r
        # away from the middle.
        found = scipy.spatial.KDTree(points).query_ball_point(
            self._middles, self._radii, return_sorted=False
        )
        dimer = np.repeat(np.arange(len(found)), [len(near) for near in found])
        point = np.concatenate(found).astype(np.int64)
        arm = points[point] - self._middles[dimer]
        height = (arm * self._axes[dimer]).sum(axis=1)
        across = np.sqrt(np.maximum((arm**2).sum(axis=1) - height**2, 0))
        # The height is at most a radius: the square root is that of a positive number.
        torus = self._circles[dimer] - np.sqrt(np.maximum(self._radii[dimer] ** 2 - height**2, 0))
        inside[point[(abs(height) <= self._heights[dimer]) & (across <= torus)]] = True
        return inside


def _check(radius: float, distance: float) -> None:
    # This condition is written so that NaN fails too.
    if not 0 < radius < math.inf:
        raise InputError(f"a radius must be positive and finite, not {radius:g}")
    if not 0 < distance <= 2 * radius * (1 + TOLERANCE):
        raise InputError(
            f"the distance of a dimer's centres must be above 0 and at most {2 * radius:g}, two "
            f"radii, not {distance:g}"
        )
