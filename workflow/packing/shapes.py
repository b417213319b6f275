"""The particles that `pack` packs: spheres, or rigid bodies of spheres of one size."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from lammps_inelastic.analysis import Spheres, dimer_volume, packing_fraction
from lammps_inelastic.analysis.geometry import FloatArray

from ..decks import Value
from ..errors import PackingError
from .checked import as_number, shown

# Half the edge of the cube in which the tetrahedron of clusters.in stands: its edges are 0.7
# diameters long. These are the digits that the deck writes.
_HALF = 0.247487373415292
TETRAHEDRON = (
    (_HALF, _HALF, _HALF),
    (_HALF, -_HALF, -_HALF),
    (-_HALF, _HALF, -_HALF),
    (-_HALF, -_HALF, _HALF),
)
# Two spheres of a cluster are at least so far apart [diameters].
APART = 1e-6


@dataclass(frozen=True)
class Sphere:
    """A sphere."""

    @property
    def points(self) -> FloatArray:
        """The centres of a particle's spheres, (k, 3), diameters."""
        return np.zeros((1, 3))

    @property
    def room(self) -> float:
        """Width that a particle needs to be placed in any direction, diameters."""
        return 1.0

    @property
    def volume(self) -> float:
        """Volume of a particle, diameters^3."""
        return math.pi / 6

    @property
    def settings(self) -> dict[str, Value]:
        """The parameters of the deck that are those of this shape, beside its size."""
        return {"particle": "sphere"}

    @property
    def plural(self) -> str:
        """What many of them are called."""
        return "spheres"


@dataclass(frozen=True)
class Dimer:
    """A rigid body of two spheres, which may overlap.

    Attributes
    ----------
    aspect_ratio : its length over the diameter of a sphere, above 1 and at most 2
    """

    aspect_ratio: float

    def __post_init__(self) -> None:
        """Raise PackingError for an aspect ratio that no dimer has."""
        allowed = "above 1 and at most 2"
        number = as_number(self.aspect_ratio, "the aspect ratio of a dimer", 1.0, 2.0, allowed)
        if number == 1:
            raise PackingError("the aspect ratio of a dimer must be above 1: 1 is that of Sphere()")
        object.__setattr__(self, "aspect_ratio", number)

    @property
    def points(self) -> FloatArray:
        """The centres of a particle's spheres, (k, 3), diameters."""
        arm = (self.aspect_ratio - 1) / 2
        return np.array([[-arm, 0.0, 0.0], [arm, 0.0, 0.0]])

    @property
    def room(self) -> float:
        """Width that a particle needs to be placed in any direction, diameters."""
        return self.aspect_ratio

    @property
    def volume(self) -> float:
        """Volume of a particle, diameters^3."""
        return dimer_volume(0.5, self.aspect_ratio - 1)

    @property
    def settings(self) -> dict[str, Value]:
        """The parameters of the deck that are those of this shape, as in dimers.in."""
        return {
            "particle": "dimer",
            "aspect_ratio": self.aspect_ratio,
            "inertia": "point",
            "tolerance_measuring": 2e-5,
            "steps_agitated": 280,
            "steps_settling": 80,
            "steps_resting": 40,
            "steps_tightening": 12,
            "random_force": 141.0,
        }

    @property
    def plural(self) -> str:
        """What many of them are called."""
        return f"dimers of aspect ratio {self.aspect_ratio:g}"


@dataclass(frozen=True)
class Cluster:
    """A rigid body of several spheres of one size, which may overlap.

    Attributes
    ----------
    centres : (k, 3), centres of its spheres, in diameters of a sphere, about any origin; without,
        a tetrahedron with edges of 0.7 diameters
    """

    centres: ArrayLike = TETRAHEDRON

    def __post_init__(self) -> None:
        """Raise PackingError for centres of no shape."""
        try:
            points = np.array(self.centres, dtype=np.float64)
        except (TypeError, ValueError):
            points = np.zeros(0)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2:
            raise PackingError(
                "the centres of a cluster must be two or more points x, y, z, in diameters, not "
                + shown(self.centres)
            )
        if not (np.abs(points) < 1e3).all():
            raise PackingError("the centres of a cluster must be finite, and below 1000 diameters")
        if scipy.spatial.distance.pdist(points).min() < APART:
            raise PackingError("two spheres of a cluster must not have the same centre")
        object.__setattr__(self, "centres", tuple(map(tuple, points.tolist())))

    @cached_property
    def points(self) -> FloatArray:
        """The centres of a particle's spheres, (k, 3), about their mean, diameters."""
        points = np.array(self.centres, dtype=np.float64)
        return np.asarray(points - points.mean(axis=0))

    @cached_property
    def extent(self) -> float:
        """The largest distance between two centres, without its round-off, diameters."""
        return round(float(scipy.spatial.distance.pdist(self.points).max()), 12)

    @property
    def room(self) -> float:
        """Width that a particle needs to be placed in any direction, diameters."""
        return 1 + 2 * self.extent

    @cached_property
    def volume(self) -> float:
        """Volume of a particle, diameters^3, by random points."""
        box = np.column_stack([self.points.min(axis=0) - 0.5, self.points.max(axis=0) + 0.5])
        share = packing_fraction(Spheres(self.points, np.full(len(self.points), 0.5)), box).value
        return share * float(np.prod(box[:, 1] - box[:, 0]))

    @property
    def settings(self) -> dict[str, Value]:
        """The parameters of the deck that are those of this shape, as in clusters.in."""
        return {
            "particle": "cluster",
            "extent": self.extent,
            "inertia": "solid",
            "tolerance_measuring": 2e-5,
            "steps_agitated": 280,
            "steps_settling": 80,
            "steps_resting": 40,
            "steps_tightening": 12,
            "random_force": 141.0,
        }

    @property
    def plural(self) -> str:
        """What many of them are called."""
        return f"clusters of {len(self.points)} spheres"

    @property
    def molecule(self) -> str:
        """The text of LAMMPS's molecule file, lengths in diameters."""
        rows = np.array(self.centres, dtype=np.float64).tolist()
        return "\n".join(
            [
                "# A cluster; lengths in diameters",
                f"{len(rows)} atoms",
                "Coords  # id x y z",
                "#",
                *(f"{number} {x!r} {y!r} {z!r}" for number, (x, y, z) in enumerate(rows, 1)),
                "Types  # id type",
                "#",
                *(f"{number} 1" for number in range(1, len(rows) + 1)),
                "",
            ]
        )


Shape = Sphere | Dimer | Cluster


def volume_of(shape: Shape, diameters: FloatArray) -> float:
    """Return the volume of particles with spheres of some diameters, (n,), length^3."""
    return shape.volume * math.fsum(diameters**3)


def as_shape(value: Any) -> Shape:
    """Return a shape; raise PackingError for anything else."""
    if isinstance(value, Shape):
        return value
    raise PackingError(
        f"shape must be Sphere(), Dimer(aspect_ratio) or Cluster(centres), not {shown(value)}"
    )
