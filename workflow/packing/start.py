"""A start of particles of several sizes: random places and directions, as a LAMMPS data file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy

from lammps_inelastic.analysis.geometry import FloatArray

from .containers import Container
from .shapes import Shape


def write_start(
    path: Path,
    shape: Shape,
    diameters: FloatArray,
    container: Container,
    density: float,
    random: np.random.Generator,
) -> None:
    """Write particles at random places; they may overlap one another, but no wall.

    Parameters
    ----------
    path : of the data file
    shape : of the particles
    diameters : (p,), diameter of the spheres of each particle, length
    container : with a height
    density : mass/length^3
    random : from which places and directions are drawn
    """
    count, each = len(diameters), len(shape.points)
    centres = container.draw(shape.room * diameters / 2, random)
    turns = scipy.spatial.transform.Rotation.random(count, random)
    arms = np.stack([turns.apply(point) for point in shape.points], axis=1)
    positions = (centres[:, None] + arms * diameters[:, None, None]).reshape(-1, 3)
    size = np.repeat(diameters, each)
    number = np.arange(1, len(size) + 1)
    columns = [number, np.ones_like(number), positions, size, np.full(len(size), density)]
    if each > 1:
        columns.append(np.repeat(np.arange(1, count + 1), each))
    faces = (f"{low!r} {high!r}" for low, high in container.bounds.tolist())
    bounds = [f"{face} {axis}lo {axis}hi" for face, axis in zip(faces, "xyz", strict=True)]
    head = ["Particles at random places", "", f"{len(size)} atoms", "1 atom types", *bounds]
    layout = "%d %d" + " %.17g" * 5 + (" %d" if each > 1 else "")
    # The columns are those of LAMMPS's atom_style hybrid sphere 1 molecular, or sphere.
    if each == 1:
        columns = [columns[0], columns[1], columns[3], columns[4], columns[2]]
    text = "\n".join([*head, "", "Atoms", ""])
    np.savetxt(path, np.column_stack(columns), layout, header=text, comments="")
