"""The results of a study, gathered from its folder, or taken over from elsewhere."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

from ..errors import WorkflowError
from ..files import whole
from ..provenance.finished import other_run
from ..provenance.run_record import differs
from ..provenance.same_runs import same_runs
from ..results.store import StoredStudy, origin_of, read_result
from ..study import Study
from .folder import Folder, answers, place_of


def gather_results(study: Study, folder: Folder, of_any_code: bool = False) -> StoredStudy:
    """Return the results that there are of a study, in the order of its cases.

    A damaged result is left out, and named on stderr. Results of decks with other defaults are
    there if they may be `of_any_code`.
    """
    results = []
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
            results.append(result)
            if said := other_run(folder.case(case), result.record):
                print(f"WARNING: {path} is {said}; delete it to measure that", file=sys.stderr)
    return StoredStudy(study.name, study.title, study.text, results)


def other_code(count: int, folder: Path) -> str:
    """Return the line about results in a folder that were not made by the code of today."""
    results = "result is" if count == 1 else "results are"
    return (
        f"{count} {results} of other versions of the fix or of the decks; they are kept. "
        f"Delete them in {folder} to run these cases again."
    )


def adopt_results(study: Study, folder: Folder, source: Path, of_any_code: bool = False) -> int:
    """Copy results that were kept elsewhere, for cases that have none; return how many.

    Parameters
    ----------
    study : study whose results they are
    folder : folder in which studies run, to which the results go
    source : folder of the results that were kept, with a folder for each study; its file
        `same_runs.toml` may tell which other fixes and decks have today's runs
    of_any_code : whether results of other versions of the fix or of the decks are taken, too

    Raises WorkflowError if that file is not as it must be.
    """
    count = other = 0
    same = same_runs(source)
    for case in study.cases:
        kept = place_of(source / study.name, case, ".h5")
        target = folder.result(study, case)
        found = folder.found(study, case, of_any_code)
        if found.measured or not kept.is_file():
            continue
        try:
            outputs, record = origin_of(kept)
        except WorkflowError as error:
            print(f"not taken: {error}")
            continue
        fits = answers(study, case, outputs, record, of_any_code)
        if not fits or (not of_any_code and differs(case, record, same)):
            other += 1
            continue
        for line in folder.set_aside(study, case, found):
            print(line)
        with whole(target) as temporary:
            shutil.copyfile(kept, temporary)
        count += 1
    if other:
        print(f"not taken: {other}, of other versions of the fix, of the decks or of the study")
    return count
