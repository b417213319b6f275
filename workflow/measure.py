"""From a finished run's folder to a result: everything that a study asks for, measured once.

    python -m lammps_inelastic.workflow.measure FOLDER TARGET OUTPUTS

writes TARGET, an HDF5 file, and prints nothing; OUTPUTS is JSON. A process of its own, so that a
measurement can be killed and its memory goes.
"""

from __future__ import annotations

import io
import json
import math
import re
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lammps_inelastic.analysis import (
    AnalysisError,
    ContactFrame,
    ParticleDump,
    ParticleFrame,
    Particles,
    RunFiles,
    RunLog,
    at_steps,
    backbone,
    bond_order,
    contact_counts,
    contact_graph,
    contacts_of,
    coordination_number,
    dimer_orientation,
    draw_network,
    draw_packing,
    exact_packing_fraction,
    fabric_tensor,
    force_distribution,
    largest_pair_overlap,
    measure_evolution,
    measure_packing_fraction,
    open_run,
    packing_fraction,
    packing_fraction_with_necks,
    particles_inside,
    radial_distribution,
    read_run_log,
    wall_profile,
    wall_profile_monte_carlo,
)
from lammps_inelastic.analysis.run_files import AGAIN

from .errors import WorkflowError
from .finished import CONTACTS, FINISHED, LOG, PARTICLES, check_stage
from .settling import contact_frames, has_soft_contacts, is_settling, measure_settling
from .store import Result, write_result
from .study import Outputs, ProfileOutput
from .thermo import read_thermo

# For the packing fraction of bodies that cannot be cut exactly, frame by frame.
POINTS_PER_FRAME = 100_000
# How far the radial distribution function goes, in diameters, where the box leaves the room.
LARGEST_DISTANCE = 4.0
BINS_PER_DIAMETER = 50
FORCE_BINS, LARGEST_FORCE = 50, 5.0
NETWORK_INCHES, NETWORK_DPI = 7.0, 150
MOST_PIXELS = 900  # of a picture's longer side
SEED = 1

Values = dict[str, NDArray[Any]]


def measure_case(folder: Path, outputs: Outputs) -> Result:
    """Measure a finished run, all of its stages.

    Raises AnalysisError or WorkflowError with one line if its files are not whole.
    """
    record = json.loads((folder / FINISHED).read_text())
    result: Result | None = None
    for stage in record["stages"]:
        files, log = _open(folder, record, stage)
        values = _measure(files, log, stage, outputs)
        pictures: dict[str, bytes] = {}
        if stage is record["stages"][-1]:
            values["numbers/wall_seconds"] = np.asarray(record["wall_seconds"], dtype=float)
            pictures = _pictures(files, stage, outputs)
        result = Result(values, pictures, record, outputs.measured, before=result)
    assert result is not None
    return result


def _open(
    folder: Path, record: Mapping[str, Any], stage: Mapping[str, Any]
) -> tuple[RunFiles, RunLog]:
    """Open the files of a stage, which must be those of this run, and whole."""
    where = folder / stage["folder"]
    log = read_run_log(where / LOG)
    contacts = None if has_soft_contacts(stage) else where / CONTACTS
    files = open_run(ParticleDump(where / PARTICLES), contacts, log)
    check_stage(folder, record, stage, files, log)
    return files, log


def _measure(files: RunFiles, log: RunLog, stage: Mapping[str, Any], outputs: Outputs) -> Values:
    dump = files.particles
    frame = dump[-1]
    box = np.reshape(np.array(outputs.box), (3, 2))
    particles = frame.particles
    chosen = particles_inside(particles.centres(frame.positions), box)
    numbers: dict[str, float] = {
        "particles": len(particles),
        "spheres": len(frame.ids),
        "particles_in_box": int(chosen.sum()),
        **_packing(frame, particles, box, outputs.points),
        **_effort(log, float(frame.radii.min())),
    }
    overlap = largest_pair_overlap(frame.positions, frame.radii, frame.bodies)
    numbers["largest_overlap"] = overlap.depth / float(frame.radii.min())
    resolution = _resolution(stage, float(frame.radii.max()))
    if resolution is not None:
        numbers["resolution"] = resolution
    values: Values = {}
    if chosen.any():
        touching = contact_frames(files, stage, frame)
        numbers |= _contacts(touching, frame, chosen, values)
        numbers |= _orientation(frame, particles, chosen, box)
        if outputs.structure:
            numbers |= _structure(frame, particles, box, values)
    if outputs.evolution or is_settling(stage):
        numbers |= _evolution(dump, log, stage, box, values)
    if is_settling(stage):
        settled = measure_settling(files, log, stage, values)
        numbers |= settled[0]
        values |= settled[1]
    if outputs.profile is not None:
        _profile(frame, particles, box, outputs.profile, values)
    values |= {f"numbers/{name}": np.asarray(value, dtype=float) for name, value in numbers.items()}
    return values


def _packing(
    frame: ParticleFrame, particles: Particles, box: NDArray[np.float64], points: int
) -> dict[str, float]:
    spheres = frame.positions, frame.radii, box
    measured = measure_packing_fraction(*spheres, particles, points=points, seed=SEED)
    drawn = measured.drawn
    numbers = {
        "packing_fraction": measured.value,
        "packing_fraction_monte_carlo": drawn.value,
        "packing_fraction_monte_carlo_error": drawn.uncertainty,
    }
    if _are_dimers(particles):
        # The same points: what the necks add has a far smaller error than either share.
        with_necks = packing_fraction_with_necks(*spheres, particles, points=points, seed=SEED)
        added = with_necks.value - drawn.value
        numbers["packing_fraction_with_necks"] = numbers["packing_fraction"] + added
        numbers["packing_fraction_with_necks_error"] = math.sqrt(added * (1 - added) / points)
    return numbers


def _are_dimers(particles: Particles) -> bool:
    return bool((particles.sizes == 2).all())


def _contacts(
    frames: Iterable[ContactFrame],
    frame: ParticleFrame,
    chosen: NDArray[np.bool_],
    values: Values,
) -> dict[str, float]:
    """Measure contacts over all frames, rattlers and forces too."""
    particles = frame.particles
    counts = []
    forces: list[NDArray[np.float64]] = []
    normals: list[NDArray[np.float64]] = []
    loose: list[float] = []
    held: list[float] = []
    for contacts in frames:
        counts.append(contact_counts(contacts.ids, frame.ids, particles))
        inside = contacts_of(chosen, contacts.ids, frame.ids, particles)
        forces.append(contacts.forces[inside])
        normals.append(contacts.normals[inside])
        firm = backbone(contacts.ids, frame.ids, particles)
        loose.append(float(firm.rattlers[chosen].mean()))
        if not firm.rattlers[chosen].all():
            held.append(float(firm.counts.particles[chosen & ~firm.rattlers].mean()))
    between = coordination_number([count.particles for count in counts], chosen)
    neighbours = coordination_number([count.neighbours for count in counts], chosen)
    values["distribution/contacts"] = between.distribution
    values["distribution/neighbours"] = neighbours.distribution
    numbers = {
        "coordination_number": between.mean,
        "neighbours": neighbours.mean,
        "wall_contacts": float(np.mean([count.walls[chosen].mean() for count in counts])),
        "particles_with_0_or_1_contacts": between.particles_with(0, 1),
        "rattlers": float(np.mean(loose)),
    }
    if between.scatter is not None:
        numbers["coordination_number_scatter"] = between.scatter
    if held:
        numbers["coordination_number_without_rattlers"] = float(np.mean(held))
    strengths = np.concatenate(forces)
    if len(strengths):
        spread = force_distribution(strengths, bins=FORCE_BINS, largest=LARGEST_FORCE)
        values["forces/ratio"] = (spread.edges[:-1] + spread.edges[1:]) / 2
        values["forces/density"] = spread.density
        directions = fabric_tensor(np.concatenate(normals)).diagonal()
        numbers |= {f"fabric_{axis}": float(v) for axis, v in zip("xyz", directions, strict=True)}
    return numbers


def _orientation(
    frame: ParticleFrame,
    particles: Particles,
    chosen: NDArray[np.bool_],
    box: NDArray[np.float64],
) -> dict[str, float]:
    if not _are_dimers(particles):
        return {}
    lie = dimer_orientation(frame.positions, particles, box)
    numbers = {f"a_{axis}": float(v) for axis, v in zip("xyz", lie.components, strict=True)}
    numbers["a_isotropic"] = lie.isotropic
    if lie.standard_errors is not None:
        errors = zip("xyz", lie.standard_errors, strict=True)
        numbers |= {f"a_{axis}_error": float(error) for axis, error in errors}
    return numbers


def _structure(
    frame: ParticleFrame, particles: Particles, box: NDArray[np.float64], values: Values
) -> dict[str, float]:
    """Measure the order of the particles' centres, as far as the box leaves the room."""
    centres = particles.centres(frame.positions)
    diameter = 2 * float(frame.radii.max())
    room = float(
        min((box[:, 0] - centres.min(axis=0)).min(), (centres.max(axis=0) - box[:, 1]).min())
    )
    # A hair less, so that no shell reaches out by round-off.
    largest = min(LARGEST_DISTANCE * diameter, room * (1 - 1e-9))
    if largest > diameter:
        bins = round(largest / diameter * BINS_PER_DIAMETER)
        around = radial_distribution(centres, box, largest=largest, bins=bins)
        values["structure/distance"] = around.middles
        values["structure/radial_distribution"] = around.values
    if particles.composite:
        return {}
    try:
        order = bond_order(centres, box)
    except AnalysisError:  # too few spheres for twelve neighbours
        return {}
    return {
        "q4": float(order.q4.mean()),
        "q6": float(order.q6.mean()),
        "crystalline": order.crystalline_share,
    }


def _evolution(
    dump: ParticleDump,
    log: RunLog,
    stage: Mapping[str, Any],
    box: NDArray[np.float64],
    values: Values,
) -> dict[str, float]:
    particles = dump[-1].particles

    def of_frame(positions: Any, radii: Any, bounds: Any) -> float:
        if particles.exactly_measurable:
            return exact_packing_fraction(positions, radii, bounds, particles).value
        return packing_fraction(positions, radii, bounds, points=POINTS_PER_FRAME, seed=SEED).value

    seen = measure_evolution(dump, box, packing=of_frame)
    clock = read_thermo(log, "Time")
    values["evolution/step"] = seen.steps
    values["evolution/time"] = at_steps(seen.steps, clock["Step"], clock["Time"])
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
    # The start is pushed apart from any overlap: what it needs is no part of the packing's way.
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
    """Return eps / (g h^2) of the measuring phase, where the deck has these variables."""
    variables = stage["variables"]
    gravity = re.search(r"^variable\s+gravity\s+equal\s+([\d.]+)", stage["text"], re.MULTILINE)
    if gravity is None or not {"tolerance_measuring", "dt"} <= variables.keys():
        return None
    eps = variables["tolerance_measuring"] * radius
    return float(eps / (float(gravity.group(1)) * variables["dt"] ** 2))


def _profile(
    frame: ParticleFrame,
    particles: Particles,
    box: NDArray[np.float64],
    wanted: ProfileOutput,
    values: Values,
) -> None:
    axis = "xyz".index(wanted.axis)
    slabs = box.copy()
    slabs[axis] = frame.box[axis, 0], frame.box[axis, 0] + wanted.reach
    wall = f"{wanted.axis}lo"
    spheres = frame.positions, frame.radii, slabs
    diameter = 2 * float(frame.radii.max())
    drawn = wall_profile_monte_carlo(
        *spheres,
        wall=wall,
        thickness=wanted.thickness * diameter,
        diameter=diameter,
        points=wanted.points,
        seed=SEED,
    )
    values["profile/distance"] = drawn.distances
    values["profile/monte_carlo"] = drawn.values
    if drawn.uncertainties is not None:
        values["profile/monte_carlo_error"] = drawn.uncertainties
    if particles.exactly_measurable:
        exact = wall_profile(
            *spheres,
            wall=wall,
            thickness=wanted.thickness * diameter,
            particles=particles,
            diameter=diameter,
        )
        values["profile/packing_fraction"] = exact.values


def _pictures(files: RunFiles, stage: Mapping[str, Any], outputs: Outputs) -> dict[str, bytes]:
    pictures: dict[str, bytes] = {}
    if not (outputs.pictures or outputs.network):
        return pictures
    dump = files.particles
    with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
        target = Path(name) / "picture.png"
        for wanted in outputs.pictures:
            # The frame nearest to the step: a run may end at another step than was thought.
            index = int(np.argmin(np.abs(np.array(dump.steps) - wanted)))
            frame = dump[index]
            spheres = frame.positions, frame.radii
            draw_packing(
                target,
                *spheres,
                frame.box,
                contacts_per_particle(frame),
                contacts_per_colour=contacts_per_colour(frame),
            )
            pictures[f"{frame.step:08d}"] = _small(target)
        if outputs.network:
            frame = dump[-1]
            *_, contacts = contact_frames(files, stage, frame)
            _draw_network(target, frame, contacts)
            pictures["network"] = _small(target)
    return pictures


def _small(path: Path) -> bytes:
    """Return a picture as results keep it, which are many: of limited size, with 256 colours."""
    with Image.open(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((MOST_PIXELS, MOST_PIXELS))
        few = small.quantize(256, method=Image.Quantize.MEDIANCUT)
        buffer = io.BytesIO()
        few.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def contacts_per_particle(frame: ParticleFrame) -> NDArray[np.int64] | None:
    """Return for each sphere the contacts of its particle; None where the dump has none."""
    if frame.contacts is None:
        return None
    index = frame.particles.index
    sums = np.bincount(index, weights=frame.contacts)
    return sums[index].astype(np.int64)


def contacts_per_colour(frame: ParticleFrame) -> int:
    """Return how many numbers of contacts share a colour: a body has ten and more, a sphere six."""
    return 2 if frame.particles.composite else 1


def _draw_network(path: Path, frame: ParticleFrame, contacts: ContactFrame) -> None:
    graph = contact_graph(
        contacts.ids, frame.ids, frame.positions, contacts.forces, frame.particles
    )
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, ax = pyplot.subplots(figsize=(NETWORK_INCHES, NETWORK_INCHES), layout="constrained")
    draw_network(ax, graph, lower_half=True)
    figure.savefig(path, dpi=NETWORK_DPI)
    pyplot.close(figure)


def main(arguments: Sequence[str]) -> int:
    """Measure; 0 if all went well, 2 after one line on stderr about what did not."""
    folder, target, outputs = arguments
    try:
        write_result(Path(target), measure_case(Path(folder), Outputs.model_validate_json(outputs)))
    except (AnalysisError, WorkflowError, OSError) as error:
        # What to do is said with the folder that must go.
        said = str(error).removesuffix(f"; {AGAIN}")
        print(" ".join(said.split()), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
