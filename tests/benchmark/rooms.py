"""Where the time of a step goes: nanoseconds a constraint, part by part and phase by phase.

The deck spheres.in is run once, with thermo output at every step. A constraint costs its part of
LAMMPS's neighbour list, of finding constraints (collect), of the projections (solve: all sweeps
over it, and what prepares and judges them), of the check whether the step may go so far, of what
takes the forces (apply), and of everything else.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.helpers.pouring import run_deck, shipped_deck

THERMO = re.compile(r"^thermo +\$\{dump_every\}$", re.MULTILINE)
COLUMNS = re.compile(r"^(thermo_style +custom step time ke .*)$", re.MULTILINE)
# Constraints, and how often they are solved in a step.
ADDED = "f_contact[7] f_contact[8]"
RUN = re.compile(r"^ +Step .*?^MPI task timing breakdown:.*?^Other ", re.MULTILINE | re.DOTALL)
LOOP = re.compile(r"^Loop time of (\S+) on .* for (\d+) steps", re.MULTILINE)
PARTS = ("collect", "solve", "check", "apply")
# A phase of fewer steps says nothing of its parts.
FEW = 5


@dataclass(frozen=True)
class Phase:
    """The steps of one `run`.

    Attributes
    ----------
    first, last : steps
    constraints : of a step, on the average
    solves, iterations : of a step, on the average
    visits : iterations times constraints, over all steps
    seconds : of each part, over all steps
    """

    first: int
    last: int
    constraints: float
    solves: float
    iterations: float
    visits: float
    seconds: dict[str, float]

    def line(self) -> str:
        """Return what it took, in words."""
        of_all = self.constraints * (self.last - self.first + 1) / 1e9
        parts = ", ".join(f"{part} {took / of_all:.0f}" for part, took in self.seconds.items())
        visit = 1e9 * self.seconds["solve"] / self.visits
        return (
            f"steps {self.first} to {self.last}: {self.constraints:,.0f} constraints, "
            f"{self.solves:.2f} solves and {self.iterations:.0f} iterations a step; ns a "
            f"constraint: {parts}; of solve {visit:.2f} for each iteration"
        )


def phases(log: str) -> Iterator[Phase]:
    """Return the phases of a log of more than a few steps."""
    for run in RUN.findall(log):
        loop = LOOP.search(run)
        assert loop is not None, run
        names, *lines = run[: loop.start()].strip().splitlines()
        columns = names.split()
        numbers = [line.split() for line in lines if re.match(r" *\d+ ", line)]
        rows = [dict(zip(columns, map(float, row), strict=True)) for row in numbers]
        # The first row is that of the setup.
        steps = rows[1:]
        if len(steps) < FEW or "f_contact[7]" not in columns:
            continue
        said = re.search(r"^  seconds: (.*?)(;|$)", run, re.MULTILINE)
        listed = re.search(r"^Neigh +\| +(\S+)", run, re.MULTILINE)
        assert said is not None, run
        assert listed is not None, run
        took = {name: float(time) for name, time in re.findall(r"(\w+) ([\d.]+)", said[1])}
        seconds = {"list": float(listed[1])} | {part: took[part] for part in PARTS}
        seconds["rest"] = float(loop[1]) - sum(seconds.values())
        yield Phase(
            int(steps[0]["Step"]),
            int(steps[-1]["Step"]),
            sum(row["f_contact[7]"] for row in steps) / len(steps),
            sum(row["f_contact[8]"] for row in steps) / len(steps),
            sum(row["iterations"] for row in steps) / len(steps),
            sum(row["iterations"] * row["f_contact[7]"] for row in steps),
            seconds,
        )


def pour(folder: Path, variables: Mapping[str, object]) -> str:
    """Run the deck, and return its log."""
    deck, thermo = THERMO.subn("thermo 1", shipped_deck("spheres"))
    deck, columns = COLUMNS.subn(rf"\1 {ADDED}", deck)
    assert (thermo, columns) == (1, 1)
    return run_deck(folder, deck, variables)


def measure(particles: int, diameter: float) -> None:
    """Print what each part of a step costs while spheres are poured."""
    with tempfile.TemporaryDirectory(prefix="inelastic-") as folder:
        log = pour(Path(folder), {"particles": particles, "diameter": diameter})
    for phase in phases(log):
        print(f"{particles:,} spheres, {phase.line()}", flush=True)
