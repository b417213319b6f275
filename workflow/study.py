"""A study: a TOML file that says which cases to run and what to measure of each.

    title = "Packing fraction against aspect ratio"
    deck  = "dimers"                     # spheres, dimers, clusters, a file, or several in turn

    [parameters]                         # variables of the deck: a value, a list or a range each
    particles    = 2000
    diameter     = 0.085
    aspect_ratio = [1.1, 1.5, 1.8]
    seed         = { from = 1, to = 4 }

    [[rows]]                             # optional: on top of the parameters, each row apart
    tolerance = 0.005
    [[rows]]
    deck = "spheres"

    [outputs]                            # optional: what is measured of each case
    box = [0.25, 0.75, 0.25, 0.75, 0.25, 0.75]

The cases are all combinations of the values, row by row.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from .decks import OUT, PACKING, Deck, Value, file_of, find_deck
from .errors import StudyError, WorkflowError
from .toml_lines import lines_of_keys

# A study of more cases is a slip of the pen.
MOST_CASES = 10_000
LONGEST_NAME = 160
# Of an error; a file may quote a picture.
LONGEST_LINE = 2000
# In a case's name even at their defaults; others where they differ.
ALWAYS_SHOWN = ("particles", "aspect_ratio", "change", "seed")

# Keys of which pydantic has several things to say at a time.
WHOLE = {("deck",): "a name or a list of names", ("outputs", "box"): "six numbers"}

Bounds = tuple[float, float, float, float, float, float]

# The box of the paper: a quarter of the container's width away from every wall and the floor.
PAPER_BOX: Bounds = (0.25, 0.75, 0.25, 0.75, 0.25, 0.75)


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ProfileOutput(_Table):
    """The packing fraction in slabs parallel to the wall at the container's lower bound.

    Attributes
    ----------
    axis : across the wall
    thickness : of a slab, diameters
    reach : distance from the wall up to which there are slabs, length
    points : random points for each slab
    """

    axis: Literal["x", "y", "z"] = "x"
    thickness: Annotated[float, Field(gt=0, le=1)] = 0.1
    reach: Annotated[float, Field(gt=0)] = 0.25
    points: Annotated[int, Field(ge=1, strict=True)] = 100_000


class Outputs(_Table):
    """What is measured of each case, and kept.

    Attributes
    ----------
    box : xlo, xhi, ylo, yhi, zlo, zhi: where particles are counted, length
    points : random points for the Monte Carlo packing fraction
    evolution : packing fraction and contacts in every frame of the particle dump
    profile : the packing fraction against the distance from a wall
    structure : radial distribution function and bond-orientational order
    pictures : steps at which the packing is drawn; a frame of the dump each
    network : the contact network is drawn
    keep : `everything`, or `results` to delete the dumps of a case that has been measured
    """

    box: Bounds = PAPER_BOX
    points: Annotated[int, Field(ge=1, strict=True)] = 1_000_000
    evolution: bool = True
    profile: ProfileOutput | None = None
    structure: bool = True
    pictures: tuple[int, ...] = ()
    network: bool = False
    keep: Literal["everything", "results"] = "everything"

    @field_validator("box")
    @classmethod
    def _ordered(cls, value: Bounds) -> Bounds:
        if not all(
            -math.inf < low < high < math.inf
            for low, high in zip(value[::2], value[1::2], strict=True)
        ):
            raise ValueError("it must be xlo, xhi, ylo, yhi, zlo, zhi, each lower bound the lesser")
        return value

    @property
    def measured(self) -> str:
        """All that decides what is measured, as JSON: equal texts, equal measurements."""
        return json.dumps(self.model_dump(exclude={"keep"}), sort_keys=True)


class _StudyFile(_Table):
    title: str
    deck: str | list[str]
    parameters: dict[str, Any] = {}
    rows: list[dict[str, Any]] = []
    outputs: Outputs = Outputs()


@dataclass(frozen=True)
class Stage:
    """One deck of a case and the values of its variables.

    Attributes
    ----------
    deck : the deck
    values : those of its variables that are not left at their defaults
    """

    deck: Deck
    values: Mapping[str, Value]

    @property
    def variables(self) -> dict[str, Value]:
        """All variables of the deck that are a study's to choose, with their values."""
        return {**self.deck.parameters, **self.values}


@dataclass(frozen=True)
class Case:
    """One run: a deck, or several in turn, with a value for each variable.

    Attributes
    ----------
    stages : in the order in which they run
    inputs : files that the decks read, by the name that they get in the case's folder
    """

    stages: tuple[Stage, ...]
    inputs: Mapping[str, Path]

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
        """Of the case's folder: what tells it from others, and a hash of all that is set.

        It depends on nothing else in the study, so that one can be extended.
        """
        shown = {
            name: value
            for stage in self.stages
            for name, value in stage.variables.items()
            if name in stage.values or name in ALWAYS_SHOWN
        }
        words = [self.deck, *(f"{name}={_as_word(v)}" for name, v in shown.items())]
        # Not the defaults: a deck may get a new variable. `is_of` sees whether one has changed.
        identity = {
            "stages": [
                [stage.deck.name, dict(stage.values)]
                + ([] if stage.deck.shipped else [stage.deck.fingerprint])
                for stage in self.stages
            ],
            "inputs": {name: _hash(path.read_bytes()) for name, path in self.inputs.items()},
        }
        digest = _hash(json.dumps(identity, sort_keys=True).encode())[:8]
        readable = re.sub(r"[^\w.=+-]", "-", "_".join(words), flags=re.ASCII)
        return f"{readable[:LONGEST_NAME]}_{digest}"

    @property
    def fingerprint(self) -> str:
        """A hash of what the decks do: another one means that a result is of another deck."""
        return "+".join(stage.deck.fingerprint for stage in self.stages)

    def is_of(self, record: Mapping[str, Any]) -> bool:
        """Whether a run was made with the values of this case, as far as it had the variables.

        Parameters
        ----------
        record : how it was made: see `provenance.run_record`
        """
        made = [stage["variables"] for stage in record["stages"]]
        if len(made) != len(self.stages):
            return False
        return all(
            name not in before or before[name] == value
            for before, stage in zip(made, self.stages, strict=True)
            for name, value in stage.variables.items()
        )

    def folder_of(self, stage: Stage) -> str:
        """Where a stage writes, seen from the case's folder; the last one writes into it."""
        return "." if stage is self.stages[-1] else stage.deck.name

    def commands(self, ranks: int = 1) -> list[list[str]]:
        """The commands that run the stages in the case's folder.

        The output is not buffered, so that one can see how far a run has come.
        """
        commands = []
        before = None
        for stage in self.stages:
            out = self.folder_of(stage)
            values = {**stage.values, OUT: out}
            if before is not None and PACKING in stage.deck.variables:
                values[PACKING] = f"{before}/packing.restart"
            command = ["lmp", "-nonbuf", "-in", f"{stage.deck.name}.in"]
            for name, value in values.items():
                command += ["-var", name, _as_word(value)]
            if ranks > 1:
                command = ["mpiexec", "-bind-to", "core", "-n", str(ranks), *command]
            commands.append(command)
            before = out
        return commands


@dataclass(frozen=True)
class Study:
    """Cases, and what is measured of each.

    Attributes
    ----------
    name : of the file, without `.toml`
    title : in words
    text : the whole file
    cases : each another one
    outputs : what is measured
    """

    name: str
    title: str
    text: str
    cases: tuple[Case, ...]
    outputs: Outputs


def read_study(path: Path) -> Study:
    """Read a study file and check all of it.

    Raises StudyError with one line for every mistake.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        content = tomllib.loads(text)
    except OSError as error:
        raise StudyError([f"{path}: {error.strerror}"]) from None
    # A whole number of thousands of digits is a ValueError too.
    except ValueError as error:
        raise StudyError([f"{path}: not TOML: {_shown(str(error))}"]) from None
    except RecursionError:
        raise StudyError(
            [f"{path}: not TOML: tables or lists are too deep in one another"]
        ) from None
    mistakes: list[str] = []
    try:
        file = _StudyFile.model_validate(content)
    except ValidationError as error:
        mistakes = list(_lines(error))
        if any(one["loc"][:1] != ("outputs",) for one in error.errors()):
            raise StudyError(_placed(mistakes, path, text)) from None
        # The parameters are as they should be: their mistakes are to be told at once.
        file = _StudyFile.model_validate({**content, "outputs": {}})
    cases = tuple(_cases(file, path.parent, mistakes))
    if mistakes:
        raise StudyError(_placed(mistakes, path, text))
    return Study(path.stem, file.title, text, cases, file.outputs)


def _placed(mistakes: Sequence[str], path: Path, text: str) -> list[str]:
    """Say of each mistake in which file it is, and on which line if its key is there."""
    lines = lines_of_keys(text)
    placed = []
    # The same mistake shows in every row that it concerns.
    for mistake in dict.fromkeys(mistakes):
        line = lines.get(mistake.split(": ")[0])
        # As tomllib says it.
        where = "" if line is None else f" (at line {line})"
        placed.append(f"{path}: {_shown(mistake)}{where}")
    return placed


def _shown(mistake: str) -> str:
    """Return a line that quotes a file without what would spoil a terminal, or fill it."""
    text = "".join(each if each.isprintable() else repr(each)[1:-1] for each in mistake)
    return text if len(text) <= LONGEST_LINE else f"{text[:LONGEST_LINE]}..."


def _cases(file: _StudyFile, folder: Path, mistakes: list[str]) -> Iterator[Case]:
    known: set[str] = set()
    seen: set[str] = set()
    missing = False
    rows = file.rows or [{}]
    for number, row in enumerate(rows, 1):
        where = f"rows[{number}]" if file.rows else "parameters"
        own = {name: value for name, value in row.items() if name != "deck"}
        try:
            decks = _decks(row.get("deck", file.deck), folder)
        except WorkflowError as error:
            mistakes.append(f"{f'{where}.deck' if 'deck' in row else 'deck'}: {error}")
            missing = True
            continue
        parameters = {name: p for deck in decks for name, p in deck.parameters.items()}
        known |= set(parameters)
        for name in own:
            if name in parameters:
                continue
            mistakes.append(_unknown(f"{where}.{name}", decks))
        wanted = {f"parameters.{name}": (name, v) for name, v in file.parameters.items()}
        wanted = {key: pair for key, pair in wanted.items() if pair[0] not in own}
        wanted |= {f"{where}.{name}": (name, v) for name, v in own.items()}
        choices: dict[str, list[Value]] = {}
        for key, (name, value) in wanted.items():
            if name in parameters:
                choices[name] = _values(key, name, value, decks, folder, mistakes)
        if math.prod(len(values) for values in choices.values()) > MOST_CASES:
            mistakes.append(f"{where}: more than {MOST_CASES} cases")
        if mistakes:
            continue
        for combination in itertools.product(*choices.values()):
            case = _case(decks, dict(zip(choices, combination, strict=True)), folder)
            if case.name not in seen:
                seen.add(case.name)
                yield case
    if missing:
        # Their variables are not known.
        return
    for name in file.parameters:
        if name not in known:
            mistakes.append(_unknown(f"parameters.{name}", _decks_of(file, folder)))


def _decks(name: Any, folder: Path) -> list[Deck]:
    names = name if isinstance(name, list) else [name]
    if not names or not all(isinstance(each, str) for each in names):
        raise WorkflowError(f"a deck is a name, or a list of names, not {name!r}")
    decks = [find_deck(each, folder) for each in names]
    # Each writes to a folder of its name.
    if len({deck.name for deck in decks}) < len(decks):
        raise WorkflowError(f"{names!r} names a deck twice; each may be there once")
    return decks


def _decks_of(file: _StudyFile, folder: Path) -> list[Deck]:
    decks: dict[str, Deck] = {}
    for row in file.rows or [{}]:
        try:
            decks |= {deck.name: deck for deck in _decks(row.get("deck", file.deck), folder)}
        except WorkflowError:
            continue
    return list(decks.values())


def _unknown(key: str, decks: Sequence[Deck]) -> str:
    if not decks:
        return f"{key}: no deck knows it"
    allowed = "; ".join(f"{deck.name}: {', '.join(deck.parameters)}" for deck in decks)
    return f"{key}: no variable of that name; allowed are {allowed}"


def _values(
    key: str, name: str, value: Any, decks: Sequence[Deck], folder: Path, mistakes: list[str]
) -> list[Value]:
    """Return the values that a value, a list or a range stands for."""
    if isinstance(value, dict):
        values = _range(key, value, mistakes)
    else:
        values = value if isinstance(value, list) else [value]
    if isinstance(value, list) and not values:
        mistakes.append(f"{key}: the list is empty")
    rules = [deck.rules[name] for deck in decks if name in deck.rules]
    for each in values:
        if isinstance(each, bool) or not isinstance(each, int | float | str):
            mistakes.append(
                f"{key}: {each!r} is no value; it must be a number, a word, a list of them or "
                "{ from = A, to = B, step = S }"
            )
        elif isinstance(each, float) and not math.isfinite(each):
            mistakes.append(f"{key}: {each} is not allowed: it must be finite")
        elif isinstance(each, str) and not _is_word(each):
            mistakes.append(f"{key}: {each!r} must be one word, without spaces, quotes, $ and &")
        elif (file := file_of(decks, name, each, folder)) is not None:
            # The deck finds it by its name alone.
            if any(file.name in rule.words for rule in rules):
                mistakes.append(f"{key}: {each} is not allowed: {file.name} is no name for a file")
        else:
            mistakes.extend(
                f"{key}: {each} is not allowed: it must be {rule.allowed}"
                for rule in rules
                if not rule.accepts(each)
            )
    return values


def _is_word(text: str) -> bool:
    return text.isprintable() and not re.search(r"[\s$\"'&]|^$", text)


def _range(key: str, value: Mapping[str, Any], mistakes: list[str]) -> list[Value]:
    """Return from, from + step, ... up to `to`, which is included where it is met."""
    step = value.get("step", 1)
    ends = [value.get("from"), value.get("to"), step]
    numbers = all(isinstance(end, int | float) and not isinstance(end, bool) for end in ends)
    if value.keys() - {"from", "to", "step"} or not numbers:
        mistakes.append(f"{key}: a range is {{ from = A, to = B, step = S }}, three numbers")
        return []
    low, high = value["from"], value["to"]
    if not (step > 0 and low <= high and all(abs(end) < math.inf for end in ends)):
        mistakes.append(f"{key}: a range needs from <= to and step > 0, not {dict(value)}")
        return []
    try:
        # A hair more: 0.1 + 2 x 0.1 is above 0.3.
        count = math.floor((high - low) / step * (1 + 1e-12) + 1e-9) + 1
    except OverflowError:
        count = MOST_CASES + 1
    if count > MOST_CASES:
        mistakes.append(f"{key}: more than {MOST_CASES} values")
        return []
    whole = all(isinstance(end, int) for end in ends)
    # 15 digits: the number that was meant, not the sum's last digit.
    return [low + i * step if whole else float(f"{low + i * step:.15g}") for i in range(count)]


def _case(decks: Sequence[Deck], values: dict[str, Value], folder: Path) -> Case:
    inputs: dict[str, Path] = {}
    for name in values:
        path = file_of(decks, name, values[name], folder)
        if path is not None:
            inputs[path.name] = path
            values[name] = path.name
    return Case(tuple(stage_of(deck, values) for deck in decks), inputs)


def stage_of(deck: Deck, values: Mapping[str, Value]) -> Stage:
    """Return a deck with those of the values that it knows, and that are not its defaults."""
    return Stage(
        deck,
        {
            name: values[name]
            for name, default in deck.parameters.items()
            if name in values and values[name] != default
        },
    )


def _lines(error: ValidationError) -> Iterator[str]:
    """Say what pydantic found, one line each, as a user of the file would."""
    said: set[str] = set()
    for mistake in error.errors():
        key = next((key for key in WHOLE if mistake["loc"][: len(key)] == key), None)
        # The key itself may be missing, and the bounds of a box in the wrong order.
        if key is not None and (mistake["type"], mistake["loc"]) not in (
            ("missing", key),
            ("value_error", key),
        ):
            line = f"{'.'.join(key)}: it must be {WHOLE[key]}"
            if line not in said:
                said.add(line)
                yield line
            continue
        place = ".".join(str(step) for step in mistake["loc"] if step not in ("str", "list[str]"))
        message = mistake["msg"].removeprefix("Value error, ")
        if mistake["type"] == "extra_forbidden":
            model: type[BaseModel] = Outputs if place.startswith("outputs") else _StudyFile
            if place.startswith("outputs.profile"):
                model = ProfileOutput
            message = f"no such key; allowed are {', '.join(model.model_fields)}"
        elif mistake["type"] == "missing":
            message = "this key is missing"
        else:
            message = f"{mistake['input']!r} is not allowed: {message}"
        yield f"{place}: {message}"


def _as_word(value: Value) -> str:
    return value if isinstance(value, str) else repr(value)


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
