"""Which code a result is of: versions with commits, hashes, and what is said of them."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lammps_inelastic import plugin
from lammps_inelastic.workflow.errors import WorkflowError
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.provenance.build_version import (
    dynamic_metadata,
    version_now,
    version_of,
)
from lammps_inelastic.workflow.provenance.run_record import code, differs
from lammps_inelastic.workflow.provenance.same_runs import FILE, SameRuns, same_runs
from lammps_inelastic.workflow.report.sections.provenance import codes_line
from lammps_inelastic.workflow.results.store import Result, origin_of, read_result, write_result
from lammps_inelastic.workflow.running.folder import Folder
from lammps_inelastic.workflow.running.gather import adopt_results, gather_results
from lammps_inelastic.workflow.study import read_study


def git(folder: Path, *arguments: str) -> str:
    identity = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
    command = ["git", *identity, *arguments]
    return subprocess.run(
        command, cwd=folder, check=True, capture_output=True, text=True
    ).stdout.strip()


def repository(folder: Path) -> Path:
    folder.mkdir()
    (folder / "file").write_text("one\n")
    git(folder, "init", "-q")
    git(folder, "add", "file")
    git(folder, "commit", "-q", "-m", "first")
    return folder


def test_the_command_line_says_which_code_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """With the words that stand in each result."""
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith(f"lammps-inelastic {code()['version']} (fix {code()['sources'][:12]}, ")


def test_a_version_holds_the_commit_and_whether_a_file_differs(tmp_path: Path) -> None:
    root = repository(tmp_path / "clone")
    commit = git(root, "rev-parse", "--short=10", "HEAD")
    assert version_of(root, "0.2.0") == f"0.2.0+g{commit}"
    # Files that git does not track, such as runs, change nothing.
    (root / "out").write_text("")
    assert version_of(root, "0.2.0") == f"0.2.0+g{commit}"
    (root / "file").write_text("two\n")
    assert version_of(root, "0.2.0") == f"0.2.0+g{commit}.modified"


def test_without_git_a_version_is_that_of_the_distribution_or_unknown(tmp_path: Path) -> None:
    # A folder inside of another repository is not that repository.
    inside = repository(tmp_path / "other") / "unpacked"
    inside.mkdir()
    assert version_of(inside, "0.2.0") == "0.2.0+unknown"
    (inside / "PKG-INFO").write_text("Metadata-Version: 2.2\nVersion: 0.2.0+gabc\n")
    assert version_of(inside, "0.2.0") == "0.2.0+gabc"


def test_the_build_asks_for_the_version_of_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(repository(tmp_path / "clone"))
    (found,) = dynamic_metadata({"release": "9.8"}, {}).values()
    assert found.startswith("9.8+g")


def test_an_installed_package_keeps_its_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "lammps_inelastic" / "workflow" / "provenance" / "build_version.py"
    monkeypatch.setattr("lammps_inelastic.workflow.provenance.build_version.__file__", str(file))
    assert version_now("0.2.0+gabc.modified") == "0.2.0+gabc.modified"


@pytest.fixture(scope="module")
def few(two_cases: Path) -> Path:
    """Return the folder of a study of two cases."""
    return two_cases


def results_of(few: Path) -> list[Path]:
    return sorted((few / "out" / "results" / "few").glob("*.h5"))


def made_by(path: Path, **changes: Any) -> Result:
    """Write a result again, as if by other code; return it."""
    result = read_result(path)
    record = json.loads(json.dumps(dict(result.record))) | changes
    other = Result(result.values, result.pictures, record, result.outputs)
    write_result(path, other)
    return other


def test_a_result_holds_the_version_and_hashes_of_plugin_and_sources(few: Path) -> None:
    record = read_result(results_of(few)[0]).record
    bytes_of_plugin = Path(plugin.plugin_file()).read_bytes()
    assert record["code"]["plugin"] == hashlib.sha256(bytes_of_plugin).hexdigest()
    assert record["code"]["sources"] == plugin.build()["sources"]
    assert record["code"]["version"] == record["versions"]["lammps-inelastic"]
    assert record["measured by"] == record["code"]["version"]
    assert "+g" in record["code"]["version"] or record["code"]["version"].endswith("+unknown")
    (case, _) = read_study(few / "few.toml").cases
    assert record["fingerprint"] == case.fingerprint


def test_results_of_other_code_are_kept_and_named(
    few: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(few, tmp_path / "few")
    folder = tmp_path / "few"
    path = results_of(folder)[0]
    arguments = [str(folder / "few.toml"), "--out", str(folder / "out")]
    assert main(["status", *arguments]) == 0
    assert "other versions" not in capsys.readouterr().out
    # Version 0.1 noted its version alone.
    old = {"versions": {**code(), "lammps-inelastic": "0.1.0"}, "code": {}}
    made_by(path, **old)
    assert main(["status", *arguments]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "by version 0.1.0 of the fix" in said
    assert "1 result is of other versions of the fix or of the decks; they are kept" in said
    # So does a run, which does not make it again.
    assert main(["run", *arguments]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "2 there before" in said
    assert "1 result is of other versions" in said
    assert "0.1.0" in codes_line([read_result(one) for one in results_of(folder)])


def test_stored_results_of_other_code_are_not_taken(
    few: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "kept" / "few"
    shutil.copytree(few / "out" / "results" / "few", kept)
    first, second = sorted(kept.glob("*.h5"))
    made_by(first, code={**code(), "sources": "another"})
    study = read_study(few / "few.toml")
    assert adopt_results(study, Folder(tmp_path / "out"), tmp_path / "kept") == 1
    assert "not taken: 1, of other versions" in capsys.readouterr().out
    folder = Folder(tmp_path / "any")
    assert adopt_results(study, folder, tmp_path / "kept", of_any_code=True) == 2
    # A result that was measured in another way is not what the study asks for, whoever made it.
    result = read_result(second)
    write_result(second, Result(result.values, {}, result.record, "{}"))
    folder = Folder(tmp_path / "third")
    assert adopt_results(study, folder, tmp_path / "kept", of_any_code=True) == 1


def test_stored_results_of_a_deck_with_another_default_are_taken_if_asked(
    few: Path, tmp_path: Path
) -> None:
    """What neither the study nor the run has set may have changed; what one of them set may not."""
    kept = tmp_path / "kept"
    shutil.copytree(few / "out" / "results" / "few", kept / "few")
    first, second = sorted((kept / "few").glob("*.h5"))
    for path, is_set in ((first, False), (second, True)):
        stages = json.loads(json.dumps(read_result(path).record["stages"]))
        stages[0]["variables"]["solver"] = "another"
        if is_set:
            stages[0]["values"]["solver"] = "another"
        made_by(path, stages=stages)
    study = read_study(few / "few.toml")
    assert adopt_results(study, Folder(tmp_path / "todays"), kept) == 0
    folder = Folder(tmp_path / "any")
    assert adopt_results(study, folder, kept, of_any_code=True) == 1
    assert len(gather_results(study, folder, of_any_code=True).results) == 1
    assert gather_results(study, folder).results == []
    # It is there already.
    assert adopt_results(study, folder, kept, of_any_code=True) == 0


def with_common_phases(few: Path, folder: Path) -> Path:
    """Write the study of two cases with its numbers of steps as common values; return its path."""
    text = (few / "few.toml").read_text()
    steps = "".join(line for line in text.splitlines(True) if line.startswith("steps_"))
    assert steps.count("\n") == 5
    path = folder / "few.toml"
    path.write_text(text.replace(steps, "") + f"[common]\n{steps}")
    return path


def test_a_stored_result_of_another_name_is_found_by_its_record(
    few: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The study states as common values now what it had set, and so names have changed."""
    path = with_common_phases(few, tmp_path)
    study, before = read_study(path), read_study(few / "few.toml")
    assert {case.name for case in study.cases}.isdisjoint(case.name for case in before.cases)
    out = tmp_path / "out"
    assert adopt_results(study, Folder(out), few / "out" / "results") == 2
    for case, one in zip(study.cases, before.cases, strict=True):
        kept = few / "out" / "results" / "few" / f"{one.name}.h5"
        copy = out / "results" / "few" / f"{case.name}.h5"
        assert copy.read_bytes() == kept.read_bytes()
    results = gather_results(study, Folder(out)).results
    assert [one.case for one in results] == [case.name for case in before.cases]
    # They are there, and nothing is run, or counted as of another code.
    capsys.readouterr()
    assert main(["run", str(path), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "few: 2 there before" in said
    assert "other versions" not in said
    assert main(["status", str(path), "--out", str(out)]) == 0
    assert "few: 2 measured" in capsys.readouterr().out
    assert adopt_results(study, Folder(out), few / "out" / "results") == 0


def test_each_record_is_read_once_and_a_damaged_one_is_named_once(
    few: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "kept"
    shutil.copytree(few / "out" / "results" / "few", kept / "few")
    damaged = kept / "few" / "a.h5"
    damaged.write_bytes(b"damaged")
    read: list[Path] = []

    def counted(path: Path) -> tuple[str, Any]:
        read.append(path)
        return origin_of(path)

    monkeypatch.setattr("lammps_inelastic.workflow.running.kept_results.origin_of", counted)
    study = read_study(with_common_phases(few, tmp_path))
    assert adopt_results(study, Folder(tmp_path / "out"), kept, of_any_code=True) == 2
    assert sorted(read) == sorted((kept / "few").glob("*.h5"))
    assert capsys.readouterr().out.count(f"not taken: {damaged}: ") == 1


def with_a_copy(path: Path, record: dict[str, Any]) -> None:
    """Leave two results of one case."""
    del record
    shutil.copyfile(path, path.with_name("copy.h5"))


def without_a_variable(_path: Path, record: dict[str, Any]) -> None:
    del record["stages"][0]["variables"]["dump_every"]


def with_an_unknown_variable(_path: Path, record: dict[str, Any]) -> None:
    for part in ("variables", "values"):
        record["stages"][0][part]["friction"] = 0.5


def of_another_deck(_path: Path, record: dict[str, Any]) -> None:
    record["stages"][0]["deck"] = "dimers"


def of_another_value(_path: Path, record: dict[str, Any]) -> None:
    record["stages"][0]["variables"]["solver"] = "another"


def of_two_stages(_path: Path, record: dict[str, Any]) -> None:
    record["stages"] *= 2


@pytest.mark.parametrize(
    ("change", "taken"),
    [
        (with_a_copy, 2),
        # The study sets it: what the run had instead is not known.
        (without_a_variable, 1),
        (with_an_unknown_variable, 1),
        (of_another_deck, 1),
        (of_another_value, 1),
        (of_two_stages, 1),
    ],
)
def test_which_records_are_of_a_case(
    change: Callable[[Path, dict[str, Any]], None], taken: int, few: Path, tmp_path: Path
) -> None:
    """What one has set, the other must know; one result is taken for one case."""
    kept = tmp_path / "kept"
    shutil.copytree(few / "out" / "results" / "few", kept / "few")
    path = sorted((kept / "few").glob("*.h5"))[0]
    record = json.loads(json.dumps(dict(read_result(path).record)))
    change(path, record)
    made_by(path, **record)
    study = read_study(with_common_phases(few, tmp_path))
    assert adopt_results(study, Folder(tmp_path / "out"), kept) == taken


def test_a_result_under_the_name_of_another_case_is_not_taken_for_one(
    few: Path, tmp_path: Path
) -> None:
    """Files of studies know results by their names, and would lose one of the two."""
    kept = tmp_path / "kept"
    shutil.copytree(few / "out" / "results" / "few", kept / "few")
    first = read_study(few / "few.toml").cases[0]
    path = kept / "few" / f"{first.name}.h5"
    stages = json.loads(json.dumps(read_result(path).record["stages"]))
    # As if 7 had been the default before.
    stages[0]["variables"]["drag"] = 7
    made_by(path, stages=stages)
    text = (few / "few.toml").read_text().replace("[1, 2]", "1")
    both = tmp_path / "few.toml"
    both.write_text(f"{text}\n[[rows]]\n[[rows]]\ndrag = 7\n")
    assert adopt_results(read_study(both), Folder(tmp_path / "both"), kept) == 0
    # Alone it is that of the case with the value that it had.
    both.write_text(f"{text}\n[[rows]]\ndrag = 7\n")
    assert adopt_results(read_study(both), Folder(tmp_path / "one"), kept) == 1


def test_what_has_all_values_comes_before_what_had_other_defaults(
    few: Path, tmp_path: Path
) -> None:
    """Both are of the case where any code will do."""
    kept = tmp_path / "kept"
    shutil.copytree(few / "out" / "results" / "few", kept / "few")
    path = results_of(few)[0]
    stages = json.loads(json.dumps(read_result(path).record["stages"]))
    stages[0]["variables"]["drag"] = 7
    other = kept / "few" / "a.h5"
    shutil.copyfile(path, other)
    made_by(other, stages=stages)
    study = read_study(with_common_phases(few, tmp_path))
    folder = Folder(tmp_path / "out")
    assert adopt_results(study, folder, kept, of_any_code=True) == 2
    assert all(one.variables["drag"] != 7 for one in gather_results(study, folder).results)


def test_a_case_with_a_file_knows_its_results_by_their_names(few: Path, tmp_path: Path) -> None:
    """A record does not tell what was in the file."""
    kept = tmp_path / "kept"
    shutil.copytree(few / "out" / "results" / "few", kept / "few")
    (tmp_path / "my.data").write_text("")
    path = results_of(few)[0]
    stages = json.loads(json.dumps(read_result(path).record["stages"]))
    for part in ("variables", "values"):
        stages[0][part] |= {"start": "inputs/my.data", "particles": 1000}
    text = (few / "few.toml").read_text().replace("particles = 30\n", "start = './my.data'\n")
    (tmp_path / "few.toml").write_text(text.replace("[1, 2]", "1"))
    study = read_study(tmp_path / "few.toml")
    made_by(kept / "few" / path.name, stages=stages)
    assert study.cases[0].is_of({"stages": stages}, of_any_code=True)
    out = Folder(tmp_path / "out")
    assert adopt_results(study, out, kept, of_any_code=True) == 0
    (kept / "few" / path.name).rename(kept / "few" / f"{study.cases[0].name}.h5")
    assert adopt_results(study, out, kept, of_any_code=True) == 1


def test_stored_results_of_a_fix_with_the_same_runs_are_taken(few: Path, tmp_path: Path) -> None:
    """Only where the folder names both, the fix that made them and today's, as of the same runs."""
    kept = tmp_path / "kept"
    shutil.copytree(few / "out" / "results" / "few", kept / "few")
    for result in (kept / "few").glob("*.h5"):
        made_by(result, code={**code(), "sources": "earlier"})
    study = read_study(few / "few.toml")
    todays = code()["sources"]
    for number, (made, same, count) in enumerate(
        [
            ("earlier", [todays], 2),
            ("first", ["earlier", todays], 2),
            ("another", [todays], 0),
            ("earlier", ["later"], 0),
        ]
    ):
        (kept / FILE).write_text(f'made_by = "{made}"\nsame = {json.dumps(same)}\n')
        assert adopt_results(study, Folder(tmp_path / str(number)), kept) == count


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("made_by = ", "cannot be read"),
        ('made_by = "a"', "made_by must be a hash of sources, and same a list of hashes"),
        ('made_by = "a"\nsame = [1]', "made_by must be a hash of sources, and same a list of"),
        ('made_by = "a"\nsame = []\ndecks = 1', "decks must be lists of fingerprints by the names"),
        ('made_by = "a"\nsame = []\ndecks = {a = "b"}', "decks must be lists of fingerprints"),
        ('same = ["a"]', "made_by must be a hash of sources, and same a list of hashes"),
    ],
)
def test_a_file_of_same_runs_that_is_not_as_it_must_be(
    content: str, said: str, tmp_path: Path
) -> None:
    (tmp_path / FILE).write_text(content)
    with pytest.raises(WorkflowError, match=re.escape(f"{tmp_path / FILE}: {said}")):
        same_runs(tmp_path)


def test_a_changed_deck_is_other_code(few: Path) -> None:
    (case, _) = read_study(few / "few.toml").cases
    record = dict(read_result(results_of(few)[0]).record)
    assert differs(case, record) == ""
    assert differs(case, {**record, "fingerprint": "0"}) == "another version of the deck"
    known = SameRuns(decks={case.deck: ("0",)})
    assert differs(case, {**record, "fingerprint": "0"}, known) == ""
    assert differs(case, {**record, "fingerprint": "0+0"}, known) == "another version of the deck"
    other = SameRuns(decks={"other": ("0",)})
    assert differs(case, {**record, "fingerprint": "0"}, other) == "another version of the deck"


def test_the_report_says_whether_packings_are_of_one_code(few: Path) -> None:
    (one, other) = (read_result(path) for path in results_of(few))
    version = code()["version"]
    assert codes_line([one, other]) == f"All packings are of version {version}."
    assert codes_line([]) == ""

    def of(version: str, sources: str) -> Result:
        record = {
            **other.record,
            "versions": {**other.record["versions"], "lammps-inelastic": version},
            "code": {"sources": sources},
        }
        return Result(other.values, {}, record, other.outputs)

    same = codes_line([one, of("0.2.0+gb", code()["sources"])])
    assert "several versions, all with the same fix" in same
    assert "0.2.0+gb (1)" in same
    assert codes_line([one, of("0.2.0+gb", "x")]).startswith(
        "The packings are of several versions of the fix: "
    )
