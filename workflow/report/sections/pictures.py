"""Sections that show pictures alone: the paper's Figures 4, 8, 9 and 10."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from lammps_inelastic.analysis.plots import draw_dimer, draw_dimer_section

from ...looking.pictures import NETWORK_DIAMETERS
from ...looking.view import MOST_IN_REPORT, page_of_values
from ...results.store import Result
from ..blocks import Block, Content, Packing, Text
from ..data import Data
from ..figures import Figure, Pictures
from ..groups import count_of
from ..text import as_count, as_short

# The dimer that is drawn has this aspect ratio.
DRAWN = 1.8


def falling_spheres(data: Data) -> Content:
    """Show the steps of a packing of spheres, as the paper's Figure 4 does."""
    results = data.results("figure-4")
    if not results:
        return Content()
    return Content(
        step_pictures(
            results,
            "figure-4",
            f"{as_count(count_of(results))} spheres fall; the colour is the number of contacts. "
            "The paper shows four steps of 100,000 spheres and does not say which.",
        )
    )


def network(data: Data) -> Content:
    """Show the network of contacts, as the paper's Figure 8 does."""
    drawn = [result for result in data.results("figure-8") if "network" in result.pictures]
    if not drawn:
        return Content()
    caption = (
        f"Contacts of {as_count(count_of(drawn))} spheres in the lower half of the packing; width "
        "and colour grow with the force. A picture with a scale shows a slab of "
        f"{NETWORK_DIAMETERS} diameters in the middle, one without it the whole depth."
    )
    blocks = network_picture(drawn, "figure-8", caption)
    return Content([*blocks, *kept_packing(drawn, "figure-8-packing")])


def one_dimer(_: Data) -> Content:
    """Draw a dimer and its neck, as the paper's Figure 9 does."""
    return Content(
        [
            Figure(
                "figure-9",
                f"A dimer of aspect ratio L/d = {DRAWN}: two overlapping spheres of diameter d, L "
                "long. Right: its section, with the neck (hatched), the volume at the waist that "
                "no sphere of the same size (dashed) can reach.",
                drawing=[
                    partial(draw_dimer, aspect_ratio=DRAWN),
                    partial(draw_dimer_section, aspect_ratio=DRAWN),
                ],
            ),
            Text("Drawn from the formulas; no run is needed."),
        ]
    )


def falling_dimers(data: Data) -> Content:
    """Show the steps of a packing of dimers, as the paper's Figure 10 does."""
    results = data.results("figure-10")
    if not results:
        return Content()
    return Content(
        step_pictures(
            results,
            "figure-10",
            f"{as_count(count_of(results))} dimers of L/d = "
            f"{as_short(results[0].setting('aspect_ratio'))} fall; the colour is the number "
            "of contacts. The paper shows four steps and does not say which.",
        )
    )


def step_pictures(results: Sequence[Result], name: str, caption: str) -> list[Block]:
    """Return the pictures of the first result that has any, in the order of their steps."""
    for result in results:
        steps = sorted(step for step in result.pictures if step.isdigit())
        if steps:
            shown = {f"step {as_count(int(step))}": result.pictures[step] for step in steps}
            return [Pictures(name, caption, shown)]
    return []


def kept_packing(results: Sequence[Result], name: str) -> list[Block]:
    """Return the packing of the first result that keeps one; more of them would swell the page."""
    kept = [result for result in results if "packing/ids" in result.values]
    small = [result for result in kept if len(result.values["packing/ids"]) <= MOST_IN_REPORT]
    if small:
        result = small[0]
        page = page_of_values(result.values, result.case, result.number("packing_fraction"))
        return [Packing(name, f"The packing of {result.case}, to turn and to look into", page)]
    if kept:
        most = as_count(MOST_IN_REPORT)
        return [Text(f"Packings of more than {most} spheres are in the HDF5 file alone.")]
    return []


def network_picture(results: Sequence[Result], name: str, caption: str) -> list[Block]:
    """Return the network of contacts of the first result that has a picture of it."""
    for result in results:
        if "network" in result.pictures:
            return [Pictures(name, caption, {"": result.pictures["network"]}, trimmed=True)]
    return []
