"""inputs/spheres.in as it is, on one rank and on two."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    Spheres,
    iterate_contact_frames,
    largest_pair_overlap,
    read_particle_frame,
)
from tests.helpers.lammps_run import LAUNCHER, Runner

VARIABLES = {
    "steps_agitated": 300,
    "steps_settling": 10,
    "steps_resting": 30,
    "steps_tightening": 5,
    "steps_measuring": 3,
    "dump_every": 40,
}


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_the_deck_runs(ranks: int, lmp: Runner) -> None:
    """1,000 spheres fall and settle; the dumps hold every sphere and only forces that push.

    On two ranks hundreds of contacts cross the boundary, more than fit in the reserve of LAMMPS's
    communication buffers.
    """
    deck = (files("lammps_inelastic.inputs") / "spheres.in").read_text()
    result = lmp(deck, ranks=ranks, variables=VARIABLES, program=LAUNCHER)
    assert not result.warnings, result.warnings
    frame = read_particle_frame(result.folder / "out" / "particles.lammpsdump")
    assert frame.step == 348
    assert np.array_equal(frame.ids, np.arange(1, 1001))
    # The tighter tolerance of the last phase; 1e-6 for round-off.
    overlap = largest_pair_overlap(Spheres(frame.positions, frame.radii)).depth
    assert overlap <= 0.00001 * 0.055 * (1 + 1e-6)
    contacts = list(iterate_contact_frames(result.folder / "out" / "contacts.lammpsdump"))
    assert [frame.step for frame in contacts] == [345, 346, 347, 348]
    assert all(len(frame.ids) > 2000 for frame in contacts)  # a settled bed has 2,900


def test_ten_thousand_spheres_start(lmp: Runner) -> None:
    """Their start is pushed apart, though in most of it nothing is left to move but round-off."""
    deck = (files("lammps_inelastic.inputs") / "spheres.in").read_text()
    phases = ("agitated", "settling", "resting", "tightening", "measuring")
    variables = {f"steps_{phase}": 0 for phase in phases} | {"particles": 10000, "diameter": 0.052}
    result = lmp(deck, variables=variables, program=LAUNCHER)
    # No step is made: all of them hang in the air.
    (warning,) = result.warnings
    assert warning.startswith("WARNING: NOT AT REST: rms speed 0 g h, net force ")
    frame = read_particle_frame(result.folder / "out" / "particles.lammpsdump")
    overlap = largest_pair_overlap(Spheres(frame.positions, frame.radii)).depth
    # The deck's tolerance; 1e-6 for round-off.
    assert overlap <= 0.0005 * 0.026 * (1 + 1e-6)


@pytest.mark.parametrize(
    ("variables", "named"),
    [
        # 1,000 spheres of this size fill the container more than completely.
        ({"diameter": 0.22}, "no room: particles of this diameter would fill 1.12"),
        # More than there is memory for.
        ({"particles": 2147483647}, "no room: particles of this diameter would fill 2.99e+05"),
        ({"drag": 50}, "drag times dt must be below 1, not 1"),
        ({"drag": 30}, "drag times dt_resting must be below 1, not 1.5"),
    ],
)
def test_wrong_parameters(
    variables: dict[str, float], named: str, refused: Callable[..., str]
) -> None:
    """One line says what is wrong."""
    deck = (files("lammps_inelastic.inputs") / "spheres.in").read_text()
    assert named in refused(deck, variables=variables)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_spheres_that_fit_exactly(seed: int, lmp: Runner) -> None:
    """Five fill the width: no gap in their row may be taken for closed without room for it."""
    deck = (files("lammps_inelastic.inputs") / "spheres.in").read_text()
    steps = {"steps_agitated": 20, "steps_settling": 1500, "dump_every": 500}
    result = lmp(deck, variables={"particles": 30, "diameter": 0.2, "seed": seed, **steps})
    # The last run goes on without being set up: its first line tells of a step of the one before.
    assert result.runs[-1]["overlap"][-1] <= 0.00001 * 0.1 * (1 + 1e-6)  # round-off


def start_file(box: tuple[float, float], x: float) -> str:
    """Return a data file of two spheres that overlap and rise, in a box of this width."""
    low, high = box
    return f"""# spheres

2 atoms
1 atom types

{low} {high} xlo xhi
0 5 ylo yhi
{low} {high} zlo zhi

Atoms # sphere

1 1 0.2 1 {x} 1 0.5
2 1 0.2 1 {x} 1.1 0.5

Velocities

1 0 10 0 0 0 0
2 0 10 0 0 0 0
"""


def test_a_start_that_moves_in_a_larger_box(lmp: Runner, tmp_path: Path) -> None:
    """Spheres start at rest, where they are pushed to, and the box is the container."""
    deck = (files("lammps_inelastic.inputs") / "spheres.in").read_text()
    (tmp_path / "start.data").write_text(start_file((-1, 2), 0.5))
    few = {name: 2 for name in VARIABLES} | {"diameter": 0.2, "start": "start.data"}
    lmp(deck, variables=few)
    first = read_particle_frame(tmp_path / "out" / "particles.lammpsdump", 0)
    # Half of the overlap on each side, within the tolerance; 1e-12 for round-off.
    middle = first.positions.mean(axis=0)
    assert middle == pytest.approx([0.5, 1.05, 0.5], abs=1e-12)
    assert np.ptp(first.positions[:, 1]) == pytest.approx(0.2, abs=2 * 0.0005 * 0.1)
    assert first.box.tolist() == [[0, 1], [0, 5], [0, 1]]


@pytest.mark.parametrize(
    ("box", "x", "named"),
    [
        ((0.1, 1), 0.5, "the box of start.data must hold the container"),
        ((-1, 2), 1.5, "every sphere in start.data must have its centre in the container"),
    ],
)
def test_a_start_that_does_not_fit(
    box: tuple[float, float], x: float, named: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    deck = (files("lammps_inelastic.inputs") / "spheres.in").read_text()
    (tmp_path / "start.data").write_text(start_file(box, x))
    assert named in refused(deck, variables={"diameter": 0.2, "start": "start.data"})
