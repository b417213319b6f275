"""Packing fraction against the distance from a wall, in slabs parallel to it.

The paper's Figures 6 and 12 show it in boxes [l, l + delta] x [0.25, 0.75] x [0.25, 0.75], with
delta a tenth of the diameter and l from 0 to 0.25.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .areas import areas_in
from .errors import InputError
from .geometry import (
    FloatArray,
    IntArray,
    as_box,
    as_count,
    as_floats,
    spheres_reaching,
)
from .overlaps import FACES
from .packing import packing_fraction
from .spheres import Spheres, takes_spheres
from .volumes import Pieces, pieces_of

# Pairs of a sphere and a slab are worked off in groups of about this many, to bound the memory.
PAIRS = 200_000
# More slabs are a slip of the pen, and would fill the memory.
MOST_SLABS = 1_000_000


@dataclass(frozen=True, eq=False)
class WallProfile:
    """Packing fraction in slabs parallel to a wall, from the wall inwards.

    Attributes
    ----------
    distances : (k,), of the slabs' middles from the wall, length
    scaled : (k,), these distances over the diameter
    values : (k,), packing fraction in each slab
    uncertainties : (k,), standard deviations of `values` over choices of the random points; None
        for exact volumes
    """

    distances: FloatArray
    scaled: FloatArray
    values: FloatArray
    uncertainties: FloatArray | None


@takes_spheres
def wall_profile(
    spheres: Spheres,
    box: ArrayLike,
    *,
    wall: str,
    thickness: float,
    diameter: float | None = None,
) -> WallProfile:
    """Compute the packing fraction of spheres and dimers in slabs parallel to a wall.

    The volumes are exact, as those of `exact_packing_fraction`: the volume that both spheres of a
    dimer cover counts once, that of different particles twice. Bodies of three or more spheres are
    refused. In two dimensions areas take the place of volumes.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    box : (3, 2), what is cut into slabs: one of its faces lies on the wall, length
    wall : which face: xlo, xhi, ylo, yhi, zlo or zhi
    thickness : of the slabs, length; what is left of the box after the last whole slab is not used
    diameter : to scale the distances with, length; by default that of the spheres, if all are equal

    Raises InputError for a box of another shape, for a body of three or more spheres, for a face
    that does not exist or is periodic, for slabs that do not fit into the box or are more than a
    million, for spheres of several sizes without a diameter, and for too many images.
    """
    slabs = _Slabs(spheres, box, wall, thickness)
    scale = _diameter(spheres.radii, diameter)
    pieces = pieces_of(spheres.around(slabs.box).spheres)
    sizes_in = areas_in if spheres.flat else Pieces.volumes_in

    # Each piece may reach the slabs from `first` up to, but not with, `last`.
    inwards = slabs.distance_from_wall(pieces.centres)
    first = np.floor((inwards - pieces.radii) / thickness).clip(0, slabs.count).astype(np.int64)
    last = np.ceil((inwards + pieces.radii) / thickness).clip(0, slabs.count).astype(np.int64)
    reaching = spheres_reaching(pieces.centres, pieces.radii, slabs.reach)
    numbers = np.where(reaching, last - first, 0)

    volumes = np.zeros(slabs.count)
    used = np.flatnonzero(numbers > 0)
    group = max(1, PAIRS // max(1, int(numbers.max(initial=0))))
    for start in range(0, len(used), group):
        chosen = used[start : start + group]
        row = np.repeat(chosen, numbers[chosen])
        begins = np.cumsum(numbers[chosen]) - numbers[chosen]
        slab = np.arange(len(row)) - np.repeat(begins - first[chosen], numbers[chosen])
        parts = sizes_in(pieces[row], *slabs.bounds(slab))
        volumes += np.bincount(slab, weights=parts, minlength=slabs.count)
    values = volumes / slabs.size
    return WallProfile(slabs.middles, slabs.middles / scale, values, None)


@takes_spheres
def wall_profile_monte_carlo(
    spheres: Spheres,
    box: ArrayLike,
    *,
    wall: str,
    thickness: float,
    diameter: float | None = None,
    points: int = 1_000_000,
    seed: int = 0,
) -> WallProfile:
    """Measure the packing fraction in slabs parallel to a wall with random points.

    Each slab is measured as by `packing_fraction`: overlaps count once, whatever particles the
    spheres are part of.

    Parameters
    ----------
    spheres : the spheres and their cell
    box : (3, 2), what is cut into slabs: one of its faces lies on the wall, length
    wall : which face: xlo, xhi, ylo, yhi, zlo or zhi
    thickness : of the slabs, length; what is left of the box after the last whole slab is not used
    diameter : to scale the distances with, length; by default that of the spheres, if all are equal
    points : number of random points in each slab, at least 1
    seed : not negative; each slab's points have a seed of their own, drawn from this one

    Raises InputError as `wall_profile` and `packing_fraction` do.
    """
    slabs = _Slabs(spheres, box, wall, thickness)
    scale = _diameter(spheres.radii, diameter)
    as_count(seed, "the seed", 0)
    seeds = np.random.SeedSequence(seed).generate_state(slabs.count)
    measured = []
    for number, own_seed in enumerate(seeds):
        lower, upper = slabs.bounds(np.array([number]))
        slab = np.column_stack([lower[0], upper[0]])
        measured.append(packing_fraction(spheres, slab, points=points, seed=int(own_seed)))
    return WallProfile(
        slabs.middles,
        slabs.middles / scale,
        np.array([one.value for one in measured]),
        np.array([one.uncertainty for one in measured]),
    )


def mueller_packing_fraction(scaled_distances: ArrayLike, width: float | None = None) -> FloatArray:
    """Return Mueller's empirical packing fraction near the wall of a cylinder full of spheres.

    With s the distance from the wall over the diameter d, and D the cylinder's diameter,

        phi = 1 - e, e = e_b + (1 - e_b) J0(a s) exp(-b s)
        a = 7.45 - 3.15 d / D for 2.02 <= D / d < 13, a = 7.45 - 11.25 d / D from there on
        b = 0.315 - 0.725 d / D, e_b = 0.365 + 0.22 d / D

    from G. E. Mueller, Radial void fraction distributions in randomly packed fixed beds of
    uniformly sized spheres in cylindrical containers, Powder Technology 72 (1992) 269-275. The
    paper compares with D / d = infinity. Mueller's abstract confirms that there is one principal
    equation, for D / d >= 2.02. Not confirmed: the numbers in a, b and e_b could not be compared
    with the article or with a public text that cites them. They do give what is known otherwise:
    nothing at the wall, a first maximum half a diameter from it, 0.635 far from it; and for
    D / d = infinity the maxima and minima of spheres poured by this package. At D / d = 13, a jumps
    by 0.6.

    Parameters
    ----------
    scaled_distances : from the wall, over the diameter of the spheres, any shape, >= 0
    width : D / d, at least 2.02; None for an infinitely wide container

    Raises InputError for a negative distance, and for a narrower container.
    """
    distance = as_floats(scaled_distances, "distances")
    # This condition is written so that NaN fails too.
    if not (distance >= 0).all():
        raise InputError("distances from the wall must not be negative or NaN")
    if width is not None and not width >= 2.02:
        raise InputError(f"Mueller's formula holds for cylinders of D/d >= 2.02, not {width:g}")
    narrow = 0.0 if width is None else 1 / width
    a = 7.45 - (3.15 if width is not None and width < 13 else 11.25) * narrow
    b = 0.315 - 0.725 * narrow
    bulk = 0.365 + 0.22 * narrow
    values: FloatArray = (
        1 - bulk - (1 - bulk) * scipy.special.j0(a * distance) * np.exp(-b * distance)
    )
    return values


class _Slabs:
    """A box cut into slabs of one thickness, numbered from the wall on one of its faces.

    Attributes
    ----------
    box : (3, 2), the box, length
    reach : (3, 2), the same; infinite along z in two dimensions, length
    count : number of slabs
    middles : (count,), distance of each slab's middle from the wall, length
    size : volume of a slab, length^3; in two dimensions its area, length^2
    """

    def __init__(self, spheres: Spheres, box: ArrayLike, wall: str, thickness: float) -> None:
        self.box = as_box(box)
        if wall not in FACES:
            raise InputError(f"a wall must be one of {', '.join(FACES)}, not {wall}")
        self._axis, self._upper = divmod(FACES.index(wall), 2)
        if spheres.endless[self._axis]:
            raise InputError(
                f"there is no wall {wall}: the packing is periodic or two-dimensional across it"
            )
        self.reach = self.box.copy()
        if spheres.flat:
            self.reach[2] = -np.inf, np.inf
        self._thickness = thickness
        extent = float(self.box[self._axis, 1] - self.box[self._axis, 0])
        # This condition is written so that NaN fails too.
        if not 0 < thickness <= extent * (1 + 1e-9):
            raise InputError(
                f"slabs must be thicker than 0 and fit into the box's {extent:g} along "
                f"{'xyz'[self._axis]}, not {thickness:g}"
            )
        if extent > MOST_SLABS * thickness:
            raise InputError(f"slabs of {thickness:g} are more than {MOST_SLABS} in the box")
        # A quotient such as 0.25 / 0.005 may be a little less than 50.
        self.count = math.floor(extent / thickness * (1 + 1e-9))
        self.middles: FloatArray = np.linspace(0.5, self.count - 0.5, self.count) * thickness
        across = [k for k in range(2 if spheres.flat else 3) if k != self._axis]
        self.size = float(thickness * np.prod(np.diff(self.box)[across]))

    def distance_from_wall(self, positions: FloatArray) -> FloatArray:
        """Return the distances of positions, (m, 3), from the wall, (m,), positive inside."""
        along: FloatArray = positions[:, self._axis] - self.box[self._axis, self._upper]
        return -along if self._upper else along

    def bounds(self, numbers: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper bounds of some slabs, (m, 3) each."""
        lower = np.repeat(self.box[None, :, 0], len(numbers), axis=0)
        upper = np.repeat(self.box[None, :, 1], len(numbers), axis=0)
        # Slabs share their faces to the last bit, so that nothing is counted twice.
        near, far = numbers * self._thickness, (numbers + 1) * self._thickness
        wall = self.box[self._axis, self._upper]
        if self._upper:
            lower[:, self._axis], upper[:, self._axis] = wall - far, wall - near
        else:
            lower[:, self._axis], upper[:, self._axis] = wall + near, wall + far
        return lower, upper


def _diameter(radii: FloatArray, diameter: float | None) -> float:
    if diameter is None:
        largest = float(radii.max())
        # A dump's radii may be rounded.
        if largest - float(radii.min()) > 1e-6 * largest:
            raise InputError("the spheres differ in size: say which diameter scales the distances")
        return 2 * largest
    if not 0 < diameter < math.inf:
        raise InputError(f"a diameter must be positive and finite, not {diameter:g}")
    return diameter
