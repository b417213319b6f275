"""The figures of a comparison: wall time against overlap, errors against tolerance and time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from numpy.typing import NDArray

from lammps_inelastic.analysis.plots import plot_bounds, plot_points, style_of

from ..files import whole
from ..report.figures import DPI, RC
from .comparison import MEASURED, Comparison, Row
from .states import WayMedians

# The figure is about as wide as a page [inches].
SIZE = (7.4, 4.3)
STATES_SIZE = (7.4, 3.2)
ERRORS_SIZE = (7.4, 5.0)
FORMATS = ("png", "svg")
SCATTER = "scatter between starts"
# Below this ratio of largest to smallest, powers of ten alone would be too few ticks.
FEW = 200


def draw_tradeoff(comparison: Comparison, path: Path) -> list[Path]:
    """Draw a comparison, and write it as PNG and as SVG; return the files.

    Parameters
    ----------
    comparison : comparison with at least one row
    path : path of the files, without `.png` and `.svg`
    """
    with matplotlib.rc_context(RC):
        figure = Figure(figsize=SIZE, layout="constrained")
        grid = figure.add_gridspec(2, 2, width_ratios=(1.2, 1))
        cost = figure.add_subplot(grid[:, 0])
        upper = figure.add_subplot(grid[0, 1])
        lower = figure.add_subplot(grid[1, 1], sharex=upper)
        plot_cost(cost, comparison)
        plot_errors(upper, comparison, "packing_fraction").set_ylabel("error of packing fraction")
        plot_errors(lower, comparison, "coordination_number").set_ylabel("error of contacts")
        upper.set_xlabel("")
        upper.tick_params(labelbottom=False)
        figure.align_ylabels((upper, lower))
        _legend_below(figure, (cost, upper, lower))
        return _write(figure, path)


def draw_errors(comparison: Comparison, path: Path) -> list[Path]:
    """Draw the errors against wall time, and write it as PNG and as SVG; return the files.

    Soft contacts have no errors of velocities and forces: these are of steps of hard contacts.

    Parameters
    ----------
    comparison : comparison with at least one row
    path : path of the files, without `.png` and `.svg`
    """
    labels = {
        "packing_fraction": "error of packing fraction",
        "coordination_number": "error of contacts",
        "velocity": "error of velocities / g h",
        "force": "error of forces",
    }
    with matplotlib.rc_context(RC):
        figure = Figure(figsize=ERRORS_SIZE, layout="constrained")
        axes = list(figure.subplots(2, 2, sharex=True).flat)
        for ax, (name, label) in zip(axes, labels.items(), strict=True):
            plot_errors_in_time(ax, comparison, name).set_ylabel(label)
        for ax in axes[:2]:
            ax.set_xlabel("")
            ax.tick_params(labelbottom=False)
        figure.align_ylabels(axes)
        _legend_below(figure, axes)
        return _write(figure, path)


def draw_states(curves: Sequence[WayMedians], path: Path) -> list[Path]:
    """Draw the errors of recorded states against time, and write it as PNG and as SVG.

    Parameters
    ----------
    curves : at least one curve
    path : path of the files, without `.png` and `.svg`
    """
    with matplotlib.rc_context(RC):
        figure = Figure(figsize=STATES_SIZE, layout="constrained")
        axes = figure.subplots(1, 3, sharex=True)
        quantities = {
            "error of velocities": ("velocity_error",),
            "error of forces": ("force_error",),
            "contacts missed or false": ("missed", "false"),
        }
        for ax, (label, names) in zip(axes, quantities.items(), strict=True):
            for number, curve in enumerate(curves):
                error = sum((curve.medians[name] for name in names), np.zeros(len(curve.values)))
                points = _positive(
                    np.column_stack([1e3 * curve.medians["seconds"], error]).tolist()
                )
                if len(points):
                    plot_points(ax, *points.T, label=curve.way, number=number)
            ax.set_ylabel(label)
            ax.set_xlabel("time of a solution [ms]")
            if ax.has_data():
                ax.set_xscale("log")
                ax.set_yscale("log")
        known = dict(zip(*reversed(axes[0].get_legend_handles_labels()), strict=True))
        figure.legend(known.values(), known, loc="outside lower center", ncols=2)
        return _write(figure, path)


def plot_cost(ax: Axes, comparison: Comparison) -> Axes:
    """Plot the wall time to rest against the largest overlap there: a point a run, and medians."""
    _plot_numbers(ax, comparison, ("overlap_at_rest", "plateau_seconds"))
    _logarithmic(ax)
    ax.xaxis.set_inverted(True)
    ax.set_xlabel("largest overlap at rest / radius")
    ax.set_ylabel("wall time until at rest [s]")
    _label_heights(ax)
    return ax


def plot_errors_in_time(ax: Axes, comparison: Comparison, name: str) -> Axes:
    """Plot the error of a number against the wall time to rest, and the scatter between starts.

    Velocities and forces, whose errors are those of steps, have no scatter.
    """
    _plot_numbers(ax, comparison, ("plateau_seconds", f"{name}_error"))
    _logarithmic(ax)
    ax.set_xlabel("wall time until at rest [s]")
    if name in MEASURED:
        _shade_scatter(ax, comparison, name)
    _label_heights(ax)
    if ax.has_data():
        _write_plain(ax.xaxis)
    return ax


def plot_errors(ax: Axes, comparison: Comparison, name: str) -> Axes:
    """Plot the error of a number against the tolerance, and the scatter between starts."""
    for number, (label, rows) in enumerate(_curves(comparison.rows).items()):
        error = f"{name}_error"
        runs = [
            [row.configuration.tolerance, one.numbers[error]] for row in rows for one in row.runs
        ]
        medians = [[row.configuration.tolerance, row.median(error)] for row in rows]
        _plot(ax, runs, medians, label, number)
    _logarithmic(ax)
    ax.xaxis.set_inverted(True)
    ax.set_xlabel("tolerance / radius")
    _shade_scatter(ax, comparison, name)
    _label_heights(ax)
    return ax


def _shade_scatter(ax: Axes, comparison: Comparison, name: str) -> None:
    """Draw the scatter of a number between starts as a band of heights, if it is known."""
    scatter = comparison.scatter(name)
    if scatter > 0 and ax.has_data():
        # The band goes down to the axis, which has no 0.
        bottom, top = ax.get_ylim()
        bottom = min(bottom, scatter / 3)
        plot_bounds(ax, bottom / 10, scatter, label=SCATTER)
        ax.set_ylim(bottom, max(top, 1.5 * scatter))


def _legend_below(figure: Figure, axes: Iterable[Axes]) -> None:
    """Write a legend of all curves, each once, below a figure."""
    known = {
        label: handle
        for ax in axes
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    figure.legend(known.values(), known, loc="outside lower center", ncols=min(len(known), 3))


def _write(figure: Figure, path: Path) -> list[Path]:
    """Write a figure in all formats; return the files."""
    files = [path.with_name(f"{path.name}.{kind}") for kind in FORMATS]
    for file in files:
        # The file has no date, so that the same numbers give the same file.
        metadata = {"Date": None} if file.suffix == ".svg" else {}
        form = file.suffix.removeprefix(".")
        with whole(file) as temporary:
            figure.savefig(temporary, format=form, dpi=DPI, metadata=metadata)
    return files


def _plot_numbers(ax: Axes, comparison: Comparison, names: tuple[str, str]) -> None:
    """Plot a number of each run, and its medians, against another one; names are of x and y."""
    for number, (label, rows) in enumerate(_curves(comparison.rows).items()):
        runs = [[one.numbers[name] for name in names] for row in rows for one in row.runs]
        medians = [[row.median(name) for name in names] for row in rows]
        _plot(ax, runs, medians, label, number)


def _plot(
    ax: Axes,
    runs: Sequence[Sequence[float]],
    medians: Sequence[Sequence[float]],
    label: str,
    number: int,
) -> None:
    """Plot (x, y) of each run as a small point, and those of the medians as a curve."""
    if len(_positive(medians)) == 0:
        return
    style = style_of(number)
    ax.plot(
        *_positive(runs).T,
        linestyle="none",
        marker=style.marker,
        markersize=3,
        markeredgewidth=0,
        color=style.colour,
        alpha=0.45,
    )
    plot_points(ax, *_positive(medians).T, label=label, number=number)


def _curves(rows: Sequence[Row]) -> Mapping[str, list[Row]]:
    """Return rows that differ in the tolerance alone as one curve, by what tells it from others."""
    curves: dict[str, list[Row]] = {}
    for row in rows:
        one = row.configuration
        words = [f"{one.contacts} contacts" if one.contacts == "hard" else "soft spheres"]
        for name, value in one.choices.items():
            values = {other.configuration.choices[name] for other in rows} - {None}
            if len(values) > 1 and value is not None:
                # A solver's name says by itself what it is.
                words.append(f"{value}" if name == "solver" else f"{name} {value}")
        curves.setdefault(", ".join(words), []).append(row)
    return curves


def _logarithmic(ax: Axes) -> None:
    """Make both axes logarithmic. Axes without data say so."""
    if not ax.has_data():
        ax.text(0.5, 0.5, "no data", transform=ax.transAxes, ha="center", va="center")
        return
    ax.set_xscale("log")
    ax.set_yscale("log")


def _label_heights(ax: Axes) -> None:
    """Write plain numbers at the ticks of y, some between powers of ten where these are few."""
    if not ax.has_data():
        ax.set_yticks([])
        return
    _write_plain(ax.yaxis)


def _write_plain(axis: Axis) -> None:
    """Write plain numbers at the ticks of an axis, some between powers of ten where few are."""
    low, high = axis.get_view_interval()
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())
    if high < FEW * low:
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))


def _positive(points: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """Return the points (x, y) that have a place on logarithmic axes, (k, 2)."""
    there = [point for point in points if all(0 < value < np.inf for value in point)]
    return np.array(there, dtype=np.float64).reshape(-1, 2)
