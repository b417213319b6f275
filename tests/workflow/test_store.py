"""Result files: what is written is read back, and what is no result is known."""

from __future__ import annotations

import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from lammps_inelastic.workflow.errors import WorkflowError
from lammps_inelastic.workflow.schema import SCHEMA
from lammps_inelastic.workflow.store import (
    Result,
    StoredStudy,
    read_result,
    read_studies,
    write_result,
    write_studies,
)


def result_of(case, /, **variables):
    stage = {"deck": "own", "folder": ".", "text": "", "variables": variables}
    values = {
        "numbers/packing_fraction": np.array(0.6),
        "distribution/contacts": np.array([0.25, 0.75]),
    }
    return Result(values, {"network": b"\x89PNG"}, {"case": case, "stages": [stage]}, "{}")


def equal(one, other):
    return (
        one.values.keys() == other.values.keys()
        and all(np.array_equal(v, other.values[name]) for name, v in one.values.items())
        and (one.pictures, one.record, one.outputs) == (other.pictures, other.record, other.outputs)
    )


def test_round_trip_of_a_result(tmp_path):
    path = tmp_path / "folder" / "a.h5"
    result = result_of("a", seed=1)
    write_result(path, result)
    assert equal(read_result(path), result)
    # Nothing else is left there.
    assert list(path.parent.iterdir()) == [path]


def test_round_trip_of_a_study_in_the_order_of_its_cases(tmp_path):
    path = tmp_path / "s.h5"
    results = [result_of("b", seed=2), result_of("a", seed=1)]
    write_studies(path, [StoredStudy("s", "títle", "text", results)])
    (study,) = read_studies(path)
    assert (study.name, study.title, study.text) == ("s", "títle", "text")
    assert [result.case for result in study.results] == ["b", "a"]
    assert all(equal(*pair) for pair in zip(study.results, results, strict=True))


def test_columns_of_the_summary(tmp_path):
    path = tmp_path / "s.h5"
    results = [result_of("a", case=1, word="x"), result_of("b", case=2, drag=0.5)]
    write_studies(path, [StoredStudy("s", "", "", results)])
    with h5py.File(path) as file:
        columns = {name: column[()].tolist() for name, column in file["s/summary"].items()}
    assert columns["case"] == [b"a", b"b"]
    assert columns["case_variable"] == [1, 2]
    assert columns["word"] == [b"x", b""]
    assert np.isnan(columns["drag"][0])
    assert columns["packing_fraction"] == [0.6, 0.6]


@pytest.mark.parametrize("size", [0, 100, -1])
def test_a_truncated_file_is_no_result(tmp_path, size):
    path = tmp_path / "a.h5"
    write_result(path, result_of("a"))
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(WorkflowError, match="not a result"):
        read_result(path)


def test_another_version_is_said(tmp_path):
    path = tmp_path / "a.h5"
    write_result(path, result_of("a"))
    with h5py.File(path, "a") as file:
        file.attrs["schema_version"] = 99
    with pytest.raises(WorkflowError, match="schema version 99"):
        read_result(path)


def test_the_document_lists_the_schema():
    """workflow/README.md has a line for each dataset, as the schema says it."""
    document = (Path(__file__).parents[2] / "workflow" / "README.md").read_text()
    rows = [line for line in document.splitlines() if re.match(r"\| `\w+/\w+` \|", line)]
    assert rows == [
        f"| `{name}` | {entry.shape} | {entry.unit} | {entry.meaning} |"
        for name, entry in SCHEMA.items()
    ]
