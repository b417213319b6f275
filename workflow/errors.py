"""The errors that are raised on purpose: the command line prints the one line of each as it is."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

# This is the exit status of a command that the user has interrupted.
INTERRUPTED = 130


def meant(name: str, names: Iterable[str]) -> str:
    """Return the question whether the nearest of some names was meant; nothing if none is near."""
    nearest = difflib.get_close_matches(name, [*names], n=1)
    return f" (did you mean {nearest[0]}?)" if nearest else ""


class WorkflowError(ValueError):
    """The base of every error that the workflow raises on purpose."""


class WriteError(WorkflowError):
    """A file could not be written: the disk is full, or may not be written to."""


class PackingError(WorkflowError):
    """A packing that cannot be made as it was asked for, or that LAMMPS could not make."""


class StudyError(WorkflowError):
    """The mistakes of a study file; `mistakes` has one line for each."""

    def __init__(self, mistakes: Sequence[str]) -> None:
        """Keep the lines, at least one."""
        super().__init__("\n".join(mistakes))
        self.mistakes = tuple(mistakes)
