"""The page of a packing: a frame of a run with its contacts, to turn and to look into."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import (
    Cell,
    PackingView,
    ParticleFrame,
    contact_counts,
    contact_lines,
    write_view,
)
from lammps_inelastic.analysis.bodies import dimer_spheres
from lammps_inelastic.analysis.coordination import contact_sides
from lammps_inelastic.analysis.view import view_page

PAGE = "packing.html"
# A page of more spheres is some 30 megabytes, and turns slowly where the processor draws.
MOST_SPHERES = 300_000
# A report has packings of so many spheres at most, of two megabytes.
MOST_IN_REPORT = 20_000
# The direction with which orientations are compared: that of gravity in our decks.
UP = 1

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class KnownContacts:
    """The contacts of one frame, from a contact dump or by distance.

    Attributes
    ----------
    ids : (m, 2), as in a `ContactFrame`
    points : (m, 3), contact points, length
    forces : (m,), force; None where they are not known
    """

    ids: NDArray[np.int64]
    points: FloatArray
    forces: FloatArray | None


def draw_page(
    path: Path, frame: ParticleFrame, contacts: KnownContacts, packing_fraction: float
) -> None:
    """Write the page of a frame.

    Parameters
    ----------
    path : of the HTML file; the page has the name of its folder
    frame : the frame of a particle dump
    contacts : its contacts
    packing_fraction : what the caption says of it

    Raises PictureError where the file cannot be written.
    """
    title = path.resolve().parent.name or "Packing"
    write_view(path, view_of(frame, contacts, title, _caption(frame, packing_fraction)))


def packing_values(frame: ParticleFrame, contacts: KnownContacts) -> dict[str, NDArray[Any]]:
    """Return a frame and its contacts as a result keeps them, by the names in the schema."""
    kept = {
        "step": frame.step,
        "ids": frame.ids,
        "positions": frame.positions,
        "velocities": frame.velocities,
        "radii": frame.radii,
        "bodies": frame.bodies,
        "cell": np.vstack([frame.cell.origin, frame.cell.vectors]),
        "periodic": np.array(frame.cell.periodic, dtype=np.int64),
        "flat": int(frame.cell.flat),
        "contact_ids": contacts.ids,
        "contact_points": contacts.points,
        "contact_forces": contacts.forces,
    }
    return {f"packing/{name}": np.asarray(v) for name, v in kept.items() if v is not None}


def page_of_values(values: Mapping[str, NDArray[Any]], title: str, packing_fraction: float) -> str:
    """Return the page of a packing that a result keeps.

    Parameters
    ----------
    values : arrays by the names in the schema, those of `packing_values` among them
    title : title of the page
    packing_fraction : what the caption says of it
    """
    kept = {
        name.removeprefix("packing/"): value
        for name, value in values.items()
        if name.startswith("packing/")
    }
    periods = kept["periodic"].astype(bool).tolist()
    cell = Cell(kept["cell"][0], kept["cell"][1:], periods, flat=bool(kept["flat"]))
    frame = ParticleFrame(
        step=int(kept["step"]),
        ids=kept["ids"],
        positions=kept["positions"],
        velocities=kept.get("velocities"),
        radii=kept["radii"],
        bodies=kept.get("bodies"),
        cell=cell,
        boundaries=None,
    )
    contacts = KnownContacts(
        kept["contact_ids"], kept["contact_points"], kept.get("contact_forces")
    )
    return view_page(view_of(frame, contacts, title, _caption(frame, packing_fraction)))


def _caption(frame: ParticleFrame, packing_fraction: float) -> str:
    what = "bodies" if frame.particles.composite else "spheres"
    count = f"{len(frame.particles):,} {what}"
    return f"{count}, step {frame.step}, packing fraction {packing_fraction:.4f}"


def view_of(frame: ParticleFrame, contacts: KnownContacts, title: str, caption: str) -> PackingView:
    """Return what the page of a frame shows."""
    lines = contact_lines(contacts.ids, frame.ids, frame.spheres, contacts.points)
    at_wall = lines.sides[:, 1] < 0
    forces = contacts.forces
    if forces is not None:
        forces = np.concatenate([forces[~at_wall], forces[at_wall]])
    return PackingView(
        frame.spheres,
        ids=frame.ids,
        contacts=lines.ends[~at_wall],
        walls=lines.ends[at_wall],
        forces=forces,
        numbers=_numbers(frame, contacts),
        title=title,
        caption=caption,
    )


def _numbers(frame: ParticleFrame, contacts: KnownContacts) -> dict[str, FloatArray]:
    """Return what spheres can be coloured by; those of one body have the same numbers."""
    particles, images = frame.particles, frame.cell.has_images
    index, count = particles.index, len(particles)
    counted = contact_counts(contacts.ids, frame.ids, particles, images=images)
    numbers = {"contacts": counted.particles.astype(np.float64)[index]}
    if contacts.forces is not None:
        sides = contact_sides(contacts.ids, frame.ids, particles, images=images)
        sums = np.zeros(count)
        for side in sides.T:
            of_particle = side >= 0
            strengths = np.abs(contacts.forces[of_particle])
            sums += np.bincount(side[of_particle], weights=strengths, minlength=count)
        numbers["sum of forces"] = sums[index]
    if frame.velocities is not None:
        means = [np.bincount(index, weights=v, minlength=count) for v in frame.velocities.T]
        velocities = np.column_stack(means) / particles.sizes[:, None]
        numbers["speed"] = np.linalg.norm(velocities, axis=1)[index]
    if (particles.sizes == 2).all():
        first, second = dimer_spheres(particles)
        axes = frame.spheres.positions[second] - frame.spheres.positions[first]
        lengths = np.linalg.norm(axes, axis=1)
        # Spheres in one place have no direction.
        cosines = np.abs(axes[:, UP]) / np.where(lengths > 0, lengths, 1.0)
        numbers["orientation: 1 stands, 0 lies"] = cosines[index]
    return numbers
