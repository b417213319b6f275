"""What is compared between hard packings: isostaticity, small gaps and weak forces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lammps_inelastic.analysis import (
    ContactFrame,
    InputError,
    ParticleFrame,
    Particles,
    backbone,
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
# A particle with fewer contacts does not bear a weight.
FEWEST = 3

Values = dict[str, NDArray[Any]]


def excess_contacts(contacts: ContactFrame, frame: ParticleFrame) -> float:
    """Return contacts less degrees of freedom, per 1,000 degrees, of particles that are held.

    An isostatic packing has as many contacts, those with walls included, as its particles have
    degrees of freedom: the result is 0. It is NaN where no particle is held.
    """
    particles = frame.particles
    firm = backbone(contacts.ids, frame.ids, particles, fewest=FEWEST, images=frame.cell.has_images)
    kinds = np.minimum(particles.sizes[~firm.rattlers], len(DEGREES_OF_FREEDOM)) - 1
    degrees = int(np.choose(kinds, DEGREES_OF_FREEDOM).sum()) if len(kinds) else 0
    held = firm.counts.particles.sum() / 2 + firm.counts.walls.sum()
    return 1000 * float(held - degrees) / degrees if degrees else float("nan")


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
    firm = backbone(contacts.ids, frame.ids, particles, images=frame.cell.has_images)
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
            ratios = local_ratios(strengths, heights)
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
