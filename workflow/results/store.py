"""Results in HDF5: one small file a case, and one file a study that gathers them.

    /                     title, schema version
    /STUDY                one group a study: its title and the text of its file
    /STUDY/summary        one dataset a parameter and a number, one row a case: a table
    /STUDY/cases/CASE     datasets as in schema.py; the attributes say how the packing was made

Everything is written under another name and renamed when it is complete. After the end of the HDF5
file, where its readers do not look, comes a line with its check sum: a damaged file is known before
HDF5 reads it, which may take long over one, or take it for whole.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import WorkflowError
from ..files import whole
from ..study.case_name import name_in
from .schema import PICTURES, SCHEMA, VERSION

Array = NDArray[Any]

SEAL = b"\nlammps-inelastic sha256 %s\n"
SEAL_BYTES = len(SEAL % bytes(64))
CHUNK = 2**20


@dataclass(frozen=True, eq=False)
class Result:
    """The measurements of a case.

    Attributes
    ----------
    values : arrays by the names in SCHEMA
    pictures : PNG files by their names
    record : how the run was made, from `run_record.run_record`
    outputs : what was asked for, as JSON
    before : result of the packing before the last stage; None where there is one stage
    """

    values: Mapping[str, Array]
    pictures: Mapping[str, bytes]
    record: Mapping[str, Any]
    outputs: str
    before: Result | None = None

    @property
    def case(self) -> str:
        """The name of the case."""
        return name_in(self.record)

    @property
    def variables(self) -> dict[str, Any]:
        """The variables of all stages."""
        return {k: v for stage in self.record["stages"] for k, v in stage["variables"].items()}

    def number(self, name: str) -> float:
        """Return one of the numbers; NaN where it was not measured."""
        value = self.values.get(f"numbers/{name}")
        return math.nan if value is None else float(value)

    def setting(self, name: str, default: float = math.nan) -> float:
        """Return the value of a variable; the default where the deck has none, or a word."""
        value = self.variables.get(name)
        return float(value) if isinstance(value, int | float) else default


def write_result(path: Path, result: Result) -> None:
    """Write one case's file."""
    with _whole(path) as file:
        file.attrs["schema_version"] = VERSION
        _put(file, result)


def read_result(path: Path) -> Result:
    """Read one case's file.

    Raises WorkflowError if the file is no result, or damaged.
    """
    with _opened(path, "a result") as file:
        return _get(file)


def origin_of(path: Path) -> tuple[str, Mapping[str, Any]]:
    """Return a result's outputs and its record, as in `Result`.

    Raises WorkflowError if the file is no result, or damaged.
    """
    with _opened(path, "a result") as file:
        return str(file.attrs["outputs"]), json.loads(file.attrs["record"])


@dataclass(frozen=True, eq=False)
class StoredStudy:
    """A study in a file: its results in the order of its cases.

    Attributes
    ----------
    name, title, text : name, title and file of the study
    results : results that there are
    """

    name: str
    title: str
    text: str
    results: Sequence[Result]


def write_studies(path: Path, studies: Sequence[StoredStudy]) -> None:
    """Write one file that holds studies."""
    with _whole(path) as file:
        file.attrs["schema_version"] = VERSION
        for study in studies:
            group = file.create_group(study.name)
            group.attrs["title"] = study.title
            group.attrs["study"] = study.text
            cases = group.create_group("cases", track_order=True)
            for result in study.results:
                _put(cases.create_group(result.case), result)
            _summarise(group.create_group("summary", track_order=True), study.results)


def read_studies(path: Path) -> list[StoredStudy]:
    """Read a file that `write_studies` wrote.

    Raises WorkflowError if the file is none of these.
    """
    with _opened(path, "a file of studies") as file:
        return [
            StoredStudy(
                name,
                str(group.attrs["title"]),
                str(group.attrs["study"]),
                [_get(case) for case in group["cases"].values()],
            )
            for name, group in file.items()
        ]


def _put(group: h5py.Group, result: Result) -> None:
    group.attrs["record"] = json.dumps(result.record)
    group.attrs["outputs"] = result.outputs
    for name, value in result.values.items():
        entry = SCHEMA[name]
        array = np.asarray(value)
        dataset = group.create_dataset(
            name, data=array, **({} if array.ndim == 0 else {"compression": "gzip"})
        )
        dataset.attrs["unit"] = entry.unit
        dataset.attrs["meaning"] = entry.meaning
    for name, picture in result.pictures.items():
        dataset = group.create_dataset(
            f"{PICTURES}/{name}", data=np.frombuffer(picture, dtype=np.uint8)
        )
        dataset.attrs["meaning"] = "bytes of a PNG file"
    if result.before is not None:
        _put(group.create_group("before"), result.before)


def _get(group: h5py.Group) -> Result:
    return Result(
        values={name: group[name][()] for name in SCHEMA if name in group},
        pictures={
            name: bytes(picture[()].tobytes()) for name, picture in group.get(PICTURES, {}).items()
        },
        record=json.loads(group.attrs["record"]),
        outputs=str(group.attrs["outputs"]),
        before=_get(group["before"]) if "before" in group else None,
    )


def _summarise(group: h5py.Group, results: Sequence[Result]) -> None:
    """Write the parameters and the numbers as columns, a row for each case."""
    group.create_dataset("case", data=[result.case for result in results] or np.empty(0, "S1"))
    names = dict.fromkeys(name for result in results for name in result.variables)
    for name in names:
        column = [result.variables.get(name) for result in results]
        # The column of the names of cases is there already.
        name = _free(group, name, "variable")
        if any(isinstance(value, str) for value in column):
            group.create_dataset(name, data=["" if v is None else str(v) for v in column])
        else:
            group.create_dataset(
                name, data=np.array([np.nan if v is None else v for v in column], dtype=float)
            )
    for name, entry in SCHEMA.items():
        if not name.startswith("numbers/") or not any(name in r.values for r in results):
            continue
        # A parameter such as `particles` was asked for, and the number of the same name measured.
        short = name.removeprefix("numbers/")
        label = _free(group, short, "measured")
        dataset = group.create_dataset(label, data=[result.number(short) for result in results])
        dataset.attrs["unit"] = entry.unit
        dataset.attrs["meaning"] = entry.meaning


def _free(group: h5py.Group, name: str, ending: str) -> str:
    """Return a name that no column has yet: with an ending if need be, and with several."""
    while name in group:
        name = f"{name}_{ending}"
    return name


@contextmanager
def _opened(path: Path, what: str) -> Iterator[h5py.File]:
    """Open a file that `_whole` has written, and none that is damaged.

    Raises WorkflowError with one line that says what is wrong with it.
    """
    try:
        _check_seal(path)
        with h5py.File(path) as file:
            version = file.attrs.get("schema_version")
            if version != VERSION:
                raise WorkflowError(f"schema version {version}, but this program reads {VERSION}")
            yield file
    except WorkflowError as error:
        raise WorkflowError(f"{path}: not {what}: {error}") from None
    except OSError as error:
        reason = error.strerror or " ".join(str(error).split())
        raise WorkflowError(f"{path}: {reason[:1].lower()}{reason[1:]}") from None
    # A file that another program has sealed may lack anything.
    except (KeyError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        raise WorkflowError(f"{path}: not {what}: {' '.join(str(error).split())}") from None


def _check_seal(path: Path) -> None:
    """Raise WorkflowError if a file is not as it was written, and OSError if it cannot be read."""
    # A pipe would keep the program waiting.
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(handle, "rb") as file:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            raise WorkflowError("it is no regular file")
        left = status.st_size - SEAL_BYTES
        digest = hashlib.sha256()
        while left > 0 and (chunk := file.read(min(left, CHUNK))):
            digest.update(chunk)
            left -= len(chunk)
        seal = file.read()
    start, _, end = SEAL.partition(b"%s")
    if len(seal) != SEAL_BYTES or not (seal.startswith(start) and seal.endswith(end)):
        raise WorkflowError("it is cut off, or was written or changed by another program")
    if seal != SEAL % digest.hexdigest().encode():
        raise WorkflowError("it is damaged: its check sum is another one")


@contextmanager
def _whole(path: Path) -> Iterator[h5py.File]:
    """Open a file for writing that gets its name only when it is complete.

    HDF5 keeps it in memory: where a disk is full, the library prints a traceback for every object
    that is open, and crashes when the process ends.
    """
    # The newer layout has smaller headers, and there are many of them here.
    with h5py.File(
        path.name, "w", libver=("v110", "v110"), driver="core", backing_store=False
    ) as file:
        yield file
        file.flush()
        image = file.id.get_file_image()
    with whole(path) as temporary:
        temporary.write_bytes(image + SEAL % hashlib.sha256(image).hexdigest().encode())
