"""Runs `inelastic` on studies, and reads back all numbers of a study's file."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from lammps_inelastic.workflow.study import read_study
from tests.helpers.few_spheres import TINY

BIN = Path(sys.executable).parent
# An mpiexec around pytest must not reach the runs (they would join its job).
OF_A_LAUNCHER = ("PMI_", "PMIX_", "HYDI_", "HYDRA_", "MPI_", "MPICH_", "OMPI_")
ENVIRONMENT = {
    name: value for name, value in os.environ.items() if not name.startswith(OF_A_LAUNCHER)
}
# Of a run of a second or two on a busy machine.
PATIENCE = 120.0


def command(*arguments: object, ranks: int = 0) -> list[str]:
    """Return the command that runs `inelastic`, inside an MPI job if there are ranks."""
    job = [str(BIN / "mpiexec"), "-n", str(ranks)] if ranks else []
    return [*job, sys.executable, "-m", "lammps_inelastic.workflow.main", *map(str, arguments)]


def inelastic(
    *arguments: object, ranks: int = 0, preparation: Callable[[], None] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run `inelastic` to its end; the preparation comes first in its process."""
    return subprocess.run(
        command(*arguments, ranks=ranks),
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
        preexec_fn=preparation,
    )


def warning(study: Path) -> str:
    """Return what is said of a study of few spheres, whose box is higher than their bed."""
    (line,) = read_study(study).warnings
    assert "numbers of the box would be partly of empty space" in line
    return f"warning: {line}\n"


def run_few(folder: Path, seeds: str) -> Path:
    """Run the study of a few spheres with some seeds in a folder; return the folder."""
    (folder / "few.toml").write_text(TINY.replace("{seeds}", seeds))
    result = inelastic("run", folder / "few.toml", "--out", folder / "out")
    assert result.returncode == 0, result.stderr
    return folder


def numbers_of(path: Path) -> dict[str, Any]:
    """Return every dataset of a study's file but the wall times."""
    found: dict[str, Any] = {}

    def keep(name: str, item: h5py.HLObject) -> None:
        if isinstance(item, h5py.Dataset) and not name.endswith("seconds"):
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(keep)
    return found


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether all numbers are equal, bit for bit."""
    return one.keys() == other.keys() and all(
        np.array_equal(value, other[name], equal_nan=np.asarray(value).dtype.kind == "f")
        for name, value in one.items()
    )


def processes_in(folder: Path) -> list[int]:
    """Return the processes that work in a folder."""
    return list(_processes_in(folder))


def _processes_in(folder: Path) -> Iterator[int]:
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and os.readlink(entry / "cwd").startswith(f"{folder}/"):
                yield int(entry.name)
        except OSError:
            continue


def wait_for(there: Any) -> None:
    """Wait until something is true."""
    deadline = time.monotonic() + PATIENCE
    while not there():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def killed_when(there: Any, *arguments: object, by: signal.Signals = signal.SIGKILL) -> int:
    """Start `inelastic`, send it a signal once something is true; return its exit status."""
    process = subprocess.Popen(
        command(*arguments),
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_for(there)
    finally:
        process.send_signal(by)
        status = process.wait(PATIENCE)
    return status
