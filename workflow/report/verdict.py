"""The verdict at the top of a report: in words which of the paper's findings agree with ours."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .blocks import Comparison, Section, Statement
from .statistics import SIGNIFICANT, adjusted
from .text import as_short, as_span, as_text, decimals_needed

# What the paper's numbers and sentences are about, in the order in which the verdict names it.
PACKING_FRACTION = "packing fraction"
CONTACTS = "contacts"
COMING_TO_REST = "coming to rest"
WALL_PROFILE = "wall profile"
ORIENTATION = "orientation of dimers"
PACKING_FRACTION_OF_DIMERS = "packing fraction of dimers"
CONTACTS_OF_DIMERS = "contacts of dimers"
TOPICS = (
    PACKING_FRACTION,
    CONTACTS,
    COMING_TO_REST,
    WALL_PROFILE,
    ORIENTATION,
    PACKING_FRACTION_OF_DIMERS,
    CONTACTS_OF_DIMERS,
)
# A percentage has another percentage's difference in points.
POINTS = {"%": "percentage points"}


@dataclass(frozen=True)
class Verdict:
    """The answer in words.

    Attributes
    ----------
    text : one or two sentences
    exceptions : what does not agree, one line each
    """

    text: str
    exceptions: Sequence[str]


@dataclass
class _Topic:
    """What is known of one topic.

    Attributes
    ----------
    agreeing, differing : numbers of the paper
    held, broken : its sentences
    """

    name: str
    agreeing: list[Comparison]
    differing: list[Comparison]
    held: list[Statement]
    broken: list[Statement]

    @property
    def is_known(self) -> bool:
        """Whether anything was run that can tell."""
        return bool(self.agreeing or self.differing or self.held or self.broken)

    @property
    def agrees(self) -> bool:
        """Whether at least half of what is known does."""
        return len(self.agreeing + self.differing) + len(self.held + self.broken) <= 2 * (
            len(self.agreeing) + len(self.held)
        )

    @property
    def words(self) -> str:
        """The name, and within what the numbers agree."""
        reach: dict[str, float] = {}
        for one in self.agreeing:
            unit = POINTS.get(one.unit, one.unit)
            reach[unit] = max(reach.get(unit, 0.0), abs(one.ours.mean - one.stated.value))
        parts = [f"{_two_digits(most)} {unit}".strip() for unit, most in reach.items()]
        return f"{self.name} (within {' and '.join(parts)})" if parts else self.name

    @property
    def exceptions(self) -> list[str]:
        """What does not agree, one line each."""
        alike: dict[tuple[str, float], list[Comparison]] = {}
        for one in self.differing:
            alike.setdefault((one.place or one.what, one.stated.value), []).append(one)
        found = [_difference(place, of_place) for (place, _), of_place in alike.items()]
        found += [one.otherwise or f"not so: {one.text} ({one.evidence})" for one in self.broken]
        return [f"{self.name}: {text}" for text in found]


def verdict(sections: Sequence[Section]) -> Verdict:
    """Return the answer, from the comparisons and statements of the sections."""
    topics = [one for one in _topics(sections).values() if one.is_known]
    exceptions = [line for one in topics for line in one.exceptions]
    agree = [one.words for one in topics if one.agrees]
    apart = [one.name for one in topics if not one.agrees]
    if not topics:
        return Verdict("Not known yet: too little was run to tell.", [])
    if not agree:
        return Verdict(f"No: ours differs from the paper in {_listed(apart)}.", exceptions)
    answer = "In part" if apart else "Yes, with exceptions" if exceptions else "Yes"
    verb = "agrees" if len(agree) == 1 else "agree"
    text = f"{answer}: {_listed(agree)} {verb} with the paper."
    if apart:
        text += f" Ours differs in {_listed(apart)}."
    return Verdict(text, exceptions)


def differs(comparison: Comparison, corrected: float) -> bool:
    """Say whether a number differs from the paper's, with its probability after correction."""
    return comparison.difference.is_significant and corrected < SIGNIFICANT


def _topics(sections: Sequence[Section]) -> Mapping[str, _Topic]:
    pairs = [(section, one) for section in sections for one in section.comparisons]
    corrected = adjusted([one.difference.p for _, one in pairs])
    topics = {name: _Topic(name, [], [], [], []) for name in TOPICS}
    tested = [(*pair, p) for pair, p in zip(pairs, corrected, strict=True) if not math.isnan(p)]
    sure = {(one.topic, one.place) for _, one, p in tested if one.place and differs(one, p)}
    for section, one, p in tested:
        # What may differ by chance does not where others of its place do for sure.
        like_others = one.difference.is_significant and (one.topic, one.place) in sure
        of = topics[one.topic or section.topic]
        (of.differing if differs(one, p) or like_others else of.agreeing).append(one)
    for section in sections:
        for statement in section.statements:
            of = topics[statement.topic or section.topic]
            if statement.holds is not None:
                (of.held if statement.holds else of.broken).append(statement)
    return topics


def _difference(place: str, alike: Sequence[Comparison]) -> str:
    """Write by how much numbers differ from the same one of the paper."""
    apart = [one.ours.mean - one.stated.value for one in alike]
    decimals = decimals_needed(max(map(abs, apart)), 2)
    higher = [value for value in apart if value > 0]
    lower = [-value for value in apart if value < 0]
    parts = [
        f"{as_span(values, decimals)} {word}"
        for values, word in ((higher, "above"), (lower, "below"))
        if values
    ]
    stated = f"{as_short(alike[0].stated.value)} {alike[0].unit}".strip()
    # The first reason is enough here: the table below has all.
    reason = next((one.why.partition(";")[0] for one in alike if one.why), "")
    return f"at {place}, {' and '.join(parts)} the paper's {stated}" + (reason and f"; {reason}")


def _two_digits(value: float) -> str:
    return as_text(value, decimals_needed(value, 2))


def _listed(names: Iterable[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last
