"""What changes behind the fix's back, or hides spheres from it: told, refused, or followed."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import iterate_contact_frames
from tests.helpers.lammps_run import Run, Runner
from tests.helpers.scenes import (
    DUMP_CONTACTS,
    DUMP_PARTICLES,
    GRAVITY,
    deepest_pair,
    mass,
    random_points,
    read_dump,
    scene,
)

RADIUS = 0.05
EPS = 0.0005 * RADIUS
SLACK = 1 + 1e-6  # round-off of positions
Refused = Callable[..., str]


def pair(folder: Path, largest: float = 2 * RADIUS, **options: object) -> str:
    """Return two spheres at rest, a small gap apart, in a periodic box without forces.

    `largest` is the diameter up to which they may grow.
    """
    defaults: dict[str, object] = {
        "tolerance": EPS,
        "box": ((0, 1), (0, 1), (0, 1)),
        "boundary": "p p p",
        "gravity": False,
        "options": "shorten yes",
    }
    centres = [[0.4, 0.5, 0.5], [0.4 + 2.02 * RADIUS, 0.5, 0.5]]
    text = scene(centres, RADIUS, folder, **(defaults | options))  # type: ignore[arg-type]
    return text.replace(f"pair_style zero {2 * RADIUS}", f"pair_style zero {largest}")


# Buffers of LAMMPS


def crowd(
    folder: Path, newton: str, spheres: int = 300, radius: float = 0.03, **options: object
) -> str:
    """Return spheres in a periodic box, with more than 300 ghosts on each rank."""
    points = random_points(spheres, ((0, 1), (0, 1), (0, 1)), radius / 0.6, seed=11)
    return scene(
        points,
        radius,
        folder,
        velocities=np.random.default_rng(12).normal(0, 1, points.shape),
        box=((0, 1), (0, 1), (0, 1)),
        boundary="p p p",
        setup=f"newton {newton}",
        **({"tolerance": 3e-5, "options": "shorten yes", "skin": 0.12} | options),  # type: ignore[arg-type]
    )


@pytest.mark.parametrize(
    ("ranks", "spheres", "radius"),
    # On one rank the reserve of LAMMPS's buffers holds what the smaller crowd sends.
    [(1, 300, 0.03), (1, 1000, 0.025), (2, 300, 0.03)],
)
def test_newton_off_with_many_ghosts(
    ranks: int, spheres: int, radius: float, tmp_path: Path, lmp: Runner
) -> None:
    """LAMMPS then makes buffers for reverse communication as large as the pair style needs them."""
    deck = crowd(tmp_path, "off", spheres, radius)
    result = lmp(deck + DUMP_PARTICLES + DUMP_CONTACTS + "run 40\n", ranks=ranks)
    ghosts = re.search(r"^Nghost:\s+([\d.e+]+) ave", result.screen, re.MULTILINE)
    assert ghosts is not None
    assert float(ghosts[1]) >= 300
    overlaps = [
        deepest_pair(frame.positions, frame["radius"], [1, 1, 1])
        for frame in read_dump(tmp_path / "particles.dump")
    ]
    # The start overlaps: it is pushed apart within some steps.
    assert max(overlaps[20:]) <= 3e-5 * SLACK
    assert result.thermo["f_contact[4]"] == pytest.approx(overlaps, abs=1e-12)  # round-off
    for frame in iterate_contact_frames(tmp_path / "contacts.dump"):
        assert ((frame.ids >= 1) & (frame.ids <= spheres)).all()


def test_newton_off_moves_spheres_as_newton_on(tmp_path: Path, lmp: Runner) -> None:
    ends = {}
    for newton in ("on", "off"):
        folder = tmp_path / newton
        # At this tolerance the order of summation shows little in so few steps.
        deck = crowd(folder, newton, tolerance=1e-9)
        lmp(deck + DUMP_PARTICLES + "run 10\n", into=newton)
        ends[newton] = read_dump(folder / "particles.dump")[-1].positions
    assert ends["off"] == pytest.approx(ends["on"], abs=1e-6)  # chaos from 1e-9


# The box and the radii


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("fix squeeze all deform 1 x scale 0.8 remap none", "fix squeeze (deform) changes the box"),
        ("fix squeeze all deform 1 x scale 0.8 remap x", "fix squeeze (deform) changes the box"),
        ("fix squeeze all deform 5 y erate -0.1", "fix squeeze (deform) changes the box"),
        (
            "fix press all press/berendsen iso 1 1 1",
            "fix press (press/berendsen) changes the box",
        ),
        (
            "variable wide equal 0.1+0.01*time\nfix grow all adapt 1 atom diameter v_wide mass no",
            "fix grow (adapt) changes diameters",
        ),
        (
            "group few id 1\natom_modify first few",
            "atom_modify first few",
        ),
        (
            "group few id 1\natom_modify first few\ncomm_modify group few",
            "comm_modify group",
        ),
        (
            "group few id 1\natom_modify first few\nneigh_modify include few",
            "neigh_modify include few",
        ),
    ],
)
@pytest.mark.parametrize("place", ["before", "after"])
def test_refused_by_name(
    place: str, line: str, words: str, tmp_path: Path, refused: Refused
) -> None:
    # The list has room for diameters that grow: where it has none, the fix speaks of that alone.
    if place == "before":
        text = pair(tmp_path, 0.14, fixes=line, style="atom_style sphere 1")
    else:
        text = pair(tmp_path, 0.14, style="atom_style sphere 1") + line + "\n"
    error = refused(text + "run 100\n")
    assert words in error, error


def test_a_box_that_changes_along_a_wall_is_no_gap(tmp_path: Path, lmp: Runner) -> None:
    """Where it is not periodic, contacts do not know the box."""
    text = pair(tmp_path, boundary="f f f")
    lmp(text + "fix squeeze all deform 1 x scale 0.9 remap none\nrun 20\n")


def test_a_box_changed_between_parts_of_a_run(tmp_path: Path, refused: Refused) -> None:
    """Without a setup in between the forces are those of the box before."""
    error = refused(pair(tmp_path) + "run 2\nchange_box all x scale 0.9 remap\nrun 2 pre no\n")
    assert "the periodic box has changed during the run" in error, error


def test_radii_changed_by_something_unknown(tmp_path: Path, refused: Refused) -> None:
    """Without a setup in between nothing else tells, where the list has room for them."""
    error = refused(pair(tmp_path, 0.14) + "run 2\nset atom 1 diameter 0.1001\nrun 2 pre no\n")
    assert "the radius of atom 1 has changed during the run by 5e-05" in error, error


def test_radii_grown_between_runs(tmp_path: Path, lmp: Runner) -> None:
    """What the page says to do instead: a short run pushes apart what has grown before it."""
    text = pair(
        tmp_path,
        largest=0.12,
        style="atom_style sphere 1",
        setup="variable wide equal 0.1*(1+0.001*step)",
        fixes="fix grow all adapt 0 atom diameter v_wide mass no",
    )
    result = lmp(text + DUMP_PARTICLES + "run 5\n" * 20)
    last = read_dump(tmp_path / "particles.dump")[-1]
    assert last["radius"] == pytest.approx(0.05 * 1.095, rel=1e-12)
    assert deepest_pair(last.positions, last["radius"], [1, 1, 1]) <= EPS * SLACK
    # A pair that was pushed apart keeps no momentum: the drift of 20 pushes would show.
    assert result.thermo["KinEng"][-1] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_drift_that_all_share(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    """It uses up no reach, but LAMMPS loses atoms that cross its box twice between two lists."""
    text = pair(
        tmp_path,
        velocities=[[3, 0, 0], [3, 0, 0]],
        timestep=0.05,
        setup="processors * 1 1",
    ).replace("neigh_modify delay 0", "neigh_modify delay 20")
    lmp(text + DUMP_PARTICLES + "run 40\n", ranks=ranks)
    last = read_dump(tmp_path / "particles.dump")[-1]
    # 40 steps of 0.15 are six times through the box.
    assert last["x"] == pytest.approx([0.4, 0.4 + 2.02 * RADIUS], abs=1e-12)


# Pairs that are hidden


@pytest.mark.parametrize(
    ("line", "options", "hidden"),
    [
        ("neigh_modify exclude type 1 1", "", "exclude type 1 1"),
        ("neigh_modify exclude group all all", "", "exclude group all all"),
        ("group one id 1\nneigh_modify exclude group one all", "", "exclude group one all"),
        # Two frozen spheres are no pair.
        ("neigh_modify exclude group all all", "frozen all", ""),
        ("group none empty\nneigh_modify exclude group none all", "", ""),
        ("", "", ""),
    ],
)
def test_warned_of_pairs_that_are_hidden(
    line: str, options: str, hidden: str, tmp_path: Path, lmp: Runner
) -> None:
    text = pair(tmp_path, options=f"shorten yes {options}", fixes=line)
    result = lmp(text + "run 1\n")
    ours = [warning for warning in result.warnings if "Fix inelastic" in warning]
    assert len(ours) == bool(hidden)
    if hidden:
        assert f"neigh_modify {hidden} keeps out of the neighbour list" in ours[0]


def test_molecules_that_are_hidden(tmp_path: Path, lmp: Runner) -> None:
    text = pair(
        tmp_path,
        style="atom_style hybrid sphere 0 molecular",
        molecules=[1, 1],
        setup="",
        fixes="mass 1 1\nneigh_modify exclude molecule/intra all",
    )
    result = lmp(text + "run 1\n")
    assert any("exclude molecule/intra all keeps" in warning for warning in result.warnings)


# Overlaps that appear


def warned(result: Run) -> list[str]:
    return [line for line in result.warnings if "which no earlier step has left" in line]


def pushed(result: Run) -> list[tuple[int, int, int]]:
    """Return of each run that pushed: steps of its start, later ones, those where it appeared."""
    lines = (
        r"before that, (\d+) steps pushed the overlaps of the start",
        r"(\d+) later steps began with overlaps",
        r"in (\d+) steps such an overlap had appeared",
    )
    found = []
    for summary in result.screen.split("Fix inelastic: ")[1:]:
        counts = [re.search(rf"^  {line}", summary, re.MULTILINE) for line in lines]
        start, later, appeared = (int(count[1]) if count else 0 for count in counts)
        if start or later:
            found.append((start, later, appeared))
    return found


def overlapping(folder: Path, **options: object) -> str:
    """Return two spheres that overlap by half a radius."""
    centres = [[0.4, 0.5, 0.5], [0.4 + 1.5 * RADIUS, 0.5, 0.5]]
    box = ((0, 1), (0, 1), (0, 1))
    return scene(
        centres,
        RADIUS,
        folder,
        tolerance=EPS,
        box=box,
        boundary="p p p",
        gravity=False,
        **({"options": "shorten yes"} | options),  # type: ignore[arg-type]
    )


def test_a_bad_start_is_counted_and_no_surprise(tmp_path: Path, lmp: Runner) -> None:
    text = overlapping(tmp_path) + "thermo_style custom step f_contact[12]\nrun 20\nrun 20\n"
    result = lmp(text)
    assert not warned(result)
    ((start, later, appeared),) = pushed(result)
    assert start >= 2
    assert (later, appeared) == (0, 0)
    assert result.runs[0]["f_contact[12]"][0] == 1
    assert result.runs[1]["f_contact[12]"][-1] == start
    # The overlap of the start is said apart from that of the rest.
    said = re.findall(r"largest overlap (\S+) =", result.screen)
    assert all(float(overlap) <= 2 * EPS * SLACK for overlap in said)
    (depth,) = re.findall(r"overlaps of the start, up to (\S+), apart", result.screen)
    assert float(depth) == pytest.approx(0.5 * RADIUS, rel=1e-6)  # printed with six digits


def test_a_bad_start_that_goes_on_in_the_next_run(tmp_path: Path, lmp: Runner) -> None:
    """It was there before, and is no surprise either."""
    assert not warned(lmp(overlapping(tmp_path) + "run 0\nrun 0\nrun 20\n"))


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize(
    ("change", "who"),
    [
        ("change_box all x scale 0.5 remap", "atoms [12] and [12] overlap by"),
        ("set atom 2 x 0.45", "atoms [12] and [12] overlap by"),
        ("displace_atoms second move -0.05 0 0", "atoms [12] and [12] overlap by"),
        ("set atom 2 diameter 0.14", "atoms [12] and [12] overlap by"),
        ("region walls delete\nregion walls plane 0.38 0 0 1 0 0", "atom 1 overlaps wall 1 by"),
    ],
)
def test_an_overlap_that_appears_between_runs(
    change: str, who: str, ranks: int, tmp_path: Path, lmp: Runner
) -> None:
    text = pair(
        tmp_path,
        largest=0.14,
        setup="region walls plane 0.01 0 0 1 0 0",
        options="region walls shorten yes",
        fixes="group second id 2",
    )
    result = lmp(text + f"run 5\n{change}\nrun 20\n", ranks=ranks)
    (warning,) = warned(result)
    assert re.search(f"step 5: {who}", warning), warning
    assert [appeared for *_, appeared in pushed(result)] == [1]


def test_an_overlap_that_appears_during_a_run(tmp_path: Path, lmp: Runner) -> None:
    """A sphere is dropped into another one; fix deposit makes them of diameter 1."""
    text = scene(
        [[4, 5, 5]],
        0.5,
        tmp_path,
        tolerance=1e-4,
        box=((0, 10), (0, 10), (0, 10)),
        gravity=False,
        setup="region spot sphere 4.8 5 5 1e-9",
        options="shorten yes",
    )
    drop = "fix drop all deposit 1 1 7 4711 region spot\n"
    result = lmp(text + drop + "run 30\n")
    (warning,) = warned(result)
    assert re.search(r"step 1: atoms [12] and [12] overlap by 0.2 \(2e\+03 toler", warning), warning
    ((start, later, appeared),) = pushed(result)
    assert start == 0
    assert later >= 2
    assert appeared == 1
    assert result.thermo["f_contact[4]"][-1] <= 1e-4 * SLACK


def test_a_sphere_that_joins_the_group_during_a_run(tmp_path: Path, refused: Refused) -> None:
    text = pair(tmp_path, fixes="group seen id 1", group="seen")
    error = refused(text + "run 2\ngroup seen id 2\nrun 2 pre no\n")
    assert "atom 2 has joined group seen during the run" in error, error


def test_a_lower_tolerance_is_no_surprise(tmp_path: Path, lmp: Runner) -> None:
    """Overlaps that were allowed before are pushed out, as the page says."""
    text = scene(
        # Two that overlap by half of the first tolerance.
        [[0.3, 0.3, 0.3], [0.3 + 1.995 * RADIUS, 0.3, 0.3]],
        RADIUS,
        tmp_path,
        tolerance=0.01 * RADIUS,
        gravity=False,
        options="region container",
    )
    result = lmp(text + f"run 5\nfix_modify contact tolerance {EPS}\nrun 20\n")
    assert not warned(result)
    assert pushed(result)


# Regions


def test_a_region_defined_again_with_fewer_walls(tmp_path: Path, refused: Refused) -> None:
    """Thermo goes on asking for the force on the sixth."""
    text = pair(tmp_path, options="region container shorten yes", boundary="f f f")
    text += "variable force equal f_contact[6][1]\nthermo_style custom step v_force\n"
    again = "region container delete\nregion container sphere 0.5 0.5 0.5 0.5\n"
    error = refused(text + f"run 2\n{again}run 2\n")
    assert "its regions have 1 walls, and had 6" in error, error
    assert "define fix contact again" in error, error


# Shortened steps


def falling(folder: Path) -> str:
    """Return two spheres so fast that every step is shortened."""
    return pair(
        folder,
        velocities=[[-30, 0, 0], [30, 0, 0]],
        boundary="f f f",
        timestep=0.01,
        options="region container shorten yes",
        thermo="step time dt f_contact[4] f_contact[10]",
    )


@pytest.mark.parametrize("ranks", [1, 2])
def test_run_pre_no_after_a_shortened_step(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    """Divided so, a run is the same to the bit."""
    whole = lmp(falling(tmp_path / "whole") + DUMP_PARTICLES + "run 7\n", into="whole", ranks=ranks)
    parts = "run 1\nrun 3 pre no\nrun 3 pre no\n"
    divided = lmp(falling(tmp_path) + DUMP_PARTICLES + parts, ranks=ranks)
    assert whole.thermo["Dt"][0] < 0.01
    assert divided.thermo["f_contact[10]"][-1] == whole.thermo["f_contact[10]"][-1]
    first = (tmp_path / "whole" / "particles.dump").read_bytes()
    assert (tmp_path / "particles.dump").read_bytes() == first


def test_run_every_after_a_shortened_step(tmp_path: Path, lmp: Runner) -> None:
    lmp(falling(tmp_path / "whole") + DUMP_PARTICLES + "run 7\n", into="whole")
    lmp(falling(tmp_path) + DUMP_PARTICLES + 'run 7 every 2 "print here"\n')
    first = (tmp_path / "whole" / "particles.dump").read_bytes()
    assert (tmp_path / "particles.dump").read_bytes() == first


BETWEEN = ["write_restart a.restart", "write_data a.data", "balance 1.0 shift x 5 1.1"]


@pytest.mark.parametrize("between", BETWEEN)
def test_commands_before_run_pre_no(between: str, tmp_path: Path, lmp: Runner) -> None:
    """LAMMPS initialises all fixes for these, and sets no run up after them."""
    lmp(falling(tmp_path / "whole") + DUMP_PARTICLES + "run 7\n", into="whole")
    parts = f"run 3\n{between}\nrun 4 pre no\n"
    lmp(falling(tmp_path) + DUMP_PARTICLES + parts)
    expected = read_dump(tmp_path / "whole" / "particles.dump")
    for frame, other in zip(read_dump(tmp_path / "particles.dump"), expected, strict=True):
        # The round-off of where LAMMPS's list was built.
        assert frame.rows == pytest.approx(other.rows, abs=1e-12)


@pytest.mark.parametrize("between", BETWEEN)
def test_wall_forces_stay_until_the_next_step(between: str, tmp_path: Path, lmp: Runner) -> None:
    """They are 0 before the first."""
    text = scene([0.5, RADIUS, 0.5], RADIUS, tmp_path, tolerance=EPS)
    show = 'print "FORCE $(f_contact[3][2]:%.6f)"\n'
    weight = -GRAVITY * float(mass(RADIUS))
    screen = lmp(text + show + f"run 10\n{between}\n" + show).screen
    first, second = re.findall(r"(?m)^FORCE (\S+)", screen)
    assert float(first) == 0.0
    # The force of a contact at rest, to the digits that are printed.
    assert float(second) == pytest.approx(weight, abs=1e-6)


def lying_and_frozen(folder: Path) -> str:
    """Return a sphere on the floor and one that is frozen."""
    return scene(
        [[0.5, RADIUS, 0.5], [0.2, 0.5, 0.2]],
        RADIUS,
        folder,
        tolerance=EPS,
        fixes="group still id 2\ngroup moving subtract all still",
        motion="fix motion moving nve",
        options="region container frozen still",
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("region container delete", "region container does not exist"),
        ("fix_modify contact tolerance 5", "must be below the smallest radius"),
        ("unfix motion\ngroup still delete", "frozen group still does not exist any more"),
    ],
)
def test_changes_before_run_pre_no(
    change: str, words: str, tmp_path: Path, refused: Refused
) -> None:
    """What a set-up would refuse is refused without one."""
    text = lying_and_frozen(tmp_path)
    assert words in refused(text + f"run 5\n{change}\nrun 5 pre no\n")


@pytest.mark.parametrize(
    "after",
    [
        "velocity all set 0 0 0\nrun 0",
        "unfix contact",
        "fix contact all inelastic 1e-5 region container",
    ],
)
def test_the_regular_time_step_comes_back(after: str, tmp_path: Path, lmp: Runner) -> None:
    """With the next run, or with the fix itself."""
    text = falling(tmp_path).replace("f_contact[4] f_contact[10]", "")
    result = lmp(text + f"run 1\n{after}\nprint 'NOW $(dt:%.4f)'\n")
    assert result.runs[0]["Dt"][0] < 0.01
    assert "NOW 0.0100\n" in result.screen


def test_a_time_step_set_after_a_shortened_one_stays(tmp_path: Path, lmp: Runner) -> None:
    result = lmp(falling(tmp_path) + "run 1\ntimestep 1e-5\nrun 1\n")
    assert (result.thermo["Dt"] == 1e-5).all()


@pytest.mark.parametrize("during", [False, True])
def test_restart_files_tell_the_regular_time_step(
    during: bool, tmp_path: Path, lmp: Runner
) -> None:
    """Also one that is written while a step is shortened."""
    write = (
        "restart 1 here.*.restart\nrun 1\n" if during else "run 1\nwrite_restart here.1.restart\n"
    )
    first = falling(tmp_path)
    again = re.sub(r"(?m)^(read_data) .*$", "read_restart here.1.restart", first)
    again = re.sub(r"(?m)^timestep .*\n", "", again).replace(
        "region container", "region container", 1
    )
    result = lmp(first + write + "clear\n" + again + "velocity all set 0 0 0\nrun 2\n")
    assert result.runs[0]["Dt"][-1] < 0.01
    assert (result.thermo["Dt"] == 0.01).all()


def test_a_frozen_group_whose_number_another_one_has(tmp_path: Path, refused: Refused) -> None:
    """Groups are known by their names: the new one would freeze what is in it."""
    text = lying_and_frozen(tmp_path)
    error = refused(text + "run 0\ngroup still delete\ngroup other id 1\nrun 1\n")
    assert "frozen group still does not exist any more" in error, error


@pytest.mark.parametrize("diameter", [0.0, EPS])
def test_spheres_made_too_small_during_a_run(
    diameter: float, tmp_path: Path, refused: Refused
) -> None:
    """The set-up of a run refuses such radii at once."""
    text = scene([0.5, RADIUS, 0.5], RADIUS, tmp_path, tolerance=EPS)
    (tmp_path / "small.mol").write_text(
        f"# a sphere\n\n1 atoms\n\nCoords\n\n1 0 0 0\n\nTypes\n\n1 1\n\nDiameters\n\n1 {diameter}\n"
        "\nMasses\n\n1 1e-9\n"
    )
    text += "region top block 0.1 0.9 3 4 0.1 0.9\nmolecule small small.mol\n"
    text += "fix feed all deposit 1 0 5 7 mol small region top id max\n"
    error = refused(text + "run 20\n")
    assert ("has no radius" if diameter == 0 else "below the smallest radius") in error, error


def test_run_pre_no_in_a_bad_start(tmp_path: Path, refused: Refused) -> None:
    """The end of a run takes the push out of the velocities."""
    error = refused(overlapping(tmp_path) + "run 1\nrun 1 pre no\n")
    assert "run pre no cannot go on from a step that was pushing" in error, error
