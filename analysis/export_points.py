"""Spheres as points and lists that other programs read, each with its radius and what is known."""

from __future__ import annotations

import json
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike

from .export_files import given, named, numbers, whole_file, write_table
from .spheres import Spheres, takes_spheres

# meshio is imported by the function that needs it: those who only measure shall not wait for it.


@takes_spheres
def write_xyz(
    path: str | PathLike[str],
    spheres: Spheres,
    *,
    ids: ArrayLike | None = None,
    bodies: ArrayLike | None = None,
    contacts: ArrayLike | None = None,
    step: int | None = None,
) -> None:
    """Write spheres as extended XYZ, with all digits; OVITO and ASE know its columns and its cell.

    The columns are species (X for all), pos, radius and, where they are given, id, body and
    contacts. The cell is there with its edges, its origin and which of its faces are periodic.
    Readers of plain XYZ, such as MDAnalysis, take the species and the positions.

    Parameters
    ----------
    path : of the file, .xyz or .extxyz
    spheres : n spheres, with their cell
    ids : (n,), of the spheres
    bodies : (n,), body of each sphere, 0 for a free sphere
    contacts : (n,), contacts of each sphere
    step : time step

    Raises InputError for another ending or arrays of other shapes, ExportError if writing fails.
    """
    target = named(path, (".xyz", ".extxyz"))
    integers = given(len(spheres), id=ids, body=bodies, contacts=contacts)
    words = []
    if spheres.cell is not None:
        cell = spheres.cell
        words += [f'Lattice="{numbers(cell.vectors.ravel())}"', f'Origin="{numbers(cell.origin)}"']
        # A reader takes a cell of which nothing is said for a periodic one.
        words.append(f'pbc="{" ".join("T" if flag else "F" for flag in cell.periodic)}"')
    names = ["species:S:1", "pos:R:3", "radius:R:1", *(f"{name}:I:1" for name in integers)]
    words.append(f"Properties={':'.join(names)}")
    if step is not None:
        words.append(f"step={step}")

    # No library serves: MDAnalysis writes no radii, and ASE eight decimals.
    table = np.column_stack([spheres.positions, spheres.radii, *integers.values()])
    layout = " ".join(["X", *["%.17g"] * 4, *["%d"] * len(integers)])
    with whole_file(target) as file:
        np.savetxt(file, table, layout, header=f"{len(spheres)}\n{' '.join(words)}", comments="")


@takes_spheres
def write_vtk(
    path: str | PathLike[str],
    spheres: Spheres,
    *,
    ids: ArrayLike | None = None,
    bodies: ArrayLike | None = None,
    contacts: ArrayLike | None = None,
) -> None:
    """Write the centres of spheres as points for ParaView, an unstructured grid of VTK's XML.

    Every point is a vertex with the point data radius, diameter and, where they are given, id, body
    and contacts. Glyphs of source Sphere, whose radius is 0.5, have the right size when they are
    scaled by diameter; Point Gaussians when they are scaled by radius.

    Parameters
    ----------
    path : of the file, .vtu
    spheres : n spheres
    ids : (n,), of the spheres
    bodies : (n,), body of each sphere, 0 for a free sphere
    contacts : (n,), contacts of each sphere

    Raises InputError for another ending or arrays of other shapes, ExportError if writing fails.
    """
    import meshio

    target = named(path, (".vtu",))
    integers = given(len(spheres), id=ids, body=bodies, contacts=contacts)
    mesh = meshio.Mesh(
        spheres.positions,
        # ParaView draws cells: points that belong to none are not seen.
        [("vertex", np.arange(len(spheres))[:, None])],
        point_data={"radius": spheres.radii, "diameter": 2 * spheres.radii, **integers},
    )
    with whole_file(target) as file:
        meshio.write(file, mesh, file_format="vtu")


@takes_spheres
def write_csv(
    path: str | PathLike[str],
    spheres: Spheres,
    *,
    ids: ArrayLike | None = None,
    bodies: ArrayLike | None = None,
    contacts: ArrayLike | None = None,
) -> None:
    """Write spheres as a table with all digits, one line each under a line of names and units.

    The columns are id and body where they are given, `x [length]`, `y [length]`, `z [length]`,
    `radius [length]`, and contacts where they are given.

    Parameters
    ----------
    path : of the file, .csv
    spheres : n spheres
    ids : (n,), of the spheres
    bodies : (n,), body of each sphere, 0 for a free sphere
    contacts : (n,), contacts of each sphere

    Raises InputError for another ending or arrays of other shapes, ExportError if writing fails.
    """
    target = named(path, (".csv",))
    places = {f"{axis} [length]": x for axis, x in zip("xyz", spheres.positions.T, strict=True)}
    columns = {
        **given(len(spheres), id=ids, body=bodies),
        **places,
        "radius [length]": spheres.radii,
        **given(len(spheres), contacts=contacts),
    }
    write_table(target, columns)


@takes_spheres
def write_json(
    path: str | PathLike[str],
    spheres: Spheres,
    *,
    ids: ArrayLike | None = None,
    bodies: ArrayLike | None = None,
    contacts: ArrayLike | None = None,
    step: int | None = None,
) -> None:
    """Write spheres and their cell as JSON, with all digits, for scripts of other programs.

    The object has `step` where it is given, `cell` (origin, vectors, one edge each, and periodic,
    a flag each; null without a cell) and `spheres`, a list of objects with `center`, `radius` and,
    where they are given, `id`, `body` and `contacts`.

    Parameters
    ----------
    path : of the file, .json
    spheres : n spheres, with their cell
    ids : (n,), of the spheres
    bodies : (n,), body of each sphere, 0 for a free sphere
    contacts : (n,), contacts of each sphere
    step : time step

    Raises InputError for another ending or arrays of other shapes, ExportError if writing fails.
    """
    target = named(path, (".json",))
    columns = {
        **given(len(spheres), id=ids),
        "center": spheres.positions,
        "radius": spheres.radii,
        **given(len(spheres), body=bodies, contacts=contacts),
    }
    cell = spheres.cell and {
        "origin": spheres.cell.origin.tolist(),
        "vectors": spheres.cell.vectors.tolist(),
        "periodic": list(spheres.cell.periodic),
    }
    said = {"cell": cell} if step is None else {"step": step, "cell": cell}
    head = ",\n".join(f'"{name}": {json.dumps(value)}' for name, value in said.items())
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    rows = (json.dumps(dict(zip(columns, row, strict=True))) for row in values)
    # A sphere has a line of its own, so that an editor shows a large list, too.
    text = f'{{{head},\n"spheres": [\n' + ",\n".join(rows) + "\n]}\n"
    with whole_file(target) as file:
        file.write_text(text, encoding="utf-8")


@takes_spheres
def write_pqr(
    path: str | PathLike[str],
    spheres: Spheres,
    *,
    ids: ArrayLike | None = None,
) -> None:
    """Write spheres as a PQR file, the one of MDAnalysis that holds radii.

    `MDAnalysis.Universe(path).atoms.radii` are the radii. Each particle is a residue, numbered from
    1 on. A PQR file has no cell.

    Parameters
    ----------
    path : of the file, .pqr
    spheres : n spheres, with their particles
    ids : (n,), of the spheres; None: they are numbered from 1 on

    Raises InputError for another ending or arrays of other shapes, ExportError if writing fails.
    """
    target = named(path, (".pqr",))
    count = len(spheres)
    serial = given(count, id=np.arange(1, count + 1) if ids is None else ids)["id"]
    charges = np.zeros(count)
    table = np.column_stack(
        [serial, spheres.particles.index + 1, spheres.positions, charges, spheres.radii]
    )
    with whole_file(target) as file:
        np.savetxt(
            file, table, "ATOM %d X SPH %d %.17g %.17g %.17g %g %.17g", footer="END", comments=""
        )
