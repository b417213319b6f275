"""The lines of a TOML file on which its keys stand, which tomllib does not tell."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

# A value of more lines is not read to its end: the time grows as their square.
MOST_LINES = 1000


def lines_of_keys(text: str) -> Mapping[str, int]:
    """Return the line of each key of a valid TOML file, counted from 1.

    Keys are as in `parameters.seed`; the tables of an array count from 1: `rows[2].seed`. A key
    that stands after a value of very many lines may be missing.
    """
    found: dict[str, int] = {}
    tables: Counter[str] = Counter()
    table = ""
    for line, statement in _statements(text):
        content = tomllib.loads(statement)
        if statement.lstrip().startswith("["):
            table = _named(content, tables)
            found.setdefault(table, line)
        else:
            for key in _keys(content):
                found.setdefault(f"{table}.{key}" if table else key, line)
    return found


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Split a file where tomllib takes each part alone: a table's name, or a key with its value."""
    # TOML has no other end of a line.
    lines = text.split("\n")
    start = 0
    for end in range(1, len(lines) + 1):
        if end - start > MOST_LINES:
            return
        statement = "\n".join(lines[start:end])
        try:
            tomllib.loads(statement)
        except tomllib.TOMLDecodeError:
            continue
        yield start + 1, statement
        start = end


def _named(content: Mapping[str, Any], tables: Counter[str]) -> str:
    """Return the name of the table that a statement opens; those of arrays are counted."""
    name = ""
    inside: Any = content
    while inside:
        ((key, inside),) = inside.items()
        name = f"{name}.{key}" if name else key
        if isinstance(inside, list):
            tables[name] += 1
            (inside,) = inside
            name = f"{name}[{tables[name]}]"
        elif tables[name]:
            # The table is inside the last table of an array.
            name = f"{name}[{tables[name]}]"
    return name


def _keys(content: Any) -> Iterator[str]:
    """Return the keys of a table and of the tables in it."""
    for key, value in content.items():
        yield key
        if isinstance(value, dict):
            yield from (f"{key}.{inner}" for inner in _keys(value))
        elif isinstance(value, list):
            for number, each in enumerate(value, 1):
                yield f"{key}[{number}]"
                if isinstance(each, dict):
                    yield from (f"{key}[{number}].{inner}" for inner in _keys(each))
