"""The recommendations that a comparison of time and accuracy gives, in words."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .comparison import Comparison, Row
from .plan import Configuration


def recommendations(comparison: Comparison) -> list[str]:
    """Return in words what the numbers tell, or why they tell nothing."""
    return [
        _enough(comparison, "Packing fraction", "packing_fraction", ".4f"),
        _enough(comparison, "Contacts per particle", "coordination_number", ".3f"),
        _speed(comparison),
    ]


def _enough(comparison: Comparison, title: str, name: str, form: str) -> str:
    """Return which is the loosest tolerance that is as good as the tightest, as far as is known."""
    reference = comparison.reference()
    scatter = comparison.scatter(name)
    if reference is None:
        return f"{title}: no run with hard contacts has a result, so that there is no reference."
    hard = [row for row in comparison.rows if row.configuration.contacts == "hard"]
    if len(hard) == 1:
        return f"{title}: only one configuration of hard contacts has results to compare."
    tightest = f"the tightest, {described(reference.configuration, comparison)}"
    if not reference.all_at_rest:
        return (
            f"{title}: {tightest}, has not come to rest from every start, so that nothing can be "
            "compared with it."
        )
    if math.isnan(scatter):
        return (
            f"{title}: errors cannot be judged by one start, whose runs end in different packings; "
            "take several (--seeds)."
        )
    good = [
        (row, shifts)
        for row in hard
        if row is not comparison.reference(row.configuration.ranks)
        and len(shifts := comparison.shifts(row, name))
        and abs(shifts.mean()) < scatter
        and row.all_at_rest
    ]
    if not good:
        return (
            f"{title}: nothing but {tightest}, is good enough: the mean over the starts of every "
            f"other that comes to rest is off by more than the scatter between starts, "
            f"{scatter:{form}}."
        )
    row, shifts = min(
        good, key=lambda one: (-one[0].configuration.tolerance, one[0].median("plateau_seconds"))
    )
    return (
        f"{title}: a tolerance of {described(row.configuration, comparison)} is enough as far as "
        f"{len(shifts)} starts can tell, and {_duration(row)}. The mean is {shifts.mean():+{form}} "
        f"from that of {tightest}, which {_duration(reference)}; the scatter between starts is "
        f"{scatter:{form}}."
    )


def _duration(row: Row) -> str:
    return f"takes {row.median('plateau_seconds'):.2g} s"


def described(one: Configuration, comparison: Comparison) -> str:
    """Return a configuration's tolerance, and what else tells it from others of its contacts."""
    others = [
        row.configuration for row in comparison.rows if row.configuration.contacts == one.contacts
    ]
    words = [f"{one.tolerance:g} r"]
    words += [
        f"{name} {value}"
        for name, value in one.choices.items()
        if len({other.choices[name] for other in others}) > 1
    ]
    return ", ".join(words)


def _speed(comparison: Comparison) -> str:
    """Return how much longer soft contacts take to rest than hard ones of their tolerance."""
    rows = [row for row in comparison.rows if len(row.slower)]
    if not rows:
        return (
            "Soft spheres: no tolerance was run to rest with both hard and soft contacts, so that "
            "their times cannot be compared."
        )
    ratios = "; ".join(
        f"{ratio_text(row.slower)} times as long at {described(row.configuration, comparison)}"
        for row in rows
    )
    return f"Soft spheres with the same largest overlap at rest take: {ratios}."


def ratio_text(ratios: NDArray[np.float64]) -> str:
    """Return the median of some ratios, and from where to where they go."""
    if len(ratios) == 1:
        return f"{ratios[0]:.3g}"
    return f"{np.median(ratios):.3g} ({ratios.min():.3g} to {ratios.max():.3g})"
