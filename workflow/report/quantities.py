"""The measured numbers that the tables of the report show, and how each is written.

The names are those of the datasets numbers/NAME in workflow/results/schema.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ..results.store import Result
from .blocks import Comparison
from .columns import Column, Grouped, Row, difference_cell, ours_text
from .statistics import Sample, numbers
from .text import as_sample, as_short, as_stated


@dataclass(frozen=True)
class Quantity:
    """A measured number.

    Attributes
    ----------
    name : the name of its dataset
    heading : the heading of its column, without the unit
    unit : the unit in which it is shown; empty for a pure number
    factor : what a stored number is multiplied by to have that unit
    decimals : how many decimals are shown
    """

    name: str
    heading: str
    unit: str = ""
    factor: float = 1.0
    decimals: int = 3

    def of(self, result: Result) -> float:
        """Return the number of one run in the unit shown; NaN if it was not measured."""
        return result.number(self.name) * self.factor

    def over(self, results: Iterable[Result]) -> Sample:
        """Return mean and scatter over some runs in the unit shown."""
        return numbers(results, self.name).scaled(self.factor)

    def text(self, results: Iterable[Result]) -> str:
        """Write mean, standard deviation and standard error over some runs."""
        return as_sample(self.over(results), self.decimals)

    def column(self, heading: str = "") -> Column[Grouped]:
        """Return a column that shows the number of each row's runs."""
        return Column(heading or self.heading, lambda row: self.text(row.group), self.unit)


PACKING_FRACTION = Quantity("packing_fraction", "φ", "%", 100.0, 2)
PACKING_FRACTION_WITH_NECKS = Quantity("packing_fraction_with_necks", "φ with necks", "%", 100.0, 2)
COORDINATION_NUMBER = Quantity("coordination_number", "z")
AGITATED_COORDINATION_NUMBER = Quantity("coordination_number_agitated", "z agitated")
COORDINATION_NUMBER_WITHOUT_RATTLERS = Quantity(
    "coordination_number_without_rattlers", "z without rattlers"
)
NEIGHBOURS = Quantity("neighbours", "neighbours")
RATTLERS = Quantity("rattlers", "rattlers", "%", 100.0, 2)
LARGEST_OVERLAP = Quantity("largest_overlap", "largest overlap / r", decimals=6)
RESOLUTION = Quantity("resolution", "ε / (g h²)", decimals=4)
FABRIC = tuple(Quantity(f"fabric_{axis}", f"fabric, {axis}", decimals=4) for axis in "xyz")
Q4, Q6 = Quantity("q4", "q4"), Quantity("q6", "q6")
CRYSTALLINE = Quantity("crystalline", "crystalline", "%", 100.0, 2)

EXCESS_CONTACTS = Quantity("excess_contacts", "excess contacts", "‰", decimals=2)
GAP_EXPONENT = Quantity("gap_exponent", "exponent of gaps")
WEAK_FORCE_EXPONENT = Quantity("weak_force_exponent", "exponent of weak forces")

# The table of a study that is none of the paper's has these columns, as far as they were measured.
OF_ANY_STUDY = (
    PACKING_FRACTION,
    PACKING_FRACTION_WITH_NECKS,
    COORDINATION_NUMBER,
    NEIGHBOURS,
    RATTLERS,
    LARGEST_OVERLAP,
    RESOLUTION,
)

# The resolution is a property of the protocol: the tables of the paper's cases show no scatter.
MEAN_RESOLUTION: Column[Grouped] = Column(
    RESOLUTION.heading, lambda row: as_short(RESOLUTION.over(row.group).mean)
)


def compared(quantity: Quantity, comparison: Callable[[Row], Comparison]) -> list[Column[Row]]:
    """Return three columns that show a comparison of each row: paper, ours, difference."""
    name, unit = quantity.heading, quantity.unit
    return [
        Column(f"{name}, paper", lambda row: as_stated(comparison(row).stated), unit),
        Column(f"{name}, ours", lambda row: ours_text(comparison(row)), unit),
        Column("difference", lambda row: difference_cell(comparison(row).difference), "SE"),
    ]
