"""A packing measured in a box: the same numbers in the same way for users, studies and tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .bed import BoxInBed, box_in_bed
from .bodies import Particles
from .coordination import ContactCounts, CoordinationNumber, coordination_number
from .geometry import BoolArray, FloatArray, as_box, particles_inside
from .orientation import Orientation, dimer_orientation
from .overlaps import PairOverlap, WallOverlap, largest_pair_overlap, largest_wall_overlap
from .packing import MeasuredPackingFraction, measure_packing_fraction
from .particles import ParticleFrame, check_not_periodic


@dataclass(frozen=True, eq=False)
class PackingMeasurement:
    """The numbers of a packing. A particle is a body, or a free sphere.

    Attributes
    ----------
    in_box : (p,) of bool, whether a particle's centre lies in the box
    bed : how much of the box lies inside the bed; where not all of it does, every number of the box
        is partly one of empty space
    packing_fraction : packing fraction in the box
    coordination : contacts with other particles of the particles in the box, over all contact
        frames; None where there is no such particle or no contact frame
    neighbours : likewise, but a particle that is touched several times counts once
    wall_contacts : likewise, of contacts with walls
    orientation : orientation of the dimers in the box; None if there are other bodies, or no dimer
        in the box
    pair_overlap : largest overlap of two spheres of different particles
    wall_overlap : largest overlap of a sphere with a wall; None where the walls are not known
    """

    in_box: BoolArray
    bed: BoxInBed
    packing_fraction: MeasuredPackingFraction
    coordination: CoordinationNumber | None
    neighbours: CoordinationNumber | None
    wall_contacts: CoordinationNumber | None
    orientation: Orientation | None
    pair_overlap: PairOverlap
    wall_overlap: WallOverlap | None


def measure_packing(
    frame: ParticleFrame,
    counts: Sequence[ContactCounts],
    box: ArrayLike,
    *,
    points: int = 1_000_000,
    seed: int = 0,
    walls: ArrayLike | None = None,
) -> PackingMeasurement:
    """Measure a packing in a box.

    Parameters
    ----------
    frame : particles of the packing
    counts : contacts of each particle in every contact frame; empty where contacts are not counted
    box : (3, 2), lower and upper bound per axis, length
    points : number of random points for the packing fraction, at least 1
    seed : seed of these points, not negative
    walls : (3, 2), box whose faces are walls, length; None where the walls are not known

    Raises InputError for a frame whose box is periodic, for boxes or counts of other shapes, and
    for points or a seed that are no whole numbers or too small.
    """
    check_not_periodic(frame)
    bounds, particles = as_box(box), frame.particles
    in_box = particles_inside(particles.centres(frame.positions), bounds)
    spheres = frame.positions, frame.radii
    counted = bool(len(counts)) and bool(in_box.any())

    def mean_of(numbers: Sequence[ArrayLike]) -> CoordinationNumber | None:
        return coordination_number(numbers, in_box) if counted else None

    return PackingMeasurement(
        in_box=in_box,
        bed=box_in_bed(*spheres, bounds, _faces(frame) if walls is None else walls),
        packing_fraction=measure_packing_fraction(
            *spheres, bounds, particles, points=points, seed=seed
        ),
        coordination=mean_of([count.particles for count in counts]),
        neighbours=mean_of([count.neighbours for count in counts]),
        wall_contacts=mean_of([count.walls for count in counts]),
        orientation=_orientation(frame, particles, in_box, bounds),
        pair_overlap=largest_pair_overlap(*spheres, frame.bodies),
        wall_overlap=None if walls is None else largest_wall_overlap(*spheres, walls),
    )


def _faces(frame: ParticleFrame) -> FloatArray:
    """Return the faces of a frame's box that are fixed, (3, 2), length; infinite for the others.

    Where a dump does not tell its boundaries none is known to be a wall.
    """
    if frame.boundaries is None:
        return np.array([[-np.inf, np.inf]] * 3)
    fixed = np.array([[flag == "f" for flag in flags] for flags in frame.boundaries])
    return np.where(fixed, frame.box, [-np.inf, np.inf])


def _orientation(
    frame: ParticleFrame, particles: Particles, in_box: BoolArray, box: FloatArray
) -> Orientation | None:
    is_body = particles.bodies > 0
    if not (particles.sizes[is_body] == 2).all() or not (is_body & in_box).any():
        return None
    return dimer_orientation(frame.positions, particles, box)
