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
from ..provenance.run_record import run_record
from ..study import Case, Study
from .folder import Folder
from .launch import (
    Options,
    Outcome,
    in_a_line,
    measure_finished,
    measured_too_long,
    missing_file,
    note_timeout,
    prepare_stage,
)

# A deck that refuses its parameters quits. That would end the process, and all other cases with
# it; an unknown command ends the deck only.
_QUIT = re.compile(r"\bquit\b(?:\s+(\d+))?")
REFUSED, ENDED = "the_deck_has_refused", "the_deck_has_ended"
# LAMMPS prints this when its timer ends a run.
CUT_SHORT = "Wall time limit reached"
# A rank that waits asks again after so long, and does not keep its core busy [seconds].
SLEEP = 0.02
# An abort makes the launcher drop what it has not yet passed on: it gets so long for it [seconds].
HEARD = 0.5
NOTHING, RUN, MEASURE = 0, 1, 2


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
    outcome = Outcome()
    job = world.bcast(uuid.uuid4().hex)
    for case in cases:
        if group.leads:
            try:
                with folder.lock(case) as mine:
                    _lead(mine, study, case, folder, options, group, outcome, display, job)
            except Exception as error:
                if world.size > 1:
                    # After an error such as a full disk, the other ranks would wait for ever.
                    print(
                        f"inelastic: {case.name}: {in_a_line(error)}", file=sys.stderr, flush=True
                    )
                    time.sleep(HEARD)
                    world.Abort(2)
                raise
        elif group.agree(NOTHING) == RUN:
            _run(case, folder.part(case), options, group)
    _Group(world).agree(NOTHING)
    outcomes = world.gather(outcome)
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


def _lead(
    mine: bool,
    study: Study,
    case: Case,
    folder: Folder,
    options: Options,
    group: _Group,
    outcome: Outcome,
    display: Display,
    job: str,
) -> None:
    """Run or measure a case, as far as that is to be done, and note what became of it."""
    if not mine or folder.is_measured(study, case) or folder.failed_in(case, job):
        (outcome.kept if mine else outcome.elsewhere).append(case.name)
        group.agree(NOTHING)
        return
    began = time.time()
    if (reason := _make(study, case, folder, options, group, display)) is not None:
        lines = folder.fail(case, reason, job)
        outcome.failed[case.name] = reason
        display.ended(case.name, f"FAILED ({reason}): {case.name}", lines)
        return
    display.started(case.name, "measuring")
    left = None if options.timeout is None else options.timeout - (time.time() - began)
    try:
        # There is a moment at least, as there may be next to nothing to measure.
        limit = None if left is None else max(left, 0.01)
        reason = measure_finished(study, case, folder, display, limit)
    except subprocess.TimeoutExpired:
        assert options.timeout is not None
        outcome.failed[case.name] = measured_too_long(options.timeout)
        note_timeout(folder.case(case), options.timeout)
        display.ended(case.name, f"CANNOT BE MEASURED (timed out): {case.name}")
        return
    if reason is None:
        outcome.measured.append(case.name)
        display.ended(case.name, f"done in {time.time() - began:.0f} s: {case.name}")
    else:
        outcome.failed[case.name] = reason
        display.ended(case.name, f"CANNOT BE MEASURED: {case.name}", [reason])


def _make(
    study: Study, case: Case, folder: Folder, options: Options, group: _Group, display: Display
) -> str | None:
    """Run a case unless there is a whole run of it; return why it failed, if it did."""
    began = time.time()
    try:
        for line in folder.set_aside(study, case):
            display.say(line)
        finished = folder.is_finished(case)
        if not finished:
            display.started(case.name, "running")
            part = folder.begin(case)
            for stage in range(len(case.stages)):
                prepare_stage(case, stage, part)
    except (WorkflowError, OSError) as error:
        # A file is in the way of this case alone, and the other ranks of the group wait.
        group.agree(NOTHING)
        return in_a_line(error)
    group.agree(MEASURE if finished else RUN)
    if finished:
        return None
    reason = _run(case, part, options, group)
    if reason is not None:
        return reason
    seconds = time.time() - began
    record = run_record(case, case.commands(options.ranks), options.ranks, began, seconds)
    try:
        folder.finish(case, record)
    except (WorkflowError, OSError) as error:
        return in_a_line(error)
    return None


def _run(case: Case, part: Path, options: Options, group: _Group) -> str | None:
    """Run the stages in the case's folder; return on the first rank why they failed, if so."""
    # LAMMPS's module starts MPI if nobody has; here it must find mpi4py's.
    from lammps import MPIAbortException, lammps

    home, began = Path.cwd(), time.time()
    os.chdir(part)
    try:
        for stage, command in enumerate(case.commands()):
            text = Path(f"{case.stages[stage].deck.name}.in").read_text()
            # The variables come after the names of the program, its options and the deck.
            arguments = ["-screen", "screen.out", "-log", "none", *command[4:]]
            engine = lammps(comm=group.ranks, cmdargs=arguments)
            try:
                if options.timeout is not None:
                    # The limit is for all stages together, and LAMMPS takes whole seconds.
                    left = max(1, math.ceil(options.timeout - (time.time() - began)))
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
                    with Path("lmp.out").open("ab") as out:
                        out.write(Path("screen.out").read_bytes())
            late = options.timeout is not None and (
                time.time() - began > options.timeout
                # The deck has gone on with the runs cut short.
                or CUT_SHORT in Path("screen.out").read_text(errors="replace")
            )
            missing = missing_file(case, stage, Path())
            if group.agree(NOTHING if late or missing else RUN) == NOTHING:
                if late:
                    return f"timed out after {options.timeout:g} s"
                return f"ended without writing {missing}"
    finally:
        os.chdir(home)
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
