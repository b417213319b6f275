"""Physics of poured dimers and tetrahedra, against the paper."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import ParticleDump, largest_pair_overlap
from tests.helpers.pouring import Packing, measure, run_deck, shipped_deck

pytestmark = pytest.mark.validation

# So that every bed of dimers covers the paper's box
DIAMETER = 0.085
DIMERS: dict[str, object] = {"particles": 2000, "diameter": DIAMETER, "dump_every": 100000}
SEEDS = (1, 2)
# So that the scatter of orientations over seeds is known.
MORE_SEEDS = (1, 2, 3, 4, 5, 6)
# The paper, for every aspect ratio above 1; within what it states
PAPER_Z, PAPER_Z_TOLERANCE = 10.0, 0.2
# [standard errors] Of ten comparisons, all independent, one in 30 repetitions would exceed it.
FAR = 3.0
SLACK = 1 + 1e-6  # round-off of positions and of the dump

# Aspect ratio, start and seed to the packing.
Poured = Callable[[float, str, int], Packing]


@pytest.fixture(scope="module")
def poured(tmp_path_factory: pytest.TempPathFactory) -> Poured:
    """Pour dimers of an aspect ratio once for each start and seed."""

    @cache
    def pour(aspect_ratio: float, start: str, seed: int) -> Packing:
        folder = tmp_path_factory.mktemp("dimers")
        variables: dict[str, object] = {"aspect_ratio": aspect_ratio, "start": start, "seed": seed}
        if aspect_ratio < 1.04:  # at the deck's 2e-5 gaps that count as closed add 1 % to contacts
            variables["tolerance_measuring"] = 5e-4 * (aspect_ratio - 1)
        run_deck(folder, shipped_deck("dimers"), DIMERS | variables)
        return measure(folder)

    return pour


@pytest.mark.parametrize("aspect_ratio", [1.01, 1.5, 1.95])
def test_contacts_and_neighbours_of_dimers(aspect_ratio: float, poured: Poured) -> None:
    """2,000 dimers: ten contacts each, and fewer neighbours, at every aspect ratio."""
    packings = [poured(aspect_ratio, "random", seed) for seed in SEEDS]
    contacts = [packing.coordination_number.mean for packing in packings]
    neighbours = [packing.neighbours.mean for packing in packings]
    print(
        f"L/d {aspect_ratio}: contacts {np.round(contacts, 2)}, "
        f"neighbours {np.round(neighbours, 2)}"
    )
    assert abs(np.mean(contacts) - PAPER_Z) < PAPER_Z_TOLERANCE
    assert max(neighbours) < PAPER_Z


def test_no_memory_of_the_start(poured: Poured) -> None:
    """Dimers that all start along x end as those that start anyhow, and x and z are alike."""
    directions = {}
    for start in ("random", "regular"):
        found = [poured(1.95, start, seed).orientation for seed in MORE_SEEDS]
        squares = np.mean([o.components**2 for o in found], axis=0)
        # Of the mean square, from those of its root
        errors = [2 * o.components * o.standard_errors for o in found]
        directions[start] = squares, np.sqrt(np.sum(np.square(errors), axis=0)) / len(found)
    means = (
        f"{start} {np.round(np.sqrt(squares) / DIAMETER, 3)}"
        for start, (squares, _) in directions.items()
    )
    print(f"L/d 1.95, lengths along x, y, z in diameters from two starts: {', '.join(means)}")
    (random, random_error), (regular, regular_error) = directions.values()
    assert np.all(np.abs(random - regular) < FAR * np.hypot(random_error, regular_error))
    for squares, errors in directions.values():
        assert abs(squares[0] - squares[2]) < FAR * np.hypot(errors[0], errors[2])
        assert squares[1] < min(squares[0], squares[2])  # the paper: dimers lie rather than stand


def thrown(deck: str) -> str:
    """Give the bodies a downward velocity at the start: LAMMPS reads it when they are set up."""
    define = "fix             bodies all rigid/small"
    again = (
        "unfix bodies\n"
        'if "${inertia} == point" then "set group all diameter 0"\n'
        "velocity all set 0 -30 0\n"
        "fix bodies all rigid/small molecule reinit no\n"
        "fix grow all adapt 0 atom diameter v_diameter_now mass no\n"
        "run 0\nunfix grow\n"
    )
    assert define in deck
    return deck.replace(
        "velocity        all zero linear rigid bodies\n"
        "velocity        all zero angular rigid bodies\n",
        again,
    )


SCENES: dict[str, tuple[str, dict[str, object]]] = {
    "dimers 1.05": (shipped_deck("dimers"), {"aspect_ratio": 1.05}),
    "dimers 1.5": (shipped_deck("dimers"), {"aspect_ratio": 1.5}),
    "solid dimers 2": (shipped_deck("dimers"), {"aspect_ratio": 2.0, "inertia": "solid"}),
    "tetrahedra": (shipped_deck("clusters"), {}),
    "dimers 1.5, thrown": (thrown(shipped_deck("dimers")), {"aspect_ratio": 1.5}),
    "tetrahedra, thrown": (thrown(shipped_deck("clusters")), {}),
}


@pytest.mark.parametrize("name", SCENES)
def test_overlap_of_every_step(name: str, tmp_path: Path) -> None:
    """Fall, impact and agitation: the largest overlap, from a dump of every step."""
    deck, variables = SCENES[name]
    steps = {
        "steps_agitated": 150,
        "steps_settling": 100,
        "steps_resting": 0,
        "steps_tightening": 0,
        "steps_measuring": 0,
    }
    # All phases have the tolerance of the second one; the overlaps here are of the first two.
    same = dict.fromkeys(("tolerance_agitated", "tolerance", "tolerance_measuring"), 0.0005)
    run_deck(tmp_path, deck, {"dump_every": 1, **steps, **same, **variables})
    worst, frames = 0.0, 0
    for frame in ParticleDump(tmp_path / "particles.lammpsdump"):
        radius = float(frame.radii[0])
        pair = largest_pair_overlap(frame.spheres).depth
        gap = min(frame.positions.min(), (np.array([1.0, 5.0, 1.0]) - frame.positions).min())
        worst = max(worst, pair / radius, 1 - float(gap) / radius)
        frames += 1
    print(f"{name}: largest overlap {worst / 0.0005:.4f} tolerances in {frames} steps")
    assert frames == 251
    assert worst <= 2 * 0.0005 * SLACK
