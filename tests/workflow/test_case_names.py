"""Names of cases: short, of whole words, with the seed; and what version 0.2 left under its own."""

from __future__ import annotations

import itertools
import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lammps_inelastic.workflow.errors import StudyError
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.provenance.finished import FINISHED
from lammps_inelastic.workflow.report import read_data
from lammps_inelastic.workflow.results.store import (
    StoredStudy,
    origin_of,
    read_result,
    read_studies,
    write_result,
    write_studies,
)
from lammps_inelastic.workflow.running.folder import Folder, write_json
from lammps_inelastic.workflow.shipped import STUDIES, STUDIES_FOLDER
from lammps_inelastic.workflow.study import Case, Study, read_study
from lammps_inelastic.workflow.study.case_name import name_before, name_in, name_of
from tests.helpers.study_run import numbers_of, same

KEPT = Path(__file__).parents[2] / "results"
# A name on an encrypted disk (eCryptfs).
LONGEST_ON_DISK = 143
# What `files.whole` adds to a name while it writes: the longest process number has seven digits.
TEMPORARY = len("..") + 20 + len(".4194304.") + 8
HASH = "0123abcd"
ALWAYS = {"seed", "particles", "aspect_ratio", "change"}
# The first of these names were cut off by 0.2; all are of studies that are shipped.
BEFORE_AND_NOW = {
    "counting": (
        "spheres_particles=1000_tolerance=0.005_tolerance_measuring=0.005_dt=0.005_dt_resting=0.005"
        "_dt_measuring=0.005_steps_agitated=800_steps_settling=400_steps_restin_04b48f42",
        "spheres_particles=1000_tolerance=0.005_dt=0.005_dt_resting=0.005_steps_resting=800_seed=9_+5_04b48f42",
    ),
    "dimers": (
        "dimers_particles=10000_aspect_ratio=1.01_diameter=0.052_tolerance_agitated=0.005"
        "_random_force=30_seed=1_b7d91e9f",
        "dimers_particles=10000_aspect_ratio=1.01_diameter=0.052_random_force=30_seed=1_+1_b7d91e9f",
    ),
    "table-2": ("spheres_particles=1000_seed=1_52d501aa",) * 2,
}


def stage_of(deck: str, values: Mapping[str, Any], **defaults: Any) -> dict[str, Any]:
    return {"deck": deck, "values": values, "variables": {**defaults, **values}}


def all_shipped() -> Iterator[Case]:
    for name in STUDIES:
        yield from read_study(STUDIES_FOLDER / f"{name}.toml").cases


@pytest.fixture(scope="module")
def done(two_cases: Path) -> Path:
    """Return the folder of a study of two cases that has been run."""
    return two_cases


def as_version_02_left_it(study: Study, root: Path) -> None:
    """Give all that is there of a study the names that version 0.2 gave, in files, too."""
    folder = Folder(root)
    found = []
    for case in study.cases:
        run = folder.case(case).rename(root / "cases" / case.name_before)
        record = json.loads((run / FINISHED).read_text())
        write_json(run / FINISHED, {**record, "case": case.name_before})
        result = read_result(folder.result(study, case))
        found.append(replace(result, record={**result.record, "case": case.name_before}))
        folder.result(study, case).unlink()
        write_result(folder.result_folder(study) / f"{case.name_before}.h5", found[-1])
    write_studies(root / f"{study.name}.h5", [StoredStudy(study.name, "", study.text, found)])


@pytest.fixture(scope="module")
def records_of_02() -> dict[Path, Mapping[str, Any]]:
    """Return the records of all stored results by their paths seen from the folder of all."""
    paths = sorted(KEPT.rglob("*.h5"))
    return {path.relative_to(KEPT): origin_of(path)[1] for path in paths}


@pytest.mark.parametrize("study", BEFORE_AND_NOW)
def test_names_before_and_now(study: str, records_of_02: dict[Path, Mapping[str, Any]]) -> None:
    names = [(one["case"], path.stem) for path, one in records_of_02.items()]
    assert BEFORE_AND_NOW[study] in names


def test_names_of_all_shipped_cases() -> None:
    cases = {case.name: case for case in all_shipped()}
    for name, case in cases.items():
        assert len(f"{name}.h5") + TEMPORARY <= LONGEST_ON_DISK
        assert f"_seed={case.variables['seed']}_" in name
        words = {f"{key}={value}" for key, value in case.variables.items()}
        rest = name.removeprefix(case.deck).rpartition("_")[0]
        for word in sorted(words, key=len, reverse=True):
            rest = rest.replace(f"_{word}", "", 1)
        # Nothing is left but how many words found no room.
        assert re.fullmatch(r"(_\+\d+)?", rest)
    # What a name shows tells one case from another: no two differ in their hash alone.
    assert len({name[: -len(HASH)] for name in cases}) == len(cases)


def test_as_many_variables_as_find_room() -> None:
    """Compared with all choices of those that are not always there."""
    others: dict[str, Any] = {"tolerance_measuring": 1e-06, "dt": 0.02, "steps_agitated": 200}
    others |= {"drag": 0.125, "random_force": 21.2, "container_height": 3.25, "solver": "uzawa"}
    values = {"particles": 1000, **others, "seed": 123}
    words = [f"{name}={value}" for name, value in values.items()]

    def named(chosen: tuple[str, ...]) -> str:
        left = len(words) - len(chosen)
        shown = [word for word in words if word in chosen]
        return "_".join(["spheres", *shown, *([f"+{left}"] if left else []), HASH])

    choices = [
        named(chosen)
        for count in range(len(words) + 1)
        for chosen in itertools.combinations(words, count)
        if {"particles=1000", "seed=123"} <= set(chosen)
    ]
    # One more letter in the longest name that is allowed would be too many for the disk.
    allowed = [name for name in choices if len(f"{name}.h5") + TEMPORARY <= LONGEST_ON_DISK]
    name = name_of([stage_of("spheres", values)], HASH)
    assert name in allowed
    assert name.count("=") == max(each.count("=") for each in allowed) < len(words)


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        ({"x": "y" * 300}, "spheres_particles=1000_seed=1_+1"),
        ({"seed": "1" * 300}, "spheres_particles=1000_+1"),
        ({"x": "a/b c"}, "spheres_particles=1000_seed=1_x=a-b-c"),
        ({"start": "inputs/a.data"}, "spheres_seed=1_start=inputs-a.data"),
    ],
)
def test_odd_values(values: dict[str, Any], shown: str) -> None:
    stage = stage_of("spheres", values, particles=1000, seed=1)
    assert name_of([stage], HASH) == f"{shown}_{HASH}"


def test_a_deck_with_a_long_name_leaves_room_for_the_seed() -> None:
    stages = [stage_of("d" * 200, {"seed": 12}), stage_of("e", {"x": 1}, change="tilt")]
    assert name_of(stages, HASH) == f"{'d' * 30}_seed=12_change=tilt_x=1_{HASH}"


def test_a_record_of_02_has_the_name_of_today(
    records_of_02: dict[Path, Mapping[str, Any]],
) -> None:
    """The files of the stored results have these names, and the records those of 0.2."""
    assert len(records_of_02) > 500
    for path, record in records_of_02.items():
        name, digest = path.stem, path.stem[-len(HASH) :]
        assert name_in(record) == name
        assert name_in({**record, "case": name}) == name
        assert name_before(record["stages"], digest) == record["case"]
    assert any(path.stem != record["case"] for path, record in records_of_02.items())


def test_stored_results_in_the_form_of_02(
    records_of_02: dict[Path, Mapping[str, Any]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A folder `results` of 0.2, with its long names, some of them cut off before the seed."""
    study = read_study(STUDIES_FOLDER / "counting.toml")
    old = tmp_path / "results" / "counting"
    old.mkdir(parents=True)
    long = {
        path: record
        for path, record in records_of_02.items()
        if path.parent.name == "counting" and path.stem != record["case"]
    }
    chosen = dict([*long.items()][::3])
    cases = [case for case in study.cases if any(case.is_of(one, True) for one in chosen.values())]
    assert len(cases) == len(chosen) > 5
    for path, record in chosen.items():
        shutil.copyfile(KEPT / path, old / f"{record['case']}.h5")
    assert any(len(path.stem) > 160 and "seed" not in path.stem for path in old.iterdir())
    page = "lammps_inelastic.workflow.report.report_files"
    monkeypatch.setattr(f"{page}.write_report", lambda *_: None)
    out = tmp_path / "out"
    arguments = ["--stored-only", "--results", str(old.parent), "--out", str(out)]
    assert main(["reproduce", *arguments]) == 0
    assert (
        f"counting: {len(cases)} stored results of {len(study.cases)} taken"
        in capsys.readouterr().out
    )
    (counting,) = (one for one in read_studies(out / "paper.h5") if one.name == "counting")
    assert {one.case for one in counting.results} == {path.stem for path in chosen}
    for case, one in zip(cases, counting.results, strict=True):
        assert case.is_of(one.record, True)
        assert (out / "results" / "counting" / f"{case.name}.h5").is_file()


@pytest.mark.slow
def test_a_run_of_02_is_not_run_again(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = study / "few.toml", study / "out"
    before = numbers_of(out / "few.h5")
    few = read_study(path)
    first, second = few.cases
    assert first.name != first.name_before
    as_version_02_left_it(few, out)
    old = out / "results" / "few" / f"{first.name_before}.h5"
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert "few: 2 there before" in capsys.readouterr().out
    assert same(before, numbers_of(out / "few.h5"))
    # The run is measured again where it is, and run again where only its beginning is left.
    old.unlink()
    run = out / "cases" / second.name_before
    run.rename(run.with_name(f"{run.name}.part"))
    (out / "results" / "few" / f"{second.name_before}.h5").unlink()
    assert main(["status", str(path), "--out", str(out)]) == 0
    assert "1 finished, 1 cut off" in capsys.readouterr().out
    assert main(["run", str(path), "--out", str(out), "--case", first.name_before]) == 0
    assert "few: 1 done" in capsys.readouterr().out
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert "few: 1 done, 1 there before" in capsys.readouterr().out
    assert same(before, numbers_of(out / "few.h5"))
    left = {path.name for path in (out / "cases").iterdir() if path.name != ".locks"}
    assert left == {first.name_before, second.name}


def test_a_case_in_an_old_file_and_in_a_new_one_counts_once(study: Path) -> None:
    few = read_study(study / "few.toml")
    shutil.copyfile(study / "out" / "few.h5", study / "new.h5")
    as_version_02_left_it(few, study / "out")
    data = read_data([study / "out" / "few.h5", study / "new.h5"])
    assert len(data.studies["few"].results) == len(few.cases)


def test_two_cases_with_one_name_are_refused(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    """One of them would be left out; a search has found two values whose hashes are the same."""
    (tmp_path / "own.in").write_text("variable x index 1\n")
    values = [f"{'y' * 100}{number}" for number in (19825, 74778, 19825)]
    head = 'title = "t"\ndeck = "own.in"\n[parameters]\n'
    path = write_study(f"{head}x = {values[:1]}\n[[rows]]\n[[rows]]\n")
    (case,) = read_study(path).cases
    with pytest.raises(StudyError) as caught:
        read_study(write_study(f"{head}x = {values}"))
    (line,) = caught.value.mistakes
    assert line == (
        f"{path}: parameters: two cases have the name {case.name}, whose hash is the same by "
        "chance; leave out one of them (at line 3)"
    )
