"""A job-array script for a Slurm cluster: one task a case, in the order of the study."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

from ..errors import WorkflowError
from ..study import Study
from .folder import Folder

# Slurm writes the limit of a job like this: minutes, with hours and seconds, with days.
_TIME = re.compile(
    r"\d+(:\d+){0,2}|\d+-\d+(:\d+){0,2}|infinite|unlimited", re.ASCII | re.IGNORECASE
)


def job_script(study: Study, path: Path, folder: Folder, ranks: int, time: str) -> str:
    """Return the text of a script that runs the cases without a result.

    A task runs its case as `inelastic run --case N` on one machine would; a case that somebody has
    run in the meantime is left alone. Raises WorkflowError if nothing is left to do, and for a time
    or a folder's name that Slurm would not read as it is meant.

    Parameters
    ----------
    study : study whose cases are run
    path : path of the study's file
    folder : folder where the study runs
    ranks : number of MPI ranks of a case
    time : limit of a case, as Slurm writes it
    """
    if not _TIME.fullmatch(time):
        raise WorkflowError(
            f"--time {time!r}: it must be a limit as Slurm writes it: minutes, "
            "hours:minutes:seconds or days-hours:minutes:seconds"
        )
    left = [
        number for number, case in enumerate(study.cases, 1) if not folder.is_measured(study, case)
    ]
    if not left:
        raise WorkflowError(f"{study.name}: every case has a result")
    out = folder.root.resolve()
    for place in (str(out), str(path.resolve())):
        # A line break would end a line for Slurm, and Slurm has quotes of its own.
        if not place.isprintable() or re.search(r"[\"'\\]", place):
            raise WorkflowError(
                f"{place!r}: a path in a job script must be printable, without quotes and \\"
            )
    command = [
        str(Path(sys.executable).parent / "inelastic"),
        "run",
        str(path.resolve()),
        "--out",
        str(out),
        "--at-once",
        "1",
        "--ranks",
        str(ranks),
    ]
    return "\n".join(
        [
            "#!/bin/bash",
            # Other letters would have to be quoted as Slurm does it.
            f"#SBATCH --job-name={re.sub(r'[^A-Za-z0-9_.+-]+', '-', study.name)}",
            f"#SBATCH --array={_ranges(left)}",
            f"#SBATCH --ntasks={ranks}",
            "#SBATCH --nodes=1",
            "#SBATCH --cpus-per-task=1",
            f"#SBATCH --time={time}",
            # Slurm puts the number of the job in the place of %j in a path, and so on.
            f"#SBATCH --output={_quoted(str(out).replace('%', '%%') + '/slurm-%A_%a.out')}",
            f'exec {shlex.join(command)} --case "$SLURM_ARRAY_TASK_ID"',
        ]
    )


def _quoted(path: str) -> str:
    return f'"{path}"' if re.search(r"\s|[^\w./%+-]", path) else path


def _ranges(numbers: list[int]) -> str:
    """Write ascending numbers as Slurm does: 1-3,7."""
    parts: list[str] = []
    start = previous = numbers[0]
    for number in [*numbers[1:], None]:
        if number is not None and number == previous + 1:
            previous = number
            continue
        parts.append(str(start) if start == previous else f"{start}-{previous}")
        if number is not None:
            start = previous = number
    return ",".join(parts)
