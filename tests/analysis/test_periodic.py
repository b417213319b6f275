"""Every measure of packings in periodic, tilted and two-dimensional cells: against all images.

The images are those of replicas.py, by plain loops. Where a measure has closed forms or own tests
for open packings, a replicated packing that is open is measured instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.special import eval_legendre

from lammps_inelastic.analysis import (
    Cell,
    InputError,
    Spheres,
    bond_order,
    box_in_bed,
    contact_counts,
    contacts_by_distance,
    dimer_orientation,
    exact_packing_fraction,
    group_spheres,
    largest_pair_overlap,
    packing_fraction,
    packing_fraction_with_necks,
    particle_volumes_in_box,
    radial_distribution,
    small_gaps,
    sphere_volumes_in_box,
    wall_profile,
    wall_profile_monte_carlo,
)
from lammps_inelastic.analysis.geometry import FloatArray
from tests.helpers.replicas import (
    CELLS,
    PLANES,
    TURN,
    Packing,
    dimer,
    in_plane,
    in_space,
    packed,
    packings,
    size_of_box,
    union,
    union_in_box,
)

ALL = packings("spheres", "dimers", "clusters")
SPHERES = packings("spheres")
EXACT = packings("spheres", "dimers")
OVERLAPPING = packings("dimers", overlapping=0.1)
each_packing = pytest.mark.parametrize("make", ALL.values(), ids=ALL)
each_exact = pytest.mark.parametrize("make", EXACT.values(), ids=EXACT)
each_overlapping = pytest.mark.parametrize("make", OVERLAPPING.values(), ids=OVERLAPPING)

Make = Callable[[], Packing]


def boxes(packing: Packing) -> dict[str, FloatArray]:
    """Return boxes inside the cell, across its faces, of its size, and larger."""
    generator = np.random.default_rng(len(packing.radii))
    middle = packing.origin + packing.vectors.sum(axis=0) / 2
    sides = np.array([1.0, 0.8, 1.2])
    found = {
        "inside": np.column_stack([middle - sides / 2, middle + sides / 2]),
        "across": np.column_stack([packing.origin - 0.4, packing.origin + 0.7]),
        "away": np.column_stack([middle + 3, middle + 3 + sides]),
        "large": np.column_stack([middle - 2.2 * sides, middle + 2.3 * sides]),
    }
    found["thin"] = found["inside"] + generator.uniform(-0.2, 0.2, (3, 1))
    found["thin"][0, 1] = found["thin"][0, 0] + 0.03
    return found


def periods(packing: Packing, shift: FloatArray) -> FloatArray:
    """Return by how many periods differences of positions differ that are equal but for images."""
    return np.asarray(np.linalg.solve(packing.vectors.T, np.atleast_2d(shift).T).T, dtype=float)


def scattered(cell: str, per_volume: float, radius: float, *, flat: bool = False) -> Packing:
    """Return a packing of small spheres at random, whether they overlap or not."""
    vectors, periodic = (PLANES if flat else CELLS)[cell]
    generator = np.random.default_rng(5)
    count = int(abs(np.linalg.det(vectors)) * per_volume)
    places = generator.uniform(size=(count, 3)) @ vectors
    if flat:
        places[:, 2] = 0.5
    radii, free = np.full(count, radius), np.zeros(count, dtype=int)
    return Packing(places, radii, free, np.zeros(3), vectors, periodic, flat)


def dense(cell: str, *, flat: bool = False) -> Packing:
    """Return a packing in which no gap is a sphere wide."""
    return scattered(cell, 90 if flat else 80, 0.17, flat=flat)


# The places of spheres.


@each_packing
def test_particles_are_in_one_piece_and_in_the_cell(make: Make) -> None:
    packing = make()
    spheres = packing.spheres()
    moved = periods(packing, spheres.positions - packing.positions)
    # A few operations on positions up to some periods away.
    assert np.abs(moved - np.rint(moved)).max() < 1e-13
    assert np.abs(moved[:, ~np.array(packing.periodic)]).max(initial=0) < 1e-13
    for particle, members in enumerate(packing.members):
        assert (spheres.particles.index[members] == particle).all()
        # All of its spheres have moved by the same periods.
        assert np.ptp(np.rint(moved[members]), axis=0).max() == 0
        centre = spheres.positions[members].mean(axis=0)
        np.testing.assert_allclose(spheres.centres[particle], centre, atol=1e-13)
        share = periods(packing, centre - packing.origin)[0]
        inside = (share > -1e-12) & (share < 1 + 1e-12)
        assert inside[np.array(packing.periodic)].all()
        arms = np.linalg.norm(spheres.positions[members] - centre, axis=1)
        extent = (arms + packing.radii[members]).max()
        assert spheres.extents[particle] == pytest.approx(extent, rel=1e-13)


def test_a_body_longer_than_its_cell() -> None:
    # Eleven spheres in a row lead twice around the cell and do not meet themselves.
    arm = np.array([0.4, 0.15, 0.05])
    places = np.arange(11)[:, None] * arm
    vectors = np.diag([2.0, 3, 3])
    away = np.random.default_rng(1).integers(-3, 4, (11, 3)) @ vectors
    order = np.random.default_rng(2).permutation(11)
    cell = Cell(np.zeros(3), vectors, [True] * 3)
    spheres = Spheres(
        (places + away)[order], np.full(11, 0.2), group_spheres(np.ones(11, dtype=int)), cell
    )
    # A few operations.
    np.testing.assert_allclose(
        spheres.positions - spheres.positions.mean(axis=0),
        (places - places.mean(axis=0))[order],
        atol=1e-13,
    )


def test_a_small_sphere_on_a_large_one() -> None:
    # The small sphere's centre is nearer to the image of the third sphere than the large one's is
    # to the third, but only these two touch.
    places = np.array([[0.15, 0, 0], [1.2, 0, 0], [2.6, 0, 0]])
    radii = np.array([0.1, 1.0, 0.4])
    cell = Cell.of_box([[0, 3.3], [-2, 2], [-2, 2]], [True] * 3)
    for away in product((-1, 0, 1), repeat=3):
        shift = np.zeros((3, 3))
        shift[:, 0] = np.array(away) * 3.3
        spheres = Spheres(places + shift, radii, group_spheres([1, 1, 1]), cell)
        apart = np.diff(spheres.positions, axis=0)
        np.testing.assert_allclose(apart, np.diff(places, axis=0), atol=1e-14)


# Pairs.


def assert_pairs(packing: Packing, gap: float) -> None:
    """Compare the contacts by distance with all pairs of images."""
    expected = packing.pairs(gap)
    spheres = packing.spheres()
    found = contacts_by_distance(spheres, gap)
    one, other = found.sides.T
    start = spheres.positions[one]
    apart = spheres.positions[other] + found.images @ packing.vectors - start
    at_home = packing.positions[other] - packing.positions[one]
    moves = periods(packing, apart - at_home)
    # A few operations on positions up to some periods away.
    assert np.abs(moves - np.rint(moves)).max(initial=0) < 1e-12
    names = np.column_stack([one, other, np.rint(moves)]).astype(int).tolist()
    own = [name for name in names if name[0] == name[1]]
    # A sphere and its own image: either of the two images may be named.
    for name in own:
        if next(k for k in name[2:] if k) < 0:
            name[2:] = [-k for k in name[2:]]
    gaps = {tuple(name): value for name, value in zip(names, found.gaps.tolist(), strict=True)}
    assert len(gaps) == len(found.gaps)
    assert gaps.keys() == expected.keys()
    assert (one <= other).all()
    for name, value in expected.items():
        # A few operations on lengths up to some periods.
        assert gaps[name] == pytest.approx(value, abs=1e-12)
    length = np.linalg.norm(apart, axis=1)
    np.testing.assert_allclose(found.normals, -apart / length[:, None], atol=1e-12)
    reach = (packing.radii[one] + found.gaps / 2)[:, None]
    np.testing.assert_allclose(found.points, start - reach * found.normals, atol=1e-12)
    np.testing.assert_allclose(
        np.sort(small_gaps(spheres, gap)), np.sort([*expected.values()]), atol=1e-12
    )


@pytest.mark.parametrize("gap", [0.0, 0.02, 0.4])
@each_packing
def test_contacts_by_distance(make: Make, gap: float) -> None:
    assert_pairs(make(), gap)


@pytest.mark.parametrize("make", SPHERES.values(), ids=SPHERES)
def test_contacts_across_several_periods(make: Make) -> None:
    assert_pairs(make(), 2.0)


@pytest.mark.parametrize("cell", ["ppp", "tilted fpf", "turned"])
def test_a_cell_twenty_diameters_wide(cell: str) -> None:
    # Small spheres among some that are five times as large.
    packing = scattered(cell, 10, 0.06)
    packing.radii[::25] *= 5
    expected = packing.pairs(0.01)
    found = contacts_by_distance(packing.spheres(), 0.01)
    # A few operations on lengths up to some periods.
    np.testing.assert_allclose(np.sort(found.gaps), np.sort([*expected.values()]), atol=1e-12)
    pairs = sorted(name[:2] for name in expected)
    assert sorted(map(tuple, found.sides.tolist())) == pairs


@each_overlapping
def test_largest_overlap(make: Make) -> None:
    packing = make()
    expected = packing.pairs(0.0)
    found = largest_pair_overlap(packing.spheres())
    deepest = min(expected, key=lambda name: expected[name])
    assert found.depth == pytest.approx(-expected[deepest], abs=1e-12)
    assert found.pair == deepest[:2]


def test_no_overlap() -> None:
    assert largest_pair_overlap(in_space("ppp", "clusters").spheres()).pair is None


def test_gaps_of_some_particles() -> None:
    packing = in_space("tilted", "clusters")
    left_out = np.arange(len(packing.members)) % 3 == 0
    expected = [
        gap
        for (one, other, *_), gap in packing.pairs(0.3).items()
        if not left_out[packing.owner[one]] and not left_out[packing.owner[other]]
    ]
    found = small_gaps(packing.spheres(), 0.3, left_out)
    np.testing.assert_allclose(np.sort(found), np.sort(expected), atol=1e-12)


@pytest.mark.parametrize("gap", [0.1, 0.6])
@each_packing
def test_contact_counts(make: Make, gap: float) -> None:
    packing = make()
    spheres = packing.spheres()
    ids = np.random.default_rng(4).permutation(len(packing.radii)) + 1
    contacts = contacts_by_distance(spheres, gap)
    counts = contact_counts(contacts.ids(ids), ids, spheres.particles, images=True)
    number = np.zeros(len(packing.members), dtype=int)
    others: list[set[int]] = [set() for _ in packing.members]
    for one, other, *_ in packing.pairs(gap):
        ends = packing.owner[[one, other]].tolist()
        for mine, its in (ends, ends[::-1]):
            number[mine] += 1
            others[mine] |= {its} - {mine}
    assert (counts.particles == number).all()
    assert counts.neighbours.tolist() == [len(some) for some in others]
    assert not counts.walls.any()


# Volumes and areas.


@each_exact
def test_packing_fraction_of_the_cell(make: Make) -> None:
    packing = make()
    flat = packing.flat
    if all(packing.periodic[: 2 if flat else 3]):
        total = sum(
            union(packing.positions[m][:, : 2 if flat else 3], packing.radii[m])
            for m in packing.members
        )
        found = exact_packing_fraction(packing.spheres())
        # A sum of some volumes.
        assert found.value == pytest.approx(total / packing.volume, rel=1e-13)
        assert found.overlap == 0


@pytest.mark.parametrize("cell", ["pff", "fpf", "ppf", "fpp", "tilted ppf", "tilted pfp"])
def test_packing_fraction_of_a_cell_that_cuts(cell: str) -> None:
    packing = in_space(cell, "dimers")
    # Any box from face to face that is a period wide holds what the cell holds.
    low, high = packing.cell.bounds.T
    width = np.diag(packing.vectors)
    box = np.column_stack([low + 0.3 * np.array(packing.periodic), high])
    box[:, 1] = np.where(packing.periodic, box[:, 0] + width, high)
    found = exact_packing_fraction(packing.spheres())
    assert found.value == pytest.approx(
        packing.size_in(box)[0] / size_of_box(box, flat=False), rel=1e-9
    )


def test_packing_fraction_of_a_plane_that_cuts() -> None:
    packing = in_plane("pf", "dimers")
    box = packing.cell.bounds + np.array([[0.3, 0.3], [0, 0], [5, 7]])
    found = exact_packing_fraction(packing.spheres())
    # The error of the integration over cut discs.
    assert found.value == pytest.approx(packing.size_in(box)[0] / packing.volume, rel=1e-9)


def test_oblique_walls_cut_no_exact_volume() -> None:
    spheres = in_space("tilted fpf", "spheres").spheres()
    with pytest.raises(InputError, match="face of the cell across a is oblique"):
        exact_packing_fraction(spheres)


@pytest.mark.parametrize("name", ["inside", "across", "away", "thin"])
@each_exact
def test_packing_fraction_of_a_box(make: Make, name: str) -> None:
    packing = make()
    box = boxes(packing)[name]
    total, common = packing.size_in(box)
    size = size_of_box(box, flat=packing.flat)
    found = exact_packing_fraction(packing.spheres(), box)
    # The error of the integration over cut spheres.
    assert found.value == pytest.approx(total / size, abs=1e-9)
    assert found.overlap == 0
    assert common == 0


@pytest.mark.slow
@each_exact
def test_packing_fraction_of_a_box_larger_than_the_cell(make: Make) -> None:
    packing = make()
    box = boxes(packing)["large"]
    total, _ = packing.size_in(box)
    found = exact_packing_fraction(packing.spheres(), box)
    assert found.value == pytest.approx(total / size_of_box(box, flat=packing.flat), abs=1e-9)


@each_overlapping
def test_packing_fraction_where_particles_overlap(make: Make) -> None:
    packing = make()
    box = boxes(packing)["across"]
    total, common = packing.size_in(box)
    size = size_of_box(box, flat=packing.flat)
    found = exact_packing_fraction(packing.spheres(), box)
    assert found.value == pytest.approx(total / size, abs=1e-9)
    assert found.overlap == pytest.approx(common / size, abs=1e-9)
    if not all(packing.periodic[: 2 if packing.flat else 3]):
        return
    whole = exact_packing_fraction(packing.spheres())
    x = packing.positions[:, : 2 if packing.flat else 3]
    lenses = 0.0
    for one, other, *move in packing.pairs(0.0):
        away = (np.array(move) @ packing.vectors)[: x.shape[1]]
        places, radii = np.array([x[one], x[other] + away]), packing.radii[[one, other]]
        lenses += sum(union(places[[k]], radii[[k]]) for k in range(2)) - union(places, radii)
    assert lenses > 0
    # The lenses are a small difference.
    assert whole.overlap == pytest.approx(lenses / packing.volume, rel=1e-9)


@pytest.mark.parametrize("name", ["across", "thin", None])
@each_packing
def test_random_points(make: Make, name: str | None) -> None:
    packing = make()
    box = None if name is None else boxes(packing)[name]
    spheres = packing.spheres()
    found = packing_fraction(spheres, box, points=20_000, seed=1234)
    # The same points, counted over all images one by one: to the last point.
    generator = np.random.default_rng(1234)
    if box is None:
        points = packing.origin + generator.uniform(size=(20_000, 3)) @ packing.vectors
        ends = packing.cell.bounds
    else:
        points, ends = generator.uniform(box[:, 0], box[:, 1], (20_000, 3)), box
    if packing.flat:
        points[:, 2] = packing.positions[0, 2]
    images = packing.opened(ends)
    inside = np.zeros(len(points), dtype=bool)
    for place, radius in zip(images.positions, images.radii, strict=True):
        inside |= ((points - place) ** 2).sum(axis=1) <= radius**2
    assert found.value == inside.mean()


@pytest.mark.parametrize("name", ["across", "away", pytest.param("large", marks=pytest.mark.slow)])
@pytest.mark.parametrize("cell", CELLS)
def test_volumes_of_each_sphere_and_particle(cell: str, name: str) -> None:
    packing = in_space(cell, "dimers")
    box = boxes(packing)[name]
    if name == "large":
        # Of the particles, some have many images inside.
        box = (box - box.mean(axis=1, keepdims=True)) * 0.6 + box.mean(axis=1, keepdims=True)
    spheres = packing.spheres()
    # The spheres of a body are free to be counted one by one here.
    loose = replace(packing, bodies=np.zeros_like(packing.bodies))
    for whole, measured in (
        (loose, sphere_volumes_in_box(spheres, box)),
        (packing, particle_volumes_in_box(spheres, box)),
    ):
        middle, half = box.mean(axis=1), np.linalg.norm(np.diff(box)) / 2
        expected = np.zeros(len(whole.members))
        span = np.linalg.norm(whole.positions - middle, axis=1).max() + half + 3
        for move in whole.shifts(span):
            for particle, members in enumerate(whole.members):
                expected[particle] += union_in_box(
                    whole.positions[members] + move, whole.radii[members], box, flat=False
                )
        # The error of the integration over cut spheres.
        np.testing.assert_allclose(measured, expected, atol=1e-9)


@pytest.mark.parametrize("cell", PLANES)
def test_discs_have_no_volume(cell: str) -> None:
    spheres = in_plane(cell, "spheres").spheres()
    for measure in (sphere_volumes_in_box, particle_volumes_in_box):
        with pytest.raises(InputError, match="discs"):
            measure(spheres, [[0, 1]] * 3)


@pytest.mark.parametrize("cell", CELLS)
def test_necks(cell: str) -> None:
    packing = equal_dimers(cell)
    spheres = packing.spheres()
    # Around dimers, in their own places and a few periods away.
    for number in range(3):
        away = (number * np.array(packing.periodic)) @ packing.vectors
        middle = packing.positions[packing.members[number]].mean(axis=0) + away
        box = np.column_stack([middle - 0.5, middle + 0.4])
        opened = packing.opened(box).spheres(None)
        expected = packing_fraction_with_necks(opened, box, points=20_000, seed=5)
        # The same points: to the last one.
        assert packing_fraction_with_necks(spheres, box, points=20_000, seed=5) == expected
        assert expected.value > packing_fraction(spheres, box, points=20_000, seed=5).value
    if all(packing.periodic):
        # Any cell of the lattice has the same share, whatever its shape.
        whole = packing_fraction_with_necks(spheres, points=100_000, seed=6)
        box = np.column_stack([packing.origin, packing.origin + 3])
        opened = packing.opened(packing.cell.bounds).spheres(None)
        points = packing.origin + (
            np.random.default_rng(7).uniform(size=(300, 3)) @ packing.vectors
        )
        tiny = [
            packing_fraction_with_necks(opened, np.column_stack([p, p + 1e-9]), points=1).value
            for p in points
        ]
        share = np.mean(tiny)
        error = math.hypot(math.sqrt(share * (1 - share) / len(tiny)), whole.uncertainty)
        assert abs(whole.value - share) < 4 * error


def equal_dimers(cell: str) -> Packing:
    vectors, periodic = CELLS[cell]
    return packed(7, vectors, periodic, (dimer,), 10)


WALLS = {
    "pff": ("ylo", "yhi", "zlo"),
    "fpf": ("xlo", "zhi"),
    "ppf": ("zlo", "zhi"),
    "fpp": ("xhi",),
    "tilted ppf": ("zlo", "zhi"),
    "tilted pfp": ("ylo",),
    "tilted fpf": ("zlo", "zhi"),
}
WALLED = [(cell, wall) for cell, walls in WALLS.items() for wall in walls]


@pytest.mark.parametrize(("cell", "wall"), WALLED)
def test_profile_along_a_wall_that_is_there(cell: str, wall: str) -> None:
    packing = in_space(cell, "dimers")
    axis, upper = "xyz".index(wall[0]), wall.endswith("hi")
    box = np.column_stack([packing.origin - 0.4, packing.origin + np.array([1.1, 1.3, 1.2])])
    face = packing.cell.bounds[axis, int(upper)]
    box[axis] = (face - 0.9, face) if upper else (face, face + 0.9)
    thickness = 0.28
    spheres = packing.spheres()
    found = wall_profile(spheres, box, wall=wall, thickness=thickness, diameter=0.5)
    drawn = wall_profile_monte_carlo(
        spheres, box, wall=wall, thickness=thickness, diameter=0.5, points=4_000
    )
    assert len(found.values) == 3
    for slab, value in enumerate(found.values):
        part = box.copy()
        near, far = slab * thickness, (slab + 1) * thickness
        part[axis] = (face - far, face - near) if upper else (face + near, face + far)
        expected = packing.size_in(part)[0] / size_of_box(part, flat=False)
        # The error of the integration over cut spheres.
        assert value == pytest.approx(expected, abs=1e-9)
        # Without a single point inside, the error is not known.
        error = max(drawn.uncertainties[slab], 1 / 4_000)
        assert abs(drawn.values[slab] - expected) < 4 * error


@pytest.mark.parametrize(
    ("cell", "wall"),
    [
        *((cell, wall) for cell in ("ppp", "tilted", "turned") for wall in ("xlo", "zhi")),
        ("pff", "xlo"),
        ("tilted ppf", "xlo"),
        # The periods along b lead along x as well: no wall stands across it.
        ("tilted fpf", "xlo"),
        ("tilted fpf", "ylo"),
    ],
)
def test_no_profile_where_there_is_no_wall(cell: str, wall: str) -> None:
    spheres = in_space(cell, "spheres").spheres()
    with pytest.raises(InputError, match="no wall"):
        wall_profile(spheres, [[0, 1]] * 3, wall=wall, thickness=0.1, diameter=1)


@pytest.mark.parametrize("wall", ["ylo", "yhi"])
def test_profile_of_discs(wall: str) -> None:
    packing = in_plane("pf", "dimers")
    face = packing.cell.bounds[1, int(wall == "yhi")]
    box = np.column_stack([packing.origin - 0.4, packing.origin + 3.5])
    box[1] = (face, face + 1) if wall == "ylo" else (face - 1, face)
    found = wall_profile(packing.spheres(), box, wall=wall, thickness=0.25, diameter=1)
    for slab, value in enumerate(found.values):
        part = box.copy()
        near, far = slab * 0.25, (slab + 1) * 0.25
        part[1] = (face + near, face + far) if wall == "ylo" else (face - far, face - near)
        expected = packing.size_in(part)[0] / size_of_box(part, flat=True)
        assert value == pytest.approx(expected, abs=1e-9)


# Order.


def assert_counts(packing: Packing, box: ArrayLike | None, largest: float, bins: int) -> None:
    """Compare g(r) with the distances between all images."""
    found = radial_distribution(packing.spheres(), box, largest=largest, bins=bins)
    centres = packing.centres
    span = np.linalg.norm(np.ptp(centres, axis=0)) + largest + 1
    if box is None:
        around, size = centres, packing.volume
    else:
        ends = np.asarray(box, dtype=float)
        middle = ends.mean(axis=1)
        far = np.linalg.norm(centres - middle, axis=1).max() + np.linalg.norm(np.diff(ends))
        images = (centres[:, None] + packing.shifts(far)).reshape(-1, 3)
        inside = (images >= ends[:, 0]) & (images <= ends[:, 1])
        around = images[inside[:, : 2 if packing.flat else 3].all(axis=1)]
        size = size_of_box(ends, flat=packing.flat)
        span += 2 * far
    everywhere = (centres[:, None] + packing.shifts(span)).reshape(-1, 3)
    distance = np.linalg.norm(around[:, None] - everywhere, axis=2).ravel()
    distance = distance[(distance > 1e-9) & (distance < largest * 1.001)]
    edges = np.linspace(0, largest, bins + 1)
    numbers, _ = np.histogram(distance, edges)
    shells = np.pi * np.diff(edges**2) if packing.flat else 4 / 3 * np.pi * np.diff(edges**3)
    density = len(around) / size
    assert found.particles == len(around)
    assert found.density == pytest.approx(density, rel=1e-13)
    counted = np.rint(found.values * len(around) * density * shells)
    # freud stores positions as float32: a distance this close to an edge may be on either side.
    near_edge = np.abs(distance[:, None] - edges).min(axis=1) < 1e-5
    doubtful, _ = np.histogram(distance[near_edge], edges)
    off = np.abs(counted - numbers)
    assert (off[doubtful == 0] <= np.convolve(doubtful, [1, 0, 1], "same")[doubtful == 0]).all()
    assert off.sum() <= 2 * near_edge.sum()
    assert near_edge.sum() < max(3, 1e-3 * len(distance))


PERIODIC = [name for name, (_, flags) in CELLS.items() if all(flags)]


@pytest.mark.parametrize("largest", [1.1, 3.97])
@pytest.mark.parametrize("shapes", ["spheres", "clusters"])
@pytest.mark.parametrize("cell", PERIODIC)
def test_radial_distribution_of_the_cell(cell: str, shapes: str, largest: float) -> None:
    assert_counts(in_space(cell, shapes), None, largest, 23)


@pytest.mark.parametrize("largest", [0.9, 5.93])
@pytest.mark.parametrize("cell", [name for name, (_, flags) in PLANES.items() if all(flags[:2])])
def test_radial_distribution_of_discs(cell: str, largest: float) -> None:
    assert_counts(in_plane(cell, "dimers"), None, largest, 23)
    packing = in_plane(cell, "spheres")
    assert_counts(packing, boxes(packing)["across"], largest, 17)


@pytest.mark.parametrize(
    ("cell", "name"), [*((cell, "across") for cell in PERIODIC), ("ppp", "large")]
)
def test_radial_distribution_around_a_box(cell: str, name: str) -> None:
    packing = in_space(cell, "dimers")
    assert_counts(packing, boxes(packing)[name], 1.3, 17)


@pytest.mark.parametrize("cell", ["pff", "ppf", "fpp", "tilted ppf", "tilted pfp", "tilted fpf"])
def test_radial_distribution_away_from_walls(cell: str) -> None:
    packing = scattered(cell, 7, 0.1)
    vectors, open_edges = packing.vectors, ~np.array(packing.periodic)
    middle = packing.origin + vectors.sum(axis=0) / 2
    # Across a period, and in the middle between two walls.
    lengths = np.where(open_edges, 0.8, 3.0)
    box = np.column_stack([middle - lengths / 2, middle + lengths / 2])
    if cell == "tilted fpf":
        box[1] = middle[1] + np.array([-0.3, 0.3])
    largest = 0.7
    shares = periods(packing, packing.positions - packing.origin)[:, open_edges]
    corners = np.array([*product(*box)]) - packing.origin
    ends = periods(packing, corners)[:, open_edges]
    heights = 1 / np.linalg.norm(np.linalg.inv(vectors), axis=0)[open_edges]
    deep = np.minimum(ends.min(axis=0) - shares.min(axis=0), shares.max(axis=0) - ends.max(axis=0))
    assert (deep * heights > largest).all()
    assert_counts(packing, box, largest, 7)
    # Up to the wall, there are too few neighbours to count.
    reached = float((deep * heights).min())
    with pytest.raises(InputError, match="away from the outermost centres"):
        radial_distribution(packing.spheres(), box, largest=reached + 0.01)


def order_of(bonds: FloatArray, degree: int) -> float:
    """Return q_l of some bonds: by the addition theorem of spherical harmonics."""
    unit = bonds / np.linalg.norm(bonds, axis=1)[:, None]
    return math.sqrt(max(eval_legendre(degree, np.clip(unit @ unit.T, -1, 1)).mean(), 0))


def twelve_nearest(place: FloatArray, everywhere: FloatArray) -> FloatArray:
    """Return the bonds to the twelve nearest centres, (12, 3)."""
    apart = everywhere - place
    return apart[np.argsort((apart**2).sum(axis=1))[1:13]]


def aligned(one: FloatArray, other: FloatArray) -> float:
    """Return how much the order of two particles of degree 6 agrees, from their bonds."""

    def product_of(a: FloatArray, b: FloatArray) -> float:
        a, b = (x / np.linalg.norm(x, axis=1)[:, None] for x in (a, b))
        return float(eval_legendre(6, np.clip(a @ b.T, -1, 1)).mean())

    return product_of(one, other) / math.sqrt(product_of(one, one) * product_of(other, other))


@pytest.mark.parametrize("shapes", ["spheres", "clusters"])
@pytest.mark.parametrize("cell", PERIODIC)
def test_bond_order_of_the_cell(cell: str, shapes: str) -> None:
    packing = in_space(cell, shapes)
    centres = packing.centres
    span = 2 * np.linalg.norm(np.ptp(centres, axis=0)) + 3
    everywhere = (centres[:, None] + packing.shifts(span)).reshape(-1, 3)
    # Three diameters around the cell are enough for the neighbours of neighbours.
    reach = np.array([centres.min(axis=0) - 3, centres.max(axis=0) + 3])
    everywhere = everywhere[((everywhere >= reach[0]) & (everywhere <= reach[1])).all(axis=1)]
    found = bond_order(packing.spheres(), w6=True)
    assert len(found.q6) == len(centres)
    for particle, place in enumerate(centres):
        bonds = twelve_nearest(place, everywhere)
        # freud stores positions as float32: 1e-5 of the shortest bonds in a wide packing.
        assert found.q4[particle] == pytest.approx(order_of(bonds, 4), abs=1e-4)
        assert found.q6[particle] == pytest.approx(order_of(bonds, 6), abs=1e-4)
        agree = [aligned(bonds, twelve_nearest(place + bond, everywhere)) for bond in bonds]
        if np.abs(np.array(agree) - 0.7).min() > 1e-4:
            assert found.crystalline_bonds[particle] == (np.array(agree) > 0.7).sum()


@pytest.mark.parametrize("cell", ["ppp", "oblique", "turned", "ppf", "tilted fpf"])
def test_bond_order_of_a_replicated_packing(cell: str) -> None:
    packing = in_space(cell, "dimers")
    middle = packing.origin + packing.vectors.sum(axis=0) / 2
    away = np.array(packing.periodic) @ packing.vectors / 2
    box = np.column_stack([middle + away - 0.9, middle + away + 0.9])
    found = bond_order(packing.spheres(), box, w6=True)
    opened = bond_order(packing.opened(box, 4.0).spheres(None), box, w6=True)
    for name in ("q4", "q6", "w6", "crystalline_bonds"):
        one, other = (np.sort(getattr(order, name)) for order in (found, opened))
        # freud's float32.
        np.testing.assert_allclose(one, other, atol=1e-4)


FCC = np.array([[0, 1, 1], [1, 0, 1], [1, 1, 0]]) / math.sqrt(2)
HCP = np.array([[1, 0, 0], [-0.5, math.sqrt(3) / 2, 0], [0, 0, math.sqrt(8 / 3)]])
STRANGE = np.array([[1, 0, 0], [3, 1, 0], [-2, 4, 1]])


@pytest.mark.parametrize(
    ("change", "rotation"),
    [(np.eye(3), np.eye(3)), (np.eye(3), TURN), (STRANGE, np.eye(3))],
    ids=["primitive", "turned", "oblique"],
)
def test_crystals_in_their_primitive_cells(change: FloatArray, rotation: FloatArray) -> None:
    # One sphere and twelve own images, or two; another cell of the lattice has other edges.
    edges = change @ FCC @ rotation
    one = Spheres([[0.2, 0.3, 0.4]], [0.5], cell=Cell(np.zeros(3), edges, [True] * 3))
    fcc = bond_order(one, w6=True)
    # The tables' four digits; freud's float32.
    assert fcc.q4[0] == pytest.approx(0.19094, abs=1e-4)
    assert fcc.q6[0] == pytest.approx(0.57452, abs=1e-4)
    assert fcc.w6[0] == pytest.approx(-0.01316, abs=1e-4)
    assert fcc.crystalline_bonds[0] == 12
    assert fcc.shares["fcc"] == 1
    exact = exact_packing_fraction(one)
    assert exact.value == pytest.approx(math.pi / math.sqrt(18), rel=1e-13)
    touching = contacts_by_distance(one, 1e-9)
    assert len(touching.gaps) == 6
    counts = contact_counts(touching.sides, [0], images=True)
    assert counts.particles[0] == 12
    assert counts.neighbours[0] == 0

    edges = change @ HCP @ rotation
    layer = np.array([0.5, 0.5 / math.sqrt(3), math.sqrt(2 / 3)]) @ rotation
    two = Spheres([np.zeros(3), layer], [0.5, 0.5], cell=Cell(np.ones(3), edges, [True] * 3))
    hcp = bond_order(two)
    np.testing.assert_allclose(hcp.q4, 0.09722, atol=1e-4)
    np.testing.assert_allclose(hcp.q6, 0.48476, atol=1e-4)
    touching = contacts_by_distance(two, 1e-9)
    counts = contact_counts(touching.sides, [0, 1], images=True)
    assert counts.particles.tolist() == [12, 12]
    # Three own images on either side, and six images of the other.
    assert counts.neighbours.tolist() == [1, 1]


@pytest.mark.parametrize("name", ["across", "inside", "large", None])
@pytest.mark.parametrize("cell", CELLS)
def test_orientation_of_dimers(cell: str, name: str | None) -> None:
    packing = in_space(cell, "dimers")
    bodies = [m for m in packing.members if len(m) == 2]
    if name is not None:
        box = boxes(packing)[name]
        middle, half = box.mean(axis=1), np.linalg.norm(np.diff(box)) / 2
        away = packing.shifts(np.linalg.norm(packing.positions - middle, axis=1).max() + half)

        def inside(members: Any) -> bool:
            places = packing.positions[members].mean(axis=0) + away
            return bool(((places >= box[:, 0]) & (places <= box[:, 1])).all(axis=1).any())

        bodies = [m for m in bodies if inside(m)]
    if not bodies:
        return
    found = dimer_orientation(packing.spheres(), None if name is None else box)
    arms = np.array([np.diff(packing.positions[m], axis=0)[0] for m in bodies])
    assert found.dimers == len(bodies)
    # A few operations.
    np.testing.assert_allclose(found.components, np.sqrt((arms**2).mean(axis=0)), rtol=1e-12)


def assert_same_bed(packing: Packing, box: ArrayLike, walls: Any = None) -> None:
    """Compare a bed with that of the open packing of all images, and of a long way around."""
    ends = np.asarray(box, dtype=float)
    found = box_in_bed(packing.spheres(), ends, walls)
    reach = ends + np.array([-4, 4])
    for axis in range(3):
        if not (packing.edges[:, axis] != 0).any():
            # Along this axis all spheres count.
            reach[axis] = packing.cell.bounds[axis] + np.array([-2, 2])
    opened = box_in_bed(packing.opened(reach).spheres(None), ends, walls)
    assert (found.inside is None) == (opened.inside is None)
    if opened.inside is not None:
        # Positions that are moved by periods differ by round-off.
        np.testing.assert_allclose(found.inside, opened.inside, atol=1e-12)
    for axis in range(2 if packing.flat else 3):
        if not (packing.edges[:, axis] != 0).any():
            np.testing.assert_allclose(found.bed[axis], opened.bed[axis], atol=1e-12)
    assert (found.ends == "a gap in the box") or "inf" not in found.ends


@pytest.mark.parametrize("cell", ["ppp", "pff", "ppf", "fpp", "turned", "tilted pfp", "tilted fpf"])
def test_bed(cell: str) -> None:
    packing = dense(cell)
    middle = packing.vectors.sum(axis=0) / 2
    open_axes = np.array([not (packing.edges[:, axis] != 0).any() for axis in range(3)])
    for sides in (np.full(3, 0.8), np.array([2.0, 3.0, 1.2]), np.where(open_axes, 0.9, 5.0)):
        box = np.column_stack([middle - sides / 2, middle + sides / 2])
        assert_same_bed(packing, box)
        assert_same_bed(packing, box + 0.37 * packing.edges[0][:, None])
    # Out of the bed, where that has an end, and half out of it.
    for axis in np.flatnonzero(open_axes):
        for height in (packing.cell.bounds[axis, 1], 20.0):
            box = np.column_stack([middle - 0.4, middle + 0.4])
            box[axis] = height + np.array([-0.5, 0.5])
            assert_same_bed(packing, box)
            walls = np.where(open_axes[:, None], packing.cell.bounds, [-np.inf, np.inf])
            assert_same_bed(packing, box, walls)


def test_bed_between_oblique_walls_has_an_end() -> None:
    packing = dense("tilted fpf")
    middle = packing.vectors.sum(axis=0) / 2
    inside = np.column_stack([middle - 0.4, middle + 0.4])
    assert box_in_bed(packing.spheres(), inside).is_inside
    # Farther along x than the oblique walls are apart.
    wide = inside + np.array([[-9, 9], [0, 0], [0, 0]])
    found = box_in_bed(packing.spheres(), wide)
    assert not found.is_inside
    assert np.diff(found.inside[0])[0] < 5


@pytest.mark.parametrize("height", [0.02, 1.0, 30.0])
@pytest.mark.parametrize("cell", PLANES)
def test_bed_of_discs(cell: str, height: float) -> None:
    packing = dense(cell, flat=True)
    middle = packing.vectors.sum(axis=0) / 2
    open_axes = np.array([not (packing.edges[:, axis] != 0).any() for axis in range(3)])
    sides = np.where(open_axes, 0.9, 4.0)
    # How high a box of discs is, or where, does not matter.
    sides[2] = height
    for up in (0.0, 7.0):
        box = np.column_stack([middle - sides / 2, middle + sides / 2])
        box[2] += up
        assert box_in_bed(packing.spheres(), box).is_inside
    if open_axes[1]:
        box[1] += 3
        assert not box_in_bed(packing.spheres(), box).is_inside


def test_a_gap_in_a_bed_without_an_end() -> None:
    cell = Cell.of_box([[0, 20]] * 3, [True] * 3)
    lone = Spheres([[1, 1, 1]], [0.5], cell=cell)
    found = box_in_bed(lone, [[9, 10]] * 3)
    assert not found.is_inside
    assert found.ends == "a gap in the box"
    assert box_in_bed(lone, [[20.5, 21.5]] * 3).is_inside


# What may not change a number.


def numbers(packing: Packing, seed: int) -> dict[str, Any]:
    """Return intensive numbers of a packing in a cell that is periodic on all sides."""
    spheres = packing.spheres(seed)
    contacts = contacts_by_distance(spheres, 0.3)
    ids = np.arange(len(spheres))
    counts = contact_counts(contacts.ids(ids), ids, spheres.particles, images=True)
    exact = exact_packing_fraction(spheres)
    order = radial_distribution(spheres, largest=2.73, bins=9)
    return {
        "packing fraction": exact.value,
        "overlap": exact.overlap,
        "coordination": counts.particles.mean(),
        "gaps": (contacts.gaps**2).sum() / len(spheres),
        "depth": largest_pair_overlap(spheres).depth,
        "g": order.values,
        "density": order.density,
        "dimers": np.linalg.norm(dimer_orientation(spheres).components),
        **(
            {}
            if packing.flat
            else {"q6": bond_order(spheres).q6.mean(), "q4": bond_order(spheres).q4.mean()}
        ),
    }


def translated(packing: Packing) -> Packing:
    return replace(packing, positions=packing.positions + np.array([0.7, -2.2, 0]))


def of_another_cell(packing: Packing) -> Packing:
    vectors = packing.vectors.copy()
    vectors[0] += 2 * vectors[1]
    if not packing.flat:
        vectors[2] -= vectors[0] + 3 * vectors[1]
    # The corner of a cell is anywhere, too.
    return replace(packing, vectors=vectors, origin=packing.origin + np.array([1.3, 0.4, 0]))


def twice(packing: Packing, edge: int) -> Packing:
    vectors = packing.vectors.copy()
    vectors[edge] *= 2
    return replace(
        packing,
        positions=np.concatenate([packing.positions, packing.positions + packing.vectors[edge]]),
        radii=np.tile(packing.radii, 2),
        bodies=np.concatenate([packing.bodies, np.where(packing.bodies, packing.bodies + 500, 0)]),
        vectors=vectors,
    )


def in_another_order(packing: Packing) -> Packing:
    order = np.random.default_rng(4).permutation(len(packing.radii))
    return replace(
        packing,
        positions=packing.positions[order],
        radii=packing.radii[order],
        bodies=packing.bodies[order],
    )


def mirrored(packing: Packing) -> Packing:
    # The edges are left-handed then, which dumps cannot have, but a user may.
    flip = np.diag([-1.0, 1, 1])
    return replace(
        packing,
        positions=packing.positions @ flip,
        vectors=packing.vectors @ flip,
        origin=packing.origin @ flip,
    )


def rotated(packing: Packing) -> Packing:
    turn = TURN
    if packing.flat:
        turn = np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]])
    return replace(
        packing,
        positions=packing.positions @ turn,
        vectors=packing.vectors @ turn,
        origin=packing.origin @ turn,
    )


CHANGES: dict[str, Callable[[Packing], Packing]] = {
    "translated": translated,
    "another cell": of_another_cell,
    "twice along a": lambda packing: twice(packing, 0),
    "twice along b": lambda packing: twice(packing, 1),
    "another order": in_another_order,
    "mirrored": mirrored,
    "rotated": rotated,
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize(
    ("make", "cell"),
    [
        *((in_space, cell) for cell in ("ppp", "narrow", "tilted", "oblique")),
        *((in_plane, cell) for cell in ("pp", "narrow", "tilted", "oblique")),
    ],
)
def test_numbers_of_another_description(
    make: Callable[[str, str, float], Packing], cell: str, change: Callable[[Packing], Packing]
) -> None:
    packing = make(cell, "dimers", 0.1)
    one, other = numbers(packing, 0), numbers(change(packing), 1)
    # freud's float32 may move single pairs of thousands across the edge of a shell.
    loose = {"q6": 1e-4, "q4": 1e-4, "g": 2e-2}
    for name, value in one.items():
        np.testing.assert_allclose(other[name], value, atol=loose.get(name, 1e-11), err_msg=name)
