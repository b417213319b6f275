"""A report from files of results: HTML page, figures and their numbers.

How a report comes about: data.py reads the files, contents.py lists the sections, each section of
sections/ makes blocks (blocks.py, figures.py) and comparisons with the paper from the data, and
page.py writes them as one page.

To show one more measured number (a dataset numbers/NAME of workflow/schema.py):

1. Add a `Quantity` to quantities.py: its name, heading, unit and decimals.
2. Add it to `OF_ANY_STUDY` there for the table of every study of a user's own, or
   `QUANTITY.column()` to the columns of a table in sections/. A cell that is no such number is a
   `Column` with a heading and a function from the row to the text; text.py writes its numbers.

To add a section:

1. Write a function from `Data` to `Content` in a file of sections/. `Content()` without blocks
   becomes a note that says how to run the section's study.
2. Add an entry with its title, that function and the studies it needs to `SECTIONS` in contents.py.
   The entry's place is the section's place in the report.
"""

from .contents import all_sections
from .data import Data, read_data
from .page import render

__all__ = ["Data", "all_sections", "read_data", "render"]
