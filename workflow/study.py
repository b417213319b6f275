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

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, field_validator

from .decks import OUT, PACKING, SHIPPED, Deck, Value, file_of, find_deck
from .errors import StudyError, WorkflowError
from .files import digest_of, is_file, read_regular
from .stages import Bounds, container_of, last_step_of, misfit, takes_out
from .toml_lines import lines_of_keys

# A study of more cases is a slip of the pen.
MOST_CASES = 10_000
LONGEST_NAME = 160
# A study's name names a file and a folder, with some letters more while they are written [bytes].
LONGEST_STUDY_NAME = 200
# Of a study file or a deck; what is larger is some other file [bytes].
LARGEST_FILE = 1_000_000
# A whole number of more bits cannot be written in decimal digits by Python.
MOST_BITS = 10_000
# A minute of measuring each, or some minutes for all slabs together.
MOST_POINTS, MOST_POINTS_OF_SLAB, MOST_POINTS_OF_PROFILE = 10**8, 10**7, 10**9
MOST_SLABS = 10_000
MOST_PICTURES = 100
# In a case's folder, so that a user's file may have any name.
INPUTS = "inputs"
# What a case's folder holds beside decks: no folder of a stage may have such a name.
OWN_FILES = (
    *(INPUTS, "finished.json", "failed.json", "log.lammps", "lmp.out", "screen.out", "measure.out"),
    *("particles.lammpsdump", "contacts.lammpsdump", "packing.restart"),
    *("dimer.json", "tetrahedron.json"),
)
# Of an error; a file may quote a picture.
LONGEST_LINE = 2000
# In a case's name even at their defaults; others where they differ.
ALWAYS_SHOWN = ("particles", "aspect_ratio", "change", "seed")

# What pydantic calls otherwise than TOML does.
KINDS = {"dict_type": "a table", "model_type": "a table", "list_type": "a list"}
KINDS |= {"tuple_type": "a list"}
# Keys of which pydantic has several things to say at a time.
WHOLE = {("deck",): "a name or a list of names", ("outputs", "box"): "six numbers"}

# The box of the paper: a quarter of the container's width away from every wall and the floor.
PAPER_BOX: Bounds = (0.25, 0.75, 0.25, 0.75, 0.25, 0.75)


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def _from_to(least: int, most: int) -> BeforeValidator:
    def check(value: Any) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
            raise ValueError(f"it must be a whole number from {least} to {most}")
        return value

    return BeforeValidator(check)


def _between(low: float, high: float) -> BeforeValidator:
    def check(value: Any) -> float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not low <= value <= high:
            raise ValueError(f"it must be a number from {low:g} to {high:g}")
        return float(value)

    return BeforeValidator(check)


_Number = Annotated[float, Field(strict=True)]
_Boolean = Annotated[bool, Field(strict=True)]


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
    thickness: Annotated[float, _between(0.001, 1)] = 0.1
    reach: Annotated[float, _between(1e-6, 1e6)] = 0.25
    points: Annotated[int, _from_to(1, MOST_POINTS_OF_SLAB)] = 100_000


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

    box: tuple[_Number, _Number, _Number, _Number, _Number, _Number] = PAPER_BOX
    points: Annotated[int, _from_to(1, MOST_POINTS)] = 1_000_000
    evolution: _Boolean = True
    profile: ProfileOutput | None = None
    structure: _Boolean = True
    pictures: tuple[Annotated[int, _from_to(0, 2**63 - 1)], ...] = ()
    network: _Boolean = False
    keep: Literal["everything", "results"] = "everything"

    @field_validator("box")
    @classmethod
    def _ordered(cls, value: Bounds) -> Bounds:
        sides = [high - low for low, high in zip(value[::2], value[1::2], strict=True)]
        # A volume that is no number of full precision gives no packing fraction.
        if not all(0 < side < math.inf for side in sides) or not 1e-300 < math.prod(sides) < 1e300:
            raise ValueError("it must be xlo, xhi, ylo, yhi, zlo, zhi, each lower bound the lesser")
        return value

    @field_validator("pictures")
    @classmethod
    def _few(cls, value: tuple[int, ...]) -> tuple[int, ...]:
        if len(value) > MOST_PICTURES or len(set(value)) < len(value):
            raise ValueError(f"they must be at most {MOST_PICTURES} steps, each of them once")
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
class Input:
    """A file that a deck reads.

    Attributes
    ----------
    path : where it is
    digest : of its content when the study was read
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
            "inputs": {name: file.digest for name, file in self.inputs.items()},
        }
        digest = _hash(json.dumps(identity, sort_keys=True).encode())[:8]
        readable = re.sub(r"[^\w.=+-]", "-", "_".join(words), flags=re.ASCII)
        return f"{readable[:LONGEST_NAME]}_{digest}"

    @property
    def fingerprint(self) -> str:
        """A hash of what the decks do: another one means that a result is of another deck."""
        return "+".join(stage.deck.fingerprint for stage in self.stages)

    def is_of(self, record: Any) -> bool:
        """Whether a run was made with the values of this case, as far as it had the variables.

        Parameters
        ----------
        record : how it was made: see `provenance.run_record`; anything else is of no case
        """
        try:
            made = [dict(stage["variables"]) for stage in record["stages"]]
        except (KeyError, TypeError, ValueError):
            return False
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
            values = dict(stage.values)
            if takes_out(stage.deck):
                values[OUT] = out
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
    if mistake := _of_name(path.stem):
        raise StudyError([_shown(f"{path}: {mistake}")])
    try:
        text = read_regular(path, LARGEST_FILE).decode("utf-8-sig")
        content = tomllib.loads(text)
        if _has_endless_number(content):
            raise ValueError("a whole number has too many digits")
    except WorkflowError as error:
        raise StudyError([_shown(str(error))]) from None
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
    if not file.title.isprintable():
        mistakes.append(f"title: {file.title!r} is not allowed: it must be one line of text")
    cases = tuple(_cases(file, path.parent, mistakes))
    if not mistakes:
        mistakes += dict.fromkeys(_of_outputs(file.outputs, cases))
    if mistakes:
        raise StudyError(_placed(mistakes, path, text))
    return Study(path.stem, file.title, text, cases, file.outputs)


def _of_name(name: str) -> str | None:
    """Say why a study file's name cannot name its results, if it cannot."""
    if name.startswith(".") or not name.isprintable() or name != name.strip():
        return (
            "the file's name, which its results get, must begin with a letter or a digit, and have "
            "neither line breaks nor other characters that cannot be printed"
        )
    if len(name.encode()) > LONGEST_STUDY_NAME:
        return f"the file's name is too long: at most {LONGEST_STUDY_NAME} bytes are allowed"
    return None


def _has_endless_number(content: Any) -> bool:
    if isinstance(content, dict):
        return any(map(_has_endless_number, content.values()))
    if isinstance(content, list):
        return any(map(_has_endless_number, content))
    return isinstance(content, int) and content.bit_length() > MOST_BITS


def _placed(mistakes: Sequence[str], path: Path, text: str) -> list[str]:
    """Say of each mistake in which file it is, and on which line if its key is there."""
    lines = lines_of_keys(text)
    placed = []
    # The same mistake shows in every row that it concerns.
    for mistake in dict.fromkeys(mistakes):
        line = lines.get(mistake.split(": ")[0])
        # As tomllib says it.
        where = "" if line is None else f" (at line {line})"
        placed.append(f"{_shown(str(path))}: {_shown(mistake)}{where}")
    return placed


def _shown(mistake: str) -> str:
    """Return a line that quotes a file without what would spoil a terminal, or fill it."""
    text = "".join(each if each.isprintable() else repr(each)[1:-1] for each in mistake)
    return text if len(text) <= LONGEST_LINE else f"{text[:LONGEST_LINE]}..."


def _cases(file: _StudyFile, folder: Path, mistakes: list[str]) -> Iterator[Case]:
    known: set[str] = set()
    seen: set[str] = set()
    files: dict[Path, Input] = {}
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
        keys = {name: key for key, (name, _) in wanted.items()}
        keys["deck"] = f"{where}.deck" if "deck" in row else "deck"
        for combination in itertools.product(*choices.values()):
            try:
                case = _case(decks, dict(zip(choices, combination, strict=True)), folder, files)
            except WorkflowError as error:
                mistakes.append(f"{where}: {error}")
                break
            if wrong := misfit(case.stages):
                mistakes.append(f"{keys.get(wrong[0], keys['deck'])}: {wrong[1]}")
            elif case.name not in seen:
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
    decks = []
    for each in names:
        path = folder / each
        if each not in SHIPPED and is_file(path):
            # Before all of it is read; of its content the deck itself takes care.
            read_regular(path, LARGEST_FILE)
        decks.append(find_deck(each, folder))
        if not is_word(decks[-1].name) or decks[-1].name.startswith("."):
            raise WorkflowError(
                f"{each!r}: a deck's name must be one word without quotes, $ and &, that does not "
                "begin with a dot"
            )
    # Each writes to a folder of its name.
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
    allowed = "; ".join(f"{deck.name}: {', '.join(deck.parameters) or 'none'}" for deck in decks)
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
        elif isinstance(each, str) and not is_word(each):
            mistakes.append(f"{key}: {each!r} must be one word, without spaces, quotes, $ and &")
        elif file_of(decks, name, each, folder) is None:
            refusing = [rule for rule in rules if not rule.accepts(each)]
            mistakes.extend(
                f"{key}: {each!r} is not allowed: it must be {rule.allowed}" for rule in refusing
            )
            if not refusing and isinstance(each, int) and abs(each) >= 2**63:
                mistakes.append(f"{key}: {each} is not allowed: whole numbers must be below 2^63")
    return values


def is_word(text: str) -> bool:
    """Whether LAMMPS takes a text as one word wherever a deck may put it."""
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


def _case(
    decks: Sequence[Deck], values: dict[str, Value], folder: Path, files: dict[Path, Input]
) -> Case:
    """Return a case; `files` are those that are known already, to read each once.

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


def _of_outputs(outputs: Outputs, cases: Sequence[Case]) -> Iterator[str]:
    """Say what of the outputs cannot be measured of the cases, one line each."""
    ends = [last_step_of(case.stages[-1]) for case in cases]
    known = [end for end in ends if end is not None]
    for step in outputs.pictures:
        # Cases of fewer steps than others are drawn at their end.
        if len(known) == len(ends) and step > max(known):
            yield (
                f"outputs.pictures: {step} is not allowed: it must be a step from 0 to "
                f"{max(known)}, where the longest case ends"
            )
    for stage in [case.stages[-1] for case in cases]:
        container = container_of(stage)
        if container is not None and not all(
            low <= value <= high
            for value, low, high in zip(
                outputs.box,
                [low for low in container[::2] for _ in "lh"],
                [high for high in container[1::2] for _ in "lh"],
                strict=True,
            )
        ):
            yield (
                f"outputs.box: {list(outputs.box)} is not allowed: it must lie in the container of "
                f"{stage.deck.name}, {list(container)}"
            )
        if outputs.profile is not None:
            yield from _of_profile(outputs.profile, stage, container)


def _of_profile(profile: ProfileOutput, stage: Stage, container: Bounds | None) -> Iterator[str]:
    axis = "xyz".index(profile.axis)
    if container is not None:
        width = container[2 * axis + 1] - container[2 * axis]
        if profile.reach > width:
            yield (
                f"outputs.profile.reach: {profile.reach} is not allowed: it must be at most "
                f"{width}, the width of the container of {stage.deck.name} along {profile.axis}"
            )
            return
    diameter = stage.variables.get("diameter")
    if not isinstance(diameter, int | float) or diameter <= 0:
        return
    thickness = profile.thickness * diameter
    slabs = profile.reach / thickness if thickness > 0 else math.inf
    if slabs > MOST_SLABS or slabs * profile.points > MOST_POINTS_OF_PROFILE:
        most = min(MOST_SLABS, MOST_POINTS_OF_PROFILE / profile.points)
        least = profile.reach / (most * diameter)
        yield (
            f"outputs.profile: {slabs:.3g} slabs of {profile.points} points each are too many: at "
            f"most {MOST_SLABS} slabs and {MOST_POINTS_OF_PROFILE} points in all are allowed, so "
            f"that thickness must be at least {least:.2g} diameters for spheres of {diameter}"
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
        elif mistake["type"] in KINDS:
            message = f"{mistake['input']!r} is not allowed: it must be {KINDS[mistake['type']]}"
        else:
            message = f"{mistake['input']!r} is not allowed: {message}"
        yield f"{place}: {message}"


def _as_word(value: Value) -> str:
    return value if isinstance(value, str) else repr(value)


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
