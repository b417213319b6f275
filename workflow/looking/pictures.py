"""Pictures of packings: frames with their contacts as colours, and the contact network."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from lammps_inelastic.analysis import (
    ContactFrame,
    ParticleDump,
    ParticleFrame,
    contact_graph,
    draw_network,
    draw_packing,
)
from lammps_inelastic.analysis.pictures import few_colours

from ..study import Outputs

NETWORK_INCHES, NETWORK_DPI = 7.0, 150
# The network is that of a slab of so many diameters: of a whole packing one sees only its front.
NETWORK_DIAMETERS = 3
# The longer side of a picture in a result has at most so many pixels.
MOST_PIXELS = 900


def draw_frame(
    path: Path,
    frame: ParticleFrame,
    walls: ArrayLike | None,
    contacts: ArrayLike | None,
    longest: int | None = None,
) -> None:
    """Draw a packing, coloured by contacts.

    Parameters
    ----------
    path : file to write
    frame : packing that is drawn
    walls : (3, 2), box that is drawn around it, length; None for the simulation box
    contacts : (n,), contacts of each sphere's particle; None where they are not known
    longest : no side of the picture has more pixels; None for no bound
    """
    # A body has ten contacts and more, a sphere six.
    per_colour = 2 if frame.particles.composite else 1
    draw_packing(
        path,
        frame.spheres,
        walls,
        contacts,
        contacts_per_colour=per_colour,
        longest=longest,
    )


def pictures_of(
    dump: ParticleDump, contacts: ContactFrame | None, outputs: Outputs
) -> dict[str, bytes]:
    """Draw the pictures that a study asks for; return PNG files by their names.

    Parameters
    ----------
    dump : particle dump of the run
    contacts : last contact frame; None if the network is not to be drawn
    outputs : measurements that the study asks for
    """
    pictures: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
        target = Path(name) / "picture.png"
        for wanted in outputs.pictures:
            # The nearest frame is drawn: a run may end at another step than was thought.
            frame = dump[int(np.argmin(np.abs(np.array(dump.steps) - wanted)))]
            draw_frame(target, frame, None, _contacts_of_particles(frame), MOST_PIXELS)
            pictures[f"{frame.step:08d}"] = target.read_bytes()
        if contacts is not None:
            _draw_contact_network(target, dump[-1], contacts)
            pictures["network"] = _small(target)
    return pictures


def _contacts_of_particles(frame: ParticleFrame) -> NDArray[np.int64] | None:
    """Return for each sphere the contacts of its particle; None where the dump has none."""
    if frame.contacts is None:
        return None
    index = frame.particles.index
    sums = np.bincount(index, weights=frame.contacts)
    return sums[index].astype(np.int64)


def _small(path: Path) -> bytes:
    """Return a figure as results keep it: there are many, so its size and colours are limited."""
    with Image.open(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((MOST_PIXELS, MOST_PIXELS))
        buffer = io.BytesIO()
        few_colours(small).save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def _middle(frame: ParticleFrame) -> tuple[float, float]:
    """Return where the slab that is drawn begins and ends along z, in the middle."""
    z = frame.positions[:, 2]
    centre = float(z.min() + z.max()) / 2
    half = NETWORK_DIAMETERS * float(frame.radii.max())
    return centre - half, centre + half


def _draw_contact_network(path: Path, frame: ParticleFrame, contacts: ContactFrame) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    graph = contact_graph(
        contacts.ids, frame.ids, frame.spheres, contacts.forces, points=contacts.points
    )
    figure, ax = pyplot.subplots(figsize=(NETWORK_INCHES, NETWORK_INCHES), layout="constrained")
    draw_network(ax, graph, lower_half=True, slab=_middle(frame))
    ax.set_xlabel("x [length]")
    ax.set_ylabel("y [length]")
    figure.colorbar(
        ax.collections[0], label="force / mean force", extend="max", shrink=0.6, aspect=30
    )
    figure.savefig(path, dpi=NETWORK_DPI)
    pyplot.close(figure)
