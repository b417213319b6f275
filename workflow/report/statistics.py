"""Means over runs with their scatter, means of curves, and differences in standard errors."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..store import Result

FloatArray = NDArray[np.float64]
Key = TypeVar("Key", bound=Hashable)
# A mean curve is x, mean y and its standard error, (k,) each; a single curve has no error.
MeanCurve = tuple[FloatArray, FloatArray, FloatArray | None]

# Samples of fewer values get the scatter of all samples of their kind.
FEW = 4
# Above this many standard errors a difference is marked. Chance alone makes about this share of all
# differences so large (Gauss: 4.6 %).
LARGE, SHARE_ABOVE_LARGE = 2.0, 0.05


@dataclass(frozen=True)
class Sample:
    """The mean of some independent values.

    Attributes
    ----------
    mean : NaN without any value
    std : standard deviation, with n - 1 in its denominator; NaN for fewer than two values
    n : number of values
    """

    mean: float
    std: float
    n: int

    @property
    def error(self) -> float:
        """Standard error of the mean; NaN for fewer than two values."""
        return self.std / math.sqrt(self.n) if self.n else math.nan

    def scaled(self, factor: float) -> Sample:
        """Return the sample with its values multiplied by a factor, as in another unit."""
        return Sample(self.mean * factor, self.std * abs(factor), self.n)


def sample(values: Iterable[float]) -> Sample:
    """Return mean and scatter of the values that are not NaN."""
    known = [float(value) for value in values if not math.isnan(value)]
    if not known:
        return Sample(math.nan, math.nan, 0)
    std = float(np.std(known, ddof=1)) if len(known) > 1 else math.nan
    return Sample(float(np.mean(known)), std, len(known))


def numbers(results: Iterable[Result], name: str) -> Sample:
    """Return mean and scatter of one of the results' numbers."""
    return sample(result.number(name) for result in results)


def pooled(samples: Mapping[Key, Sample]) -> dict[Key, Sample]:
    """Give samples of few values the scatter that all samples share.

    The standard deviation of two or three values is itself uncertain by half and more, and near
    zero by chance in some of many samples. If the scatter can be taken to be the same in all, the
    pooled one, sqrt(sum of (n - 1) s^2 / sum of (n - 1)), is better.
    """
    freedom = sum(one.n - 1 for one in samples.values() if one.n > 1)
    if not freedom:
        return dict(samples)
    square = sum((one.n - 1) * one.std**2 for one in samples.values() if one.n > 1)
    std = math.sqrt(square / freedom)
    return {
        key: Sample(one.mean, std, one.n) if 0 < one.n < FEW else one
        for key, one in samples.items()
    }


def pooled_numbers(groups: Mapping[Key, Iterable[Result]], name: str) -> dict[Key, Sample]:
    """Return mean and scatter of one of the results' numbers, group by group; see `pooled`."""
    return pooled({key: numbers(group, name) for key, group in groups.items()})


@dataclass(frozen=True)
class Stated:
    """A number that the paper states.

    Attributes
    ----------
    value : as it is printed
    error : its standard error; NaN where the paper tells no scatter
    std, n : standard deviation and number of simulations, where the error is made of these
    """

    value: float
    error: float = math.nan
    std: float = math.nan
    n: int = 0

    @classmethod
    def of_series(cls, value: float, std: float, n: int) -> Stated:
        """Return a mean of n simulations with this standard deviation."""
        return cls(value, std / math.sqrt(n), std, n)


def difference_in_errors(ours: Sample, stated: Stated) -> float:
    """Return ours - the paper's, over the standard error of that difference.

    The standard error is our own alone if the paper tells no scatter. The result is NaN if we have
    none, as for a single run.
    """
    squares = [error**2 for error in (ours.error, stated.error) if not math.isnan(error)]
    # It is not known how far a single run would fall from the paper's range by chance.
    if math.isnan(ours.error) or sum(squares) == 0:
        return math.nan
    return (ours.mean - stated.value) / math.sqrt(sum(squares))


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


def computing_seconds(results: Iterable[Result]) -> float:
    """Return the wall times of the runs, each times its ranks."""
    return float(sum(result.record["wall_seconds"] * result.record["ranks"] for result in results))


def peak(
    x: Sequence[float], y: Sequence[float], errors: Sequence[float], reach: int = 1
) -> tuple[float, float]:
    """Return where a parabola near the largest value is largest, and its standard error.

    The parabola is fitted to the largest value and those up to `reach` places to either side; the
    error is what the errors of these values make of its top (linear propagation). The result is the
    x of the largest value, and NaN, if that is too near to either end or the parabola has no top.
    """
    best = int(np.argmax(y))
    if not reach <= best < len(y) - reach:
        return float(x[best]), math.nan
    near = slice(best - reach, best + reach + 1)
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
