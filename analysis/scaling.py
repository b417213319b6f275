"""Power laws of hard packings: small gaps between particles, and weak forces on contacts.

In a packing that is held by as few contacts as can hold it the density of gaps g between particles
that nearly touch goes as g^-a, and that of forces f well below the mean as f^b (Wyart, Phys. Rev.
Lett. 109 (2012) 125502; Charbonneau, Corwin, Parisi and Zamponi, Phys. Rev. Lett. 114 (2015)
125504: a = 0.413 in theory; b = 0.423 for contacts whose opening moves all, 0.17 for those whose
opening moves few particles).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .errors import InputError
from .geometry import BoolArray, FloatArray, as_count, as_floats
from .neighbours import contacts_by_distance
from .spheres import Spheres, takes_spheres

# Exponents beyond this are no power law of a packing.
STEEPEST = 20.0
# The exponential of a larger number overflows.
STEEPEST_TERM = 700.0
# An exponent of so few values says nothing.
FEWEST = 10


@dataclass(frozen=True)
class PowerLaw:
    """A density that goes as x^exponent between two bounds.

    Attributes
    ----------
    exponent : of the density
    error : its standard error, 1 / sqrt(Fisher information); it takes the values as independent
    low, high : bounds of the values, in their unit
    count : number of values between them
    """

    exponent: float
    error: float
    low: float
    high: float
    count: int


def _between(values: ArrayLike, low: float, high: float) -> FloatArray:
    """Return values, (n,) and finite, of which those between two bounds are wanted.

    Raises InputError for other values, and for bounds that are not 0 < low < high.
    """
    if not (0 < low < high < math.inf and high / low < math.inf):
        raise InputError(f"the bounds of a power law must be 0 < low < high, not {low:g}, {high:g}")
    given = as_floats(values, "values")
    if given.ndim != 1 or not np.isfinite(given).all():
        raise InputError("the values of a power law must have shape (n,) and be finite")
    return given


def power_law(values: ArrayLike, low: float, high: float) -> PowerLaw:
    """Return the power law that makes the values between two bounds most likely.

    For a density C x^k on [low, high] the likelihood is largest where the mean of ln x is that of
    the density (maximum likelihood, no bins): with y = ln(x / low), L = ln(high / low), s = k + 1,

        <y> = L / (1 - exp(-s L)) - 1 / s

    whose right side grows with s. Its derivative is the variance of y under the density, which is
    the information of one value on k.

    Parameters
    ----------
    values : (n,), > 0; those outside of the bounds are left out
    low, high : bounds, 0 < low < high, in the unit of the values

    Raises InputError for other bounds, for values that are not finite, and for fewer than ten
    values between the bounds, or all of them at one end.
    """
    given = _between(values, low, high)
    inside = given[(given >= low) & (given <= high)]
    if len(inside) < FEWEST:
        raise InputError(
            f"{len(inside)} values between {low:g} and {high:g}: too few for a power law"
        )
    length = math.log(high / low)
    mean = float(np.log(inside / low).mean())

    def excess(s: float) -> float:
        return _mean_of_logarithm(s, length) - mean

    if not excess(-STEEPEST) < 0 < excess(STEEPEST):
        raise InputError(f"the values between {low:g} and {high:g} follow no power law")
    s = float(scipy.optimize.brentq(excess, -STEEPEST, STEEPEST, xtol=1e-12))
    step = 1e-4
    variance = (excess(s + step) - excess(s - step)) / (2 * step)
    # Between bounds that are almost the same all exponents are as likely.
    if not variance > 0:
        raise InputError(f"the values between {low:g} and {high:g} are too near for a power law")
    return PowerLaw(s - 1, 1 / math.sqrt(len(inside) * variance), low, high, len(inside))


def _mean_of_logarithm(s: float, length: float) -> float:
    """Return the mean of y in [0, length] under a density that goes as exp(s y)."""
    t = s * length
    # The series near zero: both terms grow without bound there, and their difference does not.
    if abs(t) < 1e-4:
        return length * (0.5 + t / 12)
    # Where exp(-t) would overflow, the first term is 0 to all digits.
    return (length / -math.expm1(-t) if t > -STEEPEST_TERM else 0.0) - 1 / s


@takes_spheres
def small_gaps(spheres: Spheres, largest: float, left_out: BoolArray | None = None) -> FloatArray:
    """Return the gaps between spheres of different particles up to a largest one, in any order.

    Overlaps are among them as negative gaps, and gaps across periodic faces.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    largest : gap, length
    left_out : (p,), particles whose gaps say nothing, such as rattlers, which lie about

    Raises InputError as `contacts_by_distance` does, and for `left_out` of another shape.
    """
    near = contacts_by_distance(spheres, largest)
    gaps: FloatArray = near.gaps
    if left_out is None:
        return gaps
    owner, count = spheres.particles.index, len(spheres.particles)
    if np.shape(left_out) != (count,):
        raise InputError(f"left_out must have shape ({count},), not {np.shape(left_out)}")
    kept = ~left_out[owner[near.sides[:, 0]]] & ~left_out[owner[near.sides[:, 1]]]
    return gaps[kept]


def local_ratios(forces: ArrayLike, heights: ArrayLike, layers: int = 20) -> FloatArray:
    """Return each force over the mean of those at its height, in the order of the heights, (m,).

    Under gravity the mean force grows with the depth, and a mixture of layers has more weak forces
    than any of them. The layers hold equally many contacts.

    Parameters
    ----------
    forces : (m,), >= 0, of contacts, force
    heights : (m,), of their places, length
    layers : number of layers, at least 1

    Raises InputError for arrays of other shapes, for forces that pull (< 0), for forces or heights
    that are not finite, for fewer contacts than layers, and for a layer in which all forces are 0.
    """
    strength = as_floats(forces, "forces")
    height = as_floats(heights, "heights")
    if strength.ndim != 1 or strength.shape != height.shape:
        raise InputError(
            "forces and heights must have the same shape (m,), "
            f"not {strength.shape} and {height.shape}"
        )
    # This condition is written so that NaN fails too.
    if not ((strength >= 0) & (strength < np.inf)).all():
        raise InputError("forces must be finite and not below 0: none of the contacts may pull")
    if not np.isfinite(height).all():
        raise InputError("heights hold NaN or infinity")
    if as_count(layers, "the number of layers") > len(strength):
        raise InputError(f"{len(strength)} contacts cannot be in {layers} layers")
    parts = np.array_split(strength[np.argsort(height, kind="stable")], layers)
    if not all(part.any() for part in parts):
        raise InputError("all forces of a layer are 0: it has no mean to compare with")
    ratios: FloatArray = np.concatenate([part / part.mean() for part in parts])
    return ratios


def logarithmic_density(
    values: ArrayLike, low: float, high: float, per_decade: int = 5
) -> tuple[FloatArray, FloatArray]:
    """Return the middles of bins of one width in the logarithm, and the density in each, (b,) both.

    Parameters
    ----------
    values : (n,), those outside of the bounds are left out
    low, high : bounds, 0 < low < high, in the unit of the values
    per_decade : about so many bins, at least 1

    The densities are shares of all values given, per unit of the value. Raises InputError for other
    bounds, for values that are not finite, and for fewer bins than one a decade.
    """
    given = _between(values, low, high)
    wanted = as_count(per_decade, "the number of bins per decade")
    bins = max(1, round(wanted * math.log10(high / low)))
    edges = np.geomspace(low, high, bins + 1)
    counts, _ = np.histogram(given, edges)
    middles: FloatArray = np.sqrt(edges[:-1] * edges[1:])
    return middles, counts / (max(len(given), 1) * np.diff(edges))


def binned_exponent(middles: ArrayLike, density: ArrayLike, low: float, high: float) -> float:
    """Return the exponent of the power law that makes a binned density most likely.

    It is that of `power_law` for values of which only the shares in bins are known.

    Parameters
    ----------
    middles, density : (b,) each, as `logarithmic_density` returns them
    low, high : the bins whose middles lie between these are used, in the unit of the middles

    Raises InputError for arrays of other shapes, for middles that are not positive and ascending,
    for densities below 0, for fewer than three such bins, or where all values are in one of them.
    """
    x, y = as_floats(middles, "middles"), as_floats(density, "density")
    if x.ndim != 1 or x.shape != y.shape:
        raise InputError(
            f"middles and density must have the same shape (b,), not {x.shape} and {y.shape}"
        )
    if not ((x > 0) & np.isfinite(x) & (y >= 0) & np.isfinite(y)).all() or (np.diff(x) <= 0).any():
        raise InputError("middles must be positive and ascending, densities finite and not below 0")
    inside = (x > low) & (x < high)
    if inside.sum() < 3 or (y[inside] > 0).sum() < 2:
        raise InputError(f"too few bins with values between {low:g} and {high:g} for a power law")
    ratio = x[1] / x[0]
    # In units of the first middle, so that no power of an edge overflows.
    edges = np.append(x[inside] / math.sqrt(ratio), x[inside][-1] * math.sqrt(ratio)) / x[0]
    shares = y[inside] * np.diff(edges)

    def unlikeliness(s: float) -> float:
        # The integral of x^(s - 1) over a bin; s is never exactly zero.
        parts = np.diff(edges**s) / s
        return -float(shares @ np.log(parts / parts.sum()))

    found = scipy.optimize.minimize_scalar(
        unlikeliness, bounds=(-STEEPEST, STEEPEST), method="bounded"
    )
    return float(found.x) - 1
