"""From a run's dumps to numbers: arrays in, arrays or small frozen dataclasses out."""

from .bed import BoxInBed, box_in_bed
from .bodies import Particles, group_spheres
from .cell import Cell
from .contact_lines import ContactLines, contact_lines
from .contacts import ContactFrame, iterate_contact_frames
from .coordination import (
    ContactCounts,
    CoordinationNumber,
    contact_counts,
    coordination_number,
)
from .errors import (
    AnalysisError,
    DumpError,
    ExportError,
    InputError,
    LogError,
    PictureError,
    RunFilesError,
    UnfinishedRunError,
)
from .evolution import Evolution, Plateau, measure_evolution, monte_carlo, plateau, plot_evolution
from .export_contacts import write_bonds, write_contacts_csv, write_contacts_vtk
from .export_points import write_csv, write_json, write_pqr, write_vtk, write_xyz
from .export_surfaces import write_stl
from .export_voxels import VoxelImage, voxel_shape, voxel_slices, write_raw, write_tiff
from .fabric import fabric_tensor
from .forces import ForceDistribution, contacts_of, force_distribution, plot_force_distribution
from .measurement import PackingMeasurement, measure_packing
from .necks import dimer_volume, neck_volume, packing_fraction_with_necks
from .neighbours import DistanceContacts, contacts_by_distance
from .network import NetworkDifference, contact_graph, draw_network, network_difference
from .orientation import Orientation, dimer_orientation
from .overlaps import PairOverlap, WallOverlap, largest_pair_overlap, largest_wall_overlap
from .packing import (
    ExactPackingFraction,
    MeasuredPackingFraction,
    PackingFraction,
    best_packing_fraction,
    exact_packing_fraction,
    measure_packing_fraction,
    packing_fraction,
)
from .particles import ParticleDump, ParticleFrame, read_particle_frame
from .pictures import draw_packing
from .profile import (
    WallProfile,
    mueller_packing_fraction,
    wall_profile,
    wall_profile_monte_carlo,
)
from .rattlers import Backbone, backbone, contacts_to_hold
from .run_files import RunFiles, check_contacts, open_run
from .run_log import Run, RunLog, Unrest, at_steps, read_run_log
from .scaling import (
    PowerLaw,
    binned_exponent,
    local_ratios,
    logarithmic_density,
    power_law,
    small_gaps,
)
from .spheres import Images, Spheres
from .structure import (
    BondOrder,
    RadialDistribution,
    bond_order,
    plot_radial_distribution,
    radial_distribution,
)
from .view import PackingView, write_view
from .volumes import particle_volumes_in_box, sphere_volumes_in_box

__all__ = [
    "AnalysisError",
    "Backbone",
    "BondOrder",
    "BoxInBed",
    "Cell",
    "ContactCounts",
    "ContactFrame",
    "ContactLines",
    "CoordinationNumber",
    "DistanceContacts",
    "DumpError",
    "Evolution",
    "ExactPackingFraction",
    "ExportError",
    "ForceDistribution",
    "Images",
    "InputError",
    "LogError",
    "MeasuredPackingFraction",
    "NetworkDifference",
    "Orientation",
    "PackingFraction",
    "PackingMeasurement",
    "PackingView",
    "PairOverlap",
    "ParticleDump",
    "ParticleFrame",
    "Particles",
    "PictureError",
    "Plateau",
    "PowerLaw",
    "RadialDistribution",
    "Run",
    "RunFiles",
    "RunFilesError",
    "RunLog",
    "Spheres",
    "UnfinishedRunError",
    "Unrest",
    "VoxelImage",
    "WallOverlap",
    "WallProfile",
    "at_steps",
    "backbone",
    "best_packing_fraction",
    "binned_exponent",
    "bond_order",
    "box_in_bed",
    "check_contacts",
    "contact_counts",
    "contact_graph",
    "contact_lines",
    "contacts_by_distance",
    "contacts_of",
    "contacts_to_hold",
    "coordination_number",
    "dimer_orientation",
    "dimer_volume",
    "draw_network",
    "draw_packing",
    "exact_packing_fraction",
    "fabric_tensor",
    "force_distribution",
    "group_spheres",
    "iterate_contact_frames",
    "largest_pair_overlap",
    "largest_wall_overlap",
    "local_ratios",
    "logarithmic_density",
    "measure_evolution",
    "measure_packing",
    "measure_packing_fraction",
    "monte_carlo",
    "mueller_packing_fraction",
    "neck_volume",
    "network_difference",
    "open_run",
    "packing_fraction",
    "packing_fraction_with_necks",
    "particle_volumes_in_box",
    "plateau",
    "plot_evolution",
    "plot_force_distribution",
    "plot_radial_distribution",
    "power_law",
    "radial_distribution",
    "read_particle_frame",
    "read_run_log",
    "small_gaps",
    "sphere_volumes_in_box",
    "voxel_shape",
    "voxel_slices",
    "wall_profile",
    "wall_profile_monte_carlo",
    "write_bonds",
    "write_contacts_csv",
    "write_contacts_vtk",
    "write_csv",
    "write_json",
    "write_pqr",
    "write_raw",
    "write_stl",
    "write_tiff",
    "write_view",
    "write_vtk",
    "write_xyz",
]
