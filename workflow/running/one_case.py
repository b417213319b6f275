"""ONE case on its way from its lock to its result; its owner runs the processes in between.

    is_to_do      nobody else has the case, and it has no result yet
    begin         its files are put into a folder, unless a whole run is there already
    stage         LAMMPS's command for each stage, in turn; `unwritten` is asked after each
    finish        the run gets its record, check sums and name
    measurement   the command that measures it
    measured      the result is read back; dumps that shall not be kept go

`launch` runs these as processes of their own, `mpi_route` runs LAMMPS in the ranks of an MPI job.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import WorkflowError
from ..progress import Display
from ..provenance.finished import LAST_FILE
from ..provenance.run_record import run_record
from ..study import Case, Study
from . import measuring
from .folder import NOTHING, Folder, Found
from .processes import Command, last_lines

# LAMMPS prints into this file in the folder of a run.
OUTPUT = "lmp.out"


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


@dataclass(frozen=True)
class Batch:
    """What the cases of a study have in common that are run together.

    Attributes
    ----------
    study : their study
    folder : folder in which they run
    options : options with which they run
    display : shows how they come on
    job : name of the MPI job that runs them; empty outside of one
    outcome : takes what becomes of them
    """

    study: Study
    folder: Folder
    options: Options
    display: Display
    job: str = ""
    outcome: Outcome = field(default_factory=Outcome)


class OneCase:
    """One case of a batch, which is locked while this is used.

    Attributes
    ----------
    case : the case
    over : whether nothing is left to do: it was measured, it has failed, or it was not to be done
    """

    def __init__(self, case: Case, batch: Batch) -> None:
        """Do nothing yet."""
        self.case, self.over = case, False
        self._batch, self._folder = batch, batch.folder
        self._measuring = False
        self._found = NOTHING
        self._began = time.time()

    @property
    def lock(self) -> AbstractContextManager[bool]:
        """The lock of the case, to be used in a `with`; it gives whether nobody else holds it."""
        return self._folder.lock(self.case)

    @property
    def part(self) -> Path:
        """Where it runs."""
        return self._folder.part(self.case)

    @property
    def is_measuring(self) -> bool:
        """Whether its run is whole, and only the measurement is left."""
        return self._measuring

    @property
    def seconds(self) -> float:
        """How long it has taken so far, seconds."""
        return time.time() - self._began

    @property
    def is_late(self) -> bool:
        """Whether it has taken longer than it may."""
        limit = self._batch.options.timeout
        return limit is not None and self.seconds > limit

    def is_to_do(self, locked: bool) -> bool:
        """Say whether the case is to be run or measured; note it in the outcome if it is not.

        Parameters
        ----------
        locked : what `lock` has given
        """
        name, batch = self.case.name, self._batch
        if not locked:
            batch.outcome.elsewhere.append(name)
            batch.display.passed(name, f"somebody else runs {name}")
        elif self._look().measured or self._has_failed_here():
            batch.outcome.kept.append(name)
            batch.display.passed(name, f"there already: {name}")
        else:
            return True
        self.over = True
        return False

    def begin(self) -> bool:
        """Make the folder of the run; return False where a whole run is there, to be measured.

        What cannot be read of an earlier result or run is put aside, and shown.
        """
        for line in self._folder.set_aside(self._batch.study, self.case, self._found):
            self._batch.display.say(line)
        if self._folder.is_finished(self.case):
            return False
        self._batch.display.started(self.case.name, "running")
        self._folder.begin(self.case)
        return True

    def stage(self, number: int) -> Command:
        """Return the command of a stage, counted from 0."""
        words = self.case.commands(self._batch.options.ranks)[number]
        return Command(words, self.part, self.part / OUTPUT, anew=False)

    def finish(self) -> None:
        """Give the run, of which all stages have ended well, its record and its name."""
        ranks = self._batch.options.ranks
        commands = self.case.commands(ranks)
        record = run_record(self.case, commands, ranks, self._began, self.seconds)
        self._folder.finish(self.case, record)

    def measurement(self) -> Command:
        """Show that the finished run is measured, and return the command that does so."""
        self._measuring = True
        self._batch.display.started(self.case.name, "measuring")
        study = self._batch.study
        target = self._folder.result(study, self.case)
        outputs = study.outputs.model_dump_json()
        return measuring.command_for(self._run, target, outputs)

    def measured(self, code: int) -> None:
        """Take what the measuring process has left, which has ended with this exit status."""
        batch, name = self._batch, self.case.name
        lines = last_lines(self._run / measuring.OUTPUT)
        # The dumps may go only where the result can be read.
        if code != 0 or not self._look().measured:
            self._leave(measuring.unmeasurable(code, lines, self._run), lines)
            return
        for line in measuring.remarks_in(lines):
            batch.display.say(f"{line}: {name}")
        if batch.study.outputs.keep == "results":
            self._folder.drop_dumps(self.case)
        batch.outcome.measured.append(name)
        batch.display.ended(name, f"done in {self.seconds:.0f} s: {name}")
        self.over = True

    def fail(self, reason: str) -> None:
        """Put the run aside: it has failed."""
        name = self.case.name
        lines = self._folder.fail(self.case, reason, self._batch.job)
        self._batch.outcome.failed[name] = reason
        self._batch.display.ended(name, f"FAILED ({reason}): {name}", lines)
        self.over = True

    def give_up(self) -> None:
        """End a case that takes longer than it may: the run fails, or its measurement does."""
        limit = self._batch.options.timeout
        assert limit is not None
        if self._measuring:
            self._leave(measuring.timed_out(self._run, limit), [])
        else:
            self.fail(f"timed out after {limit:g} s")

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Let this case alone fail where a file is in its way; `over` tells afterwards."""
        try:
            yield
        except BrokenPipeError:
            # Whoever reads what is shown has gone: that ends the study.
            raise
        except (WorkflowError, OSError) as error:
            reason = in_a_line(error)
            if self._measuring:
                self._leave(f"cannot be measured: {reason}", [])
            else:
                self.fail(reason)

    @property
    def _run(self) -> Path:
        return self._folder.case(self.case)

    def _look(self) -> Found:
        """Look what stands in the place of the result: once in the beginning, once in the end."""
        self._found = self._folder.found(self._batch.study, self.case)
        return self._found

    def _has_failed_here(self) -> bool:
        """Say whether another group of ranks of the same job has run it, and it failed."""
        job = self._batch.job
        return bool(job) and self._folder.failed_in(self.case, job)

    def _leave(self, reason: str, lines: Sequence[str]) -> None:
        """Give up measuring; the run is kept."""
        name = self.case.name
        self._batch.outcome.failed[name] = reason
        self._batch.display.ended(name, f"CANNOT BE MEASURED: {name}", lines)
        self.over = True


def unwritten(case: Case, stage: int, part: Path) -> str | None:
    """Return why a stage has failed whose last file is not there; None if it is.

    Parameters
    ----------
    case : case whose stage has ended
    stage : number of the stage, from 0
    part : folder in which the case runs
    """
    if not case.stages[stage].deck.shipped:
        return None
    name = Path(case.folder_of(case.stages[stage])) / LAST_FILE
    return None if (part / name).is_file() else f"ended without writing {name}"


def in_a_line(error: Exception) -> str:
    """Return what an error says as one line."""
    return " ".join(str(error).split())
