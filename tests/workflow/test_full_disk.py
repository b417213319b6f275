"""Where nothing can be written: one line says which file, and those of before stay as they were.

A limit on the size of files stands for a full disk: the system refuses what goes beyond it in the
same way, and no rights are needed to set it. A folder that is not to be written to is a path below
a file: to a superuser no other folder is closed.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from lammps_inelastic.workflow.looking.export import FILES as EXPORTS
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.results.store import read_studies
from tests.helpers.few_spheres import TINY
from tests.helpers.small_disk import mounted
from tests.helpers.study_run import inelastic, run_few

# What each of them needs to be small: 30 spheres, and no more than 27,000 voxels.
MORE = {"tiff": ["--voxel", "0.1"], "raw": ["--voxel", "0.1"]}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a study of one case that has been run."""
    return run_few(tmp_path_factory.mktemp("done"), "1")


@contextmanager
def limit(size: int) -> Iterator[None]:
    """Let no file grow beyond a size; Python is told, and not stopped by the signal."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def within(size: int, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run `inelastic` as a process where no file may grow beyond a size."""
    return inelastic(
        *arguments,
        preparation=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)),
    )


def contents(folder: Path) -> dict[str, bytes]:
    """All files below a folder but locks, which are empty."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and ".locks" not in path.parts
    }


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Return a function that runs `inelastic`, which must fail, and returns what it says."""

    def run(*arguments: object, size: int = resource.RLIM_INFINITY) -> str:
        capsys.readouterr()
        with limit(size):
            status = main([str(argument) for argument in arguments])
        assert status == 2
        said = capsys.readouterr().err.splitlines()
        # Of voxel images it is told how far they are, of a study what is to be expected.
        (line,) = (line for line in said if not line.startswith(("slice ", "warning: ")))
        assert line.startswith("inelastic: ")
        return line.removeprefix("inelastic: ")

    return run


def run_folder(study: Path) -> Path:
    (case,) = (path for path in (study / "out" / "cases").iterdir() if path.name[0] != ".")
    return case


@pytest.mark.parametrize("form", EXPORTS)
def test_exports(form: str, study: Path, refused: Callable[..., str]) -> None:
    run = run_folder(study)
    arguments = ["export", str(run), "--format", form, *MORE.get(form, [])]
    assert main(arguments) == 0
    before = contents(study)
    path = run / EXPORTS[form]
    for size in (0, 100, path.stat().st_size - 1):
        # The header of raw bytes is written first.
        assert re.fullmatch(
            rf"{re.escape(str(run))}/(packing|contacts)\.\w+: cannot be written: File too large",
            refused(*arguments, size=size),
        )
        assert contents(study) == before
    for closed in (study / "few.toml" / f"a{path.suffix}", Path(f"/proc/a{path.suffix}")):
        said = refused(*arguments, "--out", closed)
        # The system says of /proc that there is no such file.
        assert re.match(r"/.*/a\.\w+: cannot be written: No", said)
    assert contents(study) == before


@pytest.mark.parametrize("size", [0, 100, 2000, 5000, -1])
def test_results_of_a_study(size: int, study: Path, refused: Callable[..., str]) -> None:
    """At any moment of the writing."""
    before = contents(study)
    file = study / "out" / "few.h5"
    arguments = ["collect", study / "few.toml", "--out", study / "out"]
    size = file.stat().st_size - 1 if size < 0 else size
    assert refused(*arguments, size=size) == f"{file}: cannot be written: File too large"
    assert contents(study) == before
    assert len(read_studies(file)[0].results) == 1
    other = study / "few.toml" / "other.h5"
    said = refused(*arguments, "--file", other)
    assert said == f"{other}: cannot be written: {study / 'few.toml'} is no folder"
    assert contents(study) == before


@pytest.mark.slow
def test_a_measurement_that_cannot_be_kept(study: Path) -> None:
    """The run stays finished, and is measured when there is room."""
    (result,) = (study / "out" / "results" / "few").iterdir()
    result.unlink()
    before = contents(study)
    said = within(2000, "run", study / "few.toml", "--out", study / "out")
    assert said.returncode in (1, 2)
    assert "Traceback" not in said.stderr + said.stdout
    assert f"{result}: cannot be written: File too large" in said.stdout
    after = contents(study)
    assert {name: after.get(name) for name in before if "measure.out" not in name} == {
        name: text for name, text in before.items() if "measure.out" not in name
    }
    again = inelastic("run", study / "few.toml", "--out", study / "out")
    assert "few: 1 done" in again.stdout


# Less than a deck; a deck, but not its dumps.
@pytest.mark.slow
@pytest.mark.parametrize("size", [3000, 10_000])
def test_a_run_that_has_no_room(size: int, study: Path) -> None:
    """It fails as a case does, or with the workflow, and what is finished stays."""
    (study / "few.toml").write_text(TINY.replace("{seeds}", "[1, 2]"))
    before = contents(study / "out")
    said = within(size, "run", study / "few.toml", "--out", study / "out")
    assert said.returncode in (1, 2)
    assert "Traceback" not in said.stderr + said.stdout
    # LAMMPS is not told, but stopped by the signal that goes with the limit.
    assert re.search(
        r"few: .*1 failed|cannot be written: File too large", said.stdout + said.stderr
    )
    after = contents(study / "out")
    assert {name: after[name] for name in before} == before
    again = inelastic("run", study / "few.toml", "--out", study / "out")
    assert "few: 1 done, 1 there before" in again.stdout, again.stdout + again.stderr


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 128 kB."""
    with mounted(tmp_path / "disk", "128k") as disk:
        yield disk


@pytest.mark.slow
def test_a_disk_that_fills_up(done: Path, small_disk: Path) -> None:
    """The real thing, where one may be mounted: every process is told in its own way."""
    study = done / "few.toml"
    said = inelastic("run", study, "--out", small_disk)
    assert said.returncode in (1, 2)
    assert "Traceback" not in said.stderr + said.stdout
    assert "No space left on device" in said.stderr + said.stdout
    for path in small_disk.rglob("*.h5"):
        # What has got its name is whole.
        read_studies(path)


@pytest.mark.slow
@pytest.mark.parametrize("left", [0, 8192], ids=["no room for a word", "room for the reason"])
def test_a_disk_that_is_full_when_a_run_is_measured(left: int, study: Path, tmp_path: Path) -> None:
    """The message names the disk; the finished run is kept, and nobody is told to delete it."""
    with mounted(tmp_path / "disk", "2M") as disk:
        # The output of the process that measures would be overwritten, and leave its room.
        ignored = shutil.ignore_patterns("measure.out")
        shutil.copytree(study / "out" / "cases", disk / "cases", ignore=ignored)
        arguments = ["run", study / "few.toml", "--out", disk]
        fill = disk / "fill"
        with suppress(OSError), fill.open("wb", buffering=0) as file:
            while True:
                file.write(bytes(4096))
        os.truncate(fill, fill.stat().st_size - left)
        said = inelastic(*arguments)
        (reason,) = (line for line in said.stdout.splitlines() if "  failed: " in line)
        full = "No space left on device" if left else "nothing can be written there: the disk is"
        assert re.search(rf"cannot be measured: {disk}/\S+: .*{full}", reason)
        assert reason.endswith("; the run is kept, and is measured the next time")
        assert "delete" not in said.stdout + said.stderr
        fill.unlink()
        assert "few: 1 done" in inelastic(*arguments).stdout


def test_out_that_is_no_folder(study: Path, refused: Callable[..., str]) -> None:
    for arguments in (
        ["run", study / "few.toml"],
        ["tradeoff", "--seeds", "1"],
    ):
        said = refused(*arguments, "--out", study / "few.toml" / "out")
        assert said.startswith(f"{study / 'few.toml' / 'out'}/")
        assert said.endswith(": cannot be written: Not a directory")


@pytest.mark.slow
def test_tradeoff(tmp_path: Path, refused: Callable[..., str]) -> None:
    out = tmp_path / "out"
    arguments = ["tradeoff", "--out", str(out), "--particles", "20", "--diameter", "0.2"]
    arguments += ["--tolerances", "0.05", "--soft-tolerances", "none", "--seeds", "1"]
    arguments += ["--time", "0.5"]
    assert main(arguments) == 0
    before = contents(tmp_path)
    # Everything is measured: only the tables and plots are written again. HDF5 is the largest.
    file = out / "tradeoff.h5"
    for size in (0, 1000, file.stat().st_size - 1):
        assert refused(*arguments, size=size) == f"{file}: cannot be written: File too large"
        assert contents(tmp_path) == before
    for ending in ("csv", "md", "png", "svg"):
        file = out / f"tradeoff.{ending}"
        file.unlink()
        file.mkdir()
        assert refused(*arguments) == f"{file}: cannot be written: Is a directory"
        file.rmdir()
        file.write_bytes(before[f"out/tradeoff.{ending}"])
        assert contents(tmp_path).keys() == before.keys()
