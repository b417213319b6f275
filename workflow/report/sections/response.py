"""The response of a settled packing whose walls are taken away or whose gravity is tilted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...results.store import Result
from ..blocks import Block, Content, Text
from ..columns import Column, table
from ..data import Data, series
from ..figures import Curve, Figure, Panel, curve
from ..quantities import COORDINATION_NUMBER, FABRIC, PACKING_FRACTION, RATTLERS, Quantity
from ..text import as_short, as_text
from .pictures import step_pictures

# The numbers that are compared, with what they are called where that is not their heading.
COMPARED: Sequence[tuple[Quantity, str]] = (
    (PACKING_FRACTION, "φ in the box"),
    (COORDINATION_NUMBER, ""),
    (RATTLERS, ""),
    *((component, "") for component in FABRIC),
)


@dataclass(frozen=True)
class _Row:
    """One number before and after a change."""

    change: str
    quantity: Quantity
    name: str
    before: float
    after: float

    def text(self, value: float) -> str:
        """Write a value of the number."""
        return as_text(value, self.quantity.decimals)


COLUMNS: Sequence[Column[_Row]] = (
    Column("change", lambda row: row.change),
    Column("number", lambda row: row.name),
    Column("before", lambda row: row.text(row.before)),
    Column("after", lambda row: row.text(row.after)),
    Column("difference", lambda row: row.text(row.after - row.before)),
)


def response(data: Data) -> Content:
    """Show packings before, during and after a change."""
    results = data.results("response")
    blocks = [*_before_and_after(results), *_evolution(results)]
    for result in results:
        name = f"response-{result.variables.get('change', 'change')}"
        blocks += step_pictures([result], name, f"{_change(result)}; steps after the change.")
    if not blocks:
        return Content()
    introduction = Text(
        "The paper's outlook: what a packing does when its stress or its container "
        "changes. A settled packing loses its side walls, or gravity is tilted. Nothing "
        "holds spheres without friction where a wall was: they flow away and leave the "
        "box empty."
    )
    return Content([introduction, *blocks])


def _before_and_after(results: Sequence[Result]) -> list[Block]:
    rows = [
        _Row(
            _change(result),
            quantity,
            Column(name or quantity.heading, str, quantity.unit).head,
            quantity.of(result.before),
            quantity.of(result),
        )
        for result in results
        if result.before is not None
        for quantity, name in COMPARED
    ]
    if not rows:
        return []
    return [
        table(
            "Before and after",
            COLUMNS,
            rows,
            (
                "Fabric: mean square of a component of the contact normals; 1/3 without a "
                "preferred direction. One run each: no scatter is known.",
            ),
        )
    ]


def _evolution(results: Sequence[Result]) -> list[Block]:
    heights: list[Curve] = []
    contacts: list[Curve] = []
    for result in results:
        steps = series(result, "evolution/step")
        height = series(result, "evolution/centre_height")
        z = series(result, "evolution/coordination_number")
        if steps is None or height is None or z is None:
            continue
        heights.append(curve(_change(result), steps, height))
        contacts.append(curve(_change(result), steps, z))
    if not heights:
        return []
    return [
        Figure(
            "response",
            "Mean height of the spheres and coordination number in the box after the change.",
            [
                Panel("step after the change", "mean height [container widths]", heights),
                Panel("step after the change", "coordination number", contacts),
            ],
        )
    ]


def _change(result: Result) -> str:
    change = result.variables.get("change")
    if change == "tilt":
        return f"gravity tilted by {as_short(result.setting('angle'))}°"
    return "side walls removed" if change == "walls" else str(change)
