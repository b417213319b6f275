"""Every mistake with rigid bodies ends with one line that says what is wrong."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.bodies import (
    BENT,
    DUMP_BODY_SPHERES,
    INERTIAS,
    ROD,
    Bodies,
    body_scene,
    dimer,
    placed,
    random_bodies,
    rigid_velocities,
)
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import mass, read_dump

RADIUS = 0.05
EPS = 0.0005 * RADIUS
BOX = ((0.0, 0.57), (0.0, 1.0), (0.0, 0.57))
SPHERE = np.zeros((1, 3))
BODIES = random_bodies(
    [dimer(1.5), SPHERE, BENT] * 5, RADIUS, np.array(BOX) + np.array([RADIUS, -RADIUS]), seed=1
)
Refused = Callable[..., str]
PAGE = (Path(__file__).parents[2] / "docs/reference/bodies.md").read_text()


def deck(folder: Path, inertia: str = "solid", **options: Any) -> str:
    """Return a small scene that runs."""
    defaults: dict[str, Any] = {"tolerance": EPS, "box": BOX}
    return body_scene(BODIES, RADIUS, folder, inertia=inertia, **defaults | options)


def changed(text: str, old: str, new: str) -> str:
    """Return a deck with one text in place of another, which must be there."""
    assert old in text, old
    return text.replace(old, new)


def test_the_scenes_themselves_run(tmp_path: Path, lmp: Runner) -> None:
    for inertia in INERTIAS:
        for ranks in (1, 2):
            lmp(deck(tmp_path, inertia) + "run 20\n", ranks=ranks)


LINES = {
    "no fix of this name": ("rigid bodies solid", "rigid nobody solid", ["no fix nobody"]),
    "no inertia": ("rigid bodies solid", "rigid bodies", ["point", "solid", "not nothing"]),
    "another keyword": (
        "rigid bodies solid",
        "rigid bodies shorten yes",
        ["point", "solid", "not shorten"],
    ),
    "a wrong word": ("rigid bodies solid", "rigid bodies points", ["point", "solid", "points"]),
    "no value": ("rigid bodies solid", "rigid", ["rigid"]),
    "a fix of the style nve": (
        "rigid bodies solid",
        "rigid motion solid",
        ["motion", "nve", "rigid/small"],
    ),
    "fix rigid": (
        "bodies bodies rigid/small molecule",
        "bodies bodies rigid molecule",
        ["fix bodies", "style rigid", "rigid/small"],
    ),
    "fix rigid/nve/small": (
        "bodies bodies rigid/small molecule",
        "bodies bodies rigid/nve/small molecule",
        ["fix bodies", "rigid/nve/small", "must be rigid/small"],
    ),
    "langevin": (
        "bodies bodies rigid/small molecule",
        "bodies bodies rigid/small molecule langevin 1 1 1 48",
        ["bodies"],
    ),
    "gravity by fix rigid/small": (
        "vector 0 -1 0\n",
        "vector 0 -1 0 disable\n",
        ["did not move as predicted", "without its keywords gravity and langevin"],
    ),
    "a frozen sphere in a body": (
        "fix contact all inelastic",
        "group ice id 1\nfix contact all inelastic {eps} frozen ice region container "
        "rigid bodies solid #",
        ["molecule 1", "frozen"],
    ),
    "a body partly in the group": (
        "fix contact all inelastic",
        "group some id 2:100\nfix contact some inelastic",
        ["molecule 1", "group", "partly"],
    ),
    "no body in the group": (
        "fix contact all inelastic",
        "group loose subtract all bodies\nfix contact loose inelastic",
        ["no body of fix bodies is in the fix's group"],
    ),
    "two fixes move the bodies": (
        "thermo 1\n",
        "fix again bodies nve\nthermo 1\n",
        ["did not move as predicted"],
    ),
    "a force afterwards": (
        "thermo 1\n",
        "fix wind all addforce 1e-6 0 0\nthermo 1\n",
        ["did not move as predicted", "wind (addforce)", "before fix contact"],
    ),
    "gravity afterwards": (
        "thermo 1\n",
        "fix more all gravity 1 vector 1 0 0\nthermo 1\n",
        ["did not move as predicted", "more (gravity)"],
    ),
    "momentum": (
        "thermo 1\n",
        "fix drift all momentum 1 linear 1 1 1 angular\nthermo 1\n",
        ["did not move as predicted", "drift (momentum)"],
    ),
    "a torque from elsewhere": (
        "thermo 1\n",
        "fix twist bodies addtorque 0 0 1e-5\nthermo 1\n",
        ["did not move as predicted", "twist (addtorque)"],
    ),
    "no mover at all": (
        "fix bodies bodies rigid/small molecule \n",
        "",
        ["no fix bodies"],
    ),
}


@pytest.mark.parametrize(
    ("name", "ranks"),
    [(name, 1) for name in LINES]
    + [
        (name, 2)
        for name in (
            "a frozen sphere in a body",
            "a body partly in the group",
            "a force afterwards",
            "a torque from elsewhere",
        )
    ],
)
def test_one_line_says_what_is_wrong(
    name: str, ranks: int, tmp_path: Path, refused: Refused
) -> None:
    old, new, words = LINES[name]
    rigid = "gravity gravity" if name == "gravity by fix rigid/small" else ""
    text = changed(deck(tmp_path, rigid_options=rigid), old, new.replace("{eps}", str(EPS)))
    error = refused(text + "run 30\n", ranks=ranks, timeout=20)
    for word in words:
        assert word.lower() in error.lower(), error


@pytest.mark.parametrize("ranks", [1, 2])
def test_bodies_that_are_no_molecules(ranks: int, tmp_path: Path, refused: Refused) -> None:
    centres = np.array(BOX) + np.array([RADIUS, -RADIUS])
    dimers = random_bodies([dimer(1.5)] * 6, RADIUS, centres, seed=1)
    text = body_scene(dimers, RADIUS, tmp_path, inertia="solid", tolerance=EPS, box=BOX)
    text = changed(
        text,
        "fix bodies bodies rigid/small molecule",
        "comm_modify cutoff 2\nvariable two atom floor((mol+1)/2)\n"
        "fix bodies bodies rigid/small custom v_two",
    )
    error = refused(text + "run 3\n", ranks=ranks)
    assert "bodies must be molecules" in error, error


def with_molecule(folder: Path, molecule: int) -> str:
    """Return the scene with another ID for its last body."""
    text = changed(deck(folder), "group bodies molecule > 0", "group bodies molecule != 0")
    data = folder / "spheres.data"
    last = f" 1.0 {BODIES.molecules.max()}\n"
    data.write_text(changed(data.read_text(), last, f" 1.0 {molecule}\n"))
    return text


def test_bodies_without_diameters(tmp_path: Path, lmp: Runner, refused: Refused) -> None:
    """A run of no steps may set up the bodies of point masses; in others they would not touch."""
    text = deck(tmp_path, "point")
    # The recipe of the page without its fix adapt, which gives the diameters back.
    text = re.sub(r"(?m)^(fix grow|unfix grow|run 0|group size).*\n", "", text)
    text = changed(text, "set group bodies diameter 0", "set group all diameter 0")
    lmp(text + "run 0\n")
    assert "set diameters before a run of more than 0 steps" in refused(text + "run 5\n")
    assert "set diameters before a run" in refused(text + "run 0\nrun 5 pre no\n")


@pytest.mark.parametrize("ranks", [1, 2])
def test_without_atoms(ranks: int, tmp_path: Path, lmp: Runner, refused: Refused) -> None:
    """Bodies that are all gone have no diameters, and need none."""
    text = deck(tmp_path) + "run 1\n"
    for run in ("run 5\n", "run 5 pre no\n"):
        lmp(text + "delete_atoms group all\n" + run, ranks=ranks)
    # That is far out of the box, which has no boundary that would follow them.
    error = refused(text + "displace_atoms all move 1000 0 0\nrun 5\n", ranks=ranks)
    assert "Lost atoms: original 30 current 0" in error, error


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_negative_molecule_id(ranks: int, tmp_path: Path, refused: Refused) -> None:
    """LAMMPS reads any. Of one body only, which one rank alone may own."""
    error = refused(with_molecule(tmp_path, -3) + "run 3\n", ranks=ranks)
    assert "molecule ID -3 of a body must not be negative" in error, error


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_large_molecule_id_costs_nothing(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    """Same motion, and no memory for the two thousand million IDs in between."""
    small = lmp(deck(tmp_path / "small") + DUMP_BODY_SPHERES + "run 3\n", into="small", ranks=ranks)
    text = with_molecule(tmp_path / "large", 2_000_000_000)
    large = lmp(text + DUMP_BODY_SPHERES + "run 3\n", into="large", ranks=ranks)
    ends = [
        read_dump(tmp_path / name / "particles.dump")[-1].positions for name in ("small", "large")
    ]
    assert (ends[0] == ends[1]).all()
    used = [
        re.findall(r"memory allocation .* = .* \| (\S+) Mbytes", run.screen)[-1]
        for run in (small, large)
    ]
    # [MB] One number for each ID would be 8,000.
    assert float(used[1]) < float(used[0]) + 1


def test_a_body_that_loses_a_sphere(tmp_path: Path, refused: Refused) -> None:
    """It is deleted between two runs, and fix rigid/small does not look again."""
    text = deck(tmp_path, rigid_options="reinit no") + "run 3\n"
    lost = f"group last id {len(BODIES.molecules)}\ndelete_atoms group last compress no\nrun 3\n"
    error = refused(text + lost)
    assert "fix bodies gives the body of molecule" in error, error


@pytest.mark.parametrize("ranks", [1, 2])
def test_bodies_that_fall_out_of_the_box(ranks: int, tmp_path: Path, refused: Refused) -> None:
    centres = ((0.2, 0.8), (0.2, 0.8), (0.2, 0.8))
    dimers = random_bodies([dimer(1.5)] * 6, RADIUS, centres, seed=1)
    text = body_scene(
        dimers,
        RADIUS,
        tmp_path,
        inertia="solid",
        tolerance=EPS,
        boundary="f f f",
        options="shorten yes",
    )
    error = refused(text + "thermo 1000\nrun 1000\n", ranks=ranks)
    assert re.search(
        r"\d+ of the 12 spheres of bodies are lost, because they left the box", error
    ), error


@pytest.mark.parametrize("distance", [1e-9, 1e-12, 1e-15])
def test_point_masses_too_near_one_another(
    distance: float, tmp_path: Path, refused: Refused
) -> None:
    """Their inertia, and so how they turn, is round-off."""
    pair = Bodies(np.array([[0.3, 0.3, 0.3], [0.3 + distance, 0.3, 0.3]]), np.array([1, 1]))
    text = body_scene(pair, RADIUS, tmp_path, inertia="point", tolerance=EPS)
    error = refused(text + "run 20\n")
    assert "the spheres of molecule 1 are about" in error, error
    assert "too near to one another for point masses" in error, error


@pytest.mark.parametrize("ranks", [1, 2])
def test_bodies_that_turn_too_far_in_a_step(ranks: int, tmp_path: Path, refused: Refused) -> None:
    """Not the room is missing: ends of long arcs contradict one another."""
    centres = ((0.1, 0.47), (0.1, 0.9), (0.1, 0.47))
    rods = random_bodies([ROD] * 12, RADIUS, centres, seed=2)
    speeds = np.random.default_rng(3).normal(0, 100, (12, 3))
    velocities, spins = rigid_velocities(rods, RADIUS, [0, 0, 0], speeds)
    text = body_scene(
        rods,
        RADIUS,
        tmp_path,
        inertia="solid",
        tolerance=EPS,
        box=BOX,
        timestep=0.05,
        skin=8,
        options="region container maxiter 100",
        velocities=velocities,
        spins=spins,
    )
    error = refused(text + "run 5\n", ranks=ranks)
    found = re.search(r"Bodies spin by up to ([\d.e+]+) radians in this step: lower the t", error)
    assert found is not None, error
    assert float(found[1]) > 1


def test_an_infile_with_other_values(tmp_path: Path, refused: Refused) -> None:
    dimers = random_bodies([dimer(1.5)], RADIUS, ((0.2, 0.4),) * 3, seed=1)
    centre = " ".join(f"{x:.17g}" for x in dimers.positions.mean(axis=0))
    (tmp_path / "bodies.txt").write_text(
        f"1\n1 {2 * mass(RADIUS):.17g} {centre} 1e-6 1e-6 1e-6 0 0 0 0 0 0 0 0 0 0 0 0\n"
    )
    text = body_scene(
        dimers, RADIUS, tmp_path, inertia="solid", tolerance=EPS, rigid_options="infile bodies.txt"
    )
    error = refused(text + "run 1\n")
    assert "moments from an infile must be one or the other" in error, error


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("inertia", INERTIAS)
def test_the_two_fixes_have_another_inertia(
    inertia: str, ranks: int, tmp_path: Path, refused: Refused
) -> None:
    other = INERTIAS[1 - INERTIAS.index(inertia)]
    text = changed(deck(tmp_path, inertia), f"rigid bodies {inertia}", f"rigid bodies {other}")
    error = refused(text + "run 3\n", ranks=ranks)
    words = {"point": "of point masses", "solid": "of solid spheres"}
    assert f"{words[inertia]}, where fix inelastic has rigid bodies {other}" in error, error
    assert "fix bodies turns the body of molecule" in error, error
    assert "diameter is 0" in error, error


@pytest.mark.parametrize("ranks", [1, 2])
def test_radii_that_changed_after_the_bodies(ranks: int, tmp_path: Path, refused: Refused) -> None:
    """Between two runs, where fix rigid/small does not look again."""
    text = deck(tmp_path, rigid_options="reinit no")
    # The command set ... diameter crashes this version of LAMMPS once fix rigid/small is there.
    slim = "variable wide equal 0.09\nfix slim bodies adapt 0 atom diameter v_wide mass no\n"
    error = refused(text + f"run 3\n{slim}run 0\nrun 3\n", ranks=ranks)
    assert "molecule" in error, error
    assert "moments of inertia" in error, error


@pytest.mark.parametrize(
    "change", ["diameter 0.1", "density 1", "mass 1", "mol 3", "image 0 0 0", "x 0.2"]
)
def test_set_after_the_bodies(change: str, tmp_path: Path, lmp: Runner) -> None:
    """One line says what is wrong; or LAMMPS crashes in the command, and the page warns of it."""
    result = lmp(deck(tmp_path) + f"run 1\nset atom 1 {change}\nrun 1\n", must_pass=False)
    assert result.status != 0
    if not result.errors:
        warning = re.search(r"- `set` with (.*?) crashes this LAMMPS", " ".join(PAGE.split()))
        assert warning is not None
        assert f"`{change.split()[0]}`" in warning[1]


@pytest.mark.parametrize("inertia", INERTIAS)
def test_velocities_changed_between_runs(inertia: str, tmp_path: Path, lmp: Runner) -> None:
    """They count, unless fix rigid/small is told `reinit no`: then it keeps its own."""
    text = deck(tmp_path, inertia, gravity=False, options="")
    lmp(text + f"run 10\nvelocity bodies set 1 0 0\n{DUMP_BODY_SPHERES}run 5\n")
    frames = read_dump(tmp_path / "particles.dump")
    member = frames[0]["mol"] > 0
    expected = 0 if inertia == "point" else 1  # round-off
    assert frames[0]["vx"][member] == pytest.approx(expected, abs=1e-12)
    moved = frames[-1]["x"][member] - frames[0]["x"][member]
    assert (moved < 5 * 0.005 * 1.001).all()
    assert moved.max() == pytest.approx(5 * 0.005 * expected, abs=1e-12)


def test_ghosts_that_do_not_reach(tmp_path: Path, refused: Refused) -> None:
    text = "\n".join(
        line for line in deck(tmp_path).splitlines() if not line.startswith("comm_modify")
    )
    error = refused(text + "\nrun 3\n", ranks=2)
    assert "comm_modify cutoff to at least" in error, error
    needed = error.split("at least ")[1].split()[0]
    text = changed(text, "neigh_modify delay", f"comm_modify cutoff {needed}\nneigh_modify delay")


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_cutoff_that_is_named_does(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    text = "\n".join(
        line for line in deck(tmp_path).splitlines() if not line.startswith("comm_modify")
    )
    first = lmp(text + "\nrun 3\n", ranks=ranks, must_pass=False)
    assert (first.status == 0) == (ranks == 1)  # one rank has no ghosts here
    if first.status != 0:
        needed = first.errors[0].split("at least ")[1].split()[0]
        cutoff = f"comm_modify cutoff {float(needed) * (1 + 1e-5)}\n"  # printed with 6 digits
        lmp(
            changed(text, "neigh_modify delay", cutoff + "neigh_modify delay") + "\nrun 30\n",
            ranks=2,
        )


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_periodic_box_that_is_too_small(ranks: int, tmp_path: Path, refused: Refused) -> None:
    text = deck(tmp_path, boundary="p f p", setup="region floor plane 0 0 0 0 1 0").replace(
        "region container rigid", "region floor rigid"
    )
    error = refused(text + "run 3\n", ranks=ranks)
    assert "periodic box is 0.57 wide" in error, error


def test_the_skin_that_is_named_does(tmp_path: Path, lmp: Runner) -> None:
    """Of a periodic box that is too small for it, but not for its bodies."""
    box = ((0, 1), (0, 1), (0, 1))
    text = body_scene(
        Bodies(np.array([[0.45, 0.5, 0.5], [0.55, 0.5, 0.5]]), np.array([1, 1])),
        0.1,
        tmp_path,
        tolerance=1e-4,
        inertia="solid",
        box=box,
        boundary="p p p",
        gravity=False,
        skin=0.3,
        options="",
    )
    first = lmp(text + "run 1\n", must_pass=False)
    (error,) = first.errors
    assert "the periodic box is 1 wide and must be at least" in error
    most = float(error.split("at most ")[1].split()[0])
    assert 0 < most < 0.3
    # It is printed with four digits.
    lmp(
        text.replace("neighbor 0.29999999999999999 bin", f"neighbor {most * 0.999} bin") + "run 1\n"
    )


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize(("lost", "speed"), [("error", 1), ("ignore", 1), ("ignore", 20)])
def test_a_body_that_leaves_the_box(
    lost: str, speed: float, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    """LAMMPS deletes what is beyond its own, not periodic boundaries: a whole body, or a part."""
    body = placed(2 * RADIUS * dimer(1.9), [0.3, -0.8, 0.3], [0, 0, 0.7])
    both = body.joined(placed(2 * RADIUS * dimer(1.9), [0.3, 0.9, 0.3]))
    falling = np.array([[0, -speed, 0], [0, 0, 0]])
    velocities, spins = rigid_velocities(both, RADIUS, falling, [0, 0, 5])
    text = body_scene(
        both,
        RADIUS,
        tmp_path,
        inertia="solid",
        tolerance=EPS,
        box=BOX,
        gravity=False,
        options="",
        velocities=velocities,
        spins=spins,
        skin=0.3,
    )
    text = changed(text, "lost error", f"lost {lost}") + "neigh_modify every 1 check no\n"
    result = lmp(text + DUMP_BODY_SPHERES + "run 100\n", ranks=ranks, timeout=20, must_pass=False)
    assert result.status != 0
    # Fix rigid/small aborts all ranks at once, which may swallow its line.
    assert ranks == 2 or "Rigid body atoms" in result.errors[0]


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_body_in_parts_outside_the_region(ranks: int, tmp_path: Path, refused: Refused) -> None:
    body = placed(2 * RADIUS * dimer(1.9), [0.0, 0.5, 0.3])
    text = body_scene(
        BODIES.joined(body), RADIUS, tmp_path, inertia="solid", tolerance=EPS, box=BOX
    )
    error = refused(text + "run 3\n", ranks=ranks)
    assert "centre of atom" in error
    assert "region container" in error


@pytest.mark.parametrize("ranks", [1, 2])
def test_coincident_centres(ranks: int, tmp_path: Path, refused: Refused) -> None:
    one = placed(2 * RADIUS * dimer(1.5), [0.3, 0.5, 0.3])
    two = placed(2 * RADIUS * dimer(1.5), one.positions[1])
    two = Bodies(two.positions - two.positions[0] + one.positions[1], two.molecules)
    text = body_scene(one.joined(two), RADIUS, tmp_path, inertia="solid", tolerance=EPS, box=BOX)
    error = refused(text + "run 3\n", ranks=ranks)
    assert "centres of atoms" in error


@pytest.mark.parametrize("ranks", [1, 2])
def test_free_spheres_that_do_not_see_each_other(
    ranks: int, tmp_path: Path, refused: Refused
) -> None:
    """LAMMPS takes all atoms without a molecule for one when it excludes pairs of a molecule."""
    text = changed(deck(tmp_path), "molecule/intra bodies", "molecule/intra all")
    error = refused(text + "run 3\n", ranks=ranks)
    assert "exclude" in error
    assert "molecule" in error


@pytest.mark.parametrize("ranks", [1, 2])
def test_bodies_that_are_not_told_of(ranks: int, tmp_path: Path, refused: Refused) -> None:
    text = changed(deck(tmp_path), "rigid bodies solid", "")
    error = refused(text + "run 3\n", ranks=ranks)
    assert "fix bodies (rigid/small)" in error, error
    assert "rigid bodies point, or solid" in error, error


@pytest.mark.parametrize("ranks", [1, 2])
def test_bodies_made_during_a_run(ranks: int, tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "drop.mol").write_text(
        "a dimer\n\n2 atoms\n\nCoords\n\n1 0 0 0\n2 0.05 0 0\n\nTypes\n\n1 1\n2 1\n\n"
        f"Diameters\n\n1 {2 * RADIUS}\n2 {2 * RADIUS}\n\nMasses\n\n1 0.0005\n2 0.0005\n"
    )
    text = deck(tmp_path, rigid_options="mol drop")
    text = changed(
        text,
        "group bodies molecule > 0",
        "molecule drop drop.mol\ngroup bodies molecule > 0",
    )
    text += (
        "region slot block 0.15 0.4 0.9 1.2 0.15 0.4\n"
        "fix rain bodies deposit 3 0 5 4711 region slot near 0.13 mol drop rigid bodies\n"
    )
    error = refused(text + "run 40\n", ranks=ranks)
    assert "create no bodies during a run" in error, error
