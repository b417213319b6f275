"""One run measured and drawn, as a user looks at it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import (
    AnalysisError,
    ContactCounts,
    CoordinationNumber,
    PackingMeasurement,
    ParticleDump,
    ParticleFrame,
    PictureError,
    RunFiles,
    UnfinishedRunError,
    Unrest,
    contact_counts,
    contacts_by_distance,
    measure_packing,
)

from ..provenance.finished import open_in_folder
from ..study import PAPER_BOX
from .frames import choose_index, notes_of
from .pictures import draw_frame
from .view import MOST_SPHERES, KnownContacts, draw_page

PICTURE = "packing.png"

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Look:
    """The numbers of a run. A particle is a body, or a free sphere.

    Attributes
    ----------
    dump : path of the particle dump
    contact_dump : path of the contact dump; None where contacts are counted by distance
    contact_gap : gap below which two spheres are in contact, length; None where contacts are those
        of the contact dump, which carry a force
    frame : particle frame on which everything but the contacts is measured
    box : (3, 2), where the packing fraction and the coordination number are measured, length;
        None for the whole simulation box
    seed : seed of the random points
    unrest : how far the packing is from rest; None where no log tells
    packing : numbers of the packing, as studies measure them
    coordination : coordination number of the particles in the box, over all contact frames
    contact_steps : first and last step of the contact frames
    walls_known : whether contacts with walls are counted
    wall_contacts_in_all : contacts of all particles with walls, mean over the contact frames
    picture : path of the picture; None if there is none
    page : path of the page of the packing; None if there is none
    failure : reason why there is no picture or no page; None if there is one, or none was asked for
    notes : one line for each thing that the dump lacks
    """

    dump: Path
    contact_dump: Path | None
    contact_gap: float | None
    frame: ParticleFrame
    box: FloatArray | None
    seed: int
    unrest: Unrest | None
    packing: PackingMeasurement
    coordination: CoordinationNumber
    contact_steps: tuple[int, int]
    walls_known: bool
    wall_contacts_in_all: float
    picture: Path | None
    page: Path | None
    failure: PictureError | None
    notes: tuple[str, ...]

    @property
    def smallest_radius(self) -> float:
        """The smallest radius of a sphere, length."""
        return float(self.frame.radii.min())


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a user wants to see of a run.

    Attributes
    ----------
    box : (3, 2), where the packing fraction and the coordination number are measured, length; None
        for the whole simulation box if it is periodic on all sides, and else for the paper's box
    whole_cell : whether it is the whole simulation box, periodic or not
    contact_gap : gap below which two spheres are in contact, smallest radii; None to read the
        contact dump
    radius : radius of all spheres, for a dump without radii, length
    number : number of the frame from 0, or from the end; None for the last one
    step : time step of the frame, which comes before its number
    points : number of random points for the packing fraction
    seed : seed of these points
    container : (3, 2), box whose faces are the walls, length; None for the dump's, if its faces are
        fixed
    box_is_container : whether the faces of the dump's box are walls even if they are not fixed
    picture : path of the picture; None draws none
    page : path of the page of the packing; None writes none
    """

    box: FloatArray | None
    whole_cell: bool
    contact_gap: float | None
    radius: float | None
    number: int | None
    step: int | None
    points: int
    seed: int
    container: FloatArray | None
    box_is_container: bool
    picture: Path | None
    page: Path | None

    @property
    def chooses_frame(self) -> bool:
        """Whether a frame is chosen; otherwise it is the last one."""
        return self.number is not None or self.step is not None


def look_at(dump: Path, contact_dump: Path, wanted: Wanted) -> Look:
    """Measure a frame of a run and its contacts, and draw it.

    Contacts are those of all contact frames; where a frame is chosen, of its step alone.

    Parameters
    ----------
    dump : path of the particle dump
    contact_dump : path of the contact dump
    wanted : what is measured, and drawn

    Raises AnalysisError with one line. A picture that cannot be drawn, or a page that cannot be
    written, is told by `Look.failure`: the numbers do not need it.
    """
    particles = ParticleDump(dump, radius=wanted.radius, whole=False)
    files = _files(particles, contact_dump if wanted.contact_gap is None else None, wanted)
    frame = particles[choose_index(particles, number=wanted.number, step=wanted.step)]
    box, walls = _box(frame, wanted), _walls(frame, wanted)
    _check_frame(dump, frame, box)
    gap = None if wanted.contact_gap is None else wanted.contact_gap * float(frame.radii.min())
    only = frame.step if wanted.chooses_frame else None
    steps, counts, last = _count_contacts(files, frame, gap, walls, only)
    failure = None if wanted.picture is None else _draw(wanted.picture, frame, walls, counts[-1])
    packing = measure_packing(
        frame, counts, box, points=wanted.points, seed=wanted.seed, walls=walls
    )
    # There is a frame of contacts, and a particle in the box.
    assert packing.coordination is not None
    notes, page = notes_of(particles, frame), wanted.page
    if page is not None and len(frame.ids) > MOST_SPHERES:
        notes.append(f"no {page.name}: it has at most {MOST_SPHERES:,} spheres")
        page = None
    if page is not None:
        try:
            draw_page(page, frame, last, packing.packing_fraction.value)
        except PictureError as error:
            failure, page = failure or error, None
    return Look(
        dump=dump,
        contact_dump=contact_dump if gap is None else None,
        contact_gap=gap,
        frame=frame,
        box=box,
        seed=wanted.seed,
        unrest=None if files.log is None else files.log.unrest_at(frame.step),
        packing=packing,
        coordination=packing.coordination,
        contact_steps=(steps[0], steps[-1]),
        walls_known=gap is None or walls is not None,
        wall_contacts_in_all=float(np.mean([count.walls.sum() for count in counts])),
        picture=wanted.picture if failure is None else None,
        page=page,
        failure=failure,
        notes=tuple(notes),
    )


def _box(frame: ParticleFrame, wanted: Wanted) -> FloatArray | None:
    """Return the box that is measured, (3, 2), length; None for the whole simulation box."""
    if wanted.box is None and not wanted.whole_cell and not frame.spheres.endless.all():
        return np.reshape(np.asarray(PAPER_BOX, dtype=np.float64), (3, 2))
    return wanted.box


def _walls(frame: ParticleFrame, wanted: Wanted) -> FloatArray | None:
    """Return the walls of the container, (3, 2), length; None if they are not known."""
    if wanted.container is not None:
        return wanted.container
    if wanted.box_is_container or _ends_are_fixed(frame):
        return frame.cell.flat_faces
    return None


def _draw(
    path: Path, frame: ParticleFrame, walls: FloatArray | None, contacts: ContactCounts
) -> PictureError | None:
    """Draw the packing, coloured by contacts; return why that is not possible, None if it is."""
    container = None if walls is None or not np.isfinite(walls).all() else walls
    try:
        draw_frame(path, frame, container, contacts.particles[frame.particles.index])
    except PictureError as error:
        return error
    return None


def _files(particles: ParticleDump, contacts: Path | None, wanted: Wanted) -> RunFiles:
    """Open the files of a run, which must belong together, as far as there is a log to tell.

    Parameters
    ----------
    particles : particle dump
    contacts : path of the contact dump; None where contacts are counted by distance
    wanted : says which frame is measured
    """
    if contacts is not None and not contacts.exists():
        raise AnalysisError(
            f"{contacts}: no such file; --contact-gap GAP counts contacts by distance"
        )
    if wanted.step is not None:
        # A frame that is named by its step is the right one, whatever became of the others.
        return RunFiles(particles, contacts, None)
    if contacts is not None and particles.cut_off is not None and not wanted.chooses_frame:
        raise AnalysisError(
            f"{particles.cut_off}; --contact-gap GAP counts contacts in the last whole frame"
        )
    try:
        # By distance, contacts are those of one frame, whatever comes after it.
        return open_in_folder(particles, contacts, over=contacts is not None)
    except UnfinishedRunError as error:
        raise AnalysisError(
            f"{error}; --contact-gap GAP counts contacts in the last frame that is there"
        ) from None


def _ends_are_fixed(frame: ParticleFrame) -> bool:
    """Whether each face of the simulation box is fixed or periodic, so that all walls are known."""
    told = frame.boundaries or ("ss", "ss", "ss")
    return all(flags in ("ff", "pp") for flags in told)


def _check_frame(dump: Path, frame: ParticleFrame, box: FloatArray | None) -> None:
    """Raise AnalysisError where no particle is in the measuring box."""
    if box is not None and not frame.spheres.particles_in(box).any():
        raise AnalysisError(
            f"{dump}: no particle's centre lies in the box {as_ranges(box)} "
            f"at step {frame.step}; choose another with --box, or all with --cell"
        )


def _count_contacts(
    files: RunFiles,
    frame: ParticleFrame,
    gap: float | None,
    walls: FloatArray | None,
    step: int | None,
) -> tuple[list[int], list[ContactCounts], KnownContacts]:
    """Count contacts by distance or in contact frames, all of them or those of one step.

    The frames' steps are returned, too, and the contacts of the last one.
    """
    particles, images = frame.particles, frame.cell.has_images
    if gap is not None:
        near = contacts_by_distance(frame.spheres, gap, walls)
        ids = near.ids(frame.ids)
        counted = contact_counts(ids, frame.ids, particles, images=images)
        return [frame.step], [counted], KnownContacts(ids, near.points, None)
    steps, counts = [], []
    last = None
    for contacts in files.contact_frames(frame, step):
        steps.append(contacts.step)
        counts.append(contact_counts(contacts.ids, frame.ids, particles, images=images))
        last = KnownContacts(contacts.ids, contacts.points, contacts.forces)
    if last is None:
        raise AnalysisError(
            f"{files.contacts}: no contacts of step {frame.step}; --contact-gap GAP counts them "
            "by distance"
        )
    return steps, counts, last


def as_ranges(box: FloatArray) -> str:
    """Write a box, (3, 2), as the range of each axis; an axis of no end is left out."""
    ranges = [
        f"{axis} {low:g} to {high:g}"
        for axis, (low, high) in zip("xyz", box.tolist(), strict=True)
        if math.isfinite(low) or math.isfinite(high)
    ]
    return ", ".join(ranges) or "none: it has no end"
