"""The results of a comparison of time and accuracy, configuration by configuration.

The right packing is not known, so each run is compared with the tightest hard one from the same
start, the reference. Trajectories are chaotic: two runs from one start end in different packings
with the same statistics. An error therefore means little by itself; it counts where it is above the
scatter between starts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import network_difference

from ..results.store import Result
from .plan import Configuration, Run

FloatArray = NDArray[np.float64]

# These numbers of a result are compared, by their names in the schema.
MEASURED = (
    "plateau_time",
    "plateau_seconds",
    "settling_seconds",
    "steps",
    "plateau_iterations",
    "iterations",
    "overlap_at_rest",
    "overlap_falling",
    "complementarity_at_rest",
    "drift",
    "packing_fraction",
    "coordination_number",
    "box_in_bed",
)
# These are computed from them and the reference's.
COMPARED = ("packing_fraction_error", "coordination_number_error", "network_error", "shared")
# These are of recorded steps against their exact solutions.
OF_STEPS = ("velocity_error", "force_error")
# The errors of the steps of runs, by the number of ranks and the name of the case, in the order of
# OF_STEPS.
StepNumbers = Mapping[tuple[int, str], tuple[float, float]]


@dataclass(frozen=True)
class RunNumbers:
    """The numbers that came out of one run.

    Attributes
    ----------
    run : the run
    numbers : numbers by the names of MEASURED, COMPARED and OF_STEPS; NaN where there is none
    """

    run: Run
    numbers: Mapping[str, float]

    @property
    def at_rest(self) -> bool:
        """Whether the run came to rest."""
        return not math.isnan(self.numbers["plateau_time"])


@dataclass(frozen=True)
class Row:
    """The numbers of the runs of a configuration from all starts.

    Attributes
    ----------
    configuration : the configuration
    runs : numbers of the run from each start
    slower : times that soft contacts of the same tolerance took to come to rest, over the times of
        these hard ones, for each start that both have; empty for soft contacts
    """

    configuration: Configuration
    runs: Sequence[RunNumbers]
    slower: FloatArray = field(default_factory=lambda: np.empty(0))

    def values(self, name: str) -> FloatArray:
        """Return a number from each start that has it."""
        return _finite(one.numbers[name] for one in self.runs)

    @property
    def all_at_rest(self) -> bool:
        """True if the configuration came to rest from all starts."""
        return len(self.values("plateau_seconds")) == len(self.runs)

    def median(self, name: str) -> float:
        """Return the median over the starts; NaN if none has the number."""
        values = self.values(name)
        return float(np.median(values)) if len(values) else math.nan


@dataclass(frozen=True)
class Comparison:
    """All configurations side by side.

    Attributes
    ----------
    rows : row of each configuration of which anything came out
    """

    rows: Sequence[Row]

    @property
    def has_steps(self) -> bool:
        """True if recorded steps of some run were measured."""
        return any(len(row.values(name)) for row in self.rows for name in OF_STEPS)

    def reference(self, ranks: int | None = None) -> Row | None:
        """Return the row that those of so many ranks are compared with; None if there is none.

        Without a number of ranks, that of the first row is taken.
        """
        if ranks is None:
            ranks = self.rows[0].configuration.ranks if self.rows else 1
        wanted = reference_of((row.configuration for row in self.rows), ranks)
        return next((row for row in self.rows if row.configuration == wanted), None)

    def scatter(self, name: str) -> float:
        """Return the standard deviation of a number between the starts at the reference.

        NaN where fewer than two starts came to rest.
        """
        row = self.reference()
        runs = () if row is None else row.runs
        values = _finite(one.numbers[name] for one in runs if one.at_rest)
        return float(values.std(ddof=1)) if len(values) > 1 else math.nan

    def shifts(self, row: Row, name: str) -> FloatArray:
        """Return a number less the reference's, one a start from which both came to rest."""
        reference = self.reference(row.configuration.ranks)
        if reference is None:
            return np.empty(0)
        known = {one.run.start: one.numbers[name] for one in reference.runs if one.at_rest}
        return _finite(
            one.numbers[name] - known.get(one.run.start, math.nan)
            for one in row.runs
            if one.at_rest
        )


def compare(
    results: Sequence[tuple[Run, Result]], of_steps: StepNumbers | None = None
) -> Comparison:
    """Compare all runs of which there is a result with the reference's from the same start.

    The same start on another number of ranks is another one: its spheres have other numbers.

    Parameters
    ----------
    results : runs with their results
    of_steps : errors of their recorded steps, as far as there are any
    """
    configurations = list(dict.fromkeys(run.configuration for run, _ in results))
    references = {
        (run.configuration.ranks, run.start): result
        for run, result in results
        if run.configuration == reference_of(configurations, run.configuration.ranks)
    }
    unknown = (math.nan, math.nan)
    numbers = []
    for run, result in results:
        ranks = run.configuration.ranks
        found = (of_steps or {}).get((ranks, run.case.name), unknown)
        own = _numbers(result, references.get((ranks, run.start)))
        numbers.append(RunNumbers(run, own | dict(zip(OF_STEPS, found, strict=True))))
    grouped = {
        configuration: [one for one in numbers if one.run.configuration == configuration]
        for configuration in configurations
    }
    rows = []
    for configuration, group in grouped.items():
        soft = next((other for other in grouped if _matches(configuration, other)), None)
        slower = np.empty(0) if soft is None else _ratios(grouped[soft], group)
        rows.append(Row(configuration, group, slower))
    return Comparison(rows)


def reference_of(configurations: Iterable[Configuration], ranks: int) -> Configuration | None:
    """Return the tightest hard configuration on so many ranks; None if there is none.

    If there are several, it is the one with the smallest accuracy, of these the one with the
    shortest time step, and the first of these.
    """
    hard = [one for one in configurations if (one.contacts, one.ranks) == ("hard", ranks)]
    return min(hard, key=lambda one: (one.tolerance, one.accuracy, one.dt), default=None)


def _matches(hard: Configuration, soft: Configuration) -> bool:
    return (
        (hard.contacts, soft.contacts) == ("hard", "soft")
        and math.isclose(hard.tolerance, soft.tolerance)
        and hard.ranks == soft.ranks
    )


def _ratios(above: Sequence[RunNumbers], below: Sequence[RunNumbers]) -> FloatArray:
    """Return the ratios of the times to rest, one a start that came to rest in both."""
    known = {one.run.start: one.numbers["plateau_seconds"] for one in below}
    return _finite(
        one.numbers["plateau_seconds"] / known.get(one.run.start, math.nan) for one in above
    )


def _finite(values: Iterable[float]) -> FloatArray:
    """Return numbers without those that are NaN or infinite."""
    return np.array([value for value in values if math.isfinite(value)], dtype=np.float64)


def _numbers(result: Result, reference: Result | None) -> dict[str, float]:
    numbers = {name: result.number(name) for name in MEASURED}
    numbers |= dict.fromkeys(COMPARED, math.nan)
    if reference is None or reference is result:
        return numbers
    # The last moment of a packing that still moves is one of many: it has no errors, and nothing
    # has errors against it.
    if any(math.isnan(one.number("plateau_time")) for one in (result, reference)):
        return numbers
    for name in ("packing_fraction", "coordination_number"):
        numbers[f"{name}_error"] = abs(numbers[name] - reference.number(name))
    networks = [
        one.values[name]
        for one in (result, reference)
        for name in ("network/ids", "network/forces")
    ]
    # A packing without contacts has no network.
    if len(networks[0]) and len(networks[2]):
        apart = network_difference(*networks)
        numbers |= {"network_error": apart.forces, "shared": apart.shared}
    return numbers
