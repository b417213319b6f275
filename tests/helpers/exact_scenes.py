"""Scenes of equal spheres whose motion, or whose contact forces, are known in closed form.

Diameter 1, density 1, gravity along -y. Forces are given in weights of a sphere, velocities in g h,
which gravity adds in a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.helpers.bodies import Bodies, body_scene, dimer, random_bodies
from tests.helpers.lammps_run import Run, run_lmp
from tests.helpers.scenes import GRAVITY, FloatArray, mass, random_points, read_dump, scene

RADIUS = 0.5
MASS = float(mass(RADIUS))
WEIGHT = MASS * GRAVITY
STEP = 0.01
# Forces and velocities are exact from the third step on after the start, or a jump of the load.
SETTLED = 3
FLOOR = "region floor plane 0 0 0 0 1 0\n"
WIDE = ((-30.0, 30.0), (-100.0, 100.0), (-10.0, 10.0))


def spheres_of(
    points: ArrayLike, folder: Path, *, bodies: ArrayLike | None = None, **settings: Any
) -> str:
    """Return a deck of spheres at these places; `bodies`: the body of each, 0 = none."""
    common: dict[str, Any] = {
        "tolerance": 1e-3,
        "timestep": STEP,
        "skin": 1.0,
        "box": WIDE,
        "setup": FLOOR,
        "options": "region floor",
        "thermo": "step f_contact[1] f_contact[13]",
        **settings,
    }
    if bodies is None:
        return scene(points, RADIUS, folder, **common)
    placed = Bodies(np.asarray(points, dtype=float), np.asarray(bodies, dtype=np.int64))
    return body_scene(placed, RADIUS, folder, inertia="solid", **common)


def attraction(pairs: Sequence[tuple[str, str]], weights: float, distance: float = 1.0) -> str:
    """Return springs of no length that pull groups of IDs, `1 2` for two, to one another.

    A central force between centres of mass leaves momentum and angular momentum as they are.
    """
    stiffness = weights * WEIGHT / distance
    lines = []
    for k, (one, other) in enumerate(pairs):
        lines += [f"group one{k} id {one}", f"group other{k} id {other}"]
        lines += [f"fix pull{k} one{k} spring couple other{k} {stiffness:.17g} 0 0 0 0"]
    return "\n".join(lines) + "\n"


def path(folder: Path) -> FloatArray:
    """(steps, n, 6) positions and velocities in all steps of a run with DUMP_PARTICLES."""
    frames = read_dump(folder / "particles.dump")
    return np.array([frame.vectors("x y z vx vy vz") for frame in frames])


DUMP_COLUMN = """
dump column all local 1 column.dump f_contact[1] f_contact[2] f_contact[6] f_contact[7] &
     f_contact[10]
dump_modify column format float %.17g colname 1 id1 colname 2 id2 colname 3 nx colname 4 ny &
     colname 5 force
"""
# A load that doubles, halves, ramps and halves; v_s counts steps. The steps of its jumps.
CHANGES = "(1+(v_s>=40)*(v_s<80)+(v_s>=120)*(v_s<160)*(v_s-120)/40)"
JUMPS = (0, 40, 80, 160)
LAST = 200


@dataclass(frozen=True)
class Column:
    """Spheres that touch, one above the other, on a floor; the top one carries a load.

    Attributes
    ----------
    n : how many
    tolerance, timestep : of the fix, in radii, and of the run
    load : [weights]
    changes : the factor of the load as a formula of the step v_s
    lean : angle of gravity against the column, which then leans on one of two walls beside it
    hangs : it is glued, and after `steps` steps all forces are turned round for as many
    steps : of the run
    """

    n: int
    tolerance: float = 1e-3
    timestep: float = 0.005
    load: float = 0.0
    lean: float = 0.0
    hangs: bool = False
    changes: str = field(default=CHANGES, repr=False)
    steps: int = LAST

    def run(self, folder: Path, options: str = "", **how: Any) -> Run:
        """Run it with dumps of its contacts."""
        beside = RADIUS + 0.1
        points = np.column_stack(
            [np.full(self.n, 0.1), RADIUS * (1 + 2 * np.arange(self.n)), np.zeros(self.n)]
        )
        law = " law gluey" if self.hangs else ""
        sides = " left right" if self.lean else ""
        turned = f"(1-2*(step>={self.steps}))" if self.hangs else "1"
        deck = spheres_of(
            points,
            folder,
            tolerance=self.tolerance * RADIUS,
            timestep=self.timestep,
            box=((-5.0, 5.0), (-2.0, self.n + 10.0), (-5.0, 5.0)),
            gravity=False,
            fixes=f"""
region left plane {-beside} 0 0 1 0 0
region right plane {beside} 0 0 -1 0 0
variable s equal step-{self.steps}*(step>={self.steps})*{int(self.hangs)}
variable load equal {self.load}*{self.changes}*{turned}
variable down equal {-np.cos(self.lean):.17g}*{turned}
variable press equal {WEIGHT:.17g}*-v_load
fix gravity all gravity {GRAVITY} vector {np.sin(self.lean):.17g} v_down 0
group top id {self.n}
fix press top addforce 0 v_press 0
variable speed atom sqrt(vx^2+vy^2+vz^2)
compute fastest all reduce max v_speed
""",
            options=f"region floor{sides}{law} {options}",
            thermo="step f_contact[1] v_load c_fastest",
        )
        # What the contacts have stored is used up at the end, and known to some of a hundred steps.
        steps = self.steps + (95 * self.steps // 100 if self.hangs else 0)
        return run_lmp(folder, deck + DUMP_COLUMN + f"run {steps}\n", **how)

    def exact(self, loads: FloatArray, normals: FloatArray) -> FloatArray:
        """(steps, n, 2) forces below and beside each sphere, in weights.

        `loads` of the steps, and `normals` (steps, n, 2, 2): the two contacts of each sphere.
        """
        forces = np.zeros(normals.shape[:-1])
        turned = np.where((np.arange(len(loads)) >= self.steps) & self.hangs, -1.0, 1.0)
        weight = np.outer(turned, [0.0, -np.cos(self.lean)])
        weight[:, 0] = np.sin(self.lean)
        above = np.outer(loads, [0.0, -1.0])
        for k in reversed(range(self.n)):
            carried = above + weight
            forces[:, k] = np.linalg.solve(np.swapaxes(normals[:, k], 1, 2), -carried[..., None])[
                ..., 0
            ]
            above = -forces[:, k, :1] * normals[:, k, 0]
        return forces

    def check(self, result: Run) -> None:
        """Every force, and every velocity, is exact in every step."""
        thermo = result.thermo
        normals = np.zeros((len(thermo["Step"]), self.n, 2, 2))
        normals[:, :, 0, 1] = normals[:, :, 1, 0] = 1.0
        forces = np.zeros(normals.shape[:-1])
        for frame in read_dump(result.folder / "column.dump"):
            one, other = frame["id1"].astype(int), frame["id2"].astype(int)
            # A contact is that below the upper sphere, or that with a wall; the floor is wall 1.
            sphere, beside = np.maximum(one, other) - 1, (other < -1).astype(int)
            sign = np.where(one > other, 1.0, -1.0)[:, None]
            normals[frame.step, sphere, beside] = sign * frame.vectors("nx ny")
            forces[frame.step, sphere, beside] = frame["force"] / WEIGHT
        exact = self.exact(thermo["v_load"], normals)
        count = 1 + int(self.lean > 0)
        steps = settled(thermo["Step"], self.hangs)
        wrong = np.abs(forces[steps, :, :count] / exact[steps, :, :count] - 1)
        fastest = thermo["c_fastest"][steps] / (GRAVITY * self.timestep)
        print(f"{self}: forces off by up to {wrong.max():.4f}, fastest {fastest.max():.4f} g h")
        high = self.n > 100
        assert wrong.max() <= (0.05 if high else 0.01)
        assert fastest.max() <= (0.1 if high else 0.05)


def settled(steps: FloatArray, hangs: bool = False) -> NDArray[np.bool_]:
    """Tell which steps are SETTLED after the start, or after a jump of the load."""
    since = steps % LAST if hangs else steps
    good = np.ones(len(steps), dtype=bool)
    for jump in JUMPS:
        good &= (since < jump) | (since >= jump + SETTLED)
    return good


# The part of a load that is left when it goes after 600 steps, as formulas of the step v_s: the
# whole of it from one step to the next, in five parts, by a factor in each step.
PRESSED = 600
UNLOADING = {
    "at once": f"(v_s<{PRESSED})",
    "in steps": f"(1-(v_s>={PRESSED})*0.2*(floor((v_s-{PRESSED})/20)+1))*(v_s<{PRESSED + 80})",
    "by 0.7": f"0.7^((v_s-{PRESSED - 1})*(v_s>={PRESSED}))",
}


def assert_nothing_leaps(
    load: FloatArray, speed: FloatArray, weights: float, since: int = PRESSED
) -> None:
    """Nothing moves when a load goes.

    `load` [weights] and `speed` [g h] of all steps; the load was `weights`, and goes from the step
    `since` on.
    """
    changes = np.abs(np.diff(load, prepend=load[0])) > 0.1
    last = np.maximum.accumulate(np.where(changes, np.arange(len(load)), 0))
    later = np.arange(len(load)) >= np.maximum(last + 10, since + 10)
    print(
        f"{weights:g} weights: {speed[since:].max():.4f} g h, "
        f"ten steps later {speed[later].max():.4f} g h"
    )
    # Of the velocity that the load would give in a step, a hundredth of the accuracy.
    assert speed[since:].max() <= max(0.1, 1e-5 * weights)
    assert speed[later].max() <= 0.1


# Of beds: the tolerance, and the number of steps after which they rest.
BED_TOLERANCE = 1e-3
SETTLING = 6000
FASTEST = """
variable speed atom sqrt(vx^2+vy^2+vz^2)
compute fastest all reduce max v_speed
"""


def bed_box(side: float = 7.0) -> tuple[tuple[float, float], ...]:
    """Return the box of a bed, whose walls are its region `container`."""
    return ((0.0, side), (0.0, 40.0), (0.0, side))


def settling_bed(
    kind: str,
    folder: Path,
    changes: str = "1",
    *,
    number: int = 500,
    side: float = 7.0,
    loaded_after: int = 0,
    accuracy: float = 1e-3,
    seed: int = 1,
) -> str:
    """Return a deck in which a bed settles, up to the end of a run after which it rests.

    `kind`: so many "spheres", or half as many "dimers" of aspect ratio 1.5. Gravity is multiplied
    by `changes`, a formula of v_s, which counts steps from `loaded_after` steps later on.
    """
    box = bed_box(side)
    bodies = None
    # LAMMPS finds a temperature beside it, for which small beds of bodies have too few freedoms.
    kinetic = "ke " if kind == "spheres" else ""
    if kind == "spheres":
        inside = tuple((low + RADIUS, high - RADIUS) for low, high in box)
        points = random_points(number, inside, 2 * RADIUS, seed=seed)
    else:
        inside = tuple((low + 2 * RADIUS, high - 2 * RADIUS) for low, high in box)
        placed = random_bodies([dimer(1.5)] * (number // 2), RADIUS, inside, seed=seed)
        points, bodies = placed.positions, placed.molecules
    deck = spheres_of(
        points,
        folder,
        bodies=bodies,
        tolerance=BED_TOLERANCE,
        timestep=0.02,
        skin=0.5,
        box=box,
        setup="",
        options=f"region container shorten yes accuracy {accuracy:g}",
        gravity=False,
        fixes=f"variable s equal step-{SETTLING + loaded_after}\n{FASTEST}"
        f"variable load equal {changes}\nvariable g equal {GRAVITY}*v_load\n"
        "fix gravity all gravity v_g vector 0 -1 0\n",
        thermo=f"step {kinetic}f_contact[1] v_load c_fastest f_contact[13]",
    )
    drag = f"fix drag all viscous {MASS:.17g}\nfix contact all"
    return deck.replace("fix contact all", drag) + f"thermo 1000\nrun {SETTLING}\n"


def seed_at_rest(
    kind: str, folder: Path, timestep: float, steps: int, ranks: int = 1, **bed: Any
) -> int:
    """Return the first seed of whose settling_bed all grains are at rest, without drag, too.

    In about half of the beds some grain that nothing holds slides on, at 1e-3 g h, on a slope of
    1e-4 (docs/measured/rest.md): it would fall under a greater gravity. Such a bed has to be at
    rest after some `steps` of `timestep`; `bed` goes to settling_bed.
    """
    for seed in range(1, 13):
        here = folder / f"seed{seed}"
        here.mkdir(parents=True)
        deck = settling_bed(kind, here, seed=seed, **bed)
        deck += f"unfix drag\ntimestep {timestep}\nthermo 1\nrun {steps}\n"
        thermo = run_lmp(here, deck, ranks, timeout=900).thermo
        # A grain that is held stands still; round-off of what is told of it.
        if (thermo["c_fastest"][-steps:] <= 1e-9 * GRAVITY * timestep).all():
            return seed
    raise AssertionError("no bed is at rest")
