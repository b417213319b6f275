"""A million spheres: poured from random points until they are at rest, on two ranks.

The shipped decks run with other parameters, and no change: `spheres.in` makes the start,
`settling.in` lets it fall until it is at rest. The tolerance is 0.005 radii, and the contacts are
those of the last step. Packing fraction and coordination number are those of the box of the paper,
as for every other packing; the pictures are of the first frames and the last.
"""

from __future__ import annotations

import resource
import time
from pathlib import Path

from lammps_inelastic.analysis import ParticleDump, draw_packing
from tests.helpers.pouring import NO_STEPS, projections, run_deck, shipped_deck, summed
from tests.helpers.pouring import measure as measure_packing

PARTICLES = 1_000_000
RANKS = 2
CONTAINER = [[0, 1], [0, 5], [0, 1]]
COMMON: dict[str, object] = {"tolerance": 0.005}
SETTLING: dict[str, object] = {"time_settling": 2.5, "time_between": 0.5}


def diameter_of(particles: int) -> float:
    """Return the diameter with which the bed is as high as that of 10,000 spheres of 0.052."""
    return float(0.052 * (10_000 / particles) ** (1 / 3))


def pour(folder: Path, particles: int) -> str:
    """Run the decks in folders of their own; return what that took, in words."""
    common = COMMON | {"diameter": repr(diameter_of(particles))}
    stages: dict[str, tuple[str, dict[str, object]]] = {
        "start": ("spheres", {"particles": particles, **NO_STEPS}),
        "settling": ("settling", {"packing": folder / "start" / "packing.restart", **SETTLING}),
    }
    words = []
    for name, (deck, variables) in stages.items():
        start = time.monotonic()
        log = run_deck(folder / name, shipped_deck(deck), common | variables, ranks=RANKS)
        run = summed(projections(log))
        minutes = (time.monotonic() - start) / 60
        overlap = 2 * run.overlap / diameter_of(particles)
        words.append(
            f"{name}: {minutes:.1f} minutes, {run.projections} steps, {run.iterations:,} "
            f"iterations, largest overlap {overlap:.6f} radii"
        )
    gigabytes = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    return "\n".join([*words, f"{RANKS} ranks, {gigabytes:.1f} GiB each"])


def measure(folder: Path, particles: int = PARTICLES) -> None:
    """Pour them in `folder`, unless that was done before; print what came out, and draw it."""
    took = folder / "took.txt"
    if not took.exists():
        took.write_text(pour(folder.absolute(), particles))
    print(f"{particles:,} spheres\n{took.read_text()}", flush=True)
    packing = measure_packing(folder / "settling")
    assert packing.packing_fraction.value is not None
    print(
        f"packing fraction {100 * packing.packing_fraction.value:.2f} %, "
        f"coordination number {packing.coordination_number.mean:.3f}",
        flush=True,
    )
    dump = ParticleDump(folder / "settling" / "particles.lammpsdump")
    for index in (0, 1, 2, len(dump) - 1):
        frame = dump[index]
        path = folder / f"step-{frame.step}.png"
        draw_packing(path, frame.spheres, CONTAINER)
        print(path, flush=True)
