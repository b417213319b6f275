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
from scipy.linalg import svd

from lammps_inelastic.analysis import iterate_contact_frames, read_particle_frame

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# The walls of these decks; nothing reaches the lid.
CONTAINER = np.array([[0.0, 1.0], [0.0, np.inf], [0.0, 1.0]])


@dataclass(frozen=True)
class Statics:
    """Of one frame; `degrees` are those of the backbone, `bulk_stress` the weight, in states, that
    the self-stress has on contacts farther than 1.5 diameters from the walls of a box.
    """

    degrees: int
    contacts: int
    floppy: int
    self_stress: int
    bulk_stress: float


def statics(
    positions: FloatArray,
    bodies: IntArray,
    first: IntArray,
    second: IntArray,
    points: FloatArray,
    normals: FloatArray,
    diameter: float,
    box: FloatArray,
) -> Statics:
    """Analyse one frame.

    Parameters
    ----------
    positions : (n, 3) centres of the spheres
    bodies : (n,) which body each sphere belongs to, from 0
    first, second : (m,) index of the spheres of each contact; second is -1 for a wall
    points, normals : (m, 3), normals from second to first
    diameter : of the spheres
    box : (3, 2), infinite where there is no wall
    """
    # Fewer contacts hold no sphere. (Dimers that are held by three or four are kept: they count as
    # floppy, since a measurement may have missed one of their contacts.)
    least = 3
    one = bodies[first]
    two = np.where(second >= 0, bodies[second], -1)
    keep = np.ones(len(first), dtype=bool)
    while True:
        ends = np.concatenate([one[keep], two[keep]])
        counts = np.bincount(ends[ends >= 0], minlength=bodies.max() + 1)
        held = counts >= least
        still = keep & held[one] & ((two < 0) | held[two])
        if (still == keep).all():
            break
        keep = still
    one, two, points, normals = one[keep], two[keep], points[keep], normals[keep]
    held_bodies = np.flatnonzero(counts >= least)
    columns, centres, axes = {}, {}, {}
    degrees = 0
    for body in held_bodies:
        x = positions[bodies == body]
        columns[int(body)] = degrees
        centres[int(body)] = x.mean(axis=0)
        if len(x) == 1:
            axes[int(body)] = np.empty((0, 3))
            degrees += 3
        else:
            axis = (x[1] - x[0]) / np.linalg.norm(x[1] - x[0])
            axes[int(body)] = np.linalg.svd(axis[None, :])[2][1:]
            degrees += 5
    rows = np.zeros((len(one), degrees))
    for sign, bodies_of in ((1.0, one), (-1.0, two)):
        for row, (body, point, normal) in enumerate(zip(bodies_of, points, normals, strict=True)):
            if body < 0:
                continue
            at = columns[int(body)]
            rows[row, at : at + 3] += sign * normal
            turns = axes[int(body)]
            if len(turns):
                moment = np.cross(point - centres[int(body)], normal) / diameter
                rows[row, at + 3 : at + 5] += sign * turns @ moment
    left, values, _ = svd(rows, full_matrices=True, lapack_driver="gesdd")
    # The smallest value that is none of round-off was above 1e-4 of the largest one in every bed.
    rank = int((values > 1e-8 * values[0]).sum())
    stress = left[:, rank:]
    to_walls = np.minimum(points - box[:, 0], box[:, 1] - points).min(axis=1)
    weight = float((stress[to_walls > 1.5 * diameter] ** 2).sum())
    return Statics(degrees, len(one), degrees - rank, len(one) - rank, weight)


def statics_of_run(folder: Path) -> Statics:
    """Analyse the last frame of a run of spheres.in or dimers.in."""
    particles = read_particle_frame(folder / "particles.lammpsdump")
    order = np.argsort(particles.ids)
    ids = particles.ids[order]
    bodies = np.arange(len(ids)) if particles.bodies is None else particles.bodies[order]
    bodies = np.unique(bodies, return_inverse=True)[1]
    *_, frame = iterate_contact_frames(folder / "contacts.lammpsdump")
    return statics(
        particles.positions[order],
        bodies,
        np.searchsorted(ids, frame.ids[:, 0]),
        np.where(frame.ids[:, 1] > 0, np.searchsorted(ids, frame.ids[:, 1]), -1),
        frame.points,
        frame.normals,
        2 * float(particles.radii[0]),
        CONTAINER,
    )
