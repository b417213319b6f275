"""LAMMPS decks as a study sees them: a text, and the parameters that the command line may set.

Names, defaults and what each parameter may be stand in the deck's own table, which LAMMPS's command
`parameters` (docs/reference/parameters.md) reads too, so that a study is checked before it runs.
A deck of the user's own may have a table as well; one that has none is only asked for the names in
its lines `variable NAME index DEFAULT`.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from .errors import WorkflowError, meant
from .files import is_file
from .shipped import DECKS, deck_text

Value = int | float | str

# The workflow itself sets these variables: the folder to which a deck writes, and the packing that
# the deck before it has left.
OUT, PACKING = "out", "packing"
# These parameters may name a file in a deck without a table.
FILES = ("start", "shape")

_VARIABLE = re.compile(r"^variable\s+(\w+)\s+index\s+(\S+)", re.MULTILINE)
_TABLE = re.compile(r'^[ \t]*parameters[ \t]+"""(.*?)"""', re.MULTILINE | re.DOTALL)
_GRAVITY = re.compile(r"^variable[ \t]+gravity[ \t]+equal[ \t]+(\S+)", re.MULTILINE)
_NUMBER = re.compile(r"-?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
# An integer of LAMMPS is in this range.
_INTEGERS = (-(2**31), 2**31 - 1)
# LAMMPS can still calculate with numbers up to this one.
_LARGEST = 1e300


@dataclass(frozen=True)
class Bound:
    """One end of a range.

    Attributes
    ----------
    text : the number as it is written in the table
    included : whether the value itself is allowed
    """

    text: str
    included: bool

    @property
    def value(self) -> float:
        """The number."""
        return float(self.text)


@dataclass(frozen=True)
class Rule:
    """A rule that says which values a parameter may have.

    Attributes
    ----------
    kind : integer, number, words or folder
    low, high : ends of the range of a number; None for no bound
    words : words that are allowed
    file : whether the name of a file that is there is allowed, too
    """

    kind: str
    low: Bound | None = None
    high: Bound | None = None
    words: tuple[str, ...] = ()
    file: bool = False

    @property
    def allowed(self) -> str:
        """The allowed values in words, for error lines; the command `parameters` has the same."""
        if self.kind == "folder":
            return "a folder for output"
        if self.kind == "words":
            choices = [*self.words, *(["a file that is there"] if self.file else [])]
            return " or ".join([", ".join(choices[:-1]), choices[-1]] if choices[1:] else choices)
        text = "a whole number" if self.kind == "integer" else "a number"
        low, high = self.low, self.high
        if low is not None:
            from_ = " from " if high is not None else " of at least "
            text += f"{from_ if low.included else ' above '}{low.text}"
        if high is not None:
            if low is None:
                text += " of at most " if high.included else " below "
            elif high.included:
                text += " to " if low.included else " and up to "
            else:
                text += " to below " if low.included else " and below "
            text += high.text
        return text

    def accepts(self, value: Value) -> bool:
        """Say whether a value is allowed; the name of a file never is, but the words beside it."""
        if self.kind == "folder":
            return isinstance(value, str) and value != ""
        if self.kind == "words":
            return value in self.words
        kinds = int if self.kind == "integer" else int | float
        if isinstance(value, bool) or not isinstance(value, kinds):
            return False
        # The comparison comes first, as a whole number may have more digits than float() takes.
        if not abs(value) < _LARGEST:
            return False
        if self.low and not (
            value >= self.low.value if self.low.included else value > self.low.value
        ):
            return False
        return not self.high or (
            value <= self.high.value if self.high.included else value < self.high.value
        )


def read_rule(text: str) -> Rule:
    """Return the rule that a table states, such as `integer >= 1` or `random or file`.

    Raises ValueError that says what is wrong.
    """
    words = text.split()
    if words == ["folder"]:
        return Rule("folder")
    if words and words[0] in ("integer", "number"):
        kind, *pairs = words
        least, most = _INTEGERS
        bounds: dict[str, Bound] = {}
        for sign, number in zip(pairs[::2], [*pairs[1::2], ""], strict=False):
            end = sign[0]
            if (
                sign not in (">", ">=", "<", "<=")
                or end in bounds
                or not _NUMBER.fullmatch(number)
                or math.isinf(float(number))
            ):
                raise ValueError("the bounds must be > or >= and a number, < or <= and a number")
            bounds[end] = Bound(number, len(sign) == 2)
        if kind == "integer":
            bounds = {">": Bound(str(least), True), "<": Bound(str(most), True)} | bounds
        return Rule(kind, bounds.get(">"), bounds.get("<"))
    if len(words) % 2 == 0 or any((word == "or") != (i % 2 == 1) for i, word in enumerate(words)):
        raise ValueError(
            'it must be integer or number with bounds, words with "or" between them, or folder'
        )
    choices = words[::2]
    return Rule("words", words=tuple(w for w in choices if w != "file"), file="file" in choices)


@dataclass(frozen=True)
class Deck:
    """A LAMMPS deck.

    Attributes
    ----------
    name : name of the file, without `.in`
    text : text of the whole file
    shipped : whether it is one of ours
    """

    name: str
    text: str
    shipped: bool

    @cached_property
    def _table(self) -> Mapping[str, tuple[Value, Rule]]:
        """The default and the rule of every parameter in the deck's table; empty if it has none.

        Raises WorkflowError that quotes the line that cannot be read.
        """
        found = _TABLE.search(self.text)
        table: dict[str, tuple[Value, Rule]] = {}
        for line in found.group(1).splitlines() if found else ():
            words = line.partition("#")[0].split(maxsplit=2)
            if not words:
                continue
            try:
                name, default, rule = words
                if not re.fullmatch(r"\w+", name, re.ASCII) or name in table:
                    raise ValueError("its name is no name, or there twice")
                table[name] = as_value(default), read_rule(rule)
            except ValueError as error:
                why = error if len(words) == 3 else "it must be name, default and what is allowed"
                raise WorkflowError(f"a line of its parameters: {line.strip()}: {why}") from None
        return table

    @property
    def rules(self) -> Mapping[str, Rule]:
        """The rules of the parameters; empty for a deck without a table."""
        return {name: rule for name, (_, rule) in self._table.items()}

    @cached_property
    def variables(self) -> Mapping[str, Value]:
        """The parameters that `-var` can set, with their defaults, in the order of the deck."""
        if _TABLE.search(self.text):
            return {name: default for name, (default, _) in self._table.items()}
        return {name: as_value(default) for name, default in _VARIABLE.findall(self.text)}

    @property
    def parameters(self) -> Mapping[str, Value]:
        """The variables that are a study's to choose, with their defaults."""
        chosen = {OUT, PACKING}
        return {name: value for name, value in self.variables.items() if name not in chosen}

    @cached_property
    def fingerprint(self) -> str:
        """A hash of what the deck does: comments and white space do not count."""
        lines = (re.sub(r"\s+#.*$", "", line) for line in self.text.splitlines())
        what = "\n".join(" ".join(line.split()) for line in lines if not line.startswith("#"))
        return hashlib.sha256(what.encode()).hexdigest()[:16]

    def names_file(self, name: str, value: Value) -> bool:
        """Say whether a parameter's value names a file, and is none of the rule's words."""
        if name not in self.parameters:
            return False
        rule = self.rules.get(name)
        if rule is None:
            return name in FILES
        return rule.file and value not in rule.words


def gravity_of(text: str) -> float | None:
    """Return the gravity that a deck's text sets; None where it is a formula, 0 or not set."""
    found = _GRAVITY.search(text)
    value = as_value(found.group(1)) if found else 0
    if isinstance(value, str) or not 0 < abs(value) < math.inf:
        return None
    return float(value)


def as_value(text: str) -> Value:
    """Return the number that a deck's word stands for, or the word.

    One that no computer number holds, such as a whole number of 22 digits, stays a word: LAMMPS
    gets it as it is written, and no file keeps another one in its place.
    """
    for kind in (int, float):
        try:
            value = kind(text)
        except ValueError:
            continue
        if abs(value) < (2**63 if kind is int else math.inf):
            return value
        return text
    return text


def file_of(decks: Sequence[Deck], name: str, value: Value, folder: Path) -> Path | None:
    """Return the file that a parameter's value names as seen from a folder; None if it is none."""
    path = folder / str(value)
    there = any(deck.names_file(name, value) for deck in decks) and is_file(path)
    return path if there else None


def find_deck(name: str, folder: Path) -> Deck:
    """Return a shipped deck by its name, or the user's own by its file's, seen from `folder`.

    Raises WorkflowError if there is none, or if it cannot be read.
    """
    if name in DECKS:
        return Deck(name, deck_text(name), shipped=True)
    path = folder / name
    if not is_file(path):
        raise WorkflowError(
            f"no deck {name!r}{meant(name, DECKS)}: it must be {', '.join(DECKS)} or a file as "
            f"seen from {folder}"
        )
    try:
        deck = Deck(path.stem, path.read_text(encoding="utf-8"), shipped=False)
        # The table is read now, while the file's name is known.
        _ = deck.variables
        return deck
    except UnicodeDecodeError as error:
        raise WorkflowError(f"{path}: not UTF-8: {error}") from None
    except WorkflowError as error:
        raise WorkflowError(f"{path}: {error}") from None
