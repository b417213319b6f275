"""Packing fraction against the distance from a wall, in slabs parallel to it.

The paper's Figures 6 and 12 show it in boxes [l, l + delta] x [0.25, 0.75] x [0.25, 0.75], with
delta a tenth of the diameter and l from 0 to 0.25.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j0

from .bodies import Particles
from .errors import InputError
from .geometry import (
    FloatArray,
    IntArray,
    as_box,
    as_count,
    as_floats,
    as_spheres,
    spheres_reaching,
)
from .overlaps import FACES
from .packing import packing_fraction
from .volumes import pieces_of

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


def wall_profile(
    positions: ArrayLike,
    radii: ArrayLike,
    box: ArrayLike,
    *,
    wall: str,
    thickness: float,
    particles: Particles | None = None,
    diameter: float | None = None,
) -> WallProfile:
    """Compute the packing fraction of spheres and dimers in slabs parallel to a wall.

    The volumes are exact, as those of `exact_packing_fraction`: the volume that both spheres of a
    dimer cover counts once, that of different particles twice. Bodies of three or more spheres are
    refused.

    Parameters
    ----------
    positions : (n, 3), of the spheres, length
    radii : (n,), of the spheres, length
    box : (3, 2), what is cut into slabs: one of its faces lies on the wall, length
    wall : which face: xlo, xhi, ylo, yhi, zlo or zhi
    thickness : of the slabs, length; what is left of the box after the last whole slab is not used
    particles : which spheres make up which particle; without, every sphere is one
    diameter : to scale the distances with, length; by default that of the spheres, if all are equal

    Raises InputError for arrays of other shapes, for a body of three or more spheres, for a face
    that does not exist, for slabs that do not fit into the box or are more than a million, and for
    spheres of several sizes without a diameter.
    """
    centres, radius = as_spheres(positions, radii)
    slabs = _Slabs(box, wall, thickness)
    scale = _diameter(radius, diameter)
    pieces = pieces_of(centres, radius, particles)

    # Each piece may reach the slabs from `first` up to, but not with, `last`.
    inwards = slabs.distance_from_wall(pieces.centres)
    first = np.floor((inwards - pieces.radii) / thickness).clip(0, slabs.count).astype(np.int64)
    last = np.ceil((inwards + pieces.radii) / thickness).clip(0, slabs.count).astype(np.int64)
    reaching = spheres_reaching(pieces.centres, pieces.radii, slabs.box)
    numbers = np.where(reaching, last - first, 0)

    volumes = np.zeros(slabs.count)
    used = np.flatnonzero(numbers > 0)
    group = max(1, PAIRS // max(1, int(numbers.max())))
    for start in range(0, len(used), group):
        chosen = used[start : start + group]
        row = np.repeat(chosen, numbers[chosen])
        begins = np.cumsum(numbers[chosen]) - numbers[chosen]
        slab = np.arange(len(row)) - np.repeat(begins - first[chosen], numbers[chosen])
        parts = pieces[row].volumes_in(*slabs.bounds(slab))
        volumes += np.bincount(slab, weights=parts, minlength=slabs.count)
    values = volumes / slabs.volume
    return WallProfile(slabs.middles, slabs.middles / scale, values, None)


def wall_profile_monte_carlo(
    positions: ArrayLike,
    radii: ArrayLike,
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
    positions : (n, 3), length
    radii : (n,), length
    box : (3, 2), what is cut into slabs: one of its faces lies on the wall, length
    wall : which face: xlo, xhi, ylo, yhi, zlo or zhi
    thickness : of the slabs, length; what is left of the box after the last whole slab is not used
    diameter : to scale the distances with, length; by default that of the spheres, if all are equal
    points : number of random points in each slab, at least 1
    seed : not negative; each slab's points have a seed of their own, drawn from this one

    Raises InputError as `wall_profile` and `packing_fraction` do.
    """
    centres, radius = as_spheres(positions, radii)
    slabs = _Slabs(box, wall, thickness)
    scale = _diameter(radius, diameter)
    as_count(seed, "the seed", 0)
    seeds = np.random.SeedSequence(seed).generate_state(slabs.count)
    measured = []
    for number, own_seed in enumerate(seeds):
        lower, upper = slabs.bounds(np.array([number]))
        slab = np.column_stack([lower[0], upper[0]])
        measured.append(packing_fraction(centres, radius, slab, points=points, seed=int(own_seed)))
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
    values: FloatArray = 1 - bulk - (1 - bulk) * j0(a * distance) * np.exp(-b * distance)
    return values


class _Slabs:
    """A box cut into slabs of one thickness, numbered from the wall on one of its faces."""

    def __init__(self, box: ArrayLike, wall: str, thickness: float) -> None:
        self.box = as_box(box)
        if wall not in FACES:
            raise InputError(f"a wall must be one of {', '.join(FACES)}, not {wall}")
        self._axis, self._upper = divmod(FACES.index(wall), 2)
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
        self.volume = float(thickness * np.prod(np.delete(np.diff(self.box), self._axis)))

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
