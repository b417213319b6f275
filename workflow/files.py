"""Files that are either whole or not there: what stood under the name before stays until then."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import WorkflowError


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give a name to write to, in the folder of a file, and the file's name to it in the end.

    Raises WorkflowError, with the name of the file, where the disk is full or may not be written.
    """
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            yield temporary
            # Some file systems say only now that the disk is full.
            with temporary.open("rb") as written:
                os.fsync(written.fileno())
            temporary.rename(path)
        finally:
            with suppress(OSError):
                temporary.unlink()


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Say which file or folder could not be written; the system's error often does not."""
    try:
        yield
    # Where a folder should be made.
    except FileExistsError as error:
        if Path(error.filename).is_dir():
            raise
        raise WorkflowError(f"{path}: cannot be written: {error.filename} is no folder") from None
    except OSError as error:
        raise WorkflowError(f"{path}: cannot be written: {error.strerror or error}") from None
