"""The C++ rooms: short, thresholds of EPS in one place, sets known by their class alone."""

from __future__ import annotations

import re
from pathlib import Path

SOURCES = Path(__file__).parents[2] / "src_fix"
MOST_LINES = 500
MOST_MEMBERS = 15
# LAMMPS's own class, which all rooms of the fix belong to.
HAS_ALL_ROOMS = "FixInelastic"
COMMENT = re.compile(r"//[^\n]*")
THRESHOLDS = "inelastic_thresholds.h"
# A factor of EPS beside it, and a number in what is asked of Step::eps.
FACTOR = re.compile(r"[\w.)]\s*\*\s*(?:step_\.)?settings\.tolerance|settings\.tolerance\s*\*")
EPS = re.compile(r"\beps\(((?:[^()]|\([^()]*\))*)\)")
NUMBER = re.compile(r"(?<![\w.])\d")
# The number that a half line is made of, and its name: others say AdmissibleSet.
LEAST = re.compile(r"\bset(?:\[[^\]]*\]|\.back\(\))?\.least\b|\bHalfLine\b")
SET = "inelastic_admissible_set.h"


def code_of(*endings: str) -> dict[str, str]:
    """Return the sources by their names, without comments."""
    paths = [path for ending in endings for path in SOURCES.rglob(f"*{ending}")]
    return {path.name: COMMENT.sub("", path.read_text()) for path in paths}


def test_no_file_is_longer_than_its_reader_can_hold() -> None:
    lengths = {
        path.name: len(path.read_text().splitlines())
        for ending in (".h", ".cpp")
        for path in SOURCES.rglob(f"*{ending}")
    }
    assert len(lengths) > 150
    assert {name: lines for name, lines in lengths.items() if lines > MOST_LINES} == {}


def bodies_of_classes(text: str) -> dict[str, str]:
    """Return what stands between the braces of each class or struct."""
    found = {}
    for head in re.finditer(r"\b(?:class|struct)\s+(?:alignas\(\d+\)\s+)?(\w+)[^;{()]*\{", text):
        depth, end = 1, head.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        found[head.group(1)] = text[head.end() : end - 1]
    return found


def private_members(body: str) -> list[str]:
    """Return the data members of a class whose names end with an underscore, as all private do."""
    for pair in (r"\{[^{}]*\}", r"\([^()]*\)", r"<[^<>;]*>"):
        while re.search(pair, body):
            body = re.sub(pair, " ", body)
    return re.findall(r"\b[a-z]\w*_\b", body)


def test_no_class_has_more_members_than_its_reader_can_hold() -> None:
    assert private_members("A f(int x_) const { return b_; } int c_ = 0, d_; B e_{c_};") == [
        "c_",
        "d_",
        "e_",
    ]
    members = {
        name: len(set(private_members(body)))
        for text in code_of(".h", ".cpp").values()
        for name, body in bodies_of_classes(text).items()
    }
    assert members["StepLength"] > 10
    del members[HAS_ALL_ROOMS]
    assert {name: count for name, count in members.items() if count > MOST_MEMBERS} == {}


def factors_of_eps(name: str, text: str) -> list[str]:
    """Return what a file says of EPS that belongs to the thresholds."""
    if name == THRESHOLDS:
        return []
    numbers = [found for found in EPS.findall(text) if NUMBER.search(found)]
    # Step::eps itself multiplies.
    text = text.replace("return factor * settings.tolerance;", "")
    return [f"{name}: {found}" for found in FACTOR.findall(text) + numbers]


def test_every_factor_of_eps_stands_on_the_axis() -> None:
    code = code_of(".h", ".cpp")
    assert THRESHOLDS in code
    assert [found for name, text in code.items() for found in factors_of_eps(name, text)] == []
    assert sum(len(EPS.findall(text)) for text in code.values()) > 15
    assert factors_of_eps("a.cpp", "x > 2.0 * step_.settings.tolerance") != []
    assert factors_of_eps("a.cpp", "x > step_.eps(0.5)") != []
    assert factors_of_eps("a.cpp", "x > step_.eps(in_eps::ALLOWED)") == []


def test_only_its_class_knows_what_a_set_is_made_of() -> None:
    code = code_of(".h", ".cpp")
    assert SET in code
    known = {name: LEAST.findall(text) for name, text in code.items() if name != SET}
    assert {name: found for name, found in known.items() if found} == {}
    assert LEAST.search("contacts.set[c].least = 0.0")
    assert LEAST.search("HalfLine<double>::pulls(1.0)")
