"""Contacts with forces as files: parsed here, against all images looked at one by one."""

from __future__ import annotations

import base64
import dataclasses
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas
import pytest
from numpy.typing import NDArray

from lammps_inelastic.analysis import (
    Cell,
    ContactFrame,
    ExportError,
    InputError,
    Spheres,
    group_spheres,
    write_bonds,
    write_contacts_csv,
    write_contacts_vtk,
)
from tests.helpers.touching_spheres import CELLS, PERIODIC, Scene, lengths, scene, turned

# Sums and differences of numbers below 10.
ROUND_OFF = 1e-13


def parsed_lines(path: Path) -> tuple[NDArray[np.float64], dict[str, NDArray[Any]], Any]:
    """Return the lines of polygonal data, (m, 2, 3), and the data of cells and of points."""
    root = ElementTree.parse(path).getroot()
    assert root.attrib["type"] == "PolyData"
    assert root.attrib["header_type"] == "UInt64"
    piece = root[0][0]
    arrays: dict[str, dict[str, NDArray[Any]]] = {}
    for part in piece:
        for array in part:
            raw = base64.b64decode(array.text)
            assert int.from_bytes(raw[:8], "little") == len(raw) - 8
            values = np.frombuffer(
                raw[8:], {"Float64": "<f8", "Int64": "<i8"}[array.attrib["type"]]
            )
            components = int(array.attrib["NumberOfComponents"])
            shaped = values.reshape(-1, components) if components > 1 else values
            arrays.setdefault(part.tag, {})[array.attrib["Name"]] = shaped
    lines = arrays["Lines"]
    assert len(lines["offsets"]) == int(piece.attrib["NumberOfLines"])
    points = arrays["Points"]["Points"]
    assert len(points) == int(piece.attrib["NumberOfPoints"])
    ends = [points[line] for line in np.split(lines["connectivity"], lines["offsets"][:-1])]
    return np.array(ends).reshape(-1, 2, 3), arrays["CellData"], arrays["PointData"]


def write_lines(path: Path, one: Scene, **options: Any) -> tuple[NDArray[np.float64], Any, Any]:
    written = write_contacts_vtk(path, one.contacts, one.ids, one.spheres, **options)
    ends, cells, points = parsed_lines(path)
    assert len(ends) == written
    return ends, cells, points


@pytest.mark.parametrize("name", CELLS)
def test_every_contact_is_a_line_once_that_counts(tmp_path: Path, name: str) -> None:
    one = scene(name)
    ends, cells, points = write_lines(tmp_path / "contacts.vtp", one)
    own = cells["copy"] == 0
    assert cells["force"][own].tolist() == one.contacts.forces.tolist()
    assert cells["gap"][own].tolist() == one.contacts.gaps.tolist()
    assert cells["normal"][own].tolist() == one.contacts.normals.tolist()
    sides = np.column_stack([cells["id1"], cells["id2"]])
    assert sides[own].tolist() == one.contacts.ids.tolist()
    assert cells["wall"].tolist() == (sides[:, 1] < 0).astype(int).tolist()
    assert points["force"].tolist() == np.repeat(cells["force"], 2).tolist()

    # From the first sphere in its place to the image of the second, or to a wall.
    index = {int(number): place for place, number in enumerate(one.ids)}
    starts = one.spheres.positions[[index[number] for number in sides[own][:, 0].tolist()]]
    assert ends[own][:, 0] == pytest.approx(starts, abs=ROUND_OFF)
    along = turned(ends[:, 0] - ends[:, 1], sides, cells["normal"])
    far = np.linalg.norm(along, axis=1)
    contact = np.cumsum(own) - 1
    assert far == pytest.approx(lengths(one, contact), abs=ROUND_OFF)
    assert along == pytest.approx(far[:, None] * cells["normal"], abs=ROUND_OFF)

    # A contact across a periodic face is drawn from both sides, and no other one.
    across = one.images.any(axis=1)
    assert np.bincount(contact).tolist() == (1 + across).tolist()
    assert across.any() == (name != "open")
    copies = contact[~own]
    ends_at = one.spheres.positions[[index[number] for number in sides[~own][:, 1].tolist()]]
    assert ends[~own][:, 1] == pytest.approx(ends_at, abs=ROUND_OFF)
    assert copies.tolist() == np.flatnonzero(across).tolist()


@pytest.mark.parametrize("name", CELLS)
def test_bonds_lead_to_the_images(tmp_path: Path, name: str) -> None:
    one = scene(name)
    path = tmp_path / "packing.bonds"
    bonds = write_bonds(path, one.contacts, one.ids, one.spheres)
    head, rows = path.read_text().split("\n")[:5], path.read_text().split("\n")[5:-1]
    assert head[:4] == ["ITEM: TIMESTEP", "90", "ITEM: NUMBER OF BONDS", f"{bonds}"]
    assert head[4].split()[2:7] == [
        "batom1",
        "batom2",
        *(f"PeriodicImage.{axis}" for axis in "XYZ"),
    ]
    table = np.array([row.split() for row in rows], dtype=float)
    # Those with walls are left out.
    assert table[:, :2].tolist() == one.contacts.ids[:-2].tolist()
    images = turned(table[:, 2:5], table[:, :2], one.images[:-2])
    assert images.tolist() == one.images[:-2].tolist()
    assert table[:, 7].tolist() == one.contacts.forces[:-2].tolist()
    assert table[:, 8].tolist() == one.contacts.gaps[:-2].tolist()
    index = {int(number): place for place, number in enumerate(one.ids)}
    first, second = (
        one.spheres.positions[[index[int(number)] for number in table[:, side]]] for side in (0, 1)
    )
    along = second + table[:, 2:5] @ one.spheres.cell.vectors - first
    assert np.linalg.norm(along, axis=1) == pytest.approx(table[:, 5], abs=ROUND_OFF)
    assert table[:, 5] == pytest.approx(lengths(one, np.arange(bonds)), abs=ROUND_OFF)


def test_bonds_between_bodies_that_a_face_cuts(tmp_path: Path) -> None:
    """In a dump their spheres stand at both faces; in the files each body is in one piece."""
    cell = Cell.of_box([[0, 1], [0, 1], [0, 1]], (True, False, False))
    # Body 1 reaches through the face, and its second sphere touches sphere 3 beyond it.
    positions = [[0.95, 0.5, 0.5], [0.05, 0.5, 0.5], [0.25, 0.5, 0.5]]
    spheres = Spheres(positions, [0.1] * 3, group_spheres([1, 1, 0]), cell)
    contacts = ContactFrame(
        0,
        np.array([[2, 3]]),
        np.array([[0.15, 0.5, 0.5]]),
        np.array([[-1.0, 0, 0]]),
        np.zeros(1),
        np.ones(1),
    )
    write_bonds(tmp_path / "packing.bonds", contacts, [1, 2, 3], spheres)
    image = int((tmp_path / "packing.bonds").read_text().split("\n")[5].split()[2])
    apart = spheres.positions[2, 0] + image - spheres.positions[1, 0]
    assert apart == pytest.approx(0.2, abs=ROUND_OFF)
    assert abs(spheres.positions[1, 0] - spheres.positions[0, 0]) == pytest.approx(0.1)


@pytest.mark.parametrize("name", CELLS)
def test_table_is_read_by_pandas(tmp_path: Path, name: str) -> None:
    one = scene(name)
    path = tmp_path / "contacts.csv"
    assert write_contacts_csv(path, one.contacts, one.ids, one.spheres) == len(one.images)
    table = pandas.read_csv(path)
    assert table[["id1", "id2"]].to_numpy().tolist() == one.contacts.ids.tolist()
    places = table[[f"{axis} [length]" for axis in "xyz"]].to_numpy()
    assert places.tolist() == one.contacts.points.tolist()
    assert table[["nx", "ny", "nz"]].to_numpy().tolist() == one.contacts.normals.tolist()
    assert table["gap [length]"].tolist() == one.contacts.gaps.tolist()
    assert table["force [force]"].tolist() == one.contacts.forces.tolist()
    periods = table[["period_a", "period_b", "period_c"]].to_numpy()
    assert turned(periods, one.contacts.ids, one.images).tolist() == one.images.tolist()


@pytest.mark.parametrize("name", CELLS)
def test_a_box_by_looking_at_every_image(tmp_path: Path, name: str) -> None:
    """The box reaches out of the cell, and over more than a period."""
    one = scene(name)
    cell = one.spheres.cell
    box = cell.bounds @ [[0.7, -0.2], [0.3, 1.2]]
    moves = np.array([*np.ndindex(9, 9, 9)]) - 4
    moves = moves[(moves[:, ~np.array(cell.periodic)] == 0).all(axis=1)]
    places = one.contacts.points[:, None] + moves @ cell.vectors
    inside = (places >= box[:, 0]) & (places <= box[:, 1])
    if cell.flat:
        inside[..., 2] = True
    expected = inside.all(axis=2).sum(axis=1)
    assert (expected > 0).sum() > 0
    ends, cells, _ = write_lines(tmp_path / "contacts.vtp", one, box=box)
    own = cells["copy"] == 0
    order = np.flatnonzero(expected)
    assert cells["force"][own].tolist() == one.contacts.forces[order].tolist()
    assert np.bincount(np.cumsum(own) - 1).tolist() == expected[order].tolist()
    # No two lines are at the same place.
    assert len(np.unique(np.round(ends.reshape(-1, 6), 9), axis=0)) == len(ends)

    path = tmp_path / "contacts.csv"
    assert write_contacts_csv(path, one.contacts, one.ids, one.spheres, box=box) == len(order)
    assert pandas.read_csv(path)["force [force]"].tolist() == one.contacts.forces[order].tolist()


def test_tubes_are_as_thick_as_forces_are_strong(tmp_path: Path) -> None:
    """And widths of bonds: a tenth of the mean radius at the mean, within limits."""
    one = scene("open")
    count = len(one.contacts.forces)
    forces = np.ones(count)
    forces[:3] = [-2.0, 100.0, 1e-9]
    contacts = dataclasses.replace(one.contacts, forces=forces)
    write_contacts_vtk(tmp_path / "a.vtp", contacts, one.ids, one.spheres)
    mean = np.abs(forces).mean()
    shares = np.clip(np.abs(forces) / mean, 0.15, 4)
    assert shares[1] == 4
    expected = 0.1 * one.spheres.radii.mean() * shares
    assert parsed_lines(tmp_path / "a.vtp")[2]["tube"][::2] == pytest.approx(expected)
    write_bonds(tmp_path / "a.bonds", contacts, one.ids, one.spheres)
    rows = (tmp_path / "a.bonds").read_text().split("\n")[5:-1]
    # Six digits.
    widths = [float(row.split()[6]) for row in rows]
    assert widths == pytest.approx(2 * expected[:-2], rel=1e-5)


def test_what_contacts_store(tmp_path: Path) -> None:
    one = scene("periodic")
    stored = -np.arange(len(one.contacts.forces), dtype=float)
    contacts = dataclasses.replace(one.contacts, stored=stored)
    write_contacts_vtk(tmp_path / "a.vtp", contacts, one.ids, one.spheres)
    _, cells, _ = parsed_lines(tmp_path / "a.vtp")
    assert cells["stored"][cells["copy"] == 0].tolist() == stored.tolist()
    write_contacts_csv(tmp_path / "a.csv", contacts, one.ids, one.spheres)
    assert pandas.read_csv(tmp_path / "a.csv")["stored [impulse]"].tolist() == stored.tolist()


WRITERS = {
    "a.vtp": write_contacts_vtk,
    "a.csv": write_contacts_csv,
    "a.bonds": write_bonds,
}


@pytest.mark.parametrize("name", ["open", *PERIODIC])
def test_no_contacts(tmp_path: Path, name: str) -> None:
    one = scene(name)
    nothing = ContactFrame(
        0,
        np.zeros((0, 2), dtype=np.int64),
        np.zeros((0, 3)),
        np.zeros((0, 3)),
        np.zeros(0),
        np.zeros(0),
    )
    for file, write in WRITERS.items():
        assert write(tmp_path / file, nothing, one.ids, one.spheres) == 0
    assert parsed_lines(tmp_path / "a.vtp")[0].shape == (0, 2, 3)
    assert len(pandas.read_csv(tmp_path / "a.csv")) == 0


@pytest.mark.parametrize("file", WRITERS)
def test_wrong_files_and_ids(tmp_path: Path, file: str) -> None:
    one = scene("open")
    write = WRITERS[file]
    with pytest.raises(InputError, match=r"a\.dat: the name must end in \."):
        write(tmp_path / "a.dat", one.contacts, one.ids, one.spheres)
    with pytest.raises(ExportError, match="cannot be written: No such file or directory"):
        write(tmp_path / "no" / file, one.contacts, one.ids, one.spheres)
    with pytest.raises(InputError, match=r"a contact names sphere .*, which does not exist"):
        write(tmp_path / file, one.contacts, one.ids + 100, one.spheres)
    assert list(tmp_path.iterdir()) == []
