"""Runs the decks of inputs/ for the benchmark, the validation tests and the tables."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from lammps_inelastic.analysis import (
    CoordinationNumber,
    MeasuredPackingFraction,
    Orientation,
    contact_counts,
    iterate_contact_frames,
    measure_packing,
    read_particle_frame,
)
from tests.helpers.lammps_run import without_launcher

BULK = np.array([[0.25, 0.75]] * 3)  # the paper's box


# Variables of a deck that makes a start and no more.
NO_STEPS: dict[str, object] = {
    f"steps_{phase}": 0 for phase in ("agitated", "settling", "resting", "tightening", "measuring")
}

# Variables of a deck with which all of its phases are there, and none is long.
FEW_STEPS: dict[str, object] = {
    "steps_agitated": 100,
    "steps_settling": 50,
    "steps_resting": 50,
    "waiting": 0,
    "steps_tightening": 5,
    "steps_measuring": 3,
    "dump_every": 40,
}


def shipped_deck(name: str) -> str:
    """Text of the installed deck inputs/NAME.in."""
    return (files("lammps_inelastic.inputs") / f"{name}.in").read_text()


class DeckError(RuntimeError):
    """LAMMPS has refused a deck, or could not end it."""

    @property
    def reason(self) -> str:
        """The line in which LAMMPS says why; without one the last that it wrote."""
        lines = str(self).splitlines() or ["it wrote nothing"]
        return next((line for line in lines if line.startswith("ERROR")), lines[-1])


def run_deck(
    folder: Path,
    deck: str,
    variables: Mapping[str, object],
    plugin: Path | None = None,
    ranks: int = 1,
) -> str:
    """Run a deck in `folder`, which becomes its `out`; return the log.

    The plugin is the installed one, or that in the folder `plugin`. Raises DeckError with the
    end of the output when lmp fails.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "deck.in").write_text(deck)
    program, environment = str(Path(sys.executable).parent / "lmp"), dict[str, str]()
    if plugin is not None:
        program, environment = without_launcher(plugin)
    command = [program, "-in", "deck.in", "-var", "out", "."]
    if ranks > 1:
        mpiexec = str(Path(sys.executable).parent / "mpiexec")
        command = [mpiexec, "-bind-to", "core", "-n", str(ranks), *command]
    for name, value in variables.items():
        command += ["-var", name, str(value)]
    done = subprocess.run(
        command,
        cwd=folder,
        env=os.environ | environment | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise DeckError("\n".join((done.stdout + done.stderr).splitlines()[-15:]))
    return (folder / "log.lammps").read_text()


@dataclass(frozen=True)
class Projections:
    """What fix inelastic says at the end of a `run`."""

    projections: int
    iterations: int
    overlap: float  # the largest
    seconds: float


def projections(log: str) -> list[Projections]:
    """One entry for every `run` of a log."""
    pattern = re.compile(
        r"^Fix inelastic: (\d+) projections, (\d+) iterations, largest overlap (\S+) =.*?"
        r"^Loop time of ([-+.\de]+)",
        re.MULTILINE | re.DOTALL,
    )
    return [Projections(int(a), int(b), float(c), float(d)) for a, b, c, d in pattern.findall(log)]


def summed(runs: Sequence[Projections]) -> Projections:
    """Return several runs of a log as one."""
    return Projections(
        sum(run.projections for run in runs),
        sum(run.iterations for run in runs),
        max(run.overlap for run in runs),
        sum(run.seconds for run in runs),
    )


@dataclass(frozen=True)
class Packing:
    """The paper's numbers for one run; a particle is a body or a free sphere."""

    packing_fraction: MeasuredPackingFraction
    coordination_number: CoordinationNumber
    neighbours: CoordinationNumber
    orientation: Orientation | None  # of dimers


def measure(folder: Path, contact_dump: str = "contacts.lammpsdump") -> Packing:
    """Packing fraction, contacts, neighbours and orientation in the paper's box."""
    frame = read_particle_frame(folder / "particles.lammpsdump")
    counts = [
        contact_counts(contacts.ids, frame.ids, frame.particles)
        for contacts in iterate_contact_frames(folder / contact_dump)
    ]
    found = measure_packing(frame, counts, BULK)
    assert found.coordination is not None
    assert found.neighbours is not None
    return Packing(found.packing_fraction, found.coordination, found.neighbours, found.orientation)


def recording(text: str, every: int) -> str:
    """Let a deck's contact fix (not the one that prepares the start) record problems."""
    before, command, after = text.rpartition("all inelastic ")
    tolerance, _, rest = after.partition(" ")
    return f"{before}{command}{tolerance} record problem.*.npz every {every} {rest}"


def measuring_at(deck: str, tolerances: Sequence[float]) -> str:
    """Let the deck count the contacts at several tolerances [radii], one after the other.

    The contact dumps are contacts.0.lammpsdump and so on.
    """
    before, longer, measuring = deck.partition("timestep        ${dt_measuring}\n")
    counting, last, end = measuring.partition("undump          particles\n")
    if not (longer and last):
        raise ValueError("the deck has no phase in which it counts contacts")
    counts = [
        f"variable eps_now equal {tolerance:.17g}*v_radius\n"
        + counting.replace("${eps_last}", "${eps_now}").replace(
            "contacts.lammpsdump", f"contacts.{number}.lammpsdump"
        )
        + "undump          contacts\n"
        for number, tolerance in enumerate(tolerances)
    ]
    return before + longer + "".join(counts) + last + end
