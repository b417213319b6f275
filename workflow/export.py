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
    ParticleDump,
    ParticleFrame,
    RunFilesError,
    UnfinishedRunError,
    check_contacts,
    contact_counts,
    iterate_contact_frames,
    voxel_shape,
    write_raw,
    write_stl,
    write_tiff,
    write_vtk,
    write_xyz,
)
from lammps_inelastic.analysis.export import Progress
from lammps_inelastic.analysis.geometry import (
    BoolArray,
    FloatArray,
    IntArray,
    inside_of,
    spheres_reaching,
)

from .finished import CONTACTS as CONTACT_DUMP
from .finished import open_in_folder
from .frames import choose_index

# The file has this name if no other is given, and its format's ending.
NAME = "packing"
ENDINGS = {"xyz": ".xyz", "vtk": ".vtu", "tiff": ".tif", "raw": ".raw", "stl": ".stl"}
IMAGES = ("tiff", "raw")

# The smallest radius is so many voxels long, if no other size is given.
VOXELS_PER_RADIUS = 10
SUBDIVISIONS = 2

# Why surfaces and images are not made of a periodic box; points know their box, or need none.
NOT_ACROSS = "spheres that reach through its faces are not drawn on the other side yet"

# A line is printed after each of so many equal parts where there is no terminal.
PARTS = 10


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
    subdivisions: int | None,
) -> list[tuple[str, str]]:
    """Write spheres as points or as surfaces; return names and values of what was written.

    Parameters
    ----------
    form : xyz, vtk or stl
    out : file to write
    path : path of the dump, for errors
    frame : frame that is written
    box : (3, 2), box in which the centres of the spheres lie, length; None for all spheres
    source : folder of the run, or the dump's own path if it was named alone
    subdivisions : each sphere of stl has 20 x 4^subdivisions faces; None for the usual ones
    """
    chosen = np.ones(len(frame.ids), dtype=np.bool_)
    if box is not None:
        chosen = inside_of(frame.positions, box)
        if not chosen.any():
            raise AnalysisError(f"{path}: no sphere's centre lies in the box at step {frame.step}")
    positions, radii = frame.positions[chosen], frame.radii[chosen]
    rows = [("spheres", f"{len(radii)} of {len(chosen)}, step {frame.step}")]
    if form == "stl":
        _check_not_periodic(frame, path)
        divided = SUBDIVISIONS if subdivisions is None else subdivisions
        faces = write_stl(out, positions, radii, subdivisions=divided)
        return [*rows, ("faces", f"{faces}"), _as_file("file", out)]

    columns = _Columns.of(frame, chosen, source)
    if form == "xyz":
        write_xyz(
            out,
            positions,
            radii,
            **columns.arrays,
            box=frame.box,
            # A reader takes a box of which nothing is said for a periodic one.
            periodic=["p" in flags for flags in frame.boundaries or ("", "", "")],
            step=frame.step,
        )
    else:
        write_vtk(out, positions, radii, **columns.arrays)
    return [*rows, ("columns", columns.names), _as_file("file", out)]


def _check_not_periodic(frame: ParticleFrame, path: Path) -> None:
    if frame.cell.has_images:
        told = " ".join(frame.boundaries or ())
        raise AnalysisError(
            f"{path}: the box is periodic ({told}), and {NOT_ACROSS}: all boundaries must be "
            "f, s or m"
        )


@dataclass(frozen=True, eq=False)
class _Columns:
    """The columns for k chosen spheres that are written beside place and radius.

    Attributes
    ----------
    ids : (k,)
    bodies : (k,), 0 for a free sphere; None where the dump has no bodies
    contacts : (k,), contacts with other spheres, of all the packing; None where they are not known
    """

    ids: IntArray
    bodies: IntArray | None
    contacts: IntArray | None

    @classmethod
    def of(cls, frame: ParticleFrame, chosen: BoolArray, source: Path) -> _Columns:
        """Return the columns of the chosen spheres, (n,) of bool, of a frame."""
        contacts = _contacts(frame, source)
        return cls(
            ids=frame.ids[chosen],
            bodies=None if frame.bodies is None else frame.bodies[chosen],
            contacts=None if contacts is None else contacts[chosen],
        )

    @property
    def arrays(self) -> dict[str, IntArray | None]:
        """The columns by the names that the writers give them."""
        return {"ids": self.ids, "bodies": self.bodies, "contacts": self.contacts}

    @property
    def names(self) -> str:
        """The names of the columns, for the user."""
        names = "radius, id" + ("" if self.bodies is None else ", body")
        if self.contacts is None:
            return f"{names}; no contacts are known at this step"
        return f"{names}, contacts"


def _contacts(frame: ParticleFrame, source: Path) -> IntArray | None:
    """Count each sphere's contacts with others, (n,), where a run's contact dump has the step.

    A dump that was named alone may be of another run than the contacts beside it.
    """
    path = source / CONTACT_DUMP
    if not path.exists():
        return None
    for contacts in iterate_contact_frames(path):
        if contacts.step == frame.step:
            check_contacts(contacts, frame, path)
            return contact_counts(contacts.ids, frame.ids).particles
    return None


def write_image(
    form: str,
    out: Path,
    path: Path,
    frame: ParticleFrame,
    box: FloatArray | None,
    voxel: float | None,
) -> list[tuple[str, str]]:
    """Write a voxel image; return names and values of what was written.

    Parameters
    ----------
    form : tiff or raw
    out : file to write
    path : path of the dump, for errors
    frame : frame that is written
    box : (3, 2), box of the image, length; None for the dump's
    voxel : edge of a voxel, length; None for a tenth of the smallest radius
    """
    _check_not_periodic(frame, path)
    bounds = frame.box if box is None else box
    if not spheres_reaching(frame.positions, frame.radii, bounds).any():
        raise AnalysisError(f"{path}: no sphere reaches into the box at step {frame.step}")
    edge = float(frame.radii.min()) / VOXELS_PER_RADIUS if voxel is None else voxel
    slices, rows, columns = voxel_shape(bounds, edge)
    write = write_tiff if form == "tiff" else write_raw
    with _progress() as progress:
        image = write(out, frame.positions, frame.radii, bounds, edge, progress=progress)
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
