"""The results of a study, gathered from its folder, or taken over from elsewhere."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from .errors import WorkflowError
from .files import whole
from .finished import other_run
from .folder import Folder
from .store import StoredStudy, origin_of, read_result
from .study import Study


def gather_results(study: Study, folder: Folder) -> StoredStudy:
    """Return the results that there are of a study, in the order of its cases.

    A damaged result is left out, and named on stderr.
    """
    results = []
    for case in study.cases:
        if folder.is_measured(study, case):
            path = folder.result(study, case)
            results.append(read_result(path))
            if said := other_run(folder.case(case), results[-1].record):
                print(f"WARNING: {path} is {said}; delete it to measure that", file=sys.stderr)
        elif damage := folder.damage(study, case):
            print(f"inelastic: left out: {damage}", file=sys.stderr)
    return StoredStudy(study.name, study.title, study.text, results)


def adopt_results(study: Study, folder: Folder, source: Path) -> int:
    """Copy results that were kept elsewhere, for cases that have none; return how many.

    Parameters
    ----------
    study : study whose results they are
    folder : folder in which studies run, to which the results go
    source : folder of the results that were kept, with a folder for each study
    """
    count = 0
    for case in study.cases:
        kept, target = source / study.name / f"{case.name}.h5", folder.result(study, case)
        if folder.is_measured(study, case) or not kept.is_file():
            continue
        try:
            origin_of(kept)
        except WorkflowError as error:
            print(f"not taken: {error}")
            continue
        for line in folder.set_aside(study, case):
            print(line)
        with whole(target) as temporary:
            shutil.copyfile(kept, temporary)
        count += 1
    return count
