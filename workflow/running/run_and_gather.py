"""The cases of a study run, its results gathered in one file, and what became of them printed."""

from __future__ import annotations

from collections.abc import Sequence

from ..progress import Display
from ..provenance.run_record import differs
from ..results.store import StoredStudy, write_studies
from ..study import Case, Study
from .folder import Folder
from .gather import other_code, results_of
from .launch import run_study
from .one_case import Options, Outcome


def run_and_gather(
    study: Study,
    cases: Sequence[Case],
    folder: Folder,
    options: Options,
    *,
    in_job: bool = False,
) -> Outcome:
    """Run the cases of a study, gather its results, and print what became of them.

    Parameters
    ----------
    study : study whose results are gathered
    cases : cases of the study that are run
    folder : folder in which studies run
    options : options with which the cases are run
    in_job : whether the ranks of an MPI job, each of which calls this, run them
    """
    first = True
    with Display(None if in_job else len(cases)) as display:
        if in_job:
            from mpi4py import MPI

            from .mpi_route import run_in_job

            first = MPI.COMM_WORLD.rank == 0
            outcome = run_in_job(study, cases, folder, options, display)
        else:
            outcome = run_study(study, cases, folder, options, display)
    if first:
        print_outcome(study, outcome)
        file = folder.root / f"{study.name}.h5"
        with folder.gathering():
            found = list(results_of(study, folder))
            results = [result for _, result in found]
            write_studies(file, [StoredStudy(study.name, study.title, study.text, results)])
        if other := sum(bool(differs(case, result.record)) for case, result in found):
            print(other_code(other, folder.result_folder(study)))
        print(f"results: {file}")
    return outcome


def print_outcome(study: Study, outcome: Outcome) -> None:
    """Print what became of a study's cases, and why some failed."""
    parts = [
        (len(outcome.measured), "done"),
        (len(outcome.kept), "there before"),
        (len(outcome.elsewhere), "run by somebody else"),
        (len(outcome.failed), "failed"),
    ]
    print(f"{study.name}: " + (", ".join(f"{n} {what}" for n, what in parts if n) or "nothing"))
    for name, reason in outcome.failed.items():
        print(f"  failed: {name}: {reason}")
