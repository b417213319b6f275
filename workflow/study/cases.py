"""The cases of a study: all combinations of the values of its parameters, row by row."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..decks import Deck, Value, file_of, find_deck
from ..errors import WorkflowError, meant
from ..files import is_file, read_regular
from ..shipped import DECKS
from .case import Case, Input, is_word, stage_of
from .case_name import INPUTS
from .file_format import StudyFile
from .stages import misfit
from .values import MOST_CASES, values_of

# A larger deck is some other file [bytes].
LARGEST_DECK = 1_000_000
# A case's folder holds these files beside decks: no folder of a stage may have such a name.
OWN_FILES = (
    *(INPUTS, "finished.json", "failed.json", "log.lammps", "lmp.out", "screen.out", "measure.out"),
    *("particles.lammpsdump", "contacts.lammpsdump", "packing.restart"),
    *("dimer.json", "tetrahedron.json"),
)


def cases_of(file: StudyFile, folder: Path, mistakes: list[str]) -> Iterator[Case]:
    """Return the cases of a study file, each once, as long as there are no mistakes.

    Parameters
    ----------
    file : all of the study file
    folder : folder of the study file, from which it names decks and other files
    mistakes : list to which one line for each mistake is added
    """
    known: set[str] = set()
    seen: dict[str, str] = {}
    files: dict[Path, Input] = {}
    missing = False
    for number, values in enumerate(file.rows or [{}], 1):
        where = f"rows[{number}]" if file.rows else "parameters"
        deck_key = f"{where}.deck" if "deck" in values else "deck"
        try:
            decks = _decks(values.get("deck", file.deck), folder)
        except WorkflowError as error:
            mistakes.append(f"{deck_key}: {error}")
            missing = True
            continue
        row = _row(where, deck_key, decks, values, file.parameters)
        known |= row.known
        choices = _choices(row, folder, mistakes)
        if mistakes:
            continue
        for case in _combined(row, choices, folder, files, mistakes):
            if case.name not in seen:
                seen[case.name] = case.identity
                yield case
            elif seen[case.name] != case.identity:
                mistakes.append(
                    f"{where}: two cases have the name {case.name}, whose hash is the same by "
                    "chance; leave out one of them"
                )
    if missing:
        # The variables of a deck that was not found are not known.
        return
    for name in file.parameters:
        if name not in known:
            mistakes.append(_unknown(f"parameters.{name}", _all_decks(file, folder)))


@dataclass(frozen=True)
class _Row:
    """A row of a study file, with the parameters that all rows share.

    Attributes
    ----------
    where : key of the row, for errors
    deck_key : key under which its decks stand
    decks : its decks
    wanted : what the file says of each parameter, by its name
    keys : key under which it says so, by the same names
    own : names of the parameters that the row itself gives
    """

    where: str
    deck_key: str
    decks: Sequence[Deck]
    wanted: Mapping[str, Any]
    keys: Mapping[str, str]
    own: Sequence[str]

    @property
    def known(self) -> set[str]:
        """The parameters that its decks have."""
        return {name for deck in self.decks for name in deck.parameters}


def _row(
    where: str,
    deck_key: str,
    decks: Sequence[Deck],
    values: Mapping[str, Any],
    shared: Mapping[str, Any],
) -> _Row:
    """Return a row of a study file: what it says itself comes before what all rows share."""
    own = {name: value for name, value in values.items() if name != "deck"}
    others = {name: value for name, value in shared.items() if name not in own}
    keys = {name: f"parameters.{name}" for name in others}
    keys |= {name: f"{where}.{name}" for name in own}
    return _Row(where, deck_key, decks, {**others, **own}, keys, list(own))


def _choices(row: _Row, folder: Path, mistakes: list[str]) -> dict[str, list[Value]]:
    """Return the values of each parameter that the decks of a row have, by its name."""
    mistakes += [
        _unknown(f"{row.where}.{name}", row.decks) for name in row.own if name not in row.known
    ]
    choices = {
        name: values_of(row.keys[name], name, value, row.decks, folder, mistakes)
        for name, value in row.wanted.items()
        if name in row.known
    }
    if "particles" in choices and _starts_from_file(row.decks, choices, folder):
        mistakes.append(
            f"{row.keys['particles']}: not allowed where start is a file, which has a number of "
            "particles of its own; give it in rows with another start"
        )
    if math.prod(len(values) for values in choices.values()) > MOST_CASES:
        mistakes.append(f"{row.where}: more than {MOST_CASES} cases")
    return choices


def _combined(
    row: _Row,
    choices: Mapping[str, Sequence[Value]],
    folder: Path,
    files: dict[Path, Input],
    mistakes: list[str],
) -> Iterator[Case]:
    """Return the cases of a row, one for each combination of the values of its parameters."""
    for combination in itertools.product(*choices.values()):
        try:
            case = _case(row.decks, dict(zip(choices, combination, strict=True)), folder, files)
        except WorkflowError as error:
            mistakes.append(f"{row.where}: {error}")
            return
        if wrong := misfit(case.stages):
            mistakes.append(f"{row.keys.get(wrong[0], row.deck_key)}: {wrong[1]}")
        else:
            yield case


def _starts_from_file(
    decks: Sequence[Deck], choices: Mapping[str, Sequence[Value]], folder: Path
) -> bool:
    """Say whether one of our decks would take its particles from a data file in some case."""
    ours = [deck for deck in decks if deck.shipped]
    return any(file_of(ours, "start", v, folder) is not None for v in choices.get("start", ()))


def _decks(name: Any, folder: Path) -> list[Deck]:
    """Return the decks that a study file names, which must be able to run in one folder."""
    names = name if isinstance(name, list) else [name]
    if not names or not all(isinstance(each, str) for each in names):
        raise WorkflowError(f"a deck is a name, or a list of names, not {name!r}")
    decks = []
    for each in names:
        path = folder / each
        if each not in DECKS and is_file(path):
            # A file that is too large, or a pipe, is refused before all of it is read.
            read_regular(path, LARGEST_DECK)
        decks.append(find_deck(each, folder))
        if not is_word(decks[-1].name) or decks[-1].name.startswith("."):
            raise WorkflowError(
                f"{each!r}: a deck's name must be one word without quotes, $ and &, that does not "
                "begin with a dot"
            )
    # Each deck writes to a folder of its name.
    if len({deck.name for deck in decks}) < len(decks):
        raise WorkflowError(f"{names!r} names a deck twice; each may be there once")
    if len(decks) > 1:
        for deck in decks:
            if deck.name in (*OWN_FILES, *(f"{other.name}.in" for other in decks)):
                raise WorkflowError(
                    f"{deck.name}.in: the folder of this deck would be named as a file of the "
                    "case; rename the deck"
                )
    return decks


def _all_decks(file: StudyFile, folder: Path) -> list[Deck]:
    """Return the decks of all rows, each once; those that cannot be read are left out."""
    decks: dict[str, Deck] = {}
    for row in file.rows or [{}]:
        try:
            decks |= {deck.name: deck for deck in _decks(row.get("deck", file.deck), folder)}
        except WorkflowError:
            continue
    return list(decks.values())


def _unknown(key: str, decks: Sequence[Deck]) -> str:
    """Say that no deck has a variable of the name that a key gives."""
    if not decks:
        return f"{key}: no deck knows it"
    allowed = "; ".join(f"{deck.name}: {', '.join(deck.parameters) or 'none'}" for deck in decks)
    names = [name for deck in decks for name in deck.parameters]
    near = meant(key.rpartition(".")[2], names)
    return f"{key}: no variable of that name{near}; allowed are {allowed}"


def _case(
    decks: Sequence[Deck], values: dict[str, Value], folder: Path, files: dict[Path, Input]
) -> Case:
    """Return a case; `files` holds those that have been read, so that each is read once.

    Raises WorkflowError if a file cannot be read, or if two have the same name.
    """
    inputs: dict[str, Input] = {}
    for name in values:
        path = file_of(decks, name, values[name], folder)
        if path is None:
            continue
        if path not in files:
            try:
                files[path] = Input.of(path)
            except OSError as error:
                raise WorkflowError(f"{path}: {error.strerror}") from None
        if inputs.setdefault(path.name, files[path]) != files[path]:
            raise WorkflowError(f"two files are named {path.name}; rename one of them")
        values[name] = f"{INPUTS}/{path.name}"
    return Case(tuple(stage_of(deck, values) for deck in decks), inputs)
