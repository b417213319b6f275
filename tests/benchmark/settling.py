"""Starts that settle: hard contacts against soft ones, and several sizes.

All runs are those of `inelastic tradeoff`, whose rows of numbers are read here.
"""

from __future__ import annotations

import csv
import itertools
import math
import re
import statistics
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.benchmark.million import diameter_of

TIME = 2.0
LOOSE = 0.005  # radii
TOLERANCES = (LOOSE, 0.0005)
DT = 0.01  # of spheres of this diameter; the step goes with the square root of the diameter
DIAMETER = 0.052


@dataclass(frozen=True)
class Run:
    """One row of `tradeoff.csv`."""

    values: dict[str, str]

    def number(self, name: str) -> float:
        """Return a number; NaN where there is none."""
        return float(self.values[name] or "nan")


def tradeoff(folder: Path, *arguments: str) -> list[Run]:
    """Run `inelastic tradeoff` in `folder`, where its log is; return its runs."""
    folder.mkdir(parents=True, exist_ok=True)
    command = [str(Path(sys.executable).parent / "inelastic"), "tradeoff", "--out", str(folder)]
    command.append("--no-states")
    with (folder / "tradeoff.out").open("w") as log:
        subprocess.run([*command, *arguments], stdout=log, stderr=subprocess.STDOUT, check=True)
    with (folder / "tradeoff.csv").open() as file:
        return [Run(row) for row in csv.DictReader(file)]


def spread(values: Iterable[float], form: str = ".2g") -> str:
    """Return median and range of those values that there are."""
    known = [value for value in values if math.isfinite(value)]
    if not known:
        return "none"
    middle = statistics.median(known)
    return f"{middle:{form}} ({min(known):{form}} to {max(known):{form}})"


def compare(folder: Path, particles: int, diameter: float, seeds: int, time: float) -> None:
    """Print times to the plateau with hard and with soft contacts, and their ratios.

    Parameters
    ----------
    folder : where the runs are kept
    particles, diameter : of the scenes; length
    seeds : random starts
    time : to the end of a run; a start that is not at rest by then is left out, and counted
    """
    scenes = {
        f"{particles:,} spheres": ["--particle", "spheres"],
        f"{particles:,} dimers of L/d 1.5": ["--particle", "dimers", "--aspect-ratio", "1.5"],
    }
    both = ",".join(map(str, TOLERANCES))
    for name, chosen in scenes.items():
        runs = tradeoff(
            folder / chosen[1],
            *chosen,
            *("--particles", str(particles), "--diameter", str(diameter), "--seeds", str(seeds)),
            *("--tolerances", both, "--soft-tolerances", both, "--time", str(time)),
        )
        for tolerance in TOLERANCES:
            hard, soft = (
                [
                    run
                    for run in runs
                    if run.values["contacts"] == contacts and run.number("tolerance") == tolerance
                ]
                for contacts in ("hard", "soft")
            )
            times = _ratios(hard, soft, "plateau_seconds")
            overlaps = _ratios(hard, soft, "overlap_at_rest")
            # Soft steps go as the root of the stiffness, overlaps as one over it.
            equal = [time * math.sqrt(depth) for time, depth in zip(times, overlaps, strict=True)]
            known = sum(map(math.isfinite, times))
            print(
                f"{name}, {tolerance:g} r (overlaps at rest: hard {_largest(hard)}, soft "
                f"{_largest(soft)}): hard {_seconds(hard)} s to the plateau, soft "
                f"{_seconds(soft)} s, {spread(times, '.3g')} times as long; at equal overlaps "
                f"{spread(equal, '.3g')} times ({known} of {seeds} starts)",
                flush=True,
            )


def _ratios(hard: Sequence[Run], soft: Sequence[Run], name: str) -> list[float]:
    """Return soft over hard, start by start."""
    of_hard = {run.values["start"]: run.number(name) for run in hard}
    return [run.number(name) / of_hard[run.values["start"]] for run in soft]


def _seconds(runs: Sequence[Run]) -> str:
    return spread(run.number("plateau_seconds") for run in runs)


def _largest(runs: Sequence[Run]) -> str:
    known = [run.number("overlap_at_rest") for run in runs]
    return f"{max((one for one in known if math.isfinite(one)), default=math.nan):.2g} r"


def grow(folder: Path, sizes: Sequence[int]) -> None:
    """Print how iterations grow with the bed."""
    heights, per_step = [], []
    for particles in sizes:
        diameter = diameter_of(particles)
        (one,) = tradeoff(
            folder / str(particles),
            *("--particles", str(particles), "--diameter", repr(diameter), "--seeds", "1"),
            *("--tolerances", str(LOOSE), "--soft-tolerances", "none", "--time", str(TIME)),
            *("--dts", f"{DT * math.sqrt(diameter / DIAMETER):.6g}"),
        )
        whole = one.number("settling_seconds")
        steps = one.number("steps")
        # The bed is equally high for every number; what grows is its height in diameters.
        heights.append(1.0 / diameter)
        per_step.append(one.number("iterations") / steps)
        constraint = _constraint(folder / str(particles))
        print(
            f"{particles:,} spheres at {LOOSE:g} r: {whole:.1f} s to t = {TIME:g}, {steps:.0f} "
            f"steps, {per_step[-1]:.0f} iterations a step ({constraint}); {_plateau(one)}, "
            f"phi {one.number('packing_fraction'):.4f}, z {one.number('coordination_number'):.3f}",
            flush=True,
        )
    for (low, few), (high, many) in itertools.pairwise(zip(heights, per_step, strict=True)):
        exponent = math.log(many / few) / math.log(high / low)
        print(
            f"iterations a step grow as the bed's height in diameters to the power {exponent:.2f} "
            f"from {low:.0f} to {high:.0f}",
            flush=True,
        )


def _plateau(run: Run) -> str:
    time, seconds = run.number("plateau_time"), run.number("plateau_seconds")
    return f"plateau at t = {time:.2f} after {seconds:.1f} s"


def _constraint(folder: Path) -> str:
    """Return what the log of the run on one rank says of the time of a constraint."""
    logs = sorted((folder / "ranks-1").glob("cases/*/log.lammps"))
    found = re.search(r"solve takes (.*)$", logs[0].read_text(), re.MULTILINE)
    assert found is not None
    return found[1]
