"""The core's own writer of NumPy's .npz."""

from __future__ import annotations

import resource
import zipfile
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic import core
from tests.core.contact_problems import Floats

ARRAYS = {
    "empty": np.zeros((0, 3)),
    "one": np.array([[1.0, 2.0, 3.0]]),
    "special": np.array([[np.nan, np.inf, -np.inf], [-0.0, 5e-324, np.finfo(float).max]]),
    "position": np.random.default_rng(0).normal(size=(1000, 3)),
    "a name of " + "x" * 60: np.ones((2, 3)),
}


def test_reads_back_identical(tmp_path: Path) -> None:
    core.write_npz(str(tmp_path / "some.npz"), ARRAYS)
    with np.load(tmp_path / "some.npz") as loaded:
        assert loaded.files == list(ARRAYS)
        for name, values in ARRAYS.items():
            assert loaded[name].dtype == np.float64
            assert loaded[name].shape == values.shape
            assert loaded[name].tobytes() == values.tobytes()


def test_is_a_sound_archive(tmp_path: Path) -> None:
    core.write_npz(str(tmp_path / "some.npz"), ARRAYS)
    with zipfile.ZipFile(tmp_path / "some.npz") as archive:
        assert archive.testzip() is None
        for member in archive.infolist():
            header_length = int.from_bytes(archive.read(member)[8:10], "little")
            assert (10 + header_length) % 64 == 0  # the format's alignment of the data


def test_no_arrays(tmp_path: Path) -> None:
    core.write_npz(str(tmp_path / "none.npz"), {})
    with np.load(tmp_path / "none.npz") as loaded:
        assert loaded.files == []


def test_equal_arrays_give_equal_files(tmp_path: Path) -> None:
    for name in ("one", "other"):
        core.write_npz(str(tmp_path / name), ARRAYS)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def test_replaces_a_file_at_once(tmp_path: Path) -> None:
    path = tmp_path / "some.npz"
    core.write_npz(str(path), {"old": np.zeros((5, 3))})
    with path.open("rb") as opened_before, np.load(opened_before) as before:
        core.write_npz(str(path), {"new": np.ones((5, 3))})
        # Whoever reads the old file goes on reading the old file.
        assert np.array_equal(before["old"], np.zeros((5, 3)))
    with np.load(path) as after:
        assert after.files == ["new"]
    assert list(tmp_path.iterdir()) == [path]


def test_unwritable_folder(tmp_path: Path) -> None:
    path = tmp_path / "missing" / "some.npz"
    with pytest.raises(RuntimeError, match=r"cannot write .*some\.npz: No such file"):
        core.write_npz(str(path), ARRAYS)


def test_path_is_a_folder(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(RuntimeError, match=r"cannot write .*folder: Is a directory"):
        core.write_npz(str(tmp_path / "folder"), ARRAYS)
    assert list(tmp_path.iterdir()) == [tmp_path / "folder"]


@pytest.mark.parametrize("rows", [10, 10_000], ids=["while closing", "while writing"])
def test_no_space_left(tmp_path: Path, rows: int) -> None:
    path = tmp_path / "some.npz"
    core.write_npz(str(path), {"old": np.zeros((1, 3))})
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))  # bytes, for every file
    try:
        with pytest.raises(RuntimeError, match=r"cannot write .*: File too large"):
            core.write_npz(str(path), {"new": np.ones((rows, 3))})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    with np.load(path) as loaded:
        assert loaded.files == ["old"]
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("wrong", [np.zeros(3), np.zeros((3, 2)), np.zeros((1, 1, 3))])
def test_wrong_shape(tmp_path: Path, wrong: Floats) -> None:
    with pytest.raises(RuntimeError):
        core.write_npz(str(tmp_path / "some.npz"), {"wrong": wrong})
    assert list(tmp_path.iterdir()) == []
