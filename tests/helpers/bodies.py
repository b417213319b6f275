"""Rigid bodies for the tests of the fix: shapes, starts, decks and what is conserved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from tests.helpers.scenes import FloatArray, mass, scene

INERTIAS = ("point", "solid")
BODY_STYLE = "atom_style hybrid sphere 1 molecular"
# With the angular velocities, which are those of the bodies where the spheres are solid.
DUMP_BODY_SPHERES = """
dump particles all custom 1 particles.dump id mol type x y z vx vy vz omegax omegay omegaz radius
dump_modify particles sort id format float %.17g
"""
# What LAMMPS itself keeps of each body, at whole steps.
DUMP_BODIES = """
compute of_bodies bodies rigid/local bodies mol mass x y z vx vy vz angmomx angmomy angmomz
dump bodies all local 1 bodies.dump c_of_bodies[*]
dump_modify bodies format float %.17g colname 1 mol colname 2 mass colname 3 x colname 4 y &
    colname 5 z colname 6 vx colname 7 vy colname 8 vz colname 9 lx colname 10 ly colname 11 lz
"""

# Thermo's own kinetic energy counts the degrees of freedom of a body wrongly.
BODY_THERMO = "step " + " ".join(f"f_contact[{k}]" for k in (1, 2, 3, 4, 5, 6, 7, 10, 11))

# Shapes: centres of the spheres, in sphere diameters.
TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(8)
ROD = np.array([[0.7 * k, 0, 0] for k in range(4)])
# Three distinct moments of inertia.
BENT = np.array([[0, 0, 0], [0.9, 0, 0], [0.9 + 0.5, 0.8, 0]])


def dimer(aspect_ratio: float) -> FloatArray:
    """Two spheres of diameter 1, `aspect_ratio` long in all."""
    return np.array([[0, 0, 0], [aspect_ratio - 1, 0, 0]])


@dataclass(frozen=True, eq=False)
class Bodies:
    """Spheres and the molecules that they belong to, 0 = free."""

    positions: FloatArray
    molecules: NDArray[np.int64]

    def moved(self, by: ArrayLike) -> Bodies:
        """Return them at another place."""
        return Bodies(self.positions + np.asarray(by), self.molecules)

    def joined(self, other: Bodies) -> Bodies:
        """Return these and others, whose molecules count on."""
        shift = np.where(other.molecules > 0, self.molecules.max(initial=0), 0)
        return Bodies(
            np.vstack([self.positions, other.positions]),
            np.concatenate([self.molecules, other.molecules + shift]),
        )


def placed(shape: ArrayLike, centre: ArrayLike, turn: ArrayLike = (0, 0, 0)) -> Bodies:
    """Return one body: a shape about its centroid, turned by a rotation vector, at a place."""
    spheres = np.asarray(shape, dtype=float)
    spheres = Rotation.from_rotvec(turn).apply(spheres - spheres.mean(axis=0))
    return Bodies(spheres + np.asarray(centre), np.ones(len(spheres), dtype=np.int64))


def random_bodies(
    shapes: Sequence[ArrayLike],
    radius: float,
    box: ArrayLike,
    seed: int,
    *,
    distance: float | None = None,
    inside: object = None,
) -> Bodies:
    """Bodies at random places, turned at random, a distance (default: touching) apart.

    The spheres' centres are in the box, and where `inside(centres)` is true for all.
    A shape of one sphere is a free sphere.
    """
    random = np.random.default_rng(seed)
    limits = np.asarray(box, dtype=float)
    apart = 2 * radius if distance is None else distance
    positions = np.empty((0, 3))
    molecules: list[int] = []
    number = 0
    for shape in shapes:
        spheres = 2 * radius * np.asarray(shape, dtype=float)
        spheres = spheres - spheres.mean(axis=0)
        for _ in range(20_000):
            turned = Rotation.from_quat(random.normal(size=4)).apply(spheres)
            trial = turned + random.uniform(limits[:, 0], limits[:, 1])
            if (trial < limits[:, 0]).any() or (trial > limits[:, 1]).any():
                continue
            if callable(inside) and not inside(trial).all():
                continue
            gaps = np.linalg.norm(trial[:, None] - positions, axis=2)
            if gaps.min(initial=np.inf) > apart:
                break
        else:
            raise AssertionError("no room for so many bodies")
        positions = np.vstack([positions, trial])
        number += len(spheres) > 1
        molecules += [number if len(spheres) > 1 else 0] * len(spheres)
    return Bodies(positions, np.array(molecules))


def rigid_velocities(
    bodies: Bodies, radii: ArrayLike, velocities: ArrayLike, spins: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Velocity and angular velocity of each sphere; both arguments are per molecule (m, 3)."""
    v, w = np.zeros_like(bodies.positions), np.zeros_like(bodies.positions)
    masses = np.broadcast_to(mass(radii), len(v))
    number = int(bodies.molecules.max())
    of_bodies = np.broadcast_to(velocities, (number, 3)), np.broadcast_to(spins, (number, 3))
    for molecule, velocity, spin in zip(range(1, number + 1), *of_bodies, strict=True):
        mine = bodies.molecules == molecule
        centre = masses[mine] @ bodies.positions[mine] / masses[mine].sum()
        v[mine] = velocity + np.cross(spin, bodies.positions[mine] - centre)
        w[mine] = spin
    return v, w


def body_motion(radii: ArrayLike, molecules: ArrayLike, inertia: str, options: str = "") -> str:
    """Return the commands that let bodies and free spheres move; the fix's ID is `bodies`."""
    belongs = np.asarray(molecules)
    sizes = np.broadcast_to(np.asarray(radii, dtype=float), len(belongs))
    lines = ["group bodies molecule > 0", "thermo_style custom step"]
    # Not `all`: LAMMPS takes all spheres without a molecule for one.
    lines += ["neigh_modify exclude molecule/intra bodies"]
    if (belongs == 0).any():
        lines += ["group free subtract all bodies", "fix motion free nve"]
    if inertia == "solid":
        return "\n".join([*lines, f"fix bodies bodies rigid/small molecule {options}"])
    # Fix rigid/small takes spheres without diameter for point masses.
    lines += ["set group bodies diameter 0"]
    lines += [f"fix bodies bodies rigid/small molecule reinit no {options}"]
    different = np.unique(sizes[belongs > 0])
    for k, size in enumerate(different):
        ids = " ".join(map(str, np.flatnonzero((belongs > 0) & (sizes == size)) + 1))
        lines += [f"group size{k} id {ids}", f"variable size{k} equal {2 * size:.17g}"]
        lines += [f"fix grow{k} size{k} adapt 0 atom diameter v_size{k} mass no"]
    lines += ["run 0", *(f"unfix grow{k}\ngroup size{k} delete" for k in range(len(different)))]
    return "\n".join(lines)


def body_scene(
    bodies: Bodies,
    radii: ArrayLike,
    folder: Path,
    *,
    inertia: str,
    options: str = "region container",
    rigid_options: str = "",
    skin: float | None = None,
    **settings: Any,
) -> str:
    """Return the deck of `scene` with rigid bodies in it, up to the first `run` of interest.

    `rigid_options` are for fix rigid/small. The skin is one diameter unless given.
    """
    sizes = np.broadcast_to(np.asarray(radii, dtype=float), len(bodies.positions))
    listed = 2 * float(sizes.max())
    listed += listed if skin is None else skin
    # A body on another rank must be seen whole when one of its spheres is.
    extent = 0.0
    for molecule in range(1, int(bodies.molecules.max()) + 1):
        mine = bodies.molecules == molecule
        centre = np.average(bodies.positions[mine], axis=0, weights=mass(sizes[mine]))
        arms = np.linalg.norm(bodies.positions[mine] - centre, axis=1)
        extent = max(extent, 2 * float(arms.max()))
    ghosts = f"mass 1 1.0\ncomm_modify cutoff {1.001 * (listed + extent):.17g}\n"
    deck = scene(
        bodies.positions,
        sizes,
        folder,
        molecules=bodies.molecules,
        style=BODY_STYLE,
        motion=body_motion(sizes, bodies.molecules, inertia, rigid_options),
        skin=listed - 2 * float(sizes.max()),
        options=f"{options} rigid bodies {inertia}",
        **{"thermo": BODY_THERMO} | settings,
    )
    return deck.replace("neigh_modify delay", ghosts + "neigh_modify delay")
