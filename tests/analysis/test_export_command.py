"""`inelastic export` on a run of three spheres in two bodies."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import trimesh
from PIL import Image

from lammps_inelastic.workflow.main import main
from tests.helpers.written_dumps import Rows, Writer

CENTRES = np.array([(0.3, 1, 0.5), (0.4, 1, 0.5), (0.6, 1.5, 0.5)])
RADIUS = 0.125
FILES = {
    "xyz": "packing.xyz",
    "vtk": "packing.vtu",
    "csv": "packing.csv",
    "json": "packing.json",
    "pqr": "packing.pqr",
    "vtk-contacts": "contacts.vtp",
    "csv-contacts": "contacts.csv",
    "bonds": "packing.bonds",
    "tiff": "packing.tif",
    "raw": "packing.raw",
    "stl": "packing.stl",
}
OF_CONTACTS = ("vtk-contacts", "csv-contacts", "bonds")
# About the first two spheres.
BOX = ["--box", "0.2", "0.5", "0.8", "1.2", "0.25", "0.75"]


@pytest.fixture
def run(tmp_path: Path, write_particles: Writer, write_contacts: Writer) -> Path:
    """Return a folder whose spheres 1 and 2 are a body; sphere 2 touches 3 at step 90 only.

    At step 0 all centres are 0.25 lower; nothing is known of the contacts there.
    """

    def rows(fall: float) -> Rows:
        mol = (1, 1, 2)
        return [
            [i + 1, mol[i], 1, x, y - fall, z, 0, 0, 0, RADIUS]
            for i, (x, y, z) in enumerate(CENTRES)
        ]

    frames = {0: rows(0.25), 50: rows(0), 90: rows(0)}
    write_particles(frames, columns="id mol type x y z vx vy vz radius")
    floor = [1, -3, 0, 0, 0, 0, 1, 0, 0, 1]
    write_contacts({50: [floor], 90: [[2, 3, 0, 0, 0, 0, 1, 0, 0, 1], floor]})
    return tmp_path


def xyz_rows(path: Path) -> list[list[float]]:
    return [
        [float(word) for word in line.split()[1:]] for line in path.read_text().split("\n")[2:-1]
    ]


@pytest.mark.parametrize("name", FILES)
def test_the_last_frame_into_the_folder_of_the_run(
    run: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(run), "--format", name]) == 0
    path = run / FILES[name]
    assert path.exists()
    output = capsys.readouterr().out
    assert f"{path} (" in output
    assert "step 90" in output


def test_columns_of_points(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(run), "--format", "xyz"]) == 0
    assert "columns  radius, id, body, contacts\n" in capsys.readouterr().out
    assert xyz_rows(run / "packing.xyz") == [
        [*CENTRES[0], RADIUS, 1, 1, 0],
        [*CENTRES[1], RADIUS, 2, 1, 1],
        [*CENTRES[2], RADIUS, 3, 2, 1],
    ]
    comment = (run / "packing.xyz").read_text().split("\n")[1]
    assert 'Lattice="1.0 0.0 0.0 0.0 5.0 0.0 0.0 0.0 1.0"' in comment
    assert 'pbc="F F F"' in comment
    assert comment.endswith(" step=90")

    assert main(["export", str(run), "--format", "vtk"]) == 0
    mesh = meshio.read(run / "packing.vtu")
    assert mesh.points.tolist() == CENTRES.tolist()
    assert mesh.point_data["body"].tolist() == [1, 1, 2]
    assert mesh.point_data["contacts"].tolist() == [0, 1, 1]


@pytest.mark.parametrize(
    ("choice", "height", "contacts"),
    [
        (["--frame", "0"], 0.75, None),
        (["--frame", "1"], 1, [0, 0, 0]),
        (["--frame", "-1"], 1, [0, 1, 1]),
        (["--frame", "-3"], 0.75, None),
        (["--step", "0"], 0.75, None),
        (["--step", "50"], 1, [0, 0, 0]),
    ],
)
def test_frames(
    run: Path, choice: list[str], height: float, contacts: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(run), "--format", "vtk", *choice]) == 0
    mesh = meshio.read(run / "packing.vtu")
    assert mesh.points[0, 1] == height
    known = contacts is not None
    assert ("no contacts are known at this step" in capsys.readouterr().out) != known
    assert mesh.point_data.get("contacts", np.array(None)).tolist() == contacts


def test_a_dump_alone_has_no_contacts(run: Path) -> None:
    # The contacts beside it may be those of another dump.
    path = run / "particles.lammpsdump"
    assert main(["export", str(path), "--format", "xyz", "--out", str(run / "some.xyz")]) == 0
    assert xyz_rows(run / "some.xyz")[2] == [*CENTRES[2], RADIUS, 3, 2]


def test_a_dump_that_is_cut_off(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Alone, its whole frames are there, and it is said; in a run, a frame is named by its step."""
    path = run / "particles.lammpsdump"
    path.write_bytes(path.read_bytes()[:-9])
    said = "the file ends inside the frame of step 90: 2 of 3 rows"
    assert main(["export", str(path), "--format", "xyz"]) == 0
    output = capsys.readouterr().out
    assert "step 50" in output
    assert f"only whole frames are read, 2 of them: {path}, line 36: {said}" in output
    assert main(["export", str(run), "--format", "xyz"]) == 2
    error = capsys.readouterr().err
    assert error == f"inelastic: {path}, line 36: {said}; --step N writes a frame that is there\n"
    assert main(["export", str(run), "--format", "xyz", "--step", "0"]) == 0


def test_periodic_axes_are_said(run: Path) -> None:
    path = run / "particles.lammpsdump"
    path.write_text(path.read_text().replace("ff ff ff", "pp ff ff"))
    assert main(["export", str(run), "--format", "xyz"]) == 0
    assert 'pbc="T F F"' in (run / "packing.xyz").read_text()


def test_whole_spheres_by_their_centres(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["export", str(run), *BOX]
    assert main([*command, "--format", "xyz"]) == 0
    # The contact of sphere 2 with sphere 3 still counts.
    assert [row[4:] for row in xyz_rows(run / "packing.xyz")] == [[1, 1, 0], [2, 1, 1]]
    assert "spheres  2 of 3, step 90" in capsys.readouterr().out

    assert main([*command, "--format", "stl", "--subdivisions", "1"]) == 0
    assert "faces    160" in capsys.readouterr().out
    mesh = trimesh.load_mesh(run / "packing.stl")
    # They are not cut, and overlap: two closed meshes. Corners are float32 numbers near 1.
    assert len(mesh.split()) == 2
    assert mesh.bounds[:, 0] == pytest.approx([0.3 - RADIUS, 0.4 + RADIUS], abs=1e-6)


@pytest.mark.parametrize("name", ["tiff", "raw"])
def test_image_of_a_box(run: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(run), *BOX, "--format", name, "--voxel", "0.02"]) == 0
    captured = capsys.readouterr()
    assert "voxels       15 x 20 x 25 of 0.02\n" in captured.out
    share = float(re.search(r"solid share  (\S+)", captured.out)[1])
    # Nothing here is a terminal.
    assert captured.err.splitlines()[-1] == "slice 25 of 25"
    assert len(captured.err.splitlines()) == 10
    # Two spheres but for their lens and the cap beyond xhi, where sphere 2 ends at 0.525.
    lens = np.pi / 12 * (4 * RADIUS + 0.1) * (2 * RADIUS - 0.1) ** 2
    caps = [np.pi / 3 * h**2 * (3 * RADIUS - h) for h in (0.025, 0.025)]
    exact = 8 / 3 * np.pi * RADIUS**3 - lens - sum(caps)
    # About 850 pairs of neighbours, of which one is solid: each is right or wrong by half a voxel.
    # Four standard deviations.
    assert share * 0.3 * 0.4 * 0.5 == pytest.approx(exact, abs=4 * 0.5 * np.sqrt(850) * 0.02**3)


def test_voxels_follow_the_smallest_radius(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(run), *BOX, "--format", "tiff"]) == 0
    assert "voxels       24 x 32 x 40 of 0.0125\n" in capsys.readouterr().out
    with Image.open(run / "packing.tif") as image:
        assert (image.size, image.n_frames) == ((24, 32), 40)


def test_bar_on_a_terminal(
    run: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert main(["export", str(run), *BOX, "--format", "tiff"]) == 0
    captured = capsys.readouterr()
    assert "slices" in captured.err
    assert "slice 40 of 40" not in captured.err
    assert "solid share" in captured.out


def failure_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run the command line; return what it says, after seeing that it is one line and no more."""
    assert main(["export", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("inelastic: ")
    assert captured.err.count("\n") == 1
    return captured.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["xyz", "--step", "7"], "particles.lammpsdump: no step 7; the steps are 0, 50, 90"),
        (["xyz", "--frame", "3"], "no frame 3; there are 3, from 0 to 2"),
        (["xyz", "--frame", "-4"], "no frame -4; there are 3, from 0 to 2"),
        (["xyz", "--voxel", "1"], "--voxel is for tiff and raw, not for xyz"),
        (["bonds", "--box", "0", "1", "0", "1", "0", "1"], "--box is not for bonds: OVITO's"),
        (["bonds", "--out", "packing.xyz"], "packing.xyz: the name must end in .bonds"),
        (["raw", "--subdivisions", "1"], "--subdivisions is for stl, not for raw"),
        (["stl", "--subdivisions", "-1"], "subdivisions must be at least 0, not -1"),
        (["stl", "--box", "2", "3", "2", "3", "2", "3"], "no sphere's centre lies in the box"),
        (["tiff", "--box", "2", "3", "2", "3", "2", "3"], "no sphere reaches into the box"),
        (["tiff", "--box", "1", "0", "0", "1", "0", "1"], "xlo = 1 must be less than xhi = 0"),
        (["tiff", "--voxel", "0"], "the size of a voxel must be positive, not 0"),
        (["tiff", "--voxel", "1e-4"], "more than 4e+09 voxels: choose larger ones"),
        (["vtk", "--out", "packing.vtk"], "packing.vtk: the name must end in .vtu"),
        (["tiff", "--out", "/no/such/folder/a.tif"], "cannot be written: No such file"),
    ],
)
def test_wrong_values(
    run: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in failure_of([str(run), "--format", *arguments], capsys)
    assert len(list(run.iterdir())) == 2


def test_of_many_steps_some_are_named(
    run: Path, write_particles: Writer, capsys: pytest.CaptureFixture[str]
) -> None:
    write_particles({step: [[1, 1, 0, 0, 0, 0, 0, 0, 1]] for step in range(0, 1000, 10)})
    message = failure_of([str(run), "--format", "xyz", "--step", "7"], capsys)
    assert "no step 7; the 100 steps are 0, 10, 20, 30, 40, ..., 990\n" in message


def test_no_dump(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    message = failure_of([str(tmp_path), "--format", "xyz"], capsys)
    assert "particles.lammpsdump: no such file" in message
    assert "nowhere: no such file" in failure_of(["nowhere", "--format", "xyz"], capsys)


@pytest.mark.parametrize("name", ["particles.lammpsdump", "contacts.lammpsdump", "log.lammps"])
def test_what_is_no_file(run: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Nobody waits for the writer of a pipe, nor for the end of a device."""
    (run / name).unlink(missing_ok=True)
    os.mkfifo(run / name)
    said = f"{run / name}: cannot be read: it is a folder, a pipe or a device, and must be a file"
    assert said in failure_of([str(run), "--format", "xyz"], capsys)
    (run / name).unlink()
    (run / name).symlink_to("/dev/zero")
    assert said in failure_of([str(run), "--format", "xyz"], capsys)


def periodic(run: Path, flags: str) -> None:
    """Give the faces of the run's boxes other flags."""
    for name in ("particles", "contacts"):
        path = run / f"{name}.lammpsdump"
        path.write_text(path.read_text().replace("ff ff ff", flags))


def test_solids_of_a_periodic_box(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An image of sphere 1 is in a box beyond the face."""
    periodic(run, "pp ff ff")
    command = ["export", str(run), "--format"]
    # Sphere 1 reaches from 0.175 to 0.425, and its image a period further on.
    piece = ["--box", "0.9", "1.2", "0.8", "1.2", "0.25", "0.75", "--voxel", "0.005"]
    assert main([*command, "raw", *piece]) == 0
    share = float(re.search(r"solid share  (\S+)", capsys.readouterr().out)[1])
    cap = np.pi / 3 * 0.025**2 * (3 * RADIUS - 0.025)
    # A thousand pairs of neighbours, of which one is solid, each right or wrong by half a voxel.
    # Four standard deviations.
    assert share * 0.3 * 0.4 * 0.5 == pytest.approx(cap, abs=4 * 0.5 * np.sqrt(1000) * 0.005**3)


def test_surfaces_of_a_periodic_box(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    periodic(run, "pp ff ff")
    assert main(["export", str(run), "--format", "stl", "--subdivisions", "0"]) == 0
    assert "spheres  3 of 3, step 90, and 0 images that reach into the cell" in (
        capsys.readouterr().out
    )
    # Cut out at x from 1 to 1.35, an image of sphere 1 alone has its centre in the box.
    piece = ["--box", "1", "1.35", "0", "5", "0", "1"]
    assert main(["export", str(run), "--format", "stl", "--subdivisions", "1", *piece]) == 0
    assert "spheres  1, images among them, of 3, step 90" in capsys.readouterr().out
    mesh = trimesh.load_mesh(run / "packing.stl")
    assert mesh.center_mass == pytest.approx([1.3, 1, 0.5], abs=1e-6)
    assert main(["export", str(run), "--format", "csv", *piece]) == 0
    (row,) = (run / "packing.csv").read_text().split("\n")[1:-1]
    # 1.3 is a sum.
    assert [float(word) for word in row.split(",")] == pytest.approx(
        [1, 1, 1.3, 1, 0.5, RADIUS, 0], abs=1e-15
    )


def test_bonds_stand_beside_the_spheres(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    periodic(run, "pp ff ff")
    assert main(["export", str(run), "--format", "bonds", "--out", str(run / "some.bonds")]) == 0
    output = capsys.readouterr().out
    assert "contacts  2, step 90; 1 of them with walls\n" in output
    assert "bonds     1 between spheres\n" in output
    assert f"{run / 'some.xyz'} (" in output
    assert [row[4] for row in xyz_rows(run / "some.xyz")] == [1, 2, 3]
    (bond,) = (run / "some.bonds").read_text().split("\n")[5:-1]
    assert bond.split()[:2] == ["2", "3"]


def test_contacts_of_a_box(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # Both contact points are at the origin.
    command = ["export", str(run), "--format", "csv-contacts"]
    assert main([*command, "--box", "0", "1", "0", "1", "0", "1"]) == 0
    assert "rows      2\n" in capsys.readouterr().out
    assert main([*command, "--box", "0.1", "1", "0", "1", "0", "1"]) == 0
    assert "rows      0\n" in capsys.readouterr().out
    assert len((run / "contacts.csv").read_text().split("\n")) == 2


@pytest.mark.parametrize("form", OF_CONTACTS)
def test_contacts_that_are_not_known(
    form: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    message = failure_of([str(run), "--format", form, "--step", "0"], capsys)
    assert message.endswith("contacts.lammpsdump: no contacts of step 0\n")
    message = failure_of([str(run / "particles.lammpsdump"), "--format", form], capsys)
    assert "a dump alone has no contacts: name the folder of the run" in message
    (run / "contacts.lammpsdump").unlink()
    message = failure_of([str(run), "--format", form], capsys)
    assert message.endswith("contacts.lammpsdump: no contacts of step 90\n")


@pytest.mark.parametrize("form", FILES)
def test_discs(form: str, run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A two-dimensional packing has points and contacts, but no solids."""
    periodic(run, "ff ff pp")
    if form in ("tiff", "raw", "stl"):
        assert "two-dimensional" in failure_of([str(run), "--format", form], capsys)
        assert len(list(run.iterdir())) == 2
    else:
        assert main(["export", str(run), "--format", form]) == 0
        assert (run / FILES[form]).exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["x"],
        ["x", "--format", "png"],
        ["x", "--format", "xyz", "--frame", "1", "--step", "1"],
        ["x", "--format", "tiff", "--box", "1"],
    ],
)
def test_wrong_arguments(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["export", *arguments])
    error = capsys.readouterr().err
    assert error.startswith("inelastic: ")
    assert error.count("\n") == 1
