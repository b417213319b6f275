"""Arguments of `pack` as numbers, or one line about what is wrong with them."""

from __future__ import annotations

import math
import operator
from typing import Any

from ..errors import PackingError

# The shortest and the longest length, and so on: beyond them cubes of lengths leave the range of
# floating-point numbers.
LEAST, MOST = 1e-30, 1e30


def as_positive(value: Any, name: str) -> float:
    """Return a positive number; raise PackingError for anything else."""
    return as_number(value, name, LEAST, MOST, "a positive number")


def as_number(value: Any, name: str, low: float, high: float, allowed: str) -> float:
    """Return a number from low to high; raise PackingError, with what is allowed, for others."""
    try:
        number = math.nan if isinstance(value, str | bytes | bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not low <= number <= high:
        raise PackingError(f"{name} must be {allowed}, not {shown(value)}")
    return number


def as_whole(value: Any, name: str, low: int, high: int, allowed: str) -> int:
    """Return a whole number from low to high; raise PackingError for others."""
    try:
        number = low - 1 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = low - 1
    if not low <= number <= high:
        raise PackingError(f"{name} must be {allowed}, not {shown(value)}")
    return number


def shown(value: Any) -> str:
    """Return a value as an error shows it: in one line, and a short one."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
