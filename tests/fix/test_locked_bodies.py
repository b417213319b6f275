"""`unlock yes`: bodies of a random start that hang in one another are taken apart."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.helpers.bodies import DUMP_BODY_SPHERES, Bodies, body_scene, placed
from tests.helpers.lammps_run import Runner
from tests.helpers.links import linked_pairs, linking_number, ring
from tests.helpers.scenes import read_dump

RADIUS, EPS = 0.1, 1e-4
RING = 2 * RADIUS * ring(10)
BOX = ((0.0, 4.0),) * 3
INPUTS = Path(__file__).parents[2] / "inputs"


def two_links(shift: float = 0.3) -> Bodies:
    """Two rings at right angles, each through the other's middle, which touch nowhere."""
    turned = Rotation.from_rotvec([np.pi / 2, 0, 0]).apply(RING)
    one, other = placed(RING, [2.0, 2.0, 2.0]), placed(turned, [2.0 + shift, 2.0, 2.0])
    return one.joined(other)


def scene_of(bodies: Bodies, folder: Path, options: str, box: object = BOX, flag: str = "f") -> str:
    return body_scene(
        bodies,
        RADIUS,
        folder,
        inertia="solid",
        tolerance=EPS,
        box=box,
        boundary=" ".join([flag] * 3),
        gravity=False,
        timestep=0.01,
        options=options,
    ).replace("comm_modify cutoff", "comm_modify cutoff 2.5 #")


@pytest.mark.parametrize("ranks", [1, 2])
def test_two_links_come_apart(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    """Without that they had touched; no speed stays, and nothing overlaps in the end."""
    bodies = two_links()
    assert abs(linking_number(bodies.positions[:10], bodies.positions[10:])) > 0.5
    deck = scene_of(bodies, tmp_path, "region container unlock yes") + DUMP_BODY_SPHERES
    result = lmp(deck + "run 200\n", ranks=ranks)
    last = read_dump(tmp_path / "particles.dump")[-1]
    assert linked_pairs(last.positions.reshape(2, 10, 3)) in {(1, 0), (0, 0)}
    assert result.thermo["f_contact[4]"][-1] <= EPS * (1 + 1e-6)
    # They stand still again.
    assert np.abs(last.velocities).max() < 1e-9
    first, second = last.positions[:10], last.positions[10:]
    gaps = np.linalg.norm(first[:, None] - second, axis=2) - 2 * RADIUS
    assert gaps.min() >= -EPS * (1 + 1e-6)


def test_chains_stay_what_they_are(tmp_path: Path, lmp: Runner) -> None:
    """Without the keyword links are what the user has made of them, and so are those of a start
    that is good already, or was.
    """
    deck = scene_of(two_links(), tmp_path, "region container") + DUMP_BODY_SPHERES
    lmp(deck + "run 20\n")
    last = read_dump(tmp_path / "particles.dump")[-1]
    assert linked_pairs(last.positions.reshape(2, 10, 3)) == (1, 1)


def test_what_links_later_stays_linked(tmp_path: Path, lmp: Runner) -> None:
    """The keyword is for the start of the fix alone, which is over when nothing is to be pushed."""
    apart = scene_of(two_links(shift=1.0), tmp_path, "region container unlock yes")
    link = "group second id 11:20\ndisplace_atoms second move -0.7 0 0 units box\n"
    lmp(apart + "run 3\n" + link + DUMP_BODY_SPHERES + "run 20\n")
    last = read_dump(tmp_path / "particles.dump")[-1]
    assert linked_pairs(last.positions.reshape(2, 10, 3)) == (1, 1)


def test_a_grain_comes_out_of_its_cage(tmp_path: Path, lmp: Runner) -> None:
    """A free sphere in the middle of a cage of 60 spheres, through which it could not pass."""
    golden = np.pi * (3 - np.sqrt(5))
    k = np.arange(60)
    z = 1 - (2 * k + 1) / 60
    across = np.sqrt(1 - z**2)
    shell = np.column_stack([across * np.cos(golden * k), across * np.sin(golden * k), z])
    cage = placed(0.55 * shell, [2.0, 2.0, 2.0])
    grain = Bodies(np.array([[2.05, 2.02, 2.0]]), np.array([0]))
    deck = scene_of(cage.joined(grain), tmp_path, "region container unlock yes")
    lmp(deck + DUMP_BODY_SPHERES + "run 300\n")
    last = read_dump(tmp_path / "particles.dump")[-1]
    centre, place = last.positions[:60].mean(axis=0), last.positions[60]
    # Beyond the shell, perhaps in a dip between its spheres.
    assert np.linalg.norm(place - centre) > 0.55 + RADIUS


def test_links_across_a_periodic_boundary(tmp_path: Path, lmp: Runner) -> None:
    """Two rings that hang in one another over a corner of the box come apart there."""
    bodies = two_links()
    box = ((0.0, 6.0),) * 3
    deck = scene_of(bodies, tmp_path, "unlock yes", box, "p")
    to_the_corner = "displace_atoms all move -2 -2 -2 units box\ngroup bodies molecule"
    deck = deck.replace("group bodies molecule", to_the_corner)
    lmp(deck + DUMP_BODY_SPHERES + "run 200\n")
    last = read_dump(tmp_path / "particles.dump")[-1]
    one, other = last.positions[:10], last.positions[10:]

    def whole(points: np.ndarray, near: np.ndarray) -> np.ndarray:
        return points - 6.0 * np.round((points - near) / 6.0)

    one = whole(one, one[0])
    other = whole(other, other[0])
    other = other + whole(other.mean(axis=0), one.mean(axis=0)) - other.mean(axis=0)
    assert linked_pairs([one, other]) in {(1, 0), (0, 0)}


@pytest.mark.slow
def test_the_deck_of_clusters_links_nothing(tmp_path: Path, lmp: Runner) -> None:
    """100 rings of ten spheres as the shape of clusters.in; most have been linked."""
    rows = "\n".join(f"{n} {x!r} {y!r} {z!r}" for n, (x, y, z) in enumerate(ring(10).tolist(), 1))
    types = "\n".join(f"{n} 1" for n in range(1, 11))
    tmp_path.joinpath("ring.mol").write_text(
        f"# a ring\n10 atoms\nCoords\n\n{rows}\n\nTypes\n\n{types}\n"
    )
    variables = {
        "shape": "ring.mol",
        "particles": 100,
        "diameter": 0.08,
        "extent": 3.08,
        **{f"steps_{phase}": 0 for phase in ("settling", "resting", "tightening")},
        "steps_agitated": 1,
        "steps_measuring": 1,
    }
    deck = (INPUTS / "clusters.in").read_text()
    for seed in range(1, 4):
        lmp(deck, variables={**variables, "seed": seed}, timeout=300)
        last = read_dump(tmp_path / "out" / "particles.lammpsdump")[-1]
        near, linked = linked_pairs(last.positions.reshape(-1, 10, 3))
        assert near > 30
        assert linked == 0


@pytest.mark.parametrize("word", ["perhaps", ""])
def test_wrong_words(word: str, tmp_path: Path, refused: Callable[..., str]) -> None:
    deck = scene_of(two_links(), tmp_path, f"region container unlock {word}")
    assert "unlock" in refused(deck) or "boolean" in refused(deck)
