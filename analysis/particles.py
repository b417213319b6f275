"""Particle frames: LAMMPS's custom text dump, read through MDAnalysis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path

import numpy as np
from MDAnalysis.coordinates.LAMMPS import DumpReader

from .bodies import Particles, group_spheres
from .dump_text import (
    FrameHeader,
    malformed_row,
    open_dump,
    read_header,
    read_rows,
    require_columns,
)
from .errors import DumpError
from .geometry import FloatArray, IntArray

COLUMNS = ("id", "x", "y", "z", "vx", "vy", "vz", "radius")


@dataclass(frozen=True, eq=False)
class ParticleFrame:
    """The spheres at one step, ordered by id, and the particles that they make up.

    Attributes
    ----------
    step : time step
    ids : (n,), positive and each there once
    positions : (n, 3), length
    velocities : (n, 3), length / time
    radii : (n,), positive, length
    bodies : (n,), the dump's `mol`, 0 for a free sphere; None where the dump has no `mol`
    box : (3, 2), lower and upper bound per axis, length
    boundaries : two letters per axis (f fixed, p periodic, s or m shrink-wrapped), lower then upper
    """

    step: int
    ids: IntArray
    positions: FloatArray
    velocities: FloatArray
    radii: FloatArray
    bodies: IntArray | None
    box: FloatArray
    boundaries: tuple[str, str, str]

    @cached_property
    def particles(self) -> Particles:
        """Which spheres make up which particle; all are free where the dump has no `mol`."""
        return group_spheres(np.zeros_like(self.ids) if self.bodies is None else self.bodies)


class ParticleDump:
    """The frames of a particle dump: a sequence that reads a frame when it is asked for.

    The headers are read at once, so that an incomplete file is known before any frame is used.
    `dump[i]`, `len(dump)` and `for frame in dump` work as for a list; `steps` are the time steps.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        """Read the headers of all frames of the file."""
        self.path = Path(path)
        self._headers = _scanned_headers(self.path)
        self._columns = COLUMNS + (("mol",) if "mol" in self._headers[0].columns else ())
        self.steps: tuple[int, ...] = tuple(header.step for header in self._headers)
        self._reader: DumpReader | None = None

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._headers)

    def __iter__(self) -> Iterator[ParticleFrame]:
        """Read the frames one by one, never two at a time."""
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: int) -> ParticleFrame:
        """Read one frame; negative indices count from the end."""
        if not -len(self) <= index < len(self):
            raise IndexError(f"{self.path}: no frame {index}, there are {len(self)}")
        header = self._headers[index]
        data = self._read(index % len(self))
        self._check(header.step, data)
        return ParticleFrame(
            step=header.step,
            ids=data[:, 0].astype(np.int64),
            positions=data[:, 1:4].copy(),
            velocities=data[:, 4:7].copy(),
            radii=data[:, 7].copy(),
            bodies=data[:, 8].astype(np.int64) if "mol" in self._columns else None,
            box=header.box,
            boundaries=header.boundaries,
        )

    def _read(self, index: int) -> FloatArray:
        """Read one frame's columns, (n, columns), ordered by id."""
        try:
            if self._reader is None:
                # Additional columns are the only exact ones: MDAnalysis keeps positions as
                # float32 and shifts them to the box's origin. dt only silences its warning.
                self._reader = DumpReader(
                    str(self.path), additional_columns=list(self._columns), dt=1.0
                )
            values = self._reader[index].data
        except (ValueError, IndexError) as error:
            self._reader = None
            raise self._malformed() or DumpError(self.path, f"cannot be read: {error}") from None
        return np.column_stack([values[name] for name in self._columns])

    def _malformed(self) -> DumpError | None:
        """Find the first row that MDAnalysis cannot read; it does not tell which one it was."""
        line = 1
        with open_dump(self.path) as dump:
            while header := read_header(dump, self.path, line):
                rows = read_rows(dump, self.path, header)
                if error := malformed_row(rows, header, self._columns, self.path):
                    return error
                line = header.next_line
        return None

    def _check(self, step: int, data: FloatArray) -> None:
        ids, radii = data[:, 0], data[:, 7]
        finite = np.isfinite(data)
        if not finite.all():
            row, column = np.argwhere(~finite)[0]
            raise DumpError(
                self.path,
                f"step {step}, sphere {ids[row]:.0f}: "
                f"{self._columns[column]} is {data[row, column]}",
            )
        if ids[0] < 1 or (np.diff(ids) == 0).any():
            raise DumpError(self.path, f"step {step}: ids must be positive and each there once")
        if (radii <= 0).any():
            first = np.argmax(radii <= 0)
            raise DumpError(
                self.path, f"step {step}, sphere {ids[first]:.0f}: radius is not positive"
            )
        if "mol" in self._columns:
            bodies = data[:, 8]
            wrong = (bodies < 0) | (bodies != np.rint(bodies))
            if wrong.any():
                first = np.argmax(wrong)
                raise DumpError(
                    self.path,
                    f"step {step}, sphere {ids[first]:.0f}: mol must be a body's number or 0, "
                    f"not {bodies[first]:g}",
                )


def read_particle_frame(path: str | PathLike[str], index: int = -1) -> ParticleFrame:
    """Read one frame of a particle dump, by default the last."""
    return ParticleDump(path)[index]


def _scanned_headers(path: Path) -> list[FrameHeader]:
    """Read all headers; see that every frame is whole and has the same spheres and columns."""
    headers: list[FrameHeader] = []
    line = 1
    with open_dump(path) as dump:
        while header := read_header(dump, path, line):
            require_columns(header, COLUMNS, path)
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
