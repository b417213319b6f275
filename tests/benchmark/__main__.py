"""Measures speed and accuracy on this machine: `make bench`, or `make bench-quick`.

Every ratio comes from one run of this program, so that it holds on a noisy machine; seconds are
those of this machine. What has run is kept in the folder and not run again.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.benchmark import (
    earlier,
    machine,
    million,
    page,
    ranks,
    recorded,
    rooms,
    scenes_without,
    settling,
)
from tests.helpers.pouring import DeckError


@dataclass(frozen=True)
class Size:
    """How much is measured.

    Attributes
    ----------
    particles : of the scenes that settle with hard and with soft contacts
    diameter : of their spheres, length
    seeds : random starts
    time : from the start to the end of these scenes
    growing : numbers of spheres, with which the iterations grow
    ranks : number of spheres for two ranks against one, and for the model of more
    million : whether a million spheres are tried
    """

    particles: int
    diameter: float
    seeds: int
    time: float
    growing: tuple[int, ...]
    ranks: int
    million: bool


QUICK = Size(1_000, 0.11, 5, 2.5, (1_000, 10_000), 10_000, False)
FULL = Size(10_000, 0.052, 2, 1.8, (1_000, 10_000, 100_000), 100_000, True)


def main() -> int:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmark", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="smaller scenes: 9 minutes")
    parser.add_argument("--out", type=Path, default=Path("benchmark"), help="folder for the runs")
    parser.add_argument(
        "parts",
        nargs="*",
        help="of: machine settling recorded growth ranks rooms parts million earlier page",
    )
    parser.add_argument(
        "--commit",
        action="append",
        help="with which the decks are compared, as git names it; may be repeated (part earlier)",
    )
    parser.add_argument(
        "--seeds", type=int, nargs="+", default=[1, 2, 3], help="of these decks (part earlier)"
    )
    options = parser.parse_args()
    size = QUICK if options.quick else FULL
    out = options.out / ("quick" if options.quick else "full")
    parts: dict[str, Callable[[], None]] = {
        "machine": machine.measure,
        "settling": lambda: settling.compare(
            out / "settling", size.particles, size.diameter, size.seeds, size.time
        ),
        "recorded": lambda: recorded.measure(size.particles, size.diameter),
        "growth": lambda: settling.grow(out / "growth", size.growing),
        "ranks": lambda: ranks.measure(size.ranks),
        "rooms": lambda: rooms.measure(size.particles, size.diameter),
        "parts": lambda: scenes_without.measure(each=not options.quick),
        "million": lambda: million.measure(out / "million"),
        "earlier": lambda: earlier.measure(
            options.commit, size.particles, size.diameter, options.seeds, out / "earlier"
        ),
    }
    # It needs chromium and playwright, and is run if it is named.
    if "page" in options.parts:
        parts["page"] = page.measure
    if not size.million:
        del parts["million"]
    if options.commit is None:
        del parts["earlier"]
        if "earlier" in options.parts:
            parser.error("earlier needs --commit")
    for name in options.parts:
        if name not in parts:
            parser.error(f"no part {name}; there are {', '.join(parts)}")
    for name in options.parts or parts:
        try:
            parts[name]()
        except earlier.EarlierError as error:
            parser.error(str(error))
        except DeckError as error:
            print(f"{parser.prog}: {name}: {error.reason}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
