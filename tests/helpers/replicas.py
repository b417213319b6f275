"""Random packings in cells, and all their images by plain loops: nothing here is the package's.

Only `Packing.spheres` hands one over to the analysis. Bodies are in one piece here; the analysis
gets every sphere in an image of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise, product

import numpy as np
import overlap
from numpy.typing import ArrayLike

from lammps_inelastic.analysis import Cell, Spheres, group_spheres
from lammps_inelastic.analysis.geometry import FloatArray, IntArray
from tests.helpers.integration import dimer_in_box, integrate, quadrant, root

Shape = Callable[[np.random.Generator], tuple[FloatArray, FloatArray]]
# The periods in which spheres are handed over are up to this number away.
FAR = 3


def moves_within(vectors: FloatArray, periodic: Sequence[bool], reach: float) -> IntArray:
    """Return all periods that can lead a distance, and others, (m, 3).

    Where only some edges are periodic the lattice has fewer dimensions. Across the others a plane
    of the lattice is as far from the next one as the part of its edge that is normal to them.
    """
    ranges = []
    for own in range(3):
        others = [k for k in range(3) if k != own and periodic[k]]
        normal = vectors[own].copy()
        if others:
            plane, _ = np.linalg.qr(vectors[others].T)
            normal -= plane @ (plane.T @ normal)
        most = int(reach / np.linalg.norm(normal)) + 1 if periodic[own] else 0
        ranges.append(range(-most, most + 1))
    moves = np.array([*product(*ranges)])
    return moves[np.linalg.norm(moves @ vectors, axis=1) <= reach]


@dataclass(frozen=True, eq=False)
class Packing:
    """Spheres in a cell, each body in one piece; bodies 0 are free spheres."""

    positions: FloatArray
    radii: FloatArray
    bodies: IntArray
    origin: FloatArray
    vectors: FloatArray
    periodic: tuple[bool, ...]
    flat: bool = False

    @cached_property
    def cell(self) -> Cell:
        return Cell(self.origin, self.vectors, self.periodic, flat=self.flat)

    @cached_property
    def members(self) -> list[IntArray]:
        """The spheres of each particle, in the order of the first ones."""
        found = [
            np.array([one]) if body == 0 else np.flatnonzero(self.bodies == body)
            for one, body in enumerate(self.bodies)
        ]
        return [spheres for one, spheres in enumerate(found) if spheres[0] == one]

    @property
    def edges(self) -> FloatArray:
        """The edges that are periods."""
        return self.vectors[np.array(self.periodic)]

    @property
    def volume(self) -> float:
        """Volume of the cell, or area."""
        a, b, c = self.vectors
        return abs(a[0] * b[1] - a[1] * b[0]) if self.flat else abs(float(np.cross(a, b) @ c))

    @cached_property
    def owner(self) -> IntArray:
        """The particle of each sphere."""
        owner = np.zeros(len(self.radii), dtype=int)
        for particle, members in enumerate(self.members):
            owner[members] = particle
        return owner

    @cached_property
    def centres(self) -> FloatArray:
        """The centre of each particle."""
        return np.array([self.positions[members].mean(axis=0) for members in self.members])

    def shifts(self, reach: float) -> FloatArray:
        """Return the vectors of all sums of periods up to a length, (m, 3)."""
        return moves_within(self.vectors, self.periodic, reach) @ self.vectors

    def spheres(self, seed: int | None = 0) -> Spheres:
        """Return these spheres, each in some image of its own; at home for no seed."""
        places = self.positions
        if seed is not None:
            generator = np.random.default_rng(seed)
            away = generator.integers(-FAR, FAR + 1, (len(places), 3)) * self.periodic
            places = places + away @ self.vectors
        return Spheres(places, self.radii, group_spheres(self.bodies), self.cell)

    def opened(self, box: ArrayLike, margin: float = 0.0) -> Packing:
        """Return all particles of which a part may be in a box, or within a margin of it, as open.

        A body's number is that of its original plus 1000 times that of its image.
        """
        bounds = np.array(box, dtype=float)
        if self.flat:
            bounds[2] = self.positions[0, 2] + np.array([-1, 1])
        middle, half = bounds.mean(axis=1), np.linalg.norm(np.diff(bounds)) / 2
        span = np.linalg.norm(self.positions - middle, axis=1).max() + half + margin
        moves = moves_within(self.vectors, self.periodic, span + 6 * self.radii.max())
        moves = moves[np.argsort(moves.any(axis=1), kind="stable")]
        places, radii, bodies = [], [], []
        size = self.radii[:, None] + margin
        for image, shift in enumerate(moves @ self.vectors):
            place = self.positions + shift
            near = ((place + size >= bounds[:, 0]) & (place - size <= bounds[:, 1])).all(axis=1)
            whole = np.isin(self.owner, self.owner[near])
            places.append(place[whole])
            radii.append(self.radii[whole])
            body = self.bodies[whole]
            bodies.append(np.where(body > 0, body + 1000 * image, 0))
        return replace(
            self,
            positions=np.concatenate(places),
            radii=np.concatenate(radii),
            bodies=np.concatenate(bodies),
            periodic=(False, False, False),
        )

    def pairs(self, gap: float) -> dict[tuple[int, ...], float]:
        """Return the gaps below some length, by both spheres and the periods of the second one.

        The pairs are those of different particles, or of one and its own image, each once: the
        first sphere has the lower number, or the first period is positive.
        """
        x, r = self.positions, self.radii
        if len(x) == 0:
            return {}
        farthest = np.linalg.norm(x[:, None] - x, axis=2).max() + 2 * r.max() + gap
        found = {}
        for move in moves_within(self.vectors, self.periodic, farthest):
            apart = np.linalg.norm(x[:, None] - (x + move @ self.vectors), axis=2)
            gaps = apart - (r[:, None] + r)
            for one, other in np.argwhere(gaps < gap).tolist():
                own = one == other
                first = next((k for k in move.tolist() if k), 0)
                if (self.owner[one] != self.owner[other] or move.any()) and (
                    one < other or (own and first > 0)
                ):
                    found[one, other, *move.tolist()] = float(gaps[one, other])
        return found

    def size_in(self, box: ArrayLike) -> tuple[float, float]:
        """Return the volumes of all particles and images in a box, and of all their overlaps."""
        all_images = self.opened(box)
        total = sum(
            union_in_box(all_images.positions[m], all_images.radii[m], box, flat=self.flat)
            for m in all_images.members
        )
        common = 0.0
        for one, other, *_ in all_images.pairs(0.0):
            both = np.array([one, other])
            places, sizes = all_images.positions[both], all_images.radii[both]
            each = sum(union_in_box(places[[k]], sizes[[k]], box, flat=self.flat) for k in range(2))
            common += each - union_in_box(places, sizes, box, flat=self.flat)
        return total, common


def size_of_box(box: ArrayLike, *, flat: bool) -> float:
    return float(np.prod(np.diff(np.asarray(box, dtype=float))[: 2 if flat else 3]))


def union_in_box(centres: FloatArray, radii: FloatArray, box: ArrayLike, *, flat: bool) -> float:
    """Return the volume of a sphere or of the union of two in a box, or such an area of discs."""
    bounds = np.asarray(box, dtype=float)[: 2 if flat else 3]
    x = centres[:, : len(bounds)]
    size = radii[:, None]
    # A sphere beyond a face is not cut by the box, nor is one inside.
    if ((x - size >= bounds[:, 1]) | (x + size <= bounds[:, 0])).any(axis=1).all():
        return 0.0
    if ((x - size >= bounds[:, 0]) & (x + size <= bounds[:, 1])).all():
        return union(x, radii)
    if len(x) == 1 and flat:
        (x0, x1), (y0, y1) = bounds - x[0][:, None]
        r = float(radii[0])
        return float(
            quadrant(r, x1, y1) - quadrant(r, x0, y1) - quadrant(r, x1, y0) + quadrant(r, x0, y0)
        )
    if len(x) == 1:
        (x0, x1), (y0, y1), (z0, z1) = bounds
        base = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
        solid = overlap.Hexahedron([[*corner, z] for z in (z0, z1) for corner in base])
        return float(overlap.overlap_volume(overlap.Sphere(x[0], float(radii[0])), solid))
    if flat:
        return discs_in_box(x, radii, bounds)
    return dimer_in_box(x, radii.tolist(), bounds)


def union(centres: FloatArray, radii: FloatArray) -> float:
    """Return the volume of one ball or two, or such an area of discs, by that of their lens."""
    flat = centres.shape[1] == 2
    balls = np.pi * radii**2 if flat else 4 / 3 * np.pi * radii**3
    total = float(balls.sum())
    if len(radii) == 1:
        return total
    a, b = radii
    d = float(np.linalg.norm(centres[1] - centres[0]))
    if d >= a + b:
        return total
    if d <= abs(a - b):
        return float(balls.max())
    if not flat:
        lens = np.pi * (a + b - d) ** 2
        return total - lens * (d**2 + 2 * d * (a + b) - 3 * (a - b) ** 2) / (12 * d)
    angles = [2 * np.arccos((d**2 + p**2 - q**2) / (2 * d * p)) for p, q in ((a, b), (b, a))]
    return total - sum(p**2 / 2 * (t - np.sin(t)) for p, t in zip((a, b), angles, strict=True))


def discs_in_box(centres: FloatArray, radii: FloatArray, box: FloatArray) -> float:
    """Return the area of the union of one or two discs in a rectangle: chords along y, over x."""
    (x0, x1), (y0, y1) = box
    breaks = []
    for (x, y), r in zip(centres, radii, strict=True):
        breaks += [x + s * root(r**2 - h**2) for h in (0, y0 - y, y1 - y) for s in (-1, 1)]
    if len(radii) == 2:
        axis = centres[1] - centres[0]
        d = np.linalg.norm(axis)
        share = (d**2 + radii[0] ** 2 - radii[1] ** 2) / (2 * d)
        half = root(radii[0] ** 2 - share**2)
        breaks += [centres[0, 0] + (share * axis[0] + s * half * axis[1]) / d for s in (-1, 1)]

    def length(x: FloatArray) -> FloatArray:
        ends = []
        for centre, r in zip(centres, radii, strict=True):
            square = r**2 - (x - centre[0]) ** 2
            half = np.sqrt(np.maximum(square, 0))
            low, high = np.maximum(centre[1] - half, y0), np.minimum(centre[1] + half, y1)
            ends.append((low, np.where(square > 0, np.maximum(high, low), low)))
        total: FloatArray = sum(high - low for low, high in ends) + np.zeros_like(x)
        if len(ends) == 2:
            (low1, high1), (low2, high2) = ends
            total -= np.maximum(np.minimum(high1, high2) - np.maximum(low1, low2), 0)
        return total

    return integrate(length, x0, x1, breaks)


def free(generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return a sphere, the largest five times as large as the smallest."""
    return np.zeros((1, 3)), generator.uniform(0.1, 0.5, 1)


def dimer(generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return two equal spheres that overlap, or touch."""
    radius = generator.uniform(0.15, 0.4)
    length = radius * generator.choice([0.7, 1.3, 2.0])
    return np.outer([-0.5, 0.5], direction(generator) * length), np.full(2, radius)


def uneven(generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return two spheres of different sizes."""
    radii = np.array([0.4, generator.uniform(0.1, 0.3)])
    return np.outer([0, 1], direction(generator) * radii.sum() * 0.9), radii


def snake(generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return five spheres in a bent row, of different sizes: longer than half of most periods."""
    radii = np.array([0.1, 0.3, 0.12, 0.25, 0.1])
    along, places = direction(generator), [np.zeros(3)]
    for one, other in pairwise(radii):
        along = along + 0.4 * direction(generator)
        along /= np.linalg.norm(along)
        places.append(places[-1] + along * 0.95 * (one + other))
    return np.array(places), radii


def direction(generator: np.random.Generator) -> FloatArray:
    arm = generator.normal(size=3)
    return arm / np.linalg.norm(arm)


def packed(
    seed: int,
    vectors: ArrayLike,
    periodic: Sequence[bool],
    shapes: Sequence[Shape],
    count: int,
    *,
    flat: bool = False,
    overlapping: float = 0.0,
) -> Packing:
    """Place particles at random, one after the other, where they overlap none and no image.

    Parameters
    ----------
    seed : of the random numbers
    vectors, periodic, flat : as of a cell, whose origin is somewhere
    shapes : of which each particle has one
    count : the number of particles; fewer where no more fit
    overlapping : share of the distance by which spheres may overlap
    """
    generator = np.random.default_rng(seed)
    edges = np.array(vectors, dtype=float)
    origin = generator.uniform(-3, 3, 3)
    packing = Packing(
        np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=int), origin, edges, tuple(periodic), flat
    )
    shifts = moves_within(edges, periodic, np.linalg.norm(edges, axis=1).sum() + 4) @ edges
    away = shifts[shifts.any(axis=1)]
    x, r = packing.positions, packing.radii
    bodies: list[int] = []
    for number in range(1, 200 * count):
        places, radii = shapes[int(generator.integers(len(shapes)))](generator)
        turned = places.copy()
        if flat:
            turned[:, 2] = 0
            length = np.linalg.norm(np.diff(places, axis=0), axis=1)
            flat_length = np.linalg.norm(np.diff(turned, axis=0), axis=1)
            if (flat_length < 0.5 * length).any():
                continue
        place = origin + generator.uniform(size=3) @ edges + turned
        if flat:
            place[:, 2] = origin[2] + edges[2, 2] / 2
        apart = np.linalg.norm(place[:, None, None] - (x[:, None] + shifts), axis=3)
        own = np.linalg.norm(place[:, None, None] - (place[:, None] + away), axis=3)
        least = 1 - overlapping
        if (apart >= least * (radii[:, None] + r)[..., None]).all() and (
            own >= least * (radii[:, None] + radii)[..., None]
        ).all():
            x, r = np.concatenate([x, place]), np.concatenate([r, radii])
            bodies += [number if len(radii) > 1 else 0] * len(radii)
            if len({b or -k for k, b in enumerate(bodies)}) == count:
                break
    # The spheres of a body do not stand side by side in a dump.
    order = generator.permutation(len(r))
    return replace(packing, positions=x[order], radii=r[order], bodies=np.array(bodies)[order])


TILTED = [[3.0, 0, 0], [1.3, 2.5, 0], [-0.8, 0.9, 2.7]]
# The rotation about all axes of what LAMMPS calls a general triclinic box.
TURN = np.array([[2.0, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
T, F = True, False
CELLS = {
    "ppp": (np.diag([3.1, 2.6, 2.9]), (T, T, T)),
    "narrow": (np.diag([2.0, 2.1, 2.0]), (T, T, T)),
    "pff": (np.diag([2.1, 3.6, 3.0]), (T, F, F)),
    "fpf": (np.diag([2.6, 2.2, 3.0]), (F, T, F)),
    "ppf": (np.diag([2.3, 2.6, 3.5]), (T, T, F)),
    "fpp": (np.diag([3.3, 2.6, 2.2]), (F, T, T)),
    "tilted": (np.array(TILTED), (T, T, T)),
    "oblique": (np.array([[2.5, 0, 0], [6.1, 2.4, 0], [-4.4, 5.3, 2.6]]), (T, T, T)),
    "turned": (np.array(TILTED) @ TURN, (T, T, T)),
    "tilted ppf": (np.array([[2.6, 0, 0], [1.3, 2.4, 0], [0, 0, 3.5]]), (T, T, F)),
    "tilted pfp": (np.array([[2.6, 0, 0], [0, 3.5, 0], [-0.9, 0, 2.4]]), (T, F, T)),
    "tilted fpf": (np.array([[4.0, 0, 0], [1.5, 2.2, 0], [0, 0, 3.0]]), (F, T, F)),
}
PLANES = {
    "pp": (np.diag([3.1, 2.6, 1]), (T, T, F)),
    "pf": (np.diag([2.2, 4.5, 1]), (T, F, F)),
    "tilted": (np.array([[3.0, 0, 0], [1.3, 2.6, 0], [0, 0, 1]]), (T, T, F)),
    "oblique": (np.array([[2.5, 0, 0], [8.3, 2.6, 0], [0, 0, 1]]), (T, T, F)),
    "narrow": (np.diag([2.0, 2.0, 1]), (T, T, F)),
}
SHAPES: dict[str, tuple[Shape, ...]] = {
    "spheres": (free,),
    "dimers": (free, dimer, uneven),
    "clusters": (free, dimer, snake),
}


@cache
def in_space(cell: str, shapes: str, overlapping: float = 0.0) -> Packing:
    """Return one of the packings of spheres."""
    vectors, periodic = CELLS[cell]
    count = 14 if cell == "narrow" else 22
    return packed(len(cell), vectors, periodic, SHAPES[shapes], count, overlapping=overlapping)


@cache
def in_plane(cell: str, shapes: str, overlapping: float = 0.0) -> Packing:
    """Return one of the packings of discs."""
    vectors, periodic = PLANES[cell]
    return packed(
        len(cell), vectors, periodic, SHAPES[shapes], 14, flat=True, overlapping=overlapping
    )


def packings(*shapes: str, overlapping: float = 0.0) -> dict[str, Callable[[], Packing]]:
    """Return what makes all packings of some shapes, with their names."""

    def maker(
        make: Callable[[str, str, float], Packing], cell: str, shape: str
    ) -> Callable[[], Packing]:
        return lambda: make(cell, shape, overlapping)

    return {
        f"{name} {cell} {shape}": maker(make, cell, shape)
        for make, cells, name in ((in_space, CELLS, "3D"), (in_plane, PLANES, "2D"))
        for cell in cells
        for shape in shapes
    }
