"""The two dump formats as LAMMPS writes them, so that every test says what its file holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

PARTICLE_COLUMNS = "id type x y z vx vy vz radius"
CONTACT_COLUMNS = "id1 id2 x y z nx ny nz gap force"

Rows = Sequence[Sequence[float]]
# Writes a dump into the test's folder: see the fixtures write_particles and write_contacts.
Writer = Callable[..., Path]


def frame_text(label: str, step: int, columns: str, rows: Rows, announced: int | None) -> str:
    """Return one frame as LAMMPS writes it, with a blank at the end of each row."""
    lines = [
        "ITEM: TIMESTEP",
        f"{step}",
        f"ITEM: NUMBER OF {label}",
        f"{len(rows) if announced is None else announced}",
        "ITEM: BOX BOUNDS ff ff ff",
        "0.0000000000000000e+00 1.0000000000000000e+00",
        "0.0000000000000000e+00 5.0000000000000000e+00",
        "0.0000000000000000e+00 1.0000000000000000e+00",
        f"ITEM: {label} {columns}",
        *(" ".join(f"{value:.17g}" for value in row) + " " for row in rows),
    ]
    return "".join(line + "\n" for line in lines)
