"""Recorded contact problems: what is in them, and that an independent solver agrees."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import clarabel
import numpy as np
import pytest
from scipy import sparse

from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    GRAVITY,
    FloatArray,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.055
EPS = 0.0005 * RADIUS
STEP = 0.005
BOX = ((0.0, 0.73), (0.0, 1.6), (0.0, 0.73))
SHAPES = {
    "step": (),
    "timestep": (),
    "tolerance": (),
    "id": ("n",),
    "inverse_mass": ("n",),
    "mass": ("n",),
    "radius": ("n",),
    "position": ("n", 3),
    "predicted_velocity": ("n", 3),
    "velocity": ("n", 3),
    "id1": ("m",),
    "id2": ("m",),
    "normal": ("m", 3),
    "gap": ("m",),
    "gap_now": ("m",),
    "wall_motion": ("m",),
    "impulse": ("m",),
    "impulse_guess": ("m",),
}
Record = dict[str, np.ndarray]


def load(path: Path) -> Record:
    """Read a record."""
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


def jacobian(record: Record) -> sparse.csr_array:
    """Return G: (contacts, 3 particles)."""
    index = {int(number): k for k, number in enumerate(record["id"])}
    rows, columns, values = [], [], []
    for c, (first, second) in enumerate(zip(record["id1"], record["id2"], strict=True)):
        for partner, sign in ((first, 1.0), (second, -1.0)):
            if partner > 0:
                for d in range(3):
                    rows.append(c)
                    columns.append(3 * index[int(partner)] + d)
                    values.append(sign * record["normal"][c, d])
    shape = (len(record["id1"]), 3 * len(index))
    return sparse.csr_array((values, (rows, columns)), shape=shape)


def pile(folder: Path, record: str, count: int = 120, **settings: object) -> str:
    """Return the deck of spheres of slightly different radii that fall into a box."""
    points = random_points(count, ((0.07, 0.66), (0.07, 1.5), (0.07, 0.66)), 0.12, seed=3)
    radii = np.random.default_rng(4).uniform(0.9, 1.09, count) * RADIUS
    defaults: dict[str, object] = {
        "tolerance": EPS,
        "box": BOX,
        "fixes": "fix drag all viscous 0.002",
        "skin": 0.1,
        "options": f"region container {record}",
    }
    return scene(points, radii, folder, **(defaults | settings))  # type: ignore[arg-type]


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_a_record_holds(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    deck = pile(tmp_path, "record step*.npz every 20", fixes="")
    result = lmp(deck + DUMP_PARTICLES + "run 61\n", ranks=ranks)
    assert sorted(path.name for path in tmp_path.glob("*.npz")) == [
        "step20.npz",
        "step40.npz",
        "step60.npz",
    ]
    record = load(tmp_path / "step60.npz")
    sizes = {"n": 120, "m": len(record["gap"])}
    for name, shape in SHAPES.items():
        assert record[name].shape == tuple(
            sizes[item] if isinstance(item, str) else item for item in shape
        ), name
    assert record["step"] == 60
    assert record["timestep"] == STEP
    assert record["tolerance"] == EPS
    assert record["id"].tolist() == list(range(1, 121))
    assert record["mass"] * record["inverse_mass"] == pytest.approx(np.ones(120), rel=1e-15)
    assert record["mass"] == pytest.approx(mass(record["radius"]), rel=1e-14)  # round-off

    before, now, after = (read_dump(tmp_path / "particles.dump")[step] for step in (59, 60, 61))
    assert (record["position"] == now.positions).all()
    # What moved: differences of positions carry their round-off, divided by the step.
    round_off = 1e-13 / STEP
    gravity = np.array([0, -GRAVITY, 0])
    assert record["predicted_velocity"] == pytest.approx(
        (now.positions - before.positions) / STEP + STEP * gravity, abs=round_off
    )
    assert record["velocity"] == pytest.approx(
        (after.positions - now.positions) / STEP, abs=round_off
    )
    kick = jacobian(record).T @ record["impulse"]
    assert record["velocity"] == pytest.approx(
        record["predicted_velocity"] + kick.reshape(-1, 3) * record["inverse_mass"][:, None],
        abs=1e-13 * np.abs(record["predicted_velocity"]).max(),  # round-off
    )
    assert record["impulse"].min() >= 0
    active = record["impulse"] > 0
    assert (active & (record["id2"] > 0)).sum() == result.thermo["f_contact[5]"][60]
    assert (active & (record["id2"] < 0)).sum() == result.thermo["f_contact[6]"][60]
    assert not record["wall_motion"].any()
    # Gaps are those of the positions.
    index = {int(number): k for k, number in enumerate(record["id"])}
    for c in np.flatnonzero(record["id2"] > 0):
        i, j = index[int(record["id1"][c])], index[int(record["id2"][c])]
        apart = record["position"][i] - record["position"][j]
        distance = np.linalg.norm(apart)
        assert record["normal"][c] == pytest.approx(apart / distance, abs=1e-14)  # round-off
        assert record["gap_now"][c] == pytest.approx(
            distance - record["radius"][i] - record["radius"][j],
            abs=1e-15,  # round-off
        )


def test_the_guess_is_the_force_of_the_step_before(tmp_path: Path, lmp: Runner) -> None:
    lmp(pile(tmp_path, "record step*.npz every 1") + "run 61\n")
    before = load(tmp_path / "step59.npz")
    known = {
        (int(a), int(b)): impulse
        for a, b, impulse in zip(before["id1"], before["id2"], before["impulse"], strict=True)
    }
    known |= {(b, a): impulse for (a, b), impulse in known.items()}
    now = load(tmp_path / "step60.npz")
    pairs = zip(now["id1"].tolist(), now["id2"].tolist(), strict=True)
    expected = np.array([known.get(pair, 0.0) for pair in pairs])
    assert (expected > 0).sum() > 20
    assert now["impulse_guess"] == pytest.approx(expected, rel=1e-14)  # h / h is not quite 1


def projection(record: Record) -> FloatArray:
    """Project with Clarabel onto the constraints of ALL pairs and walls, built from positions."""
    x, radii, m = record["position"], record["radius"], record["mass"]
    predicted, h = record["predicted_velocity"], float(record["timestep"])
    n = len(x)
    i, j = np.array(list(combinations(range(n), 2))).T
    apart = x[i] - x[j]
    distance = np.linalg.norm(apart, axis=1)
    normal = apart / distance[:, None]
    rows = np.repeat(np.arange(len(i)), 3)
    of_pairs = sparse.csr_array(
        (normal.ravel(), (rows, (3 * i[:, None] + np.arange(3)).ravel())), shape=(len(i), 3 * n)
    ) - sparse.csr_array(
        (normal.ravel(), (rows, (3 * j[:, None] + np.arange(3)).ravel())), shape=(len(i), 3 * n)
    )
    low, high = np.array(BOX).T
    identity = sparse.eye_array(3 * n, format="csr")
    g = sparse.vstack([of_pairs, identity, -identity], format="csc")
    gap = np.concatenate(
        [
            distance - radii[i] - radii[j],
            (x - low - radii[:, None]).ravel(),
            (high - x - radii[:, None]).ravel(),
        ]
    )
    # In units of the radius and the largest mass: u = (V - V*) h / r, A u <= b.
    weights = np.repeat(m / m.max(), 3)
    bound = (gap + h * (g @ predicted.ravel())) / RADIUS
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    solver = clarabel.DefaultSolver(
        sparse.diags_array(weights, format="csc"),
        np.zeros(3 * n),
        sparse.csc_array(-g),
        bound,
        [clarabel.NonnegativeConeT(len(gap))],
        settings,
    )
    solution = solver.solve()
    assert str(solution.status) == "Solved"
    # An interior point is as far off as the square root of its tolerance: solve for the active
    # constraints that it found, correct those that it took for the wrong kind, and see that the
    # result is the solution.
    active = np.array(solution.z) > np.array(solution.s)
    dense = g.toarray()
    for _ in range(20):
        of_active = dense[active]
        multipliers = np.linalg.lstsq(
            of_active / weights @ of_active.T, -bound[active], rcond=None
        )[0]
        u = of_active.T @ multipliers / weights
        pulling = np.flatnonzero(active)[multipliers < -1e-9]  # of weights of order 1
        violated = np.flatnonzero(dense @ u + bound < -1e-11)  # of lengths of order r
        if len(pulling) == len(violated) == 0:
            break
        active[pulling] = False
        active[violated] = True
    assert len(pulling) == len(violated) == 0
    return predicted + u.reshape(-1, 3) * RADIUS / h


def test_an_independent_solver_agrees(tmp_path: Path, lmp: Runner) -> None:
    """Falling, on impact and at rest, to 1e-6 of the largest predicted velocity."""
    tight = 1e-10 * RADIUS
    deck = pile(tmp_path, "record step*.npz every 5")
    phases = {"falling": 10, "impact": 60, "rest": 350}
    for step in phases.values():
        deck += f"fix_modify contact tolerance {EPS}\nrun {step - 3} upto\n"
        deck += f"fix_modify contact tolerance {tight}\nrun {step} upto\n"
    result = lmp(deck)
    assert result.runs[1]["KinEng"][-1] > 10 * result.runs[-1]["KinEng"][-1]
    assert result.runs[3]["f_contact[5]"][-1] > 10
    assert result.runs[-1]["f_contact[5]"][-1] > 150
    for name, step in phases.items():
        record = load(tmp_path / f"step{step}.npz")
        assert record["tolerance"] == tight
        speed = np.linalg.norm(record["predicted_velocity"], axis=1).max()
        off = np.linalg.norm(record["velocity"] - projection(record), axis=1).max()
        assert off <= 1e-6 * speed, name


@pytest.mark.parametrize("floor", ["at rest", "moving"])
def test_kinetic_energy_comes_from_nowhere(floor: str, tmp_path: Path, lmp: Runner) -> None:
    region = "variable up equal 0.05*sin(25*time)\nregion tub block {} {}".format(
        "0 0.73 0 2 0 0.73", "move NULL v_up NULL" if floor == "moving" else ""
    )
    deck = pile(tmp_path, "", count=80, setup=region, options="region tub record step*.npz every 1")
    lmp(deck + "run 120\n")
    works = []
    for step in range(1, 121):
        record = load(tmp_path / f"step{step}.npz")
        h, impulse = float(record["timestep"]), record["impulse"]
        m = record["mass"]
        before = 0.5 * m @ (record["predicted_velocity"] ** 2).sum(axis=1)
        after = 0.5 * m @ (record["velocity"] ** 2).sum(axis=1)
        gap = record["gap"]
        # A contact gives back no more than its overlap.
        overlap = np.maximum(0, -record["gap_now"])
        of_walls = impulse @ record["wall_motion"] / h
        # Where an impulse acts, the gap at the end of the step is at most the tolerance.
        residual = impulse.sum() * record["tolerance"] / h
        allowed = before + impulse @ overlap / h + of_walls + residual
        assert after <= allowed + 1e-14 * before, step  # round-off
        # The identity behind it, to round-off.
        at_end = gap + h * (jacobian(record) @ record["velocity"].ravel())
        off = record["velocity"] - record["predicted_velocity"]
        exact = before + impulse @ (at_end - gap) / h - 0.5 * m @ (off**2).sum(axis=1)
        assert after == pytest.approx(exact, rel=1e-11), step
        assert at_end.min(initial=0) >= -record["tolerance"] * (1 + 1e-9), step
        assert at_end[impulse > 0].max(initial=0) <= record["tolerance"] * (1 + 1e-9), step
        works.append(of_walls)
    assert (max(works) > 0) == (floor == "moving")


def as_set(record: Record) -> dict[tuple[int, int], float]:
    """Return the impulse of each constraint, by its two sides, the smaller id first."""
    pairs = zip(record["id1"].tolist(), record["id2"].tolist(), record["impulse"], strict=True)
    result = {}
    for first, second, impulse in pairs:
        key = (first, second) if second < 0 or first < second else (second, first)
        assert key not in result, "a contact is there twice"
        result[key] = float(impulse)
    return result


def test_two_ranks_write_the_same(tmp_path: Path, lmp: Runner) -> None:
    records = []
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        deck = pile(folder, "record step*.npz every 30", tolerance=1e-9 * RADIUS, count=60)
        lmp(deck + "run 60\n", ranks=ranks, into=str(ranks))
        records.append([load(folder / f"step{step}.npz") for step in (30, 60)])
    for one, two in zip(*records, strict=True):
        speed = np.abs(one["predicted_velocity"]).max()
        for name in ("position", "predicted_velocity", "velocity"):
            # Both are within the tolerance over the step (1e-8), which contacts amplify.
            assert one[name] == pytest.approx(two[name], abs=1e-5 * speed), name
        contacts, others = as_set(one), as_set(two)
        assert contacts.keys() == others.keys()
        largest = max(contacts.values())
        for key, impulse in contacts.items():
            assert others[key] == pytest.approx(impulse, abs=1e-4 * largest), key


def test_frozen_spheres_have_no_inverse_mass(tmp_path: Path, lmp: Runner) -> None:
    deck = pile(
        tmp_path,
        "frozen still record step*.npz every 2",
        count=10,
        motion="group still id 1 2\ngroup moving subtract all still\nfix motion moving nve",
    )
    lmp(deck + "run 2\n")
    record = load(tmp_path / "step2.npz")
    assert record["inverse_mass"][:2].tolist() == [0, 0]
    assert (record["inverse_mass"][2:] > 0).all()
    assert not record["velocity"][:2].any()


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_file_that_cannot_be_written(
    ranks: int, tmp_path: Path, refused: Callable[..., str]
) -> None:
    deck = pile(tmp_path, "record nowhere/step*.npz every 2", count=5)
    error = refused(deck + "run 4\n", ranks=ranks)
    assert "nowhere/step2.npz" in error
    assert "No such file" in error


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_full_disk(ranks: int, tmp_path: Path, refused: Callable[..., str]) -> None:
    """Every file that is there is whole: those of the steps before, and those of a run before."""
    deck = pile(tmp_path, "record step*.npz every 2", count=5)
    (tmp_path / "step4.npz").write_text("of a run before")
    # The name under which the file is written until it is whole.
    (tmp_path / "step4.npz.part").symlink_to("/dev/full")
    error = refused(deck + "run 6\n", ranks=ranks)
    assert "step 4: cannot write the record step4.npz: No space left on device" in error
    assert sorted(path.name for path in tmp_path.glob("step*")) == ["step2.npz", "step4.npz"]
    assert load(tmp_path / "step2.npz")["step"] == 2
    assert (tmp_path / "step4.npz").read_text() == "of a run before"
