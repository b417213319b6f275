"""Orientation of dimers: whether they lie, stand, or point anywhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .bodies import dimer_spheres
from .errors import InputError
from .geometry import FloatArray
from .spheres import Spheres, takes_spheres


@dataclass(frozen=True, eq=False)
class Orientation:
    """Mean orientation of some dimers, from the vectors between the centres of their two spheres.

    Attributes
    ----------
    components : (3,), root mean square of these vectors' x, y and z, length
    standard_errors : (3,), of `components`, length; None for a single dimer
    dimers : number of dimers
    dimensions : 2 for dimers of discs in a plane, else 3
    """

    components: FloatArray
    standard_errors: FloatArray | None
    dimers: int
    dimensions: int = 3

    @property
    def isotropic(self) -> float:
        """The value of each component if no direction was preferred, length.

        It is the root mean square distance of the two centres over sqrt(3); in a plane over
        sqrt(2), and z has none.
        """
        return math.sqrt(float((self.components[: self.dimensions] ** 2).mean()))


@takes_spheres
def dimer_orientation(spheres: Spheres, box: ArrayLike | None = None) -> Orientation:
    """Measure the orientation of the dimers whose centres lie in a box.

    A component is a = sqrt(<d^2>): d is the difference of the coordinates of a dimer's two spheres,
    <> the mean over N dimers. Its standard error is that of <d^2> to first order,
    s / (2 a sqrt(N)), with s the standard deviation of d^2 between the dimers (N - 1 in its
    denominator); 0 where a is 0. It takes the dimers as independent: where neighbours align, it is
    too small. The three are not independent of each other: the squares of the components add up to
    the mean squared distance.

    Free spheres have no orientation and are left out; every body must be a dimer, also outside the
    box.

    Parameters
    ----------
    spheres : the spheres, the particles that they make up, and their cell
    box : (3, 2), lower and upper bound per axis, length; None: all dimers

    Raises InputError for a body that is no dimer, and for a box without a dimer's centre.
    """
    particles = spheres.particles
    is_body = particles.bodies > 0
    wrong = np.flatnonzero(is_body & (particles.sizes != 2))
    if len(wrong):
        raise InputError(
            "only dimers have an orientation: the number of spheres in body "
            f"{particles.bodies[wrong[0]]} is {particles.sizes[wrong[0]]}, not 2"
        )
    chosen = is_body & spheres.particles_in(box)
    dimers = int(chosen.sum())
    if dimers == 0:
        raise InputError("no dimer's centre lies in the box: the mean over none does not exist")

    one, other = dimer_spheres(particles)
    inside = chosen[particles.index[one]]
    squares = (spheres.positions[one[inside]] - spheres.positions[other[inside]]) ** 2
    components = np.sqrt(squares.mean(axis=0))
    errors: FloatArray | None = None
    if dimers > 1:
        of_squares = squares.std(axis=0, ddof=1) / math.sqrt(dimers)
        errors = np.zeros(3)
        np.divide(of_squares, 2 * components, out=errors, where=components > 0)
    return Orientation(components, errors, dimers, 2 if spheres.flat else 3)
