"""The subcommand `inelastic export`: a packing as a file that another program opens."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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
    open_run,
    particles_inside,
    read_run_log,
    voxel_shape,
    write_raw,
    write_stl,
    write_tiff,
    write_vtk,
    write_xyz,
)
from lammps_inelastic.analysis.export import Progress
from lammps_inelastic.analysis.geometry import BoolArray, FloatArray, IntArray, as_box

from .finished import CONTACTS as CONTACT_DUMP
from .finished import LOG, unchanged
from .finished import PARTICLES as PARTICLE_DUMP

# What the file is called that is not named.
NAME = "packing"
ENDINGS = {"xyz": ".xyz", "vtk": ".vtu", "tiff": ".tif", "raw": ".raw", "stl": ".stl"}
IMAGES = ("tiff", "raw")

# Without --voxel, the smallest radius is this many voxels long.
VOXELS_PER_RADIUS = 10
SUBDIVISIONS = 2

# Steps that are named where one is not found.
STEPS_SHOWN = 6
# Where there is no terminal, a line is printed after each of so many equal parts.
PARTS = 10


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    export = commands.add_parser(
        "export",
        help="write a packing for another program",
        description="Write one frame of a run as points (xyz for OVITO, ASE and MDAnalysis; vtk "
        "for ParaView), as a voxel image (tiff; raw, with a MetaImage header) or as the surfaces "
        "of its spheres (stl).",
    )
    export.add_argument(
        "source",
        type=Path,
        metavar="FOLDER|DUMP",
        help=f"folder of a run, which holds {PARTICLE_DUMP}, or a particle dump",
    )
    export.add_argument("--format", required=True, choices=tuple(ENDINGS))
    export.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help=f"file to write (default: {NAME} and the format's ending, in the run's folder)",
    )
    frames = export.add_mutually_exclusive_group()
    frames.add_argument(
        "--frame",
        type=int,
        metavar="N",
        help="frame, counted from 0, or from the end: -1 is the last (default: the last)",
    )
    frames.add_argument("--step", type=int, metavar="N", help="frame of this time step")
    export.add_argument(
        "--box",
        type=float,
        nargs=6,
        metavar=("XLO", "XHI", "YLO", "YHI", "ZLO", "ZHI"),
        help="box of a voxel image (default: the dump's); for the other formats, write the spheres "
        "whose centres lie in this box (default: all)",
    )
    export.add_argument(
        "--voxel",
        type=float,
        metavar="SIZE",
        help="edge of a voxel, tiff and raw only (default: a tenth of the smallest radius)",
    )
    export.add_argument(
        "--subdivisions",
        type=int,
        metavar="N",
        help="each sphere has 20 x 4^N faces, stl only "
        f"(default: {SUBDIVISIONS}, {20 * 4**SUBDIVISIONS} faces)",
    )


def run(options: argparse.Namespace) -> int:
    """Write the file, and print what is in it; 0, or an AnalysisError."""
    if options.voxel is not None and options.format not in IMAGES:
        raise AnalysisError(f"--voxel is for tiff and raw, not for {options.format}")
    if options.subdivisions is not None and options.format != "stl":
        raise AnalysisError(f"--subdivisions is for stl, not for {options.format}")
    source: Path = options.source
    dump = ParticleDump(source / PARTICLE_DUMP if source.is_dir() else source)
    frame = _chosen_frame(dump, options)
    box = None if options.box is None else as_box(np.reshape(options.box, (3, 2)))
    out: Path = options.out or dump.path.with_name(NAME + ENDINGS[options.format])
    if options.format in IMAGES:
        rows = _write_image(out, dump.path, frame, box, options)
    else:
        rows = _write_spheres(out, dump.path, frame, box, options)
    left = max(len(name) for name, _ in rows)
    print("\n".join(f"{name:<{left}}  {value}" for name, value in rows))
    return 0


def _chosen_frame(dump: ParticleDump, options: argparse.Namespace) -> ParticleFrame:
    if options.step is not None:
        # A frame that is named by its step is what it says, whatever became of the others.
        if options.step not in dump.steps:
            raise AnalysisError(f"{dump.path}: no step {options.step}; {_as_steps(dump.steps)}")
        if dump.steps.count(options.step) > 1:
            raise AnalysisError(
                f"{dump.path}: more than one frame of step {options.step}; --frame N chooses one"
            )
        return dump[dump.steps.index(options.step)]
    _check_frames(dump, options.source)
    index = -1 if options.frame is None else options.frame
    if not -len(dump) <= index < len(dump):
        raise AnalysisError(
            f"{dump.path}: no frame {index}; there are {len(dump)}, from 0 to {len(dump) - 1}"
        )
    return dump[index]


def _check_frames(dump: ParticleDump, source: Path) -> None:
    """See that no frame is missing: a frame is named by its place among all.

    A dump that was named alone may be of another run than the contacts beside it.
    """
    folder, contacts = dump.path.parent, source / CONTACT_DUMP
    log = read_run_log(folder / LOG) if (folder / LOG).exists() else None
    try:
        files = open_run(dump, contacts if contacts.exists() else None, log)
        files.check_last(dump[-1])
        if source.is_dir():
            unchanged(folder)
    except UnfinishedRunError as error:
        raise AnalysisError(f"{error}; --step N writes a frame that is there") from None
    except RunFilesError as error:
        raise AnalysisError(f"{error}, or write a frame that is there with --step N") from None


def _as_steps(steps: tuple[int, ...]) -> str:
    if len(steps) <= STEPS_SHOWN:
        return f"the steps are {', '.join(map(str, steps))}"
    first = ", ".join(map(str, steps[: STEPS_SHOWN - 1]))
    return f"the {len(steps)} steps are {first}, ..., {steps[-1]}"


def _write_spheres(
    out: Path, path: Path, frame: ParticleFrame, box: FloatArray | None, options: argparse.Namespace
) -> list[tuple[str, str]]:
    """Write the spheres whose centres lie in the box, all if there is none; return what to say."""
    chosen = np.ones(len(frame.ids), dtype=np.bool_)
    if box is not None:
        chosen = particles_inside(frame.positions, box)
        if not chosen.any():
            raise AnalysisError(f"{path}: no sphere's centre lies in the box at step {frame.step}")
    positions, radii = frame.positions[chosen], frame.radii[chosen]
    rows = [("spheres", f"{len(radii)} of {len(chosen)}, step {frame.step}")]
    if options.format == "stl":
        divided = SUBDIVISIONS if options.subdivisions is None else options.subdivisions
        faces = write_stl(out, positions, radii, subdivisions=divided)
        return [*rows, ("faces", f"{faces}"), _as_file("file", out)]

    columns = _Columns.of(frame, chosen, options.source)
    if options.format == "xyz":
        write_xyz(
            out,
            positions,
            radii,
            ids=columns.ids,
            bodies=columns.bodies,
            contacts=columns.contacts,
            box=frame.box,
            periodic=["p" in flags for flags in frame.boundaries],
            step=frame.step,
        )
    else:
        write_vtk(
            out,
            positions,
            radii,
            ids=columns.ids,
            bodies=columns.bodies,
            contacts=columns.contacts,
        )
    return [*rows, ("columns", columns.names), _as_file("file", out)]


@dataclass(frozen=True, eq=False)
class _Columns:
    """What is written of each chosen sphere beside place and radius; k spheres are chosen.

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
        contacts = _contacts(frame, source)
        return cls(
            ids=frame.ids[chosen],
            bodies=None if frame.bodies is None else frame.bodies[chosen],
            contacts=None if contacts is None else contacts[chosen],
        )

    @property
    def names(self) -> str:
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


def _write_image(
    out: Path, path: Path, frame: ParticleFrame, box: FloatArray | None, options: argparse.Namespace
) -> list[tuple[str, str]]:
    """Write the voxel image of the box, the dump's if there is none; return what to say."""
    if any("p" in flags for flags in frame.boundaries):
        raise AnalysisError(
            f"{path}: the box is periodic ({' '.join(frame.boundaries)}), and spheres that reach "
            "through its faces are not drawn on the other side yet"
        )
    bounds = frame.box if box is None else box
    radii = frame.radii[:, None]
    reaches = (frame.positions + radii > bounds[:, 0]) & (frame.positions - radii < bounds[:, 1])
    if not reaches.all(axis=1).any():
        raise AnalysisError(f"{path}: no sphere reaches into the box at step {frame.step}")
    voxel = float(frame.radii.min()) / VOXELS_PER_RADIUS if options.voxel is None else options.voxel
    slices, rows, columns = voxel_shape(bounds, voxel)
    write = write_tiff if options.format == "tiff" else write_raw
    with _progress() as progress:
        image = write(out, frame.positions, frame.radii, bounds, voxel, progress=progress)
    said = [
        ("spheres", f"{len(frame.ids)}, step {frame.step}"),
        ("voxels", f"{columns} x {rows} x {slices} of {voxel:g}"),
        ("solid share", f"{image.solid_share:.4f}"),
        _as_file("file", out),
    ]
    return [*said, _as_file("header", out.with_suffix(".mhd"))] if options.format == "raw" else said


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
