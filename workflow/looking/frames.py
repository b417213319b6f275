"""The frame of a dump that a user chooses, and what its dump does not say."""

from __future__ import annotations

from lammps_inelastic.analysis import AnalysisError, ParticleDump, ParticleFrame

# So many steps are named where one is not found.
STEPS_SHOWN = 6


def choose_index(dump: ParticleDump, *, number: int | None, step: int | None) -> int:
    """Return the place of a frame in its dump, of the last one if none is chosen.

    Parameters
    ----------
    dump : particle dump
    number : number of the frame from 0, or from the end: -1 is the last
    step : time step of the frame, which comes before its number

    Raises AnalysisError where there is no such frame, or more than one of the step.
    """
    if step is not None:
        if step not in dump.steps:
            raise AnalysisError(f"{dump.path}: no step {step}; {_as_steps(dump.steps)}")
        if dump.steps.count(step) > 1:
            raise AnalysisError(
                f"{dump.path}: more than one frame of step {step}; --frame N chooses one"
            )
        return dump.steps.index(step)
    index = -1 if number is None else number
    if not -len(dump) <= index < len(dump):
        raise AnalysisError(
            f"{dump.path}: no frame {index}; there are {len(dump)}, from 0 to {len(dump) - 1}"
        )
    return index


def notes_of(dump: ParticleDump, frame: ParticleFrame) -> list[str]:
    """Return what a user must know of a frame: one line for each thing that its dump lacks."""
    notes = []
    if dump.cut_off is not None:
        notes.append(f"only whole frames are read, {len(dump)} of them: {dump.cut_off}")
    if frame.boundaries is None:
        notes.append("the dump does not say whether its box is periodic; it is taken as not")
    return notes


def _as_steps(steps: tuple[int, ...]) -> str:
    if len(steps) <= STEPS_SHOWN:
        return f"the steps are {', '.join(map(str, steps))}"
    first = ", ".join(map(str, steps[: STEPS_SHOWN - 1]))
    return f"the {len(steps)} steps are {first}, ..., {steps[-1]}"
