"""Figures of the report: what is drawn is a table of numbers, and both are written.

A figure is made of panels, a panel of curves; its CSV file holds the same curves, one row a point.
"""

from __future__ import annotations

import base64
import csv
import io
import math
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike
from PIL import Image, ImageOps

from lammps_inelastic.analysis.plots import (
    plot_bounds,
    plot_curve,
    plot_distribution,
    plot_moment,
    plot_points,
    plot_reference,
    plot_wall_profile,
)

from ..files import whole
from .curves import FloatArray
from .statistics import Sample

Kind = Literal["curve", "points", "apart", "distribution", "profile"]

# The size of one panel in inches; the text has about the size of the page's.
WIDTH, HEIGHT = 4.6, 3.4
DPI = 200
# A legend of more entries, or longer ones, stands below the axes: its rows are so many inches high
# and hold so many letters a panel.
MOST_INSIDE, LONGEST_INSIDE = 6, 26
LEGEND_ROW, LINE = 0.19, 62
# So many pixels are left around a picture whose margins are cut off.
MARGIN = 10
RC: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    # A line that marks a place does not strike out the words of a legend.
    "legend.frameon": True,
    "legend.edgecolor": "none",
    "legend.fancybox": False,
    "legend.fontsize": "small",
    "xtick.direction": "out",
    "ytick.direction": "out",
    # Letters are drawn as outlines: the page needs no font of the reader's.
    "svg.fonttype": "path",
    # The same numbers give the same file.
    "svg.hashsalt": "inelastic",
    "pdf.fonttype": 42,
}


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve.

    Attributes
    ----------
    label : the name in the legend and the CSV file
    x, y : (k,)
    error : (k,), standard error of y; None where there is none
    kind : how it is drawn; `apart`: points that no line joins
    """

    label: str
    x: FloatArray
    y: FloatArray
    error: FloatArray | None = None
    kind: Kind = "curve"


def curve(
    label: str, x: ArrayLike, y: ArrayLike, error: ArrayLike | None = None, kind: Kind = "curve"
) -> Curve:
    """Return a curve of whatever numpy takes for arrays."""
    return Curve(
        label,
        np.asarray(x, dtype=np.float64),
        np.asarray(y, dtype=np.float64),
        None if error is None else np.asarray(error, dtype=np.float64),
        kind,
    )


def points(label: str, x: ArrayLike, samples: Iterable[Sample], kind: Kind = "points") -> Curve:
    """Return means over runs as points with their standard errors as error bars.

    Parameters
    ----------
    label : for the legend and the CSV file
    x : (k,)
    samples : k of them
    kind : how they are drawn
    """
    known = list(samples)
    return curve(label, x, [one.mean for one in known], [one.error for one in known], kind)


@dataclass(frozen=True, eq=False)
class Panel:
    """One pair of axes.

    Attributes
    ----------
    x, y : labels of the axes, with units
    curves : in the order of their styles
    references : horizontal lines, and what they are
    bounds : a shaded range of y, and what it is
    moments : vertical lines, and what is written beside them
    title : above the axes
    log : whether y is on a logarithmic scale
    log_x : whether x is
    ticks : names of x = 0, 1, ...
    top : upper end of y, where the highest values say little
    """

    x: str
    y: str
    curves: Sequence[Curve]
    references: Sequence[tuple[str, float]] = ()
    bounds: tuple[str, float, float] | None = None
    moments: Sequence[tuple[str, float]] = ()
    title: str = ""
    log: bool = False
    log_x: bool = False
    ticks: Sequence[str] = ()
    top: float | None = None


@dataclass(frozen=True, eq=False)
class Figure:
    """A figure of the report.

    Attributes
    ----------
    name : the name of its files
    caption : what is seen
    panels : from left to right
    drawing : draws on a panel's axis in its stead; such a figure has no numbers
    """

    name: str
    caption: str
    panels: Sequence[Panel] = ()
    drawing: Sequence[Callable[[Axes], Axes]] = ()

    @property
    def kind(self) -> str:
        """The name by which the template tells blocks apart."""
        return "figure"

    @property
    def is_wide(self) -> bool:
        """Whether several panels stand side by side."""
        return max(len(self.panels), len(self.drawing)) > 1

    @property
    def svg(self) -> str:
        """The figure as a data URI."""
        buffer = io.BytesIO()
        self._save(buffer, "svg")
        return f"data:image/svg+xml;base64,{base64.b64encode(buffer.getvalue()).decode()}"

    def write(self, folder: Path) -> None:
        """Write the figure as PDF, PNG and CSV into a folder that is there."""
        for form in ("pdf", "png"):
            with whole(folder / f"{self.name}.{form}") as temporary:
                self._save(temporary, form)
        if self.panels:
            _write_rows(folder / f"{self.name}.csv", self.rows())

    def rows(self) -> list[list[str]]:
        """Return what the CSV file holds: a heading, then a row for each point of each curve."""
        names = list(dict.fromkeys(["curve", *(panel.x for panel in self.panels)]))
        for panel in self.panels:
            names += [name for name in (panel.y, f"standard error of {panel.y}")]
        names = list(dict.fromkeys(names))
        rows = [names]
        for panel in self.panels:
            for one in panel.curves:
                errors = np.full(len(one.y), math.nan) if one.error is None else one.error
                label = f"{panel.title}: {one.label}" if panel.title else one.label
                for place, value, error in zip(one.x, one.y, errors, strict=True):
                    tick = panel.ticks[int(place)] if panel.ticks else f"{place:.10g}"
                    row = {"curve": label, panel.x: tick, panel.y: _word(value)}
                    row[f"standard error of {panel.y}"] = _word(error)
                    rows.append([row.get(name, "") for name in names])
        # A column without any entry is left out.
        filled = [any(row[i] for row in rows[1:]) for i in range(len(names))]
        return [[cell for cell, kept in zip(row, filled, strict=True) if kept] for row in rows]

    def _save(self, target: Any, form: str) -> None:
        # Without these an SVG file and a PDF file hold the date.
        metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": None}[form]
        with matplotlib.rc_context(RC):
            self._canvas.savefig(target, format=form, dpi=DPI, metadata=metadata)

    @cached_property
    def _canvas(self) -> Canvas:
        """The figure as it is drawn, once for all formats."""
        with matplotlib.rc_context(RC):
            count = max(len(self.panels), len(self.drawing))
            rows = [] if _fits(self.panels) else _legend(self.panels, count)
            height = HEIGHT + sum(1 + label.count("\n") for label in rows) * LEGEND_ROW
            canvas = Canvas(figsize=(WIDTH * count, height), layout="constrained")
            axes = canvas.subplots(1, count, squeeze=False)[0]
            for ax, panel in zip(axes, self.panels, strict=False):
                _draw(ax, panel)
            for ax, draw in zip(axes, self.drawing, strict=False):
                draw(ax)
            if rows:
                handles = {
                    label: handle
                    for ax in axes
                    for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
                }
                canvas.legend(list(handles.values()), rows, loc="outside lower left")
            else:
                for ax in axes:
                    if len(ax.get_legend_handles_labels()[1]) > 1:
                        ax.legend(loc="best")
            # The layout takes longer than the drawing: it is made once.
            canvas.draw_without_rendering()
            canvas.set_layout_engine("none")
        return canvas


@dataclass(frozen=True, eq=False)
class Pictures:
    """Pictures that are stored as PNG files.

    Attributes
    ----------
    name : the name of their files
    caption : what is seen
    pictures : PNG files by what is written below each
    trimmed : whether white margins are cut off
    """

    name: str
    caption: str
    pictures: Mapping[str, bytes]
    trimmed: bool = False

    @property
    def kind(self) -> str:
        """The name by which the template tells blocks apart."""
        return "pictures"

    @property
    def sources(self) -> list[tuple[str, str]]:
        """The text below each picture, and the picture as a data URI."""
        return [
            (label, f"data:image/png;base64,{base64.b64encode(data).decode()}")
            for label, data in self._shown()
        ]

    def _shown(self) -> list[tuple[str, bytes]]:
        return [
            (label, _without_margins(data) if self.trimmed else data)
            for label, data in self.pictures.items()
        ]

    def write(self, folder: Path) -> None:
        """Write the pictures side by side as PDF and PNG, and as CSV what each one shows."""
        images = [Image.open(io.BytesIO(data)).convert("RGB") for _, data in self._shown()]
        height = max(image.height for image in images)
        joined = Image.new("RGB", (sum(image.width for image in images), height), "white")
        left = 0
        for image in images:
            joined.paste(image, (left, height - image.height))
            left += image.width
        for form in ("png", "pdf"):
            with whole(folder / f"{self.name}.{form}") as temporary:
                joined.save(temporary, format=form)
        rows = [["picture from the left", "what"], *enumerate(self.pictures, 1)]
        _write_rows(folder / f"{self.name}.csv", rows)


def _write_rows(path: Path, rows: Iterable[Iterable[object]]) -> None:
    with whole(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)


def _without_margins(data: bytes) -> bytes:
    """Return a PNG file without its white margins, but for a few pixels."""
    with Image.open(io.BytesIO(data)) as image:
        box = ImageOps.invert(image.convert("L")).getbbox()
        if box is None:
            return data
        left, top, right, bottom = box
        wide, high = image.size
        cut = image.crop(
            (
                max(left - MARGIN, 0),
                max(top - MARGIN, 0),
                min(right + MARGIN, wide),
                min(bottom + MARGIN, high),
            )
        )
        buffer = io.BytesIO()
        cut.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def _labels(panel: Panel) -> list[str]:
    bounds = [] if panel.bounds is None else [panel.bounds[0]]
    return [*bounds, *(label for label, _ in panel.references), *(c.label for c in panel.curves)]


def _fits(panels: Sequence[Panel]) -> bool:
    """Say whether the legends are small enough to stand within the axes."""
    return all(
        len(labels) <= MOST_INSIDE
        and max(map(len, labels)) <= LONGEST_INSIDE
        # Error bars of many curves leave no room.
        and sum(one.kind == "points" for one in panel.curves) <= 2
        for panel in panels
        if len(labels := _labels(panel)) > 1
    )


def _legend(panels: Sequence[Panel], count: int) -> list[str]:
    """Return the rows of a legend below all axes: each label once, in lines that fit."""
    labels = dict.fromkeys(label for panel in panels for label in _labels(panel))
    return [textwrap.fill(label, LINE * count) for label in labels]


def _draw(ax: Axes, panel: Panel) -> None:
    if panel.bounds is not None:
        label, low, high = panel.bounds
        plot_bounds(ax, low, high, label=label)
    for number, (label, value) in enumerate(panel.references):
        plot_reference(ax, value, label=label, number=number)
    # A logarithmic axis ends below the smallest value, not where an error band meets 0.
    bottom = 0.5 * min(float(one.y[one.y > 0].min()) for one in panel.curves) if panel.log else None
    for number, one in enumerate(panel.curves):
        _draw_curve(ax, one, number, bottom)
    for label, place in panel.moments:
        plot_moment(ax, place, label)
    if bottom is not None:
        ax.set_yscale("log", nonpositive="mask")
        ax.set_ylim(bottom=bottom)
    if panel.log_x:
        ax.set_xscale("log")
    if panel.ticks:
        ax.set_xticks(range(len(panel.ticks)), panel.ticks, rotation=30, ha="right")
        ax.set_xlim(-0.5, len(panel.ticks) - 0.5)
    elif any(one.kind == "distribution" for one in panel.curves):
        # There is no half contact.
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    if panel.top is not None:
        ax.set_ylim(0, panel.top)
    ax.set_xlabel("" if panel.ticks else panel.x)
    ax.set_ylabel(panel.y)
    if panel.title:
        ax.set_title(panel.title, fontsize="medium")


def _draw_curve(ax: Axes, one: Curve, number: int, bottom: float | None) -> None:
    """Draw a curve; `bottom` is the lower end of a logarithmic axis."""
    # A band reaches beyond the lower end of the axis: it is cut there and does not seem to end.
    least = None if bottom is None else bottom / 10
    how: Any = {"errors": one.error, "label": one.label, "number": number, "least": least}
    if one.kind == "distribution":
        plot_distribution(ax, one.y, **how)
    elif one.kind == "profile":
        plot_wall_profile(ax, one.x, one.y, **how)
    elif one.kind == "curve":
        plot_curve(ax, one.x, one.y, **how)
    else:
        plot_points(ax, one.x, one.y, joined=one.kind == "points", **how)


def _word(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.10g}"
