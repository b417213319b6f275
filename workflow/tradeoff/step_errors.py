"""The errors of velocities and forces in the recorded steps of a run with hard contacts.

Two packings do not tell them, as trajectories are chaotic; steps do. A record has a step's problem,
and the velocities and forces that the fix has left; it is solved exactly outside of LAMMPS.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from lammps_inelastic import core

from ..decks import find_deck, gravity_of
from ..files import write_text
from ..provenance.finished import read_json
from ..shipped import SETTLING
from .states import MOST_OF_EXACT, records_in

ERRORS = "errors.json"
# Of the exact solutions [radii]. Grains that contacts hold hardly at all keep some steps from going
# further. In one of these velocities change by 3e-7 g h from 1e-9 to 1e-10 radii.
EXACT = 1e-10


@dataclass(frozen=True)
class StepErrors:
    """What the recorded steps of a run leave of velocities and forces.

    Attributes
    ----------
    steps : number of recorded steps
    velocity_error : root mean square, over the spheres and the steps, of the difference of the
        velocity to the exact one, in units of g h, h the time step
    force_error : sum over the contacts and the steps of the differences of the forces to the exact
        ones, over the sum of the exact forces; NaN where there is none
    """

    steps: int
    velocity_error: float
    force_error: float


def errors_in(folder: Path) -> StepErrors:
    """Return the errors of a run: as they were written before, or else from its records.

    Raises ValueError if a record is damaged, there is none, or one cannot be solved.
    """
    with suppress(ValueError):
        return read_errors(folder / ERRORS)
    gravity = gravity_of(find_deck(SETTLING, Path()).text)
    records = map(core.read_record, records_in(folder))
    found = errors_of(records, math.nan if gravity is None else gravity)
    write_errors(folder / ERRORS, found)
    return found


def write_errors(path: Path, found: StepErrors) -> None:
    """Write errors as JSON."""
    write_text(path, json.dumps(asdict(found), indent=1) + "\n")


def read_errors(path: Path) -> StepErrors:
    """Read what write_errors has written. Raises ValueError for anything else."""
    return TypeAdapter(StepErrors).validate_python(read_json(path))


def errors_of(records: Iterable[core.Record], gravity: float) -> StepErrors:
    """Compare what the fix has left in recorded steps with the exact solutions.

    Raises ValueError if there is no record, or an exact solution is not to be had.

    Parameters
    ----------
    records : recorded steps
    gravity : g, length/time^2
    """
    steps, spheres, squares, apart, forces = 0, 0, 0.0, 0.0, 0.0
    for record in records:
        exact = exact_solution(record)
        timestep = record.problem.timestep
        velocity = (record.arrays["velocity"] - exact.velocity) / (gravity * timestep)
        steps += 1
        spheres += len(velocity)
        squares += float((velocity**2).sum())
        # Impulses of a step that was shortened are smaller by as much: forces are compared.
        apart += float(np.abs(record.arrays["impulse"] - exact.impulse).sum()) / timestep
        forces += float(np.abs(exact.impulse).sum()) / timestep
    if not steps:
        raise ValueError("no recorded contact problem is there")
    return StepErrors(
        steps,
        math.sqrt(squares / spheres),
        apart / forces if forces > 0 else math.nan,
    )


def exact_solution(record: core.Record) -> core.Projection:
    """Return the exact solution of a recorded step, up to a residual of EXACT radii.

    Where more contacts press than are needed, forces are not unique: it is one near those of the
    fix.

    Raises ValueError if it is not to be had.
    """
    limits = core.Limits(EXACT * float(record.arrays["radius"].min()), max_iterations=MOST_OF_EXACT)
    found = core.project(replace(record.problem, impulse_guess=record.arrays["impulse"]), limits)
    if not found.converged:
        raise ValueError(
            f"step {record.step}: {EXACT:g} r is not reached in {MOST_OF_EXACT:,} iterations: "
            f"{found.status}"
        )
    return found
