"""The paper's Figure 5: packing fraction and coordination number until the packing is at rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from lammps_inelastic.analysis import AnalysisError, Plateau, plateau

from ...results.store import Result
from ..blocks import Block, Content, Statement, Table, Text
from ..columns import RUNS, Column, table
from ..curves import FloatArray
from ..data import Data, series
from ..figures import Curve, Figure, Panel, curve
from ..groups import by_value, count_of, grouped, matching, nearest_size, seed_label
from ..quantities import COORDINATION_NUMBER, PACKING_FRACTION, Quantity
from ..statistics import SIGNIFICANT, sample
from ..text import DASH, as_count, as_probability, as_short, as_text

# The paper calls its two curves constant within these shares of the final mean.
BAND_OF_PHI, BAND_OF_Z = 0.001, 0.0005


@dataclass(frozen=True)
class _Run:
    """A row of the table.

    Attributes
    ----------
    particles, label : of the run
    phi, z : the plateaus; None where the box was empty
    phi_scatter, z_scatter : standard deviation from frame to frame while the bed rests, relative to
        the mean; NaN where fewer than three frames were written then
    """

    particles: int
    label: str
    phi: Plateau | None
    z: Plateau | None
    phi_scatter: float
    z_scatter: float


COLUMNS: Sequence[Column[_Run]] = (
    Column("spheres", lambda run: as_count(run.particles)),
    Column("run", lambda run: run.label),
    Column(f"φ within ±{as_text(100 * BAND_OF_PHI, 1)}% from step", lambda run: _step(run.phi)),
    Column("mean φ", lambda run: _mean(run.phi, PACKING_FRACTION), "%"),
    Column(f"z within ±{as_text(100 * BAND_OF_Z, 2)}% from step", lambda run: _step(run.z)),
    Column("mean z", lambda run: _mean(run.z, COORDINATION_NUMBER)),
    Column("φ, frame to frame", lambda run: as_text(100 * run.phi_scatter, 3), "%"),
    Column("z, frame to frame", lambda run: as_text(100 * run.z_scatter, 2), "%"),
)


def coming_to_rest(data: Data) -> Content:
    """Show both numbers against the step, and from which step on they stay as they are."""
    with_frames = [r for r in data.results("table-2") if series(r, "evolution/step") is not None]
    results = nearest_size(with_frames, 10_000, data.usual_tolerance)
    if not results:
        return Content()
    runs = [_run(result) for result in results]
    to_plateau = _times_to_the_plateau(data)
    blocks: list[Block] = [
        _figure(data, results),
        _table_of_plateaus(runs),
        _remark(data.paper["protocol"]),
    ]
    if to_plateau:
        blocks.append(_table_of_times(to_plateau))
    return Content(blocks, statements=[*_statements(runs), *_statement_on_times(to_plateau)])


def _run(result: Result) -> _Run:
    """Return where a run comes to a plateau, and how much it scatters at rest."""
    return _Run(
        count_of([result]),
        seed_label(result),
        _plateau(result, PACKING_FRACTION, BAND_OF_PHI),
        _plateau(result, COORDINATION_NUMBER, BAND_OF_Z),
        _scatter_at_rest(result, PACKING_FRACTION),
        _scatter_at_rest(result, COORDINATION_NUMBER),
    )


def _figure(data: Data, results: Sequence[Result]) -> Figure:
    """Return a figure of both numbers against the step."""
    moments = _moments(results[0], data.paper["protocol"])
    return Figure(
        "figure-5",
        f"Packing fraction and coordination number in the box against the step, "
        f"{as_count(count_of(results))} spheres. The two steps that the paper names are "
        "those of its own code; dashed and shaded: its numbers of packings at rest.",
        [
            Panel(
                "step",
                "packing fraction",
                _curves(results, PACKING_FRACTION),
                references=_stated_packing_fraction(data, count_of(results)),
                moments=moments,
            ),
            Panel(
                "step",
                "coordination number",
                _curves(results, COORDINATION_NUMBER),
                bounds=stated_contacts(data),
                moments=moments,
            ),
        ],
    )


def _table_of_plateaus(runs: Sequence[_Run]) -> Table:
    """Return a table of the steps from which on the numbers stay as they are."""
    return table(
        "From which step on the packing stays as it is",
        COLUMNS,
        runs,
        (
            "The mean is that of the last quarter of the frames. Dash: not even the last "
            "frame. Frame to frame: standard deviation over the mean, in the phase of "
            "rest.",
        ),
    )


def _remark(stated: Mapping[str, Any]) -> Text:
    """Return a remark on the paper's steps, and on what still moves in the end."""
    return Text(
        f"Paper: a plateau after about {stated['plateau_reached_at_step']} steps; from "
        f"step {stated['plateau_step']} on φ is constant within 0.1 % and z within 0.05 %. "
        "A step of the paper's code and one of ours need not last the same time, and "
        "nothing states how long the paper's is: the shapes can be compared, the numbers "
        "of steps cannot. A bed of this size still gives way here and there when the run "
        "ends, by far less than its packing fraction tells; contacts open and close with "
        "it, and 0.05 % of z are two contacts of the box. z is that of single frames, and "
        "until the count it is taken with the larger ε."
    )


def _stated_packing_fraction(data: Data, spheres: int) -> list[tuple[str, float]]:
    """Return the packing fraction of the paper's Table 2 for so many spheres, if it has them."""
    return [
        (f"paper: {row['phi_percent']} %", row["phi_percent"] / PACKING_FRACTION.factor)
        for row in data.paper["table2"]
        if row["spheres"] == spheres
    ]


def stated_contacts(data: Data) -> tuple[str, float, float]:
    """Return the paper's range of the coordination number of spheres, and what it is."""
    z = data.paper["spheres"]["z"]
    value, reach = z["value"], z["tolerance"]
    return f"paper: {as_text(value, 2)} ± {as_short(reach)}", value - reach, value + reach


def _statements(runs: Sequence[_Run]) -> list[Statement]:
    """Say whether both numbers come to a plateau in all runs."""
    found = []
    for name, band, plateaus, scatters in (
        (
            "packing fraction",
            BAND_OF_PHI,
            [run.phi for run in runs],
            [run.phi_scatter for run in runs],
        ),
        (
            "coordination number",
            BAND_OF_Z,
            [run.z for run in runs],
            [run.z_scatter for run in runs],
        ),
    ):
        scatter = sample(scatters).mean
        steps = [one.step for one in plateaus if one is not None and one.step is not None]
        found.append(
            Statement(
                f"The {name} comes to a plateau, constant within ±{as_text(100 * band, 2)} %.",
                len(steps) == len(plateaus),
                f"{len(steps)} of {len(plateaus)} runs"
                + (f", from step {min(steps)} to {max(steps)} on" if steps else "")
                + (
                    ""
                    if math.isnan(scatter)
                    else f"; at rest, frames scatter by {as_text(100 * scatter, 2)} %"
                ),
                f"the {name} is constant within ±{as_text(100 * band, 2)} % in {len(steps)} of "
                f"{len(plateaus)} runs"
                + (
                    ""
                    if math.isnan(scatter)
                    else f"; frames at rest scatter by {as_text(100 * scatter, 2)} %"
                ),
            )
        )
    return found


@dataclass(frozen=True)
class _ToPlateau:
    """How long the runs of one random force take to the plateau.

    Attributes
    ----------
    force : largest random acceleration, per direction
    group : the runs
    reached : how many of them reach it before they end
    time, seconds : simulated time and seconds of computing, of each run; infinite if not reached
    """

    force: float
    group: Sequence[Result]
    reached: int
    time: FloatArray
    seconds: FloatArray


def _median(values: FloatArray) -> str:
    """Write the median and the quartiles; runs that do not reach the plateau are longest."""
    # Of the values themselves: between a finite one and infinity there is none to interpolate.
    low, high = np.quantile(values, (0.25, 0.75), method="inverted_cdf")
    return f"{_text(np.median(values))} ({_text(low)} to {_text(high)})"


def _text(value: float) -> str:
    return as_text(value, 2) if math.isfinite(value) else "not reached"


PLATEAU_COLUMNS: Sequence[Column[_ToPlateau]] = (
    Column("random force", lambda row: as_short(row.force)),
    RUNS,
    Column("reach it", lambda row: row.reached),
    Column("time: median (quartiles)", lambda row: _median(row.time)),
    Column("computing [s]: median (quartiles)", lambda row: _median(row.seconds)),
)


def _table_of_times(rows: Sequence[_ToPlateau]) -> Table:
    """Return a table of the times to the plateau, by the random force."""
    return table(
        "How long it takes to the plateau of φ",
        PLATEAU_COLUMNS,
        rows,
        (
            "The plateau begins with the first frame from which on φ stays within "
            f"±{as_text(100 * BAND_OF_PHI, 1)} % of the mean of the last quarter. "
            "A bed that still gives way at the end of its run has not reached it: "
            "it counts as longer than all others.",
        ),
    )


def _times_to_the_plateau(data: Data) -> list[_ToPlateau]:
    """Return how long it takes with each random force, in the study with many seeds."""
    usual = matching(data.results("more-seeds"), tolerance=data.usual_tolerance)
    known = [r for r in usual if series(r, "evolution/seconds") is not None]
    rows = []
    for force, group in sorted(grouped(known, by_value("random_force")).items()):
        found = [_plateau(r, PACKING_FRACTION, BAND_OF_PHI) for r in group]
        steps = [None if one is None else one.step for one in found]
        time, seconds = (
            np.array([_at(r, name, step) for r, step in zip(group, steps, strict=True)])
            for name in ("time", "seconds")
        )
        rows.append(_ToPlateau(force, group, int(np.isfinite(time).sum()), time, seconds))
    return rows


def _at(result: Result, name: str, step: float | None) -> float:
    """Return simulated time, or seconds of computing, at a step; infinite for None."""
    if step is None:
        return math.inf
    return float(
        np.interp(step, result.values["evolution/step"], result.values[f"evolution/{name}"])
    )


def _statement_on_times(rows: Sequence[_ToPlateau]) -> list[Statement]:
    """Compare computing times by ranks: some runs have not reached the plateau at their end."""
    without = next((row for row in rows if row.force == 0), None)
    shaken = next((row for row in rows if row.force > 0), None)
    if without is None or shaken is None:
        return []
    test = scipy.stats.mannwhitneyu(shaken.seconds, without.seconds)
    # Half of all pairs, one run of either, would be won by either if the force did nothing.
    faster = test.statistic < len(shaken.group) * len(without.group) / 2
    p = float(test.pvalue)
    return [
        Statement(
            "It takes slightly less computing time to the plateau with a random force.",
            bool(faster) if p < SIGNIFICANT else None,
            f"median {_seconds(shaken)} with, {_seconds(without)} without (p = "
            f"{as_probability(p)}, Mann and Whitney)",
        )
    ]


def _seconds(row: _ToPlateau) -> str:
    middle = _text(np.median(row.seconds))
    unit = " s" if 2 * row.reached > len(row.group) else ""
    return f"{middle}{unit} ({row.reached} of {len(row.group)} runs reach it)"


def _curves(results: Sequence[Result], quantity: Quantity) -> list[Curve]:
    return [curve(seed_label(result), *_evolution(result, quantity)) for result in results]


def _moments(result: Result, stated: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Return the steps at which something happens, in the paper and in our runs."""
    moments = [
        ("paper: plateau", float(stated["plateau_reached_at_step"])),
        ("paper: constant", float(stated["plateau_step"])),
    ]
    off = result.setting("steps_agitated")
    before = ("steps_settling", "steps_resting", "steps_tightening")
    counted = off + sum(result.setting(name) for name in before)
    ours = [("random force off", off), ("contacts are counted", counted)]
    return [*moments, *((what, step) for what, step in ours if not math.isnan(step))]


def _evolution(result: Result, quantity: Quantity) -> tuple[FloatArray, FloatArray]:
    """Return the steps of the frames and a number in each, (f,) both."""
    steps, values = series(result, "evolution/step"), series(result, f"evolution/{quantity.name}")
    assert steps is not None
    assert values is not None
    return steps, values


def _plateau(result: Result, quantity: Quantity, band: float) -> Plateau | None:
    steps, values = _evolution(result, quantity)
    try:
        return plateau(steps, values, band=band)
    except AnalysisError:  # NaN at the end: an empty box
        return None


def _scatter_at_rest(result: Result, quantity: Quantity) -> float:
    """Return how much a number scatters from frame to frame after the drag has taken its effect."""
    steps, values = _evolution(result, quantity)
    begin = result.setting("steps_agitated") + result.setting("steps_settling")
    resting = values[(steps > begin) & (steps <= begin + result.setting("steps_resting"))]
    if len(resting) < 3:
        return math.nan
    return float(np.std(resting, ddof=1) / np.mean(resting))


def _step(found: Plateau | None) -> str:
    return DASH if found is None or found.step is None else as_count(found.step)


def _mean(found: Plateau | None, quantity: Quantity) -> str:
    return DASH if found is None else as_text(found.mean * quantity.factor, quantity.decimals)
