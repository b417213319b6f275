"""Bodies on several ranks, in periodic boxes, and in runs that are divided, restarted, reordered.

Contacts amplify round-off; at a tolerance of 5e-9 r, 100 steps must agree within 0.0005 r.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.bodies import (
    BENT,
    DUMP_BODY_SPHERES,
    INERTIAS,
    TETRAHEDRON,
    Bodies,
    body_scene,
    dimer,
    placed,
    random_bodies,
    rigid_velocities,
)
from tests.helpers.lammps_run import Runner, run_lmp
from tests.helpers.scenes import DIVISIONS, FloatArray, deepest_pair, read_dump

RADIUS = 0.055
EXACT = 5e-9 * RADIUS
SAME = 0.0005 * RADIUS
STEPS = 100
# Not a multiple of the diameter wide: a row of spheres that just fits is stiff beyond measure.
BOX = ((0.0, 0.77), (0.0, 1.1), (0.0, 0.77))
SPHERE = np.zeros((1, 3))
SHAPES = [dimer(1.5), BENT, SPHERE, dimer(1.1)] * 10
DUMP_LAST = DUMP_BODY_SPHERES.replace("custom 1 ", f"custom {STEPS} ")


def cloud(folder: Path, inertia: str, **options: Any) -> str:
    """Return the deck of bodies that tumble, fall and lie in a heap after 100 steps."""
    bodies = random_bodies(SHAPES, RADIUS, np.array(BOX) + np.array([RADIUS, -RADIUS]), seed=6)
    random = np.random.default_rng(7)
    number = int(bodies.molecules.max())
    velocities, spins = rigid_velocities(
        bodies,
        RADIUS,
        random.normal([0, -4, 0], 0.3, (number, 3)),
        random.normal(0, 4, (number, 3)),
    )
    settings: dict[str, Any] = {"tolerance": EXACT, "box": BOX, "thermo": "step f_contact[5]"}
    return body_scene(
        bodies,
        RADIUS,
        folder,
        inertia=inertia,
        velocities=velocities,
        spins=spins,
        **settings | options,
    )


def last_positions(folder: Path) -> FloatArray:
    """Positions at step 100."""
    frame = read_dump(folder / "particles.dump")[-1]
    assert frame.step == STEPS
    return frame.positions


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, FloatArray]:
    """Return the positions after 100 steps in one go, on one rank."""
    ends = {}
    for inertia in INERTIAS:
        folder = tmp_path_factory.mktemp(inertia)
        result = run_lmp(folder, cloud(folder, inertia) + DUMP_LAST + f"run {STEPS}\n")
        assert result.thermo["f_contact[5]"][-1] > 25
        ends[inertia] = last_positions(folder)
    return ends


def assert_same(positions: FloatArray, others: FloatArray) -> None:
    """Fail where a sphere is further than SAME from where it should be on an axis."""
    assert np.abs(positions - others).max() <= SAME


@pytest.mark.slow
@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize(
    "runs",
    [
        "run 50\nrun 50",
        "run 50\nrun 50 pre no",
        "run 50\nrun 0\nrun 50",
        "run 50\nunfix contact\nfix contact all inelastic {eps} region container "
        "rigid bodies {inertia}\nrun 50",
        "run 50\nwrite_restart a.restart\nwrite_data a.data\nrun 50",
        'run 100 every 20 "print again"',
    ],
)
def test_two_runs(
    runs: str, inertia: str, undisturbed: dict[str, FloatArray], tmp_path: Path, lmp: Runner
) -> None:
    lmp(cloud(tmp_path, inertia) + DUMP_LAST + runs.format(eps=EXACT, inertia=inertia) + "\n")
    assert_same(last_positions(tmp_path), undisturbed[inertia])


@pytest.mark.parametrize("inertia", INERTIAS)
def test_a_restart_file_before_run_pre_no(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """LAMMPS initialises all fixes to write it; the momenta of bodies are carried on."""
    whole = cloud(tmp_path / "whole", inertia) + DUMP_LAST + f"run {STEPS}\n"
    lmp(whole, into="whole")
    parts = "run 20\nwrite_restart a.restart\nrun 80 pre no\n"
    lmp(cloud(tmp_path, inertia) + DUMP_LAST + parts)
    assert (last_positions(tmp_path) == last_positions(tmp_path / "whole")).all()


def reordered(deck: str, order: str) -> str:
    """Return the deck with its fixes in another order, named by initials."""
    pull = next(line for line in deck.splitlines() if line.startswith("fix gravity"))
    contact = next(line for line in deck.splitlines() if line.startswith("fix contact"))
    bodies = next(line for line in deck.splitlines() if line.startswith("fix bodies"))
    if order == "bodies, gravity, contact":
        deck = deck.replace(pull + "\n", "")
        return deck.replace(contact, f"{pull}\n{contact}")
    assert order == "gravity, contact, bodies"
    deck = deck.replace(contact + "\n", "")
    return deck.replace(bodies, f"{contact}\n{bodies}")


@pytest.mark.parametrize(
    ("order", "inertia"),
    [
        ("bodies, gravity, contact", "point"),
        ("bodies, gravity, contact", "solid"),
        # The recipe for point masses needs a run between fix rigid/small and the contact fix.
        ("gravity, contact, bodies", "solid"),
    ],
)
@pytest.mark.parametrize("runs", ["run 100", "run 50\nrun 50"])
def test_the_order_of_fixes(
    order: str,
    runs: str,
    inertia: str,
    undisturbed: dict[str, FloatArray],
    tmp_path: Path,
    lmp: Runner,
) -> None:
    lmp(reordered(cloud(tmp_path, inertia), order) + DUMP_LAST + runs + "\n")
    assert_same(last_positions(tmp_path), undisturbed[inertia])


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "ranks"), [("restart", 1), ("data", 2)])
@pytest.mark.parametrize("inertia", INERTIAS)
def test_from_a_file(
    kind: str,
    ranks: int,
    inertia: str,
    undisturbed: dict[str, FloatArray],
    tmp_path: Path,
    lmp: Runner,
) -> None:
    deck = cloud(tmp_path, inertia)
    write = {"restart": "write_restart half.restart", "data": "write_data half.data nocoeff"}[kind]
    lmp(deck + f"run 50\n{write}\n", ranks=3 - ranks)
    second = deck.replace("read_data spheres.data", f"read_{kind} half.{kind}")
    if kind == "data":
        second += "reset_timestep 50\n"
    lmp(second + DUMP_LAST + "run 50\n", ranks=ranks)
    assert_same(last_positions(tmp_path), undisturbed[inertia])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "inertia"),
    [("runs", "point"), ("runs", "solid"), ("restart", "point"), ("data", "solid")],
)
def test_a_tumbling_body_goes_on_tumbling(
    kind: str, inertia: str, tmp_path: Path, lmp: Runner
) -> None:
    """Free flight of a body of three different moments, divided into parts of 25 steps."""
    body = placed(2 * RADIUS * BENT, [0.4, 0.6, 0.4], [0.3, 1.2, -0.4])
    velocities, spins = rigid_velocities(body, RADIUS, [0.01, 0.02, 0], [3, -6, 2])
    deck = body_scene(
        body,
        RADIUS,
        tmp_path,
        inertia=inertia,
        tolerance=EXACT,
        box=BOX,
        gravity=False,
        velocities=velocities,
        spins=spins,
    )
    lmp(deck + DUMP_LAST + f"run {STEPS}\n")
    expected = last_positions(tmp_path)
    if kind == "runs":
        lmp(deck + DUMP_LAST + "run 25\n" * 4)
    else:
        write = (
            "write_restart part.restart\n"
            if kind == "restart"
            else "write_data part.data nocoeff\n"
        )
        lmp(deck + "run 25\n" + write)
        for part in range(1, 4):
            going_on = deck.replace("read_data spheres.data", f"read_{kind} part.{kind}")
            going_on += f"reset_timestep {25 * part}\n" if kind == "data" else ""
            dump = DUMP_LAST if part == 3 else ""
            lmp(going_on + dump + "run 25\n" + write)
    # Round-off of files with 17 digits and of four set-ups, amplified by the free tumbling.
    assert last_positions(tmp_path) == pytest.approx(expected, abs=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("name", DIVISIONS)
def test_the_division_does_not_matter(
    name: str, undisturbed: dict[str, FloatArray], tmp_path: Path, lmp: Runner
) -> None:
    setup, balance, ranks = DIVISIONS[name]
    inertia = INERTIAS[len(name) % 2]
    # Fix rigid/small must be defined before a fix that balances.
    deck = cloud(tmp_path, inertia, setup=setup) + balance + "\n"
    lmp(deck + DUMP_LAST + f"run {STEPS}\n", ranks=ranks)
    assert_same(last_positions(tmp_path), undisturbed[inertia])


PERIOD = 0.9


def drifting(folder: Path, inertia: str, eps: float, setup: str) -> tuple[str, Bodies]:
    """Return the deck of bodies over a floor that drift through the periodic sides."""
    shapes = [dimer(1.5), TETRAHEDRON, SPHERE] * 12
    limits = ((0.06, PERIOD - 0.06), (RADIUS, 1.1), (0.06, PERIOD - 0.06))
    bodies = random_bodies(shapes, RADIUS, limits, seed=2)
    # Across the sides from the start.
    bodies = bodies.moved([0.45, 0, 0.1])
    velocities, spins = rigid_velocities(bodies, RADIUS, [2, -1, -1.5], [1, 2, 3])
    deck = body_scene(
        bodies,
        RADIUS,
        folder,
        inertia=inertia,
        tolerance=eps,
        box=((0, PERIOD), (0, 3), (0, PERIOD)),
        boundary="p f p",
        setup=f"{setup}\nregion floor plane 0 0 0 0 1 0",
        options="region floor shorten yes",
        skin=0.08,
        velocities=velocities,
        spins=spins,
    )
    return deck, bodies


@pytest.mark.slow
@pytest.mark.parametrize("inertia", INERTIAS)
@pytest.mark.parametrize("newton", ["on", "off"])
def test_periodic_sides(inertia: str, newton: str, tmp_path: Path, lmp: Runner) -> None:
    frames = []
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        deck, bodies = drifting(folder, inertia, EXACT, f"newton {newton}")
        result = lmp(deck + DUMP_BODY_SPHERES + f"run {STEPS}\n", ranks=ranks, into=str(ranks))
        assert result.thermo["f_contact[5]"].max() > 10
        frames.append(read_dump(folder / "particles.dump"))
    periods = [PERIOD, 0, PERIOD]
    for one, two in zip(*frames, strict=True):
        off = one.positions - two.positions
        off[:, [0, 2]] -= PERIOD * np.rint(off[:, [0, 2]] / PERIOD)
        assert np.abs(off).max() <= SAME
        depth = deepest_pair(one.positions, one["radius"], periods, molecules=one["mol"])
        # Round-off of positions of order 1.
        assert depth <= 2 * EXACT + 1e-15
        assert np.min(one.positions[:, 1] - RADIUS) >= -2 * EXACT - 1e-15
    # Nothing pushes along x and z but the bodies themselves: the momentum stays.
    for axis in (0, 2):
        momentum = [frame.velocities[:, axis].sum() for frame in frames[0]]
        assert momentum == pytest.approx(np.full(STEPS + 1, momentum[0]), abs=1e-11)  # round-off
    # They did cross the sides.
    crossed = np.abs(np.diff([frame["x"] for frame in frames[0]], axis=0)) > PERIOD / 2
    assert crossed.any(axis=0).sum() > len(bodies.positions) / 2


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("inertia", INERTIAS)
def test_bodies_meet_across_the_periodic_boundary(
    inertia: str, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """The same collision in the middle of the box and across its corner."""
    one = placed(2 * RADIUS * dimer(1.5), [0.3, 0.5, 0.5], [0.3, 0.2, 0.9])
    both = one.joined(placed(2 * RADIUS * BENT, [0.65, 0.5, 0.5], [1, 0.2, 0.4]))
    velocities, spins = rigid_velocities(
        both, RADIUS, np.array([[1, 0.1, 0], [-1, 0, 0]]), [[3, 1, 2], [0, -3, 1]]
    )
    ends = []
    for name, shift in {"middle": (0, 0, 0), "corner": (0.55, 0.5, 0.45)}.items():
        deck = body_scene(
            both.moved(shift),
            RADIUS,
            tmp_path / name,
            inertia=inertia,
            tolerance=EXACT,
            box=((0, 1), (0, 1), (0, 1)),
            boundary="p p p",
            gravity=False,
            options="",
            skin=0.08,
            velocities=velocities,
            spins=spins,
        )
        result = lmp(deck + DUMP_LAST + f"run {STEPS}\n", ranks=ranks, into=name)
        assert result.thermo["f_contact[5]"].max() > 0
        ends.append(last_positions(tmp_path / name) - shift)
    off = ends[0] - ends[1]
    assert np.abs(off - np.rint(off)).max() <= SAME
