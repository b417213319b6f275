"""The fabric tensor of contact normals."""

from __future__ import annotations

import numpy as np
import pytest

from lammps_inelastic.analysis import InputError, fabric_tensor

# Sums of a few products of numbers near 1: round-off only.
ROUND_OFF = 1e-14


def test_normals_along_the_axes() -> None:
    normals = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, -1]]
    assert fabric_tensor(normals) == pytest.approx(np.diag([0.5, 0.25, 0.25]), abs=ROUND_OFF)


def test_weights_count_as_so_many_contacts() -> None:
    normals = np.array([[0.6, 0.8, 0.0], [0.0, 0.6, -0.8]])
    weighted = fabric_tensor(normals, weights=[3.0, 1.0])
    assert weighted == pytest.approx(fabric_tensor(normals[[0, 0, 0, 1]]), abs=ROUND_OFF)
    assert weighted[0, 1] == pytest.approx(0.75 * 0.6 * 0.8, abs=ROUND_OFF)


def test_it_turns_with_the_packing() -> None:
    generator = np.random.default_rng(1)
    normals = generator.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    turn, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    tensor = fabric_tensor(normals)
    assert np.trace(tensor) == pytest.approx(1.0, abs=ROUND_OFF)
    assert fabric_tensor(normals @ turn.T) == pytest.approx(turn @ tensor @ turn.T, abs=ROUND_OFF)


@pytest.mark.parametrize(
    ("normals", "weights", "named"),
    [
        ([[1, 0]], None, "normals must have shape"),
        (np.empty((0, 3)), None, "normals must have shape"),
        ([[1, 0, 0]], [1, 2], "weights must have shape"),
        ([[1, 0, 0]], [np.nan], "weights must be positive"),
    ],
)
def test_wrong_input(normals: object, weights: object, named: str) -> None:
    with pytest.raises(InputError, match=named):
        fabric_tensor(normals, weights)
