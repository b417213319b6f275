"""Result files: what is written is read back, and what is no result is known."""

from __future__ import annotations

import errno
import fcntl
import hashlib
import io
import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from lammps_inelastic.workflow.errors import WorkflowError
from lammps_inelastic.workflow.files import whole
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.results.schema import SCHEMA, VERSION
from lammps_inelastic.workflow.results.store import (
    SEAL,
    Result,
    StoredStudy,
    read_result,
    read_studies,
    write_result,
    write_studies,
)
from lammps_inelastic.workflow.running.folder import Folder
from lammps_inelastic.workflow.running.one_case import Options
from lammps_inelastic.workflow.running.run_and_gather import run_and_gather
from lammps_inelastic.workflow.shipped import shipped_studies
from lammps_inelastic.workflow.study import Case, Study, read_study


def result_of(case: str, /, **variables: Any) -> Result:
    stage = {"deck": "own", "folder": ".", "text": "", "variables": variables}
    values = {
        "numbers/packing_fraction": np.array(0.6),
        "distribution/contacts": np.array([0.25, 0.75]),
    }
    return Result(values, {"network": b"\x89PNG"}, {"case": case, "stages": [stage]}, "{}")


def equal(one: Result, other: Result) -> bool:
    return (
        one.values.keys() == other.values.keys()
        and all(np.array_equal(v, other.values[name]) for name, v in one.values.items())
        and (one.pictures, one.record, one.outputs) == (other.pictures, other.record, other.outputs)
    )


def test_round_trip_of_a_result(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "a.h5"
    result = result_of("a", seed=1)
    write_result(path, result)
    assert equal(read_result(path), result)
    # Nothing else is left there.
    assert list(path.parent.iterdir()) == [path]


def test_round_trip_of_a_study_in_the_order_of_its_cases(tmp_path: Path) -> None:
    path = tmp_path / "s.h5"
    results = [result_of("b", seed=2), result_of("a", seed=1)]
    write_studies(path, [StoredStudy("s", "títle", "text", results)])
    (study,) = read_studies(path)
    assert (study.name, study.title, study.text) == ("s", "títle", "text")
    assert [result.case for result in study.results] == ["b", "a"]
    assert all(equal(*pair) for pair in zip(study.results, results, strict=True))


def test_columns_of_the_summary(tmp_path: Path) -> None:
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
def test_a_truncated_file_is_no_result(tmp_path: Path, size: int) -> None:
    path = tmp_path / "a.h5"
    write_result(path, result_of("a"))
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(WorkflowError, match="not a result"):
        read_result(path)


def test_another_version_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.h5"
    with monkeypatch.context() as patch:
        patch.setattr("lammps_inelastic.workflow.results.store.VERSION", 99)
        write_result(path, result_of("a"))
    with pytest.raises(WorkflowError, match="not a result: schema version 99"):
        read_result(path)


@pytest.mark.parametrize("at", [0, 8, 60, 500, 2000, -200, -100, -40, -1])
def test_one_changed_byte_is_noticed(tmp_path: Path, at: int) -> None:
    """Wherever it is: HDF5 itself does not look whether numbers are as they were written."""
    path = tmp_path / "a.h5"
    write_result(path, result_of("a"))
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)
    with pytest.raises(WorkflowError, match=r"not a result: it is (damaged|cut off)"):
        read_result(path)
    with pytest.raises(WorkflowError, match=r"not a file of studies: it is (damaged|cut off)"):
        read_studies(path)


def test_random_bytes_never_reach_hdf5(tmp_path: Path) -> None:
    """A file that begins as one of HDF5 may keep it busy for minutes, or end the process."""
    path = tmp_path / "a.h5"
    write_result(path, result_of("a"))
    content = path.read_bytes()
    for seed in range(100):
        path.write_bytes(content[:48] + random.Random(seed).randbytes(len(content) - 48))
        with pytest.raises(WorkflowError, match="not a result: it is cut off"):
            read_result(path)


@pytest.mark.parametrize("lacks", ["outputs", "record", "case"])
def test_a_sealed_file_of_something_else(tmp_path: Path, lacks: str) -> None:
    path = tmp_path / "a.h5"
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        file.attrs["schema_version"] = VERSION
        if lacks != "outputs":
            file.attrs["outputs"] = "{}"
        if lacks == "case":
            file.attrs["record"] = "[" * 100_000
    seal = hashlib.sha256(image.getvalue()).hexdigest().encode()
    path.write_bytes(image.getvalue() + SEAL % seal)
    with pytest.raises(WorkflowError, match="not a result: "):
        read_result(path)


def test_columns_whose_names_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "s.h5"
    taken = {"case": 1, "case_variable": 2, "packing_fraction": 3, "packing_fraction_measured": 4}
    write_studies(path, [StoredStudy("s", "", "", [result_of("a", **taken)])])
    with h5py.File(path) as file:
        columns = {name: column[()].tolist() for name, column in file["s/summary"].items()}
    assert columns == {
        "case": [b"a"],
        "case_variable": [1],
        "case_variable_variable": [2],
        "packing_fraction": [3],
        "packing_fraction_measured": [4],
        "packing_fraction_measured_measured": [0.6],
    }


def test_the_document_lists_the_schema() -> None:
    """docs/reference/hdf5.md has a line for each dataset, as the schema says it."""
    document = (Path(__file__).parents[2] / "docs" / "reference" / "hdf5.md").read_text()
    rows = [line for line in document.splitlines() if re.match(r"\| `\w+/\w+` \|", line)]
    assert rows == [
        f"| `{name}` | {entry.shape} | {entry.unit} | {entry.meaning} |"
        for name, entry in SCHEMA.items()
    ]


def test_two_writers_of_one_file_do_not_meet(tmp_path: Path) -> None:
    """They may be on two machines, where processes may have the same number."""
    path = tmp_path / "a.txt"
    with whole(path) as first, whole(path) as second:
        first.write_text("first")
        second.write_text("second")
    assert path.read_text() == "first"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("module", ["cli.collect", "running.run_and_gather", "cli.reproduce"])
def test_results_are_gathered_by_one_at_a_time(
    module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise an older set of them could be written after a newer one."""
    folder = Folder(tmp_path)
    locks = tmp_path / "cases" / ".locks"
    locks.mkdir(parents=True)
    held = []

    def is_held() -> bool:
        with (locks / "results").open("a") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
        return False

    def gather(study: Study, *_: object) -> StoredStudy:
        held.append(is_held())
        return StoredStudy(study.name, study.title, study.text, [])

    def write(*_: object) -> None:
        held.append(is_held())

    def look(study: Study, *_: object) -> Iterator[tuple[Case, Result]]:
        gather(study)
        yield from ()

    place = f"lammps_inelastic.workflow.{module}"
    if module == "running.run_and_gather":
        monkeypatch.setattr(f"{place}.results_of", look)
    else:
        monkeypatch.setattr(f"{place}.gather_results", gather)
    monkeypatch.setattr(f"{place}.write_studies", write)
    if module == "cli.collect":
        assert main(["collect", "table-1", "--out", str(tmp_path)]) == 0
    elif module == "running.run_and_gather":
        study = read_study(shipped_studies()["table-1"])
        run_and_gather([(study, [])], folder, Options())
    else:
        page = "lammps_inelastic.workflow.report.report_files"
        monkeypatch.setattr(f"{page}.write_report", lambda *_: None)
        (tmp_path / "kept" / "table-1").mkdir(parents=True)
        kept = ["--stored-only", "--results", str(tmp_path / "kept")]
        assert main(["reproduce", "--out", str(tmp_path), *kept]) == 0
    assert held
    assert all(held)
    assert not is_held()


def test_results_are_gathered_where_there_are_no_locks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    with Folder(tmp_path / "nowhere").gathering():
        assert not list(tmp_path.iterdir())
    (tmp_path / "cases" / ".locks").mkdir(parents=True)
    monkeypatch.setattr(fcntl, "flock", no_locks)
    with Folder(tmp_path).gathering():
        pass
