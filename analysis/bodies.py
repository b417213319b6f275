"""Particles made of spheres: a particle is a rigid body of one or more spheres, or a free sphere.

Dumps know spheres only: their ids stand in both dumps, and `mol` says to which body each belongs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError
from .geometry import FloatArray, IntArray, as_integers, as_positions


@dataclass(frozen=True, eq=False)
class Particles:
    """The particles that some spheres make up.

    Particles come in the order of their first spheres: where no two spheres belong together,
    particle i is sphere i.

    Attributes
    ----------
    index : (n,), index of each sphere's particle, 0 to p - 1
    sizes : (p,), number of spheres of each particle
    bodies : (p,), number of the body that the particle is, 0 for a free sphere
    """

    index: IntArray
    sizes: IntArray
    bodies: IntArray

    def __len__(self) -> int:
        """Return the number of particles."""
        return len(self.sizes)

    @property
    def composite(self) -> bool:
        """Whether any particle has more than one sphere."""
        return len(self.sizes) < len(self.index)

    @property
    def exactly_measurable(self) -> bool:
        """Whether all are free spheres and dimers, whose volumes in a box are known exactly."""
        return bool((self.sizes <= 2).all())

    def centres(self, positions: ArrayLike) -> FloatArray:
        """Return the particles' centres, (p, 3): each is the mean of its spheres' centres.

        This is the centre of mass of `fix rigid` if all spheres of a body have the same mass.
        Nothing is periodic.

        Parameters
        ----------
        positions : (n, 3), of the spheres, length

        Raises InputError for another number of positions.
        """
        spheres = self.checked(positions)
        sums = [np.bincount(self.index, weights=x, minlength=len(self)) for x in spheres.T]
        return np.column_stack(sums) / self.sizes[:, None]

    def checked(self, positions: ArrayLike) -> FloatArray:
        """Return positions of the spheres, (n, 3); raise InputError if their number differs."""
        spheres = as_positions(positions)
        if len(spheres) != len(self.index):
            raise InputError(
                f"{len(spheres)} positions, but {len(self.index)} spheres in particles"
            )
        return spheres


def group_spheres(bodies: ArrayLike) -> Particles:
    """Put the spheres of each body together.

    Parameters
    ----------
    bodies : (n,), body of each sphere, 0 for a free sphere, such as `ParticleFrame.bodies`

    Raises InputError for an array of another shape, and for numbers that are negative or not whole.
    """
    body = as_integers(bodies, "bodies")
    if body.ndim != 1 or len(body) == 0:
        raise InputError(f"bodies must have shape (n,) with n >= 1, not {body.shape}")
    if (body < 0).any():
        raise InputError(f"a body's number must not be negative, not {body.min()}")
    # Every free sphere has a number of its own here, below those of the bodies.
    number = np.where(body == 0, -np.arange(1, len(body) + 1), body)
    _, first, group = np.unique(number, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    index = place[group]
    return Particles(index=index, sizes=np.bincount(index), bodies=body[first[order]])


def dimer_spheres(particles: Particles) -> tuple[IntArray, IntArray]:
    """Return the indices of the first and of the second sphere of each dimer, both (k,)."""
    # In the order of the particles, the two spheres of each dimer follow each other.
    order = np.argsort(particles.index, kind="stable")
    pairs = order[particles.sizes[particles.index[order]] == 2].reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]
