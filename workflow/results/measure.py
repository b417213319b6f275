"""A finished run measured: from its folder to a result with everything that a study asks for.

    python -m lammps_inelastic.workflow.results.measure FOLDER TARGET OUTPUTS

writes TARGET, an HDF5 file; OUTPUTS is JSON. It prints a line for each number that the packing does
not have and for a box that reaches out of it, and nothing else. It is a process of its own, so that
it can be killed, and leaves no memory in use.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import (
    AnalysisError,
    BoxInBed,
    ContactCounts,
    ContactFrame,
    Orientation,
    PackingMeasurement,
    ParticleDump,
    ParticleFrame,
    PictureError,
    RunFiles,
    RunLog,
    Unrest,
    at_steps,
    best_packing_fraction,
    bond_order,
    contact_counts,
    contacts_of,
    fabric_tensor,
    force_distribution,
    measure_evolution,
    measure_packing,
    open_run,
    packing_fraction_with_necks,
    radial_distribution,
    read_run_log,
    wall_profile,
    wall_profile_monte_carlo,
)
from lammps_inelastic.analysis.run_files import AGAIN

from ..decks import gravity_of
from ..errors import WorkflowError, WriteError
from ..looking.pictures import pictures_of
from ..looking.view import KnownContacts, packing_values
from ..provenance.finished import (
    CONTACTS,
    FINISHED,
    LOG,
    MEASURED_BY,
    NOT_AT_REST,
    NOT_MEASURED,
    NOT_WHOLE,
    OUT_OF_BED,
    PARTICLES,
    check_stage,
)
from ..provenance.run_record import THIS, versions
from ..study import Outputs, ProfileOutput
from .reference_values import excess_contacts, firm_part, power_laws
from .settling import contact_frames, has_soft_contacts, is_settling, measure_settling
from .store import Result, write_result
from .thermo import cumulated, read_thermo

# The packing fraction of a frame has so many random points, where it is not exact.
POINTS_PER_FRAME = 100_000
# The radial distribution function goes so far, where the box leaves the room [diameters].
LARGEST_DISTANCE = 4.0
BINS_PER_DIAMETER = 50
FORCE_BINS, LARGEST_FORCE = 50, 5.0
# All random points have this seed.
SEED = 1

FloatArray = NDArray[np.float64]
Values = dict[str, NDArray[Any]]


def measure_case(folder: Path, outputs: Outputs) -> Result:
    """Measure a finished run, all of its stages.

    Raises AnalysisError or WorkflowError with one line if its files are not whole.
    """
    record = json.loads((folder / FINISHED).read_text())
    measured = {**record, MEASURED_BY: versions()[THIS]}
    result: Result | None = None
    for stage in record["stages"]:
        files, log = _open(folder, record, stage)
        is_last = stage is record["stages"][-1]
        values = _measure(files, log, stage, outputs, is_last=is_last)
        pictures: dict[str, bytes] = {}
        if is_last:
            values["numbers/wall_seconds"] = np.asarray(record["wall_seconds"], dtype=float)
            contacts = _last_contacts(files, stage, outputs)
            pictures = pictures_of(files.particles, contacts if outputs.network else None, outputs)
            if outputs.packing and contacts is not None:
                known = KnownContacts(contacts.ids, contacts.points, contacts.forces)
                values |= packing_values(files.particles[-1], known)
        result = Result(values, pictures, measured, outputs.measured, before=result)
    assert result is not None
    return result


def _open(
    folder: Path, record: Mapping[str, Any], stage: Mapping[str, Any]
) -> tuple[RunFiles, RunLog]:
    """Open the files of a stage: those of this run, and whole."""
    where = folder / stage["folder"]
    log = read_run_log(where / LOG)
    contacts = None if has_soft_contacts(stage) else where / CONTACTS
    files = open_run(ParticleDump(where / PARTICLES), contacts, log)
    check_stage(folder, record, stage, files, log)
    return files, log


def _measure(
    files: RunFiles, log: RunLog, stage: Mapping[str, Any], outputs: Outputs, *, is_last: bool
) -> Values:
    """Measure what a study asks for of a stage; return arrays by the names in the schema."""
    dump = files.particles
    frame = dump[-1]
    box = outputs.bounds
    particles = frame.particles
    smallest = float(frame.radii.min())
    in_box = frame.spheres.particles_in(box)
    frames = contact_frames(files, stage, frame) if in_box.any() else ()
    contacts = _ContactFrames.of(frames, frame, in_box)
    packing = measure_packing(frame, contacts.counts, box, points=outputs.points, seed=SEED)
    numbers: dict[str, float] = {
        "particles": len(particles),
        "spheres": len(frame.ids),
        "particles_in_box": int(in_box.sum()),
        "box_in_bed": packing.bed.share,
        **_packing_fractions(packing, frame, box, outputs.points),
        **_effort(log, smallest),
    }
    numbers["largest_overlap"] = packing.pair_overlap.depth / smallest
    numbers |= {
        f"centre_{axis}": float(v)
        for axis, v in zip("xyz", frame.positions.mean(axis=0), strict=True)
    }
    # What a deck before the last one leaves may move.
    numbers |= _unrest(log.unrest_at(frame.step), said=is_last)
    resolution = _resolution(stage, float(frame.radii.max()))
    if resolution is not None:
        numbers["resolution"] = resolution
    values: Values = {"bed/ends": packing.bed.bed}
    if packing.bed.inside is not None:
        values["bed/box"] = packing.bed.inside
    # A deck before the last one may leave a cloud, which has no ends.
    if is_last and not packing.bed.is_inside:
        _say_out_of_bed(packing.bed)
    if in_box.any():
        numbers |= _contact_numbers(packing, contacts, values)
        numbers |= _orientation(packing.orientation)
        _layers(frame, contacts.counts, box, values)
        if contacts.excess and not has_soft_contacts(stage):
            excess = float(np.mean(contacts.excess))
            # Without a particle that is held there are no degrees of freedom to compare with.
            numbers |= {} if math.isnan(excess) else {"excess_contacts": excess}
            numbers |= power_laws(contacts.last[0], frame, stage, values)
        if outputs.structure:
            numbers |= _structure(frame, box, values)
    if outputs.evolution or is_settling(stage):
        numbers |= _evolution(dump, log, stage, box, values)
    if is_settling(stage):
        settled = measure_settling(files, log, stage, values)
        numbers |= settled[0]
        values |= settled[1]
    if outputs.profile is not None:
        _profile(frame, box, outputs.profile, values)
    values |= {f"numbers/{name}": np.asarray(value, dtype=float) for name, value in numbers.items()}
    return values


def _unrest(unrest: Unrest | None, *, said: bool) -> dict[str, float]:
    """Return how far a packing is from rest, if that is known; say so of one that moves."""
    if unrest is None:
        return {}
    if said and not unrest.at_rest:
        _say(f"{NOT_AT_REST}{unrest.words}; every number is of a bed that still moves")
    return {
        "at_rest": float(unrest.at_rest),
        "rest_speed": unrest.speed,
        "net_force": unrest.net_force,
    }


def _packing_fractions(
    packing: PackingMeasurement, frame: ParticleFrame, box: FloatArray | None, points: int
) -> dict[str, float]:
    """Return the packing fraction, of dimers also with the volume at their necks."""
    measured = packing.packing_fraction
    drawn = measured.drawn
    numbers = {
        "packing_fraction": measured.value,
        "packing_fraction_monte_carlo": drawn.value,
        "packing_fraction_monte_carlo_error": drawn.uncertainty,
    }
    if (frame.particles.sizes == 2).all() and not frame.cell.flat:
        # The points are the same: what the necks add has a far smaller error than either share.
        with_necks = packing_fraction_with_necks(frame.spheres, box, points=points, seed=SEED)
        added = with_necks.value - drawn.value
        numbers["packing_fraction_with_necks"] = numbers["packing_fraction"] + added
        numbers["packing_fraction_with_necks_error"] = math.sqrt(added * (1 - added) / points)
    return numbers


@dataclass(frozen=True, eq=False)
class _ContactFrames:
    """The contacts of all contact frames that particles in the box have.

    Attributes
    ----------
    counts : contacts of each particle, one entry a frame
    rattlers : share of the particles in the box that are rattlers, one entry a frame
    held : mean contacts of the others among themselves, one entry a frame that has others
    forces : forces of contacts in the box, one array a frame
    normals : their normals, one array a frame
    excess : contacts less degrees of freedom of the whole packing, one entry a frame
    last : last frame; none without frames
    """

    counts: list[ContactCounts] = field(default_factory=list)
    rattlers: list[float] = field(default_factory=list)
    held: list[float] = field(default_factory=list)
    forces: list[NDArray[np.float64]] = field(default_factory=list)
    normals: list[NDArray[np.float64]] = field(default_factory=list)
    excess: list[float] = field(default_factory=list)
    last: list[ContactFrame] = field(default_factory=list)

    @classmethod
    def of(
        cls, frames: Iterable[ContactFrame], frame: ParticleFrame, in_box: NDArray[np.bool_]
    ) -> _ContactFrames:
        """Read the contact frames one at a time."""
        particles, images = frame.particles, frame.cell.has_images
        found = cls()
        for contacts in frames:
            counts = contact_counts(contacts.ids, frame.ids, particles, images=images)
            found.counts.append(counts)
            inside = contacts_of(in_box, contacts.ids, frame.ids, particles, images=images)
            found.forces.append(contacts.forces[inside])
            found.normals.append(contacts.normals[inside])
            firm = firm_part(contacts, frame)
            found.rattlers.append(float(firm.rattlers[in_box].mean()))
            if not firm.rattlers[in_box].all():
                held = firm.counts.particles[in_box & ~firm.rattlers]
                found.held.append(float(held.mean()))
            found.excess.append(excess_contacts(contacts, frame))
            found.last[:] = [contacts]
        return found


def _contact_numbers(
    packing: PackingMeasurement, contacts: _ContactFrames, values: Values
) -> dict[str, float]:
    """Return contacts, rattlers and fabric; add distributions of contacts and forces to values."""
    between, neighbours, walls = packing.coordination, packing.neighbours, packing.wall_contacts
    if between is None or neighbours is None or walls is None:
        raise AnalysisError("at least one frame of contacts is needed")
    values["distribution/contacts"] = between.distribution
    values["distribution/neighbours"] = neighbours.distribution
    numbers = {
        "coordination_number": between.mean,
        "neighbours": neighbours.mean,
        "wall_contacts": walls.mean,
        "particles_with_0_or_1_contacts": between.particles_with(0, 1),
        "rattlers": float(np.mean(contacts.rattlers)),
    }
    if between.scatter is not None:
        numbers["coordination_number_scatter"] = between.scatter
    if contacts.held:
        numbers["coordination_number_without_rattlers"] = float(np.mean(contacts.held))
    strengths = np.concatenate(contacts.forces)
    if len(strengths):
        spread = force_distribution(strengths, bins=FORCE_BINS, largest=LARGEST_FORCE)
        values["forces/ratio"] = (spread.edges[:-1] + spread.edges[1:]) / 2
        values["forces/density"] = spread.density
        directions = fabric_tensor(np.concatenate(contacts.normals)).diagonal()
        numbers |= {f"fabric_{axis}": float(v) for axis, v in zip("xyz", directions, strict=True)}
    return numbers


def _orientation(lie: Orientation | None) -> dict[str, float]:
    """Return the orientation of dimers; nothing where there is none."""
    if lie is None:
        return {}
    numbers = {f"a_{axis}": float(v) for axis, v in zip("xyz", lie.components, strict=True)}
    numbers["a_isotropic"] = lie.isotropic
    if lie.standard_errors is not None:
        errors = zip("xyz", lie.standard_errors, strict=True)
        numbers |= {f"a_{axis}_error": float(error) for axis, error in errors}
    return numbers


def _last_contacts(
    files: RunFiles, stage: Mapping[str, Any], outputs: Outputs
) -> ContactFrame | None:
    """Return the last contact frame; None if neither network nor packing is asked for."""
    if not (outputs.network or outputs.packing):
        return None
    *_, contacts = contact_frames(files, stage, files.particles[-1])
    return contacts


def _layers(
    frame: ParticleFrame,
    counts: Sequence[ContactCounts],
    box: FloatArray | None,
    values: Values,
) -> None:
    """Add the contacts of particles in layers above the floor, a diameter thick, to values.

    The particles are those between the box's sides, at any height. A cell that is periodic along y
    has no floor.
    """
    if frame.spheres.endless[1]:
        return
    centres = frame.spheres.centres
    column = None
    if box is not None:
        column = box.copy()
        column[1] = centres[:, 1].min(), centres[:, 1].max() + float(frame.radii.max())
    between = frame.spheres.particles_in(column)
    if not between.any():
        return
    diameter = 2 * float(frame.radii.max())
    heights = (centres[between, 1] - frame.box[1, 0]) / diameter
    layers = np.floor(np.maximum(heights, 0)).astype(np.int64)
    number = np.bincount(layers)
    mean = np.mean([one.particles for one in counts], axis=0)[between]
    filled = number > 0
    values["layers/height"] = (np.arange(len(number)) + 0.5)[filled]
    values["layers/particles"] = number[filled].astype(float)
    values["layers/coordination_number"] = (
        np.bincount(layers, weights=mean)[filled] / number[filled]
    )


def _structure(frame: ParticleFrame, box: FloatArray | None, values: Values) -> dict[str, float]:
    """Measure the order of the particles' centres, as far as the box leaves the room."""
    spheres = frame.spheres
    ends = ~spheres.endless
    if box is None and ends.any():
        _say_not_measured(
            "radial distribution, q4, q6, crystalline",
            "the whole simulation box has walls: give a box away from them",
        )
        return {}
    diameter = 2 * float(frame.radii.max())
    room = math.inf
    if box is not None and ends.any():
        out = np.stack(
            [box[:, 0] - spheres.centres.min(axis=0), spheres.centres.max(axis=0) - box[:, 1]]
        )
        room = float(out[:, ends].min())
    # The room is taken as a hair less, so that no shell reaches out by round-off.
    largest = min(LARGEST_DISTANCE * diameter, room * (1 - 1e-9))
    if largest > diameter:
        bins = round(largest / diameter * BINS_PER_DIAMETER)
        around = radial_distribution(spheres, box, largest=largest, bins=bins)
        values["structure/distance"] = around.middles
        values["structure/radial_distribution"] = around.values
    else:
        _say_not_measured("radial distribution", "the box is too near to the outermost particles")
    if frame.particles.composite:
        return {}
    try:
        order = bond_order(spheres, box)
    except AnalysisError as error:
        # There are too few spheres for twelve neighbours, or they are discs.
        _say_not_measured("q4, q6, crystalline", str(error))
        return {}
    return {
        "q4": float(order.q4.mean()),
        "q6": float(order.q6.mean()),
        "crystalline": order.crystalline_share,
    }


def _say_out_of_bed(bed: BoxInBed) -> None:
    """Say where the bed ends and which box lies inside, as `_say_not_measured` does."""
    if bed.inside is None:
        inside = "no part of it is inside"
    else:
        bounds = ", ".join(f"{bound:g}" for bound in bed.inside.ravel())
        inside = f"[{bounds}] is inside"
    said = f"the bed ends at {bed.ends}, the numbers of the box are partly of empty space; {inside}"
    _say(f"{OUT_OF_BED}{said}")


def _say_not_measured(what: str, why: str) -> None:
    """Say what a result lacks, in a line that the process around this one shows."""
    _say(f"{NOT_MEASURED}{what}: {why}")


def _say(line: str) -> None:
    """Print a line for the process around this one; a disk that is full may have no room for it."""
    with suppress(OSError):
        print(line, file=sys.stderr)


def _evolution(
    dump: ParticleDump,
    log: RunLog,
    stage: Mapping[str, Any],
    box: FloatArray | None,
    values: Values,
) -> dict[str, float]:
    """Add the evolution to values; return the mean contacts while particles are agitated."""

    def of_frame(frame: ParticleFrame, bounds: FloatArray | None) -> float:
        return best_packing_fraction(frame.spheres, bounds, points=POINTS_PER_FRAME, seed=SEED)

    seen = measure_evolution(dump, box, packing=of_frame)
    clock = read_thermo(log, "Time")
    values["evolution/step"] = seen.steps
    values["evolution/time"] = at_steps(seen.steps, clock["Step"], clock["Time"])
    work = cumulated(log, "CPU")
    values["evolution/seconds"] = at_steps(seen.steps, work["Step"], work["CPU"])
    values["evolution/packing_fraction"] = seen.packing_fraction
    values["evolution/coordination_number"] = seen.coordination
    values["evolution/centre_height"] = seen.height
    values["evolution/kinetic_energy"] = seen.kinetic_energy
    agitated = stage["variables"].get("steps_agitated")
    if not isinstance(agitated, int) or agitated == 0:
        return {}
    late = (seen.steps > agitated / 2) & (seen.steps <= agitated)
    if not stage["variables"].get("random_force") or not late.any():
        return {}
    return {"coordination_number_agitated": float(np.mean(seen.coordination[late]))}


_SUMMARY = re.compile(
    r"^Fix inelastic: \d+ projections, (\d+) iterations, largest overlap (\S+) =",
    re.MULTILINE,
)


def _effort(log: RunLog, smallest_radius: float) -> dict[str, float]:
    """Return what the fix has needed and reached in the runs after the start was made."""
    # Runs before the steps are counted from 0 push the start apart, and are no part of the effort.
    _, _, rest = log.text.rpartition("reset_timestep")
    runs = _SUMMARY.findall(rest)
    numbers = {"steps": float(log.runs[-1].known)} if log.runs else {}
    if runs:
        numbers["iterations"] = float(sum(int(iterations) for iterations, _ in runs))
        numbers["largest_overlap_of_all_steps"] = (
            max(float(overlap) for _, overlap in runs) / smallest_radius
        )
    return numbers


def _resolution(stage: Mapping[str, Any], radius: float) -> float | None:
    """Return eps / (g h^2) of the measuring phase, where the deck has these as numbers."""
    gravity = gravity_of(stage["text"])
    variables = stage["variables"]
    tolerance, step = variables.get("tolerance_measuring"), variables.get("dt")
    # Decks before those of today measured with the time step of the rest, those of version 0.1 had
    # one step.
    step = variables.get("dt_measuring", variables.get("dt_resting", step))
    if gravity is None or not isinstance(tolerance, int | float):
        return None
    if not isinstance(step, int | float):
        return None
    fall = abs(gravity) * step * step
    return float(tolerance * radius / fall) if fall > 0 else None


def _profile(
    frame: ParticleFrame, box: FloatArray | None, wanted: ProfileOutput, values: Values
) -> None:
    """Add the packing fraction in slabs parallel to a wall to values, if there is a wall."""
    axis = "xyz".index(wanted.axis)
    wall = f"{wanted.axis}lo"
    if frame.spheres.endless[axis]:
        _say_not_measured("profile", f"there is no wall {wall}: the box is periodic across it")
        return
    slabs = frame.box if box is None else box.copy()
    slabs[axis] = frame.box[axis, 0], frame.box[axis, 0] + wanted.reach
    diameter = 2 * float(frame.radii.max())
    drawn = wall_profile_monte_carlo(
        frame.spheres,
        slabs,
        wall=wall,
        thickness=wanted.thickness * diameter,
        diameter=diameter,
        points=wanted.points,
        seed=SEED,
    )
    values["profile/diameter"] = np.asarray(diameter)
    values["profile/distance"] = drawn.distances
    values["profile/monte_carlo"] = drawn.values
    if drawn.uncertainties is not None:
        values["profile/monte_carlo_error"] = drawn.uncertainties
    if frame.particles.exactly_measurable:
        exact = wall_profile(
            frame.spheres,
            slabs,
            wall=wall,
            thickness=wanted.thickness * diameter,
            diameter=diameter,
        )
        values["profile/packing_fraction"] = exact.values


def main(arguments: Sequence[str]) -> int:
    """Measure; 0 if all went well, else after one line on stderr about what did not.

    NOT_WHOLE if it is the run, and 1 if it is the result, which could not be drawn or written.
    """
    folder, target, outputs = arguments
    try:
        write_result(Path(target), measure_case(Path(folder), Outputs.model_validate_json(outputs)))
    except (AnalysisError, WorkflowError, OSError) as error:
        # The caller says what to do, and names the folder that must go.
        _say(" ".join(str(error).removesuffix(f"; {AGAIN}").split()))
        return 1 if isinstance(error, WriteError | PictureError | OSError) else NOT_WHOLE
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
