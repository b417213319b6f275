"""The table [common] of a study file: whose values it gives, which names show it, its mistakes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from lammps_inelastic.workflow.decks import find_deck
from lammps_inelastic.workflow.errors import StudyError
from lammps_inelastic.workflow.study import Case, read_study

HEAD = 'title = "t"\ndeck = "spheres"\n'
TURN = 'title = "t"\ndeck = ["spheres", "response"]\n'
# None of these is a default of a deck.
COMMON = "[common]\ndt = 0.0125\nsteps_agitated = 333\n"

Writer = Callable[..., Path]


def words_of(case: Case) -> str:
    """Return the name of a case without its hash."""
    return case.name.rpartition("_")[0]


def test_common_values_are_set_and_not_shown(write_study: Writer) -> None:
    (case,) = read_study(write_study(HEAD + COMMON)).cases
    (plain,) = read_study(write_study(HEAD)).cases
    assert (case.variables["dt"], case.variables["steps_agitated"]) == (0.0125, 333)
    assert case.stages[0].values == {"dt": 0.0125, "steps_agitated": 333}
    (command,) = case.commands()
    for words in ("-var dt 0.0125", "-var steps_agitated 333"):
        assert words in " ".join(command)
    # They make another case, though.
    assert words_of(case) == words_of(plain) == "spheres_particles=1000_seed=1"
    assert case.name != plain.name
    assert case.identity != plain.identity


def test_the_same_values_are_one_case_wherever_they_stand(write_study: Writer) -> None:
    """So the hash is the same, too; the name shows what is not common to all."""
    (common,) = read_study(write_study(HEAD + "[common]\ndt = 0.0125")).cases
    (stated,) = read_study(write_study(HEAD + "[parameters]\ndt = 0.0125")).cases
    assert common.identity == stated.identity
    assert words_of(stated) == "spheres_particles=1000_dt=0.0125_seed=1"
    assert common.name.rpartition("_")[2] == stated.name.rpartition("_")[2]


def test_parameters_and_rows_come_before_common_values(write_study: Writer) -> None:
    default = find_deck("spheres", Path()).parameters["dt"]
    rows = f"[[rows]]\n[[rows]]\ndt = 0.03\n[[rows]]\ndt = {default}\n[[rows]]\ndt = 0.0125\n"
    text = HEAD + COMMON + "[parameters]\nsteps_agitated = 444\n" + rows
    cases = read_study(write_study(text)).cases
    # The last row gives what is common: it is the case of the first.
    assert [case.variables["dt"] for case in cases] == [0.0125, 0.03, default]
    assert all(case.variables["steps_agitated"] == 444 for case in cases)
    # Also a default of the deck is shown where it is not what the cases have in common.
    assert [words_of(case) for case in cases] == [
        "spheres_particles=1000_steps_agitated=444_seed=1",
        "spheres_particles=1000_dt=0.03_steps_agitated=444_seed=1",
        f"spheres_particles=1000_dt={default}_steps_agitated=444_seed=1",
    ]


def test_what_is_always_shown_is_shown(write_study: Writer) -> None:
    (case,) = read_study(write_study(HEAD + "[common]\nparticles = 2000\nseed = 7")).cases
    assert words_of(case) == "spheres_particles=2000_seed=7"


def test_each_deck_takes_what_it_has(write_study: Writer) -> None:
    text = TURN + COMMON + "angle = 12\n[common.response]\ndt = 0.015\n"
    (case,) = read_study(write_study(text)).cases
    first, second = case.stages
    assert first.values == {"dt": 0.0125, "steps_agitated": 333}
    assert second.values == {"dt": 0.015, "angle": 12}
    # A parameter is one of both decks.
    (case,) = read_study(write_study(text + "[parameters]\ndt = 0.011")).cases
    assert [stage.values["dt"] for stage in case.stages] == [0.011, 0.011]
    assert words_of(case) == "spheres+response_particles=1000_dt=0.011_seed=1_change=walls"


def test_decks_of_rows(write_study: Writer) -> None:
    text = HEAD + COMMON + "aspect_ratio = 1.7\n[common.dimers]\ndt = 0.0375\n"
    cases = read_study(write_study(text + '[[rows]]\n[[rows]]\ndeck = "dimers"\n')).cases
    assert [case.variables["dt"] for case in cases] == [0.0125, 0.0375]
    assert [case.variables["steps_agitated"] for case in cases] == [333, 333]
    assert cases[1].variables["aspect_ratio"] == 1.7


def test_a_variable_with_the_name_of_its_deck(write_study: Writer, tmp_path: Path) -> None:
    (tmp_path / "own.in").write_text("variable own index 1\nvariable x index 1\n")
    head = 'title = "t"\ndeck = "own.in"\n'
    for text, values in (
        ("[common]\nown = 2", {"own": 2}),
        ("[common.own]\nown = 3\nx = 4", {"own": 3, "x": 4}),
        ("[common.own]\nx = 4", {"x": 4}),
    ):
        (case,) = read_study(write_study(head + text)).cases
        assert case.stages[0].values == values


def test_a_common_start(write_study: Writer, tmp_path: Path) -> None:
    """A file is put where the decks find it, as that of a parameter is, and counts by content."""
    (tmp_path / "my.data").write_text("one")
    text = HEAD + "[common]\nstart = './my.data'\n"
    (case,) = read_study(write_study(text)).cases
    assert case.variables["start"] == "inputs/my.data"
    assert list(case.inputs) == ["my.data"]
    assert words_of(case) == "spheres_seed=1"
    rows = read_study(write_study(text + "[[rows]]\nstart = 'random'\n")).cases
    assert [(one.inputs, words_of(one)) for one in rows] == [
        ({}, "spheres_particles=1000_start=random_seed=1")
    ]
    for given, key in (
        ("[parameters]\nparticles = 5", "parameters.particles"),
        ("particles = 5", "common.particles"),
    ):
        with pytest.raises(StudyError) as caught:
            read_study(write_study(text + given))
        (line,) = caught.value.mistakes
        assert f" {key}: not allowed where start is a file" in line


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + "common = 5", "common: 5 is not allowed: it must be a table (at line 3)"),
        (
            HEAD + "[common]\ndtt = 0.01",
            "common.dtt: no variable of that name (did you mean dt?); allowed are spheres: partic",
        ),
        (
            HEAD + "[common]\nseed = 1\n[common.spheres]\naspect_ratio = 1.5",
            "common.spheres.aspect_ratio: no variable of that name; allowed are spheres: particl",
        ),
        (
            HEAD + "[common.dimers]\ndt = 0.01",
            "common.dimers: no deck or variable of that name; decks are spheres (at line 3)",
        ),
        (
            TURN + "[common.respons]\ndt = 0.01",
            "common.respons: no deck or variable of that name (did you mean response?); decks are "
            "spheres, response (at line 3)",
        ),
        (
            HEAD + "[common]\nseed = [1, 2]",
            "common.seed: [1, 2] is not allowed: it must be one number or word, which all cases "
            "have; lists and ranges belong in [parameters] or in rows (at line 4)",
        ),
        (HEAD + "[common]\nseed = { from = 1, to = 3 }", "must be one number or word, which all "),
        (HEAD + "[common.spheres]\nseed = [1]", "common.spheres.seed: [1] is not allowed: it mus"),
        (HEAD + "[common]\nseed = true", "common.seed: True is not allowed: it must be one numb"),
        (
            HEAD + "[common]\nseed = 0",
            "common.seed: 0 is not allowed: it must be a whole number from 1 to 800000000 (at line",
        ),
        (
            TURN + "[common]\nsteps_changing = 0",
            "common.steps_changing: 0 is not allowed: it must be a whole number from 1 to",
        ),
        (
            HEAD + "[common]\n[common.spheres]\ndt = 'x'",
            "common.spheres.dt: 'x' is not allowed: it must be a number from 1e-6 to 1 (at line 5)",
        ),
        (HEAD + "[common]\ndrag = nan", "common.drag: nan is not allowed: it must be finite"),
        (HEAD + "[common]\nsolver = 'a b'", "common.solver: 'a b' must be one word, without spac"),
        (
            'title = "t"\ndeck = ["dimers", "settling"]\n[common]\ndt = 0.01',
            "deck: settling has particle = spheres, but dimers leaves dimers",
        ),
        (
            'title = "t"\ndeck = ["dimers", "settling"]\n[common]\nparticle = "spheres"',
            "common.particle: settling has particle = spheres, but dimers leaves dimers",
        ),
    ],
)
def test_one_line_for_one_mistake(write_study: Writer, text: str, message: str) -> None:
    path = write_study(text)
    with pytest.raises(StudyError) as caught:
        read_study(path)
    (line,) = caught.value.mistakes
    assert line.startswith(f"{path}: ")
    assert message in line


def test_a_deck_that_is_missing_is_the_only_mistake(write_study: Writer) -> None:
    """Nobody knows whether it has the variable."""
    with pytest.raises(StudyError) as caught:
        read_study(write_study('title = "t"\ndeck = "grains"\n[common]\nfoo = 1\n'))
    (line,) = caught.value.mistakes
    assert " deck: no deck 'grains'" in line
