"""LAMMPS run beside Python: how far it is, its errors as one line, stopped by an interrupt."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ..decks import Value
from ..errors import PackingError
from ..files import write_text
from ..provenance.finished import CONTACTS, LAST_FILE, PARTICLES
from ..running.processes import POLL, Command, exit_reason, interrupts, kill_group, start
from ..shipped import PACK, deck_text

OUTPUT = "lmp.out"
# Where there is no bar, a line is printed for each phase, and so often during one [seconds].
EVERY = 60.0
# The deck prints these before its phases; the steps count from the second one on.
_PHASE = re.compile(rb"^Phase: (.+)$")
_STEP = re.compile(rb"^\s*(\d+)\s+[-\d]")
# Where in LAMMPS's sources an error was found.
_SOURCE = re.compile(r"\s*\([\w/.]+\.(?:cpp|h):\d+\)$")


@dataclass(frozen=True)
class Scene:
    """What is run, as it is shown.

    Attributes
    ----------
    what, container : what is packed in what, in words
    steps : of all phases together
    """

    what: str
    container: str
    steps: int


def run_deck(
    folder: Path, values: Mapping[str, Value], scene: Scene, *, ranks: int, progress: bool
) -> None:
    """Run the deck of `pack` in a folder, in which the files are that it reads.

    An interrupt (also SIGTERM and SIGHUP) stops LAMMPS, and is raised as KeyboardInterrupt.

    Parameters
    ----------
    folder : where LAMMPS works and writes
    values : parameters of the deck that are not its defaults
    scene : what is run
    ranks : number of MPI ranks
    progress : whether to show how far it is

    Raises PackingError with LAMMPS's line if it fails.
    """
    write_text(folder / f"{PACK}.in", deck_text(PACK))
    command = ["lmp", "-nonbuf", "-in", f"{PACK}.in", "-var", "out", "."]
    for name, value in values.items():
        command += ["-var", name, value if isinstance(value, str) else repr(value)]
    if ranks > 1:
        command = ["mpiexec", "-bind-to", "core", "-n", str(ranks), *command]
    with interrupts() as interrupted:
        code = _run(command, folder, _Shown(scene, visible=progress), interrupted)
    if interrupted:
        raise KeyboardInterrupt(f"LAMMPS is stopped, and nothing is left of {scene.what}")
    if code != 0:
        raise PackingError(
            f"LAMMPS could not pack {scene.what} in {scene.container}: "
            f"{_reason(folder / OUTPUT, code)}"
        )
    for name in (PARTICLES, CONTACTS, LAST_FILE):
        if not (folder / name).is_file():
            raise PackingError(
                f"LAMMPS ended without writing {name}: is there room in {folder.parent}?"
            )


def _run(command: list[str], folder: Path, shown: _Shown, interrupted: list[int]) -> int:
    """Run a command until it ends or is interrupted; return its exit status."""
    try:
        # An interrupt at the keyboard does not reach LAMMPS, and leaves no bar behind.
        process = start(Command(command, folder, folder / OUTPUT))
    except FileNotFoundError:
        raise PackingError(
            f"there is no program {command[0]} beside {sys.executable} or on PATH"
        ) from None
    try:
        with shown, (folder / OUTPUT).open("rb") as printed:
            while process.poll() is None and not interrupted:
                shown.read(printed.readlines())
                time.sleep(POLL)
            shown.read(printed.readlines())
    finally:
        kill_group(process)
    return process.returncode


class _Shown:
    """How far LAMMPS is: a bar in a terminal or a notebook, otherwise a line now and then."""

    def __init__(self, scene: Scene, *, visible: bool) -> None:
        """Show nothing yet."""
        self._what, self._steps, self._visible = scene.what, scene.steps, visible
        self._phase, self._step, self._told = "start", 0, time.monotonic()
        self._bar: Progress | None = None
        console = Console(stderr=True, soft_wrap=True, highlight=False)
        self._console = console
        if visible and (console.is_terminal or (console.is_jupyter and _has_widgets())):
            columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
            self._bar = Progress(*columns, TimeElapsedColumn(), console=console, transient=True)
            self._task = self._bar.add_task(self._line, total=self._steps)

    def __enter__(self) -> Self:
        """Begin to show it."""
        if self._bar:
            self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the terminal as it was."""
        if self._bar:
            self._bar.stop()

    def read(self, lines: list[bytes]) -> None:
        """Show what some lines that LAMMPS has printed tell."""
        before = self._phase
        for line in lines:
            if phase := _PHASE.match(line):
                self._phase = phase[1].decode().strip()
            elif (row := _STEP.match(line)) and self._phase not in ("start", "push apart"):
                self._step = min(max(self._step, int(row[1])), self._steps)
        if self._bar:
            self._bar.update(self._task, description=self._line, completed=self._step)
        elif self._visible and (self._phase != before or time.monotonic() - self._told > EVERY):
            self._told = time.monotonic()
            print(f"{self._line}, step {self._step} of {self._steps}", file=sys.stderr, flush=True)

    @property
    def _line(self) -> str:
        return f"{self._what}: {self._phase}"


def _has_widgets() -> bool:
    """Say whether a notebook can draw a bar: without these rich warns in place of one."""
    return find_spec("ipywidgets") is not None


def _reason(output: Path, code: int) -> str:
    """Return LAMMPS's own line about an error, or how it ended."""
    for line in output.read_text(errors="replace").splitlines():
        if line.startswith("ERROR"):
            return _SOURCE.sub("", line.partition(":")[2].strip())
    return exit_reason(code)
