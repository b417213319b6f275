"""NumPy reads the .npz files that npz_test.cpp has written; that program checks the rest."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.building import REPOSITORY, cmake, generator, run

# As in npz_test.cpp.
ARRAYS = {
    "empty": np.zeros((0, 3)),
    "one": np.array([[1.0, 2.0, 3.0]]),
    "special": np.array([[np.nan, np.inf, -np.inf], [-0.0, 5e-324, np.finfo(float).max]]),
    "many": ((np.arange(3000) - 1500) / 7).reshape(-1, 3),
    "a name of " + "x" * 60: np.ones((2, 3)),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build and run the test program; return the folder with the files that it leaves."""
    build = tmp_path_factory.mktemp("build")
    run(
        *cmake(),
        *("-S", str(REPOSITORY), "-B", str(build)),
        *generator(),
        "-DINELASTIC_PYTHON=OFF",
        "-DINELASTIC_TESTS=ON",
    )
    run(*cmake(), "--build", str(build), "--target", "npz_test")
    folder = tmp_path_factory.mktemp("written")
    run(str(build / "tests" / "npz" / "npz_test"), str(folder))
    return folder


def test_reads_back_identical(written: Path) -> None:
    with np.load(written / "arrays.npz") as loaded:
        assert loaded.files == list(ARRAYS)
        for name, values in ARRAYS.items():
            assert loaded[name].dtype == np.float64
            assert loaded[name].shape == values.shape
            assert loaded[name].tobytes() == values.tobytes()


def test_other_types_and_shapes(written: Path) -> None:
    with np.load(written / "members.npz") as loaded:
        assert loaded["indices"].dtype == np.int64
        assert loaded["indices"].tolist() == [-1, 2**40]
        assert loaded["timestep"].shape == ()
        assert loaded["timestep"] == 0.005
        assert loaded["values"].tolist() == [1, 0, 1e300, 4, 5, 6]


def test_is_a_sound_archive(written: Path) -> None:
    with zipfile.ZipFile(written / "arrays.npz") as archive:
        assert archive.testzip() is None
        for member in archive.infolist():
            header_length = int.from_bytes(archive.read(member)[8:10], "little")
            assert (10 + header_length) % 64 == 0  # the format's alignment of the data


def test_no_arrays(written: Path) -> None:
    with np.load(written / "none.npz") as loaded:
        assert loaded.files == []


def test_leaves_no_other_files(written: Path) -> None:
    assert sorted(path.name for path in written.iterdir()) == [
        *("a folder", "again.npz", "arrays.npz", "full.npz", "members.npz", "none.npz"),
        "replaced.npz",
    ]
