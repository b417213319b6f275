"""Voxel images of spheres, for image analysis and for flow through the pores.

Lengths are those of the dump. Images of spheres in a periodic cell are drawn as well, wherever the
voxel image is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError
from .export_files import named, numbers, whole_file
from .geometry import FloatArray, IntArray, as_box
from .spheres import Spheres, takes_spheres

# tifffile is imported by the function that needs it: those who only measure shall not wait for it.

PORE, SOLID = 0, 255
# An ImageJ file of more bytes would need 64-bit addresses, which ImageJ's format has not.
MOST_VOXELS = 4_000_000_000
# A TIFF image holds the resolution as a ratio of whole numbers up to this one.
MOST_IN_TIFF = 2**32 - 1
# A slice is held in memory, at about ten bytes per voxel while it is computed.
MOST_VOXELS_IN_SLICE = 100_000_000

# Such a function is called with the number of slices that are done, and the number of all.
Progress = Callable[[int, int], None]
ByteArray = NDArray[np.uint8]


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


@takes_spheres
def voxel_slices(spheres: Spheres, box: ArrayLike, voxel: float) -> Iterator[ByteArray]:
    """Compute the voxel image of spheres in a box slice by slice, from zlo to zhi.

    A voxel is solid (255) if its centre lies in a sphere, otherwise pore (0). What overlaps is
    solid once.

    Parameters
    ----------
    spheres : the spheres, with their cell: in a periodic one their images are solid, too
    box : (3, 2), anywhere and of any size, length
    voxel : edge of a voxel, length

    Returns
    -------
    (rows, columns) of uint8 for each slice; see `voxel_shape`. Row 0 is at ylo, column 0 at xlo

    Raises InputError as `voxel_shape` does, for discs, and for too many periodic images.
    """
    if spheres.flat:
        raise InputError("a two-dimensional packing has no voxel image: its discs have no volume")
    shape = voxel_shape(box, voxel)
    bounds = as_box(box)
    # An image that covers a part of a voxel beyond the box may see further spheres there.
    drawn = spheres.around(bounds, voxel).spheres
    # Places are in voxels from the centre of the first one: centres of voxels are whole numbers.
    return _slices((drawn.positions - bounds[:, 0]) / voxel - 0.5, drawn.radii / voxel, shape)


@takes_spheres
def write_tiff(
    path: str | PathLike[str],
    spheres: Spheres,
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
    spheres : the spheres, with their cell: in a periodic one their images are solid, too
    box : (3, 2), anywhere and of any size, length
    voxel : edge of a voxel, length
    progress : called for each slice

    Raises InputError as `voxel_slices` does, for another ending and for a voxel below 2.4e-10 or
    above 4.2e9, which the format cannot hold; ExportError if writing fails.
    """
    import tifffile

    target = named(path, (".tif", ".tiff"))
    computed = _Counted(voxel_slices(spheres, box, voxel), voxel_shape(box, voxel))
    if not 1 / MOST_IN_TIFF <= voxel <= MOST_IN_TIFF:
        raise InputError(
            f"a TIFF image cannot hold voxels of {voxel:g}: they must be from 2.4e-10 to 4.2e9; "
            "take another unit of length, or raw bytes"
        )
    xlo, ylo, zlo = (as_box(box)[:, 0] / voxel).tolist()
    with whole_file(target) as file:
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


@takes_spheres
def write_raw(
    path: str | PathLike[str],
    spheres: Spheres,
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
    spheres : the spheres, with their cell: in a periodic one their images are solid, too
    box : (3, 2), anywhere and of any size, length
    voxel : edge of a voxel, length
    progress : called for each slice

    Raises InputError as `voxel_slices` does and for another ending, ExportError if writing fails.
    """
    target = named(path, (".raw",))
    computed = _Counted(voxel_slices(spheres, box, voxel), voxel_shape(box, voxel))
    header = {
        "ObjectType": "Image",
        "NDims": 3,
        "BinaryData": True,
        "BinaryDataByteOrderMSB": False,
        "CompressedData": False,
        "TransformMatrix": "1 0 0 0 1 0 0 0 1",
        # The offset is the place of the centre of the first voxel.
        "Offset": numbers(as_box(box)[:, 0] + voxel / 2),
        "ElementSpacing": numbers([voxel] * 3),
        "DimSize": " ".join(str(number) for number in reversed(computed.shape)),
        "ElementType": "MET_UCHAR",
        # This line is the last one: data would follow it.
        "ElementDataFile": target.name,
    }
    lines = "".join(f"{name} = {value}\n" for name, value in header.items())
    # The header gets its name last: a new one stands beside bytes that are whole.
    with whole_file(target.with_suffix(".mhd")) as head:
        head.write_text(lines, encoding="utf-8")
        with whole_file(target) as file, file.open("wb") as raw:
            for image in computed.slices(progress):
                # `tofile` would not tell that a disk is full.
                raw.write(image.data)
    return VoxelImage(computed.shape, voxel, computed.solid)


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


def _as_sides(lengths: Sequence[float]) -> str:
    return " x ".join(f"{length:g}" for length in lengths)
