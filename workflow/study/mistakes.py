"""The mistakes of a study file, in the words of its users: one line each, with file and line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from pydantic import BaseModel, ValidationError

from ..errors import meant
from .file_format import Outputs, ProfileOutput, StudyFile
from .toml_lines import lines_of_keys

# A file may quote a picture: a longer line is cut.
LONGEST_LINE = 2000

# TOML has other words than pydantic for these.
KINDS = {"dict_type": "a table", "model_type": "a table", "list_type": "a list"}
KINDS |= {"tuple_type": "a list"}
# Pydantic has several things to say of these keys at a time.
WHOLE = {("deck",): "a name or a list of names", ("outputs", "box"): "six numbers or cell"}


def placed(mistakes: Sequence[str], path: Path, text: str) -> list[str]:
    """Return each mistake with its file, and with its line if its key is there."""
    lines = lines_of_keys(text)
    placed = []
    # A mistake may show in every row that it concerns, and is told once.
    for mistake in dict.fromkeys(mistakes):
        line = lines.get(mistake.split(": ")[0])
        # These are the words of tomllib.
        where = "" if line is None else f" (at line {line})"
        placed.append(f"{shown(str(path))}: {shown(mistake)}{where}")
    return placed


def shown(mistake: str) -> str:
    """Return a line without letters that would spoil a terminal, and cut if it would fill it."""
    text = "".join(each if each.isprintable() else repr(each)[1:-1] for each in mistake)
    return text if len(text) <= LONGEST_LINE else f"{text[:LONGEST_LINE]}..."


def _place(steps: Sequence[int | str]) -> str:
    """Return a key as `lines_of_keys` has it: entries of a list count from 1."""
    kept = (step for step in steps if step not in ("str", "list[str]"))
    words = (f"[{step + 1}]" if isinstance(step, int) else f".{step}" for step in kept)
    return "".join(words).removeprefix(".")


def mistakes_of(error: ValidationError) -> Iterator[str]:
    """Return the mistakes that pydantic found, one line each, as a user of the file would say."""
    said: set[str] = set()
    for mistake in error.errors():
        key = next((key for key in WHOLE if mistake["loc"][: len(key)] == key), None)
        # The key itself may be missing, and the bounds of a box in the wrong order.
        if key is not None and (mistake["type"], mistake["loc"]) not in (
            ("missing", key),
            ("value_error", key),
        ):
            line = f"{'.'.join(key)}: it must be {WHOLE[key]}"
            if line not in said:
                said.add(line)
                yield line
            continue
        place = _place(mistake["loc"])
        message = mistake["msg"].removeprefix("Value error, ")
        if mistake["type"] == "extra_forbidden":
            model: type[BaseModel] = Outputs if place.startswith("outputs") else StudyFile
            if place.startswith("outputs.profile"):
                model = ProfileOutput
            near = meant(str(mistake["loc"][-1]), model.model_fields)
            message = f"no such key{near}; allowed are {', '.join(model.model_fields)}"
        elif mistake["type"] == "missing":
            message = "this key is missing"
        elif mistake["type"] in KINDS:
            message = f"{mistake['input']!r} is not allowed: it must be {KINDS[mistake['type']]}"
        else:
            message = f"{mistake['input']!r} is not allowed: {message}"
        yield f"{place}: {message}"
