"""Counts, by linear algebra, the floppy modes and the states of self-stress of a packing.

The contacts of a packing at rest have normals n_c and act on free spheres (three degrees of
freedom) or dimers (five: turning about their axis changes nothing). H, of shape (contacts, degrees
of freedom), gives the speeds at which gaps open for given velocities. Velocities in its null space
are floppy modes, impulses in the null space of its transpose are states of self-stress:

    contacts - degrees of freedom = states of self-stress - floppy modes

(Calladine, Int. J. Solids Struct. 14 (1978) 161). Spheres and dimers with too few contacts to be
held are taken off first.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csc_matrix, csr_matrix, identity
from scipy.sparse.linalg import norm, splu

from lammps_inelastic.analysis import (
    ContactFrame,
    ParticleFrame,
    iterate_contact_frames,
    read_particle_frame,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# The walls of these decks; nothing reaches the lid.
CONTAINER = np.array([[0.0, 1.0], [0.0, np.inf], [0.0, 1.0]])

# Below this part of the largest eigenvalue of H^T H, the square of a part of 1e-5 of the largest
# singular value of H, an eigenvalue counts as zero. The smallest one that is none of round-off was
# above 1e-8 in nearly every bed, and above 1e-9 in all.
ZERO = 1e-10

# A sphere with fewer contacts is not held. (Dimers that are held by three or four are kept: they
# count as floppy, since a measurement may have missed one of their contacts.)
FEWEST = 3


@dataclass(frozen=True)
class Statics:
    """Of one frame.

    Attributes
    ----------
    degrees : of freedom, of the backbone
    contacts : in it
    floppy : floppy modes
    swings : those of one dimer alone, which turns about one of its spheres, because the other one
        has one contact or none: it lies on the floor, leans on a wall or hangs. No contact is
        missing there.
    """

    degrees: int
    contacts: int
    floppy: int
    swings: int

    @property
    def self_stress(self) -> int:
        return self.contacts - self.degrees + self.floppy


@dataclass(frozen=True)
class Backbone:
    """What a frame's contacts hold.

    Attributes
    ----------
    gaps : (m, degrees of freedom) H; turning is in units of velocity / diameter
    points : (m, 3) where the contacts are
    swings : in how many directions single dimers turn about one of their spheres
    """

    gaps: csr_matrix
    points: FloatArray
    swings: int


def backbone(particles: ParticleFrame, contacts: ContactFrame) -> Backbone:
    """Take off what is not held, and set up H for the rest."""
    order = np.argsort(particles.ids)
    ids, positions = particles.ids[order], particles.positions[order]
    spheres = np.arange(len(ids)) if particles.bodies is None else particles.bodies[order]
    bodies = np.unique(spheres, return_inverse=True)[1]
    diameter = 2 * float(particles.radii[0])

    # (m, 2); a wall is -1.
    spheres_of = np.where(contacts.ids > 0, np.searchsorted(ids, contacts.ids), -1)
    pairs = np.where(spheres_of < 0, -1, bodies[spheres_of])
    keep = np.ones(len(pairs), dtype=bool)
    while True:
        ends = pairs[keep].ravel()
        held = np.bincount(ends[ends >= 0], minlength=bodies.max() + 1) >= FEWEST
        still = keep & (held[pairs] | (pairs < 0)).all(axis=1)
        if (still == keep).all():
            break
        keep = still
    pairs, points, normals = pairs[keep], contacts.points[keep], contacts.normals[keep]

    sizes = np.bincount(bodies)
    assert sizes.max() <= 2, "larger clusters turn about every axis"
    centres = np.stack(
        [np.bincount(bodies, weights=positions[:, axis]) / sizes for axis in range(3)], axis=1
    )
    turns = _turns(positions, bodies, centres)
    degrees = 3 + turns.shape[1]
    columns = np.cumsum(held) - 1
    rows, places, values = [], [], []
    for side, sign in ((0, 1.0), (1, -1.0)):
        row = np.flatnonzero(pairs[:, side] >= 0)
        body = pairs[row, side]
        moments = np.cross(points[row] - centres[body], normals[row]) / diameter
        entries = np.concatenate(
            [normals[row], np.einsum("mij,mj->mi", turns[body], moments)], axis=1
        )
        rows.append(np.repeat(row, degrees))
        places.append((degrees * columns[body][:, None] + np.arange(degrees)).ravel())
        values.append(sign * entries.ravel())
    gaps = csr_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(places))),
        shape=(len(pairs), degrees * int(held.sum())),
    )
    touched = spheres_of[keep].ravel()
    counts = np.bincount(touched[touched >= 0], minlength=len(ids))
    # A sphere's two directions at right angles to its dimer's axis, less those that contacts hold
    free = np.maximum(2 - counts[held[bodies] & (sizes[bodies] == 2)], 0)
    return Backbone(gaps, points, int(free.sum()))


def _turns(positions: FloatArray, bodies: IntArray, centres: FloatArray) -> FloatArray:
    """Return two axes at right angles to each dimer's, (b, 2, 3); for spheres none, (b, 0, 3)."""
    if len(centres) == len(positions):
        return np.empty((len(centres), 0, 3))
    along = np.zeros_like(centres)
    along[bodies] = positions - centres[bodies]
    along /= np.linalg.norm(along, axis=1)[:, None]
    # The coordinate axis that is farthest from the dimer's gives a cross product that is not small.
    other = np.eye(3)[np.abs(along).argmin(axis=1)]
    first = np.cross(along, other)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(along, first)], axis=1)


def floppy_modes(gaps: csr_matrix) -> int:
    """Count the eigenvalues of H^T H that are zero.

    There are as many below a shift as a factorisation L D L^T of the shifted matrix has negative
    numbers in D (Sylvester's law of inertia).
    """
    product = (gaps.T @ gaps).tocsc()
    shift = ZERO * norm(product, 1)
    factors = splu(
        csc_matrix(product - shift * identity(product.shape[0], format="csc")),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    # Rows that are exchanged without the columns would make it another factorisation.
    assert (factors.perm_r == factors.perm_c).all()
    return int((factors.U.diagonal() < 0).sum())


def statics(particles: ParticleFrame, contacts: ContactFrame) -> Statics:
    """Analyse one frame."""
    held = backbone(particles, contacts)
    return Statics(held.gaps.shape[1], held.gaps.shape[0], floppy_modes(held.gaps), held.swings)


def statics_of_run(folder: Path) -> list[Statics]:
    """Analyse the measured frames of a run of spheres.in or dimers.in."""
    # The last frame of the particles serves them all: which sphere is of which dimer does not
    # change, and in the measured steps of a bed none turns by as much as 1e-3.
    particles = read_particle_frame(folder / "particles.lammpsdump")
    frames = iterate_contact_frames(folder / "contacts.lammpsdump")
    return [statics(particles, frame) for frame in frames]


def bulk_stress(folder: Path) -> float:
    """Return how much of the self-stress of a run's last frame is far from walls, in states.

    It is the part of the squared forces of the states of self-stress that is on contacts farther
    than 1.5 diameters from the walls, times the number of states.
    """
    particles = read_particle_frame(folder / "particles.lammpsdump")
    *_, frame = iterate_contact_frames(folder / "contacts.lammpsdump")
    held = backbone(particles, frame)
    product = (held.gaps @ held.gaps.T).toarray()
    _, stress = eigh(product, subset_by_value=(-np.inf, ZERO * np.abs(product).sum(axis=0).max()))
    walls = np.minimum(held.points - CONTAINER[:, 0], CONTAINER[:, 1] - held.points).min(axis=1)
    return float((stress[walls > 3 * float(particles.radii[0])] ** 2).sum())
