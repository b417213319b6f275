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


def top(x: Sequence[float], y: Sequence[float], errors: Sequence[float]) -> tuple[float, float]:
    """Return where a cubic through some values is largest, and the standard error of that.

    The cubic is that of weighted least squares; a parabola would move the top of a lopsided curve.
    The error is what the errors of the values make of the top (linear propagation). Values are to
    be chosen by their x: those around the largest one are near each other by chance. NaN for fewer
    than five values, without errors, and where the cubic has no top between the first and last.

    Parameters
    ----------
    x, y, errors : (k,) each, with the standard errors of y
    """
    places, sigma = np.asarray(x, dtype=float), np.asarray(errors, dtype=float)
    if len(places) < 5 or not np.all(sigma > 0):
        return math.nan, math.nan
    centre = float(places.mean())
    # These rows of the weighted pseudo-inverse say how much of each value is in each coefficient.
    shares = np.linalg.pinv(np.vander(places - centre, 4) / sigma[:, None]) / sigma
    a, b, c, _ = shares @ np.asarray(y, dtype=float)
    if not b**2 > 3 * a * c or a == 0:
        return math.nan, math.nan
    # Of the two places where the slope is zero it is the one with a negative curvature.
    at = float((-b - math.sqrt(b**2 - 3 * a * c)) / (3 * a))
    if not places.min() <= centre + at <= places.max():
        return math.nan, math.nan
    curvature = 6 * a * at + 2 * b
    moved = -np.array([3 * at**2, 2 * at, 1.0, 0.0]) @ shares / curvature
    return centre + at, float(np.linalg.norm(moved * sigma))
