"""The model of an iteration on many ranks, where it can be done by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmark.ranks import BYTES, Network, cut


def test_a_bed_of_four_columns() -> None:
    """Spheres 0 and 1 are in one column, 2 and 3 in the next along x and along z."""
    positions = np.array([[0.2, 1, 0.2], [0.4, 1, 0.4], [0.6, 1, 0.4], [0.4, 1, 0.6]])
    first = np.array([0, 1, 1, 2, 0])
    second = np.array([1, 2, 3, -1, -1])
    columns = cut(positions, first, second, (2, 2))
    assert columns.ranks == 4
    assert columns.constraints == 4  # all but that of sphere 2 and a wall
    assert columns.mean == pytest.approx(5 / 4)
    assert columns.ghosts == 1  # sphere 1, in both directions
    network = Network("a network", 2.0, 6.0)
    # Four messages through faces, four along edges, and a reduction in two stages there and back.
    expected = 3 * 4 + 4 * (2 + BYTES / 6) + 4 * 2 + 2 * 2 * 2
    assert columns.iteration(3.0, network) == pytest.approx(expected)


def test_nothing_is_cut_in_a_direction_of_one_column() -> None:
    positions = np.array([[0.1, 1, 0.1], [0.9, 1, 0.1]])
    columns = cut(positions, np.array([0]), np.array([1]), (1, 2))
    assert columns.ghosts == 0
    # One direction is cut: two messages.
    assert columns.iteration(0.0, Network("a network", 1.0, 1.0)) == pytest.approx(2 + 2)
