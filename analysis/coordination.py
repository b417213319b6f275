"""Coordination numbers: contacts of a particle, a body or a free sphere, with other particles.

In contact means that the contact carries a force. Walls are counted apart and never enter the
coordination number. Contacts are between spheres: two bodies may have several with each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .bodies import Particles
from .errors import InputError
from .geometry import FloatArray, IntArray, as_integers


@dataclass(frozen=True, eq=False)
class ContactCounts:
    """Contacts of each particle in one frame.

    Attributes
    ----------
    particles : (p,), contacts with other particles, each between two spheres
    neighbours : (p,), other particles in contact, however many contacts there are with each
    walls : (p,), contacts with walls, each of one sphere
    """

    particles: IntArray
    neighbours: IntArray
    walls: IntArray


@dataclass(frozen=True, eq=False)
class CoordinationNumber:
    """The coordination number of a set of particles over some frames.

    Attributes
    ----------
    mean : mean over the frames of the mean over the particles
    scatter : standard deviation between the frames' means; None for a single frame
    per_frame : (frames,), mean over the particles
    distribution : (k_max + 1,), share of particles with 0, 1, ... k_max contacts, over all frames
    particles : number of particles in the set
    """

    mean: float
    scatter: float | None
    per_frame: FloatArray
    distribution: FloatArray
    particles: int

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.per_frame)

    def particles_with(self, fewest: int, most: int) -> float:
        """Number of particles with `fewest` to `most` contacts, mean over the frames."""
        return float(self.particles * self.distribution[fewest : most + 1].sum())


def contact_counts(
    contact_ids: ArrayLike,
    sphere_ids: ArrayLike,
    particles: Particles | None = None,
    *,
    images: bool = False,
) -> ContactCounts:
    """Count every particle's contacts; a contact between two particles counts for both.

    Parameters
    ----------
    contact_ids : (m, 2), spheres on both sides; the second is -k for wall k. Every contact is there
        once, as in a `ContactFrame`
    sphere_ids : (n,), ids of the spheres, in any order
    particles : which spheres make up which particle, in the order of `sphere_ids`; the result has
        the order of the particles. None: all spheres are free, and in the order of the result
    images : whether the cell is periodic: then a particle may touch its own image, which counts
        twice as both are the same particle, but makes no neighbour

    Raises InputError as `contact_sides` does.
    """
    sides = contact_sides(contact_ids, sphere_ids, particles, images=images)
    count = number_of_particles(sphere_ids, particles)
    with_wall = sides[:, 1] < 0
    walls = np.bincount(sides[with_wall, 0], minlength=count)
    pairs = np.sort(sides[~with_wall], axis=1)
    between = np.bincount(pairs.ravel(), minlength=count)
    others = pairs[pairs[:, 0] != pairs[:, 1]]
    touching = np.concatenate(np.divmod(np.unique(others @ [count, 1]), count))
    return ContactCounts(between, np.bincount(touching, minlength=count), walls)


def number_of_particles(sphere_ids: ArrayLike, particles: Particles | None) -> int:
    """Return the number of particles that some spheres make up; all are free for None."""
    return len(np.asarray(sphere_ids)) if particles is None else len(particles)


def contact_sides(
    contact_ids: ArrayLike,
    sphere_ids: ArrayLike,
    particles: Particles | None = None,
    *,
    images: bool = False,
) -> IntArray:
    """Return the particles on both sides of every contact, (m, 2); -k stays for wall k.

    The parameters are those of `contact_counts`. Particles are indices, 0 to p - 1. Raises
    InputError for arrays of other shapes or numbers that are not whole, for ids that are there
    twice, for a contact of an unknown sphere, and, where there are no images, for one of a sphere
    with itself or within a body.
    """
    contacts = as_integers(contact_ids, "contact ids")
    ids = as_integers(sphere_ids, "sphere ids")
    if contacts.ndim != 2 or contacts.shape[1] != 2:
        raise InputError(f"contact ids must have shape (m, 2), not {contacts.shape}")
    if ids.ndim != 1 or len(ids) == 0:
        raise InputError(f"sphere ids must have shape (n,) with n >= 1, not {ids.shape}")
    if particles is not None and len(particles.index) != len(ids):
        raise InputError(f"{len(ids)} sphere ids, but {len(particles.index)} spheres in particles")

    of_spheres = contacts >= 0
    # The first side is never a wall: a negative number there is an unknown sphere.
    of_spheres[:, 0] = True
    sides = contacts.copy()
    sides[of_spheres] = _index_of(contacts[of_spheres], ids)
    alone = sides[:, 0] == sides[:, 1]
    if alone.any() and not images:
        raise InputError(f"sphere {contacts[alone][0, 0]} is in contact with itself")
    if particles is None or not particles.composite:
        return sides
    spheres = sides.copy()
    sides[of_spheres] = particles.index[sides[of_spheres]]
    within = sides[:, 0] == sides[:, 1]
    if within.any() and not images:
        one, other = ids[spheres[within][0]]
        body = particles.bodies[sides[within][0, 0]]
        raise InputError(
            f"spheres {one} and {other} are in contact, but both belong to body {body}"
        )
    return sides


def coordination_number(counts: Iterable[ArrayLike], chosen: ArrayLike) -> CoordinationNumber:
    """Average the contact counts of chosen particles over frames.

    The choice is by the particle alone: one whose centre lies in a box counts its contacts with
    particles outside too.

    Parameters
    ----------
    counts : one array (p,) per frame, such as `ContactCounts.particles`
    chosen : (p,) of bool, such as the result of `Spheres.particles_in`

    Raises InputError where no particle is chosen, no frame is there, or shapes differ.
    """
    mask = np.asarray(chosen, dtype=np.bool_)
    particles = int(mask.sum())
    if particles == 0:
        raise InputError("no particle is chosen: the mean over none does not exist")
    means: list[float] = []
    histogram = np.zeros(0, dtype=np.int64)
    for frame in counts:
        values = as_integers(frame, "contact counts")
        if values.shape != mask.shape:
            raise InputError(f"contact counts must have shape {mask.shape}, not {values.shape}")
        means.append(float(values[mask].mean()))
        more = np.bincount(values[mask], minlength=len(histogram))
        more[: len(histogram)] += histogram
        histogram = more
    if not means:
        raise InputError("at least one frame of contacts is needed")
    per_frame = np.array(means)
    return CoordinationNumber(
        mean=float(per_frame.mean()),
        scatter=float(per_frame.std(ddof=1)) if len(per_frame) > 1 else None,
        per_frame=per_frame,
        distribution=histogram / histogram.sum(),
        particles=particles,
    )


def _index_of(wanted: IntArray, ids: IntArray) -> IntArray:
    """Return the places of some ids among all, in the shape of `wanted`."""
    order = np.argsort(ids)
    twice = np.flatnonzero(np.diff(ids[order]) == 0)
    if len(twice):
        raise InputError(f"sphere {ids[order][twice[0]]} is there twice among the sphere ids")
    place = np.minimum(np.searchsorted(ids, wanted, sorter=order), len(ids) - 1)
    index = order[place]
    unknown = ids[index] != wanted
    if unknown.any():
        raise InputError(f"a contact names sphere {wanted[unknown][0]}, which does not exist")
    return index
