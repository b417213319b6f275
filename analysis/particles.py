"""Particle frames: LAMMPS's custom text dump of spheres, read through MDAnalysis.

A dump must have the columns `id`, positions and, unless the reader gives a radius, `radius` or
`diameter`. Positions may be as they are (x, xu) or in shares of the box (xs, xsu).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from os import PathLike
from pathlib import Path

import numpy as np
from MDAnalysis.coordinates.LAMMPS import DumpReader

from .bodies import Particles, group_spheres
from .dump_text import (
    LARGEST_ID,
    FrameHeader,
    malformed_row,
    missing_columns,
    open_dump,
    read_header,
    read_rows,
    require_columns,
)
from .errors import DumpError, InputError
from .geometry import FloatArray, IntArray

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
    box : (3, 2), lower and upper bound per axis, length
    boundaries : two letters per axis (f fixed, p periodic, s or m shrink-wrapped), lower then upper
    contacts : (n,), each sphere's contacts with spheres of other particles; None where the dump has
        no `contacts`
    """

    step: int
    ids: IntArray
    positions: FloatArray
    velocities: FloatArray | None
    radii: FloatArray
    bodies: IntArray | None
    box: FloatArray
    boundaries: tuple[str, str, str]
    contacts: IntArray | None = None

    @cached_property
    def particles(self) -> Particles:
        """The particles that the spheres make up; all are free if the dump has no `mol`."""
        return group_spheres(np.zeros_like(self.ids) if self.bodies is None else self.bodies)


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
    `dump[i]`, `len(dump)` and `for frame in dump` work as for a list; `steps` are the time steps.
    """

    def __init__(self, path: str | PathLike[str], *, radius: float | None = None) -> None:
        """Read the headers of all frames of the file.

        Parameters
        ----------
        path : of the dump, plain text or compressed by gzip
        radius : of all spheres, length, where the dump has neither `radius` nor `diameter`

        Raises InputError for a radius that is not positive, and DumpError for a file that is not
        whole or lacks a column.
        """
        if radius is not None and not (radius > 0 and math.isfinite(radius)):
            raise InputError(f"a radius must be positive and finite, not {radius:g}")
        self.path = Path(path)
        self._headers = _scanned_headers(self.path)
        self._radius = radius
        self._layout = _layout(self._headers[0], self.path, radius)
        self.steps: tuple[int, ...] = tuple(header.step for header in self._headers)
        self._reader: DumpReader | None = None

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._headers)

    @property
    def spheres(self) -> int:
        """Number of spheres, the same in all frames."""
        return self._headers[0].rows

    def __iter__(self) -> Iterator[ParticleFrame]:
        """Read the frames one by one, never two at a time."""
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: int) -> ParticleFrame:
        """Read one frame; negative indices count from the end.

        Raises IndexError for a frame that is not there, and DumpError for a row that is wrong.
        """
        if not -len(self) <= index < len(self):
            raise IndexError(f"{self.path}: no frame {index}, there are {len(self)}")
        header, layout = self._headers[index], self._layout
        data = self._read(index % len(self))
        self._check(header, data)
        positions = _side_by_side(data, layout.positions)
        if layout.positions in SCALED:
            lower, upper = header.box.T
            positions = lower + positions * (upper - lower)
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
            box=header.box,
            boundaries=header.boundaries,
            contacts=data["contacts"].astype(np.int64) if "contacts" in data else None,
        )

    def _read(self, index: int) -> dict[str, FloatArray]:
        """Read one frame's columns, each (n,) and ordered by id."""
        columns = self._layout.columns
        try:
            if self._reader is None:
                # Additional columns are the only exact ones: MDAnalysis keeps positions as
                # float32 and shifts them to the box's origin. dt only silences its warning.
                self._reader = DumpReader(str(self.path), additional_columns=[*columns], dt=1.0)
            values = self._reader[index].data
        # An id of twenty digits makes an OverflowError.
        except (ValueError, IndexError, OverflowError) as error:
            self._reader = None
            mistake = self._malformed() or self._mistake(self._headers[index])
            raise mistake or DumpError(self.path, f"cannot be read: {error}") from None
        # These are copies, since MDAnalysis reads the next frame into the same arrays.
        return {name: np.array(values[name], dtype=np.float64) for name in columns}

    def _malformed(self) -> DumpError | None:
        """Find the first row that MDAnalysis cannot read; it does not tell which one it was."""
        line = 1
        with open_dump(self.path) as dump:
            while header := read_header(dump, self.path, line):
                rows = read_rows(dump, self.path, header)
                columns = self._layout.columns
                if error := malformed_row(rows, header, columns, self.path, whole=("id",)):
                    return error
                line = header.next_line
        return None

    def _check(self, header: FrameHeader, data: dict[str, FloatArray]) -> None:
        ids, size, whole = data["id"], self._layout.size, self._layout.whole
        fine = np.isfinite(np.column_stack(list(data.values()))).all(axis=1)
        fine &= (ids >= 1) & (ids < LARGEST_ID)
        if size is not None:
            fine &= data[size] > 0
        for name in whole:
            fine &= (data[name] >= 0) & (data[name] == np.rint(data[name]))
        if not fine.all() or (np.diff(ids) == 0).any():
            raise self._mistake(header) or DumpError(self.path, "changed while it was read")

    def _mistake(self, header: FrameHeader) -> DumpError | None:
        """Find the first row that is wrong, in the order of the file, which tells its line."""
        with open_dump(self.path) as dump:
            rows = list(islice(dump, header.first_row_line - 1, header.next_line - 1))
        columns = self._layout.columns
        place = [header.columns.index(name) for name in columns]
        before: set[int] = set()
        for line, row in enumerate(rows, start=header.first_row_line):
            fields = row.split()
            number = int(fields[place[0]])
            values = {
                name: float(fields[k]) for name, k in zip(columns[1:], place[1:], strict=True)
            }
            if not 1 <= number < LARGEST_ID or number in before:
                said = f"step {header.step}: ids must be positive and each there once"
                return DumpError(self.path, said, line)
            before.add(number)
            if said := self._said_of(values):
                return DumpError(self.path, f"step {header.step}, sphere {number}: {said}", line)
        return None

    def _said_of(self, values: dict[str, float]) -> str:
        """Say what is wrong with the values of a sphere; nothing if they are right."""
        for name, value in values.items():
            if not math.isfinite(value):
                return f"{name} is {value}"
        size = self._layout.size
        if size is not None and not values[size] > 0:
            return f"{size} is not positive"
        for name in self._layout.whole:
            if values[name] < 0 or values[name] != round(values[name]):
                return f"{name} must be {WHOLE_NUMBERS[name]}, not {values[name]:g}"
        return ""


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


def check_not_periodic(
    frame: ParticleFrame,
    path: str | PathLike[str] | None = None,
    lacking: str = "contacts and overlaps across its faces are not looked for yet",
) -> None:
    """See that the box of a frame has no periodic face: nothing here looks across one.

    Parameters
    ----------
    frame : frame of a particle dump
    path : of the dump, for the error; None where it is not known
    lacking : what would be wrong, for the error

    Raises DumpError for a box that is periodic along any axis, InputError without a path.
    """
    if not any("p" in flags for flags in frame.boundaries):
        return
    said = (
        f"the box is periodic ({' '.join(frame.boundaries)}), and {lacking}: "
        "all boundaries must be f, s or m"
    )
    if path is None:
        raise InputError(f"frame of step {frame.step}: {said}")
    raise DumpError(path, said)


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


def _scanned_headers(path: Path) -> list[FrameHeader]:
    """Read all headers; see that every frame is whole and has the same spheres and columns."""
    headers: list[FrameHeader] = []
    line = 1
    with open_dump(path) as dump:
        while header := read_header(dump, path, line):
            if header.rows == 0:
                raise DumpError(path, f"the frame of step {header.step} has no spheres", line + 3)
            first = headers[0] if headers else header
            if header.rows != first.rows:
                raise DumpError(
                    path,
                    f"{header.rows} spheres at step {header.step}, "
                    f"but {first.rows} at step {first.step}",
                    line + 3,
                )
            if header.columns != first.columns:
                raise DumpError(path, "the columns are not those of the first frame", line + 8)
            read_rows(dump, path, header)
            headers.append(header)
            line = header.next_line
    if not headers:
        raise DumpError(path, "the file is empty")
    return headers
