"""The layout of a result: every dataset with its shape, unit and meaning.

A study's file holds one group a case, /STUDY/cases/CASE, laid out as here;
docs/reference/hdf5.md shows the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

VERSION = 1


@dataclass(frozen=True)
class Entry:
    """One dataset of a result.

    Attributes
    ----------
    shape : shape in words; empty for a single number
    unit : unit in LAMMPS's lj units; 1 for a pure number
    meaning : meaning in one line
    """

    shape: str
    unit: str
    meaning: str


def _number(unit: str, meaning: str) -> Entry:
    return Entry("", unit, meaning)


SCHEMA: Mapping[str, Entry] = {
    "numbers/particles": _number("1", "bodies and free spheres"),
    "numbers/spheres": _number("1", "spheres, those of bodies included"),
    "numbers/particles_in_box": _number("1", "particles whose centre lies in the measuring box"),
    "numbers/box_in_bed": _number(
        "1", "share of the measuring box inside the bed; below 1 its numbers are of empty space too"
    ),
    "numbers/at_rest": _number("1", "1 if the packing is at rest at the end, else 0"),
    "numbers/rest_speed": _number(
        "1", "rms speed at the end / rms velocity that forces from outside give in a step, g h"
    ),
    "numbers/net_force": _number(
        "1", "sum of all forces at the end / sum of those from outside, the weight"
    ),
    "numbers/packing_fraction": _number(
        "1", "in the measuring box: exact for spheres and dimers, else by Monte Carlo"
    ),
    "numbers/packing_fraction_monte_carlo": _number("1", "the same by random points"),
    "numbers/packing_fraction_monte_carlo_error": _number("1", "its standard error (binomial)"),
    "numbers/packing_fraction_with_necks": _number(
        "1",
        "and the volume at the waist of dimers that no sphere can reach; this part by Monte Carlo",
    ),
    "numbers/packing_fraction_with_necks_error": _number("1", "its standard error (binomial)"),
    "numbers/coordination_number": _number(
        "1", "contacts of a particle in the box with others, also outside of it; no walls"
    ),
    "numbers/coordination_number_scatter": _number(
        "1", "standard deviation of it between the contact frames"
    ),
    "numbers/neighbours": _number("1", "the same, several contacts with one particle count once"),
    "numbers/wall_contacts": _number("1", "contacts with walls per particle in the box"),
    "numbers/particles_with_0_or_1_contacts": _number(
        "1", "in the box, mean over the contact frames"
    ),
    "numbers/rattlers": _number(
        "1",
        "share of the particles in the box with fewer contacts, walls included, than hold them in "
        "any direction (4 a sphere, 6 a dimer, 7 a larger body); contacts with such particles do "
        "not count",
    ),
    "numbers/coordination_number_without_rattlers": _number("1", "of the others, among themselves"),
    "numbers/resolution": _number(
        "1", "eps / (g h^2) while contacts are counted; at most 0.01 for a good count"
    ),
    "numbers/coordination_number_agitated": _number(
        "1", "in the box, mean over the frames of the second half of the agitation"
    ),
    "numbers/a_x": _number("length", "root mean square of x_i - x_j in the dimers in the box"),
    "numbers/a_y": _number("length", "of y_i - y_j"),
    "numbers/a_z": _number("length", "of z_i - z_j"),
    "numbers/a_x_error": _number("length", "standard error of a_x over the dimers"),
    "numbers/a_y_error": _number("length", "of a_y"),
    "numbers/a_z_error": _number("length", "of a_z"),
    "numbers/a_isotropic": _number("length", "each of them where no direction is preferred"),
    "numbers/fabric_x": _number(
        "1", "mean square x of the contact normals in the box; 1/3 if isotropic"
    ),
    "numbers/fabric_y": _number("1", "of y"),
    "numbers/fabric_z": _number("1", "of z"),
    "numbers/largest_overlap": _number(
        "radii", "of two spheres of different particles in the last frame of the dump"
    ),
    "numbers/largest_overlap_of_all_steps": _number(
        "radii", "of two particles or with a wall, at any step, as the fix reports it"
    ),
    "numbers/centre_x": _number("length", "mean x of all spheres in the last frame of the dump"),
    "numbers/centre_y": _number("length", "of y"),
    "numbers/centre_z": _number("length", "of z"),
    "numbers/excess_contacts": _number(
        "1",
        "contacts, those with walls included, less degrees of freedom of all particles that are "
        "held, per 1,000 degrees, mean over the contact frames; 0 if isostatic",
    ),
    "numbers/gap_exponent": _number(
        "1", "k of the density g^k of the gaps between particles that touch no wall"
    ),
    "numbers/gap_exponent_error": _number("1", "its standard error, gaps taken as independent"),
    "numbers/weak_force_exponent": _number(
        "1", "k of the density f^k of forces, over their mean at the same height"
    ),
    "numbers/weak_force_exponent_error": _number("1", "its standard error"),
    "numbers/q6": _number("1", "mean local bond-orientational order of the particles in the box"),
    "numbers/q4": _number("1", "mean local bond-orientational order of the particles in the box"),
    "numbers/crystalline": _number("1", "share of the particles in the box that are crystalline"),
    "numbers/steps": _number("1", "steps of all phases"),
    "numbers/iterations": _number("1", "solver iterations of all steps"),
    "numbers/wall_seconds": _number("s", "wall time of LAMMPS"),
    "numbers/plateau_time": _number("time", "settling: first frame at rest; NaN if there is none"),
    "numbers/plateau_seconds": _number("s", "settling: wall time of the steps up to it"),
    "numbers/plateau_iterations": _number("1", "settling, hard: solver iterations up to it"),
    "numbers/settling_seconds": _number("s", "settling: wall time of all steps"),
    "numbers/overlap_at_rest": _number(
        "radii", "settling: of two particles or with a wall, largest in the frames at rest"
    ),
    "numbers/overlap_falling": _number("radii", "settling: the same before, but at the start"),
    "numbers/complementarity_at_rest": _number(
        "radii", "settling, hard: largest gap under a force that the solver has left at rest"
    ),
    "numbers/drift": _number(
        "diameters/time", "settling: speed of the centre of mass over the last 0.25 time units"
    ),
    "bed/ends": Entry("(3, 2)", "length", "where the bed ends around the measuring box, per axis"),
    "bed/box": Entry("(3, 2)", "length", "part of the measuring box that lies inside the bed"),
    "distribution/contacts": Entry("(k,)", "1", "share of the particles with 0, 1, ... contacts"),
    "distribution/neighbours": Entry("(k,)", "1", "share with 0, 1, ... neighbours"),
    "network/ids": Entry(
        "(m, 2)", "1", "settling: spheres of each contact at the end; the second is -k for wall k"
    ),
    "network/forces": Entry(
        "(m,)", "force", "settling: of each contact; soft: its depth, in units of the stiffness"
    ),
    "packing/step": _number("steps", "of the last frame of the particle dump, which is kept here"),
    "packing/ids": Entry("(n,)", "1", "of its spheres"),
    "packing/positions": Entry("(n, 3)", "length", "of their centres"),
    "packing/velocities": Entry("(n, 3)", "length/time", "of their centres"),
    "packing/radii": Entry("(n,)", "length", "of the spheres"),
    "packing/bodies": Entry("(n,)", "1", "body of each sphere, 0 for a free one"),
    "packing/cell": Entry("(4, 3)", "length", "origin of the simulation box, then its three edges"),
    "packing/periodic": Entry("(3,)", "1", "1 where there are periods along an edge"),
    "packing/flat": _number("1", "1 if the packing is two-dimensional"),
    "packing/contact_ids": Entry(
        "(m, 2)", "1", "spheres of each contact of the last contact frame; -k for wall k"
    ),
    "packing/contact_points": Entry("(m, 3)", "length", "where they touch"),
    "packing/contact_forces": Entry("(m,)", "force", "of each contact, < 0 where it pulls"),
    "forces/ratio": Entry("(b,)", "1", "contact force over its mean, middle of each bin"),
    "forces/density": Entry("(b,)", "1", "probability density of that ratio"),
    "forces/local_ratio": Entry(
        "(b,)", "1", "contact force over the mean at its height, middle of each bin"
    ),
    "forces/local_density": Entry("(b,)", "1", "probability density of that ratio"),
    "gaps/size": Entry("(b,)", "1", "gap over the diameter, middle of each bin"),
    "gaps/density": Entry("(b,)", "1", "its probability density among gaps up to 0.3"),
    "evolution/step": Entry("(f,)", "steps", "of each frame of the particle dump"),
    "evolution/time": Entry("(f,)", "time", "of each frame; shortened steps count as they were"),
    "evolution/seconds": Entry(
        "(f,)", "s", "of each frame: wall time of all steps up to it, without that of the start"
    ),
    "evolution/packing_fraction": Entry("(f,)", "1", "in the box"),
    "evolution/coordination_number": Entry("(f,)", "1", "in the box; NaN while it is empty"),
    "evolution/centre_height": Entry(
        "(f,)", "length", "of the centre of mass: mean y of the spheres, weighted by r^3"
    ),
    "evolution/kinetic_energy": Entry(
        "(f,)",
        "length^2/time^2",
        "kinetic energy over mass: mean of v^2 / 2 over the spheres, weighted by r^3",
    ),
    "profile/diameter": _number("length", "of the largest sphere, by which slabs are measured"),
    "profile/distance": Entry("(s,)", "length", "middle of each slab from the wall"),
    "profile/packing_fraction": Entry("(s,)", "1", "in each slab, exact"),
    "profile/monte_carlo": Entry("(s,)", "1", "in each slab, by random points"),
    "profile/monte_carlo_error": Entry("(s,)", "1", "its standard error (binomial)"),
    "layers/height": Entry(
        "(l,)", "diameters", "above the floor, middle of each layer, a diameter thick"
    ),
    "layers/particles": Entry("(l,)", "1", "particles of the layer between the sides of the box"),
    "layers/coordination_number": Entry(
        "(l,)", "1", "their contacts with other particles, mean over the contact frames"
    ),
    "structure/distance": Entry("(b,)", "length", "between two centres, middle of each bin"),
    "structure/radial_distribution": Entry("(b,)", "1", "g(r) of the particles' centres"),
}
# Images are bytes of PNG files: pictures/STEP and pictures/network.
PICTURES = "pictures"
