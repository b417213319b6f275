"""Periodic boxes, groups and every way in which LAMMPS divides the work."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import iterate_contact_frames
from tests.helpers.bodies import Bodies, body_scene, dimer, random_bodies
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DIVISIONS,
    DUMP_CONTACTS,
    DUMP_FORCES,
    DUMP_PARTICLES,
    Frame,
    deepest_in_box,
    deepest_pair,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.06
EPS = 0.0005 * RADIUS
SLACK = 1 + 1e-6  # round-off of positions
# Summation orders differ between decompositions; contacts amplify that. At this tolerance 80 steps
# agree within SAME, the tolerance of a deck.
EXACT = 5e-9 * RADIUS
SAME = 0.0005 * RADIUS


def bed(seed: int = 1, count: int = 40) -> np.ndarray:
    """Return a cloud that falls and hits the floor within 60 steps."""
    return random_points(count, ((0.07, 0.5), (0.07, 0.7), (0.07, 0.5)), 2 * RADIUS, seed)


# Not a multiple of the diameter wide: a row of spheres that just fits is stiff beyond measure.
BOX = ((0.0, 0.57), (0.0, 1.0), (0.0, 0.57))


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("newton", ["on", "off"])
def test_periodic_sides_and_a_floor(ranks: int, newton: str, tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        random_points(60, ((0.061, 0.509), (0.07, 1.5), (0.061, 0.509)), 2 * RADIUS, seed=2),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        box=(BOX[0], (0, 4), BOX[2]),
        boundary="p f p",
        setup=f"newton {newton}\nregion floor plane 0 0 0 0 1 0",
        options="region floor shorten yes",
        skin=0.1,
        velocities=np.random.default_rng(3).normal(0, 2, (60, 3)),
    )
    dumps = DUMP_PARTICLES + DUMP_FORCES + DUMP_CONTACTS
    result = lmp(deck + dumps + "run 150\n", ranks=ranks)
    for frame in read_dump(tmp_path / "particles.dump"):
        radii = frame["radius"]
        assert deepest_pair(frame.positions, radii, [0.57, 0, 0.57]) <= EPS * SLACK
        assert np.min(frame.positions[:, 1] - radii) >= -EPS * SLACK
    assert result.thermo["f_contact[5]"][-1] > 20
    # Nothing pushes along x and z but the spheres themselves: the momentum stays.
    frames = read_dump(tmp_path / "particles.dump")
    for axis in (0, 2):
        momentum = [frame.velocities[:, axis].sum() for frame in frames]
        assert momentum == pytest.approx(np.full(len(frames), momentum[0]), abs=1e-11)  # round-off
    # Each contact is counted at both ends.
    counts = [frame["particles"].sum() for frame in read_dump(tmp_path / "forces.dump")]
    assert (np.array(counts) == 2 * result.thermo["f_contact[5]"]).all()
    # The list holds each contact once (the reader checks that), and the same forces.
    contacts = list(iterate_contact_frames(tmp_path / "contacts.dump"))
    assert [len(frame.forces) for frame in contacts] == list(
        result.thermo["f_contact[5]"] + result.thermo["f_contact[6]"]
    )
    force = np.zeros((61, 3))
    for (first, second), pushed in zip(
        contacts[-1].ids, contacts[-1].forces[:, None] * contacts[-1].normals, strict=True
    ):
        force[first] += pushed
        force[max(second, 0)] -= pushed  # walls: row 0
    per_atom = read_dump(tmp_path / "forces.dump")[-1].vectors("fx fy fz")
    assert per_atom == pytest.approx(force[1:], abs=1e-12 * np.abs(per_atom).max())  # round-off


@pytest.mark.parametrize("newton", ["on", "off"])
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_pair_meets_across_the_periodic_boundary(
    newton: str, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    deck = scene(
        [[0.15, 0.5, 0.3], [0.85, 0.5, 0.3]],
        [RADIUS, 2 * RADIUS],
        tmp_path,
        tolerance=1e-12,
        box=((0, 1), (0, 1), (0, 1)),
        boundary="p p p",
        setup=f"newton {newton}",
        gravity=False,
        options="",
        velocities=[[-1, 0, 0], [1, 0, 0]],
    )
    lmp(deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 40\n", ranks=ranks)
    end = read_dump(tmp_path / "particles.dump")[-1]
    gap = (end["x"][0] - end["x"][1]) % 1.0 - 3 * RADIUS
    # Their relative velocity is zero to tolerance / h: 40 steps may add up.
    assert gap == pytest.approx(0, abs=40e-12)
    m = mass([RADIUS, 2 * RADIUS])
    assert end["vx"] == pytest.approx(np.full(2, (m[1] - m[0]) / m.sum()), abs=1e-9)  # eps / h
    hit = [frame for frame in read_dump(tmp_path / "contacts.dump") if len(frame.rows)]
    assert hit
    for frame in hit:
        assert len(frame.rows) == 1
        normal = frame["nx"][0] if frame["id1"][0] == 1 else -frame["nx"][0]
        assert normal == pytest.approx(1, abs=1e-15)  # round-off


def test_atoms_outside_the_group_are_ignored(tmp_path: Path, lmp: Runner) -> None:
    # 1 and 2 meet; 3 is not in the group and lies in between, outside the region as well.
    deck = scene(
        [[0.2, 0.5, 0.3], [0.6, 0.5, 0.3], [0.4, 0.5, 0.3], [0.5, -0.5, 0.3]],
        [RADIUS, RADIUS, 3 * RADIUS, RADIUS],
        tmp_path,
        tolerance=1e-12,
        box=((0, 1), (0, 1), (0, 1)),
        gravity=False,
        velocities=[[1, 0, 0], [-1, 0, 0], [0, 0, 0], [0, 0, 0]],
        motion="fix motion all nve\ngroup some id 1 2",
        group="some",
    )
    result = lmp(deck + DUMP_PARTICLES + DUMP_FORCES + "run 60\n")
    end = read_dump(tmp_path / "particles.dump")[-1]
    assert end.velocities == pytest.approx(np.zeros((4, 3)), abs=1e-9)  # tolerance / h
    assert end["x"][1] - end["x"][0] == pytest.approx(2 * RADIUS, abs=60e-12)  # of 60 steps
    assert (end.positions[2:] == [[0.4, 0.5, 0.3], [0.5, -0.5, 0.3]]).all()
    assert result.thermo["f_contact[6]"].max() == 0
    assert read_dump(tmp_path / "forces.dump")[-1].rows[2:, 1:].any() == np.False_


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> list[Frame]:
    """Return the bed's frames on one rank, with LAMMPS's defaults."""
    from tests.helpers.lammps_run import run_lmp

    folder = tmp_path_factory.mktemp("reference")
    deck = scene(bed(), RADIUS, folder, tolerance=EXACT, box=BOX)
    result = run_lmp(folder, deck + DUMP_PARTICLES + "run 80\n")
    assert result.thermo["f_contact[5]"][-1] > 30
    return read_dump(folder / "particles.dump")


@pytest.mark.slow
@pytest.mark.parametrize("name", DIVISIONS)
def test_the_division_does_not_matter(
    name: str, reference: list[Frame], tmp_path: Path, lmp: Runner
) -> None:
    setup, balance, ranks = DIVISIONS[name]
    deck = scene(bed(), RADIUS, tmp_path, tolerance=EXACT, box=BOX, setup=setup, fixes=balance)
    if name == "height":
        # A tall box: the upper rank is empty from the start of the fall's end.
        deck += "change_box all y final -1 6 boundary f f f\n"
    lmp(deck + DUMP_PARTICLES + "run 80\n", ranks=ranks)
    frames = read_dump(tmp_path / "particles.dump")
    assert len(frames) == len(reference)
    for frame, other in zip(frames, reference, strict=True):
        assert np.abs(frame.positions - other.positions).max() <= SAME


def test_balance_after_the_fix_and_before(tmp_path: Path, lmp: Runner) -> None:
    """The balance fix exchanges atoms before and after the contact fix has its turn."""
    ends = []
    for place in ("before", "after"):
        balance = "fix balance all balance 3 1.0 shift xy 10 1.0\n"
        deck = scene(
            bed(),
            RADIUS,
            tmp_path / place,
            tolerance=EXACT,
            box=BOX,
            fixes=balance if place == "before" else "",
        )
        deck += balance if place == "after" else ""
        lmp(deck + DUMP_PARTICLES + "run 80\n", ranks=2, into=place)
        ends.append(read_dump(tmp_path / place / "particles.dump")[-1].positions)
    assert np.abs(ends[0] - ends[1]).max() <= SAME


def test_frozen_spheres_on_two_ranks(tmp_path: Path, lmp: Runner) -> None:
    ends = []
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        points = bed()
        deck = scene(
            points,
            RADIUS,
            folder,
            tolerance=EXACT,
            box=BOX,
            options="region container frozen still",
            motion=f"group still id {' '.join(map(str, np.argsort(points[:, 1])[:8] + 1))}\n"
            "group moving subtract all still\nfix motion moving nve",
        )
        lmp(deck + DUMP_PARTICLES + "run 60\n", ranks=ranks, into=str(ranks))
        frames = read_dump(folder / "particles.dump")
        still = np.argsort(points[:, 1])[:8]
        assert (frames[-1].positions[still] == points[still]).all()
        ends.append(frames[-1].positions)
    assert np.abs(ends[0] - ends[1]).max() <= SAME


@pytest.mark.parametrize("ranks", [1, 2])
def test_one_rank_empty_or_no_sphere_at_all(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        [[0.2, 0.2, 0.2], [0.2, 0.4, 0.2]],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        box=BOX,
        setup="processors * 1 1",
    )
    result = lmp(
        deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 60\ndelete_atoms group all\nrun 5\n",
        ranks=ranks,
    )
    assert result.runs[0]["f_contact[5]"][-1] + result.runs[0]["f_contact[6]"][-1] == 2
    assert result.runs[1]["f_contact[4]"][-1] == 0


@pytest.mark.parametrize("ranks", [1, 2])
def test_atoms_that_come_and_go(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    deck = scene(
        bed(count=5),
        RADIUS,
        tmp_path,
        tolerance=EPS,
        box=((0, 0.57), (0, 2), (0, 0.57)),
        setup="region slot block 0.1 0.5 1.6 1.9 0.1 0.5",
        fixes="fix rain all deposit 25 1 8 4711 region slot near 0.13 vy -3 -3",
        options="region container shorten yes",
    )
    # fix deposit makes spheres of diameter 1 and density 1 unless told otherwise.
    deck = deck.replace(
        "fix rain all deposit 25 1 8 4711 region slot near 0.13 vy -3 -3",
        "molecule drop drop.mol\n"
        "fix rain all deposit 25 0 8 4711 region slot near 0.13 vy -3 -3 mol drop",
    )
    (tmp_path / "drop.mol").write_text(
        "one sphere\n\n1 atoms\n\nCoords\n\n1 0 0 0\n\nTypes\n\n1 1\n\n"
        f"Diameters\n\n1 {2 * RADIUS}\n\nMasses\n\n1 {float(mass(RADIUS))}\n"
    )
    deck += "region hole block -1 0.2 -1 0.2 -1 1\nfix sink all evaporate 50 1 hole 99\n"
    result = lmp(deck + DUMP_PARTICLES + "run 300\n", ranks=ranks)
    sizes = set()
    for frame in read_dump(tmp_path / "particles.dump"):
        sizes.add(len(frame.rows))
        radii = frame["radius"]
        assert deepest_pair(frame.positions, radii) <= EPS * SLACK
        depth = deepest_in_box(frame.positions, radii, ((0, 0.57), (0, 2), (0, 0.57)))
        assert depth <= EPS * SLACK
    assert max(sizes) > 20
    assert result.thermo["f_contact[5]"][-1] > 5


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("inertia", ["", "point"])
def test_a_step_through_a_whole_periodic_box(
    inertia: str, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """LAMMPS brings an atom back from the next image only: further, it would lose the atom."""
    options: dict[str, Any] = {
        "tolerance": EPS,
        "box": ((0, 1),) * 3,
        "boundary": "p p p",
        "gravity": False,
        "options": "shorten no",
        "velocities": [0.0, 0.0, 1.6 / 0.005],  # box lengths in a time step
    }
    if inertia:
        bodies = random_bodies([dimer(1.5)] * 3, RADIUS, ((0.1, 0.9),) * 3, seed=4)
        text = body_scene(bodies, RADIUS, tmp_path, inertia=inertia, **options)
    else:
        text = scene([[0.2, 0.2, 0.2], [0.5, 0.5, 0.8]], RADIUS, tmp_path, **options)
    refused = lmp(text + "run 20\n", ranks=ranks, must_pass=False)
    said = "move further than LAMMPS can follow them between two neighbour lists, 1.6 times as far"
    assert said in refused.screen
    result = lmp(text.replace("shorten no", "shorten yes") + "run 20\n", ranks=ranks)
    assert "21 shortened steps" in result.screen


def test_a_rank_without_bodies(tmp_path: Path, lmp: Runner) -> None:
    """Dimers fall on a floor in one half of the box, spheres in the other one: no rank waits."""
    dimers = random_bodies([dimer(1.3)] * 6, RADIUS, ((0.1, 0.6), (0.1, 0.7), (0.1, 0.5)), seed=5)
    free = random_points(10, ((1.5, 1.9), (0.07, 0.7), (0.07, 0.5)), 2 * RADIUS, seed=6)
    placed = dimers.joined(Bodies(free, np.zeros(len(free), np.int64)))
    deck = body_scene(
        placed,
        RADIUS,
        tmp_path,
        tolerance=EPS,
        box=((0.0, 2.0), (0.0, 2.0), (0.0, 0.57)),
        inertia="solid",
        setup="processors 2 1 1",
        options="region container shorten yes",
    )
    ends = []
    for ranks in (1, 2):
        run = deck if ranks == 2 else deck.replace("processors 2 1 1", "")
        lmp(run + DUMP_PARTICLES + "run 60\n", ranks=ranks, timeout=60)
        ends.append(read_dump(tmp_path / "particles.dump")[-1].positions)
    # They agree within some tolerances: forces are resolved to the accuracy.
    assert ends[0] == pytest.approx(ends[1], abs=0.05 * RADIUS)


def test_uzawa_with_a_contact_on_each_rank(tmp_path: Path, lmp: Runner) -> None:
    """Its step is short enough where two ranks count the same contacts: three spheres in a row.

    Without newton a contact is on the rank of the lower ID: each rank has one of the third one.
    """
    deck = scene(
        [[0.39, 0.5, 0.5], [0.61, 0.5, 0.5], [0.499, 0.5, 0.5]],
        0.05,
        tmp_path,
        tolerance=1e-5,
        box=((0, 1),) * 3,
        timestep=0.1,
        gravity=False,
        velocities=[[1, 0, 0], [-1, 0, 0], [0, 0, 0]],
        setup="newton off\nprocessors 2 1 1",
        options="region container solver uzawa",
    )
    result = lmp(deck + DUMP_PARTICLES + "run 2\n", ranks=2)
    assert result.thermo["f_contact[5]"][0] == 2
    last = read_dump(tmp_path / "particles.dump")[-1]
    # What is allowed, and the round-off of positions.
    assert deepest_pair(last.positions, last["radius"], [0, 0, 0]) <= 1e-5 * SLACK
    # The eigenvalue of the row is three times that of both contacts alike.
    assert result.thermo["f_contact[1]"].max() < 100
