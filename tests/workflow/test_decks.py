"""Decks as a study sees them: their table of parameters, or plain lines of variables."""

from __future__ import annotations

from pathlib import Path

import pytest

from lammps_inelastic.workflow.decks import Deck, as_value, find_deck, gravity_of, read_rule
from lammps_inelastic.workflow.errors import StudyError
from lammps_inelastic.workflow.shipped import DECKS
from lammps_inelastic.workflow.study import read_study

TABLE = '''# My own
parameters """
  # Comments of their own
  grains   50      integer >= 1           # how many
  shake    0.5     number >= 0 <= 2       # [length/time^2]
  start    lattice lattice or file        # where they are
                                          # at first
  out      out     folder
"""
variable radius equal 0.5
variable pass index 1 2
'''


def mistakes_of(folder: Path, parameters: str, deck: str = TABLE) -> list[str]:
    (folder / "own.in").write_text(deck)
    path = folder / "study.toml"
    path.write_text(f'title = "t"\ndeck = "own.in"\n[parameters]\n{parameters}\n')
    try:
        read_study(path)
    except StudyError as error:
        return [line.removeprefix(f"{path}: ") for line in error.mistakes]
    return []


def test_an_own_deck_with_a_table(tmp_path: Path) -> None:
    (tmp_path / "own.in").write_text(TABLE)
    deck = find_deck("own.in", tmp_path)
    assert deck.variables == {"grains": 50, "shake": 0.5, "start": "lattice", "out": "out"}
    assert deck.parameters == {"grains": 50, "shake": 0.5, "start": "lattice"}
    assert deck.rules["grains"] == read_rule("integer >= 1")
    assert deck.rules["start"] == read_rule("lattice or file")


def test_an_own_deck_without_a_table(tmp_path: Path) -> None:
    (tmp_path / "own.in").write_text("variable x index 1.5 # what\nvariable y equal 2\n")
    deck = find_deck("own.in", tmp_path)
    assert deck.variables == {"x": 1.5}
    assert deck.rules == {}
    assert mistakes_of(tmp_path, 'x = "anything"', deck.text) == []


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ("grains = 0", "grains: 0 is not allowed: it must be a whole number from 1 to 2147483647"),
        ("grains = 1.5", "grains: 1.5 is not allowed: it must be a whole number from 1 to"),
        ('grains = "5"', "grains: '5' is not allowed: it must be a whole number from 1 to"),
        ("grains = 2147483648", "is not allowed: it must be a whole number from 1 to 2147483647"),
        ("shake = 2.5", "shake: 2.5 is not allowed: it must be a number from 0 to 2"),
        ('start = "no.data"', "it must be lattice or a file that is there"),
        ("pass = 2", "parameters.pass: no variable of that name; allowed are own: grains, shake"),
    ],
)
def test_a_table_of_the_users_own_is_checked_too(
    parameters: str, message: str, tmp_path: Path
) -> None:
    (line,) = mistakes_of(tmp_path, parameters)
    assert message in line


def test_a_word_comes_before_a_file_of_its_name(tmp_path: Path) -> None:
    """A file named like the word is no input; one of another name is, or in a folder."""
    (tmp_path / "lattice").write_text("")
    (tmp_path / "own.data").write_text("")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "lattice").write_text("")
    assert mistakes_of(tmp_path, 'start = ["lattice", "own.data", "sub/lattice"]') == []
    word, file, other = read_study(tmp_path / "study.toml").cases
    assert word.inputs == {}
    assert [one.path for one in file.inputs.values()] == [tmp_path / "own.data"]
    assert [one.path for one in other.inputs.values()] == [tmp_path / "sub" / "lattice"]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("x 1", "it must be name, default and what is allowed"),
        ("x-y 1 number", "its name is no name, or there twice"),
        ("x 1 number\nx 1 number", "its name is no name, or there twice"),
        ("x 1 number >", "the bounds must be"),
        ("x 1 number > a", "the bounds must be"),
        ("x 1 number > 1 >= 2", "the bounds must be"),
        ("x 1 number 1", "the bounds must be"),
        ("x 1 integer > 1e999", "the bounds must be"),
        ("x 1 one two", 'words with "or" between them'),
        ("x 1 one or", 'words with "or" between them'),
        ("x 1 or", 'words with "or" between them'),
    ],
)
def test_a_table_that_cannot_be_read(line: str, message: str, tmp_path: Path) -> None:
    (mistake,) = mistakes_of(tmp_path, "", f'parameters """\n{line}\n"""\n')
    assert mistake.startswith("deck: ")
    assert "own.in: a line of its parameters: x" in mistake
    assert message in mistake


@pytest.mark.parametrize("name", DECKS)
def test_shipped_decks_state_rules_that_their_defaults_keep(name: str) -> None:
    deck = find_deck(name, Path())
    assert deck.rules.keys() == deck.variables.keys() > {"out", "diameter"}
    for each, value in deck.parameters.items():
        assert deck.rules[each].accepts(value), each


def test_comments_in_a_table_do_not_change_a_deck() -> None:
    before = Deck("own", TABLE, shipped=False).fingerprint
    other = TABLE.replace("# how many", "# of them").replace("  grains  ", " grains ")
    assert Deck("own", other, shipped=False).fingerprint == before
    assert Deck("own", TABLE.replace("50", "51"), shipped=False).fingerprint != before


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("variable gravity equal 9.81", 9.81),
        ("units lj\nvariable  gravity\tequal 1e-3  # along -y\n", 1e-3),
        ("variable gravity equal -9.81", -9.81),
        ("variable gravity equal 9.81*2", None),
        ("variable gravity equal v_g", None),
        ("variable gravity equal 1.2.3", None),
        ("variable gravity equal 0", None),
        ("variable gravity equal inf", None),
        ("variable gravity index 9.81", None),
        ("", None),
    ],
)
def test_gravity_is_a_number_or_not_known(text: str, expected: float | None) -> None:
    assert gravity_of(text) == expected


@pytest.mark.parametrize("text", ["1" + "0" * 22, "-" + "9" * 400, str(2**63), "1e999", "nan"])
def test_numbers_that_no_computer_number_holds_stay_words(text: str) -> None:
    """A deck's default of 22 digits is kept as it is written, and a larger one ends nothing."""
    assert as_value(text) == text
    assert as_value(str(2**63 - 1)) == 2**63 - 1
    assert as_value("1e22") == 1e22


@pytest.mark.parametrize("time", ["1e-15", "9e-7"])
def test_frames_closer_than_any_time_step_are_refused(time: str, tmp_path: Path) -> None:
    """LAMMPS loses frames, and lines of the log, where they are as close as round-off."""
    study = tmp_path / "study.toml"
    head = 'title = "t"\ndeck = ["spheres", "settling"]\n'
    study.write_text(f"{head}[parameters]\ntime_between = [1e-6, {time}]\n")
    with pytest.raises(StudyError, match=r"time_between: .* is not allowed: .* at least 1e-6"):
        read_study(study)
