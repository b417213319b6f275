"""Spheres as every measure takes them: places, radii, particles and the cell, checked once.

A measure that would look across a periodic face looks at images instead: `around` copies whole
particles next to a box, and what holds for an open packing holds for the copies.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .bodies import Particles, group_spheres
from .cell import Cell
from .errors import InputError
from .geometry import BoolArray, FloatArray, IntArray, as_box, as_spheres, inside_of


class Spheres:
    """The spheres of a packing, the particles that they make up, and the cell that they are in.

    Attributes
    ----------
    positions : (n, 3), length. In a periodic cell each particle is in one piece, and its centre in
        the cell: spheres are moved by whole periods to where that is so
    radii : (n,), length; of discs in a two-dimensional cell
    particles : which spheres make up which particle
    cell : the simulation cell; None where there is none, or none that matters: nothing is periodic
    """

    def __init__(
        self,
        positions: ArrayLike,
        radii: ArrayLike,
        particles: Particles | None = None,
        cell: Cell | None = None,
    ) -> None:
        """Check spheres.

        Parameters
        ----------
        positions : (n, 3), finite, n >= 1, length
        radii : (n,), positive, length
        particles : which spheres make up which particle; None: all spheres are free
        cell : the simulation cell; None: nothing is periodic, and space has three dimensions

        Raises InputError for arrays of other shapes or values, for another number of spheres in
        `particles`, and for discs of a two-dimensional cell that are not in one plane.
        """
        centres, self.radii = as_spheres(positions, radii)
        if particles is None:
            particles = group_spheres(np.zeros(len(centres), dtype=np.int64))
        self.particles = particles
        self.cell = cell
        centres = particles.checked(centres)
        if cell is not None and cell.flat and np.ptp(centres[:, 2]) > 0:
            raise InputError("the discs of a two-dimensional packing must all have the same z")
        self.positions: FloatArray = centres
        if cell is not None and cell.has_images:
            pieces = _in_one_piece(centres, self.radii, particles, cell)
            middles = particles.centres(pieces)
            moves = cell.wrapped(middles) - middles
            self.positions = pieces + moves[particles.index]

    def __len__(self) -> int:
        """Return the number of spheres."""
        return len(self.radii)

    @property
    def has_images(self) -> bool:
        """Whether the cell has a periodic face."""
        return self.cell is not None and self.cell.has_images

    @property
    def flat(self) -> bool:
        """Whether these are discs in a plane."""
        return self.cell is not None and self.cell.flat

    @property
    def endless(self) -> BoolArray:
        """Along which axes the packing has no end, (3,): by periods, or across discs."""
        endless = np.zeros(3, dtype=np.bool_)
        if self.cell is not None:
            # The periods of an oblique cell lead along several axes: none of them has an end.
            endless |= (self.cell.vectors[np.array(self.cell.periodic)] != 0).any(axis=0)
            endless[2] |= self.flat
        return endless

    @cached_property
    def centres(self) -> FloatArray:
        """The particles' centres, (p, 3), length: the mean of their spheres' centres.

        This is the centre of mass of `fix rigid` if all spheres of a body have the same mass.
        """
        return self.particles.centres(self.positions)

    @cached_property
    def extents(self) -> FloatArray:
        """The particles' largest distances of a point from the centre, (p,), length."""
        arms = np.linalg.norm(self.positions - self.centres[self.particles.index], axis=1)
        extents = np.zeros(len(self.particles))
        np.maximum.at(extents, self.particles.index, arms + self.radii)
        return extents

    def particles_in(self, box: ArrayLike | None) -> BoolArray:
        """Say which particles have their centre, or an image of it, in a box, (p,).

        Parameters
        ----------
        box : (3, 2), its faces included, length; z does not matter in two dimensions. None: all

        Raises InputError for a box of another shape, or whose bounds are not in order.
        """
        if box is None:
            return np.full(len(self.particles), True)
        bounds = as_box(box)
        if self.cell is None or not self.cell.has_images:
            return inside_of(self.centres, bounds, flat=self.flat)
        owner, _ = self.cell.images_in_box(self.centres, np.zeros(len(self.centres)), bounds)
        found = np.full(len(self.particles), False)
        found[owner] = True
        return found

    def around(self, box: ArrayLike, margin: float = 0.0) -> Images:
        """Return the particles of which a part may be within a margin of a box, images among them.

        Without periodic faces these are all particles, as they are.

        Parameters
        ----------
        box : (3, 2), anywhere and of any size, length
        margin : distance from the box, length

        Raises InputError for a box of another shape, and for too many images.
        """
        bounds = as_box(box)
        if self.cell is None or not self.cell.has_images:
            return self._alone()
        return self._copied(*self.cell.images_in_box(self.centres, self.extents + margin, bounds))

    def around_cell(self, margin: float = 0.0) -> Images:
        """Return all particles, then the images of which a part may be within a margin of the cell.

        Parameters
        ----------
        margin : distance from the cell, length

        Raises InputError for too many images.
        """
        if self.cell is None or not self.cell.has_images:
            return self._alone()
        owner, moves = self.cell.images_near_cell(self.centres, self.extents + margin)
        count = len(self.particles)
        return self._copied(
            np.concatenate([np.arange(count), owner]),
            np.concatenate([np.zeros((count, 3), dtype=np.int64), moves]),
        )

    def _alone(self) -> Images:
        count = len(self.particles)
        return Images(
            self, np.arange(len(self)), np.arange(count), np.zeros((count, 3), dtype=np.int64)
        )

    def _copied(self, owner: IntArray, moves: IntArray) -> Images:
        """Return images of particles: whose each is, (q,), and by how many periods, (q, 3)."""
        assert self.cell is not None
        index, sizes = self.particles.index, self.particles.sizes
        # The spheres of a particle stand side by side in this order.
        order = np.argsort(index, kind="stable")
        begins = np.cumsum(sizes) - sizes
        numbers = sizes[owner]
        image = np.repeat(np.arange(len(owner)), numbers)
        place = np.arange(len(image)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
        spheres = order[begins[owner][image] + place]
        copies = Particles(image, numbers, self.particles.bodies[owner])
        # Images need no periods of their own, but discs remain discs.
        open_cell = Cell(self.cell.origin, self.cell.vectors, flat=self.cell.flat)
        places = self.positions[spheres] + (moves @ self.cell.vectors)[image]
        copied = Spheres._of_checked(places, self.radii[spheres], copies, open_cell)
        return Images(copied, spheres, owner, moves)

    @classmethod
    def _of_checked(
        cls, positions: FloatArray, radii: FloatArray, particles: Particles, cell: Cell
    ) -> Spheres:
        """Make spheres of arrays that need no check, and may be empty; no face is periodic."""
        made = cls.__new__(cls)
        made.positions, made.radii, made.particles, made.cell = positions, radii, particles, cell
        return made


@dataclass(frozen=True, eq=False)
class Images:
    """Particles and images of them as an open packing, in which nothing is periodic. May be empty.

    Attributes
    ----------
    spheres : the spheres of all of them
    sphere : (m,), index of the sphere of which each is an image
    particle : (q,), index of the particle of which each is an image
    moves : (q, 3), by how many periods each particle is moved; 0 where it is in its own place
    """

    spheres: Spheres
    sphere: IntArray
    particle: IntArray
    moves: IntArray

    @property
    def own(self) -> BoolArray:
        """Which of the particles are in their own place, (q,)."""
        own: BoolArray = np.all(self.moves == 0, axis=1)
        return own


def _in_one_piece(
    positions: FloatArray, radii: FloatArray, particles: Particles, cell: Cell
) -> FloatArray:
    """Move the spheres of each particle by whole periods, so that the particle is in one piece.

    A particle may be longer than half a period. So each of its spheres is put next to the one that
    has its place already and leaves the smallest gap, beginning with the first: spheres that touch
    or overlap come before images that a particle does not touch.

    Parameters
    ----------
    positions : (n, 3), length
    radii : (n,), length
    particles : which spheres make up which particle
    cell : the cell with periodic faces
    """
    moved = positions.copy()
    order = np.argsort(particles.index, kind="stable")
    begins = np.cumsum(particles.sizes) - particles.sizes
    for size in np.unique(particles.sizes[particles.sizes > 1]).tolist():
        # The spheres of all particles of this size, (b, size).
        members = order[begins[particles.sizes == size][:, None] + np.arange(size)]
        _gather(moved, radii, members, cell)
    return moved


def _gather(positions: FloatArray, radii: FloatArray, members: IntArray, cell: Cell) -> None:
    """Put the spheres of some bodies together, in place.

    Parameters
    ----------
    positions : (n, 3), of all spheres, length
    radii : (n,), of all spheres, length
    members : (b, k), indices of the spheres of each body
    cell : the cell with periodic faces
    """
    bodies, size = members.shape
    row = np.arange(bodies)
    # For each sphere: its smallest gap to one that has its place, and where it is then.
    gap = np.full((bodies, size), np.inf)
    near = np.zeros((bodies, size, 3))
    placed = np.zeros((bodies, size), dtype=np.bool_)
    place, radius = positions[members], radii[members]
    last = np.zeros(bodies, dtype=np.int64)
    placed[:, 0] = True
    for _ in range(size - 1):
        start = place[row, last][:, None]
        shortest = cell.nearest((place - start).reshape(-1, 3)).reshape(place.shape)
        gaps = np.linalg.norm(shortest, axis=2) - radius - radius[row, last][:, None]
        nearer = (gaps < gap) & ~placed
        gap[nearer] = gaps[nearer]
        near[nearer] = (start + shortest)[nearer]
        last = np.argmin(np.where(placed, np.inf, gap), axis=1)
        place[row, last] = near[row, last]
        placed[row, last] = True
    positions[members] = place


P = ParamSpec("P")
R = TypeVar("R")


def takes_spheres(measure: Callable[P, R]) -> Callable[P, R]:
    """Let a measure of `spheres` refuse what are none, such as an array of positions.

    Raises InputError when the measure is called so, which says how to make them.
    """
    place = list(inspect.signature(measure).parameters).index("spheres")

    @wraps(measure)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        given = args[place] if place < len(args) else kwargs.get("spheres")
        if given is not None and not isinstance(given, Spheres):
            raise InputError(
                f"{measure.__name__}: spheres must be of the class Spheres, as frame.spheres is, "
                f"not {type(given).__name__}: Spheres(positions, radii) makes them of arrays"
            )
        return measure(*args, **kwargs)

    return checked
