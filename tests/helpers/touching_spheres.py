"""Small packings in all kinds of cells, whose contacts are found by looking at every image."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import Cell, ContactFrame, Spheres
from lammps_inelastic.analysis.geometry import FloatArray, IntArray

# Each cell encloses the unit cube, or a parallelogram of about the same size.
CELLS = {
    "open": Cell.of_box([[0, 1]] * 3),
    "periodic": Cell.of_box([[-0.25, 0.75], [0, 1], [2, 3]], (True, True, True)),
    "along x": Cell.of_box([[0, 1], [0, 2], [0, 1]], (True, False, False)),
    "tilted": Cell([0.5, 0, 0], [[1, 0, 0], [0.4, 1, 0], [-0.3, 0.45, 1]], (True, True, True)),
    "tilted, open along c": Cell(
        [0, -1, 0], [[1.2, 0, 0], [0.5, 1, 0], [0.25, 0.25, 1]], (True, True, False)
    ),
    # The largest spheres touch their own images, and some pairs touch twice.
    "narrow": Cell.of_box([[0, 0.55], [0, 2], [0, 2]], (True, True, True)),
    "flat": Cell([0, 0, -0.5], [[1, 0, 0], [0.3, 1, 0], [0, 0, 1]], (True, True, True), flat=True),
}
PERIODIC = [name for name, cell in CELLS.items() if cell.has_images]


@dataclass(frozen=True, eq=False)
class Scene:
    """Spheres and their contacts.

    Attributes
    ----------
    ids : (n,), ids of the spheres
    spheres : n spheres, in the cell
    contacts : m contacts; the last two are with walls 1 and 2
    images : (m, 3), by how many periods the second sphere of each is moved
    """

    ids: IntArray
    spheres: Spheres
    contacts: ContactFrame
    images: IntArray


def scene(name: str, count: int = 12) -> Scene:
    """Return spheres at random places in one of the cells, and all their contacts."""
    generator = np.random.default_rng(7)
    cell = CELLS[name]
    shares = generator.uniform(0, 1, (count, 3))
    if cell.flat:
        shares[:, 2] = 0.5
    positions = cell.origin + shares @ cell.vectors
    radii = generator.uniform(0.1, 0.3, count)
    ids = generator.permutation(3 * count)[:count] + 1
    steps = [range(-3, 4) if flag else (0,) for flag in cell.periodic]
    sides, images, points, normals, gaps = [], [], [], [], []
    for one, other in product(range(count), repeat=2):
        for step in product(*steps):
            # Each contact is there once; a sphere and its own image stand for two of them.
            if (one, (0, 0, 0)) >= (other, step):
                continue
            apart = positions[one] - positions[other] - np.array(step) @ cell.vectors
            distance = float(np.linalg.norm(apart))
            gap = distance - radii[one] - radii[other]
            if gap >= 0:
                continue
            sides.append([ids[one], ids[other]])
            images.append(step)
            normals.append(apart / distance)
            gaps.append(gap)
            # A dump may tell the point in any image.
            anywhere = generator.integers(-1, 2, 3) * cell.periodic @ cell.vectors
            points.append(positions[one] - (radii[one] + gap / 2) * normals[-1] + anywhere)
    for wall in (1, 2):
        sides.append([ids[wall], -wall])
        images.append((0, 0, 0))
        normals.append([0.0, 1.0, 0.0])
        gaps.append(-1e-6)
        points.append(positions[wall] - [0, radii[wall], 0])
    forces = generator.exponential(2, len(gaps))
    contacts = ContactFrame(
        90, np.array(sides), np.array(points), np.array(normals), np.array(gaps), forces
    )
    return Scene(ids, Spheres(positions, radii, cell=cell), contacts, np.array(images))


def lengths(scene: Scene, contact: NDArray[np.int64]) -> FloatArray:
    """Return the distances of the centres of spheres in contact, or of centre and wall."""
    index = {int(number): place for place, number in enumerate(scene.ids)}
    radii = scene.spheres.radii
    sums = []
    for row in contact.tolist():
        one, other = scene.contacts.ids[row].tolist()
        gap = scene.contacts.gaps[row]
        sums.append(radii[index[one]] + (radii[index[other]] + gap if other > 0 else 0))
    return np.array(sums)


def turned(found: NDArray[Any], sides: NDArray[Any], expected: NDArray[Any]) -> NDArray[Any]:
    """Turn vectors, (m, 3), of contacts of a sphere with its own image to the expected side.

    Either side of the sphere is right: both stand for the same contact.
    """
    away = (sides[:, 0] == sides[:, 1]) & ((found * expected).sum(axis=1) < 0)
    return np.where(away[:, None], -found, found)
