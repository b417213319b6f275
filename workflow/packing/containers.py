"""The containers that `pack` fills: a box, a standing cylinder, a ball. Gravity is along -y."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lammps_inelastic.analysis.geometry import FloatArray

from ..decks import Value
from ..errors import PackingError
from .checked import as_positive, shown
from .shapes import Sphere, volume_of

# The shipped decks pour 1,000 spheres of this diameter into a box of 1 x 5 x 1.
USUAL_DIAMETER = 0.11
USUAL_VOLUME = volume_of(Sphere(), np.full(1000, USUAL_DIAMETER))
USUAL_HEIGHT = 5.0
# A container without a height is at least so high [lengths of a particle].
LOWEST = 5.0


@dataclass(frozen=True)
class Box:
    """A box with a corner in the origin: x from 0 to width, y to height, z to depth.

    Attributes
    ----------
    width : along x, length
    depth : along z, length; None for the width
    height : along y, length; None for one with room to pour the particles into
    """

    width: float
    depth: float | None = None
    height: float | None = None

    def __post_init__(self) -> None:
        """Raise PackingError for sides that are not positive."""
        _set(self, width=self.width, depth=self.width if self.depth is None else self.depth)
        if self.height is not None:
            _set(self, height=self.height)

    @property
    def floor(self) -> float:
        """Area of the floor, length^2."""
        assert self.depth is not None
        return self.width * self.depth

    @property
    def narrowest(self) -> float:
        """The smallest of its sides that are known, length."""
        return min(side for side in (self.width, self.depth, self.height) if side is not None)

    @property
    def volume(self) -> float:
        """Volume, length^3; it must have a height."""
        assert self.height is not None
        return self.floor * self.height

    @property
    def bounds(self) -> FloatArray:
        """The box around it, (3, 2), length; it must have a height."""
        assert self.depth is not None
        assert self.height is not None
        return np.array([[0.0, self.width], [0.0, self.height], [0.0, self.depth]])

    @property
    def columns(self) -> list[FloatArray]:
        """Boxes, (3, 2), a quarter of the widths away from the side walls, length."""
        return [_middle(self.bounds)]

    @property
    def settings(self) -> dict[str, Value]:
        """The parameters of the deck that are those of this container."""
        assert self.depth is not None
        assert self.height is not None
        sides = {"width": self.width, "depth": self.depth, "height": self.height}
        return {"container": "box", **sides}

    @property
    def words(self) -> str:
        """It in words."""
        return f"a box of {self.width:g} x {self.height:g} x {self.depth:g}"

    def distances(self, points: FloatArray) -> FloatArray:
        """Return the distance of points inside, (n, 3), from the nearest wall, (n,), length."""
        low, high = self.bounds.T
        nearest: FloatArray = np.minimum(points - low, high - points).min(axis=1)
        return nearest

    def draw(self, insets: FloatArray, random: np.random.Generator) -> FloatArray:
        """Draw points, (n, 3), that are at least insets, (n,), away from all walls."""
        low, high = self.bounds.T
        inset = insets[:, None]
        places: FloatArray = (
            low + inset + random.random((len(insets), 3)) * (high - low - 2 * inset)
        )
        return places


@dataclass(frozen=True)
class Cylinder:
    """A standing cylinder; its axis is that of y, its floor is at y = 0.

    Attributes
    ----------
    diameter : length
    height : length; None for one with room to pour the particles into
    """

    diameter: float
    height: float | None = None

    def __post_init__(self) -> None:
        """Raise PackingError for lengths that are not positive."""
        _set(self, diameter=self.diameter)
        if self.height is not None:
            _set(self, height=self.height)

    @property
    def floor(self) -> float:
        """Area of the floor, length^2."""
        return math.pi / 4 * self.diameter**2

    @property
    def narrowest(self) -> float:
        """The smaller of diameter and height, if that is known, length."""
        return self.diameter if self.height is None else min(self.diameter, self.height)

    @property
    def volume(self) -> float:
        """Volume, length^3; it must have a height."""
        assert self.height is not None
        return self.floor * self.height

    @property
    def bounds(self) -> FloatArray:
        """The box around it, (3, 2), length; it must have a height."""
        assert self.height is not None
        half = self.diameter / 2
        return np.array([[-half, half], [0.0, self.height], [-half, half]])

    @property
    def columns(self) -> list[FloatArray]:
        """Boxes, (3, 2), whose edges are a seventh of the diameter away from the wall, length."""
        return [_middle(self.bounds)]

    @property
    def settings(self) -> dict[str, Value]:
        """The parameters of the deck that are those of this container."""
        assert self.height is not None
        return {"container": "cylinder", "width": self.diameter, "height": self.height}

    @property
    def words(self) -> str:
        """It in words."""
        return f"a cylinder of diameter {self.diameter:g} and height {self.height:g}"

    def distances(self, points: FloatArray) -> FloatArray:
        """Return the distance of points inside, (n, 3), from the nearest wall, (n,), length."""
        assert self.height is not None
        x, y, z = points.T
        return np.asarray(np.min([self.diameter / 2 - np.hypot(x, z), y, self.height - y], axis=0))

    def draw(self, insets: FloatArray, random: np.random.Generator) -> FloatArray:
        """Draw points, (n, 3), that are at least insets, (n,), away from all walls."""
        assert self.height is not None
        share, turn, height = random.random((3, len(insets)))
        radius = np.sqrt(share) * (self.diameter / 2 - insets)
        y = insets + height * (self.height - 2 * insets)
        angle = 2 * np.pi * turn
        return np.column_stack([radius * np.cos(angle), y, radius * np.sin(angle)])


@dataclass(frozen=True)
class Ball:
    """A hollow ball about the origin.

    Attributes
    ----------
    diameter : length
    """

    diameter: float

    def __post_init__(self) -> None:
        """Raise PackingError for a diameter that is not positive."""
        _set(self, diameter=self.diameter)

    @property
    def height(self) -> float:
        """Its diameter, length."""
        return self.diameter

    @property
    def narrowest(self) -> float:
        """Its diameter, length."""
        return self.diameter

    @property
    def volume(self) -> float:
        """Volume, length^3."""
        return math.pi / 6 * self.diameter**3

    @property
    def bounds(self) -> FloatArray:
        """The box around it, (3, 2), length."""
        return np.array([[-self.diameter / 2, self.diameter / 2]] * 3)

    @property
    def columns(self) -> list[FloatArray]:
        """Boxes, (3, 2), whose corners are a fifteenth of the diameter away from the wall."""
        corner = math.sqrt(3) / 4
        found = []
        # The widest is a cube; narrower ones reach further down, where a ball is filled in part.
        for side in (0.25, 0.2, 0.15, 0.1, 0.05):
            high = math.sqrt(corner**2 - 2 * side**2)
            found.append(np.array([[-side, side], [-high, high], [-side, side]]) * self.diameter)
        return found

    @property
    def settings(self) -> dict[str, Value]:
        """The parameters of the deck that are those of this container."""
        return {"container": "sphere", "width": self.diameter, "height": self.diameter}

    @property
    def words(self) -> str:
        """It in words."""
        return f"a ball of diameter {self.diameter:g}"

    def distances(self, points: FloatArray) -> FloatArray:
        """Return the distance of points inside, (n, 3), from the wall, (n,), length."""
        return np.asarray(self.diameter / 2 - np.linalg.norm(points, axis=1))

    def draw(self, insets: FloatArray, random: np.random.Generator) -> FloatArray:
        """Draw points, (n, 3), that are at least insets, (n,), away from the wall."""
        directions = random.normal(size=(len(insets), 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        radius = np.cbrt(random.random(len(insets))) * (self.diameter / 2 - insets)
        return directions * radius[:, None]


Container = Box | Cylinder | Ball


def as_container(value: Any, volume: float, length: float) -> Container:
    """Return a container with a height; raise PackingError for anything else.

    What is not given is that of the shipped decks, scaled to the volume of the particles.

    Parameters
    ----------
    value : container, or None for a box
    volume : of all particles together, length^3
    length : room that the largest particle needs, length
    """
    many = volume / USUAL_VOLUME
    if value is None:
        value = Box(max(many ** (1 / 3), 2 * length))
    if not isinstance(value, Container):
        raise PackingError(
            "container must be Box(width, depth, height), Cylinder(diameter, height) or "
            f"Ball(diameter), not {shown(value)}"
        )
    if isinstance(value, Ball) or value.height is not None:
        return value
    return replace(value, height=max(USUAL_HEIGHT * many / value.floor, LOWEST * length))


def _set(container: Any, **lengths: Any) -> None:
    """Set lengths of a container, each checked."""
    for name, value in lengths.items():
        object.__setattr__(container, name, as_positive(value, f"the {name} of a container"))


def _middle(bounds: FloatArray) -> FloatArray:
    """Return the middle half of a box, (3, 2), along x and z, and all of its height."""
    middle = bounds.copy()
    for axis in (0, 2):
        low, high = bounds[axis]
        middle[axis] = (3 * low + high) / 4, (low + 3 * high) / 4
    return middle
