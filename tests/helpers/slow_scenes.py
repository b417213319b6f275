"""Light grains that drive heavy ones apart, slowly, and the exact way that these go.

All is smooth, of one coordinate, and starts at rest. A light grain of mass m descends by y between
two surfaces, each of which goes sideways by s; they touch it as long as s^2 + y^2 = length^2:

    1/2 inertia s'^2 + 1/2 m y'^2 + m g y = constant
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from tests.helpers.bodies import Bodies, body_scene
from tests.helpers.exact_scenes import FLOOR
from tests.helpers.lammps_run import Run, run_lmp
from tests.helpers.scenes import DUMP_PARTICLES, GRAVITY, FloatArray, mass, read_dump, scene

TOLERANCE = 1e-6
# A run ends here at the latest.
LONGEST = 20.0
# Of the way that the exact equations, or the same steps with rest no, give.
PART = 1e-3
# The scheme is of first order: in longer steps it is off by more than that where a way takes a few.
EXACT_STEP = 0.01


@dataclass(frozen=True, eq=False)
class Wedge:
    """Grains at rest that light ones drive apart.

    Attributes
    ----------
    points, radii, densities : of the spheres
    light, inertia : m and the inertia of s
    length, apart : the distance of centres that touch, without its part along z, and s at the start
    coordinate : s as a formula of LAMMPS
    bodies : the body of each sphere, 0 = none
    walls : besides the floor; their names, and the commands that make them
    """

    points: Sequence[Sequence[float]] | FloatArray
    radii: ArrayLike
    densities: ArrayLike
    light: float
    inertia: float
    length: float
    apart: float
    coordinate: str
    bodies: Sequence[int] | None = None
    walls: tuple[str, str] = ("", "")

    def exact(self) -> Motion:
        """Integrate the exact equation, up to the end of what a run has to follow."""

        def mass_of(angle: float) -> float:
            return float(self.inertia * np.cos(angle) ** 2 + self.light * np.sin(angle) ** 2)

        def rates(_: float, state: FloatArray) -> list[float]:
            angle, speed = state
            turn = np.sin(angle) * np.cos(angle) * (self.light - self.inertia) * speed**2
            pull = self.light * GRAVITY / self.length * np.sin(angle)
            return [speed, (pull - turn) / mass_of(angle)]

        def lets_go(time: float, state: FloatArray) -> float:
            """Return what is proportional to s'', and so to the forces."""
            _, faster = rates(time, state)
            return float(np.cos(state[0]) * faster - np.sin(state[0]) * state[1] ** 2)

        def half_way(_: float, state: FloatArray) -> float:
            return float(np.cos(state[0]) - 0.5 * np.cos(start))

        lets_go.terminal = half_way.terminal = True
        start = np.arcsin(self.apart / self.length)
        # Relative to angles and speeds that may be as small as 1e-3.
        found = solve_ivp(
            rates,
            (0.0, LONGEST),
            [start, 0.0],
            "DOP853",
            events=(lets_go, half_way),
            rtol=1e-12,
            atol=1e-14,
            dense_output=True,
        )
        angle, speed = found.y[:, -1]
        kinetic = 0.5 * mass_of(angle) * (self.length * speed) ** 2
        work = self.light * GRAVITY * self.length * (np.cos(start) - np.cos(angle))
        assert abs(kinetic - work) <= 1e-10 * work
        return Motion(float(found.t[-1]), self, found.sol)

    def deck(
        self,
        folder: Path,
        timestep: float,
        options: str = "",
        **settings: Any,
    ) -> str:
        """Return a deck up to its first `run`; v_apart is s."""
        names, made = self.walls
        densities = np.asarray(self.densities)
        common: dict[str, Any] = {
            "tolerance": TOLERANCE,
            "timestep": timestep,
            "skin": 0.5,
            "box": ((-100.0, 100.0), (0.0, 10.0), (-10.0, 10.0)),
            "setup": FLOOR + made + settings.pop("setup", ""),
            "fixes": "".join(
                f"set atom {k} density {density:.17g}\n" for k, density in enumerate(densities, 1)
            ),
            "options": f"region floor {names} {options}",
            "thermo": "step time v_apart f_contact[1] f_contact[13]",
            **settings,
        }
        if self.bodies is None:
            deck = scene(self.points, self.radii, folder, **common)
        else:
            placed = Bodies(np.asarray(self.points), np.asarray(self.bodies))
            deck = body_scene(placed, self.radii, folder, inertia="solid", **common)
        return deck.replace("thermo 1\n", f"variable apart equal {self.coordinate}\nthermo 1\n")

    def run(
        self,
        folder: Path,
        timestep: float,
        options: str = "",
        *,
        ranks: int = 1,
        dump: str = "",
    ) -> Run:
        """Run it, on ranks that stand side by side, as long as the exact motion lasts."""
        steps = max(1, int(self.exact().end / timestep + 1e-9))
        deck = self.deck(folder, timestep, options, setup=f"processors {ranks} 1 1\n")
        return run_lmp(folder, f"{deck}{dump}run {steps}\n", ranks, timeout=300.0)


@dataclass(frozen=True, eq=False)
class Motion:
    """The exact motion of a wedge, up to `end`: the light grain has come half its way down.

    It ends earlier where the surfaces part, or at LONGEST.
    """

    end: float
    wedge: Wedge
    angle: Any

    def way(self, times: FloatArray) -> FloatArray:
        """Return how far s has come."""
        return self.wedge.length * np.sin(self.angle(times)[0]) - self.wedge.apart


def way(run: Run) -> FloatArray:
    """Return how far s has come in each step of a run."""
    apart = run.thermo["v_apart"]
    return apart - apart[0]


def assert_same_way(found: FloatArray, expected: FloatArray) -> None:
    """The way is the same in every step, within a PART of the whole way."""
    wrong = np.abs(found - expected) / expected[-1]
    print(f"moved by {expected[-1]:.6g}, off by up to {wrong.max():.2e} of that")
    assert wrong.max() <= PART


def assert_exact_way(scene: Wedge, run: Run) -> None:
    """It is that of the exact equations."""
    motion = scene.exact()
    assert_same_way(way(run), motion.way(np.minimum(run.thermo["Time"], motion.end)))


def assert_never_at_rest(run: Run) -> None:
    """No step is one in which the whole scene rests."""
    assert (run.thermo["f_contact[13]"] == 0.0).all()


def assert_goes_on(
    scene: Wedge, folder: Path, timestep: float, ranks: int = 1, *, exact: bool = True
) -> None:
    """Grains go as far as with `rest no`, at the same steps, and never rest.

    Steps of at most EXACT_STEP follow the exact way, too, unless `exact` is false.
    """
    unstopped = scene.run(folder / "unstopped", timestep, "rest no", ranks=ranks)
    found = scene.run(folder / "found", timestep, ranks=ranks)
    assert_same_way(way(found), way(unstopped))
    if exact and timestep <= EXACT_STEP:
        assert_exact_way(scene, found)
    assert_never_at_rest(found)


def assert_no_momentum(scene: Wedge, folder: Path, timestep: float) -> None:
    """On a smooth floor the momentum along it is 0 in every step, to round-off."""
    found = scene.run(folder, timestep, dump=DUMP_PARTICLES)
    frames = read_dump(found.folder / "particles.dump")
    masses = np.broadcast_to(mass(scene.radii) * np.asarray(scene.densities), len(frames[0].rows))
    momenta = np.array([masses @ frame.velocities[:, [0, 2]] for frame in frames])
    numbers = np.arange(len(frames))[:, None]
    # A step adds m g h at most, each velocity is rounded to 1e-16 of what came together.
    assert (np.abs(momenta) <= 1e-12 * scene.light * GRAVITY * timestep * numbers).all()


def wedge(left: float, right: float | None = None) -> Wedge:
    """Return a sphere of density 1 between two that touch, of these densities."""
    right = left if right is None else right
    m = float(mass(0.5))
    # The light one stays in the middle of both, and goes by `drift` s where they differ.
    drift = (left - right) / (1 + left + right)
    return Wedge(
        points=[[-0.5, 0.5, 0], [0.5, 0.5, 0], [0, 0.5 + sqrt(0.75), 0]],
        radii=0.5,
        densities=[left, right, 1],
        light=m,
        inertia=m * (drift**2 + left * (1 - drift) ** 2 + right * (1 + drift) ** 2),
        length=1.0,
        apart=0.5,
        coordinate="(x[2]-x[1])/2",
    )


def between_large_spheres(density: float) -> Wedge:
    """Return a sphere between two of four times its diameter."""
    return Wedge(
        points=[[-2, 2, 0], [2, 2, 0], [0, 3.5, 0]],
        radii=[2, 2, 0.5],
        densities=[density, density, 1],
        light=float(mass(0.5)),
        inertia=2 * density * float(mass(2.0)),
        length=2.5,
        apart=2.0,
        coordinate="(x[2]-x[1])/2",
    )


def between_blocks(density: float) -> Wedge:
    """Return a sphere that lies on two rigid cubes of eight, on the edges that touch."""
    cube = np.array([[x, y, z] for x in (0.5, 1.5) for y in (0.5, 1.5) for z in (-0.5, 0.5)])
    m = float(mass(0.5))
    return Wedge(
        points=np.vstack([cube * [-1, 1, 1], cube, [[0, 1.5 + sqrt(0.5), 0]]]),
        radii=0.5,
        densities=[density] * 16 + [1],
        light=m,
        inertia=16 * density * m,
        length=sqrt(0.75),
        apart=0.5,
        coordinate="(x[9]-x[1])/2",
        bodies=[1] * 8 + [2] * 8 + [0],
    )


def five(density: float) -> Wedge:
    """Return two spheres in the gaps of three heavy ones in a row: the middle one stays."""
    m = float(mass(0.5))
    above = 0.5 + sqrt(0.75)
    return Wedge(
        points=[[-1, 0.5, 0], [0, 0.5, 0], [1, 0.5, 0], [-0.5, above, 0], [0.5, above, 0]],
        radii=0.5,
        densities=[density] * 3 + [1, 1],
        # Of one half: a light one goes aside by s as well, the outer heavy one by 2 s.
        light=m,
        inertia=m * (1 + 4 * density),
        length=1.0,
        apart=0.5,
        coordinate="(x[3]-x[1])/4",
    )


def slope(density: float) -> Wedge:
    """Return a sphere on the side of one that is four times as large, and on a wall."""
    return Wedge(
        points=[[2.0, 2, 0], [0, 3.5, 0]],
        radii=[2, 0.5],
        densities=[density, 1],
        light=float(mass(0.5)),
        inertia=density * float(mass(2.0)),
        length=2.5,
        apart=2.0,
        coordinate="x[1]",
        walls=("side", "region side plane -0.5 0 0 1 0 0\n"),
    )


def dimers(density: float) -> Wedge:
    """Return the wedge with a rigid dimer, along z, in the place of each sphere."""
    ends = np.array([[0, 0, -0.25], [0, 0, 0.25]])
    centres = np.array([[-0.5, 0.5, 0], [0.5, 0.5, 0], [0, 0.5 + sqrt(0.75), 0]])
    m = 2 * float(mass(0.5))
    return Wedge(
        points=(centres[:, None] + ends).reshape(-1, 3),
        radii=0.5,
        densities=[density] * 4 + [1, 1],
        light=m,
        inertia=2 * density * m,
        length=1.0,
        apart=0.5,
        coordinate="(x[3]+x[4]-x[1]-x[2])/4",
        bodies=[1, 1, 2, 2, 3, 3],
    )


OTHERS = {
    "between large spheres": between_large_spheres,
    "between blocks": between_blocks,
    "five": five,
    "slope": slope,
    "dimers": dimers,
}
