"""Runs a scene with real LAMMPS, and says which answers are allowed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.helpers.lammps_run import BIN, OF_A_LAUNCHER, cores_for

TIMEOUT = 60.0


@dataclass(frozen=True)
class Answer:
    """What LAMMPS answered.

    Attributes
    ----------
    status : exit code; None if it had to be stopped
    screen : all that it printed
    seconds : wall time
    """

    status: int | None
    screen: str
    seconds: float

    @property
    def errors(self) -> list[str]:
        """The lines that start with ERROR, each once, whatever the rank."""
        lines = [line for line in self.screen.splitlines() if line.startswith("ERROR")]
        # LAMMPS names the rank where each has found the same by itself.
        return list(dict.fromkeys(re.sub(r"on proc \d+", "on a rank", line) for line in lines))


def answer(
    folder: Path,
    ranks: int,
    program: Sequence[str],
    environment: Mapping[str, str],
    timeout: float = TIMEOUT,
) -> Answer:
    """Run `deck.in` of a folder."""
    command = [*program, "-in", "deck.in", "-log", "none", "-nocite"]
    if ranks > 1:
        command = [str(BIN / "mpiexec"), "-bind-to", "core", "-n", str(ranks), *command]
    around = {
        name: value for name, value in os.environ.items() if not name.startswith(OF_A_LAUNCHER)
    }
    status: int | None
    with cores_for(ranks):
        start = time.monotonic()
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=around | {"OMP_NUM_THREADS": "1"} | dict(environment),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
            text=True,
            errors="replace",
        )
        try:
            screen, _ = process.communicate(timeout=timeout)
            status = process.returncode
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            screen, _ = process.communicate()
            status = None
        seconds = time.monotonic() - start
    (folder / "screen.txt").write_text(screen)
    return Answer(status, screen, seconds)


Facts = dict[str, Any]


def _may_be_slow(facts: Facts) -> bool:
    """Whether more than 100,000 iterations are no surprise: unequal masses, or walls that close."""
    return (
        facts["spread"] > 2
        or facts["closing"]
        or facts["warn"]
        or "densities differ" in facts["words"]
        or "mass ratio" in facts["words"]
        or facts["tightest"] < 1e-6 * facts["smallest"]
        # The part of the forces that the tolerance asks to be known.
        or facts["tightest"] < 1e-7 * facts["pull"]
    )


# A message of the fix, and the scenes in which it is the right answer.
REFUSALS: tuple[tuple[str, Callable[[Facts], bool]], ...] = (
    (r"further than the neighbour list reaches", lambda facts: not facts["shorten"]),
    (r"Bodies spin by up to .* radians in this step", lambda facts: not facts["shorten"]),
    (
        r"The contact law asks more surfaces to part.* close in, and leave no room",
        lambda facts: facts["closing"] or not facts["shorten"],
    ),
    (
        r"The contact law asks more surfaces to part",
        # A grain that appears where there is no room for it has none in a shorter step either.
        lambda facts: not facts["shorten"] or facts["bad_start"] or "created" in facts["words"],
    ),
    # Fewer iterations are allowed here than by default.
    (r"The residual is still coming down", lambda facts: True),
    (r"the scene leaves no room for the spheres: they have a volume", lambda facts: False),
    (
        r"no velocities keep .* none for those at the end of the step",
        lambda facts: not facts["shorten"],
    ),
    (
        r"no velocities keep the surfaces apart",
        lambda facts: facts["closing"] or facts["bad_start"],
    ),
    (r"no time step above .* keeps the spheres apart", lambda facts: facts["closing"]),
    # The forces with which grains are squeezed hide those of others.
    (
        r"what contacts change is left.* walls or frozen spheres close in",
        lambda facts: facts["closing"],
    ),
    # Such a start is drawn without a look at whether there is room.
    (r"do not open any more where all give way", lambda facts: facts["bad_start"]),
    (
        r"iterations left a gap short.*The gaps at the end of the step",
        lambda facts: not facts["shorten"],
    ),
    (r"iterations left a gap short", _may_be_slow),
    (
        r"is on the wrong side of region",
        lambda facts: (
            facts["closing"]
            or "created" in facts["words"]
            or facts["bad_start"]
            # A step that was not solved may go anywhere.
            or facts["warn"]
        ),
    ),
    (
        r"run pre no cannot go on from a step that was pushing",
        # Without `shorten` bodies and curved walls may leave what the next step pushes apart.
        lambda facts: facts["bad_start"] or facts["warn"] or not facts["shorten"],
    ),
    (r"The tolerance is below the round-off of these forces", lambda facts: facts["spread"] > 4),
    (r"spheres move further than LAMMPS can follow them", lambda facts: not facts["shorten"]),
)


# The warning of a step that was not solved begins so.
UNSOLVED = r"WARNING: Fix inelastic: step \d+: (\d+ iterations left|no velocities keep)"


def finding(of: Answer, facts: Facts) -> str:
    """What is wrong with an answer; empty if it is the end of the deck, or a right refusal."""
    if of.status is None:
        return f"hangs: still running after {of.seconds:.0f} s"
    if "Sanitizer" in of.screen or "runtime error" in of.screen:
        found = re.search(r".*(Sanitizer|runtime error).*", of.screen)
        return f"sanitizer: {found.group(0) if found else ''}"
    if of.status == 0 and "@end" in of.screen:
        return ""
    errors = of.errors
    if not errors:
        return f"crash: exit code {of.status} without an ERROR line: {of.screen[-300:]!r}"
    if len(errors) > 1:
        return "two different errors: " + " / ".join(errors)
    # A step that `maxiter ... warn` goes on with unsolved may end beyond a box of fixed size.
    lost = re.search(r"Lost atoms|Rigid body atoms .* missing", errors[0])
    if facts["warn"] and re.search(UNSOLVED, of.screen) and lost:
        return ""
    for pattern, condition in REFUSALS:
        if re.search(pattern, errors[0]):
            return "" if condition(facts) else f"a refusal that does not fit: {errors[0]}"
    return f"an error that no scene should meet: {errors[0]}"
