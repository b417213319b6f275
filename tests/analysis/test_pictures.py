"""The picture: the right colours in the right places, nothing cut off."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import InputError, PictureError, Spheres, draw_packing
from tests.helpers.pixels import check_legend, pixels_of

CONTAINER = [[0, 1], [0, 5], [0, 1]]
# The upper sphere has no contact (dark violet), the lower one ten or more (yellow).
CENTRES = [[0.5, 0.9, 0.5], [0.5, 0.2, 0.5]]
TWO = Spheres(CENTRES, [0.2, 0.2])


def test_colours_and_gravity(tmp_path: Path) -> None:
    path = tmp_path / "packing.png"
    draw_packing(path, TWO, CONTAINER, [0, 12], pixels=300)
    red, green, blue = np.moveaxis(pixels_of(path), 2, 0)
    yellow = np.argwhere((red > 150) & (green > 150) & (blue < 100))
    violet = np.argwhere((red > green + 40) & (blue > green + 40))
    # Each disc of the picture is about 60 pixels wide; those of the legend have below 100 pixels.
    assert len(yellow) > 1000
    assert len(violet) > 1000
    assert np.median(violet[:, 0]) < np.median(yellow[:, 0])


def test_colours_of_bodies(tmp_path: Path) -> None:
    # Thirteen contacts are yellow; where each colour stands for two numbers they are green.
    green_pixels = []
    path = tmp_path / "packing.png"
    for width in (1, 2):
        draw_packing(path, TWO, CONTAINER, [1, 13], contacts_per_colour=width, pixels=300)
        red, green, blue = np.moveaxis(pixels_of(path), 2, 0)
        green_pixels.append(np.count_nonzero((green > red + 60) & (green > blue + 20)))
    # The sphere is about 60 pixels wide; the legend's three green discs have below 100 pixels each.
    assert green_pixels[0] < 300
    assert green_pixels[1] > 1000


@pytest.fixture(scope="module")
def bed() -> tuple[Any, Any, Any]:
    """Return positions, radii and contacts of spheres in 1,000 shades, and more."""
    random = np.random.default_rng(1)
    return random.random((300, 3)) * 0.9 + 0.05, np.full(300, 0.05), random.integers(0, 12, 300)


@pytest.mark.parametrize(
    "contacts",
    ["all", *(pytest.param(some, marks=pytest.mark.slow) for some in ("few", "none", "many"))],
)
def test_each_colour_of_the_legend_can_be_told_from_the_others(
    contacts: str, bed: tuple[Any, Any, Any], tmp_path: Path
) -> None:
    """In the file, which has 256 colours: most of them are shades of spheres."""
    positions, radii, numbers = bed
    shown = {"all": numbers, "few": numbers % 3, "none": 0 * numbers, "many": 0 * numbers + 6}
    path = tmp_path / "packing.png"
    draw_packing(path, Spheres(positions, radii), [[0, 1]] * 3, shown[contacts])
    check_legend(path)


@pytest.mark.slow
def test_a_legend_that_is_read_where_four_pictures_stand_side_by_side(
    bed: tuple[Any, Any, Any], tmp_path: Path
) -> None:
    """Letters are as high as a disc: ten pixels of 1,200 that four pictures share."""
    path = tmp_path / "packing.png"
    draw_packing(path, Spheres(bed[0], bed[1]), [[0, 1]] * 3, bed[2])
    seen = pixels_of(path)
    blank = (seen > 250).all(axis=(1, 2))
    starts = np.flatnonzero(blank[:-1] & ~blank[1:])
    ends = np.flatnonzero(~blank[:-1] & blank[1:])
    disc = ends[1] - starts[1]
    assert disc * 1200 / (4 * seen.shape[1]) > 9


def test_overlapping_spheres_meet_in_a_plane(tmp_path: Path) -> None:
    # Side by side, at right angles to the view: each is seen up to the plane between them.
    path = tmp_path / "packing.png"
    across = 0.1 * np.array([-0.3725, 0, 0.928])
    draw_packing(
        path, Spheres([0.5 - across, 0.5 + across], [0.2, 0.2]), CONTAINER, [12, 0], pixels=300
    )
    red, green, blue = np.moveaxis(pixels_of(path), 2, 0)
    yellow = np.count_nonzero((red > blue + 20) & (green > blue + 20))
    violet = np.count_nonzero((red > green + 20) & (blue > green + 20))
    # Up to dark pixels and the legend. Of a sphere drawn over the other 1.6 times as much is seen.
    assert yellow / violet == pytest.approx(1, abs=0.3)


@pytest.mark.parametrize("size", [(1, 1, 1), (1, 5, 1), (5, 1, 1), (1, 1, 5)])
def test_nothing_is_cut_off(tmp_path: Path, size: tuple[int, int]) -> None:
    path = tmp_path / "packing.png"
    corners = [np.full(3, 0.5), np.array(size) - 0.5]
    draw_packing(path, Spheres(corners, [0.5, 0.5]), [[0, length] for length in size], pixels=300)
    drawn = (pixels_of(path) < 250).any(axis=2)
    for edge in (drawn[0], drawn[-1], drawn[:, 0], drawn[:, -1]):
        assert not edge.any()
    # The outermost rows hold the tip of a corner or of a sphere; a cut through the packing would
    # fill most of them.
    rows = np.flatnonzero(drawn.any(axis=1))
    assert drawn[rows[[0, -1]]].mean(axis=1).max() < 0.2
    assert [file.name for file in tmp_path.iterdir()] == ["packing.png"]


def test_colours_by_radius(tmp_path: Path) -> None:
    path = tmp_path / "packing.png"
    draw_packing(path, Spheres(CENTRES, [0.1, 0.2]), CONTAINER, pixels=300)
    red, green, blue = np.moveaxis(pixels_of(path), 2, 0)
    assert np.count_nonzero((red > 150) & (green > 150) & (blue < 100)) > 1000


def test_picture_without_lammps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lammps", None)
    with pytest.raises(PictureError, match="no picture: LAMMPS cannot be imported"):
        draw_packing(tmp_path / "packing.png", TWO, CONTAINER)


def test_picture_into_no_folder(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match="cannot be written"):
        draw_packing(tmp_path / "no" / "packing.png", TWO, CONTAINER, pixels=100)


def test_nothing_is_left_of_a_picture_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "packing.png").mkdir()
    with pytest.raises(PictureError, match=r"packing\.png: cannot be written: Is a directory"):
        draw_packing(tmp_path / "packing.png", TWO, CONTAINER, pixels=100)
    assert [path.name for path in tmp_path.iterdir()] == ["packing.png"]


def test_wrong_number_of_contacts(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"contacts must have shape \(2,\), not \(3,\)"):
        draw_packing(tmp_path / "packing.png", TWO, CONTAINER, [1, 2, 3])


def test_a_colour_for_no_contacts_at_all(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="share a colour must be at least 1, not 0"):
        draw_packing(tmp_path / "packing.png", TWO, CONTAINER, [1, 2], contacts_per_colour=0)
