"""Study files of any content: cases with allowed values, or one line for each mistake."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lammps_inelastic.workflow.decks import find_deck
from lammps_inelastic.workflow.errors import StudyError
from lammps_inelastic.workflow.shipped import DECKS as SHIPPED
from lammps_inelastic.workflow.study import MOST_CASES, Study, read_study

# The same examples on every machine; a folder may serve all examples of a test, each writes anew.
FUZZED = settings(
    derandomize=True,
    deadline=None,
    max_examples=200,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)

VALID = """\
title = "Packing fraction against aspect ratio"
deck = ["dimers", "settling"]

[parameters]
particles = 2000
diameter = 0.085
aspect_ratio = [1.1, 1.5, 1.8]
seed = { from = 1, to = 4 }
particle = "dimers"

[[rows]]
tolerance = 0.005
[[rows]]
deck = "spheres"
start = "random"

[common]
dt = 0.015
[common.spheres]
dt_resting = 0.03

[outputs]
box = [0.25, 0.75, 0.25, 0.75, 0.25, 0.75]
points = 1000
keep = "results"
[outputs.profile]
axis = "x"
thickness = 0.1
"""


def read_or_refused(path: Path, content: bytes) -> Study | tuple[str, ...]:
    """Return the study, whose values are all allowed, or the lines about its mistakes."""
    path.write_bytes(content)
    try:
        study = read_study(path)
    except StudyError as error:
        mistakes = error.mistakes
    else:
        mistakes = ()
    for line in mistakes:
        assert line.startswith(f"{path}: ")
        # More than a reader wants to see is cut.
        assert len(line) < 3000
        assert line.isprintable()
    if mistakes:
        return tuple(line.removeprefix(f"{path}: ") for line in mistakes)
    assert 1 <= len(study.cases) <= MOST_CASES * 100
    for case in study.cases:
        for stage in case.stages:
            for name, value in stage.variables.items():
                assert stage.deck.rules[name].accepts(value) or name in ("start", "shape")
    return study


@FUZZED
@given(content=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_junk(content: bytes, tmp_path: Path) -> None:
    # Of these there is not one with both keys that are needed.
    assert isinstance(read_or_refused(tmp_path / "a.toml", content), tuple)


def test_cut_off_anywhere(tmp_path: Path) -> None:
    """After every single byte: a study of less, as nobody can see, or mistakes."""
    whole = VALID.encode()
    assert isinstance(read_or_refused(tmp_path / "a.toml", whole), Study)
    for length in range(len(whole)):
        read_or_refused(tmp_path / "a.toml", whole[:length])


@FUZZED
@given(data=st.data())
def test_bytes_that_were_changed(data: st.DataObject, tmp_path: Path) -> None:
    content = bytearray(VALID.encode())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 10))] = data.draw(st.binary(max_size=3))
    read_or_refused(tmp_path / "a.toml", bytes(content))


@pytest.mark.parametrize("opening", ["[", "{a=", "a."])
def test_what_is_too_deep(opening: str, tmp_path: Path) -> None:
    found = read_or_refused(tmp_path / "a.toml", f"x = {opening * 100_000}".encode())
    assert isinstance(found, tuple)
    assert found[0].startswith("not TOML: ")


def as_toml(value: object) -> str:
    """Write a value as TOML; a text with every letter that is not plain escaped."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return "nan" if math.isnan(value) else repr(value)
    if isinstance(value, str):
        return '"' + "".join(f"\\U{ord(letter):08x}" for letter in value) + '"'
    if isinstance(value, list):
        return f"[{', '.join(map(as_toml, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{as_toml(k)} = {as_toml(v)}' for k, v in value.items())} }}"
    return str(value)


LETTERS = st.text(st.characters(exclude_categories=["Cs"]), max_size=5)
SINGLE = (
    st.integers()
    | st.integers(min_value=-3, max_value=3)
    | st.sampled_from([2**31, 2**63, 10**400])
    | st.floats()
    | st.booleans()
    | LETTERS
    | st.sampled_from(["random", "spheres", "tilt", "walls", "apgd", "x", "../a", "2024-01-01"])
)
RANGE = st.dictionaries(st.sampled_from(["from", "to", "step", "by"]), SINGLE, max_size=4)
VALUES = st.recursive(SINGLE | RANGE, lambda inner: st.lists(inner, max_size=3), max_leaves=5)
DECKS = st.sampled_from(SHIPPED)
NAMES = sorted({name for deck in SHIPPED for name in find_deck(deck, Path()).parameters})
TABLES = st.dictionaries(st.sampled_from(NAMES) | LETTERS, VALUES, max_size=4)
OUTPUTS = st.dictionaries(
    st.sampled_from(["box", "points", "evolution", "profile", "structure", "pictures", "keep"])
    | LETTERS,
    VALUES | TABLES,
    max_size=3,
)
STUDIES = st.fixed_dictionaries(
    {"title": st.just("t") | VALUES, "deck": DECKS | st.lists(DECKS, max_size=3) | VALUES},
    optional={
        "common": TABLES | st.dictionaries(DECKS | LETTERS, TABLES | VALUES, max_size=3) | VALUES,
        "parameters": TABLES | VALUES,
        "rows": st.lists(TABLES, max_size=3) | VALUES,
        "outputs": OUTPUTS | VALUES,
    },
)


@FUZZED
@given(study=STUDIES)
def test_keys_and_values_of_any_kind(study: dict[str, object], tmp_path: Path) -> None:
    text = "".join(f"{as_toml(key)} = {as_toml(value)}\n" for key, value in study.items())
    read_or_refused(tmp_path / "a.toml", text.encode())


@FUZZED
@given(name=st.sampled_from(NAMES), value=VALUES)
def test_one_value_of_any_kind(name: str, value: object, tmp_path: Path) -> None:
    """A number stands in the cases as it stands in the file, or it is refused."""
    text = f'title = "t"\ndeck = "spheres"\n[parameters]\n{name} = {as_toml(value)}\n'
    found = read_or_refused(tmp_path / "a.toml", text.encode())
    if isinstance(found, tuple):
        assert any(line.startswith((f"parameters.{name}: ", "not TOML")) for line in found), found
    elif not isinstance(value, dict | list):
        assert [case.variables[name] for case in found.cases] == [value]


@pytest.mark.parametrize(
    ("old", "new", "key", "line"),
    [
        ("seed = {", "drag = -1\nseed = {", "parameters.drag", 8),
        ("seed = {", "zoo = 1\nseed = {", "parameters.zoo", 8),
        ("[1.1, 1.5,", "[\n  1.1, # small\n\n  0.5,\n  ", "parameters.aspect_ratio", 7),
        ("tolerance = 0.005", "tolerance = -1", "rows[1].tolerance", 12),
        ('start = "random"', 'start = "random"\nfoo = 1', "rows[2].foo", 16),
        ('"spheres"', '"sphere"', "rows[2].deck", 14),
        ("dt = 0.015", "dt = [1]", "common.dt", 18),
        ("dt_resting = 0.03", "dt_resting = 3", "common.spheres.dt_resting", 20),
        ("[common.spheres]", "[common.sphere]", "common.sphere", 19),
        ("points = 1000", "points = 0", "outputs.points", 24),
        ('axis = "x"', 'axis = "w"', "outputs.profile.axis", 27),
        ("thickness = 0.1", "axes = 1", "outputs.profile.axes", 28),
        ('deck = ["dimers", "settling"]', "deck = 5", "deck", 2),
        ('title = "', 'titel = "', "titel", 1),
    ],
)
def test_the_line_is_said(old: str, new: str, key: str, line: int, tmp_path: Path) -> None:
    assert old in VALID
    found = read_or_refused(tmp_path / "a.toml", VALID.replace(old, new, 1).encode())
    assert isinstance(found, tuple)
    (said,) = (each for each in found if each.startswith(f"{key}: "))
    assert said.endswith(f" (at line {line})")
