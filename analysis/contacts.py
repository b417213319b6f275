"""Contact frames: LAMMPS's local text dump of the fix's contacts.

Every row is a contact that carries a force: a positive multiplier, no distance criterion. With the
law gluey a row is a contact that carries a force, which may pull, or that has stored an impulse;
the dump then has the column stored.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from .dump_text import (
    LARGEST_ID,
    PARTICLES,
    FrameHeader,
    open_dump,
    parsed_rows,
    read_header,
    read_rows,
    require_columns,
)
from .errors import DumpError
from .geometry import BoolArray, FloatArray, IntArray

COLUMNS = ("id1", "id2", "x", "y", "z", "nx", "ny", "nz", "gap", "force")
STORED = "stored"


@dataclass(frozen=True, eq=False)
class ContactFrame:
    """The contacts at one step, in the order of the file; m may be 0.

    Attributes
    ----------
    step : time step
    ids : (m, 2), spheres on both sides; the second is -k for wall k
    points : (m, 3), contact point, length
    normals : (m, 3), unit vector from side 2 to side 1
    gaps : (m,), negative where the two overlap, length
    forces : (m,), positive, force; with a law by which contacts pull of any sign, < 0 where they do
    stored : (m,), impulse that presses them less what has pulled, <= 0, mass length/time; None if
        contacts store nothing
    """

    step: int
    ids: IntArray
    points: FloatArray
    normals: FloatArray
    gaps: FloatArray
    forces: FloatArray
    stored: FloatArray | None = None


def iterate_contact_frames(path: str | PathLike[str]) -> Iterator[ContactFrame]:
    """Read the frames of a contact dump one by one; at least one frame must be there.

    Raises DumpError with the file and, where it can be told, the line: for a file that cannot be
    read or is empty, for a frame that is cut off or lacks a column, and for rows that cannot be
    contacts.
    """
    file = Path(path)
    line = 1
    with open_dump(file) as dump:
        while header := read_header(dump, file, line):
            if header.label == PARTICLES:
                raise DumpError(
                    file,
                    f"its rows are {PARTICLES}, of a dump of particles: a dump local of contacts "
                    "is needed",
                    header.first_row_line - 1,
                )
            require_columns(header, COLUMNS, file)
            yield _parsed_frame(read_rows(dump, file, header), header, file)
            line = header.next_line
    if line == 1:
        raise DumpError(file, "the file is empty")


def _parsed_frame(rows: list[bytes], header: FrameHeader, path: Path) -> ContactFrame:
    stores = STORED in header.columns
    names = (*COLUMNS, STORED) if stores else COLUMNS
    data = parsed_rows(rows, header, names, path)
    _check(data, names, header, path)
    return ContactFrame(
        step=header.step,
        ids=data[:, 0:2].astype(np.int64),
        points=data[:, 2:5].copy(),
        normals=data[:, 5:8].copy(),
        gaps=data[:, 8].copy(),
        forces=data[:, 9].copy(),
        stored=data[:, 10].copy() if stores else None,
    )


def _check(data: FloatArray, names: Sequence[str], header: FrameHeader, path: Path) -> None:
    finite = np.isfinite(data)
    if not finite.all():
        row, column = np.argwhere(~finite)[0]
        raise DumpError(
            path, f"{names[column]} is {data[row, column]}", header.first_row_line + int(row)
        )
    ids = data[:, 0:2]
    for wrong, message in (
        (
            (ids != np.rint(ids)).any(axis=1)
            | (ids[:, 0] < 1)
            | (ids[:, 1] == 0)
            | (np.abs(ids) >= LARGEST_ID).any(axis=1),
            "id1 must be a sphere's id and id2 a sphere's id or minus a wall's number",
        ),
        (
            (ids[:, 0] == ids[:, 1]) & (not header.cell.has_images),
            "a sphere is in contact with itself",
        ),
        (
            np.full(len(data), len(names) == len(COLUMNS)) & (data[:, 9] <= 0),
            "the force of a contact must be positive",
        ),
        (data[:, len(COLUMNS) :].max(axis=1, initial=0.0) > 0, "stored must not be positive"),
        (_repeated(data, header), "this pair of spheres is listed twice"),
    ):
        if wrong.any():
            raise DumpError(path, message, header.first_row_line + int(np.argmax(wrong)))


def _repeated(data: FloatArray, header: FrameHeader) -> BoolArray:
    """Say which rows repeat an earlier pair of spheres, in either order.

    A pair counted once by each of two ranks would double the coordination number unseen. Walls are
    left out: a sphere may touch one curved wall at several points. In a periodic box two spheres
    may touch by several images, along different normals.
    """
    between_spheres = np.flatnonzero(data[:, 1] > 0)
    pairs = np.sort(data[between_spheres, :2], axis=1)
    if header.cell.has_images:
        turned = data[between_spheres, 0] > data[between_spheres, 1]
        normals = np.where(turned[:, None], -1, 1) * data[between_spheres, 5:8]
        # Images that touch at all are much farther apart than this share of a radius; a normal of
        # a contact that two ranks have seen differs by round-off.
        pairs = np.column_stack([pairs, np.round(normals, 3)])
    _, first = np.unique(pairs, axis=0, return_index=True)
    repeated = np.zeros(len(data), dtype=bool)
    repeated[np.delete(between_spheres, first)] = True
    return repeated
