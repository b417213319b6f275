"""The subcommand `inelastic deck`: a shipped deck as a start for one's own."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from ..study.starting_points import deck_lines, text_of_deck


def add_parser(commands: argparse._SubParsersAction[Any]) -> None:
    """Add the subcommand to those of `inelastic`."""
    deck = commands.add_parser(
        "deck",
        help="print a shipped deck, to change it and run it with lmp",
        description="Print a shipped LAMMPS deck: `inelastic deck spheres > mine.in`, then `lmp "
        "-in mine.in`. Without a name, list the decks.",
    )
    deck.add_argument("name", nargs="?", metavar="NAME", help="name of a deck")
    deck.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Print the deck, or the list; 0, or a WorkflowError."""
    if options.name is not None:
        sys.stdout.write(text_of_deck(options.name))
        return 0
    lines = deck_lines()
    width = max(map(len, lines))
    for name, line in lines.items():
        print(f"{name:<{width}}  {line}")
    return 0
