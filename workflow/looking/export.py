"""A frame of a run written as a file that another program opens."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich import filesize
from rich.console import Console
from rich.progress import Progress as ProgressBar

from lammps_inelastic.analysis import (
    AnalysisError,
    ContactFrame,
    ParticleDump,
    ParticleFrame,
    RunFilesError,
    Spheres,
    UnfinishedRunError,
    check_contacts,
    contact_counts,
    group_spheres,
    iterate_contact_frames,
    voxel_shape,
    write_bonds,
    write_contacts_csv,
    write_contacts_vtk,
    write_csv,
    write_json,
    write_pqr,
    write_raw,
    write_stl,
    write_tiff,
    write_vtk,
    write_xyz,
)
from lammps_inelastic.analysis.export_files import named
from lammps_inelastic.analysis.export_voxels import Progress
from lammps_inelastic.analysis.geometry import FloatArray, IntArray, inside_of, spheres_reaching

from ..provenance.finished import CONTACTS as CONTACT_DUMP
from ..provenance.finished import open_in_folder
from .frames import choose_index

# The formats, and the name of each one's file if no other is given.
FILES = {
    "xyz": "packing.xyz",
    "vtk": "packing.vtu",
    "csv": "packing.csv",
    "json": "packing.json",
    "pqr": "packing.pqr",
    "vtk-contacts": "contacts.vtp",
    "csv-contacts": "contacts.csv",
    "bonds": "packing.bonds",
    "tiff": "packing.tif",
    "raw": "packing.raw",
    "stl": "packing.stl",
}
OF_CONTACTS = ("vtk-contacts", "csv-contacts", "bonds")
IMAGES = ("tiff", "raw")

# The smallest radius is so many voxels long, if no other size is given.
VOXELS_PER_RADIUS = 10
SUBDIVISIONS = 2

# A line is printed after each of so many equal parts where there is no terminal.
PARTS = 10

Rows = list[tuple[str, str]]


def choose_frame(
    dump: ParticleDump, source: Path, *, number: int | None, step: int | None
) -> ParticleFrame:
    """Return a frame of a dump as `choose_index` does; by its number only where none is missing.

    Parameters
    ----------
    dump : particle dump
    source : folder of the run, or the dump's own path if it was named alone
    number : number of the frame from 0, or from the end: -1 is the last
    step : time step of the frame, which comes before its number
    """
    # A frame that is named by its step is the right one, whatever became of the others.
    if step is None:
        _check_frames(dump, source)
    return dump[choose_index(dump, number=number, step=step)]


def _check_frames(dump: ParticleDump, source: Path) -> None:
    """See that no frame is missing, as a frame is named by its place among all.

    A dump that was named alone may be of another run than the contacts beside it.
    """
    contacts = source / CONTACT_DUMP
    if dump.cut_off is not None and contacts.exists():
        raise AnalysisError(f"{dump.cut_off}; --step N writes a frame that is there")
    try:
        open_in_folder(dump, contacts if contacts.exists() else None, alone=not source.is_dir())
    except UnfinishedRunError as error:
        raise AnalysisError(f"{error}; --step N writes a frame that is there") from None
    except RunFilesError as error:
        raise AnalysisError(f"{error}, or write a frame that is there with --step N") from None


def write_spheres(
    form: str,
    out: Path,
    path: Path,
    frame: ParticleFrame,
    box: FloatArray | None,
    source: Path,
) -> Rows:
    """Write spheres as points or as a list; return names and values of what was written.

    Parameters
    ----------
    form : xyz, vtk, csv, json or pqr
    out : file to write
    path : path of the dump, for errors
    frame : frame that is written
    box : (3, 2), box in which the centres of the spheres lie, length; None for all spheres
    source : folder of the run, or the dump's own path if it was named alone
    """
    chosen = _Chosen.of(frame, box, path)
    spheres, ids = chosen.spheres, frame.ids[chosen.index]
    said = [("spheres", chosen.said)]
    if form == "pqr":
        write_pqr(out, spheres, ids=ids)
        return [
            *said,
            ("columns", "radius, id; a residue for each particle"),
            _as_file("file", out),
        ]
    bodies = None if frame.bodies is None else frame.bodies[chosen.index]
    counts = _counts(frame, source)
    contacts = None if counts is None else counts[chosen.index]
    if form == "xyz":
        write_xyz(out, spheres, ids=ids, bodies=bodies, contacts=contacts, step=frame.step)
    elif form == "json":
        write_json(out, spheres, ids=ids, bodies=bodies, contacts=contacts, step=frame.step)
    else:
        write = {"vtk": write_vtk, "csv": write_csv}[form]
        write(out, spheres, ids=ids, bodies=bodies, contacts=contacts)
    names = "radius, id" + ("" if bodies is None else ", body")
    names += "; no contacts are known at this step" if contacts is None else ", contacts"
    return [*said, ("columns", names), _as_file("file", out)]


def write_surfaces(
    out: Path, path: Path, frame: ParticleFrame, box: FloatArray | None, subdivisions: int
) -> Rows:
    """Write the surfaces of spheres as STL; return names and values of what was written.

    Parameters
    ----------
    out : file to write
    path : path of the dump, for errors
    frame : frame that is written
    box : (3, 2), box in which the centres of the spheres lie, length; None for all spheres, and
        the images of those that reach through a periodic face
    subdivisions : each sphere has 20 x 4^subdivisions faces
    """
    chosen = _Chosen.of(frame, box, path)
    faces = write_stl(out, chosen.spheres, subdivisions=subdivisions)
    said = chosen.said
    images = faces // (20 * 4**subdivisions) - len(chosen.spheres)
    if chosen.spheres.has_images:
        said += f", and {images} images that reach into the cell"
    return [("spheres", said), ("faces", f"{faces}"), _as_file("file", out)]


def write_contacts(
    form: str,
    out: Path,
    path: Path,
    frame: ParticleFrame,
    box: FloatArray | None,
    source: Path,
) -> Rows:
    """Write contacts with their forces; return names and values of what was written.

    Parameters
    ----------
    form : vtk-contacts, csv-contacts or bonds
    out : file to write
    path : path of the dump, for errors
    frame : frame whose contacts are written
    box : (3, 2), box in which the contact points lie, length; None for all contacts
    source : folder of the run

    Raises AnalysisError where the contacts of the frame's step are not known.
    """
    contacts = _contacts(frame, source)
    if contacts is None:
        if not source.is_dir():
            raise AnalysisError(
                f"{path}: a dump alone has no contacts: name the folder of the run, which holds "
                f"{CONTACT_DUMP}"
            )
        raise AnalysisError(f"{source / CONTACT_DUMP}: no contacts of step {frame.step}")
    said = [("contacts", _as_contacts(contacts, frame.step))]
    if form == "bonds":
        points = named(out, (".bonds",)).with_suffix(".xyz")
        # Bonds lead between the places of the spheres in this file, which are written first.
        rows = write_spheres("xyz", points, path, frame, None, source)
        bonds = write_bonds(out, contacts, frame.ids, frame.spheres)
        return [*rows, *said, ("bonds", f"{bonds} between spheres"), _as_file("file", out)]
    if form == "vtk-contacts":
        lines = write_contacts_vtk(out, contacts, frame.ids, frame.spheres, box=box)
        said.append(("lines", f"{lines} with force, gap, normal, id1, id2, wall, copy"))
    else:
        rows_written = write_contacts_csv(out, contacts, frame.ids, frame.spheres, box=box)
        said.append(("rows", f"{rows_written}"))
    return [*said, _as_file("file", out)]


def _as_contacts(contacts: ContactFrame, step: int) -> str:
    walls = int((contacts.ids[:, 1] < 0).sum())
    return f"{len(contacts.ids)}, step {step}; {walls} of them with walls"


@dataclass(frozen=True, eq=False)
class _Chosen:
    """The spheres of a frame that are written.

    Attributes
    ----------
    spheres : k spheres; cut out of a packing, they are not periodic
    index : (k,), index of each one in the frame
    said : how many they are, for the user
    """

    spheres: Spheres
    index: IntArray
    said: str

    @classmethod
    def of(cls, frame: ParticleFrame, box: FloatArray | None, path: Path) -> _Chosen:
        """Choose all spheres, or those whose centres, or images of them, lie in a box, (3, 2)."""
        everything = frame.spheres
        count = len(everything)
        if box is None:
            return cls(everything, np.arange(count), f"{count} of {count}, step {frame.step}")
        images = everything.around(box)
        places = images.spheres
        chosen = inside_of(places.positions, box, flat=everything.flat)
        if not chosen.any():
            raise AnalysisError(f"{path}: no sphere's centre lies in the box at step {frame.step}")
        index = images.sphere[chosen]
        said = f"{len(index)} of {count}, step {frame.step}"
        if everything.has_images:
            said = f"{len(index)}, images among them, of {count}, step {frame.step}"
        particles = group_spheres(places.particles.index[chosen] + 1)
        piece = Spheres(places.positions[chosen], places.radii[chosen], particles, places.cell)
        return cls(piece, index, said)


def _counts(frame: ParticleFrame, source: Path) -> IntArray | None:
    """Count each sphere's contacts with others, (n,), where they are known."""
    contacts = _contacts(frame, source)
    if contacts is None:
        return None
    images = frame.cell.has_images
    return contact_counts(contacts.ids, frame.ids, images=images).particles


def _contacts(frame: ParticleFrame, source: Path) -> ContactFrame | None:
    """Return the contacts of a frame's step, if a run's contact dump has them.

    A dump that was named alone may be of another run than the contacts beside it.
    """
    path = source / CONTACT_DUMP
    if not path.exists():
        return None
    for contacts in iterate_contact_frames(path):
        if contacts.step == frame.step:
            check_contacts(contacts, frame, path)
            return contacts
    return None


def write_image(
    form: str,
    out: Path,
    path: Path,
    frame: ParticleFrame,
    box: FloatArray | None,
    voxel: float | None,
) -> Rows:
    """Write a voxel image; return names and values of what was written.

    Parameters
    ----------
    form : tiff or raw
    out : file to write
    path : path of the dump, for errors
    frame : frame that is written
    box : (3, 2), box of the image, length; None for the one that encloses the dump's
    voxel : edge of a voxel, length; None for a tenth of the smallest radius
    """
    bounds = frame.box if box is None else box
    drawn = frame.spheres.around(bounds).spheres
    if not spheres_reaching(drawn.positions, drawn.radii, bounds).any():
        raise AnalysisError(f"{path}: no sphere reaches into the box at step {frame.step}")
    edge = float(frame.radii.min()) / VOXELS_PER_RADIUS if voxel is None else voxel
    slices, rows, columns = voxel_shape(bounds, edge)
    write = write_tiff if form == "tiff" else write_raw
    with _progress() as progress:
        image = write(out, frame.spheres, bounds, edge, progress=progress)
    said = [
        ("spheres", f"{len(frame.ids)}, step {frame.step}"),
        ("voxels", f"{columns} x {rows} x {slices} of {edge:g}"),
        ("solid share", f"{image.solid_share:.4f}"),
        _as_file("file", out),
    ]
    return [*said, _as_file("header", out.with_suffix(".mhd"))] if form == "raw" else said


@contextmanager
def _progress() -> Iterator[Progress]:
    """Give a function that shows how many slices are done: a bar on a terminal, otherwise lines."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _say_part
        return
    with ProgressBar(console=console, transient=True) as bar:
        task = bar.add_task("slices", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _say_part(done: int, total: int) -> None:
    if done * PARTS // total > (done - 1) * PARTS // total:
        print(f"slice {done} of {total}", file=sys.stderr, flush=True)


def _as_file(name: str, path: Path) -> tuple[str, str]:
    return name, f"{path} ({filesize.decimal(path.stat().st_size)})"
