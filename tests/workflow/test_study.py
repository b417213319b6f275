"""Study files: the cases that they stand for, and one line for each mistake."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lammps_inelastic.workflow.decks import find_deck
from lammps_inelastic.workflow.errors import StudyError, WorkflowError
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.running.folder import Folder
from lammps_inelastic.workflow.study import read_study

HEAD = 'title = "t"\ndeck = "spheres"\n'
# A run of 824 steps.
STEPS = """[parameters]
steps_agitated = 400
steps_settling = 200
steps_resting = 200
steps_tightening = 20
steps_measuring = 4
"""
DIGITS = "9" * 400


def mistakes_of(path: Path) -> list[str]:
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
            "deck: no deck 'sphere' (did you mean spheres?): it must be spheres, dimers, clusters, "
            "response, gluey, settling or",
        ),
        ('title = "t"\ndeck = "grains"', "deck: no deck 'grains': it must be spheres, dimers, "),
        (HEAD + "[parameter]\nseed = 1", "parameter: no such key (did you mean parameters?); all"),
        (
            HEAD + "[parameters]\npartcles = 1",
            "parameters.partcles: no variable of that name (did you mean particles?); allowed are",
        ),
        (
            HEAD + "[outputs.profile]\naxes = 'x'",
            "outputs.profile.axes: no such key (did you mean axis?); allowed are axis, ",
        ),
        (HEAD + "foo = 1", "foo: no such key; allowed are title, deck, common, parameters, rows, "),
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
            "'no.data' is not allowed: it must be random or a",
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
        (
            HEAD + "[outputs]\nboxx = 1",
            "outputs.boxx: no such key (did you mean box?); allowed are box, points",
        ),
        (HEAD + "[outputs]\nbox = 'big'", "outputs.box: it must be six numbers or cell"),
        (HEAD + "[outputs]\nbox = [0, 1, 0, 1]", "outputs.box: it must be six numbers or cell"),
        (
            HEAD + "[outputs]\nbox = [0, 1, 0, 1, 0, 1, 2]",
            "outputs.box: it must be six numbers or cell",
        ),
        (HEAD + "[outputs]\nbox = [1, 0, 0, 1, 0, 1]", "each lower bound the lesser"),
        (HEAD + "[outputs]\nbox = [0, inf, 0, 1, 0, 1]", "each lower bound the lesser"),
        (HEAD + "[outputs]\npoints = 0", "outputs.points: 0 is not allowed"),
        (HEAD + "outputs = []", "outputs: [] is not allowed: it must be a table"),
        (HEAD + "outputs = { profile = 5 }", "outputs.profile: 5 is not allowed: it must be a tab"),
        (
            HEAD + "outputs = { pictures = 5 }",
            "outputs.pictures: 5 is not allowed: it must be a li",
        ),
        (HEAD + "rows = [{}, 5]", "rows[2]: 5 is not allowed: it must be a table (at line 3)"),
        (
            HEAD + "[outputs]\npictures = [0, 1.5]",
            "outputs.pictures[2]: 1.5 is not allowed: it must be a whole number from 0 to ",
        ),
        (HEAD + "rows = 5", "rows: 5 is not allowed: it must be a list"),
        (HEAD + "parameters = []", "parameters: [] is not allowed: it must be a table"),
        (HEAD + "[parameters]\nseed = '1'", "parameters.seed: '1' is not allowed: it must be a wh"),
        (HEAD + "[outputs]\npoints = 10000000000", "must be a whole number from 1 to 100000000"),
        (HEAD + "[outputs]\npoints = '1000'", "must be a whole number from 1 to 100000000"),
        (HEAD + "[outputs]\nevolution = 'yes'", "outputs.evolution: 'yes' is not allowed"),
        (
            HEAD + "[outputs]\nbox = ['0', 1, 0, 1, 0, 1]",
            "outputs.box: it must be six numbers or cell",
        ),
        (HEAD + "[outputs]\nbox = [0, 1, 0, 1, 0, nan]", "each lower bound the lesser"),
        (HEAD + "[outputs]\nbox = [0, 1e-200, 0, 1e-200, 0, 1]", "each lower bound the lesser"),
        (
            HEAD + "[outputs]\nbox = [0, 1, 0, 5, 0, 1.01]",
            "in the container of spheres, [0, 1, 0, 5",
        ),
        (
            HEAD + "[outputs]\npictures = [-5]",
            "must be a whole number from 0 to 9223372036854775807",
        ),
        (
            HEAD + "[outputs]\npictures = ['0']",
            "must be a whole number from 0 to 92233720368547758",
        ),
        (
            HEAD + STEPS + "[outputs]\npictures = [825]",
            "it must be a step from 0 to 824, where the long",
        ),
        (
            HEAD + "[outputs]\npictures = [0, 0]",
            "they must be at most 100 steps, each of them once",
        ),
        (HEAD + f"[outputs]\npictures = {list(range(101))}", "they must be at most 100 steps"),
        (HEAD + "[outputs.profile]\nthickness = 1e-9", "it must be a number from 0.001 to 1"),
        (HEAD + "[outputs.profile]\nthickness = nan", "it must be a number from 0.001 to 1"),
        (HEAD + "[outputs.profile]\nreach = 1.5", "it must be at most 1, the width of the contain"),
        (HEAD + "[outputs.profile]\nreach = inf", "it must be a number from 1e-06 to 1e+06"),
        (HEAD + "[outputs.profile]\npoints = 1000000000", "a whole number from 1 to 10000000"),
        (
            HEAD + "[parameters]\ndiameter = 0.01\n[outputs.profile]\nthickness = 0.001",
            "2.5e+04 slabs of 100000 points each are too many: at most 10000 slabs and 1000000000 "
            "points in all are allowed, so that thickness must be at least 0.0025 diameters",
        ),
        (HEAD + f"[parameters]\nseed = 0x{'f' * 5000}", "not TOML: a whole number has too many"),
        ('title = "a\\u0000"\ndeck = "spheres"', "title: 'a\\x00' is not allowed: it must be one"),
        (HEAD + "[outputs]\nkeep = 'none'", "should be 'everything' or 'results'"),
        (HEAD + "[outputs.profile]\naxis = 'w'", "should be 'x', 'y' or 'z'"),
        (HEAD + "[outputs.profile]\naxes = 'x'", "allowed are axis, thickness, reach, points"),
    ],
)
def test_one_line_for_one_mistake(
    write_study: Callable[..., Path], text: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_study(text)
    (line,) = mistakes_of(path)
    assert message in line
    assert main(["validate", str(path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == f"inelastic: {' '.join(f'{path}: {line}'.split())}\n"


@pytest.mark.parametrize(
    ("decks", "parameters", "message"),
    [
        ("dimers response", "", "response cannot follow dimers, which leaves dimers: it takes sph"),
        ("clusters response", "", "response cannot follow clusters, which leaves clusters"),
        ("clusters settling", "", "settling cannot follow clusters, which leaves clusters: it ta"),
        (
            "dimers settling",
            "",
            "settling has particle = spheres, but dimers leaves dimers: set pa",
        ),
        (
            "dimers settling",
            "particle='spheres'",
            "parameters.particle: settling has particle = spheres",
        ),
        (
            "dimers settling",
            "particle=['dimers', 'spheres']",
            "parameters.particle: settling has par",
        ),
        (
            "spheres settling",
            "particle='dimers'",
            "parameters.particle: settling has particle = dimers",
        ),
        ("spheres response settling", "", "settling cannot follow response, which changes the co"),
        ("dimers settling response", "particle='dimers'", "response cannot follow settling, which"),
        (
            "spheres settling response",
            "contacts='soft'",
            "parameters.contacts: response cannot follow",
        ),
        ("spheres dimers", "", "dimers makes a packing of its own, and would not use that of sph"),
        ("own.in spheres", "", "spheres makes a packing of its own, and would not use that of own"),
        ("response", "", "deck: response starts from a packing, which a deck before it must make"),
        ("settling", "", 'spheres or dimers, as in deck = ["spheres", "settling"]'),
        ("own.in response", "", "parameters.diameter: 0.11 in response and 0.2 in own: decks that"),
        ("own.in settling", "diameter=0.2", None),
        ("spheres response", "", None),
        ("spheres settling", "", None),
        ("spheres settling response", "", None),
        ("dimers settling", "particle='dimers'", None),
        ("dimers settling", "particle='dimers'\ninertia='solid'", None),
        ("clusters own.in", "", None),
    ],
)
def test_decks_that_fit_together(
    write_study: Callable[..., Path], tmp_path: Path, decks: str, parameters: str, message: str
) -> None:
    (tmp_path / "own.in").write_text("variable diameter index 0.2\nvariable out index out\n")
    # As the study's deck, and as that of a row.
    for head in ("deck = {}", 'deck = "spheres"\nrows = [{{ deck = {} }}]'):
        text = f"title = 't'\n{head.format(decks.split())}\n[parameters]\n{parameters}\n"
        path = write_study(text)
        if message is None:
            assert len(read_study(path).cases) == 1
            continue
        (line,) = mistakes_of(path)
        where, _, said = line.partition(": ")
        wanted = message.removeprefix("deck: ").removeprefix("parameters.diameter: ")
        assert wanted in said or wanted in line
        assert where in ("deck", "rows[1].deck", message.split(":")[0])


def test_a_row_whose_deck_does_not_fit(write_study: Callable[..., Path]) -> None:
    text = (
        'title="t"\ndeck=["spheres", "settling"]\n[[rows]]\n[[rows]]\ndeck=["dimers", "settling"]'
    )
    (line,) = mistakes_of(write_study(text))
    assert line.startswith(
        "rows[2].deck: settling has particle = spheres, but dimers leaves dimers: set "
    )
    assert line.endswith(" (at line 5)")


def test_pictures_of_the_longest_case(write_study: Callable[..., Path]) -> None:
    """Of a shorter one the last frame is drawn, so that a study may mix them."""
    settling = "steps_settling = 200", "steps_settling = [100, 2000]"
    text = HEAD + STEPS.replace(*settling) + "[outputs]\npictures = [0, 2535]"
    assert len(read_study(write_study(text)).cases) == 2


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (".few.toml", "must begin with a letter or a digit"),
        ("..toml", "must begin with a letter or a digit"),
        ("a\nb.toml", "neither line breaks"),
        ("a\x1b[2J.toml", "neither line breaks"),
        ("a\udcff.toml", "neither line breaks"),
        (f"{'a' * 201}.toml", "at most 200 bytes"),
        ("a b 'c' $(d).toml", None),
        ("漢.toml", None),
    ],
)
def test_names_of_study_files(
    tmp_path: Path, name: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    path.write_text(HEAD)
    assert main(["validate", str(path)]) == (0 if message is None else 2)
    said = capsys.readouterr().err
    assert said.count("\n") == (0 if message is None else 1)
    assert (message or "") in said


@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "link", "large"])
def test_what_is_no_file(
    write_study: Callable[..., Path], tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a study, a deck and a start: a line each, and nobody waits."""
    odd = tmp_path / "odd"
    if kind == "pipe":
        os.mkfifo(odd)
    elif kind == "device":
        odd.symlink_to("/dev/zero")
    elif kind == "folder":
        odd.mkdir()
    elif kind == "link":
        odd.symlink_to(tmp_path / "nowhere")
    else:
        with odd.open("wb") as file:
            file.truncate(2_000_000)
    uses = ['title = "t"\ndeck = "odd"', HEAD + '[parameters]\nstart = "odd"']
    paths = [odd, *(write_study(text, f"{n}.toml") for n, text in enumerate(uses))]
    for path in paths:
        # A start may be large: it is data.
        fine = kind == "large" and path is paths[2]
        assert main(["validate", str(path)]) == (0 if fine else 2)
        assert len(capsys.readouterr().err.splitlines()) == (0 if fine else 1)


@pytest.mark.parametrize(
    "name", ["spheres.in", "log.lammps", "lmp.out", "finished.json", "inputs", "random", "a b"]
)
def test_a_start_may_have_any_name(
    write_study: Callable[..., Path], tmp_path: Path, name: str
) -> None:
    """It lies in a folder of its own, and is a file also where a deck has a word of its name."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / name).write_text("data")
    path = write_study(HEAD + f"[parameters]\nstart = 'data/{name}'")
    if " " in name:
        assert "must be one word" in mistakes_of(path)[0]
        return
    (case,) = read_study(path).cases
    (command,) = case.commands()
    assert command[command.index("start") + 1] == f"inputs/{name}"
    part = Folder(tmp_path / "out").begin(case)
    assert (part / "inputs" / name).read_text() == "data"
    assert (part / "spheres.in").read_text() == case.stages[0].deck.text


def test_a_start_from_a_file_has_particles_of_its_own(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    """Several numbers of them would be one start, run again and again under wrong names."""
    (tmp_path / "my.data").write_text("data")
    text = HEAD + "[parameters]\nparticles = [1000, 2000]\n"
    refusal = "not allowed where start is a file, which has a number of particles of its own"
    for start, key in (
        ("start = './my.data'", "parameters.particles"),
        ("[[rows]]\nstart = ['random', './my.data']", "parameters.particles"),
        ("[[rows]]\nstart = './my.data'\nparticles = 5", "rows[1].particles"),
    ):
        (line,) = mistakes_of(write_study(text + start))
        assert line.startswith(f"{key}: {refusal}")
    rows = "[[rows]]\nparticles = [1000, 2000]\n[[rows]]\nstart = './my.data'"
    names = [case.name.rpartition("_")[0] for case in read_study(write_study(HEAD + rows)).cases]
    assert names == [
        "spheres_particles=1000_seed=1",
        "spheres_particles=2000_seed=1",
        "spheres_start=inputs-my.data_seed=1",
    ]
    # A deck of one's own may need both.
    (tmp_path / "own.in").write_text("variable start index x\nvariable particles index 5\n")
    own = "title = 't'\ndeck = 'own.in'\n[parameters]\nstart = './my.data'\nparticles = [1, 2]"
    assert len(read_study(write_study(own)).cases) == 2


def test_a_word_of_a_deck_is_no_file(write_study: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "random").write_text("data")
    (case,) = read_study(write_study(HEAD + "[parameters]\nstart = 'random'")).cases
    assert (case.inputs, case.variables["start"]) == ({}, "random")


def test_two_files_of_one_name(write_study: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "own.in").write_text("variable start index a\nvariable shape index b\n")
    for folder in "ab":
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "x").write_text(folder)
    text = 'title="t"\ndeck="own.in"\n[parameters]\nstart = "a/x"\nshape = "b/x"'
    assert mistakes_of(write_study(text)) == [
        "parameters: two files are named x; rename one of them (at line 3)"
    ]
    (case,) = read_study(write_study(text.replace("b/x", "a/x"))).cases
    assert list(case.inputs) == ["x"]


def test_a_start_that_changes_before_it_is_used(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    (tmp_path / "my.data").write_text("one")
    (case,) = read_study(write_study(HEAD + '[parameters]\nstart = "my.data"')).cases
    (tmp_path / "my.data").write_text("two")
    with pytest.raises(WorkflowError, match="has changed since the study was read"):
        Folder(tmp_path / "out").begin(case)


@pytest.mark.parametrize(
    "names", [".hidden.in", "a b.in", "$a.in", "inputs.in a.in", "a.in.in a.in"]
)
def test_names_of_own_decks(write_study: Callable[..., Path], tmp_path: Path, names: str) -> None:
    decks = names.split(".in ")
    decks = [f"{each.removesuffix('.in')}.in" for each in decks]
    for each in decks:
        (tmp_path / each).write_text("variable x index 1\n")
    (line,) = mistakes_of(write_study(f"title='t'\ndeck={decks}"))
    assert line.startswith("deck: ")


def test_a_deck_without_a_parameter(write_study: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "own.in").write_text("print 'x'\n")
    (case,) = read_study(write_study('title="t"\ndeck="own.in"')).cases
    assert case.variables == {}
    assert case.commands() == [["lmp", "-nonbuf", "-in", "own.in", "-var", "out", "."]]
    (line,) = mistakes_of(write_study('title="t"\ndeck="own.in"\n[parameters]\nx = 1'))
    assert line == "parameters.x: no variable of that name; allowed are own: none (at line 4)"


@pytest.mark.parametrize(
    ("text", "given", "fits"),
    [
        ("variable out index x\n", True, True),
        ("variable   out   index x # or another variable out there\n", True, True),
        ("shell mkdir ${out}\n", True, True),
        ("print 'x'\n", True, False),
        # LAMMPS would end with "Cannot redefine variable out with a different style".
        ("variable out string x\n", False, False),
        ("if 1 then 'variable out equal 1'\n", False, False),
    ],
)
def test_where_an_own_deck_writes(
    write_study: Callable[..., Path], tmp_path: Path, text: str, given: bool, fits: bool
) -> None:
    (tmp_path / "own.in").write_text(text)
    (case,) = read_study(write_study('title="t"\ndeck="own.in"')).cases
    (command,) = case.commands()
    assert ("-var" in command) == given
    path = write_study('title="t"\ndeck=["own.in", "response"]')
    if fits:
        assert len(read_study(path).cases) == 1
    else:
        (line,) = mistakes_of(path)
        assert line.startswith("deck: the next deck could not find what own leaves: own must write")


def test_all_mistakes_at_once_in_the_order_of_the_file(write_study: Callable[..., Path]) -> None:
    path = write_study(HEAD + "[parameters]\nzoo = 1\nseed = 0\ndrag = -1\nfoo = 1\nbar = 2\n")
    keys = [line.split(":")[0] for line in mistakes_of(path)]
    assert keys == [f"parameters.{name}" for name in ("seed", "drag", "zoo", "foo", "bar")]


def test_no_such_file(tmp_path: Path) -> None:
    assert mistakes_of(tmp_path / "no.toml") == ["No such file or directory"]
    assert mistakes_of(tmp_path) == ["Is a directory"]


def test_mistakes_in_outputs_do_not_hide_others(write_study: Callable[..., Path]) -> None:
    path = write_study(HEAD + "[parameters]\nseed = 0\n[outputs]\npoint = 1000\n")
    keys = [line.split(":")[0] for line in mistakes_of(path)]
    assert keys == ["outputs.point", "parameters.seed"]


def test_study_that_is_neither_a_file_nor_shipped(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "table_1"]) == 2
    error = capsys.readouterr().err
    assert error.startswith(
        "inelastic: no study table_1 (did you mean table-1?): it must be a TOML file or "
    )
    assert "table-1, table-2" in error


def test_a_deck_that_is_no_text(write_study: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "own.in").write_bytes(b"# caf\xe9\nvariable x index 1\n")
    (line,) = mistakes_of(write_study('title = "t"\ndeck = "own.in"'))
    assert "own.in: not UTF-8" in line


@pytest.mark.parametrize("value", ["", "a b", "$x", "a&", "a\\u0000", "a\\u001b"])
def test_words_that_lammps_cannot_take(
    write_study: Callable[..., Path], tmp_path: Path, value: str
) -> None:
    (tmp_path / "own.in").write_text("variable x index 1\n")
    (line,) = mistakes_of(write_study(f'title="t"\ndeck="own.in"\n[parameters]\nx = "{value}"'))
    assert line.startswith("parameters.x: ")


def values_of(path: Path, name: str) -> list[Any]:
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
def test_values(write_study: Callable[..., Path], written: str, values: list[Any]) -> None:
    assert values_of(write_study(f"{HEAD}[parameters]\ndrag = {written}"), "drag") == values


def test_combinations_row_by_row(write_study: Callable[..., Path]) -> None:
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


def test_names_are_those_of_before_when_a_study_grows(write_study: Callable[..., Path]) -> None:
    before = read_study(write_study(HEAD + "[parameters]\nseed = [1, 2]")).cases
    # Another order, a variable at its default, more values, more rows, and a row twice.
    dt = find_deck("spheres", Path()).parameters["dt"]
    grown = (
        HEAD + f"[parameters]\ndt = {dt}\nseed = [3, 2, 1]\n[[rows]]\n[[rows]]\n[[rows]]\ndrag=2"
    )
    after = read_study(write_study(grown)).cases
    names = [case.name for case in after]
    assert len(set(names)) == len(names) == 6
    assert {case.name for case in before} < set(names)
    assert all(name.startswith("spheres_particles=1000_") for name in names)


def test_names_are_fit_for_folders(write_study: Callable[..., Path], tmp_path: Path) -> None:
    (tmp_path / "own.in").write_text("variable x index 1\n")
    words = ["a/b", "[/b]", "漢" * 200, "..", "a:b"]
    path = write_study(f'title="t"\ndeck="own.in"\n[parameters]\nx = {words}')
    names = [case.name for case in read_study(path).cases]
    assert len(set(names)) == len(words)
    for name in names:
        (tmp_path / f"{name}.failed").mkdir()


def test_own_decks_of_one_name_are_different_cases(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    for folder, default in (("a", 1), ("b", 2)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "own.in").write_text(f"variable x index {default}\n")
    path = write_study('title="t"\ndeck="a/own.in"\n[[rows]]\n[[rows]]\ndeck="b/own.in"')
    assert len({case.name for case in read_study(path).cases}) == 2


def test_a_data_file_counts_by_its_content(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    path = write_study(HEAD + '[parameters]\nstart = "my.data"')
    data = tmp_path / "my.data"
    data.write_text("one")
    (case,) = read_study(path).cases
    data.write_text("two")
    (other,) = read_study(path).cases
    assert case.name != other.name
    assert case.variables["start"] == "inputs/my.data"


def test_commands(
    write_study: Callable[..., Path], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
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


def test_stages_hand_on_their_packing(write_study: Callable[..., Path]) -> None:
    path = write_study('title="t"\ndeck=["spheres", "response"]\n[parameters]\nangle = -5')
    (case,) = read_study(path).cases
    first, second = case.commands()
    assert first[-3:] == ["-var", "out", "spheres"]
    assert second[-3:] == ["-var", "packing", "spheres/packing.restart"]
    assert second[second.index("angle") + 1] == "-5"


def test_a_box_above_the_bed_is_warned_of(
    write_study: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """A bed of 500 spheres of 0.11 ends below 0.58, where all of it at 0.6 would; of 1,000 not."""
    text = "title = 't'\ndeck = '{}'\n[parameters]\nparticles = {}\nseed = [1, 2]\n[outputs]\n{}"
    for deck, particles, outputs, said in (
        ("spheres", 500, "", "500 spheres of diameter 0.11 make a bed that ends at about 0.5:"),
        ("dimers", 200, "", "200 dimers of diameter 0.11 make a bed that ends at about 0.31:"),
        (
            "clusters",
            100,
            "",
            "100 clusters of diameter 0.11 make a bed that ends at about 0.3:",
        ),
        ("spheres", 500, "box = [0.2, 0.8, 0.1, 0.4, 0.2, 0.8]", None),
        ("spheres", 1000, "", None),
    ):
        path = write_study(text.format(deck, particles, outputs))
        out = ["--out", str(path.parent / "out")]
        for command in (["validate"], ["run", "--dry-run", *out], ["slurm", *out]):
            assert main([*command, str(path)]) == 0
            lines = capsys.readouterr().err.splitlines()
            assert len(lines) == (0 if said is None else 1)
            assert all(line.startswith(f"warning: {path}: outputs.box: ") for line in lines)
            assert said is None or said in lines[0]
