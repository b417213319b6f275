"""Overlaps of a start: where there is room all open, where there is none the run says so.

Random starts below jamming, beds whose spheres grow, and soft packings above jamming, which are
made with LAMMPS's own soft contacts.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.lammps_run import Run, run_lmp

# Steps within which the error must come.
SOON = 10
EPS = 1e-4
SPHERES = """
units lj
atom_style sphere
boundary p p p
variable width equal ({number}*{volume}/{fraction})^(1/3)
region space block 0 ${{width}} 0 ${{width}} 0 ${{width}}
create_box 1 space
create_atoms 1 random {number} {seed} space
set group all diameter 1 density 1
"""
DIMERS = """
units lj
atom_style hybrid sphere 1 molecular
atom_modify map array
boundary p p p
variable width equal ({number}*{volume}/{fraction})^(1/3)
region space block 0 ${{width}} 0 ${{width}} 0 ${{width}}
create_box 1 space
mass 1 1.0
molecule dimer dimer.mol
create_atoms 0 random {number} {seed} space mol dimer {seed}
set group all diameter 1 density 1
comm_modify cutoff 4
"""
# Damped soft spheres, until the overlaps no longer change.
SOFT = """
thermo_style custom step
comm_modify vel yes
pair_style gran/hooke 1000.0 NULL 50.0 NULL 0.0 0
pair_coeff * *
neighbor 0.3 bin
timestep 0.005
fix drag all viscous 0.5
{limited}
run 1500
{free}
run 3000
unfix drag
pair_style zero 1
pair_coeff * *
timestep 0.01
"""
HARD = """
thermo 1
thermo_style custom step f_contact[4] f_contact[12]
run {steps}
"""
# Of a sphere, and of a dimer 1.5 long [diameters^3].
VOLUMES = {"spheres": np.pi / 6, "dimers": 2 * np.pi / 6 - np.pi * (2 + 0.5) * 0.5**2 / 12}


def packed_softly(kind: str, fraction: float, seed: int, folder: Path) -> Run:
    """1,000 particles at a packing fraction above jamming, relaxed as soft ones, then made hard."""
    head = (SPHERES if kind == "spheres" else DIMERS).format(
        number=1000, volume=VOLUMES[kind], fraction=fraction, seed=seed
    )
    if kind == "spheres":
        soft = SOFT.format(
            limited="fix limit all nve/limit 0.05",
            free="unfix limit\nfix motion all nve/sphere",
        )
        hard = f"velocity all set 0 0 0\nfix contact all inelastic {EPS} shorten yes\n"
    else:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "dimer.mol").write_text(
            "# a dimer\n2 atoms\nCoords\n\n1 -0.25 0 0\n2 0.25 0 0\n\nTypes\n\n1 1\n2 1\n"
        )
        soft = SOFT.format(
            limited="neigh_modify exclude molecule/intra all\n"
            "fix bodies all rigid/small molecule\nfix slow all viscous 20",
            free="unfix slow",
        )
        hard = (
            "velocity all zero linear rigid bodies\nvelocity all zero angular rigid bodies\n"
            f"fix contact all inelastic {EPS} rigid bodies solid shorten yes\n"
        )
    deck = head + soft + hard + HARD.format(steps=SOON)
    return run_lmp(folder, deck, must_pass=False, timeout=600)


@pytest.mark.validation
@pytest.mark.parametrize("number", range(10))
@pytest.mark.parametrize(("kind", "lowest"), [("spheres", 0.66), ("dimers", 0.75)])
def test_a_soft_packing_that_is_too_dense_is_refused(
    kind: str, lowest: float, number: int, tmp_path: Path
) -> None:
    """An error, or a warning at the end of the run, within ten steps; never all apart."""
    result = packed_softly(kind, lowest + 0.0044 * number, number + 1, tmp_path)
    told = [line for line in result.errors if "no room" in line]
    left = [line for line in result.warnings if " are left after " in line]
    assert told or left, result.screen[-1500:]
    assert len(result.runs[-1].get("f_contact[4]", ())) <= SOON + 1


@pytest.mark.validation
@pytest.mark.parametrize("seed", range(1, 6))
def test_a_dense_random_start_opens(seed: int, tmp_path: Path) -> None:
    """4,250 spheres at random in a periodic cell, at a packing fraction of 0.60."""
    head = SPHERES.format(number=4250, volume=np.pi / 6, fraction=0.60, seed=seed)
    deck = (
        head
        + f"""
pair_style zero 1
pair_coeff * *
timestep 0.01
neighbor 0.4 bin
fix drag all viscous 0.5
fix contact all inelastic {EPS} shorten yes
fix motion all nve
{HARD.format(steps=300)}"""
    )
    result = run_lmp(tmp_path, deck, timeout=900)
    # Round-off of positions.
    assert result.thermo["f_contact[4]"][-1] <= EPS * (1 + 1e-6)


@pytest.mark.validation
@pytest.mark.parametrize("growth", [1.03, 1.1])
@pytest.mark.parametrize("number", range(10))
def test_a_bed_whose_spheres_grow_swells(number: int, growth: float, tmp_path: Path) -> None:
    """A bed at rest, periodic across, with free height; all overlaps open, and none is refused.

    (Between walls some spheres at the floor may really jam: 160 of 4.5 diameters across do.)
    """
    diameter, eps = 0.11, 3e-5
    deck = f"""
units lj
atom_style sphere
boundary p p f
region box block 0 1 0 1 0 3
create_box 1 box
create_atoms 1 random {200 + 20 * number} {number + 1} box overlap {diameter} maxtry 1000
set group all diameter {diameter} density 1
pair_style zero 0.14
pair_coeff * *
neighbor 0.1 bin
timestep 0.01
region walls block INF INF INF INF 0 3
fix gravity all gravity 9.81 vector 0 0 -1
fix contact all inelastic {eps} region walls shorten yes
fix motion all nve
thermo 1
thermo_style custom step f_contact[4] f_contact[12]
run 200
set group all diameter {diameter * growth}
run 200
"""
    result = run_lmp(tmp_path, deck, timeout=300)
    overlap = result.thermo["f_contact[4]"]
    assert overlap[0] > 0.5 * diameter * (growth - 1)
    # Round-off of positions.
    assert overlap[-1] <= eps * (1 + 1e-6)
    assert not any(" are left after " in line for line in result.warnings)
