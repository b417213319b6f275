"""The folder of one or more studies: which cases are done, and which may run.

    cases/CASE/            a finished run: it gets this name only when all of it is there
    cases/CASE.part/       a run that is under way, or that was cut off
    cases/CASE.failed/     the last run that failed, with its log
    cases/CASE.damaged/    a run whose finished.json could not be read
    cases/CASE.earlier/    a run of a deck with other defaults, which the one of today's replaces
    cases/.locks/CASE      locked while somebody runs or measures the case
    cases/.locks/results   locked while somebody gathers results
    results/STUDY/CASE.h5  what was measured of it; CASE.h5.damaged where that could not be read,
                           CASE.h5.earlier where it was of a deck with other defaults
    STUDY.h5               all results of a study

Everything gets its name by a rename when it is complete: whatever is cut off, at any moment, leaves
nothing behind that looks finished. A case's folder name is unique to its variables, and studies in
one folder share their cases. What version 0.2 has left under a longer name stays under that.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ..errors import WorkflowError
from ..files import digest_of, is_file, write_text, writing
from ..provenance.finished import CONTACTS, FINISHED, PARTICLES, checksums, json_of
from ..results.store import origin_of
from ..study import INPUTS, Case, Study
from . import locks
from .processes import kill_processes_in, last_lines

State = Literal["measured", "finished", "running", "cut off", "failed", "missing"]

UNKNOWN = "unknown"
FAILED = "failed.json"
# What is set aside gets one of these endings.
DAMAGED, EARLIER = "damaged", "earlier"
OTHER_DEFAULTS = "of a deck with other defaults than today's"


@dataclass(frozen=True)
class Found:
    """What stands in the place of a case's result.

    Attributes
    ----------
    measured : whether it is a result, of what the study asks for now
    damage : what is wrong with it; None if it can be read, or nothing is there
    earlier : whether it is a result of a deck with other defaults
    """

    measured: bool = False
    damage: str | None = None
    earlier: bool = False


NOTHING = Found()


@dataclass(frozen=True)
class Folder:
    """The folder in which studies run.

    Attributes
    ----------
    root : path of the folder
    """

    root: Path

    def case(self, case: Case) -> Path:
        """Return where a finished run is."""
        return place_of(self.root / "cases", case)

    def part(self, case: Case) -> Path:
        """Return where a run is under way."""
        return place_of(self.root / "cases", case, ".part")

    def failure(self, case: Case) -> Path:
        """Return where the last failed run is."""
        return place_of(self.root / "cases", case, ".failed")

    def check_there(self) -> None:
        """See that the folder is there; raise WorkflowError with one line if it is not."""
        if not self.root.is_dir():
            raise WorkflowError(f"{self.root}: no such folder; --out names that of the runs")

    def result(self, study: Study, case: Case) -> Path:
        """Return where the measurements of a case are."""
        return place_of(self.result_folder(study), case, ".h5")

    def result_folder(self, study: Study) -> Path:
        """Return where all measurements of a study are."""
        return self.root / "results" / study.name

    def state(self, case: Case, found: Found) -> State:
        """Say how far a case has come.

        Parameters
        ----------
        case : the case
        found : what `found` has returned of it
        """
        if found.measured:
            return "measured"
        if locks.is_locked(self._lock(case)):
            return "running"
        if self.is_finished(case):
            return "finished"
        if self.failure(case).is_dir():
            return "failed"
        return "cut off" if self.part(case).is_dir() else "missing"

    def found(self, study: Study, case: Case, of_any_code: bool = False) -> Found:
        """Look what stands in the place of a result; the parameters are those of `answers`."""
        path = self.result(study, case)
        try:
            outputs, record = origin_of(path)
        except WorkflowError as error:
            return Found(damage=str(error)) if os.path.lexists(path) else NOTHING
        return Found(
            measured=answers(study, case, outputs, record, of_any_code),
            earlier=not case.is_of(record, of_any_code),
        )

    def is_measured(self, study: Study, case: Case) -> bool:
        """Say whether there is a result, of what the study asks for now."""
        return self.found(study, case).measured

    def is_finished(self, case: Case) -> bool:
        """Say whether there is a whole run of the case that can still be measured."""
        record = json_of(self.case(case) / FINISHED)
        return case.is_of(record) and is_file(self.case(case) / PARTICLES)

    def set_aside(self, study: Study, case: Case, found: Found) -> list[str]:
        """Rename a result and a run that cannot be read or are of other defaults of the decks.

        Nothing of them is lost, and nothing of them is in the way. The case must be locked. Returns
        a line about each.

        Parameters
        ----------
        study, case : the case, and the study that asks for its result
        found : what `found` has returned of it
        """
        lines = []
        result, run = self.result(study, case), self.case(case)
        if found.damage:
            lines.append(f"{found.damage}; kept as {_renamed(result, DAMAGED).name}")
        elif found.earlier:
            lines.append(f"{result}: {OTHER_DEFAULTS}; kept as {_renamed(result, EARLIER).name}")
        if run.is_dir():
            record = json_of(run / FINISHED)
            if record is None:
                kept = _renamed(run, DAMAGED).name
                lines.append(f"{run / FINISHED}: cannot be read; kept as {kept}")
            elif not case.is_of(record):
                lines.append(f"{run}: {OTHER_DEFAULTS}; kept as {_renamed(run, EARLIER).name}")
        return lines

    def obstacles(self, study: Study, cases: Iterable[Case]) -> list[str]:
        """Return one line for each thing that stands where the study's files should be."""
        inner = self.root / "cases", self.root / "cases" / ".locks"
        results = self.root / "results", self.result_folder(study)
        lines = [
            f"{path}: {'a link to nowhere' if path.is_symlink() else 'a file'} is in the way; move "
            "it away"
            for path in (self.root, *inner, *results)
            if os.path.lexists(path) and not path.is_dir()
        ]
        file = self.root / f"{study.name}.h5"
        if file.is_dir():
            lines.append(f"{file}: a folder is in the way; move it away")
        if lines:
            return lines
        for case in cases:
            # A run that has been moved elsewhere, with a link to it, is still measured there.
            linked = self.is_finished(case) if self.case(case).is_symlink() else False
            folders = self.case(case), self.part(case), self.failure(case)
            lines += [
                f"{path}: a link or a file is in the way; move it away"
                for path in folders[1 if linked else 0 :]
                if os.path.lexists(path) and (path.is_symlink() or not path.is_dir())
            ]
            path = self._lock(case)
            if os.path.lexists(path) and (path.is_symlink() or not path.is_file()):
                lines.append(f"{path}: no lock file; move it away")
        return lines

    def drop_dumps(self, case: Case) -> None:
        """Delete the dumps of a run that has been measured."""
        for stage in case.stages:
            for name in (PARTICLES, CONTACTS):
                (self.case(case) / case.folder_of(stage) / name).unlink(missing_ok=True)

    def lock(self, case: Case) -> AbstractContextManager[bool]:
        """Lock a case, and give whether that was possible: somebody else may hold the lock.

        The lock goes with the process that holds it, however that ends.
        """
        return locks.tried(self._lock(case))

    def gathering(self) -> AbstractContextManager[None]:
        """Wait until nobody else gathers results of this folder, and let nobody meanwhile.

        Who gathers and writes inside of it never replaces newer results by older ones. Where the
        file system has no locks, or nothing may be written or has been run, it does not wait.
        """
        return locks.held(self.root / "cases" / ".locks" / "results")

    def _lock(self, case: Case) -> Path:
        return self.root / "cases" / ".locks" / case.name

    def begin(self, case: Case) -> Path:
        """Make the folders for a new run, and put the decks and their input files there.

        The rest of a run that was cut off is deleted, and any process in it is killed.
        """
        part = self.part(case)
        kill_processes_in(part)
        shutil.rmtree(part, ignore_errors=True)
        with writing(part):
            part.mkdir(parents=True)
            for stage in case.stages:
                (part / f"{stage.deck.name}.in").write_text(stage.deck.text)
                (part / case.folder_of(stage)).mkdir(exist_ok=True)
            if case.inputs:
                (part / INPUTS).mkdir()
            for name, file in case.inputs.items():
                if not is_file(file.path):
                    raise WorkflowError(f"{file.path}: has gone since the study was read")
                copy = part / INPUTS / name
                shutil.copyfile(file.path, copy)
                if digest_of(copy) != file.digest:
                    raise WorkflowError(f"{file.path}: has changed since the study was read")
        return part

    def finish(self, case: Case, record: Mapping[str, Any]) -> None:
        """Give a whole run its name."""
        part = self.part(case)
        write_json(part / FINISHED, {**record, "files": checksums(part, record["stages"])})
        shutil.rmtree(self.case(case), ignore_errors=True)
        part.rename(self.case(case))
        shutil.rmtree(self.failure(case), ignore_errors=True)

    def fail(self, case: Case, reason: str, job: str = "") -> list[str]:
        """Put a failed run aside, as far as there is one; return the last lines of its output.

        Parameters
        ----------
        case : case whose run it was
        reason : reason of the failure, in words
        job : MPI job that the run was a part of, in which it is not tried again
        """
        failure = self.failure(case)
        shutil.rmtree(failure, ignore_errors=True)
        lines = last_lines(self.part(case) / "lmp.out")
        # The run may have failed for want of room or rights, which a note of it needs as well.
        with suppress(OSError, WorkflowError):
            self.part(case).mkdir(exist_ok=True)
            self.part(case).rename(failure)
            write_json(failure / FAILED, {"reason": reason, "job": job, "last_lines": lines})
        return lines

    def reason(self, case: Case) -> str:
        """Say why the last run failed."""
        return self._of_failure(case, "reason")

    def failed_in(self, case: Case, job: str) -> bool:
        """Say whether the last run failed as a part of this MPI job."""
        return self._of_failure(case, "job") == job

    def _of_failure(self, case: Case, what: str) -> str:
        said = (json_of(self.failure(case) / FAILED) or {}).get(what, UNKNOWN)
        return " ".join(str(said).split()) or UNKNOWN


def answers(
    study: Study, case: Case, outputs: str, record: Mapping[str, Any], of_any_code: bool = False
) -> bool:
    """Say whether a result is what a study asks for now.

    Parameters
    ----------
    study, case : the case, and the study that asks for its result
    outputs, record : of the result, as in `Result`
    of_any_code : whether it may be of decks with other defaults
    """
    return outputs == study.outputs.measured and case.is_of(record, of_any_code)


def place_of(folder: Path, case: Case, ending: str = "") -> Path:
    """Return where something of a case is or would be: what version 0.2 has left, or else its own.

    Parameters
    ----------
    folder : folder that holds something of each case, under its name
    case : the case
    ending : what follows the name, such as `.h5`
    """
    path = folder / f"{case.name}{ending}"
    before = folder / f"{case.name_before}{ending}"
    return before if os.path.lexists(before) and not os.path.lexists(path) else path


def _renamed(path: Path, ending: str) -> Path:
    """Rename something so that it can be looked at, and is not in the way; return its new name."""
    number = 1
    while os.path.lexists(
        target := path.with_name(f"{path.name}.{ending}{'' if number == 1 else number}")
    ):
        number += 1
    with writing(target):
        path.rename(target)
    return target


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file, which is either whole or not there."""
    write_text(path, json.dumps(content, indent=2))
