"""Results of an earlier fix, or of earlier decks, whose runs are those of today's to the last bit.

The folder of the results says in a file that they are; a validation test compares dumps of both.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeGuard

from ..errors import WorkflowError

FILE = "same_runs.toml"


@dataclass(frozen=True)
class SameRuns:
    """What other code has the runs of today's.

    Attributes
    ----------
    made_by : hash of the sources of the fix that made the results; empty: of none that is known
    fixes : hashes of the sources of fixes with the runs of that one
    decks : fingerprints of decks, by their names, with which the results were made, and whose runs
        are, as the results' studies set the variables, those of today's decks
    """

    made_by: str = ""
    fixes: tuple[str, ...] = ()
    decks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def has_fix(self, sources: str | None, todays: str) -> bool:
        """Say whether a fix, by the hash of its sources, has the runs of today's."""
        return sources == todays or {sources, todays} <= {self.made_by, *self.fixes}

    def has_deck(self, name: str, fingerprint: str, todays: str) -> bool:
        """Say whether a deck, by its fingerprint, has the runs of today's of this name."""
        return fingerprint == todays or fingerprint in self.decks.get(name, ())


def same_runs(results: Path) -> SameRuns:
    """Read the file `same_runs.toml` of a folder of results; without it nothing else is as good.

    Raises WorkflowError with one line if the file is not as it must be.
    """
    file = results / FILE
    if not file.is_file():
        return SameRuns()
    try:
        content = tomllib.loads(file.read_text())
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise WorkflowError(f"{file}: cannot be read: {error}") from None
    made_by, same, decks = content.get("made_by"), content.get("same"), content.get("decks", {})
    if not isinstance(made_by, str) or not _is_list_of_words(same):
        raise WorkflowError(f"{file}: made_by must be a hash of sources, and same a list of hashes")
    if not isinstance(decks, dict) or not all(map(_is_list_of_words, decks.values())):
        raise WorkflowError(f"{file}: decks must be lists of fingerprints by the names of decks")
    return SameRuns(made_by, tuple(same), {name: tuple(known) for name, known in decks.items()})


def _is_list_of_words(value: Any) -> TypeGuard[list[str]]:
    return isinstance(value, list) and all(isinstance(word, str) for word in value)
