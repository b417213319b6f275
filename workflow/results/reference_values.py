"""What is compared between hard packings: isostaticity, small gaps and weak forces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import (
    Backbone,
    ContactFrame,
    InputError,
    ParticleFrame,
    Particles,
    backbone,
    contacts_to_hold,
    local_ratios,
    logarithmic_density,
    power_law,
    small_gaps,
)
from lammps_inelastic.analysis.coordination import contact_sides

# The power laws are fitted between these bounds. Smaller gaps are those that the tolerance of the
# phases before has left, larger ones know of the size of the spheres; weaker forces are too few,
# and stronger ones know of the mean.
GAPS = 1e-3, 1e-1  # [diameters]
FORCES = 1e-3, 0.3  # [mean force at the same height]
# The densities are shown between these.
GAPS_SHOWN, FORCES_SHOWN = (1e-5, 0.3), (1e-4, 5.0)
# Of a particle of one, two, and more spheres; a dimer may turn about its axis as it likes.
DEGREES_OF_FREEDOM = 3, 5, 6
# Likewise of discs in a plane.
DEGREES_OF_DISCS = 2, 3, 3

Values = dict[str, NDArray[Any]]


def excess_contacts(contacts: ContactFrame, frame: ParticleFrame) -> float:
    """Return contacts less degrees of freedom, per 1,000 degrees, of particles that are held.

    An isostatic packing has as many contacts, those with walls included, as its particles have
    degrees of freedom: the result is 0. A packing may move as a whole along each period: these are
    no degrees. It is NaN where no particle is held.
    """
    particles, flat = frame.particles, frame.cell.flat
    # A particle with fewer contacts than dimensions does not bear a weight.
    fewest = 2 if flat else 3
    firm = backbone(contacts.ids, frame.ids, particles, fewest=fewest, images=frame.cell.has_images)
    of_kinds = np.array(DEGREES_OF_DISCS if flat else DEGREES_OF_FREEDOM)
    kinds = np.minimum(particles.sizes[~firm.rattlers], len(of_kinds)) - 1
    degrees = int(of_kinds[kinds].sum()) - sum(frame.cell.periodic)
    held = firm.counts.particles.sum() / 2 + firm.counts.walls.sum()
    return 1000 * float(held - degrees) / degrees if degrees > 0 else float("nan")


def firm_part(contacts: ContactFrame, frame: ParticleFrame) -> Backbone:
    """Return the rattlers of a packing, and the contacts of what is held in any direction."""
    return backbone(
        contacts.ids,
        frame.ids,
        frame.particles,
        fewest=contacts_to_hold(frame.particles, flat=frame.cell.flat),
        images=frame.cell.has_images,
    )


def power_laws(
    contacts: ContactFrame, frame: ParticleFrame, stage: Mapping[str, Any], values: Values
) -> dict[str, float]:
    """Return the exponents of small gaps and weak forces; add their densities to values.

    Both are of particles that are held in any direction and touch no wall. There is none of gaps
    where the tolerance that packed them is not far below, and none where there are too few.

    Parameters
    ----------
    contacts : last contact frame
    frame : particles of the same step
    stage : stage of the run, which has their tolerance [radii] if it is of one of our decks
    values : arrays by the names in the schema
    """
    particles = frame.particles
    firm = firm_part(contacts, frame)
    left_out = firm.rattlers | (firm.counts.walls > 0)
    numbers: dict[str, float] = {}
    diameter = 2 * float(frame.radii.max())

    tolerance = stage["variables"].get("tolerance")
    packed_tightly = not isinstance(tolerance, int | float) or tolerance / 2 < GAPS[0] / 2
    if packed_tightly:
        gaps = small_gaps(frame.spheres, GAPS_SHOWN[1] * diameter, left_out)
        scaled = gaps / diameter
        values["gaps/size"], values["gaps/density"] = logarithmic_density(scaled, *GAPS_SHOWN)
        numbers |= _exponent("gap", scaled, GAPS)

    between = _between(contacts, frame, particles, left_out)
    strengths, heights = contacts.forces[between], contacts.points[between, 1]
    if len(strengths) and (strengths >= 0).all():
        try:
            # Without an up there is no depth with which forces grow.
            endless = frame.spheres.endless[1]
            ratios = local_ratios(strengths, heights, *([1] if endless else []))
        except InputError:
            return numbers
        values["forces/local_ratio"], values["forces/local_density"] = logarithmic_density(
            ratios, *FORCES_SHOWN
        )
        numbers |= _exponent("weak_force", ratios, FORCES)
    return numbers


def _between(
    contacts: ContactFrame,
    frame: ParticleFrame,
    particles: Particles,
    left_out: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Say which contacts are between particles none of which is left out, (m,)."""
    sides = contact_sides(contacts.ids, frame.ids, particles, images=frame.cell.has_images)
    of_particles = sides[:, 1] >= 0
    other = np.where(of_particles, sides[:, 1], sides[:, 0])
    found: NDArray[np.bool_] = of_particles & ~left_out[sides[:, 0]] & ~left_out[other]
    return found


def _exponent(
    name: str, values: NDArray[np.float64], bounds: tuple[float, float]
) -> dict[str, float]:
    """Return an exponent and its error; nothing where there are too few values."""
    try:
        law = power_law(values, *bounds)
    except InputError:
        return {}
    return {f"{name}_exponent": law.exponent, f"{name}_exponent_error": law.error}
