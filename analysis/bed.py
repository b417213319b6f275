"""Whether a box lies inside a packing, and where the packing ends: else it measures empty space.

A free surface is rough and may slope, and a lone sphere may lie on top of it. So the end of a bed
is looked for column by column: the box is cut into columns along each axis, a little wider than a
sphere, and the bed ends at the outermost centre of the column that ends first. Up to there a bed is
as dense as deep inside. No direction is up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .cell import ROUND_OFF
from .geometry import BoolArray, FloatArray, as_box, as_walls
from .spheres import Spheres, takes_spheres

# Width of a column [largest diameters]. In narrower ones the gap between two spheres of a dense bed
# would be its end; wider ones hide a pit of the surface.
COLUMN = 1.5
# The box is cut this often at most to lie inside; twice is enough for a bed with one free surface.
MOST_CUTS = 100


@dataclass(frozen=True, eq=False)
class BoxInBed:
    """A box, and how much of it lies inside a bed.

    Attributes
    ----------
    box : (3, 2), the box, length
    bed : (3, 2), where the bed ends per axis in the columns through `inside`, walls included; of
        the whole bed where no part of the box is inside, length
    inside : (3, 2), part of the box that lies inside the bed, all of it or rounded inwards by less
        than a tenth of the largest diameter, length; None if there is none
    """

    box: FloatArray
    bed: FloatArray
    inside: FloatArray | None

    @property
    def share(self) -> float:
        """Share of the box's volume that `inside` has: 1 for a box in the bed, 0 for none."""
        if self.inside is None:
            return 0.0
        return float(np.prod(np.diff(self.inside, axis=1) / np.diff(self.box, axis=1)))

    @property
    def is_inside(self) -> bool:
        """Whether all of the box lies inside the bed."""
        return self.inside is not None and bool((self.inside == self.box).all())

    @property
    def ends(self) -> str:
        """Where the bed ends, of the faces that reach out of it, such as `y = 0.49`."""
        reach = self.bed if self.inside is None else self.inside
        out = np.column_stack([self.box[:, 0] < reach[:, 0], self.box[:, 1] > reach[:, 1]])
        found = [f"{'xyz'[row]} = {self.bed[row, side]:.3g}" for row, side in np.argwhere(out)]
        return ", ".join(found) or "a gap in the box"


@takes_spheres
def box_in_bed(spheres: Spheres, box: ArrayLike, walls: ArrayLike | None = None) -> BoxInBed:
    """Find how much of a box lies inside a bed of spheres, and where the bed ends.

    The bed ends at the outermost centres of each column, 1.5 to 3 largest diameters wide; at a wall
    if no sphere of the largest diameter fits between the two. A sphere that has left the bed does
    not move its end, unless it is alone in a column. A bed has no end along an axis that lies in
    the plane, or along the line, of the cell's periods, nor across discs: it is infinite there.

    Parameters
    ----------
    spheres : the spheres, and their cell
    box : (3, 2), lower and upper bound per axis, length
    walls : (3, 2), place of the flat wall below and above per axis, infinite where there is none,
        length; None for no walls

    Raises InputError for a box or walls of another shape, for walls that are NaN, and for too many
    images.
    """
    bounds = as_box(box)
    faces = as_walls(walls)
    diameter = 2 * float(spheres.radii.max())
    endless = _endless(spheres)
    # Where the bed ends it is looked at as a whole: its end may be far from the box.
    extent = np.column_stack([spheres.positions.min(axis=0), spheres.positions.max(axis=0)])
    reach = bounds.copy()
    reach[~endless, 0] = np.minimum(bounds[:, 0], extent[:, 0])[~endless]
    reach[~endless, 1] = np.maximum(bounds[:, 1], extent[:, 1])[~endless]
    # A narrow column reaches out of the box by less than its own width.
    centres = spheres.around(reach, 2 * COLUMN * diameter).spheres.positions
    if len(centres):
        extent = np.column_stack([centres.min(axis=0), centres.max(axis=0)])
    whole = _to_walls(extent, faces, diameter)
    whole[endless] = -math.inf, math.inf
    if len(centres) == 0:
        return BoxInBed(bounds, whole, None)
    # A column outside of the whole bed is empty: most of a box that is far too large goes at once.
    part = _cut(bounds, whole, diameter)
    for _ in range(MOST_CUTS):
        if (part[:, 0] >= part[:, 1]).any():
            break
        bed = np.array([[-math.inf, math.inf]] * 3)
        for axis in np.flatnonzero(~endless).tolist():
            # Discs in a plane are not cut into columns across it.
            across = [other for other in (range(2) if spheres.flat else range(3)) if other != axis]
            bed[axis] = _ends(centres, part, axis, across, faces, diameter)
        widths = np.minimum(part[:, 1], bed[:, 1]) - np.maximum(part[:, 0], bed[:, 0])
        kept = widths / np.diff(part, axis=1)[:, 0]
        if (kept == 1).all():
            return BoxInBed(bounds, bed, part)
        # The columns across a free surface end anywhere: the axis along which they keep most of the
        # box is the one that is cut.
        axis = int(np.argmax(np.where(kept < 1, kept, -math.inf)))
        part[axis] = _cut(part, bed, diameter)[axis]
    return BoxInBed(bounds, whole, None)


def _cut(box: FloatArray, bed: FloatArray, diameter: float) -> FloatArray:
    """Return a box, (3, 2), without what is outside of a bed, (3, 2), rounded inwards where cut."""
    digit = 10.0 ** math.floor(math.log10(diameter / 10))
    cut = box.copy()
    with np.errstate(invalid="ignore"):
        low, high = np.ceil(bed[:, 0] / digit) * digit, np.floor(bed[:, 1] / digit) * digit
    cut[:, 0] = np.where(bed[:, 0] > box[:, 0], np.maximum(low, bed[:, 0]), box[:, 0])
    cut[:, 1] = np.where(bed[:, 1] < box[:, 1], np.minimum(high, bed[:, 1]), box[:, 1])
    return cut


def _endless(spheres: Spheres) -> BoolArray:
    """Say along which axes a bed has no end, (3,): those along which some sum of periods leads."""
    if spheres.cell is None:
        return np.zeros(3, dtype=np.bool_)
    periods = spheres.cell.vectors[np.array(spheres.cell.periodic)]
    # The part of an axis that lies in the plane of the periods is as long as the axis.
    endless: BoolArray = np.diag(np.linalg.pinv(periods) @ periods) > 1 - ROUND_OFF
    endless[2] |= spheres.flat
    return endless


def _ends(
    centres: FloatArray,
    box: FloatArray,
    axis: int,
    across: Sequence[int],
    faces: FloatArray,
    diameter: float,
) -> tuple[float, float]:
    """Return where the bed begins and ends along an axis in all columns through a box.

    Parameters
    ----------
    centres : (n, 3), of the spheres, length
    box : (3, 2), the box, length
    axis : along which the columns are
    across : the axes by which they are told apart
    faces : (3, 2), places of the walls, length
    diameter : the largest, length
    """
    chosen = np.full(len(centres), True)
    column = np.zeros(len(centres), dtype=np.int64)
    columns = 1
    for other in across:
        low, high = box[other]
        if high - low < COLUMN * diameter:
            middle = (low + high) / 2
            low, high = middle - COLUMN * diameter / 2, middle + COLUMN * diameter / 2
        number = max(1, int((high - low) / (COLUMN * diameter)))
        at = centres[:, other]
        chosen &= (at >= low) & (at <= high)
        place = np.clip((at - low) / (high - low) * number, 0, number - 1)
        column = column * number + place.astype(np.int64)
        columns *= number
        # Some column is empty: there are more of them than spheres.
        if columns > len(centres):
            return math.inf, -math.inf
    ends = np.array([[math.inf, -math.inf]] * columns)
    np.minimum.at(ends[:, 0], column[chosen], centres[chosen, axis])
    np.maximum.at(ends[:, 1], column[chosen], centres[chosen, axis])
    ends = _to_walls(ends, faces[axis], diameter)
    return float(ends[:, 0].max()), float(ends[:, 1].min())


def _to_walls(ends: FloatArray, faces: FloatArray, diameter: float) -> FloatArray:
    """Return ends, (k, 2), moved to the walls, (2,) or (k, 2), where no sphere fits between."""
    reach = 1.5 * diameter
    low, high = faces[..., 0], faces[..., 1]
    return np.column_stack(
        [
            np.where(ends[:, 0] - low < reach, low, ends[:, 0]),
            np.where(high - ends[:, 1] < reach, high, ends[:, 1]),
        ]
    )
