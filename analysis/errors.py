"""The errors of the analysis: the text of each is one line, which the command line prints."""

from __future__ import annotations

from os import PathLike


class AnalysisError(ValueError):
    """Base of every error that the analysis raises on purpose."""


class InputError(AnalysisError):
    """An array, a box or a number does not have the shape or the value that the function needs."""


class FileError(AnalysisError):
    """A file that is read is missing, incomplete or malformed."""

    def __init__(self, path: str | PathLike[str], message: str, line: int | None = None) -> None:
        """Make the text `path, line N: message`; lines are counted from 1."""
        where = f"{path}" if line is None else f"{path}, line {line}"
        super().__init__(f"{where}: {message}")


class DumpError(FileError):
    """A dump file is missing, incomplete or malformed."""


class CutOffError(DumpError):
    """A dump ends inside a frame; the frames before it are whole."""


class LogError(FileError):
    """A log is missing, cannot be read, or lacks a part."""


class RunFilesError(AnalysisError):
    """The files of a run do not belong together, or lack frames."""


class UnfinishedRunError(RunFilesError):
    """The log ends before the run does."""


class PictureError(AnalysisError):
    """The picture could not be drawn: no LAMMPS, or LAMMPS refused."""


class ExportError(AnalysisError):
    """A file for another program could not be written."""


def shortened(text: str) -> str:
    """Return a text that an error quotes, not too much of it."""
    return printable(text if len(text) <= 40 else text[:37] + "...")


def printable(text: str) -> str:
    """Return a text that spoils no terminal, also where a binary file is quoted."""
    return "".join(
        letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in text
    )
