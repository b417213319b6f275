"""What the pixels of a picture of a packing show."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from PIL import Image


def pixels_of(path: Path) -> Any:
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def colours_of_legend(path: Path) -> Any:
    """Return the colours (k, 3) that are not grey, below the packing, in 20 pixels and more."""
    seen = pixels_of(path)
    blank = (seen > 250).all(axis=(1, 2))
    starts = np.flatnonzero(blank[:-1] & ~blank[1:])
    # The packing comes first, then rows of discs, then the title.
    colours, count = np.unique(seen[starts[1] :].reshape(-1, 3), axis=0, return_counts=True)
    return colours[(count >= 20) & (np.ptp(colours, axis=1) > 40)]


def check_legend(path: Path) -> None:
    """See that each colour of the legend is its own, and the one that is meant."""
    meant = 255 * matplotlib.colormaps["viridis"](np.linspace(0, 1, 11))[:, :3]
    written = colours_of_legend(path)
    assert len(written) > 0
    near = np.linalg.norm(meant[:, None] - written, axis=2)
    nearest = written[near.argmin(axis=1)]
    assert len(np.unique(nearest, axis=0)) == 11
    # The colour nearest to each is meant for that one, and for no other.
    assert np.linalg.norm(meant[:, None] - nearest, axis=2).argmin(axis=0).tolist() == [*range(11)]
    apart = np.linalg.norm(nearest[:, None] - nearest, axis=2) + 1000 * np.eye(11)
    # Two neighbours of the palette are 33 apart; 10 in one channel are seen beside each other.
    assert apart.min() > 20
