"""What is shipped, where stored results are looked for, and decks as their page has them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lammps_inelastic.workflow.decks import Deck, as_value
from lammps_inelastic.workflow.errors import WorkflowError
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.shipped import (
    DECKS,
    PACK,
    QUICK_FOLDER,
    RESULTS_VARIABLE,
    STUDIES,
    STUDIES_FOLDER,
    deck_text,
    find_stored_results,
    shipped_studies,
)

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Start in a folder without results, and in an environment that names none."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(RESULTS_VARIABLE, raising=False)


def stored(folder: Path) -> Path:
    (folder / STUDIES[0]).mkdir(parents=True)
    return folder


def test_every_study_of_the_paper_is_shipped() -> None:
    assert shipped_studies().keys() == set(STUDIES)
    for folder in (STUDIES_FOLDER, QUICK_FOLDER):
        assert {path.stem for path in folder.glob("*.toml")} == set(STUDIES)


def test_results_are_no_part_of_the_package() -> None:
    assert not list(STUDIES_FOLDER.rglob("*.h5"))


def test_results_are_those_of_the_folder_of_the_start(tmp_path: Path) -> None:
    results = stored(tmp_path / "results")
    assert find_stored_results() == results


def test_a_named_folder_comes_before_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored(tmp_path / "results")
    monkeypatch.setenv(RESULTS_VARIABLE, str(stored(tmp_path / "named")))
    assert find_stored_results() == tmp_path / "named"
    assert find_stored_results(stored(tmp_path / "chosen")) == tmp_path / "chosen"


def test_without_results_one_line_says_where_they_were_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # The program runs from no clone.
    package = tmp_path / "lammps_inelastic" / "workflow" / "shipped.py"
    monkeypatch.setattr("lammps_inelastic.workflow.shipped.__file__", str(package))
    # A folder for runs of one's own may have this name, too.
    (tmp_path / "results" / "cases").mkdir(parents=True)
    assert main(["reproduce", "--stored-only", "--out", "paper"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"inelastic: no stored results in {tmp_path / 'results'}")
    assert f"--results or {RESULTS_VARIABLE}" in line
    assert not (tmp_path / "paper").exists()
    with pytest.raises(WorkflowError, match="no stored results in chosen: "):
        find_stored_results(Path("chosen"))
    stored(tmp_path / "other")
    # A folder that is named and is wrong is not passed over.
    monkeypatch.setenv(RESULTS_VARIABLE, "named")
    with pytest.raises(WorkflowError, match="no stored results in named: "):
        find_stored_results()


def test_results_are_for_stored_ones_only(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "--quick", "--results", "anywhere"]) == 2
    assert "only --stored and --stored-only take results" in capsys.readouterr().err


ROW = re.compile(r"^\| `(\w+)` \| (\S+) \| ?[^|]* \| ([^|]+) \|$", re.MULTILINE)
RANGE = re.compile(r"\bfrom (-?[\d.e-]+)(?: \([^)]*\))? to (below )?([\d.e]+)")
MOST = re.compile(r"\bup to ([\d.e]+)(?![\d.e]*\w)")


# A deck's table names what is not as in the table of another one.
TABLE_OF = {
    "dimers": "spheres",
    "clusters": "dimers",
    "response": "spheres",
    "gluey": "spheres",
    "pack": "spheres",
}


def shipped_deck(name: str) -> Deck:
    return Deck(name, deck_text(name), shipped=True)


def documented(name: str) -> list[tuple[str, str, str]]:
    """Return the rows of a deck's tables on its page: variable, default and meaning."""
    document = (ROOT / "docs" / "reference" / "decks.md").read_text()
    (section,) = re.findall(rf"^## {name}\.in\n(.*?)(?=^## |\Z)", document, re.M | re.S)
    tables = re.findall(r"^\| name \|.*?(?=\n\n|\Z)", section, re.M | re.S)
    return [row for table in tables for row in ROW.findall(table)]


@pytest.mark.parametrize("name", [*DECKS, PACK])
def test_the_documentation_has_every_variable(name: str) -> None:
    """With the deck's default, in its own table or in that of the deck that it refers to."""
    defaults: dict[str, str] = {}
    table: str | None = name
    while table is not None:
        defaults = {variable: default for variable, default, _ in documented(table)} | defaults
        table = TABLE_OF.get(table)
    for variable, default in shipped_deck(name).variables.items():
        assert as_value(defaults[variable]) == default, variable


@pytest.mark.parametrize("name", [*DECKS, PACK])
def test_the_tables_of_the_documentation_are_those_of_the_deck(name: str) -> None:
    """Names, defaults, words and the ends of ranges in docs/reference/decks.md."""
    deck = shipped_deck(name)
    rows = documented(name)
    assert len(rows) >= 4
    for variable, default, meaning in rows:
        assert variable in deck.variables
        assert as_value(default) == deck.variables[variable], variable
        rule = deck.rules[variable]
        for word in rule.words:
            assert word in meaning, (variable, word)
        for low, below, high in RANGE.findall(meaning):
            assert rule.low is not None
            assert rule.high is not None
            assert (low, high) == (rule.low.text, rule.high.text), variable
            assert rule.low.included
            assert rule.high.included is not bool(below), variable
        for most in MOST.findall(meaning):
            assert rule.high is not None
            assert (most, rule.high.included) == (rule.high.text, True), variable
