"""Steps that are solved to the tolerance and not to the accuracy are counted, and end a run."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.crystals import crystal, run_crystal
from tests.helpers.exact_scenes import spheres_of
from tests.helpers.lammps_run import run_lmp


def test_the_summary_counts_them(tmp_path: Path) -> None:
    """What steps missed stands in the log, and how many of them took all iterations."""
    run = run_crystal(tmp_path, 2, 1.0, options="maxiter 400")
    assert run.status == 0, run.errors
    told = re.search(
        r"in (\d+) steps the accuracy was not reached, only the tolerance; (\d+) of them ended at "
        r"maxiter",
        run.screen,
    )
    assert told is not None
    assert 0 < int(told[2]) <= int(told[1]) <= len(run.thermo["f_contact[1]"])
    # A step may take its last iteration just when it reaches the accuracy.
    assert int(told[2]) <= np.count_nonzero(run.thermo["f_contact[1]"] >= 400)


def test_a_bed_that_is_solved_has_no_such_line(tmp_path: Path) -> None:
    """A crystal at rest reaches the accuracy in every step."""
    run = run_crystal(tmp_path, 2, 0.0)
    assert run.status == 0, run.errors
    assert "accuracy was not reached" not in run.screen
    assert "could not be solved" not in run.screen


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_network_is_named(ranks: int, tmp_path: Path) -> None:
    """Where so few iterations leave most of the forces unknown the run ends, and says of what."""
    run = run_crystal(tmp_path, 2, 1.0, ranks=ranks, options="maxiter 40")
    assert run.status != 0
    (error,) = run.errors
    assert re.search(
        r"\d+ contacts with a force are too many, or too alike, for 32 particles", error
    )
    assert "raise maxiter (40)" in error


@pytest.mark.parametrize("shorten", ["no", "yes"])
def test_masses_are_named(shorten: str, tmp_path: Path) -> None:
    """A grain too heavy for double precision to resolve is an error that names it."""
    points = np.array([[0.0, 0.5 + k, 0.0] for k in range(6)])
    deck = spheres_of(
        points,
        tmp_path,
        tolerance=1e-9,
        timestep=0.005,
        setup="region floor plane 0 0 0 0 1 0\n",
        fixes="set atom 6 density 1e18\n",
        options=f"region floor shorten {shorten}",
        thermo="step f_contact[1]",
    )
    run = run_lmp(tmp_path, f"{deck}run 60\n", must_pass=False)
    assert run.status != 0
    (error,) = run.errors
    assert re.search(
        r"Masses of \S+ \(atom 6\) and \S+ \(atom \d\) push one another, 1e\+18 : 1", error
    )


def test_the_crystal_touches() -> None:
    """The scene is what it says: twelve neighbours at a distance of 1 inside, none nearer."""
    points = crystal(2)
    between = np.linalg.norm(points[:, None] - points, axis=-1)
    np.fill_diagonal(between, np.inf)
    # Round-off of the square root of 2.
    assert between.min() == pytest.approx(1.0, rel=1e-12)
