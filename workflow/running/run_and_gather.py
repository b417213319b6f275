"""The cases of studies run, the results of each gathered in one file, what came of them printed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from ..progress import Display
from ..provenance.run_record import differs
from ..results.store import StoredStudy, write_studies
from ..study import Case, Study
from .folder import Folder
from .gather import other_code, results_of
from .launch import Together, run_together
from .one_case import Batch, Options, Outcome


def run_and_gather(
    choices: Sequence[tuple[Study, Sequence[Case]]],
    folder: Folder,
    options: Options,
    *,
    in_job: bool = False,
) -> list[Outcome]:
    """Run cases of studies, gather the results of each, and print what became of its cases.

    Parameters
    ----------
    choices : studies whose results are gathered, and the cases of each that are run
    folder : folder in which studies run
    options : options with which the cases are run
    in_job : whether the ranks of an MPI job, each of which calls this, run them
    """
    if in_job:
        return [_run_in_job(study, cases, folder, options) for study, cases in choices]
    with Display(sum(len(cases) for _, cases in choices)) as display:
        studies = []
        for number, (study, cases) in enumerate(choices, 1):
            heading = f"study {number} of {len(choices)}: {study.name}, {study.title}"
            batch = Batch(study, folder, options, display)
            begins = partial(display.say, heading) if len(choices) > 1 else lambda: None
            studies.append(
                Together(
                    batch, cases, begins, partial(gather_and_print, study, folder, batch.outcome)
                )
            )
        run_together(studies)
    return [one.batch.outcome for one in studies]


def _run_in_job(study: Study, cases: Sequence[Case], folder: Folder, options: Options) -> Outcome:
    from mpi4py import MPI

    from .mpi_route import run_in_job

    with Display(None) as display:
        outcome = run_in_job(study, cases, folder, options, display)
    if MPI.COMM_WORLD.rank == 0:
        gather_and_print(study, folder, outcome)
    return outcome


def gather_and_print(study: Study, folder: Folder, outcome: Outcome) -> None:
    """Gather the results of a study in one file, and print what became of its cases."""
    print_outcome(study, outcome)
    file = folder.root / f"{study.name}.h5"
    with folder.gathering():
        found = list(results_of(study, folder))
        results = [result for _, result in found]
        write_studies(file, [StoredStudy(study.name, study.title, study.text, results)])
    if other := sum(bool(differs(case, result.record)) for case, result in found):
        print(other_code(other, folder.result_folder(study)))
    print(f"results: {file}")


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
