"""LAMMPS decks as a study sees them: a text, and the variables that the command line may set.

A variable is a line `variable NAME index DEFAULT  # meaning`, and nothing else is one. What values
the variables of our own decks allow is written down here, so that a study is checked before
anything runs; a deck of the user's own is only asked for the names.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from pathlib import Path

from .errors import WorkflowError

Value = int | float | str

# Lets a start fall until it is at rest; measured in a way of its own.
SETTLING = "settling"
SHIPPED = ("spheres", "dimers", "clusters", "response", SETTLING)
# Set by the workflow itself: where a deck writes, and the packing that the deck before it has left.
OUT, PACKING = "out", "packing"

_VARIABLE = re.compile(r"^variable\s+(\w+)\s+index\s+(\S+)", re.MULTILINE)


@dataclass(frozen=True)
class Rule:
    """Which values a variable may have.

    Attributes
    ----------
    allowed : in words, for error lines
    accepts : says of a value whether it is one of them
    """

    allowed: str
    accepts: Callable[[Value], bool]


def _number(value: Value) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    # A whole number may have more digits than float() takes.
    return abs(value) < 1e300


def _numbers(allowed: str, accepts: Callable[[float], bool]) -> Rule:
    return Rule(
        f"a number {allowed}",
        lambda value: _number(value) and accepts(float(value)),
    )


def _integers(least: int) -> Rule:
    return Rule(
        f"a whole number of at least {least}",
        lambda value: isinstance(value, int) and not isinstance(value, bool) and value >= least,
    )


def _words(*words: str) -> Rule:
    return Rule(" or ".join(words), lambda value: value in words)


_POSITIVE = _numbers("above 0", lambda value: 0 < value < float("inf"))
_NOT_NEGATIVE = _numbers("of at least 0", lambda value: 0 <= value < float("inf"))

RULES: Mapping[str, Rule] = {
    "particles": _integers(1),
    "diameter": _numbers("between 0 and 1", lambda value: 0 < value < 1),
    "aspect_ratio": _numbers("above 1 and up to 2", lambda value: 1 < value <= 2),
    "tolerance": _POSITIVE,
    "tolerance_agitated": _POSITIVE,
    "tolerance_measuring": _POSITIVE,
    "dt": _POSITIVE,
    "steps_agitated": _integers(0),
    "steps_settling": _integers(0),
    "steps_tightening": _integers(0),
    # 0: the contacts of the packing as it is.
    "steps_measuring": _integers(0),
    "steps_changing": _integers(1),
    "random_force": _NOT_NEGATIVE,
    "drag": _NOT_NEGATIVE,
    "seed": Rule(
        "a whole number from 1 to 2147483647",
        lambda value: isinstance(value, int) and not isinstance(value, bool) and 1 <= value < 2**31,
    ),
    "dump_every": _integers(1),
    "inertia": _words("point", "solid"),
    "solver": _words("apgd", "uzawa"),
    "extent": _NOT_NEGATIVE,
    "change": _words("walls", "tilt"),
    "angle": _numbers("from -90 to 90", lambda value: -90 <= value <= 90),
    "particle": _words("spheres", "dimers"),
    "contacts": _words("hard", "soft"),
    "reach": _POSITIVE,
    "time_settling": _POSITIVE,
    "time_between": _POSITIVE,
}

# Variables that name a file, and the words that they may be instead, deck by deck.
FILES: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "start": {"spheres": ("random",), "dimers": ("random", "regular")},
    "shape": {"clusters": ("tetrahedron",)},
}


@dataclass(frozen=True)
class Deck:
    """A LAMMPS deck.

    Attributes
    ----------
    name : of the file, without `.in`
    text : the whole file
    shipped : whether it is one of ours, whose variables have rules
    """

    name: str
    text: str
    shipped: bool

    @cached_property
    def variables(self) -> Mapping[str, Value]:
        """The variables that `-var` can set, with their defaults, in the order of the deck."""
        return {name: as_value(default) for name, default in _VARIABLE.findall(self.text)}

    @property
    def parameters(self) -> Mapping[str, Value]:
        """Those of the variables that are a study's to choose."""
        chosen = {OUT, PACKING}
        return {name: value for name, value in self.variables.items() if name not in chosen}

    @cached_property
    def fingerprint(self) -> str:
        """A hash of what the deck does: comments and white space do not count."""
        lines = (re.sub(r"\s+#.*$", "", line) for line in self.text.splitlines())
        what = "\n".join(" ".join(line.split()) for line in lines if not line.startswith("#"))
        return hashlib.sha256(what.encode()).hexdigest()[:16]


def as_value(text: str) -> Value:
    """Return the number that a deck's word stands for, or the word."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def find_deck(name: str, folder: Path) -> Deck:
    """Return a shipped deck by its name, or the user's own by its file's, seen from `folder`."""
    if name in SHIPPED:
        text = (files("lammps_inelastic.inputs") / f"{name}.in").read_text()
        return Deck(name, text, shipped=True)
    path = folder / name
    if not path.is_file():
        raise WorkflowError(
            f"no deck {name!r}: it must be {', '.join(SHIPPED)} or a file as seen from {folder}"
        )
    try:
        return Deck(path.stem, path.read_text(encoding="utf-8"), shipped=False)
    except UnicodeDecodeError as error:
        raise WorkflowError(f"{path}: not UTF-8: {error}") from None
