"""A study: a TOML file that says which cases to run and what to measure of each.

    title = "Packing fraction against aspect ratio"
    deck  = "dimers"                     # spheres, dimers, clusters, a file, or several in turn

    [common]                             # optional: a value each for all cases; no name shows it
    dt = 0.01
    [common.dimers]                      # the same for one deck
    dt_resting = 0.03

    [parameters]                         # variables of the deck: a value, a list or a range each
    particles    = 2000
    diameter     = 0.085
    aspect_ratio = [1.1, 1.5, 1.8]
    seed         = { from = 1, to = 4 }

    [[rows]]                             # optional: on top of the parameters, each row apart
    tolerance = 0.005
    [[rows]]
    deck = "spheres"

    [outputs]                            # optional: what is measured of each case
    box = [0.25, 0.75, 0.25, 0.75, 0.25, 0.75]

The cases are all combinations of the values, row by row.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import StudyError, WorkflowError
from ..files import read_regular
from .case import Study
from .cases import cases_of
from .file_format import StudyFile
from .measurable import doubtful_outputs, unmeasurable_outputs
from .mistakes import mistakes_of, placed, shown

# A study's name names a file and a folder, with some letters more while they are written [bytes].
LONGEST_STUDY_NAME = 200
# A larger study file is some other file [bytes].
LARGEST_FILE = 1_000_000
# A whole number of more bits cannot be written in decimal digits by Python.
MOST_BITS = 10_000


def read_study(path: Path) -> Study:
    """Read a study file and check all of it.

    Raises StudyError with one line for every mistake.
    """
    if mistake := mistake_in_name(path.stem):
        raise StudyError([shown(f"{path}: {mistake}")])
    try:
        text = read_regular(path, LARGEST_FILE).decode("utf-8-sig")
        content = tomllib.loads(text)
        if _has_endless_number(content):
            raise ValueError("a whole number has too many digits")
    except WorkflowError as error:
        raise StudyError([shown(str(error))]) from None
    # Python raises ValueError for a whole number of thousands of digits, too.
    except ValueError as error:
        raise StudyError([f"{path}: not TOML: {shown(str(error))}"]) from None
    except RecursionError:
        raise StudyError(
            [f"{path}: not TOML: tables or lists are too deep in one another"]
        ) from None
    mistakes: list[str] = []
    try:
        file = StudyFile.model_validate(content)
    except ValidationError as error:
        mistakes = list(mistakes_of(error))
        if any(one["loc"][:1] != ("outputs",) for one in error.errors()):
            raise StudyError(placed(mistakes, path, text)) from None
        # Parameters and rows are tables: the mistakes in them are told together with these.
        file = StudyFile.model_validate({**content, "outputs": {}})
    if not file.title.isprintable():
        mistakes.append(f"title: {file.title!r} is not allowed: it must be one line of text")
    cases = tuple(cases_of(file, path.parent, mistakes))
    if not mistakes:
        mistakes += dict.fromkeys(unmeasurable_outputs(file.outputs, cases))
    if mistakes:
        raise StudyError(placed(mistakes, path, text))
    warnings = placed([*doubtful_outputs(file.outputs, cases)], path, text)
    return Study(path.stem, file.title, text, cases, file.outputs, tuple(warnings))


def mistake_in_name(name: str) -> str | None:
    """Return why a study file's name cannot name its results; None if it can."""
    if name.startswith(".") or not name.isprintable() or name != name.strip():
        return (
            "the file's name, which its results get, must begin with a letter or a digit, and have "
            "neither line breaks nor other characters that cannot be printed"
        )
    if len(name.encode()) > LONGEST_STUDY_NAME:
        return f"the file's name is too long: at most {LONGEST_STUDY_NAME} bytes are allowed"
    return None


def _has_endless_number(content: Any) -> bool:
    """Say whether a TOML file has a whole number of more digits than Python writes."""
    if isinstance(content, dict):
        return any(map(_has_endless_number, content.values()))
    if isinstance(content, list):
        return any(map(_has_endless_number, content))
    return isinstance(content, int) and content.bit_length() > MOST_BITS
