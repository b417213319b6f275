"""The settling runs of a plan: those that are missing are run, one at a time, and all are read."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..progress import Display
from ..results.store import Result, read_result, write_studies
from ..running.folder import Folder
from ..running.gather import gather_results
from ..running.launch import run_study
from ..running.one_case import Options
from ..running.run_and_gather import print_outcome
from ..study import Outputs, Study
from .plan import Plan, Run, command_line, runs_of
from .table import TITLE

STORE = "tradeoff.h5"
# Only the result of a run is kept: the dumps of many would fill a disk. Random points are not
# needed where the exact packing fraction is known.
OUTPUTS = Outputs(points=10_000, structure=False, keep="results")


@dataclass(frozen=True, eq=False)
class Settled:
    """What has come of the runs of a plan.

    Attributes
    ----------
    results : runs with their results
    failed : runs that have failed, by the names of their cases, with the reason
    elsewhere : cases that somebody else runs
    """

    results: list[tuple[Run, Result]] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    elsewhere: list[str] = field(default_factory=list)

    @property
    def left_out(self) -> list[str]:
        """One line for each run without a result."""
        return [
            *(f"left out: {name}: {reason}" for name, reason in self.failed.items()),
            *(f"left out: {name}: somebody else runs it" for name in self.elsewhere),
        ]

    @property
    def before_accuracy(self) -> list[str]:
        """One line if some results are of a version whose deck did not set the accuracy."""
        hard = [(run, one) for run, one in self.results if run.configuration.contacts == "hard"]
        number = sum("accuracy" not in result.variables for _, result in hard)
        if not number:
            return []
        return [
            f"accuracy not known: {number} of {len(hard)} runs with hard contacts are of a version "
            "whose settling.in left the accuracy to the fix; another folder (--out) runs them "
            "with that of the table"
        ]


def run_all(plan: Plan, out: Path, timeout: float | None) -> Settled:
    """Run what has no result yet, one run at a time, and write all results to one file.

    Parameters
    ----------
    plan : what is to be run
    out : folder of the comparison
    timeout : limit of a run, seconds; None for none
    """
    settled, stored, runs = Settled(), [], runs_of(plan)
    for ranks in plan.ranks:
        chosen = [one for one in runs if one.configuration.ranks == ranks]
        folder = Folder(out / f"ranks-{ranks}")
        cases = tuple(one.case for one in chosen)
        study = Study(folder.root.name, TITLE, command_line(plan), cases, OUTPUTS)
        with Display(len(cases)) as display:
            # Runs beside each other would take each other's time.
            options = Options(at_once=1, ranks=ranks, timeout=timeout)
            outcome = run_study(study, cases, folder, options, display)
        print_outcome(study, outcome)
        settled.failed.update(outcome.failed)
        settled.elsewhere.extend(outcome.elsewhere)
        settled.results.extend(
            (one, read_result(folder.result(study, one.case)))
            for one in chosen
            if folder.is_measured(study, one.case)
        )
        stored.append(gather_results(study, folder))
    write_studies(out / STORE, stored)
    return settled
