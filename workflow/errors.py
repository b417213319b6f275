"""What can go wrong: the text of each error is one line, which the command line prints as it is."""

from __future__ import annotations

from collections.abc import Sequence


class WorkflowError(ValueError):
    """Base of every error that the workflow raises on purpose."""


class StudyError(WorkflowError):
    """A study file has mistakes; `mistakes` has one line for each."""

    def __init__(self, mistakes: Sequence[str]) -> None:
        """Keep the lines, at least one."""
        super().__init__("\n".join(mistakes))
        self.mistakes = tuple(mistakes)
