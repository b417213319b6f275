"""Which code a result is of: versions with commits, hashes, and what is said of them."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
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
from lammps_inelastic.workflow.results.store import Result, read_result, write_result
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
