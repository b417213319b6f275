"""The subcommand `inelastic slurm`: a job-array script for a cluster."""

from __future__ import annotations

import argparse
from typing import Any

from ..errors import WorkflowError
from ..files import writing
from ..running.folder import Folder
from ..running.slurm import job_script
from .arguments import add_out, add_studies, read_studies, study_path, warn, whole_number


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    slurm = commands.add_parser(
        "slurm",
        help="write a job-array script for a Slurm cluster",
        description="Print a job-array script that runs the cases of a study that have no result.",
    )
    add_studies(slurm)
    add_out(slurm)
    slurm.add_argument("--ranks", type=whole_number, default=1, help="MPI ranks of each case")
    slurm.add_argument("--time", default="24:00:00", help="limit of one case (default: 24:00:00)")
    slurm.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Print the script; return 0."""
    if len(options.studies) > 1:
        raise WorkflowError("slurm: one study at a time")
    (study,) = read_studies(options.studies)
    warn([study])
    folder = Folder(options.out)
    path = study_path(options.studies[0])
    script = job_script(study, path, folder, options.ranks, options.time)
    with writing(folder.root):
        # Slurm does not make the folder for its output, and a job without one fails unseen.
        folder.root.mkdir(parents=True, exist_ok=True)
    print(script)
    return 0
