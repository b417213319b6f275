"""Whether closed chains of spheres hang in one another, by Gauss's linking number."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def ring(spheres: int, apart: float = 0.95) -> FloatArray:
    """The centres of a ring of spheres of diameter 1, neighbours `apart`, (k, 3)."""
    angles = 2 * np.pi * np.arange(spheres) / spheres
    radius = apart / (2 * np.sin(np.pi / spheres))
    return np.column_stack([radius * np.cos(angles), 0 * angles, radius * np.sin(angles)])


def linking_number(one: ArrayLike, other: ArrayLike) -> float:
    """Gauss's linking number of two closed lines through points, (k, 3) and (m, 3): 0 or +-1, ...

    The sum over all pairs of segments of the solid angle from which one sees them cross (Klenin and
    Langowski, Biopolymers 54 (2000) 307, method 1a), over 4 pi.
    """
    total = 0.0
    first, second = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    for p, q in zip(first, np.roll(first, -1, axis=0), strict=True):
        for s, t in zip(second, np.roll(second, -1, axis=0), strict=True):
            corners = [(s - p, t - p), (t - p, t - q), (t - q, s - q), (s - q, s - p)]
            normals = [np.cross(a, b) for a, b in corners]
            units = [normal / np.linalg.norm(normal) for normal in normals]
            angle = sum(np.arcsin(np.clip(units[k - 1] @ units[k], -1, 1)) for k in range(4))
            total += angle * np.sign(np.cross(t - s, q - p) @ (s - p))
    return float(total / (4 * np.pi))


def linked_pairs(bodies: ArrayLike) -> tuple[int, int]:
    """How many pairs of closed chains, (n, k, 3), are near enough to be linked, and how many are.

    Those are near whose mean points are nearer than both reach.
    """
    chains = np.asarray(bodies, dtype=float)
    centres = chains.mean(axis=1)
    reach = np.linalg.norm(chains - centres[:, None], axis=2).max(axis=1)
    near = [
        (i, j)
        for i in range(len(chains))
        for j in range(i)
        if np.linalg.norm(centres[i] - centres[j]) < reach[i] + reach[j]
    ]
    # Halves are far from both.
    return len(near), sum(abs(linking_number(chains[i], chains[j])) > 0.5 for i, j in near)
