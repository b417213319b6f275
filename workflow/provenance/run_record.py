"""The record of a run, which is written beside it and into its result: how it was made."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from lammps_inelastic import plugin

from ..study import Case
from .build_version import version_now
from .same_runs import SameRuns

THIS = "lammps-inelastic"
NOTHING_ELSE = SameRuns()
PACKAGES = (THIS, "lammps", "mpi4py", "numpy", "scipy", "h5py")


@cache
def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that make and measure a packing."""
    found = {"python": sys.version.split()[0]}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    found[THIS] = version_now(found[THIS])
    return found


@cache
def code() -> dict[str, str]:
    """Return what tells the installed code from any other.

    `version` ends in the commit, `sources` is a hash of the fix's C++ sources without comments, and
    `plugin` one of the compiled plugin, which another compiler makes another one.
    """
    built = plugin.build()
    return {
        "version": versions()[THIS],
        "sources": built["sources"],
        "plugin": hashlib.sha256(Path(plugin.plugin_file()).read_bytes()).hexdigest(),
        "compiler": built["compiler"],
    }


def version_in(record: Mapping[str, Any]) -> str:
    """Return the version of the code that made a run."""
    return str(record["versions"].get(THIS, "unknown"))


def differs(case: Case, record: Mapping[str, Any], same: SameRuns = NOTHING_ELSE) -> str:
    """Say in what the code of a run differs from that of today; empty if in nothing.

    Parameters
    ----------
    case : case as its decks are today
    record : record of a run of the case
    same : other code that is known to have the runs of today's
    """
    words = []
    fingerprints = str(record["fingerprint"]).split("+")
    if len(fingerprints) != len(case.stages) or not all(
        same.has_deck(stage.deck.name, fingerprint, stage.deck.fingerprint)
        for stage, fingerprint in zip(case.stages, fingerprints, strict=True)
    ):
        words.append("another version of the deck")
    # Runs of version 0.1 did not note the code.
    if not same.has_fix(record.get("code", {}).get("sources"), code()["sources"]):
        words.append(f"version {version_in(record)} of the fix")
    return ", ".join(words)


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
        "code": code(),
    }
