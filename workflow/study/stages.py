"""Our own decks one after another: which packing each takes and leaves, where, and for how long.

Decks find each other's packings by their files only. A deck that is given a packing of another kind
may not notice: bodies, for example, would move on as free spheres. So a study is checked for it
before anything runs. Nothing is known of a user's own deck, and nothing is refused.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..decks import OUT, PACKING, Deck
from ..shipped import RESPONSE, SETTLING
from .case import Stage, takes_out
from .file_format import Bounds

# These decks leave the container as they found it, so that another one may go on in it.
KEEPS_CONTAINER = ("spheres", "dimers", "clusters", "gluey", SETTLING)
# These variables describe the packing and not what is done to it.
SHARED = ("diameter", "inertia")

CONTAINER: Bounds = (0, 1, 0, 5, 0, 1)
# `response` takes the side walls away and leaves a tray.
TRAY: Bounds = (-2, 3, 0, 5, -2, 3)


def misfit(stages: Sequence[Stage]) -> tuple[str, str] | None:
    """Return what does not fit together in the decks of a case; None if everything does.

    It is the name of the variable that is to blame, or `deck`, and one line in words.
    """
    kind: str | None = None
    for number, stage in enumerate(stages):
        name = stage.deck.name
        before = stages[number - 1] if number else None
        if not stage.deck.shipped:
            kind = None
            if stage is not stages[-1] and not (_uses_out(stage.deck) and takes_out(stage.deck)):
                return "deck", (
                    f"the next deck could not find what {name} leaves: {name} must write to the "
                    "folder in its variable out (variable out index FOLDER)"
                )
            continue
        if PACKING not in stage.deck.variables:
            if before is not None:
                return "deck", (
                    f"{name} makes a packing of its own, and would not use that of "
                    f"{before.deck.name}: it can only be the first deck"
                )
            kind = name
            continue
        takes = _packings_for(stage.deck)
        if before is None:
            return "deck", (
                f"{name} starts from a packing, which a deck before it must make: "
                f'{" or ".join(takes)}, as in deck = ["{takes[0]}", "{name}"]'
            )
        if wrong := _wrong_before(stage, before, kind):
            return wrong
        for variable in SHARED:
            if variable not in stage.variables or variable not in before.variables:
                continue
            own, other = stage.variables[variable], before.variables[variable]
            if own != other:
                return variable, (
                    f"{own} in {name} and {other} in {before.deck.name}: decks that share a "
                    "packing need the same value; give it in [parameters]"
                )
    return None


def _wrong_before(stage: Stage, before: Stage, kind: str | None) -> tuple[str, str] | None:
    """Return why one of our decks cannot start from what the one before it leaves, if it cannot."""
    name = stage.deck.name
    if kind is None:
        return None
    if before.deck.name not in KEEPS_CONTAINER:
        return "deck", f"{name} cannot follow {before.deck.name}, which changes the container"
    takes = _packings_for(stage.deck)
    if kind not in takes:
        return "deck", (
            f"{name} cannot follow {before.deck.name}, which leaves {kind}: it takes "
            f"{' or '.join(takes)} only"
        )
    particle = stage.variables.get("particle", kind)
    if particle != kind:
        return "particle", (
            f"{name} has particle = {particle}, but {before.deck.name} leaves {kind}: set "
            f"particle = {kind}"
        )
    if before.variables.get("contacts") == "soft":
        return "contacts", (
            f"{name} cannot follow {before.deck.name} with contacts = soft, which leaves overlaps"
        )
    return None


def _packings_for(deck: Deck) -> tuple[str, ...]:
    """Return the decks from whose packings one of our decks may start."""
    # A deck that may start from several has a parameter that says from which.
    rule = deck.rules.get("particle")
    return ("spheres",) if rule is None else rule.words


def _uses_out(deck: Deck) -> bool:
    """Say whether a deck writes to the folder in its variable out."""
    return OUT in deck.variables or "${out}" in deck.text


def container_of(stage: Stage) -> Bounds | None:
    """Return the container at the end of a stage [length]; None if its deck is not ours."""
    if not stage.deck.shipped:
        return None
    walls_go = stage.deck.name == RESPONSE and stage.variables["change"] == "walls"
    return TRAY if walls_go else CONTAINER


def last_step_of(stage: Stage) -> int | None:
    """Return the step at which a stage ends; None where its deck does not say."""
    if not stage.deck.shipped or stage.deck.name == SETTLING:
        return None
    return steps_of(stage)


def steps_of(stage: Stage) -> int:
    """Return the steps that a stage will take in all; 0 where its deck does not say."""
    steps = [v for name, v in stage.variables.items() if name.startswith("steps_")]
    return sum(step for step in steps if isinstance(step, int))
