"""From a run's dumps to numbers: arrays in, arrays or small frozen dataclasses out."""

from .contacts import ContactFrame, iterate_contact_frames
from .coordination import (
    ContactCounts,
    CoordinationNumber,
    contact_counts,
    coordination_number,
)
from .errors import AnalysisError, DumpError, InputError, PictureError
from .geometry import particles_inside
from .overlaps import PairOverlap, WallOverlap, largest_pair_overlap, largest_wall_overlap
from .packing import PackingFraction, packing_fraction
from .particles import ParticleDump, ParticleFrame, read_particle_frame
from .pictures import draw_packing

__all__ = [
    "AnalysisError",
    "ContactCounts",
    "ContactFrame",
    "CoordinationNumber",
    "DumpError",
    "InputError",
    "PackingFraction",
    "PairOverlap",
    "ParticleDump",
    "ParticleFrame",
    "PictureError",
    "WallOverlap",
    "contact_counts",
    "coordination_number",
    "draw_packing",
    "iterate_contact_frames",
    "largest_pair_overlap",
    "largest_wall_overlap",
    "packing_fraction",
    "particles_inside",
    "read_particle_frame",
]
