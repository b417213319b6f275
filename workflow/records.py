"""Contact problems that `fix inelastic ... record` has written, as the solver takes them."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Recorded:
    """A recorded contact problem of n spheres and m constraints, with indices in place of IDs.

    Attributes
    ----------
    arrays : arrays of the file by their names (docs/reference/record.md)
    first : indices of the first spheres, (m,)
    second : indices of the second ones, -1 for a wall, (m,)
    """

    arrays: Mapping[str, NDArray[np.float64]]
    first: NDArray[np.int64]
    second: NDArray[np.int64]

    @property
    def timestep(self) -> float:
        """Time step, time."""
        return float(self.arrays["timestep"])

    @property
    def tolerance(self) -> float:
        """Tolerance of the run, length."""
        return float(self.arrays["tolerance"])

    @property
    def spheres(self) -> list[Any]:
        """The arguments of `core.project` for the spheres as if all were free."""
        a = self.arrays
        return [
            a["predicted_velocity"],
            a["inverse_mass"],
            self.first,
            self.second,
            a["normal"],
            a["gap"],
        ]

    @property
    def contact_laws(self) -> dict[str, Any]:
        """The arguments of `core.project` for contacts that give way or may pull.

        Records of the inelastic law have no least impulses, and only those of version 0.2 have
        compliances, of contacts at rest.
        """
        names = ("compliance", "least_impulse")
        return {name: self.arrays[name] for name in names if name in self.arrays}

    @property
    def bodies(self) -> dict[str, Any]:
        """The arguments of `core.project` for the bodies; none in a scene of free spheres."""
        a = self.arrays
        if "molecule" not in a:
            return {}
        order = np.argsort(a["body_molecule"])
        place = np.searchsorted(a["body_molecule"][order], a["molecule"])
        xx, yy, zz, xy, xz, yz = a["body_inverse_inertia"][order].T
        rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        return {
            "body": np.where(a["molecule"] > 0, place, -1).astype(np.int64),
            "arm": a["arm"],
            "body_inverse_mass": a["body_inverse_mass"][order],
            "body_inverse_inertia": np.ascontiguousarray(np.moveaxis(np.array(rows), -1, 0)),
        }


def read_record(path: Path) -> Recorded:
    """Read one recorded problem. Raises ValueError, with the name of the file, if it is none."""
    try:
        with np.load(path) as file:
            arrays = dict(file)
        identifiers = arrays["id"]
        first = np.asarray(np.searchsorted(identifiers, arrays["id1"]))
        second = np.where(arrays["id2"] > 0, np.searchsorted(identifiers, arrays["id2"]), -1)
    except (OSError, ValueError, KeyError, EOFError, TypeError, BadZipFile, zlib.error) as error:
        raise ValueError(f"{path}: no recorded contact problem, or a damaged one") from error
    return Recorded(arrays, first.astype(np.int64), second.astype(np.int64))


def records(folder: Path) -> list[Path]:
    """Return the recorded problems of a folder in the order of their steps."""
    return sorted(folder.glob("problem.*.npz"), key=lambda path: int(path.name.split(".")[1]))
