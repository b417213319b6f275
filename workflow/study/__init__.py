"""Studies: from a TOML file to its cases, all of it checked before anything runs."""

from .case import Case, Input, Stage, Study, is_word, stage_of
from .case_name import INPUTS
from .file_format import MOST_POINTS, PAPER_BOX, Outputs, ProfileOutput
from .stages import steps_of
from .study_file import mistake_in_name, read_study
from .values import MOST_CASES

__all__ = [
    "INPUTS",
    "MOST_CASES",
    "MOST_POINTS",
    "PAPER_BOX",
    "Case",
    "Input",
    "Outputs",
    "ProfileOutput",
    "Stage",
    "Study",
    "is_word",
    "mistake_in_name",
    "read_study",
    "stage_of",
    "steps_of",
]
