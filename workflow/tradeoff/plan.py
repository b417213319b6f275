"""The plan of a comparison of time and accuracy: its configurations, and the runs that show them.

Every configuration (hard or soft contacts, a tolerance, and for hard ones a solver, a time step and
an accuracy) lets the same starts settle.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Literal

from ..decks import Value, find_deck
from ..shipped import SETTLING
from ..study import INPUTS, Case, Input, stage_of

# The deck that makes a start does nothing else: its phases have no steps.
NO_STEPS: Mapping[str, Value] = {
    "steps_agitated": 0,
    "steps_settling": 0,
    "steps_resting": 0,
    "steps_tightening": 0,
    "steps_measuring": 0,
}
# This word in the place of a list leaves soft contacts out.
NONE = "none"


@dataclass(frozen=True)
class Configuration:
    """One way to let a start settle.

    Attributes
    ----------
    contacts : hard or soft
    tolerance : largest overlap, radii; soft contacts keep it at rest only, and about
    solver : solver of hard contacts; None for soft ones
    dt : longest time step of hard contacts, time; None for soft ones
    accuracy : part of an approach that hard contacts may leave; None for soft ones
    ranks : number of MPI ranks
    """

    contacts: Literal["hard", "soft"]
    tolerance: float
    solver: str | None
    dt: float | None
    accuracy: float | None
    ranks: int

    @property
    def choices(self) -> Mapping[str, object]:
        """What tells the configuration from others of its contacts and tolerance, by name."""
        return {
            "solver": self.solver,
            "dt": self.dt,
            "accuracy": self.accuracy,
            "ranks": self.ranks,
        }


@dataclass(frozen=True)
class Plan:
    """A plan of what is to be run.

    Attributes
    ----------
    particle : spheres or dimers
    values : variables of the decks that all runs share
    starts : seeds of random starts, or data files
    tolerances : tolerances of hard contacts, radii
    soft_tolerances : tolerances of soft contacts, radii; an empty list leaves them out
    dts : time steps of hard contacts, time
    accuracies : accuracies of hard contacts, parts of an approach
    solvers : solvers of hard contacts
    ranks : numbers of MPI ranks; everything is run with each of them
    step_errors : whether errors of velocities and forces of hard contacts are measured, too
    """

    particle: str
    values: Mapping[str, Value]
    starts: Sequence[int | Path]
    tolerances: Sequence[float]
    soft_tolerances: Sequence[float]
    dts: Sequence[float]
    accuracies: Sequence[float]
    solvers: Sequence[str]
    ranks: Sequence[int]
    step_errors: bool = False

    @property
    def configurations(self) -> list[Configuration]:
        """The configurations, hard ones first, from the loosest tolerance to the tightest."""
        tolerances = sorted(self.tolerances, reverse=True)
        hard = [
            Configuration("hard", tolerance, solver, dt, accuracy, ranks)
            for ranks, solver, dt, accuracy, tolerance in product(
                self.ranks,
                self.solvers,
                self.dts,
                sorted(self.accuracies, reverse=True),
                tolerances,
            )
        ]
        soft = [
            Configuration("soft", tolerance, None, None, None, ranks)
            for ranks, tolerance in product(self.ranks, sorted(self.soft_tolerances, reverse=True))
        ]
        return hard + soft


@dataclass(frozen=True)
class Run:
    """A run of one configuration from one start.

    Attributes
    ----------
    configuration : how the start settles
    start : seed or name of the data file
    case : case that is run
    """

    configuration: Configuration
    start: str
    case: Case


def runs_of(plan: Plan) -> list[Run]:
    """Return all runs, start by start: what slows a machine for a while slows all configurations.

    All runs from a start are given the very same one: the tolerance, the time step, the accuracy
    and the solver are the settling's, and the deck that makes the start keeps its defaults.
    """
    folder = Path()
    first, second = find_deck(plan.particle, folder), find_deck(SETTLING, folder)
    inputs = {start: input_of(start) for start in plan.starts}
    runs = []
    for start, configuration in product(plan.starts, plan.configurations):
        own, settling = start_values(plan, start), settling_values(plan, configuration)
        case = Case((stage_of(first, own), stage_of(second, settling)), inputs[start])
        runs.append(Run(configuration, label_of(start), case))
    return runs


def settling_values(plan: Plan, configuration: Configuration) -> dict[str, Value]:
    """Return the variables of the deck that lets a start settle."""
    chosen: dict[str, Value | None] = {
        "solver": configuration.solver,
        "dt": configuration.dt,
        "accuracy": configuration.accuracy,
    }
    return {
        **plan.values,
        "particle": plan.particle,
        "contacts": configuration.contacts,
        "tolerance": configuration.tolerance,
        **{name: value for name, value in chosen.items() if value is not None},
    }


def start_values(plan: Plan, start: int | Path) -> dict[str, Value]:
    """Return the variables of the deck that makes a start."""
    own: dict[str, Value] = {**NO_STEPS, **plan.values}
    return own | (
        {"start": f"{INPUTS}/{start.name}"} if isinstance(start, Path) else {"seed": start}
    )


def input_of(start: int | Path) -> dict[str, Input]:
    """Return the data file of a start by its name; nothing for a seed."""
    return {start.name: Input.of(start)} if isinstance(start, Path) else {}


def label_of(start: int | Path) -> str:
    """Return the seed of a start, or the name of its data file."""
    return start.name if isinstance(start, Path) else str(start)


def command_line(plan: Plan) -> str:
    """Return the command that asks for a plan."""

    def joined(values: Sequence[object]) -> str:
        return ",".join(f"{value}" for value in values)

    values = dict(plan.values)
    words = ["inelastic", "tradeoff", "--particle", plan.particle]
    words += ["--time", f"{values.pop('time_settling')}"]
    for name, value in values.items():
        words += [f"--{name.replace('_', '-')}", f"{value}"]
    files = [str(start) for start in plan.starts if isinstance(start, Path)]
    words += ["--start", *files] if files else ["--seeds", str(len(plan.starts))]
    words += ["--tolerances", joined(plan.tolerances)]
    words += ["--soft-tolerances", joined(plan.soft_tolerances) or NONE]
    words += ["--dts", joined(plan.dts), "--accuracies", joined(plan.accuracies)]
    words += ["--solvers", joined(plan.solvers), "--ranks", joined(plan.ranks)]
    words += ["--step-errors"] if plan.step_errors else []
    return shlex.join(words)
