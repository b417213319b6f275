"""Every mistake ends with one line that says what is wrong, an exit code, and no hanging rank."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.bodies import body_scene, dimer, placed
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import (
    DUMP_PARTICLES,
    deepest_in_box,
    deepest_pair,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.05
EPS = 0.0005 * RADIUS
POINTS = random_points(30, ((0.06, 0.5), (0.06, 0.9), (0.06, 0.5)), 2 * RADIUS, seed=1)
BOX = ((0.0, 0.57), (0.0, 2.0), (0.0, 0.57))
Refused = Callable[..., str]


def deck(folder: Path, **options: object) -> str:
    """Return a small scene that runs."""
    defaults: dict[str, object] = {"tolerance": EPS, "box": BOX}
    return scene(POINTS, RADIUS, folder, **(defaults | options))  # type: ignore[arg-type]


def with_fix(folder: Path, line: str) -> str:
    """Return the scene with another line for the contact fix, up to its first run."""
    text = deck(folder)
    start = text.index("fix contact")
    rest = text[text.index("\n", start) :]
    return text[:start] + line + rest[: rest.index("thermo ")] + "run 2\n"


def test_the_scene_itself_runs(tmp_path: Path, lmp: Runner) -> None:
    lmp(deck(tmp_path) + "run 20\n")
    lmp(with_fix(tmp_path, "fix contact all inelastic 1e-5 region container"))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("fix contact all inelastic", ["fix inelastic", "missing"]),
        ("fix contact all inelastic 0 region container", ["tolerance", "greater than 0", "not 0"]),
        ("fix contact all inelastic -1 region container", ["tolerance", "not -1"]),
        ("fix contact all inelastic nan region container", ["nan"]),
        ("fix contact all inelastic inf region container", ["inf"]),
        ("fix contact all inelastic region container", ["region"]),
        ("fix contact all inelastic 1e-5 1e-6", ["1e-6", "keyword"]),
        ("fix contact all inelastic 1e-5 regions container", ["regions", "keyword", "record"]),
        ("fix contact all inelastic 1e-5 region", ["region"]),
        ("fix contact all inelastic 1e-5 region nowhere", ["region", "nowhere", "not exist"]),
        ("fix contact all inelastic 1e-5 region container nowhere", ["nowhere", "not exist"]),
        ("fix contact all inelastic 1e-5 solver newton", ["newton", "sweeps", "apgd", "uzawa"]),
        ("fix contact all inelastic 1e-5 solver", ["solver"]),
        ("fix contact all inelastic 1e-5 accuracy", ["accuracy"]),
        ("fix contact all inelastic 1e-5 accuracy 0", ["accuracy", "greater than 0", "not 0"]),
        ("fix contact all inelastic 1e-5 accuracy 1.1", ["accuracy", "at most 1", "not 1.1"]),
        ("fix contact all inelastic 1e-5 accuracy nan", ["nan"]),
        ("fix contact all inelastic 1e-5 accuracy x", ["x"]),
        ("fix contact all inelastic 1e-5\nfix_modify contact accuracy 2", ["at most 1", "not 2"]),
        ("fix contact all inelastic 1e-5\nfix_modify contact accuracy", ["accuracy"]),
        ("fix contact all inelastic 1e-5 maxiter 0", ["maxiter", "0"]),
        ("fix contact all inelastic 1e-5 maxiter -5", ["maxiter", "-5"]),
        ("fix contact all inelastic 1e-5 maxiter 1.5", ["1.5"]),
        ("fix contact all inelastic 1e-5 maxiter warn", ["warn"]),
        ("fix contact all inelastic 1e-5 maxiter 10 warning", ["warning", "keyword"]),
        ("fix contact all inelastic 1e-5 frozen nobody", ["frozen", "nobody", "not exist"]),
        ("fix contact all inelastic 1e-5 frozen", ["frozen"]),
        ("fix contact all inelastic 1e-5 shorten maybe", ["maybe"]),
        ("fix contact all inelastic 1e-5 shorten", ["shorten"]),
        ("fix contact all inelastic 1e-5 record a*.npz", ["record FILE every N"]),
        ("fix contact all inelastic 1e-5 record a*.npz every 0", ["every", "at least 1"]),
        ("fix contact all inelastic 1e-5 record a.npz every 1", ["a.npz", "*"]),
        ("fix contact all inelastic 1e-5 frozen all frozen all", ["frozen", "given twice"]),
        ("fix contact all inelastic 1e-5 maxiter 9 warn maxiter 8", ["maxiter", "given twice"]),
        ("fix contact nobody inelastic 1e-5", ["nobody"]),
        (
            "group one id 1\ngroup two id 2\nfix contact one inelastic 1e-5 frozen two",
            ["1 of the frozen group two", "not in group one"],
        ),
        (
            "group two id 2\nfix two two move linear 1 0 0\n"
            "fix contact all inelastic 1e-5 frozen two shorten yes",
            ["fix two (move)", "leave out shorten"],
        ),
        (
            "fix contact all inelastic 1e-5\nfix contact2 all inelastic 1e-5",
            ["More than one fix inelastic"],
        ),
        ("fix contact all inelastic 1e-5\nfix_modify contact tolerance 0", ["greater than 0"]),
        ("fix contact all inelastic 1e-5\nfix_modify contact tolerance", ["tolerance"]),
        ("fix contact all inelastic 1e-5\nfix_modify contact tolerance x", ["x"]),
        ("fix contact all inelastic 1e-5\nfix_modify contact maxiter 10", ["maxiter"]),
        ("fix contact all inelastic 1e-5\nrun_style respa 2 2 pair 1", ["respa", "verlet"]),
        ("fix contact all inelastic 1e-5\nminimize 0 1e-4 10 10", ["minimize", "unfix"]),
        ("fix contact all inelastic 1e-5\nset atom 3 diameter 0", ["no radius", "diameter"]),
        (
            "fix contact all inelastic 1e-5 region container\npair_coeff * * 0.05",
            ["neighbour list", "pair_style zero", "0.1"],
        ),
        (
            "fix contact all inelastic 1e-5 region container\nset atom 3 diameter 0.5",
            ["neighbour list", "pair_style zero", "0.5"],
        ),
        ("fix contact all inelastic 1e-5 region container\npair_style none", ["pair_style zero"]),
        (
            "fix contact all inelastic 1e-5 region container friction 0.5",
            ["region friction does not exist", "IDs of regions", "next keyword"],
        ),
        (
            "fix contact all inelastic 1e-5 region container\nset group all diameter 1",
            ["pair_style zero", "was set diameter forgotten"],
        ),
        (
            "fix contact all inelastic 1e-5 region container\nset atom 3 x 0.7",
            ["centre", "atom 3", "region container"],
        ),
        (
            "fix contact all inelastic 1e-5 region container\nset atom 3 y 0",
            ["centre", "atom 3", "region container"],
        ),
        (
            "fix contact all inelastic 1e-5 region container\nset atom 3 vx 1e300",
            ["atom 3", "finite"],
        ),
        ("fix contact all inelastic 1e-5 region container\nregion container delete", ["container"]),
    ],
)
def test_one_line_says_what_is_wrong(
    line: str, words: list[str], tmp_path: Path, refused: Refused
) -> None:
    error = refused(with_fix(tmp_path, line), timeout=20)
    for word in words:
        assert word.lower() in error.lower(), error


def test_atom_style_without_radius(tmp_path: Path, refused: Refused) -> None:
    text = """
units lj
region container block 0 1 0 1 0 1
create_box 1 container
create_atoms 1 single 0.5 0.5 0.5
mass 1 1
pair_style zero 0.2
pair_coeff * *
fix motion all nve
fix contact all inelastic 1e-5 region container
run 1
"""
    error = refused(text)
    assert "radius" in error
    assert "atom_style sphere" in error


CHANGES = {
    "a later force": (
        "thermo 1\n",
        "fix wind all addforce 1e-6 0 0\nthermo 1\n",
        ["wind (addforce)", "before fix contact"],
        "",
    ),
    "reflected at the box": (
        "thermo 1\n",
        "fix mirror all wall/reflect ylo 0.3\nthermo 1\n",
        ["mirror (wall/reflect)"],
        "",
    ),
    "gravity afterwards": (
        "thermo 1\n",
        "fix more all gravity 1 vector 1 0 0\nthermo 1\n",
        ["more (gravity)"],
        "",
    ),
    "rescaled velocities": (
        "thermo 1\n",
        "fix cool all temp/rescale 1 0.001 0.001 0 1\nthermo 1\n",
        ["cool (temp/rescale)"],
        "",
    ),
    "momentum": (
        "thermo 1\n",
        "fix drift all momentum 1 linear 1 1 1\nthermo 1\n",
        ["drift (momentum)"],
        "",
    ),
    "another integrator": ("all nve", "all nve/limit 1e-4", [], ""),
    "thermostat": ("fix motion all nve", "fix motion all nvt/sphere temp 1 1 0.1", [], ""),
    "two integrators": ("fix motion all nve", "fix motion all nve\nfix again all nve", [], ""),
    "fix dt/reset": (
        "thermo 1\n",
        "fix dt all dt/reset 1 0.001 0.002 0.001\nthermo 1\n",
        [],
        "",
    ),
}


@pytest.mark.parametrize(
    ("name", "ranks"),
    [(name, 1) for name in CHANGES] + [("a later force", 2), ("reflected at the box", 2)],
)
def test_something_else_moves_the_spheres(
    name: str, ranks: int, tmp_path: Path, refused: Refused
) -> None:
    old, new, words, what = CHANGES[name]
    text = deck(tmp_path)
    assert old in text
    error = refused(text.replace(old, new, 1) + "run 50\n", ranks=ranks)
    for word in ("did not move as predicted", what, *words):
        assert word in error, error


@pytest.mark.parametrize("ranks", [1, 2])
def test_spheres_that_nothing_moves_are_frozen_ones(
    ranks: int, tmp_path: Path, refused: Refused
) -> None:
    """A rough base that no fix moves is not held: contacts would move it."""
    text = deck(tmp_path).replace(
        "fix motion all nve", "group base id 1:9\ngroup free subtract all base\nfix motion free nve"
    )
    error = refused(text + "run 50\n", ranks=ranks)
    assert re.search(r"no fix moves atom [1-9]\b", error), error
    assert "frozen" in error


HOLDS = ["freeze", "setforce 0 0 0", "setforce NULL NULL 0", "lineforce 1 0 0", "planeforce 1 0 0"]


@pytest.mark.parametrize("later", [False, True])
@pytest.mark.parametrize("hold", [*HOLDS, "aveforce 0 0 0"])
def test_held_grains_are_frozen_ones(
    hold: str, later: bool, tmp_path: Path, refused: Refused
) -> None:
    """A fix that replaces forces holds nothing, before this fix or behind it."""
    held = f"group base id 1:9\nfix hold base {hold}\n"
    text = deck(tmp_path, fixes="" if later else held) + (held if later else "")
    error = refused(text + "run 2\n")
    for words in (f"fix hold ({hold.split()[0]})", "group base", "keyword frozen"):
        assert words in error, error


def test_frozen_grains_may_be_held_as_well(tmp_path: Path, lmp: Runner) -> None:
    fixes = "group base id 1:9\ngroup free subtract all base\nfix hold base freeze\n"
    options = "region container frozen base"
    lmp(deck(tmp_path, fixes=fixes, options=options, motion="fix motion free nve") + "run 20\n")


def test_velocities_changed_before_a_run_without_setup(tmp_path: Path, refused: Refused) -> None:
    """The first step of `run pre no` goes on from the last one, which had other velocities."""
    error = refused(deck(tmp_path) + "run 5\nvelocity all set 1 0 0\nrun 5 pre no\n")
    assert "was changed before run pre no" in error


def test_fixes_in_the_right_order_are_accepted(tmp_path: Path, lmp: Runner) -> None:
    fixes = (
        "fix wind all addforce 1e-4 0 0\nfix drag all viscous 0.001\n"
        "fix noise all langevin 0.001 0.001 1.0 48 zero yes\n"
        "fix spring all spring/self 0.001\n"
    )
    text = deck(tmp_path, fixes=fixes, motion="fix motion all nve/sphere", skin=0.1)
    text += (
        "variable overlap equal f_contact[4]\nfix stop all halt 10 v_overlap > 1\n"
        "fix mean all ave/time 1 10 10 f_contact[4] f_contact[6]\n"
        "fix walls all ave/time 1 10 10 f_contact[*] mode vector\n"
        "fix count all ave/atom 1 10 10 f_contact[1] f_contact[4]\n"
        "compute most all reduce max f_contact[2]\n"
    )
    lmp(text + "run 60\n")


@pytest.mark.parametrize("ranks", [1, 2])
def test_too_few_iterations(ranks: int, tmp_path: Path, refused: Refused, lmp: Runner) -> None:
    text = deck(tmp_path, options="region container maxiter 3")
    error = refused(text + "run 100\n", ranks=ranks)
    for word in ("3 iterations", "maxiter", "tolerance", "step"):
        assert word in error, error
    text = deck(tmp_path, options="region container maxiter 3 warn")
    result = lmp(text + "run 100\n", ranks=ranks)
    over = (result.thermo["f_contact[2]"] > EPS) | (result.thermo["f_contact[3]"] > EPS)
    assert over.sum() > 5
    said = [warning for warning in result.warnings if "iterations left" in warning]
    # Each time, once.
    assert len(said) == over.sum()
    assert f"{over.sum()} projections did not reach the tolerance" in result.screen


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_step_of_too_many_iterations_is_shortened(
    ranks: int, tmp_path: Path, refused: Refused, lmp: Runner
) -> None:
    """Where the deck allows it: in a shorter step spheres pass fewer others.

    With warn a few iterations may be what is wanted, and then no step is shortened.
    """
    options = "region container maxiter 10"
    text = deck(tmp_path, options=f"{options} shorten yes")
    result = lmp(text + "run 100\n", ranks=ranks)
    assert not result.warnings
    assert result.thermo["f_contact[1]"].max() <= 10
    assert max(result.thermo["f_contact[2]"].max(), result.thermo["f_contact[4]"].max()) <= EPS
    assert int(re.findall(r"(\d+) shortened steps", result.screen)[-1]) > 5
    assert "10 iterations" in refused(deck(tmp_path, options=options) + "run 100\n", ranks=ranks)
    result = lmp(deck(tmp_path, options=f"{options} warn shorten yes") + "run 100\n", ranks=ranks)
    assert any("10 iterations left" in warning for warning in result.warnings)
    assert result.screen.count(" 0 shortened steps") == 1


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
def test_a_container_that_closes(
    solver: str, ranks: int, tmp_path: Path, refused: Refused, lmp: Runner
) -> None:
    """The lid comes down by 0.01 a step; the last one lacks this much, half of it on each side."""
    text = scene(
        [0.5, RADIUS, 0.5],
        RADIUS,
        tmp_path,
        tolerance=EPS,
        skin=0.1,
        setup="variable down equal -2*time\n"
        "region lid plane 0 0.205 0 0 -1 0 move NULL v_down NULL",
        options=f"region container lid solver {solver}",
    )
    error = refused(text + "run 20\n", ranks=ranks)
    assert "no velocities keep the surfaces apart" in error
    assert "leaves no room" in error
    found = re.search(r"step (\d+):.* atom 1 and wall (\d+) overlap by (\S+) at its end", error)
    assert found, error
    assert found[2] in ("3", "7")
    missing = 2 * RADIUS - (0.205 - 0.01 * (int(found[1]) + 1))
    assert EPS < missing < 0.01 + 2 * EPS
    assert float(found[3]) == pytest.approx(missing / 2, abs=2 * EPS)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_tolerance_below_round_off(ranks: int, tmp_path: Path, refused: Refused) -> None:
    text = deck(tmp_path) + "fix_modify contact tolerance 1e-16\nrun 1\n"
    assert "below the round-off of positions" in refused(text, ranks=ranks)


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_list_that_does_not_reach(
    ranks: int, tmp_path: Path, refused: Refused, lmp: Runner
) -> None:
    velocities = np.random.default_rng(2).normal(0, 4, POINTS.shape)
    fast = {"velocities": velocities, "skin": 0.01}
    error = refused(deck(tmp_path, **fast) + "run 50\n", ranks=ranks)
    for word in ("neighbour list", "skin", "timestep", "shorten yes"):
        assert word in error, error

    thermo = "step time dt ke f_contact[4] f_contact[10]"
    text = deck(tmp_path, options="region container shorten yes", thermo=thermo, **fast)
    text += DUMP_PARTICLES + "run 300\nrun 10\n"
    text += 'unfix contact\nprint "regular step $(dt:%.3f)"\n'
    result = lmp(text, ranks=ranks)
    for frame in read_dump(tmp_path / "particles.dump"):
        radii = frame["radius"]
        # Round-off of positions.
        assert deepest_pair(frame.positions, radii) <= EPS * (1 + 1e-6)
        assert deepest_in_box(frame.positions, radii, BOX) <= EPS * (1 + 1e-6)
    first, second = result.runs
    assert first["f_contact[10]"][-1] > 10
    assert first["Time"][-1] < 299 * 0.005
    assert np.diff(first["Time"]).min() > 0
    # The regular step is back as soon as it can be, and simulated time goes on where it was.
    assert second["Time"][0] == pytest.approx(first["Time"][-1], rel=1e-12)  # round-off
    assert "regular step 0.005" in result.screen
    # Free flight covers the simulated time: energy is right, not only the positions' overlaps.
    frames = read_dump(tmp_path / "particles.dump")
    times = first["Time"]
    moved = np.diff([frame.positions for frame in frames[:31]], axis=0)
    steps = np.diff(times[:31])
    speed = np.linalg.norm(moved, axis=2) / steps[:, None]
    assert speed.max() <= 1.5 * np.linalg.norm(velocities, axis=1).max()


def test_a_free_fall_with_shortened_steps_takes_its_time(tmp_path: Path, lmp: Runner) -> None:
    """One sphere falls while two others race: its path belongs to the time that LAMMPS shows."""
    points = [[0.1, 1.8, 0.1], [0.3, 0.5, 0.3], [0.3, 0.7, 0.3]]
    deck_text = scene(
        points,
        RADIUS,
        tmp_path,
        tolerance=EPS,
        box=((0, 0.57), (-50, 50), (0, 0.57)),
        velocities=[[0, 0, 0], [0, -9, 0], [0, 9, 0]],
        skin=0.02,
        options="shorten yes",
        thermo="step time f_contact[10]",
    )
    result = lmp(deck_text + DUMP_PARTICLES + "run 100\n")
    time = result.thermo["Time"]
    assert result.thermo["f_contact[10]"][-1] > 50
    y = np.array([frame["y"][0] for frame in read_dump(tmp_path / "particles.dump")])
    # Velocity-Verlet with steps that change is exact to first order in a step at worst.
    assert y == pytest.approx(1.8 - 9.81 * time**2 / 2, abs=9.81 * time[-1] * 0.005)


@pytest.mark.parametrize("ranks", [1, 2])
def test_types_whose_cutoff_is_too_short(
    ranks: int, tmp_path: Path, refused: Refused, lmp: Runner
) -> None:
    """With neighbor multi LAMMPS looks for pairs as far as the cutoffs of their types reach."""
    text = scene(
        [[0.2, RADIUS, 0.2], [0.2, 5 * RADIUS, 0.2], [0.7, 0.5, 0.7]],
        [RADIUS, RADIUS, 2 * RADIUS],
        tmp_path,
        tolerance=EPS,
    ).replace(
        "read_data spheres.data", "read_data spheres.data extra/atom/types 1\nset atom 3 type 2"
    )
    text = re.sub(r"(?m)^neighbor (\S+) bin", r"neighbor \1 multi", text)
    assert "multi" in text
    short = f"pair_coeff 1 1 {0.5 * RADIUS}\n"
    error = refused(text + short + "run 2\n", ranks=ranks)
    assert "atom types 1 and 1" in error
    assert f"a cutoff of at least {2 * RADIUS:g}" in error
    lmp(text + f"pair_coeff 1 1 {2 * RADIUS}\nrun 2\n", ranks=ranks)


@pytest.mark.parametrize(
    "compute", ["contact/atom", "rattlers/atom type 4 1", "fabric type contact"]
)
def test_counts_by_overlap_are_warned_of(compute: str, tmp_path: Path, lmp: Runner) -> None:
    """Once, with what to take instead."""
    result = lmp(deck(tmp_path) + f"compute count all {compute}\nrun 2\nrun 2\n")
    (said,) = [
        line for line in result.warnings if "takes spheres that overlap for contacts" in line
    ]
    assert f"compute count ({compute.split()[0]})" in said
    assert "columns 1 and 2 of this fix" in said


@pytest.mark.parametrize("style", ["multi", "bin"])
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_type_without_spheres_needs_no_cutoff(
    style: str, ranks: int, tmp_path: Path, refused: Refused, lmp: Runner
) -> None:
    """Small spheres that are to come have their own cutoffs: the list reaches as far as before."""
    text = scene([[0.2, RADIUS, 0.2], [0.2, 5 * RADIUS, 0.2]], RADIUS, tmp_path, tolerance=EPS)
    text = text.replace("read_data spheres.data", "read_data spheres.data extra/atom/types 1")
    text = re.sub(r"(?m)^neighbor (\S+) bin", rf"neighbor \1 {style}", text)
    small = f"pair_coeff 1 2 {1.2 * RADIUS}\npair_coeff 2 2 {0.4 * RADIUS}\n"
    with_small = lmp(text + small + "run 20\n", ranks=ranks)
    assert (
        with_small.thermo["KinEng"] == lmp(text + "run 20\n", ranks=ranks).thermo["KinEng"]
    ).all()
    # As soon as one is there, and large, the cutoffs of its type count.
    error = refused(text + small + "set atom 2 type 2\nrun 2\n", ranks=ranks)
    assert f"a cutoff of at least {2 * RADIUS:g}" in error or "cutoff of at least" in error


@pytest.mark.parametrize("what", ["wrong side", "far outside", "on the wall", "moved away"])
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_centre_outside_the_region(
    what: str, ranks: int, tmp_path: Path, refused: Refused
) -> None:
    place = {
        "wrong side": "set atom 7 y -0.01",
        "far outside": "set atom 7 y -0.9",
        "on the wall": "set atom 7 y 0.0",
        "moved away": "run 1\ndisplace_atoms all move 0 -0.95 0",
    }[what]
    error = refused(deck(tmp_path) + place + "\nrun 5\n", ranks=ranks)
    assert "centre of atom" in error
    assert "region container" in error


def test_a_wall_that_jumps_over_a_centre_is_no_silent_mistake(
    tmp_path: Path, refused: Refused
) -> None:
    text = deck(
        tmp_path,
        setup="variable up equal 0.3*step\n"
        "region lift block 0 0.57 0 3 0 0.57 rotate v_up 0.2 1 0.2 0 0 1",
        options="region lift",
    )
    error = refused(text + "run 5\n")
    assert "region lift" in error


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_union_seen_from_outside(ranks: int, tmp_path: Path, refused: Refused) -> None:
    """LAMMPS shows no wall of parts that do not lie in one another."""
    setup = (
        "region a sphere 0 0 0 0.01\nregion b sphere 0.5 0 0 0.01\nregion ab union 2 a b side out"
    )
    text = deck(tmp_path, setup=setup, options="region container ab")
    error = refused(text + "run 1\n", ranks=ranks)
    assert "region ab is a union seen from outside" in error, error
    assert "list the parts instead" in error, error


MESSAGES: dict[str, tuple[dict[str, Any], list[str]]] = {
    "a force that is not finite": (
        {"fixes": "variable f atom (id==1)*1e305\nfix blow all addforce v_f 0 0"},
        ["the force on atom 1 is not a finite number"],
    ),
    "the same where steps are shortened": (
        {
            "fixes": "variable f atom (id==1)*1e305\nfix blow all addforce v_f 0 0",
            "options": "region container shorten yes",
        },
        ["the force on atom 1 is not a finite number"],
    ),
    "fix move without frozen": (
        {
            "fixes": "group moved id 3\ngroup still subtract all moved\n"
            "fix lift moved move linear 0 0.1 0",
            "motion": "fix motion still nve",
        },
        ["atom 3 is moved by fix lift (move) and is not frozen", "keyword frozen"],
    ),
    "a tolerance as large as a sphere": (
        {"tolerance": 0.05},
        ["the tolerance 0.05", "the smallest radius of group all, 0.05: give", "5e-05, or less"],
    ),
}


@pytest.mark.parametrize("name", MESSAGES)
def test_the_cause_is_named(name: str, tmp_path: Path, refused: Refused) -> None:
    options, words = MESSAGES[name]
    error = refused(deck(tmp_path, **options) + "run 5\n")
    for word in words:
        assert word in error, error


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("bodies", [False, True], ids=["spheres", "dimers"])
def test_a_tolerance_near_the_radius(
    bodies: bool, part: float, tmp_path: Path, lmp: Runner
) -> None:
    """Above a tenth of a radius a warning names what is usual; the run goes on."""
    tolerance = part * RADIUS
    if bodies:
        body = placed(2 * RADIUS * dimer(1.5), [0.5, 0.5, 0.5])
        text = body_scene(body, RADIUS, tmp_path, inertia="solid", tolerance=tolerance)
    else:
        text = deck(tmp_path, tolerance=tolerance)
    result = lmp(text + "run 2\n")
    said = [line for line in result.warnings if "lets spheres overlap by" in line]
    assert len(said) == (part > 0.1), result.warnings
    for line in said:
        assert f"overlap by {part} of the smallest radius of group all, {RADIUS}" in line
        assert f"{RADIUS / 1000:.2g}, or less" in line


@pytest.mark.parametrize(("part", "raising"), [(0.01, True), (0.9, False)])
def test_no_tolerance_above_the_radius_is_advised(
    part: float, raising: bool, tmp_path: Path, refused: Refused
) -> None:
    """Where iterations run out, to raise the tolerance is advice as long as that is allowed."""
    text = column(tmp_path, maxiter=2, lid=-40, tolerance=part * RADIUS)
    error = refused(text + "run 1\n")
    assert "raise maxiter (2)" in error, error
    assert ("raise the tolerance" in error) == raising, error


def test_gaps_that_follow_a_curved_wall_far(tmp_path: Path, refused: Refused) -> None:
    """A step so long that gravity takes spheres through their container eight times is too long."""
    random = np.random.default_rng(5)
    points = random.normal(size=(60, 3))
    points *= 0.24 * random.uniform(0.3, 1, (60, 1)) / np.linalg.norm(points, axis=1)[:, None]
    text = scene(
        points,
        0.03,
        tmp_path,
        tolerance=1e-6,
        box=((-0.4, 0.4),) * 3,
        setup="region ball sphere 0 0 0 0.3",
        options="region ball maxiter 2000",
        skin=20,
        timestep=0.7,
    )
    error = refused(text + "run 1\n")
    assert "gaps at the end of the step, until which walls curve" in error, error
    assert "use shorten yes" in error, error


def column(folder: Path, maxiter: int, lid: float, tolerance: float = 1e-9) -> str:
    """Return 50 spheres that stand on one another and just touch floor and lid."""
    x = np.full(50, 0.5)
    y = 0.05 + 0.1 * np.arange(50)
    return scene(
        np.column_stack([x, y, x]),
        RADIUS,
        folder,
        box=((0.0, 1.0), (0.0, 7.0), (0.0, 1.0)),
        tolerance=tolerance,
        setup=f"variable down equal {lid}*time\n"
        "region lid plane 0 5 0 0 -1 0 move NULL v_down NULL",
        options=f"region container lid maxiter {maxiter}",
    )


@pytest.mark.parametrize(
    ("maxiter", "lid", "words"),
    [
        (150, 1, "The residual is still coming down"),
        (400, -0.02, "leaves no room"),
        (2, 1, "Either the scene leaves no room for the spheres, or"),
    ],
)
def test_slow_is_told_from_impossible(
    maxiter: int, lid: float, words: str, tmp_path: Path, refused: Refused
) -> None:
    """A column that needs more iterations, and one on which a lid closes."""
    error = refused(column(tmp_path, maxiter, lid) + "run 1\n")
    assert words in error, error
    assert f"raise maxiter ({maxiter})" in error, error
