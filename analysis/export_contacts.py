"""Contacts with their forces as files for other programs: lines, bonds, a table.

Across a periodic face the second sphere of a contact is an image of itself: lines lead to where
that image is, and bonds and tables say by how many periods it is moved.
"""

from __future__ import annotations

import base64
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contact_lines import ContactLines, contact_lines
from .contacts import STORED, ContactFrame
from .export_files import named, whole_file, write_table
from .geometry import FloatArray, IntArray, as_box, inside_of
from .spheres import Spheres, takes_spheres

# A force of the mean strength is drawn so thick, in mean radii of the spheres; the largest at most
# four times as thick, the weakest so that they are still seen. `draw_network` shows the same range.
MEAN_RADIUS = 0.1
THICKEST, THINNEST = 4.0, 0.15


@takes_spheres
def write_contacts_vtk(
    path: str | PathLike[str],
    contacts: ContactFrame,
    sphere_ids: ArrayLike,
    spheres: Spheres,
    *,
    box: ArrayLike | None = None,
) -> int:
    """Write contacts as lines for ParaView, polygonal data of VTK's XML; return how many lines.

    A line leads from the centre of the first sphere to that of the second, or to the contact point
    on a wall. A contact across a periodic face is there twice, from each of its spheres to the
    image of the other, and so seen at both faces. Each line has the cell data

    - force, gap, normal and, for a law that stores, stored, as in a `ContactFrame`;
    - id1 and id2, the spheres on both sides; id2 is -k for wall k;
    - wall: 1 for a contact with a wall, else 0;
    - copy: 0 once for every contact, 1 for its further lines, which no sum may count.

    Each of its two points has the point data force and tube, the radius of a tube as thick as the
    force is strong: the filter Tube draws that with *Vary Radius* by absolute scalar.

    Parameters
    ----------
    path : of the file, .vtp
    contacts : the contacts at one step
    sphere_ids : (n,), ids of the spheres, in their order
    spheres : n spheres, with their cell
    box : (3, 2), write the lines of contacts whose contact point lies in this box, and those of
        their images that do, length; None: all contacts

    Raises InputError as `contact_lines` does, for another ending and for a box of another shape,
    ExportError if writing fails.
    """
    target = named(path, (".vtp",))
    lines = contact_lines(contacts.ids, sphere_ids, spheres, contacts.points)
    owner, moves = _drawn(lines, contacts.points, spheres, box)
    copy = np.ones(len(owner), dtype=np.int64)
    copy[np.unique(owner, return_index=True)[1]] = 0
    ends = lines.ends[owner] + moves[:, None]
    cell_data: dict[str, NDArray[Any]] = {
        "force": contacts.forces[owner],
        "gap": contacts.gaps[owner],
        "normal": contacts.normals[owner],
        "id1": contacts.ids[owner, 0],
        "id2": contacts.ids[owner, 1],
        "wall": (contacts.ids[owner, 1] < 0).astype(np.int64),
        "copy": copy,
    }
    if contacts.stored is not None:
        cell_data[STORED] = contacts.stored[owner]
    tube = _thickness(contacts.forces, spheres.radii)[owner]
    point_data = {"force": np.repeat(cell_data["force"], 2), "tube": np.repeat(tube, 2)}
    _write_lines(target, ends, point_data, cell_data)
    return len(owner)


@takes_spheres
def write_contacts_csv(
    path: str | PathLike[str],
    contacts: ContactFrame,
    sphere_ids: ArrayLike,
    spheres: Spheres,
    *,
    box: ArrayLike | None = None,
) -> int:
    """Write contacts as a table with all digits, under a line of names and units; return how many.

    The columns are id1 and id2, which is -k for wall k; `x [length]`, `y [length]`, `z [length]` of
    the contact point; nx, ny and nz of the normal, from side 2 to side 1; `gap [length]`;
    `force [force]`; for a law that stores, `stored [impulse]`; and period_a, period_b and period_c,
    by how many periods of the cell the second sphere is moved.

    Parameters
    ----------
    path : of the file, .csv
    contacts : the contacts at one step
    sphere_ids : (n,), ids of the spheres, in their order
    spheres : n spheres, with their cell
    box : (3, 2), write the contacts whose contact point, or an image of it, lies in this box,
        length; None: all contacts

    Raises InputError as `contact_lines` does, for another ending and for a box of another shape,
    ExportError if writing fails.
    """
    target = named(path, (".csv",))
    lines = contact_lines(contacts.ids, sphere_ids, spheres, contacts.points)
    kept = np.unique(_drawn(lines, contacts.points, spheres, box)[0])
    columns: dict[str, NDArray[Any]] = {"id1": contacts.ids[:, 0], "id2": contacts.ids[:, 1]}
    columns |= {f"{axis} [length]": x for axis, x in zip("xyz", contacts.points.T, strict=True)}
    columns |= {f"n{axis}": x for axis, x in zip("xyz", contacts.normals.T, strict=True)}
    columns |= {"gap [length]": contacts.gaps, "force [force]": contacts.forces}
    if contacts.stored is not None:
        columns[f"{STORED} [impulse]"] = contacts.stored
    columns |= {f"period_{edge}": x for edge, x in zip("abc", lines.images.T, strict=True)}
    write_table(target, {name: column[kept] for name, column in columns.items()})
    return len(kept)


@takes_spheres
def write_bonds(
    path: str | PathLike[str],
    contacts: ContactFrame,
    sphere_ids: ArrayLike,
    spheres: Spheres,
) -> int:
    """Write contacts between spheres as bonds for OVITO, a dump local; return how many.

    OVITO's modifier Load Trajectory adds them to the spheres of `write_xyz`. It knows the columns
    of the two spheres, of the period by which the second one is moved, of the distance of the
    centres and of the width of the bond, which grows with the strength of the force; force and gap
    are properties if one gives them a name. Contacts with walls are left out: a bond is between
    particles.

    Parameters
    ----------
    path : of the file, .bonds
    contacts : the contacts at one step
    sphere_ids : (n,), ids of the spheres, in their order
    spheres : n spheres, with their cell; the periods are those between these places, which in a
        periodic cell may be other images than those in a dump

    Raises InputError as `contact_lines` does and for another ending, ExportError if writing fails.
    """
    target = named(path, (".bonds",))
    lines = contact_lines(contacts.ids, sphere_ids, spheres, contacts.points)
    kept = lines.sides[:, 1] >= 0
    distances = np.linalg.norm(lines.ends[kept, 1] - lines.ends[kept, 0], axis=1)
    widths = 2 * _thickness(contacts.forces, spheres.radii)
    table = np.column_stack(
        [
            contacts.ids[kept],
            lines.images[kept],
            distances,
            widths[kept],
            contacts.forces[kept],
            contacts.gaps[kept],
        ]
    )
    names = "batom1 batom2 PeriodicImage.X PeriodicImage.Y PeriodicImage.Z dist Width force gap"
    head = (
        f"ITEM: TIMESTEP\n{contacts.step}\nITEM: NUMBER OF BONDS\n{len(table)}\nITEM: BONDS {names}"
    )
    with whole_file(target) as file:
        np.savetxt(file, table, "%d %d %d %d %d %.17g %.6g %.17g %.17g", header=head, comments="")
    return len(table)


def _drawn(
    lines: ContactLines, points: FloatArray, spheres: Spheres, box: ArrayLike | None
) -> tuple[IntArray, FloatArray]:
    """Choose the lines that are drawn: of which contact each is, (k,), and how far moved, (k, 3).

    Those of one contact stand side by side, in the order of the contacts.
    """
    count, cell = len(lines.sides), spheres.cell
    owner, moves = np.arange(count), np.zeros((count, 3))
    bounds = None if box is None else as_box(box)
    if cell is None or not cell.has_images or not count:
        kept = owner if bounds is None else owner[inside_of(points, bounds, flat=spheres.flat)]
        return kept, moves[kept]
    if bounds is None:
        across = np.flatnonzero(lines.images.any(axis=1))
        owner = np.concatenate([owner, across])
        moves = np.concatenate([moves, -lines.images[across] @ cell.vectors])
    else:
        starts = lines.ends[:, 0]
        places = starts + cell.nearest(points - starts)
        owner, periods = cell.images_in_box(places, np.zeros(count), bounds)
        moves = periods @ cell.vectors
    order = np.argsort(owner, kind="stable")
    return owner[order], moves[order]


def _thickness(forces: FloatArray, radii: FloatArray) -> FloatArray:
    """Return radii of tubes, (m,), that grow with the strength of forces, (m,), length."""
    strength = np.abs(forces)
    mean = strength.mean() if len(strength) else 0.0
    share = strength / mean if mean > 0 else np.zeros(len(strength))
    thickness: FloatArray = MEAN_RADIUS * radii.mean() * np.clip(share, THINNEST, THICKEST)
    return thickness


def _write_lines(
    target: Path,
    ends: FloatArray,
    point_data: dict[str, NDArray[Any]],
    cell_data: dict[str, NDArray[Any]],
) -> None:
    """Write lines as polygonal data. Raises ExportError if writing fails.

    No library serves: meshio has no polygonal data, of which alone ParaView makes tubes, and VTK's
    own package is several times as large as this one with all that it needs.

    Parameters
    ----------
    target : file
    ends : (m, 2, 3), length
    point_data : (2 m,) each
    cell_data : (m,) or (m, 3) each
    """
    count = len(ends)
    parts = {
        "PointData": point_data,
        "CellData": cell_data,
        "Points": {"Points": ends.reshape(-1, 3)},
        "Lines": {
            "connectivity": np.arange(2 * count),
            "offsets": np.arange(2, 2 * count + 2, 2),
        },
    }
    with whole_file(target) as file, file.open("w", encoding="utf-8") as xml:
        xml.write(
            '<?xml version="1.0"?>\n'
            '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" '
            'header_type="UInt64">\n<PolyData>\n'
            f'<Piece NumberOfPoints="{2 * count}" NumberOfVerts="0" NumberOfLines="{count}" '
            'NumberOfStrips="0" NumberOfPolys="0">\n'
        )
        for part, arrays in parts.items():
            xml.write(f"<{part}>\n")
            xml.writelines(_data_array(name, values) for name, values in arrays.items())
            xml.write(f"</{part}>\n")
        xml.write("</Piece>\n</PolyData>\n</VTKFile>\n")


def _data_array(name: str, values: NDArray[Any]) -> str:
    """Return an array of floats or whole numbers, (k,) or (k, components), as VTK's XML has it."""
    kind, layout = ("Float64", "<f8") if values.dtype.kind == "f" else ("Int64", "<i8")
    raw = np.ascontiguousarray(values, dtype=layout).tobytes()
    size = np.uint64(len(raw)).astype("<u8").tobytes()
    components = values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" '
        f'format="binary">{base64.b64encode(size + raw).decode()}</DataArray>\n'
    )
