"""The progress of a study as a user sees it: bars in a terminal, plain lines in a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn
from rich.progress import TimeElapsedColumn as Elapsed

# The steps of running cases are told in a log at most so often [seconds].
EVERY = 60.0


class Display:
    """A display of how a number of cases come on, to be used in a `with`.

    A log gets one line when a case starts, one when it ends, and one a minute in between.
    """

    def __init__(self, cases: int | None, console: Console | None = None) -> None:
        """Show nothing yet.

        Parameters
        ----------
        cases : number of cases; None where several displays share them, as in an MPI job
        console : console on which it is shown; None for the standard output
        """
        self._console = console or Console(stderr=False, soft_wrap=True, highlight=False)
        self._cases = cases
        self._done = 0
        self._told = time.monotonic()
        self._steps: dict[str, tuple[int, int]] = {}
        self._tasks: dict[str, TaskID] = {}
        self._progress: Progress | None = None
        if self._console.is_terminal and cases is not None:
            self._progress = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                Elapsed(),
                console=self._console,
            )
            self._all = self._progress.add_task("cases", total=cases)

    def __enter__(self) -> Self:
        """Begin to show the bars."""
        if self._progress:
            self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the terminal as it was."""
        if self._progress:
            self._progress.stop()

    def say(self, line: str) -> None:
        """Show a line, above the bars in a terminal."""
        clock = "" if self._progress else time.strftime("%H:%M:%S ")
        self._console.print(f"{clock}{line}", markup=False)
        sys.stdout.flush()

    def started(self, case: str, what: str) -> None:
        """Show that a case has started: `what` says whether it runs or is measured."""
        if self._progress:
            self._remove(case)
            self._tasks[case] = self._progress.add_task(f"  {_short(case)}", total=None)
        else:
            self.say(f"{what} {case}")

    def stepped(self, case: str, step: int, steps: int) -> None:
        """Show how far a case has come."""
        self._steps[case] = (step, steps)
        if self._progress and case in self._tasks:
            self._progress.update(self._tasks[case], completed=step, total=steps)
        elif not self._progress and time.monotonic() - self._told > EVERY:
            self._told = time.monotonic()
            for name, (at, last) in self._steps.items():
                self.say(f"  step {at} of {last}: {name}")

    def passed(self, case: str, line: str) -> None:
        """Show that nothing is done with a case; where displays share the cases, show nothing."""
        if self._cases is not None:
            self.ended(case, line)

    def ended(self, case: str, line: str, more: Sequence[str] = ()) -> None:
        """Show that a case is done or has failed; `more` are lines of its log."""
        self._done += 1
        self._remove(case)
        self.say(line if self._cases is None else f"[{self._done}/{self._cases}] {line}")
        for text in more:
            self.say(f"    {text}")
        if self._progress:
            self._progress.update(self._all, completed=self._done)

    def _remove(self, case: str) -> None:
        self._steps.pop(case, None)
        task = self._tasks.pop(case, None)
        if self._progress and task is not None:
            self._progress.remove_task(task)


def _short(name: str, length: int = 60) -> str:
    return name if len(name) <= length else f"{name[:18]}...{name[21 - length :]}"
