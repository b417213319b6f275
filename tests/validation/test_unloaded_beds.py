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

from lammps_inelastic.analysis import ContactFrame, iterate_contact_frames
from tests.helpers.exact_scenes import (
    BED_TOLERANCE,
    FASTEST,
    MASS,
    PRESSED,
    RADIUS,
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
from tests.helpers.scenes import DUMP_CONTACTS, DUMP_PARTICLES, GRAVITY, FloatArray

pytestmark = pytest.mark.validation

# The step of the loads, of which a bed rests for some hundred before.
STEP, RESTED = 0.001, 300
FREE = f"unfix drag\ntimestep {STEP}\nthermo 1\n"
SPHERES = 500  # in a bed
ACCURACY = 1e-3  # of a bed that one grain pressed


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


def most_added(
    contacts: ContactFrame, velocity: FloatArray, changed: FloatArray, timestep: float
) -> float:
    """The most that the contacts of a step may add to the energy (docs/method/tolerances.md).

    It is the sum of the forces, each times the contact's target and what its overlap gives back.
    The first guess, of which targets know, is off by no more than contacts have changed velocities
    in this step and in the one before, and by the forces times the angle by which normals turned.

    Parameters
    ----------
    contacts : with m contacts
    velocity : before the step, (n, 3)
    changed : by which contacts have changed velocities in this step and the last, (n,)
    timestep : h
    """
    first, second = contacts.ids[:, 0] - 1, contacts.ids[:, 1] - 1
    of_wall = contacts.ids[:, 1] < 0
    second = np.where(of_wall, first, second)
    # By which its force alone opens the gap
    opened = contacts.forces * timestep**2 / MASS * np.where(of_wall, 1, 2)
    apart = velocity[first] - np.where(of_wall[:, None], 0, velocity[second])
    turned = np.where(of_wall, 0, timestep * np.linalg.norm(apart, axis=1) / (2 * RADIUS))
    aside = contacts.forces * timestep / MASS * turned
    new = changed.copy()
    np.add.at(new, first, aside)
    np.add.at(new, second, aside)
    added = timestep * (new[first] + np.where(of_wall, 0, new[second]))
    target = ACCURACY / 16 * (added + opened / 50_000)
    falls = np.where(of_wall, GRAVITY * timestep * contacts.normals[:, 1], 0)
    approach = timestep * (falls - (contacts.normals * apart).sum(axis=1))
    beyond = np.maximum(-contacts.gaps - BED_TOLERANCE / 2, 0)
    part = beyond / (0.3 * BED_TOLERANCE)
    softly = ACCURACY * np.maximum(approach, opened / 10) * part * np.maximum(part**2, 1)
    given_back = np.minimum(beyond, np.maximum(softly, -contacts.gaps - BED_TOLERANCE))
    return float((contacts.forces * (target + given_back)).sum())


@pytest.mark.parametrize("weights", [10.0, 100.0, 1e3])
def test_a_bed_that_one_grain_pressed(spheres: FloatArray, weights: float, tmp_path: Path) -> None:
    """It gives way when the load goes at once, but no energy comes from anywhere.

    Single spheres end higher: what falls back lifts them. The centre of mass does not. What is left
    of the load is held by arches, by up to twenty times its force.
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
        options=f"region container shorten yes accuracy {ACCURACY:g}",
        thermo="step c_fastest f_contact[1]",
    )
    run = f"thermo 500\nrun {pressed - 1}\nunfix drag\n{DUMP_PARTICLES}{DUMP_CONTACTS}run 600\n"
    run_lmp(tmp_path, deck + run, timeout=600)
    places = path(tmp_path)[:, :, :3]
    velocity = np.diff(places, axis=0) / timestep  # with which each step moves
    change = np.diff(velocity, axis=0)
    by_contacts = np.linalg.norm(change + np.array([0, GRAVITY * timestep, 0]), axis=2)
    # The work of the contacts in a step is what the energy rises by, with positions at ends of
    # steps, and m |V - V before|^2 / 2, which the scheme itself takes.
    energy = MASS * (velocity**2).sum(axis=(1, 2)) / 2 + WEIGHT * places[1:, :, 1].sum(axis=1)
    work = np.diff(energy) + MASS * (change**2).sum(axis=(1, 2)) / 2
    frames = iterate_contact_frames(tmp_path / "contacts.dump")
    # The forces of frame k change velocities k - 1 to velocities k.
    most = [
        most_added(frame, velocity[k - 1], by_contacts[k - 1] + by_contacts[k - 2], timestep)
        for k, frame in enumerate(frames)
        if 2 <= k < len(velocity)
    ]
    part = (work[1:] / most).max()
    risen = (energy - np.minimum.accumulate(energy)).max() / WEIGHT
    fallen = (energy[0] - energy[-1]) / WEIGHT
    fastest = np.linalg.norm(velocity, axis=2).max(axis=1) / (GRAVITY * timestep)
    print(
        f"{weights:g} weights: energy falls by {fallen:.3g} weights, and rises by {risen:.2e} at "
        f"most, contacts add {part:.2f} of what they may in a step; {fastest[0]:.3f} g h before, "
        f"then {fastest.max():.3f} g h"
    )
    # Round-off of the energy of 500 spheres
    assert (work[1:] <= np.array(most) + 1e-12 * energy[0]).all()
