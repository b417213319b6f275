"""What a deck or a study of one's own begins with: the text of a shipped deck, a small study."""

from __future__ import annotations

import re
from pathlib import Path

from ..errors import WorkflowError, meant
from ..files import writing
from ..shipped import DECKS, MINIMAL, PACK, deck_text, first_study_text
from .study_file import mistake_in_name

STUDY_ENDING = ".toml"
# These are the names of all shipped decks; studies run neither the smallest one, without variables,
# nor that of `pack`.
ALL_DECKS = (MINIMAL, *DECKS, PACK)


def deck_lines() -> dict[str, str]:
    """Return what each shipped deck shows by its name: the first sentence of its text."""
    return {name: _first_sentence(deck_text(name)) for name in ALL_DECKS}


def text_of_deck(name: str) -> str:
    """Return the text of a shipped deck, by its name with or without `.in`.

    Raises WorkflowError if there is none of this name.
    """
    known = name.removesuffix(".in")
    if known not in ALL_DECKS:
        raise WorkflowError(
            f"no deck {name!r}{meant(known, ALL_DECKS)}: it must be {', '.join(ALL_DECKS[:-1])} or "
            f"{ALL_DECKS[-1]}"
        )
    return deck_text(known)


def write_first_study(path: Path) -> None:
    """Write a small study that runs as it is.

    Raises WorkflowError if its name can be that of no study, or if something has it already.
    """
    if path.suffix != STUDY_ENDING:
        raise WorkflowError(f"{path}: the name of a study's file must end in {STUDY_ENDING}")
    if mistake := mistake_in_name(path.stem):
        raise WorkflowError(f"{path}: {mistake}")
    with writing(path):
        try:
            with path.open("x", encoding="utf-8") as file:
                file.write(first_study_text())
        except FileExistsError:
            raise WorkflowError(
                f"{path}: is there already, and is not overwritten: give another name"
            ) from None


def _first_sentence(text: str) -> str:
    """Return the first sentence of the comment on top of a deck, up to its colon."""
    line = text.partition("\n")[0].removeprefix("#").strip()
    return re.split(r"[.:](?: |$)", line)[0]
