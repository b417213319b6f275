"""The sizes of the particles that `pack` packs: one for all, a list, shares, or a distribution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from lammps_inelastic.analysis.geometry import FloatArray

from ..errors import PackingError
from .checked import LEAST, MOST, as_positive, shown

# Diameters differ at most so many times. A neighbour list reaches as far for a small sphere as for
# a large one, so that it grows with the third power of this.
MOST_RATIO = 20.0
# The shares of all sizes add up to 1 but for this much, as 1/3 may be written 0.333.
SUM = 0.01


class Distribution(Protocol):
    """A frozen distribution of SciPy, such as scipy.stats.lognorm(0.2)."""

    def rvs(self, *, size: int, random_state: Any) -> Any:
        """Draw some numbers."""


Sizes = (
    float
    | Sequence[float]
    | FloatArray
    | Sequence[tuple[float, float]]
    | Distribution
    | Callable[[np.random.Generator, int], Any]
)


def diameters_of(sizes: Any, count: int, random: np.random.Generator) -> FloatArray:
    """Return the diameter of the spheres of each particle, (count,), length.

    Parameters
    ----------
    sizes : as in `pack`
    count : number of particles
    random : from which a distribution draws

    Raises PackingError with one line.
    """
    drawn = hasattr(sizes, "rvs") or callable(sizes)
    if hasattr(sizes, "rvs"):
        values = sizes.rvs(size=count, random_state=random)
    elif callable(sizes):
        values = sizes(random, count)
    elif np.ndim(_as_array(sizes)) == 0:
        return np.full(count, as_positive(sizes, "sizes"))
    else:
        values = sizes
    array = _as_array(values)
    if array.ndim == 2 and array.shape[1] == 2 and not drawn:
        diameters = _shared(array, count)
    elif array.shape == (count,):
        diameters = array
    elif drawn or array.ndim != 1:
        said = f"{shown(values)}, of shape {array.shape}" if drawn else shown(sizes)
        raise PackingError(
            f"sizes must be a diameter, {count} diameters, pairs of a diameter and its share, or a "
            f"distribution of that many diameters, not {said}"
        )
    else:
        raise PackingError(f"sizes has {len(array)} diameters, but there are {count} particles")
    wrong = ~((diameters >= LEAST) & (diameters <= MOST))
    if wrong.any():
        raise PackingError(f"a diameter in sizes must be positive, not {diameters[wrong][0]:g}")
    ratio = float(diameters.max() / diameters.min())
    if ratio > MOST_RATIO:
        raise PackingError(
            f"sizes from {diameters.min():g} to {diameters.max():g} differ {ratio:.3g} times; at "
            f"most {MOST_RATIO:g} times are allowed"
        )
    return diameters


def _shared(pairs: FloatArray, count: int) -> FloatArray:
    """Return diameters, (count,), in which each has its share, by the largest remainders."""
    diameters, shares = pairs.T
    if not ((shares >= 0) & (shares <= 1)).all() or abs(shares.sum() - 1) > SUM:
        raise PackingError(
            f"the shares in sizes must be from 0 to 1 and add up to 1, not {shares.tolist()}"
        )
    exact = shares / shares.sum() * count
    numbers = np.floor(exact).astype(np.int64)
    rest = count - int(numbers.sum())
    numbers[np.argsort(numbers - exact, kind="stable")[:rest]] += 1
    return np.repeat(diameters, numbers)


def _as_array(values: Any) -> FloatArray:
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "iuf":
            raise TypeError
        return array.astype(np.float64)
    except (TypeError, ValueError):
        raise PackingError(
            "sizes must be a diameter, a list of diameters, pairs of a diameter and its share, or "
            f"a distribution, not {shown(values)}"
        ) from None
