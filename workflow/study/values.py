"""The values that a study file gives to a parameter: one, a list of them, or a range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..decks import Deck, Value, file_of
from ..errors import meant
from .case import is_word

# A study of more cases, or a parameter of more values, is a slip of the pen.
MOST_CASES = 10_000


def values_of(
    key: str, name: str, value: Any, decks: Sequence[Deck], folder: Path, mistakes: list[str]
) -> list[Value]:
    """Return the values that a value, a list or a range stands for.

    Parameters
    ----------
    key : key in the study file, for errors
    name : name of the parameter
    value : value in the study file
    decks : decks of the case, which say what is allowed
    folder : folder of the study file
    mistakes : list to which one line for each mistake is added
    """
    if isinstance(value, dict):
        values = _range(key, value, mistakes)
    else:
        values = value if isinstance(value, list) else [value]
    if isinstance(value, list) and not values:
        mistakes.append(f"{key}: the list is empty")
    rules = [deck.rules[name] for deck in decks if name in deck.rules]
    for each in values:
        if isinstance(each, bool) or not isinstance(each, int | float | str):
            mistakes.append(
                f"{key}: {each!r} is no value; it must be a number, a word, a list of them or "
                "{ from = A, to = B, step = S }"
            )
        elif isinstance(each, float) and not math.isfinite(each):
            mistakes.append(f"{key}: {each} is not allowed: it must be finite")
        elif isinstance(each, str) and not is_word(each):
            mistakes.append(f"{key}: {each!r} must be one word, without spaces, quotes, $ and &")
        elif file_of(decks, name, each, folder) is None:
            refusing = [rule for rule in rules if not rule.accepts(each)]
            mistakes.extend(
                f"{key}: {each!r} is not allowed: it must be {rule.allowed}" for rule in refusing
            )
            if not refusing and isinstance(each, int) and abs(each) >= 2**63:
                mistakes.append(f"{key}: {each} is not allowed: whole numbers must be below 2^63")
    return values


def unknown_variable(key: str, decks: Sequence[Deck]) -> str:
    """Say that no deck has a variable of the name that a key gives."""
    if not decks:
        return f"{key}: no deck knows it"
    allowed = "; ".join(f"{deck.name}: {', '.join(deck.parameters) or 'none'}" for deck in decks)
    names = [name for deck in decks for name in deck.parameters]
    near = meant(key.rpartition(".")[2], names)
    return f"{key}: no variable of that name{near}; allowed are {allowed}"


def _range(key: str, value: Mapping[str, Any], mistakes: list[str]) -> list[Value]:
    """Return from, from + step, ... up to `to`, which is included where it is met."""
    step = value.get("step", 1)
    ends = [value.get("from"), value.get("to"), step]
    numbers = all(isinstance(end, int | float) and not isinstance(end, bool) for end in ends)
    if value.keys() - {"from", "to", "step"} or not numbers:
        mistakes.append(f"{key}: a range is {{ from = A, to = B, step = S }}, three numbers")
        return []
    low, high = value["from"], value["to"]
    if not (step > 0 and low <= high and all(abs(end) < math.inf for end in ends)):
        mistakes.append(f"{key}: a range needs from <= to and step > 0, not {dict(value)}")
        return []
    try:
        # The quotient gets a hair more, because 0.1 + 2 x 0.1 is above 0.3.
        count = math.floor((high - low) / step * (1 + 1e-12) + 1e-9) + 1
    except OverflowError:
        count = MOST_CASES + 1
    if count > MOST_CASES:
        mistakes.append(f"{key}: more than {MOST_CASES} values")
        return []
    whole = all(isinstance(end, int) for end in ends)
    # Rounding to 15 digits gives the number that was meant, without the sum's last digit.
    return [low + i * step if whole else float(f"{low + i * step:.15g}") for i in range(count)]
