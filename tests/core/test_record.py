"""Recorded problems as the core reads them: indices for IDs, bodies, and what is no record."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic import core
from tests.helpers.blocks import blocks_of

REFERENCE = Path(__file__).parents[2] / "docs" / "reference"

# Sphere 7 is free; 3 and 9 are molecule 5, and 4 is molecule 2. Wall 2 is under 4, the contact of
# which comes first.
ARRAYS: dict[str, Any] = {
    "step": 40.0,
    "timestep": 0.01,
    "tolerance": 1e-4,
    "iterations": 8.0,
    "id": [3, 4, 7, 9],
    "inverse_mass": [1.0, 1.0, 2.0, 1.0],
    "predicted_velocity": [[0, 0, -1], [0, 0, -2], [0, 0, -3], [0, 0, -1]],
    "molecule": [5, 2, 0, 5],
    "arm": [[-0.5, 0, 0], [0, 0, 0], [0, 0, 0], [0.5, 0, 0]],
    "body_molecule": [5, 2],
    "body_inverse_mass": [0.5, 1.0],
    "body_inverse_inertia": [[1.0, 2.0, 3.0, 0.1, 0.3, 0.2], [0.0] * 6],
    "id1": [4, 7],
    "id2": [-2, 9],
    "normal": [[0, 0, 1], [0, 0, 1]],
    "gap": [0.001, 0.0],
    "impulse": [2.0, 0.0],
    "impulse_guess": [0.5, 0.25],
    "least_impulse": [0.0, -1.0],
}


def write(path: Path, **changes: Any) -> Path:
    """Write a record with some arrays changed, or left out where they are None."""
    arrays = {name: value for name, value in (ARRAYS | changes).items() if value is not None}
    np.savez(path, **arrays)
    return path


def test_indices_and_bodies(tmp_path: Path) -> None:
    record = core.read_record(write(tmp_path / "one.npz"))
    assert (record.step, record.tolerance, record.problem.timestep) == (40, 1e-4, 0.01)
    problem = record.problem
    assert problem.first.tolist() == [1, 2]
    assert problem.second.tolist() == [-1, 3]
    assert problem.impulse_guess.tolist() == [0.5, 0.25]
    assert problem.least_impulse.tolist() == [0.0, -1.0]
    assert problem.compliance.tolist() == [0.0, 0.0]
    assert problem.bodies is not None
    # Bodies are in the order of their molecules.
    assert problem.bodies.body.tolist() == [1, 0, -1, 1]
    assert problem.bodies.inverse_mass.tolist() == [1.0, 0.5]
    expected = [[1.0, 0.1, 0.3], [0.1, 2.0, 0.2], [0.3, 0.2, 3.0]]
    assert problem.bodies.inverse_inertia[1].tolist() == expected
    assert core.project(problem, core.Limits(record.tolerance)).converged


def test_spheres_without_a_law(tmp_path: Path) -> None:
    bodies = [name for name in ARRAYS if name.startswith("body_")]
    free = dict.fromkeys([*bodies, "molecule", "arm", "least_impulse"])
    problem = core.read_record(str(write(tmp_path / "one.npz", **free))).problem
    assert problem.bodies is None
    assert problem.least_impulse.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gap": None}, "the array 'gap' of a recorded problem is missing"),
        ({"arm": None}, "the array 'arm' of a recorded problem is missing"),
        ({"id1": [4, 8]}, "id1 has the ID 8, which is nowhere else"),
        ({"id2": [-2, 10]}, "id2 has the ID 10, which is nowhere else"),
        ({"molecule": [5, 3, 0, 5]}, "molecule has the ID 3, which is nowhere else"),
        ({"gap": [0.0, np.nan]}, "gap[1] is nan: it must be finite"),
        ({"normal": [[0, 0, 1]]}, "normal must have the shape (2, 3), not (1, 3)"),
        ({"id": None}, "no recorded contact problem, or a damaged one"),
    ],
)
def test_records_that_are_wrong(changes: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = write(tmp_path / "one.npz", **changes)
    with pytest.raises(ValueError, match=r"^.*\Z") as caught:
        core.read_record(path)
    assert str(caught.value) == f"{path}: {message}"


@pytest.mark.parametrize("kept", [0, 100, 1000, -20])
def test_files_that_are_no_records(kept: int, tmp_path: Path) -> None:
    path = write(tmp_path / "one.npz")
    path.write_bytes(path.read_bytes()[:kept])
    for wrong in (path, tmp_path / "nowhere.npz", tmp_path):
        with pytest.raises(ValueError, match="no recorded contact problem, or a damaged one"):
            core.read_record(wrong)


def test_the_pages_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the pages of the core and of the record print, and what they say of it."""
    write(tmp_path / "problem.100.npz")
    monkeypatch.chdir(tmp_path)
    first, reads = (block.text for block in blocks_of((REFERENCE / "core.md").read_text()))
    names: dict[str, Any] = {}
    exec(first, names)
    found = names["found"]
    assert found.status == "converged"
    # The tolerance over the time step, and that for the masses above a contact.
    assert found.velocity[:, 1] == pytest.approx([-0.1, -0.1], abs=2e-7)
    assert found.impulse == pytest.approx([1.8, 0.9], abs=4e-7)
    exec(reads, names)
    assert names["found"].converged
    (again,) = (block.text for block in blocks_of((REFERENCE / "record.md").read_text()))
    exec(again, names)
    # Sphere 4 stops at the wall, 0.001 above it; 7 falls by 2 h more than 9.
    assert names["feasibility"] == pytest.approx(0.02, abs=1e-15)
    assert names["complementarity"] == pytest.approx(0.001, abs=1e-15)
    assert names["again"].converged
