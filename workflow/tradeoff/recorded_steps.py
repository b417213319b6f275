"""The recorded steps of a plan: each run with hard contacts made once more, and its steps measured.

Recording takes time: the runs whose times are compared record nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from ..progress import Display
from ..running.folder import Folder
from ..running.launch import run_study
from ..running.one_case import Options
from ..running.run_and_gather import print_outcome
from ..study import Case, Study, stage_of
from .comparison import StepNumbers
from .plan import Plan, Run, command_line, runs_of
from .recorded_states import RECORDING
from .step_errors import StepErrors, errors_in
from .table import TITLE

# The runs that record are in this folder.
STEPS = "steps"
RECORD_EVERY = 10  # steps


@dataclass(frozen=True)
class MeasuredSteps:
    """The errors of all runs of a plan.

    Attributes
    ----------
    errors : errors of runs by their number of ranks and the name of their case
    lost : one line for each run without any
    """

    errors: dict[tuple[int, str], StepErrors] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)

    @property
    def numbers(self) -> StepNumbers:
        """The errors as a comparison takes them."""
        return {
            key: (found.velocity_error, found.force_error) for key, found in self.errors.items()
        }


def measure_all(plan: Plan, out: Path, timeout: float | None) -> MeasuredSteps:
    """Record steps of each run with hard contacts and measure them, unless that was done before.

    Parameters
    ----------
    plan : what is compared
    out : folder of the comparison
    timeout : limit of a run that records, seconds; None for none
    """
    measured = MeasuredSteps()
    hard = [run for run in runs_of(plan) if run.configuration.contacts == "hard"]
    for ranks in plan.ranks:
        runs = [run for run in hard if run.configuration.ranks == ranks]
        _measure(runs, ranks, plan, out, timeout, measured)
    return measured


def _measure(
    runs: list[Run],
    ranks: int,
    plan: Plan,
    out: Path,
    timeout: float | None,
    measured: MeasuredSteps,
) -> None:
    """Measure the runs on one number of ranks."""
    folder = Folder(out / STEPS / f"ranks-{ranks}")
    cases = tuple(recording_case(run) for run in runs)
    study = Study(f"{STEPS}-{ranks}", TITLE, command_line(plan), cases, RECORDING)
    with Display(len(cases)) as display:
        outcome = run_study(study, cases, folder, Options(ranks=ranks, timeout=timeout), display)
    print_outcome(study, outcome)
    lost = {**outcome.failed, **dict.fromkeys(outcome.elsewhere, "somebody else runs it")}
    measured.lost.extend(f"steps left out: {name}: {why}" for name, why in lost.items())
    for run, case in zip(runs, cases, strict=True):
        if not folder.is_measured(study, case):
            continue
        try:
            measured.errors[ranks, run.case.name] = errors_in(folder.case(case))
        except ValueError as error:
            measured.lost.append(f"steps left out: {case.name}: {error}")


def recording_case(run: Run) -> Case:
    """Return the case of a run that also records."""
    *before, settling = run.case.stages
    values = {**settling.values, "record_every": RECORD_EVERY}
    return replace(run.case, stages=(*before, stage_of(settling.deck, values)))
