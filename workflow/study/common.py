"""The table `[common]` of a study file: values that all cases have, and that no name shows.

[common]
dt = 0.01                # of each deck that has the variable

[common.dimers]
dt_resting = 0.03        # of this deck alone, before what stands above
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..decks import Deck, Value
from ..errors import meant
from .values import unknown_variable, values_of

TABLE = "common"


@dataclass(frozen=True)
class Common:
    """The values that all cases of a study have in common.

    Attributes
    ----------
    table : the table, as the study file has it: one value a variable, and a table a deck
    """

    table: Mapping[str, Any]

    def of(self, deck: Deck) -> dict[str, Value]:
        """Return the values that a deck takes, by the names of its variables."""
        return {name: value for name, (_, value) in self._taken(deck).items()}

    def keys(self, decks: Sequence[Deck]) -> dict[str, str]:
        """Return the key under which a value stands, by the name of the variable."""
        return {name: key for deck in decks for name, (key, _) in self._taken(deck).items()}

    def check(self, decks: Sequence[Deck], folder: Path, mistakes: list[str]) -> None:
        """See that each value is one that the decks allow.

        Parameters
        ----------
        decks : all decks of the study
        folder : folder of the study file
        mistakes : list to which one line for each mistake is added
        """
        for deck in decks:
            for name, (key, value) in self._taken(deck).items():
                if isinstance(value, bool) or not isinstance(value, int | float | str):
                    mistakes.append(
                        f"{key}: {value!r} is not allowed: it must be one number or word, which "
                        "all cases have; lists and ranges belong in [parameters] or in rows"
                    )
                else:
                    values_of(key, name, value, [deck], folder, mistakes)

    def unknown(self, decks: Sequence[Deck]) -> Iterator[str]:
        """Return one line for each key that is of none of a study's decks.

        Parameters
        ----------
        decks : all decks of the study
        """
        by_name = {deck.name: deck for deck in decks}
        known = {name for deck in decks for name in deck.parameters}
        for name, value in self.table.items():
            key = f"{TABLE}.{name}"
            if not isinstance(value, dict):
                if name not in known:
                    yield unknown_variable(key, decks)
            elif name in by_name:
                deck = by_name[name]
                strange = [inner for inner in value if inner not in deck.parameters]
                yield from (unknown_variable(f"{key}.{inner}", [deck]) for inner in strange)
            elif name not in known:
                near = meant(name, by_name)
                names = ", ".join(by_name)
                yield f"{key}: no deck or variable of that name{near}; decks are {names}"

    def _taken(self, deck: Deck) -> dict[str, tuple[str, Any]]:
        """Return the key and the value of each variable that a deck takes, by its name."""
        own = self.table.get(deck.name)
        own = own if isinstance(own, dict) else {}
        taken: dict[str, tuple[str, Any]] = {}
        for name in deck.parameters:
            if name in own:
                taken[name] = f"{TABLE}.{deck.name}.{name}", own[name]
            # A variable may have the name of its deck, whose table is none of its values.
            elif name in self.table and not (name == deck.name and own):
                taken[name] = f"{TABLE}.{name}", self.table[name]
        return taken
