"""Curves over runs: their means, those of distributions, how far two are apart, and a peak."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
# A mean curve is x, mean y and its standard error, (k,) each; a single curve has no error.
MeanCurve = tuple[FloatArray, FloatArray, FloatArray | None]


def mean_curve(
    curves: Sequence[tuple[FloatArray, FloatArray]],
) -> MeanCurve:
    """Return the mean of curves (x, y): x, mean y, and its standard error, None for a single curve.

    The curves after the first are read at the x of the first by linear interpolation; they are NaN
    beyond their ends.
    """
    x = curves[0][0]
    rows = np.array([np.interp(x, *curve, left=np.nan, right=np.nan) for curve in curves])
    mean: FloatArray = rows.mean(axis=0)
    if len(rows) == 1:
        return x, mean, None
    return x, mean, rows.std(axis=0, ddof=1) / math.sqrt(len(rows))


def root_mean_square_difference(
    one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]
) -> float:
    """Return the root mean square difference of two curves (x, y) at the x of the first.

    The second is read by linear interpolation, and only where it is known: NaN if nowhere.
    """
    x, y = one
    apart = y - np.interp(x, *other, left=np.nan, right=np.nan)
    apart = apart[~np.isnan(apart)]
    return float(np.sqrt(np.mean(apart**2))) if len(apart) else math.nan


def scatter_of_difference(one: MeanCurve, other: MeanCurve) -> float:
    """Return the root mean square difference that their standard errors alone would make.

    Both are taken at the x of the first, as in `root_mean_square_difference`; a single curve, whose
    error is not known, is taken as exact.
    """
    x, y, _ = one
    own = np.zeros(len(y)) if one[2] is None else one[2]
    theirs = np.zeros(len(other[1])) if other[2] is None else other[2]
    square = own**2 + np.interp(x, other[0], theirs, left=np.nan, right=np.nan) ** 2
    square = square[~np.isnan(square)]
    return float(np.sqrt(np.mean(square))) if len(square) else math.nan


def mean_distribution(distributions: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray | None]:
    """Return the mean share of each number and its standard error, (k,) both.

    Shorter distributions go on with zeros. A single one has no standard error: None.
    """
    length = max(len(one) for one in distributions)
    rows = np.array([np.pad(one, (0, length - len(one))) for one in distributions])
    mean: FloatArray = rows.mean(axis=0)
    if len(rows) == 1:
        return mean, None
    return mean, rows.std(axis=0, ddof=1) / math.sqrt(len(rows))


def peak(
    x: Sequence[float], y: Sequence[float], errors: Sequence[float], reach: int = 1
) -> tuple[float, float]:
    """Return where a parabola near the largest value is largest, and its standard error.

    The parabola is fitted to the largest value and those up to `reach` places to either side, or to
    all values where there are no more than `reach`; the error is what the errors of these values
    make of its top (linear propagation). The result is the x of the largest value, and NaN, if that
    is too near to either end or the parabola has no top.
    """
    best = int(np.argmax(y))
    if reach >= len(y):
        near = slice(None)
    elif reach <= best < len(y) - reach:
        near = slice(best - reach, best + reach + 1)
    else:
        return float(x[best]), math.nan
    # Places are counted from the largest value, which keeps the numbers small.
    apart = np.asarray(x[near]) - x[best]
    # These rows of the pseudo-inverse say how much of each value is in the coefficients a and b.
    of_a, of_b, _ = np.linalg.pinv(np.vander(apart, 3))
    values = np.asarray(y[near])
    a, b = float(of_a @ values), float(of_b @ values)
    if not a < 0:
        return float(x[best]), math.nan
    slope = -of_b / (2 * a) + b * of_a / (2 * a**2)
    return float(x[best] - b / (2 * a)), float(np.linalg.norm(slope * np.asarray(errors[near])))
