"""The measurements of a start that settles (inputs/settling.in): when it is at rest, and how well.

Hard and soft contacts have the same numbers, from the same files as far as both write them: time
and wall time come from the log, overlaps from the positions alone. Soft contacts have no contact
dump: their contacts are the overlaps, each with a force that is proportional to its depth.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lammps_inelastic.analysis import (
    ContactFrame,
    ParticleFrame,
    RunFiles,
    RunLog,
    at_steps,
    contacts_by_distance,
    largest_pair_overlap,
    largest_wall_overlap,
)

from ..shipped import SETTLING
from .thermo import read_thermo

FloatArray = NDArray[np.float64]

# A start is at rest where over so much time the packing fraction has changed by less than this
# share, and the centre of mass has stayed within so many diameters.
WINDOW = 0.25
STEADY, STANDING = 1e-3, 0.05


def is_settling(stage: Mapping[str, Any]) -> bool:
    """Say whether a stage of a run's record is of the deck that lets a start settle."""
    return bool(stage["deck"] == SETTLING)


def has_soft_contacts(stage: Mapping[str, Any]) -> bool:
    """Say whether a stage of a run's record has no contact dump: its contacts are overlaps."""
    return is_settling(stage) and stage["variables"]["contacts"] == "soft"


def contact_frames(
    files: RunFiles, stage: Mapping[str, Any], frame: ParticleFrame
) -> Iterable[ContactFrame]:
    """Return a stage's contact frames: those of its dump, or the overlaps of soft contacts.

    Parameters
    ----------
    files : files of the stage
    stage : stage of the run's record
    frame : last frame of the particle dump
    """
    if has_soft_contacts(stage):
        return [overlaps_as_contacts(frame)]
    return files.contact_frames(frame)


def overlaps_as_contacts(frame: ParticleFrame) -> ContactFrame:
    """Return all overlaps of spheres with each other and with the box as contacts.

    A contact's force is the depth of the overlap, which is the force over the stiffness.
    """
    found = contacts_by_distance(frame.spheres, 0.0, frame.cell.flat_faces)
    return ContactFrame(
        step=frame.step,
        ids=found.ids(frame.ids),
        points=found.points,
        normals=found.normals,
        gaps=found.gaps,
        forces=-found.gaps,
    )


def first_at_rest(
    times: ArrayLike, packing_fraction: ArrayLike, height: ArrayLike, diameter: float
) -> int | None:
    """Return the index of the first frame in which a start has come to rest; None if none has.

    Two things hold there. Over the last 0.25 time units the packing fraction in the box has changed
    by less than 0.1 %. And the packing stands: all that time the centre of mass has stayed within
    5 % of a diameter. A steady packing fraction alone says little: a cloud that falls as a whole
    keeps its own, and one that swings meets an earlier value again and again. A free fall moves by
    0.3 and more in 0.25 time units, however small the spheres; a packing that goes on being shaken,
    as by loose contacts, moves by more than 5 % of a diameter, too.

    Parameters
    ----------
    times : (f,), ascending, time
    packing_fraction : (f,), read between two frames by linear interpolation
    height : (f,), height of the centre of mass, length; likewise
    diameter : diameter of a sphere, length
    """
    when = np.asarray(times, dtype=np.float64)
    share = np.asarray(packing_fraction, dtype=np.float64)
    up = np.asarray(height, dtype=np.float64)
    for index, before in enumerate(when - WINDOW):
        # The frame at 0.25 has the first one before it, but for round-off. NaN is in no window.
        if not before >= when[0] - 1e-9:
            continue
        within = (when > before) & (when <= when[index])
        heights = np.append(up[within], np.interp(before, when, up))
        change = abs(share[index] - np.interp(before, when, share))
        if change < STEADY * share[index] and np.ptp(heights) < STANDING * diameter:
            return index
    return None


def measure_settling(
    files: RunFiles, log: RunLog, stage: Mapping[str, Any], seen: Mapping[str, Any]
) -> tuple[dict[str, float], dict[str, NDArray[Any]]]:
    """Measure how a start has settled.

    Parameters
    ----------
    files : dumps of the run
    log : log of the run
    stage : stage of the run's record
    seen : evolution of the dump: `evolution/time`, `evolution/packing_fraction` and
        `evolution/centre_height`, (f,) each

    Returns
    -------
    numbers : by the names in the schema, without `numbers/`; NaN where the packing has not come to
        rest
    network : contact network of the last frame, by the names in the schema
    """
    dump = files.particles
    last = dump[-1]
    smallest = float(last.radii.min())
    diameter = 2 * float(last.radii.max())
    times, height = seen["evolution/time"], seen["evolution/centre_height"]
    rest = first_at_rest(times, seen["evolution/packing_fraction"], height, diameter)
    overlaps = np.array([_largest_overlap(frame) for frame in dump]) / smallest
    numbers = {
        "plateau_time": math.nan if rest is None else float(times[rest]),
        "plateau_seconds": math.nan,
        "overlap_at_rest": math.nan if rest is None else float(overlaps[rest:].max()),
        # The overlaps in the first frame are of the run that made the start.
        "overlap_falling": float(overlaps[1:rest].max(initial=0.0)),
        "drift": _drift(times, height) / diameter,
        "settling_seconds": math.fsum(run.seconds or 0.0 for run in log.runs),
        "steps": float(sum(run.steps or 0 for run in log.runs)),
    }
    hard = stage["variables"]["contacts"] == "hard"
    if hard:
        numbers |= {"plateau_iterations": math.nan, "complementarity_at_rest": math.nan}
    if rest is not None:
        step = dump.steps[rest]
        clock = read_thermo(log, "CPU")
        numbers["plateau_seconds"] = float(at_steps([step], clock["Step"], clock["CPU"])[0])
        if hard:
            solved = read_thermo(log, "iterations", "complementarity")
            late = solved["Step"] >= step
            numbers["plateau_iterations"] = float(
                solved["iterations"][solved["Step"] <= step].sum()
            )
            numbers["complementarity_at_rest"] = float(
                solved["complementarity"][late].max() / smallest
            )
    *_, network = contact_frames(files, stage, last)
    return numbers, {"network/ids": network.ids, "network/forces": network.forces}


def _largest_overlap(frame: ParticleFrame) -> float:
    """Return the largest overlap of two particles or with a wall, length."""
    pair = largest_pair_overlap(frame.spheres)
    wall = largest_wall_overlap(frame.spheres, frame.cell.flat_faces)
    return max(pair.depth, wall.depth)


def _drift(times: FloatArray, height: FloatArray) -> float:
    """Return the speed of the centre of mass over the last 0.25 time units, length / time."""
    before = times[-1] - WINDOW
    if before < times[0]:
        return math.nan
    return float(abs(height[-1] - np.interp(before, times, height)) / WINDOW)
