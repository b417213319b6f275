"""A million spheres: poured from random points until they are at rest, on two ranks.

The shipped `spheres.in` runs with other parameters, and no change: the tolerance is 0.005 radii,
nothing shakes the spheres, and the phases are shorter. Packing fraction and coordination number are
those of the box of the paper, as for every other packing; the pictures are of the start, the fall
and the end.
"""

from __future__ import annotations

import resource
import time
from pathlib import Path

from lammps_inelastic.analysis import ParticleDump, draw_packing
from tests.pouring import measure as measure_packing
from tests.pouring import projections, run_deck, shipped_deck, summed

PARTICLES = 1_000_000
RANKS = 2
CONTAINER = [[0, 1], [0, 5], [0, 1]]
# While spheres fall a step is as short as the neighbour list needs: the fall is nearly 300.
VARIABLES: dict[str, object] = {
    "tolerance": 0.005,
    "tolerance_measuring": 0.0005,
    "random_force": 0,
    "steps_agitated": 300,
    "steps_settling": 100,
    "steps_resting": 60,
    "steps_tightening": 10,
    "steps_measuring": 2,
    "dump_every": 100,
}


def diameter_of(particles: int) -> float:
    """Return the diameter with which the bed is as high as that of 10,000 spheres of 0.052."""
    return float(0.052 * (10_000 / particles) ** (1 / 3))


def measure(folder: Path, particles: int = PARTICLES) -> None:
    """Pour them in `folder`, unless that was done before; print what came out, and draw it."""
    took = folder / "took.txt"
    if not took.exists():
        start = time.monotonic()
        variables = {"particles": particles, "diameter": repr(diameter_of(particles))}
        run_deck(folder, shipped_deck("spheres"), VARIABLES | variables, ranks=RANKS)
        minutes = (time.monotonic() - start) / 60
        gigabytes = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
        took.write_text(f"{minutes:.1f} minutes on {RANKS} ranks, {gigabytes:.1f} GiB a rank\n")
    run = summed(projections((folder / "log.lammps").read_text()))
    print(
        f"{particles:,} spheres: {took.read_text().strip()}; {run.projections} steps, "
        f"{run.iterations:,} iterations",
        flush=True,
    )
    packing = measure_packing(folder)
    assert packing.packing_fraction.value is not None
    print(
        f"  packing fraction {100 * packing.packing_fraction.value:.2f} %, "
        f"coordination number {packing.coordination_number.mean:.3f}",
        flush=True,
    )
    dump = ParticleDump(folder / "particles.lammpsdump")
    for index in (0, 1, 2, len(dump) - 1):
        frame = dump[index]
        path = folder / f"step-{frame.step}.png"
        draw_packing(path, frame.positions, frame.radii, CONTAINER)
        print(f"  {path}", flush=True)
