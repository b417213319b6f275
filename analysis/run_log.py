"""A log of LAMMPS: its runs, their thermo output, and the steps at which its dumps were written.

A log repeats every command with the values of its variables. So it tells by itself which frames a
dump must hold: what `dump`, `dump_modify`, `undump` and `write_dump` say, and the runs in between.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import ArrayLike

from .errors import LogError, shortened
from .files import reason_of, regular
from .geometry import FloatArray, IntArray

_LOOP = re.compile(r"Loop time of (\S+) on \d+ procs for (\d+) steps with (\d+) atoms")
# What the summary of fix inelastic says of a run's end.
_UNREST = re.compile(
    r"\s+at its end the scene is (at rest|NOT AT REST): "
    r"rms speed (\S+) g h, net force (\S+) of the weight"
)
_COUNT = re.compile(r"f_(\w+)\[(5|6)\]")
# After these commands the step is another one, without a run.
_NEW_STEP = ("read_restart", "read_data", "read_dump", "clear", "rerun", "tad", "prd", "hyper")
# A deck begins with one of these words.
_ANEW = ("LAMMPS", "units", "atom_style", "read_restart", "read_data", "clear")
# LAMMPS takes two times for the same that differ by less than this share of a step.
_SAME_TIME = 1e-6
# Thermo output has eight digits: this is its relative rounding.
_DIGITS = 1e-8
# Frames are not predicted where a run has more of them: a step count that is damaged shall not
# exhaust the memory.
_MOST = 10_000_000
# Steps are read as float64, which holds every whole number below this one.
_LARGEST_STEP = 2**53


@dataclass(frozen=True)
class Unrest:
    """How far a scene is from rest at the end of a run, as fix inelastic tells it.

    Attributes
    ----------
    at_rest : whether it counts as at rest
    speed : root mean square speed / that of the velocities that forces from outside give in a step
    net_force : |sum of all forces| / |sum of those from outside|
    """

    at_rest: bool
    speed: float
    net_force: float

    @property
    def words(self) -> str:
        """How fast what moves is, and which part of the weight nothing carries."""
        return f"rms speed {self.speed:.3g} g h, net force {self.net_force:.3g} of the weight"


@dataclass(frozen=True, eq=False)
class Run:
    """One run of a log.

    Attributes
    ----------
    line : of the header of its thermo output, counted from 1
    before : step at which the run before it ended; None where that is not known
    first : its first step
    steps : how many it took; None where the log ends before the run does
    seconds : wall time; None likewise
    atoms : their number at the end; None likewise
    thermo : columns of the thermo output by their names, (k,) each; they have all the same length
    every : lines of thermo output are so many steps apart, 0 for none but the first and the last;
        None where that is not known
    counts : columns of the contacts that a fix inelastic counts, by the place in its vector: 5 for
        those between spheres, 6 for those with walls; none where a format may have cut digits
    unrest : how far its end is from rest; None where no fix inelastic tells it
    """

    line: int
    before: int | None
    first: int
    steps: int | None
    seconds: float | None
    atoms: int | None
    thermo: Mapping[str, FloatArray]
    every: int | None
    counts: Mapping[int, str]
    unrest: Unrest | None

    @property
    def known(self) -> int:
        """The last step of which the log tells."""
        return int(self.thermo["Step"][-1]) if self.steps is None else self.first + self.steps


@dataclass(frozen=True, eq=False)
class Written:
    """The frames that a dump file must hold, as a log tells it.

    Attributes
    ----------
    path : of the file, as the deck names it
    steps : (k,), of its frames
    runs : (k,), number of the run that wrote each, from 0
    slack : by so many steps a frame may be written earlier or later: those that are written at
        times follow from the rounded times of the log
    group : of atoms; None for a dump that chooses among them
    fix : the fix inelastic whose contacts are in it; None where there is none
    """

    path: str
    steps: IntArray
    runs: IntArray
    slack: int
    group: str | None
    fix: str | None


@dataclass(frozen=True, eq=False)
class RunLog:
    """A log of LAMMPS.

    Attributes
    ----------
    path : of the log
    text : all of it
    runs : in their order
    dumps : the files that it names, by their paths: what they must hold, or None where it does not
        tell all about that
    ended : whether it was closed as LAMMPS or the deck does it: not the case while LAMMPS works,
        and where the log was cut off
    too_many : those of the files, by their paths, that must hold more frames than are compared
    """

    path: Path
    text: str
    runs: Sequence[Run]
    dumps: Mapping[str, Written | None]
    ended: bool
    too_many: frozenset[str] = frozenset()

    @property
    def complete(self) -> bool:
        """Whether the last run has ended."""
        return not self.runs or self.runs[-1].steps is not None

    def unrest_at(self, step: int) -> Unrest | None:
        """Return how far the scene is from rest at a step; None where no run that ended tells."""
        told = (run.unrest for run in reversed(self.runs) if run.known == step and run.unrest)
        return next(told, None)

    def names(self, path: Path) -> bool:
        """Say whether the log tells that a dump of this file's name was written."""
        return any(PurePosixPath(name).name == path.name for name in self.dumps)

    def written(self, path: Path) -> Written | None:
        """Return what a dump must hold; None where the log does not tell.

        A folder may have been moved: the file's name decides, which must be there once. Raises
        LogError where the dump must hold more frames than are compared.
        """
        found = [name for name in self.dumps if PurePosixPath(name).name == path.name]
        if len(found) != 1:
            return None
        if found[0] in self.too_many:
            raise LogError(
                self.path, f"tells of more than {_MOST} frames in {path.name}: too many to compare"
            )
        return self.dumps[found[0]]


def read_run_log(path: str | PathLike[str]) -> RunLog:
    """Read a log of LAMMPS with one line of thermo output a step (styles one and custom).

    Raises LogError where the file cannot be read or is none (a folder, a pipe, a device), where a
    number in it is damaged, and where what it tells contradicts itself.
    """
    file = Path(path)
    try:
        with open(file, encoding="utf-8", errors="replace", opener=regular) as log:
            text = log.read()
    except FileNotFoundError:
        raise LogError(file, "no such file") from None
    except OSError as error:
        raise LogError(file, f"cannot be read: {reason_of(error)}") from None
    reader = _Reader(file)
    for number, line in enumerate(text.splitlines(), 1):
        reader.read(line, number)
    reader.close_run(None)
    dumps = {name: reader.written(name) for name in reader.files}
    too_many = frozenset(name for name, one in reader.files.items() if one.too_many)
    return RunLog(file, text, reader.runs, dumps, reader.ended, too_many)


@dataclass
class _Dump:
    """A dump that is defined; `every` or `time` says when it writes, or neither is known."""

    path: str
    group: str | None
    every: int | None
    time: float | None = None
    first: bool = False
    delay: int = 0
    last: int | None = None


@dataclass
class _File:
    """The frames of a dump file; nothing is known of a file that had something in it before."""

    known: bool = True
    too_many: bool = False
    steps: list[int] = field(default_factory=list)
    runs: list[int] = field(default_factory=list)
    slack: int = 0
    group: str | None = None
    fix: str | None = None


@dataclass(frozen=True)
class _End:
    """What the line after a run says: its wall time, its steps, and the atoms at its end."""

    seconds: float
    steps: int
    atoms: int


class _Reader:
    """A reader that goes through the lines of a log, and what it has found so far."""

    def __init__(self, path: Path) -> None:
        self.runs: list[Run] = []
        self.files: dict[str, _File] = {}
        self.ended = False
        self._path = path
        self._dumps: dict[str, _Dump] = {}
        self._step: int | None = None
        self._every: int | None = None
        self._counts: dict[int, str] = {}
        self._fixes: set[str] = set()
        self._cut = False
        self._names: list[str] = []
        self._rows: list[list[float]] = []
        self._unrest: Unrest | None = None
        self._header = 0

    def read(self, line: str, number: int) -> None:
        words = line.split()
        if self._names and words and words[0] in _ANEW:
            # LAMMPS was killed, and another one has gone on with the log and from a restart file.
            self.close_run(None)
            self._forget()
            self._dumps.clear()
            self._step = None
        if words[:1] == ["Step"]:
            self.close_run(None)
            self._names, self._header = words, number
        elif self._names and (loop := _LOOP.match(line)):
            self.close_run(self._end(loop, number))
        elif self._names and (row := _numbers(words, len(self._names))) is not None:
            if _count(words[0]) is None:
                raise LogError(self._path, f"'{shortened(words[0])}' is no step", number)
            self._rows.append(row)
        elif self._names and (told := _UNREST.match(line)):
            self._unrest = self._unrest_of(told, number)
        elif _LOOP.match(line):
            # This run has thermo output of another style: nobody knows where it ended.
            self._step = None
            self._forget()
        elif words and not self._names:
            self._command(words)

    def _end(self, loop: re.Match[str], number: int) -> _End:
        """Return what the line after a run says."""
        seconds, steps, atoms = _real(loop[1]), _count(loop[2]), _count(loop[3])
        if seconds is None or steps is None or atoms is None:
            raise LogError(
                self._path,
                f"'{shortened(loop[0])}' is damaged: it must hold a time, a number of steps and a "
                "number of atoms",
                number,
            )
        return _End(seconds, steps, atoms)

    def _unrest_of(self, told: re.Match[str], number: int) -> Unrest:
        """Return what the summary of the fix says of the end of a run."""
        speed, net_force = _real(told[2]), _real(told[3])
        if speed is None or net_force is None:
            raise LogError(self._path, f"'{shortened(told[0].strip())}' is damaged", number)
        return Unrest(told[1] == "at rest", speed, net_force)

    def close_run(self, end: _End | None) -> None:
        """Keep the run that the thermo output of the last header belongs to, if there is one."""
        if self._rows:
            table = np.array(self._rows).T
            thermo = dict(zip(self._names, table, strict=True))
            run = Run(
                line=self._header,
                before=self._step,
                first=int(thermo["Step"][0]),
                steps=None if end is None else end.steps,
                seconds=None if end is None else end.seconds,
                atoms=None if end is None else end.atoms,
                thermo=thermo,
                every=self._every,
                counts=self._counts_of(self._names),
                unrest=self._unrest,
            )
            self.runs.append(run)
            self._check(run)
            for dump in self._dumps.values():
                self._write(dump, run)
            self._step = run.known
        elif self._names and end is not None:
            raise LogError(self._path, "a run has no line of thermo output", self._header)
        self._names, self._rows, self._unrest = [], [], None

    def written(self, name: str) -> Written | None:
        file = self.files[name]
        if not file.known or not file.steps:
            return None
        steps, runs = np.array(file.steps), np.array(file.runs)
        return Written(name, steps, runs, file.slack, file.group, file.fix)

    def _counts_of(self, names: Sequence[str]) -> dict[int, str]:
        """Return the columns of thermo output that count contacts; none if several fixes do."""
        if len(self._fixes) != 1 or self._cut:
            return {}
        own = {number: f"f_{fix}[{number}]" for fix in self._fixes for number in (5, 6)}
        found = {number: self._counts.get(number, name) for number, name in own.items()}
        return {number: name for number, name in found.items() if name in names}

    def _fix_of(self, columns: Sequence[str]) -> str | None:
        """Return the fix inelastic whose first column, the contacts, is among those of a dump."""
        return next((fix for fix in self._fixes if f"f_{fix}[1]" in columns), None)

    def _check(self, run: Run) -> None:
        """See that a run goes on where the one before has ended, and that no line is missing."""
        if run.before is not None and run.first != run.before:
            raise LogError(
                self._path,
                f"a run begins at step {run.first}, but the one before it ended at step "
                f"{run.before}: a part of the log is missing",
                run.line,
            )
        steps = run.thermo["Step"]
        there = set(steps.astype(np.int64).tolist())
        wanted = _multiples(run.every, run.first, run.known) if run.every else ()
        # The first one that is missing ends the search, however many more a run claims to have.
        missing = next((step for step in wanted if step not in there), None)
        if missing is not None or (np.diff(steps) <= 0).any() or steps[-1] > run.known:
            what = (
                "do not follow one another" if missing is None else f"of step {missing} is missing"
            )
            raise LogError(
                self._path,
                f"{'the lines' if missing is None else 'a line'} of thermo output {what}, in the "
                f"run from step {run.first} to {run.known}",
                run.line,
            )

    def _command(self, words: list[str]) -> None:
        if words[:3] == ["Total", "wall", "time:"]:
            self.ended = True
            return
        if any("$" in word for word in words):
            # The line comes again, with the values in place.
            return
        name, *rest = [word for word in words[: _comment(words)]] or [""]
        self.ended = name in ("quit", "log")
        if name == "reset_timestep" or name in _NEW_STEP:
            self._step = _integer(rest[0]) if name == "reset_timestep" and rest else None
            if name == "clear":
                self._dumps.clear()
            elif name != "reset_timestep":
                self._forget()
        elif name == "thermo" and rest:
            self._every = _integer(rest[0])
        elif name == "thermo_style":
            self._counts.clear()
            self._cut = False
        elif name == "thermo_modify":
            if "every" in rest:
                self._every = None
            self._cut = self._cut or "format" in rest
            for index, word in enumerate(rest[:-2]):
                source = _COUNT.fullmatch(rest[index + 1])
                if word == "colname" and source and source[1] in self._fixes:
                    self._counts[int(source[2])] = rest[index + 2]
        elif name == "fix" and rest[2:3] == ["inelastic"]:
            self._fixes.add(rest[0])
        elif name == "dump" and len(rest) >= 5:
            identity, group, _, every, path = rest[:5]
            self._dumps[identity] = _Dump(path, group, _integer(every))
            self.files[path] = _File(group=group, fix=self._fix_of(rest[5:]))
        elif name == "dump_modify" and rest and rest[0] in self._dumps:
            self._modify(self._dumps[rest[0]], rest[1:])
        elif name == "undump" and rest:
            self._dumps.pop(rest[0], None)
        elif name == "write_dump" and len(rest) >= 3:
            self._write_once(rest)

    def _modify(self, dump: _Dump, words: list[str]) -> None:
        file = self.files[dump.path]
        for word, value in itertools.pairwise(words):
            if word == "every":
                dump.every, dump.time = _integer(value), None
            elif word == "every/time":
                dump.every, dump.time = None, _real(value)
            elif word == "first":
                dump.first = value == "yes"
            elif word in ("region", "thresh"):
                file.group = None
            elif word == "delay" and (step := _integer(value)) is not None:
                dump.delay = step
            elif word in ("append", "delay", "skip") and value != "no":
                file.known = False

    def _forget(self) -> None:
        """Take nothing for known that the dumps write now."""
        for dump in self._dumps.values():
            self.files[dump.path].known = False

    def _write(self, dump: _Dump, run: Run) -> None:
        """Add the frames that a dump has written in a run."""
        file, last = self.files[dump.path], run.known
        found: Sequence[int] | None = None
        if dump.every:
            found = _multiples(dump.every, run.first, last + 1)
        else:
            found = _steps_at_times(run, dump.time) if dump.time and not self._cut else None
            file.slack = 1
        file.too_many |= found is not None and len(found) > _MOST
        if found is None or file.too_many:
            file.known = False
            return
        steps = [*found]
        if dump.first and dump.last is None and steps[:1] != [run.first]:
            steps.insert(0, run.first)
        steps = [step for step in steps if step != dump.last and step >= dump.delay]
        if steps:
            dump.last = steps[-1]
            file.steps += steps
            file.runs += [len(self.runs) - 1] * len(steps)

    def _write_once(self, words: list[str]) -> None:
        """Add the frame of a write_dump: its words are group, style, file and columns."""
        path, append = words[2], " append yes" in " ".join(words)
        new = _File(known=not append, group=words[0], fix=self._fix_of(words[3:]))
        if not append or path not in self.files:
            self.files[path] = new
        file = self.files[path]
        if self._step is None or not self.runs:
            file.known = False
            return
        file.steps.append(self._step)
        file.runs.append(len(self.runs) - 1)


def _multiples(every: int, first: int, end: int) -> range:
    """Return the steps, from a first one and before an end, that a number divides."""
    return range(-(-first // every) * every, end, every)


def _steps_at_times(run: Run, interval: float) -> Sequence[int] | None:
    """Return the steps at which a multiple of a time interval is reached; None if unknown.

    Where there are more than _MOST of them, they are only counted: what is returned has their
    number, and is no list of steps.
    """
    if "Time" not in run.thermo:
        return None
    steps, times = run.thermo["Step"], run.thermo["Time"]
    if run.known > steps[-1]:
        end = at_steps([run.known], steps, times)
        steps, times = np.append(steps, run.known), np.append(times, end)
    # Of a step between two lines.
    length = np.diff(times) / np.diff(steps) if len(steps) > 1 else np.zeros(1)
    if not np.isfinite(times).all() or length.min() < 0:
        return None
    # A dump whose interval is about that of the steps now and then leaves one out.
    if 2 * length.max() > interval:
        return None
    before = np.concatenate([length[:1], length[: len(steps) - 1]])
    near = _SAME_TIME * before + _DIGITS * np.abs(times)
    passed = np.floor((times + near) / interval)
    if passed[-1] - passed[0] > _MOST:
        return range(int(passed[-1] - passed[0]))
    multiples = np.arange(passed[0] + 1, passed[-1] + 1)
    # The line at which a multiple has been passed, and the step since the line before.
    line = np.searchsorted(passed, multiples)
    slope = length[line - 1]
    due = (multiples * interval - _SAME_TIME * slope) / (1 + _DIGITS) - times[line - 1]
    since = np.ceil(np.divide(due, slope, out=np.zeros_like(due), where=slope > 0))
    written = steps[line - 1] + np.clip(since, 1, steps[line] - steps[line - 1])
    # The first time is a multiple of the interval, or lies beyond one already.
    if abs(times[0] - passed[0] * interval) <= near[0]:
        written = np.append(steps[0], written)
    return [int(step) for step in written]


def at_steps(wanted: ArrayLike, steps: FloatArray, values: FloatArray) -> FloatArray:
    """Return what a column was at some steps: linear between two lines, and after the last one.

    The log has no line of the last step of a run that a fix has ended.

    Parameters
    ----------
    wanted : (m,), steps that need not have a line
    steps : (k,), of the lines, ascending
    values : (k,), of the column

    Returns
    -------
    (m,); NaN before the first line, and everywhere where there is none
    """
    where = np.asarray(wanted, dtype=np.float64)
    if len(steps) == 0:
        return np.full(where.shape, np.nan)
    found = np.interp(where, steps, values, left=np.nan)
    beyond = where > steps[-1]
    if beyond.any():
        slope = (values[-1] - values[-2]) / (steps[-1] - steps[-2]) if len(steps) > 1 else np.nan
        found[beyond] = values[-1] + slope * (where[beyond] - steps[-1])
    return found


def _numbers(words: list[str], count: int) -> list[float] | None:
    """Return the numbers of a line of thermo output; None if the line is none."""
    if len(words) != count or not words[0].isdigit():
        return None
    try:
        return [float(word) for word in words]
    except ValueError:
        return None


def _comment(words: list[str]) -> int:
    """Return the number of words before a comment."""
    return next((n for n, word in enumerate(words) if word.startswith("#")), len(words))


def _integer(word: str) -> int | None:
    """Return the whole number that a word is; None if it is none."""
    try:
        return int(word)
    except ValueError:
        return None


def _count(word: str) -> int | None:
    """Return the step or the number of steps or atoms that a word is; None if it is none."""
    value = _integer(word)
    return value if value is not None and value < _LARGEST_STEP else None


def _real(word: str) -> float | None:
    """Return the finite number that a word is; None if it is none."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
