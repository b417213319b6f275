"""Contact problems that ``fix inelastic ... record`` has written (docs/reference/record.md)."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.core.problem import FREE, WALL, Bodies, Indices, Problem


@dataclass(frozen=True, eq=False)
class Record:
    """A recorded step: its contact problem, and what the fix made of it.

    Attributes
    ----------
    arrays : arrays of the file by their names (docs/reference/record.md)
    problem : the contact problem, with indices in place of IDs, and bodies in the order of theirs

    Raises KeyError if an array of the problem is missing, ValueError if one is wrong.
    """

    arrays: Mapping[str, NDArray[Any]]
    problem: Problem = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "problem", _problem_of(self.arrays))

    @property
    def step(self) -> int:
        """Number of the time step."""
        return int(self.arrays["step"])

    @property
    def tolerance(self) -> float:
        """Tolerance of the run, length."""
        return float(self.arrays["tolerance"])


def read_record(path: Path | str) -> Record:
    """Read one recorded problem. Raises ValueError, with the name of the file, if it is none."""
    try:
        with np.load(path) as file:
            arrays = dict(file)
        arrays["id"]
    except (OSError, ValueError, KeyError, EOFError, TypeError, BadZipFile, zlib.error) as error:
        raise ValueError(f"{path}: no recorded contact problem, or a damaged one") from error
    try:
        return Record(arrays)
    except KeyError as error:
        raise ValueError(f"{path}: the array {error} of a recorded problem is missing") from error
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _problem_of(arrays: Mapping[str, NDArray[Any]]) -> Problem:
    pairs = arrays["id2"] > 0
    second = np.full(arrays["id2"].shape, WALL)
    second[pairs] = _places("id2", arrays["id"], arrays["id2"][pairs])
    return Problem(
        timestep=float(arrays["timestep"]),
        predicted_velocity=arrays["predicted_velocity"],
        inverse_mass=arrays["inverse_mass"],
        first=_places("id1", arrays["id"], arrays["id1"]),
        second=second,
        normal=arrays["normal"],
        gap=arrays["gap"],
        impulse_guess=arrays["impulse_guess"],
        # Records of the inelastic law have none, and only those of version 0.2 have compliances,
        # of contacts at rest.
        least_impulse=arrays.get("least_impulse", np.array(0.0)),
        compliance=arrays.get("compliance", np.array(0.0)),
        bodies=_bodies_of(arrays) if "molecule" in arrays else None,
    )


def _bodies_of(arrays: Mapping[str, NDArray[Any]]) -> Bodies:
    order = np.argsort(arrays["body_molecule"])
    molecule = arrays["molecule"]
    inside = molecule > 0
    body = np.full(molecule.shape, FREE)
    body[inside] = _places("molecule", arrays["body_molecule"][order], molecule[inside])
    xx, yy, zz, xy, xz, yz = arrays["body_inverse_inertia"][order].T
    rows = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Bodies(
        body,
        arrays["arm"],
        arrays["body_inverse_mass"][order],
        np.moveaxis(rows, -1, 0),
    )


def _places(name: str, sorted_ids: NDArray[Any], wanted: NDArray[Any]) -> Indices:
    """Return where IDs are among others. Raises ValueError if one is not there."""
    places = np.searchsorted(sorted_ids, wanted)
    there = np.append(sorted_ids, 0)[places] == wanted
    if not np.all(there):
        raise ValueError(f"{name} has the ID {wanted[~there][0]}, which is nowhere else")
    return places
