"""Decks, starts and dumps for the tests of the fix. All in `units lj`, density 1."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

FloatArray = NDArray[np.float64]

GRAVITY = 9.81
DEFAULT_BOX = ((0.0, 1.0), (0.0, 5.0), (0.0, 1.0))
CONTACT_NAMES = "id1 id2 x y z nx ny nz gap force"
# The columns that the shipped decks write, at every step.
DUMP_PARTICLES = """
dump particles all custom 1 particles.dump id type x y z vx vy vz radius
dump_modify particles sort id format float %.17g
"""
DUMP_CONTACTS = (
    "dump contacts all local 1 contacts.dump "
    + " ".join(f"f_contact[{k}]" for k in range(1, 11))
    + "\ndump_modify contacts format float %.17g "
    + " ".join(f"colname {k} {name}" for k, name in enumerate(CONTACT_NAMES.split(), 1))
    + "\n"
)
DUMP_FORCES = """
dump forces all custom 1 forces.dump id &
     f_contact[1] f_contact[2] f_contact[3] f_contact[4] f_contact[5]
dump_modify forces sort id format float %.17g colname 2 particles colname 3 walls &
     colname 4 fx colname 5 fy colname 6 fz
"""

# How ranks share the box: what stands before it, what balances it, number of ranks.
DIVISIONS = {
    "default": ("", "", 2),
    "x": ("processors 2 1 1", "", 2),
    "height": ("processors 1 2 1", "", 2),
    "z": ("processors 1 1 2", "", 2),
    "newton-off": ("newton off", "", 2),
    "newton-off-one-rank": ("newton off", "", 1),
    "tiled": ("comm_style tiled", "", 2),
    "rcb": ("comm_style tiled", "fix balance all balance 10 1.0 rcb", 2),
    "rcb-newton-off": ("comm_style tiled\nnewton off", "fix balance all balance 10 1.0 rcb", 2),
    "shift": ("processors 1 2 1", "fix balance all balance 7 1.0 shift y 10 1.0", 2),
    "sorted-rarely": ("atom_modify sort 7 0.1", "", 1),
}


def mass(radius: ArrayLike) -> FloatArray:
    """Mass of spheres of density 1."""
    return 4.0 / 3.0 * np.pi * np.asarray(radius, dtype=float) ** 3


def scene(
    positions: ArrayLike,
    radii: ArrayLike,
    folder: Path,
    *,
    tolerance: float,
    velocities: ArrayLike | None = None,
    box: Sequence[Sequence[float]] = DEFAULT_BOX,
    boundary: str = "f f f",
    timestep: float = 0.005,
    skin: float | None = None,
    gravity: bool = True,
    options: str = "region container",
    setup: str = "",
    fixes: str = "",
    motion: str = "fix motion all nve",
    group: str = "all",
    thermo: str = "step ke f_contact[1] f_contact[2] f_contact[3] f_contact[4] f_contact[5] "
    "f_contact[6]",
    style: str = "atom_style sphere",
    molecules: ArrayLike | None = None,
    spins: ArrayLike = (0.0, 0.0, 0.0),
) -> str:
    """Return a deck up to its first `run`, and write the spheres' data file beside it.

    `setup` stands before the box is made, `fixes` before the contact fix. The box is a region named
    container. LAMMPS's box is larger by 1 than the container in directions that are not periodic.
    With `molecules` (0 = none) the style must be BODY_STYLE. `spins` are angular velocities.
    """
    centres = np.atleast_2d(np.asarray(positions, dtype=float))
    radius = np.broadcast_to(np.asarray(radii, dtype=float), len(centres))
    velocity = np.zeros_like(centres)
    velocity[:] = 0.0 if velocities is None else velocities
    spin = np.broadcast_to(np.asarray(spins, dtype=float), centres.shape)
    columns = [""] * len(centres)
    if molecules is not None:
        columns = [f" {molecule}" for molecule in np.asarray(molecules, dtype=int)]
    limits = np.asarray(box, dtype=float)
    room = [0.0 if flag.startswith("p") else 1.0 for flag in boundary.split()]
    folder.mkdir(parents=True, exist_ok=True)
    names = (("xlo", "xhi"), ("ylo", "yhi"), ("zlo", "zhi"))
    lines = ["# spheres", "", f"{len(centres)} atoms", "1 atom types", ""]
    for (lower, upper), (low, high), extra in zip(names, limits, room, strict=True):
        lines.append(f"{low - extra:.17g} {high + extra:.17g} {lower} {upper}")
    lines += ["", "Atoms", ""]
    for number, (x, r, molecule) in enumerate(zip(centres, radius, columns, strict=True), 1):
        size, place = f"{2 * r:.17g} 1.0", f"{x[0]:.17g} {x[1]:.17g} {x[2]:.17g}"
        # A hybrid style has the coordinates first.
        lines.append(
            f"{number} 1 {place} {size}{molecule}" if molecule else f"{number} 1 {size} {place}"
        )
    lines += ["", "Velocities", ""]
    for number, (v, w) in enumerate(zip(velocity, spin, strict=True), 1):
        lines.append(f"{number} " + " ".join(f"{value:.17g}" for value in (*v, *w)))
    (folder / "spheres.data").write_text("\n".join(lines) + "\n")

    largest = 2 * float(radius.max())
    faces = " ".join(f"{value:.17g}" for value in limits.ravel())
    return f"""
units lj
{style}
atom_modify map array
boundary {boundary}
{setup}
read_data spheres.data
region container block {faces}
pair_style zero {largest:.17g}
pair_coeff * *
neighbor {0.3 * largest if skin is None else skin:.17g} bin
neigh_modify delay 0 every 1 check yes
timestep {timestep:.17g}
{f"fix gravity all gravity {GRAVITY} vector 0 -1 0" if gravity else ""}
{fixes}
{motion}
fix contact {group} inelastic {tolerance:.17g} {options}
thermo 1
thermo_style custom {thermo}
thermo_modify norm no lost error format float %.17g
"""


def wall_force_variables(walls: int) -> str:
    """Return variables wx1, wy1, wz1, wx2, ...: the force on each wall."""
    return "".join(
        f"variable w{axis}{wall} equal f_contact[{wall}][{column}]\n"
        for wall in range(1, walls + 1)
        for column, axis in enumerate("xyz", 1)
    )


def random_points(
    count: int, box: ArrayLike, distance: float, seed: int, inside: object = None
) -> FloatArray:
    """Random points in a box, at least a distance apart; `inside(points)` may restrict them."""
    random = np.random.default_rng(seed)
    limits = np.asarray(box, dtype=float)
    points = np.empty((0, 3))
    for _ in range(10_000):
        batch = random.uniform(limits[:, 0], limits[:, 1], size=(count, 3))
        if callable(inside):
            batch = batch[inside(batch)]
        for point in batch:
            if len(points) == 0 or np.min(np.sum((points - point) ** 2, axis=1)) > distance**2:
                points = np.vstack([points, point])
            if len(points) == count:
                return points
    raise AssertionError("no room for so many points")


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame of a dump: `frame["x"]` is a column, `frame.positions` three of them."""

    step: int
    columns: tuple[str, ...]
    rows: FloatArray

    def __getitem__(self, name: str) -> FloatArray:
        """Return a column."""
        return self.rows[:, self.columns.index(name)]

    def vectors(self, names: str) -> FloatArray:
        """Return some columns, (n, number of names)."""
        return self.rows[:, [self.columns.index(name) for name in names.split()]]

    @property
    def positions(self) -> FloatArray:
        """Return (n, 3), length."""
        return self.vectors("x y z")

    @property
    def velocities(self) -> FloatArray:
        """Return (n, 3), length / time."""
        return self.vectors("vx vy vz")


def read_dump(path: Path) -> list[Frame]:
    """Read all frames of a text dump."""
    return list(_frames(path))


def _frames(path: Path) -> Iterator[Frame]:
    lines = path.read_text().splitlines()
    at = 0
    while at < len(lines):
        count = int(lines[at + 3])
        columns = tuple(lines[at + 8].split()[2:])
        values = " ".join(lines[at + 9 : at + 9 + count]).split()
        yield Frame(
            int(lines[at + 1]),
            columns,
            np.array(values, dtype=float).reshape(count, len(columns)),
        )
        at += 9 + count


def deepest_pair(
    positions: FloatArray,
    radii: FloatArray,
    periods: Sequence[float] | None = None,
    molecules: FloatArray | None = None,
) -> float:
    """Largest r_i + r_j - |x_i - x_j| over all pairs, not below 0. `periods`: 0 = not periodic.

    With `molecules` pairs within one of them (but 0) do not count.
    """
    if periods is None:
        tree = KDTree(positions)
    else:
        positions = positions.copy()
        for axis, period in enumerate(periods):
            if period > 0:
                positions[:, axis] %= period
        tree = KDTree(positions, boxsize=periods)
    pairs = tree.query_pairs(2 * radii.max(), output_type="ndarray")
    if molecules is not None:
        first, second = molecules[pairs].T
        pairs = pairs[(first != second) | (first == 0)]
    if len(pairs) == 0:
        return 0.0
    apart = positions[pairs[:, 0]] - positions[pairs[:, 1]]
    for axis, period in enumerate(periods or ()):
        if period > 0:
            apart[:, axis] -= period * np.rint(apart[:, axis] / period)
    depth = radii[pairs].sum(axis=1) - np.linalg.norm(apart, axis=1)
    return max(0.0, float(depth.max()))


def deepest_in_box(positions: FloatArray, radii: FloatArray, box: ArrayLike = DEFAULT_BOX) -> float:
    """Largest depth of a sphere in one of the six walls, not below 0."""
    limits = np.asarray(box, dtype=float)
    size = radii[:, None]
    depth = np.maximum(size - (positions - limits[:, 0]), size - (limits[:, 1] - positions))
    return max(0.0, float(depth.max()))
