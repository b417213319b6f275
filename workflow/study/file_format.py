"""The keys of a study file and what each may be, in pydantic's way."""

from __future__ import annotations

import json
import math
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, field_validator

# A box or a container: xlo, xhi, ylo, yhi, zlo, zhi [length].
Bounds = tuple[float, float, float, float, float, float]

# The box of the paper is a quarter of the container's width away from every wall and the floor.
PAPER_BOX: Bounds = (0.25, 0.75, 0.25, 0.75, 0.25, 0.75)

# So many random points take a minute of measuring.
MOST_POINTS, MOST_POINTS_OF_SLAB = 10**8, 10**7
MOST_PICTURES = 100


class _Table(BaseModel):
    """A table of a study file, which has no other keys than its own."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _from_to(least: int, most: int) -> BeforeValidator:
    def check(value: Any) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
            raise ValueError(f"it must be a whole number from {least} to {most}")
        return value

    return BeforeValidator(check)


def _between(low: float, high: float) -> BeforeValidator:
    def check(value: Any) -> float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not low <= value <= high:
            raise ValueError(f"it must be a number from {low:g} to {high:g}")
        return float(value)

    return BeforeValidator(check)


_Number = Annotated[float, Field(strict=True)]
_Boolean = Annotated[bool, Field(strict=True)]


class ProfileOutput(_Table):
    """The packing fraction in slabs parallel to the wall at the container's lower bound.

    Attributes
    ----------
    axis : the axis across the wall
    thickness : thickness of a slab, diameters
    reach : distance from the wall up to which there are slabs, length
    points : number of random points in each slab
    """

    axis: Literal["x", "y", "z"] = "x"
    thickness: Annotated[float, _between(0.001, 1)] = 0.1
    reach: Annotated[float, _between(1e-6, 1e6)] = 0.25
    points: Annotated[int, _from_to(1, MOST_POINTS_OF_SLAB)] = 100_000


class Outputs(_Table):
    """The measurements that are made of each case, and what is kept of it.

    Attributes
    ----------
    box : xlo, xhi, ylo, yhi, zlo, zhi: where particles are counted, length; `cell` for the whole
        simulation box, such as one that is periodic on all sides
    points : number of random points for the Monte Carlo packing fraction
    evolution : whether packing fraction and contacts of every frame of the particle dump are kept
    profile : slabs for the packing fraction against the distance from a wall; None for none
    structure : whether radial distribution function and bond-orientational order are measured
    pictures : steps at which the packing is drawn; a frame of the dump each
    network : whether the contact network is drawn
    packing : whether the last frame is kept with its contacts, so that a report can show it
    keep : `everything`, or `results` to delete the dumps of a case that has been measured
    """

    box: Literal["cell"] | tuple[_Number, _Number, _Number, _Number, _Number, _Number] = PAPER_BOX
    points: Annotated[int, _from_to(1, MOST_POINTS)] = 1_000_000
    evolution: _Boolean = True
    profile: ProfileOutput | None = None
    structure: _Boolean = True
    pictures: tuple[Annotated[int, _from_to(0, 2**63 - 1)], ...] = ()
    network: _Boolean = False
    packing: _Boolean = False
    keep: Literal["everything", "results"] = "everything"

    @field_validator("box")
    @classmethod
    def _ordered(cls, value: Bounds | Literal["cell"]) -> Bounds | Literal["cell"]:
        if value == "cell":
            return value
        sides = [high - low for low, high in zip(value[::2], value[1::2], strict=True)]
        # A volume that is no number of full precision gives no packing fraction.
        if not all(0 < side < math.inf for side in sides) or not 1e-300 < math.prod(sides) < 1e300:
            raise ValueError("it must be xlo, xhi, ylo, yhi, zlo, zhi, each lower bound the lesser")
        return value

    @field_validator("pictures")
    @classmethod
    def _few(cls, value: tuple[int, ...]) -> tuple[int, ...]:
        if len(value) > MOST_PICTURES or len(set(value)) < len(value):
            raise ValueError(f"they must be at most {MOST_PICTURES} steps, each of them once")
        return value

    @property
    def bounds(self) -> NDArray[np.float64] | None:
        """The box as an array (3, 2), length; None for the whole simulation box."""
        return None if self.box == "cell" else np.reshape(np.array(self.box, dtype=float), (3, 2))

    @property
    def measured(self) -> str:
        """All that decides what is measured, as JSON: equal texts, equal measurements."""
        # Results that were measured before there was `packing` are those without it.
        silent = {"keep"} if self.packing else {"keep", "packing"}
        return json.dumps(self.model_dump(exclude=silent), sort_keys=True)


class StudyFile(_Table):
    """The whole of a study file; values are checked against the decks later."""

    title: str
    deck: str | list[str]
    common: dict[str, Any] = {}
    parameters: dict[str, Any] = {}
    rows: list[dict[str, Any]] = []
    outputs: Outputs = Outputs()
