"""The network of contacts as a graph, and its drawing (Figure 8 of Faure et al. 2009)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .contact_lines import ContactLines, contact_lines
from .coordination import contact_sides
from .errors import InputError
from .geometry import FloatArray, IntArray, as_floats, as_integers, as_positions
from .spheres import Spheres, takes_spheres

if TYPE_CHECKING:
    import networkx
    from matplotlib.axes import Axes

PALETTE = "viridis"
# The thickness of the line of the mean force, in points.
MEAN_WIDTH = 0.8
# The force of the thickest line, in mean forces: few contacts carry more.
LARGEST_SHOWN = 4.0


@dataclass(frozen=True)
class NetworkDifference:
    """The difference of two contact networks of the same spheres.

    Attributes
    ----------
    forces : sum of the differences of the forces over all contacts that either has, where those of
        each network sum to 1: 0 if the two are the same, 2 if they have no contact in common
    shared : contacts that both have, over those that either has
    """

    forces: float
    shared: float


def network_difference(
    contact_ids: ArrayLike,
    forces: ArrayLike,
    reference_ids: ArrayLike,
    reference_forces: ArrayLike,
) -> NetworkDifference:
    """Compare a contact network with a reference, whatever the units of their forces.

    Parameters
    ----------
    contact_ids : (m, 2), m >= 1, spheres on both sides, in either order; the second is -k for wall
        k. A contact that is there several times counts with the sum of its forces
    forces : (m,), not all 0; < 0 where a contact pulls
    reference_ids, reference_forces : (r, 2) and (r,), likewise

    Raises InputError for arrays of other shapes, for a contact of a sphere with itself, and for
    forces that are not finite or all 0.
    """
    one = _shares(contact_ids, forces)
    other = _shares(reference_ids, reference_forces)
    either = one.keys() | other.keys()
    apart = sum(abs(one.get(pair, 0.0) - other.get(pair, 0.0)) for pair in either)
    return NetworkDifference(apart, len(one.keys() & other.keys()) / len(either))


def _shares(contact_ids: ArrayLike, forces: ArrayLike) -> dict[tuple[int, int], float]:
    """Return for each pair its share of the strengths of all forces, < 0 where it pulls."""
    ids = as_integers(contact_ids, "contact ids")
    strength = as_floats(forces, "forces")
    if ids.ndim != 2 or ids.shape[1] != 2 or strength.shape != (len(ids),):
        raise InputError(
            f"contact ids and forces must have shape (m, 2) and (m,), not {ids.shape} and "
            f"{strength.shape}"
        )
    if (own := ids[:, 0] == ids[:, 1]).any():
        raise InputError(f"sphere {ids[own][0, 0]} is in contact with itself")
    # This condition is written so that NaN fails too.
    total = np.abs(strength).sum()
    if not 0 < total < np.inf:
        raise InputError("forces must be finite, and not all of them 0")
    shares: dict[tuple[int, int], float] = {}
    ordered = np.sort(ids, axis=1).tolist()
    for (low, high), share in zip(ordered, (strength / total).tolist(), strict=True):
        shares[low, high] = shares.get((low, high), 0.0) + share
    return shares


@takes_spheres
def contact_graph(
    contact_ids: ArrayLike,
    sphere_ids: ArrayLike,
    spheres: Spheres,
    forces: ArrayLike | None = None,
    *,
    points: ArrayLike | None = None,
    walls: bool = False,
) -> networkx.Graph:
    """Make the graph whose nodes are particles and whose edges join neighbours.

    Node i is particle i, with `position` (its centre, three floats). Node -k is wall k, without a
    position; a wall that touches nothing has no node. An edge has `contacts`, the number of
    contacts between the two, and `force`, the sum of their strengths. networkx does the rest:
    `networkx.connected_components(graph)`, `networkx.has_path(graph, -3, i)`.

    In a periodic cell two particles may touch by several images of the second, or one its own
    image. With the contact points the graph is a `networkx.MultiGraph`: it has an edge for each
    image, and an edge's `vector` leads from the particle of the lower number to that image of the
    other (three floats). A path that comes back to a particle may have gone around the cell.

    Parameters
    ----------
    contact_ids : (m, 2), as for `contact_counts`
    sphere_ids : (n,), ids of the spheres, in their order
    spheres : the spheres, the particles that they make up, and their cell
    forces : (m,), strength of each contact, force; None: unknown, edges have no `force`
    points : (m, 3), contact points, length; they matter in a periodic cell only, and only for where
        edges are drawn
    walls : whether walls are nodes too; else contacts with walls are left out

    Raises InputError as `contact_sides` does, and for forces of another shape or not finite.
    """
    sides = contact_sides(contact_ids, sphere_ids, spheres.particles, images=spheres.has_images)
    strength = None if forces is None else _strengths(forces, len(sides))
    wanted = np.full(len(sides), True) if walls else sides[:, 1] >= 0
    lines = None
    if points is not None and spheres.has_images:
        lines = contact_lines(contact_ids, sphere_ids, spheres, points)
    graph = _without_edges(spheres.centres, each_image=lines is not None)
    # An edge is named by its two particles and, where there are several, by the image.
    ends = np.sort(sides[wanted], axis=1)
    names = ends if lines is None else np.column_stack([ends, _upwards(sides, lines)[wanted]])
    edges, edge, contacts = np.unique(names, axis=0, return_inverse=True, return_counts=True)
    data: dict[str, list[Any]] = {"contacts": contacts.tolist()}
    if strength is not None:
        data["force"] = np.bincount(edge.ravel(), strength[wanted], len(edges)).tolist()
    if lines is not None:
        data["vector"] = [(x, y, z) for x, y, z in _vectors(edges, spheres).tolist()]
    values = zip(*data.values(), strict=True)
    graph.add_edges_from(
        (one, other, dict(zip(data, own, strict=True)))
        for (one, other), own in zip(edges[:, :2].tolist(), values, strict=True)
    )
    return graph


def _without_edges(centres: FloatArray, *, each_image: bool) -> networkx.Graph:
    """Return a graph of particles that may have an edge for each image of another."""
    # networkx takes a fifth of a second to import, which most uses need not wait for.
    import networkx

    graph: networkx.Graph = networkx.MultiGraph() if each_image else networkx.Graph()
    graph.add_nodes_from(
        (index, {"position": (x, y, z)}) for index, (x, y, z) in enumerate(centres.tolist())
    )
    return graph


def _strengths(forces: ArrayLike, number: int) -> FloatArray:
    """Return the strengths of so many contacts; raise InputError for any other number of them."""
    strength = as_floats(forces, "forces")
    if strength.shape != (number,):
        raise InputError(f"forces must have shape ({number},), not {strength.shape}")
    if not np.isfinite(strength).all():
        raise InputError("forces hold NaN or infinity")
    return strength


def _vectors(edges: IntArray, spheres: Spheres) -> FloatArray:
    """Return the lines along edges that are named by two particles and an image, (e, 3), length."""
    assert spheres.cell is not None
    centres = spheres.centres
    # A wall has no place: the line to it is that of no edge that is drawn.
    low = np.maximum(edges[:, 0], 0)
    along: FloatArray = centres[edges[:, 1]] - centres[low] + edges[:, 2:] @ spheres.cell.vectors
    return along


def _upwards(sides: IntArray, lines: ContactLines) -> IntArray:
    """Return by how many periods the particle of the higher number is moved, (m, 3).

    For a particle and its own image it is the one of the two moves whose first period is positive.

    Parameters
    ----------
    sides : (m, 2), particles on both sides of the contacts
    lines : the lines of the contacts
    """
    first = np.take_along_axis(lines.images, np.argmax(lines.images != 0, axis=1)[:, None], axis=1)[
        :, 0
    ]
    turned = (sides[:, 0] > sides[:, 1]) | ((sides[:, 0] == sides[:, 1]) & (first < 0))
    moves: IntArray = np.where(turned[:, None], -lines.images, lines.images)
    return moves


def draw_network(
    ax: Axes,
    graph: networkx.Graph,
    *,
    up: int = 1,
    across: int = 0,
    lower_half: bool = False,
    slab: tuple[float, float] | None = None,
    palette: str = PALETTE,
) -> Axes:
    """Draw the edges between particles as lines between their centres; walls are not drawn.

    An edge across a periodic face is drawn twice, from each of its particles to the image of the
    other. Thickness and colour grow with the force, up to four times the mean strength of a force.
    Contacts that pull are dashed. Without forces all lines look alike.

    Parameters
    ----------
    ax : flat axes, onto which the packing is projected, or 3-D axes (projection="3d")
    graph : from `contact_graph`
    up : axis against gravity, 0 to 2 for x to z
    across : axis that runs to the right on flat axes, other than `up`
    lower_half : only edges whose particles are both in the lower half of the packing's height, as
        in the paper
    slab : only lines whose ends both have their places between these two places along the
        third axis, so that one can look into the packing
    palette : name of a colour map of matplotlib

    Raises InputError for axes that are not two of x, y and z, and for a graph without particles.
    """
    # This takes a second to import, and those who only count contacts need not wait for it.
    from mpl_toolkits.mplot3d import Axes3D

    if not (up in (0, 1, 2) and across in (0, 1, 2) and up != across):
        raise InputError(f"up and across must be two of the axes 0, 1, 2, not {up} and {across}")
    depth = 3 - up - across
    ends, force = _edges(graph, up if lower_half else None)
    if slab is not None:
        inside = ((ends[..., depth] >= slab[0]) & (ends[..., depth] <= slab[1])).all(axis=1)
        ends, force = ends[inside], None if force is None else force[inside]
    order = [across, depth, up] if isinstance(ax, Axes3D) else [across, up]
    lines: FloatArray = ends[:, :, order]
    _draw_lines(ax, lines, force, palette)
    ax.set_xlabel("xyz"[across])
    ax.set_ylabel("xyz"[depth if isinstance(ax, Axes3D) else up])
    if isinstance(ax, Axes3D):
        ax.set_zlabel("xyz"[up])
    if len(lines):
        # Depth runs away from the viewer: an order that would mirror the packing is turned.
        _fit_axes(ax, lines, mirrored=(across, depth, up) in ((0, 2, 1), (1, 0, 2), (2, 1, 0)))
    return ax


def _draw_lines(ax: Axes, lines: FloatArray, force: FloatArray | None, palette: str) -> None:
    """Draw lines, (e, 2, 2 or 3), as strong as their forces, (e,); all alike without forces."""
    # The strongest are drawn last, on top of the others.
    rank = np.arange(len(lines)) if force is None else np.argsort(np.abs(force), kind="stable")
    lines = lines[rank]
    share = np.zeros(len(lines))
    if force is not None and len(force):
        mean = np.abs(force).mean()
        share = np.minimum(np.abs(force[rank]) / (mean if mean > 0 else 1.0), LARGEST_SHOWN)
    widths = np.full(len(lines), MEAN_WIDTH)
    pulls = np.zeros(len(lines), dtype=bool)
    if force is not None:
        widths = np.maximum(share, 0.15) * MEAN_WIDTH
        pulls = force[rank] < 0
    for chosen, style in ((~pulls, "solid"), (pulls, "dashed")):
        if chosen.any() or style == "solid":
            _add_lines(
                ax,
                lines[chosen],
                share[chosen],
                linewidths=widths[chosen],
                cmap=palette,
                linestyles=style,
            )


def _edges(graph: networkx.Graph, lower_half: int | None) -> tuple[FloatArray, FloatArray | None]:
    """Return the ends of the edges between particles, (m, 2, 3), and their forces, (m,).

    Parameters
    ----------
    graph : from `contact_graph`; the forces are None if an edge has none
    lower_half : the axis up, if only the edges in the lower half of the height are wanted
    """
    # An edge's vector leads from the lower number; the nodes of a subgraph come in any order.
    nodes = sorted(node for node in graph if node >= 0)
    place = {node: index for index, node in enumerate(nodes)}
    centres = as_positions([graph.nodes[node]["position"] for node in nodes])
    edges = [
        (one, other, data) for one, other, data in graph.edges(data=True) if min(one, other) >= 0
    ]
    pairs = np.array([(place[one], place[other]) for one, other, _ in edges], dtype=np.int64)
    pairs = np.sort(pairs.reshape(-1, 2), axis=1)
    lines = centres[pairs]
    force: FloatArray | None = None
    if edges and all("force" in data for *_, data in edges):
        force = np.array([data["force"] for *_, data in edges], dtype=np.float64)
    if edges and all("vector" in data for *_, data in edges):
        along = np.array([data["vector"] for *_, data in edges], dtype=np.float64)
        from_other = lines[:, 1] - along
        # Both lines of an edge are one unless it crosses a face.
        crosses = np.abs(from_other - lines[:, 0]).max(axis=1) > 1e-6 * np.abs(along).max(axis=1)
        second = np.stack([from_other, lines[:, 1]], axis=1)[crosses]
        lines = np.concatenate([np.stack([lines[:, 0], lines[:, 0] + along], axis=1), second])
        force = None if force is None else np.concatenate([force, force[crosses]])
    if lower_half is not None:
        height = centres[:, lower_half]
        middle = (height.min() + height.max()) / 2
        shown = (lines[..., lower_half] <= middle).all(axis=1)
        lines, force = lines[shown], None if force is None else force[shown]
    return lines, force


def _add_lines(ax: Axes, lines: FloatArray, share: FloatArray, **style: Any) -> None:
    """Draw lines whose colours show their forces.

    Parameters
    ----------
    ax : flat or 3-D axes
    lines : (m, 2, 2) or (m, 2, 3), ends of the lines
    share : (m,), force of each, in mean forces
    style : as matplotlib's collections of lines have it
    """
    from matplotlib.collections import LineCollection
    from mpl_toolkits.mplot3d import Axes3D
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    collection: LineCollection
    if isinstance(ax, Axes3D):
        collection = Line3DCollection(lines, **style)
        ax.add_collection3d(collection)
    else:
        collection = LineCollection(list(lines), **style)
        ax.add_collection(collection)
    collection.set_array(share)
    collection.set_clim(0, LARGEST_SHOWN)


def _fit_axes(ax: Axes, lines: FloatArray, *, mirrored: bool) -> None:
    """Make axes end a little beyond some lines, with one scale for all directions.

    Parameters
    ----------
    ax : flat or 3-D axes
    lines : (m, 2, 2) or (m, 2, 3), ends of the lines, m >= 1
    mirrored : whether the second axis of 3-D axes is turned
    """
    from mpl_toolkits.mplot3d import Axes3D

    ends = lines.reshape(-1, lines.shape[2])
    spans = np.ptp(ends, axis=0)
    starts = ends.min(axis=0)
    margin = 0.02 * float(spans.max())
    limits = np.column_stack([starts - margin, starts + spans + margin]).tolist()
    ax.set_xlim(*limits[0])
    ax.set_ylim(*limits[1])
    if isinstance(ax, Axes3D):
        ax.set_zlim(*limits[2])
        if mirrored:
            ax.invert_yaxis()
        ax.set_box_aspect(tuple((spans + 2 * margin).tolist()))
    else:
        ax.set_aspect("equal")
