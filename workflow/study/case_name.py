"""The name of a case: what is set in it, as far as a line has room for that, and a hash of it all.

The case's folder, its result and its group in a study's file have this name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

# The files that decks read have a folder of their own in a case's, so that they may have any name.
INPUTS = "inputs"
# A name shows these variables even at their defaults, and others where they differ. Where room is
# short, they come first, in this order.
ALWAYS_SHOWN = ("seed", "particles", "aspect_ratio", "change")
DIGEST_LENGTH = 8
# Some encrypted disks take no file name of more than 143 characters: with the hash and the ending
# `.h5` a result has up to 104, and its temporary name, while it is written, 39 more.
WORDS_LENGTH = 92
NAME_LENGTH = WORDS_LENGTH + 1 + DIGEST_LENGTH
# A longer name of a deck is cut, so that the variables that are always shown find room.
DECK_LENGTH = 30
# Version 0.2 cut the words here, be it in the middle of one and before the seed.
WORDS_LENGTH_BEFORE = 160


def name_of(stages: Sequence[Mapping[str, Any]], digest: str) -> str:
    """Return the name of a case, which depends on nothing else in its study.

    A word is there as a whole or not at all: of those that find no room, the longest are left out,
    and `+2` says that they are two.

    Parameters
    ----------
    stages : decks in the order in which they run, each with `deck`, `values` (variables that the
        name shows) and `variables` (all of them)
    digest : hash of all that is set, DIGEST_LENGTH characters
    """
    deck, shown = _words_of(stages)
    words = _joined([deck, *shown.values()])
    if len(words) > WORDS_LENGTH:
        words = _shortened(deck[:DECK_LENGTH], shown)
    return f"{words}_{digest}"


def name_before(stages: Sequence[Mapping[str, Any]], digest: str) -> str:
    """Return the name that version 0.2 gave a case; the parameters are those of `name_of`."""
    deck, shown = _words_of(stages)
    return f"{_joined([deck, *shown.values()])[:WORDS_LENGTH_BEFORE]}_{digest}"


def name_in(record: Mapping[str, Any]) -> str:
    """Return the name of the case of a run, from its record.

    Version 0.2 has made records with longer names, and shorter ones have stayed what they are.
    """
    name = str(record["case"])
    if len(name) <= NAME_LENGTH:
        return name
    return name_of(record["stages"], name[-DIGEST_LENGTH:])


def unused_in(variables: Mapping[str, Any]) -> frozenset[str]:
    """Return which variables mean nothing: a start from a file has particles of its own."""
    from_file = str(variables.get("start")).startswith(f"{INPUTS}/")
    return frozenset({"particles"} if from_file else ())


def as_word(value: Any) -> str:
    """Return the value of a variable as LAMMPS takes it."""
    return value if isinstance(value, str) else repr(value)


def _words_of(stages: Sequence[Mapping[str, Any]]) -> tuple[str, dict[str, str]]:
    """Return the decks as a word, and a word for each variable that a name shows, by its name."""
    shown = {
        name: value
        for stage in stages
        for name, value in stage["variables"].items()
        if name in stage["values"]
        or (name in ALWAYS_SHOWN and name not in unused_in(stage["variables"]))
    }
    words = {name: _fit_for_a_file(f"{name}={as_word(value)}") for name, value in shown.items()}
    return _fit_for_a_file("+".join(stage["deck"] for stage in stages)), words


def _shortened(deck: str, words: Mapping[str, str]) -> str:
    """Return the deck and the words that find room, in their order, and how many are left out."""

    def rank(name: str) -> tuple[int, int]:
        if name in ALWAYS_SHOWN:
            return ALWAYS_SHOWN.index(name), 0
        return len(ALWAYS_SHOWN), len(words[name])

    kept: list[str] = []
    text = _joined([deck, f"+{len(words)}"])
    for name in sorted(words, key=rank):
        chosen = [each for each in words if each in kept or each == name]
        left = [f"+{len(words) - len(chosen)}"] if len(chosen) < len(words) else []
        longer = _joined([deck, *(words[each] for each in chosen), *left])
        if len(longer) <= WORDS_LENGTH:
            kept, text = chosen, longer
    return text


def _joined(words: Sequence[str]) -> str:
    return "_".join(words)


def _fit_for_a_file(word: str) -> str:
    return re.sub(r"[^\w.=+-]", "-", word, flags=re.ASCII)
