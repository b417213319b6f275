"""A job-array script for a Slurm cluster: one task a case, in the order of the study."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from .errors import WorkflowError
from .folder import Folder
from .study import Study


def job_script(study: Study, path: Path, folder: Folder, ranks: int, time: str) -> str:
    """Return the text of a script that runs the cases without a result.

    A task runs its case as `inelastic run --case N` on one machine would; a case that somebody has
    run in the meantime is left alone. Raises WorkflowError if nothing is left to do.
    """
    left = [
        number for number, case in enumerate(study.cases, 1) if not folder.is_measured(study, case)
    ]
    if not left:
        raise WorkflowError(f"{study.name}: every case has a result")
    out = folder.root.resolve()
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
            f"#SBATCH --job-name={'-'.join(study.name.split())}",
            f"#SBATCH --array={_ranges(left)}",
            f"#SBATCH --ntasks={ranks}",
            "#SBATCH --nodes=1",
            "#SBATCH --cpus-per-task=1",
            f"#SBATCH --time={time}",
            f"#SBATCH --output={shlex.quote(str(out / 'slurm-%A_%a.out'))}",
            f'exec {shlex.join(command)} --case "$SLURM_ARRAY_TASK_ID"',
        ]
    )


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
