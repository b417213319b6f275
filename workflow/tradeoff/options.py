"""The options of `inelastic tradeoff`, checked and turned into a plan."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..decks import Rule, Value, as_value, find_deck, read_rule
from ..errors import StudyError
from ..files import is_file
from ..running.processes import cores
from ..shipped import SETTLING
from ..study import MOST_CASES, is_word
from .plan import NONE, Plan


def read_plan(options: argparse.Namespace) -> Plan:
    """Return the plan that the options ask for.

    Raises StudyError with one line for every mistake.
    """
    settling = find_deck(SETTLING, Path()).rules
    dimers = find_deck("dimers", Path()).rules
    check = _Check()
    particle = check.value("--particle", options.particle, settling["particle"])
    values: dict[str, Value] = {
        "diameter": check.value("--diameter", options.diameter, settling["diameter"]),
        "time_settling": check.value("--time", options.time, settling["time_settling"]),
    }
    if options.aspect_ratio is not None:
        ratio = check.value("--aspect-ratio", options.aspect_ratio, dimers["aspect_ratio"])
        values["aspect_ratio"] = ratio
        if particle != "dimers":
            check.mistakes.append("--aspect-ratio: only dimers have one (--particle dimers)")
    particles = check.value("--particles", options.particles, dimers["particles"])
    count = check.value("--seeds", options.seeds, read_rule(f"integer >= 1 <= {MOST_CASES}"))
    files: list[Path] = options.start or []
    check.mistakes += _mistakes_of_starts(files, dimers)
    tolerance, soft = settling["tolerance"], options.soft_tolerances
    tolerances = check.values("--tolerances", options.tolerances, tolerance)
    soft_tolerances = [] if soft == NONE else check.values("--soft-tolerances", soft, tolerance)
    dts = check.values("--dts", options.dts, settling["dt"])
    accuracies = check.values("--accuracies", options.accuracies, settling["accuracy"])
    solvers = check.values("--solvers", options.solvers, settling["solver"])
    most = read_rule(f"integer >= 1 <= {cores()}")
    ranks = check.values("--ranks", options.ranks, most, why=", the cores there are")
    if check.mistakes:
        raise StudyError(check.mistakes)
    seeds: list[int] = []
    if not files:
        # A data file has a number of particles of its own.
        values["particles"] = particles
        seeds = list(range(1, count + 1))
    return Plan(
        particle,
        values,
        files or seeds,
        tolerances,
        soft_tolerances,
        dts,
        accuracies,
        solvers,
        ranks,
        options.step_errors,
    )


class _Check:
    """A check of options against rules that collects the mistakes, one line each."""

    def __init__(self) -> None:
        """Begin without mistakes."""
        self.mistakes: list[str] = []

    def values(self, name: str, text: str, rule: Rule, *, why: str = "") -> list[Any]:
        """Return the values in a list with commas, each once.

        Parameters
        ----------
        name : name of the option
        text : value of the option
        rule : rule for each value
        why : reason of the rule, for errors
        """
        return self._allowed(name, text.split(","), rule, why)

    def value(self, name: str, text: str, rule: Rule) -> Any:
        """Return the value of an option that has one."""
        (value,) = self._allowed(name, [text], rule, "")
        return value

    def _allowed(self, name: str, words: Sequence[str], rule: Rule, why: str) -> list[Any]:
        values = [as_value(word.strip()) for word in words]
        self.mistakes.extend(
            f"{name}: {value} is not allowed: it must be {rule.allowed}{why}"
            for value in values
            if not rule.accepts(value)
        )
        return list(dict.fromkeys(values))


def _mistakes_of_starts(files: Sequence[Path], rules: Mapping[str, Rule]) -> list[str]:
    """Return the mistakes in the names of data files, one line each."""
    mistakes = []
    for path in files:
        if not is_word(path.name):
            mistakes.append(
                f"--start: {path}: a file's name must be one word, without spaces, quotes, $ and &"
            )
        elif not is_file(path):
            mistakes.append(f"--start: {path}: no such file")
    if len({path.name for path in files}) < len(files):
        mistakes.append("--start: two files have the same name, which tells starts apart")
    words = rules["start"].words
    mistakes += [
        f"--start: {path}: {path.name} is no name for a file"
        for path in files
        if path.name in words
    ]
    return mistakes
