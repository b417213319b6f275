"""The subcommand `inelastic look`: the numbers and a picture of one run."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import (
    AnalysisError,
    ContactCounts,
    CoordinationNumber,
    MeasuredPackingFraction,
    Orientation,
    PairOverlap,
    ParticleDump,
    ParticleFrame,
    PictureError,
    RunFiles,
    UnfinishedRunError,
    WallOverlap,
    contact_counts,
    contacts_by_distance,
    coordination_number,
    dimer_orientation,
    draw_packing,
    largest_pair_overlap,
    largest_wall_overlap,
    measure_packing_fraction,
    open_run,
    particles_inside,
    read_run_log,
)

from .finished import CONTACTS as CONTACT_DUMP
from .finished import LOG, unchanged
from .finished import PARTICLES as PARTICLE_DUMP
from .measure import contacts_per_colour
from .study import PAPER_BOX

PICTURE = "packing.png"

NO_WALLS = "the box is not fixed: give --container or --walls"

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    look = commands.add_parser(
        "look",
        help="measure a run and draw its packing",
        description=f"Measure the packing in a run's folder, which holds {PARTICLE_DUMP} and "
        f"{CONTACT_DUMP}, and draw it as {PICTURE}. Any dump custom of spheres will do with "
        "--dump, --contact-gap and --radius.",
    )
    look.add_argument(
        "folder",
        type=Path,
        metavar="FOLDER",
        help="folder of a run, or a particle dump in one",
    )
    look.add_argument(
        "--dump",
        type=Path,
        metavar="FILE",
        help=f"particle dump in the folder (default: {PARTICLE_DUMP})",
    )
    look.add_argument(
        "--contact-gap",
        type=float,
        metavar="GAP",
        help="count contacts by distance and not by a contact dump: gaps below GAP smallest radii",
    )
    look.add_argument(
        "--radius",
        type=float,
        metavar="R",
        help="radius of all spheres, for a dump without radius and diameter",
    )
    bounds = ("XLO", "XHI", "YLO", "YHI", "ZLO", "ZHI")
    look.add_argument(
        "--box",
        type=float,
        nargs=6,
        metavar=bounds,
        default=PAPER_BOX,
        help="measure the packing fraction and the coordination number in this box "
        "(default: 0.25 to 0.75 on every axis)",
    )
    look.add_argument(
        "--points",
        type=int,
        default=1_000_000,
        help="random points for the Monte Carlo packing fraction (default: 1000000)",
    )
    look.add_argument("--seed", type=int, default=1, help="seed of these points (default: 1)")
    walls = look.add_mutually_exclusive_group()
    walls.add_argument(
        "--walls",
        action="store_true",
        help="take the faces of the dump's box as walls (default: if they are all fixed)",
    )
    walls.add_argument(
        "--container", type=float, nargs=6, metavar=bounds, help="take the faces of this box"
    )
    look.add_argument("--no-picture", action="store_true", help="draw nothing")
    look.add_argument("--json", action="store_true", help="print JSON")


@dataclass(frozen=True, eq=False)
class _Bodies:
    """What is said of a packing only where some of its particles are bodies of several spheres.

    Attributes
    ----------
    neighbours : as the coordination number, but a particle touched several times counts once
    walls : as the coordination number, of contacts with walls; None where the walls are not known
    walls_in_all : contacts of all particles with walls, mean over the frames
    orientation : of the dimers in the box; None if there are other bodies, or no dimer in the box
    """

    neighbours: CoordinationNumber
    walls: CoordinationNumber | None
    walls_in_all: float
    orientation: Orientation | None


@dataclass(frozen=True, eq=False)
class _Look:
    """What `inelastic look` found in a folder. A particle is a body, or a free sphere.

    Attributes
    ----------
    dump : path of the particle dump
    contact_dump : path of the contact dump; None where contacts are counted by distance
    contact_gap : the gap below which two spheres are in contact, length; None where contacts are
        those of the contact dump, which carry a force
    frame : the last particle frame, on which everything but the contacts is measured
    box : (3, 2), where the packing fraction and the coordination number are measured, length
    seed : of the random points
    packing : packing fraction in the box, as studies measure it
    coordination : coordination number of the particles in the box, over all contact frames
    contact_steps : first and last step of the contact frames
    bodies : None where every particle is one sphere
    pair : largest overlap of two spheres of different particles
    wall : largest overlap with a wall; None where the walls are not known
    picture : where the picture is; None if there is none
    """

    dump: Path
    contact_dump: Path | None
    contact_gap: float | None
    frame: ParticleFrame
    box: FloatArray
    seed: int
    packing: MeasuredPackingFraction
    coordination: CoordinationNumber
    contact_steps: tuple[int, int]
    bodies: _Bodies | None
    pair: PairOverlap
    wall: WallOverlap | None
    picture: Path | None

    @property
    def smallest_radius(self) -> float:
        return float(self.frame.radii.min())


def run(options: argparse.Namespace) -> int:
    """Measure, print, draw; return the exit status."""
    if options.points < 1:
        raise AnalysisError(f"--points must be at least 1, not {options.points}")
    if options.seed < 0:
        raise AnalysisError(f"--seed must not be negative, not {options.seed}")
    if options.contact_gap is not None and not 0 <= options.contact_gap < np.inf:
        raise AnalysisError(f"--contact-gap must be 0 or more, not {options.contact_gap:g}")
    folder: Path = options.folder
    name = PARTICLE_DUMP if options.dump is None else options.dump
    if folder.is_file():
        if options.dump is not None:
            raise AnalysisError(f"{folder}: is a file; --dump names one in a folder")
        folder, name = folder.parent, folder.name
    dump, contact_dump = folder / name, folder / CONTACT_DUMP
    particle_dump = ParticleDump(dump, radius=options.radius)
    by_distance = options.contact_gap is not None
    if not by_distance and not contact_dump.exists():
        raise AnalysisError(
            f"{contact_dump}: no such file; --contact-gap GAP counts contacts by distance"
        )
    files = _files(particle_dump, None if by_distance else contact_dump)
    frame = particle_dump[-1]
    if any("p" in flags for flags in frame.boundaries):
        raise AnalysisError(
            f"{dump}: the box is periodic ({' '.join(frame.boundaries)}), and "
            "overlaps across its faces are not looked for yet"
        )

    box = np.reshape(np.asarray(options.box, dtype=np.float64), (3, 2))
    particles = frame.particles
    chosen = particles_inside(particles.centres(frame.positions), box)
    if not chosen.any():
        raise AnalysisError(
            f"{dump}: no particle's centre lies in the box {_as_ranges(box)} "
            f"at step {frame.step}; choose another with --box"
        )
    walls: FloatArray | None = None
    if options.container is not None:
        walls = np.reshape(np.asarray(options.container, dtype=np.float64), (3, 2))
    elif options.walls or all(flags == "ff" for flags in frame.boundaries):
        walls = frame.box

    steps: list[int] = []
    counts: list[ContactCounts] = []
    contact_gap: float | None = None
    if by_distance:
        contact_gap = options.contact_gap * float(frame.radii.min())
        near = contacts_by_distance(frame.positions, frame.radii, contact_gap, particles, walls)
        steps.append(frame.step)
        counts.append(contact_counts(near.ids(frame.ids), frame.ids, particles))
    else:
        for contacts in files.contact_frames(frame):
            steps.append(contacts.step)
            counts.append(contact_counts(contacts.ids, frame.ids, particles))

    failure: PictureError | None = None
    picture = None if options.no_picture else folder / PICTURE
    if picture is not None:
        try:
            draw_packing(
                picture,
                frame.positions,
                frame.radii,
                frame.box if walls is None else walls,
                counts[-1].particles[particles.index],
                contacts_per_colour=contacts_per_colour(frame),
            )
        # The numbers do not need the picture: they are printed, and what failed is said last.
        except PictureError as error:
            failure, picture = error, None

    found = _Look(
        dump=dump,
        contact_dump=contact_dump if contact_gap is None else None,
        contact_gap=contact_gap,
        frame=frame,
        box=box,
        seed=options.seed,
        packing=measure_packing_fraction(
            frame.positions,
            frame.radii,
            box,
            particles,
            points=options.points,
            seed=options.seed,
        ),
        coordination=coordination_number((count.particles for count in counts), chosen),
        contact_steps=(steps[0], steps[-1]),
        bodies=_of_bodies(frame, box, chosen, counts, contact_gap is None or walls is not None)
        if particles.composite
        else None,
        pair=largest_pair_overlap(frame.positions, frame.radii, frame.bodies),
        wall=None if walls is None else largest_wall_overlap(frame.positions, frame.radii, walls),
        picture=picture,
    )
    print(_as_json(found) if options.json else _as_text(found))
    if failure is not None:
        raise failure
    return 0


def _files(particles: ParticleDump, contacts: Path | None) -> RunFiles:
    """Open the files of a run, which must belong together, as far as there is a log to tell."""
    folder = particles.path.parent
    log = read_run_log(folder / LOG) if (folder / LOG).exists() else None
    try:
        # By distance, contacts are those of one frame, whatever comes after it.
        files = open_run(particles, contacts, log, over=contacts is not None)
    except UnfinishedRunError as error:
        raise AnalysisError(
            f"{error}; --contact-gap GAP counts contacts in the last frame that is there"
        ) from None
    files.check_last(particles[-1])
    unchanged(folder)
    return files


def _of_bodies(
    frame: ParticleFrame,
    box: FloatArray,
    chosen: BoolArray,
    counts: Sequence[ContactCounts],
    walls_known: bool,
) -> _Bodies:
    particles = frame.particles
    is_body = particles.bodies > 0
    dimers = bool((particles.sizes[is_body] == 2).all() and (is_body & chosen).any())
    return _Bodies(
        neighbours=coordination_number((count.neighbours for count in counts), chosen),
        walls=coordination_number((count.walls for count in counts), chosen)
        if walls_known
        else None,
        walls_in_all=float(np.mean([count.walls.sum() for count in counts])),
        orientation=dimer_orientation(frame.positions, particles, box) if dimers else None,
    )


def _as_text(found: _Look) -> str:
    coordination, ids, bodies = found.coordination, found.frame.ids, found.bodies
    first, last = found.contact_steps
    if coordination.scatter is None:
        over = f"one frame, step {first}"
    else:
        over = f"{coordination.frames} frames, steps {first} to {last}; ± is their scatter"

    pair, wall = found.pair, found.wall
    # Overlaps are between spheres; where every particle is a sphere, they are between particles.
    one = "particle" if bodies is None else "sphere"
    where_pair = f"{one}s {ids[pair.pair[0]]} and {ids[pair.pair[1]]}" if pair.pair else "none"
    if wall is None:
        with_wall = ("-", NO_WALLS)
    else:
        touched = "none" if wall.particle is None else f"{one} {ids[wall.particle]}, {wall.face}"
        with_wall = (f"{wall.depth / found.smallest_radius:.3g} r", touched)

    rows = [
        ("particles", f"{len(found.frame.particles)}", f"step {found.frame.step}"),
        *([] if bodies is None else [("  spheres", f"{len(ids)}", _sizes(found.frame))]),
        _packing_row(found),
        ("coordination number", _as_mean(coordination), over),
        (
            "  0 or 1 contacts",
            f"{coordination.particles_with(0, 1):.1f} particles",
            f"of the {coordination.particles} in the box",
        ),
        *([] if bodies is None else _body_rows(bodies)),
        ("largest overlap", f"{pair.depth / found.smallest_radius:.3g} r", where_pair),
        ("  with a wall", *with_wall),
    ]
    left, right = (max(len(row[column]) for row in rows) for column in (0, 1))
    lines = [f"{name:<{left}}  {value:<{right}}  {note}" for name, value, note in rows]
    files = [
        ("particle dump", found.dump),
        ("contact dump", found.contact_dump)
        if found.contact_gap is None
        else ("contacts", f"gaps below {found.contact_gap / found.smallest_radius:.3g} r"),
        ("picture", found.picture or "none"),
    ]
    return "\n".join(
        [
            *lines,
            "",
            f"{'box':<{left}}  {_as_ranges(found.box)}",
            f"{'r':<{left}}  {found.smallest_radius:.6g}, the smallest radius",
            *(f"{name:<{left}}  {path}" for name, path in files),
        ]
    )


def _packing_row(found: _Look) -> tuple[str, str, str]:
    drawn = found.packing.drawn
    by_points = f"{drawn.value:.4f} ± {drawn.uncertainty:.4f}"
    points = f"{drawn.points:,} random points, seed {found.seed}"
    if found.packing.exact is None:
        return ("packing fraction", by_points, points)
    return ("packing fraction", f"{found.packing.value:.4f}", f"exact; {by_points} by {points}")


def _as_mean(number: CoordinationNumber) -> str:
    return f"{number.mean:.3f}" + ("" if number.scatter is None else f" ± {number.scatter:.3f}")


def _sizes(frame: ParticleFrame) -> str:
    sizes = frame.particles.sizes
    fewest, most = int(sizes.min()), int(sizes.max())
    return f"{most} in each" if fewest == most else f"{fewest} to {most} in each"


def _body_rows(bodies: _Bodies) -> list[tuple[str, str, str]]:
    rows = [
        ("  neighbours", _as_mean(bodies.neighbours), "several contacts with one count once"),
        (
            "  wall contacts",
            _as_mean(bodies.walls),
            f"in the box; {bodies.walls_in_all:.1f} contacts with walls in all",
        )
        if bodies.walls is not None
        else ("  wall contacts", "-", NO_WALLS),
    ]
    lie = bodies.orientation
    if lie is not None:
        errors = [None] * 3 if lie.standard_errors is None else lie.standard_errors.tolist()
        notes = (
            f"root mean square of x_i - x_j in the {lie.dimers} dimers in the box",
            "of y_i - y_j; ± is the standard error",
            f"of z_i - z_j; isotropic: {lie.isotropic:.4g}",
        )
        for axis, mean, error, note in zip("xyz", lie.components, errors, notes, strict=True):
            value = f"{mean:.4g}" if error is None else f"{mean:.4g} ± {error:.2g}"
            rows.append((f"a_{axis}", value, note))
    return rows


def _as_json(found: _Look) -> str:
    coordination, ids, wall = found.coordination, found.frame.ids, found.wall
    exact, drawn = found.packing.exact, found.packing.drawn
    report: dict[str, Any] = {
        "step": found.frame.step,
        "particles": len(found.frame.particles),
        "smallest_radius": found.smallest_radius,
        "box": found.box.tolist(),
        "packing_fraction": {
            "value": found.packing.value,
            "method": "monte carlo" if exact is None else "exact",
            "common_volume": None if exact is None else exact.overlap,
            "monte_carlo": {
                "value": drawn.value,
                "uncertainty": drawn.uncertainty,
                "points": drawn.points,
                "seed": found.seed,
            },
        },
        "coordination_number": {
            "mean": coordination.mean,
            "scatter": coordination.scatter,
            "frames": coordination.frames,
            "steps": list(found.contact_steps),
            "particles": coordination.particles,
            "particles_with_0_or_1": coordination.particles_with(0, 1),
            "distribution": coordination.distribution.tolist(),
        },
        "largest_pair_overlap": {
            "depth": found.pair.depth,
            "ids": [int(ids[index]) for index in found.pair.pair or ()],
        },
        "largest_wall_overlap": None
        if wall is None
        else {
            "depth": wall.depth,
            "id": None if wall.particle is None else int(ids[wall.particle]),
            "face": wall.face,
        },
        "files": {
            "particles": str(found.dump),
            "contacts": None if found.contact_dump is None else str(found.contact_dump),
            "picture": None if found.picture is None else str(found.picture),
        },
    }
    if found.contact_gap is not None:
        report["coordination_number"]["contact_gap"] = found.contact_gap
    if found.bodies is not None:
        report |= _bodies_report(found.bodies, len(ids))
    return json.dumps(report, indent=2, allow_nan=False)


def _bodies_report(bodies: _Bodies, spheres: int) -> dict[str, Any]:
    lie = bodies.orientation
    errors = None if lie is None else lie.standard_errors
    return {
        "spheres": spheres,
        "neighbours": {"mean": bodies.neighbours.mean, "scatter": bodies.neighbours.scatter},
        "wall_contacts": None
        if bodies.walls is None
        else {
            "mean": bodies.walls.mean,
            "scatter": bodies.walls.scatter,
            "in_all": bodies.walls_in_all,
        },
        "orientation": None
        if lie is None
        else {
            "components": lie.components.tolist(),
            "standard_errors": None if errors is None else errors.tolist(),
            "isotropic": lie.isotropic,
            "dimers": lie.dimers,
        },
    }


def _as_ranges(box: FloatArray) -> str:
    return ", ".join(
        f"{axis} {low:g} to {high:g}" for axis, (low, high) in zip("xyz", box.tolist(), strict=True)
    )
