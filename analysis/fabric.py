"""Fabric: in which directions the contacts of a packing point."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError
from .geometry import FloatArray, as_floats


def fabric_tensor(normals: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """Return the fabric tensor, (3, 3): the mean of n n^T over contacts; its trace is 1.

    The tensor is a third of the unit matrix if no direction is preferred; weighted with the forces
    it shows where these go. It is that of M. Oda, Soils and Foundations 12 (1972) 17.

    Parameters
    ----------
    normals : (m, 3), unit vectors, m >= 1
    weights : (m,), positive, such as the forces; None: every contact counts the same

    Raises InputError for arrays of other shapes, for normals that are not finite, and for weights
    that are not positive and finite.
    """
    vectors = as_floats(normals, "normals")
    if vectors.ndim != 2 or vectors.shape[1] != 3 or len(vectors) == 0:
        raise InputError(f"normals must have shape (m, 3) with m >= 1, not {vectors.shape}")
    weight = np.ones(len(vectors)) if weights is None else as_floats(weights, "weights")
    if weight.shape != (len(vectors),):
        raise InputError(f"weights must have shape ({len(vectors)},), not {weight.shape}")
    if not np.isfinite(vectors).all():
        raise InputError("normals hold NaN or infinity")
    # This condition is written so that NaN fails too.
    if not ((weight > 0) & (weight < np.inf)).all():
        raise InputError("weights must be positive and finite")
    tensor: FloatArray = np.einsum("c,ci,cj->ij", weight, vectors, vectors) / weight.sum()
    return tensor
