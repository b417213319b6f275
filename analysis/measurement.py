"""A packing measured in a box: the same numbers in the same way for users, studies and tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from .bed import BoxInBed, box_in_bed
from .coordination import ContactCounts, CoordinationNumber, coordination_number
from .geometry import BoolArray, as_box
from .orientation import Orientation, dimer_orientation
from .overlaps import PairOverlap, WallOverlap, largest_pair_overlap, largest_wall_overlap
from .packing import MeasuredPackingFraction, measure_packing_fraction
from .particles import ParticleFrame
from .spheres import Spheres


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
    box: ArrayLike | None = None,
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
    box : (3, 2), lower and upper bound per axis, length; None: the whole simulation cell
    points : number of random points for the packing fraction, at least 1
    seed : seed of these points, not negative
    walls : (3, 2), box whose faces are walls, infinite where there is none, length; None where the
        walls are not known

    Raises InputError for boxes or counts of other shapes, and for points or a seed that are no
    whole numbers or too small.
    """
    bounds = None if box is None else as_box(box)
    spheres = frame.spheres
    in_box = spheres.particles_in(bounds)
    faces = frame.walls if walls is None else walls
    counted = bool(len(counts)) and bool(in_box.any())

    def mean_of(numbers: Sequence[ArrayLike]) -> CoordinationNumber | None:
        return coordination_number(numbers, in_box) if counted else None

    return PackingMeasurement(
        in_box=in_box,
        bed=box_in_bed(spheres, frame.box if bounds is None else bounds, faces),
        packing_fraction=measure_packing_fraction(spheres, bounds, points=points, seed=seed),
        coordination=mean_of([count.particles for count in counts]),
        neighbours=mean_of([count.neighbours for count in counts]),
        wall_contacts=mean_of([count.walls for count in counts]),
        orientation=_orientation(spheres, in_box, box),
        pair_overlap=largest_pair_overlap(spheres),
        wall_overlap=None if walls is None else largest_wall_overlap(spheres, walls),
    )


def _orientation(spheres: Spheres, in_box: BoolArray, box: ArrayLike | None) -> Orientation | None:
    particles = spheres.particles
    is_body = particles.bodies > 0
    if not (particles.sizes[is_body] == 2).all() or not (is_body & in_box).any():
        return None
    return dimer_orientation(spheres, box)
