"""The subcommand `inelastic export`: a packing as a file that another program opens."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from lammps_inelastic.analysis import AnalysisError, ParticleDump
from lammps_inelastic.analysis.geometry import as_box

from ..looking.export import (
    FILES,
    IMAGES,
    OF_CONTACTS,
    SUBDIVISIONS,
    choose_frame,
    write_contacts,
    write_image,
    write_spheres,
    write_surfaces,
)
from ..looking.frames import notes_of
from ..provenance.finished import PARTICLES as PARTICLE_DUMP
from .arguments import add_frame


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    export = commands.add_parser(
        "export",
        help="write a packing for another program",
        description="Write one frame of a run: its spheres (xyz for OVITO and ASE; vtk for "
        "ParaView; pqr for MDAnalysis, with radii; csv and json for scripts), its contacts with "
        "their forces (vtk-contacts: lines for ParaView and OVITO; bonds for OVITO, and the "
        "spheres as xyz; csv-contacts: a table), a voxel image (tiff; raw, with a MetaImage "
        "header) or the surfaces of its spheres (stl).",
    )
    export.add_argument(
        "source",
        type=Path,
        metavar="FOLDER|DUMP",
        help=f"folder of a run, which holds {PARTICLE_DUMP}, or a particle dump",
    )
    export.add_argument("--format", required=True, choices=tuple(FILES))
    export.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="file to write (default: packing or contacts, and the format's ending, in the run's "
        "folder)",
    )
    add_frame(export)
    export.add_argument(
        "--box",
        type=float,
        nargs=6,
        metavar=("XLO", "XHI", "YLO", "YHI", "ZLO", "ZHI"),
        help="box of a voxel image (default: the dump's); otherwise write the spheres whose "
        "centres, or the contacts whose points, lie in this box (default: all)",
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
    export.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Write the file, and print what is in it; 0, or an AnalysisError."""
    if options.voxel is not None and options.format not in IMAGES:
        raise AnalysisError(f"--voxel is for tiff and raw, not for {options.format}")
    if options.subdivisions is not None and options.format != "stl":
        raise AnalysisError(f"--subdivisions is for stl, not for {options.format}")
    if options.box is not None and options.format == "bonds":
        raise AnalysisError("--box is not for bonds: OVITO's modifier Slice cuts spheres and bonds")
    source: Path = options.source
    dump = ParticleDump(source / PARTICLE_DUMP if source.is_dir() else source, whole=False)
    frame = choose_frame(dump, source, number=options.frame, step=options.step)
    box = None if options.box is None else as_box(np.reshape(options.box, (3, 2)))
    form: str = options.format
    out: Path = options.out or dump.path.with_name(FILES[form])
    if form in IMAGES:
        rows = write_image(form, out, dump.path, frame, box, options.voxel)
    elif form in OF_CONTACTS:
        rows = write_contacts(form, out, dump.path, frame, box, source)
    elif form == "stl":
        subdivisions = SUBDIVISIONS if options.subdivisions is None else options.subdivisions
        rows = write_surfaces(out, dump.path, frame, box, subdivisions)
    else:
        rows = write_spheres(form, out, dump.path, frame, box, source)
    rows += [("note", note) for note in notes_of(dump, frame)]
    left = max(len(name) for name, _ in rows)
    print("\n".join(f"{name:<{left}}  {value}" for name, value in rows))
    return 0
