"""A report from files of results: HTML page, figures and their numbers."""

from .data import Data, read_data
from .page import render
from .paper import all_sections

__all__ = ["Data", "all_sections", "read_data", "render"]
