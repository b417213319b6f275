"""A report from files of results: HTML page, figures and their numbers.

How a report comes about: data.py reads the files, contents.py lists the sections, each section of
sections/ makes blocks (blocks.py, figures.py) and comparisons with the paper from the data, and
page.py writes them as one page, markdown.py their tables as text.

CONTRIBUTING.md says under "To add ..." which files a new number or a new section changes.
"""

from .contents import all_sections
from .data import Data, read_data
from .markdown import render_markdown
from .page import render

__all__ = ["Data", "all_sections", "read_data", "render", "render_markdown"]
