"""What the files for other programs have in common: names, columns, and that they are whole.

Lengths and forces are those of the dump. A file gets its name when it is whole: until then, and if
writing fails, an older one stays as it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ExportError, InputError
from .files import reason_of, unfinished
from .geometry import IntArray, as_integers


def named(path: str | PathLike[str], endings: Sequence[str]) -> Path:
    """Return a path whose name has one of some endings: programs choose their reader by it.

    Raises InputError for another ending.
    """
    target = Path(path)
    if target.suffix.lower() not in endings:
        raise InputError(f"{target}: the name must end in {' or '.join(endings)}")
    return target


@contextmanager
def whole_file(target: Path) -> Iterator[Path]:
    """Give a file as `unfinished` does; raise ExportError if it cannot be written."""
    try:
        with unfinished(target) as file:
            yield file
    except OSError as error:
        raise ExportError(f"{target}: cannot be written: {reason_of(error)}") from None


def given(count: int, **columns: ArrayLike | None) -> dict[str, IntArray]:
    """Return the columns that are not None as integers, one per sphere, by their names.

    Raises InputError for a column of another length, or of numbers that are not whole.
    """
    arrays: dict[str, IntArray] = {}
    for name, values in columns.items():
        if values is not None:
            arrays[name] = as_integers(values, name)
            if arrays[name].shape != (count,):
                raise InputError(f"{name} must have shape ({count},), not {arrays[name].shape}")
    return arrays


def numbers(values: ArrayLike) -> str:
    """Return numbers with all digits, separated by blanks."""
    return " ".join(f"{value!r}" for value in np.asarray(values, dtype=np.float64).tolist())


def write_table(target: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """Write columns as CSV with all digits, under one line of their names.

    Raises ExportError if writing fails.
    """
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    with whole_file(target) as file, file.open("w", encoding="utf-8") as table:
        table.write(",".join(columns) + "\n")
        table.writelines(",".join(map(repr, row)) + "\n" for row in rows)
