"""Files that are either whole or not there: what stood under the name before stays until then."""

from __future__ import annotations

import hashlib
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import WorkflowError, WriteError

# Every HDF5 file begins with these bytes.
HDF5 = b"\x89HDF\r\n\x1a\n"
# A temporary name has so much of the machine's name: file systems take 255 bytes in all.
LONGEST_HOST = 20


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give a temporary name to write to; what was written gets the file's own name in the end.

    Raises WriteError, with the name of the file, where the disk is full or may not be written.
    """
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        # Processes of other machines may have the same number, and write to the same folder.
        writer = f"{os.uname().nodename[:LONGEST_HOST]}.{os.getpid()}.{secrets.token_hex(4)}"
        temporary = path.with_name(f".{path.name}.{writer}")
        try:
            yield temporary
            # Some file systems say only now that the disk is full.
            with temporary.open("rb") as written:
                os.fsync(written.fileno())
            temporary.rename(path)
        finally:
            with suppress(OSError):
                temporary.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a text file that is either whole or not there; raise WriteError as `whole` does."""
    with whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Raise WriteError with the file or folder that could not be written.

    The system's own error often does not name it.
    """
    try:
        yield
    # This one comes where a folder should be made.
    except FileExistsError as error:
        if Path(error.filename).is_dir():
            raise
        raise WriteError(f"{path}: cannot be written: {error.filename} is no folder") from None
    except OSError as error:
        raise WriteError(f"{path}: cannot be written: {error.strerror or error}") from None


def read_regular(path: Path, most: int) -> bytes:
    """Return the content of a regular file of at most so many bytes.

    Raises WorkflowError, with the name of the file, if it cannot be read, is larger, or is
    something else, such as a pipe, for whose writer one would wait for ever.
    """
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            kind = os.fstat(file.fileno()).st_mode
            content = file.read(most + 1) if stat.S_ISREG(kind) else b""
    except OSError as error:
        raise WorkflowError(f"{path}: {error.strerror}") from None
    if not stat.S_ISREG(kind):
        raise WorkflowError(f"{path}: not a file")
    if len(content) > most:
        raise WorkflowError(f"{path}: too large: at most {most} bytes are allowed")
    return content


def is_file(path: Path) -> bool:
    """Say whether there is a regular file; no name is too long or too odd to ask."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def check_target(path: Path, *, hdf5: bool) -> None:
    """See that results replace results alone, and nothing else replaces them.

    Parameters
    ----------
    path : file that will be written, and may be there already
    hdf5 : whether HDF5 will be written

    Raises WorkflowError if a file of the other kind is there, and OSError if it cannot be read.
    """
    if not is_file(path):
        return
    with path.open("rb") as file:
        start = file.read(len(HDF5))
    if start and (start == HDF5) != hdf5:
        kind = "no HDF5 file" if hdf5 else "an HDF5 file"
        raise WorkflowError(f"{path}: this file is {kind}, and is not replaced")


def digest_of(path: Path) -> str:
    """Return a hash of a file's content, however large it is. Raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
