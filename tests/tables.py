"""Prints the measured tables of the README and of the fix's page: `make tables`.

`tables.py agitation` shows the packing fraction against the random force, `tables.py contacts` the
coordination number against time step, tolerance and solver, `tables.py size` against the number of
spheres. Every row is nine seeds unless --seeds says otherwise.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from pouring import Packing, measure, run_deck, spheres_deck

GRAVITY, RADIUS = 9.81, 0.055


def pour(variables: Mapping[str, object], seeds: int, deck: str | None = None) -> list[Packing]:
    """Pour the spheres once for every seed."""
    packings = []
    for seed in range(1, seeds + 1):
        with tempfile.TemporaryDirectory() as folder:
            run_deck(
                Path(folder),
                deck or spheres_deck(),
                {"dump_every": 100000, "seed": seed, **variables},
            )
            packings.append(measure(Path(folder)))
    return packings


def spread(values: list[float], digits: int) -> str:
    """Mean ± standard deviation (standard error)."""
    if len(values) == 1:
        return f"{values[0]:.{digits}f}"
    deviation = statistics.stdev(values)
    return (
        f"{statistics.mean(values):.{digits}f} ± {deviation:.{digits}f} "
        f"({deviation / len(values) ** 0.5:.{digits}f})"
    )


def row(packings: list[Packing]) -> str:
    phi = [100 * packing.packing_fraction.value for packing in packings]
    z = [packing.coordination_number.mean for packing in packings]
    return f"{spread(phi, 2)} | {spread(z, 3)}"


def agitation(seeds: int) -> Iterator[str]:
    yield "| random force / g | packing fraction % | coordination number |"
    yield "|---|---|---|"
    for force in (0, 10, 30, 100, 300):
        yield f"| {force / GRAVITY:.2g} | {row(pour({'random_force': force}, seeds))} |"


def contacts(seeds: int) -> Iterator[str]:
    yield "| solver | h | eps / r | eps / (g h^2) | packing fraction % | coordination number |"
    yield "|---|---|---|---|---|---|"
    for solver in ("apgd", "uzawa"):
        deck = spheres_deck()
        if solver == "uzawa":
            # The packing is made by apgd: Uzawa only measures, over fewer steps.
            deck = deck.replace(
                "fix_modify      contact tolerance ${eps_last}",
                "fix contact all inelastic ${eps_last} region container "
                "solver uzawa maxiter 10000000",
            )
        for timestep in (0.005, 0.01, 0.02):
            for tolerance in (0.0005, 0.0001, 0.00002):
                variables: dict[str, object] = {
                    "dt": timestep,
                    # The same times for every time step
                    "steps_agitated": round(4 / timestep),
                    "steps_settling": round(8 / timestep),
                    "tolerance_measuring": tolerance,
                }
                resolution = tolerance * RADIUS / (GRAVITY * timestep**2)
                yield (
                    f"| {solver} | {timestep} | {tolerance} | {resolution:.3f} | "
                    f"{row(pour(variables, seeds, deck))} |"
                )


def size(seeds: int) -> Iterator[str]:
    yield "| spheres | diameter | packing fraction % | coordination number |"
    yield "|---|---|---|---|"
    for particles, diameter, runs in ((1000, 0.11, seeds), (10000, 0.052, min(2, seeds))):
        packings = pour({"particles": particles, "diameter": diameter}, runs)
        yield f"| {particles} | {diameter} | {row(packings)} |"


TABLES = {"agitation": agitation, "contacts": contacts, "size": size}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[[], *TABLES], help="default: all")
    parser.add_argument("--seeds", type=int, default=9)
    arguments = parser.parse_args()
    for name in arguments.tables or TABLES:
        for line in TABLES[name](arguments.seeds):
            print(line, flush=True)
        print(flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
