"""A million spheres: memory and time of a step, and what the whole would take.

A jittered lattice, nearly as dense as the bed that it becomes, falls for twenty steps. The same
with a hundred thousand spheres goes on until t = 2. What its whole way takes in units of its first
twenty steps is what a million would take in units of theirs, times the growth of the bed in
diameters: the steps are shorter. (That a step takes more iterations shows in the first twenty.)
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.pouring import NO_STEPS, shipped_deck

STEPS = 20
TOLERANCE = 0.005  # radii
SPACING = 1.06  # of the lattice, diameters
SEED = 1
END = "run             100000000\n"


@dataclass(frozen=True)
class Effort:
    """What a run took.

    Attributes
    ----------
    seconds : of the time loop
    bytes : largest resident memory
    steps : taken
    iterations : of the solver
    """

    seconds: float
    bytes: int
    steps: int
    iterations: int


def diameter_of(particles: int) -> float:
    """Return the diameter with which the bed is as high as that of 10,000 spheres of 0.052."""
    return float(0.052 * (10_000 / particles) ** (1 / 3))


def write_lattice(path: Path, particles: int) -> None:
    """Write a LAMMPS data file of spheres on a jittered cubic lattice that stands on the floor."""
    diameter = diameter_of(particles)
    across = int(1 / (SPACING * diameter))
    number = np.arange(particles)
    cells = np.column_stack(
        (number % across, number // across**2, number // across % across)
    ).astype(float)
    spacing = np.array([1 / across, SPACING * diameter, 1 / across])
    # So far that no two spheres overlap.
    jitter = 0.5 * (SPACING - 1) * diameter
    places = (cells + 0.5) * spacing
    places += np.random.default_rng(SEED).uniform(-jitter, jitter, places.shape)
    with path.open("w") as file:
        file.write(f"lattice\n\n{particles} atoms\n1 atom types\n\n")
        file.write("0 1 xlo xhi\n0 5 ylo yhi\n0 1 zlo zhi\n\nAtoms # sphere\n\n")
        for k, (x, y, z) in enumerate(places, 1):
            file.write(f"{k} 1 {diameter!r} 1 {x:.15g} {y:.15g} {z:.15g}\n")


def settle(folder: Path, particles: int, steps: int | None) -> Effort:
    """Let the lattice fall in `folder`, for some steps or until it is at rest."""
    folder.mkdir(parents=True, exist_ok=True)
    write_lattice(folder / "lattice.data", particles)
    common = {"diameter": repr(diameter_of(particles)), "tolerance": TOLERANCE}
    text = shipped_deck("settling")
    if steps is not None:
        assert END in text
        text = text.replace(END, f"run {steps}\n")
    start = {"particles": particles, "start": "lattice.data", "out": "start", **NO_STEPS, **common}
    _lmp(folder, "spheres", shipped_deck("spheres"), start)
    memory = _lmp(folder, "settling", text, {"packing": "start/packing.restart", **common})
    log = (folder / "settling" / "log.lammps").read_text()
    loop = re.search(r"^Loop time of (\S+) on .* for (\d+) steps", log, re.MULTILINE)
    solved = re.search(r"^Fix inelastic: \d+ projections, (\d+) iterations", log, re.MULTILINE)
    assert loop is not None
    assert solved is not None
    return Effort(float(loop[1]), memory, int(loop[2]), int(solved[1]))


def _lmp(folder: Path, name: str, text: str, variables: dict[str, object]) -> int:
    """Run a deck on one core; return the largest resident memory in bytes."""
    (folder / f"{name}.in").write_text(text)
    command = [str(Path(sys.executable).parent / "lmp"), "-in", f"{name}.in", "-screen", "none"]
    for variable, value in variables.items():
        command += ["-var", variable, str(value)]
    process = subprocess.Popen(command, cwd=folder, env=os.environ | {"OMP_NUM_THREADS": "1"})
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{folder / f'{name}.in'} failed: see its log.lammps")
    return usage.ru_maxrss * 1024


def measure(folder: Path) -> None:
    """Print memory and time of a million spheres, and what the whole would take."""
    small_start = settle(folder / "100000-start", 100_000, STEPS)
    small = settle(folder / "100000", 100_000, None)
    large = settle(folder / "1000000", 1_000_000, STEPS)
    taller = 10 ** (1 / 3)
    for name, effort in (("100,000", small_start), ("1,000,000", large)):
        print(
            f"{name} spheres, {effort.steps} steps: {effort.seconds / effort.steps:.2f} s a step, "
            f"{effort.iterations / effort.steps:.0f} iterations a step, "
            f"{effort.bytes / 2**30:.2f} GiB",
            flush=True,
        )
    whole = large.seconds * small.seconds / small_start.seconds * taller
    print(
        f"100,000 spheres from the lattice to t = 2: {small.steps} steps, {small.seconds:.0f} s; "
        f"1,000,000 would take {whole / 3600:.1f} h on one core",
        flush=True,
    )
