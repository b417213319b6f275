"""Coming to rest takes no momentum from heavy grains that a light one drives apart, slowly.

See tests/validation/test_slow_motion.py for more ratios of the masses, and more time steps.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.lammps_run import run_lmp
from tests.helpers.slow_scenes import (
    OTHERS,
    assert_exact_way,
    assert_goes_on,
    assert_no_momentum,
    wedge,
)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize(("density", "timestep"), [(30, 0.05), (100, 0.01), (1e3, 0.05)])
@pytest.mark.parametrize("more", [1, 10])
def test_a_wedge(density: float, timestep: float, more: float, ranks: int, tmp_path: Path) -> None:
    """A sphere drives two apart, of which one has `more` times the mass, as with `rest no`."""
    assert_goes_on(wedge(density, more * density), tmp_path, timestep, ranks)


@pytest.mark.parametrize("density", [1e4, 1e5])
@pytest.mark.parametrize("timestep", [0.01, 0.05])
def test_a_wedge_of_far_heavier_ones(density: float, timestep: float, tmp_path: Path) -> None:
    """Forces of 1e-5 of a weight move what they act on."""
    assert_goes_on(wedge(density), tmp_path, timestep)


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("density", [1e2, 1e3])
def test_other_scenes(name: str, density: float, tmp_path: Path) -> None:
    """Large spheres, blocks, a row, one beside a wall and dimers go as far as with `rest no`."""
    assert_goes_on(OTHERS[name](density), tmp_path, 0.01)


@pytest.mark.parametrize("more", [2, 10])
@pytest.mark.parametrize("density", [10, 1e3, 1e4])
def test_momentum_along_the_floor(density: float, more: float, tmp_path: Path) -> None:
    """It is 0 in every step where one of two heavy spheres is heavier."""
    assert_no_momentum(wedge(density, more * density), tmp_path, 0.02)


@pytest.mark.parametrize("name", OTHERS)
def test_the_exact_way(name: str, tmp_path: Path) -> None:
    """With `rest no` grains follow the exact equations that tests compare with."""
    scene = OTHERS[name](300)
    assert_exact_way(scene, scene.run(tmp_path, 0.01, "rest no"))


AT_THE_WALL = """
units lj
atom_style sphere
boundary m m m
region box block -4 4 0 4 -4 4
create_box 1 box
create_atoms 1 single -2.0746743424940055 0.21517802268405414 2.5587209408948337
set type 1 diameter 0.4303561432043213 density 1
region wall cylinder y 0 0 3.5093109556424333 0 4 side in
pair_style zero 1
pair_coeff * *
neighbor 0.5 bin
velocity all set {velocity}
timestep 0.10883979885637772
fix gravity all gravity 1 vector 0 -1 0
fix drag all viscous {drag}
fix motion all nve
fix before all store/force
fix contact all inelastic {eps} region wall
compute sums all reduce sum fx fz f_before[1] f_before[3] f_contact[3] f_contact[5]
thermo 1
thermo_style custom step c_sums[1] c_sums[2] c_sums[3] c_sums[4] c_sums[5] c_sums[6]
thermo_modify format float %.17g
run 300
"""


@pytest.mark.parametrize(
    ("velocity", "drag", "eps"),
    [
        (
            "0.012349976401752604 0 0.009985087303544658",
            0.0034823854149554395,
            8.832965567880902e-05,
        ),
        ("0.007739391776564272 0 0.006257380585307283", 0.00032882174135951325, 4.2745977e-06),
    ],
)
def test_a_wall_without_a_force_holds_nothing_back(
    velocity: str, drag: float, eps: float, tmp_path: Path
) -> None:
    """A sphere that rolls along a tube: where the tube has no force it takes no momentum.

    Not in the first steps, in which an overlap of the start is pushed apart.
    """
    deck = AT_THE_WALL.format(velocity=velocity, drag=drag, eps=eps)
    thermo = run_lmp(tmp_path, deck).thermo
    force, before, wall = (
        np.stack([thermo[f"c_sums[{k}]"][3:], thermo[f"c_sums[{k + 1}]"][3:]]) for k in (1, 3, 5)
    )
    free = (wall == 0).all(axis=0)
    assert free.any()
    # Round-off of the forces that are added up.
    assert np.abs(force - before)[:, free].max() <= 1e-12 * np.abs(force).max()
