"""Means over runs with their scatter, and differences of means with their probabilities."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy

from ..results.store import Result

Key = TypeVar("Key", bound=Hashable)
# Samples of fewer values get the scatter of all samples of their kind: that of nine values is known
# to a quarter of itself (1 / sqrt(2 (n - 1))), that of four to 40 %, that of two to 70 %.
FEW = 9
# A difference is significant if chance alone would make so large a one in less than this share of
# all cases, in both tails of Student's distribution.
SIGNIFICANT = 0.05
# A scatter of fewer degrees of freedom says too little: Welch's test of two values beside a series
# of nine finds twice as many false differences as it should, that of three 6 % in place of 5.
LEAST_FREEDOM = 2


def margin_of(error: float, freedom: float) -> float:
    """Return half the width of the 95 % confidence interval, by Student's t; NaN if not known."""
    if math.isnan(error) or not freedom > 0:
        return math.nan
    return error * float(scipy.stats.t.ppf(1 - SIGNIFICANT / 2, freedom))


@dataclass(frozen=True)
class Sample:
    """The mean of some independent values.

    Attributes
    ----------
    mean : NaN without any value
    std : standard deviation, with n - 1 in its denominator; NaN for fewer than two values
    n : number of values
    freedom : degrees of freedom of the standard deviation: n - 1, or those of all samples that were
        pooled
    """

    mean: float
    std: float
    n: int
    freedom: float = math.nan

    def __post_init__(self) -> None:
        """Take n - 1 where no degrees of freedom are given."""
        if math.isnan(self.freedom):
            object.__setattr__(self, "freedom", float(max(self.n - 1, 0)))

    @property
    def error(self) -> float:
        """Standard error of the mean; NaN if the standard deviation is not known."""
        return self.std / math.sqrt(self.n) if self.n else math.nan

    @property
    def margin(self) -> float:
        """Half the width of the 95 % confidence interval, by Student's t; NaN if not known."""
        return margin_of(self.error, self.freedom)

    def scaled(self, factor: float) -> Sample:
        """Return the sample with its values multiplied by a factor, as in another unit."""
        return Sample(self.mean * factor, self.std * abs(factor), self.n, self.freedom)


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
    pooled one, sqrt(sum of (n - 1) s^2 / sum of (n - 1)), is better, and has the degrees of freedom
    of all.
    """
    freedom = sum(one.freedom for one in samples.values() if one.n > 1)
    if not freedom:
        return dict(samples)
    square = sum(one.freedom * one.std**2 for one in samples.values() if one.n > 1)
    std = math.sqrt(square / freedom)
    return {
        key: Sample(one.mean, std, one.n, freedom) if 0 < one.n < FEW else one
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
    is_range : whether the error is half of a range in which all of the paper's runs lie
    """

    value: float
    error: float = math.nan
    std: float = math.nan
    n: int = 0
    is_range: bool = False

    @classmethod
    def of_range(cls, value: float, reach: float) -> Stated:
        """Return a number with a range: value - reach to value + reach."""
        return cls(value, reach, is_range=True)

    @classmethod
    def of_series(cls, value: float, std: float, n: int) -> Stated:
        """Return a mean of n simulations with this standard deviation."""
        return cls(value, std / math.sqrt(n), std, n)

    @property
    def mean(self) -> float:
        """The value, by the name that it has in a sample."""
        return self.value

    @property
    def freedom(self) -> float:
        """The degrees of freedom of the error; infinite where it does not come from a series."""
        return float(self.n - 1) if self.n else math.inf


@dataclass(frozen=True)
class Difference:
    """The difference of two means, and what chance would make of it.

    Attributes
    ----------
    value : one mean less the other
    error : standard error of the value; NaN if it is not known
    freedom : degrees of freedom of the error
    """

    value: float
    error: float
    freedom: float

    @property
    def in_errors(self) -> float:
        """The difference over its standard error; NaN if that is not known, or zero."""
        return self.value / self.error if self.error > 0 else math.nan

    @property
    def p(self) -> float:
        """How often chance alone would make a difference at least as large; NaN if not known."""
        if math.isnan(self.in_errors):
            return math.nan
        return 2 * float(scipy.stats.t.sf(abs(self.in_errors), self.freedom))

    @property
    def is_significant(self) -> bool:
        """Whether chance alone would hardly make so large a difference."""
        return self.p < SIGNIFICANT

    @property
    def margin(self) -> float:
        """Half the width of the 95 % confidence interval, by Student's t; NaN if not known."""
        return margin_of(self.error, self.freedom)

    def is_within(self, reach: float) -> bool | None:
        """Say whether the difference lies between -reach and reach with 95 % confidence.

        False if it lies beyond with that confidence; None if neither can be said.
        """
        if math.isnan(self.margin):
            return None
        if abs(self.value) + self.margin <= reach:
            return True
        return False if abs(self.value) - self.margin > reach else None


UNKNOWN = Difference(math.nan, math.nan, math.nan)


def all_hold(verdicts: Iterable[bool | None]) -> bool | None:
    """Say whether all hold: not known if one is not, and none is known to be false."""
    found = list(verdicts)
    if False in found:
        return False
    return None if None in found or not found else True


def difference(one: Sample | Stated, other: Sample | Stated) -> Difference:
    """Return the difference of two means by Welch's t test.

    The standard error is sqrt(e1^2 + e2^2), and its degrees of freedom are those of Welch
    (Biometrika 34 (1947) 28) and Satterthwaite. A number that the paper states without scatter is
    taken as exact; of one that has a range the nearer end is, and within the range the difference
    is 0. The error is not known where a mean of ours has no scatter, or one of fewer than
    LEAST_FREEDOM degrees of freedom, as that of two runs.
    """
    if isinstance(other, Stated) and other.is_range:
        beyond = abs(one.mean - other.mean) - other.error
        value = math.copysign(beyond, one.mean - other.mean) if beyond > 0 else 0.0
        apart = difference(one, Stated(other.value))
        return Difference(value, apart.error, apart.freedom)
    parts = []
    for mean in (one, other):
        if isinstance(mean, Sample) and not (mean.std >= 0 and mean.freedom >= LEAST_FREEDOM):
            return Difference(one.mean - other.mean, math.nan, math.nan)
        if math.isnan(mean.error):
            continue
        parts.append((mean.error**2, mean.freedom))
    square = sum(part for part, _ in parts)
    if square == 0:
        return Difference(one.mean - other.mean, math.nan, math.nan)
    inverse = sum(part**2 / freedom for part, freedom in parts)
    freedom = square**2 / inverse if inverse > 0 else math.inf
    return Difference(one.mean - other.mean, math.sqrt(square), freedom)


def paired_difference(one: Mapping[Key, float], other: Mapping[Key, float]) -> Difference:
    """Return the mean difference of pairs: values of the same key, as runs from the same start.

    The standard error is that of the differences. It is not known for fewer than three pairs.
    """
    apart = sample(one[key] - other[key] for key in one if key in other)
    known = apart.freedom >= LEAST_FREEDOM
    return Difference(apart.mean, apart.error if known else math.nan, apart.freedom)


def slope(x: Sequence[float], samples: Sequence[Sample], degree: int = 1) -> Difference:
    """Return the slope, at the largest x, of the polynomial through means at x, (k,).

    Least squares, all means with the same weight: weights made of the errors of a few values each
    find three times as many slopes as there should be. The degrees of freedom are those of Welch
    and Satterthwaite. It is not known for fewer means than the degree and two, or if one has no
    error.
    """
    errors = np.array([one.error for one in samples])
    if len(samples) < degree + 2 or not np.all(errors > 0) or len(set(x)) <= degree:
        return UNKNOWN
    apart = np.asarray(x) - np.max(x)
    # The last but one coefficient is the slope where `apart` is zero.
    parts = np.linalg.pinv(np.vander(apart, degree + 1))[-2]
    squares = (parts * errors) ** 2
    freedoms = np.array([one.freedom for one in samples])
    inverse = float(np.sum(squares**2 / freedoms))
    square = float(np.sum(squares))
    return Difference(
        float(parts @ [one.mean for one in samples]),
        math.sqrt(square),
        square**2 / inverse if inverse > 0 else math.inf,
    )


def adjusted(probabilities: Sequence[float]) -> list[float]:
    """Return the probabilities of several tests, each corrected for how many there are.

    By Holm (Scandinavian Journal of Statistics 6 (1979) 65): of m tests the smallest p is
    multiplied by m, the next by m - 1, and so on, and none comes out below one before it. With the
    corrected ones the chance of a false alarm anywhere among all tests is at most the level,
    whatever runs the tests share. NaN stays, and is no test.
    """
    order = sorted(
        (index for index, p in enumerate(probabilities) if not math.isnan(p)),
        key=lambda index: probabilities[index],
    )
    found = [math.nan] * len(probabilities)
    least = 0.0
    for rank, index in enumerate(order):
        least = max(least, min(1.0, (len(order) - rank) * probabilities[index]))
        found[index] = least
    return found


def computing_seconds(results: Iterable[Result]) -> float:
    """Return the wall times of the runs, each times its ranks."""
    return float(sum(result.record["wall_seconds"] * result.record["ranks"] for result in results))
