"""Files that are read, which must be regular ones, and files that are written whole or not."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


def regular(path: str, flags: int) -> int:
    """Open a regular file, as the `opener` of `open` does; raise OSError for anything else.

    For the writer of a pipe one would wait for ever, and a device may have no end.
    """
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    if stat.S_ISREG(os.fstat(descriptor).st_mode):
        return descriptor
    os.close(descriptor)
    raise OSError("it is a folder, a pipe or a device, and must be a file")


def reason_of(error: OSError) -> str:
    """Say why a file could not be read or written; an error of a library has no `strerror`."""
    return error.strerror or str(error)


@contextmanager
def unfinished(target: Path) -> Iterator[Path]:
    """Give a file to write, in the target's folder, and its name to it when it is whole.

    What had the name before stays until then, and nothing is left of a file that could not be
    written to its end. Raises OSError.
    """
    file = target.with_name(target.name + ".part")
    try:
        yield file
        file.replace(target)
    finally:
        # A file that is still there could not be written to its end, or not be renamed.
        with suppress(OSError):
            file.unlink()
