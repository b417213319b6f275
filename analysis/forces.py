"""Contact forces: which contacts belong to chosen particles, and how their strengths spread."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .bodies import Particles
from .coordination import contact_sides, number_of_particles
from .errors import InputError
from .geometry import BoolArray, FloatArray, as_count, as_floats
from .plots import error_lengths

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class ForceDistribution:
    """The probability density P(f / <f>) of the strengths f of some contacts.

    There are b bins: as many as were asked for, or twice as many where some forces pull.

    Attributes
    ----------
    edges : (b + 1,), of the bins, in mean forces; from 0, or from below 0 where some forces pull
    density : (b,), share of all contacts per unit of f / <f>; its integral is below 1 if some are
        beyond the outermost edges
    standard_errors : (b,), of `density`, sqrt(n) / (N width) for n of N contacts in a bin; it takes
        contacts as independent
    mean : <f>, the mean of |f|, force
    contacts : N, number of contacts
    """

    edges: FloatArray
    density: FloatArray
    standard_errors: FloatArray
    mean: float
    contacts: int


def contacts_of(
    chosen: ArrayLike,
    contact_ids: ArrayLike,
    sphere_ids: ArrayLike,
    particles: Particles | None = None,
    *,
    walls: bool = False,
    images: bool = False,
) -> BoolArray:
    """Say which contacts have a chosen particle on at least one side, (m,).

    Parameters
    ----------
    chosen : (p,) of bool, such as the result of `Spheres.particles_in`
    contact_ids : (m, 2), as for `contact_counts`
    sphere_ids : (n,), ids of the spheres, in any order
    particles : which spheres make up which particle; None: all are free
    walls : whether contacts with walls are among them
    images : whether the cell is periodic: then a particle may touch its own image

    Raises InputError as `contact_sides` does, and for a choice of another shape.
    """
    sides = contact_sides(contact_ids, sphere_ids, particles, images=images)
    mask = np.asarray(chosen, dtype=np.bool_)
    count = number_of_particles(sphere_ids, particles)
    if mask.shape != (count,):
        raise InputError(f"chosen must have shape ({count},), not {mask.shape}")
    at_wall = sides[:, 1] < 0
    of_them: BoolArray = mask[sides[:, 0]]
    of_them[~at_wall] |= mask[sides[~at_wall, 1]]
    return of_them if walls else of_them & ~at_wall


def force_distribution(
    forces: ArrayLike, *, bins: int = 50, largest: float = 5.0
) -> ForceDistribution:
    """Measure how the strengths of contacts spread around their mean.

    Parameters
    ----------
    forces : (m,), of the contacts wanted: `frame.forces[contacts_of(...)]`, or those of several
        frames one after the other, force
    bins : number of bins of the same width, from 0
    largest : upper edge of the last bin, in mean forces

    Where some forces pull (< 0) the mean is that of their strengths, and as many bins go down to
    -`largest`. Raises InputError for forces that are not finite or all 0, for no bins, and for a
    largest force that is not positive and finite.
    """
    strength = as_floats(forces, "forces")
    if strength.ndim != 1 or len(strength) == 0:
        raise InputError(f"forces must have shape (m,) with m >= 1, not {strength.shape}")
    if not np.isfinite(strength).all() or not strength.any():
        raise InputError("forces must be finite, and not all of them 0")
    bins = as_count(bins, "the number of bins")
    if not (largest > 0 and math.isfinite(largest)):
        raise InputError(f"the largest force must be positive and finite, not {largest:g}")
    mean = float(np.abs(strength).mean())
    pulls = bool((strength < 0).any())
    numbers, edges = np.histogram(
        strength / mean,
        bins=2 * bins if pulls else bins,
        range=(-largest if pulls else 0.0, largest),
    )
    scale = len(strength) * np.diff(edges)
    return ForceDistribution(
        edges=edges,
        density=numbers / scale,
        standard_errors=np.sqrt(numbers) / scale,
        mean=mean,
        contacts=len(strength),
    )


def plot_force_distribution(
    ax: Axes, distribution: ForceDistribution, *, label: str | None = None
) -> Axes:
    """Plot P(f / <f>) over f / <f>, on a logarithmic scale; empty bins are left out.

    Parameters
    ----------
    ax : the axes to draw on, which are returned
    distribution : from `force_distribution`: densities of b bins, per mean force, with their errors
    label : the name of the curve in the legend
    """
    filled = distribution.density > 0
    density = distribution.density[filled]
    middles = (distribution.edges[:-1] + distribution.edges[1:]) / 2
    ax.errorbar(
        middles[filled],
        density,
        yerr=error_lengths(
            density, distribution.standard_errors[filled], density.min(initial=math.inf) / 10
        ),
        fmt="o-",
        markersize=3,
        linewidth=0.8,
        label=label,
    )
    ax.set_yscale("log", nonpositive="mask")
    ax.set_xlabel("f / <f>")
    ax.set_ylabel("P(f / <f>)")
    return ax
