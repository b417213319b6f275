"""A study of a few spheres, which takes a second a case."""

from __future__ import annotations

from pathlib import Path

TINY = """
title = "A few spheres"
deck = "spheres"
[parameters]
particles = 30
diameter = 0.2
steps_agitated = 20
steps_settling = 40
steps_resting = 20
waiting = 0
steps_tightening = 10
steps_measuring = 5
dump_every = 20
seed = {seeds}
[outputs]
box = [0.1, 0.9, 0, 0.2, 0.1, 0.9]
points = 1000
structure = false
"""


def write_data(path: Path, diameter: float) -> None:
    """Write 27 spheres on a lattice in the container, as LAMMPS reads them."""
    places = [
        (0.2 + 0.3 * i, 0.2 + 0.3 * j, 0.2 + 0.3 * k)
        for i in range(3)
        for j in range(3)
        for k in range(3)
    ]
    rows = [f"{n} 1 {diameter} 1 {x} {y} {z}" for n, (x, y, z) in enumerate(places, 1)]
    head = ["Spheres", "", f"{len(rows)} atoms", "1 atom types", "", "0 1 xlo xhi", "0 5 ylo yhi"]
    text = [*head, "0 1 zlo zhi", "", "Atoms # sphere", "", *rows]
    path.write_text("\n".join(text) + "\n")
