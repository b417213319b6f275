"""The graph of contacts and its drawing, by hand."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import networkx
import numpy as np
import pytest
from matplotlib.figure import Figure

from lammps_inelastic.analysis import (
    InputError,
    Spheres,
    contact_graph,
    contacts_by_distance,
    draw_network,
    group_spheres,
)

# A tower of three on the floor (wall 3), and a fourth alone.
IDS = [10, 20, 30, 40]
PLACES = [[0.5, 1, 0.5], [0.5, 2, 0.5], [0.5, 3, 0.5], [3, 3, 3]]
RADII = [0.5] * 4
TOWER = Spheres(PLACES, RADII)
CONTACTS = [[10, -3], [20, 10], [20, 30]]
FORCES = [3.0, 2.0, 1.0]


def test_nodes_and_edges() -> None:
    graph = contact_graph(CONTACTS, IDS, TOWER, FORCES)
    assert sorted(graph) == [0, 1, 2, 3]
    assert graph.nodes[2]["position"] == (0.5, 3, 0.5)
    assert sorted(graph.edges(data=True)) == [
        (0, 1, {"contacts": 1, "force": 2.0}),
        (1, 2, {"contacts": 1, "force": 1.0}),
    ]
    assert sorted(map(len, networkx.connected_components(graph))) == [1, 3]


def test_walls_are_nodes_if_wanted() -> None:
    graph = contact_graph(CONTACTS, IDS, TOWER, walls=True)
    assert sorted(graph) == [-3, 0, 1, 2, 3]
    assert graph.edges[0, -3] == {"contacts": 1}
    # From the floor to the top.
    assert networkx.has_path(graph, -3, 2)
    assert not networkx.has_path(graph, -3, 3)


def test_contacts_of_the_same_two_bodies_are_one_edge() -> None:
    particles = group_spheres([1, 1, 2, 2])
    contacts = [[10, 30], [40, 20], [10, 40], [20, -1]]
    graph = contact_graph(contacts, IDS, Spheres(PLACES, RADII, particles), [1, 2, 4, 8])
    assert list(graph.edges(data=True)) == [(0, 1, {"contacts": 3, "force": 7.0})]
    assert graph.nodes[0]["position"] == (0.5, 1.5, 0.5)


def test_no_contacts() -> None:
    graph = contact_graph(np.empty((0, 2)), IDS, TOWER, [])
    assert (graph.number_of_nodes(), graph.number_of_edges()) == (4, 0)
    ax = Figure().add_subplot()
    assert draw_network(ax, graph) is ax


def lines_of(ax: Any) -> set[tuple[tuple[float, ...], ...]]:
    return {
        tuple(map(tuple, np.round(path.vertices, 12))) for path in ax.collections[0].get_paths()
    }


def test_flat_drawing() -> None:
    ax = Figure().add_subplot()
    graph = contact_graph(CONTACTS, IDS, TOWER, FORCES, walls=True)
    assert draw_network(ax, graph) is ax
    assert lines_of(ax) == {((0.5, 1), (0.5, 2)), ((0.5, 2), (0.5, 3))}
    # The mean force is 1.5; the weakest comes first.
    assert ax.collections[0].get_array().tolist() == pytest.approx([1 / 1.5, 2 / 1.5], rel=1e-15)
    thin, thick = ax.collections[0].get_linewidths()
    assert thick == pytest.approx(2 * thin, rel=1e-15)


def test_lower_half_only() -> None:
    # Heights 1 to 3: the upper contact reaches above 2.
    ax = Figure().add_subplot()
    draw_network(ax, contact_graph(CONTACTS, IDS, TOWER), lower_half=True)
    assert lines_of(ax) == {((0.5, 1), (0.5, 2))}


def test_a_slab_only() -> None:
    places = [[0, 0, 0], [1, 0, 0.4], [2, 0, 0.6], [3, 0, 2]]
    ax = Figure().add_subplot()
    graph = contact_graph(
        [[0, 1], [1, 2], [2, 3]], np.arange(4), Spheres(places, RADII), [1, 2, 30]
    )
    draw_network(ax, graph, slab=(0, 0.5))
    # The second contact ends beyond the slab, the third one lies beyond it.
    assert lines_of(ax) == {((0, 0), (1, 0))}
    # In mean forces of what is drawn.
    assert ax.collections[0].get_array().tolist() == [1.0]


def test_drawing_in_space_is_no_mirror_image() -> None:
    figure = Figure()
    ax = figure.add_subplot(projection="3d")
    draw_network(ax, contact_graph(CONTACTS, IDS, TOWER, FORCES))
    figure.canvas.draw()
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_zlabel()) == ("x", "z", "y")
    # x to the right and y upwards: z comes towards the viewer, so the depth is turned.
    assert ax.yaxis_inverted()
    assert not ax.xaxis_inverted()
    assert not ax.zaxis_inverted()


@pytest.mark.slow
def test_ten_thousand_spheres_are_drawn_in_seconds(tmp_path: Path) -> None:
    places = np.indices((22, 22, 22)).reshape(3, -1).T[:10_000]
    spheres = Spheres(places, np.full(10_000, 0.5))
    contacts = contacts_by_distance(spheres, 0.1)
    forces = np.random.default_rng(0).exponential(1, len(contacts.sides))
    start = time.perf_counter()
    graph = contact_graph(contacts.sides, np.arange(10_000), spheres, forces)
    assert graph.number_of_edges() > 28_000
    for projection in (None, "3d"):
        figure = Figure()
        draw_network(figure.add_subplot(projection=projection), graph)
        figure.savefig(tmp_path / "network.png")
    # 2 s where this was written; ten times that on a slow or busy machine.
    assert time.perf_counter() - start < 20


def test_wrong_input() -> None:
    with pytest.raises(InputError, match=r"forces must have shape \(3,\), not \(2,\)"):
        contact_graph(CONTACTS, IDS, TOWER, [1, 2])
    with pytest.raises(InputError, match="two of the axes 0, 1, 2, not 1 and 1"):
        draw_network(Figure().add_subplot(), contact_graph(CONTACTS, IDS, TOWER), across=1)
