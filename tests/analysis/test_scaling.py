"""Power laws: exponents of drawn values, gaps of known places, forces in known layers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    InputError,
    Spheres,
    binned_exponent,
    group_spheres,
    local_ratios,
    logarithmic_density,
    power_law,
    small_gaps,
)


def drawn(exponent: float, low: float, high: float, count: int, seed: int = 1) -> np.ndarray:
    """Values of a power law between bounds, by the inverse of its cumulative distribution."""
    u = np.random.default_rng(seed).random(count)
    s = exponent + 1
    if s == 0:
        return low * (high / low) ** u
    return (low**s + u * (high**s - low**s)) ** (1 / s)


@pytest.mark.parametrize("exponent", [-1.6, -1.0, -0.413, 0.0, 0.17, 2.0])
def test_the_exponent_and_its_error(exponent: float) -> None:
    found = [power_law(drawn(exponent, 1e-4, 1e-1, 1000, seed), 1e-4, 1e-1) for seed in range(100)]
    values = np.array([law.exponent for law in found])
    # The mean of 100 lies within four of its standard errors (chance of more: 1 in 16,000).
    assert abs(values.mean() - exponent) < 4 * found[0].error / 10
    # The standard deviation of 100 values is known to 7 %; the error itself is of one sample.
    assert values.std(ddof=1) == pytest.approx(found[0].error, rel=0.3)


def test_it_is_the_likeliest_exponent() -> None:
    """The logarithm of the likelihood of its neighbours is smaller."""
    low, high = 0.01, 1.0
    values = drawn(0.4, low, high, 500)
    law = power_law(np.append(values, [5.0, 0.001]), low, high)
    assert law.count == 500

    def likelihood(k: float) -> float:
        norm = (k + 1) / (high ** (k + 1) - low ** (k + 1))
        return float(np.log(norm * values**k).sum())

    best = likelihood(law.exponent)
    # Below a maximum by half the square of the distance in standard errors, for any likelihood.
    for sign in (-1, 1):
        drop = best - likelihood(law.exponent + sign * law.error)
        assert drop == pytest.approx(0.5, rel=0.1)


@pytest.mark.parametrize("exponent", [-1.6, -0.413, 0.0, 0.17])
def test_a_binned_density_has_the_exponent_of_its_values(exponent: float) -> None:
    values = drawn(exponent, 1e-4, 1.0, 20_000)
    middles, density = logarithmic_density(values, 1e-5, 10.0)
    # Between edges of bins, which are at powers of ten.
    law = power_law(values, 1e-3, 1e-1)
    # Where in a bin a value lies is lost, which is worth less than a third of the error.
    found = binned_exponent(middles, density, 1e-3, 1e-1)
    assert found == pytest.approx(law.exponent, abs=0.3 * law.error)


def test_bad_input_of_a_binned_density() -> None:
    with pytest.raises(InputError, match=r"too few bins with values between 0\.1 and 0\.2"):
        binned_exponent([0.1, 0.15, 0.2], [1.0, 1.0, 1.0], 0.1, 0.2)
    with pytest.raises(InputError, match="too few bins"):
        binned_exponent([1.0, 2.0, 4.0, 8.0], [0.0, 1.0, 0.0, 0.0], 0.5, 10.0)


def test_bad_input_of_a_power_law() -> None:
    with pytest.raises(InputError, match="0 < low < high, not 1, 1"):
        power_law([1.0] * 20, 1.0, 1.0)
    with pytest.raises(InputError, match=r"9 values between 0\.1 and 1: too few"):
        power_law([0.5] * 9, 0.1, 1.0)
    with pytest.raises(InputError, match="be finite"):
        power_law([math.nan] * 20, 0.1, 1.0)
    with pytest.raises(InputError, match="no power law"):
        power_law([1.0] * 20, 0.1, 1.0)


def test_gaps_of_known_places() -> None:
    positions = np.array([[0.0, 0, 0], [1.1, 0, 0], [2.05, 0, 0], [5.0, 0, 0]])
    radii = np.full(4, 0.5)
    assert sorted(small_gaps(Spheres(positions, radii), 0.2)) == pytest.approx(
        [-0.05, 0.1], abs=1e-12
    )
    # The second sphere is a rattler.
    none = small_gaps(
        Spheres(positions, radii), 0.2, left_out=np.array([False, True, False, False])
    )
    assert len(none) == 0
    # The first two are one body.
    particles = group_spheres([1, 1, 2, 3])
    assert small_gaps(Spheres(positions, radii, particles), 0.2) == pytest.approx(
        [-0.05], abs=1e-12
    )
    assert (
        len(small_gaps(Spheres(positions, radii, particles), 0.2, np.array([True, False, False])))
        == 0
    )


def test_forces_over_the_mean_of_their_layer() -> None:
    heights = [0.0, 3.0, 1.0, 2.0]
    # Low: 8 and 4, mean 6; high: 1 and 3, mean 2.
    assert local_ratios([8.0, 3.0, 4.0, 1.0], heights, 2) == pytest.approx([4 / 3, 2 / 3, 0.5, 1.5])
    with pytest.raises(InputError, match="4 contacts cannot be in 5 layers"):
        local_ratios([1.0] * 4, heights, 5)
    with pytest.raises(InputError, match="same shape"):
        local_ratios([1.0], heights)


def test_the_density_in_logarithmic_bins() -> None:
    values = drawn(-0.4, 1e-3, 1.0, 200_000)
    middles, density = logarithmic_density(values, 1e-3, 1.0, 10)
    assert len(middles) == 30
    wanted = 0.6 / (1 - 1e-3**0.6) * middles**-0.4
    # The fewest values in a bin are 1,900: 2.3 %, and 4 standard errors.
    assert density == pytest.approx(wanted, rel=0.1)
    assert (density * np.diff(np.geomspace(1e-3, 1, 31))).sum() == pytest.approx(1, rel=1e-12)


def test_contacts_that_pull_have_no_local_ratios() -> None:
    with pytest.raises(InputError, match="none of the contacts may pull"):
        local_ratios([-1.0, 2.0], [1.0, 2.0], 1)
