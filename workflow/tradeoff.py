"""How accuracy is paid for with time: the runs that show it, and what they say side by side.

Every configuration (hard or soft contacts, a tolerance, and for hard ones a solver and a time
step) lets the same starts settle. What is right is not known, so each run is compared with the
tightest hard one from the same start, the reference. Trajectories are chaotic: two runs from one
start end in different packings with the same statistics. An error therefore means little by itself;
it counts where it is above the scatter between starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import network_difference

from .decks import SETTLING, Value, find_deck
from .store import Result
from .study import INPUTS, Case, Input, stage_of

FloatArray = NDArray[np.float64]

# The start is made and nothing else: its deck's phases have no steps.
NO_STEPS: Mapping[str, Value] = {
    "steps_agitated": 0,
    "steps_settling": 0,
    "steps_tightening": 0,
    "steps_measuring": 0,
}
# Numbers of a result that are compared, as in the schema.
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
)
# What is computed from them and the reference's.
COMPARED = ("packing_fraction_error", "coordination_number_error", "network_error", "shared")


@dataclass(frozen=True)
class Configuration:
    """One way to let a start settle.

    Attributes
    ----------
    contacts : hard or soft
    tolerance : largest overlap, radii; of soft contacts at rest, about
    solver : of hard contacts, else None
    dt : longest time step of hard contacts, time; else None
    ranks : MPI ranks
    """

    contacts: Literal["hard", "soft"]
    tolerance: float
    solver: str | None
    dt: float | None
    ranks: int


@dataclass(frozen=True)
class Plan:
    """What is to be run.

    Attributes
    ----------
    particle : spheres or dimers
    values : variables of the decks that all runs share
    starts : seeds of random starts, or data files
    tolerances : of hard contacts, radii
    soft_tolerances : of soft contacts, radii; none leaves them out
    dts : time steps of hard contacts, time
    solvers : of hard contacts
    ranks : MPI ranks; everything is run with each number of them
    """

    particle: str
    values: Mapping[str, Value]
    starts: Sequence[int | Path]
    tolerances: Sequence[float]
    soft_tolerances: Sequence[float]
    dts: Sequence[float]
    solvers: Sequence[str]
    ranks: Sequence[int]

    @property
    def configurations(self) -> list[Configuration]:
        """All of them: hard ones first, from the loosest tolerance to the tightest."""
        tolerances = sorted(self.tolerances, reverse=True)
        hard = [
            Configuration("hard", tolerance, solver, dt, ranks)
            for ranks, solver, dt, tolerance in product(
                self.ranks, self.solvers, self.dts, tolerances
            )
        ]
        soft = [
            Configuration("soft", tolerance, None, None, ranks)
            for ranks, tolerance in product(self.ranks, sorted(self.soft_tolerances, reverse=True))
        ]
        return hard + soft


@dataclass(frozen=True)
class Run:
    """One configuration from one start.

    Attributes
    ----------
    configuration : how it settles
    start : the seed or the data file's name
    case : what is run
    """

    configuration: Configuration
    start: str
    case: Case


def runs_of(plan: Plan) -> list[Run]:
    """Return all runs, start by start: what slows a machine for a while slows all configurations.

    All runs from a start are given the very same one: the tolerance, the time step and the solver
    are the settling's, and the deck that makes the start keeps its defaults.
    """
    folder = Path()
    first, second = find_deck(plan.particle, folder), find_deck(SETTLING, folder)
    files = {start: Input.of(start) for start in plan.starts if isinstance(start, Path)}
    runs = []
    for start, configuration in product(plan.starts, plan.configurations):
        own: dict[str, Value] = {**NO_STEPS, **plan.values}
        inputs: dict[str, Input] = {}
        if isinstance(start, Path):
            own["start"] = f"{INPUTS}/{start.name}"
            inputs[start.name] = files[start]
        else:
            own["seed"] = start
        settling: dict[str, Value] = {
            **plan.values,
            "particle": plan.particle,
            "contacts": configuration.contacts,
            "tolerance": configuration.tolerance,
        }
        if configuration.solver is not None and configuration.dt is not None:
            settling |= {"solver": configuration.solver, "dt": configuration.dt}
        case = Case((stage_of(first, own), stage_of(second, settling)), inputs)
        label = start.name if isinstance(start, Path) else str(start)
        runs.append(Run(configuration, label, case))
    return runs


@dataclass(frozen=True)
class Outcome:
    """What came out of one run.

    Attributes
    ----------
    run : which one
    numbers : by the names of MEASURED and COMPARED; NaN where there is none
    """

    run: Run
    numbers: Mapping[str, float]


@dataclass(frozen=True)
class Row:
    """What came out of a configuration from all starts.

    Attributes
    ----------
    configuration : which one
    outcomes : one a start
    slower : how many times as long as this soft contacts of the same tolerance took to come to
        rest, one a start that both have; none of soft contacts
    """

    configuration: Configuration
    outcomes: Sequence[Outcome]
    slower: FloatArray = field(default_factory=lambda: np.empty(0))

    def values(self, name: str) -> FloatArray:
        """Return a number from each start, without those that have none."""
        return _finite(outcome.numbers[name] for outcome in self.outcomes)

    @property
    def all_at_rest(self) -> bool:
        """Whether it came to rest from all starts."""
        return len(self.values("plateau_seconds")) == len(self.outcomes)

    def median(self, name: str) -> float:
        """Return the median over the starts; NaN if none has the number."""
        values = self.values(name)
        return float(np.median(values)) if len(values) else math.nan


@dataclass(frozen=True)
class Comparison:
    """All configurations side by side.

    Attributes
    ----------
    rows : one a configuration of which anything came out
    """

    rows: Sequence[Row]

    def reference(self, ranks: int | None = None) -> Row | None:
        """Return the row that those of so many ranks are compared with; None if there is none.

        Without a number of ranks: that of the first row.
        """
        if ranks is None:
            ranks = self.rows[0].configuration.ranks if self.rows else 1
        wanted = reference_of((row.configuration for row in self.rows), ranks)
        return next((row for row in self.rows if row.configuration == wanted), None)

    def scatter(self, name: str) -> float:
        """Return the standard deviation of a number between the starts at the reference.

        NaN where there are fewer than two starts.
        """
        row = self.reference()
        values = np.empty(0) if row is None else row.values(name)
        return float(values.std(ddof=1)) if len(values) > 1 else math.nan

    def shifts(self, row: Row, name: str) -> FloatArray:
        """Return a number less the reference's, one a start that both have."""
        reference = self.reference(row.configuration.ranks)
        if reference is None:
            return np.empty(0)
        known = {one.run.start: one.numbers[name] for one in reference.outcomes}
        return _finite(
            one.numbers[name] - known.get(one.run.start, math.nan) for one in row.outcomes
        )


def compare(results: Sequence[tuple[Run, Result]]) -> Comparison:
    """Compare all runs of which there is a result with the reference's from the same start.

    The same start on another number of ranks is another one: its spheres have other numbers.
    """
    configurations = list(dict.fromkeys(run.configuration for run, _ in results))
    references = {
        (run.configuration.ranks, run.start): result
        for run, result in results
        if run.configuration == reference_of(configurations, run.configuration.ranks)
    }
    outcomes = [
        Outcome(run, _numbers(result, references.get((run.configuration.ranks, run.start))))
        for run, result in results
    ]
    grouped = {
        configuration: [one for one in outcomes if one.run.configuration == configuration]
        for configuration in configurations
    }
    rows = []
    for configuration, group in grouped.items():
        soft = next((other for other in grouped if _matches(configuration, other)), None)
        slower = np.empty(0) if soft is None else _ratios(grouped[soft], group)
        rows.append(Row(configuration, group, slower))
    return Comparison(rows)


def reference_of(configurations: Iterable[Configuration], ranks: int) -> Configuration | None:
    """Return the tightest hard one on so many ranks; None if there is none.

    Of several that with the shortest time step, and of several of those the first.
    """
    hard = [one for one in configurations if (one.contacts, one.ranks) == ("hard", ranks)]
    return min(hard, key=lambda one: (one.tolerance, one.dt), default=None)


def _matches(hard: Configuration, soft: Configuration) -> bool:
    return (
        (hard.contacts, soft.contacts) == ("hard", "soft")
        and math.isclose(hard.tolerance, soft.tolerance)
        and hard.ranks == soft.ranks
    )


def _ratios(above: Sequence[Outcome], below: Sequence[Outcome]) -> FloatArray:
    """Return the ratios of the times to rest, one a start that came to rest in both."""
    known = {one.run.start: one.numbers["plateau_seconds"] for one in below}
    return _finite(
        one.numbers["plateau_seconds"] / known.get(one.run.start, math.nan) for one in above
    )


def _finite(values: Iterable[float]) -> FloatArray:
    """Return those of some numbers that there are."""
    return np.array([value for value in values if math.isfinite(value)], dtype=np.float64)


def _numbers(result: Result, reference: Result | None) -> dict[str, float]:
    numbers = {name: result.number(name) for name in MEASURED}
    numbers |= dict.fromkeys(COMPARED, math.nan)
    # Of a packing that still moves the last moment is one of many, and has no error to speak of.
    if reference is None or reference is result or math.isnan(numbers["plateau_time"]):
        return numbers
    for name in ("packing_fraction", "coordination_number"):
        numbers[f"{name}_error"] = abs(numbers[name] - reference.number(name))
    networks = [
        one.values[name]
        for one in (result, reference)
        for name in ("network/ids", "network/forces")
    ]
    # A packing of which nothing touches has no network.
    if len(networks[0]) and len(networks[2]):
        apart = network_difference(*networks)
        numbers |= {"network_error": apart.forces, "shared": apart.shared}
    return numbers


def recommendations(comparison: Comparison) -> list[str]:
    """Say in words what the numbers say, or why they do not."""
    return [
        _enough(comparison, "Packing fraction", "packing_fraction", ".4f"),
        _enough(comparison, "Contacts per particle", "coordination_number", ".3f"),
        _speed(comparison),
    ]


def _enough(comparison: Comparison, title: str, name: str, form: str) -> str:
    """Say which is the loosest tolerance that is as good as the tightest, as far as one can see."""
    reference = comparison.reference()
    scatter = comparison.scatter(name)
    if reference is None:
        return f"{title}: no run with hard contacts has a result, so that there is no reference."
    hard = [row for row in comparison.rows if row.configuration.contacts == "hard"]
    if len(hard) == 1:
        return f"{title}: only one configuration of hard contacts has results to compare."
    if math.isnan(scatter):
        return (
            f"{title}: errors cannot be judged by one start, whose runs end in different packings; "
            "take several (--seeds)."
        )
    tightest = f"the tightest, {described(reference.configuration, comparison)}"
    if not reference.all_at_rest:
        return (
            f"{title}: {tightest}, has not come to rest from every start, so that nothing can be "
            "compared with it."
        )
    good = [
        (row, shifts)
        for row in hard
        if row is not comparison.reference(row.configuration.ranks)
        and len(shifts := comparison.shifts(row, name))
        and abs(shifts.mean()) < scatter
        and row.all_at_rest
    ]
    if not good:
        return (
            f"{title}: nothing but {tightest}, is good enough: the mean over the starts of every "
            f"other that comes to rest is off by more than the scatter between starts, "
            f"{scatter:{form}}."
        )
    row, shifts = min(
        good, key=lambda one: (-one[0].configuration.tolerance, one[0].median("plateau_seconds"))
    )
    return (
        f"{title}: a tolerance of {described(row.configuration, comparison)} is enough as far as "
        f"{len(shifts)} starts can tell, and {_duration(row)}. The mean is {shifts.mean():+{form}} "
        f"from that of {tightest}, which {_duration(reference)}; the scatter between starts is "
        f"{scatter:{form}}."
    )


def _duration(row: Row) -> str:
    return f"takes {row.median('plateau_seconds'):.2g} s"


def described(one: Configuration, comparison: Comparison) -> str:
    """Return a configuration's tolerance, and what else tells it from others of its contacts."""
    others = [
        row.configuration for row in comparison.rows if row.configuration.contacts == one.contacts
    ]
    words = [f"{one.tolerance:g} r"]
    parts: list[tuple[str, Callable[[Configuration], object]]] = [
        ("solver", lambda each: each.solver),
        ("dt", lambda each: each.dt),
        ("ranks", lambda each: each.ranks),
    ]
    words += [f"{name} {part(one)}" for name, part in parts if len(set(map(part, others))) > 1]
    return ", ".join(words)


def _speed(comparison: Comparison) -> str:
    """Say how much longer soft contacts take to come to rest than hard ones of their tolerance."""
    rows = [row for row in comparison.rows if len(row.slower)]
    if not rows:
        return (
            "Soft spheres: no tolerance was run to rest with both hard and soft contacts, so that "
            "their times cannot be compared."
        )
    ratios = "; ".join(
        f"{ratio_text(row.slower)} times as long at {described(row.configuration, comparison)}"
        for row in rows
    )
    return f"Soft spheres with the same largest overlap at rest take: {ratios}."


def ratio_text(ratios: FloatArray) -> str:
    """Return the median of some ratios, and from where to where they go."""
    if len(ratios) == 1:
        return f"{ratios[0]:.3g}"
    return f"{np.median(ratios):.3g} ({ratios.min():.3g} to {ratios.max():.3g})"
