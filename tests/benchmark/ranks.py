"""Ranks: two measured beside one, and a model of an iteration on up to 64.

A start settles on one rank and on two. The bed that it ends as is then cut into columns, as ranks
own them, and what limits an iteration is counted: the constraints of the fullest column, and the
spheres that touch one of another column. With the time of a constraint, measured on one rank, and
the time of a message this gives the time of a sweep, an iteration of the default solver:

    T(P) = t L + s (a + 12 B n / b) + e a + 2 a log2 P

    t   time of a constraint (of the solver as a whole: particles are in it)
    L   constraints of the fullest column, for the contacts of the bed at rest
    s   columns beside one, two for each direction that is cut: in a sweep a rank sends a message to
        each of them, and hears one. Here these cost as if it waited for them
    n   spheres of the fullest column that touch one of the next column in one direction, of three
        numbers in single precision each
    e   columns that meet it along an edge, four where both directions are cut: few spheres
    a   time of a small message, b bytes a second; the last term is the reduction of the residuals

Both are given for this machine (measured between two processes) and for a network that is assumed:
2 us and 10 GB/s. How many sweeps there are on two ranks is measured, not a part of the model.
"""

from __future__ import annotations

import math
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import iterate_contact_frames, read_particle_frame
from tests.benchmark.million import diameter_of
from tests.helpers.pouring import NO_STEPS, Projections, projections, run_deck, shipped_deck, summed

TIME = 2.0
TOLERANCE = 0.005  # radii
GRIDS = ((1, 2), (2, 2), (4, 4), (8, 8))  # columns along x and z
BYTES = 12  # of three numbers in single precision
ASSUMED = (2e-6, 10e9)  # seconds, bytes a second
PING_PONG = """
import numpy, time
from mpi4py import MPI
comm = MPI.COMM_WORLD
found = []
for size, times in ((24, 20000), (1200000, 200)):
    data = numpy.zeros(size, dtype=numpy.uint8)
    for _ in range(2):
        comm.Barrier()
        start = time.perf_counter()
        for _ in range(times):
            if comm.rank == 0:
                comm.Send(data, 1)
                comm.Recv(data, 1)
            else:
                comm.Recv(data, 0)
                comm.Send(data, 0)
        seconds = (time.perf_counter() - start) / (2 * times)
    found.append(seconds)
if comm.rank == 0:
    print(found[0], 1200000 / found[1])
"""


@dataclass(frozen=True)
class Network:
    """What a message costs.

    Attributes
    ----------
    name : in words
    latency : time of a small message, seconds
    bandwidth : bytes a second
    """

    name: str
    latency: float
    bandwidth: float


@dataclass(frozen=True)
class Columns:
    """A bed cut into columns.

    Attributes
    ----------
    grid : columns along x and z
    constraints : contacts of the fullest column
    mean : contacts of a column in the mean
    ghosts : spheres of a column that touch one of the next in one direction, at most
    """

    grid: tuple[int, int]
    constraints: int
    mean: float
    ghosts: int

    @property
    def ranks(self) -> int:
        """How many columns there are."""
        return self.grid[0] * self.grid[1]

    def iteration(self, constraint: float, network: Network) -> float:
        """Return the time of an iteration by the formula above, seconds."""
        cuts = sum(number > 1 for number in self.grid)
        message = network.latency + BYTES * self.ghosts / network.bandwidth
        reduction = 2 * network.latency * math.log2(self.ranks)
        edges = 4 * network.latency if cuts == 2 else 0.0
        return constraint * self.constraints + 2 * cuts * message + edges + reduction


def cut(
    positions: NDArray[np.float64],
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    grid: tuple[int, int],
) -> Columns:
    """Cut a bed in the container [0,1] x . x [0,1] into columns of equal width.

    Parameters
    ----------
    positions : of the spheres, (n, 3)
    first, second : spheres of each contact, -1 for a wall, (m,)
    grid : columns along x and z
    """
    place = [
        np.clip((positions[:, axis] * number).astype(int), 0, number - 1)
        for axis, number in zip((0, 2), grid, strict=True)
    ]
    column = place[0] * grid[1] + place[1]
    loads = np.bincount(column[first], minlength=grid[0] * grid[1])
    pairs = second >= 0
    ghosts = 0
    for axis in place:
        for one, other in ((first[pairs], second[pairs]), (second[pairs], first[pairs])):
            beyond = axis[other] > axis[one]
            touching = np.unique(one[beyond])
            if len(touching):
                ghosts = max(ghosts, int(np.bincount(column[touching]).max()))
    return Columns(grid, int(loads.max()), float(loads.mean()), ghosts)


def settle(folder: Path, particles: int, ranks: int) -> tuple[Projections, str]:
    """Let a start settle in `folder` on some ranks; return what it took, and the log."""
    size: dict[str, object] = {"particles": particles, "diameter": diameter_of(particles)}
    run_deck(folder / "start", shipped_deck("spheres"), {**size, **NO_STEPS})
    log = run_deck(
        folder,
        shipped_deck("settling"),
        {
            "packing": "start/packing.restart",
            "diameter": size["diameter"],
            "tolerance": TOLERANCE,
            "time_settling": TIME,
            "dt": 0.01 * math.sqrt(diameter_of(particles) / 0.052),
        },
        ranks=ranks,
    )
    return summed(projections(log)), log


def of_this_machine() -> Network:
    """Measure messages between two processes."""
    program = [str(Path(sys.executable).parent / "mpiexec"), "-bind-to", "core", "-n", "2"]
    done = subprocess.run(
        [*program, sys.executable, "-c", PING_PONG], capture_output=True, text=True, check=True
    )
    latency, bandwidth = map(float, done.stdout.split())
    return Network("this machine", latency, bandwidth)


def measure(particles: int) -> None:
    """Print the times on one rank and two, and the model."""
    with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
        one, log = settle(Path(name) / "one", particles, 1)
        two, _ = settle(Path(name) / "two", particles, 2)
        frame = read_particle_frame(Path(name) / "one" / "particles.lammpsdump")
        *_, contacts = iterate_contact_frames(Path(name) / "one" / "contacts.lammpsdump")
    found = re.findall(r"([\d.]+) ns a constraint", log)
    constraint = 1e-9 * float(found[0])
    faster = one.seconds / two.seconds
    print(
        f"{particles:,} spheres at {TOLERANCE:g} r to t = {TIME:g}: {one.seconds:.1f} s and "
        f"{one.iterations:,} iterations on one rank, {two.seconds:.1f} s and {two.iterations:,} on "
        f"two: {faster:.2f} times as fast, {faster * two.iterations / one.iterations:.2f} times an "
        f"iteration; {1e9 * constraint:.2f} ns a constraint",
        flush=True,
    )
    order = np.argsort(frame.ids)
    ids = frame.ids[order]
    first = np.searchsorted(ids, contacts.ids[:, 0])
    second = np.where(contacts.ids[:, 1] > 0, np.searchsorted(ids, contacts.ids[:, 1]), -1)
    networks = (of_this_machine(), Network("the network assumed", *ASSUMED))
    for network in networks:
        print(
            f"{network.name}: {1e6 * network.latency:.2f} us a message, "
            f"{network.bandwidth / 1e9:.1f} GB/s",
            flush=True,
        )
    serial = constraint * len(first)
    for grid in GRIDS:
        columns = cut(frame.positions[order], first, second, grid)
        speeds = ", ".join(
            f"{serial / columns.iteration(constraint, network):.1f} times with {network.name}"
            for network in networks
        )
        print(
            f"model, {columns.ranks} ranks: fullest column {columns.constraints:,} contacts "
            f"({columns.constraints / columns.mean:.2f} times the mean), {columns.ghosts:,} "
            f"spheres a message: an iteration as fast as one rank's {speeds}",
            flush=True,
        )
