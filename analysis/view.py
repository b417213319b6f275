"""A packing as one HTML page, to turn with the mouse and to look into; it needs no network.

The page is `view.html`, in which `write_view` puts the packing. It draws with WebGL 2 itself: a
library such as three.js would be 700 kB in every page, five times a packing of 1,000 spheres, and
has neither spheres that are exact at any size nor cuts through them, which are most of the page.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bodies import Particles
from .errors import InputError, PictureError
from .files import reason_of, unfinished
from .geometry import FloatArray, as_floats, as_integers
from .spheres import Spheres

TEMPLATE = "view.html"
PLACE = "{{PACKING}}"
# Ends of lines are stored as shares of the packing's extent, in so many parts: a thousandth of a
# diameter where 60 spheres lie side by side. Twelve bytes a line, not 24, are a third of the file.
PARTS = 65535
# Where few values are far above all others, colours end at this share of the values.
SHARE, FAR = 0.98, 1.5
# Larger numbers do not fit into four bytes.
LARGEST = 1e38
# A colour map is written as so many colours.
COLOURS = 256
# Forces are drawn on white: the palest part of their colour maps would not be seen.
PALETTES = {"spheres": ("viridis", 0.0, 1.0), "push": ("magma_r", 0.2, 0.9)}
PALETTES["pull"] = ("Blues", 0.5, 1.0)


@dataclass(frozen=True, eq=False)
class PackingView:
    """A packing as its page shows it. Lengths and forces are in the units of the caller.

    Attributes
    ----------
    spheres : the spheres, the particles that they make up, and their cell, whose edges are drawn
    ids : (n,), the spheres' numbers for the reader, not negative; None where they have none
    contacts : (m, 2, 3), lines that stand for contacts, from centre to centre, such as
        `ContactLines.ends`: a partner beyond a periodic face is at the place of its image
    walls : (k, 2, 3), lines from a centre to where a wall is touched
    forces : (m + k,), force of each contact, then of each contact with a wall, negative where it
        pulls; None where they are not known
    numbers : (n,) for each name, by which spheres can be coloured
    title : shown above the packing
    caption : a line below the title
    """

    spheres: Spheres
    ids: ArrayLike | None = None
    contacts: ArrayLike = field(default_factory=lambda: np.empty((0, 2, 3)))
    walls: ArrayLike = field(default_factory=lambda: np.empty((0, 2, 3)))
    forces: ArrayLike | None = None
    numbers: Mapping[str, ArrayLike] = field(default_factory=dict)
    title: str = "Packing"
    caption: str = ""


def write_view(path: str | PathLike[str], view: PackingView) -> None:
    """Write the page of a packing.

    Parameters
    ----------
    path : of the HTML file
    view : the packing

    Raises InputError for arrays of other shapes and for numbers that are not finite, and
    PictureError where the file cannot be written.
    """
    text = view_page(view)
    target = Path(path)
    try:
        with unfinished(target) as file:
            file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise PictureError(f"{target}: cannot be written: {reason_of(error)}") from None


def view_page(view: PackingView) -> str:
    """Return the page of a packing as text.

    Raises InputError as `write_view` does.
    """
    # In a script no text may look like the end of the script.
    packing = json.dumps(_packing(view), allow_nan=False).replace("<", "\\u003c")
    template = (files(__package__) / TEMPLATE).read_text(encoding="utf-8")
    return template.replace(PLACE, packing, 1)


def _packing(view: PackingView) -> dict[str, Any]:
    """Return what the page is told of the packing.

    Lengths are in units of `scale`, seen from `centre`: the graphics of a browser have seven
    digits, whatever the units and wherever the packing lies.
    """
    positions, radii, cell = view.spheres.positions, view.spheres.radii, view.spheres.cell
    count = len(radii)
    contacts, walls = _lines(view.contacts, "contacts"), _lines(view.walls, "walls")
    lines = np.concatenate([contacts, walls])
    low = (positions - radii[:, None]).min(axis=0)
    high = (positions + radii[:, None]).max(axis=0)
    centre, scale = (low + high) / 2, float((high - low).max())
    ends = (lines.reshape(-1, 3) - centre) / scale
    ends_low, ends_high = (
        (ends.min(axis=0), ends.max(axis=0)) if len(ends) else (np.zeros(3), np.ones(3))
    )
    # Where all ends have one coordinate, any width of its range will do.
    width = np.where(ends_high > ends_low, ends_high - ends_low, 1.0)
    particles = view.spheres.particles
    return {
        "title": view.title,
        "caption": view.caption,
        "centre": centre.tolist(),
        "scale": scale,
        "bounds": _pairs((low - centre) / scale, (high - centre) / scale),
        "reach": _pairs(positions.min(axis=0), positions.max(axis=0)),
        "sizes": [float(radii.min()), float(radii.max())],
        "flat": view.spheres.flat,
        "positions": _encoded(((positions - centre) / scale).astype("<f4")),
        "radii": _encoded((radii / scale).astype("<f4")),
        "meanRadius": float(radii.mean()) / scale,
        "particle": _encoded(_smallest(_labels(particles))) if particles.composite else None,
        "ids": None if view.ids is None else _encoded(_smallest(_ids(view.ids, count))),
        "cell": None
        if cell is None
        else {
            "origin": ((cell.origin - centre) / scale).tolist(),
            "vectors": (cell.vectors / scale).tolist(),
            "periodic": list(cell.periodic),
        },
        "walls": len(walls),
        "lines": _encoded(np.rint((ends - ends_low) / width * PARTS).astype("<u2")),
        "range": _pairs(ends_low, ends_low + width),
        **_forces(view.forces, len(lines)),
        "numbers": [_coloured(name, values, count) for name, values in view.numbers.items()],
        "palettes": {name: _palette(*palette) for name, palette in PALETTES.items()},
    }


def _labels(particles: Particles) -> NDArray[np.int64]:
    """Return for each sphere the number of its body, or one of its own beyond them all, (n,)."""
    number = np.where(particles.sizes > 1, particles.bodies, 0)
    alone = particles.sizes == 1
    number[alone] = number.max() + 1 + np.arange(alone.sum())
    labels: NDArray[np.int64] = number[particles.index]
    return labels


def _lines(values: ArrayLike, name: str) -> FloatArray:
    """Return lines (m, 2, 3), checked."""
    lines = as_floats(values, name)
    if lines.ndim != 3 or lines.shape[1:] != (2, 3):
        raise InputError(f"{name} must have shape (m, 2, 3), not {lines.shape}")
    if not np.isfinite(lines).all():
        raise InputError(f"{name} hold NaN or infinity")
    return lines


def _forces(forces: ArrayLike | None, count: int) -> dict[str, Any]:
    """Return the forces in units of their mean strength; that is 1 where all are 0."""
    if forces is None:
        return {"forces": None, "meanForce": None, "pulls": False}
    array = as_floats(forces, "forces")
    if array.shape != (count,):
        raise InputError(f"forces must have shape ({count},), not {array.shape}")
    _check_size(array, "forces")
    mean = float(np.abs(array).mean()) if count else 0.0
    unit = mean if mean > 0 else 1.0
    shares = _encoded((array / unit).astype("<f4"))
    return {"forces": shares, "meanForce": mean, "pulls": bool((array < 0).any())}


def _coloured(name: str, values: ArrayLike, count: int) -> dict[str, Any]:
    """Return numbers of the spheres, with the range of their colours."""
    array = as_floats(values, name)
    if array.shape != (count,):
        raise InputError(f"{name} must have shape ({count},), not {array.shape}")
    _check_size(array, name)
    whole = bool((array == np.rint(array)).all())
    low, high = float(array.min()), float(array.max())
    # Numbers of contacts begin at 0: pages of several packings have nearly the same colours.
    low = min(low, 0.0) if whole else low
    most = float(np.quantile(array, SHARE, method="higher"))
    above = low < most and high - low > FAR * (most - low)
    small = _smallest(array.astype(np.int64)) if whole and low >= 0 else array.astype("<f4")
    return {
        "name": name,
        "low": low,
        "high": most if above else high,
        "whole": whole,
        "above": above,
        **_encoded(small),
    }


def _check_size(array: FloatArray, name: str) -> None:
    """See that numbers are finite, and not too large for the page."""
    if not (np.abs(array) < LARGEST).all():
        raise InputError(f"{name} must be finite and below {LARGEST:g}")


def _ids(values: ArrayLike, count: int) -> NDArray[np.int64]:
    """Return whole numbers that are not negative, (n,)."""
    numbers = as_integers(values, "ids")
    if numbers.shape != (count,):
        raise InputError(f"ids must have shape ({count},), not {numbers.shape}")
    if (numbers < 0).any():
        raise InputError(f"ids must not be negative, not {numbers.min()}")
    return numbers


def _smallest(numbers: NDArray[np.int64]) -> NDArray[Any]:
    """Return whole numbers in the smallest type that a browser has for them."""
    most = int(numbers.max())
    for kind, limit in (("<u1", 2**8), ("<u2", 2**16), ("<u4", 2**32)):
        if most < limit:
            return numbers.astype(kind)
    return numbers.astype("<f8")


def _encoded(array: NDArray[Any]) -> dict[str, str]:
    """Return an array as the page reads it: little-endian bytes in base64, and their type."""
    kind = f"{array.dtype.kind}{array.dtype.itemsize}"
    return {"type": kind, "data": base64.b64encode(array.tobytes()).decode("ascii")}


def _pairs(low: FloatArray, high: FloatArray) -> list[list[float]]:
    pairs: list[list[float]] = np.column_stack([low, high]).tolist()
    return pairs


def _palette(name: str, start: float, end: float) -> str:
    """Return a part of a colour map as hexadecimal digits, six a colour."""
    # matplotlib takes a fifth of a second to import, which most commands need not wait for.
    import matplotlib

    colours = matplotlib.colormaps[name](np.linspace(start, end, COLOURS), bytes=True)
    return np.asarray(colours)[:, :3].astype(np.uint8).tobytes().hex()
