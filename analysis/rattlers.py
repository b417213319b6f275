"""Rattlers: particles that the packing does not hold, and what is left without them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .bodies import Particles
from .coordination import ContactCounts, contact_counts, contact_sides, number_of_particles
from .errors import InputError
from .geometry import BoolArray, IntArray, as_integers


@dataclass(frozen=True, eq=False)
class Backbone:
    """The rattlers of a packing, and the contacts that the others have with one another.

    The coordination number without rattlers is that of `counts.particles` over `~rattlers`.

    Attributes
    ----------
    rattlers : (p,) of bool
    counts : contacts of each particle, those with rattlers left out; 0 for a rattler
    rounds : rounds of removal that found a rattler
    """

    rattlers: BoolArray
    counts: ContactCounts
    rounds: int


def contacts_to_hold(particles: Particles, *, flat: bool = False) -> IntArray:
    """Return the number of contacts that it takes to hold each particle in any direction, (p,).

    Contacts without friction only push. To balance at any load, the directions in which they push
    must surround the origin of the space of motions: that takes one contact more than the particle
    has degrees of freedom. These are 3 for one sphere, 5 for two (a turn about the axis moves
    nothing), and 6 for more: 4, 6 and 7 contacts. Three spheres and more in a row have 5 degrees of
    freedom as well, which only their positions tell: pass `fewest` to `backbone` for them. In two
    dimensions (`flat`) these are 3 contacts for a disc, and 4 for a body.
    """
    if flat:
        return np.where(particles.sizes == 1, 3, 4)
    return np.choose(np.minimum(particles.sizes, 3) - 1, [4, 6, 7]).astype(np.int64)


def backbone(
    contact_ids: ArrayLike,
    sphere_ids: ArrayLike,
    particles: Particles | None = None,
    *,
    fewest: ArrayLike | None = None,
    images: bool = False,
) -> Backbone:
    """Remove particles with too few contacts, again and again, until all that are left have enough.

    Contacts with walls count, contacts with removed particles do not. The definition for jammed
    packings (Lubachevsky and Stillinger 1990; Donev, Torquato and Stillinger 2005) knows no weight.
    Under gravity a sphere may rest on three others and still be one of these rattlers, and its
    removal may free the next: of 1,000 poured spheres 15 % were rattlers, 3 % away from the walls.
    With `fewest=3`, what it takes to bear a weight, 0.4 % were.

    Parameters
    ----------
    contact_ids : (m, 2), contacts that carry a force, as for `contact_counts`
    sphere_ids : (n,), ids of the spheres, in any order
    particles : which spheres make up which particle, in the order of `sphere_ids`; None: all are
        free
    fewest : contacts that a particle must have to stay, one number or (p,); None: the numbers of
        `contacts_to_hold` in three dimensions
    images : whether the cell is periodic: then a particle may touch its own image

    Raises InputError as `contact_sides` does, and for `fewest` of another shape.
    """
    contacts = as_integers(contact_ids, "contact ids")
    sides = contact_sides(contacts, sphere_ids, particles, images=images)
    count = number_of_particles(sphere_ids, particles)
    if fewest is None:
        fewest = 4 if particles is None else contacts_to_hold(particles)
    needed = as_integers(fewest, "fewest")
    if needed.shape not in ((), (count,)):
        raise InputError(f"fewest must be one number or have shape ({count},), not {needed.shape}")

    rattlers = np.zeros(count, dtype=np.bool_)
    held = np.ones(len(sides), dtype=np.bool_)
    at_wall = sides[:, 1] < 0
    one, other = sides[:, 0], np.where(at_wall, sides[:, 0], sides[:, 1])
    rounds = 0
    while True:
        ends = np.concatenate([one[held], other[held & ~at_wall]])
        loose = (np.bincount(ends, minlength=count) < needed) & ~rattlers
        if not loose.any():
            break
        rounds += 1
        rattlers |= loose
        held &= ~rattlers[one] & ~rattlers[other]
    counts = contact_counts(contacts[held], sphere_ids, particles, images=images)
    return Backbone(rattlers, counts, rounds)
