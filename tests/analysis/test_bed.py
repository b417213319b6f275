"""Where a bed ends, on lattices whose surface is known, and which part of a box lies inside."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lammps_inelastic.analysis import BoxInBed, InputError, Spheres, box_in_bed

# Spheres of this diameter fill a container one wide, five high.
DIAMETER = 0.1
WALLS = [[0, 1], [0, 5], [0, 1]]
MIDDLE = [[0.25, 0.75]] * 3


def lattice(layers: int) -> NDArray[np.float64]:
    """Return the centres of so many layers of 10 x 10 spheres, the first one on the floor."""
    steps = (np.arange(10), np.arange(layers), np.arange(10))
    places = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray((places + 0.5) * DIAMETER, dtype=np.float64)


def found(centres: NDArray[np.float64], box: Any, walls: Any = WALLS) -> BoxInBed:
    return box_in_bed(Spheres(centres, np.full(len(centres), DIAMETER / 2)), box, walls)


def test_a_box_deep_inside() -> None:
    bed = found(lattice(10), MIDDLE)
    assert bed.is_inside
    assert bed.share == 1
    # No sphere fits between the outermost ones and the walls; above are the outermost centres.
    # Differences of coordinates near 1, in float64.
    assert bed.bed == pytest.approx(np.array([[0, 1], [0, 0.95], [0, 1]]), abs=1e-15)


def test_a_box_that_reaches_out() -> None:
    bed = found(lattice(5), MIDDLE)
    assert not bed.is_inside
    assert bed.ends == "y = 0.45"
    # The place is rounded inwards by less than a tenth of a diameter.
    assert bed.inside is not None
    assert 0.44 < bed.inside[1, 1] <= bed.bed[1, 1] == pytest.approx(0.45, abs=1e-15)
    assert bed.inside[[0, 2]].tolist() == [[0.25, 0.75]] * 2
    # From 0.25 to somewhere in these places, of 0.25 to 0.75.
    assert 0.19 / 0.5 < bed.share <= 0.2 / 0.5 + 1e-12


def test_the_part_inside_is_inside() -> None:
    centres = lattice(5)
    part = found(centres, MIDDLE).inside
    assert part is not None
    assert found(centres, part).is_inside


def test_no_direction_is_up() -> None:
    for axis in (0, 2):
        order = [1, 0, 2] if axis == 0 else [0, 2, 1]
        bed = found(lattice(5)[:, order], MIDDLE, np.array(WALLS)[order])
        assert bed.ends == f"{'xyz'[axis]} = 0.45"


def test_a_sphere_that_flies_above_does_not_raise_the_bed() -> None:
    bed = found(np.vstack([lattice(5), [[0.5, 0.9, 0.5]]]), MIDDLE)
    assert bed.ends == "y = 0.45"


def test_a_slope_ends_where_it_is_lowest() -> None:
    centres = lattice(10)
    # From one layer at x = 0 to ten at x = 1: five, up to 0.35, where the box begins.
    slope = centres[centres[:, 1] <= centres[:, 0] + 0.15]
    bed = found(slope, MIDDLE)
    assert bed.inside is not None
    assert 0.25 < bed.inside[1, 1] < 0.6
    assert bed.inside[[0, 2]].tolist() == [[0.25, 0.75]] * 2


def test_a_box_above_has_no_part_inside() -> None:
    bed = found(lattice(5), [[0.25, 0.75], [0.6, 0.8], [0.25, 0.75]])
    assert (bed.inside, bed.share, bed.ends) == (None, 0, "y = 0.45")


def test_up_to_the_walls_and_not_beyond() -> None:
    assert found(lattice(10), [[0, 1], [0, 0.9], [0, 1]]).is_inside
    beyond = found(lattice(10), [[-0.1, 1], [0, 0.9], [0, 1]])
    assert beyond.ends == "x = 0"
    # Without walls nothing is known beyond the outermost centres.
    assert found(lattice(10), [[0, 1], [0, 0.9], [0, 1]], None).ends == (
        "x = 0.05, x = 0.95, y = 0.05, z = 0.05, z = 0.95"
    )


@pytest.mark.parametrize("high", [0.251, 1e9])
def test_boxes_of_any_size(high: float) -> None:
    """A box narrower than a column is in the bed, one of astronomic size is cut to it."""
    bed = found(lattice(10), [[0.25, high]] * 3)
    assert bed.is_inside == (high < 1)
    assert bed.inside is not None


def test_wrong_walls() -> None:
    with pytest.raises(InputError, match=r"walls must have shape \(3, 2\)"):
        found(lattice(1), MIDDLE, [0, 1])
    with pytest.raises(InputError, match="walls: xlo = 0 must be less than xhi = nan"):
        found(lattice(1), MIDDLE, [[0, np.nan]] * 3)
