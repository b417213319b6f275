"""The command `parameters`, and the tables of all decks: bad values, misspelt names, the list."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.resources import files
from pathlib import Path

import pytest

from lammps_inelastic.workflow.decks import Deck, Rule, as_value, read_rule
from lammps_inelastic.workflow.shipped import DECKS, PACK
from tests.helpers.lammps_run import OF_A_LAUNCHER, Runner, run_lmp

SERVER = Path(__file__).parents[1] / "helpers" / "table_server.py"
TABLE = re.compile(r'^parameters """\n(.*?)"""', re.MULTILINE | re.DOTALL)

Ask = Callable[..., list[str]]


def deck(name: str) -> str:
    return (files("lammps_inelastic.inputs") / f"{name}.in").read_text()


def table_of(text: str) -> str:
    """The command of a deck that holds its table; nothing but comments may stand before it."""
    found = TABLE.search(text)
    assert found is not None
    assert all(line.startswith("#") or not line for line in text[: found.start()].splitlines())
    return found.group(0)


@pytest.fixture(scope="module")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ask]:
    """Return a function that runs steps in a new LAMMPS, in a folder with files to choose from."""
    folder = tmp_path_factory.mktemp("tables")
    for name in ("there.data", "my file.data", "a$b.data", "random", "out/packing.restart"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("")
    os.mkfifo(folder / "pipe")
    (folder / "folder").mkdir()
    environment = {k: v for k, v in os.environ.items() if not k.startswith(OF_A_LAUNCHER)}
    process = subprocess.Popen(
        [sys.executable, str(SERVER)],
        cwd=folder,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    write, read = process.stdin, process.stdout

    def run(steps: list[str], *arguments: str, log: str = "none") -> list[str]:
        print(
            json.dumps({"arguments": ["-log", log, *arguments], "steps": steps}),
            file=write,
            flush=True,
        )
        line = read.readline()
        assert line, f"LAMMPS crashed: {steps}"
        answers: list[str] = json.loads(line)
        return answers

    run.folder = folder
    yield run
    process.kill()
    process.communicate()


def values_in_turn(ask: Ask, table: str, cases: list[tuple[str, str]]) -> list[str]:
    """What the table says when one parameter after another has a value, the others none."""
    steps = []
    for name, value in cases:
        steps += [f"variable {name} delete", f'variable {name} index """{value}"""', table]
        steps += [f"variable {name} delete"]
    return ask(steps)[2::4]


# Values of every kind --------------------------------------------------------------------------

# LAMMPS takes many of these for a number somewhere, and for something else elsewhere.
NO_NUMBER = [
    "",
    "abc",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "1e999",
    "-1e999",
    "10abc",
    "0x10",
    "0x1p-3",
    "1,5",
    "0.5.1",
    "1e",
    "1e+",
    "e5",
    ".",
    "-",
    "--1",
    "+1",
    "1 2",
    " 1",
    "1\t",
    "1\n",
    "'1'",
    '"1" ',
    "1;2",
    "1/2",
    "v_seed",
    "${seed}",
    "$(1)",
    "*",
    "NULL",
    "yes",
    "1" * 400,
]
NO_INTEGER = [*NO_NUMBER, "1e3", "1.5", "10.0", "2147483648", "-2147483649", "9" * 20]
NO_WORD = ["", "1", "nan", "or", "file", "x", "a b"]
NO_FILE = ["", "no.data", "folder", ".", "pipe", "there.data/x", "my file.data", "a$b.data", "*"]
NO_FOLDER = [
    "",
    "a b",
    " a",
    "there.data",
    "there.data/x",
    "pipe",
    "/proc/x",
    *(f"a{letter}b" for letter in "'`$&#*?%{}()[]~;<>|\\!,\t\n"),
]


def just_outside(rule: Rule) -> Iterator[str]:
    """The first numbers beyond the bounds."""
    step = 1.0 if rule.kind == "integer" else 1e-13
    for bound, direction in ((rule.low, -1), (rule.high, 1)):
        if bound is not None and bound.included:
            beyond = bound.value + direction * max(step, 1e-3 * step * abs(bound.value))
            yield str(int(beyond)) if rule.kind == "integer" else repr(beyond)
        elif bound is not None:
            yield bound.text
    if rule.low is not None and rule.low.value >= 0:
        yield "-1"


def just_inside(rule: Rule) -> Iterator[str]:
    """The last numbers within the bounds."""
    for bound, direction in ((rule.low, 1), (rule.high, -1)):
        if bound is not None:
            yield bound.text if bound.included else repr(bound.value + direction * 1e-9)


def wrong_values(rule: Rule) -> list[str]:
    if rule.kind == "folder":
        return NO_FOLDER
    if rule.kind == "words":
        near = [text for word in rule.words for text in (word.upper(), word[:-1], f"{word} ")]
        return [*NO_WORD, *near, *(NO_FILE if rule.file else [])]
    return [*(NO_INTEGER if rule.kind == "integer" else NO_NUMBER), *just_outside(rule)]


def right_values(rule: Rule) -> list[str]:
    if rule.kind == "folder":
        return ["folder", "new", "new/deeper", ".", "./a-b_c.d+e=f@h^i:j", "deep/"]
    if rule.kind == "words":
        return [*rule.words, *(["there.data", "./random"] if rule.file else [])]
    return list(just_inside(rule))


@pytest.mark.parametrize("name", [*DECKS, PACK])
def test_every_bad_value_is_named_with_what_is_allowed(name: str, ask: Ask) -> None:
    """Every parameter of a deck with every kind of value that it must not have."""
    rules = Deck(name, deck(name), shipped=True).rules
    cases = [(each, value) for each, rule in rules.items() for value in wrong_values(rule)]
    assert len(cases) > 200
    for (each, value), error in zip(
        cases, values_in_turn(ask, table_of(deck(name)), cases), strict=True
    ):
        line, *more = error.splitlines()
        assert line.startswith(f"ERROR: Parameter {each} must be {rules[each].allowed}, not "), (
            each,
            value,
            error,
        )
        assert not any(more), error


@pytest.mark.parametrize("name", [*DECKS, PACK])
def test_the_last_values_within_bounds_are_allowed(name: str, ask: Ask) -> None:
    rules = Deck(name, deck(name), shipped=True).rules
    cases = [(each, value) for each, rule in rules.items() for value in right_values(rule)]
    answers = values_in_turn(ask, table_of(deck(name)), cases)
    assert dict(zip(cases, answers, strict=True)) == dict.fromkeys(cases, "")


RULES = [
    "integer",
    "integer >= 1",
    "integer > 1 < 5",
    "integer <= -3 >= -5",
    "number",
    "number > 0",
    "number >= 0 <= 1e5",
    "number > -1.5 < .5",
    "number > 0 <= 1",
    "number >= 0 < 1",
    "number < 3",
    "number <= 3",
    "one",
    "one or two",
    "one or two or three or file",
    "file",
]
NUMBERS = [
    "-6",
    "-5",
    "-3",
    "-1.5",
    "-1",
    "0",
    "0.5",
    "1",
    "2",
    "3",
    "4",
    "5",
    "1e5",
    "1e99",
    "one",
]


@pytest.mark.parametrize("rule", RULES)
def test_lammps_and_the_workflow_read_a_rule_alike(rule: str, ask: Ask) -> None:
    table = f'parameters """\n x 1 {rule} # comment\n"""'
    read = read_rule(rule)
    for value, error in zip(
        NUMBERS, values_in_turn(ask, table, [("x", value) for value in NUMBERS]), strict=True
    ):
        expected = f"ERROR: Parameter x must be {read.allowed}, not {value} "
        assert error.startswith(expected) if not read.accepts(as_value(value)) else not error


# The table itself ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("", "The table of parameters is empty"),
        ("# x 1 number", "The table of parameters is empty"),
        ("x 1", "must be: name, default, what is allowed; not: x 1"),
        ("x-y 1 number", "name must be of letters, digits and underscores"),
        ("parameters 1 number", 'and not "parameters"'),
        ("x 1 number\nx 2 number", "Parameter x is in the table twice"),
        ("x 1 number >", "bounds of a parameter must be"),
        ("x 1 number > a", "bounds of a parameter must be"),
        ("x 1 number > 1 > 2", "bounds of a parameter must be"),
        ("x 1 number = 1", "bounds of a parameter must be"),
        ("x 1 integer 1", "bounds of a parameter must be"),
        ("x 1 one two", 'words with "or" between them'),
        ("x 1 or", 'words with "or" between them'),
        ("x 1 one or", "A word is missing"),
        ("x 1 folder or one or", "A word is missing"),
        ("x 2 number < 1", "Parameter x must be a number below 1, not 2"),
    ],
)
def test_a_table_that_cannot_be_read(table: str, message: str, ask: Ask) -> None:
    (error,) = ask([f'parameters """\n{table}\n"""'])
    assert message in error
    assert error.startswith("ERROR: ")
    assert len(error.splitlines()) == 1


def test_wrong_arguments(ask: Ask) -> None:
    """The list is there after a table only, and takes no second argument."""
    assert "takes one argument" in ask(["parameters"])[0]
    assert "takes one argument, a table" in ask(["parameters x 1 number"])[0]
    assert "must follow a table" in ask(["parameters log"])[0]


SMALL = """parameters '''
  # Comments of their own, and "quotes" don't matter
  particles  1000    integer >= 1      # number of spheres, $5 & more
  seed       1       integer >= 1
  start      random  random or file
                                       # goes on
  out        out     folder
'''""".replace("'''", '"""')


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-var", "partcles", "5"], "There is no parameter partcles: did you mean particles?"),
        (["-var", "praticles", "5"], "did you mean particles?"),
        (["-var", "Seed", "5"], "did you mean seed?"),
        (["-var", "colour", "red"], "There is no parameter colour. All are particles, seed, start"),
        (["-var", "parameters", "5"], "There is no parameter parameters"),
        (["-var", "start_is_file", "1"], "There is no parameter start_is_file"),
    ],
)
def test_a_misspelt_variable_is_an_error(arguments: list[str], message: str, ask: Ask) -> None:
    (error,) = ask([SMALL], *arguments)
    assert message in error
    assert "particles, seed, start and out" in error


def test_letters_beyond_ascii(ask: Ask) -> None:
    """A folder may have them; LAMMPS hands them on from its command line only."""
    assert ask([SMALL], "-var", "out", "Übung") == [""]
    (error,) = ask([SMALL], "-var", "particles", "ä")
    assert "must be a whole number from 1 to 2147483647, not ä (" in error
    # A long value is cut between two letters, not in one.
    (error,) = ask([SMALL], "-var", "particles", f"a{'ä' * 99}")
    assert f"not a{'ä' * 49}... (" in error


def test_all_mistakes_are_told_at_once(ask: Ask) -> None:
    (error,) = ask([SMALL], "-var", "zoo", "1", "-var", "particles", "0", "-var", "seed", "x")
    lines = error.splitlines()
    assert [line.split(" (src")[0] for line in lines] == [
        "ERROR: There is no parameter zoo. All are particles, seed, start and out",
        "ERROR: Parameter particles must be a whole number from 1 to 2147483647, not 0",
        "ERROR: Parameter seed must be a whole number from 1 to 2147483647, not x",
    ]


def test_a_script_may_run_a_deck_again_and_have_variables_of_its_own(ask: Ask) -> None:
    """What a pass has left, of any style, is no misspelt parameter of the next one."""
    own = [
        "variable a equal 1",
        "variable b string x",
        "variable c loop 3",
        "variable d index p q",
        "variable e atom 1",
        "variable f getenv HOME",
    ]
    before = [line for line in own if "index" not in line]
    steps = [*before, SMALL, *own, "clear", "next seed", SMALL, "print ${seed}"]
    assert ask(steps, "-var", "seed", "3", "4") == [""] * len(steps)
    # A table of another deck in the same LAMMPS does not have the first one's parameters.
    steps = [SMALL, "clear", 'parameters """\n  other 1 number\n"""']
    assert ask(steps) == [""] * 3


def test_values_come_from_the_command_line_a_script_or_the_default(ask: Ask) -> None:
    steps = [
        "variable particles equal 20*3",
        SMALL,
        'if "${particles} != 60 || ${seed} != 7" then "variable"',
        'if "${start_is_file} != 0" then "variable"',
        "clear",
        "variable start delete",
        "variable start index there.data",
        SMALL,
        'if "${start_is_file} != 1" then "variable"',
    ]
    # `variable` without arguments is an error.
    assert ask(steps, "-var", "seed", "7") == [""] * len(steps)
    (_, error) = ask(["variable particles atom 1", SMALL])
    assert "Parameter particles must be a whole number from 1 to 2147483647, not an empty" in error


def test_a_word_comes_before_a_file_of_its_name(ask: Ask) -> None:
    """The folder holds a file named random."""
    steps = [SMALL, 'if "${start_is_file} != 0" then "variable"']
    assert ask(steps) == [""] * 2
    steps = [SMALL, 'if "${start_is_file} != 1" then "variable"']
    assert ask(steps, "-var", "start", "./random") == [""] * 2


def test_the_list_is_in_the_logs(ask: Ask) -> None:
    steps = [SMALL, "log second.log", "parameters log"]
    arguments = ["-var", "particles", "20", "-var", "start", "there.data", "-var", "seed", "1", "2"]
    assert ask(steps, *arguments, log="first.log") == [""] * 3
    listed = """\
Parameters (* is not the default):
  * particles 20         default 1000
    seed      1          (one of several values)
  * start     there.data default random
    out       out
"""
    folder = ask.folder
    assert (folder / "first.log").read_text().count(listed) == 1
    assert (folder / "second.log").read_text().count(listed) == 1


def test_a_folder_is_made_only_if_all_else_is_right(ask: Ask) -> None:
    folder = ask.folder
    assert ask([SMALL], "-var", "out", "not/yet", "-var", "seed", "0") != [""]
    assert not (folder / "not").exists()
    assert ask([SMALL], "-var", "out", "not/yet") == [""]
    assert (folder / "not" / "yet").is_dir()


def test_one_line_on_two_ranks(lmp: Runner) -> None:
    result = lmp(SMALL, ranks=2, variables={"particles": "1e3"}, must_pass=False)
    assert result.status != 0
    assert len(result.errors) == 1
    assert "Parameter particles must be a whole number" in result.errors[0]
    # Neither the table nor a list of it follows.
    assert "goes on" not in result.screen
    result = lmp(SMALL, ranks=2, variables={"particles": 3})
    assert result.screen.count("particles 3") == 1


# The decks' relations between parameters, and packings of another kind ---------------------------

FEW = {
    "particles": 20,
    "steps_agitated": 2,
    "steps_settling": 2,
    "steps_resting": 1,
    "waiting": 0,
    "steps_tightening": 1,
    "steps_measuring": 1,
    "dump_every": 1000,
}


@pytest.mark.parametrize(
    ("name", "variables", "message"),
    [
        ("spheres", {"drag": 50}, "drag times dt must be below 1, not 1"),
        ("spheres", {"dt": 1, "drag": 1}, "drag times dt must be below 1, not 1"),
        ("dimers", {"drag": 1e300}, "drag times dt must be below 1"),
        ("clusters", {"drag": 100}, "drag times dt must be below 1, not 2"),
        ("spheres", {"particles": 2147483647}, "no room: particles of this diameter would fill"),
        ("dimers", {"diameter": 0.5, "aspect_ratio": 2}, "dimers are too long: aspect_ratio times"),
        ("dimers", {"diameter": 0.2}, "no room: the dimers would fill"),
        (
            "dimers",
            {"particles": 1, "diameter": 0.4998, "aspect_ratio": 2, "start": "regular"},
            "no room for a regular start",
        ),
        ("clusters", {"particles": 3000, "diameter": 0.2}, "no room: the clusters would fill 8.2"),
        ("clusters", {"particles": 2147483647}, "no room: the clusters would fill"),
        ("clusters", {"extent": 5}, "the clusters are too large for the container: (extent + 0.5)"),
        ("clusters", {"extent": 0.6}, "extent must be at least that of the tetrahedron, 0.7"),
    ],
)
def test_parameters_that_do_not_go_together(
    name: str, variables: dict[str, object], message: str, refused: Callable[..., str]
) -> None:
    """At once: nothing is created, let alone pushed apart."""
    assert message in refused(deck(name), variables=variables, timeout=10)


COORDINATES = [(-0.6, 0, 0), (0, 0.3, 0), (0.6, 0, 0)]


def shape(
    coordinates: Sequence[tuple[object, ...]], section: str = "", rows: Iterable[object] = ()
) -> str:
    """A molecule file with these coordinates, and with a section of one value an atom."""
    sections: dict[str, Sequence[tuple[object, ...]]] = {
        "Coords": coordinates,
        "Types": [(1,)] * len(coordinates),
        **({section: [(value,) for value in rows]} if section else {}),
    }
    text = f"# Shape\n\n{len(coordinates)} atoms\n"
    for name, values in sections.items():
        text += f"\n{name}\n\n"
        text += "".join(f"{i} {' '.join(map(str, row))}\n" for i, row in enumerate(values, 1))
    return text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (shape([("nan", 0, 0), *COORDINATES[1:]]), "its centres are further apart, or not finite"),
        (shape([(0, 0, "-nan"), *COORDINATES[1:]]), "its centres are further apart, or not finite"),
        (shape([("inf", 0, 0), *COORDINATES[1:]]), "its centres are further apart, or not finite"),
        (shape([("1e30", 0, 0), *COORDINATES[1:]]), "its centres are further apart, or not finite"),
        (shape([(9, 0, 0), *COORDINATES[1:]]), "no shape within extent, 1.2 diameters"),
        (shape(COORDINATES[:1]), "has one sphere, a cluster needs two at least"),
        (shape(COORDINATES, "Diameters", [1, 0.5, 1]), "must be without Diameters and Masses"),
        (shape(COORDINATES, "Masses", [1, 2, 1]), "must be without Diameters and Masses"),
    ],
)
def test_a_shape_that_is_none(
    text: str, message: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    (tmp_path / "shape.txt").write_text(text)
    variables = {**FEW, "shape": "shape.txt", "extent": 1.2}
    assert message in refused(deck("clusters"), variables=variables)


def test_a_shape_may_say_what_the_deck_does(tmp_path: Path, lmp: Runner) -> None:
    (tmp_path / "shape.txt").write_text(shape(COORDINATES, "Diameters", [1, 1, 1]))
    lmp(deck("clusters"), variables={**FEW, "shape": "shape.txt", "extent": 1.2})


@pytest.fixture(scope="module")
def packings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that holds a packing of each kind."""
    folder = tmp_path_factory.mktemp("packings")
    for name in ("spheres", "dimers", "clusters"):
        run_lmp(folder, deck(name), variables={**FEW, "out": name})
    data = "".join(f"{i} 1 {0.1 / (1 + i % 2)} 1 0.5 {0.2 * i} 0.5\n" for i in range(1, 11))
    box = "0 1 xlo xhi\n0 5 ylo yhi\n0 1 zlo zhi\n"
    (folder / "two.data").write_text(
        f"# Two sizes\n\n10 atoms\n1 atom types\n{box}\nAtoms\n\n{data}"
    )
    return folder


@pytest.mark.parametrize(
    ("name", "variables", "message"),
    [
        ("response", {"packing": "dimers"}, "is a packing of dimers or clusters, this deck needs"),
        (
            "response",
            {"packing": "clusters"},
            "is a packing of dimers or clusters, this deck needs",
        ),
        ("gluey", {"packing": "dimers"}, "is a packing of dimers or clusters, this deck needs"),
        ("settling", {"packing": "dimers"}, "particle must be dimers, not spheres"),
        ("settling", {"packing": "clusters"}, "particle must be dimers, not spheres"),
        (
            "settling",
            {"packing": "spheres", "particle": "dimers"},
            "particle must be spheres, not dimers",
        ),
        (
            "settling",
            {"packing": "clusters", "particle": "dimers"},
            "is a packing of clusters, this deck needs spheres or dimers",
        ),
        ("response", {"packing": "spheres", "diameter": 0.1}, "diameter must be that of the large"),
        ("gluey", {"packing": "spheres", "diameter": 0.1}, "diameter must be that of the largest"),
        ("settling", {"packing": "spheres", "diameter": 0.1}, "diameter must be that of the large"),
        ("settling", {"packing": "spheres", "diameter": 0.12}, "diameter must be that of the larg"),
        (
            "settling",
            {"packing": "spheres", "diameter": 0.12, "contacts": "soft"},
            "diameter must be that of the largest sphere",
        ),
        (
            "settling",
            {"packing": "dimers", "particle": "dimers", "diameter": 0.12},
            "must have the diameter 0.12",
        ),
    ],
)
def test_a_packing_of_another_kind_or_size(
    name: str,
    variables: dict[str, object],
    message: str,
    packings: Path,
    refused: Callable[..., str],
) -> None:
    packing = packings / str(variables["packing"]) / "packing.restart"
    assert message in refused(deck(name), variables={**variables, "packing": packing})


def test_a_start_of_molecules_that_are_no_dimers(
    packings: Path, lmp: Runner, refused: Callable[..., str]
) -> None:
    data = packings / "clusters.data"
    convert = "read_restart {}\nmass 1 1.0\nwrite_data {} nocoeff"
    lmp(convert.format(packings / "clusters" / "packing.restart", data), into="convert")
    message = refused(deck("dimers"), variables={**FEW, "start": data})
    assert "every molecule in" in message
    assert "must be of two spheres, a dimer" in message


def test_drag_counts_with_the_lightest_sphere(packings: Path, refused: Callable[..., str]) -> None:
    """A sphere of half the diameter has an eighth of the mass and feels the same drag."""
    variables = {**FEW, "start": packings / "two.data", "diameter": 0.1, "drag": 9}
    message = refused(deck("spheres"), variables=variables)
    assert "drag times dt must be below 1 with the smallest one" in message
