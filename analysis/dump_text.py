"""The frame layout that LAMMPS's text dumps `custom` and `local` share.

A frame is a header and then one line per row::

    ITEM: UNITS                                                  (with `units yes`, first frame)
    <style>
    ITEM: TIME                                                   (with `time yes`)
    <time>
    ITEM: TIMESTEP
    <step>
    ITEM: NUMBER OF <LABEL>
    <rows>
    ITEM: BOX BOUNDS <two flags per axis, such as ff ff ff>
    <lower> <upper>                                              (three lines)
    ITEM: <LABEL> <column names>

LABEL is ATOMS in a dump custom and ENTRIES in a dump local, where `dump_modify label` may
change it. Before 2011 LAMMPS wrote no flags. A box that may be tilted has `xy xz yz` before the
flags and lines `<lower> <upper> <tilt>`, whose bounds enclose the tilted box, or `abc origin` and
lines of an edge's three components and a component of the origin.
"""

from __future__ import annotations

import gzip
import re
import sys
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import BufferedIOBase
from itertools import islice
from pathlib import Path

import numpy as np

from .cell import Cell
from .errors import CutOffError, DumpError, printable, shortened
from .files import reason_of, regular
from .geometry import FloatArray

# Rows of a dump custom have this label.
PARTICLES = "ATOMS"
GZIP_MAGIC = b"\x1f\x8b"
# Ids are read as float64, which holds every whole number up to here.
LARGEST_ID = 2**53
# LAMMPS counts steps and rows in 64 bits.
MOST_COUNTED = 2**63
_WHOLE = re.compile(r"[+-]?[0-9]+")


@dataclass(frozen=True, eq=False)
class FrameHeader:
    """The header of one frame, the lines above its rows.

    Attributes
    ----------
    step : time step
    label : what a row is: ATOMS in a dump custom
    rows : number of rows announced
    cell : the simulation box, in three dimensions; nothing is periodic where the header does not
        say it
    boundaries : two letters per axis (f fixed, p periodic, s or m shrink-wrapped), lower then
        upper; None where the header does not say
    columns : names of the columns
    first_row_line : number of the line that holds the first row, counted from 1
    """

    step: int
    label: str
    rows: int
    cell: Cell
    boundaries: tuple[str, str, str] | None
    columns: tuple[str, ...]
    first_row_line: int

    @property
    def next_line(self) -> int:
        """Number of the first line after the frame."""
        return self.first_row_line + self.rows


@contextmanager
def open_dump(path: Path) -> Iterator[BufferedIOBase]:
    """Open a dump for reading, also one that gzip has compressed, whatever its name ends in.

    Raises DumpError for a file that is not there or cannot be read, and for what is no file: a
    folder, a pipe, a device; CutOffError where a compressed file has lost its end.
    """
    try:
        with open(path, "rb", opener=regular) as raw:
            compressed = raw.read(len(GZIP_MAGIC)) == GZIP_MAGIC
            raw.seek(0)
            if compressed:
                with gzip.open(raw) as text:
                    yield text
            else:
                yield raw
    except FileNotFoundError:
        raise DumpError(path, "no such file") from None
    except EOFError as error:
        raise CutOffError(path, f"cannot be unpacked: {error}") from None
    except (zlib.error, gzip.BadGzipFile) as error:
        raise DumpError(path, f"cannot be unpacked: {error}") from None
    except OSError as error:
        raise DumpError(path, f"cannot be read: {reason_of(error)}") from None


def read_header(dump: Iterator[bytes], path: Path, line: int) -> FrameHeader | None:
    """Read the header that starts at the given line number; None at the end of the file.

    Raises DumpError for a header that is not LAMMPS's, and CutOffError for one that is not whole.
    """
    lines = _Lines(dump, path, line)
    if not lines.skip_empty():
        return None
    lines.skip("ITEM: UNITS", "ITEM: TIME")
    if lines.text != "ITEM: TIMESTEP":
        why = "it is no text dump custom or local of LAMMPS"
        if line > 1:
            why = "the frame before has more or fewer rows than it announces"
        raise lines.expected("'ITEM: TIMESTEP'", f" ({why})")
    lines.advance()
    step = lines.integer()
    lines.advance()
    lines.skip("ITEM: UNITS", "ITEM: TIME")
    if not lines.text.startswith("ITEM: NUMBER OF "):
        raise lines.expected("'ITEM: NUMBER OF'")
    label = lines.text.removeprefix("ITEM: NUMBER OF ")
    lines.advance()
    rows = lines.integer()
    if rows < 0:
        raise DumpError(path, f"{rows} rows announced", lines.number)
    lines.advance()
    cell, boundaries = _parsed_box(lines)
    lines.advance()
    if lines.text.split()[:2] != ["ITEM:", label]:
        raise lines.expected(f"'ITEM: {shortened(label)}'")
    return FrameHeader(
        step=step,
        label=label,
        rows=rows,
        cell=cell,
        boundaries=boundaries,
        columns=tuple(lines.text.split()[2:]),
        first_row_line=lines.number + 1,
    )


class _Lines:
    """The lines of a header one by one: `text` is that of the line with the number `number`."""

    def __init__(self, dump: Iterator[bytes], path: Path, line: int) -> None:
        self.path = path
        self.number = line
        self.text = ""
        self._dump = dump

    def skip_empty(self) -> bool:
        """Go to the first line that is not empty; say whether there is one."""
        self.number -= 1
        while raw := next(self._dump, b""):
            self._take(raw)
            if self.text:
                return True
        return False

    def advance(self) -> None:
        """Go to the next line."""
        raw = next(self._dump, b"")
        if not raw:
            raise self._cut_off()
        self._take(raw)

    def skip(self, *items: str) -> None:
        """Go past items of one line each, which are not needed."""
        while self.text in items:
            self.advance()
            if self.text.startswith("ITEM:"):
                raise self.expected("a value")
            self.advance()

    def integer(self) -> int:
        """Return the whole number that the line holds."""
        if not _WHOLE.fullmatch(self.text):
            raise self.expected("an integer")
        # Python reads no numbers of thousands of digits.
        if len(self.text) > 20 or abs(int(self.text)) >= MOST_COUNTED:
            raise self.expected("an integer below 2^63")
        return int(self.text)

    def numbers(self, count: int, what: str) -> list[float]:
        """Return the finite numbers that the line holds."""
        try:
            values = [float(field) for field in self.text.split()]
        except ValueError:
            values = []
        if len(values) != count or not np.isfinite(values).all():
            raise self.expected(what)
        return values

    def expected(self, what: str, why: str = "") -> DumpError:
        """Make the error that says what should be in the line."""
        return DumpError(
            self.path, f"expected {what}, found '{shortened(self.text)}'{why}", self.number
        )

    def _take(self, raw: bytes) -> None:
        self.number += 1
        # A last line without its end of line may have lost digits.
        if not raw.endswith(b"\n"):
            raise self._cut_off()
        self.text = raw.decode("ascii", errors="replace").strip()

    def _cut_off(self) -> DumpError:
        return CutOffError(self.path, "the file ends inside this frame's header", self.number)


def _parsed_box(lines: _Lines) -> tuple[Cell, tuple[str, str, str] | None]:
    """Read the box and its boundaries from the line of its item to its last line."""
    item, number = lines.text, lines.number
    if not item.startswith("ITEM: BOX BOUNDS"):
        raise lines.expected("'ITEM: BOX BOUNDS'")
    words = item.removeprefix("ITEM: BOX BOUNDS").split()
    general, tilted = words[:2] == ["abc", "origin"], {"xy", "xz", "yz"} <= {*words}
    # Some programs write the names of the tilts last.
    flags = [word for word in words[2 if general else 0 :] if word not in ("xy", "xz", "yz")]
    if len(flags) not in (0, 3):
        raise lines.expected("two letters for each axis of the box, or none")
    origin, vectors = np.zeros(3), np.zeros((3, 3))
    bounds, tilts = np.zeros((3, 2)), np.zeros(3)
    for axis in range(3):
        lines.advance()
        if general:
            *vectors[axis], origin[axis] = lines.numbers(
                4, "an edge of the box and a component of its origin"
            )
        elif tilted:
            *bounds[axis], tilts[axis] = lines.numbers(3, "two bounds and a tilt")
        else:
            bounds[axis] = lines.numbers(2, "two bounds")
        lower, upper = bounds[axis].tolist()
        if not general and not lower < upper:
            raise DumpError(
                lines.path, f"box bounds {lower:g} {upper:g} are not in order", lines.number
            )
    boundaries = (flags[0], flags[1], flags[2]) if flags else None
    periodic = ["p" in letters for letters in boundaries or ("", "", "")]
    if not general and not tilts.any():
        return Cell.of_box(bounds, periodic), boundaries
    if not general:
        origin, vectors = _tilted_box(bounds, *tilts.tolist())
    if not np.linalg.det(vectors) > 0:
        raise DumpError(lines.path, "the box has no volume, or its edges are left-handed", number)
    return Cell(origin, vectors, periodic), boundaries


def _tilted_box(
    bounds: FloatArray, xy: float, xz: float, yz: float
) -> tuple[FloatArray, FloatArray]:
    """Return origin and edges of a box whose tilts its bounds, (3, 2), enclose.

    The formula is that of LAMMPS's manual, section Triclinic boxes.
    """
    (xlo, xhi), (ylo, yhi), (zlo, zhi) = bounds.tolist()
    xlo, xhi = xlo - min(0.0, xy, xz, xy + xz), xhi - max(0.0, xy, xz, xy + xz)
    ylo, yhi = ylo - min(0.0, yz), yhi - max(0.0, yz)
    vectors = np.array([[xhi - xlo, 0, 0], [xy, yhi - ylo, 0], [xz, yz, zhi - zlo]])
    return np.array([xlo, ylo, zlo]), vectors


def read_rows(dump: Iterator[bytes], path: Path, header: FrameHeader) -> list[bytes]:
    """Read the lines of one frame's rows, unparsed; raise CutOffError if some are missing."""
    # A file that announces more rows than a computer can count has fewer.
    rows = list(islice(dump, min(header.rows, sys.maxsize)))
    # A last line without its end of line may have lost digits: it counts as missing.
    complete = len(rows) if not rows or rows[-1].endswith(b"\n") else len(rows) - 1
    if complete < header.rows:
        raise CutOffError(
            path,
            f"the file ends inside the frame of step {header.step}: "
            f"{complete} of {header.rows} rows",
            header.first_row_line + complete,
        )
    return rows


def require_columns(header: FrameHeader, needed: Sequence[str], path: Path) -> None:
    """Raise DumpError with the columns that are missing, and those that are there."""
    missing = [name for name in needed if name not in header.columns]
    if missing:
        raise missing_columns(header, path, ", ".join(missing))
    twice = [name for name in needed if header.columns.count(name) > 1]
    if twice:
        raise DumpError(
            path, f"more than one column is called {twice[0]}", header.first_row_line - 1
        )


def missing_columns(header: FrameHeader, path: Path, names: str) -> DumpError:
    """Make the error that says which columns are missing and which are there."""
    line = header.first_row_line - 1
    if not header.columns:
        said = (
            f"the columns have no names, as LAMMPS wrote none before 2010: write them after "
            f"'ITEM: {shortened(header.label)}', for every frame"
        )
        return DumpError(path, said, line)
    there = printable(" ".join(header.columns))
    return DumpError(path, f"no column {names}; there is {there}", line)


def parsed_rows(
    rows: Sequence[bytes],
    header: FrameHeader,
    needed: Sequence[str],
    path: Path,
    whole: Sequence[str] = (),
) -> FloatArray:
    """Parse some columns of a frame's rows; the others may hold words.

    Parameters
    ----------
    rows : lines of the rows, at least as many as the header announces
    header : header of the frame, which has the columns
    needed : names of the columns
    path : of the dump, for errors
    whole : those of the columns that must hold whole numbers

    Returns
    -------
    (rows, columns needed)

    Raises DumpError with the first line that has more or fewer values, or no number.
    """
    # What is no ASCII becomes a letter that no number has.
    lines = [row.decode("ascii", errors="replace") for row in rows]
    places = [header.columns.index(name) for name in needed]
    integers = [header.columns.index(name) for name in whole]
    expected = len(header.columns)
    fine = True
    for line in lines:
        fields = line.split()
        fine = len(fields) == expected and all(_WHOLE.fullmatch(fields[k]) for k in integers)
        if not fine:
            break
    if not lines:
        return np.empty((0, len(places)))
    try:
        if fine:
            return np.loadtxt(lines, comments=None, usecols=places, ndmin=2)
    except ValueError:
        pass
    raise _malformed_row(lines, header, needed, path, whole)


def _malformed_row(
    lines: Sequence[str],
    header: FrameHeader,
    needed: Sequence[str],
    path: Path,
    whole: Sequence[str],
) -> DumpError:
    """Name the first row that does not hold numbers, where a parser only said that there is one."""
    expected = len(header.columns)
    for number, line in enumerate(lines, start=header.first_row_line):
        fields = line.split()
        if len(fields) != expected:
            return DumpError(path, f"expected {expected} values, found {len(fields)}", number)
        for name in needed:
            value = fields[header.columns.index(name)]
            kind = "whole number" if name in whole else "number"
            if not (_WHOLE.fullmatch(value) if name in whole else _is_number(value)):
                return DumpError(path, f"{name} = '{shortened(value)}' is no {kind}", number)
    return DumpError(path, "every column must hold numbers", header.first_row_line)


def _is_number(text: str) -> bool:
    """Say whether a text is a number as LAMMPS writes it; Python would allow underscores."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text
