"""The simulation cell: its lattice, which of its faces are periodic, and where images are.

No other room knows a period. What is measured near a periodic face is measured among images, which
are copied from here, or along the shortest of all lines between two points and their images.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError
from .geometry import FloatArray, IntArray, as_box, as_floats

# More images of points than this are a slip of the pen, and would fill the memory.
MOST_IMAGES = 30_000_000
# A fraction of the cell is known to about this: two ways to one point differ by round-off.
ROUND_OFF = 1e-9


class Cell:
    """A simulation cell, a parallelepiped with faces that are periodic or not.

    A point x of the cell is origin + f a + g b + h c with fractions f, g, h from 0 to 1; where the
    faces along a are periodic, x + k a is one of its images for each whole number k.

    Attributes
    ----------
    origin : (3,), corner from which the edges start, length
    vectors : (3, 3), edges a, b and c, one per row, length
    periodic : for a, b and c, whether the faces at their ends are periodic
    flat : whether the packing is two-dimensional, of discs in a plane of constant z. Then c is
        along z, and not periodic: discs have no images in front and behind
    """

    def __init__(
        self,
        origin: ArrayLike,
        vectors: ArrayLike,
        periodic: Sequence[bool] = (False, False, False),
        *,
        flat: bool = False,
    ) -> None:
        """Check a cell; see the attributes for the parameters.

        Raises InputError for arrays of other shapes, for edges that are not finite or lie in a
        plane, and for a two-dimensional cell whose edges leave the plane.
        """
        corner, edges = as_floats(origin, "a cell's origin"), as_floats(vectors, "a cell's vectors")
        if corner.shape != (3,) or edges.shape != (3, 3):
            raise InputError(
                f"a cell must have an origin (3,) and vectors (3, 3), not {corner.shape} and "
                f"{edges.shape}"
            )
        if len(periodic) != 3:
            raise InputError(f"a cell needs three flags of periods, not {len(periodic)}")
        if not (np.isfinite(corner).all() and np.isfinite(edges).all()):
            raise InputError("a cell's origin and vectors must be finite")
        lengths = np.linalg.norm(edges, axis=1)
        if not abs(np.linalg.det(edges)) > 1e-12 * lengths.prod():
            raise InputError("a cell's three vectors must not lie in one plane")
        if flat and (edges[:2, 2].any() or edges[2, :2].any()):
            raise InputError("the first two vectors of a two-dimensional cell must have no z")
        self.origin, self.vectors, self.flat = corner, edges, bool(flat)
        one, two, three = (bool(flag) for flag in periodic)
        self.periodic = (one, two, three and not flat)
        corners = corner + np.array([*product((0, 1), repeat=3)]) @ edges
        self._bounds = np.column_stack([corners.min(axis=0), corners.max(axis=0)])

    @classmethod
    def of_box(
        cls, box: ArrayLike, periodic: Sequence[bool] = (False, False, False), *, flat: bool = False
    ) -> Cell:
        """Return the cell of a box along the axes.

        Parameters
        ----------
        box : (3, 2), lower and upper bound per axis, length
        periodic : for each axis, whether the faces across it are periodic
        flat : whether the packing is two-dimensional

        Raises InputError for a box of another shape, or whose bounds are not in order.
        """
        bounds = as_box(box)
        cell = cls(bounds[:, 0], np.diag(bounds[:, 1] - bounds[:, 0]), periodic, flat=flat)
        # The upper bound keeps all its digits.
        cell._bounds = bounds
        return cell

    @property
    def has_images(self) -> bool:
        """Whether any face is periodic."""
        return any(self.periodic)

    @property
    def volume(self) -> float:
        """Volume of the cell, length^3; of a two-dimensional one the area, length^2."""
        if self.flat:
            return float(abs(np.linalg.det(self.vectors[:2, :2])))
        return float(abs(np.linalg.det(self.vectors)))

    @property
    def bounds(self) -> FloatArray:
        """The smallest box along the axes that encloses the cell, (3, 2), length."""
        return self._bounds.copy()

    @property
    def can_be_flat(self) -> bool:
        """Whether discs in a plane of constant z fit: the third edge is along z, and periodic."""
        across = self.vectors[:2, 2].any() or self.vectors[2, :2].any()
        return self.periodic[2] and not across

    def flattened(self) -> Cell:
        """Return the two-dimensional cell of the same edges."""
        cell = Cell(self.origin, self.vectors, self.periodic, flat=True)
        cell._bounds = self._bounds
        return cell

    @cached_property
    def widths(self) -> FloatArray:
        """Distance between the two faces at the ends of a, b and c, (3,), length."""
        return np.asarray(1 / np.linalg.norm(self._inverse, axis=0), dtype=np.float64)

    @cached_property
    def flat_faces(self) -> FloatArray:
        """Faces across the axes, (3, 2), length: infinite where a face is periodic or oblique."""
        faces = np.array([[-np.inf, np.inf]] * 3)
        for axis in range(3):
            others = [other for other in range(3) if other != axis]
            # A face is across the axis if the two edges in it have no part along the axis.
            if not self.periodic[axis] and not self.vectors[others, axis].any():
                faces[axis] = self._bounds[axis]
        return faces

    def fractions(self, positions: FloatArray) -> FloatArray:
        """Return the fractions of a, b and c at which positions, (n, 3), lie, (n, 3)."""
        shares: FloatArray = (positions - self.origin) @ self._inverse
        return shares

    def wrapped(self, positions: FloatArray) -> FloatArray:
        """Return the image of each position, (n, 3), that lies in the cell, along what is periodic.

        A position that lies in the cell keeps all its digits.
        """
        out = np.where(self.periodic, np.floor(self.fractions(positions)), 0.0)
        moved: FloatArray = positions - out @ self.vectors
        return moved

    def nearest(self, apart: FloatArray) -> FloatArray:
        """Return the shortest image of each difference of two positions, (n, 3), length."""
        return apart + self.nearest_images(apart) @ self.vectors

    def nearest_images(self, apart: FloatArray) -> IntArray:
        """Return by which periods each difference of two positions is shortest, (n, 3).

        Rounding the fractions of a difference finds the shortest image in a cell of right angles.
        In an oblique one the lattice gets its shortest edges first; then the shortest image is the
        one that rounding finds, or one next to it (Nguyen and Stehle, ACM Trans. Algorithms 5
        (2009) 46).
        """
        steps = self._short_steps
        if not len(steps):
            return np.zeros(apart.shape, dtype=np.int64)
        edges = steps @ self.vectors
        # Fractions of the short edges; where only some faces are periodic, those of a projection.
        shares = apart @ np.linalg.pinv(edges)
        best = -np.rint(shares)
        around = np.array([*product((-1, 0, 1), repeat=len(steps))], dtype=np.float64)
        if self._is_rectangular:
            return (best @ steps).astype(np.int64)
        closest = best.copy()
        least = ((apart + best @ edges) ** 2).sum(axis=1)
        for step in around:
            squared = ((apart + (best + step) @ edges) ** 2).sum(axis=1)
            nearer = squared < least
            least[nearer] = squared[nearer]
            closest[nearer] = (best + step)[nearer]
        return np.rint(closest @ steps).astype(np.int64)

    def images_near_cell(
        self, positions: FloatArray, reach: FloatArray
    ) -> tuple[IntArray, IntArray]:
        """Return the images, none of them in its own place, within a reach of the cell.

        Parameters
        ----------
        positions : (n, 3), in the cell along what is periodic, length
        reach : (n,), distance from the cell's faces up to which images of each are wanted, length

        Returns
        -------
        (m,) and (m, 3): whose image each is, and by how many periods it is moved, in the order of
        the positions and then of the periods. Images a little farther away may be among them
        """
        pad = reach[:, None] / self.widths + ROUND_OFF
        return self._images(positions, -pad, 1 + pad, own=False)

    def images_in_box(
        self, positions: FloatArray, reach: FloatArray, box: FloatArray
    ) -> tuple[IntArray, IntArray]:
        """Return the images, the positions themselves among them, within a reach of a box.

        Parameters
        ----------
        positions : (n, 3), length
        reach : (n,), distance from the box's faces up to which images of each are wanted, length
        box : (3, 2), anywhere and of any size, length

        Returns
        -------
        (m,) and (m, 3): whose image each is, and by how many periods it is moved, in the order of
        the positions and then of the periods
        """
        corners = np.array([*product(*box)])
        shares = self.fractions(corners)
        pad = reach[:, None] / self.widths + ROUND_OFF
        owner, moves = self._images(
            positions, shares.min(axis=0) - pad, shares.max(axis=0) + pad, own=True
        )
        places = positions[owner] + moves @ self.vectors
        size = reach[owner, None]
        near = (places + size >= box[:, 0]) & (places - size <= box[:, 1])
        if self.flat:
            near[:, 2] = True
        kept = near.all(axis=1)
        return owner[kept], moves[kept]

    def _images(
        self, positions: FloatArray, low: FloatArray, high: FloatArray, *, own: bool
    ) -> tuple[IntArray, IntArray]:
        """Return the images whose fractions lie between bounds, (n, 3) each."""
        shares = self.fractions(positions)
        first = np.where(self.periodic, np.ceil(low - shares), 0.0)
        last = np.where(self.periodic, np.floor(high - shares), 0.0)
        numbers = np.maximum(last - first + 1, 0)
        # Whole numbers would overflow; a float may be infinite, or NaN, and is too large then.
        with np.errstate(over="ignore", invalid="ignore"):
            needed = float(numbers.prod(axis=1).sum())
        if not needed <= MOST_IMAGES:
            raise InputError(
                f"{needed:.2g} periodic images of {len(positions)} spheres are needed, more "
                f"than {MOST_IMAGES:.0e}: choose a smaller box or a shorter distance"
            )
        counts = numbers.astype(np.int64)
        each = counts.prod(axis=1)
        owner = np.repeat(np.arange(len(positions)), each)
        place = np.arange(len(owner)) - np.repeat(np.cumsum(each) - each, each)
        moves = first.astype(np.int64)[owner]
        for edge in (2, 1, 0):
            place, along = np.divmod(place, counts[owner, edge])
            moves[:, edge] += along
        if not own:
            away = moves.any(axis=1)
            owner, moves = owner[away], moves[away]
        return owner, moves

    @cached_property
    def _inverse(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.vectors), dtype=np.float64)

    @cached_property
    def _short_steps(self) -> IntArray:
        """Periods that lead along the shortest edges of the lattice, one per row."""
        steps: IntArray = np.eye(3, dtype=np.int64)[np.array(self.periodic)]
        while len(steps) > 1 and self._shortened(steps):
            pass
        return steps

    def _shortened(self, steps: IntArray) -> bool:
        """Make one of two or three edges shorter by adding or taking away others, if it can be.

        The edges are changed in place. This ends: a lattice has finitely many below a length.
        """
        edges = steps @ self.vectors
        squared = (edges**2).sum(axis=1)
        few = np.array([*product((-1, 0, 1), repeat=len(steps) - 1)], dtype=np.int64)
        for edge in np.argsort(-squared):
            others = np.delete(steps, edge, axis=0)
            # An edge of a very oblique cell may be as long as a million of the others.
            many = np.rint(edges[edge] @ np.linalg.pinv(np.delete(edges, edge, axis=0)))
            sums = np.concatenate([few, few - many.astype(np.int64)])
            tried = steps[edge] + sums @ others
            lengths = ((tried @ self.vectors) ** 2).sum(axis=1)
            best = int(np.argmin(lengths))
            if lengths[best] < squared[edge] * (1 - ROUND_OFF):
                steps[edge] = tried[best]
                return True
        return False

    @cached_property
    def _is_rectangular(self) -> bool:
        edges = self._short_steps @ self.vectors
        products = edges @ edges.T
        return bool((products == np.diag(np.diag(products))).all())
