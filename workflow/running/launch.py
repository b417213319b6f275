"""Cases run as processes on one machine: several at a time, each killed with its children.

A case is one process after the other: LAMMPS for each stage, then the measurement. A case that
fails, is killed or takes too long is put aside with its log, and the others go on.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from ..errors import StudyError
from ..progress import Display
from ..study import Case, Study, steps_of
from .folder import Folder
from .one_case import OUTPUT, Batch, OneCase, Options, Outcome, unwritten
from .processes import POLL, exit_reason, interrupts, kill_group, last_lines, start

# The step of a run is read from its output at most so often [seconds].
READ_EVERY = 1.0


def run_study(
    study: Study, cases: Sequence[Case], folder: Folder, options: Options, display: Display
) -> Outcome:
    """Run and measure those of the cases that have no result yet, as `run_together` does."""
    one = Together(Batch(study, folder, options, display), cases)
    run_together([one])
    return one.batch.outcome


@dataclass(frozen=True)
class Together:
    """Some cases of a study, to be run together with those of others.

    Attributes
    ----------
    batch : their study, and how they run; it takes what becomes of them
    cases : the cases
    begins : called before the first of them
    ends : called when nothing is left to do of them
    """

    batch: Batch
    cases: Sequence[Case]
    begins: Callable[[], None] = lambda: None
    ends: Callable[[], None] = lambda: None


def run_together(studies: Sequence[Together]) -> None:
    """Run and measure those of the cases that have no result yet, as many at a time as may be.

    A case of a later study begins before the last one of an earlier study has ended. Where two
    studies share a run, the second one waits for it. An interrupt (also SIGTERM and SIGHUP) kills
    what runs, and is raised as KeyboardInterrupt. Raises StudyError if anything stands where a file
    or a folder of a study should be.
    """
    for one in studies:
        if obstacles := one.batch.folder.obstacles(one.batch.study, one.cases):
            raise StudyError(obstacles)
    with interrupts() as interrupted:
        pool = _Pool(studies)
        try:
            while pool.has_any():
                pool.fill(interrupted)
                if interrupted:
                    raise KeyboardInterrupt
                pool.look()
                time.sleep(POLL)
        finally:
            pool.stop()


class _Pool:
    """The cases of some studies: those that wait for their turn, and the jobs that run."""

    def __init__(self, studies: Sequence[Together]) -> None:
        self._jobs: list[_Job] = []
        self._left = {id(one): len(one.cases) for one in studies}
        self._waiting = [(one, case) for one in studies for case in one.cases]
        self._begun: set[int] = set()
        for one in studies:
            if not one.cases:
                one.ends()

    def has_any(self) -> bool:
        """Say whether anything is left to do."""
        return bool(self._waiting or self._jobs)

    def fill(self, interrupted: Sequence[int]) -> None:
        """Start as many cases as may run beside those that do."""
        while not interrupted and (turn := self._next()) is not None:
            study, case = self._waiting.pop(turn)
            if id(study) not in self._begun:
                self._begun.add(id(study))
                study.begins()
            # A job is in the list before it starts anything that must be stopped.
            self._jobs.append(_Job(study, case))
            if not self._jobs[-1].begin():
                self._end(self._jobs.pop())

    def look(self) -> None:
        """Let jobs go on whose processes have ended, and take out what is over."""
        over = [job for job in self._jobs if not job.goes_on()]
        self._jobs = [job for job in self._jobs if job not in over]
        for job in over:
            self._end(job)

    def stop(self) -> None:
        """Kill what runs."""
        for job in self._jobs:
            job.stop()

    def _next(self) -> int | None:
        """Return the place of the next case; None if none may start now."""
        if not self._waiting or len(self._jobs) >= self._waiting[0][0].batch.options.at_once:
            return None
        running = {job.case.name for job in self._jobs}
        names = [case.name for _, case in self._waiting]
        return next((turn for turn, name in enumerate(names) if name not in running), None)

    def _end(self, job: _Job) -> None:
        self._left[id(job.study)] -= 1
        if self._left[id(job.study)] == 0:
            job.study.ends()


class _Job:
    """The processes of one case, one after the other; it holds the case's lock."""

    def __init__(self, study: Together, case: Case) -> None:
        self.study, self.case = study, case
        self._one, self._display = OneCase(case, study.batch), study.batch.display
        self._stage = 0
        self._process: subprocess.Popen[bytes] | None = None
        self._last_read = 0.0
        self._held = ExitStack()

    def begin(self) -> bool:
        """Start the first process; return False if nothing is to be done, or it has failed."""
        one = self._one
        if one.is_to_do(self._held.enter_context(one.lock)):
            with one.alone():
                self._process = start(one.stage(0) if one.begin() else one.measurement())
        return self._is_left()

    def goes_on(self) -> bool:
        """Start the next process when one has ended; return False after the last."""
        with self._one.alone():
            try:
                self._look()
            except Exception:
                # What runs in the folder ends before that is put aside.
                self._kill()
                raise
        return self._is_left()

    def stop(self) -> None:
        """Kill what runs, and give the case free."""
        self._kill()
        self._held.close()

    def _is_left(self) -> bool:
        if self._one.over:
            self.stop()
        return not self._one.over

    def _kill(self) -> None:
        if self._process is not None:
            kill_group(self._process)
            self._process = None

    def _look(self) -> None:
        """Go on if the process has ended, give the case up if it is late."""
        assert self._process is not None
        code = self._process.poll()
        if code is not None:
            # It may have left processes behind, such as an lmp whose launcher was killed.
            self._kill()
            self._take(code)
        elif self._one.is_late:
            self._kill()
            self._one.give_up()
        else:
            self._show_step()

    def _take(self, code: int) -> None:
        """Take the exit status of a process, and start the next one if there is one."""
        one = self._one
        if one.is_measuring:
            one.measured(code)
        elif code != 0:
            one.fail(exit_reason(code))
        elif reason := unwritten(one.case, self._stage, one.part):
            one.fail(reason)
        elif self._stage + 1 < len(one.case.stages):
            self._stage += 1
            self._process = start(one.stage(self._stage))
        else:
            one.finish()
            self._process = start(one.measurement())

    def _show_step(self) -> None:
        """Show how far LAMMPS has come, if that was not shown a moment ago."""
        if self._one.is_measuring or time.monotonic() - self._last_read < READ_EVERY:
            return
        self._last_read = time.monotonic()
        steps = steps_of(self._one.case.stages[self._stage])
        # The log would not do: a deck that opens another one has it buffered.
        if steps and (step := step_of(self._one.part / OUTPUT)) is not None:
            self._display.stepped(self._one.case.name, min(step, steps), steps)


def step_of(output: Path) -> int | None:
    """Return the step in LAMMPS's last line of thermo output."""
    for line in reversed(last_lines(output, 40)):
        word, _, rest = line.strip().partition(" ")
        if word.isdigit() and rest.strip()[:1] in "-0123456789":
            return int(word)
    return None
