"""Local order: radial distribution function and bond-orientational order, counted by freud.

freud knows periodic boxes only. The packing, with the images that matter, is put into one so wide
that none of freud's own images is a neighbour: no period is too short. Averages are over the
particles in a box away from the walls, whose neighbours may be outside.
freud stores positions as float32: distances are good to about 1e-7 of the packing's size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .errors import InputError
from .geometry import BoolArray, FloatArray, IntArray, as_box, as_count, inside_of
from .packing import Region
from .spheres import Spheres, takes_spheres

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Order of a sphere's twelve neighbours in the two densest crystals: Steinhardt, Nelson and
# Ronchetti, Physical Review B 28 (1983) 784.
Q4_OF_CRYSTALS = {"fcc": 0.1909, "hcp": 0.0972}
Q6_OF_CRYSTALS = {"fcc": 0.5745, "hcp": 0.4848}
NEIGHBOURS = 12
# A bond is crystalline if the order of its ends agrees by more than this, a particle if so many of
# its bonds are: ten Wolde, Ruiz-Montero and Frenkel, Faraday Discussions 104 (1996) 93.
ALIGNED = 0.7
CRYSTALLINE_BONDS = 8
# A packing with a larger share of crystalline particles is not random.
MOST_CRYSTALLINE = 0.5


@dataclass(frozen=True, eq=False)
class RadialDistribution:
    """The radial distribution function g(r): density at distance r from a centre, over the mean.

    Attributes
    ----------
    edges : (bins + 1,), of the shells, length
    values : (bins,), 1 where there is no order
    density : mean number of centres per volume in the box, 1 / length^3
    particles : number of particles in the box, around which centres were counted
    """

    edges: FloatArray
    values: FloatArray
    density: float
    particles: int

    @property
    def middles(self) -> FloatArray:
        """Middle of each shell, (bins,), length."""
        middles: FloatArray = (self.edges[:-1] + self.edges[1:]) / 2
        return middles


@dataclass(frozen=True, eq=False)
class BondOrder:
    """Steinhardt's bond-orientational order of some particles, from their twelve nearest ones.

    For comparison (q4, q6): fcc 0.1909, 0.5745; hcp 0.0972, 0.4848. In random packings q6 is about
    0.3 to 0.45 and wide, so that its mean alone does not tell; the share of crystalline bonds does.

    Attributes
    ----------
    q4, q6 : (c,), one value per particle in the box
    crystalline_bonds : (c,), how many of the twelve bonds join particles of the same orientation
    w6 : (c,), third-order invariant, normalised; -0.0132 for fcc, -0.0124 for hcp; None unless it
        was asked for
    """

    q4: FloatArray
    q6: FloatArray
    crystalline_bonds: FloatArray
    w6: FloatArray | None = None

    @property
    def crystalline(self) -> BoolArray:
        """Whether each particle is in a crystal, with eight crystalline bonds or more, (c,)."""
        crystalline: BoolArray = self.crystalline_bonds >= CRYSTALLINE_BONDS
        return crystalline

    @property
    def crystalline_share(self) -> float:
        """Share of the particles that are in a crystal."""
        return float(self.crystalline.mean())

    @property
    def crystallised(self) -> bool:
        """Whether most of the particles are in a crystal."""
        return self.crystalline_share > MOST_CRYSTALLINE

    @property
    def shares(self) -> dict[str, float]:
        """Shares of particles that are fcc, hcp and disordered; they add up to 1.

        A particle in a crystal is taken for the one that is nearer in q4 and q6.
        """
        distance = np.array(
            [
                (self.q4 - Q4_OF_CRYSTALS[name]) ** 2 + (self.q6 - Q6_OF_CRYSTALS[name]) ** 2
                for name in Q6_OF_CRYSTALS
            ]
        )
        nearer = np.argmin(distance, axis=0)
        found = {
            name: float((self.crystalline & (nearer == index)).mean())
            for index, name in enumerate(Q6_OF_CRYSTALS)
        }
        return found | {"disordered": 1.0 - self.crystalline_share}


@takes_spheres
def radial_distribution(
    spheres: Spheres, box: ArrayLike | None = None, *, largest: float, bins: int = 200
) -> RadialDistribution:
    """Measure g(r) around the particles in a box that lies well inside a packing.

    Centres outside the box are counted too, so no surface cuts a shell: the box must be at least
    `largest` away from the outermost centres on every side that is not periodic. The mean density
    is that in the box. In two dimensions shells are rings, and densities those per area.

    Parameters
    ----------
    spheres : the particles whose centres are counted, and their cell
    box : (3, 2), length; None: the whole cell, which must be periodic on all sides
    largest : upper edge of the last shell, length; more than half a period is allowed
    bins : number of shells of the same thickness, from 0

    Raises InputError for a box that is too near to the outermost centres or holds none, for no box
    where the cell is not periodic, for less than one shell, for a largest radius that is not
    positive and finite, and for too many images.
    """
    # freud takes half a second to import, which most uses need not wait for.
    import freud

    bins = as_count(bins, "the number of shells")
    if not (largest > 0 and math.isfinite(largest)):
        raise InputError(f"the largest radius must be positive and finite, not {largest:g}")
    region = Region(spheres, box)
    centres, chosen = _centres(spheres, box, largest)
    if box is not None:
        _require_depth(spheres, as_box(box), largest)
    system, points = _system(centres, largest)
    counter: Any = freud.density.RDF(bins=bins, r_max=largest)
    # This distance is above 0, so that no particle counts itself.
    smallest = 1e-6 * largest
    query = {"mode": "ball", "r_max": largest, "r_min": smallest, "exclude_ii": False}
    counter.compute((system, points), query_points=points[chosen], neighbors=query)
    edges = np.linspace(0.0, largest, bins + 1)
    shells = math.pi * np.diff(edges**2) if spheres.flat else 4 / 3 * math.pi * np.diff(edges**3)
    particles = int(chosen.sum())
    density = particles / region.size
    numbers = np.asarray(counter.bin_counts, dtype=np.float64)
    return RadialDistribution(
        edges=edges,
        values=numbers / (particles * density * shells),
        density=density,
        particles=particles,
    )


@takes_spheres
def bond_order(spheres: Spheres, box: ArrayLike | None = None, *, w6: bool = False) -> BondOrder:
    """Measure the bond-orientational order of the particles in a box away from the walls.

    The neighbours are the twelve nearest, which needs no cutoff. The box should be two diameters
    away from the outermost centres on sides that are not periodic: bonds are compared with those of
    the neighbours.

    Parameters
    ----------
    spheres : the particles whose centres are neighbours, 13 or more if none has images, and their
        cell
    box : (3, 2), length; None: the whole cell, which must be periodic on all sides
    w6 : whether to measure w6 as well, which takes a third longer

    Raises InputError for a box of another shape, for no box where the cell is not periodic, for too
    few particles, for a box without a centre, for discs, and for too many images.
    """
    import freud

    if spheres.flat:
        raise InputError("q4, q6 and w6 are those of spheres in space, not of discs in a plane")
    centres, chosen, neighbours = _nearest_twelve(spheres, box)
    # The box is wider than the packing, so that images are far away.
    system, points = _system(centres, float(np.ptp(centres, axis=0).max()))
    # The order of the others is not asked for.
    needed = chosen.copy()
    needed[neighbours[chosen]] = True
    one = np.repeat(np.flatnonzero(needed), NEIGHBOURS)
    other = neighbours[needed].ravel()
    bonds: Any = freud.locality.NeighborList.from_arrays(
        len(points), len(points), one, other, points[other] - points[one]
    )

    def order(degree: int, **options: bool) -> FloatArray:
        measured: Any = freud.order.Steinhardt(degree, **options)
        values = measured.compute((system, points), neighbors=bonds).particle_order
        return np.asarray(values, dtype=np.float64)[chosen]

    aligned: Any = freud.order.SolidLiquid(
        6, q_threshold=ALIGNED, solid_threshold=CRYSTALLINE_BONDS
    )
    aligned.compute((system, points), neighbors=bonds)
    return BondOrder(
        q4=order(4),
        q6=order(6),
        crystalline_bonds=np.asarray(aligned.num_connections, dtype=np.float64)[chosen],
        w6=order(6, wl=True, wl_normalize=True) if w6 else None,
    )


def plot_radial_distribution(
    ax: Axes, distribution: RadialDistribution, *, diameter: float = 1.0, label: str | None = None
) -> Axes:
    """Plot g(r) over r / diameter.

    Parameters
    ----------
    ax : the axes to draw on, which are returned
    distribution : from `radial_distribution`: values of b shells, and their edges, length
    diameter : of the spheres, length; 1 leaves the distances in the unit of length
    label : the name of the curve in the legend

    Raises InputError for a diameter that is not positive and finite.
    """
    if not 0 < diameter < math.inf:
        raise InputError(f"a diameter must be positive and finite, not {diameter:g}")
    ax.plot(distribution.middles / diameter, distribution.values, linewidth=1, label=label)
    ax.axhline(1.0, color="0.7", linewidth=0.8)
    ax.set_xlabel("r" if diameter == 1.0 else "r / d")
    ax.set_ylabel("g(r)")
    return ax


def _nearest_twelve(
    spheres: Spheres, box: ArrayLike | None
) -> tuple[FloatArray, BoolArray, IntArray]:
    """Return the twelve nearest centres of each particle in a box, and of these twelve.

    Returns
    -------
    (q, 3), (q,) and (q, 12): all centres, images among them, which of them lie in the box, and the
    neighbours of each, which are right for those in the box and for their neighbours
    """
    # This reach is doubled until no image that is farther away can be nearer than a neighbour.
    reach = 4 * float(spheres.extents.max())
    while True:
        centres, chosen = _centres(spheres, box, reach)
        enough = len(centres) > NEIGHBOURS
        if not enough and not spheres.has_images:
            raise InputError(f"more than {NEIGHBOURS} particles are needed, not {len(centres)}")
        if enough:
            # freud's own search took eight times as long. The nearest one of each is itself.
            distance, nearest = scipy.spatial.KDTree(centres).query(centres, k=NEIGHBOURS + 1)
            neighbours = nearest[:, 1:]
            bond = distance[chosen].max()
            next_bond = distance[neighbours[chosen]].max()
            if not spheres.has_images or bond + next_bond <= reach:
                return centres, chosen, neighbours
        reach *= 2


def _centres(spheres: Spheres, box: ArrayLike | None, reach: float) -> tuple[FloatArray, BoolArray]:
    """Return the particles' centres within a reach of a box, images too, and which are in the box.

    Without periodic faces these are all centres. Raises InputError for a box without a centre, and
    for no box where the cell is not periodic on all sides.
    """
    centres, cell = spheres.centres, spheres.cell
    if box is None:
        if cell is None or not all(cell.periodic[: 2 if cell.flat else 3]):
            raise InputError("the cell is not periodic on all sides: a box inside it is needed")
        owner, moves = cell.images_near_cell(cell.wrapped(centres), np.full(len(centres), reach))
        images = cell.wrapped(centres)[owner] + moves @ cell.vectors
        own = np.arange(len(centres) + len(owner)) < len(centres)
        return np.concatenate([cell.wrapped(centres), images]), own
    bounds = as_box(box)
    if cell is not None and cell.has_images:
        owner, moves = cell.images_in_box(centres, np.full(len(centres), reach), bounds)
        centres = centres[owner] + moves @ cell.vectors
    chosen = inside_of(centres, bounds, flat=spheres.flat)
    if not chosen.any():
        raise InputError("no particle's centre lies in the box: the mean over none does not exist")
    return centres, chosen


def _require_depth(spheres: Spheres, box: FloatArray, depth: float) -> None:
    """Raise InputError for a box that is nearer to the outermost centres where these have an end.

    Between faces of a cell whose other faces are periodic that is a distance across these faces.
    """
    centres, names = spheres.centres, "xyz"
    ends, far, endless = box, np.full(3, depth), spheres.endless
    cell = spheres.cell
    if cell is not None and cell.has_images:
        shares = cell.fractions(np.array([*product(*box)]))
        ends, far = np.column_stack([shares.min(axis=0), shares.max(axis=0)]), depth / cell.widths
        centres, endless = cell.fractions(centres), np.array(cell.periodic)
        endless[2] |= cell.flat
        names = "xyz" if np.isfinite(cell.flat_faces[~endless]).all() else "abc"
    short = (ends[:, 0] - far < centres.min(axis=0)) | (ends[:, 1] + far > centres.max(axis=0))
    short &= ~endless
    if short.any():
        raise InputError(
            f"along {names[int(np.argmax(short))]} the box must be {depth:g} or more away from the "
            "outermost centres"
        )


def _system(centres: FloatArray, margin: float) -> tuple[Any, FloatArray]:
    """Return freud's box around all centres, images at least `margin` away, and the centres.

    The centres are shifted: freud's boxes are centred at the origin.
    """
    import freud

    lower, upper = centres.min(axis=0), centres.max(axis=0)
    # freud allows a search up to half of the box's width.
    widths = np.maximum(upper - lower + margin, 2 * margin) * 1.01
    return freud.box.Box(*widths.tolist()), centres - (lower + upper) / 2
