"""A packing as files that other programs open: points, voxels, or a surface.

Lengths are those of the dump, nothing is periodic but for a flag in the extended XYZ file. A file
gets its name when it is whole: until then, and if writing fails, an older one stays as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ExportError, InputError
from .files import reason_of, unfinished
from .geometry import FloatArray, IntArray, as_box, as_count, as_integers, as_spheres

# meshio, tifffile and trimesh are imported by the functions that need them: trimesh alone takes a
# second, and those who only measure shall not wait for it.

PORE, SOLID = 0, 255
# An ImageJ file of more bytes would need 64-bit addresses, which ImageJ's format has not.
MOST_VOXELS = 4_000_000_000
# A TIFF image holds the resolution as a ratio of whole numbers up to this one.
MOST_IN_TIFF = 2**32 - 1
# A slice is held in memory, at about ten bytes per voxel while it is computed.
MOST_VOXELS_IN_SLICE = 100_000_000
# So many faces take 5 GB; the file itself counts its faces with 32 bits.
MOST_FACES = 100_000_000
FACES_AT_ONCE = 200_000

# Such a function is called with the number of slices that are done, and the number of all.
Progress = Callable[[int, int], None]
ByteArray = NDArray[np.uint8]

# This is the layout of a face in a binary STL file.
_FACE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True)
class VoxelImage:
    """The size of a voxel image, and how much of it is solid.

    Attributes
    ----------
    shape : voxels along z (slices), y (rows) and x (columns)
    voxel : edge of a voxel, length
    solid : number of voxels whose centres lie in a sphere
    """

    shape: tuple[int, int, int]
    voxel: float
    solid: int

    @property
    def solid_share(self) -> float:
        """Share of the voxels that are solid, 0 to 1."""
        return self.solid / math.prod(self.shape)


def write_xyz(
    path: str | PathLike[str],
    positions: ArrayLike,
    radii: ArrayLike,
    *,
    ids: ArrayLike | None = None,
    bodies: ArrayLike | None = None,
    contacts: ArrayLike | None = None,
    box: ArrayLike | None = None,
    periodic: Sequence[bool] = (False, False, False),
    step: int | None = None,
) -> None:
    """Write spheres as extended XYZ, with all digits; OVITO and ASE know its columns.

    The columns are species (X for all), pos, radius and, where they are given, id, body and
    contacts. Readers of plain XYZ, such as MDAnalysis, take the species and the positions.

    Parameters
    ----------
    path : of the file, .xyz or .extxyz
    positions : (n, 3), length
    radii : (n,), length
    ids : (n,), of the spheres
    bodies : (n,), body of each sphere, 0 for a free sphere
    contacts : (n,), contacts of each sphere
    box : (3, 2), the container, length
    periodic : for each axis, whether the box is periodic; only said where there is a box
    step : time step

    Raises InputError for another ending or arrays of other shapes, ExportError if writing fails.
    """
    target = _named(path, (".xyz", ".extxyz"))
    centres, radius = as_spheres(positions, radii)
    integers = _given(len(radius), id=ids, body=bodies, contacts=contacts)
    words = []
    if box is not None:
        bounds = as_box(box)
        edges = np.diag(bounds[:, 1] - bounds[:, 0])
        words += [f'Lattice="{_numbers(edges.ravel())}"', f'Origin="{_numbers(bounds[:, 0])}"']
        words.append(f'pbc="{" ".join("T" if flag else "F" for flag in periodic)}"')
    names = ["species:S:1", "pos:R:3", "radius:R:1", *(f"{name}:I:1" for name in integers)]
    words.append(f"Properties={':'.join(names)}")
    if step is not None:
        words.append(f"step={step}")

    # No library serves: MDAnalysis writes no radii, and ASE eight decimals.
    table = np.column_stack([centres, radius, *integers.values()])
    layout = " ".join(["X", *["%.17g"] * 4, *["%d"] * len(integers)])
    with _unfinished(target) as file:
        np.savetxt(file, table, layout, header=f"{len(radius)}\n{' '.join(words)}", comments="")


def write_vtk(
    path: str | PathLike[str],
    positions: ArrayLike,
    radii: ArrayLike,
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
    positions : (n, 3), length
    radii : (n,), length
    ids : (n,), of the spheres
    bodies : (n,), body of each sphere, 0 for a free sphere
    contacts : (n,), contacts of each sphere

    Raises InputError for another ending or arrays of other shapes, ExportError if writing fails.
    """
    import meshio

    target = _named(path, (".vtu",))
    centres, radius = as_spheres(positions, radii)
    integers = _given(len(radius), id=ids, body=bodies, contacts=contacts)
    mesh = meshio.Mesh(
        centres,
        # ParaView draws cells: points that belong to none are not seen.
        [("vertex", np.arange(len(radius))[:, None])],
        point_data={"radius": radius, "diameter": 2 * radius, **integers},
    )
    with _unfinished(target) as file:
        meshio.write(file, mesh, file_format="vtu")


def voxel_shape(box: ArrayLike, voxel: float) -> tuple[int, int, int]:
    """Return the number of voxels along z, y and x whose centres lie in a box.

    The first voxel's corner is the box's. Where a side is no whole number of voxels, the image
    covers up to half a voxel more or less than the box.

    Parameters
    ----------
    box : (3, 2), length
    voxel : edge of a voxel, length

    Raises InputError for a voxel that is not positive or too large for the box, and for too many.
    """
    bounds = as_box(box)
    if not (voxel > 0 and math.isfinite(voxel)):
        raise InputError(f"the size of a voxel must be positive, not {voxel:g}")
    lengths = (bounds[:, 1] - bounds[:, 0]).tolist()
    # A larger number is cut to this bound, which is refused below.
    columns, rows, slices = (
        math.floor(min(length / voxel + 0.5, 2 * MOST_VOXELS)) for length in lengths
    )
    if min(columns, rows, slices) < 1:
        raise InputError(f"a voxel of {voxel:g} is too large for a box {_as_sides(lengths)} wide")
    size = f"voxels of {voxel:g} make an image of {columns} x {rows} x {slices}"
    if columns * rows * slices > MOST_VOXELS:
        raise InputError(f"{size}, more than {MOST_VOXELS:.0e} voxels: choose larger ones")
    if columns * rows > MOST_VOXELS_IN_SLICE:
        raise InputError(
            f"{size}, more than {MOST_VOXELS_IN_SLICE:.0e} voxels in a slice: choose larger ones"
        )
    return slices, rows, columns


def voxel_slices(
    positions: ArrayLike, radii: ArrayLike, box: ArrayLike, voxel: float
) -> Iterator[ByteArray]:
    """Compute the voxel image of spheres in a box slice by slice, from zlo to zhi.

    A voxel is solid (255) if its centre lies in a sphere, otherwise pore (0). What overlaps is
    solid once.

    Parameters
    ----------
    positions : (n, 3), length
    radii : (n,), length
    box : (3, 2), length
    voxel : edge of a voxel, length

    Returns
    -------
    (rows, columns) of uint8 for each slice; see `voxel_shape`. Row 0 is at ylo, column 0 at xlo

    Raises InputError as `voxel_shape` does.
    """
    centres, radius = as_spheres(positions, radii)
    shape = voxel_shape(box, voxel)
    # Places are in voxels from the centre of the first one: centres of voxels are whole numbers.
    return _slices((centres - as_box(box)[:, 0]) / voxel - 0.5, radius / voxel, shape)


def write_tiff(
    path: str | PathLike[str],
    positions: ArrayLike,
    radii: ArrayLike,
    box: ArrayLike,
    voxel: float,
    *,
    progress: Progress | None = None,
) -> VoxelImage:
    """Write the voxel image of spheres in a box as a stack of TIFF images, one per slice in z.

    The stack is compressed (zlib). It holds the size of a voxel and the place of the box as ImageJ
    has them. Programs that draw images show row 0, which is at ylo, at the top.

    Parameters
    ----------
    path : of the file, .tif or .tiff
    positions : (n, 3), length
    radii : (n,), length
    box : (3, 2), length
    voxel : edge of a voxel, length
    progress : called for each slice

    Raises InputError as `voxel_shape` does, for another ending and for a voxel below 2.4e-10 or
    above 4.2e9, which the format cannot hold; ExportError if writing fails.
    """
    import tifffile

    target = _named(path, (".tif", ".tiff"))
    computed = _Counted(voxel_slices(positions, radii, box, voxel), voxel_shape(box, voxel))
    if not 1 / MOST_IN_TIFF <= voxel <= MOST_IN_TIFF:
        raise InputError(
            f"a TIFF image cannot hold voxels of {voxel:g}: they must be from 2.4e-10 to 4.2e9; "
            "take another unit of length, or raw bytes"
        )
    xlo, ylo, zlo = (as_box(box)[:, 0] / voxel).tolist()
    with _unfinished(target) as file:
        tifffile.imwrite(
            file,
            computed.slices(progress),
            shape=computed.shape,
            dtype=np.uint8,
            imagej=True,
            photometric="minisblack",
            compression="zlib",
            # Spheres shrink a hundredfold and more at any level; the lowest takes least time.
            compressionargs={"level": 1},
            resolution=(1 / voxel, 1 / voxel),
            # ImageJ counts the place of the coordinates' origin in voxels.
            metadata={
                "axes": "ZYX",
                "spacing": voxel,
                "unit": "",
                "xorigin": -xlo,
                "yorigin": -ylo,
                "zorigin": -zlo,
            },
        )
    return VoxelImage(computed.shape, voxel, computed.solid)


def write_raw(
    path: str | PathLike[str],
    positions: ArrayLike,
    radii: ArrayLike,
    box: ArrayLike,
    voxel: float,
    *,
    progress: Progress | None = None,
) -> VoxelImage:
    """Write the voxel image of spheres in a box as bytes, and a MetaImage header beside them.

    One byte per voxel, x fastest, then y, then z. The header has the name of the file with the
    ending .mhd, and is what ParaView, ITK and 3D Slicer open.

    Parameters
    ----------
    path : of the bytes, .raw
    positions : (n, 3), length
    radii : (n,), length
    box : (3, 2), length
    voxel : edge of a voxel, length
    progress : called for each slice

    Raises InputError as `voxel_shape` does and for another ending, ExportError if writing fails.
    """
    target = _named(path, (".raw",))
    computed = _Counted(voxel_slices(positions, radii, box, voxel), voxel_shape(box, voxel))
    header = {
        "ObjectType": "Image",
        "NDims": 3,
        "BinaryData": True,
        "BinaryDataByteOrderMSB": False,
        "CompressedData": False,
        "TransformMatrix": "1 0 0 0 1 0 0 0 1",
        # The offset is the place of the centre of the first voxel.
        "Offset": _numbers(as_box(box)[:, 0] + voxel / 2),
        "ElementSpacing": _numbers([voxel] * 3),
        "DimSize": " ".join(str(number) for number in reversed(computed.shape)),
        "ElementType": "MET_UCHAR",
        # This line is the last one: data would follow it.
        "ElementDataFile": target.name,
    }
    lines = "".join(f"{name} = {value}\n" for name, value in header.items())
    # The header gets its name last: a new one stands beside bytes that are whole.
    with _unfinished(target.with_suffix(".mhd")) as head:
        head.write_text(lines, encoding="utf-8")
        with _unfinished(target) as file, file.open("wb") as raw:
            for image in computed.slices(progress):
                # `tofile` would not tell that a disk is full.
                raw.write(image.data)
    return VoxelImage(computed.shape, voxel, computed.solid)


def write_stl(
    path: str | PathLike[str],
    positions: ArrayLike,
    radii: ArrayLike,
    *,
    subdivisions: int = 2,
) -> int:
    """Write the surfaces of spheres as triangles, a binary STL file; return how many.

    Each sphere is an icosahedron whose faces are divided into four `subdivisions` times, and whose
    corners lie on the sphere: 320 faces and 96.6 % of the volume for 2, 1280 and 99.1 % for 3.

    Each sphere's mesh is closed, but spheres that overlap interpenetrate: the file is not the
    surface of their union, which a program that knows boolean operations on meshes can make of it.
    STL has no more than seven digits.

    Parameters
    ----------
    path : of the file, .stl
    positions : (n, 3), length
    radii : (n,), length
    subdivisions : how often the faces are divided

    Raises InputError for another ending or too many faces, ExportError if writing fails.
    """
    import trimesh

    target = _named(path, (".stl",))
    centres, radius = as_spheres(positions, radii)
    # The faces of one sphere are too many long before their number takes a while to compute.
    each: int = 20 * 4 ** min(as_count(subdivisions, "the number of subdivisions", 0), 30)
    faces = each * len(radius)
    if faces > MOST_FACES:
        raise InputError(
            f"{len(radius)} spheres of 20 x 4^{subdivisions} faces are more than "
            f"{MOST_FACES:.0e} faces: choose fewer subdivisions or fewer spheres"
        )
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    # trimesh would write one mesh, and hold all of it in memory. These are the bytes it would
    # write, some spheres at a time.
    some = max(1, FACES_AT_ONCE // each)
    with _unfinished(target) as file, file.open("wb") as stl:
        stl.write(b"spheres".ljust(80) + np.uint32(faces).astype("<u4").tobytes())
        for start in range(0, len(radius), some):
            chosen = slice(start, start + some)
            table = np.zeros((len(radius[chosen]), each), dtype=_FACE)
            table["normal"] = ball.face_normals
            table["corners"] = (
                centres[chosen, None, None] + radius[chosen, None, None, None] * ball.triangles
            )
            stl.write(table.data)
    return faces


class _Counted:
    """The slices of an image, and how many of their voxels are solid once they were computed."""

    def __init__(self, images: Iterator[ByteArray], shape: tuple[int, int, int]) -> None:
        self.shape = shape
        self.solid = 0
        self._images = images

    def slices(self, progress: Progress | None) -> Iterator[ByteArray]:
        for done, image in enumerate(self._images, start=1):
            self.solid += int(np.count_nonzero(image))
            # This comes before the slice is given away: a writer does not ask again after the last.
            if progress is not None:
                progress(done, self.shape[0])
            yield image


def _slices(
    centres: FloatArray, radii: FloatArray, shape: tuple[int, int, int]
) -> Iterator[ByteArray]:
    """Compute the slices of spheres in units of voxels, the centres of which are whole numbers."""
    slices, rows, columns = shape
    x, y, z = centres.T
    for index in range(slices):
        # Each sphere that the slice cuts is a disc here, and each row of a disc an interval.
        disc = radii**2 - (z - index) ** 2
        cut = np.flatnonzero(disc > 0)
        half = np.sqrt(disc[cut])
        first = _next_above(y[cut] - half, rows)
        count = np.maximum(_next_at_or_above(y[cut] + half, rows) - first, 0)
        sphere = np.repeat(cut, count)
        row = np.arange(len(sphere)) + np.repeat(first - (np.cumsum(count) - count), count)
        half = np.sqrt(np.maximum(disc[sphere] - (y[sphere] - row) ** 2, 0))
        start = _next_above(x[sphere] - half, columns)
        stop = np.maximum(_next_at_or_above(x[sphere] + half, columns), start)

        # +1 where an interval starts, -1 where it has ended: their running sum is the number of
        # spheres in which a voxel lies.
        steps = np.zeros((rows, columns + 1), dtype=np.int32)
        np.add.at(steps.ravel(), row * (columns + 1) + start, 1)
        np.subtract.at(steps.ravel(), row * (columns + 1) + stop, 1)
        inside = np.cumsum(steps[:, :columns], axis=1, dtype=np.int32) > 0
        yield np.where(inside, np.uint8(SOLID), np.uint8(PORE))


def _next_above(values: FloatArray, count: int) -> IntArray:
    """Return the first voxels beyond some places, 0 to count: a surface itself is outside."""
    voxels: IntArray = np.clip(np.floor(values) + 1, 0, count).astype(np.int64)
    return voxels


def _next_at_or_above(values: FloatArray, count: int) -> IntArray:
    voxels: IntArray = np.clip(np.ceil(values), 0, count).astype(np.int64)
    return voxels


def _given(count: int, **columns: ArrayLike | None) -> dict[str, IntArray]:
    """Return the columns that are not None as integers, one per sphere."""
    arrays: dict[str, IntArray] = {}
    for name, values in columns.items():
        if values is not None:
            arrays[name] = as_integers(values, name)
            if arrays[name].shape != (count,):
                raise InputError(f"{name} must have shape ({count},), not {arrays[name].shape}")
    return arrays


def _numbers(values: ArrayLike) -> str:
    return " ".join(f"{value!r}" for value in np.asarray(values, dtype=np.float64).tolist())


def _as_sides(lengths: Sequence[float]) -> str:
    return " x ".join(f"{length:g}" for length in lengths)


def _named(path: str | PathLike[str], endings: Sequence[str]) -> Path:
    """Return a path whose name has one of some endings: programs choose their reader by it."""
    target = Path(path)
    if target.suffix.lower() not in endings:
        raise InputError(f"{target}: the name must end in {' or '.join(endings)}")
    return target


@contextmanager
def _unfinished(target: Path) -> Iterator[Path]:
    """Give a file as `unfinished` does; raise ExportError if it cannot be written."""
    try:
        with unfinished(target) as file:
            yield file
    except OSError as error:
        raise ExportError(f"{target}: cannot be written: {reason_of(error)}") from None
