"""The results in the files and the numbers of the paper: a report is made from these alone."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ..decks import Value, find_deck
from ..errors import WorkflowError
from ..results.store import Result, StoredStudy, read_studies
from ..shipped import DECKS
from ..shipped import STUDIES as OF_THE_PAPER
from .curves import FloatArray

# This deck pours free spheres: its particles are spheres.
SPHERES = "spheres"
# Decks of version 0.1 had no choice of a solver, and took this one.
SOLVER_BEFORE = "apgd"
# Each row of the paper's Table 1 is the mean of so many runs.
RUNS_OF_TABLE_1 = 9


@dataclass(frozen=True, eq=False)
class Data:
    """Studies by their names, and the numbers of the paper as its TOML file has them."""

    studies: Mapping[str, StoredStudy]
    paper: Mapping[str, Any]

    @property
    def usual_tolerance(self) -> float:
        """The overlap, over the radius, that the paper uses wherever it states no other."""
        return float(self.paper["protocol"]["default_eps_over_r"])

    @property
    def paper_solver(self) -> str:
        """The paper's solver, as our decks name it."""
        return str(self.paper["protocol"]["solver"])

    @cached_property
    def our_solver(self) -> str:
        """Our own solver: the default of today's decks, or else that of those that made results."""
        usual = str(deck_defaults(SPHERES)["solver"])
        known = {
            str(result.variables["solver"])
            for study in self.studies.values()
            for result in study.results
            if "solver" in result.variables
        }
        earlier = sorted(known - {usual, self.paper_solver})
        return earlier[0] if earlier and usual not in known else usual

    def results(self, *names: str) -> list[Result]:
        """Return the results of the first of these studies that has any."""
        for name in names:
            if name in self.studies and self.studies[name].results:
                return list(self.studies[name].results)
        return []


def paper_numbers() -> dict[str, Any]:
    """Return the numbers that the paper states."""
    text = (files("lammps_inelastic.workflow.report") / "paper_numbers.toml").read_text("utf-8")
    return tomllib.loads(text)


def read_data(paths: Iterable[Path]) -> Data:
    """Read files of studies; parts of one study that lie in several files are put together.

    Raises WorkflowError for a file that holds no studies, and for two different studies of one
    name.
    """
    studies: dict[str, StoredStudy] = {}
    for path in paths:
        for study in read_studies(path):
            known = studies.get(study.name)
            if known is None:
                studies[study.name] = study
                continue
            if known.text != study.text:
                raise WorkflowError(
                    f"{path}: another study of the name {study.name} is in a file before it"
                )
            # A case that is there twice was run twice: the first one counts.
            cases = {result.case: result for result in [*study.results, *known.results]}
            studies[study.name] = replace(known, results=list(cases.values()))
    for name, study in studies.items():
        studies[name] = replace(study, results=[_completed(result) for result in study.results])
    # The studies of the paper come first, in its order: a file has them by the alphabet.
    order = [name for name in OF_THE_PAPER if name in studies]
    order += [name for name in studies if name not in OF_THE_PAPER]
    return Data({name: studies[name] for name in order}, paper_numbers())


def _completed(result: Result) -> Result:
    """Return a result that has all variables of today's decks, so that it groups with newer ones.

    A deck had no such choice before it had the variable: it did what the default does, but for the
    solver, of which the default was another one, the phase of rest, which version 0.1 had not, and
    the longer step of the last phase, which came later.
    """
    stages = []
    for stage in result.record["stages"]:
        known = stage["variables"]
        defaults = dict(deck_defaults(stage["deck"]))
        if "solver" in defaults:
            defaults["solver"] = SOLVER_BEFORE
        if "dt_resting" in defaults:
            dt = known.get("dt", defaults["dt"])
            if "steps_resting" not in known:
                defaults |= {"steps_resting": 0, "dt_resting": dt}
            defaults["dt_measuring"] = known.get("dt_resting", dt)
        stages.append({**stage, "variables": {**defaults, **known}})
    return replace(result, record={**result.record, "stages": stages})


@cache
def deck_defaults(deck: str) -> Mapping[str, Value]:
    """Return the variables of one of our decks with their defaults; of another deck, none."""
    return find_deck(deck, Path()).parameters if deck in DECKS else {}


def profile(result: Result) -> tuple[FloatArray, FloatArray] | None:
    """Return a wall profile: distance over the diameter (s,), packing fraction (s,), or None.

    The packing fraction is that of exact volumes where it was measured, else of random points.
    None stands for a result without a profile, or whose diameter is not known.
    """
    distance = result.values.get("profile/distance")
    values = result.values.get("profile/packing_fraction", result.values.get("profile/monte_carlo"))
    # Older results do not note the diameter: theirs is that of the deck, if it has one.
    diameter = float(result.values.get("profile/diameter", result.setting("diameter")))
    if distance is None or values is None or math.isnan(diameter):
        return None
    return distance / diameter, values


def profiles(results: Iterable[Result]) -> list[tuple[FloatArray, FloatArray]]:
    """Return the wall profiles of those results that have one."""
    return [found for result in results if (found := profile(result)) is not None]


def series(result: Result, name: str) -> FloatArray | None:
    """Return an array of a result; None if it was not measured or is empty."""
    values = result.values.get(name)
    return None if values is None or len(values) == 0 else np.asarray(values, dtype=np.float64)


def arrays_of(results: Iterable[Result], name: str) -> list[FloatArray]:
    """Return an array of those results that have it."""
    return [
        np.asarray(result.values[name], dtype=np.float64)
        for result in results
        if name in result.values
    ]


def curves_of(results: Iterable[Result], x: str, y: str) -> list[tuple[FloatArray, FloatArray]]:
    """Return two arrays, (k,) both, of those results that have the first."""
    known = [result for result in results if x in result.values]
    return list(zip(arrays_of(known, x), arrays_of(known, y), strict=True))
