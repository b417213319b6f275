"""Which results belong together: repeats of a case, cases of a table's row, runs of one size."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any

from ..results.store import Result
from .data import SPHERES, deck_defaults
from .text import DASH, as_count, as_runs, as_value

# The packing depends on these parameters by chance alone: cases that differ in nothing else are
# repeats.
REPEATS = frozenset({"seed", "dump_every"})


def grouped(
    results: Iterable[Result], key: Callable[[Result], Hashable]
) -> dict[Any, list[Result]]:
    """Return the results by a key, in the order in which the keys first appear."""
    groups: dict[Any, list[Result]] = {}
    for result in results:
        groups.setdefault(key(result), []).append(result)
    return groups


def by_variables(names: Sequence[str]) -> Callable[[Result], tuple[Any, ...]]:
    """Return a key: a result's deck and its values of some variables."""
    return lambda result: (result.record["deck"], *map(result.variables.get, names))


def by_value(name: str) -> Callable[[Result], float]:
    """Return a key: a result's value of a variable that is a number."""
    return lambda result: result.setting(name)


def varying(results: Sequence[Result]) -> list[str]:
    """Return the parameters, other than repeats, that are not the same in all results."""
    names = dict.fromkeys(name for result in results for name in result.variables)
    return [
        name
        for name in names
        if name not in REPEATS and len({result.variables.get(name) for result in results}) > 1
    ]


def labelled(results: Sequence[Result]) -> list[tuple[str, list[Result]]]:
    """Return the results of the same parameters together, each group with what is not alike in all.

    The label names the deck, where there are several, and what varies among the runs of that deck.
    """
    decks = grouped(results, lambda result: str(result.record["deck"]))
    groups: list[tuple[str, list[Result]]] = []
    for deck, runs in decks.items():
        names = varying(runs)
        for (_, *values), group in grouped(runs, by_variables(names)).items():
            words = [f"{n} = {as_value(v)}" for n, v in zip(names, values, strict=True)]
            if len(decks) > 1 or not words:
                words.insert(0, deck)
            groups.append((", ".join(words), group))
    return groups


def matching(results: Iterable[Result], **wanted: float | str) -> list[Result]:
    """Return the results whose variables have these values, numbers up to round-off."""
    return [
        result
        for result in results
        if all(_equal(result.variables.get(name), value) for name, value in wanted.items())
    ]


def _equal(value: object, wanted: float | str) -> bool:
    if isinstance(value, int | float) and isinstance(wanted, int | float):
        return math.isclose(value, wanted, rel_tol=1e-9)
    return value == wanted


def box_is_in_bed(results: Iterable[Result]) -> bool:
    """Say whether no run's measuring box is known to reach out of the bed.

    Results of before this was measured do not tell.
    """
    return not any(result.number("box_in_bed") < 1 for result in results)


def is_agitated(result: Result) -> bool:
    """Say whether a random force acted in a run."""
    return result.setting("random_force") > 0


def by_size(results: Iterable[Result]) -> dict[tuple[float, float], list[Result]]:
    """Return results by number of particles and diameter, from few particles to many."""
    groups = grouped(
        results,
        lambda result: (
            result.setting("particles", result.number("particles")),
            result.setting("diameter", 1.0),
        ),
    )
    return dict(sorted(groups.items()))


def nearest_size(results: Sequence[Result], wanted: int, tolerance: float) -> list[Result]:
    """Return the results of so many particles; of the most if there are none of so many.

    Results of another tolerance are left out if there are any of this one.
    """
    groups = by_size(matching(results, tolerance=tolerance) or results)
    if not groups:
        return []
    for (particles, _), group in groups.items():
        if particles == wanted:
            return group
    return list(groups.values())[-1]


def count_of(results: Sequence[Result]) -> int:
    """Return the number of particles that the results were asked to have."""
    return int(results[0].setting("particles", results[0].number("particles")))


def solver_of(result: Result) -> str:
    """Return the solver of a run; a deck that does not say it uses the default of ours."""
    return str(result.variables.get("solver", deck_defaults(SPHERES)["solver"]))


def seed_label(result: Result) -> str:
    """Return a name for one of several repeats."""
    return f"seed {result.variables.get('seed', DASH)}"


def unlike(results: Sequence[Result], particles: int, runs: int = 0) -> str:
    """Say what of number of particles and number of runs is not as in the paper; empty if all is.

    Parameters
    ----------
    results : the runs of one group
    particles : the paper's number of particles
    runs : the paper's number of runs; 0 if this is not compared
    """
    parts = []
    if results and count_of(results) != particles:
        parts.append(f"{as_count(count_of(results))} particles, not {as_count(particles)}")
    if results and runs and len(results) != runs:
        parts.append(f"{as_runs(len(results))}, not {runs}")
    return "; ".join(parts)
