"""The page of a packing in a real browser: what its pixels show.

Chromium draws without a graphics card here, by SwiftShader. Pages are looked at along -z in
parallel projection unless a test says otherwise: then places are pixels, by a factor and a shift.
"""

from __future__ import annotations

import io
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from scipy import ndimage

from lammps_inelastic.analysis import Cell, PackingView, Spheres, group_spheres, write_view
from tests.helpers.lammps_run import LAUNCHER

pytestmark = pytest.mark.slow

WIDE, HIGH = 1000, 700
# The panel with the controls is so wide, and the small axes in the corner below are so large.
PANEL, AXES, FRAME = 290, 102, 4
Pixels = NDArray[np.int64]
VIRIDIS = matplotlib.colormaps["viridis"]


class Shown:
    """A page in the browser, and what one does with it."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def wait(self) -> None:
        """Wait for the picture at rest."""
        # What has just been asked for is shown in the next frame but one, if not before.
        frame = "new Promise((done) => requestAnimationFrame(() => setTimeout(done)))"
        self.page.evaluate(frame)
        self.page.locator("canvas[data-state='at rest']").wait_for()

    def pixels(self) -> Pixels:
        """Return what is right of the panel, (rows, columns, 3), without the small axes."""
        self.wait()
        return self.pixels_now()

    def pixels_now(self) -> Pixels:
        """Return the same without waiting for a picture at rest."""
        image = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        pixels = np.array(image).astype(np.int64)[:, PANEL:]
        pixels[-AXES:, -AXES:] = 255
        # Who uses the keyboard, a shift key too, is shown by a frame that it speaks to the packing.
        pixels[:FRAME] = pixels[-FRAME:] = pixels[:, -FRAME:] = 255
        return pixels

    def set(self, **values: float | bool | str) -> None:
        """Give values to controls by their ids, as a user's hand does; _ stands for -."""
        for name, value in values.items():
            control = self.page.locator(f"#{name.replace('_', '-')}")
            if isinstance(value, bool):
                control.set_checked(value)
            elif isinstance(value, str):
                control.select_option(label=value)
            else:
                control.fill(f"{value:g}")
        self.wait()

    def drag(self, dx: int, dy: int, **held: Any) -> None:
        """Drag the packing by so many pixels."""
        x, y = (PANEL + WIDE) // 2, HIGH // 2
        self.page.mouse.move(x, y)
        self.page.mouse.down(**held)
        self.page.mouse.move(x + dx, y + dy, steps=4)
        self.page.mouse.up(**held)
        self.wait()

    def text(self, name: str) -> str:
        return str(self.page.locator(f"#{name}").inner_text())


Show = Callable[..., Shown]


@pytest.fixture
def show(browser: Any, tmp_path: Path) -> Iterator[Show]:
    """Open the page of a packing; in the end see that nothing went wrong or left the machine."""
    contexts, asked, errors = [], [], []

    def opened(view: PackingView, *, front: bool = True, **options: Any) -> Shown:
        path = tmp_path / "packing.html"
        write_view(path, view)
        options = {"viewport": {"width": WIDE, "height": HIGH}, **options}
        context = browser.new_context(**options)
        contexts.append(context)
        page = context.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text))
        page.goto(path.as_uri())
        shown = Shown(page)
        if front:
            page.locator("#parallel").check()
            page.locator("#cell").uncheck() if view.spheres.cell is not None else None
            page.locator("[data-along=z]").click()
        shown.wait()
        return shown

    yield opened
    for context in contexts:
        context.close()
    assert errors == []
    assert [url for url in asked if not url.startswith("file:")] == []


def view_of(places: ArrayLike, radii: ArrayLike, **more: Any) -> PackingView:
    """Return spheres of the colours of the numbers 0, 1, 2, ... unless others are given."""
    places = np.asarray(places, dtype=float)
    values = {"number": np.arange(len(places))}
    spheres = Spheres(
        places,
        np.broadcast_to(radii, len(places)),
        more.pop("particles", None),
        more.pop("cell", None),
    )
    return PackingView(spheres, numbers=more.pop("numbers", values), **more)


def shade(number: int, count: int) -> NDArray[np.int64]:
    """Return the colour of a whole number among 0 to count - 1, of viridis."""
    return np.array(VIRIDIS(number / (count - 1), bytes=True)[:3]).astype(np.int64)


def place(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the middle of some pixels: to the right and up, pixels."""
    rows, columns = np.nonzero(mask)
    assert len(rows) > 20, f"{len(rows)} pixels"
    return np.array([columns.mean(), -rows.mean()])


def inked(pixels: Pixels) -> NDArray[np.bool_]:
    return np.asarray(pixels.min(axis=2) < 235)


def blobs(mask: NDArray[np.bool_], least: int = 30) -> list[tuple[NDArray[np.float64], int]]:
    """Return the connected parts of some pixels: their middles, as by `place`, and areas."""
    labels, count = ndimage.label(mask)
    parts = [labels == number for number in range(1, count + 1)]
    return [(place(part), int(part.sum())) for part in parts if part.sum() > least]


def colour_at(pixels: Pixels, at: ArrayLike) -> NDArray[np.int64]:
    """Return the colour at a place as `place` gives them."""
    x, y = np.asarray(at)
    colour: NDArray[np.int64] = pixels[round(-y), round(x)]
    return colour


def spheres_in(pixels: Pixels, count: int) -> dict[int, NDArray[np.float64]]:
    """Return where the middles of separate spheres are, by their numbers among 0 to count - 1.

    In its middle a sphere has the colour of its number.
    """
    found = {}
    for at, _ in blobs(inked(pixels)):
        apart = [np.abs(colour_at(pixels, at) - shade(one, count)).max() for one in range(count)]
        assert min(apart) < 6
        found[int(np.argmin(apart))] = at
    return found


def assert_alike(pixels: Pixels, others: Pixels) -> None:
    """See that two pictures are the same; edges may be smooth in one and rough in the other."""
    assert (np.abs(pixels - others).max(axis=2) > 100).mean() < 1e-3
    assert np.abs(pixels - others).mean() < 1


# Four colours that are told apart in any light: of 0, 3, 7 and 10 out of 0 to 10.
FAR_APART = [0, 3, 7, 10]


def test_x_is_to_the_right_and_y_up_as_in_lammps(show: Show) -> None:
    """From the front, in parallel projection, a picture is the positions times one factor."""
    places = np.array([[0, 0, 0], [2, 0, 0.3], [0, 1, -0.5], [2.2, 1.5, 0.1]])
    found = spheres_in(show(view_of(places, 0.3)).pixels(), 4)
    seen = np.array([found[number] for number in range(4)])
    apart, wanted = seen - seen[0], places[:, :2] - places[0, :2]
    factor = (apart * wanted).sum() / (wanted**2).sum()
    assert factor > 50
    # Middles of discs are known to half a pixel.
    np.testing.assert_allclose(apart, factor * wanted, atol=0.8)


def test_near_spheres_hide_far_ones_and_a_half_turn_shows_them(show: Show) -> None:
    shown = show(view_of([[0, 0, 1], [0, 0, -1], [3, 0, 0]], 0.5))
    assert sorted(spheres_in(shown.pixels(), 3)) == [0, 2]
    # A pixel turns it by 0.008: half a turn.
    shown.drag(round(np.pi / 0.008 / 2), 0)
    shown.drag(round(np.pi / 0.008 / 2), 0)
    assert sorted(spheres_in(shown.pixels(), 3)) == [1, 2]


def test_overlapping_spheres_meet_in_their_true_circle(show: Show) -> None:
    """Of two spheres of one size, side by side, each shows its half: the boundary is straight."""
    pixels = show(view_of([[-0.3, 0, 0], [0.3, 0, 0]], 1.0)).pixels()
    rows, columns = np.nonzero(inked(pixels))
    border, factor = columns.mean(), np.ptp(columns) / 2.6
    # The circle's radius is sqrt(1 - 0.3^2); near its ends both sides are edges of the picture.
    assert np.ptp(rows) == pytest.approx(2 * factor, abs=2)
    half = round(0.93 * factor)
    middle = round(rows.mean())
    _, green, blue = np.moveaxis(pixels[middle - half : middle + half], 2, 0)
    # Violet has more blue than green, yellow less, in any light.
    assert (blue > green)[:, round(border) - 3].all()
    assert (blue < green)[:, round(border) + 3].all()


def test_dragging_turns_the_near_side_along(show: Show) -> None:
    view = view_of([[0, 0, 1], [0, 0, -1], [0, 1.5, 0], [0, -1.5, 0]], 0.2)
    shown = show(view)
    before = spheres_in(shown.pixels(), 4)[0]
    shown.drag(40, 0)
    right = spheres_in(shown.pixels(), 4)
    assert right[0][0] > before[0] + 15
    assert right[1][0] < before[0] - 15
    np.testing.assert_allclose([right[0][1], right[2][0]], [before[1], before[0]], atol=1)
    shown.page.locator("[data-along=z]").click()
    shown.drag(0, 40)
    down = spheres_in(shown.pixels(), 4)
    assert down[0][1] < before[1] - 15
    np.testing.assert_allclose(down[0][0], before[0], atol=1)


def test_wheel_zooms_shift_moves_and_a_double_click_resets(show: Show) -> None:
    shown = show(view_of([[0, 0, 0], [1, 0.5, 0.2]], 0.3), front=False)
    shown.set(parallel=True)
    first = shown.pixels()
    size, at = inked(first).sum(), place(inked(first))
    shown.page.mouse.move(600, 350)
    shown.page.mouse.wheel(0, -300)
    shown.wait()
    # exp(0.3) along each side.
    assert inked(shown.pixels()).sum() == pytest.approx(np.exp(0.6) * size, rel=0.1)
    shown.page.mouse.dblclick(900, 650)
    assert_alike(shown.pixels(), first)
    shown.page.keyboard.down("Shift")
    shown.drag(40, -25)
    shown.page.keyboard.up("Shift")
    np.testing.assert_allclose(place(inked(shown.pixels())) - at, [40, 25], atol=2)
    shown.page.locator("#reset").click()
    assert_alike(shown.pixels(), first)
    shown.drag(-30, 10, button="right")
    np.testing.assert_allclose(place(inked(shown.pixels())) - at, [-30, -10], atol=2)


def test_the_size_of_spheres(show: Show) -> None:
    shown = show(view_of([[0, 0, 0], [2, 0, 0]], 0.9))
    full = inked(shown.pixels()).sum()
    for size in (0.5, 0.2):
        shown.set(size=size)
        assert inked(shown.pixels()).sum() == pytest.approx(size**2 * full, rel=0.03)
    shown.set(size=0)
    assert inked(shown.pixels()).sum() == 0


@pytest.mark.parametrize("axis", "xyz")
def test_a_cut_shows_the_inside_at_the_cutting_plane(show: Show, axis: str) -> None:
    """Two spheres in a row along the axis; a third one makes the packing three lengths long."""
    along = "xyz".index(axis)
    places = np.zeros((3, 3))
    places[:, along] = [0, 1, 2]
    shown = show(view_of(places, 0.5))
    shown.page.locator(f"[data-along={axis}]").click()
    disc = int(inked(shown.pixels()).sum())
    # The nearest sphere is cut off, and the middle one in its middle. The cut is a quarter paler
    # than the colour of that sphere, and faces the viewer.
    shown.set(**{f"cut_{axis}_to": 500})
    assert shown.text(f"cut-{axis}-now") == "-0.5 to 1"
    pixels = shown.pixels()
    ((at, area),) = blobs(inked(pixels))
    assert area == pytest.approx(disc, rel=0.02)
    pale = shade(1, 3) * 0.75 + 255 * 0.25
    np.testing.assert_allclose(colour_at(pixels, at), pale, atol=2)
    # All of the disc is flat.
    flat = np.abs(pixels - pale).max(axis=2) < 3
    assert flat.sum() == pytest.approx(disc, rel=0.03)
    # Cut at 0.75 from the middle of the far one the disc is smaller, and around it there is a rim.
    shown.set(**{f"cut_{axis}_to": 250})
    assert shown.text(f"cut-{axis}-now") == "-0.5 to 0.25"
    pixels = shown.pixels()
    pale = shade(0, 3) * 0.75 + 255 * 0.25
    flat = np.abs(pixels - pale).max(axis=2) < 3
    assert flat.sum() == pytest.approx(0.75 * disc, rel=0.03)
    assert inked(pixels).sum() == pytest.approx(disc, rel=0.02)
    # From the other side: what is left of the nearest sphere is a cap, 0.3 high.
    shown.set(**{f"cut_{axis}_to": 1000, f"cut_{axis}_from": 900})
    pixels = shown.pixels()
    assert inked(pixels).sum() == pytest.approx((0.5**2 - 0.2**2) / 0.5**2 * disc, rel=0.03)
    assert list(spheres_in(pixels, 3)) == [2]


def test_cut_spheres_may_be_left_whole(show: Show) -> None:
    shown = show(view_of([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 0.5))
    shown.set(cut_x_to=400)
    assert inked(shown.pixels()).any()
    shown.set(whole=True)
    # The plane at 0.7 leaves the first sphere alone, the middle one goes: its centre is at 1.
    ((_, area),) = blobs(inked(shown.pixels()))
    shown.set(cut_x_to=1000)
    assert area == pytest.approx(inked(shown.pixels()).sum() / 3, rel=0.02)


# A triangle of three spheres with two contacts, and one sphere with a contact with the floor.
TRIANGLE = np.array([[0.0, 0, 0], [2, 0, 0], [1, 1.5, 0], [3.2, 0.8, 0]])
FLOOR = np.array([[TRIANGLE[3], [3.2, 0.2, 0]]])


def with_forces(forces: ArrayLike) -> PackingView:
    lines = TRIANGLE[[[0, 1], [1, 2]]]
    return view_of(TRIANGLE, 0.4, contacts=lines, walls=FLOOR, forces=forces)


def scale_of(shown: Shown) -> tuple[NDArray[np.float64], float]:
    """Return where the origin is in the picture, and the pixels of a length, of the triangle."""
    pixels = shown.pixels()
    rows, columns = np.nonzero(inked(pixels))
    factor = (columns.max() - columns.min() + 1) / (3.2 + 0.8)
    return np.array([columns.min() + 0.4 * factor, rows.max() + 1 - 0.4 * factor]), factor


def width_across(pixels: Pixels, start: ArrayLike, end: ArrayLike) -> int:
    """Count the pixels of a line that one meets who crosses it in its middle."""
    one, other = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    across = (other - one)[::-1] * [1, -1] / np.linalg.norm(other - one)
    steps = np.arange(-40, 40.0, 0.5)
    points = np.round((one + other) / 2 + steps[:, None] * across).astype(int)
    return int(inked(pixels)[points[:, 1], points[:, 0]].sum()) // 2


def test_forces_are_where_contacts_are_and_as_thick_as_they_are_strong(show: Show) -> None:
    shown = show(with_forces([3, 1.5, 1.5]))
    origin, factor = scale_of(shown)
    shown.set(size=0)
    pixels = shown.pixels()
    ends = origin + factor * TRIANGLE[:, :2] * [1, -1]
    floor = origin + factor * FLOOR[0, :, :2] * [1, -1]
    strong, weak = width_across(pixels, *ends[[0, 1]]), width_across(pixels, *ends[[1, 2]])
    assert width_across(pixels, *ends[[0, 2]]) == 0
    # The mean force is 2; four times that has a radius of 0.4 mean radii. An edge may be a pixel
    # wide on both sides, and slanting ones are met in steps.
    assert strong == pytest.approx(2 * 0.4 * 0.4 * 1.5 / 4 * factor, abs=2.5)
    assert weak == pytest.approx(strong / 2, abs=2.5)
    assert width_across(pixels, *floor) == pytest.approx(weak, abs=2.5)
    # Nothing reaches through the floor.
    below = np.nonzero(inked(pixels)[:, int(floor[0, 0]) - 5 : int(floor[0, 0]) + 5])[0].max()
    assert below == pytest.approx(floor[1, 1], abs=1.5)
    # Stronger forces are darker.
    middle = [
        pixels[tuple(np.round(ends[pair].mean(axis=0)[::-1]).astype(int))]
        for pair in ([0, 1], [1, 2])
    ]
    assert middle[0].sum() < middle[1].sum() - 30


def test_weak_forces_can_be_left_out_and_pulling_ones_are_blue(show: Show) -> None:
    shown = show(with_forces([3, -1.5, 0.5]))
    origin, factor = scale_of(shown)
    ends = origin + factor * TRIANGLE[:, :2] * [1, -1]
    floor = origin + factor * FLOOR[0, :, :2] * [1, -1]
    shown.set(size=0)
    pixels = shown.pixels()
    red, _, blue = pixels[tuple(np.round(ends[[1, 2]].mean(axis=0)[::-1]).astype(int))]
    assert blue > red + 40
    assert "contacts that pull" in shown.text("force-colours")
    assert "which is 1.67" in shown.text("force-colours")
    assert width_across(pixels, *floor) > 0
    # In units of the mean strength they are 1.8, 0.9 and 0.3.
    for threshold, seen in ((0.6, [1, 1, 0]), (1.2, [1, 0, 0]), (2.4, [0, 0, 0])):
        shown.set(threshold=threshold)
        pixels = shown.pixels()
        lines = (ends[[0, 1]], ends[[1, 2]], floor)
        assert [int(width_across(pixels, *line) > 0) for line in lines] == seen
    shown.set(threshold=0, forces=False)
    assert not inked(shown.pixels()).any()


def test_contacts_without_forces_are_lines_of_one_kind(show: Show) -> None:
    view = view_of(TRIANGLE, 0.4, contacts=TRIANGLE[[[0, 1], [1, 2]]])
    shown = show(view)
    origin, factor = scale_of(shown)
    ends = origin + factor * TRIANGLE[:, :2] * [1, -1]
    shown.set(size=0)
    pixels = shown.pixels()
    widths = [width_across(pixels, *ends[pair]) for pair in ([0, 1], [1, 2])]
    assert widths[0] == pytest.approx(widths[1], abs=1)
    assert widths[0] > 1
    assert not shown.page.locator("#threshold").is_visible()


def test_periodic_images_are_those_of_the_cell(show: Show) -> None:
    """One sphere in a tilted cell, periodic along a and b alone: eight images around it, paler."""
    vectors = np.array([[2.0, 0, 0], [0.7, 1.5, 0], [0, 0, 3]])
    shown = show(
        view_of(
            [[1.2, 0.8, 1], [1.5, 0.9, 1]],
            0.2,
            cell=Cell([0, 0, 0], vectors, (True, True, False)),
            particles=group_spheres([1, 1]),
            numbers={"shade": [0, 0]},
        )
    )
    assert len(blobs(inked(shown.pixels()))) == 1
    shown.page.evaluate("view.distance *= 8")
    shown.set(images=True)
    assert "one layer" in shown.text("images-now")
    pixels = shown.pixels()
    found = blobs(inked(pixels), least=5)
    assert len(found) == 9
    darkness = [255 * 3 - colour_at(pixels, at).sum() for at, _ in found]
    centre = int(np.argmax(darkness))
    # Spheres are some pixels wide: their edges make the difference less than the twofold.
    assert darkness[centre] > 1.2 * sorted(darkness)[-2]
    moves = np.array([middle - found[centre][0] for middle, _ in found])
    wanted = np.array([i * vectors[0] + j * vectors[1] for i in (-1, 0, 1) for j in (-1, 0, 1)])
    factor = np.abs(moves).max(axis=0)[1] / 1.5
    for one in wanted[:, :2] * factor:
        assert np.linalg.norm(moves - one, axis=1).min() < 1.5
    shown.set(images=False)
    assert len(blobs(inked(shown.pixels()), least=5)) == 1


def test_only_images_near_the_cell_are_drawn_of_many_spheres(show: Show) -> None:
    random = np.random.default_rng(1)
    cell = Cell([0, 0, 0], np.eye(3), (True, True, True))
    shown = show(view_of(random.random((10_000, 3)), 0.02, cell=cell))
    shown.set(images=True)
    drawn = shown.page.evaluate("count + imagesOfSpheres.length")
    assert 20_000 < drawn < 45_000
    assert "those within" in shown.text("images-now")


def test_the_edges_of_the_cell(show: Show) -> None:
    """From the front a tilted cell is a parallelogram."""
    vectors = np.array([[2.0, 0, 0], [0.7, 1.5, 0], [0, 0, 1]])
    shown = show(view_of([[0, 0, 0.5], [2.7, 1.5, 0.5]], 0.1, cell=Cell([0, 0, 0], vectors)))
    seen = blobs(inked(shown.pixels()))
    shown.set(cell=True, size=0)
    dark = inked(shown.pixels())
    low, high = sorted((at for at, _ in seen), key=lambda at: at[0])
    factor = (high - low)[0] / 2.7
    for start, end in (((0, 0), (2, 0)), ((2, 0), (2.7, 1.5)), ((0, 0), (0.7, 1.5))):
        for share in (0.2, 0.5, 0.8):
            x, y = low + factor * (np.array(start) * (1 - share) + np.array(end) * share)
            assert dark[round(-y) - 1 : round(-y) + 2, round(x) - 1 : round(x) + 2].any()
    x, y = low + factor * np.array([1.35, 0.75])
    assert not dark[round(-y), round(x)]


def swatches(shown: Shown) -> list[tuple[str, list[int]]]:
    """Return the labels of the legend with their colours."""
    found: list[tuple[str, list[int]]] = shown.page.evaluate(
        """[...document.querySelectorAll("#colours .swatches span")].map((one) => [one.innerText,
           getComputedStyle(one.firstChild).backgroundColor.match(/\\d+/g).map(Number)])"""
    )
    return found


def test_colours_are_those_of_the_legend(show: Show) -> None:
    """In the middle of a sphere the colour is that of its number in the legend, and of viridis."""
    count = 8
    places = np.column_stack([np.arange(count) % 4, np.arange(count) // 4, np.zeros(count)])
    speeds = np.linspace(0, 3e-4, count) ** 2
    shown = show(view_of(places, 0.4, numbers={"contacts": np.arange(count), "speed": speeds}))
    legend = swatches(shown)
    assert [label for label, _ in legend] == [str(number) for number in range(count)]

    def middles() -> list[NDArray[np.int64]]:
        pixels = shown.pixels()
        mask = inked(pixels)
        rows, columns = np.nonzero(mask)
        factor = (columns.max() - columns.min() + 1) / 3.8
        left, bottom = columns.min() + 0.4 * factor, rows.max() - 0.4 * factor
        return [pixels[round(bottom - y * factor), round(left + x * factor)] for x, y, _ in places]

    # Round-off of colours, and light that changes by a hundredth within a pixel of the middle.
    for number, pixel in enumerate(middles()):
        np.testing.assert_allclose(pixel, legend[number][1], atol=4)
        np.testing.assert_allclose(legend[number][1], shade(number, count), atol=3)
    shown.set(colour="speed")
    assert shown.text("colours").split() == ["0", "4.5e-8", "9e-8"]
    for speed, pixel in zip(speeds, middles(), strict=True):
        wanted = np.array(VIRIDIS(speed / speeds[-1], bytes=True)[:3])
        np.testing.assert_allclose(pixel, wanted, atol=5)


def test_many_whole_numbers_share_colours(show: Show) -> None:
    places = np.column_stack([np.arange(23), np.zeros(23), np.zeros(23)])
    shown = show(view_of(places, 0.4, numbers={"contacts": np.arange(23)}))
    labels = [label for label, _ in swatches(shown)]
    assert labels[:2] == ["0-2", "3-5"]
    assert labels[-1] == "21-23"


def test_bodies_have_one_colour_each(show: Show) -> None:
    at = [(0, 0), (0.5, 0), (2, 0), (2.5, 0), (1.2, 1)]
    shown = show(view_of([(*one, 0) for one in at], 0.4, particles=group_spheres([5, 5, 6, 6, 0])))
    shown.set(colour="body")
    assert "each body" in shown.text("colours")
    pixels = shown.pixels()
    rows, columns = np.nonzero(inked(pixels))
    factor = np.ptp(columns) / 3.3
    left, bottom = columns.min() + 0.4 * factor, rows.max() - 0.4 * factor
    colours = [colour_at(pixels, (left + x * factor, y * factor - bottom)) for x, y in at]
    # Round-off, and light that changes by a hundredth within a pixel of the middle.
    for one, other in ((0, 1), (2, 3)):
        np.testing.assert_allclose(colours[one], colours[other], atol=6)
    for one, other in ((0, 2), (0, 4), (2, 4)):
        assert np.abs(colours[one] - colours[other]).max() > 40


def test_a_click_tells_what_a_sphere_is(show: Show) -> None:
    places = [[0, 0, 0], [1.25, 0, 0], [1.25, 0, -1]]
    shown = show(view_of(places, 0.5, ids=[70, 71, 72], numbers={"contacts": [3, 5, 4]}))
    found = blobs(inked(shown.pixels()))
    (left, right) = sorted((at for at, _ in found), key=lambda at: at[0])
    shown.page.mouse.click(PANEL + right[0], -right[1])
    shown.wait()
    assert shown.text("picked").split("\n") == [
        "sphere 71", "radius 0.5", "centre 1.25, 0, 0", "contacts 5",
    ]  # fmt: skip
    shown.set(cut_z_to=400)
    shown.page.mouse.click(PANEL + right[0], -right[1])
    shown.wait()
    assert shown.text("picked").startswith("sphere 72")
    shown.page.mouse.click(PANEL + 5, 600)
    shown.wait()
    assert shown.text("picked") == ""
    assert left[0] < right[0]


def test_keys_turn_and_reach_every_control(show: Show) -> None:
    shown = show(with_forces([3, 1, 1]))
    before = shown.pixels()
    shown.page.locator("canvas").focus()
    for _ in range(4):
        shown.page.keyboard.press("ArrowRight")
    turned = shown.pixels()
    assert np.abs(turned - before).max() > 50
    reached = set()
    for _ in range(30):
        shown.page.keyboard.press("Tab")
        reached.add(
            shown.page.evaluate("document.activeElement.id || document.activeElement.tagName")
        )
    controls = shown.page.evaluate(
        """[...document.querySelectorAll("input, select, button")]
           .filter((one) => one.offsetParent).map((one) => one.id || one.tagName)"""
    )
    assert len(controls) > 12
    assert set(controls) <= reached
    unnamed = shown.page.evaluate(
        """[...document.querySelectorAll("input, select")].filter((one) => one.offsetParent
           && !one.labels.length && !one.getAttribute("aria-label")).map((one) => one.id)"""
    )
    assert unnamed == []


def test_without_webgl_the_page_says_so(browser: Any, tmp_path: Path) -> None:
    write_view(tmp_path / "packing.html", with_forces([1, 1, 1]))
    page = browser.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto((tmp_path / "packing.html").as_uri())
    assert "draws no WebGL 2" in page.locator("#message").inner_text()
    assert errors == []
    page.close()


def test_two_fingers_zoom_on_a_telephone(show: Show) -> None:
    """The panel is folded up there, and leaves room for the packing."""
    shown = show(
        with_forces([1, 1, 1]),
        front=False,
        viewport={"width": 390, "height": 800},
        has_touch=True,
        is_mobile=True,
    )
    assert not shown.page.locator("#size").is_visible()

    def seen() -> int:
        shown.wait()
        image = Image.open(io.BytesIO(shown.page.screenshot(scale="css"))).convert("RGB")
        # Neither the title above nor the small axes below.
        return int(inked(np.asarray(image).astype(np.int64))[100:-110].sum())

    before = seen()
    assert before > 1000
    session = shown.page.context.new_cdp_session(shown.page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        there = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": there})

    touch("touchStart", (180, 400))
    touch("touchStart", (180, 400), (220, 400))
    for spread in (25, 30, 26):
        touch("touchMove", (200 - spread, 400), (200 + spread, 400))
    touch("touchEnd")
    # From 40 to 52 pixels apart.
    assert seen() == pytest.approx(1.3**2 * before, rel=0.15)


def test_what_is_hidden_can_be_left_out_without_a_trace(show: Show) -> None:
    """Where drawing is slow, hidden spheres are not drawn: the picture is the same to a pixel."""
    random = np.random.default_rng(3)
    places = random.random((1500, 3))
    lines = places[random.integers(0, 1500, (2000, 2))]
    near = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1) < 0.2
    view = view_of(
        places,
        random.uniform(0.03, 0.07, 1500),
        contacts=lines[near],
        forces=random.random(near.sum()) * 3,
        numbers={"shade": random.integers(0, 11, 1500)},
    )
    shown = show(view, front=False)
    script = """([hide, all]) => {
      hiding = hide;
      if (all) for (const crowd of [shapes.spheres, shapes.lines]) crowd.fill(crowd.data);
      draw(1);
      return [shapes.spheres.total, shapes.lines.total];
    }"""

    def drawn(hide: bool) -> tuple[Pixels, list[int]]:
        totals = shown.page.evaluate(script, [hide, not hide])
        return shown.pixels_now(), totals

    left_out = []
    for turn, settings in enumerate(
        [{}, {"parallel": True}, {"size": 0.7}, {"cut_z_to": 600, "size": 1}, {"whole": True}]
    ):
        shown.set(**settings)
        shown.page.evaluate("([n]) => { view.azimuth += 0.7 * n; view.distance *= 0.85; }", [turn])
        every, totals = drawn(False)
        assert totals == [1500, near.sum()]
        some, fewer = drawn(True)
        np.testing.assert_array_equal(some, every)
        left_out.append(1 - fewer[0] / 1500)
    assert max(left_out) > 0.4


def test_ten_thousand_spheres_turn(show: Show) -> None:
    random = np.random.default_rng(1)
    places = random.random((10_000, 3))
    # Each with three others, wherever they are: nothing is looked at but how many there are.
    lines = np.concatenate([np.stack([places[:-k], places[k:]], axis=1) for k in (1, 2, 3)])
    forces = random.exponential(1, 28_000)
    view = view_of(places, 0.025, contacts=lines[:28_000], forces=forces)
    shown = show(view, front=False)
    # In motion the strongest forces are drawn where there is no time for all: they come first.
    strengths = shown.page.evaluate(
        "Array.from(shapes.lines.data.places).filter((_, i) => i % 8 === 7)"
    )
    assert len(strengths) == 28_000
    assert (np.diff(strengths) <= 0).all()
    before = shown.pixels()
    shown.drag(80, 20)
    assert (np.abs(shown.pixels() - before).max(axis=2) > 30).mean() > 0.1


LAMMPS_IMAGE = """
units lj
atom_style sphere
boundary f f f
region all block -3 3 -3 3 -3 3
create_box 4 all
{atoms}
{sizes}
pair_style zero 1
pair_coeff * *
run 0
write_dump all image out.ppm type diameter size 700 700 view {theta} {phi} up 0 1 0 zoom 1.2 &
  shiny 0 fsaa no box no 0 axes no 0 0 modify backcolor white {colours}
"""


@pytest.mark.parametrize(("theta", "phi"), [(0, 0), (70, 25), (110, -60)])
def test_it_looks_as_lammps_draws_it(show: Show, tmp_path: Path, theta: int, phi: int) -> None:
    """`dump image` from the same side: the same colours in the same places, nothing mirrored."""
    random = np.random.default_rng(5)
    places = random.uniform(-2, 2, (40, 3))
    radii = random.uniform(0.3, 0.7, 40)
    kinds = random.integers(0, 4, 40)
    shades = np.array(FAR_APART)[kinds]
    deck = LAMMPS_IMAGE.format(
        atoms="\n".join(
            f"create_atoms {kind + 1} single {x!r} {y!r} {z!r}"
            for kind, (x, y, z) in zip(kinds, places.tolist(), strict=True)
        ),
        sizes="\n".join(
            f"set atom {number} diameter {2 * radius!r}"
            for number, radius in enumerate(radii.tolist(), 1)
        ),
        theta=theta,
        phi=phi,
        colours=" ".join(
            f"color shade{kind} {' '.join(f'{part / 255:.4f}' for part in shade(number, 11))}"
            for kind, number in enumerate(FAR_APART)
        )
        + " "
        + " ".join(f"acolor {kind + 1} shade{kind}" for kind in range(4)),
    )
    (tmp_path / "image.in").write_text(deck)
    command = [*LAUNCHER, "-in", "image.in", "-log", "none"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    theirs = kinds_in(np.asarray(Image.open(tmp_path / "out.ppm").convert("RGB")).astype(np.int64))

    shown = show(view_of(places, radii, numbers={"shade": shades}))
    # LAMMPS: theta from the z-axis, phi from the x-axis, both of the direction to the viewer.
    one, other = np.radians([theta, phi])
    x, y, z = np.sin(one) * np.cos(other), np.sin(one) * np.sin(other), np.cos(one)
    shown.page.evaluate(
        "([a, e]) => { view.azimuth = a; view.elevation = e; redraw(); }",
        [float(np.arctan2(x, z)), float(np.arcsin(y))],
    )
    ours = kinds_in(shown.pixels())
    size = tuple(np.max([theirs.shape, ours.shape], axis=0)[::-1])
    one_size = [
        np.asarray(Image.fromarray(kinds).resize(size, Image.Resampling.NEAREST))
        for kinds in (theirs, ours)
    ]
    same = one_size[0] == one_size[1]
    both = (one_size[0] > 0) & (one_size[1] > 0)
    # Edges differ by a pixel or two, and where a sphere lies in shadow its colour is not certain.
    assert same.mean() > 0.93
    assert same[both].mean() > 0.96
    assert both.mean() > 0.4
    mirrored = one_size[0] == one_size[1][:, ::-1]
    assert mirrored[both].mean() < 0.8


def kinds_in(pixels: Pixels) -> NDArray[np.uint8]:
    """Return which of four colours each pixel has, 1 to 4, 0 for white, without white margins."""
    rows, columns = np.nonzero(inked(pixels))
    cut = pixels[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    shares = cut / np.maximum(cut.sum(axis=2, keepdims=True), 1)
    wanted = np.array([shade(number, 11) / shade(number, 11).sum() for number in FAR_APART])
    nearest = np.abs(shares[:, :, None] - wanted).sum(axis=3).argmin(axis=2) + 1
    return np.where(inked(cut), nearest, 0).astype(np.uint8)
