"""The call itself: arguments checked, LAMMPS run in a folder, the packing read."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lammps_inelastic.analysis.geometry import FloatArray

from ..decks import Deck, Value
from ..errors import PackingError
from ..files import writing
from ..running.processes import cores
from ..shipped import PACK, deck_text
from .checked import as_number, as_positive, as_whole
from .containers import USUAL_DIAMETER, Container, as_container
from .result import NotAtRestError, Packing, read_packing
from .running import Scene, run_deck
from .shapes import Cluster, Shape, Sphere, as_shape, volume_of
from .sizes import Sizes, diameters_of
from .start import write_start

# The decks refuse a start that would fill more: random places that dense cannot be pushed apart.
MOST_FILLED = 0.6
# A box of neighbour lists takes memory, also where it is empty: spheres.in has as many at most.
MOST_ROOM = 4e7
START, MOLECULE = "start.data", "cluster.mol"
LARGEST_SEED = 800_000_000


def pack(
    particles: int,
    *,
    shape: Shape = Sphere(),  # noqa: B008
    sizes: Sizes = USUAL_DIAMETER,
    container: Container | None = None,
    seed: int = 1,
    tolerance: float = 0.0005,
    density: float = 1.0,
    gravity: float = 9.81,
    ranks: int = 1,
    folder: str | os.PathLike[str] | None = None,
    progress: bool = True,
    must_rest: bool = True,
) -> Packing:
    """Pour hard particles into a container, shake them, and wait until they are at rest.

    It runs the shipped deck `pack`, which does what `spheres.in`, `dimers.in` and `clusters.in` do:
    in their container, and with their sizes, the packing is theirs to the last bit.

    Parameters
    ----------
    particles : number of particles, at least 1
    shape : Sphere(), Dimer(aspect_ratio) or Cluster(centres)
    sizes : diameter of the spheres, in any unit of length: one for all; a list with one for each
        particle; pairs of a diameter and its share of the particles; a frozen distribution of
        SciPy; or a function of a numpy Generator and a number that draws that many. All spheres of
        a body have one diameter
    container : Box(width, depth, height), Cylinder(diameter, height) or Ball(diameter); without a
        height it is high enough to pour them in; without a container it is a box in which the bed
        is about as high as wide, for 1,000 spheres of 0.11 the 1 x 5 x 1 of the shipped decks
    seed : of the start and of the shaking, from 1 to 800000000
    tolerance : largest overlap while they settle, smallest radii, from 1e-10 to 0.1; shaken at
        least 0.005, in the end 0.00001 (of bodies 0.00002) or this, whichever is less
    density : mass/length^3; with gravity the unit of the forces
    gravity : length/time^2, along -y
    ranks : number of MPI ranks, at most that of the cores
    folder : for LAMMPS's files, which must not be there yet; without, they go with the packing
    progress : whether to show how far it is, on the standard error
    must_rest : whether one that still moves at the end is an error; or its `at_rest` is False

    Raises NotAtRestError where it moves, a PackingError whose `packing` it is; PackingError with
    one line for what cannot be packed, and where LAMMPS fails. An interrupt (KeyboardInterrupt)
    stops LAMMPS; then, and after other errors, nothing is left.
    """
    count = as_whole(particles, "particles", 1, 2**31 - 1, "a whole number of at least 1")
    form = as_shape(shape)
    number = as_whole(seed, "seed", 1, LARGEST_SEED, f"a whole number from 1 to {LARGEST_SEED}")
    most = cores()
    at_once = as_whole(ranks, "ranks", 1, most, f"from 1 to {most}, the number of cores here")
    values: dict[str, Value] = {
        "tolerance": as_number(tolerance, "tolerance", 1e-10, 0.1, "from 1e-10 to 0.1 radii"),
        "density": as_positive(density, "density"),
        "gravity": as_positive(gravity, "gravity"),
        "particles": count,
        "seed": number,
    }
    target = None if folder is None else _free(Path(folder))
    start = _start(form, sizes, count, container, np.random.default_rng(number))
    return _at_rest(_packed(start, values, target, at_once, progress), must=must_rest)


def _at_rest(packing: Packing, *, must: bool) -> Packing:
    """Return a packing; raise NotAtRestError for one that moves, if it must not."""
    if must and not packing.at_rest:
        raise NotAtRestError(packing)
    return packing


@dataclass(frozen=True, eq=False)
class _Start:
    """What is packed in what.

    Attributes
    ----------
    shape : of the particles
    diameters : of the spheres of each, (n,), length
    walls : the container, with its height
    random : draws the rest of the start, where LAMMPS does not
    """

    shape: Shape
    diameters: FloatArray
    walls: Container
    random: np.random.Generator

    @property
    def words(self) -> str:
        """What is packed."""
        return f"{len(self.diameters)} {self.shape.plural}"

    @property
    def has_sizes(self) -> bool:
        """Whether the particles are of several sizes."""
        return bool(self.diameters.min() < self.diameters.max())


def _start(
    form: Shape,
    sizes: Sizes,
    count: int,
    container: Container | None,
    random: np.random.Generator,
) -> _Start:
    """Draw the sizes and choose the container; raise PackingError where they do not fit."""
    diameters = diameters_of(sizes, count, random)
    volume = volume_of(form, diameters)
    walls = as_container(container, volume, form.room * float(diameters.max()))
    _check_room(form, diameters, walls, volume)
    return _Start(form, diameters, walls, random)


def _packed(
    start: _Start, values: dict[str, Value], target: Path | None, ranks: int, progress: bool
) -> Packing:
    """Run LAMMPS and read the packing.

    Parameters
    ----------
    start : what is packed in what
    values : what was asked for, by the names of the deck's parameters
    target : folder for LAMMPS's files; None for a temporary one that goes with the packing
    ranks : number of MPI ranks
    progress : whether to show how far it is
    """
    values, steps = _complete(values, start)
    where = Path(tempfile.gettempdir()) if target is None else target.absolute().parent
    with writing(where):
        where.mkdir(parents=True, exist_ok=True)
        # A temporary folder is its owner's alone, and the run in it may be given a name for all.
        work = Path(tempfile.mkdtemp(prefix="inelastic-pack-", dir=where))
    run = work / "run"
    try:
        with writing(where):
            run.mkdir()
            values |= _write_files(run, start, float(values["density"]))
        scene = Scene(start.words, start.walls.words, steps)
        run_deck(run, values, scene, ranks=ranks, progress=progress)
        if target is not None:
            with writing(target):
                run.rename(target)
                run = target
        packing = read_packing(run, start.shape, start.walls)
        if target is None:
            weakref.finalize(packing, shutil.rmtree, work, ignore_errors=True)
        else:
            work.rmdir()
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        raise
    return packing


def _complete(values: Mapping[str, Value], start: _Start) -> tuple[dict[str, Value], int]:
    """Return all values that are not the deck's defaults, and the number of steps they ask for."""
    all_values = {**values, "diameter": float(start.diameters.max())}
    all_values |= start.shape.settings | start.walls.settings
    deck = Deck(PACK, deck_text(PACK), shipped=True)
    final = float(all_values.get("tolerance_measuring", deck.variables["tolerance_measuring"]))
    all_values["tolerance_measuring"] = min(final, float(values["tolerance"]))
    used = {**deck.variables, **all_values}
    steps = sum(int(value) for name, value in used.items() if name.startswith("steps_"))
    return all_values, steps


def _write_files(run: Path, start: _Start, density: float) -> dict[str, Value]:
    """Write the files that the deck reads, if any; return the values that name them."""
    form, diameters = start.shape, start.diameters
    if start.has_sizes:
        write_start(run / START, form, diameters, start.walls, density, start.random)
        ratio = float(diameters.min() / diameters.max())
        return {"start": START, "ratio": ratio, "inertia": "solid"}
    if isinstance(form, Cluster):
        (run / MOLECULE).write_text(form.molecule)
        return {"shape": MOLECULE}
    return {}


def _free(folder: Path) -> Path:
    """Return the path of a folder that is not there yet; raise PackingError if it is."""
    if os.path.lexists(folder):
        raise PackingError(f"{folder}: is there already; name a folder that is not")
    return folder


def _check_room(shape: Shape, diameters: np.ndarray, container: Container, volume: float) -> None:
    """Raise PackingError for a container that is too narrow, too small or far too large."""
    room = shape.room * float(diameters.max())
    if container.narrowest <= room:
        raise PackingError(
            f"{container.words} is too narrow: to be placed in any direction the largest of these "
            f"{shape.plural} needs more than {room:.4g} along each side"
        )
    filled = volume / container.volume
    if filled > MOST_FILLED:
        raise PackingError(
            f"no room: {len(diameters)} {shape.plural} would fill {filled:.3g} of "
            f"{container.words}, at most {MOST_FILLED:g} is allowed"
        )
    cells = container.volume / float(diameters.max()) ** 3
    if cells > MOST_ROOM:
        raise PackingError(
            f"{container.words} is too large for these sizes: it has room for {cells:.1e} cubes of "
            f"the largest diameter, at most {MOST_ROOM:.0e} are allowed"
        )
