"""Processes of a case: how they are started, what they print, how they end, how they are killed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

# So long after one look at a process comes the next [seconds].
POLL = 0.05
# Every process that runs a case has this variable in its environment: other processes in the
# folder, such as a user's shell, are left alone.
MARK = "INELASTIC_CASE"
# A killed process may take so long to go [seconds].
PATIENCE = 10.0
# An MPI job around us sets variables of these names: an lmp that sees them takes itself for one of
# its ranks.
_OF_MPI = re.compile(r"^(PMI|PMIX|HYDI|HYDRA|MPI|MPIR)_")


@dataclass(frozen=True)
class Command:
    """A command of a case.

    Attributes
    ----------
    words : program and arguments
    where : folder in which it runs
    output : file that takes all that it prints
    anew : whether that file begins anew; otherwise it goes on
    """

    words: list[str]
    where: Path
    output: Path
    anew: bool = True


def start(command: Command) -> subprocess.Popen[bytes]:
    """Start a process that leads a group of its own, so that `kill_group` reaches all of it.

    Raises OSError if there is no such program, or no room for its output.
    """
    with command.output.open("wb" if command.anew else "ab") as file:
        return subprocess.Popen(
            command.words,
            cwd=command.where,
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            # A signal to a group of its own reaches the lmp behind the launcher too.
            start_new_session=True,
        )


def run_to_end(command: Command, limit: float | None) -> int:
    """Run a process as a part of this job, which ends with it; return its exit status.

    Raises TimeoutExpired of subprocess if it takes longer than the limit [seconds], and OSError as
    `start` does.
    """
    with command.output.open("wb" if command.anew else "ab") as file:
        done = subprocess.run(
            command.words,
            cwd=command.where,
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            check=False,
            timeout=limit,
        )
    return done.returncode


def environment() -> dict[str, str]:
    """Return the environment for a process of a case: its lmp first, one thread, no MPI job."""
    variables = {name: v for name, v in os.environ.items() if not _OF_MPI.match(name)}
    variables["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{variables.get('PATH', '')}"
    return variables | {"OMP_NUM_THREADS": "1", MARK: "1"}


def cores() -> int:
    """Return how many cores there are for this process."""
    return len(os.sched_getaffinity(0))


def exit_reason(code: int) -> str:
    """Return in words how a process ended that did not end well."""
    # The launcher of LAMMPS hands on a signal as an exit status of 256 less its number.
    number = -code if code < 0 else 256 - code if code > 192 else 0
    if number:
        try:
            return f"killed by {signal.Signals(number).name}"
        except ValueError:
            pass
    return f"exit status {code}"


def last_lines(path: Path, count: int = 8) -> list[str]:
    """Return the last lines of a text file that are not empty; none if there is no file."""
    try:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - 20_000))
            text = file.read().decode(errors="replace")
    except OSError:
        return []
    return [line.rstrip() for line in text.splitlines() if line.strip()][-count:]


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """Kill a process that leads a group, and all of the group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def kill_processes_in(folder: Path) -> None:
    """Kill the processes that still work in a folder whose owner is gone, such as an lmp."""
    deadline = time.monotonic() + PATIENCE
    while pids := list(_processes_in(folder)):
        for pid in pids:
            try:
                os.kill(pid, signal.SIGKILL)
            except (ProcessLookupError, PermissionError):
                continue
        if time.monotonic() > deadline:
            break
        time.sleep(POLL)


def _processes_in(folder: Path) -> Iterator[int]:
    if not folder.is_dir() or not Path("/proc").is_dir():
        return
    inside = str(folder.resolve())
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit() or int(entry.name) == os.getpid():
            continue
        try:
            where = os.readlink(entry / "cwd")
            ours = MARK.encode() in (entry / "environ").read_bytes()
            # A killed process that nobody has waited for yet still has an entry, without a folder.
        except OSError:
            continue
        if ours and (where == inside or where.startswith(inside + "/")):
            yield int(entry.name)


@contextmanager
def interrupts() -> Iterator[list[int]]:
    """Collect interrupts, SIGTERM and SIGHUP in a list, in the place of what they do else.

    Nothing is cut short by them: an exception at any place could leave a process behind that has
    just been started, and a second one those that were still to be stopped. A signal that is
    ignored, as SIGHUP under nohup, stays so. Only the main thread of Python may take signals: in
    another one nothing is collected.
    """
    seen: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        seen.append(number)

    in_main = threading.current_thread() is threading.main_thread()
    before: dict[int, Any] = {}
    for number in map(int, (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)):
        if in_main and signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, note)
    try:
        yield seen
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
