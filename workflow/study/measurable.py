"""A check that the outputs that a study asks for can be measured of its cases.

What cannot be is a mistake. A box that reaches out of the bed can: how high a bed is, is only known
after its run. Beforehand there is a warning.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from lammps_inelastic.analysis import dimer_volume

from ..shipped import SETTLING
from .case import Case, Stage
from .file_format import Bounds, Outputs, ProfileOutput
from .stages import CONTAINER, container_of, last_step_of

# So many slabs and points take some minutes of measuring.
MOST_SLABS, MOST_POINTS_OF_PROFILE = 10_000, 10**9
# Packing fraction of a whole bed in the container, walls included, by which its height is expected;
# beds of spheres and dimers have 0.58 to 0.62 (1,000 and 10,000 spheres).
OF_WHOLE_BED = 0.6
# The first pit of a free surface is so far below its mean height [diameters].
PIT = 0.75
# In these decks the bed lies on the floor of the container at the end.
LIES_ON_FLOOR = ("spheres", "dimers", "clusters", SETTLING)


def doubtful_outputs(outputs: Outputs, cases: Sequence[Case]) -> Iterator[str]:
    """Return one line for each kind of case whose box is expected to reach out of the bed."""
    if outputs.box == "cell":
        return
    top = outputs.box[3]
    for case in cases:
        end = expected_end(case)
        if end is not None and top > end:
            first = case.stages[0]
            yield (
                f"outputs.box: it reaches up to y = {top:g}, but {first.variables['particles']} "
                f"{first.deck.name} of diameter {first.variables['diameter']} make a bed that ends "
                f"at about {max(end, 0):.2g}: numbers of the box would be partly of empty space"
            )


def expected_end(case: Case) -> float | None:
    """Return the height at which a case's bed will end, about [length]; None if nothing tells it.

    Known are the volumes of the particles that our decks make themselves.
    """
    first, last = case.stages[0], case.stages[-1]
    if not (first.deck.shipped and last.deck.shipped and last.deck.name in LIES_ON_FLOOR):
        return None
    if "particles" in first.unused or not isinstance(
        particles := first.variables["particles"], int
    ):
        return None
    diameter = float(first.variables["diameter"])
    volume = math.pi / 6 * diameter**3
    if first.deck.name == "dimers":
        apart = diameter * (float(first.variables["aspect_ratio"]) - 1)
        volume = dimer_volume(diameter / 2, apart)
    elif first.deck.name == "clusters":
        if first.variables["shape"] != "tetrahedron":
            return None
        # Four spheres without the six lenses in which two of them overlap, 0.7 diameters apart.
        apart = 0.7 * diameter
        volume = 6 * dimer_volume(diameter / 2, apart) - 8 * volume
    xlo, xhi, _, _, zlo, zhi = CONTAINER
    return particles * volume / (OF_WHOLE_BED * (xhi - xlo) * (zhi - zlo)) - PIT * diameter


def unmeasurable_outputs(outputs: Outputs, cases: Sequence[Case]) -> Iterator[str]:
    """Return one line for each of the outputs that cannot be measured of some case."""
    ends = [last_step_of(case.stages[-1]) for case in cases]
    known = [end for end in ends if end is not None]
    for step in outputs.pictures:
        # A case of fewer steps than others is drawn at its end.
        if len(known) == len(ends) and step > max(known):
            yield (
                f"outputs.pictures: {step} is not allowed: it must be a step from 0 to "
                f"{max(known)}, where the longest case ends"
            )
    for stage in [case.stages[-1] for case in cases]:
        container = container_of(stage)
        if (
            outputs.box != "cell"
            and container is not None
            and not all(
                low <= value <= high
                for value, low, high in zip(
                    outputs.box,
                    [low for low in container[::2] for _ in "lh"],
                    [high for high in container[1::2] for _ in "lh"],
                    strict=True,
                )
            )
        ):
            yield (
                f"outputs.box: {list(outputs.box)} is not allowed: it must lie in the container of "
                f"{stage.deck.name}, {list(container)}"
            )
        if outputs.profile is not None:
            yield from _of_profile(outputs.profile, stage, container)


def _of_profile(profile: ProfileOutput, stage: Stage, container: Bounds | None) -> Iterator[str]:
    """Return a line if a profile reaches out of the container, or takes too long to measure."""
    axis = "xyz".index(profile.axis)
    if container is not None:
        width = container[2 * axis + 1] - container[2 * axis]
        if profile.reach > width:
            yield (
                f"outputs.profile.reach: {profile.reach} is not allowed: it must be at most "
                f"{width}, the width of the container of {stage.deck.name} along {profile.axis}"
            )
            return
    diameter = stage.variables.get("diameter")
    if not isinstance(diameter, int | float) or diameter <= 0:
        return
    thickness = profile.thickness * diameter
    slabs = profile.reach / thickness if thickness > 0 else math.inf
    if slabs > MOST_SLABS or slabs * profile.points > MOST_POINTS_OF_PROFILE:
        most = min(MOST_SLABS, MOST_POINTS_OF_PROFILE / profile.points)
        least = profile.reach / (most * diameter)
        yield (
            f"outputs.profile: {slabs:.3g} slabs of {profile.points} points each are too many: at "
            f"most {MOST_SLABS} slabs and {MOST_POINTS_OF_PROFILE} points in all are allowed, so "
            f"that thickness must be at least {least:.2g} diameters for spheres of {diameter}"
        )
