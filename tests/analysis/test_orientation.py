"""Orientation of dimers: by hand, and against what isotropic directions give on average."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike

from lammps_inelastic.analysis import (
    InputError,
    Particles,
    Spheres,
    dimer_orientation,
    group_spheres,
)
from lammps_inelastic.analysis.geometry import FloatArray

UNIT = [[0, 1]] * 3
DISTANCE = 0.055


def dimers_along(directions: FloatArray, centres: ArrayLike) -> tuple[FloatArray, Particles]:
    """Return positions and particles of dimers, all first spheres before all second ones."""
    arms = DISTANCE / 2 * directions / np.linalg.norm(directions, axis=1)[:, None]
    numbers = np.arange(1, len(arms) + 1)
    return np.vstack([centres - arms, centres + arms]), group_spheres(np.r_[numbers, numbers])


def dimers_of(positions: ArrayLike, particles: Particles) -> Spheres:
    """The spheres of dimers, whose size is of no importance here."""
    return Spheres(positions, np.full(len(np.asarray(positions)), 0.04), particles)


def isotropic(count: int, seed: int) -> tuple[FloatArray, Particles]:
    generator = np.random.default_rng(seed)
    return dimers_along(generator.normal(size=(count, 3)), generator.uniform(0, 1, (count, 3)))


def test_two_dimers() -> None:
    positions = [[0, 0.5, 0.5], [0.4, 0.5, 0.5], [0.5, 0.5, 0.1], [0.5, 0.8, 0.5]]
    found = dimer_orientation(dimers_of(positions, group_spheres([4, 4, 2, 2])), UNIT)
    # The squares are 0.16 and 0, 0 and 0.09, 0 and 0.16. Rounding of a few operations.
    assert found.components == pytest.approx(np.sqrt([0.08, 0.045, 0.08]), rel=1e-14)
    # Two values d and 0: s = d / sqrt(2), s / sqrt(2) / (2 a), with a^2 = d / 2, is a / 2.
    assert found.standard_errors == pytest.approx(found.components / 2, rel=1e-14)
    assert found.dimers == 2
    assert found.isotropic == pytest.approx(np.sqrt((0.16 + 0.25) / 2 / 3), rel=1e-14)


def test_the_order_of_the_spheres_is_of_no_importance() -> None:
    positions, particles = isotropic(50, seed=1)
    order = np.random.default_rng(2).permutation(len(positions))
    shuffled = group_spheres(particles.bodies[particles.index][order])
    found = dimer_orientation(dimers_of(positions[order], shuffled), UNIT)
    expected = dimer_orientation(dimers_of(positions, particles), UNIT)
    # Sums of 50 squares in another order.
    assert found.components == pytest.approx(expected.components, rel=1e-14)
    assert found.standard_errors == pytest.approx(expected.standard_errors, rel=1e-12)


def test_isotropic_directions() -> None:
    positions, particles = isotropic(20_000, seed=3)
    found = dimer_orientation(dimers_of(positions, particles), UNIT)
    assert found.isotropic == pytest.approx(DISTANCE / np.sqrt(3), rel=1e-12)  # of a mean of 20,000
    # Four standard errors: the seed is fixed, one seed in 5,000 fails by chance.
    assert (abs(found.components - found.isotropic) < 4 * found.standard_errors).all()
    # A component u of a random direction has <u^2> = 1/3 and <u^4> = 1/5. The scatter of u^2
    # between 20,000 dimers is known to 0.5 %; ten of these.
    of_squares = DISTANCE**2 * np.sqrt((1 / 5 - 1 / 9) / found.dimers)
    assert found.standard_errors == pytest.approx(of_squares / (2 * found.isotropic), rel=0.05)


def test_standard_error_is_the_scatter_between_packings() -> None:
    runs = [dimer_orientation(dimers_of(*isotropic(100, seed)), UNIT) for seed in range(200)]
    scatter = np.std([run.components for run in runs], axis=0, ddof=1)
    mean_error = np.mean([run.standard_errors for run in runs], axis=0)
    # A standard deviation from 200 values is itself known to 5 %; three of these.
    assert scatter == pytest.approx(mean_error, rel=0.15)


def test_lying_dimers() -> None:
    positions, particles = dimers_along(
        np.array([[1, 0, 0], [0, 0, 1], [1, 0, 1]]), np.full((3, 3), 0.5)
    )
    found = dimer_orientation(dimers_of(positions, particles), UNIT)
    assert (found.components[1], found.standard_errors[1]) == (0, 0)
    assert found.components[[0, 2]] == pytest.approx([DISTANCE / np.sqrt(2)] * 2, rel=1e-14)


def test_only_dimers_with_their_centre_in_the_box() -> None:
    # The first has both spheres outside, the second is outside with one sphere inside.
    positions = [[0.5, -1, 0.5], [0.5, 2, 0.5], [0.9, 0.5, 0.5], [1.2, 0.5, 0.5]]
    found = dimer_orientation(dimers_of(positions, group_spheres([1, 1, 2, 2])), UNIT)
    assert found.components.tolist() == [0, 3, 0]
    assert (found.dimers, found.standard_errors) == (1, None)


def test_free_spheres_are_left_out() -> None:
    positions = [[0.5, 0.5, 0.5], [0.5, 0.5, 0.25], [0.1, 0.1, 0.1], [0.5, 0.5, 0.75]]
    found = dimer_orientation(dimers_of(positions, group_spheres([0, 5, 0, 5])), UNIT)
    assert found.components.tolist() == [0, 0, 0.5]


@pytest.mark.parametrize(
    ("bodies", "number"),
    [([1, 1, 2, 2, 2], "body 2 is 3"), ([8, 4, 4, 6, 6], "body 8 is 1")],
)
def test_not_two_spheres(bodies: list[int], number: int) -> None:
    # Also where that body is outside the box.
    with pytest.raises(InputError, match=f"the number of spheres in {number}, not 2"):
        dimer_orientation(dimers_of(np.eye(5, 3), group_spheres(bodies)), [[5, 6]] * 3)


@pytest.mark.parametrize("bodies", [[1, 1], [0, 0]])
def test_no_dimer_in_the_box(bodies: list[int]) -> None:
    with pytest.raises(InputError, match="no dimer's centre lies in the box"):
        dimer_orientation(dimers_of([[2, 2, 2], [3, 3, 3]], group_spheres(bodies)), UNIT)


def test_other_number_of_spheres() -> None:
    with pytest.raises(InputError, match="1 positions, but 2 spheres"):
        dimer_orientation(dimers_of([[0, 0, 0]], group_spheres([1, 1])), UNIT)
