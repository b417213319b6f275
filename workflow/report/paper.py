"""The sections of a report, in their order."""

from __future__ import annotations

from collections.abc import Sequence

from ..shipped import STUDIES as OF_THE_PAPER
from .beyond import beyond_sections
from .blocks import Section
from .data import Data
from .dimers import dimers_sections
from .generic import study_section
from .provenance import provenance_section
from .spheres import spheres_sections


def all_sections(data: Data, files: Sequence[str]) -> list[Section]:
    """Return all sections: those of the paper if any of its studies is there, and the others.

    Parameters
    ----------
    data : from the files
    files : their names
    """
    sections: list[Section] = []
    if any(name in data.studies for name in OF_THE_PAPER):
        sections += [*spheres_sections(data), *dimers_sections(data), *beyond_sections(data)]
    sections += [
        study_section(study) for name, study in data.studies.items() if name not in OF_THE_PAPER
    ]
    return [*sections, provenance_section(data, files)]
