"""A run's log, particle dump and contact dump, and whether they belong together.

A dump that has lost whole frames is still a dump, and every number that comes from it looks fine.
Here the steps of the frames are compared with those that the log tells of, and the contacts with
the particles that they are combined with.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .contacts import ContactFrame, iterate_contact_frames
from .coordination import contact_counts
from .dump_text import open_dump, read_header, read_rows
from .errors import DumpError, RunFilesError, UnfinishedRunError
from .particles import ParticleDump, ParticleFrame
from .run_log import RunLog, Written

# An error names so many steps whose frames are missing.
STEPS_SHOWN = 4
AGAIN = "run it again"


@dataclass(frozen=True, eq=False)
class RunFiles:
    """Files of one run whose frames are all there.

    Attributes
    ----------
    particles : the particle dump
    contacts : path of the contact dump; None where there is none, or none is asked for
    log : None where there is none, or where it is of something else
    """

    particles: ParticleDump
    contacts: Path | None
    log: RunLog | None

    def contact_frames(
        self, frame: ParticleFrame, step: int | None = None
    ) -> Iterator[ContactFrame]:
        """Read the contact frames, and see that each belongs to a particle frame.

        Parameters
        ----------
        frame : the last one of the particle dump, or that of `step`
        step : time step of the one contact frame that is read, if it is there; None for all

        Raises RunFilesError where the contacts are not those of these particles.
        """
        if self.contacts is None:
            raise RunFilesError(f"{self.particles.path}: no contact dump belongs to it")
        written = None if self.log is None else self.log.written(self.contacts)
        for number, contacts in enumerate(iterate_contact_frames(self.contacts)):
            if step is not None and contacts.step != step:
                continue
            known = written is not None and number < len(written.runs)
            run = int(written.runs[number]) if written is not None and known else None
            self._check(self.contacts, contacts, frame, run)
            yield contacts
            if step is not None:
                return

    def _check(
        self, path: Path, contacts: ContactFrame, frame: ParticleFrame, run: int | None
    ) -> None:
        last = frame.step == self.particles.steps[-1]
        check_contacts(contacts, frame, path, last and self._same_moment(run))
        if run is not None:
            between = int((contacts.ids[:, 1] > 0).sum())
            counted = {5: between, 6: len(contacts.ids) - between}
            self._compare(path, contacts.step, run, counted)

    def check_last(self) -> None:
        """See that the last particle frame has the contacts of which the log tells."""
        written = self._written(self.particles.path)
        # A frame of another run need not be read.
        if written is None or self.particles.steps[-1] != written.steps[-1]:
            return
        frame = self.particles[-1]
        if frame.contacts is not None and written.fix is not None and written.group == "all":
            counted = {5: int(frame.contacts.sum()) / 2}
            self._compare(self.particles.path, frame.step, int(written.runs[-1]), counted)

    def _written(self, path: Path | None) -> Written | None:
        return None if self.log is None or path is None else self.log.written(path)

    def _same_moment(self, run: int | None) -> bool:
        """Whether a run that wrote contacts of a fix also wrote those of the last particle frame.

        Contacts of a step that ends one run and begins the next are solved for in each of them.
        """
        particles, contacts = self._written(self.particles.path), self._written(self.contacts)
        if particles is None or contacts is None or particles.fix is None:
            return False
        return particles.fix == contacts.fix and int(particles.runs[-1]) == run

    def _compare(self, path: Path, step: int, number: int, counted: Mapping[int, float]) -> None:
        """Compare numbers of contacts with the columns of the log, by their places in the fix."""
        assert self.log is not None
        run = self.log.runs[number]
        line = np.flatnonzero(run.thermo["Step"] == step)
        for place, column in run.counts.items():
            if place not in counted or not len(line):
                continue
            told = run.thermo[column][line[0]]
            if told != counted[place]:
                raise RunFilesError(
                    f"{path}: {counted[place]:g} contacts at step {step}, but {told:g} in the "
                    f"column {column} of {self.log.path.name}: they are of different runs; {AGAIN}"
                )


def open_run(
    particles: ParticleDump, contacts: Path | None, log: RunLog | None, *, over: bool = True
) -> RunFiles:
    """Compare the frames of a run's dumps with each other and with its log.

    A dump that a log does not tell of cannot be compared with it: one of another name, one that is
    written at the steps of a variable. Then frames must be in their order, and the contact dump
    must end at the step of the particle dump.

    Parameters
    ----------
    particles : the particle dump
    contacts : of the contact dump; None where contacts are not needed
    log : of the run; None where there is none
    over : whether the run must have ended

    Raises RunFilesError, DumpError or LogError with one line: which file, and what is missing.
    """
    paths = [path for path in (particles.path, contacts) if path is not None]
    if log is not None and over:
        _check_end(log, paths)
    # A log that tells of neither may be of anything.
    if log is not None and not any(log.names(path) for path in paths):
        log = None
    _check_steps(particles.path, particles.steps, log, repeats=True)
    written = None if log is None else log.written(particles.path)
    if log is not None and written is not None and written.group == "all":
        _check_number(particles, written, log)
    if contacts is not None:
        steps = frame_steps(contacts)
        _check_steps(contacts, steps, log, repeats=False)
        if steps[-1] != particles.steps[-1]:
            raise RunFilesError(
                f"{contacts}: its last frame is of step {steps[-1]}, that of "
                f"{particles.path.name} of step {particles.steps[-1]}: these contacts are not of "
                f"these particles; {AGAIN}"
            )
    return RunFiles(particles, contacts, log)


def check_contacts(
    contacts: ContactFrame, frame: ParticleFrame, path: Path, same_moment: bool = False
) -> None:
    """See that contacts are of the particles of a frame.

    Parameters
    ----------
    contacts : the contacts
    frame : the particles
    path : of the contact dump, for errors
    same_moment : whether both were written at once, where they have the same step: then every
        sphere has as many contacts as the particle dump says

    Raises RunFilesError where a contact names a sphere that the frame does not have, or where a
    sphere's contacts are more or fewer.
    """
    spheres = contacts.ids[contacts.ids > 0]
    unknown = spheres[~np.isin(spheres, frame.ids)]
    if len(unknown):
        raise RunFilesError(
            f"{path}: a contact at step {contacts.step} names sphere {unknown[0]}, which the "
            "particle dump does not have"
        )
    if not same_moment or frame.contacts is None or contacts.step != frame.step:
        return
    images = frame.cell.has_images
    counted = contact_counts(contacts.ids, frame.ids, images=images).particles
    wrong = np.flatnonzero(counted != frame.contacts)
    if len(wrong):
        first = wrong[0]
        raise RunFilesError(
            f"{path}: sphere {frame.ids[first]} has {counted[first]} contacts at step "
            f"{contacts.step}, but {frame.contacts[first]} in the particle dump: they are of "
            f"different runs; {AGAIN}"
        )


def frame_steps(path: Path) -> tuple[int, ...]:
    """Return the steps of a dump's frames, each of which is whole; at least one must be there."""
    steps = []
    line = 1
    with open_dump(path) as dump:
        while header := read_header(dump, path, line):
            read_rows(dump, path, header)
            steps.append(header.step)
            line = header.next_line
    if not steps:
        raise DumpError(path, "the file is empty")
    return tuple(steps)


def _check_end(log: RunLog, paths: Sequence[Path]) -> None:
    """See that a log goes on to the end of its runs, if it can be that of some dumps."""
    unknown = [path.name for path in paths if log.written(path) is None]
    cut = None if log.complete else log.runs[-1]
    said = ""
    if cut is not None and len(unknown) < len(paths):
        said = f"nothing after step {cut.known} of the run that begins at step {cut.first}"
    elif unknown and not log.ended:
        said = f"its end is missing, and what is there does not tell of {' and '.join(unknown)}"
    if said:
        raise UnfinishedRunError(f"{log.path}: {said}: it is still under way, or was cut off")


def _check_steps(path: Path, steps: Sequence[int], log: RunLog | None, *, repeats: bool) -> None:
    """Compare the steps of a dump's frames with those that the log tells of.

    A run without a log that goes on from a restart file may repeat the step at which it began.
    """
    written = None if log is None else log.written(path)
    wanted = [] if written is None else written.steps.tolist()
    if list(steps) == wanted:
        return
    for before, after in itertools.pairwise(steps):
        if after < before:
            raise RunFilesError(
                f"{path}: the frame of step {after} comes after that of step {before}; {AGAIN}"
            )
    twice = [step for step, after in itertools.pairwise(steps) if step == after]
    if written is None and repeats:
        return
    if twice and len(set(wanted)) == len(wanted):
        raise RunFilesError(f"{path}: the frame of step {twice[0]} is there twice; {AGAIN}")
    if log is None or written is None:
        return
    missing, more = _differences(written, steps)
    if missing:
        raise RunFilesError(
            f"{path}: {_frames(missing)} that {log.path.name} tells of {_are(missing)} missing; "
            f"{AGAIN}"
        )
    # While a run goes on, its log is behind its dump.
    more = [step for step in more if log.complete or step <= log.runs[-1].known]
    if more:
        raise RunFilesError(
            f"{path}: {log.path.name} does not tell of {_frames(more)}: it is of another run, or "
            f"lacks its end; {AGAIN}"
        )


def _differences(written: Written, steps: Sequence[int]) -> tuple[list[int], list[int]]:
    """Return the steps of frames that are missing, and of those that should not be there."""
    missing, more = [], []
    place = 0
    for wanted in written.steps.tolist():
        while place < len(steps) and steps[place] < wanted - written.slack:
            more.append(steps[place])
            place += 1
        if place < len(steps) and steps[place] <= wanted + written.slack:
            place += 1
        else:
            missing.append(wanted)
    return missing, [*more, *steps[place:]]


def _check_number(particles: ParticleDump, written: Written, log: RunLog) -> None:
    """Compare the number of spheres with those of the runs that wrote the dump."""
    writers = [log.runs[run] for run in written.runs.tolist()]
    numbers = {run.atoms for run in writers} - {None}
    there = set(particles.spheres)
    wrong = next(iter(there)) if len(there) == 1 and not there & numbers else None
    if len(there) > 1 and particles.steps == tuple(written.steps.tolist()):
        # A log tells the number of atoms at the end of each run only.
        ends = zip(particles.spheres, particles.steps, writers, strict=True)
        known = ((count, run.atoms) for count, step, run in ends if step == run.known)
        wrong, numbers = next(
            ((count, {atoms}) for count, atoms in known if atoms not in (None, count)),
            (None, numbers),
        )
    if numbers and wrong is not None:
        raise RunFilesError(
            f"{particles.path}: {wrong} spheres, but {max(numbers)} atoms in "
            f"{log.path.name}: they are of different runs; {AGAIN}"
        )


def _frames(steps: Sequence[int]) -> str:
    """Name some frames by their steps."""
    if len(steps) == 1:
        return f"the frame of step {steps[0]}"
    if len(steps) > STEPS_SHOWN + 1:
        named = ", ".join(str(step) for step in steps[:STEPS_SHOWN])
        return f"{len(steps)} frames (steps {named}, ..., {steps[-1]})"
    return f"{len(steps)} frames (steps {', '.join(str(step) for step in steps)})"


def _are(steps: Sequence[int]) -> str:
    return "is" if len(steps) == 1 else "are"
