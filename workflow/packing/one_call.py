"""The call itself: arguments checked, LAMMPS run in a folder, the packing read."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from pathlib import Path

import numpy as np

from ..decks import Deck, Value
from ..errors import PackingError
from ..files import writing
from ..running.processes import cores
from ..shipped import PACK, deck_text
from .checked import as_number, as_positive, as_whole
from .containers import USUAL_DIAMETER, Container, as_container
from .result import Packing, read_packing
from .running import run_deck
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
    tolerance : largest overlap while they fall, smallest radii, from 1e-10 to 0.1; in the end it is
        0.00001 (of bodies 0.00002) or this, whichever is less
    density : mass/length^3; with gravity the unit of the forces
    gravity : length/time^2, along -y
    ranks : number of MPI ranks, at most that of the cores
    folder : for LAMMPS's files, which must not be there yet; without, they go with the packing
    progress : whether to show how far it is, on the standard error

    Raises PackingError with one line for what cannot be packed, and where LAMMPS fails. An
    interrupt (KeyboardInterrupt) stops LAMMPS; then, and after an error, nothing is left.
    """
    count = as_whole(particles, "particles", 1, 2**31 - 1, "a whole number of at least 1")
    form = as_shape(shape)
    number = as_whole(seed, "seed", 1, LARGEST_SEED, f"a whole number from 1 to {LARGEST_SEED}")
    most = cores()
    at_once = as_whole(ranks, "ranks", 1, most, f"from 1 to {most}, the number of cores here")
    allowed = as_number(tolerance, "tolerance", 1e-10, 0.1, "from 1e-10 to 0.1 radii")
    values: dict[str, Value] = {
        "tolerance": allowed,
        "density": as_positive(density, "density"),
        "gravity": as_positive(gravity, "gravity"),
    }
    target = None if folder is None else _free(Path(folder))
    random = np.random.default_rng(number)
    diameters = diameters_of(sizes, count, random)
    room = form.room * float(diameters.max())
    volume = volume_of(form, diameters)
    walls = as_container(container, volume, room)
    _check_room(form, diameters, walls, volume)

    values |= {"particles": count, "seed": number, "diameter": float(diameters.max())}
    values |= form.settings | walls.settings
    deck = Deck(PACK, deck_text(PACK), shipped=True)
    final = float(values.get("tolerance_measuring", deck.variables["tolerance_measuring"]))
    values["tolerance_measuring"] = min(final, allowed)
    used = {**deck.variables, **values}
    steps = sum(int(value) for name, value in used.items() if name.startswith("steps_"))
    several = float(diameters.min()) < float(diameters.max())
    where = Path(tempfile.gettempdir()) if target is None else target.absolute().parent
    with writing(where):
        where.mkdir(parents=True, exist_ok=True)
        # A temporary folder is its owner's alone, and the run in it may be given a name for all.
        work = Path(tempfile.mkdtemp(prefix="inelastic-pack-", dir=where))
    run = work / "run"
    try:
        with writing(where):
            run.mkdir()
            if isinstance(form, Cluster) and not several:
                (run / MOLECULE).write_text(form.molecule)
                values["shape"] = MOLECULE
            if several:
                write_start(run / START, form, diameters, walls, float(values["density"]), random)
        if several:
            ratio = float(diameters.min() / diameters.max())
            values |= {"start": START, "ratio": ratio, "inertia": "solid"}
        run_deck(
            run,
            values,
            what=f"{count} {form.plural}",
            container=walls.words,
            steps=steps,
            ranks=at_once,
            progress=progress,
        )
        if target is not None:
            with writing(target):
                run.rename(target)
                run = target
        packing = read_packing(run, form, walls)
        if target is None:
            weakref.finalize(packing, shutil.rmtree, work, ignore_errors=True)
        else:
            work.rmdir()
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        raise
    return packing


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
