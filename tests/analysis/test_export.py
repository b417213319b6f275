"""Files for other programs, read back by code that did not write them."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import MDAnalysis
import meshio
import numpy as np
import pandas
import pytest
import trimesh
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import ConvexHull
from scipy.spatial.distance import cdist

from lammps_inelastic.analysis import (
    Cell,
    ExportError,
    InputError,
    Spheres,
    VoxelImage,
    group_spheres,
    packing_fraction,
    voxel_shape,
    voxel_slices,
    write_csv,
    write_json,
    write_pqr,
    write_raw,
    write_stl,
    write_tiff,
    write_vtk,
    write_xyz,
)
from lammps_inelastic.analysis.geometry import FloatArray
from tests.helpers.touching_spheres import CELLS, PERIODIC, scene

UNIT = [[0, 1]] * 3
ONE = Spheres([[0.5] * 3], [0.5])
INTEGERS = {"ids": [3, 5, 2**40], "bodies": [7, 7, 0], "contacts": [1, 0, 12]}


@pytest.fixture
def spheres() -> Spheres:
    """Return 60 spheres that overlap and leave the unit cube."""
    generator = np.random.default_rng(3)
    return Spheres(generator.uniform(-0.1, 1.1, (60, 3)), generator.uniform(0.02, 0.25, 60))


def first(count: int, spheres: Spheres, cell: Cell | None = None) -> Spheres:
    return Spheres(spheres.positions[:count], spheres.radii[:count], cell=cell)


def parsed_xyz(path: Path) -> tuple[dict[str, str], dict[tuple[str, str], Any]]:
    """Return what is said of all spheres, and the columns by their names, all as text."""
    count, comment, *rows = path.read_text().splitlines()
    assert int(count) == len(rows)
    said = dict(word.split("=", 1) for word in shlex.split(comment))
    table = np.array([row.split() for row in rows])
    columns, start = {}, 0
    for name, kind, width in re.findall(r"(\w+):([SRI]):(\d+)", said["Properties"]):
        columns[name, kind] = table[:, start : start + int(width)]
        start += int(width)
    assert start == table.shape[1]
    return said, columns


def test_xyz_holds_all_digits(tmp_path: Path, spheres: Spheres) -> None:
    write_xyz(tmp_path / "packing.xyz", spheres)
    said, columns = parsed_xyz(tmp_path / "packing.xyz")
    assert list(said) == ["Properties"]
    # Equality, not closeness: 17 digits give a float64 back.
    assert columns["pos", "R"].astype(float).tolist() == spheres.positions.tolist()
    assert columns["radius", "R"].astype(float).ravel().tolist() == spheres.radii.tolist()
    assert list(columns) == [("species", "S"), ("pos", "R"), ("radius", "R")]


def test_xyz_with_all_that_is_known(tmp_path: Path, spheres: Spheres) -> None:
    path = tmp_path / "packing.extxyz"
    cell = Cell.of_box([[-0.5, 1], [0, 5], [0.25, 1]], (True, False, True))
    write_xyz(path, first(3, spheres, cell), **INTEGERS, step=90)
    said, columns = parsed_xyz(path)
    for name, values in zip(("id", "body", "contacts"), INTEGERS.values(), strict=True):
        assert columns[name, "I"].astype(int).ravel().tolist() == values
    lattice = np.array(said["Lattice"].split(), dtype=float).reshape(3, 3)
    assert lattice.tolist() == np.diag([1.5, 5, 0.75]).tolist()
    assert [float(word) for word in said["Origin"].split()] == [-0.5, 0, 0.25]
    assert (said["pbc"], said["step"]) == ("T F T", "90")


def test_xyz_is_read_by_mdanalysis(tmp_path: Path, spheres: Spheres) -> None:
    path = tmp_path / "packing.xyz"
    write_xyz(path, spheres, contacts=np.arange(60), step=1)
    universe = MDAnalysis.Universe(str(path), to_guess=())
    # MDAnalysis keeps positions as float32, of seven digits and more.
    assert universe.atoms.positions == pytest.approx(spheres.positions, rel=1e-7)
    assert set(universe.atoms.names) == {"X"}


def test_vtk(tmp_path: Path, spheres: Spheres) -> None:
    three = first(3, spheres)
    write_vtk(tmp_path / "packing.vtu", three, **INTEGERS)
    mesh = meshio.read(tmp_path / "packing.vtu")
    # Binary: the same numbers.
    assert mesh.points.tolist() == three.positions.tolist()
    assert mesh.cells_dict["vertex"].tolist() == [[0], [1], [2]]
    found = {name: values.tolist() for name, values in mesh.point_data.items()}
    assert found == {
        "radius": three.radii.tolist(),
        "diameter": (2 * three.radii).tolist(),
        "id": INTEGERS["ids"],
        "body": INTEGERS["bodies"],
        "contacts": INTEGERS["contacts"],
    }


def test_vtk_without_what_is_not_known(tmp_path: Path, spheres: Spheres) -> None:
    write_vtk(tmp_path / "packing.vtu", spheres)
    assert list(meshio.read(tmp_path / "packing.vtu").point_data) == ["radius", "diameter"]


def test_table_is_read_by_pandas(tmp_path: Path, spheres: Spheres) -> None:
    three = first(3, spheres)
    write_csv(tmp_path / "packing.csv", three, **INTEGERS)
    table = pandas.read_csv(tmp_path / "packing.csv")
    assert list(table) == [
        "id",
        "body",
        *(f"{axis} [length]" for axis in "xyz"),
        "radius [length]",
        "contacts",
    ]
    assert table["id"].tolist() == INTEGERS["ids"]
    assert table[[f"{axis} [length]" for axis in "xyz"]].to_numpy().tolist() == (
        three.positions.tolist()
    )
    assert table["radius [length]"].tolist() == three.radii.tolist()


def test_json_is_a_list_of_spheres_and_a_cell(tmp_path: Path, spheres: Spheres) -> None:
    cell = Cell([0.5, 0, -1], [[2, 0, 0], [0.5, 2, 0], [0, -0.25, 3]], (True, False, True))
    three = first(3, spheres, cell)
    write_json(tmp_path / "packing.json", three, **INTEGERS, step=90)
    read = json.loads((tmp_path / "packing.json").read_text())
    assert read["step"] == 90
    assert read["cell"]["origin"] == [0.5, 0, -1]
    assert read["cell"]["vectors"] == cell.vectors.tolist()
    assert read["cell"]["periodic"] == [True, False, True]
    assert [one["center"] for one in read["spheres"]] == three.positions.tolist()
    assert [one["radius"] for one in read["spheres"]] == three.radii.tolist()
    assert [one["body"] for one in read["spheres"]] == INTEGERS["bodies"]
    write_json(tmp_path / "packing.json", spheres)
    read = json.loads((tmp_path / "packing.json").read_text())
    assert (read["cell"], len(read["spheres"])) == (None, 60)
    assert list(read["spheres"][0]) == ["center", "radius"]


def test_mdanalysis_has_the_radii_of_pqr(tmp_path: Path, spheres: Spheres) -> None:
    bodies = [0, 4, 4]
    three = Spheres(spheres.positions[:3], spheres.radii[:3], group_spheres(bodies))
    write_pqr(tmp_path / "packing.pqr", three, ids=[3, 5, 2])
    atoms = MDAnalysis.Universe(str(tmp_path / "packing.pqr"), to_guess=()).atoms
    # MDAnalysis keeps positions and radii as float32.
    assert atoms.radii == pytest.approx(three.radii, rel=1e-7)
    assert atoms.positions == pytest.approx(three.positions, rel=1e-7)
    assert atoms.resids.tolist() == [1, 2, 2]
    assert atoms.ids.tolist() == [3, 5, 2]
    write_pqr(tmp_path / "packing.pqr", spheres)
    assert MDAnalysis.Universe(str(tmp_path / "packing.pqr"), to_guess=()).atoms.ids[-1] == 60


@pytest.mark.parametrize("name", CELLS)
def test_xyz_keeps_cell_and_periods(tmp_path: Path, name: str) -> None:
    one = scene(name)
    write_xyz(tmp_path / "packing.xyz", one.spheres, ids=one.ids)
    said, columns = parsed_xyz(tmp_path / "packing.xyz")
    cell = CELLS[name]
    assert [float(word) for word in said["Lattice"].split()] == cell.vectors.ravel().tolist()
    assert [float(word) for word in said["Origin"].split()] == cell.origin.tolist()
    assert said["pbc"] == " ".join("T" if flag else "F" for flag in cell.periodic)
    assert columns["pos", "R"].astype(float).tolist() == one.spheres.positions.tolist()


def stack(path: Path) -> NDArray[np.uint8]:
    """Return the images of a TIFF file as Pillow reads them, (slices, rows, columns)."""
    with Image.open(path) as image:
        pages = []
        for page in range(image.n_frames):
            image.seek(page)
            pages.append(np.asarray(image))
    return np.array(pages)


BOX = np.array([[0, 1], [0.1, 0.85], [-0.2, 0.4]])


def by_looking_at_every_sphere(
    spheres: Spheres, voxel: float, shape: tuple[int, ...], box: FloatArray = BOX
) -> NDArray[np.int64]:
    """Return the voxel image of a box from its definition."""
    z, y, x = (
        lower + (np.arange(count) + 0.5) * voxel
        for lower, count in zip(box[::-1, 0], shape, strict=True)
    )
    centres = np.stack(np.meshgrid(z, y, x, indexing="ij"), axis=-1)[..., ::-1]
    squared = ((centres[..., None, :] - spheres.positions) ** 2).sum(axis=-1)
    return np.where((squared < spheres.radii**2).any(axis=-1), 255, 0)


def test_voxels_by_looking_at_every_sphere(spheres: Spheres) -> None:
    # No centre of a voxel is so close to one of these surfaces that round-off could decide.
    found = np.array(list(voxel_slices(spheres, BOX, 0.025)))
    assert found.dtype == np.uint8
    assert found.shape == (24, 30, 40)
    assert (found == by_looking_at_every_sphere(spheres, 0.025, found.shape)).all()
    assert 0.2 < found.mean() / 255 < 0.8


def every_image(spheres: Spheres) -> Spheres:
    """Return spheres of a periodic cell with all images up to four periods away, in the open."""
    cell = spheres.cell
    moves = np.array([*np.ndindex(9, 9, 9)]) - 4
    moves = moves[(moves[:, ~np.array(cell.periodic)] == 0).all(axis=1)]
    places = (spheres.positions + (moves @ cell.vectors)[:, None]).reshape(-1, 3)
    return Spheres(places, np.tile(spheres.radii, len(moves)))


SOLID_CELLS = [name for name in PERIODIC if not CELLS[name].flat]


@pytest.mark.parametrize("name", SOLID_CELLS)
def test_voxels_of_a_periodic_cell_by_looking_at_every_image(name: str) -> None:
    spheres = scene(name).spheres
    box = spheres.cell.bounds
    found = np.array(list(voxel_slices(spheres, box, 0.05)))
    near = every_image(spheres)
    reach = ((near.positions > box[:, 0] - 0.3) & (near.positions < box[:, 1] + 0.3)).all(axis=1)
    around = Spheres(near.positions[reach], near.radii[reach])
    expected = by_looking_at_every_sphere(around, 0.05, found.shape, box)
    assert (found == expected).all()
    assert 0.1 < found.mean() / 255 < 0.99


def test_voxels_repeat_after_a_period() -> None:
    """In a box of two periods, somewhere else than the cell."""
    spheres = scene("periodic").spheres
    found = np.array(list(voxel_slices(spheres, [[7, 9], [0, 1], [-3, -1]], 0.125)))
    assert found.shape == (16, 8, 16)
    assert (found[:8] == found[8:]).all()
    assert (found[:, :, :8] == found[:, :, 8:]).all()


def test_what_is_on_the_surface_is_pore() -> None:
    # The sphere ends at the centres of its neighbours: exact in binary.
    found = np.array(list(voxel_slices(Spheres([[0.625] * 3], [0.25]), UNIT, 0.25)))
    assert np.argwhere(found).tolist() == [[2, 2, 2]]


def test_spheres_smaller_than_a_voxel_may_be_missed() -> None:
    corner_of_eight = np.array(list(voxel_slices(Spheres([[0.5] * 3], [0.1]), UNIT, 0.25)))
    assert not corner_of_eight.any()


def test_solid_share_is_the_packing_fraction(tmp_path: Path, spheres: Spheres) -> None:
    cells = 120
    image = write_tiff(tmp_path / "packing.tif", spheres, UNIT, 1 / cells)
    measured = packing_fraction(spheres, UNIT)
    solid = stack(tmp_path / "packing.tif") == 255
    assert image == VoxelImage((cells,) * 3, 1 / cells, np.count_nonzero(solid))
    # The voxels at the surface are right or wrong by chance, half a voxel each; to both this and
    # the random points four standard deviations.
    at_surface = sum(np.count_nonzero(np.diff(solid, axis=axis)) for axis in range(3))
    scatter = 0.5 * np.sqrt(at_surface) / cells**3
    error = np.hypot(scatter, measured.uncertainty)
    assert abs(image.solid_share - measured.value) < 4 * error
    # That is, a packing fraction to three digits.
    assert error < 1e-3


def test_tiff_holds_the_scale_and_the_place(tmp_path: Path, spheres: Spheres) -> None:
    path = tmp_path / "packing.tiff"
    assert write_tiff(path, spheres, BOX, 0.025).shape == (24, 30, 40)
    assert (stack(path) == np.array(list(voxel_slices(spheres, BOX, 0.025)))).all()
    with Image.open(path) as image:
        tags = dict(image.tag_v2)
    # Voxels per length, without a unit.
    assert (tags[282], tags[283], tags[296]) == (40, 40, 1)
    said = dict(line.split("=") for line in tags[270].splitlines())
    assert (said["slices"], said["spacing"]) == ("24", "0.025")
    origin = [float(said[name]) for name in ("xorigin", "yorigin", "zorigin")]
    # Quotients of numbers that are no binary fractions.
    assert origin == pytest.approx([0, -4, 8], abs=1e-14)


def test_raw_and_its_header(tmp_path: Path, spheres: Spheres) -> None:
    image = write_raw(tmp_path / "packing.raw", spheres, BOX, 0.025)
    lines = (tmp_path / "packing.mhd").read_text().splitlines()
    header = dict(line.split(" = ") for line in lines)
    assert list(header)[-1] == "ElementDataFile"
    assert header["ElementType"] == "MET_UCHAR"
    columns, rows, slices = (int(word) for word in header["DimSize"].split())
    assert image.shape == (slices, rows, columns)
    assert [float(word) for word in header["ElementSpacing"].split()] == [0.025] * 3
    # The centre of the first voxel; sums of numbers that are no binary fractions.
    offset = [float(word) for word in header["Offset"].split()]
    assert offset == pytest.approx([0.0125, 0.1125, -0.1875], abs=1e-15)
    found = np.fromfile(tmp_path / header["ElementDataFile"], dtype=np.uint8)
    assert image.solid == np.count_nonzero(found)
    expected = np.array(list(voxel_slices(spheres, BOX, 0.025)))
    assert (found.reshape(slices, rows, columns) == expected).all()


@pytest.mark.parametrize("write", [write_tiff, write_raw])
def test_progress(tmp_path: Path, spheres: Spheres, write: Callable[..., Any]) -> None:
    seen = []
    name = {write_tiff: "packing.tif", write_raw: "packing.raw"}[write]
    write(tmp_path / name, spheres, UNIT, 0.25, progress=lambda *done: seen.append(done))
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]


@pytest.mark.parametrize(
    ("box", "voxel", "shape"),
    [
        (UNIT, 0.1, (10, 10, 10)),
        ([[0, 1], [0, 2], [0, 3]], 0.5, (6, 4, 2)),
        # The centre of an eleventh voxel would lie at 1.05 widths, or at 0.98.
        (UNIT, 1 / 10.4, (10, 10, 10)),
        (UNIT, 1 / 10.6, (11, 11, 11)),
    ],
)
def test_as_many_voxels_as_have_their_centres_in_the_box(
    box: Any, voxel: float, shape: tuple[int, ...]
) -> None:
    assert voxel_shape(box, voxel) == shape


@pytest.mark.parametrize(
    ("box", "voxel", "message"),
    [
        (UNIT, 0, "the size of a voxel must be positive, not 0"),
        (UNIT, np.nan, "the size of a voxel must be positive, not nan"),
        (UNIT, 2.1, "a voxel of 2.1 is too large for a box 1 x 1 x 1 wide"),
        (UNIT, 6e-4, r"image of 1667 x 1667 x 1667, more than 4e\+09 voxels"),
        (UNIT, 1e-320, r"more than 4e\+09 voxels"),
        ([[0, 1], [0, 1], [0, 0.001]], 9e-5, r"11111 x 11111 x 11, more than 1e\+08 .* a slice"),
        ([[0, 1], [0, 0], [0, 1]], 0.1, "ylo = 0 must be less than yhi = 0"),
    ],
)
def test_wrong_voxels(box: Any, voxel: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        voxel_slices(ONE, box, voxel)


# The icosahedron's share of its sphere, in closed form, and those that the documentation names.
EDGE = 4 / np.sqrt(10 + 2 * np.sqrt(5))
ICOSAHEDRON = 5 / 12 * (3 + np.sqrt(5)) * EDGE**3 / (4 / 3 * np.pi)


@pytest.mark.parametrize(
    ("subdivisions", "share"), [(0, ICOSAHEDRON), (1, None), (2, 0.966), (3, 0.991)]
)
def test_stl(tmp_path: Path, subdivisions: int, share: float) -> None:
    positions, radii = [[0.5, 0.25, 3], [0.6, 0.25, 3], [-1, 0, 0]], [0.1, 0.3, 0.2]
    path = tmp_path / "packing.stl"
    faces = write_stl(path, Spheres(positions, radii), subdivisions=subdivisions)
    assert faces == 3 * 20 * 4**subdivisions
    # A header of 80 bytes, the number of faces, and 50 bytes for each.
    assert path.stat().st_size == 84 + 50 * faces
    mesh = trimesh.load_mesh(path)
    meshes = sorted(mesh.split(), key=lambda one: one.volume)
    for one, sphere in zip(meshes, np.argsort(radii), strict=True):
        assert one.is_watertight
        assert len(one.faces) == 20 * 4**subdivisions
        # Numbers of STL are float32: those near 3 are known to 2e-7.
        assert one.center_mass == pytest.approx(positions[sphere], abs=1e-6)
        distances = np.linalg.norm(one.vertices - positions[sphere], axis=1)
        assert distances == pytest.approx(radii[sphere], abs=1e-6)
        exact = 4 / 3 * np.pi * radii[sphere] ** 3
        # Positive: the faces look outwards. Corners are known to 2e-7, and the smallest radius
        # is 0.1.
        assert one.volume == pytest.approx(ConvexHull(one.vertices).volume, rel=1e-5)
        if share is not None:
            # Three digits.
            assert one.volume / exact == pytest.approx(share, abs=5e-4)
    # The normals that were written, against those of the corners in their order.
    outwards = np.cross(
        mesh.triangles[:, 1] - mesh.triangles[:, 0], mesh.triangles[:, 2] - mesh.triangles[:, 0]
    )
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    raw = np.frombuffer(path.read_bytes()[84:], dtype=np.uint8).reshape(-1, 50)
    written = np.ascontiguousarray(raw[:, :12]).view("<f4")
    # Edges of the smallest faces are 0.01 long, with corners known to 2e-7.
    assert written == pytest.approx(outwards, abs=1e-4)


@pytest.mark.parametrize("name", SOLID_CELLS)
def test_stl_of_a_periodic_cell_has_the_images_that_reach_into_it(
    tmp_path: Path, name: str
) -> None:
    spheres = scene(name, 4).spheres
    faces = write_stl(tmp_path / "packing.stl", spheres, subdivisions=1)
    mesh = trimesh.load_mesh(tmp_path / "packing.stl", process=False)
    assert len(mesh.faces) == faces
    # The corners of a sphere are mirrored at its centre.
    centres = mesh.triangles.reshape(faces // 80, 240, 3).mean(axis=1)
    assert centres[:4] == pytest.approx(spheres.positions, abs=1e-6)
    # Each image is there once.
    assert len(np.unique(np.round(centres, 5), axis=0)) == len(centres)
    # Points of the cell are in a sphere or in an image: that is in one that is drawn.
    cell = spheres.cell
    points = cell.origin + np.random.default_rng(2).uniform(0, 1, (3000, 3)) @ cell.vectors
    images = every_image(spheres)
    covered = cdist(points, images.positions) < images.radii
    drawn = cdist(images.positions, centres).min(axis=1) < 1e-5
    assert covered.any(axis=1).any()
    assert not covered[:, ~drawn].any()
    # None of the images is drawn in vain but those that pass an edge of the cell by.
    assert len(centres) <= 4 * 8


@pytest.mark.slow
def test_stl_of_many_spheres_is_written_in_parts(tmp_path: Path) -> None:
    # 20 faces each: 10,000 spheres are written at once.
    centres = np.random.default_rng(6).uniform(0, 1, (20_001, 3))
    faces = write_stl(
        tmp_path / "packing.stl", Spheres(centres, np.full(20_001, 0.01)), subdivisions=0
    )
    mesh = trimesh.load_mesh(tmp_path / "packing.stl", process=False)
    assert len(mesh.faces) == faces
    found = mesh.triangles.reshape(20_001, 60, 3).mean(axis=1)
    # Corners are float32 numbers below 1.01: each is known to 6e-8.
    assert found == pytest.approx(centres, abs=1e-7)


@pytest.mark.parametrize(
    ("subdivisions", "message"),
    [
        (-1, "subdivisions must be at least 0, not -1"),
        (12, r"1 spheres of 20 x 4\^12 .* more than 1e\+08"),
    ],
)
def test_wrong_subdivisions(tmp_path: Path, subdivisions: int, message: str) -> None:
    with pytest.raises(InputError, match=message):
        write_stl(tmp_path / "packing.stl", ONE, subdivisions=subdivisions)


WRITERS = {
    "packing.xyz": lambda path: write_xyz(path, ONE),
    "packing.vtu": lambda path: write_vtk(path, ONE),
    "packing.csv": lambda path: write_csv(path, ONE),
    "packing.json": lambda path: write_json(path, ONE),
    "packing.pqr": lambda path: write_pqr(path, ONE),
    "packing.tif": lambda path: write_tiff(path, ONE, UNIT, 0.5),
    "packing.raw": lambda path: write_raw(path, ONE, UNIT, 0.5),
    "packing.stl": lambda path: write_stl(path, ONE),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_is_replaced_and_nothing_is_left(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("old")
    WRITERS[name](tmp_path / name)
    assert (tmp_path / name).read_bytes() != b"old"
    beside = {"packing.mhd"} if name == "packing.raw" else set()
    assert {file.name for file in tmp_path.iterdir()} == {name} | beside


@pytest.mark.parametrize("name", WRITERS)
def test_no_such_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(ExportError, match="cannot be written: No such file or directory"):
        WRITERS[name](tmp_path / "no" / name)


@pytest.mark.parametrize("name", WRITERS)
def test_name_of_another_format(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"packing\.dat: the name must end in \."):
        WRITERS[name](tmp_path / "packing.dat")


@pytest.mark.parametrize("name", ["packing.tif", "packing.raw", "packing.stl"])
def test_no_solid_of_discs(tmp_path: Path, name: str) -> None:
    discs = scene("flat").spheres
    write = {
        "packing.tif": lambda path: write_tiff(path, discs, UNIT, 0.5),
        "packing.raw": lambda path: write_raw(path, discs, UNIT, 0.5),
        "packing.stl": lambda path: write_stl(path, discs),
    }[name]
    with pytest.raises(InputError, match=r"a two-dimensional packing has no .* no volume"):
        write(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["packing.tif", "packing.raw"])
def test_the_old_file_stays_until_the_new_one_is_whole(tmp_path: Path, name: str) -> None:
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    (tmp_path / name).write_text("old")
    write = write_tiff if name == "packing.tif" else write_raw
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / name, ONE, UNIT, 0.5, progress=stop)
    assert (tmp_path / name).read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_a_column_of_another_length(tmp_path: Path) -> None:
    message = r"body must have shape \(1,\), not \(2,\)"
    with pytest.raises(InputError, match=message):
        write_xyz(tmp_path / "packing.xyz", ONE, bodies=[1, 2])
    with pytest.raises(InputError, match=message):
        write_vtk(tmp_path / "packing.vtu", ONE, bodies=[1, 2])
