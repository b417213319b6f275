"""What a report is made from: the results in the files, and the numbers of the paper."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ..decks import Value, find_deck
from ..errors import WorkflowError
from ..shipped import DECKS
from ..shipped import STUDIES as OF_THE_PAPER
from ..store import Result, StoredStudy, read_studies
from .statistics import FloatArray, grouped, matching

# Decks in whose results a particle is a sphere.
SPHERES = "spheres"
# The decks' words for the solvers: our own, and the paper's.
OUR_SOLVER, PAPER_SOLVER = "apgd", "uzawa"
# Of the paper where it states no other, radii.
USUAL_TOLERANCE = 0.0005


@dataclass(frozen=True, eq=False)
class Data:
    """Studies by their names, and the numbers of the paper as its TOML file has them."""

    studies: Mapping[str, StoredStudy]
    paper: Mapping[str, Any]

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

    Raises WorkflowError for a file that is none, and where two different studies have one name.
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
    # Those of the paper first, in its order: a file has them in that of the alphabet.
    order = [name for name in OF_THE_PAPER if name in studies]
    order += [name for name in studies if name not in OF_THE_PAPER]
    return Data({name: studies[name] for name in order}, paper_numbers())


def _completed(result: Result) -> Result:
    """Return a result that has all variables of today's decks, so that it groups with newer ones.

    A deck had no such choice before it had the variable: it did what the default does.
    """
    stages = [
        {**stage, "variables": {**deck_defaults(stage["deck"]), **stage["variables"]}}
        for stage in result.record["stages"]
    ]
    return replace(result, record={**result.record, "stages": stages})


@cache
def deck_defaults(deck: str) -> Mapping[str, Value]:
    """Return the variables of one of our decks with their defaults; of another deck, none."""
    return find_deck(deck, Path()).parameters if deck in DECKS else {}


def profile(result: Result) -> tuple[FloatArray, FloatArray] | None:
    """Return a wall profile: distance over the diameter, packing fraction; None if there is none.

    From exact volumes where there are such, else from random points.
    """
    distance = result.values.get("profile/distance")
    values = result.values.get("profile/packing_fraction", result.values.get("profile/monte_carlo"))
    if distance is None or values is None:
        return None
    return distance / float(result.variables.get("diameter", 1.0)), values


def profiles(results: Iterable[Result]) -> list[tuple[FloatArray, FloatArray]]:
    """Return the wall profiles that there are."""
    return [found for result in results if (found := profile(result)) is not None]


def series(result: Result, name: str) -> FloatArray | None:
    """Return an array of a result; None if it was not measured or is empty."""
    values = result.values.get(name)
    return None if values is None or len(values) == 0 else np.asarray(values, dtype=np.float64)


def by_size(results: Iterable[Result]) -> dict[tuple[float, float], list[Result]]:
    """Return results by number of particles and diameter, from few particles to many."""
    groups = grouped(
        results,
        lambda result: (
            float(result.variables.get("particles", result.number("particles"))),
            float(result.variables.get("diameter", 1.0)),
        ),
    )
    return dict(sorted(groups.items()))


def nearest_size(results: Sequence[Result], wanted: int) -> list[Result]:
    """Return the results of so many particles; of the most if there are none of so many.

    Those of the paper's usual tolerance only, where there are such.
    """
    groups = by_size(matching(results, tolerance=USUAL_TOLERANCE) or results)
    if not groups:
        return []
    for (particles, _), group in groups.items():
        if particles == wanted:
            return group
    return list(groups.values())[-1]


def count_of(results: Sequence[Result]) -> int:
    """Return the number of particles that the results were asked to have."""
    return int(results[0].variables.get("particles", results[0].number("particles")))


def solver_of(result: Result) -> str:
    """Return the solver of a run; a deck that does not say it uses our own."""
    return str(result.variables.get("solver", OUR_SOLVER))


def unlike(results: Sequence[Result], particles: int, runs: int = 0) -> str:
    """Say what of number of particles and number of runs is not as in the paper; empty if all is.

    Parameters
    ----------
    results : of one group
    particles : in the paper
    runs : in the paper; 0 if this is not compared
    """
    parts = []
    if results and count_of(results) != particles:
        parts.append(f"{count_of(results):,} particles, not {particles:,}")
    if results and runs and len(results) != runs:
        parts.append(f"{len(results)} run{'s' if len(results) > 1 else ''}, not {runs}")
    return "; ".join(parts)
