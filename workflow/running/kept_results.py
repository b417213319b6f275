"""Results of a study that were kept in a folder: which of them is that of which case.

A result has its case's name. Where that has changed since (a study states values now that were
defaults of a deck before, or a default has changed), the record of the run tells whose it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from pathlib import Path
from typing import Any

from ..errors import WorkflowError
from ..results.store import origin_of
from ..study import Case, Study
from ..study.case_name import name_in
from .folder import answers, place_of

# Says whether a result, by its outputs and its record, may be that of a case.
Fits = Callable[[Case, str, Mapping[str, Any]], bool]


class KeptResults:
    """The results of a study in a folder, each of which is read once."""

    def __init__(self, study: Study, folder: Path) -> None:
        """Read nothing yet."""
        self._study, self._folder = study, folder
        self._names = {case.name for case in study.cases}
        self._read: dict[Path, tuple[str, Mapping[str, Any]] | None] = {}

    def of_cases(self, cases: Sequence[Case], of_any_code: bool, fits: Fits) -> dict[str, Path]:
        """Return the files of those cases that have one, by their names; each file is of one case.

        A file under the case's name comes first, then any that is left whose record has the case's
        decks and the values of all its variables.

        Parameters
        ----------
        cases : cases of the study that need a result
        of_any_code : as in `answers`
        fits : what else is asked of a result
        """
        found: dict[str, Path] = {}
        # What has exactly the values of a case comes before what may have had other defaults.
        for any_code in (False, True) if of_any_code else (False,):
            self._by_names(cases, any_code, fits, found)
            self._by_records(cases, any_code, fits, found)
        return found

    def _by_names(
        self, cases: Sequence[Case], of_any_code: bool, fits: Fits, found: dict[str, Path]
    ) -> None:
        """Add the files that have a case's name; the parameters are those of `of_cases`."""
        for case in cases:
            path = place_of(self._folder, case, ".h5")
            origin = self._origin(path)
            if case.name in found or origin is None or path in found.values():
                continue
            if answers(self._study, case, *origin, of_any_code) and fits(case, *origin):
                found[case.name] = path

    def _by_records(
        self, cases: Sequence[Case], of_any_code: bool, fits: Fits, found: dict[str, Path]
    ) -> None:
        """Add files that are left, by their records; the parameters are those of `of_cases`."""
        wanted = [case for case in cases if case.name not in found]
        left = self._measured_like_the_study(set(found.values())) if wanted else {}
        for case in wanted:
            for path, (outputs, record) in left.items():
                if self._is_of(case, record, of_any_code) and fits(case, outputs, record):
                    found[case.name] = path
                    del left[path]
                    break

    def has(self, case: Case) -> bool:
        """Say whether a result that can be read has the name of a case, whatever it is of."""
        return self._origin(place_of(self._folder, case, ".h5")) is not None

    def _is_of(self, case: Case, record: Mapping[str, Any], of_any_code: bool) -> bool:
        """Say whether a run is of a case, and does not have the name of another case today."""
        # Both would be one to all that knows results by their names.
        others = self._names - {case.name}
        return case.is_run_of(record, of_any_code) and name_in(record) not in others

    def _measured_like_the_study(
        self, taken: Set[Path]
    ) -> dict[Path, tuple[str, Mapping[str, Any]]]:
        """Return outputs and records of the files that are of no case yet."""
        wanted = self._study.outputs.measured
        paths = sorted(path for path in self._folder.glob("*.h5") if path not in taken)
        origins = {path: origin for path in paths if (origin := self._origin(path))}
        return {path: origin for path, origin in origins.items() if origin[0] == wanted}

    def _origin(self, path: Path) -> tuple[str, Mapping[str, Any]] | None:
        """Return a result's outputs and record; None if it is not there, or damaged, which is said.

        What a file holds is read once.
        """
        if path not in self._read:
            self._read[path] = None
            if path.is_file():
                try:
                    self._read[path] = origin_of(path)
                except WorkflowError as error:
                    print(f"not taken: {error}")
        return self._read[path]
