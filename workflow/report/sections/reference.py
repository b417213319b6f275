"""Reference values of hard packings without friction, which the paper does not have."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from lammps_inelastic.analysis import InputError, binned_exponent

from ...results.store import Result
from ..blocks import Block, Content, Text
from ..columns import RUNS, Column, LabelledRuns, table
from ..curves import mean_curve
from ..data import SPHERES, Data, curves_of, profiles
from ..figures import Curve, Figure, Panel, curve
from ..groups import count_of, grouped
from ..quantities import (
    COORDINATION_NUMBER,
    EXCESS_CONTACTS,
    GAP_EXPONENT,
    NEIGHBOURS,
    PACKING_FRACTION,
    RATTLERS,
    WEAK_FORCE_EXPONENT,
)
from ..statistics import Sample, sample
from ..text import as_count, as_sample, as_short

COLUMNS: Sequence[Column[LabelledRuns]] = (
    Column("packing", lambda case: case.label),
    RUNS,
    PACKING_FRACTION.column(),
    COORDINATION_NUMBER.column(),
    NEIGHBOURS.column(),
    RATTLERS.column(),
    EXCESS_CONTACTS.column(),
)
EXPONENTS: Sequence[Column[LabelledRuns]] = (
    Column("packing", lambda case: case.label),
    RUNS,
    GAP_EXPONENT.column(),
    WEAK_FORCE_EXPONENT.column(),
)


@dataclass(frozen=True)
class _Part:
    """Part of the range of a power law: bins with middles between two bounds."""

    heading: str
    x: str
    y: str
    low: float
    high: float

    def column(self) -> Column[LabelledRuns]:
        """Return a column with the exponent of this part."""
        return Column(self.heading, lambda case: as_sample(self.over(case.group), 3))

    def over(self, results: Sequence[Result]) -> Sample:
        """Return mean and scatter of the exponent over the runs."""
        return sample(self.of(result) for result in results)

    def of(self, result: Result) -> float:
        """Return the exponent of one run; NaN where there are too few values."""
        if self.x not in result.values:
            return math.nan
        try:
            return binned_exponent(
                result.values[self.x], result.values[self.y], self.low, self.high
            )
        except InputError:
            return math.nan


GAPS, FORCES = ("gaps/size", "gaps/density"), ("forces/local_ratio", "forces/local_density")
# Halves of the ranges of the fits, at bins of the stored densities.
PARTS = (
    _Part("gaps of 0.001 to 0.01 d", *GAPS, 1e-3, 1.1e-2),
    _Part("gaps of 0.01 to 0.1 d", *GAPS, 1.1e-2, 1e-1),
    _Part("forces of 0.001 to 0.02", *FORCES, 1e-3, 1.77e-2),
    _Part("forces of 0.02 to 0.3", *FORCES, 1.77e-2, 0.3),
)
THEORY = Text(
    "Theory of amorphous packings in many dimensions (Charbonneau, Corwin, Parisi and "
    "Zamponi, Phys. Rev. Lett. 114 (2015) 125504): gaps g^(-0.413); forces f^0.423 where "
    "the opening of a contact moves the whole packing, and f^0.17 where it moves few "
    "particles, as most weak contacts do."
)


def reference(data: Data) -> Content:
    """Show isostaticity, the power laws, the radial distribution function and wall layers."""
    groups = grouped(data.results("reference"), _label)
    cases = [LabelledRuns(label, group) for label, group in groups.items()]
    if not cases:
        return Content()
    figures = [*_power_laws(cases), *_radial(cases), *_layers(cases), *_floor(cases)]
    return Content([*_tables(cases), THEORY, *figures])


def _tables(cases: Sequence[LabelledRuns]) -> list[Block]:
    """Return the tables of the numbers, and of the exponents of the power laws."""
    return [
        table(
            f"Hard packings of {as_count(count_of(cases[0].group))} particles",
            COLUMNS,
            cases,
            (
                "Mean ± standard deviation (standard error) over the runs. φ, z, neighbours and "
                "rattlers are those in the box. Excess: contacts, walls included, less degrees of "
                "freedom, per 1,000 degrees, of all particles that are held: 0 is isostatic.",
            ),
        ),
        table(
            "Exponents of small gaps and weak forces",
            EXPONENTS,
            cases,
            (
                "By maximum likelihood, of gaps from 0.001 to 0.1 diameters and of forces from "
                "0.001 to 0.3 of the mean at their height, of particles that are held in any "
                "direction and touch no wall. Gaps of dimers that are almost spheres follow no "
                "power: the second contact of a pair has the size of the arm.",
            ),
        ),
        table(
            "Exponents of parts of the range",
            (Column("packing", lambda case: case.label), RUNS, *(one.column() for one in PARTS)),
            cases,
            (
                "By maximum likelihood from the stored densities. Forces are over their mean at "
                "the same height. Where two parts have one exponent, the law is a power.",
            ),
        ),
    ]


def _power_laws(cases: Sequence[LabelledRuns]) -> list[Block]:
    """Return a figure of small gaps and weak forces, if they were measured."""
    laws = [
        panel
        for panel in (
            _panel(cases, *GAPS, "gap / d", "density"),
            _panel(cases, *FORCES, "f / ⟨f⟩", "P(f / ⟨f⟩)"),
        )
        if panel is not None
    ]
    if not laws:
        return []
    return [
        Figure(
            "power-laws",
            "Density of small gaps, and of contact forces over their mean at the same height.",
            laws,
        ),
    ]


def _radial(cases: Sequence[LabelledRuns]) -> list[Block]:
    """Return a figure of the radial distribution function, if it was measured."""
    around = _curves(cases, "structure/distance", "structure/radial_distribution")
    if not around:
        return []
    return [
        Figure(
            "radial",
            "Radial distribution function of the particles' centres.",
            [Panel("r [container widths]", "g(r)", around, references=[("no order", 1.0)])],
        ),
    ]


def _layers(cases: Sequence[LabelledRuns]) -> list[Block]:
    """Return a figure of the contacts in layers above the floor, if they were counted."""
    layers = _curves(cases, "layers/height", "layers/coordination_number")
    if not layers:
        return []
    return [
        Figure(
            "layers",
            "Contacts with other particles in layers above the floor, a diameter thick, of "
            "particles between the sides of the measuring box. Near the floor the wall takes "
            "the place of particles, and at the free surface there are fewer of them: the box "
            "lies between, so that its mean is above twice the degrees of freedom of a "
            "particle, while the whole packing has as many contacts as degrees of freedom.",
            [
                Panel(
                    "height above the floor / d",
                    "contacts per particle",
                    layers,
                    references=[
                        ("twice the degrees of freedom: spheres", 6.0),
                        ("twice the degrees of freedom: dimers", 10.0),
                    ],
                )
            ],
        ),
    ]


def _floor(cases: Sequence[LabelledRuns]) -> list[Block]:
    """Return a figure of the packing fraction above the floor, if it was measured."""
    floors = [
        curve(case.label, *mean_curve(found), kind="profile")
        for case in cases
        if (found := profiles(case.group))
    ]
    if not floors:
        return []
    return [
        Figure(
            "floor",
            "Packing fraction in slabs above the floor.",
            [Panel("height above the floor / d", "packing fraction", floors)],
        ),
    ]


def _label(result: Result) -> str:
    if result.record["deck"] == SPHERES:
        return "spheres"
    return f"dimers, L/d = {as_short(result.setting('aspect_ratio'))}"


def _curves(cases: Sequence[LabelledRuns], x: str, y: str) -> list[Curve]:
    return [
        curve(case.label, *mean_curve(found))
        for case in cases
        if (found := curves_of(case.group, x, y))
    ]


def _panel(cases: Sequence[LabelledRuns], x: str, y: str, along: str, up: str) -> Panel | None:
    """Return a panel with two logarithmic axes; None if nothing was measured."""
    curves = []
    for one in _curves(cases, x, y):
        filled = one.y > 0
        errors = None if one.error is None else one.error[filled]
        if filled.any():
            curves.append(curve(one.label, one.x[filled], one.y[filled], errors))
    return Panel(along, up, curves, log=True, log_x=True) if curves else None
