"""Cases run as processes on one machine: several at a time, each killed with its children.

A case is one process after the other: LAMMPS for each stage, then the measurement. A case that
fails, is killed or takes too long is put aside with its log, and the others go on.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from ..errors import StudyError, WorkflowError
from ..progress import Display
from ..provenance.finished import NOT_WHOLE, REMARKS
from ..provenance.run_record import run_record
from ..study import Case, Study, steps_of
from .folder import MARK, Folder, last_lines

POLL = 0.05
# The step of a run is read from its output at most so often [seconds].
READ_EVERY = 1.0
# The measuring process prints into this file: what went wrong, or what the result lacks.
MEASURED = "measure.out"
# Our own decks write this file last.
LAST_FILE = "packing.restart"
# An MPI job around us sets variables of these names: an lmp that sees them takes itself for one of
# its ranks.
_OF_MPI = re.compile(r"^(PMI|PMIX|HYDI|HYDRA|MPI|MPIR)_")


@dataclass(frozen=True)
class Options:
    """The options with which cases are run.

    Attributes
    ----------
    at_once : number of cases at a time
    ranks : number of MPI ranks of each
    timeout : limit for all of a case's stages and measuring together, seconds; None for none
    """

    at_once: int = 1
    ranks: int = 1
    timeout: float | None = None


@dataclass
class Outcome:
    """The outcome of running cases, by their names.

    Attributes
    ----------
    measured : cases that were measured now
    kept : cases that had been measured before
    failed : cases that have failed, with the reason
    elsewhere : cases that somebody else runs at the moment
    """

    measured: list[str] = field(default_factory=list)
    kept: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    elsewhere: list[str] = field(default_factory=list)


def run_study(
    study: Study, cases: Sequence[Case], folder: Folder, options: Options, display: Display
) -> Outcome:
    """Run and measure those of the cases that have no result yet.

    An interrupt (also SIGTERM and SIGHUP) kills what runs, and is raised as KeyboardInterrupt.
    Raises StudyError if anything stands where a file or a folder of the study should be.
    """
    if obstacles := folder.obstacles(study, cases):
        raise StudyError(obstacles)
    outcome = Outcome()
    waiting = list(cases)
    jobs: list[_Job] = []
    with interrupts() as interrupted:
        try:
            while waiting or jobs:
                while waiting and len(jobs) < options.at_once and not interrupted:
                    # A job is in the list before it starts anything that must be stopped.
                    jobs.append(_Job(study, waiting.pop(0), folder, options))
                    if not jobs[-1].begin(outcome, display):
                        jobs.pop()
                if interrupted:
                    raise KeyboardInterrupt
                jobs = [job for job in jobs if job.goes_on(outcome, display)]
                time.sleep(POLL)
        finally:
            for job in jobs:
                job.stop()
    return outcome


class _Job:
    """One case on its way through its processes; it holds the case's lock."""

    def __init__(self, study: Study, case: Case, folder: Folder, options: Options) -> None:
        self._study, self._case, self._folder, self._options = study, case, folder, options
        self._commands = case.commands(options.ranks)
        self._stage = 0
        self._measuring = False
        self._process: subprocess.Popen[bytes] | None = None
        self._started = time.time()
        self._last_read = 0.0
        self._held = ExitStack()

    def begin(self, outcome: Outcome, display: Display) -> bool:
        """Start the case; return False if there is nothing to do, or somebody else does it."""
        name = self._case.name
        if not self._held.enter_context(self._folder.lock(self._case)):
            outcome.elsewhere.append(name)
            display.ended(name, f"somebody else runs {name}")
        elif self._folder.is_measured(self._study, self._case):
            outcome.kept.append(name)
            display.ended(name, f"there already: {name}")
        else:
            return self._unless_it_fails(self._start, outcome, display)
        self._held.close()
        return False

    def goes_on(self, outcome: Outcome, display: Display) -> bool:
        """Start the next process when one has ended; return False after the last."""
        return self._unless_it_fails(self._go_on, outcome, display)

    def _unless_it_fails(
        self, step: Callable[[Outcome, Display], bool], outcome: Outcome, display: Display
    ) -> bool:
        """Take a step of the case; where a file is in its way, this case alone fails."""
        try:
            return step(outcome, display)
        except BrokenPipeError:
            # Whoever reads what is shown has gone: that ends the study.
            raise
        except (WorkflowError, OSError) as error:
            if self._process is not None:
                kill_group(self._process)
            reason = in_a_line(error)
            if self._measuring:
                return self._leave(f"cannot be measured: {reason}", [], outcome, display)
            return self._fail(reason, outcome, display)

    def _start(self, outcome: Outcome, display: Display) -> bool:
        for line in self._folder.set_aside(self._study, self._case):
            display.say(line)
        self._measuring = self._folder.is_finished(self._case)
        display.started(self._case.name, "measuring" if self._measuring else "running")
        if self._measuring:
            self._measure()
        else:
            self._folder.begin(self._case)
            self._run()
        return True

    def _go_on(self, outcome: Outcome, display: Display) -> bool:
        assert self._process is not None
        name, code = self._case.name, self._process.poll()
        if code is None:
            limit = self._options.timeout
            if limit is not None and self._seconds > limit:
                kill_group(self._process)
                reason = f"timed out after {limit:g} s"
                if not self._measuring:
                    return self._fail(reason, outcome, display)
                note_timeout(self._folder.case(self._case), limit)
                return self._leave(measured_too_long(limit), [], outcome, display)
            self._show_step(display)
            return True
        # It may have left processes behind, such as an lmp whose launcher was killed.
        kill_group(self._process)
        if self._measuring:
            lines = last_lines(self._folder.case(self._case) / MEASURED)
            if code == 0 and self._folder.is_measured(self._study, self._case):
                show_remarks(name, lines, display)
                if self._study.outputs.keep == "results":
                    self._folder.drop_dumps(self._case)
                outcome.measured.append(name)
                display.ended(name, f"done in {self._seconds:.0f} s: {name}")
                self._held.close()
                return False
            reason = unmeasurable(code, lines, self._folder.case(self._case))
            return self._leave(reason, lines, outcome, display)
        if code != 0:
            return self._fail(exit_reason(code), outcome, display)
        if missing := missing_file(self._case, self._stage, self._folder.part(self._case)):
            return self._fail(f"ended without writing {missing}", outcome, display)
        self._stage += 1
        if self._stage < len(self._commands):
            self._run()
            return True
        record = run_record(
            self._case, self._commands, self._options.ranks, self._started, self._seconds
        )
        self._folder.finish(self._case, record)
        self._measuring = True
        display.started(name, "measuring")
        self._measure()
        return True

    def stop(self) -> None:
        """Kill what runs, and give the case free."""
        if self._process is not None:
            kill_group(self._process)
        self._held.close()

    @property
    def _seconds(self) -> float:
        return time.time() - self._started

    def _run(self) -> None:
        part = self._folder.part(self._case)
        prepare_stage(self._case, self._stage, part)
        self._launch(self._commands[self._stage], part, part / "lmp.out")

    def _measure(self) -> None:
        case = self._folder.case(self._case)
        self._launch(measuring(self._study, self._case, self._folder), case, case / MEASURED)

    def _launch(self, command: list[str], where: Path, output: Path) -> None:
        with output.open("ab" if output.name != MEASURED else "wb") as file:
            self._process = subprocess.Popen(
                command,
                cwd=where,
                env=environment(),
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                # A signal to a group of its own reaches the lmp behind the launcher too.
                start_new_session=True,
            )

    def _fail(self, reason: str, outcome: Outcome, display: Display) -> bool:
        name = self._case.name
        lines = self._folder.fail(self._case, reason)
        outcome.failed[name] = reason
        display.ended(name, f"FAILED ({reason}): {name}", lines)
        self._held.close()
        return False

    def _leave(self, reason: str, lines: Sequence[str], outcome: Outcome, display: Display) -> bool:
        """Give up measuring; the run is kept."""
        name = self._case.name
        outcome.failed[name] = reason
        display.ended(name, f"CANNOT BE MEASURED: {name}", lines)
        self._held.close()
        return False

    def _show_step(self, display: Display) -> None:
        """Show how far LAMMPS has come, if that was not shown a moment ago."""
        if self._measuring or time.monotonic() - self._last_read < READ_EVERY:
            return
        self._last_read = time.monotonic()
        stage = self._case.stages[self._stage]
        steps = steps_of(stage)
        # The log would not do: a deck that opens another one has it buffered.
        output = self._folder.part(self._case) / "lmp.out"
        if steps and (step := step_of(output)) is not None:
            display.stepped(self._case.name, min(step, steps), steps)


def in_a_line(error: Exception) -> str:
    """Return what an error says as one line."""
    return " ".join(str(error).split())


def measuring(study: Study, case: Case, folder: Folder) -> list[str]:
    """Return the command that measures a finished run, in the case's folder."""
    target = folder.result(study, case).resolve()
    module = "lammps_inelastic.workflow.results.measure"
    return [sys.executable, "-m", module, ".", str(target), study.outputs.model_dump_json()]


def unmeasurable(code: int, lines: Sequence[str], folder: Path) -> str:
    """Say why a finished run gives no result, and what to do about it.

    Parameters
    ----------
    code : exit status of the measuring process
    lines : what it has printed
    folder : folder of the run
    """
    reason = failure_in(lines)
    if code == NOT_WHOLE:
        return f"cannot be measured: {reason}; delete {folder} to run it again"
    if not reason:
        # Without room the process could not even say so.
        full = f"{folder}: nothing can be written there: the disk is full, or read-only"
        reason = exit_reason(code) if _is_room_in(folder) else full
    return f"cannot be measured: {reason}; the run is kept, and is measured the next time"


def _is_room_in(folder: Path) -> bool:
    """Say whether a file can be written in a folder."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"0")
            file.flush()
    except OSError:
        return False
    return True


def note_timeout(case: Path, limit: float) -> None:
    """Leave a note for `status` in the folder of a run, if there is room for one."""
    with suppress(OSError):
        (case / MEASURED).write_text(f"timed out after {limit:g} s\n")


def measured_too_long(limit: float) -> str:
    """Say that measuring has been given up, and what to do about it."""
    return (
        f"cannot be measured: timed out after {limit:g} s; the run is kept, and is measured the "
        "next time if --timeout allows"
    )


def failure_in(lines: Sequence[str]) -> str:
    """Return the line in which the measuring process says what went wrong; empty if none does."""
    return next((line for line in reversed(lines) if not line.startswith(REMARKS)), "")


def show_remarks(case: str, lines: Iterable[str], display: Display) -> None:
    """Show those lines of the measuring process in which it says what to know of a result."""
    for line in lines:
        if line.startswith(REMARKS):
            display.say(f"{line}: {case}")


def measure_finished(
    study: Study, case: Case, folder: Folder, display: Display, limit: float | None = None
) -> str | None:
    """Measure a finished run, and wait for it; return why there is no result, None if there is.

    Raises TimeoutExpired of subprocess if it takes longer than the limit [seconds].
    """
    where = folder.case(case)
    done = subprocess.run(
        measuring(study, case, folder),
        cwd=where,
        env=environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=limit,
    )
    lines = done.stderr.splitlines()
    if done.returncode == 0 and folder.is_measured(study, case):
        show_remarks(case.name, lines, display)
        if study.outputs.keep == "results":
            folder.drop_dumps(case)
        return None
    return unmeasurable(done.returncode, lines, where)


def prepare_stage(case: Case, stage: int, part: Path) -> None:
    """Make the folder that a stage writes to."""
    (part / case.folder_of(case.stages[stage])).mkdir(exist_ok=True)


def missing_file(case: Case, stage: int, part: Path) -> str | None:
    """Name the file that a stage should have written last; None if it is there."""
    if not case.stages[stage].deck.shipped:
        return None
    name = Path(case.folder_of(case.stages[stage])) / LAST_FILE
    return None if (part / name).is_file() else str(name)


def exit_reason(code: int) -> str:
    """Return in words how a process ended that did not end well."""
    # The launcher of LAMMPS hands on a signal as an exit status of 256 less its number.
    number = -code if code < 0 else 256 - code if code > 192 else 0
    if number:
        try:
            return f"killed by {signal.Signals(number).name}"
        except ValueError:
            pass
    return f"exit status {code}"


def step_of(output: Path) -> int | None:
    """Return the step in LAMMPS's last line of thermo output."""
    for line in reversed(last_lines(output, 40)):
        word, _, rest = line.strip().partition(" ")
        if word.isdigit() and rest.strip()[:1] in "-0123456789":
            return int(word)
    return None


def cores() -> int:
    """Return how many cores there are for this process."""
    return len(os.sched_getaffinity(0))


def environment() -> dict[str, str]:
    """Return the environment for a process of a case: its lmp first, one thread, no MPI job."""
    variables = {name: v for name, v in os.environ.items() if not _OF_MPI.match(name)}
    variables["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{variables.get('PATH', '')}"
    return variables | {"OMP_NUM_THREADS": "1", MARK: "1"}


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """Kill a process that leads a group, and all of the group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@contextmanager
def interrupts() -> Iterator[list[int]]:
    """Collect interrupts, SIGTERM and SIGHUP in a list, in the place of what they do else.

    Nothing is cut short by them: an exception at any place could leave a process behind that has
    just been started, and a second one those that were still to be stopped. A signal that is
    ignored, as SIGHUP under nohup, stays so. Only the main thread of Python may take signals: in
    another one nothing is collected.
    """
    seen: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        seen.append(number)

    in_main = threading.current_thread() is threading.main_thread()
    before: dict[int, Any] = {}
    for number in map(int, (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)):
        if in_main and signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, note)
    try:
        yield seen
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
