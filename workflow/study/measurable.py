"""A check that the outputs that a study asks for can be measured of its cases."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from .case import Case, Stage
from .file_format import Bounds, Outputs, ProfileOutput
from .stages import container_of, last_step_of

# So many slabs and points take some minutes of measuring.
MOST_SLABS, MOST_POINTS_OF_PROFILE = 10_000, 10**9


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
        if container is not None and not all(
            low <= value <= high
            for value, low, high in zip(
                outputs.box,
                [low for low in container[::2] for _ in "lh"],
                [high for high in container[1::2] for _ in "lh"],
                strict=True,
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
