"""How a packing comes to rest: packing fraction, contacts, height and energy frame by frame."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .contacts import ContactFrame
from .coordination import contact_counts
from .errors import InputError
from .geometry import FloatArray, IntArray, as_box, as_floats, as_integers
from .packing import packing_fraction
from .particles import ParticleFrame

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Such a function measures the packing fraction of a frame in a box (3, 2), or in the whole cell.
PackingFractionOf = Callable[[ParticleFrame, FloatArray | None], float]


@dataclass(frozen=True, eq=False)
class Evolution:
    """The state of a packing at each step; NaN where a number is not known.

    Attributes
    ----------
    steps : (k,), time steps of the frames
    packing_fraction : (k,), in the box
    coordination : (k,), mean number of contacts with other particles of those whose centres are in
        the box; NaN where no centre is, or where neither dump has contacts
    height : (k,), of the centre of mass of all spheres along the axis up, length; NaN where the
        cell is periodic along it
    kinetic_energy : (k,), of all spheres, over their mass, velocity^2; NaN without velocities
    """

    steps: IntArray
    packing_fraction: FloatArray
    coordination: FloatArray
    height: FloatArray
    kinetic_energy: FloatArray


@dataclass(frozen=True)
class Plateau:
    """The end of a series, where it stays near its final value.

    Attributes
    ----------
    step : first step from which on all values are within the band; None if the last one is not
    mean : mean of the last values
    band : largest distance from `mean`, relative to it
    """

    step: int | None
    mean: float
    band: float


def monte_carlo(points: int = 100_000, seed: int = 0) -> PackingFractionOf:
    """Return a function that measures a packing fraction with so many random points.

    Parameters
    ----------
    points : number of random points, at least 1
    seed : of numpy's default generator, not negative; every call draws the same points

    The function takes a frame and a box (3, 2), length, None for the whole cell, and raises
    InputError as `packing_fraction` does.
    """

    def measure(frame: ParticleFrame, box: FloatArray | None) -> float:
        return packing_fraction(frame.spheres, box, points=points, seed=seed).value

    return measure


def measure_evolution(
    frames: Iterable[ParticleFrame],
    box: ArrayLike | None = None,
    *,
    contacts: Iterable[ContactFrame] = (),
    packing: PackingFractionOf | None = None,
    up: int = 1,
) -> Evolution:
    """Measure each frame of a particle dump, one at a time.

    Contacts are those of the contact frame at the same step; where there is none, those of the
    particle dump's column `contacts`, summed over the spheres of a body. Spheres weigh as much as
    their volume; those of one body are point masses at their centres, however they overlap.

    Parameters
    ----------
    frames : such as a `ParticleDump`, in the order of their steps if there are contact frames
    box : (3, 2), where the packing fraction and the coordination number are measured, length;
        None: the whole cell
    contacts : such as `iterate_contact_frames(path)`, in the order of their steps
    packing : measures the packing fraction; None: `monte_carlo()`
    up : axis against gravity, 0 to 2 for x to z

    Raises InputError without any frame, for another axis, and for a box of another shape.
    """
    bounds = None if box is None else as_box(box)
    if up not in (0, 1, 2):
        raise InputError(f"up must be the axis 0, 1 or 2, not {up}")
    measure = monte_carlo() if packing is None else packing
    rows: list[tuple[float, ...]] = []
    steps: list[int] = []
    known = iter(contacts)
    current = next(known, None)
    for frame in frames:
        current = _not_before(frame.step, current, known)
        # Discs are balls to LAMMPS, with masses as their volumes.
        mass = frame.radii**3
        mass /= mass.sum()
        ends = not frame.spheres.endless[up]
        energy = math.nan
        if frame.velocities is not None:
            energy = float(mass @ (frame.velocities**2).sum(axis=1)) / 2
        steps.append(frame.step)
        rows.append(
            (
                measure(frame, bounds),
                _coordination(frame, current, bounds),
                float(mass @ frame.positions[:, up]) if ends else math.nan,
                energy,
            )
        )
    if not rows:
        raise InputError("at least one particle frame is needed")
    columns = np.array(rows, dtype=np.float64).T
    return Evolution(np.array(steps, dtype=np.int64), *columns)


def plateau(
    steps: ArrayLike, values: ArrayLike, *, band: float = 0.001, last: float = 0.25
) -> Plateau:
    """Find the first step after which a series stays within a band around its final mean.

    Parameters
    ----------
    steps : (k,), ascending
    values : (k,), NaN is never within the band
    band : largest distance from the final mean, relative to it
    last : share of the values, the last ones, whose mean is the final mean; at least one value

    Raises InputError for arrays of other shapes, where the last values are not finite, for a band
    that is not positive, and for a share outside of (0, 1].
    """
    when, series = _series(steps, values)
    if not (band > 0 and 0 < last <= 1):
        raise InputError(f"band must be positive and last in (0, 1], not {band:g} and {last:g}")
    mean = float(series[-math.ceil(last * len(series)) :].mean())
    if not math.isfinite(mean):
        raise InputError("the last values, whose mean is the final one, hold NaN or infinity")
    outside = np.flatnonzero(~(np.abs(series - mean) <= band * abs(mean)))
    first = 0 if len(outside) == 0 else int(outside[-1]) + 1
    return Plateau(int(when[first]) if first < len(when) else None, mean, band)


def plot_evolution(
    ax: Axes,
    steps: ArrayLike,
    values: ArrayLike,
    *,
    reached: Plateau | None = None,
    label: str | None = None,
) -> Axes:
    """Plot a series over the steps, as in Figure 5 of Faure et al. (2009), and its plateau.

    Parameters
    ----------
    ax : the axes to draw on, which are returned
    steps, values : (k,), time steps, and what was measured at each, in any unit
    reached : the plateau; None draws none
    label : the name of the series in the legend

    Raises InputError for arrays of other shapes.
    """
    (line,) = ax.plot(*_series(steps, values), "o-", markersize=3)
    if label is not None:
        line.set_label(label)
    ax.set_xlabel("step")
    if reached is not None:
        ax.axhline(reached.mean, color=line.get_color(), linewidth=0.8, linestyle="--")
        if reached.step is not None:
            ax.axvline(reached.step, color="0.6", linewidth=0.8, linestyle=":")
    return ax


def _series(steps: ArrayLike, values: ArrayLike) -> tuple[IntArray, FloatArray]:
    """Return steps and values, (k,) each; raise InputError for arrays of other shapes."""
    when, series = as_integers(steps, "steps"), as_floats(values, "values")
    if when.ndim != 1 or len(when) == 0 or when.shape != series.shape:
        raise InputError(
            f"steps and values must have the same shape (k,) with k >= 1, not {when.shape} and "
            f"{series.shape}"
        )
    return when, series


def _not_before(
    step: int, current: ContactFrame | None, more: Iterator[ContactFrame]
) -> ContactFrame | None:
    """Return the first contact frame that is not before a step; None if there is none."""
    while current is not None and current.step < step:
        current = next(more, None)
    return current


def _coordination(
    frame: ParticleFrame, contacts: ContactFrame | None, box: FloatArray | None
) -> float:
    """Return the mean number of contacts of the particles in the box."""
    particles = frame.particles
    if contacts is not None and contacts.step == frame.step:
        numbers = contact_counts(
            contacts.ids, frame.ids, particles, images=frame.cell.has_images
        ).particles
    elif frame.contacts is not None:
        numbers = np.bincount(particles.index, weights=frame.contacts).astype(np.int64)
    else:
        return math.nan
    inside = frame.spheres.particles_in(box)
    return float(numbers[inside].mean()) if inside.any() else math.nan
