"""Study files: the cases that they stand for, and one line for each mistake."""

from __future__ import annotations

import pytest

from lammps_inelastic.workflow.errors import StudyError
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.study import read_study

HEAD = 'title = "t"\ndeck = "spheres"\n'
DIGITS = "9" * 400


def mistakes_of(path):
    with pytest.raises(StudyError) as caught:
        read_study(path)
    assert all(line.startswith(f"{path}: ") for line in caught.value.mistakes)
    return [line.removeprefix(f"{path}: ") for line in caught.value.mistakes]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("title =", "not TOML: Invalid value (at end of document)"),
        ('deck = "spheres"', "title: this key is missing"),
        ('title = "t"', "deck: this key is missing"),
        ('title = "t"\ndeck = 5', "deck: it must be a name or a list of names"),
        ('title = "t"\ndeck = ["spheres", 5]', "deck: it must be a name or a list of names"),
        ('title = "t"\ndeck = []', "deck: a deck is a name, or a list of names, not []"),
        (
            'title = "t"\ndeck = "sphere"\n[parameters]\nseed = 1\ndrag = 1',
            "deck: no deck 'sphere': it must be spheres, dimers, clusters, response, settling or",
        ),
        (HEAD + "foo = 1", "foo: no such key; allowed are title, deck, parameters, rows, outputs"),
        (
            HEAD + "[parameters]\naspect_ratio = 1.5",
            "parameters.aspect_ratio: no variable of that name; allowed are spheres: particles, ",
        ),
        (HEAD + "[parameters]\nout = 'x'", "parameters.out: no variable of that name"),
        (HEAD + "[[rows]]\n[[rows]]\nfoo = 1", "rows[2].foo: no variable of that name"),
        (HEAD + "[parameters]\nseed = 0", "seed: 0 is not allowed: it must be a whole number fro"),
        (HEAD + "[parameters]\nseed = []", "parameters.seed: the list is empty"),
        (HEAD + "[parameters]\nseed = true", "parameters.seed: True is no value; it must be"),
        (HEAD + "[parameters]\nseed = [[1]]", "parameters.seed: [1] is no value"),
        (HEAD + "[parameters]\nseed = 1.0", "a whole number from 1 to 800000000"),
        (HEAD + "[parameters]\nseed = 2024-01-01", "is no value"),
        (HEAD + "[parameters]\ndrag = nan", "parameters.drag: nan is not allowed: it must be fin"),
        (HEAD + f"[parameters]\ndrag = {DIGITS}", "it must be a number of at least 0"),
        (HEAD + f"[parameters]\nparticles = {DIGITS * 11}", "not TOML: Exceeds the limit"),
        (HEAD + "[parameters]\nstart = 'a b'", "must be one word, without spaces, quotes, $ and &"),
        (
            HEAD + "[parameters]\nstart = 'no.data'",
            "no.data is not allowed: it must be random or a",
        ),
        (HEAD + "[parameters]\nseed = { from = 1 }", "a range is { from = A, to = B, step = S }"),
        (HEAD + "[parameters]\nseed = { from = 2, to = 1 }", "a range needs from <= to and step"),
        (HEAD + "[parameters]\nseed = { from = 1, to = 9, step = 0 }", "step > 0"),
        (HEAD + "[parameters]\ndrag = { from = 1, to = 9, step = inf }", "step > 0"),
        (HEAD + "[parameters]\ndrag = { from = -1e308, to = 1e308 }", "more than 10000 values"),
        (HEAD + "[parameters]\ndrag = { from = 0, to = 1, step = 1e-320 }", "more than 10000 va"),
        (HEAD + f"[parameters]\nseed = {{ from = 1, to = {DIGITS} }}", "more than 10000 values"),
        (
            HEAD + "[parameters]\nseed = { from = 1, to = 9000 }\ndrag = [1, 2]",
            "more than 10000 cases",
        ),
        (HEAD + "[outputs]\nboxx = 1", "outputs.boxx: no such key; allowed are box, points, evol"),
        (HEAD + "[outputs]\nbox = 'big'", "outputs.box: it must be six numbers"),
        (HEAD + "[outputs]\nbox = [0, 1, 0, 1]", "outputs.box: it must be six numbers"),
        (HEAD + "[outputs]\nbox = [0, 1, 0, 1, 0, 1, 2]", "outputs.box: it must be six numbers"),
        (HEAD + "[outputs]\nbox = [1, 0, 0, 1, 0, 1]", "each lower bound the lesser"),
        (HEAD + "[outputs]\nbox = [0, inf, 0, 1, 0, 1]", "each lower bound the lesser"),
        (HEAD + "[outputs]\npoints = 0", "outputs.points: 0 is not allowed"),
        (HEAD + "[outputs]\nkeep = 'none'", "should be 'everything' or 'results'"),
        (HEAD + "[outputs.profile]\naxis = 'w'", "should be 'x', 'y' or 'z'"),
        (HEAD + "[outputs.profile]\naxes = 'x'", "allowed are axis, thickness, reach, points"),
    ],
)
def test_one_line_for_one_mistake(write_study, text, message, capsys):
    path = write_study(text)
    (line,) = mistakes_of(path)
    assert message in line
    assert main(["validate", str(path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == f"inelastic: {' '.join(f'{path}: {line}'.split())}\n"


def test_all_mistakes_at_once_in_the_order_of_the_file(write_study):
    path = write_study(HEAD + "[parameters]\nzoo = 1\nseed = 0\ndrag = -1\nfoo = 1\nbar = 2\n")
    keys = [line.split(":")[0] for line in mistakes_of(path)]
    assert keys == [f"parameters.{name}" for name in ("seed", "drag", "zoo", "foo", "bar")]


def test_no_such_file(tmp_path):
    assert mistakes_of(tmp_path / "no.toml") == ["No such file or directory"]
    assert mistakes_of(tmp_path) == ["Is a directory"]


def test_mistakes_in_outputs_do_not_hide_others(write_study):
    path = write_study(HEAD + "[parameters]\nseed = 0\n[outputs]\npoint = 1000\n")
    keys = [line.split(":")[0] for line in mistakes_of(path)]
    assert keys == ["outputs.point", "parameters.seed"]


def test_study_that_is_neither_a_file_nor_shipped(capsys):
    assert main(["validate", "table_1"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("inelastic: no study table_1: it must be a TOML file or ")
    assert "table-1, table-2" in error


def test_a_deck_that_is_no_text(write_study, tmp_path):
    (tmp_path / "own.in").write_bytes(b"# caf\xe9\nvariable x index 1\n")
    (line,) = mistakes_of(write_study('title = "t"\ndeck = "own.in"'))
    assert "own.in: not UTF-8" in line


@pytest.mark.parametrize("value", ["", "a b", "$x", "a&", "a\\u0000", "a\\u001b"])
def test_words_that_lammps_cannot_take(write_study, tmp_path, value):
    (tmp_path / "own.in").write_text("variable x index 1\n")
    (line,) = mistakes_of(write_study(f'title="t"\ndeck="own.in"\n[parameters]\nx = "{value}"'))
    assert line.startswith("parameters.x: ")


def values_of(path, name):
    return [case.variables[name] for case in read_study(path).cases]


@pytest.mark.parametrize(
    ("written", "values"),
    [
        ("3", [3]),
        ("[3, 1]", [3, 1]),
        ("[1, 1]", [1]),
        ("{ from = 1, to = 3 }", [1, 2, 3]),
        ("{ from = 1, to = 6, step = 2 }", [1, 3, 5]),
        ("{ from = 0.1, to = 0.3, step = 0.1 }", [0.1, 0.2, 0.3]),
        ("{ from = 2, to = 2 }", [2]),
    ],
)
def test_values(write_study, written, values):
    assert values_of(write_study(f"{HEAD}[parameters]\ndrag = {written}"), "drag") == values


def test_combinations_row_by_row(write_study):
    path = write_study(
        'title="t"\ndeck="dimers"\n[parameters]\nseed=[1,2]\naspect_ratio=[1.1,1.2]\n'
        '[[rows]]\naspect_ratio=1.3\n[[rows]]\n[[rows]]\ndeck="spheres"\n'
    )
    cases = [
        (c.deck, c.variables["seed"], c.variables.get("aspect_ratio"))
        for c in read_study(path).cases
    ]
    assert cases == [
        ("dimers", 1, 1.3),
        ("dimers", 2, 1.3),
        ("dimers", 1, 1.1),
        ("dimers", 1, 1.2),
        ("dimers", 2, 1.1),
        ("dimers", 2, 1.2),
        ("spheres", 1, None),
        ("spheres", 2, None),
    ]


def test_names_are_those_of_before_when_a_study_grows(write_study):
    before = read_study(write_study(HEAD + "[parameters]\nseed = [1, 2]")).cases
    # Another order, a variable at its default, more values, more rows, and a row twice.
    grown = HEAD + "[parameters]\ndt = 0.01\nseed = [3, 2, 1]\n[[rows]]\n[[rows]]\n[[rows]]\ndrag=2"
    after = read_study(write_study(grown)).cases
    names = [case.name for case in after]
    assert len(set(names)) == len(names) == 6
    assert {case.name for case in before} < set(names)
    assert all(name.startswith("spheres_particles=1000_") for name in names)


def test_names_are_fit_for_folders(write_study, tmp_path):
    (tmp_path / "own.in").write_text("variable x index 1\n")
    words = ["a/b", "[/b]", "漢" * 200, "..", "a:b"]
    path = write_study(f'title="t"\ndeck="own.in"\n[parameters]\nx = {words}')
    names = [case.name for case in read_study(path).cases]
    assert len(set(names)) == len(words)
    for name in names:
        (tmp_path / f"{name}.failed").mkdir()


def test_own_decks_of_one_name_are_different_cases(write_study, tmp_path):
    for folder, default in (("a", 1), ("b", 2)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "own.in").write_text(f"variable x index {default}\n")
    path = write_study('title="t"\ndeck="a/own.in"\n[[rows]]\n[[rows]]\ndeck="b/own.in"')
    assert len({case.name for case in read_study(path).cases}) == 2


def test_a_data_file_counts_by_its_content(write_study, tmp_path):
    path = write_study(HEAD + '[parameters]\nstart = "my.data"')
    data = tmp_path / "my.data"
    data.write_text("one")
    (case,) = read_study(path).cases
    data.write_text("two")
    (other,) = read_study(path).cases
    assert case.name != other.name
    assert case.variables["start"] == "my.data"


def test_commands(write_study, capsys, tmp_path):
    path = write_study(HEAD + "[parameters]\nseed = 7\ndrag = 1.5")
    (case,) = read_study(path).cases
    own = ["lmp", "-nonbuf", "-in", "spheres.in", "-var", "drag", "1.5"]
    (command,) = case.commands()
    assert command == [*own, "-var", "seed", "7", "-var", "out", "."]
    (command,) = case.commands(ranks=2)
    assert command[:6] == ["mpiexec", "-bind-to", "core", "-n", "2", "lmp"]
    assert main(["run", str(path), "--dry-run", "--out", str(tmp_path / "a b")]) == 0
    output = capsys.readouterr().out
    assert "lmp -nonbuf -in spheres.in -var drag 1.5 -var seed 7 -var out .\n" in output
    assert f"cd '{tmp_path / 'a b' / 'cases' / case.name}.part'\n" in output
    assert not (tmp_path / "a b").exists()


def test_stages_hand_on_their_packing(write_study):
    path = write_study('title="t"\ndeck=["spheres", "response"]\n[parameters]\nangle = -5')
    (case,) = read_study(path).cases
    first, second = case.commands()
    assert first[-3:] == ["-var", "out", "spheres"]
    assert second[-3:] == ["-var", "packing", "spheres/packing.restart"]
    assert second[second.index("angle") + 1] == "-5"
