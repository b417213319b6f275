"""Local order of crystals and of points at random, whose values are known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from lammps_inelastic.analysis import (
    InputError,
    Spheres,
    bond_order,
    plot_radial_distribution,
    radial_distribution,
)
from lammps_inelastic.analysis.geometry import FloatArray

# freud computes in float32: seven digits, of which sums of spherical harmonics lose two.
SINGLE = 1e-4


def around(centres: ArrayLike) -> Spheres:
    """Spheres of diameter 1 at some centres; their size is of no importance here."""
    return Spheres(centres, np.full(len(np.asarray(centres)), 0.5))


def lattice(cell: float, basis: ArrayLike, repeats: Sequence[int]) -> FloatArray:
    cells = np.indices(repeats).reshape(3, -1).T
    return (cells[:, None] + np.asarray(basis)).reshape(-1, 3) * cell


# Spheres of diameter 1 that touch.
FCC = lattice(
    np.full(3, np.sqrt(2)),
    [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]],
    (8, 8, 8),
)
# The hexagonal cell as one at right angles, four spheres in it.
HCP = lattice(
    np.array([1, np.sqrt(3), np.sqrt(8 / 3)]),
    [[0, 0, 0], [0.5, 0.5, 0], [0.5, 5 / 6, 0.5], [0, 1 / 3, 0.5]],
    (10, 6, 6),
)
# Four cells of the first on each axis, whose faces cut no sphere's centre: 256 centres.
MIDDLE = np.full((3, 2), [1.7, 5.7]) * np.sqrt(2)
INSIDE = np.array([[3, 7], [3, 7], [3, 7]])


@pytest.mark.parametrize(
    ("centres", "box", "name", "q4", "q6", "w6"),
    [
        (FCC, MIDDLE, "fcc", 0.19094, 0.57452, -0.01316),
        (HCP, INSIDE, "hcp", 0.09722, 0.48476, -0.01244),
    ],
    ids=["fcc", "hcp"],
)
def test_crystals(
    centres: FloatArray, box: Any, name: str, q4: float, q6: float, w6: float
) -> None:
    found = bond_order(around(centres), box, w6=True)
    # The values of Steinhardt, Nelson and Ronchetti (1983), to the digits given.
    assert found.q4 == pytest.approx(q4, abs=SINGLE)
    assert found.q6 == pytest.approx(q6, abs=SINGLE)
    assert found.w6 == pytest.approx(w6, abs=SINGLE)
    assert (found.crystalline_bonds == 12).all()
    assert found.crystallised
    assert found.shares[name] == 1
    assert sum(found.shares.values()) == 1


def test_a_shaken_crystal_is_still_one() -> None:
    shaken = FCC + np.random.default_rng(2).normal(0, 0.03, FCC.shape)
    assert bond_order(around(shaken), MIDDLE).crystallised


def test_points_at_random_are_no_crystal() -> None:
    points = np.random.default_rng(0).uniform(0, 1, (20_000, 3))
    found = bond_order(around(points), [[0.2, 0.8]] * 3)
    # Twelve independent directions: the mean of q6^2 is 1 / 12. 4,300 particles scatter by 0.2 each
    # around it, neighbours not independently: 1 %, three times the error of the mean.
    assert np.sqrt((found.q6**2).mean()) == pytest.approx(1 / np.sqrt(12), rel=0.01)
    assert found.crystalline_share < 0.001
    assert not found.crystallised
    assert found.shares["disordered"] > 0.999
    # It takes a third longer, and few ask for it.
    assert found.w6 is None


def test_radial_distribution_of_points_at_random_is_one() -> None:
    points = np.random.default_rng(5).uniform(0, [1, 5, 1], (50_000, 3))
    found = radial_distribution(
        around(points), [[0.3, 0.7], [1, 4], [0.3, 0.7]], largest=0.25, bins=10
    )
    # 4,800 particles in the box: the mean density is known to 1.4 %. The innermost shell has 1,600
    # pairs, which are known to 2.5 %, the others seven times as many and more. Three times both.
    assert found.values[0] == pytest.approx(1, abs=0.09)
    assert found.values[1:] == pytest.approx(1, abs=0.05)
    assert found.density == pytest.approx(10_000, rel=0.045)
    assert found.middles[0] == pytest.approx(0.0125, rel=1e-14)


def test_shells_of_a_crystal() -> None:
    found = radial_distribution(around(FCC), MIDDLE, largest=2.1, bins=210)
    assert found.particles == 256
    # Four spheres in a cube of width sqrt(2).
    assert found.density == pytest.approx(np.sqrt(2), rel=1e-12)
    volumes = 4 / 3 * np.pi * np.diff(found.edges**3)
    neighbours = found.values * found.density * volumes
    for distance, number in ((1, 12), (np.sqrt(2), 6), (np.sqrt(3), 24), (2, 12)):
        # A distance on the edge of two bins falls into either, in float32.
        near = np.abs(found.middles - distance) < 0.011
        assert neighbours[near].sum() == pytest.approx(number, rel=1e-12)
        neighbours[near] = 0
    assert (neighbours == 0).all()


def test_box_too_near_to_the_surface() -> None:
    with pytest.raises(
        InputError, match="along y the box must be 2 or more away from the outermost"
    ):
        radial_distribution(around(FCC), [[3, 7], [1.5, 7], [3, 7]], largest=2)


def test_plot() -> None:
    ax = Figure().add_subplot()
    found = radial_distribution(around(FCC), MIDDLE, largest=2, bins=20)
    assert plot_radial_distribution(ax, found, diameter=2.0) is ax
    assert ax.lines[0].get_xdata()[-1] == pytest.approx(1.95 / 2, rel=1e-14)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: bond_order(around(FCC[:12]), [[0, 1]] * 3),
            "more than 12 particles are needed, not 12",
        ),
        (lambda: bond_order(around(FCC), [[50, 51]] * 3), "no particle's centre lies in the box"),
        (
            lambda: radial_distribution(around(FCC), MIDDLE, largest=0),
            "the largest radius must be positive",
        ),
        (
            lambda: radial_distribution(around(FCC), MIDDLE, largest=1, bins=0),
            "number of shells must be at least 1",
        ),
    ],
)
def test_wrong_input(call: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()
