"""Damaged files and what stands in the way: named, set aside, and nothing else held up."""

from __future__ import annotations

import json
import os
import random
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.provenance.finished import FINISHED
from lammps_inelastic.workflow.results.store import read_result, write_result
from lammps_inelastic.workflow.running.folder import FAILED, Folder
from lammps_inelastic.workflow.study import read_study
from tests.helpers.few_spheres import TINY
from tests.helpers.study_run import inelastic, numbers_of, same, warning


@pytest.fixture(scope="module")
def done(two_cases: Path) -> Path:
    """Return the folder of a study of two cases that has been run."""
    return two_cases


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:1000])


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def of_random_bytes(path: Path) -> None:
    path.write_bytes(random.Random(1).randbytes(20_000))


def that_begins_well(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:64] + random.Random(2).randbytes(len(content) - 64))


def with_one_bit_changed(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)


def too_deep(path: Path) -> None:
    path.write_text("[" * 100_000)


def of_another_kind(path: Path) -> None:
    path.write_text("null")


def that_is_a_folder(path: Path) -> None:
    path.unlink()
    (path / "inner").mkdir(parents=True)


def that_is_a_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def that_is_a_link_to_nowhere(path: Path) -> None:
    path.unlink()
    path.symlink_to("nowhere")


DAMAGED = [
    cut,
    emptied,
    of_random_bytes,
    that_begins_well,
    with_one_bit_changed,
    too_deep,
    of_another_kind,
    that_is_a_folder,
    that_is_a_pipe,
    that_is_a_link_to_nowhere,
]
# One changed bit is not seen in JSON, whose numbers are for information.
DAMAGED_JSON = [each for each in DAMAGED if each is not with_one_bit_changed]


@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_result_is_named_and_set_aside(
    study: Path, damage: Callable[[Path], None], capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = study / "few.toml", study / "out"
    read, folder = read_study(path), Folder(out)
    first, second = read.cases
    result = folder.result(read, first)
    damage(result)
    assert main(["status", str(path), "--out", str(out)]) == 0
    output = capsys.readouterr().out
    assert "1 finished, 1 measured" in output
    assert str(result) in output
    assert main(["collect", str(path), "--out", str(out), "--file", str(out / "one.h5")]) == 0
    captured = capsys.readouterr()
    assert "few: 1 of 2 cases" in captured.out
    (line,) = captured.err.splitlines()
    assert line.startswith(f"inelastic: left out: {result}: ")
    # What `run`, a job and `reproduce` do first with a case
    (line,) = folder.set_aside(read, first, folder.found(read, first))
    assert line.startswith(f"{result}: ")
    kept = result.with_name(f"{result.name}.damaged")
    assert line.endswith(f"; kept as {kept.name}")
    assert os.path.lexists(kept)
    assert not os.path.lexists(result)
    assert folder.is_finished(first)
    assert folder.set_aside(read, second, folder.found(read, second)) == []


def test_a_damaged_result_is_measured_again(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = study / "few.toml", study / "out"
    before = numbers_of(out / "few.h5")
    read = read_study(path)
    for case, damage in zip(read.cases, (with_one_bit_changed, that_is_a_folder), strict=True):
        damage(Folder(out).result(read, case))
    (out / "few.h5").write_bytes(b"damaged")
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert "few: 2 done" in capsys.readouterr().out
    assert same(before, numbers_of(out / "few.h5"))
    assert len(list((out / "results" / "few").glob("*.h5.damaged"))) == 2
    assert len(list((out / "cases").iterdir())) == 3  # with that of the locks


@pytest.mark.slow
def test_a_damaged_result_in_a_job(study: Path) -> None:
    path, out = study / "few.toml", study / "out"
    before = numbers_of(out / "few.h5")
    read = read_study(path)
    of_random_bytes(Folder(out).result(read, read.cases[0]))
    said = inelastic("run", path, "--out", out, "--mpi", ranks=1)
    assert said.returncode == 0, said.stderr
    assert "kept as " in said.stdout
    assert "few: 1 done, 1 there before" in said.stdout
    assert same(before, numbers_of(out / "few.h5"))


def with_another_default(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record as if a variable that nobody sets had had another default then."""
    (stage,) = json.loads(json.dumps(record["stages"]))
    assert "drag" not in stage["values"]
    stage["variables"]["drag"] = 7
    return {**record, "stages": [stage]}


def test_a_run_and_a_result_of_earlier_defaults_are_kept(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The study has not changed, the deck's default has: the case is run, and nothing is lost."""
    path, out = study / "few.toml", study / "out"
    read, folder = read_study(path), Folder(out)
    first, _ = read.cases
    result, run = folder.result(read, first), folder.case(first)
    old = read_result(result)
    write_result(result, replace(old, record=with_another_default(dict(old.record))))
    record = json.loads((run / FINISHED).read_text())
    (run / FINISHED).write_text(json.dumps(with_another_default(record)))
    content, files = result.read_bytes(), sorted(one.name for one in run.iterdir())
    assert main(["status", str(path), "--out", str(out)]) == 0
    assert "1 missing, 1 measured" in capsys.readouterr().out
    assert main(["run", str(path), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "few: 1 done, 1 there before" in said
    words = "of a deck with other defaults than today's"
    for kept in (result, run):
        assert f"{kept}: {words}; kept as {kept.name}.earlier" in said
    earlier = result.with_name(f"{result.name}.earlier")
    assert earlier.read_bytes() == content
    runs = run.with_name(f"{run.name}.earlier")
    assert sorted(one.name for one in runs.iterdir()) == files
    assert read_result(result).variables == old.variables
    # What is kept is in nobody's way.
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert "few: 2 there before" in capsys.readouterr().out
    assert earlier.read_bytes() == content


def test_set_aside_again_and_again(study: Path) -> None:
    read, folder = read_study(study / "few.toml"), Folder(study / "out")
    case = read.cases[0]
    result = folder.result(read, case)
    for name in ("damaged", "damaged2", "damaged3"):
        result.write_text(name)
        folder.set_aside(read, case, folder.found(read, case))
        assert result.with_name(f"{result.name}.{name}").read_text() == name


@pytest.mark.parametrize("damage", DAMAGED)
def test_a_report_of_a_damaged_file(
    study: Path, damage: Callable[[Path], None], capsys: pytest.CaptureFixture[str]
) -> None:
    file = study / "out" / "few.h5"
    damage(file)
    assert main(["report", str(file), "--out", str(study / "report.html")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"inelastic: {file}: ")


@pytest.mark.parametrize("damage", DAMAGED_JSON)
def test_a_damaged_record_of_a_run(
    study: Path, damage: Callable[[Path], None], capsys: pytest.CaptureFixture[str]
) -> None:
    """The run can no longer be measured: it is kept, and made again."""
    path, out = study / "few.toml", study / "out"
    read, folder = read_study(path), Folder(out)
    case = read.cases[0]
    run = folder.case(case)
    folder.result(read, case).unlink()
    damage(run / FINISHED)
    assert main(["status", str(path), "--out", str(out)]) == 0
    assert "1 missing, 1 measured" in capsys.readouterr().out
    (line,) = folder.set_aside(read, case, folder.found(read, case))
    assert line == f"{run / FINISHED}: cannot be read; kept as {run.name}.damaged"
    assert (run.with_name(f"{run.name}.damaged") / "particles.lammpsdump").is_file()
    assert not run.exists()


@pytest.mark.parametrize("damage", DAMAGED_JSON)
def test_a_damaged_record_of_a_failure(
    study: Path, damage: Callable[[Path], None], capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = study / "few.toml", study / "out"
    read, folder = read_study(path), Folder(out)
    case = read.cases[0]
    folder.result(read, case).unlink()
    folder.case(case).rename(folder.failure(case))
    lines = ["a line of a log"] * 100
    (folder.failure(case) / FAILED).write_text(json.dumps({"reason": "why", "last_lines": lines}))
    assert folder.reason(case) == "why"
    damage(folder.failure(case) / FAILED)
    assert not folder.failed_in(case, "job")
    assert main(["status", str(path), "--out", str(out)]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[-1] for row in rows if "failed" in row[:-1] and case.name in row] == ["unknown"]


PLACES = [
    "",
    "cases",
    "cases/.locks",
    "cases/.locks/CASE",
    "cases/CASE",
    "cases/CASE.part",
    "cases/CASE.failed",
    "results",
    "results/few",
]


@pytest.mark.parametrize("kind", ["file", "link to nowhere", "link to a file", "pipe"])
@pytest.mark.parametrize("place", PLACES)
def test_what_stands_in_the_way(
    write_study: Callable[..., Path],
    tmp_path: Path,
    place: str,
    kind: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = write_study(TINY.replace("{seeds}", "1"))
    (case,) = read_study(path).cases
    mine = tmp_path / "mine"
    mine.write_text("mine")
    odd = tmp_path / "out" / place.replace("CASE", case.name)
    odd.parent.mkdir(parents=True, exist_ok=True)
    if kind == "file":
        odd.write_text("mine")
    elif kind == "pipe":
        os.mkfifo(odd)
    else:
        odd.symlink_to(mine if kind == "link to a file" else tmp_path / "nowhere")
    before = sorted(tmp_path.rglob("*"))
    status = main(["run", str(path), "--out", str(tmp_path / "out"), "--timeout", "0.01"])
    captured = capsys.readouterr()
    if (place, kind) == ("cases/.locks/CASE", "file"):
        # A lock is a file.
        assert status == 1
        return
    assert status == 2
    assert captured.err.startswith(warning(path))
    (line,) = captured.err.removeprefix(warning(path)).splitlines()
    assert line.startswith(f"inelastic: {odd}: ")
    assert line.endswith("; move it away")
    assert captured.out == ""
    assert sorted(tmp_path.rglob("*")) == before
    assert mine.read_text() == "mine"
    # Neither a look nor a script opens what is there.
    assert main(["status", str(path), "--out", str(tmp_path / "out")]) == (0 if place else 2)


def test_a_folder_in_the_place_of_a_lock(
    write_study: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is named by what needs the lock, and in nobody's way otherwise."""
    path = write_study(TINY.replace("{seeds}", "1"))
    (case,) = read_study(path).cases
    odd = tmp_path / "out" / "cases" / ".locks" / case.name
    odd.mkdir(parents=True)
    arguments = [str(path), "--out", str(tmp_path / "out")]
    assert main(["status", *arguments]) == 0
    capsys.readouterr()
    assert main(["run", *arguments, "--timeout", "0.01"]) == 2
    (line,) = capsys.readouterr().err.removeprefix(warning(path)).splitlines()
    assert line.startswith(f"inelastic: {odd}: ")


@pytest.mark.parametrize("command", ["status", "collect"])
def test_a_folder_that_is_not_there(
    command: str,
    write_study: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A slip in --out is no study of which nothing has been run."""
    out = tmp_path / "nowhere"
    study = write_study(TINY.replace("{seeds}", "1"))
    assert main([command, str(study), "--out", str(out)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == f"inelastic: {out}: no such folder; --out names that of the runs\n"
    assert not out.exists()


def test_a_folder_in_the_place_of_the_results(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = study / "out" / "few.h5"
    file.unlink()
    file.mkdir()
    assert main(["run", str(study / "few.toml"), "--out", str(study / "out")]) == 2
    said = capsys.readouterr().err.removeprefix(warning(study / "few.toml"))
    assert said == f"inelastic: {file}: a folder is in the way; move it away\n"


def test_a_run_that_was_moved_and_linked(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = study / "few.toml", study / "out"
    read, folder = read_study(path), Folder(out)
    case = read.cases[0]
    folder.result(read, case).unlink()
    folder.case(case).rename(study / "elsewhere")
    folder.case(case).symlink_to(study / "elsewhere")
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert "few: 1 done, 1 there before" in capsys.readouterr().out


def test_collect_replaces_hdf5_files_only(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = study / "few.toml", study / "out"
    text = path.read_text()
    assert main(["collect", str(path), "--out", str(out), "--file", str(path)]) == 2
    assert capsys.readouterr().err.endswith("this file is no HDF5 file, and is not replaced\n")
    assert path.read_text() == text


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [0, 1])
def test_status_says_why_a_run_cannot_be_measured(study: Path, ranks: int) -> None:
    """Also where the ranks of an MPI job have run it."""
    path, out = study / "few.toml", study / "out"
    for result in (out / "results" / "few").iterdir():
        result.unlink()
    for dump in out.glob("cases/*/particles.lammpsdump"):
        dump.write_bytes(dump.read_bytes()[:2000])
    job = ["--mpi"] if ranks else []
    said = inelastic("run", path, "--out", out, *job, ranks=ranks)
    assert said.returncode == 1
    assert "few: 2 failed" in said.stdout
    told = inelastic("status", path, "--out", out).stdout
    assert told.count("cannot be measured: particles.lammpsdump, line") == 2


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [0, 1])
def test_measuring_takes_too_long(study: Path, ranks: int) -> None:
    """What was run stays, and is measured when there is more time."""
    path, out = study / "few.toml", study / "out"
    text = path.read_text()
    before = numbers_of(out / "few.h5")
    slow = text.replace("points = 1000", "points = 100000000")
    path.write_text(slow)
    job = ["--mpi"] if ranks else []
    said = inelastic("run", path, "--out", out, "--timeout", 1.5, *job, ranks=ranks)
    assert said.returncode == 1
    assert "few: 2 failed" in said.stdout
    assert "cannot be measured: timed out after 1.5 s; the run is kept" in said.stdout
    assert (
        "cannot be measured: timed out after 1.5 s"
        in inelastic("status", path, "--out", out).stdout
    )
    path.write_text(text)
    said = inelastic("run", path, "--out", out)
    assert "few: 2 there before" in said.stdout
    assert same(before, numbers_of(out / "few.h5"))
