"""Contacts across periodic faces as lines, graphs and drawings: against all images."""

from __future__ import annotations

from collections import Counter
from typing import Any

import networkx
import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from lammps_inelastic.analysis import (
    Cell,
    Spheres,
    backbone,
    contact_counts,
    contact_graph,
    contact_lines,
    contacts_by_distance,
    draw_network,
    group_spheres,
)
from lammps_inelastic.analysis.geometry import FloatArray
from tests.helpers.replicas import CELLS, PLANES, Packing, in_plane, in_space

GAP = 0.25
EVERY = [
    *((in_space, cell, shapes) for cell in CELLS for shapes in ("spheres", "clusters")),
    *((in_plane, cell, shapes) for cell in PLANES for shapes in ("spheres", "clusters")),
]
each_packing = pytest.mark.parametrize(("make", "cell", "shapes"), EVERY)


def contacts_of(packing: Packing, gap: float = GAP) -> tuple[Any, FloatArray, FloatArray]:
    """Return ids, points and vectors of all contacts, the points in random images.

    The vectors lead from the centre of the first sphere to that of the image of the second.
    """
    generator = np.random.default_rng(8)
    ids, points, vectors = [], [], []
    for (one, other, *move), distance in packing.pairs(gap).items():
        apart = packing.positions[other] + np.array(move) @ packing.vectors
        apart = apart - packing.positions[one]
        unit = apart / np.linalg.norm(apart)
        point = packing.positions[one] + (packing.radii[one] + distance / 2) * unit
        away = generator.integers(-3, 4, 3) * packing.periodic
        # Either sphere may be named first.
        if generator.uniform() < 0.5:
            ids.append((other + 1, one + 1))
            vectors.append(-apart)
        else:
            ids.append((one + 1, other + 1))
            vectors.append(apart)
        points.append(point + away @ packing.vectors)
    return np.array(ids).reshape(-1, 2), np.reshape(points, (-1, 3)), np.reshape(vectors, (-1, 3))


@each_packing
def test_ends_of_contact_lines(make: Any, cell: str, shapes: str) -> None:
    packing = make(cell, shapes)
    ids, points, vectors = contacts_of(packing)
    spheres = packing.spheres()
    lines = contact_lines(ids, np.arange(len(packing.radii)) + 1, spheres, points)
    assert (lines.sides == ids - 1).all()
    assert (lines.ends[:, 0] == spheres.positions[ids[:, 0] - 1]).all()
    second = spheres.positions[ids[:, 1] - 1] + lines.images @ packing.vectors
    # A few operations on positions up to some periods away.
    np.testing.assert_allclose(lines.ends[:, 1], second, atol=1e-12)
    found = lines.ends[:, 1] - lines.ends[:, 0]
    # A sphere touches two of its own images alike: the point may be that of either.
    own = ids[:, 0] == ids[:, 1]
    off = np.abs(found - vectors).max(axis=1)
    off[own] = np.minimum(off, np.abs(found + vectors).max(axis=1))[own]
    assert off.max() < 1e-12
    assert len(ids) > 5


@pytest.mark.parametrize("away", [0, 1])
def test_line_of_a_sphere_to_its_own_image(away: int) -> None:
    # The contact point is as far from the sphere as from its image.
    for length in np.linspace(0.9, 1.1, 21):
        cell = Cell.of_box([[0, length], [-3, 3], [-3, 3]], [True] * 3)
        spheres = Spheres([[0.3, 0.1, 0.2]], [length / 2], cell=cell)
        for side in (-0.5, 0.5):
            point = [0.3 + (side + 3 * away) * length, 0.1, 0.2]
            lines = contact_lines([[1, 1]], [1], spheres, [point])
            assert np.abs(lines.images[0]).tolist() == [1, 0, 0]
            # A few operations.
            assert np.linalg.norm(np.diff(lines.ends[0], axis=0)) == pytest.approx(length)


def test_lines_to_walls_of_a_cell_with_periods() -> None:
    cell = Cell.of_box([[0, 1], [0, 5], [0, 5]], [True, False, False])
    spheres = Spheres([[0.9, 1, 1], [0.4, 4.8, 1]], [0.3, 0.2], cell=cell)
    points = [[0.9, 0.7, 1], [2.4, 5, 1], [-0.1, 1, 0.7]]
    lines = contact_lines([[1, -3], [2, -4], [1, -5]], [1, 2], spheres, points)
    # A few operations.
    np.testing.assert_allclose(
        lines.ends[:, 1], [[0.9, 0.7, 1], [0.4, 5, 1], [0.9, 1, 0.7]], atol=1e-14
    )
    assert not lines.images.any()


def edges_by_loops(packing: Packing) -> dict[tuple[int, int], list[FloatArray]]:
    """Return the vectors of all edges between particles, from the lower number to the higher."""
    centres = packing.centres
    found: dict[tuple[int, int], list[FloatArray]] = {}
    for one, other, *move in packing.pairs(GAP):
        low, high = packing.owner[[one, other]].tolist()
        shift = np.array(move) @ packing.vectors
        vector = centres[high] + shift - centres[low]
        if low > high:
            low, high, vector = high, low, -vector
        found.setdefault((low, high), []).append(vector)
    return found


def same_vectors(one: list[FloatArray], other: list[FloatArray], *, own: bool) -> bool:
    """Say whether two lists hold the same vectors; those to own images up to a sign."""

    def key(vector: ArrayLike) -> tuple[float, ...]:
        rounded = np.round(vector, 9) + 0.0
        first = next((x for x in rounded if x), 0)
        return tuple((-rounded + 0.0 if own and first < 0 else rounded).tolist())

    return Counter(map(key, one)) == Counter(map(key, other))


@each_packing
def test_edges_of_the_graph(make: Any, cell: str, shapes: str) -> None:
    packing = make(cell, shapes)
    ids, points, _ = contacts_of(packing)
    forces = np.random.default_rng(1).uniform(1, 2, len(ids))
    numbers = np.arange(len(packing.radii)) + 1
    graph = contact_graph(ids, numbers, packing.spheres(), forces, points=points)
    assert isinstance(graph, networkx.MultiGraph)
    expected = edges_by_loops(packing)
    found: dict[tuple[int, int], list[FloatArray]] = {}
    for one, other, data in graph.edges(data=True):
        pair = (min(one, other), max(one, other))
        found.setdefault(pair, []).extend([np.array(data["vector"])] * data["contacts"])
    assert found.keys() == expected.keys()
    for (low, high), vectors in expected.items():
        assert same_vectors(found[low, high], vectors, own=low == high)
    assert sum(data["force"] for *_, data in graph.edges(data=True)) == pytest.approx(forces.sum())
    # Without the points it is known who touches whom, not by which image.
    simple = contact_graph(ids, numbers, packing.spheres(), forces)
    assert {tuple(sorted(pair)) for pair in simple.edges()} == expected.keys()
    counts = {tuple(sorted(pair[:2])): pair[2]["contacts"] for pair in simple.edges(data=True)}
    assert counts == {pair: len(vectors) for pair, vectors in expected.items()}


def drawn(graph: networkx.Graph, **options: Any) -> FloatArray:
    """Return the ends of the lines that are drawn, (m, 2, 2)."""
    ax = Figure().add_subplot()
    draw_network(ax, graph, **options)
    lines = [segment for found in ax.collections for segment in found.get_segments()]
    return np.array(lines).reshape(-1, 2, 2)


@each_packing
def test_drawn_lines(make: Any, cell: str, shapes: str) -> None:
    packing = make(cell, shapes)
    ids, points, _ = contacts_of(packing)
    numbers = np.arange(len(packing.radii)) + 1
    spheres = packing.spheres()
    graph = contact_graph(ids, numbers, spheres, points=points)
    expected = []
    for (low, high), vectors in edges_by_loops(packing).items():
        ends: list[FloatArray] = []
        for vector in vectors:
            # An edge of several contacts is one line, to own images in either direction.
            if not any(same_vectors([vector], [one], own=low == high) for one in ends):
                ends.append(vector)
        for one in ends:
            lines = [
                (spheres.centres[low], spheres.centres[low] + one),
                (spheres.centres[high] - one, spheres.centres[high]),
            ]
            inside = np.allclose(lines[0], lines[1])
            expected += lines[:1] if inside else lines
    found = drawn(graph)

    def keys(lines: Any) -> Counter[Any]:
        flat = [sorted(map(tuple, np.round(np.array(line)[:, :2], 7) + 0.0)) for line in lines]
        return Counter(tuple(sum(line, ())) for line in flat)

    assert keys(found) == keys(expected)
    # Of a part of the graph, whose nodes may come in any order, the lines are among them.
    chosen = np.random.default_rng(3).permutation(len(spheres.particles))[:9].tolist()
    part = networkx.MultiGraph()
    part.add_nodes_from((node, graph.nodes[node]) for node in chosen)
    part.add_edges_from(
        (one, other, data)
        for one, other, data in graph.edges(data=True)
        if one in chosen and other in chosen
    )
    assert not keys(drawn(part)) - keys(found)


def test_two_particles_that_touch_by_two_images() -> None:
    cell = Cell.of_box([[0, 2], [0, 9], [0, 9]], [True] * 3)
    spheres = Spheres([[0.2, 1, 1], [1.2, 1, 1]], [0.5, 0.5], cell=cell)
    found = contacts_by_distance(spheres, 1e-9)
    assert found.sides.tolist() == [[0, 1], [0, 1]]
    counts = contact_counts(found.sides, [0, 1], images=True)
    assert counts.particles.tolist() == [2, 2]
    assert counts.neighbours.tolist() == [1, 1]
    graph = contact_graph(found.sides, [0, 1], spheres, points=found.points)
    vectors = sorted(data["vector"][0] for *_, data in graph.edges(data=True))
    # A few operations.
    np.testing.assert_allclose(vectors, [-1, 1], rtol=1e-14)
    # Two edges, of which one crosses the face and is drawn twice.
    assert len(drawn(graph)) == 3


def test_a_chain_around_the_cell_carries() -> None:
    # Each sphere of the chain has two contacts, one of them across the face; the others have none.
    cell = Cell.of_box([[0, 4], [0, 9], [0, 9]], [True] * 3)
    places = [[0.5, 1, 1], [1.5, 1, 1], [2.5, 1, 1], [3.5, 1, 1], [2, 4, 4]]
    spheres = Spheres(places, np.full(5, 0.5), cell=cell)
    found = contacts_by_distance(spheres, 1e-9)
    ids = np.arange(10, 15)
    held = backbone(found.ids(ids), ids, spheres.particles, fewest=2, images=True)
    assert held.rattlers.tolist() == [False] * 4 + [True]
    assert held.counts.particles.tolist() == [2, 2, 2, 2, 0]
    # A face that is not periodic ends the chain, which falls apart from both ends.
    open_cell = Cell.of_box([[0, 4], [0, 9], [0, 9]], [False, True, True])
    found = contacts_by_distance(Spheres(places, np.full(5, 0.5), cell=open_cell), 1e-9)
    loose = backbone(found.ids(ids), ids, spheres.particles, fewest=2, images=True)
    assert loose.rattlers.all()
    assert loose.rounds == 2


@pytest.mark.parametrize("fewest", [2, 3, None])
@pytest.mark.parametrize("shapes", ["spheres", "clusters"])
@pytest.mark.parametrize("cell", ["narrow", "oblique", "ppf"])
def test_backbone(cell: str, shapes: str, fewest: int | None) -> None:
    packing = in_space(cell, shapes)
    gap = 0.5
    pairs = [packing.owner[[one, other]].tolist() for one, other, *_ in packing.pairs(gap)]
    left = set(range(len(packing.members)))
    if fewest is None:
        least = {p: {1: 4, 2: 6}.get(len(m), 7) for p, m in enumerate(packing.members)}
    else:
        least = dict.fromkeys(left, fewest)
    while True:
        number = Counter(end for pair in pairs if left.issuperset(pair) for end in pair)
        loose = {one for one in left if number[one] < least[one]}
        if not loose:
            break
        left -= loose
    spheres = packing.spheres()
    found = contacts_by_distance(spheres, gap)
    ids = np.arange(len(packing.radii))
    held = backbone(found.ids(ids), ids, spheres.particles, fewest=fewest, images=True)
    assert set(np.flatnonzero(~held.rattlers).tolist()) == left
    assert held.counts.particles.tolist() == [
        number[one] if one in left else 0 for one in range(len(packing.members))
    ]


def test_a_body_that_touches_its_own_image() -> None:
    # The two ends of a row of three meet across the face.
    cell = Cell.of_box([[0, 3], [0, 9], [0, 9]], [True] * 3)
    for shift in (0.0, 0.4, 1.7, 2.9):
        places = np.array([[0.5, 1, 1], [1.5, 1, 1], [2.5, 1, 1]])
        places[:, 0] += shift
        # The last sphere overlaps its neighbour a little, which tells where the body begins.
        places[2, 0] -= 1e-3
        body = group_spheres([4, 4, 4])
        spheres = Spheres(cell.wrapped(places), [0.5, 0.5, 0.5], body, cell)
        np.testing.assert_allclose(np.diff(spheres.positions[:, 0]), [1, 0.999], atol=1e-14)
        found = contacts_by_distance(spheres, 0.01)
        assert found.sides.tolist() == [[0, 2]]
        assert found.gaps[0] == pytest.approx(1e-3, abs=1e-14)
        counts = contact_counts(found.sides, [0, 1, 2], body, images=True)
        assert counts.particles.tolist() == [2]
        assert counts.neighbours.tolist() == [0]
        graph = contact_graph(found.sides, [0, 1, 2], spheres, points=found.points)
        ((one, other, data),) = graph.edges(data=True)
        assert (one, other) == (0, 0)
        np.testing.assert_allclose(np.abs(data["vector"]), [3, 0, 0], atol=1e-14)
        assert len(drawn(graph)) == 2
