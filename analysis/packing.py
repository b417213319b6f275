"""Packing fraction: the share of a box's volume that lies inside spheres."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import KDTree

from .bodies import Particles
from .geometry import BoolArray, FloatArray, as_box, as_count, as_spheres, spheres_reaching
from .neighbours import near_pairs
from .volumes import Pieces, pieces_of, split

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


@dataclass(frozen=True)
class ExactPackingFraction:
    """A packing fraction from the exact volumes of spheres and dimers in a box.

    Attributes
    ----------
    value : sum of the particles' volumes in the box over the box's volume; where different
        particles overlap, their common volume counts for each of them
    overlap : sum of the common volumes in the box, over all pairs of spheres of different
        particles, over the box's volume. The share that is covered at all lies between
        `value - overlap` and `value`; it is `value - overlap` if no point is in two of these pairs
    """

    value: float
    overlap: float


@dataclass(frozen=True)
class MeasuredPackingFraction:
    """A packing fraction, measured as well as the particles allow.

    Attributes
    ----------
    value : the exact packing fraction if all particles are free spheres and dimers, else that of
        random points
    exact : the exact packing fraction; None if there are other bodies
    drawn : the packing fraction by random points, for every kind of particle
    """

    value: float
    exact: ExactPackingFraction | None
    drawn: PackingFraction


def measure_packing_fraction(
    positions: ArrayLike,
    radii: ArrayLike,
    box: ArrayLike,
    particles: Particles,
    *,
    points: int = 1_000_000,
    seed: int = 0,
) -> MeasuredPackingFraction:
    """Measure the packing fraction in a box, exactly where that is possible, and by random points.

    Parameters
    ----------
    positions : (n, 3), of the spheres, length
    radii : (n,), of the spheres, length
    box : (3, 2), lower and upper bound per axis, length
    particles : which spheres make up which particle
    points : number of random points, at least 1
    seed : of numpy's default generator, not negative

    Raises InputError for arrays of other shapes, and as `packing_fraction` does.
    """
    drawn = packing_fraction(positions, radii, box, points=points, seed=seed)
    if not particles.exactly_measurable:
        return MeasuredPackingFraction(drawn.value, None, drawn)
    exact = exact_packing_fraction(positions, radii, box, particles)
    return MeasuredPackingFraction(exact.value, exact, drawn)


def best_packing_fraction(
    positions: ArrayLike,
    radii: ArrayLike,
    box: ArrayLike,
    particles: Particles,
    *,
    points: int = 1_000_000,
    seed: int = 0,
) -> float:
    """Return the packing fraction in a box: exact where that is possible, else by random points.

    It is the value of `measure_packing_fraction`, without random points where these do not matter.

    Parameters
    ----------
    positions : (n, 3), of the spheres, length
    radii : (n,), of the spheres, length
    box : (3, 2), lower and upper bound per axis, length
    particles : which spheres make up which particle
    points : number of random points, at least 1
    seed : of numpy's default generator, not negative

    Raises InputError for arrays of other shapes, and as `packing_fraction` does.
    """
    if particles.exactly_measurable:
        return exact_packing_fraction(positions, radii, box, particles).value
    return packing_fraction(positions, radii, box, points=points, seed=seed).value


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
    points : number of random points, at least 1
    seed : of numpy's default generator, not negative

    Raises InputError for arrays of other shapes, and for points or a seed that are not such whole
    numbers.
    """
    centres, radius, bounds = as_measurable_by_points(positions, radii, box, points, seed)
    reaching = spheres_reaching(centres, radius, bounds)
    if not reaching.any():
        return PackingFraction(0.0, 0.0, points)
    cover = Cover(centres[reaching], radius[reaching])
    return share_of_points(cover.holds, bounds, points, seed)


def exact_packing_fraction(
    positions: ArrayLike,
    radii: ArrayLike,
    box: ArrayLike,
    particles: Particles | None = None,
) -> ExactPackingFraction:
    """Compute the packing fraction of spheres and dimers in a box without random points.

    Within a dimer, what both spheres cover counts once; between different particles it counts
    twice, see `ExactPackingFraction.overlap`. Spheres that stick out of the box count with their
    part inside. Bodies of three or more spheres are refused. Nothing is periodic.

    Parameters
    ----------
    positions : (n, 3), of the spheres, length
    radii : (n,), of the spheres, length
    box : (3, 2), lower and upper bound per axis, length
    particles : which spheres make up which particle; without, every sphere is one

    Raises InputError for arrays of other shapes, and for a body of three or more spheres.
    """
    centres, radius = as_spheres(positions, radii)
    bounds = as_box(box)
    lower, upper = bounds.T
    pieces = pieces_of(centres, radius, particles)
    volume = float(pieces.volumes_in(lower, upper).sum())

    common = 0.0
    near = np.flatnonzero(spheres_reaching(centres, radius, bounds))
    if len(near):
        one, other = near[near_pairs(centres[near], radius[near], 0.0)].T
        if particles is not None:
            apart = particles.index[one] != particles.index[other]
            one, other = one[apart], other[apart]
        for part in split(centres, radius, one, other):
            # The common part of two balls is made of what the parts of the union leave out of each.
            rest = Pieces(part.centres, part.radii, -part.normals, -part.offsets, part.particles)
            rest = rest[rest.offsets > -np.inf]
            common += float(rest.volumes_in(lower, upper).sum())
    size_of_box = float(np.prod(upper - lower))
    return ExactPackingFraction(volume / size_of_box, common / size_of_box)


def as_measurable_by_points(
    positions: ArrayLike, radii: ArrayLike, box: ArrayLike, points: int, seed: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return positions (n, 3), radii (n,) and a box (3, 2), checked for a count of random points.

    Raises InputError where these have other shapes or values, for fewer points than one, and for a
    negative seed.
    """
    centres, radius = as_spheres(positions, radii)
    bounds = as_box(box)
    as_count(points, "the number of points")
    as_count(seed, "the seed", 0)
    return centres, radius, bounds


def share_of_points(
    holds: Callable[[FloatArray], BoolArray], bounds: FloatArray, points: int, seed: int
) -> PackingFraction:
    """Return the share of uniform random points in a box that lie in some volume.

    Parameters
    ----------
    holds : says of points, (k, 3), which ones lie in the volume, (k,)
    bounds : (3, 2), the box, length
    points : number of points
    seed : of numpy's default generator
    """
    generator = np.random.default_rng(seed)
    inside = 0
    for start in range(0, points, BATCH):
        batch = min(BATCH, points - start)
        drawn = generator.uniform(bounds[:, 0], bounds[:, 1], (batch, 3))
        inside += int(np.count_nonzero(holds(drawn)))
    value = inside / points
    return PackingFraction(value, math.sqrt(value * (1 - value) / points), points)


class Cover:
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

    def holds(self, points: FloatArray) -> BoolArray:
        """Say which of the points, (k, 3), lie in a sphere."""
        lifted = np.column_stack([points, np.zeros(len(points))])
        # Points without a neighbour within the bound come back at infinity.
        distance, _ = self._tree.query(lifted, distance_upper_bound=self._largest)
        inside: BoolArray = np.isfinite(distance)
        return inside
