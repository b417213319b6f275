"""A packing: arrays, contacts, numbers of the packing deep inside, and files for other programs."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from lammps_inelastic.analysis import (
    ContactCounts,
    ContactFrame,
    PackingMeasurement,
    ParticleFrame,
    Particles,
    Unrest,
    box_in_bed,
    contact_counts,
    iterate_contact_frames,
    largest_pair_overlap,
    measure_packing,
    read_particle_frame,
    read_run_log,
    write_contacts_vtk,
    write_csv,
    write_json,
    write_pqr,
    write_raw,
    write_stl,
    write_tiff,
    write_view,
    write_vtk,
    write_xyz,
)
from lammps_inelastic.analysis.geometry import FloatArray, IntArray

from ..errors import PackingError
from ..files import whole, writing
from ..looking.view import KnownContacts, view_of
from ..provenance.finished import CONTACTS, LOG, PARTICLES
from .containers import Ball, Container
from .shapes import Shape

# The seed of the random points is that of `inelastic look`.
SEED = 1
# A packing is saved in these files, by the endings of their names.
ENDINGS = (
    *(".csv", ".npz", ".json", ".pqr", ".xyz", ".extxyz"),
    *(".vtu", ".vtp", ".html", ".stl", ".tif", ".raw"),
)
# Of these, these are lists of the spheres, and these are images.
OF_SPHERES: Mapping[str, Callable[..., object]] = {
    ".csv": write_csv,
    ".json": write_json,
    ".vtu": write_vtk,
    ".xyz": write_xyz,
    ".extxyz": write_xyz,
}
OF_VOXELS: Mapping[str, Callable[..., object]] = {".tif": write_tiff, ".raw": write_raw}
# The smallest radius is so many voxels long, if no other size is given.
VOXELS_PER_RADIUS = 10


@dataclass(frozen=True, eq=False, repr=False)
class Packing:
    """Particles in a container, at rest unless one has asked otherwise.

    A particle is a sphere, or a rigid body of spheres.

    Attributes
    ----------
    shape : of the particles
    container : that they lie in, with its height
    frame : the spheres, ordered by id
    contact_frames : the contacts in each of the last steps
    unrest : how far it is from rest: `at_rest`, `speed`, `net_force`
    folder : of LAMMPS's run; a temporary one goes with the packing
    """

    shape: Shape
    container: Container
    frame: ParticleFrame
    contact_frames: tuple[ContactFrame, ...] = field(repr=False)
    unrest: Unrest
    folder: Path

    @property
    def at_rest(self) -> bool:
        """Whether it is at rest: rms speed at most 0.1 g h, and the walls carry the weight."""
        return self.unrest.at_rest

    @property
    def words(self) -> str:
        """What is packed in what."""
        return f"{len(self.particles)} {self.shape.plural} in {self.container.words}"

    @property
    def positions(self) -> FloatArray:
        """The centres of the spheres, (n, 3), length."""
        return self.frame.positions

    @property
    def radii(self) -> FloatArray:
        """The radii of the spheres, (n,), length."""
        return self.frame.radii

    @property
    def bodies(self) -> IntArray:
        """The body of each sphere, (n,), from 1 on; 0 for a free sphere."""
        bodies = self.frame.bodies
        return np.zeros(len(self.radii), dtype=np.int64) if bodies is None else bodies

    @property
    def particles(self) -> Particles:
        """Which spheres make up which particle."""
        return self.frame.particles

    @property
    def contacts(self) -> ContactFrame:
        """The contacts that carry a force, at the end: ids, points, normals, gaps, forces."""
        return self.contact_frames[-1]

    @property
    def forces(self) -> FloatArray:
        """The force of each contact, (m,), mass length/time^2."""
        return self.contacts.forces

    @cached_property
    def box(self) -> FloatArray | None:
        """A box deep in the bed, (3, 2), length, for its numbers; None if the bed has no such part.

        It is half as wide as the container and ends where the bed ends; from the floor it keeps a
        quarter of the smallest of the widths and the height of the bed. In a ball it is the largest
        of some with their corners a fifteenth of the diameter away from the wall. A bed that is
        less than two largest diameters wide or high has none.
        """
        boxes = [
            box for column in self.container.columns if (box := self._part(column)) is not None
        ]
        return max(boxes, key=_volume, default=None)

    @property
    def packing_fraction(self) -> float | None:
        """Packing fraction in `box`, exact for spheres and dimers; None without a box."""
        return None if self._measured is None else self._measured.packing_fraction.value

    @property
    def coordination_number(self) -> float | None:
        """Mean number of contacts with other particles, of those in `box`; None without a box."""
        if self._measured is None or self._measured.coordination is None:
            return None
        return self._measured.coordination.mean

    @cached_property
    def largest_overlap(self) -> float:
        """The largest overlap of two particles, or of one with a wall, length; 0 for none."""
        pair = largest_pair_overlap(self.frame.spheres).depth
        wall = self.radii - self.container.distances(self.positions)
        return max(float(pair), float(wall.max()), 0.0)

    def measure(self, box: ArrayLike) -> PackingMeasurement:
        """Measure the packing in a box of your own, as `inelastic look --box` does.

        Parameters
        ----------
        box : (3, 2), lower and upper bound per axis, length
        """
        return measure_packing(
            self.frame, self._counts, box, seed=SEED, walls=self.container.bounds
        )

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        box: ArrayLike | None = None,
        voxel: float | None = None,
        subdivisions: int = 2,
    ) -> Path:
        """Save the packing; the ending of the name says as what.

        | ending | file |
        |---|---|
        | none | the folder of LAMMPS's run, as `inelastic look` reads it, with the deck |
        | .csv | a table of the spheres: id, body, x, y, z, radius, contacts |
        | .npz | NumPy's arrays positions, radii, bodies, contact_ids, contact_points, forces |
        | .xyz, .extxyz | OVITO, ASE: places, radii, ids, bodies, contacts |
        | .vtu | ParaView: the same |
        | .vtp | ParaView, OVITO: the contacts as lines, with forces |
        | .html | a page for a browser, to turn and to look into |
        | .json | places, radii, ids, bodies, contacts and the box, for scripts |
        | .pqr | MDAnalysis: places and radii |
        | .stl | triangles of the surfaces of the spheres |
        | .tif, .raw | an image of voxels, 255 in a particle and 0 in a pore |

        Parameters
        ----------
        path : of the file or folder; a file of that name is replaced, a folder is not
        box : (3, 2), box of an image; without, the container up to the top of the highest sphere
        voxel : edge of a voxel, length; without, a tenth of the smallest radius
        subdivisions : each sphere of stl has 20 x 4^subdivisions faces

        Returns
        -------
        the path

        Raises PackingError for an ending that is none of these and for a folder that is there,
        AnalysisError or WriteError if it cannot be written.
        """
        target = Path(path)
        ending = _ending_of(target)
        frame, spheres = self.frame, self.frame.spheres
        if ending in OF_SPHERES:
            lists = {"ids": frame.ids, "bodies": frame.bodies, "contacts": frame.contacts}
            OF_SPHERES[ending](target, spheres, **lists)
        elif ending in OF_VOXELS:
            edge = float(self.radii.min()) / VOXELS_PER_RADIUS if voxel is None else voxel
            OF_VOXELS[ending](target, spheres, self._filled if box is None else box, edge)
        elif ending == ".stl":
            write_stl(target, spheres, subdivisions=subdivisions)
        else:
            self._save_other(target, ending)
        return target

    def __repr__(self) -> str:
        """Return the main numbers, one a line."""
        small, large = 2 * float(self.radii.min()), 2 * float(self.radii.max())
        counts = self._counts[-1]
        rest = "yes" if self.at_rest else f"NOT AT REST: {self.unrest.words}"
        rows = [
            ("at rest", rest),
            ("diameter", f"{small:g}" if small == large else f"{small:g} to {large:g}"),
            ("packing fraction", _number(self.packing_fraction, ".4f")),
            ("coordination number", _number(self.coordination_number, ".3f")),
            ("measured in", "no box: the bed is too small" if self.box is None else _box(self.box)),
            ("contacts", f"{counts.particles.sum() // 2}, with walls {counts.walls.sum()}"),
            ("largest overlap", f"{self.largest_overlap:.2g}"),
        ]
        return "\n".join([self.words, *(f"  {name:<20} {value}" for name, value in rows)])

    @cached_property
    def _counts(self) -> list[ContactCounts]:
        frame = self.frame
        return [contact_counts(one.ids, frame.ids, frame.particles) for one in self.contact_frames]

    @cached_property
    def _measured(self) -> PackingMeasurement | None:
        return None if self.box is None else self.measure(self.box)

    @property
    def _filled(self) -> FloatArray:
        """The container up to the top of the highest sphere, (3, 2), length."""
        bounds = self.container.bounds
        bounds[1, 1] = min(bounds[1, 1], float((self.positions[:, 1] + self.radii).max()))
        return bounds

    def _part(self, column: FloatArray) -> FloatArray | None:
        """Return the part of a column, (3, 2), that is deep in the bed; None if there is none."""
        bounds = self.container.bounds
        part = box_in_bed(self.frame.spheres, column, bounds).inside
        if part is None:
            return None
        box = part.copy()
        widths = np.diff(bounds[[0, 2]], axis=1)
        margin = min(float(widths.min()), box[1, 1] - bounds[1, 0]) / 4
        # A box that is nearer to a wall than the spheres at it are holds gaps that no bed has.
        if margin < self.radii.max():
            return None
        if not isinstance(self.container, Ball):
            box[1, 0] = max(box[1, 0], bounds[1, 0] + margin)
        if not (box[:, 0] < box[:, 1]).all() or not self.frame.spheres.particles_in(box).any():
            return None
        return box

    def _save_other(self, target: Path, ending: str) -> None:
        frame = self.frame
        match ending:
            case ".npz":
                self._save_npz(target)
            case ".vtp":
                write_contacts_vtk(target, self.contacts, frame.ids, frame.spheres)
            case ".html":
                known = KnownContacts(self.contacts.ids, self.contacts.points, self.forces)
                write_view(target, view_of(frame, known, target.stem, self.words))
            case ".pqr":
                write_pqr(target, frame.spheres, ids=frame.ids)
            case _:
                self._save_folder(target)

    def _save_folder(self, target: Path) -> None:
        if target.exists():
            raise PackingError(f"{target}: is there already, and is not replaced")
        with writing(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=f".{target.name}.", dir=target.parent) as part:
                copy = Path(part) / "run"
                shutil.copytree(self.folder, copy)
                copy.rename(target)

    def _save_npz(self, target: Path) -> None:
        with whole(target) as file, file.open("wb") as stream:
            np.savez_compressed(
                stream,
                positions=self.positions,
                radii=self.radii,
                bodies=self.bodies,
                contact_ids=self.contacts.ids,
                contact_points=self.contacts.points,
                forces=self.forces,
            )


class NotAtRestError(PackingError):
    """A packing that still moves; `packing` is that packing."""

    def __init__(self, packing: Packing) -> None:
        """Keep what has been packed."""
        super().__init__(
            f"{packing.words} are NOT AT REST: {packing.unrest.words}; must_rest=False returns "
            "them as they are, and so does this error's packing"
        )
        self.packing = packing


def _ending_of(target: Path) -> str:
    """Return the ending of a file's name; raise PackingError for one that says nothing."""
    ending = target.suffix.lower()
    if ending not in ("", *ENDINGS):
        raise PackingError(
            f"{target}: the name must end in {', '.join(ENDINGS)}, or have no ending for a folder"
        )
    return ending


def read_packing(folder: Path, shape: Shape, container: Container) -> Packing:
    """Read the packing that LAMMPS has left in a folder. Raises AnalysisError."""
    frame = read_particle_frame(folder / PARTICLES)
    contacts = tuple(iterate_contact_frames(folder / CONTACTS))
    unrest = read_run_log(folder / LOG).unrest_at(frame.step)
    if unrest is None:
        raise PackingError(f"{folder / LOG}: does not tell whether the packing is at rest")
    return Packing(shape, container, frame, contacts, unrest, folder)


def _volume(box: FloatArray) -> float:
    return float(np.prod(box[:, 1] - box[:, 0]))


def _number(value: float | None, layout: str) -> str:
    return "not known" if value is None else format(value, layout)


def _box(box: FloatArray) -> str:
    ranges = zip("xyz", box.tolist(), strict=True)
    return ", ".join(f"{axis} {low:.4g} to {high:.4g}" for axis, (low, high) in ranges)
