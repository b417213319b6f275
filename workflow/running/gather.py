"""The results of a study, gathered from its folder, or taken over from elsewhere."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..errors import WorkflowError
from ..files import whole
from ..provenance.finished import other_run
from ..provenance.run_record import differs
from ..provenance.same_runs import same_runs
from ..results.store import Result, StoredStudy, read_result
from ..study import Case, Study
from .folder import Folder, answers
from .kept_results import KeptResults


def gather_results(study: Study, folder: Folder, of_any_code: bool = False) -> StoredStudy:
    """Return the results that there are of a study; the parameters are those of `results_of`."""
    results = [result for _, result in results_of(study, folder, of_any_code)]
    return StoredStudy(study.name, study.title, study.text, results)


def results_of(
    study: Study, folder: Folder, of_any_code: bool = False
) -> Iterator[tuple[Case, Result]]:
    """Return the cases of a study that have a result, in their order, and what that is.

    A damaged result is left out, and named on stderr. Results of decks with other defaults are
    there if they may be `of_any_code`. A stored result may have an earlier name of its case.
    """
    for case in study.cases:
        path = folder.result(study, case)
        if not os.path.lexists(path):
            continue
        try:
            result = read_result(path)
        except WorkflowError as damage:
            print(f"inelastic: left out: {damage}", file=sys.stderr)
            continue
        if answers(study, case, result.outputs, result.record, of_any_code):
            yield case, result
            if said := other_run(folder.case(case), result.record):
                print(f"WARNING: {path} is {said}; delete it to measure that", file=sys.stderr)


def other_code(count: int, folder: Path) -> str:
    """Return the line about results in a folder that were not made by the code of today."""
    results = "result is" if count == 1 else "results are"
    return (
        f"{count} {results} of other versions of the fix or of the decks; they are kept. "
        f"Delete them in {folder} to run these cases again."
    )


def adopt_results(study: Study, folder: Folder, source: Path, of_any_code: bool = False) -> int:
    """Copy results that were kept elsewhere, for cases that have none; return how many.

    A copy gets the name that its case has today.

    Parameters
    ----------
    study : study whose results they are
    folder : folder in which studies run, to which the results go
    source : folder of the results that were kept, with a folder for each study; its file
        `same_runs.toml` may tell which other fixes and decks have today's runs
    of_any_code : whether results of other versions of the fix or of the decks are taken, too

    Raises WorkflowError if that file is not as it must be.
    """
    same = same_runs(source)
    kept = KeptResults(study, source / study.name)
    found = {case.name: folder.found(study, case, of_any_code) for case in study.cases}
    cases = [case for case in study.cases if not found[case.name].measured]

    def is_of_this_code(case: Case, _outputs: str, record: Mapping[str, Any]) -> bool:
        return of_any_code or not differs(case, record, same)

    files = kept.of_cases(cases, of_any_code, is_of_this_code)
    for case in cases:
        if case.name not in files:
            continue
        for line in folder.set_aside(study, case, found[case.name]):
            print(line)
        with whole(folder.result(study, case)) as temporary:
            shutil.copyfile(files[case.name], temporary)
    left = [case for case in cases if case.name not in files]
    others = kept.of_cases(left, True, lambda *_: True)
    if other := sum(case.name in others or kept.has(case) for case in left):
        print(f"not taken: {other}, of other versions of the fix, of the decks or of the study")
    return len(files)
