"""Particle frames: LAMMPS's custom text dump of spheres, ours or of others.

Frames are read through MDAnalysis. It refuses dumps whose number of spheres changes, whose end is
missing, and some headers of others, and does not tell which row is wrong: these are parsed here.

A dump must have the columns `id`, positions and, unless the reader gives a radius, `radius` or
`diameter`. Positions may be as they are (x, xu) or in shares of the box (xs, xsu).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .bodies import Particles, group_spheres
from .cell import Cell
from .dump_text import (
    LARGEST_ID,
    PARTICLES,
    FrameHeader,
    missing_columns,
    open_dump,
    parsed_rows,
    read_header,
    read_rows,
    require_columns,
)
from .errors import CutOffError, DumpError, InputError, shortened
from .geometry import BoolArray, FloatArray, IntArray
from .spheres import Spheres

if TYPE_CHECKING:
    from MDAnalysis.coordinates.LAMMPS import DumpReader

# The first three of these columns that a dump has are read: positions in the box come before those
# that left it through a periodic face, lengths before shares of the box, which have lost digits.
POSITIONS = (("x", "y", "z"), ("xu", "yu", "zu"), ("xs", "ys", "zs"), ("xsu", "ysu", "zsu"))
SCALED = POSITIONS[2:]
VELOCITIES = ("vx", "vy", "vz")
# Errors say that a column holds these whole numbers.
WHOLE_NUMBERS = {"mol": "a body's number or 0", "contacts": "a number of contacts"}


@dataclass(frozen=True, eq=False)
class ParticleFrame:
    """The spheres at one step, ordered by id, and the particles that they make up.

    Attributes
    ----------
    step : time step
    ids : (n,), positive and each there once
    positions : (n, 3), length
    velocities : (n, 3), length / time; None where the dump has not all of `vx`, `vy`, `vz`
    radii : (n,), positive, length
    bodies : (n,), the dump's `mol`, 0 for a free sphere; None where the dump has no `mol`
    cell : the simulation box. Nothing is periodic where the dump does not say it
    boundaries : for each edge two letters (f fixed, p periodic, s or m shrink-wrapped), lower then
        upper face; None where the dump does not say
    contacts : (n,), each sphere's contacts with spheres of other particles; None where the dump has
        no `contacts`
    """

    step: int
    ids: IntArray
    positions: FloatArray
    velocities: FloatArray | None
    radii: FloatArray
    bodies: IntArray | None
    cell: Cell
    boundaries: tuple[str, str, str] | None
    contacts: IntArray | None = None

    @cached_property
    def particles(self) -> Particles:
        """The particles that the spheres make up; all are free if the dump has no `mol`."""
        return group_spheres(np.zeros_like(self.ids) if self.bodies is None else self.bodies)

    @cached_property
    def spheres(self) -> Spheres:
        """The spheres as every measure takes them, with their particles and their cell."""
        return Spheres(self.positions, self.radii, self.particles, self.cell)

    @property
    def box(self) -> FloatArray:
        """The smallest box along the axes that encloses the simulation box, (3, 2), length."""
        return self.cell.bounds

    @property
    def walls(self) -> FloatArray:
        """Faces of the simulation box that are fixed, (3, 2), infinite for the others, length.

        Where a dump does not tell its boundaries, none is known to be a wall.
        """
        told = self.boundaries or ("ss", "ss", "ss")
        fixed = np.array([[flag == "f" for flag in flags] for flags in told])
        return np.where(fixed, self.cell.flat_faces, [-np.inf, np.inf])


@dataclass(frozen=True)
class _Layout:
    """The columns of a dump that are read.

    Attributes
    ----------
    positions : names of the three columns
    velocities : names of the three columns, or none
    size : `radius` or `diameter`; None where the reader gives the radius
    whole : those of `mol` and `contacts` that are there
    """

    positions: tuple[str, str, str]
    velocities: tuple[str, ...]
    size: str | None
    whole: tuple[str, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        sizes = () if self.size is None else (self.size,)
        return ("id", *self.positions, *self.velocities, *sizes, *self.whole)


class ParticleDump:
    """The frames of a particle dump: a sequence that reads a frame when it is asked for.

    The headers are read at once, so that an incomplete file is known before any frame is used.
    `dump[i]`, `len(dump)` and `for frame in dump` work as for a list; `steps` are the time steps,
    and `spheres` the numbers of spheres, of the frames. `cut_off` says why the frames are not all.
    """

    def __init__(
        self, path: str | PathLike[str], *, radius: float | None = None, whole: bool = True
    ) -> None:
        """Read the headers of all frames of the file.

        Parameters
        ----------
        path : of the dump, plain text or compressed by gzip
        radius : of all spheres, length, where the dump has neither `radius` nor `diameter`
        whole : whether the file must be whole; if not, the frames before its end are read where
            that is missing, and `cut_off` says in one line that it is

        Raises InputError for a radius that is not positive, DumpError for a file without a frame or
        a column that is needed, and CutOffError for one that is not whole.
        """
        if radius is not None and not (radius > 0 and math.isfinite(radius)):
            raise InputError(f"a radius must be positive and finite, not {radius:g}")
        self.path = Path(path)
        self.cut_off: str | None = None
        self._headers: list[FrameHeader] = []
        # Of the first row of each frame.
        self._offsets: list[int] = []
        try:
            self._scan()
        except CutOffError as error:
            if whole or not self._headers:
                raise
            self.cut_off = str(error)
        self._radius = radius
        self._layout = _layout(self._headers[0], self.path, radius)
        self.steps: tuple[int, ...] = tuple(header.step for header in self._headers)
        self.spheres: tuple[int, ...] = tuple(header.rows for header in self._headers)
        self._reader: DumpReader | None = None
        self._is_known = self.cut_off is None and len(set(self.spheres)) == 1

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._headers)

    def __iter__(self) -> Iterator[ParticleFrame]:
        """Read the frames one by one, never two at a time."""
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: int) -> ParticleFrame:
        """Read one frame; negative indices count from the end.

        Raises IndexError for a frame that is not there, and DumpError for one without spheres or
        with a row that is wrong.
        """
        if not -len(self) <= index < len(self):
            raise IndexError(f"{self.path}: no frame {index}, there are {len(self)}")
        header = self._headers[index]
        if self._is_known and header.rows > 0:
            table = self._read(index % len(self))
            if table is not None and self._fine(table).all():
                return self._frame_of(header, table)
        with open_dump(self.path) as dump:
            dump.seek(self._offsets[index])
            rows = read_rows(dump, self.path, header)
        return self._frame(header, rows)

    def _read(self, index: int) -> FloatArray | None:
        """Read one frame's columns through MDAnalysis; None if it cannot."""
        # MDAnalysis takes half a second to import, which most commands need not wait for.
        from MDAnalysis.coordinates.LAMMPS import DumpReader

        columns = self._layout.columns
        try:
            if self._reader is None:
                # Additional columns are the only exact ones: MDAnalysis keeps positions as
                # float32 and shifts them to the box's origin. dt only silences its warning.
                self._reader = DumpReader(str(self.path), additional_columns=[*columns], dt=1.0)
            data = self._reader[index].data
            return np.column_stack([np.asarray(data[name], dtype=np.float64) for name in columns])
        # An id of twenty digits makes an OverflowError; it knows no header of units or times.
        except (ValueError, IndexError, KeyError, OverflowError):
            self._reader = None
            self._is_known = False
            return None

    def _scan(self) -> None:
        """Read all headers; see that every frame is whole and has the same columns."""
        line = 1
        with open_dump(self.path) as dump:
            while header := read_header(dump, self.path, line):
                if header.label != PARTICLES:
                    raise DumpError(
                        self.path,
                        f"its rows are {shortened(header.label)}, as in a dump local, such as one "
                        f"of contacts: a dump custom of particles, of {PARTICLES}, is needed",
                        header.first_row_line - 1,
                    )
                if self._headers and header.columns != self._headers[0].columns:
                    raise DumpError(
                        self.path,
                        "the columns are not those of the first frame",
                        header.first_row_line - 1,
                    )
                offset = dump.tell()
                read_rows(dump, self.path, header)
                self._headers.append(header)
                self._offsets.append(offset)
                line = header.next_line
        if not self._headers:
            raise DumpError(self.path, "the file is empty")

    def _frame(self, header: FrameHeader, rows: list[bytes]) -> ParticleFrame:
        """Make a frame of its rows, which may be in any order."""
        layout = self._layout
        if header.rows == 0:
            raise DumpError(
                self.path,
                f"the frame of step {header.step} has no spheres",
                header.first_row_line - 1,
            )
        table = parsed_rows(rows, header, layout.columns, self.path, whole=("id",))
        self._check(header, table)
        return self._frame_of(header, table[np.argsort(table[:, 0])])

    def _frame_of(self, header: FrameHeader, table: FloatArray) -> ParticleFrame:
        """Make a frame of the columns of its layout, in the order of the ids."""
        layout = self._layout
        data = dict(zip(layout.columns, table.T, strict=True))
        positions = _side_by_side(data, layout.positions)
        if layout.positions in SCALED:
            positions = header.cell.origin + positions @ header.cell.vectors
        if layout.size is None:
            radii = np.full(len(positions), self._radius)
        else:
            radii = data[layout.size] * (0.5 if layout.size == "diameter" else 1.0)
        return ParticleFrame(
            step=header.step,
            ids=data["id"].astype(np.int64),
            positions=positions,
            velocities=_side_by_side(data, layout.velocities) if layout.velocities else None,
            radii=radii,
            bodies=data["mol"].astype(np.int64) if "mol" in data else None,
            cell=_flat_if_two_dimensional(header.cell, positions),
            boundaries=header.boundaries,
            contacts=data["contacts"].astype(np.int64) if "contacts" in data else None,
        )

    def _fine(self, table: FloatArray) -> BoolArray:
        """Tell which rows can be spheres; of two with one id the later one cannot."""
        columns, size, whole = self._layout.columns, self._layout.size, self._layout.whole
        fine = np.isfinite(table).all(axis=1) & self._named(table)
        if size is not None:
            fine &= table[:, columns.index(size)] > 0
        for name in whole:
            values = table[:, columns.index(name)]
            fine &= (values >= 0) & (values < LARGEST_ID) & (values == np.rint(values))
        return np.asarray(fine)

    @staticmethod
    def _named(table: FloatArray) -> BoolArray:
        """Tell which rows have an id that can be one and is not there before."""
        ids = table[:, 0]
        named = (ids >= 1) & (ids < LARGEST_ID)
        first = np.zeros(len(ids), dtype=np.bool_)
        first[np.unique(ids, return_index=True)[1]] = True
        return np.asarray(named & first)

    def _check(self, header: FrameHeader, table: FloatArray) -> None:
        """See that the rows of a frame, in the order of the file, can be spheres."""
        columns, ids = self._layout.columns, table[:, 0]
        fine, named = self._fine(table), self._named(table)
        if fine.all():
            return
        row = int(np.argmin(fine))
        line = header.first_row_line + row
        if not named[row]:
            said = f"step {header.step}: ids must be positive and each there once"
            raise DumpError(self.path, said, line)
        said = self._said_of(dict(zip(columns[1:], table[row, 1:].tolist(), strict=True)))
        raise DumpError(self.path, f"step {header.step}, sphere {int(ids[row])}: {said}", line)

    def _said_of(self, values: dict[str, float]) -> str:
        """Say what is wrong with the values of a sphere."""
        for name, value in values.items():
            if not math.isfinite(value):
                return f"{name} is {value}"
        size = self._layout.size
        if size is not None and not values[size] > 0:
            return f"{size} is not positive"
        name = next(
            name
            for name in self._layout.whole
            if not 0 <= values[name] < LARGEST_ID or values[name] != round(values[name])
        )
        return f"{name} must be {WHOLE_NUMBERS[name]}, not {values[name]:g}"


def read_particle_frame(
    path: str | PathLike[str], index: int = -1, *, radius: float | None = None
) -> ParticleFrame:
    """Read one frame of a particle dump, by default the last.

    Parameters
    ----------
    path : of the dump, plain text or compressed by gzip
    index : of the frame; negative indices count from the end
    radius : of all spheres, length, where the dump has neither `radius` nor `diameter`

    Raises what `ParticleDump` raises.
    """
    return ParticleDump(path, radius=radius)[index]


def _flat_if_two_dimensional(cell: Cell, positions: FloatArray) -> Cell:
    """Return a cell as two-dimensional if it is periodic along z and all centres have one z.

    LAMMPS has it so with `dimension 2`, which dumps do not tell. A lone sphere is in space.
    """
    z = positions[:, 2]
    one_plane = len(z) > 1 and bool((z == z[0]).all())
    return cell.flattened() if one_plane and cell.can_be_flat else cell


def _side_by_side(data: dict[str, FloatArray], names: Sequence[str]) -> FloatArray:
    """Return some columns as one array (n, columns)."""
    return np.column_stack([data[name] for name in names])


def _layout(header: FrameHeader, path: Path, radius: float | None) -> _Layout:
    """Choose among the columns that are there; raise with their names where that is impossible."""
    require_columns(header, ("id",), path)
    there = set(header.columns)
    whole = [names for names in POSITIONS if there.issuperset(names)]
    if not whole:
        others = "; ".join(", ".join(names) for names in POSITIONS[1:])
        raise missing_columns(header, path, f"x, y, z (nor {others})")
    size = next((name for name in ("radius", "diameter") if name in there), None)
    if size is None and radius is None:
        raise missing_columns(header, path, "radius (nor diameter), and no radius is given")
    layout = _Layout(
        positions=whole[0],
        velocities=VELOCITIES if there.issuperset(VELOCITIES) else (),
        size=size,
        whole=tuple(name for name in WHOLE_NUMBERS if name in there),
    )
    require_columns(header, layout.columns, path)
    return layout
