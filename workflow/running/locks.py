"""Locks: files that one process holds at a time, until it ends, in whatever way."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO

from ..files import writing

# Neither a link's target nor a pipe is opened in the place of a lock.
_PLAIN = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
# So long after one attempt at a lock comes the next [seconds].
NEXT_ATTEMPT = 0.05


@contextmanager
def tried(path: Path) -> Iterator[bool]:
    """Try to lock a file, made with its folder if it is not there, and give whether that worked.

    Raises WriteError if the file cannot be made, OSError where the file system has no locks.
    """
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDWR | os.O_CREAT | _PLAIN, 0o666)
    with os.fdopen(handle, "w") as file:
        yield _locked(file)


@contextmanager
def held(path: Path, line: str = "") -> Iterator[None]:
    """Wait until nobody else holds a lock, and hold it.

    Where the file system has no locks, or the lock's file cannot be made, it does not wait.

    Parameters
    ----------
    path : of the lock's file, whose folder must be there
    line : is printed before a wait; nothing is if it is empty
    """
    with ExitStack() as stack:
        with suppress(OSError):
            handle = os.open(path, os.O_RDWR | os.O_CREAT | _PLAIN, 0o666)
            file = stack.enter_context(os.fdopen(handle, "w"))
            if line and not _locked(file):
                print(line, flush=True)
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def is_locked(path: Path) -> bool:
    """Say whether somebody holds a lock, as far as that can be known."""
    try:
        # The file may belong to somebody else, so it is opened for reading only.
        handle = os.open(path, os.O_RDONLY | _PLAIN)
    except OSError:
        return False
    # Not a file object: a folder in its place cannot become one.
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(handle)
    return False


def _locked(file: IO[str]) -> bool:
    for last in (False, False, True):
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            # The lock may be held for a moment only, by `inelastic status`.
            time.sleep(0 if last else NEXT_ATTEMPT)
        else:
            return True
    return False
