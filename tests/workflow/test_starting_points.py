"""Decks and studies to begin with, and what `inelastic` says to somebody who begins."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from lammps_inelastic.workflow.cli.command_line import PAGE, SUBCOMMANDS
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.shipped import DECKS, PACK, STUDIES_FOLDER
from lammps_inelastic.workflow.study import read_study

COMMANDS = [module.__name__.rpartition(".")[2] for module in SUBCOMMANDS]
INPUTS = STUDIES_FOLDER.parent
ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", ["minimal", *DECKS, PACK])
def test_a_deck_is_printed_to_the_byte(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    for given in (name, f"{name}.in"):
        assert main(["deck", given]) == 0
        assert capsys.readouterr().out.encode() == (INPUTS / f"{name}.in").read_bytes()


def test_the_decks_are_listed_with_what_they_show(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["deck"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert {line.split()[0] for line in lines} == {path.stem for path in INPUTS.glob("*.in")}
    for line in lines:
        name, words = line.split(maxsplit=1)
        assert (INPUTS / f"{name}.in").read_text().startswith(f"# {words}")
        assert len(line) <= 100


def test_no_deck_of_that_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["deck", "sphere"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("inelastic: no deck 'sphere' (did you mean spheres?): it must be ")
    assert line.endswith("settling or pack")


def test_a_new_study_can_be_read_and_is_not_overwritten(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The command that is printed runs it: here without its runs."""
    assert main(["new", "my-study.toml"]) == 0
    written, following = capsys.readouterr().out.splitlines()
    assert written == "Written: my-study.toml"
    command = shlex.split(following.removeprefix("Next: inelastic "))
    assert command == ["run", "my-study.toml", "--out", "my-study"]
    assert main([*command, "--dry-run"]) == 0
    printed = capsys.readouterr()
    assert printed.out.count("lmp") == 6
    # Its box lies in the bed, and nothing else is warned of.
    assert printed.err == ""
    study = read_study(Path("my-study.toml"))
    assert len(study.cases) == 6
    Path("my-study.toml").write_text("mine")
    assert main(["new", "my-study.toml"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "my-study.toml: is there already, and is not overwritten" in line
    assert Path("my-study.toml").read_text() == "mine"


@pytest.mark.slow
def test_a_new_study_runs_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "mine.toml"]) == 0
    command = shlex.split(capsys.readouterr().out.splitlines()[-1].removeprefix("Next: inelastic "))
    assert main(command) == 0
    assert main(["report", "mine/mine.h5"]) == 0
    assert Path("report.html").stat().st_size > 1000


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("study.txt", "study.txt: the name of a study's file must end in .toml"),
        ("study", "study: the name of a study's file must end in .toml"),
        ("a\nb.toml", "must begin with a letter or a digit"),
        (".hidden.toml", "must begin with a letter or a digit"),
        ("no/folder.toml", "no/folder.toml: cannot be written"),
        ("folder.toml", "folder.toml: is there already"),
    ],
)
def test_where_no_study_can_be_written(
    name: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("folder.toml").mkdir()
    assert main(["new", name]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line
    assert not Path(name).is_file()


@pytest.mark.parametrize("command", ["validate", "run", "status", "collect", "slurm"])
def test_a_study_file_that_is_not_there(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "my-study.toml"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(
        "inelastic: no study my-study.toml: it must be a TOML file that is there (`inelastic new "
        "my-study.toml` writes one) or counting, "
    )
    assert main([command, "table_1.toml"]) == 2
    assert "(did you mean table-1?)" in capsys.readouterr().err


def test_without_a_command_the_help_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    alone = capsys.readouterr()
    assert alone.err == ""
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    assert capsys.readouterr().out == alone.out
    for command in COMMANDS:
        assert re.search(rf"^    {command}\s", alone.out, re.MULTILINE)


@pytest.mark.parametrize("command", COMMANDS)
def test_each_help_names_the_page_of_the_commands(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    text = capsys.readouterr().out
    assert (ROOT / PAGE).is_file()
    assert PAGE in text.splitlines()[-1]
    assert max(map(len, text.splitlines())) <= 100
