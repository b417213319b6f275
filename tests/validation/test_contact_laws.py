"""Contact laws at 1,000 spheres: against kinetic theory, own bookkeeping and another solver."""

from __future__ import annotations

from pathlib import Path

import clarabel
import networkx
import numpy as np
import pytest
from scipy import sparse

from tests.helpers.lammps_run import Run, run_lmp
from tests.helpers.scenes import (
    DUMP_CONTACTS,
    GRAVITY,
    FloatArray,
    mass,
    random_points,
    read_dump,
    scene,
)

pytestmark = pytest.mark.validation

COUNT = 1000

# ------------------------------------------------------------------------------------
# a gas that restitutes
# ------------------------------------------------------------------------------------

DIAMETER = 1.0
VOLUME_FRACTION = 0.05
EDGE = (COUNT * np.pi / 6 / VOLUME_FRACTION) ** (1 / 3)


def gas(
    folder: Path, coefficient: float, step: float, time: float, seed: int, record: bool = False
) -> Run:
    """Run a dilute gas of temperature 1 (that is <v^2> / 3, for mass 1) between periodic walls."""
    points = random_points(COUNT, ((0.0, EDGE - 1.001 * DIAMETER),) * 3, DIAMETER, seed=seed)
    velocities = np.random.default_rng(seed).normal(size=points.shape)
    velocities -= velocities.mean(axis=0)
    velocities *= np.sqrt(3 / (velocities**2).sum(axis=1).mean())
    deck = scene(
        points,
        DIAMETER / 2,
        folder,
        tolerance=1e-4 * DIAMETER,
        velocities=velocities,
        box=((0.0, EDGE),) * 3,
        boundary="p p p",
        timestep=step,
        gravity=False,
        options=f"law restitution {coefficient}"
        + (
            f" accuracy 1e-6 record problem.*.npz every {round(time / step / 100)}"
            if record
            else ""
        ),
        thermo="step ke",
    )
    steps = round(time / step)
    return run_lmp(folder, deck + f"thermo {steps // 100}\nrun {steps}\n", timeout=900)


def cooling_rate(coefficient: float) -> float:
    """Return 1 / t_0 of Haff's law T = T_0 / (1 + t / t_0)^2, for T_0 = 1, m = 1.

    Kinetic theory with the radial distribution at contact of Carnahan and Starling, and the first
    Sonine correction (van Noije and Ernst, Granular Matter 1 (1998) 57).
    """
    density = COUNT / EDGE**3
    at_contact = (1 - VOLUME_FRACTION / 2) / (1 - VOLUME_FRACTION) ** 3
    frequency = 4 * np.sqrt(np.pi) * density * DIAMETER**2 * at_contact
    e = coefficient
    sonine = 16 * (1 - e) * (1 - 2 * e**2) / (81 - 17 * e + 30 * e**2 * (1 - e))
    return float(frequency * (1 - e**2) / 6 * (1 + 3 / 16 * sonine))


@pytest.mark.parametrize("coefficient", [0.9, 0.7])
def test_haffs_law(coefficient: float, tmp_path: Path) -> None:
    rate = cooling_rate(coefficient)
    time = 2.0 / rate
    rates = []
    for seed in (1, 2, 3):
        thermo = gas(tmp_path, coefficient, 0.005, time, seed).thermo
        slowing = np.sqrt(thermo["KinEng"][0] / thermo["KinEng"]) - 1
        t = 0.005 * thermo["Step"]
        rates.append(float((t @ slowing) / (t @ t)))
    found = float(np.mean(rates))
    each = " ".join(f"{one / rate:.3f}" for one in rates)
    print(f"E {coefficient}: rate over that of kinetic theory {found / rate:.3f} ({each})")
    assert found == pytest.approx(rate, rel=0.05)


def test_an_elastic_gas_keeps_its_energy(tmp_path: Path) -> None:
    """To what collisions in the same step lose, the less the shorter the step; it never rises."""
    lost = {}
    for step in (0.01, 0.0025):
        folder = tmp_path / str(step)
        gas(folder, 1.0, step, 20.0, seed=1, record=True)
        # Of the velocities with which spheres move. (Thermo's are in the middle of collisions.)
        energies = []
        for path in sorted(folder.glob("*.npz"), key=lambda path: int(path.name.split(".")[1])):
            with np.load(path) as problem:
                energies.append(float((problem["velocity"] ** 2).sum()))
        lost[step] = 1 - energies[-1] / energies[0]
        # Velocities of the hundred collisions of a sample are solved to a millionth.
        assert np.diff(energies).max() <= 1e-6 * energies[0]
    print("E 1: part of the energy lost after 20 d / v, by time step:", lost)
    assert 0 <= lost[0.0025] <= 0.5 * lost[0.01] <= 0.01


# ------------------------------------------------------------------------------------
# a bed that is glued
# ------------------------------------------------------------------------------------

RADIUS = 0.5
MASS = float(mass(RADIUS))
STEP = 0.01
EPS = 1e-3 * RADIUS
BOX = ((0.0, 9.0), (0.0, 60.0), (0.0, 9.0))
FORCES = "variable pull equal 0\nfix pull all addforce 0 v_pull 0"
HELD = "f_contact[15]"
STRIDE = 25  # frames from one look to the next


def weight(factor: float) -> str:
    """Return the command that sets the weight of each sphere, > 0 upwards."""
    return f"variable pull equal {factor * MASS * GRAVITY:.17g}\n"


def bed(folder: Path, points: FloatArray, **settings: object) -> str:
    defaults: dict[str, object] = {
        "tolerance": EPS,
        "box": BOX,
        "timestep": STEP,
        "gravity": False,
        "fixes": FORCES,
        "skin": 0.6,
        "options": "region container shorten yes law gluey record problem.*.npz every 1",
        "thermo": f"step f_contact[14] {HELD} ke",
    }
    return scene(points, RADIUS, folder, **(defaults | settings))  # type: ignore[arg-type]


def random_bed() -> FloatArray:
    return random_points(COUNT, ((0.5, 8.5), (0.5, 40.0), (0.5, 8.5)), 1.0, seed=2)


def crystal() -> FloatArray:
    """Return layers of a cubic lattice, in which more contacts touch than forces need."""
    places = np.mgrid[0:9, 0:6, 0:9].reshape(3, -1).T
    return np.asarray(places + 0.5, dtype=float)


def test_turned_over(tmp_path: Path) -> None:
    """Each contact holds while what it has stored, summed here from its forces, is not used up."""
    turned = 600
    dump = DUMP_CONTACTS.replace("f_contact[10]", "f_contact[10] f_contact[11]")
    deck = bed(tmp_path, random_bed(), options="region container law gluey", skin=2.0)
    deck += dump + "dump_modify contacts colname 11 stored\n"
    deck += "dump particles all custom 1 particles.dump id x y z vx vy vz\n"
    deck += "dump_modify particles sort id format float %.17g\n"
    force = f"{MASS * GRAVITY:.17g}*(4*(step>={turned})-1)"
    deck = deck.replace("pull equal 0", f"pull equal {force}")
    result = run_lmp(tmp_path, deck + f"run {turned + 300}\n", timeout=900)
    frames = read_dump(tmp_path / "contacts.dump")
    stored: dict[tuple[float, float], float] = {}
    shares = []
    hanging_by = []
    for k, frame in enumerate(frames):
        # A run starts with half of a step.
        duration = STEP if k else STEP / 2
        now = {}
        for a, b, force in frame.vectors("id1 id2 force"):
            pair = (min(a, b), max(a, b))
            now[pair] = min(0.0, stored.get(pair, 0.0) - duration * force)
        told = {
            (min(a, b), max(a, b)): store
            for a, b, store in frame.vectors("id1 id2 stored")
            if store < 0
        }
        # Round-off of a sum of up to a thousand impulses; a contact that opens ends with nothing.
        for pair in now.keys() | told.keys():
            assert told.get(pair, 0.0) == pytest.approx(now.get(pair, 0.0), rel=1e-9, abs=1e-9)
        stored = {pair: now[pair] for pair in told}
        shares.append(len(told))
        hanging_by.append(set(told))
        if k == turned:
            on_floor = -sum(store for pair, store in told.items() if pair[0] == -3.0)
    assert (result.thermo[HELD] == np.array(shares)).all()
    assert shares[turned] > 2 * COUNT
    # What hangs, by these stores: spheres that contacts which hold join to the floor.
    hanging = [share_on_floor(held) for held in hanging_by[turned::STRIDE]]
    # What hangs, by the positions: spheres that have not risen by a radius since.
    particles = read_dump(tmp_path / "particles.dump")[turned::STRIDE]
    heights = [frame["y"] for frame in particles]
    low = [float((height < heights[0] + RADIUS).mean()) for height in heights]
    print("time since the turn, share that hangs by stores and by positions")
    for k, shown in enumerate(zip(hanging, low, strict=True)):
        print(f"{k * STRIDE * STEP:.1f} {shown[0]:.3f} {shown[1]:.3f}")
    assert hanging[0] > 0.98
    # The floor pulls until its stores are used up: what gravity gives less what the bed has got.
    first_free = next(k for k, share in enumerate(hanging) if share < 0.5)
    gravity = 3 * COUNT * MASS * GRAVITY * STRIDE * STEP * first_free
    momentum = MASS * float(particles[first_free]["vy"].sum())
    print(f"the floor had stored {on_floor:.0f}, and has given back {gravity - momentum:.0f}")
    # Afterwards some that have let go come back and are held once more.
    assert gravity - momentum == pytest.approx(on_floor, rel=0.03)
    # What nothing holds rises by a radius in a quarter of a time unit, and others as they stretch.
    behind = [hanging[max(0, k - 1)] for k in range(len(hanging))]
    assert all(seen <= before + 0.01 for seen, before in zip(low, behind, strict=True))
    assert low[-1] == 0.0


def share_on_floor(held: set[tuple[float, float]]) -> float:
    """Return the part of the spheres that chains of contacts join to the floor, which is wall 3."""
    graph = networkx.Graph(held)
    # Walls are no bridges: only the floor is looked at.
    graph.remove_nodes_from([node for node in list(graph) if node < 0 and node != -3.0])
    if -3.0 not in graph:
        return 0.0
    return (len(networkx.node_connected_component(graph, -3.0)) - 1) / COUNT


@pytest.mark.parametrize("kind", ["random", "crystal"])
def test_projection_against_clarabel(kind: str, tmp_path: Path) -> None:
    """Falling, pressed and pulled: momentum and energy of each step, and the exact solution."""
    points = random_bed() if kind == "random" else crystal()
    deck = bed(tmp_path, points)
    steps = 200 if kind == "random" else 10
    # A step is solved to no less than half of what the last one was.
    tight = "fix_modify contact accuracy 1e-10\nrun 30\n"
    deck += weight(-1) + "run 35\n" + tight + f"fix_modify contact accuracy 1e-3\nrun {steps}\n"
    deck += tight + weight(3) + "run 5\n"
    deck = deck.replace(" every 1", " every 5")
    run_lmp(tmp_path, deck, timeout=900)
    phases = {"falling": 65, "pressed": steps + 95, "pulled": steps + 100}
    if kind == "crystal":
        del phases["falling"]
    paths = list(tmp_path.glob("*.npz"))
    assert len(paths) == (steps + 100) // 5
    for path in paths:
        check_motion(read(path))
    for name, number in phases.items():
        problem = read(tmp_path / f"problem.{number}.npz")
        before, after = problem["predicted_velocity"], problem["velocity"]
        m = problem["mass"]
        exact, impulse = solution(problem)
        fastest = np.abs(before).max()
        error = np.abs(after - exact).max() / fastest
        pulling = int((problem["impulse"] < 0).sum())
        print(f"{kind}, {name}: {len(m)} spheres, {len(impulse)} constraints, ", end="")
        print(f"{pulling} pull, velocities differ by {error:.1e} of the fastest")
        assert error <= 1e-6
        if name == "pulled":
            assert pulling > len(m) / 2


def read(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as file:
        return {key: file[key] for key in file.files}


def check_motion(problem: dict[str, np.ndarray]) -> None:
    """See that the projection of a step keeps momentum, and adds no kinetic energy."""
    before, after, m = problem["predicted_velocity"], problem["velocity"], problem["mass"]
    # Impulses, which act on both sides of a contact, make all of the change, to round-off.
    gained = m[:, None] * (after - before)
    made = (jacobian(problem).T @ problem["impulse"]).reshape(-1, 3)
    assert np.abs(gained - made).max() <= 1e-12 * np.abs(m[:, None] * before).max()
    # What an overlap or a gap within the tolerance gives back is no more than velocities are
    # resolved to, a thousandth of what contacts change.
    energies = [0.5 * m @ (v**2).sum(axis=1) for v in (before, after)]
    changed = 0.5 * m @ ((after - before) ** 2).sum(axis=1)
    assert energies[1] <= energies[0] + 1e-3 * changed


def solution(problem: dict[str, np.ndarray]) -> tuple[FloatArray, FloatArray]:
    """Return velocities and impulses by Clarabel.

    With y = M^1/2 (V - V*) it minimises y . y / 2 - l . G V under gap + h G V >= 0; its dual
    variables are the impulses without l, the least ones. An interior point is as far off as the
    root of its tolerance. What is left is therefore solved for again, magnified (Gleixner, Steffy
    and Wolter, INFORMS J. Comput. 28 (2016) 449): it is a problem of the same form, whose gaps are
    those of the first solution, from whose impulses the least ones are counted.
    """
    g = jacobian(problem)
    root = sparse.diags_array(np.repeat(np.sqrt(problem["inverse_mass"]), 3))
    h = float(problem["timestep"])
    predicted = problem["predicted_velocity"]
    matrix = sparse.csr_array(g @ root)
    least = problem["least_impulse"]
    scale = np.abs(predicted).max() / np.sqrt(problem["inverse_mass"].max())
    gaps = (problem["gap"] / h + g @ predicted.ravel()) / scale
    pulls = least / scale
    impulse = by_clarabel(matrix, gaps, pulls)
    for magnified in (1e3, 1e5):
        impulse = np.maximum(impulse, pulls)
        left = gaps + matrix @ (matrix.T @ impulse)
        impulse += by_clarabel(matrix, magnified * left, magnified * (pulls - impulse)) / magnified
    y = matrix.T @ impulse
    return predicted + scale * (root @ y).reshape(-1, 3), scale * impulse


def by_clarabel(matrix: sparse.csr_array, gaps: FloatArray, pulls: FloatArray) -> FloatArray:
    """Return the impulses that minimise y . y / 2 - pulls . B y under gaps + B y >= 0."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    result = clarabel.DefaultSolver(
        sparse.identity(matrix.shape[1], format="csc"),
        -(matrix.T @ pulls),
        sparse.csc_matrix(-matrix),
        gaps,
        [clarabel.NonnegativeConeT(len(gaps))],
        settings,
    ).solve()
    # It may come to the end of what numbers resolve before it meets its tolerance.
    assert str(result.status) in ("Solved", "AlmostSolved", "InsufficientProgress")
    return np.array(result.z) + pulls


def jacobian(problem: dict[str, np.ndarray]) -> sparse.csr_array:
    """Return G, (contacts, 3 spheres): from velocities to speeds with which surfaces part."""
    index = {int(number): k for k, number in enumerate(problem["id"])}
    n, count = len(index), len(problem["gap"])
    first = np.array([index[int(number)] for number in problem["id1"]])
    normal = problem["normal"]
    rows = np.repeat(np.arange(count), 3)
    columns = (3 * first[:, None] + np.arange(3)).ravel()
    g = sparse.csr_array((normal.ravel(), (rows, columns)), shape=(count, 3 * n))
    pairs = problem["id2"] > 0
    second = np.array([index[int(number)] for number in problem["id2"][pairs]], dtype=int)
    rows = np.repeat(np.flatnonzero(pairs), 3)
    columns = (3 * second[:, None] + np.arange(3)).ravel()
    return g - sparse.csr_array((normal[pairs].ravel(), (rows, columns)), shape=(count, 3 * n))
