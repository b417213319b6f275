"""inputs/spheres.in as it is, on one rank and on two."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    iterate_contact_frames,
    largest_pair_overlap,
    read_particle_frame,
)
from tests.fix.lammps_run import LAUNCHER, Runner

VARIABLES = {
    "steps_agitated": 300,
    "steps_settling": 10,
    "steps_resting": 30,
    "steps_tightening": 5,
    "steps_measuring": 3,
    "dump_every": 40,
}


@pytest.mark.parametrize("ranks", [1, 2])
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
    overlap = largest_pair_overlap(frame.positions, frame.radii).depth
    assert overlap <= 0.00001 * 0.055 * (1 + 1e-6)
    contacts = list(iterate_contact_frames(result.folder / "out" / "contacts.lammpsdump"))
    assert [frame.step for frame in contacts] == [345, 346, 347, 348]
    assert all(len(frame.ids) > 2000 for frame in contacts)  # a settled bed has 2,900


@pytest.mark.parametrize(
    ("variables", "named"),
    [
        # 1,000 spheres of this size fill the container more than completely.
        ({"diameter": 0.22}, "no room: particles of this diameter would fill 1.11"),
        # More than there is memory for.
        ({"particles": 2147483647}, "no room: particles of this diameter would fill 299"),
        ({"drag": 100}, "drag times dt must be below 1, not 1"),
        ({"drag": 75}, "drag times dt_resting must be below 1, not 1.5"),
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
    assert result.runs[-1]["overlap"].max() <= 0.00001 * 0.1 * (1 + 1e-6)  # round-off
