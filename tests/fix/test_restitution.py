"""Newton's law of restitution: surfaces that collide with the speed a part with E a."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.bodies import (
    BENT,
    DUMP_BODY_SPHERES,
    body_scene,
    dimer,
    placed,
    random_bodies,
    rigid_velocities,
)
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    GRAVITY,
    deepest_pair,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.5
EPS = 1e-6
COEFFICIENTS = (0.0, 0.01, 0.3, 0.9, 1.0)
WIDE = ((-20.0, 20.0),) * 3
# The velocities of a collision are solved to a thousandth of what contacts change.
ACCURACY = 2e-3


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("part", [0.05, 0.5, 0.95])
@pytest.mark.parametrize("coefficient", COEFFICIENTS)
def test_two_spheres(
    coefficient: float, part: float, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """Spheres of different masses, wherever in a step they meet."""
    radii, step = np.array([0.5, 0.3]), 0.01
    before = np.array([1.0, -0.5])
    gap = (3 + part) * step * (before[0] - before[1])
    deck = scene(
        [[0.0, 0.0, 0.0], [radii.sum() + gap, 0.0, 0.0]],
        radii,
        tmp_path,
        tolerance=EPS,
        velocities=[[before[0], 0.0, 0.0], [before[1], 0.0, 0.0]],
        box=WIDE,
        timestep=step,
        gravity=False,
        options=f"law restitution {coefficient}",
    )
    lmp(deck + DUMP_PARTICLES + "run 10\n", ranks=ranks)
    after = read_dump(tmp_path / "particles.dump")[-1].velocities[:, 0]
    masses = mass(radii)
    centre = masses @ before / masses.sum()
    expected = (1 + coefficient) * centre - coefficient * before
    assert after == pytest.approx(expected, abs=ACCURACY * 1.5)
    assert masses @ after == pytest.approx(masses @ before, abs=1e-14)


@pytest.mark.parametrize("coefficient", [0.3, 0.9])
def test_a_ball_that_comes_to_rest(coefficient: float, tmp_path: Path, lmp: Runner) -> None:
    """It bounces for (1 + E) / (1 - E) of the time of its fall, and then lies on the floor."""
    step, height = 0.0005, 1.0
    deck = scene(
        [[0.0, RADIUS + height, 0.0]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        box=((-5.0, 5.0), (0.0, 5.0), (-5.0, 5.0)),
        timestep=step,
        options=f"region container law restitution {coefficient}",
        thermo="step ke f_contact[6]",
    )
    fall = np.sqrt(2 * height / GRAVITY)
    expected = fall * (1 + coefficient) / (1 - coefficient)
    lmp(deck + DUMP_PARTICLES + f"run {round(1.3 * expected / step)}\n")
    frames = read_dump(tmp_path / "particles.dump")
    speed = np.array([frame.velocities[0, 1] for frame in frames])
    high = np.array([frame.positions[0, 1] for frame in frames]) - RADIUS
    first = int(1.2 * fall / step)
    # The highest point after the first bounce, which one step blurs by its own length.
    peak = high[first : first + int(2.5 * coefficient * fall / step)].max()
    assert peak == pytest.approx(coefficient**2 * height, rel=6 * step / fall)
    at_rest = step * int(np.flatnonzero(np.abs(speed) > GRAVITY * step)[-1])
    # Each bounce ends at a step, and the last ones, below g h, do not take place.
    bounces = np.log(GRAVITY * step / (GRAVITY * fall)) / np.log(coefficient)
    assert abs(at_rest - expected) <= (2 * bounces + 2 / (1 - coefficient)) * step
    assert speed[-1] == pytest.approx(0.0, abs=1e-3 * GRAVITY * step)


@pytest.mark.parametrize("coefficient", COEFFICIENTS)
def test_a_wall_that_moves(coefficient: float, tmp_path: Path, lmp: Runner) -> None:
    """A wall with the velocity V sends a sphere back with V + E (V - v)."""
    step, speed, v = 0.01, 0.4, -0.7
    deck = scene(
        [[0.0, RADIUS + 0.1, 0.0]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        velocities=[[0.0, v, 0.0]],
        box=((-5.0, 5.0), (-1.0, 5.0), (-5.0, 5.0)),
        timestep=step,
        gravity=False,
        fixes=f"variable up equal {speed}*step*dt\n"
        "region floor plane 0 0 0 0 1 0 move NULL v_up NULL",
        options=f"region floor law restitution {coefficient}",
    )
    lmp(deck + DUMP_PARTICLES + "run 30\n")
    after = read_dump(tmp_path / "particles.dump")[-1].velocities[0, 1]
    assert after == pytest.approx(speed + coefficient * (speed - v), abs=ACCURACY * 1.1)


@pytest.mark.parametrize("inertia", ["point", "solid"])
@pytest.mark.parametrize("coefficient", COEFFICIENTS)
def test_a_dimer_that_falls_on_its_end(
    coefficient: float, inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    """The end that hits leaves with E times its speed, and the impulse turns the dimer."""
    step, tilt = 0.001, 0.6
    body = placed(dimer(1.6), (0.0, 1.0, 0.0), (0.0, 0.0, tilt))
    body = body.moved((0.0, RADIUS + 0.0123 - body.positions[:, 1].min(), 0.0))
    velocities, spins = rigid_velocities(body, RADIUS, [[0.0, -1.0, 0.0]], [[0.0, 0.0, 0.0]])
    deck = body_scene(
        body,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EPS,
        velocities=velocities,
        spins=spins,
        box=((-5.0, 5.0), (0.0, 5.0), (-5.0, 5.0)),
        timestep=step,
        gravity=False,
        options=f"region container law restitution {coefficient}",
    )
    lmp(deck + DUMP_BODY_SPHERES + "run 16\n")
    frame = read_dump(tmp_path / "particles.dump")[-1]
    m, r = 2 * float(mass(RADIUS)), 0.3 * np.cos(tilt)  # arm of the contact; half the distance
    moment = m * 0.3**2 + (m * 0.4 * RADIUS**2 if inertia == "solid" else 0.0)
    # 1 / m + r^2 / I is the mobility of the lower end.
    impulse = (1 + coefficient) / (1 / m + r**2 / moment)
    assert frame.velocities[:, 1].mean() == pytest.approx(-1 + impulse / m, abs=ACCURACY)
    low = int(np.argmin(frame.positions[:, 1]))
    turned = abs(np.diff(frame.velocities[:, 0])[0] / np.diff(frame.positions[:, 1])[0])
    assert turned == pytest.approx(impulse * r / moment, rel=0.02)  # in the steps after the impact
    assert frame.velocities[low, 1] >= coefficient - 0.02 - 16 * step * turned


@pytest.mark.parametrize("split", [31, 32, 33])
def test_a_run_that_ends_with_the_collision(split: int, tmp_path: Path, lmp: Runner) -> None:
    """Two runs of one input, and a restart, go on as one run, also in the step of the collision."""
    step = 0.01
    deck = scene(
        [[0.0, RADIUS + 0.325, 0.0]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        velocities=[[0.0, -1.0, 0.0]],
        box=((-5.0, 5.0), (0.0, 5.0), (-5.0, 5.0)),
        timestep=step,
        gravity=False,
        options="region container law restitution 0.8",
    )
    deck += DUMP_PARTICLES
    lmp(deck + f"run {split}\nwrite_restart half.restart\nrun {50 - split}\n")
    two = read_dump(tmp_path / "particles.dump")[-1].velocities[0, 1]
    lmp(deck.replace("read_data spheres.data", "read_restart half.restart") + f"run {50 - split}\n")
    restarted = read_dump(tmp_path / "particles.dump")[-1].velocities[0, 1]
    assert (two, restarted) == pytest.approx((0.8, 0.8), abs=ACCURACY)


@pytest.mark.parametrize("gravity", [False, True])
@pytest.mark.parametrize("coefficient", [0.5, 1.0])
def test_energy_never_rises(coefficient: float, gravity: bool, tmp_path: Path, lmp: Runner) -> None:
    """The projection of no step adds kinetic energy: 200 spheres in a box, dense and fast."""
    step, radius = 0.002, 0.06
    eps = 1e-4 * radius
    random = np.random.default_rng(3)
    points = random_points(200, ((0.1, 0.9),) * 3, 2.02 * radius, seed=3)
    deck = scene(
        points,
        radius,
        tmp_path,
        tolerance=eps,
        velocities=random.normal(size=(200, 3)),
        box=((0.0, 1.0),) * 3,
        timestep=step,
        skin=0.1,
        gravity=gravity,
        options=f"region container law restitution {coefficient} accuracy 1e-7 "
        "record problem.*.npz every 1",
    )
    lmp(deck + DUMP_PARTICLES + "run 200\n")
    worst, largest = -np.inf, 0.0
    for number in range(1, 201):
        with np.load(tmp_path / f"problem.{number}.npz") as problem:
            m = problem["mass"]
            before = 0.5 * m @ np.sum(problem["predicted_velocity"] ** 2, axis=1)
            after = 0.5 * m @ np.sum(problem["velocity"] ** 2, axis=1)
        worst, largest = max(worst, after - before), max(largest, before)
    # Velocities are known to a ten millionth of what contacts change in a step.
    assert worst <= 1e-6 * largest
    frames = read_dump(tmp_path / "particles.dump")
    assert max(deepest_pair(frame.positions, frame["radius"]) for frame in frames) <= eps * 1.001


def spinning_bodies(folder: Path, options: str) -> str:
    """20 bodies of three point masses, one of them a hundredth of the others, in a box."""
    number, radius, side = 20, 0.15, 3.0
    inside = ((radius, side - radius),) * 3
    bodies = random_bodies([BENT] * number, radius, inside, seed=3)
    random = np.random.default_rng(3)
    velocities, spins = rigid_velocities(
        bodies, radius, random.normal(size=(number, 3)), 5 * random.normal(size=(number, 3))
    )
    deck = body_scene(
        bodies,
        radius,
        folder,
        inertia="point",
        velocities=velocities,
        spins=spins,
        box=((0.0, side),) * 3,
        timestep=0.02,
        tolerance=1e-5,
        gravity=False,
        options=f"region container law restitution 1 {options}",
        thermo="step",
    )
    light = "".join(f"set atom {k} density 0.01\n" for k in range(1, 3 * number, 3))
    # Their masses count when the bodies are set up.
    deck = deck.replace("set group bodies diameter 0", f"{light}set group bodies diameter 0")
    return deck + (
        "compute slide all ke/rigid bodies\ncompute spin all erotate/rigid bodies\n"
        "variable energy equal c_slide+c_spin\nthermo_style custom step v_energy\n"
    )


def test_bodies_that_spin_keep_their_energy(tmp_path: Path, lmp: Runner) -> None:
    """With `shorten yes` elastic collisions add nothing, however far bodies would turn in a step.

    LAMMPS keeps the angular momentum of a body, but turns it towards a rotation of more energy; and
    where surfaces part at the end of a long arc they need a speed that they had not before.
    """
    result = lmp(spinning_bodies(tmp_path, "shorten yes") + "run 200\n", timeout=120)
    energy = result.thermo["v_energy"]
    # A hundredth in a thousand steps is what turning may add.
    assert energy.max() <= 1.01 * energy[0]
    # At the end, when some collision may be half over.
    assert energy[-1] >= 0.5 * energy[0]
    assert "added energy" not in result.screen


def test_energy_that_collisions_add_is_told(tmp_path: Path, lmp: Runner) -> None:
    """Without `shorten` the same bodies gain energy, and the summary says in how many steps."""
    deck = spinning_bodies(tmp_path, "").replace(
        "variable energy", "timestep 0.002\nvariable energy"
    )
    result = lmp(deck + "run 100\n", must_pass=False)
    assert re.search(
        r"in \d+ steps collisions, or bodies that turned far, added energy", result.screen
    )


def test_none_at_all_is_the_inelastic_law(tmp_path: Path, lmp: Runner) -> None:
    """E = 0 writes the same bytes."""
    points = random_points(60, ((0.1, 0.9),) * 3, 0.13, seed=5)
    deck = scene(points, 0.06, tmp_path, tolerance=1e-5, box=((0.0, 1.0), (0.0, 2.0), (0.0, 1.0)))
    texts = []
    for law in ("", " law inelastic", " law restitution 0"):
        text = deck.replace("region container\nthermo", f"region container{law}\nthermo")
        lmp(text + DUMP_PARTICLES + "run 150\n")
        texts.append((tmp_path / "particles.dump").read_text())
    assert texts[0] == texts[1] == texts[2]


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("restitution 1.1", "needs law restitution E, with E from 0 to 1, not law restitution 1.1"),
        ("restitution -0.1", "needs law restitution E, with E from 0 to 1"),
        ("restitution nan", "needs law restitution E, with E from 0 to 1"),
        ("restitution", "needs law restitution E, with E from 0 to 1"),
        ("restitution 0.5 0.5", "needs law restitution E, with E from 0 to 1"),
        ("gluey limit 0", "needs law gluey [limit G], with an impulse G greater than 0"),
        ("gluey limit", "needs law gluey [limit G]"),
        ("inelastic 1", "needs law inelastic, without any other word"),
        ("elastic", "law must be inelastic, gluey or restitution, not elastic"),
        ("gluey law restitution 0.5", "two laws, gluey and restitution: all contacts have one"),
        ("", "Illegal fix inelastic law command: missing argument(s)"),
    ],
)
def test_bad_words(law: str, message: str, tmp_path: Path, refused: Callable[..., str]) -> None:
    deck = scene([[0.5, 1.0, 0.5]], 0.1, tmp_path, tolerance=1e-5, options=f"law {law}")
    assert message in refused(deck + "run 1\n")


# Two spheres in a box of length 3.2: what they and the far wall give back would throw the first one
# at the near wall and through it within one step.
CROWDED = [[0.6, 0.0, 0.0], [1.9, 0.0, 0.0]]


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_step_in_which_not_all_can_part(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    """It is an error that names the law and the cure; shorten yes goes on and adds no energy.

    (Some is lost where a contact closes in the step in which another one collides.)
    """

    def deck(options: str) -> str:
        return scene(
            CROWDED,
            0.5,
            tmp_path,
            tolerance=EPS,
            velocities=[[10.0, 0.0, 0.0], [5.0, 0.0, 0.0]],
            box=((0.0, 3.2), *WIDE[1:]),
            timestep=0.2,
            gravity=False,
            options=f"region container law restitution 1 {options}",
        )

    (refused,) = lmp(deck("") + "run 1\n", ranks=ranks, must_pass=False).errors
    assert "contact law asks more surfaces to part" in refused
    assert "shorten yes" in refused
    lmp(deck("shorten yes") + DUMP_PARTICLES + "run 20\n", ranks=ranks)
    for frame in read_dump(tmp_path / "particles.dump")[1:]:
        x = frame.positions[:, 0]
        # The positions of a dump have some 1e-16 of round-off.
        assert min(x[0] - 0.5, x[1] - x[0] - 1, 2.7 - x[1]) >= -EPS * (1 + 1e-6)
        # Velocities of a dump are the mean of those before and after its step's impulses.
        assert (frame.velocities**2).sum() <= 125 * (1 + 1e-12)  # round-off
