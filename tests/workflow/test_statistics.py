"""The statistics of the report: textbook cases, SciPy's tests, and cases by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from lammps_inelastic.workflow.report.curves import (
    mean_curve,
    mean_distribution,
    root_mean_square_difference,
    scatter_of_difference,
    top,
)
from lammps_inelastic.workflow.report.statistics import (
    Sample,
    Stated,
    adjusted,
    difference,
    paired_difference,
    pooled,
    sample,
    slope,
)

# Student's own example (Biometrika 6 (1908) 20): hours of sleep gained with two soporifics.
DEXTRO = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
LAEVO = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]


def test_students_sleep_data() -> None:
    """As two samples: t = -1.8608 with 17.776 degrees of freedom, p = 0.0794, as R prints it."""
    found = difference(sample(DEXTRO), sample(LAEVO))
    # As many digits as R prints.
    assert found.in_errors == pytest.approx(-1.8608, abs=5e-5)
    assert found.freedom == pytest.approx(17.776, abs=5e-4)
    assert found.p == pytest.approx(0.07939, abs=5e-6)
    assert not found.is_significant


def test_students_sleep_data_in_pairs() -> None:
    """Of the same ten patients: t = -4.0621 with 9 degrees of freedom, p = 0.002833, by R."""
    found = paired_difference(dict(enumerate(DEXTRO)), dict(enumerate(LAEVO)))
    # As many digits as R prints.
    assert found.in_errors == pytest.approx(-4.0621, abs=5e-5)
    assert found.freedom == 9
    assert found.p == pytest.approx(0.002833, abs=5e-7)
    # R: 95 % from -2.4598858 to -0.7001142.
    assert found.value - found.margin == pytest.approx(-2.4598858, abs=5e-8)
    assert found.is_within(2.46) is True
    assert found.is_within(2.4) is None
    assert found.is_within(0.7) is False
    # Two pairs tell nothing, nor does a value without its like.
    few = paired_difference({1: 0.7, 2: -1.6, 4: 1.0}, {1: 1.9, 2: 0.8, 3: 1.0})
    assert math.isnan(few.p)
    assert few.is_within(10) is None


def test_a_range_of_the_paper_has_two_ends() -> None:
    ours = Sample(10.3, 0.2, 16)
    inside = difference(ours, Stated.of_range(10.0, 0.4))
    assert (inside.value, inside.p) == (0.0, 1.0)
    beyond = difference(ours, Stated.of_range(10.0, 0.2))
    # 0.1 above the end, over 0.2 / sqrt(16); a range has no error of its own.
    assert beyond.in_errors == pytest.approx(2.0, rel=1e-9)  # round-off
    assert difference(ours, Stated.of_range(11.0, 0.6)).in_errors == pytest.approx(-2.0, rel=1e-9)
    assert math.isnan(difference(Sample(10.3, math.nan, 1), Stated.of_range(10, 0.3)).p)


def test_the_interval_of_the_sleep_data() -> None:
    """The gain with the first one, 0.75 hours: 95 % from -0.5298 to 2.0298 by Student's t of 9."""
    one = sample(DEXTRO)
    assert one.mean == pytest.approx(0.75, rel=1e-12)  # round-off
    # 2.262157 (tables of t, 9 degrees of freedom) times 1.789010 / sqrt(10).
    assert one.margin == pytest.approx(2.262157 * 1.789010 / math.sqrt(10), rel=1e-6)
    assert math.isnan(sample([1.0]).margin)


@pytest.mark.parametrize("sizes", [(3, 3), (3, 9), (36, 4)])
def test_differences_are_those_of_scipy(sizes: tuple[int, int]) -> None:
    random = np.random.default_rng(sum(sizes))
    one, other = (random.normal(i, 1 + i, size) for i, size in enumerate(sizes))
    found = difference(sample(one), sample(other))
    wanted = stats.ttest_ind(one, other, equal_var=False)
    assert found.in_errors == pytest.approx(wanted.statistic, rel=1e-12)  # round-off
    assert found.freedom == pytest.approx(wanted.df, rel=1e-12)
    assert found.p == pytest.approx(wanted.pvalue, rel=1e-9)


def test_against_a_number_without_scatter_it_is_the_test_of_one_sample() -> None:
    values = [63.1, 63.9, 64.0, 63.6]
    found = difference(sample(values), Stated(63.2))
    wanted = stats.ttest_1samp(values, 63.2)
    assert found.in_errors == pytest.approx(wanted.statistic, rel=1e-12)  # round-off
    assert (found.freedom, found.p) == pytest.approx((3, wanted.pvalue), rel=1e-9)


def test_an_error_that_is_stated_as_such_is_exactly_known() -> None:
    """Gauss: 1.959964 standard errors are exceeded by chance in 5 %."""
    found = difference(Sample(1.959964, 0.0, 4), Stated(0.0, 1.0))
    assert found.freedom == math.inf
    assert found.p == pytest.approx(0.05, rel=1e-6)


def test_two_standard_errors_of_three_runs_mean_little() -> None:
    """Student with two degrees of freedom: p = 1 - t / sqrt(2 + t^2), 0.184 for t = 2."""
    found = difference(Sample(2.0, math.sqrt(3), 3), Stated(0.0))
    assert found.in_errors == pytest.approx(2.0, rel=1e-12)  # round-off
    assert found.p == pytest.approx(1 - 2 / math.sqrt(6), rel=1e-9)
    assert not found.is_significant
    # The same error, of 36 runs, would be 0.05; of two it is not told.
    assert difference(Sample(2.0, 6.0, 36), Stated(0.0)).p == pytest.approx(0.0533, abs=5e-5)
    assert math.isnan(difference(sample([1.0, 3.0]), Stated(0.0)).p)
    # It is if the scatter is that of other rows, too.
    assert difference(Sample(2.0, 1.0, 2, freedom=12), Stated(0.0)).p < 0.05


def test_nothing_is_known_of_a_single_run_or_without_scatter() -> None:
    for stated in (Stated(6.0), Stated(6.0, 0.05)):
        found = difference(sample([6.1]), stated)
        assert math.isnan(found.in_errors)
        assert math.isnan(found.p)
        assert not found.is_significant
    assert math.isnan(difference(Sample(6.1, 0.0, 3), Stated(6.0)).in_errors)


@pytest.mark.parametrize("runs", [3, 4, 36])
def test_the_share_of_false_alarms_is_five_percent(runs: int) -> None:
    """Of some runs beside a series of nine, as in the paper."""
    random = np.random.default_rng(3)
    tests = 4000
    alarms = 0
    for _ in range(tests):
        ours, theirs = random.normal(0, 1, runs), random.normal(0, 1, 9)
        stated = Stated.of_series(float(theirs.mean()), float(theirs.std(ddof=1)), 9)
        alarms += difference(sample(ours), stated).is_significant
    # Welch's test is approximate: 6 % for three runs. The binomial error is 0.0034.
    assert alarms / tests == pytest.approx(0.05, abs=0.02)


def test_a_slope_is_that_of_a_fit() -> None:
    """NumPy's; its error is that of one mean over the root of the sum of squares along x."""
    x, y = [1.2, 1.5, 1.6, 2.0], [0.9, 0.85, 0.86, 0.7]
    means = [Sample(value, 0.01, 1, math.inf) for value in y]
    found = slope(x, means)
    assert found.value == pytest.approx(np.polyfit(x, y, 1)[0], rel=1e-9)  # round-off of a fit
    assert found.error == pytest.approx(0.01 / math.sqrt(np.var(x) * 4), rel=1e-9)
    assert found.freedom == math.inf
    # That of a parabola, at its last place.
    bent = slope(x, means, degree=2)
    a, b, _ = np.polyfit(x, y, 2)
    assert bent.value == pytest.approx(2 * a * 2.0 + b, rel=1e-9)  # round-off of a fit
    assert math.isnan(slope(x[:3], means[:3], degree=2).p)
    # Of two points, or of one that has no error, nothing is told.
    assert math.isnan(slope(x[:2], means[:2]).p)
    assert math.isnan(slope(x, [*means[:3], sample([0.7])]).p)


def test_slopes_by_chance_are_significant_in_five_percent() -> None:
    random = np.random.default_rng(5)
    tests = 3000
    x = np.linspace(1, 2, 6)
    alarms = sum(
        slope(list(x), [sample(random.normal(0, 1, 4)) for _ in x]).is_significant
        for _ in range(tests)
    )
    # The binomial error is 0.004; degrees of freedom after Satterthwaite are approximate.
    assert alarms / tests == pytest.approx(0.05, abs=0.015)


def test_the_scatter_of_two_curves_adds_in_squares() -> None:
    x = np.linspace(0, 1, 5)
    flat = np.zeros(5)
    one, other = (x, flat, flat + 0.03), (x, flat, flat + 0.04)
    assert scatter_of_difference(one, other) == pytest.approx(0.05, rel=1e-12)  # round-off
    # A single curve has no error.
    assert scatter_of_difference(one, (x, flat, None)) == pytest.approx(0.03, rel=1e-12)


def test_holms_example() -> None:
    """p of 0.01, 0.04, 0.03 and 0.005 become 0.03, 0.06, 0.06 and 0.02."""
    found = adjusted([0.01, 0.04, 0.03, 0.005])
    assert found == pytest.approx([0.03, 0.06, 0.06, 0.02], rel=1e-12)  # round-off
    assert adjusted([0.9, 0.8]) == [1.0, 1.0]
    with_unknown = adjusted([0.01, math.nan, 0.2])
    assert with_unknown[0] == 0.02
    assert math.isnan(with_unknown[1])
    assert adjusted([]) == []


def test_false_alarms_among_rows_that_share_runs() -> None:
    """Twenty rows that share most of their runs: at most one report in twenty has an alarm."""
    random = np.random.default_rng(4)
    reports, alarms = 600, 0
    for _ in range(reports):
        shared = random.normal(0, 1, 9)
        rows = [sample(np.append(shared[:-2], random.normal(0, 1, 2))) for _ in range(20)]
        corrected = adjusted([difference(row, Stated(0.0)).p for row in rows])
        alarms += min(corrected) < 0.05
    # Binomial error 0.009; fewer is right, too: rows that share runs are fewer tests than rows.
    assert alarms / reports < 0.05 + 0.02


def test_statistics_by_hand() -> None:
    values = sample([1.0, 2.0, 3.0, math.nan])
    assert (values.mean, values.std, values.n) == (2.0, 1.0, 3)
    assert values.error == 1 / math.sqrt(3)
    x, y = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0])
    # The other one begins at 1 and is 0.5 higher there and at 2.
    other = np.array([1.0, 2.0]), np.array([1.5, 2.5])
    assert root_mean_square_difference((x, y), other) == 0.5
    assert math.isnan(root_mean_square_difference((x, y), (x + 10, y)))
    _, mean, error = mean_curve([(x, y), (x, y + 2)])
    assert mean.tolist() == [1, 2, 3]
    # Standard deviation sqrt(2), over sqrt(2).
    assert error == pytest.approx([1, 1, 1], rel=1e-12)  # round-off
    shares, _ = mean_distribution([np.array([0.0, 1.0]), np.array([0.0, 0.0, 1.0])])
    assert shares.tolist() == [0, 0.5, 0.5]


def test_the_top_of_a_cubic() -> None:
    x = [1.2, 1.3, 1.35, 1.5, 1.6]
    # A cubic with its top at 1.42 and its lowest place at 1.9; exact but for round-off.
    y = [-((v - 1.42) ** 2) * (2.62 - v) for v in x]
    place, error = top(x, y, [0.01] * 5)
    assert place == pytest.approx(1.42, abs=1e-9)
    assert error > 0
    # No top between the ends, too few values, and values without an error.
    for values, errors in (
        ([1.0, 2.0, 3.0, 4.0, 5.0], [0.01] * 5),
        (y[:4], [0.01] * 4),
        (y, [0.01] * 4 + [math.nan]),
    ):
        assert all(map(math.isnan, top(x[: len(values)], values, errors)))


def test_the_error_of_the_top() -> None:
    """Of noisy values of a lopsided curve twice the error holds the true top as often as it says.

    The curve, its noise and its places are about those of the packing fraction of dimers.
    """
    x: Any = np.array([1.2, 1.25, 1.3, 1.35, 1.4, 1.45, 1.5, 1.6])
    errors: Any = np.full(len(x), 0.14)
    y = 70 - 20 * (x - 1.36) ** 2 + 12 * (x - 1.36) ** 3
    random = np.random.default_rng(1)
    drawn = np.array([top(x, y + random.normal(0, errors), errors) for _ in range(2000)])
    within = np.abs(drawn[:, 0] - 1.36) < 2 * drawn[:, 1]
    # 95 %, less what curved terms take: with these errors a few percent.
    assert within.mean() == pytest.approx(0.95, abs=0.05)
    precise = np.array([top(x, y + 0.1 * random.normal(0, errors), errors) for _ in range(2000)])
    # Of 2,000 values the standard deviation is known to 1.6 %; curved terms are smaller yet.
    assert np.std(precise[:, 0]) == pytest.approx(0.1 * top(x, y, errors)[1], rel=0.07)


def test_pooled_scatter() -> None:
    """Of rows of few values; a row of nine has its own, a row of one gets the others'."""
    samples = {
        "a": sample([1.0, 3.0]),
        "b": sample([5.0, 5.0]),
        "c": sample([0.0] * 4 + [6.0] * 5),
        "d": sample([7.0]),
        "e": sample([]),
    }
    found = pooled(samples)
    # (1 x 2 + 1 x 0 + 8 x 10) / 10, from the variances 2, 0 and 10.
    std = math.sqrt(82 / 10)
    assert [found[key].std for key in "abd"] == pytest.approx([std] * 3, rel=1e-12)
    assert [found[key].freedom for key in "abd"] == [10] * 3
    assert found["c"] == samples["c"]
    assert found["d"].error == pytest.approx(std, rel=1e-12)
    assert found["e"].n == 0
    assert pooled({"d": samples["d"]}) == {"d": samples["d"]}
