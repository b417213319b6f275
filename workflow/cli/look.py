"""The subcommand `inelastic look`: the numbers and a picture of one run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from lammps_inelastic.analysis import AnalysisError

from ..looking.look import PICTURE, Wanted, look_at
from ..looking.look_output import as_json, as_text
from ..looking.view import PAGE
from ..provenance.finished import CONTACTS as CONTACT_DUMP
from ..provenance.finished import PARTICLES as PARTICLE_DUMP
from ..study import MOST_POINTS
from .arguments import add_frame


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    look = commands.add_parser(
        "look",
        help="measure a run and draw its packing",
        description=f"Measure the packing in a run's folder, which holds {PARTICLE_DUMP} and "
        f"{CONTACT_DUMP}, and draw it: as {PICTURE}, and as {PAGE}, a page to turn and to look "
        "into. Any dump custom of spheres will do with --dump, --contact-gap and --radius.",
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
    add_frame(look)
    bounds = ("XLO", "XHI", "YLO", "YHI", "ZLO", "ZHI")
    where = look.add_mutually_exclusive_group()
    where.add_argument(
        "--box",
        type=float,
        nargs=6,
        metavar=bounds,
        help="measure the packing fraction and the coordination number in this box "
        "(default: 0.25 to 0.75 on every axis; the whole simulation box where it is periodic on "
        "all sides)",
    )
    where.add_argument(
        "--cell", action="store_true", help="measure them in the whole simulation box"
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
    look.add_argument(
        "--no-picture", action="store_true", help=f"draw nothing, neither {PICTURE} nor {PAGE}"
    )
    look.add_argument("--no-page", action="store_true", help=f"write no {PAGE}")
    look.add_argument("--json", action="store_true", help="print JSON")
    look.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Measure, draw, print; 0, or an AnalysisError."""
    if not 1 <= options.points <= MOST_POINTS:
        raise AnalysisError(f"--points must be from 1 to {MOST_POINTS}, not {options.points}")
    if options.seed < 0:
        raise AnalysisError(f"--seed must not be negative, not {options.seed}")
    if options.contact_gap is not None and not 0 <= options.contact_gap < np.inf:
        raise AnalysisError(f"--contact-gap must be 0 or more, not {options.contact_gap:g}")
    folder: Path = options.folder
    if not folder.exists():
        raise AnalysisError(f"{folder}: no such file or folder")
    name = PARTICLE_DUMP if options.dump is None else options.dump
    if folder.is_file():
        if options.dump is not None:
            raise AnalysisError(f"{folder}: is a file; --dump names one in a folder")
        folder, name = folder.parent, folder.name
    wanted = Wanted(
        box=None if options.box is None else np.reshape(np.asarray(options.box, float), (3, 2)),
        whole_cell=options.cell,
        contact_gap=options.contact_gap,
        radius=options.radius,
        number=options.frame,
        step=options.step,
        points=options.points,
        seed=options.seed,
        container=None
        if options.container is None
        else np.reshape(np.asarray(options.container, dtype=np.float64), (3, 2)),
        box_is_container=options.walls,
        picture=None if options.no_picture else folder / PICTURE,
        page=None if options.no_picture or options.no_page else folder / PAGE,
    )
    found = look_at(folder / name, folder / CONTACT_DUMP, wanted)
    print(as_json(found) if options.json else as_text(found))
    if found.failure is not None:
        raise found.failure
    return 0
