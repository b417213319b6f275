"""Exact volumes: against numerical integration, another library and the paper's Appendix A."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise, permutations, product
from typing import Any

import numpy as np
import overlap
import pytest
from numpy.typing import ArrayLike

from lammps_inelastic.analysis import (
    InputError,
    Particles,
    Spheres,
    group_spheres,
    particle_volumes_in_box,
    sphere_volumes_in_box,
)
from lammps_inelastic.analysis.geometry import FloatArray
from tests.helpers.integration import ball_in_box, dimer_in_box, integrate

UNIT = [[0, 1]] * 3
BALL = 4 / 3 * np.pi

# One ball of radius 0.25 in the unit box: how it is cut, and its centre.
CUTS = {
    "inside": [0.5, 0.4, 0.6],
    "touching three faces": [0.25, 0.25, 0.75],
    "one face": [0.5, 0.1, 0.5],
    "one face, centre outside": [0.5, 0.5, 1.1],
    "one face, centre on it": [0.0, 0.5, 0.5],
    "two faces": [0.2, 0.5, 0.8],
    "two faces and the edge": [0.1, 0.5, 0.95],
    "two faces and the edge, centre outside": [-0.1, 0.5, 1.1],
    "two faces and the edge, centre on it": [0.0, 0.5, 1.0],
    "three faces": [0.2, 0.2, 0.2],
    "three faces, one edge": [0.1, 0.15, 0.21],
    "three faces, two edges": [0.05, 0.2, 0.2],
    "three faces, three edges": [0.16, 0.16, 0.16],
    "three faces, three edges, the corner": [0.1, 0.12, 0.05],
    "the corner, centre outside": [-0.1, -0.12, -0.05],
    "the corner, centre outside two faces": [-0.1, 0.12, -0.05],
    "the corner, centre on an edge": [0.0, 0.0, 0.1],
    "centre on the corner": [1.0, 0.0, 1.0],
    "outside of an edge, which it does not reach": [-0.2, -0.2, 0.5],
    "touching from outside": [0.5, -0.25, 0.5],
}

# Other boxes, for a ball of radius 1 at the origin.
BOXES = {
    "opposite faces": [[-0.3, 0.7], [-2, 2], [-2, 2]],
    "opposite faces, centre outside": [[0.3, 0.7], [-2, 2], [-2, 2]],
    "thin slab": [[0.3, 0.301], [-2, 2], [-2, 2]],
    "thin slab with corners": [[0.3, 0.301], [-0.1, 0.8], [-0.5, 0.6]],
    "thin slab at the centre": [[0, 0.001], [-0.1, 0.8], [0, 2]],
    "bar": [[-0.2, 0.3], [-0.4, 0.1], [-2, 2]],
    "all faces, no corner": [[-0.9, 0.8]] * 3,
    "all faces and edges, no corner": [[-0.6, 0.65]] * 3,
    "all faces and some corners": [[-0.6, 0.65], [-0.5, 0.7], [-0.55, 0.4]],
    "box in the ball": [[-0.5, 0.1], [0.2, 0.3], [-0.4, 0.6]],
    "box in the ball up to a corner": [[-0.6, 0.1], [-0.1, 0.0], [-0.1, 0.8]],
    "large box far away": [[0.9, 1e6], [-1e6, 0.1], [-1e6, 1e6]],
}


def in_box(centre: ArrayLike, radius: float, box: ArrayLike) -> float:
    with np.errstate(all="raise"):
        return sphere_volumes_in_box(Spheres([centre], [radius]), box)[0]


@pytest.mark.parametrize("name", CUTS)
def test_ball_in_unit_box(name: str) -> None:
    centre = CUTS[name]
    # Both sides round at 1e-16 of terms of the size of the ball, 0.07.
    assert in_box(centre, 0.25, UNIT) == pytest.approx(ball_in_box(centre, 0.25, UNIT), abs=1e-12)


@pytest.mark.parametrize("name", BOXES)
def test_unit_ball_in_boxes(name: str) -> None:
    # As above, for a ball of 4.
    expected = ball_in_box([0, 0, 0], 1, BOXES[name])
    assert in_box([0, 0, 0], 1, BOXES[name]) == pytest.approx(expected, abs=1e-11)


def hexahedron(box: Any) -> overlap.Hexahedron:
    (x0, x1), (y0, y1), (z0, z1) = box
    base = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    return overlap.Hexahedron([[x, y, z] for z in (z0, z1) for x, y in base])


@pytest.mark.parametrize("seed", range(4))
def test_other_library(seed: int) -> None:
    # S. Strobl, A. Formella, T. Poeschel, J. Comput. Phys. 311 (2016) 158.
    generator = np.random.default_rng(seed)
    for _ in range(200):
        centre, radius = generator.uniform(-1, 1, 3), generator.uniform(0.2, 1.5)
        box = np.sort(generator.uniform(-1, 1, (3, 2)), axis=1)
        expected = overlap.overlap_volume(overlap.Sphere(centre, radius), hexahedron(box))
        # Rounding, on both sides, of terms of the size of the ball, up to 14.
        assert in_box(centre, radius, box) == pytest.approx(expected, abs=1e-13)


def test_nothing_and_everything_are_exact() -> None:
    assert in_box([0.5, 0.5, 0.5], 0.5, UNIT) == 4 / 3 * np.pi * 0.5**3
    assert in_box([0.5, 0.5, 0.5], 0.9, UNIT) == 1
    assert in_box([1.2, 1.2, 0.5], 0.25, UNIT) == 0
    assert in_box([0.5, 0.5, 3], 2, UNIT) == 0


# Appendix A of the paper. The scan has (-pi + 2 theta_0) in V_edge, where the arc of the circle on
# which the bound of the disc is r_m spans (pi + 2 theta_0): the printed sign gives 0.929 instead of
# 0.873 for R = 1, a = b = 0.3. V_cap and V_corner are right as they stand. In the paper's figures
# V_edge is what the first face cuts off on the inner side of the second one, and V_corner what
# lies on the inner side of two others: {x > a, y < b} and {x > a, y < b, z < c} in the ball.


def disc_integral(r: Any, radius: float) -> Any:
    return -((radius**2 - r**2) ** 1.5) / 3


def over_angles(function: Callable[[FloatArray], ArrayLike], lower: float, upper: float) -> float:
    # Near the ends the integrand bends as sharply as a is small: short pieces.
    return integrate(function, lower, upper, np.linspace(lower, upper, 12))


def cap(a: float, radius: float) -> float:
    return np.pi * (2 / 3 * radius**3 - a * radius**2 + a**3 / 3)


def edge(a: float, b: float, radius: float) -> float:
    rm = np.sqrt(radius**2 - a**2)
    theta = np.arcsin(b / rm)

    def of_angle(angle: FloatArray) -> FloatArray:
        return disc_integral(b / np.sin(angle), radius)

    return (
        (np.pi + 2 * theta) * disc_integral(rm, radius)
        + over_angles(of_angle, theta, np.pi - theta)
        + 2 * np.pi * radius**3 / 3
        - a * (b * np.sqrt(rm**2 - b**2) + rm**2 * (np.arcsin(b / rm) + np.pi / 2))
    )


def corner(a: float, b: float, c: float, radius: float) -> float:
    rm = np.sqrt(radius**2 - a**2)
    theta0, theta1, theta2 = np.arcsin(b / rm), np.arccos(c / rm), np.arctan(b / c)
    yc = np.sqrt(rm**2 - c**2)
    area = (
        b * np.sqrt(rm**2 - b**2)
        + rm**2 * np.arcsin(b / rm)
        - yc * np.sqrt(rm**2 - yc**2)
        + rm**2 * np.arcsin(-yc / rm)
    ) / 2
    area += np.pi / 2 * rm**2 + c * (b + yc)
    return (
        (np.pi + theta0 - theta1) * disc_integral(rm, radius)
        + over_angles(lambda t: disc_integral(c / np.cos(t), radius), -theta1, theta2)
        + over_angles(lambda t: disc_integral(b / np.sin(t), radius), theta2, np.pi - theta0)
        + 2 * np.pi * radius**3 / 3
        - a * area
    )


@pytest.mark.parametrize("a", [0.05, 0.3, 0.55])
def test_appendix_a(a: float) -> None:
    b, c, far = 0.3, 0.4, 5
    boxes = [
        (cap(a, 1), [[a, far], [-far, far], [-far, far]]),
        (edge(a, b, 1), [[a, far], [-far, b], [-far, far]]),
        (corner(a, b, c, 1), [[a, far], [-far, b], [-far, c]]),
    ]
    for expected, box in boxes:
        # Rounding of terms of 4, and of the rule's 24 points in each piece.
        assert in_box([0, 0, 0], 1, box) == pytest.approx(expected, abs=1e-12)
        assert ball_in_box([0, 0, 0], 1, box) == pytest.approx(expected, abs=1e-12)


def test_all_axes_and_sides_are_alike() -> None:
    box = np.array([[0.1, 0.7], [0.2, 0.9], [0.05, 0.4]])
    centre = np.array([0.2, 0.3, 0.15])
    expected = in_box(centre, 0.3, box)
    for order in permutations(range(3)):
        # Rounding of sums in another order, of terms of 0.1.
        moved = in_box(centre[list(order)], 0.3, box[list(order)])
        assert moved == pytest.approx(expected, abs=1e-15)
    for signs in product([-1, 1], repeat=3):
        mirrored = np.sort(box * np.array(signs)[:, None], axis=1)
        assert in_box(centre * signs, 0.3, mirrored) == pytest.approx(expected, abs=1e-15)


def boxes_of(box: Any, cuts: Any) -> list[FloatArray]:
    """Return the boxes into which planes across each axis part a box."""
    edges = [np.r_[low, cut, high] for (low, high), cut in zip(box, cuts, strict=True)]
    return [np.array(b) for b in product(*(pairwise(e) for e in edges))]


def random_dimers(
    count: int, radii: Any, distance: float, seed: int, spread: float = 1.2
) -> tuple[FloatArray, FloatArray, Particles]:
    generator = np.random.default_rng(seed)
    centres = generator.uniform(0.5 - spread / 2, 0.5 + spread / 2, (count, 3))
    arms = generator.normal(size=(count, 3))
    arms *= distance / 2 / np.linalg.norm(arms, axis=1)[:, None]
    numbers = np.arange(1, count + 1)
    return (
        np.vstack([centres - arms, centres + arms]),
        np.repeat(radii, count),
        group_spheres(np.r_[numbers, numbers]),
    )


def test_parts_of_a_box_add_up() -> None:
    positions, radii, dimers = random_dimers(300, [0.2, 0.15], 0.25, seed=1)
    parts = boxes_of(UNIT, [[0.3, 0.31], [0.5], [0.2, 0.7]])
    # Each of the 18 parts rounds at 1e-17.
    total = sum(sphere_volumes_in_box(Spheres(positions, radii), part) for part in parts)
    assert total == pytest.approx(sphere_volumes_in_box(Spheres(positions, radii), UNIT), abs=1e-15)
    total = sum(particle_volumes_in_box(Spheres(positions, radii, dimers), part) for part in parts)
    whole = particle_volumes_in_box(Spheres(positions, radii, dimers), UNIT)
    assert total == pytest.approx(whole, abs=1e-15)


# Two centres, two radii, a box: dimers that are cut in every way, also exactly along their plane.
DIMERS = {
    "not cut": ([[0.4, 0.5, 0.5], [0.6, 0.55, 0.4]], [0.2, 0.2], UNIT),
    "one face": ([[0.1, 0.5, 0.5], [0.2, 0.6, 0.6]], [0.2, 0.2], UNIT),
    "edge": ([[0.1, 0.1, 0.5], [0.2, 0.05, 0.6]], [0.2, 0.2], UNIT),
    "corner": ([[0.1, 0.1, 0.1], [0.2, 0.05, 0.2]], [0.2, 0.2], UNIT),
    "corner, one centre outside": ([[0.1, 0.1, -0.1], [0.2, -0.05, 0.2]], [0.3, 0.3], UNIT),
    "unequal": ([[0.1, 0.1, 0.1], [0.3, 0.05, 0.2]], [0.1, 0.25], UNIT),
    "smaller mostly covered": ([[0.1, 0.1, 0.1], [0.2, 0.15, 0.1]], [0.14, 0.25], UNIT),
    "smaller covered": ([[0.1, 0.1, 0.1], [0.2, 0.15, 0.1]], [0.1, 0.25], UNIT),
    "not touching": ([[0.1, 0.1, 0.1], [0.1, 0.9, 0.1]], [0.2, 0.3], UNIT),
    "all faces": ([[0.45, 0.5, 0.5], [0.6, 0.55, 0.4]], [0.6, 0.5], UNIT),
    "thin slab": ([[0.1, 0.5, 0.5], [0.2, 0.6, 0.6]], [0.2, 0.2], [[0.14, 0.15], [0, 1], [0, 1]]),
    "thin bar": ([[0.1, 0.5, 0.5], [0.2, 0.6, 0.6]], [0.2, 0.2], [[0, 1], [0.5, 0.51], [0.5, 0.6]]),
    "along an axis": ([[0.0, 0.1, 0.5], [0.2, 0.1, 0.5]], [0.15, 0.15], UNIT),
    "along an axis, plane on a face": ([[-0.1, 0.1, 0.5], [0.1, 0.1, 0.5]], [0.2, 0.2], UNIT),
    "along a diagonal, plane through an edge": (
        [[-0.1, -0.1, 0.5], [0.1, 0.1, 0.5]],
        [0.2, 0.2],
        UNIT,
    ),
    "along a diagonal, plane through a corner": (
        [[0.9, 0.1, 0.9], [1.1, -0.1, 1.1]],
        [0.3, 0.3],
        UNIT,
    ),
}


def dimer(centres: ArrayLike, radii: ArrayLike, box: ArrayLike) -> float:
    with np.errstate(all="raise"):
        return particle_volumes_in_box(Spheres(centres, radii, group_spheres([3, 3])), box)[0]


@pytest.mark.parametrize("name", DIMERS)
def test_dimers(name: str) -> None:
    # The integrand is smooth between the breaks: what is left is rounding and the rule's error.
    assert dimer(*DIMERS[name]) == pytest.approx(dimer_in_box(*DIMERS[name]), abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_random_dimers(seed: int) -> None:
    generator = np.random.default_rng(seed)
    centres = generator.uniform(-0.2, 0.8, (2, 3))
    radii = generator.uniform(0.3, 0.6, 2)
    # As above.
    expected = dimer_in_box(centres, radii, UNIT)
    assert dimer(centres, radii, UNIT) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("shift", [0, 1e-16, 3e-15])
def test_rounding_decides_which_corner_is_behind_the_plane(shift: float) -> None:
    # The plane on which the spheres meet all but holds faces, edges and corners of the box.
    for axis in ([1, 0, 0], [1, 1, 0], [1, 1, 1], [1, -1, 0], [1, 1, -2]):
        arm = 0.1 * np.array(axis) / np.linalg.norm(axis) + [0, shift, 2 * shift]
        for place in ([0, 0.5, 0.5], [0, 0, 0.5], [0, 0, 0], [1, 0, 1], [0.5, 0.5, 0.5]):
            centres = np.array([place - arm, place + arm])
            # The shift moves the volume by no more than itself times the surface, about 1; the
            # rest as above.
            expected = dimer_in_box(np.round(centres, 10), [0.3, 0.3], UNIT)
            assert dimer(centres, [0.3, 0.3], UNIT) == pytest.approx(expected, abs=1e-9)


def test_dimers_in_a_large_box() -> None:
    radius, distance = 0.2, 0.3
    positions, radii, particles = random_dimers(50, [radius, radius], distance, seed=2)
    volumes = particle_volumes_in_box(Spheres(positions, radii, particles), [[-5, 5]] * 3)
    lens = np.pi / 12 * (4 * radius + distance) * (2 * radius - distance) ** 2
    # A few operations.
    assert volumes == pytest.approx(np.full(50, 2 * BALL * radius**3 - lens), rel=1e-13)


def test_the_same_sphere_twice_counts_once() -> None:
    centre = [0.1, 0.1, 0.1]
    assert dimer([centre, centre], [0.2, 0.2], UNIT) == in_box(centre, 0.2, UNIT)
    assert dimer([centre, centre], [0.1, 0.2], UNIT) == in_box(centre, 0.2, UNIT)


def test_free_spheres_and_dimers_in_any_order() -> None:
    positions, radii, _ = random_dimers(40, [0.2, 0.15], 0.2, seed=3)
    bodies = np.r_[np.arange(40), np.arange(40)]
    bodies[[5, 45, 7, 47]] = [0, 0, 100, 101]  # bodies of one sphere, too
    expected = np.zeros(102)
    for body in set(bodies) - {0}:
        members = np.flatnonzero(bodies == body)
        if len(members) == 2:
            expected[body] = dimer(positions[members], radii[members], UNIT)
        else:
            expected[body] = in_box(positions[members[0]], radii[members[0]], UNIT)
    free = sphere_volumes_in_box(Spheres(positions[bodies == 0], radii[bodies == 0]), UNIT)
    order = np.random.default_rng(4).permutation(80)
    particles = group_spheres(bodies[order])
    found = particle_volumes_in_box(Spheres(positions[order], radii[order], particles), UNIT)
    is_body = particles.bodies > 0
    # The order of the two spheres of a dimer changes the rounding of terms of 0.03.
    assert found[is_body] == pytest.approx(expected[particles.bodies[is_body]], abs=1e-15)
    assert np.sort(found[~is_body]) == pytest.approx(np.sort(free), abs=1e-15)


def test_larger_bodies_are_refused() -> None:
    message = "the number of spheres in body 4 is 3; packing_fraction measures any body"
    with pytest.raises(InputError, match=message):
        particle_volumes_in_box(Spheres(np.eye(3), [1] * 3, group_spheres([4, 4, 4])), UNIT)


def test_wrong_input() -> None:
    with pytest.raises(InputError, match="radii must be positive"):
        sphere_volumes_in_box(Spheres([[0, 0, 0]], [0]), UNIT)
    with pytest.raises(InputError, match="ylo = 2 must be less than yhi = 2"):
        sphere_volumes_in_box(Spheres([[0, 0, 0]], [1]), [[0, 1], [2, 2], [0, 1]])
    with pytest.raises(InputError, match="1 positions, but 2 spheres in particles"):
        particle_volumes_in_box(Spheres([[0, 0, 0]], [1], group_spheres([1, 1])), UNIT)


def test_many_spheres_are_fast() -> None:
    positions = np.random.default_rng(5).uniform(0, 1, (100_000, 3))
    begin = time.process_time()
    sphere_volumes_in_box(Spheres(positions, np.full(len(positions), 0.3)), [[0.25, 0.75]] * 3)
    # All are cut: half a second on one old core; a loop over the spheres takes a minute.
    assert time.process_time() - begin < 5
