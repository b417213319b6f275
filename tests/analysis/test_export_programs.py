"""Exported files as the programs open them for which they are made, by their own Python packages.

The packages are the group `programs` of pyproject.toml, 1.1 GB: `make programs` installs them.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    write_bonds,
    write_contacts_vtk,
    write_raw,
    write_vtk,
    write_xyz,
)
from tests.helpers.programs import missing
from tests.helpers.touching_spheres import CELLS, Scene, lengths, scene, turned

pytestmark = pytest.mark.slow

# Sums and differences of numbers below 10.
ROUND_OFF = 1e-13
# How OVITO's manual names the columns of a file of bonds; it maps the first seven by itself.
COLUMNS = [
    "Particle Identifiers.1",
    "Particle Identifiers.2",
    "Periodic Image.X",
    "Periodic Image.Y",
    "Periodic Image.Z",
    "Length",
    "Width",
    "Force",
    "Gap",
]


def package(name: str) -> Any:
    """Import a package of the group; its tests are skipped, or fail in CI, where it is missing."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        missing(f"{name} is not installed: make programs does it")


@pytest.fixture(scope="module")
def ovito() -> Any:
    found = package("ovito")
    importlib.import_module("ovito.io")
    importlib.import_module("ovito.modifiers")
    return found


@pytest.fixture(scope="module")
def vtk() -> Any:
    return package("vtk")


def xyz(folder: Path, one: Scene) -> Path:
    path = folder / "packing.xyz"
    write_xyz(path, one.spheres, ids=one.ids, step=90)
    return path


@pytest.mark.parametrize("name", CELLS)
def test_ovito_has_spheres_and_bonds(tmp_path: Path, ovito: Any, name: str) -> None:
    one = scene(name)
    pipeline = ovito.io.import_file(str(xyz(tmp_path, one)))
    number = write_bonds(tmp_path / "packing.bonds", one.contacts, one.ids, one.spheres)
    modifier = ovito.modifiers.LoadTrajectoryModifier()
    modifier.source.load(str(tmp_path / "packing.bonds"), columns=COLUMNS)
    pipeline.modifiers.append(modifier)
    data = pipeline.compute()

    cell = CELLS[name]
    edges = data.cell[:, :3].T
    assert edges == pytest.approx(cell.vectors, abs=ROUND_OFF)
    assert data.cell[:, 3] == pytest.approx(cell.origin, abs=ROUND_OFF)
    assert tuple(data.cell.pbc) == cell.periodic
    particles = data.particles
    assert particles.count == len(one.ids)
    assert particles.identifiers[...].tolist() == one.ids.tolist()
    # OVITO reads numbers to their last digit but one, and keeps radii as float32.
    assert particles.positions[...] == pytest.approx(one.spheres.positions, abs=ROUND_OFF)
    assert particles["Radius"][...] == pytest.approx(one.spheres.radii, rel=1e-7)

    bonds = particles.bonds
    assert bonds.count == number == len(one.images) - 2
    sides = particles.identifiers[...][bonds.topology[...]]
    assert sides.tolist() == one.contacts.ids[:-2].tolist()
    images = turned(bonds.pbc_vectors[...], sides, one.images[:-2])
    assert images.tolist() == one.images[:-2].tolist()
    assert bonds["Force"][...] == pytest.approx(one.contacts.forces[:-2], rel=ROUND_OFF)
    assert bonds["Gap"][...] == pytest.approx(one.contacts.gaps[:-2], rel=ROUND_OFF)
    # As its manual computes the vector of a bond.
    first, second = bonds.topology[...].T
    places = particles.positions[...]
    along = places[second] - places[first] + bonds.pbc_vectors[...] @ edges
    far = np.linalg.norm(along, axis=1)
    assert far == pytest.approx(lengths(one, np.arange(number)), abs=ROUND_OFF)
    assert far == pytest.approx(bonds["Length"][...], abs=ROUND_OFF)


@pytest.mark.parametrize("name", CELLS)
def test_ovito_has_lines(tmp_path: Path, ovito: Any, name: str) -> None:
    one = scene(name)
    path = tmp_path / "contacts.vtp"
    number = write_contacts_vtk(path, one.contacts, one.ids, one.spheres)
    (lines,) = ovito.io.import_file(str(path)).compute().lines.values()
    # One row for each end.
    assert len(lines.positions) == 2 * number
    own = lines["copy"][::2] == 0
    assert lines["force"][::2][own].tolist() == one.contacts.forces.tolist()


@pytest.mark.parametrize("name", CELLS)
def test_vtk_makes_tubes(tmp_path: Path, vtk: Any, name: str) -> None:
    one = scene(name)
    path = tmp_path / "contacts.vtp"
    number = write_contacts_vtk(path, one.contacts, one.ids, one.spheres)
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    lines = reader.GetOutput()
    assert (lines.GetNumberOfLines(), lines.GetNumberOfCells()) == (number, number)
    data = lines.GetCellData()
    force, copy, id2 = (data.GetArray(array) for array in ("force", "copy", "id2"))
    own = [row for row in range(number) if copy.GetValue(row) == 0]
    assert [force.GetValue(row) for row in own] == one.contacts.forces.tolist()
    assert [id2.GetValue(row) for row in own] == one.contacts.ids[:, 1].tolist()
    expected = lengths(one, np.cumsum([copy.GetValue(row) == 0 for row in range(number)]) - 1)
    ends = np.array([lines.GetPoint(point) for point in range(2 * number)]).reshape(-1, 2, 3)
    far = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    assert far == pytest.approx(expected, abs=ROUND_OFF)

    tube = vtk.vtkTubeFilter()
    tube.SetInputConnection(reader.GetOutputPort())
    tube.SetInputArrayToProcess(0, 0, 0, vtk.vtkDataObject.FIELD_ASSOCIATION_POINTS, "tube")
    tube.SetVaryRadiusToVaryRadiusByAbsoluteScalar()
    tube.SetNumberOfSides(6)
    tube.Update()
    drawn = tube.GetOutput()
    assert drawn.GetNumberOfPoints() == 12 * number
    # The first tube is as thick as its array says: its corners are so far from the first centre.
    corners = np.array([drawn.GetPoint(corner) for corner in range(6)])
    radius = lines.GetPointData().GetArray("tube").GetValue(0)
    apart = np.linalg.norm(corners - ends[0, 0], axis=1)
    # Points of the filter's output are float32.
    assert apart == pytest.approx(np.full(6, radius), rel=1e-4)


def test_vtk_has_spheres_and_voxels(tmp_path: Path, vtk: Any) -> None:
    one = scene("tilted")
    write_vtk(tmp_path / "packing.vtu", one.spheres, ids=one.ids)
    points = vtk.vtkXMLUnstructuredGridReader()
    points.SetFileName(str(tmp_path / "packing.vtu"))
    points.Update()
    found = points.GetOutput()
    assert found.GetNumberOfCells() == len(one.ids)
    radii = found.GetPointData().GetArray("radius")
    assert [radii.GetValue(row) for row in range(len(one.ids))] == one.spheres.radii.tolist()

    box = one.spheres.cell.bounds
    image = write_raw(tmp_path / "packing.raw", one.spheres, box, 0.0625)
    voxels = vtk.vtkMetaImageReader()
    voxels.SetFileName(str(tmp_path / "packing.mhd"))
    voxels.Update()
    assert voxels.GetOutput().GetDimensions() == image.shape[::-1]
    assert voxels.GetOutput().GetSpacing() == pytest.approx([0.0625] * 3)
    # The place of the first voxel's centre.
    assert voxels.GetDataOrigin() == pytest.approx(box[:, 0] + 0.03125)


@pytest.mark.parametrize("name", CELLS)
def test_ase_has_radii_cell_and_periods(tmp_path: Path, name: str) -> None:
    package("ase")
    ase_io = importlib.import_module("ase.io")
    one = scene(name)
    atoms = ase_io.read(xyz(tmp_path, one))
    cell = CELLS[name]
    assert atoms.positions.tolist() == one.spheres.positions.tolist()
    assert atoms.arrays["radius"].tolist() == one.spheres.radii.tolist()
    assert atoms.arrays["id"].tolist() == one.ids.tolist()
    assert np.array(atoms.cell).tolist() == cell.vectors.tolist()
    assert tuple(atoms.pbc.tolist()) == cell.periodic
    # Its nearest images are those of the contacts, if the cell is not narrow.
    index = {int(number): place for place, number in enumerate(one.ids)}
    for row in range(len(one.images) - 2 if name != "narrow" else 0):
        first, second = (index[number] for number in one.contacts.ids[row].tolist())
        far = atoms.get_distance(first, second, mic=True)
        assert far <= lengths(one, np.array([row]))[0] + ROUND_OFF
