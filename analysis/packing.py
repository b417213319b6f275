"""Packing fraction: the share of a box's volume that lies inside spheres."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .areas import areas_in
from .errors import InputError
from .geometry import BoolArray, FloatArray, as_box, as_count, spheres_reaching
from .neighbours import near_pairs, pairs_among
from .spheres import Spheres, takes_spheres
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


@takes_spheres
def measure_packing_fraction(
    spheres: Spheres, box: ArrayLike | None = None, *, points: int = 1_000_000, seed: int = 0
) -> MeasuredPackingFraction:
    """Measure the packing fraction in a box, exactly where that is possible, and by random points.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    box : (3, 2), lower and upper bound per axis, length; None: the whole cell
    points : number of random points, at least 1
    seed : of numpy's default generator, not negative

    Raises InputError as `packing_fraction` does.
    """
    drawn = packing_fraction(spheres, box, points=points, seed=seed)
    if not spheres.particles.exactly_measurable:
        return MeasuredPackingFraction(drawn.value, None, drawn)
    exact = exact_packing_fraction(spheres, box)
    return MeasuredPackingFraction(exact.value, exact, drawn)


@takes_spheres
def best_packing_fraction(
    spheres: Spheres, box: ArrayLike | None = None, *, points: int = 1_000_000, seed: int = 0
) -> float:
    """Return the packing fraction in a box: exact where that is possible, else by random points.

    It is the value of `measure_packing_fraction`, without random points where these do not matter.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    box : (3, 2), lower and upper bound per axis, length; None: the whole cell
    points : number of random points, at least 1
    seed : of numpy's default generator, not negative

    Raises InputError as `packing_fraction` does.
    """
    if spheres.particles.exactly_measurable:
        return exact_packing_fraction(spheres, box).value
    return packing_fraction(spheres, box, points=points, seed=seed).value


@takes_spheres
def packing_fraction(
    spheres: Spheres, box: ArrayLike | None = None, *, points: int = 1_000_000, seed: int = 0
) -> PackingFraction:
    """Measure the packing fraction in a box with uniform random points.

    Overlaps count once, spheres and images of them that stick out of the box with their part
    inside. In two dimensions it is the share of the area that discs cover.

    Parameters
    ----------
    spheres : the spheres and their cell
    box : (3, 2), lower and upper bound per axis, length; None: the whole cell
    points : number of random points, at least 1
    seed : of numpy's default generator, not negative

    Raises InputError for a box of another shape, for no box where there is no cell, for points or a
    seed that are not such whole numbers, and for too many images.
    """
    as_points(points, seed)
    region = Region(spheres, box)
    copies = region.around(0.0)
    reaching = spheres_reaching(copies.positions, copies.radii, region.reach)
    if not reaching.any():
        return PackingFraction(0.0, 0.0, points)
    cover = Cover(copies.positions[reaching], copies.radii[reaching])
    return region.share_of_points(cover.holds, points, seed)


@takes_spheres
def exact_packing_fraction(spheres: Spheres, box: ArrayLike | None = None) -> ExactPackingFraction:
    """Compute the packing fraction of spheres and dimers in a box without random points.

    Within a dimer, what both spheres cover counts once; between different particles it counts
    twice, see `ExactPackingFraction.overlap`. Spheres and images of them that stick out of the box
    count with their part inside. In two dimensions areas take the place of volumes. Bodies of three
    or more spheres are refused.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    box : (3, 2), lower and upper bound per axis, length; None: the whole cell

    Raises InputError for a box of another shape, for no box where there is no cell, or one with an
    oblique face that is not periodic, for a body of three or more spheres, and for too many images.
    """
    region = Region(spheres, box)
    if box is None:
        # Each particle counts once and whole, but for what is beyond a face that is not periodic.
        lower, upper = region.faces.T
        pieces = pieces_of(spheres)
        near = near_pairs(spheres, 0.0)
        near = near[near.between_particles(spheres)]
        ends = np.concatenate([spheres.positions[near.first], near.places(spheres)])
        radii = np.concatenate([spheres.radii[near.first], spheres.radii[near.second]])
        one, other = np.arange(len(near)), np.arange(len(near)) + len(near)
    else:
        lower, upper = as_box(box).T
        copies = region.around(0.0)
        pieces = pieces_of(copies)
        chosen = np.flatnonzero(spheres_reaching(copies.positions, copies.radii, region.reach))
        ends, radii = copies.positions, copies.radii
        pairs = np.zeros((0, 2), dtype=np.int64)
        if len(chosen):
            pairs = chosen[pairs_among(ends[chosen], radii[chosen], 0.0)]
        owners = copies.particles.index[pairs]
        one, other = pairs[owners[:, 0] != owners[:, 1]].T
    sizes_in = areas_in if spheres.flat else Pieces.volumes_in
    filled = float(sizes_in(pieces, lower, upper).sum())
    common = 0.0
    for part in split(ends, radii, one, other):
        # The common part of two balls is made of what the parts of the union leave out of each.
        rest = Pieces(part.centres, part.radii, -part.normals, -part.offsets, part.particles)
        rest = rest[rest.offsets > -np.inf]
        common += float(sizes_in(rest, lower, upper).sum())
    return ExactPackingFraction(filled / region.size, common / region.size)


def as_points(points: int, seed: int) -> None:
    """Raise InputError for fewer random points than one, and for a negative seed."""
    as_count(points, "the number of points")
    as_count(seed, "the seed", 0)


class Region:
    """Where a packing fraction is measured: a box, or the whole cell.

    Attributes
    ----------
    size : volume, length^3; of a region in two dimensions area, length^2
    reach : (3, 2), box along the axes that encloses the region, length; infinite along z in two
        dimensions
    """

    def __init__(self, spheres: Spheres, box: ArrayLike | None) -> None:
        """Raise InputError for a box of another shape, and for no box where there is no cell."""
        self._spheres = spheres
        if box is not None:
            self._bounds = as_box(box)
            sides = self._bounds[:, 1] - self._bounds[:, 0]
            self.size = float(np.prod(sides[:2] if spheres.flat else sides))
        elif spheres.cell is not None:
            self._bounds = spheres.cell.bounds
            self.size = spheres.cell.volume
        else:
            raise InputError("there is no cell to measure as a whole: a box is needed")
        self._cell = spheres.cell if box is None else None
        self.reach = self._bounds.copy()
        if spheres.flat:
            self.reach[2] = -np.inf, np.inf

    @property
    def faces(self) -> FloatArray:
        """Faces of the cell that are not periodic, (3, 2), infinite where there is none, length.

        Raises InputError where such a face is oblique.
        """
        cell = self._spheres.cell
        assert cell is not None
        faces = cell.flat_faces
        oblique = ~np.array(cell.periodic) & np.isinf(faces[:, 0])
        if cell.flat:
            faces[2], oblique[2] = (-np.inf, np.inf), False
        if oblique.any():
            raise InputError(
                f"the face of the cell across {'abc'[int(np.argmax(oblique))]} is oblique and not "
                "periodic: give a box inside the cell"
            )
        return faces

    def around(self, margin: float) -> Spheres:
        """Return all that may reach into the region, or within a margin [length], as copies."""
        if self._cell is not None:
            return self._spheres.around_cell(margin).spheres
        return self._spheres.around(self._bounds, margin).spheres

    def share_of_points(
        self, holds: Callable[[FloatArray], BoolArray], points: int, seed: int
    ) -> PackingFraction:
        """Return the share of uniform random points in the region that lie in some volume.

        Parameters
        ----------
        holds : says of points, (k, 3), which ones lie in the volume, (k,)
        points : number of points
        seed : of numpy's default generator
        """
        generator = np.random.default_rng(seed)
        inside = 0
        for start in range(0, points, BATCH):
            drawn = self._draw(generator, min(BATCH, points - start))
            inside += int(np.count_nonzero(holds(drawn)))
        value = inside / points
        return PackingFraction(value, math.sqrt(value * (1 - value) / points), points)

    def _draw(self, generator: np.random.Generator, count: int) -> FloatArray:
        if self._cell is not None:
            drawn = self._cell.origin + generator.uniform(size=(count, 3)) @ self._cell.vectors
        else:
            drawn = generator.uniform(self._bounds[:, 0], self._bounds[:, 1], (count, 3))
        if self._spheres.flat:
            drawn[:, 2] = self._spheres.positions[0, 2]
        return drawn


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
        self._tree = scipy.spatial.KDTree(np.column_stack([centres, lift]))

    def holds(self, points: FloatArray) -> BoolArray:
        """Say which of the points, (k, 3), lie in a sphere."""
        lifted = np.column_stack([points, np.zeros(len(points))])
        # Points without a neighbour within the bound come back at infinity.
        distance, _ = self._tree.query(lifted, distance_upper_bound=self._largest)
        inside: BoolArray = np.isfinite(distance)
        return inside
