"""When a load on a bed at rest goes, nothing leaps, and nothing gains energy.

Gravity that is multiplied scales all forces of a bed: they balance in the same places, and nothing
moves, then or when it is set back.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.exact_scenes import (
    BED_TOLERANCE,
    FASTEST,
    MASS,
    PRESSED,
    UNLOADING,
    WEIGHT,
    assert_nothing_leaps,
    bed_box,
    path,
    seed_at_rest,
    settling_bed,
    spheres_of,
)
from tests.helpers.lammps_run import run_lmp
from tests.helpers.scenes import DUMP_PARTICLES, GRAVITY, FloatArray

pytestmark = pytest.mark.validation

# The step of the loads, of which a bed rests for some hundred before.
STEP, RESTED = 0.001, 300
FREE = f"unfix drag\ntimestep {STEP}\nthermo 1\n"
SPHERES = 500  # in a bed


def loaded_and_unloaded(
    kind: str, folder: Path, factor: float, accuracy: float, way: str, seed: int = 1
) -> dict[str, FloatArray]:
    """A bed that rests on for some steps, without the drag, before its gravity is multiplied."""
    changes = f"1+{factor - 1:.17g}*(v_s>=0)*{UNLOADING[way]}"
    deck = settling_bed(kind, folder, changes, loaded_after=RESTED, accuracy=accuracy, seed=seed)
    loaded = f"{FREE}run {RESTED + PRESSED + 300}\n"
    return run_lmp(folder, deck + loaded, timeout=900).thermo


# Returns the seed of a bed of a kind, settled with an accuracy.
SeedOf = Callable[[str, float], int]


@pytest.fixture(scope="module")
def at_rest(tmp_path_factory: pytest.TempPathFactory) -> SeedOf:
    """Return the first seed of which all grains are at rest; each is looked for once."""

    @functools.cache
    def seed_of(kind: str, accuracy: float) -> int:
        folder = tmp_path_factory.mktemp("rested")
        return seed_at_rest(kind, folder, STEP, RESTED, accuracy=accuracy)

    return seed_of


@pytest.mark.parametrize("way", UNLOADING)
@pytest.mark.parametrize(
    ("kind", "factor", "accuracy"),
    [
        ("spheres", 10.0, 1e-3),
        ("spheres", 1e3, 1e-3),
        ("dimers", 10.0, 1e-3),
        ("dimers", 1e3, 1e-3),
        # Forces on held grains balance to 5 accuracies, of which a million times the gravity makes
        # a fall of twenty tolerances in a step with the default one.
        ("dimers", 1e6, 1e-5),
    ],
)
def test_gravity_that_is_multiplied(
    kind: str, factor: float, accuracy: float, way: str, tmp_path: Path, at_rest: SeedOf
) -> None:
    seed = at_rest(kind, accuracy)
    thermo = loaded_and_unloaded(kind, tmp_path, factor, accuracy, way, seed)
    speed = thermo["c_fastest"] / (GRAVITY * STEP)
    print(
        f"{kind}, seed {seed}: {speed[RESTED - 1]:.4f} g h before, "
        f"{speed[RESTED:].max():.4f} g h from then on"
    )
    # It was at rest, to round-off of what is told of it.
    assert speed[RESTED - 1] <= 1e-9
    assert_nothing_leaps(thermo["v_load"], speed, factor, RESTED + PRESSED)


@pytest.mark.parametrize("way", UNLOADING)
def test_gravity_that_is_a_million_times(way: str, tmp_path: Path) -> None:
    """What fell under the load flies on when it goes, but nothing gains energy.

    No bed of 500 spheres was found (of eight) that is at rest altogether with this accuracy: some
    slide on slopes of 1e-4, held by nothing. A million times the gravity lets them fall, and the
    bed with them. So there is motion when the load goes, to which unloading must add nothing: from
    then on kinetic energy grows by no more than the work of the weight.
    """
    accuracy, factor = 1e-5, 1e6
    thermo = loaded_and_unloaded("spheres", tmp_path, factor, accuracy, way)
    speed, load = thermo["c_fastest"] / (GRAVITY * STEP), thermo["v_load"]
    begins = RESTED + PRESSED
    gone = begins + int(np.argmax(load[begins:] < 1 + 1e-6))
    assert gone < len(load) - 100
    print(
        f"{way}: {speed[begins - 20 : begins].max():.3g} g h in twenty steps before, "
        f"{speed[begins:gone].max(initial=0):.3g} until it is gone, then {speed[gone:].max():.3g}"
    )
    energy = thermo["KinEng"][gone + 1 :]
    # In a step gravity does the work m g h v on a sphere, and m (g h)^2 / 2; the sum of the speeds
    # is at most the root of their number times the sum of their squares.
    work = WEIGHT * STEP * np.sqrt(2 * SPHERES * energy / MASS)
    work += SPHERES * MASS * (GRAVITY * STEP) ** 2 / 2
    # Round-off of energies
    assert (np.diff(energy) <= work[:-1] + 1e-9 * energy[:-1]).all()


@pytest.fixture(scope="module")
def spheres(tmp_path_factory: pytest.TempPathFactory) -> FloatArray:
    """Centres of the spheres at rest."""
    folder = tmp_path_factory.mktemp("settled")
    deck = settling_bed("spheres", folder)
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
        tolerance=BED_TOLERANCE,
        timestep=timestep,
        box=bed_box(),
        setup="",
        fixes=f"{FASTEST}group top id {top}\n"
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
    assert risen <= BED_TOLERANCE
