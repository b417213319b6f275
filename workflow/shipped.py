"""The decks and studies that are shipped, and the places where their results are looked for.

The package holds the decks and the studies. Results are data of the repository, in its folder
`results`: one folder a study, one HDF5 file a case.
"""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path

from .errors import WorkflowError

# The deck that changes walls or gravity, and the one that lets a start fall until it rests.
RESPONSE, SETTLING = "response", "settling"
# The smallest deck has no variables, and is none for studies.
MINIMAL = "minimal"
# The deck behind `pack` in Python is none for studies, either.
PACK = "pack"
# These are the names of the decks, in files with the ending `.in`.
DECKS = ("spheres", "dimers", "clusters", RESPONSE, "gluey", SETTLING)
# These are the names of the studies, in files with the ending `.toml`, in the order of the paper.
STUDIES = (
    "table-1",
    "more-seeds",
    "counting",
    "table-2",
    "figure-4",
    "figure-8",
    "dimers",
    "figure-10",
    "dimers-agitation",
    "dimers-soft",
    "response",
    "repose",
    "reference",
    "protocol",
)
_INPUTS = files("lammps_inelastic.inputs")
STUDIES_FOLDER = Path(str(_INPUTS / "studies"))
# This folder holds smaller studies of the same names.
QUICK_FOLDER = STUDIES_FOLDER / "quick"

RESULTS = "results"
# This environment variable names another folder of results.
RESULTS_VARIABLE = "INELASTIC_RESULTS"


def deck_text(name: str) -> str:
    """Return the text of a shipped deck."""
    return (_INPUTS / f"{name}.in").read_text()


def first_study_text() -> str:
    """Return the text of the study with which a study of one's own begins."""
    return (_INPUTS / "study.toml").read_text()


def shipped_studies() -> dict[str, Path]:
    """Return the files of the shipped studies by their names, in alphabetical order."""
    return {file.stem: file for file in sorted(STUDIES_FOLDER.glob("*.toml"))}


def find_stored_results(chosen: Path | None = None) -> Path:
    """Return the folder that holds the stored results of the shipped studies.

    A folder that is chosen is the only one that is tried, and so is the one that the environment
    variable INELASTIC_RESULTS names. Otherwise it is `results` in the folder from which the program
    was started or, where the program runs from a clone of the repository, in that.

    Raises WorkflowError with one line that names the folders that were tried.
    """
    named = os.environ.get(RESULTS_VARIABLE)
    if chosen is not None:
        tried = [chosen]
    elif named:
        tried = [Path(named)]
    else:
        clone = Path(__file__).resolve().parents[1]
        tried = [Path(RESULTS).absolute()]
        if (clone / "pyproject.toml").is_file() and clone / RESULTS not in tried:
            tried.append(clone / RESULTS)
    for folder in tried:
        if any((folder / study).is_dir() for study in STUDIES):
            return folder
    raise WorkflowError(
        f"no stored results in {' or '.join(map(str, tried))}: start it in a clone of the "
        f"repository, or name a folder of results with --results or {RESULTS_VARIABLE}"
    )
