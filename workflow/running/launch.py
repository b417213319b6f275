"""Cases run as processes on one machine: several at a time, each killed with its children.

A case is one process after the other: LAMMPS for each stage, then the measurement. A case that
fails, is killed or takes too long is put aside with its log, and the others go on.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Sequence
from contextlib import ExitStack
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
    """Run and measure those of the cases that have no result yet.

    An interrupt (also SIGTERM and SIGHUP) kills what runs, and is raised as KeyboardInterrupt.
    Raises StudyError if anything stands where a file or a folder of the study should be.
    """
    if obstacles := folder.obstacles(study, cases):
        raise StudyError(obstacles)
    batch = Batch(study, folder, options, display)
    waiting = list(cases)
    jobs: list[_Job] = []
    with interrupts() as interrupted:
        try:
            while waiting or jobs:
                while waiting and len(jobs) < options.at_once and not interrupted:
                    # A job is in the list before it starts anything that must be stopped.
                    jobs.append(_Job(OneCase(waiting.pop(0), batch), display))
                    if not jobs[-1].begin():
                        jobs.pop()
                if interrupted:
                    raise KeyboardInterrupt
                jobs = [job for job in jobs if job.goes_on()]
                time.sleep(POLL)
        finally:
            for job in jobs:
                job.stop()
    return batch.outcome


class _Job:
    """The processes of one case, one after the other; it holds the case's lock."""

    def __init__(self, one: OneCase, display: Display) -> None:
        self._one, self._display = one, display
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
