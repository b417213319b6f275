"""Piles at rest in which heavy spheres lie on light ones: nothing moves, the floor carries all.

Walls beside them are vertical and smooth, and so carry nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.helpers.exact_scenes import FLOOR, RADIUS, SETTLED, spheres_of
from tests.helpers.lammps_run import Run, run_lmp
from tests.helpers.scenes import GRAVITY, FloatArray

TOLERANCE = 1e-6
TIMESTEP = 0.005
STEPS = 60
# The default of the keyword maxiter, and the least part of the regular time step but for a list
# that does not reach.
MOST = 100_000
SHORTEST = 1e-3
# Of all weights, and how many steps in a row may find no more than that they need more.
PART = 0.01
IN_A_ROW = 3
# The greatest ratio of masses that every pile has to bear.
BORNE = 1e6


@dataclass(frozen=True, eq=False)
class Pile:
    """Spheres of diameter 1 that touch.

    Attributes
    ----------
    points, densities : of the spheres
    bodies : the body of each, 0 = none
    walls : beside them, commands that make regions side1, side2, ...
    """

    points: FloatArray
    densities: FloatArray
    bodies: Sequence[int] | None = None
    walls: Sequence[str] = ()

    @property
    def ratio(self) -> float:
        """Return that of the masses of the heaviest and the lightest."""
        return float(self.densities.max() / self.densities.min())

    def run(self, folder: Path, options: str = "") -> Run:
        """Run it; it may end with an error. v_floor is what the floor carries of all weights."""
        sides = range(1, 1 + len(self.walls))
        made = "".join(
            f"region side{k} {wall}\n" for k, wall in zip(sides, self.walls, strict=True)
        )
        masses = "".join(
            f"set atom {k} density {density:.17g}\n" for k, density in enumerate(self.densities, 1)
        )
        weights = float(self.densities.sum()) * pi / 6 * GRAVITY
        deck = spheres_of(
            self.points,
            folder,
            bodies=self.bodies,
            tolerance=TOLERANCE,
            timestep=TIMESTEP,
            setup=FLOOR + made,
            fixes=f"{masses}variable floor equal -f_contact[1][2]/{weights:.17g}\n",
            options=f"region floor {' '.join(f'side{k}' for k in sides)} {options}",
            thermo="step dt f_contact[1] v_floor",
        )
        return run_lmp(folder, f"{deck}run {STEPS}\n", must_pass=False, timeout=300.0)


def assert_carried(pile: Pile, folder: Path, options: str = "", borne: float = BORNE) -> None:
    """The floor carries all weights in every step; above a ratio that is `borne` a run may end.

    It then ends with an error, and what it told until then is right.
    """
    result = pile.run(folder, options)
    error = result.errors[0] if result.errors else ""
    steps = result.thermo["Step"] if result.runs else np.empty(0)
    print(f"ratio {pile.ratio:g}, {options}: {len(steps)} steps {error[:200]}")
    if result.status == 0:
        assert len(steps) == STEPS + 1
    else:
        assert error.startswith("ERROR: Fix inelastic: ")
        assert pile.ratio > borne
    if len(steps) == 0:
        return
    floor = result.thermo["v_floor"][SETTLED:]
    stuck = is_stuck(result)
    print(
        f"the floor carries {floor.min(initial=1):.4f} to {floor.max(initial=1):.4f}, "
        f"{result.thermo['f_contact[1]'].mean():.0f} iterations, "
        f"{longest(stuck)} steps in a row not solved"
    )
    assert (np.abs(floor - 1) <= PART).all()
    assert longest(stuck) <= IN_A_ROW


def is_stuck(result: Run) -> NDArray[np.bool_]:
    """Tell which steps took all iterations, or the shortest time step, to round-off."""
    thermo = result.thermo
    shortest = thermo["Dt"] <= SHORTEST * TIMESTEP * (1 + 1e-9)
    return np.asarray((thermo["f_contact[1]"] >= MOST) | shortest)


def longest(flags: NDArray[np.bool_]) -> int:
    """Return how many are true in a row."""
    most = since = 0
    for flag in flags:
        since = since + 1 if flag else 0
        most = max(most, since)
    return most


def column(densities: ArrayLike) -> Pile:
    """Return spheres one above the other, the first on the floor."""
    given = np.asarray(densities, dtype=float)
    heights = RADIUS + np.arange(len(given))
    return Pile(np.column_stack([0 * heights, heights, 0 * heights]), given)


# By the number of light spheres, or of all where they alternate or double, and the ratio.
COLUMNS: dict[str, Callable[[int, float], Pile]] = {
    "on top": lambda n, ratio: column([1.0] * n + [ratio]),
    "below": lambda n, ratio: column([ratio] + [1.0] * n),
    "alternating": lambda n, ratio: column(([1.0, ratio] * n)[:n]),
}


def doubling(n: int) -> Pile:
    """Return a column in which each sphere has twice the mass of the one below."""
    return column(2.0 ** np.arange(n))


def block(*limits: float) -> str:
    """Return a region whose walls are these in x and z; its floor and lid are far away."""
    x0, x1, z0, z1 = limits
    return f"block {x0:.17g} {x1:.17g} -50 90 {z0:.17g} {z1:.17g}"


def in_a_prism(ratio: float) -> Pile:
    """Return three light spheres in a triangular tube, and a heavy one on them."""
    turns = 2 * pi * np.arange(3) / 3
    around = np.column_stack([np.cos(turns), 0 * turns, np.sin(turns)])
    points = np.vstack([around / sqrt(3) + [0, RADIUS, 0], [[0, RADIUS + sqrt(2 / 3), 0]]])
    # Each wall is opposite of a sphere, half a diameter beyond the centres of the other two.
    faces = [
        "plane " + " ".join(f"{value:.17g}" for value in (*(-out * (sqrt(1 / 12) + RADIUS)), *out))
        for out in around
    ]
    return Pile(points, np.array([1.0, 1, 1, ratio]), walls=faces)


def in_a_box(ratio: float) -> Pile:
    """Return four light spheres in a square tube, and a heavy one on them."""
    four = [[x, RADIUS, z] for x in (-0.5, 0.5) for z in (-0.5, 0.5)]
    points = np.array([*four, [0, RADIUS + sqrt(0.5), 0]])
    return Pile(points, np.array([1.0] * 4 + [ratio]), walls=[block(-1, 1, -1, 1)])


def in_a_slot(ratio: float, n: int = 10) -> Pile:
    """Return light spheres that lean on one of two walls and on the other in turn, one on top."""
    across = 0.3
    numbers = np.arange(n + 1)
    sides = np.where(numbers % 2 == 0, -across, across)
    heights = RADIUS + sqrt(1 - (2 * across) ** 2) * numbers
    room = block(-across - RADIUS, across + RADIUS, -RADIUS, RADIUS)
    densities = np.array([1.0] * n + [ratio])
    return Pile(np.column_stack([sides, heights, 0 * heights]), densities, walls=[room])


def dimer_on_columns(ratio: float, n: int = 3) -> Pile:
    """Return a heavy rigid dimer that lies on two light columns which touch."""
    places = [[x, RADIUS + k, 0] for k in range(n + 1) for x in (-0.5, 0.5)]
    densities = np.array([1.0] * 2 * n + [ratio] * 2)
    return Pile(np.array(places), densities, [0] * 2 * n + [1, 1])


def dimer_in_a_box(ratio: float) -> Pile:
    """Return a heavy rigid dimer in the groove between four light spheres in a square tube."""
    four = [[x, RADIUS, z] for x in (-0.5, 0.5) for z in (-0.5, 0.5)]
    points = np.array([*four, *([0, RADIUS + sqrt(0.75), z] for z in (-0.5, 0.5))])
    densities = np.array([1.0] * 4 + [ratio] * 2)
    return Pile(points, densities, [0] * 4 + [1, 1], [block(-1, 1, -1, 1)])


PILES: dict[str, Callable[[float], Pile]] = {
    "in a prism": in_a_prism,
    "in a box": in_a_box,
    "in a slot": in_a_slot,
    "dimer on columns": dimer_on_columns,
    "dimer in a box": dimer_in_a_box,
}
