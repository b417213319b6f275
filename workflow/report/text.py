"""Numbers as the report writes them: every number in a table or a text is formatted here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal

from .statistics import Sample, Stated

# DASH stands where nothing is known, MINUS before negative numbers.
NOT_RUN = "not run yet"
DASH, MINUS = "\N{EN DASH}", "\N{MINUS SIGN}"
# The paper's means over several simulations are printed with two decimals.
DECIMALS_OF_SERIES = 2
# A number of so many digits before or behind the point is written with a power of ten.
LONGEST = 12
# A number below this is written with a power of ten if it has more letters: 0.00001 stays.
SMALL, MOST_OF_SMALL = 1e-4, 8


def as_text(value: float, decimals: int) -> str:
    """Write a number, or a dash for NaN."""
    if math.isnan(value):
        return DASH
    text = f"{value:.{decimals}f}"
    # A number that rounds to zero is not written as -0.00.
    return text.replace("-", MINUS) if float(text) else text.removeprefix("-")


def as_short(value: float) -> str:
    """Write a number in as few digits as it needs, at most four, or a dash for NaN.

    One that would begin with a row of zeros is written as 5.6e-6: two digits and a power of ten.
    """
    if value == 0 or not math.isfinite(value):
        return as_text(value, 0)
    # Fixed notation is read more easily; a tiny or huge number would be zeros alone.
    decimals = 3 - math.floor(math.log10(abs(value)))
    if not -LONGEST < decimals < LONGEST:
        text = f"{value:.4g}"
    else:
        text = f"{value:.{max(decimals, 0)}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
        if abs(value) < SMALL and len(text.lstrip("-")) > MOST_OF_SMALL:
            digits, power = f"{value:.1e}".split("e")
            text = f"{digits}e{int(power)}"
    return text.replace("-", MINUS)


def as_count(value: float) -> str:
    """Write a whole number with a comma between thousands."""
    return f"{value:,.0f}"


def as_runs(count: int) -> str:
    """Write a number of runs: `1 run`, `2 runs`."""
    return f"{count} run{'' if count == 1 else 's'}"


def as_value(value: object) -> str:
    """Write a parameter: a number with its own digits, or a word."""
    if not isinstance(value, int | float):
        return str(value)
    # Round-off is in the last of a number's 17 digits.
    number = Decimal(f"{value:.15g}" if isinstance(value, float) else value)
    # A small number is written as 0.00005, not as 5e-05.
    fixed = number.is_finite() and -LONGEST < number.adjusted() < LONGEST
    return f"{number:,f}" if fixed else f"{number:g}"


def as_time(seconds: float) -> str:
    """Write a time in hours, minutes or seconds."""
    if seconds >= 3600:
        return f"{seconds / 3600:.1f} h"
    return f"{seconds / 60:.1f} min" if seconds >= 60 else f"{seconds:.0f} s"


def as_sample(ours: Sample, decimals: int) -> str:
    """Write mean ± standard deviation (standard error); the mean alone where it has no scatter."""
    text = as_text(ours.mean, decimals)
    if math.isnan(ours.std):
        return text
    return f"{text} ± {as_text(ours.std, decimals)} ({as_text(ours.error, decimals + 1)})"


def as_mean(ours: Sample, decimals: int) -> str:
    """Write mean ± standard error."""
    return as_measured(ours.mean, ours.error, decimals)


def as_measured(value: float, error: float, decimals: int) -> str:
    """Write a value ± its standard error."""
    return f"{as_text(value, decimals)} ± {as_text(error, decimals)}"


def as_stated(stated: Stated) -> str:
    """Write a number of the paper with the scatter that the paper gives it."""
    if stated.n:
        return f"{as_text(stated.value, DECIMALS_OF_SERIES)} ± {as_short(stated.std)}"
    if not math.isnan(stated.error):
        # The value has as many decimals as its error.
        decimals = decimals_needed(stated.error, 2)
        return as_measured(stated.value, stated.error, decimals)
    return as_short(stated.value)


def decimals_needed(value: float, digits: int) -> int:
    """Return how many decimals a number of at least 0 needs, rounded to so many digits."""
    if value == 0:
        return 0
    most = max(digits - 1 - math.floor(math.log10(value)), 0)
    rounded = round(value, most)
    return next(n for n in range(most + 1) if round(rounded, n) == rounded)


def as_difference(value: float) -> str:
    """Write a difference with its sign, to one decimal, or a dash for NaN."""
    return f"{'+' if value > 0 else ''}{as_text(value, 1)}"


def as_probability(value: float) -> str:
    """Write a probability: `0.03`, `< 0.001`, or a dash for NaN."""
    return "< 0.001" if value < 0.001 else as_text(value, 3 if value < 0.1 else 2)


def as_span(values: Sequence[float], decimals: int) -> str:
    """Write the smallest and the largest of some numbers, `0.22 to 0.24`; one if they look alike.

    It is empty without any number.
    """
    ends = [as_text(end(values), decimals) for end in (min, max)] if values else []
    return " to ".join(dict.fromkeys(ends))


def as_choice(values: Sequence[int]) -> str:
    """Write several whole numbers: `0, 1, 11 or 12`."""
    return ", ".join(map(str, values[:-1])) + f" or {values[-1]}"
