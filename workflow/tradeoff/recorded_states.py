"""The recorded states of a plan: problems recorded from each start and solved, unless they are."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from ..progress import Display
from ..running.folder import Folder
from ..running.launch import run_study
from ..running.one_case import Options
from ..running.run_and_gather import print_outcome
from ..study import Outputs, Study
from .plan import Plan, command_line, label_of
from .states import (
    MOMENTS,
    Solved,
    problems_of,
    read_states,
    recording_case,
    solve_state,
    write_states,
)
from .table import TITLE

# The study of the recording runs has this name, and so has its folder.
STATES = "states"
# Recorded problems are files of the run.
RECORDING = Outputs(points=10_000, structure=False, evolution=False, keep="everything")


@dataclass(frozen=True)
class Solutions:
    """The solutions of recorded problems.

    Attributes
    ----------
    states : all solutions, start by start
    lost : one line for each start without any
    """

    states: list[Solved] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)


def solve_all(plan: Plan, out: Path, timeout: float | None) -> Solutions:
    """Record problems of each start and solve them, unless that was done before.

    Parameters
    ----------
    plan : what is compared
    out : folder of the comparison
    timeout : limit of a run that records, seconds; None for none
    """
    folder = Folder(out / STATES)
    cases = tuple(recording_case(plan, start) for start in plan.starts)
    study = Study(STATES, TITLE, command_line(plan), cases, RECORDING)
    with Display(len(cases)) as display:
        outcome = run_study(study, cases, folder, Options(timeout=timeout), display)
    print_outcome(study, outcome)
    solutions = Solutions()
    solutions.lost.extend(f"left out: {name}: {why}" for name, why in outcome.failed.items())
    solutions.lost.extend(f"left out: {name}: somebody else runs it" for name in outcome.elsewhere)
    with Display(None) as display:
        for start, case in zip(plan.starts, cases, strict=True):
            if not folder.is_measured(study, case):
                continue
            run = folder.case(case)
            solved = _solved_before(run)
            left = [moment for moment in MOMENTS if moment not in solved]
            try:
                # What is solved needs neither the log of its run nor its problem.
                problems = problems_of(run, left) if left else {}
                for moment, problem in problems.items():
                    display.say(f"solves {case.name}, {moment}")
                    solved[moment] = list(solve_state(label_of(start), moment, problem))
                    write_states(_file(run, moment), solved[moment])
            except ValueError as error:
                solutions.lost.append(f"left out: {case.name}: {error}")
            solutions.states.extend(one for moment in MOMENTS for one in solved.get(moment, ()))
    return solutions


def _solved_before(run: Path) -> dict[str, list[Solved]]:
    """Return the solutions that there are in the folder of a run, by their moments."""
    solved = {}
    for moment in MOMENTS:
        with suppress(ValueError):
            solved[moment] = read_states(_file(run, moment))
    return solved


def _file(run: Path, moment: str) -> Path:
    return run / f"solved-{moment}.json"
