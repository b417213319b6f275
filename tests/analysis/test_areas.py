"""Exact areas: against closed forms and the numerical integration of chords."""

from __future__ import annotations

import time
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.integrate import quad

from lammps_inelastic.analysis import InputError, Spheres, group_spheres
from lammps_inelastic.analysis.areas import areas, areas_in
from lammps_inelastic.analysis.geometry import FloatArray
from lammps_inelastic.analysis.volumes import Pieces, balls, pieces_of, split

UNIT = [[0, 1], [0, 1]]
PLANE = [[-np.inf, np.inf]] * 2

# The same examples on every machine.
RANDOM = settings(derandomize=True, deadline=None, max_examples=300)


def in_plane(points: ArrayLike) -> FloatArray:
    """Return points (m, 2) as centres (m, 3) in a plane that is not that of the origin."""
    array = np.asarray(points, dtype=float)
    return np.column_stack([array, np.full(len(array), 0.7)])


def discs(centres: ArrayLike, radii: ArrayLike) -> Pieces:
    return balls(in_plane(centres), np.asarray(radii, dtype=float))


def dimers(one: ArrayLike, other: ArrayLike, radii: ArrayLike) -> tuple[Pieces, Pieces]:
    """Return the two pieces of each of m dimers, from centres (m, 2) and radii (2, m)."""
    count = len(np.asarray(one))
    pair = np.arange(count)
    centres = in_plane(np.vstack([one, other]))
    return split(centres, np.ravel(radii).astype(float), pair, pair + count)


def in_box(pieces: Pieces, box: ArrayLike) -> FloatArray:
    lower, upper = np.asarray(box, dtype=float).T
    with np.errstate(all="raise"):
        return areas_in(pieces, lower, upper)


def disc(centre: ArrayLike, radius: float, box: ArrayLike) -> float:
    return in_box(discs([centre], [radius]), box)[0]


def dimer(centres: ArrayLike, radii: ArrayLike, box: ArrayLike) -> float:
    one, other = np.asarray(centres, dtype=float)
    return sum(in_box(piece, box)[0] for piece in dimers([one], [other], radii))


def roots(square: float) -> list[float]:
    return [-np.sqrt(square), np.sqrt(square)] if square >= 0 else []


def by_chords(centres: Any, radii: Any, box: Any) -> float:
    """Return the area of the union of one or two discs in a rectangle: chords along y, over x."""
    (x0, x1), (y0, y1) = box
    ends = [x0, x1]
    for (x, y), r in zip(centres, radii, strict=True):
        ends += [x + root for h in (0, y0 - y, y1 - y) for root in roots(r**2 - h**2)]
    if len(radii) == 2:
        # Where the two circles cross, with the middle of their common chord.
        (one, other), (r1, r2) = np.asarray(centres, dtype=float), radii
        axis = other - one
        squared = axis @ axis
        if squared > 0:
            share = (squared + r1**2 - r2**2) / (2 * squared)
            half = roots(r1**2 / squared - share**2)
            ends += [one[0] + share * axis[0] + root * axis[1] for root in half]

    def length(x: float) -> float:
        parts = []
        for (cx, cy), r in zip(centres, radii, strict=True):
            half = np.sqrt(max(r**2 - (x - cx) ** 2, 0))
            low, high = max(cy - half, y0), min(cy + half, y1)
            if low < high:
                parts.append((low, high))
        if len(parts) < 2:
            return sum(high - low for low, high in parts)
        (low1, high1), (low2, high2) = parts
        both = max(min(high1, high2) - max(low1, low2), 0)
        return high1 - low1 + high2 - low2 - both

    total = 0.0
    for begin, end in pairwise(sorted(x for x in ends if x0 <= x <= x1)):
        # What starts like a square root at an end of a piece is smooth in the angle t.
        middle, half = (begin + end) / 2, (end - begin) / 2

        def of_angle(t: float, middle: float = middle, half: float = half) -> float:
            return length(middle - half * np.cos(t)) * half * np.sin(t)

        total += quad(of_angle, 0, np.pi, epsabs=1e-13, epsrel=1e-12, limit=200)[0]
    return total


def test_closed_forms() -> None:
    far = 7.0
    halves = [[[0, far], [-far, far]], [[-far, 0], [-far, far]], [[-far, far], [0, far]]]
    # A sum of a few terms of the size of the disc, 3.1, here and below: each rounds at 2e-16.
    for box in halves:
        assert disc([0, 0], 1, box) == pytest.approx(np.pi / 2, abs=1e-15)
    for x, y in product([[0, far], [-far, 0]], repeat=2):
        assert disc([0, 0], 1, [x, y]) == pytest.approx(np.pi / 4, abs=1e-15)
    for distance in (0.01, 0.5, 0.8, 0.999999):
        half = np.sqrt((1 - distance) * (1 + distance))
        segment = np.arctan2(half, distance) - distance * half
        assert disc([0, 0], 1, [[distance, far], [-far, far]]) == pytest.approx(segment, abs=1e-15)
        rest = np.pi - segment
        assert disc([0, 0], 1, [[-distance, far], [-far, far]]) == pytest.approx(rest, abs=2e-15)
    # The quarter beyond a corner at a distance a along both axes.
    for a in (0.1, 0.5, 0.7):
        b = np.sqrt(1 - a**2)
        corner = (np.arcsin(b) - np.arcsin(a)) / 2 - a * (b - a)
        assert disc([0, 0], 1, [[a, far], [a, far]]) == pytest.approx(corner, abs=1e-15)


def test_nothing_and_everything_are_exact() -> None:
    whole = np.pi * 0.5**2
    assert disc([0.5, 0.5], 0.5, UNIT) == whole
    assert disc([0.5, 0.5], 0.5, PLANE) == whole
    assert disc([0.5, 0.5], 0.5, [[-1e300, np.inf], [-1e9, 1e300]]) == whole
    assert disc([0.5, 0.5], 0.9, UNIT) == 1
    assert disc([0.5, 0.5], 0.9, [[0.5, 0.75], [0.25, 0.5]]) == 0.25**2
    assert disc([1.2, 1.2], 0.25, UNIT) == 0  # beside the corner
    assert disc([0.5, 1.25], 0.25, UNIT) == 0  # touching from outside
    assert disc([0.5, 3], 0.25, [[-np.inf, np.inf], [-np.inf, 1]]) == 0
    # Empty rectangles, one of them inside out.
    assert disc([0.5, 0.5], 0.25, [[0.5, 0.5], [0, 1]]) == 0
    assert disc([0.5, 0.5], 0.25, [[0.6, 0.4], [0.7, 0.2]]) == 0


def test_whole_dimers() -> None:
    r, distance = 0.2, 0.3
    angles = np.linspace(0, 7, 40)
    arms = distance / 2 * np.column_stack([np.cos(angles), np.sin(angles)])
    one, other = dimers(0.5 - arms, 0.5 + arms, np.full((2, 40), r))
    lens = 2 * r**2 * np.arccos(distance / 2 / r) - distance / 2 * np.sqrt(4 * r**2 - distance**2)
    union = np.full(40, 2 * np.pi * r**2 - lens)
    # A few operations of terms of 0.1.
    assert areas(one) + areas(other) == pytest.approx(union, abs=1e-16)
    for box in (UNIT, PLANE, [[-1e6, 1e6]] * 2):
        assert (in_box(one, box) == areas(one)).all()


def test_lines_that_all_but_touch() -> None:
    # The segment beyond a line at r (1 - e) has the area 4/3 sqrt(2) e^(3/2) r^2 for small e.
    r1, r2 = 0.7, 0.6
    for e in (1e-10, 1e-7):
        # The two circles meet on a chord of which the larger disc loses the segment.
        offset = r1 * (1 - e)
        distance = offset + np.sqrt(r2**2 - r1**2 * e * (2 - e))
        larger, _ = dimers([[0, 0]], [[distance, 0]], [[r1], [r2]])
        whole, lost = np.pi * r1**2, 4 / 3 * np.sqrt(2) * e**1.5 * r1**2
        # Rounding of an area of 1.5.
        assert areas(larger) == pytest.approx(whole - lost, abs=1e-15)
        quarter = in_box(larger, [[0, 2], [0, 2]])
        assert quarter == pytest.approx(whole / 4 - lost / 2, abs=1e-15)


# One disc of radius 0.25 in the unit square: how it is cut, and its centre.
CUTS = {
    "touching two sides": [0.25, 0.75],
    "one side": [0.5, 0.1],
    "one side, centre outside": [1.1, 0.5],
    "one side, centre on it": [0.0, 0.5],
    "one side, a corner on the circle": [0.15, 0.8],
    "the corner": [0.1, 0.15],
    "the corner, circle through it": [0.15, 0.2],
    "the corner, circle through it from outside": [-0.15, -0.2],
    "the corner, centre outside": [-0.1, -0.12],
    "the corner, centre outside of one side": [-0.1, 0.12],
    "centre on the corner": [1.0, 0.0],
    "two sides, not the corner": [0.2, 0.8],
    "all but touching": [0.5, -0.25 + 1e-9],
    "all but inside": [0.5, 0.25 - 1e-9],
}

# Other rectangles, for a disc of radius 1 at the origin.
BOXES = {
    "opposite sides": [[-0.3, 0.7], [-2, 2]],
    "opposite sides, centre outside": [[0.3, 0.7], [-2, 2]],
    "thin strip": [[0.3, 0.300001], [-2, 2]],
    "thin strip with corners": [[0.3, 0.300001], [-0.1, 0.8]],
    "thin strip along a tangent": [[1 - 1e-6, 1], [-2, 2]],
    "three sides": [[-0.2, 0.3], [-0.4, 2]],
    "all sides, no corner": [[-0.9, 0.8], [-0.7, 0.95]],
    "all sides, some corners": [[-0.6, 0.65], [-0.5, 0.8]],
    "all corners on the circle": [[-0.6, 0.6], [-0.8, 0.8]],
    "one corner in the disc": [[-0.5, 3], [-3, 0.1]],
    "rectangle in the disc, a corner on the circle": [[-0.6, 0.1], [-0.1, 0.8]],
    "large rectangle far away": [[0.9, 1e6], [-1e6, 0.1]],
}


@pytest.mark.parametrize("name", CUTS)
def test_disc_in_the_unit_square(name: str) -> None:
    centre = CUTS[name]
    expected = by_chords([centre], [0.25], UNIT)
    # Rounding of terms of 0.2, on both sides: `quad` does far better than it promises.
    assert disc(centre, 0.25, UNIT) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("name", BOXES)
def test_unit_disc_in_rectangles(name: str) -> None:
    expected = by_chords([[0, 0]], [1], np.clip(np.array(BOXES[name]), -1.5, 1.5))
    # As above, for a disc of 3.
    assert disc([0, 0], 1, BOXES[name]) == pytest.approx(expected, abs=4e-15)


# Two centres, two radii, a rectangle: dimers cut in every way, also exactly along their line.
DIMERS = {
    "not cut": ([[0.4, 0.5], [0.6, 0.55]], [0.2, 0.2], UNIT),
    "one side": ([[0.1, 0.5], [0.2, 0.6]], [0.2, 0.2], UNIT),
    "corner": ([[0.1, 0.1], [0.2, 0.05]], [0.2, 0.2], UNIT),
    "corner, one centre outside": ([[0.1, -0.1], [-0.05, 0.2]], [0.3, 0.3], UNIT),
    "unequal": ([[0.1, 0.1], [0.3, 0.05]], [0.1, 0.25], UNIT),
    "smaller mostly covered": ([[0.1, 0.1], [0.2, 0.15]], [0.15, 0.25], UNIT),
    "smaller covered": ([[0.1, 0.1], [0.2, 0.15]], [0.1, 0.25], UNIT),
    "smaller covered, touching from inside": ([[0.1, 0.1], [0.2, 0.1]], [0.1, 0.2], UNIT),
    "in one place": ([[0.1, 0.1], [0.1, 0.1]], [0.1, 0.2], UNIT),
    "touching": ([[0.1, 0.1], [0.5, 0.1]], [0.15, 0.25], UNIT),
    "not touching": ([[0.1, 0.1], [0.1, 0.9]], [0.2, 0.3], UNIT),
    "all sides": ([[0.45, 0.5], [0.6, 0.4]], [0.6, 0.5], UNIT),
    "rectangle in the dimer": ([[0.3, 0.5], [0.7, 0.4]], [0.8, 0.8], UNIT),
    "thin strip": ([[0.1, 0.5], [0.2, 0.6]], [0.2, 0.2], [[0.14, 0.140001], [0, 1]]),
    "along an axis": ([[0.0, 0.1], [0.2, 0.1]], [0.15, 0.15], UNIT),
    "along an axis, line on a side": ([[-0.1, 0.1], [0.1, 0.1]], [0.2, 0.2], UNIT),
    "along a diagonal, line through a corner": ([[-0.1, -0.1], [0.1, 0.1]], [0.2, 0.2], UNIT),
    "along a diagonal, line through two corners": ([[0.4, 0.4], [0.6, 0.6]], [0.8, 0.8], UNIT),
    "circles meet on a side": ([[0.3, -0.4], [0.3, 0.6]], [0.5, np.sqrt(0.45)], UNIT),
    "circles meet in a corner": ([[-0.3, 0.4], [0.4, 0.3]], [0.5, 0.5], UNIT),
}


@pytest.mark.parametrize("name", DIMERS)
def test_dimers(name: str) -> None:
    centres, radii, box = DIMERS[name]
    # Rounding of terms of up to 2, on both sides.
    assert dimer(centres, radii, box) == pytest.approx(by_chords(centres, radii, box), abs=2e-15)


@pytest.mark.parametrize("seed", range(4))
def test_random_discs_and_dimers(seed: int) -> None:
    generator = np.random.default_rng(seed)
    for _ in range(50):
        centres = generator.uniform(-0.5, 0.5, (2, 2))
        radii = 10 ** generator.uniform(-1, 0.3, 2)
        # Widths and heights from 0.001 to 10.
        low = generator.uniform(-1, 0.5, 2)
        box = np.column_stack([low, low + 10 ** generator.uniform(-3, 1, 2)])
        # Rounding of terms of the size of the discs, up to 13, on both sides.
        expected = by_chords(centres[:1], radii[:1], box)
        assert disc(centres[0], radii[0], box) == pytest.approx(expected, abs=1e-14)
        expected = by_chords(centres, radii, box)
        assert dimer(centres, radii, box) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("shift", [0, 1e-16, 3e-15])
def test_rounding_decides_which_corner_is_behind_the_line(shift: float) -> None:
    # The line on which the circles meet all but holds a side, a corner or two of the square.
    for axis in ([1, 0], [0, 1], [1, 1], [1, -1], [1, 2]):
        arm = 0.1 * np.array(axis) / np.linalg.norm(axis) + [shift, -2 * shift]
        for place in ([0, 0.5], [0.5, 1], [0, 0], [1, 0], [0.5, 0.5], [0, 0.75]):
            centres = np.array([place - arm, place + arm])
            # As above.
            expected = by_chords(centres, [0.3, 0.3], UNIT)
            assert dimer(centres, [0.3, 0.3], UNIT) == pytest.approx(expected, abs=2e-15)


def random_dimers(count: int, seed: int) -> tuple[Pieces, Pieces]:
    generator = np.random.default_rng(seed)
    one = generator.uniform(-0.1, 1.1, (count, 2))
    other = one + generator.uniform(-0.3, 0.3, (count, 2))
    return dimers(one, other, generator.uniform(0.05, 0.4, (2, count)))


def test_cells_of_a_grid_add_up() -> None:
    edges = [[0, 0.1, 0.3, 0.300001, 0.7, 1], [0, 0.25, 0.5, 0.51, 1]]
    cells = [np.array(cell) for cell in product(*(list(pairwise(line)) for line in edges))]
    for pieces in (*random_dimers(3000, seed=1), discs([[0.5, 0.5], [0.1, 0.5]], [0.5, 0.7])):
        total = sum(in_box(pieces, cell) for cell in cells)
        # Twenty cells, each of which rounds at some 1e-16 of r^2 < 0.5.
        assert total == pytest.approx(in_box(pieces, UNIT), abs=1e-15)


def test_the_plane_of_cells_holds_every_piece() -> None:
    lines = [-np.inf, 0, 0.5, 1, np.inf]
    for pieces in random_dimers(3000, seed=2):
        total = sum(in_box(pieces, cell) for cell in product(list(pairwise(lines)), repeat=2))
        # As above, with sixteen cells.
        assert total == pytest.approx(areas(pieces), abs=1e-15)


def test_each_piece_in_a_rectangle_of_its_own() -> None:
    pieces, _ = random_dimers(300, seed=3)
    generator = np.random.default_rng(4)
    bounds = np.sort(generator.uniform(-0.2, 1.2, (2, 300, 3)), axis=0)
    lower, upper = bounds
    found = areas_in(pieces, lower, upper)
    assert (found == areas_in(pieces, lower[:, :2], upper[:, :2])).all()
    single = [in_box(pieces[[i]], bounds[:, i, :2].T)[0] for i in range(300)]
    # The same operations, but numpy's vectors may round otherwise than what is left over at an end.
    assert found == pytest.approx(np.array(single), abs=1e-15)
    assert found.shape == (300,)
    assert areas_in(pieces[[]], lower[0], upper[0]).shape == (0,)


def test_pieces_of_particles() -> None:
    # A dimer, a free sphere, and a dimer of which one sphere lies within the other.
    points = [[0.1, 0.1], [0.2, 0.1], [0.6, 0.6], [0.9, 0.2], [0.9, 0.3]]
    radii = [0.1, 0.1, 0.3, 0.2, 0.05]
    pieces = pieces_of(Spheres(in_plane(points), np.array(radii), group_spheres([1, 1, 0, 2, 2])))
    box = [[0.15, 0.8], [0.05, 0.5]]
    found = np.zeros(3)
    np.add.at(found, pieces.particles, in_box(pieces, box))
    expected = [by_chords(points[i:j], radii[i:j], box) for i, j in ((0, 2), (2, 3), (3, 5))]
    # Rounding of terms of 0.3, on both sides.
    assert np.sort(found) == pytest.approx(np.sort(expected), abs=1e-15)


def test_a_disc_in_its_partner_has_no_area() -> None:
    inner, outer = dimers([[0.5, 0.5]], [[0.5, 0.55]], [[0.1], [0.3]])
    assert areas(inner) == [0]
    for box in (UNIT, [[0.5, 1], [0, 1]], [[0.49, 0.51], [0.49, 0.51]]):
        assert in_box(inner, box) == [0]
    assert areas(outer) == [np.pi * 0.3**2]


def test_spheres_that_are_not_in_one_plane() -> None:
    centres = np.array([[0.5, 0.5, 0], [0.6, 0.5, 0.1]])
    pieces = pieces_of(Spheres(centres, np.array([0.2, 0.2]), group_spheres([1, 1])))
    with pytest.raises(InputError, match="spheres of the particle with index 0 differ in z"):
        in_box(pieces, UNIT)


# Numbers that meet one another and the sides exactly, and any others.
NUMBERS = st.one_of(
    st.sampled_from([-1.0, -0.8, -0.6, -0.5, 0.0, 0.5, 0.6, 0.8, 1.0]), st.floats(-1.5, 1.5)
)
SIZES = st.one_of(st.sampled_from([0.3, 0.5, 0.6, 0.8, 1.0]), st.floats(0.1, 2))
POINTS = st.tuples(NUMBERS, NUMBERS)


def of_dimer(centres: ArrayLike, radii: Any) -> Pieces:
    """Return the two pieces of a dimer, or one if it is a disc that holds the other."""
    return pieces_of(
        Spheres(in_plane(centres), np.array(radii, dtype=float), group_spheres([1, 1]))
    )


@RANDOM
@given(one=POINTS, other=POINTS, radii=st.tuples(SIZES, SIZES), low=POINTS, high=POINTS, cut=POINTS)
@example((0, 0), (1, 0), (1, 1), (-1, -1), (1, 1), (0.5, 0.0))
def test_four_parts_add_up(one: Any, other: Any, radii: Any, low: Any, high: Any, cut: Any) -> None:
    pieces = of_dimer([one, other], radii)
    x, y = np.sort([low, high, cut], axis=0).T
    with np.errstate(divide="raise", invalid="raise", over="raise"):
        parts = [
            areas_in(pieces, np.array([x0, y0]), np.array([x1, y1]))
            for x0, x1 in pairwise(x)
            for y0, y1 in pairwise(y)
        ]
        found = areas_in(pieces, np.array([x[0], y[0]]), np.array([x[2], y[2]]))
    # Five areas, each of which rounds at some 1e-16 of r^2 < 4; so do the distances of the sides.
    assert sum(parts) == pytest.approx(found, abs=2e-14)
    assert (found >= 0).all()
    assert (found <= areas(pieces)).all()


@RANDOM
@given(one=POINTS, other=POINTS, radii=st.tuples(SIZES, SIZES), low=POINTS, high=POINTS)
def test_mirrored_and_turned(one: Any, other: Any, radii: Any, low: Any, high: Any) -> None:
    box = np.sort([low, high], axis=0).T
    points = np.array([one, other])
    expected = areas_in(of_dimer(points, radii), *box.T).sum()
    for signs in product([-1, 1], repeat=2):
        mirrored = np.sort(box * np.array(signs)[:, None], axis=1)
        found = areas_in(of_dimer(points * signs, radii), *mirrored.T).sum()
        # Sums in another order, of terms of up to 13.
        assert found == pytest.approx(expected, abs=2e-14)
    turned = areas_in(of_dimer(points[:, ::-1], radii), *box[::-1].T).sum()
    assert turned == pytest.approx(expected, abs=2e-14)
    # The dimer counts what is common to its discs once.
    single = sum(areas_in(discs([p], [r]), *box.T)[0] for p, r in zip(points, radii, strict=True))
    assert expected <= single + 2e-14


def test_many_discs_are_fast() -> None:
    centres = np.random.default_rng(5).uniform(0, 1, (100_000, 2))
    pieces = discs(centres, np.full(100_000, 0.3))
    begin = time.process_time()
    in_box(pieces, [[0.25, 0.75]] * 2)
    # All but the corners' are cut: a tenth of a second; a loop over the discs takes a minute.
    assert time.process_time() - begin < 1
