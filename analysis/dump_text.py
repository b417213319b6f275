"""The frame layout that LAMMPS's text dumps `custom` and `local` share.

A frame is nine header lines and then one line per row::

    ITEM: TIMESTEP
    <step>
    ITEM: NUMBER OF <LABEL>
    <rows>
    ITEM: BOX BOUNDS <two flags per axis, such as ff ff ff>
    <lower> <upper>                                              (three lines)
    ITEM: <LABEL> <column names>

LABEL is ATOMS in a dump custom and ENTRIES in a dump local, where `dump_modify label` may
change it.
"""

from __future__ import annotations

import gzip
import sys
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from .errors import DumpError, printable, shortened
from .files import reason_of, regular
from .geometry import FloatArray

HEADER_LINES = 9
GZIP_MAGIC = b"\x1f\x8b"
# Ids are read as float64, which holds every whole number up to here.
LARGEST_ID = 2**53


@dataclass(frozen=True, eq=False)
class FrameHeader:
    """The header of one frame, the lines above its rows.

    Attributes
    ----------
    step : time step
    rows : number of rows announced
    box : (3, 2), lower and upper bound per axis, length
    boundaries : two letters per axis (f fixed, p periodic, s or m shrink-wrapped), lower then upper
    columns : names of the columns
    first_row_line : number of the line that holds the first row, counted from 1
    """

    step: int
    rows: int
    box: FloatArray
    boundaries: tuple[str, str, str]
    columns: tuple[str, ...]
    first_row_line: int

    @property
    def next_line(self) -> int:
        """Number of the first line after the frame."""
        return self.first_row_line + self.rows


@contextmanager
def open_dump(path: Path) -> Iterator[Iterator[bytes]]:
    """Open a dump for reading, also one that gzip has compressed, whatever its name ends in.

    Raises DumpError for a file that is not there or cannot be read, and for what is no file: a
    folder, a pipe, a device.
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
    # These are raised for a compressed file that was cut off or damaged.
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise DumpError(path, f"cannot be unpacked: {error}") from None
    except OSError as error:
        raise DumpError(path, f"cannot be read: {reason_of(error)}") from None


def read_header(dump: Iterator[bytes], path: Path, line: int) -> FrameHeader | None:
    """Read the header that starts at the given line number; None at the end of the file.

    Raises DumpError for a header that is not LAMMPS's or not whole.
    """
    raw = list(islice(dump, HEADER_LINES))
    if not raw:
        return None
    text = [item.decode("ascii", errors="replace").strip() for item in raw]
    if text[0] != "ITEM: TIMESTEP":
        raise DumpError(
            path,
            f"expected 'ITEM: TIMESTEP', found '{shortened(text[0])}' (the frame before has "
            "more or fewer rows than it announces, or the dump has 'units yes' or 'time yes')",
            line,
        )
    if len(raw) < HEADER_LINES or not raw[-1].endswith(b"\n"):
        raise DumpError(path, "the file ends inside this frame's header", line + len(raw) - 1)

    step = _parsed_integer(text[1], path, line + 1)
    if not text[2].startswith("ITEM: NUMBER OF "):
        raise DumpError(path, f"expected 'ITEM: NUMBER OF', found '{shortened(text[2])}'", line + 2)
    label = text[2].removeprefix("ITEM: NUMBER OF ")
    rows = _parsed_integer(text[3], path, line + 3)
    if rows < 0:
        raise DumpError(path, f"{rows} rows announced", line + 3)

    flags = text[4].removeprefix("ITEM: BOX BOUNDS").split()
    if not text[4].startswith("ITEM: BOX BOUNDS") or len(flags) != 3:
        raise DumpError(path, f"expected an orthogonal box, found '{shortened(text[4])}'", line + 4)
    box = np.array([_parsed_bounds(text[5 + axis], path, line + 5 + axis) for axis in range(3)])

    if text[8].split()[:2] != ["ITEM:", label]:
        raise DumpError(path, f"expected 'ITEM: {label}', found '{shortened(text[8])}'", line + 8)
    return FrameHeader(
        step=step,
        rows=rows,
        box=box,
        boundaries=(flags[0], flags[1], flags[2]),
        columns=tuple(text[8].split()[2:]),
        first_row_line=line + HEADER_LINES,
    )


def read_rows(dump: Iterator[bytes], path: Path, header: FrameHeader) -> list[bytes]:
    """Read the lines of one frame's rows, unparsed; raise DumpError if some are missing."""
    # A file that announces more rows than a computer can count has fewer.
    rows = list(islice(dump, min(header.rows, sys.maxsize)))
    # A last line without its end of line may have lost digits: it counts as missing.
    complete = len(rows) if not rows or rows[-1].endswith(b"\n") else len(rows) - 1
    if complete < header.rows:
        raise DumpError(
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
    there = printable(" ".join(header.columns)) or "none"
    return DumpError(path, f"no column {names}; there is {there}", header.first_row_line - 1)


def malformed_row(
    rows: Sequence[bytes],
    header: FrameHeader,
    needed: Sequence[str],
    path: Path,
    whole: Sequence[str] = (),
) -> DumpError | None:
    """Name the first row that does not hold numbers, where a parser only said that there is one.

    The columns `whole`, some of those `needed`, must hold whole numbers.
    """
    expected = len(header.columns)
    for number, row in enumerate(rows, start=header.first_row_line):
        fields = row.decode("ascii", errors="replace").split()
        if len(fields) != expected:
            return DumpError(path, f"expected {expected} values, found {len(fields)}", number)
        for name in needed:
            value = fields[header.columns.index(name)]
            try:
                int(value) if name in whole else float(value)
            except ValueError:
                kind = "whole number" if name in whole else "number"
                return DumpError(path, f"{name} = '{shortened(value)}' is no {kind}", number)
    return None


def _parsed_integer(text: str, path: Path, line: int) -> int:
    try:
        return int(text)
    except ValueError:
        raise DumpError(path, f"expected an integer, found '{shortened(text)}'", line) from None


def _parsed_bounds(text: str, path: Path, line: int) -> tuple[float, float]:
    try:
        lower, upper = (float(field) for field in text.split())
    except ValueError:
        raise DumpError(path, f"expected two bounds, found '{shortened(text)}'", line) from None
    if not (np.isfinite(lower) and np.isfinite(upper) and lower < upper):
        raise DumpError(path, f"box bounds {lower:g} {upper:g} are not in order", line)
    return lower, upper
