"""Plots of what is measured: arrays in, drawn on an axis that the caller gives.

Curves differ in colour, in line and in marker, so that they can be told apart in grey and by
everybody: the colours are those of Okabe and Ito.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError
from .geometry import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Style:
    """Colour, line and marker of a curve.

    Attributes
    ----------
    colour, line, marker : as matplotlib names them
    """

    colour: str
    line: str | tuple[int, tuple[int, ...]]
    marker: str


# The colours run from dark to light, as far as their number allows.
STYLES = (
    Style("#000000", "-", "o"),
    Style("#0072B2", "--", "s"),
    Style("#D55E00", "-.", "^"),
    Style("#009E73", ":", "D"),
    Style("#CC79A7", (0, (6, 1, 1, 1, 1, 1)), "v"),
    Style("#56B4E9", (0, (3, 1)), "P"),
    Style("#E69F00", (0, (1, 1)), "X"),
)
GREY = "#767676"


def style_of(number: int) -> Style:
    """Return the style of a plot's curve of this number, from 0; they begin anew after the last."""
    return STYLES[number % len(STYLES)]


def plot_curve(
    ax: Axes,
    x: ArrayLike,
    y: ArrayLike,
    *,
    errors: ArrayLike | None = None,
    label: str | None = None,
    number: int = 0,
    markers: bool = False,
    least: float | None = None,
) -> Axes:
    """Plot a line, with a band of one standard error on either side.

    Parameters
    ----------
    ax : to draw on
    x, y : (k,), NaN leaves a gap
    errors : (k,), standard errors of y
    label : for the legend
    number : of the curve in this plot, from 0: its colour and line
    markers : whether each point is marked
    least : of a logarithmic axis: a band goes down to here where it would go to 0 or below, which
        such an axis does not have; above 0
    """
    style = style_of(number)
    across, up = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    ax.plot(
        across,
        up,
        color=style.colour,
        linestyle=style.line,
        linewidth=1.3,
        marker=style.marker if markers else None,
        markersize=3.5,
        label=label,
    )
    if errors is not None:
        below, above = error_lengths(up, errors, least)
        ax.fill_between(across, up - below, up + above, color=style.colour, alpha=0.2, linewidth=0)
    return ax


def error_lengths(
    values: ArrayLike, errors: ArrayLike, least: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return how far errors reach below and above values, (k,) each.

    A corner of a band, or an end of an error bar, that lies at 0 or below is left out on a
    logarithmic axis: what remains is a wedge between other corners, or no bar at all.

    Parameters
    ----------
    values : (k,)
    errors : (k,), NaN where there is none
    least : what is reached below on a logarithmic axis at most; None on a linear one
    """
    place, width = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if least is None:
        return width, width
    # A value below the axis has nothing to be drawn.
    return np.minimum(width, np.maximum(place - least, 0.0)), width


def plot_points(
    ax: Axes,
    x: ArrayLike,
    y: ArrayLike,
    *,
    errors: ArrayLike | None = None,
    label: str | None = None,
    number: int = 0,
    joined: bool = True,
    least: float | None = None,
) -> Axes:
    """Plot a value against a parameter: points with error bars, joined by a thin line.

    Parameters
    ----------
    ax : to draw on
    x, y : (k,)
    errors : (k,), standard errors of y; NaN where there is none
    label : for the legend
    number : of the curve in this plot, from 0: its colour and marker
    joined : whether a line runs from point to point
    least : as for `plot_curve`
    """
    lengths = None
    if errors is not None:
        lengths = np.nan_to_num(np.array(error_lengths(y, errors, least)))
    style = style_of(number)
    ax.errorbar(
        np.asarray(x, dtype=np.float64),
        np.asarray(y, dtype=np.float64),
        yerr=lengths,
        color=style.colour,
        marker=style.marker,
        linestyle=style.line if joined else "none",
        linewidth=0.9,
        markersize=5,
        # Markers are white inside, so that two points on top of one another are still seen.
        markerfacecolor="white" if number else style.colour,
        markeredgewidth=1.2,
        capsize=2.5,
        label=label,
    )
    return ax


def plot_distribution(
    ax: Axes,
    shares: ArrayLike,
    *,
    errors: ArrayLike | None = None,
    label: str | None = None,
    number: int = 0,
    least: float | None = None,
) -> Axes:
    """Plot the share of particles with 0, 1, 2, ... contacts or neighbours; the ends of zeros go.

    Parameters
    ----------
    ax : to draw on
    shares : (k,), of 0, 1, ..., k - 1
    errors : (k,), their standard errors
    label : for the legend
    number : of the curve in this plot, from 0: its colour, line and marker
    least : as for `plot_curve`

    Raises InputError where no share is above 0.
    """
    values = np.asarray(shares, dtype=np.float64)
    filled = np.flatnonzero(values > 0)
    if values.ndim != 1 or len(filled) == 0:
        raise InputError("shares must have shape (k,), and at least one of them must be above 0")
    # One zero at either end shows where the distribution ends.
    first, last = max(int(filled[0]) - 1, 0), min(int(filled[-1]) + 1, len(values) - 1)
    which = np.arange(first, last + 1)
    width = None if errors is None else np.asarray(errors, dtype=np.float64)[which]
    return plot_points(
        ax, which, values[which], errors=width, label=label, number=number, least=least
    )


def plot_wall_profile(
    ax: Axes,
    scaled: ArrayLike,
    values: ArrayLike,
    *,
    errors: ArrayLike | None = None,
    label: str | None = None,
    number: int = 0,
    least: float | None = None,
) -> Axes:
    """Plot the packing fraction against the distance from a wall over the diameter.

    This is the plot of Figures 6 and 12 of Faure et al. (2009).

    Parameters
    ----------
    ax : to draw on
    scaled : (k,), distances over the diameter
    values : (k,), packing fractions
    errors : (k,), standard errors of the values
    label, number, least : as for `plot_curve`
    """
    plot_curve(ax, scaled, values, errors=errors, label=label, number=number, least=least)
    ax.set_xlabel("distance from the wall / d")
    ax.set_ylabel("packing fraction")
    # The other ends are still to be scaled by the curves that come after this one.
    ax.set_xlim(left=0, auto=True)
    ax.set_ylim(bottom=0, auto=True)
    return ax


def draw_dimer(ax: Axes, aspect_ratio: float, *, pixels: int = 500) -> Axes:
    """Draw one dimer as a solid body that is lit from the upper left.

    Parameters
    ----------
    ax : to draw on; its scale becomes diameters
    aspect_ratio : length over diameter, 1 to 2
    pixels : across the dimer

    Raises InputError for an aspect ratio out of this range.
    """
    half = _half_distance(aspect_ratio)
    wide, high = half + 0.55, 0.55
    # Each pixel is the mean of four, which smooths the outline.
    rows = max(1, round(pixels * high / wide))
    x, y = np.linspace(-wide, wide, 2 * pixels), np.linspace(-high, high, 2 * rows)
    across, up = np.meshgrid(x, y)
    light = np.array([-0.45, 0.6, 0.66])
    light /= np.linalg.norm(light)
    shade = np.zeros(across.shape)
    depth = np.zeros(across.shape)
    for centre in (-half, half):
        z = np.sqrt(np.maximum(0.25 - (across - centre) ** 2 - up**2, 0))
        nearer = z > depth
        normal = np.stack([across - centre, up, z], axis=-1) / 0.5
        # Some light comes from everywhere, so that the far side is seen too.
        lit = 0.3 + 0.65 * np.clip(normal @ light, 0, 1)
        shade[nearer] = lit[nearer]
        depth[nearer] = z[nearer]
    inside = (depth > 0).astype(np.float64)
    image = np.stack([shade, shade, shade, inside], axis=-1)
    image = image.reshape(rows, 2, pixels, 2, 4).mean(axis=(1, 3))
    # A pixel at the outline has the colour of its covered part.
    image[..., :3] /= np.maximum(image[..., 3:], 1e-9)
    ax.imshow(np.clip(image, 0, 1), extent=(-wide, wide, -high, high), origin="lower")
    ax.set_aspect("equal")
    ax.axis("off")
    return ax


def draw_dimer_section(ax: Axes, aspect_ratio: float) -> Axes:
    """Draw the section of a dimer, its lengths d and L, and the neck that no sphere can reach.

    A sphere of the same size that rolls around the junction is drawn where it touches both.

    Parameters
    ----------
    ax : to draw on; its scale becomes diameters
    aspect_ratio : length over diameter, above 1 and up to 2

    Raises InputError for an aspect ratio out of this range.
    """
    from matplotlib.patches import Circle

    half = _half_distance(aspect_ratio)
    if half == 0:
        raise InputError("a dimer of aspect ratio 1 is a sphere: it has no neck")
    rolling = math.sqrt(1 - half**2)
    for side in (-1, 1):
        neck = _neck_outline(half, rolling) * np.array([1, side])
        ax.fill(*neck.T, facecolor="#E69F00", edgecolor="#8A5F00", hatch="////", linewidth=0.8)
    for centre in (-half, half):
        ax.add_patch(Circle((centre, 0), 0.5, facecolor="#BBD7EA", edgecolor="none"))
    for centre in (-half, half):
        ax.add_patch(Circle((centre, 0), 0.5, facecolor="none", edgecolor="black", linewidth=1.2))
    ax.add_patch(
        Circle((0, rolling), 0.5, facecolor="none", edgecolor=GREY, linestyle="--", linewidth=1)
    )
    arrow: dict[str, Any] = {"arrowstyle": "<->", "color": "black", "linewidth": 0.9}
    ends = half + 0.5
    ax.annotate("", (-ends, -0.68), (ends, -0.68), arrowprops=arrow)
    ax.text(0, -0.72, "L", ha="center", va="top", style="italic")
    ax.annotate("", (ends + 0.15, -0.5), (ends + 0.15, 0.5), arrowprops=arrow)
    ax.text(ends + 0.2, 0, "d", ha="left", va="center", style="italic")
    ax.set_xlim(-ends - 0.15, ends + 0.35)
    ax.set_ylim(-0.95, rolling + 0.55)
    ax.set_aspect("equal")
    ax.axis("off")
    return ax


def _half_distance(aspect_ratio: float) -> float:
    # This condition is written so that NaN fails too.
    if not 1 <= aspect_ratio <= 2:
        raise InputError(f"an aspect ratio must be from 1 to 2, not {aspect_ratio:g}")
    return (aspect_ratio - 1) / 2


def _neck_outline(half: float, rolling: float) -> FloatArray:
    """Return the upper half of a neck's section, (k, 2): up to the rolling sphere's outline."""
    # The sphere touches half way between its centre and those of the dimer's spheres.
    x = np.linspace(-half / 2, half / 2, 60)
    above = rolling - np.sqrt(0.25 - x**2)
    below = np.sqrt(0.25 - (half - np.abs(x)) ** 2)
    return np.vstack([np.column_stack([x, above]), np.column_stack([x, below])[::-1]])


def plot_bounds(ax: Axes, low: float, high: float, *, label: str | None = None) -> Axes:
    """Shade a range of y that is known from elsewhere."""
    ax.axhspan(low, high, color=GREY, alpha=0.2, linewidth=0, label=label)
    return ax


def plot_reference(ax: Axes, value: float, *, label: str | None = None, number: int = 0) -> Axes:
    """Draw a horizontal line at a y that is known from elsewhere; each number another dash."""
    dashes: Sequence[tuple[int, tuple[int, ...]]] = ((0, (5, 3)), (0, (1, 2)), (0, (8, 2, 1, 2)))
    ax.axhline(value, color=GREY, linewidth=1, linestyle=dashes[number % len(dashes)], label=label)
    return ax


def plot_moment(ax: Axes, x: float, label: str) -> Axes:
    """Draw a vertical line at an x, and write beside it, at its foot, what happens there."""
    # This takes a while to import, and those who only compute need not wait for it.
    from matplotlib.patheffects import withStroke

    ax.axvline(x, color=GREY, linewidth=0.9, linestyle=":")
    ax.annotate(
        label,
        (x, 0),
        xycoords=("data", "axes fraction"),
        xytext=(2, 3),
        textcoords="offset points",
        rotation=90,
        ha="left",
        va="bottom",
        fontsize="x-small",
        color="#505050",
        # It is readable where it crosses a curve.
        path_effects=[withStroke(linewidth=2, foreground="white")],
        zorder=5,
    )
    return ax
