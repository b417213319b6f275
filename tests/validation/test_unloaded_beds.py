"""When a load on a bed at rest goes, nothing leaps, and nothing gains energy.

Gravity that is multiplied scales all forces of a bed: they balance in the same places, and nothing
moves, then or when it is set back.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.fix.bodies import dimer, random_bodies
from tests.fix.exact_scenes import (
    MASS,
    PRESSED,
    RADIUS,
    UNLOADING,
    WEIGHT,
    assert_nothing_leaps,
    path,
    spheres_of,
)
from tests.fix.lammps_run import run_lmp
from tests.fix.scenes import DUMP_PARTICLES, GRAVITY, FloatArray, random_points

pytestmark = pytest.mark.validation

EPS = 1e-3
SIDE = 7.0
BOX = ((0.0, SIDE), (0.0, 40.0), (0.0, SIDE))
# The step of the loads, of which a bed rests for some hundred before.
STEP, RESTED = 0.001, 300
SETTLING = 6000


def settling(kind: str, folder: Path, **settings: Any) -> str:
    """Return a deck in which 500 spheres or 250 dimers fall, and its run that ends at rest."""
    bodies = None
    if kind == "spheres":
        inside = tuple((low + RADIUS, high - RADIUS) for low, high in BOX)
        points = random_points(500, inside, 2 * RADIUS, seed=1)
    else:
        inside = tuple((low + 2 * RADIUS, high - 2 * RADIUS) for low, high in BOX)
        placed = random_bodies([dimer(1.5)] * 250, RADIUS, inside, seed=1)
        points, bodies = placed.positions, placed.molecules
    deck = spheres_of(
        points,
        folder,
        bodies=bodies,
        tolerance=EPS,
        timestep=0.02,
        skin=0.5,
        box=BOX,
        setup="",
        options="region container shorten yes",
        **{"fixes": ""} | settings,
    )
    drag = f"fix drag all viscous {MASS:.17g}\nfix contact all"
    return deck.replace("fix contact all", drag) + f"thermo 1000\nrun {SETTLING}\n"


SPEED = """
variable speed atom sqrt(vx^2+vy^2+vz^2)
compute fastest all reduce max v_speed
"""


@pytest.mark.parametrize("way", UNLOADING)
@pytest.mark.parametrize("factor", [10.0, 1e3, 1e6])
@pytest.mark.parametrize("kind", ["spheres", "dimers"])
def test_gravity_that_is_multiplied(kind: str, factor: float, way: str, tmp_path: Path) -> None:
    """The bed rests on for some steps, without the drag, before it is multiplied."""
    start = SETTLING + RESTED
    deck = settling(
        kind,
        tmp_path,
        gravity=False,
        fixes=f"variable s equal step-{start}\n{SPEED}"
        f"variable load equal 1+{factor - 1:.17g}*(v_s>=0)*{UNLOADING[way]}\n"
        f"variable g equal {GRAVITY}*v_load\n"
        "fix gravity all gravity v_g vector 0 -1 0\n",
        thermo="step f_contact[1] v_load c_fastest f_contact[13]",
    )
    loaded = f"unfix drag\ntimestep {STEP}\nthermo 1\nrun {RESTED + PRESSED + 300}\n"
    thermo = run_lmp(tmp_path, deck + loaded, timeout=900).thermo
    speed = thermo["c_fastest"] / (GRAVITY * STEP)
    print(
        f"{kind}: {speed[RESTED - 1]:.4f} g h before, {speed[RESTED:].max():.4f} g h from then on"
    )
    # It was at rest: what is asked of it later holds before.
    assert speed[RESTED - 1] <= 0.1
    assert_nothing_leaps(thermo["v_load"], speed, factor, RESTED + PRESSED)


@pytest.fixture(scope="module")
def spheres(tmp_path_factory: pytest.TempPathFactory) -> FloatArray:
    """Centres of the spheres at rest."""
    folder = tmp_path_factory.mktemp("settled")
    deck = settling("spheres", folder)
    run_lmp(folder, f"{deck}{DUMP_PARTICLES}run 0\n", timeout=600)
    return path(folder)[-1, :, :3]


@pytest.mark.parametrize("weights", [10.0, 100.0, 1e3])
def test_a_bed_that_one_grain_pressed(spheres: FloatArray, weights: float, tmp_path: Path) -> None:
    """It gives way when the load goes at once, but no energy comes from anywhere.

    Single spheres end higher: what falls back lifts them. The centre of mass does not.
    """
    timestep, pressed = 0.01, 6000
    top = int(spheres[:, 1].argmax()) + 1
    deck = spheres_of(
        spheres,
        tmp_path,
        tolerance=EPS,
        timestep=timestep,
        box=BOX,
        setup="",
        fixes=f"{SPEED}group top id {top}\n"
        f"variable press equal {-weights * WEIGHT:.17g}*(step<{pressed})"
        "*((step<1000)*step/1000+(step>=1000))\n"
        f"fix press top addforce 0 v_press 0\nfix drag all viscous {MASS:.17g}\n",
        options="region container shorten yes",
        thermo="step c_fastest f_contact[1]",
    )
    run = f"thermo 500\nrun {pressed - 1}\nunfix drag\n{DUMP_PARTICLES}run 600\n"
    run_lmp(tmp_path, deck + run, timeout=600)
    places = path(tmp_path)[:, :, :3]
    # At half steps, at which a sphere that falls freely keeps its energy exactly
    moving = (np.diff(places, axis=0) ** 2).sum(axis=(1, 2)) / 2 / timestep**2
    height = places[:, :, 1].sum(axis=1)
    energy = MASS * moving + WEIGHT * (height[1:] + height[:-1]) / 2
    risen = (energy - np.minimum.accumulate(energy)).max() / WEIGHT
    fastest = np.linalg.norm(np.diff(places, axis=0), axis=2).max(axis=1)
    fastest /= GRAVITY * timestep**2
    print(
        f"{weights:g} weights: energy rises by {risen:.2e} weights; "
        f"{fastest[0]:.3f} g h before, then {fastest.max():.3f} g h"
    )
    # An overlap that was allowed may be taken back.
    assert risen <= EPS
