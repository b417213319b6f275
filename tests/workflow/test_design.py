"""DESIGN.md and CONTRIBUTING.md name files that exist, and DESIGN.md names every source file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CODE = re.compile(r"`([^`\s]+)`")
HEADING = re.compile(r"#+ `([^`]+)`$")
# A folder, or a file of a kind that the repository holds; runs leave files with other endings.
PATH = re.compile(r"[\w./{},-]*(?:/|\.(?:cpp|h|\{h,cpp\}|in|j2|md|py|pyi|toml|txt))")
# A part of a path that the reader chooses.
OPEN = "NAME"
SOURCES = (
    "src_fix/core/*.cpp",
    "src_fix/core/*.h",
    "src_fix/lammps/*.cpp",
    "src_fix/lammps/*.h",
    "workflow/*.py",
    "analysis/*.py",
)


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


def test_every_source_file_is_named() -> None:
    named = {place for _, places in named_in((ROOT / "DESIGN.md").read_text()) for place in places}
    sources = [path for pattern in SOURCES for path in sorted(ROOT.glob(pattern))]
    assert len(sources) > 100
    assert [str(path.relative_to(ROOT)) for path in sources if path not in named] == []


def test_paths_are_told_from_other_words() -> None:
    text = "### `tests/npz`\n`npz_test.cpp` `a.{h,cpp}` `analysis/` `Step::sides` `NAME.py` `a.h5`"
    found = dict(named_in(text))
    assert list(found) == ["npz_test.cpp", "a.h", "a.cpp", "analysis/"]
    assert found["a.h"] == [ROOT / "tests/npz/a.h", ROOT / "a.h"]
