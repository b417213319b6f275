"""Numbers, spheres and boxes: the checks that every function makes, and who is inside.

Lengths are in the units of the dump. A box is a (3, 2) array, one row (lower, upper) per axis.
"""

from __future__ import annotations

import operator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def as_floats(values: ArrayLike, name: str) -> FloatArray:
    """Return values as an array of numbers; raise InputError, with a name, for anything else."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be an array of numbers") from None


def as_integers(values: ArrayLike, name: str) -> IntArray:
    """Return values as an array of whole numbers; raise InputError for anything else."""
    try:
        given = np.asarray(values)
    except ValueError:
        raise InputError(f"{name} must be an array of whole numbers") from None
    if given.dtype.kind not in "biuf":
        raise InputError(f"{name} must be an array of whole numbers")
    # NaN, infinity and what is too large become another number, without a warning.
    with np.errstate(invalid="ignore"):
        whole: IntArray = given.astype(np.int64, copy=False)
    if not (whole == given).all():
        raise InputError(f"{name} must be whole numbers")
    return whole


def as_count(value: int, name: str, least: int = 1) -> int:
    """Return a whole number of at least so many; raise InputError for anything else."""
    try:
        number = operator.index(value)
    except TypeError:
        raise InputError(f"{name} must be a whole number, not {value!r}") from None
    if number < least:
        raise InputError(f"{name} must be at least {least}, not {number}")
    return number


def as_positions(positions: ArrayLike) -> FloatArray:
    """Return positions as an (n, 3) array of finite numbers, n >= 1; raise InputError otherwise."""
    array = as_floats(positions, "positions")
    if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0:
        raise InputError(f"positions must have shape (n, 3) with n >= 1, not {array.shape}")
    if not np.isfinite(array).all():
        raise InputError("positions hold NaN or infinity")
    return array


def as_spheres(positions: ArrayLike, radii: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return positions (n, 3) and positive radii (n,); raise InputError if they are not that."""
    centres = as_positions(positions)
    array = as_floats(radii, "radii")
    if array.shape != (len(centres),):
        raise InputError(f"radii must have shape ({len(centres)},), not {array.shape}")
    # This condition is written so that NaN fails too.
    if not ((array > 0) & np.isfinite(array)).all():
        raise InputError("radii must be positive and finite")
    return centres, array


def as_box(box: ArrayLike) -> FloatArray:
    """Return a box as a (3, 2) array; raise InputError unless lower < upper on every axis."""
    array = as_floats(box, "a box")
    if array.shape != (3, 2):
        raise InputError(f"a box must have shape (3, 2), not {array.shape}")
    for axis, (lower, upper) in zip("xyz", array, strict=True):
        if not (np.isfinite(lower) and np.isfinite(upper) and lower < upper):
            raise InputError(f"box: {axis}lo = {lower:g} must be less than {axis}hi = {upper:g}")
    return array


def as_walls(walls: ArrayLike | None) -> FloatArray:
    """Return the places of flat walls as a (3, 2) array, lower and upper per axis, length.

    A wall is infinite where there is none; None is no wall at all. Raises InputError for an array
    of another shape, and for a lower wall that is not below the upper one, or NaN.
    """
    if walls is None:
        return np.array([[-np.inf, np.inf]] * 3)
    faces = as_floats(walls, "walls")
    if faces.shape != (3, 2):
        raise InputError(f"walls must have shape (3, 2), not {faces.shape}")
    for axis, (lower, upper) in zip("xyz", faces, strict=True):
        if not lower < upper:
            raise InputError(f"walls: {axis}lo = {lower:g} must be less than {axis}hi = {upper:g}")
    return faces


def inside_of(positions: FloatArray, box: FloatArray, *, flat: bool = False) -> BoolArray:
    """Say which positions, (n, 3), lie in a box, (3, 2), its faces included; flat ones at any z."""
    inside = (positions >= box[:, 0]) & (positions <= box[:, 1])
    if flat:
        inside[:, 2] = True
    found: BoolArray = np.all(inside, axis=1)
    return found


def spheres_reaching(positions: FloatArray, radii: FloatArray, box: FloatArray) -> BoolArray:
    """Say which spheres may have a part in a box, (n,): none of them lies beyond one of its faces.

    Parameters
    ----------
    positions : (n, 3), length
    radii : (n,), length
    box : (3, 2), length
    """
    size = radii[:, None]
    reaching: BoolArray = np.all(
        (positions + size > box[:, 0]) & (positions - size < box[:, 1]), axis=1
    )
    return reaching
