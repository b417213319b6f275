"""The cases of a study: all combinations of the values of its parameters, row by row."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..decks import Deck, Value, file_of, find_deck
from ..errors import WorkflowError
from ..files import is_file, read_regular
from ..shipped import DECKS
from .case import Case, Input, is_word, stage_of
from .case_name import INPUTS
from .common import Common
from .file_format import StudyFile
from .stages import misfit
from .values import MOST_CASES, unknown_variable, values_of

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
    every, common = _all_decks(file, folder), Common(file.common)
    common.check(every, folder, mistakes)
    for number, values in enumerate(file.rows or [{}], 1):
        where = f"rows[{number}]" if file.rows else "parameters"
        deck_key = f"{where}.deck" if "deck" in values else "deck"
        try:
            decks = _decks(values.get("deck", file.deck), folder)
        except WorkflowError as error:
            mistakes.append(f"{deck_key}: {error}")
            missing = True
            continue
        row = _row(where, deck_key, decks, values, file.parameters, common)
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
    mistakes += common.unknown(every)
    for name in file.parameters:
        if name not in known:
            mistakes.append(unknown_variable(f"parameters.{name}", every))


@dataclass(frozen=True)
class _Row:
    """A row of a study file, with the parameters that all rows share, and the common values.

    Attributes
    ----------
    where : key of the row, for errors
    deck_key : key under which its decks stand
    decks : its decks
    wanted : what the file says of each parameter, by its name
    keys : key under which it says so, and under which a common value stands, by its name
    own : names of the parameters that the row itself gives
    common : values that all cases have where there is none of these
    """

    where: str
    deck_key: str
    decks: Sequence[Deck]
    wanted: Mapping[str, Any]
    keys: Mapping[str, str]
    own: Sequence[str]
    common: Common

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
    common: Common,
) -> _Row:
    """Return a row of a study file: what it says itself comes before what all rows share.

    The values that all cases have in common come last.
    """
    own = {name: value for name, value in values.items() if name != "deck"}
    others = {name: value for name, value in shared.items() if name not in own}
    keys = common.keys(decks) | {name: f"parameters.{name}" for name in others}
    keys |= {name: f"{where}.{name}" for name in own}
    return _Row(where, deck_key, decks, {**others, **own}, keys, list(own), common)


def _choices(row: _Row, folder: Path, mistakes: list[str]) -> dict[str, list[Value]]:
    """Return the values of each parameter that the decks of a row have, by its name."""
    mistakes += [
        unknown_variable(f"{row.where}.{name}", row.decks)
        for name in row.own
        if name not in row.known
    ]
    choices = {
        name: values_of(row.keys[name], name, value, row.decks, folder, mistakes)
        for name, value in row.wanted.items()
        if name in row.known
    }
    usual = {name: [v] for deck in row.decks for name, v in row.common.of(deck).items()}
    if "particles" in choices | usual and _starts_from_file(row.decks, usual | choices, folder):
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
            case = _case(row, dict(zip(choices, combination, strict=True)), folder, files)
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


def _case(row: _Row, values: Mapping[str, Value], folder: Path, files: dict[Path, Input]) -> Case:
    """Return a case; `files` holds those that have been read, so that each is read once.

    Raises WorkflowError if a file cannot be read, or if two have the same name.
    """
    inputs: dict[str, Input] = {}
    own = _with_inputs(row.decks, values, folder, files, inputs)
    stages = []
    for deck in row.decks:
        common = row.common.of(deck)
        left = {name: value for name, value in common.items() if name not in own}
        common |= _with_inputs([deck], left, folder, files, inputs)
        stages.append(stage_of(deck, own, common))
    return Case(tuple(stages), inputs)


def _with_inputs(
    decks: Sequence[Deck],
    values: Mapping[str, Value],
    folder: Path,
    files: dict[Path, Input],
    inputs: dict[str, Input],
) -> dict[str, Value]:
    """Return values with the files among them as decks find them; `inputs` gets these files."""
    found = dict(values)
    for name, value in values.items():
        path = file_of(decks, name, value, folder)
        if path is None:
            continue
        if path not in files:
            try:
                files[path] = Input.of(path)
            except OSError as error:
                raise WorkflowError(f"{path}: {error.strerror}") from None
        if inputs.setdefault(path.name, files[path]) != files[path]:
            raise WorkflowError(f"two files are named {path.name}; rename one of them")
        found[name] = f"{INPUTS}/{path.name}"
    return found
