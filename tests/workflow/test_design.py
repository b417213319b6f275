"""DESIGN.md and CONTRIBUTING.md name files that exist, and DESIGN.md lists every source file."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CODE = re.compile(r"`([^`\s]+)`")
HEADING = re.compile(r"#+ `([^`]+)`$")
# A folder, or a file of a kind that the repository holds; runs leave files with other endings.
PATH = re.compile(r"[\w./{},-]*(?:/|\.(?:cmake|cpp|h|\{h,cpp\}|html|in|j2|md|py|pyi|toml|txt))")
# A part of a path that the reader chooses.
OPEN = "NAME"
# The rooms of the sources, with all that is below them.
ROOMS = ("src_fix", "analysis", "workflow")
ENDINGS = (".cpp", ".h", ".py", ".pyi")


def expanded(path: str) -> list[str]:
    """Return the paths that a path with braces stands for."""
    found = re.fullmatch(r"(.*)\{(.+)\}(.*)", path)
    if found is None:
        return [path]
    before, endings, after = found.groups()
    return [before + ending + after for ending in endings.split(",")]


def named_in(text: str) -> Iterator[tuple[str, list[Path]]]:
    """Return each path between backticks, and where it may be: here or in the section's folder."""
    folder = ROOT
    for line in text.splitlines():
        if line.startswith("#"):
            heading = HEADING.match(line)
            folder = ROOT / heading.group(1) if heading else ROOT
        for code in CODE.findall(line):
            if PATH.fullmatch(code) and OPEN not in code:
                yield from ((path, [folder / path, ROOT / path]) for path in expanded(code))


@pytest.mark.parametrize("name", ["DESIGN.md", "CONTRIBUTING.md"])
def test_every_file_that_is_named_exists(name: str) -> None:
    text = (ROOT / name).read_text()
    named = list(named_in(text))
    assert len(named) > 10
    assert [path for path, places in named if not any(place.exists() for place in places)] == []
    folders = [match.group(1) for line in text.splitlines() if (match := HEADING.match(line))]
    assert [folder for folder in folders if not (ROOT / folder).is_dir()] == []
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text)
    assert [link for link in links if not (ROOT / link).exists()] == []


def listed_in_rooms(text: str) -> set[Path]:
    """Return what the sections of the rooms list: each file in the section of its own folder."""
    rooms = text[text.index("## Rooms") : text.index("## One step")]
    return {places[0] for _, places in named_in(rooms)}


def is_listed(path: Path, listed: set[Path]) -> bool:
    """Say whether a file is listed, or its folder is, as one of files that are all alike."""
    return path in listed or path.parent in listed


def sources() -> list[Path]:
    """Return the source files, but for an `__init__.py` that only says what its folder is for."""
    found = [path for room in ROOMS for path in (ROOT / room).rglob("*") if path.suffix in ENDINGS]
    return [path for path in sorted(found) if not is_docstring_alone(path)]


def is_docstring_alone(path: Path) -> bool:
    """Say whether a file is an `__init__.py` with a docstring and nothing else."""
    if path.name != "__init__.py":
        return False
    (*_, last) = ast.parse(path.read_text()).body
    return isinstance(last, ast.Expr)


def test_every_source_file_is_listed_in_the_section_of_its_folder() -> None:
    listed, files = listed_in_rooms((ROOT / "DESIGN.md").read_text()), sources()
    assert len(files) > 200
    assert [str(path.relative_to(ROOT)) for path in files if not is_listed(path, listed)] == []


def test_a_file_that_is_not_listed_is_seen() -> None:
    text = (ROOT / "DESIGN.md").read_text()
    lines = text.splitlines(keepends=True)
    for start, missing in (
        ("- `gather.py`", "workflow/running/gather.py"),
        ("- `inelastic_gluey.{h,cpp}`", "src_fix/laws/inelastic_gluey.h"),
        ("- `sections/`", "workflow/report/sections/agitation.py"),
    ):
        assert is_listed(ROOT / missing, listed_in_rooms(text))
        (line,) = (line for line in lines if line.startswith(start))
        assert not is_listed(ROOT / missing, listed_in_rooms(text.replace(line, "")))


# Folders whose section on the page lists their files, each and no other ones.
LISTED = (
    "src_fix/core",
    "src_fix/laws",
    "src_fix/npz",
    "src_fix/lammps",
    "src_fix/python",
    "src_fix/plugin",
    "analysis",
    "inputs",
    "tests",
    "tests/helpers",
    "tests/random_scenes",
    "tests/benchmark",
)
# Names that say what the files are: of any folder, and of those of the tests.
OF_ANY, OF_TESTS = re.compile(r"README\.md"), re.compile(r"(test_.*|__init__)\.py")


def listed_in(text: str, room: str) -> set[str]:
    """Return the files that the section of a folder names, without those of folders in it."""
    (section,) = re.findall(rf"^#+ `{re.escape(room)}`$(.*?)(?=^#|\Z)", text, re.S | re.M)
    named = [code for code in CODE.findall(section) if "/" not in code and OPEN not in code]
    return {path for code in named if PATH.fullmatch(code) for path in expanded(code)}


def differences(room: str, listed: set[str], there: set[str]) -> str:
    """Return one line about what a list and a folder do not have in common, or nothing."""
    known = OF_TESTS if room.startswith("tests") else OF_ANY
    there = {name for name in there if not known.fullmatch(name)}
    parts = {"not on the page": there - listed, "not in the folder": listed - there}
    said = [f"{', '.join(sorted(names))} ({where})" for where, names in parts.items() if names]
    return f"DESIGN.md, {room}: {'; '.join(said)}" if said else ""


@pytest.mark.parametrize("room", LISTED)
def test_a_folder_holds_what_its_section_lists(room: str) -> None:
    there = {path.name for path in (ROOT / room).iterdir() if PATH.fullmatch(path.name)}
    assert there
    if wrong := differences(room, listed_in((ROOT / "DESIGN.md").read_text(), room), there):
        pytest.fail(wrong, pytrace=False)


def test_a_file_too_few_and_one_too_many() -> None:
    text = "### `tests/a`\n- `x.{h,cpp}`, `b/y.py`: `Step::x`.\n### `tests/ab`\n- `z.py`: `a`.\n"
    listed = listed_in(text, "tests/a")
    assert listed == {"x.h", "x.cpp"}
    assert differences("tests/a", listed, {"x.h", "x.cpp", "test_x.py"}) == ""
    assert differences("tests/a", listed, {"x.h", "w.py"}) == (
        "DESIGN.md, tests/a: w.py (not on the page); x.cpp (not in the folder)"
    )
    assert differences("a", listed, {"x.h", "x.cpp", "test_x.py"}) == (
        "DESIGN.md, a: test_x.py (not on the page)"
    )


def test_helpers_are_told_from_tests() -> None:
    """Folders of tests hold tests and their fixtures alone, and that of the helpers no test."""
    programs = {"helpers", "random_scenes", "benchmark"}
    tests = [path for path in (ROOT / "tests").glob("*/*.py") if path.parent.name not in programs]
    allowed = re.compile(r"(test_.*|conftest|__init__)\.py")
    helpers = sorted((ROOT / "tests" / "helpers").glob("*.py"))
    assert len(tests) > 100
    assert [str(path.relative_to(ROOT)) for path in tests if not allowed.fullmatch(path.name)] == []
    of_a_test = re.compile(r"^def test_|^from tests\.\w+(\.| import )test_", re.M)
    assert [path.name for path in helpers if of_a_test.search(path.read_text())] == []


def test_paths_are_told_from_other_words() -> None:
    text = "### `tests/npz`\n`npz_test.cpp` `a.{h,cpp}` `analysis/` `Step::sides` `NAME.py` `a.h5`"
    found = dict(named_in(text))
    assert list(found) == ["npz_test.cpp", "a.h", "a.cpp", "analysis/"]
    assert found["a.h"] == [ROOT / "tests/npz/a.h", ROOT / "a.h"]
