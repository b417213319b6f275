"""The lattice of a cell: against plain loops over many images, in cells of every shape."""

from __future__ import annotations

import time
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from lammps_inelastic.analysis import Cell, InputError
from lammps_inelastic.analysis.geometry import FloatArray, IntArray, inside_of
from tests.helpers.replicas import moves_within

# The same examples on every machine.
RANDOM = settings(derandomize=True, deadline=None, max_examples=60)
ALL_FLAGS = [*product((True, False), repeat=3)]


def turn(generator: np.random.Generator) -> FloatArray:
    """Return a random rotation."""
    turned, triangle = np.linalg.qr(generator.normal(size=(3, 3)))
    turned *= np.sign(np.diag(triangle))
    turned[:, 0] *= np.sign(np.linalg.det(turned))
    return turned


def edges(seed: int, tilt: float, *, rotated: bool) -> FloatArray:
    """Return the edges of a cell that is tilted by up to some lengths, in any direction if wanted.

    Its sides have lengths of 1 to 4.
    """
    generator = np.random.default_rng(seed)
    vectors = np.diag(generator.uniform(1, 4, 3))
    vectors[1, 0], vectors[2, 0], vectors[2, 1] = generator.uniform(-tilt, tilt, 3) * [
        vectors[0, 0],
        vectors[0, 0],
        vectors[1, 1],
    ]
    return vectors @ turn(generator) if rotated else vectors


CELLS = st.builds(
    edges,
    st.integers(0, 10_000),
    st.sampled_from([0.0, 0.5, 1.0, 3.0]),
    rotated=st.booleans(),
)
FLAGS = st.sampled_from(ALL_FLAGS)


@RANDOM
@given(CELLS, FLAGS, st.integers(0, 10_000))
def test_nearest_image(vectors: FloatArray, periodic: tuple[bool, ...], seed: int) -> None:
    generator = np.random.default_rng(seed)
    cell = Cell([0.3, -1, 2], vectors, periodic)
    # Differences of points a few cells apart, and such for which two images are equally near.
    apart = np.concatenate(
        [
            generator.uniform(-3, 3, (30, 3)) @ vectors,
            generator.integers(-3, 4, (10, 3)) / 2 @ vectors,
        ]
    )
    farthest = np.linalg.norm(apart, axis=1).max()
    # An image at the origin's side of the difference is no longer than the difference itself.
    moves = moves_within(vectors, periodic, 2 * farthest)
    for one, found, image in zip(
        apart, cell.nearest(apart), cell.nearest_images(apart), strict=True
    ):
        expected = np.linalg.norm(one + moves @ vectors, axis=1).min()
        # A few operations on lengths up to the farthest.
        assert np.linalg.norm(found) == pytest.approx(expected, abs=1e-13 * (1 + farthest))
        np.testing.assert_allclose(found, one + image @ vectors, atol=1e-13 * (1 + farthest))
        assert not image[~np.array(periodic)].any()


@pytest.mark.parametrize("times", [7, 1_000, 100_000])
def test_nearest_image_in_a_cell_of_any_tilt(times: int) -> None:
    # The edges of another cell of the same lattice: the first one is added to the others so often.
    short = np.array([[2.0, 0, 0], [0.6, 1.5, 0], [0.1, -0.2, 1.25]])
    vectors = short + times * np.outer([0, 1, -1], short[0])
    apart = np.random.default_rng(3).uniform(-2, 2, (50, 3)) @ short
    images = np.array([*product(range(-3, 4), repeat=3)]) @ short
    expected = np.linalg.norm(apart[:, None] + images, axis=2).min(axis=1)
    start = time.perf_counter()
    found = np.linalg.norm(Cell(np.zeros(3), vectors, [True] * 3).nearest(apart), axis=1)
    # Rounding of the edges, which are so long.
    np.testing.assert_allclose(found, expected, atol=1e-14 * (10 + times))
    # A thousandth of a second if the short edges are found by dividing, forever if by subtracting.
    assert time.perf_counter() - start < 1


@RANDOM
@given(CELLS, FLAGS, st.integers(0, 10_000))
def test_wrapped_into_the_cell(vectors: FloatArray, periodic: tuple[bool, ...], seed: int) -> None:
    generator = np.random.default_rng(seed)
    origin = generator.uniform(-5, 5, 3)
    cell = Cell(origin, vectors, periodic)
    shares = generator.uniform(-3, 4, (40, 3))
    inside = np.linalg.solve(vectors.T, (cell.wrapped(origin + shares @ vectors) - origin).T).T
    expected = np.where(periodic, shares % 1, shares)
    # A few operations; the two ends of an edge are one place.
    off = np.abs(inside - expected)
    assert np.where(periodic, np.minimum(off, 1 - off), off).max() < 1e-13
    # What is inside is not touched.
    kept = origin + generator.uniform(1e-6, 1 - 1e-6, (40, 3)) @ vectors
    assert (cell.wrapped(kept) == kept).all()


def images_that(
    near: Any, positions: FloatArray, vectors: FloatArray, moves: IntArray
) -> set[tuple[int, ...]]:
    """Return the images that are near: whose each is, and its three periods."""
    return {
        (owner, *move)
        for owner, place in enumerate(positions)
        for move in moves[near(place + moves @ vectors, owner)].tolist()
    }


def as_set(owner: IntArray, moves: IntArray) -> set[tuple[int, ...]]:
    found = {(one, *move) for one, move in zip(owner.tolist(), moves.tolist(), strict=True)}
    # None of them is there twice.
    assert len(found) == len(owner)
    return found


@RANDOM
@given(CELLS, FLAGS, st.integers(0, 10_000), st.booleans())
@example(np.diag([1.0, 2, 3]), (True, True, True), 1, True)
def test_images_in_box(
    vectors: FloatArray, periodic: tuple[bool, ...], seed: int, small: bool
) -> None:
    generator = np.random.default_rng(seed)
    origin = generator.uniform(-3, 3, 3)
    cell = Cell(origin, vectors, periodic)
    # Places need not be in the cell, nor the box.
    positions = origin + generator.uniform(-0.5, 1.5, (4, 3)) @ vectors
    reach = generator.uniform(0, 0.5, 4)
    low = origin + generator.uniform(-1, 1, 3) @ vectors
    box = np.column_stack([low, low + generator.uniform(0.1, 0.4 if small else 3, 3)])
    span = np.abs(positions[:, None] - box.T).max() * 2 + 2
    moves = moves_within(vectors, periodic, 2 * span)

    def near(places: FloatArray, owner: int) -> Any:
        out = np.maximum(np.maximum(box[:, 0] - places, places - box[:, 1]), 0)
        return np.linalg.norm(out, axis=1) <= reach[owner]

    def near_each_face(places: FloatArray, owner: int) -> Any:
        low, high = box[:, 0] - reach[owner], box[:, 1] + reach[owner]
        return ((places >= low) & (places <= high)).all(axis=1)

    found = as_set(*cell.images_in_box(positions, reach, box))
    assert images_that(near, positions, vectors, moves) <= found
    # What is beyond an edge or a corner may be farther.
    assert found <= images_that(near_each_face, positions, vectors, moves)
    exact = as_set(*cell.images_in_box(positions, np.zeros(4), box))
    assert exact == images_that(lambda x, _: inside_of(x, box), positions, vectors, moves)


@RANDOM
@given(CELLS, FLAGS, st.integers(0, 10_000))
def test_images_near_cell(vectors: FloatArray, periodic: tuple[bool, ...], seed: int) -> None:
    generator = np.random.default_rng(seed)
    cell = Cell(np.zeros(3), vectors, periodic)
    positions = generator.uniform(size=(4, 3)) @ vectors
    reach = generator.uniform(0, 1.5, 4)
    found = as_set(*cell.images_near_cell(positions, reach))
    # No image in its own place.
    assert (0, 0, 0) not in {(a, b, c) for _, a, b, c in found}
    # An image is wanted if any point of the cell is near: it is looked for at many of them.
    shares = np.array([*product(np.linspace(0, 1, 7), repeat=3)])
    points = shares @ vectors
    longest = np.linalg.norm(vectors.sum(axis=0)) + np.linalg.norm(vectors, axis=1).sum()
    moves = moves_within(vectors, periodic, longest + 2)
    moves = moves[moves.any(axis=1)]

    def near(places: FloatArray, owner: int) -> Any:
        return KDTree(points).query(places)[0] <= reach[owner]

    assert images_that(near, positions, vectors, moves) <= found
    # Those that are farther than the reach from the planes of the faces are not among them.
    heights = 1 / np.linalg.norm(np.linalg.inv(vectors), axis=0)
    for owner, *move in found:
        at = np.linalg.solve(vectors.T, positions[owner] + np.array(move) @ vectors)
        beyond = np.maximum(np.maximum(-at, at - 1), 0) * heights
        # The analysis adds a billionth of the cell for round-off.
        assert (beyond[np.array(periodic)] <= reach[owner] + 2e-9 * heights.max()).all()


def test_too_many_images() -> None:
    cell = Cell.of_box([[0, 1]] * 3, [True] * 3)
    place = np.full((1, 3), 0.5)
    for size in (400.0, 1e7, 1e30, 1e300):
        with pytest.raises(InputError, match="periodic images of 1 spheres are needed"):
            cell.images_in_box(place, np.zeros(1), np.array([[0, size]] * 3))
        with pytest.raises(InputError, match="periodic images of 1 spheres are needed"):
            cell.images_near_cell(place, np.array([size]))


def test_a_million_images_of_one_sphere_take_a_second() -> None:
    cell = Cell.of_box([[0, 1]] * 3, [True] * 3)
    start = time.perf_counter()
    owner, moves = cell.images_in_box(np.full((1, 3), 0.5), np.zeros(1), np.array([[0, 100.0]] * 3))
    assert len(owner) == 1_000_000
    assert (moves == np.array([*product(range(100), repeat=3)])).all()
    # It takes a third of a second; a loop over the periods took twenty.
    assert time.perf_counter() - start < 5


def test_discs_have_images_in_their_plane_only() -> None:
    cell = Cell.of_box([[0, 2], [0, 3], [-0.5, 0.5]], [True] * 3, flat=True)
    assert cell.periodic == (True, True, False)
    assert cell.volume == 6
    apart = np.array([[1.7, -1.6, 0]])
    # Each subtraction is exact to about an epsilon.
    np.testing.assert_allclose(cell.nearest(apart), [[-0.3, 1.4, 0]], atol=1e-15)
    # A box of discs has no height that matters.
    owner, moves = cell.images_in_box(
        np.array([[1.0, 1, 7]]), np.zeros(1), np.array([[0, 4], [0, 3], [100, 101]])
    )
    assert as_set(owner, moves) == {(0, 0, 0, 0), (0, 1, 0, 0)}


def test_flattened_cell_keeps_its_edges() -> None:
    solid = Cell([1, 2, 3], [[4, 0, 0], [1, 5, 0], [0, 0, 6]], [True, False, True])
    assert solid.can_be_flat
    flat = solid.flattened()
    assert flat.flat
    assert flat.periodic == (True, False, False)
    assert (flat.vectors == solid.vectors).all()
    assert (flat.bounds == solid.bounds).all()
    # The determinant of a triangular matrix, by factors.
    assert flat.volume == pytest.approx(20, rel=1e-15)
    assert solid.volume == pytest.approx(120, rel=1e-15)
    leaning = Cell(np.zeros(3), [[4, 0, 0], [1, 5, 0], [0.1, 0, 6]], [True] * 3)
    assert not leaning.can_be_flat
    assert not Cell.of_box([[0, 1]] * 3, [True, True, False]).can_be_flat


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("periodic", ALL_FLAGS)
def test_widths_and_volume(seed: int, periodic: tuple[bool, ...]) -> None:
    vectors = edges(seed, 2.0, rotated=True)
    cell = Cell([1, 2, 3], vectors, periodic)
    a, b, c = vectors
    volume = abs(float(np.cross(a, b) @ c))
    faces = [np.linalg.norm(np.cross(*pair)) for pair in ((b, c), (c, a), (a, b))]
    # A few operations in a cell whose tilt loses a digit.
    assert cell.volume == pytest.approx(volume, rel=1e-13)
    np.testing.assert_allclose(cell.widths, volume / np.array(faces), rtol=1e-12)
    corners = np.array([1, 2, 3]) + np.array([*product((0, 1), repeat=3)]) @ vectors
    np.testing.assert_allclose(cell.bounds[:, 0], corners.min(axis=0), atol=1e-13)
    np.testing.assert_allclose(cell.bounds[:, 1], corners.max(axis=0), atol=1e-13)
    assert cell.has_images == any(periodic)
    # None of the faces of a turned cell is across an axis.
    assert np.isinf(cell.flat_faces).all()


def test_faces_across_the_axes() -> None:
    # LAMMPS tilts along what is periodic. Faces across a hold b and c, and so on.
    leaning = [[4, 0, 0], [1, 5, 0], [0, 0, 6]]
    inf = np.inf
    for periodic, expected in (
        ((False, False, False), [[-inf, inf], [2, 7], [3, 9]]),
        ((False, True, False), [[-inf, inf], [-inf, inf], [3, 9]]),
        ((True, True, False), [[-inf, inf], [-inf, inf], [3, 9]]),
        ((True, False, True), [[-inf, inf], [2, 7], [-inf, inf]]),
        ((True, True, True), [[-inf, inf]] * 3),
    ):
        assert (Cell([1, 2, 3], leaning, periodic).flat_faces == expected).all()


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Cell([0, 0], np.eye(3)), "an origin"),
        (lambda: Cell(np.zeros(3), np.eye(2)), "an origin"),
        (lambda: Cell(np.zeros(3), np.eye(3), [True] * 2), "three flags"),
        (lambda: Cell([0, 0, np.nan], np.eye(3)), "finite"),
        (lambda: Cell(np.zeros(3), np.diag([1, np.inf, 1])), "finite"),
        (lambda: Cell(np.zeros(3), [[1, 0, 0], [0, 1, 0], [1, 1, 0]]), "one plane"),
        (lambda: Cell(np.zeros(3), np.diag([1, 0, 1])), "one plane"),
        (lambda: Cell(np.zeros(3), np.eye(3) + np.eye(3, k=2), flat=True), "no z"),
        (lambda: Cell(np.zeros(3), np.eye(3) + np.eye(3, k=-2), flat=True), "two-dimensional"),
        (lambda: Cell.of_box([[0, 1], [1, 0], [0, 1]]), "ylo"),
    ],
)
def test_no_cell(make: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()
