"""`pack` makes the packings of the decks, in containers and sizes of all kinds, and is stopped."""

from __future__ import annotations

import gc
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import MDAnalysis
import meshio
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.distance import pdist, squareform

from lammps_inelastic.analysis import (
    AnalysisError,
    iterate_contact_frames,
    read_particle_frame,
)
from lammps_inelastic.workflow import (
    Ball,
    Box,
    Cluster,
    Cylinder,
    Dimer,
    NotAtRestError,
    Packing,
    Sphere,
    pack,
)
from lammps_inelastic.workflow.errors import PackingError, WorkflowError
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.packing import one_call
from tests.helpers.lammps_run import LAUNCHER, run_lmp
from tests.helpers.small_disk import mounted
from tests.workflow.test_pack_arguments import outside

ROOT = Path(__file__).parents[2]
FILES = ("particles.lammpsdump", "contacts.lammpsdump")


def deck(name: str) -> str:
    return (ROOT / "inputs" / f"{name}.in").read_text()


def quiet(particles: int, **arguments: Any) -> Packing:
    return pack(particles, **{"progress": False, **arguments})


def largest_overlap(packing: Packing) -> float:
    """Of two spheres of different bodies, or of a sphere and a wall, by formulas of our own."""
    radii = packing.radii
    gaps = squareform(pdist(packing.positions)) - radii - radii[:, None]
    body = np.where(packing.bodies > 0, packing.bodies, -np.arange(1, len(radii) + 1))
    gaps[body == body[:, None]] = np.inf
    walls = outside(packing.container, packing.positions, radii)
    return max(float(-gaps.min()), float(walls.max()))


CASES: dict[str, tuple[Any, str, dict[str, Any]]] = {
    "spheres": (Sphere(), "spheres", {}),
    "dimers": (Dimer(1.7), "dimers", {"aspect_ratio": 1.7}),
    "clusters": (Cluster(), "clusters", {}),
}


@pytest.mark.parametrize(
    "name", ["spheres", "dimers", pytest.param("clusters", marks=pytest.mark.slow)]
)
def test_a_packing_is_that_of_the_deck(name: str, tmp_path: Path) -> None:
    """The bytes of both dumps, in all frames, are those of the deck run by hand."""
    shape, file, variables = CASES[name]
    run = run_lmp(
        tmp_path / "by_hand",
        deck(file),
        variables={"particles": 60, "diameter": 0.2, "seed": 5, **variables},
        program=LAUNCHER,
    )
    container = Box(1, 1, 5)
    packing = quiet(60, shape=shape, sizes=0.2, container=container, seed=5)
    for dump in FILES:
        written = (packing.folder / dump).read_bytes()
        assert written == (run.folder / "out" / dump).read_bytes(), dump
    # What Python has is what the files have.
    frame = read_particle_frame(run.folder / "out" / FILES[0])
    *_, contacts = iterate_contact_frames(run.folder / "out" / FILES[1])
    assert np.array_equal(packing.positions, frame.positions)
    assert np.array_equal(packing.radii, frame.radii)
    assert np.array_equal(packing.forces, contacts.forces)
    assert np.array_equal(packing.bodies, np.zeros(60) if frame.bodies is None else frame.bodies)


@pytest.mark.slow
def test_the_usual_packing_is_that_of_the_deck(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without any argument but the number; and `inelastic look` prints its numbers."""
    run = run_lmp(tmp_path / "by_hand", deck("spheres"), program=LAUNCHER)
    packing = quiet(1000)
    for dump in FILES:
        assert (packing.folder / dump).read_bytes() == (run.folder / "out" / dump).read_bytes()
    assert packing.box is not None
    box = [f"{bound!r}" for bound in packing.box.ravel().tolist()]
    assert main(["look", str(run.folder / "out"), "--no-picture", "--box", *box]) == 0
    printed = capsys.readouterr().out
    assert f" {packing.packing_fraction:.4f} " in printed
    assert f" {packing.coordination_number:.3f} " in printed


@pytest.mark.parametrize(
    ("shape", "container", "particles"),
    [
        pytest.param(Sphere(), Box(4.0, 3.0), 80, marks=pytest.mark.slow),
        (Sphere(), Cylinder(4.0), 80),
        (Sphere(), Ball(7.0), 120),
        pytest.param(Dimer(1.5), Cylinder(5.0), 50, marks=pytest.mark.slow),
        (Cluster(), Ball(9.0), 60),
    ],
)
def test_nothing_overlaps_in_any_container(shape: Any, container: Any, particles: int) -> None:
    """Neither two particles nor a particle and a wall, by more than the tolerance at the end."""
    packing = quiet(particles, shape=shape, sizes=1.0, container=container)
    final = 1e-5 if shape == Sphere() else 2e-5
    overlap = largest_overlap(packing)
    # Inside curved walls, and of bodies, overlaps stay below twice the tolerance (method/walls.md).
    assert overlap <= 2 * final * 0.5
    # Round-off of lengths of 50.
    assert packing.largest_overlap == pytest.approx(max(overlap, 0.0), abs=1e-13)
    assert len(packing.particles) == particles
    assert len(packing.radii) == particles * len(shape.points)
    # The weight is on the walls: they push up as much as gravity pulls down.
    contacts = packing.contacts
    wall = contacts.ids[:, 1] < 0
    up = (contacts.forces[wall] * contacts.normals[wall, 1]).sum()
    mass = len(packing.radii) * np.pi / 6
    # What is at rest within the solver's accuracy of a per mille.
    assert up == pytest.approx(9.81 * mass, rel=0.01)


def test_a_packing_that_moves_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """It says so, and holds the packing; where it may move it comes back, and says so."""
    usual = one_call._complete
    phases = ("settling", "resting", "tightening")
    hasty = {f"steps_{phase}": 0 for phase in phases} | {"steps_agitated": 30, "waiting": 0}

    def stopped(*arguments: Any) -> tuple[dict[str, Any], int]:
        values, steps = usual(*arguments)
        return {**values, **hasty}, steps

    resting = quiet(40, sizes=0.2, container=Box(1, 1, 5))
    assert resting.at_rest
    assert re.search(r"at rest +yes", repr(resting))
    monkeypatch.setattr(one_call, "_complete", stopped)
    with pytest.raises(NotAtRestError, match=r"40 spheres in a box .* are NOT AT REST") as caught:
        quiet(40, sizes=0.2, container=Box(1, 1, 5))
    packing = quiet(40, sizes=0.2, container=Box(1, 1, 5), must_rest=False)
    assert not packing.at_rest
    assert re.search(r"at rest +NOT AT REST: rms speed", repr(packing))
    assert np.array_equal(packing.positions, caught.value.packing.positions)
    # Of the dump: faster than the velocity that gravity gives in a step, a tenth of a time unit.
    assert packing.frame.velocities is not None
    assert np.sqrt((packing.frame.velocities**2).sum(axis=1).mean()) > 9.81 * 0.1


def test_each_size_is_there_as_often_as_asked() -> None:
    """Particle i has size i, whether it is a sphere or a body."""
    sizes = np.repeat([1.0, 1.7, 3.0], [40, 20, 10])[np.random.default_rng(1).permutation(70)]
    packing = quiet(70, sizes=sizes, container=Box(8.0))
    # The dump keeps 16 digits.
    assert np.allclose(2 * packing.radii, sizes, rtol=1e-15)
    assert largest_overlap(packing) <= 1e-5 * 0.5 * (1 + 1e-6)
    shares = quiet(30, shape=Dimer(1.5), sizes=[(1.0, 0.5), (2.0, 0.5)], container=Cylinder(8.0))
    assert Counter(np.round(2 * shares.radii, 12).tolist()) == {1.0: 30, 2.0: 30}
    places = shares.positions.reshape(30, 2, 3)
    apart = np.linalg.norm(places[:, 0] - places[:, 1], axis=1)
    # A body keeps its shape but for round-off of many steps.
    assert np.allclose(apart, shares.radii[::2], rtol=1e-9)
    assert largest_overlap(shares) <= 2 * 2e-5 * 0.5


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1e6])
def test_any_unit_of_length(unit: float) -> None:
    """Forces are those of the units: all weights lie on the floor."""
    packing = quiet(60, sizes=unit, container=Box(4 * unit), density=2500.0, gravity=1.6)
    assert largest_overlap(packing) <= 1e-5 * 0.5 * unit * (1 + 1e-6)
    floor = packing.contacts.ids[:, 1] == -3
    weight = 60 * 2500.0 * np.pi / 6 * unit**3 * 1.6
    # What is at rest within the solver's accuracy of a per mille.
    assert packing.forces[floor].sum() == pytest.approx(weight, rel=0.01)


@pytest.fixture(scope="module")
def few() -> Packing:
    return quiet(150, shape=Dimer(1.5), sizes=1.0, seed=3)


def test_the_box_lies_deep_in_the_bed(few: Packing) -> None:
    """Away from walls, below the surface, and what is measured there is that of other means."""
    assert few.box is not None
    (left, right), (low, high), (front, back) = few.box
    width = few.container.bounds[0, 1]
    assert (left, right) == (front, back) == (width / 4, 3 * width / 4)
    top = few.positions[:, 1].max()
    assert 0 < low < high < top
    points = few.box[:, 0] + np.random.default_rng(1).random((5000, 3)) * np.diff(few.box).ravel()
    near = np.linalg.norm(points[:, None] - few.positions, axis=2) < few.radii
    share = near.any(axis=1).mean()
    # Five standard errors of 5,000 random points.
    assert few.packing_fraction == pytest.approx(share, abs=5 * 0.5 / np.sqrt(5000))
    centres = few.positions.reshape(-1, 2, 3).mean(axis=1)
    inside = ((centres > few.box[:, 0]) & (centres < few.box[:, 1])).all(axis=1)
    means = []
    for contacts in few.contact_frames:
        body = np.where(contacts.ids > 0, few.bodies[contacts.ids - 1], 0)
        between = body[body.min(axis=1) > 0]
        means.append(np.bincount(between.ravel(), minlength=151)[1:][inside].mean())
    assert few.coordination_number == pytest.approx(np.mean(means), rel=1e-12)


def test_the_numbers_on_one_screen(few: Packing) -> None:
    lines = repr(few).splitlines()
    assert lines[0].startswith("150 dimers of aspect ratio 1.5 in a box of ")
    assert f"packing fraction     {few.packing_fraction:.4f}" in repr(few)
    assert len(lines) <= 10
    assert max(map(len, lines)) <= 100


@pytest.mark.parametrize("arguments", [{"particles": 2}, {"particles": 20, "container": Box(0.2)}])
def test_a_bed_that_is_too_small_has_no_box(arguments: dict[str, Any]) -> None:
    packing = quiet(**arguments)
    assert packing.box is None
    assert packing.packing_fraction is None
    assert packing.coordination_number is None
    assert "no box: the bed is too small" in repr(packing)
    assert len(packing.contacts.ids) >= 2


def lines_of(path: Path) -> NDArray[np.float64]:
    return np.loadtxt(path, delimiter=",", skiprows=1)


def test_what_is_saved_is_the_packing(
    few: Packing, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every file as other programs read it."""
    table = lines_of(few.save(tmp_path / "p.csv"))
    names = "id,body,x [length],y [length],z [length],radius [length],contacts"
    assert (tmp_path / "p.csv").read_text().startswith(f"{names}\n")
    assert few.frame.contacts is not None
    ids, bodies = few.frame.ids, few.bodies
    expected = [ids, bodies, few.positions, few.radii, few.frame.contacts]
    assert np.array_equal(table, np.column_stack(expected))
    with np.load(few.save(tmp_path / "p.npz")) as arrays:
        assert np.array_equal(arrays["positions"], few.positions)
        assert np.array_equal(arrays["contact_ids"], few.contacts.ids)
        assert np.array_equal(arrays["forces"], few.forces)
    rows = few.save(tmp_path / "p.xyz").read_text().splitlines()
    assert int(rows[0]) == 300 == len(rows) - 2
    assert np.array_equal(np.loadtxt(rows, usecols=(1, 2, 3), skiprows=2), few.positions)
    page = few.save(tmp_path / "p.html").read_text()
    assert "150 dimers of aspect ratio 1.5" in page
    grid = meshio.read(few.save(tmp_path / "p.vtu"))
    assert np.array_equal(grid.point_data["radius"], few.radii)
    read = json.loads(few.save(tmp_path / "p.json").read_text())
    assert [one["center"] for one in read["spheres"]] == few.positions.tolist()
    atoms = MDAnalysis.Universe(str(few.save(tmp_path / "p.pqr")), to_guess=()).atoms
    # MDAnalysis keeps float32.
    assert atoms.radii == pytest.approx(few.radii, rel=1e-7)
    lines = few.save(tmp_path / "p.vtp").read_text()
    assert f'NumberOfLines="{len(few.forces)}"' in lines
    few.save(tmp_path / "p.stl", subdivisions=1)
    # A head of 84 bytes, and 50 for each of 80 triangles.
    assert (tmp_path / "p.stl").stat().st_size == 84 + 50 * 80 * 300
    few.save(tmp_path / "p.raw", voxel=0.1, box=few.box)
    solid = np.fromfile(tmp_path / "p.raw", dtype=np.uint8) > 0
    # An image of 25 x 30 x 25 voxels; what surfaces cut is wrong by chance: some per mille.
    assert solid.mean() == pytest.approx(few.packing_fraction, abs=0.02)
    few.save(tmp_path / "p.tif", voxel=0.2)
    few.save(tmp_path / "run")
    assert main(["look", str(tmp_path / "run"), "--no-picture", "--box", *["1", "4"] * 3]) == 0
    assert capsys.readouterr().out.startswith("particles            150 ")
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "p.docx",
            "p.docx: the name must end in .csv, .npz, .json, .pqr, .xyz, .extxyz, ",
        ),
        (".", "is there already, and is not replaced"),
        ("file.txt/run", "file.txt"),
        ("file.txt/p.csv", "file.txt"),
        ("file.txt/p.xyz", "file.txt"),
    ],
)
def test_what_cannot_be_saved_is_told_in_one_line(
    name: str, message: str, few: Packing, tmp_path: Path
) -> None:
    (tmp_path / "file.txt").write_text("mine")
    with pytest.raises((WorkflowError, AnalysisError)) as caught:
        few.save(tmp_path / name)
    (line,) = str(caught.value).splitlines()
    assert message in line
    assert [path.name for path in tmp_path.iterdir()] == ["file.txt"]
    assert (tmp_path / "file.txt").read_text() == "mine"


def test_the_files_go_with_the_packing(tmp_path: Path) -> None:
    """Those in a folder with a name stay."""
    packing = quiet(5)
    folder = packing.folder
    assert folder.is_dir()
    del packing
    gc.collect()
    assert not folder.exists()
    kept = quiet(5, folder=tmp_path / "new" / "kept")
    assert kept.folder == tmp_path / "new" / "kept"
    del kept
    gc.collect()
    assert {*FILES, "packing.restart", "pack.in"} <= {
        path.name for path in (tmp_path / "new" / "kept").iterdir()
    }
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["kept"]


@pytest.mark.slow
def test_on_two_ranks() -> None:
    """Another packing of the same kind: nothing overlaps, and all weight is on the walls."""
    if len(os.sched_getaffinity(0)) < 2:
        with pytest.raises(PackingError, match="ranks must be from 1 to 1"):
            quiet(100, ranks=2)
        return
    packing = quiet(100, sizes=1.0, ranks=2)
    assert np.array_equal(packing.frame.ids, np.arange(1, 101))
    assert largest_overlap(packing) <= 1e-5 * 0.5 * (1 + 1e-6)


def test_what_lammps_says_is_the_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one line, and nothing is left."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    text = deck("pack").replace('print           "Phase: agitate"', "nonsense 5")
    monkeypatch.setattr("lammps_inelastic.workflow.packing.running.deck_text", lambda name: text)
    with pytest.raises(PackingError) as caught:
        quiet(10, folder=tmp_path / "out")
    said = "LAMMPS could not pack 10 spheres in a box of "
    assert str(caught.value).startswith(said)
    assert str(caught.value).endswith(": Unknown command: nonsense 5")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("size", "message"),
    [
        # Room for the deck, and for the start of spheres of several sizes; for neither.
        ("70k", "LAMMPS could not pack 100 spheres in a box of "),
        ("12k", "cannot be written: No space left on device"),
    ],
)
def test_a_full_disk_is_told_in_one_line(
    size: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And nothing is left on it."""
    with mounted(tmp_path / "disk", size) as disk:
        monkeypatch.setattr("tempfile.tempdir", str(disk))
        with pytest.raises(WorkflowError) as caught:
            quiet(100, sizes=[(1.0, 0.5), (1.5, 0.5)])
        (line,) = str(caught.value).splitlines()
        assert message in line
        assert "No space left on device" in line
        assert list(disk.iterdir()) == []


def test_without_lammps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    with pytest.raises(PackingError, match="there is no program lmp beside "):
        quiet(10)
    assert list(tmp_path.iterdir()) == []


def test_progress_in_a_log(capfd: pytest.CaptureFixture[str]) -> None:
    """A line for each phase, on the standard error."""
    pack(20)
    out, err = capfd.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert all(line.startswith("20 spheres: ") for line in lines)
    # A phase of a few milliseconds may pass between two looks; the last one is always told.
    assert 1 <= len(lines) <= 5
    assert ": measure, step 3" in lines[-1]
    assert lines[-1].endswith(" of 332")


LONG = """
import sys
from lammps_inelastic.workflow import pack
pack(3000, folder=sys.argv[1])
"""


def processes_of(folder: Path) -> list[int]:
    """Return the processes that work in a folder or below."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            where = os.readlink(entry / "cwd") if entry.name.isdigit() else ""
        except OSError:
            continue
        if where.startswith(f"{folder}/"):
            found.append(int(entry.name))
    return found


@pytest.mark.parametrize(
    "sent", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_an_interrupt_stops_it(sent: signal.Signals, tmp_path: Path) -> None:
    """KeyboardInterrupt in the user's Python; no LAMMPS is left, and no file."""
    process = subprocess.Popen(
        [sys.executable, "-c", LONG, str(tmp_path / "out")],
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not processes_of(tmp_path) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert processes_of(tmp_path)
    # LAMMPS is started by a program that takes some time itself.
    time.sleep(0.5)
    process.send_signal(sent)
    said = process.communicate(timeout=60)[1]
    last = said.splitlines()[-1]
    assert last.startswith("KeyboardInterrupt: LAMMPS is stopped, and nothing is left of 3000 sph")
    assert processes_of(tmp_path) == []
    assert list(tmp_path.iterdir()) == []
