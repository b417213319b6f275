"""A case of a study: decks that run in turn, and a value for each of their variables."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from ..decks import OUT, PACKING, Deck, Value
from ..files import digest_of
from .case_name import DIGEST_LENGTH, as_word, name_before, name_of, unused_in
from .file_format import Outputs


@dataclass(frozen=True)
class Input:
    """A file that a deck reads.

    Attributes
    ----------
    path : path of the file
    digest : hash of its content when the study was read
    """

    path: Path
    digest: str

    @classmethod
    def of(cls, path: Path) -> Input:
        """Return a file as it is now. Raises OSError if it cannot be read."""
        return cls(path, digest_of(path))


@dataclass(frozen=True)
class Stage:
    """One deck of a case and the values of its variables.

    Attributes
    ----------
    deck : the deck
    values : variables that are not left at their defaults, with their values
    common : values that all cases of the study have where they have none of their own
    """

    deck: Deck
    values: Mapping[str, Value]
    common: Mapping[str, Value] = field(default_factory=dict)

    @property
    def variables(self) -> dict[str, Value]:
        """All variables of the deck that are a study's to choose, with their values."""
        return {**self.deck.parameters, **self.values}

    @property
    def shown(self) -> dict[str, Value]:
        """The variables that a name shows: not at the default or at the common value."""
        usual = {**self.deck.parameters, **self.common}
        return {name: v for name, v in self.variables.items() if v != usual[name]}

    @property
    def unused(self) -> frozenset[str]:
        """The variables that mean nothing: a start from a file has particles of its own."""
        return unused_in(self.variables)


@dataclass(frozen=True)
class Case:
    """One run: a deck, or several in turn, with a value for each variable.

    Attributes
    ----------
    stages : decks with their values, in the order in which they run
    inputs : files that the decks read, by the name that they get in the case's folder of inputs
    """

    stages: tuple[Stage, ...]
    inputs: Mapping[str, Input]

    @property
    def variables(self) -> dict[str, Value]:
        """The variables of all stages with their values."""
        return {name: v for stage in self.stages for name, v in stage.variables.items()}

    @property
    def deck(self) -> str:
        """Names of the decks, joined by +."""
        return "+".join(stage.deck.name for stage in self.stages)

    @cached_property
    def name(self) -> str:
        """The name of the case's folder and result, which depends on this case alone.

        So a study can be extended.
        """
        return name_of(self._stages_set, self._digest)

    @cached_property
    def name_before(self) -> str:
        """The name that version 0.2 gave the case, which is another one where it is long."""
        return name_before(self._stages_set, self._digest)

    @property
    def _stages_set(self) -> list[dict[str, Any]]:
        return [
            {"deck": stage.deck.name, "values": stage.shown, "variables": stage.variables}
            for stage in self.stages
        ]

    @cached_property
    def identity(self) -> str:
        """All that is set, as JSON: two cases are the same where it is."""
        # Defaults are left out, as a deck may get a new variable; `is_of` sees when one changes.
        identity = {
            "stages": [
                [stage.deck.name, dict(stage.values)]
                + ([] if stage.deck.shipped else [stage.deck.fingerprint])
                for stage in self.stages
            ],
            "inputs": {name: file.digest for name, file in self.inputs.items()},
        }
        return json.dumps(identity, sort_keys=True)

    @property
    def _digest(self) -> str:
        return hashlib.sha256(self.identity.encode()).hexdigest()[:DIGEST_LENGTH]

    @property
    def fingerprint(self) -> str:
        """A hash of what the decks do: another one means that a result is of another deck."""
        return "+".join(stage.deck.fingerprint for stage in self.stages)

    def is_of(self, record: Any, of_any_code: bool = False) -> bool:
        """Say whether a run was made with the values of this case, as far as it had the variables.

        Parameters
        ----------
        record : record of the run, from `provenance.run_record`; anything else is of no case
        of_any_code : whether a variable that neither of them sets may have had another default
        """
        try:
            made = [
                (dict(stage["variables"]), set(stage.get("values", stage["variables"])))
                for stage in record["stages"]
            ]
        except (AttributeError, KeyError, TypeError, ValueError):
            return False
        if len(made) != len(self.stages):
            return False
        return all(
            name not in before
            or before[name] == value
            or (of_any_code and name not in values and name not in stage.values)
            for (before, values), stage in zip(made, self.stages, strict=True)
            for name, value in stage.variables.items()
        )

    def is_run_of(self, record: Any, of_any_code: bool = False) -> bool:
        """Say whether a run is of this case, whatever its name is: of its decks and all its values.

        What one of them sets, the other must know. A record does not tell what was in the files
        that decks read: runs of a case with such files are known by their names alone. The
        parameters are those of `is_of`.
        """
        if self.inputs or not self.is_of(record, of_any_code):
            return False
        ours = all(stage.deck.shipped for stage in self.stages)
        return (ours or record.get("fingerprint") == self.fingerprint) and all(
            made.get("deck") == stage.deck.name
            and set(made.get("values", ())) <= stage.variables.keys()
            and stage.values.keys() <= set(made["variables"])
            for made, stage in zip(record["stages"], self.stages, strict=True)
        )

    def folder_of(self, stage: Stage) -> str:
        """Return the folder of a stage, seen from the case's; the last stage writes into that."""
        return "." if stage is self.stages[-1] else stage.deck.name

    def commands(self, ranks: int = 1) -> list[list[str]]:
        """Return the commands that run the stages in the case's folder.

        The output is not buffered, so that one can see how far a run has come.
        """
        commands = []
        before = None
        for stage in self.stages:
            out = self.folder_of(stage)
            values = dict(stage.values)
            if takes_out(stage.deck):
                values[OUT] = out
            if before is not None and PACKING in stage.deck.variables:
                values[PACKING] = f"{before}/packing.restart"
            command = ["lmp", "-nonbuf", "-in", f"{stage.deck.name}.in"]
            for name, value in values.items():
                command += ["-var", name, as_word(value)]
            if ranks > 1:
                command = ["mpiexec", "-bind-to", "core", "-n", str(ranks), *command]
            commands.append(command)
            before = out
        return commands


@dataclass(frozen=True)
class Study:
    """A study: its cases, and what is measured of each.

    Attributes
    ----------
    name : name of its file, without `.toml`
    title : title in words
    text : text of the whole file
    cases : cases, no two of them the same
    outputs : measurements that are made of each case
    warnings : what is expected to go wrong, one line each
    """

    name: str
    title: str
    text: str
    cases: tuple[Case, ...]
    outputs: Outputs
    warnings: tuple[str, ...] = ()


def stage_of(
    deck: Deck, values: Mapping[str, Value], common: Mapping[str, Value] | None = None
) -> Stage:
    """Return a deck with those of the values that it knows and that are not its defaults.

    Parameters
    ----------
    deck : the deck
    values : values of the case
    common : values of the deck that all cases of the study have where `values` has none
    """
    common = common or {}
    given = {**common, **values}
    return Stage(
        deck,
        {
            name: given[name]
            for name, default in deck.parameters.items()
            if name in given and given[name] != default
        },
        common,
    )


def takes_out(deck: Deck) -> bool:
    """Say whether `-var out FOLDER` may be given: LAMMPS refuses it if the deck has another out."""
    own = r"^[^#\n]*\bvariable\s+out\s+(?!\s|index\b)"
    return not re.search(own, deck.text, re.MULTILINE)


def is_word(text: str) -> bool:
    """Say whether LAMMPS takes a text as one word wherever a deck may put it."""
    return text.isprintable() and not re.search(r"[\s$\"'&]|^$", text)
