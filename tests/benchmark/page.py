"""How fast the page of a packing turns where the processor draws: 10,000 spheres, 28,000 contacts.

The spheres are a crystal whose contacts are chosen among all, with forces at random. The page is
dragged in Chromium, which draws by SwiftShader, at three sizes of the spheres. A picture in motion
takes as long as it may: what is left of it where time is short is its effort, 1 for all.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from lammps_inelastic.analysis import PackingView, Spheres, contacts_by_distance, write_view
from tests.helpers.programs import BROWSER, OPTIONS

SPHERES, CONTACTS = 10_000, 28_000
SECONDS, WARM_UP = 6.0, 2.0
SIZES = (1, 0.5, 0)
# Each picture's moment, milliseconds and effort are noted, beside drawing it.
NOTE = """() => {
  window.pictures = [];
  const drawn = draw;
  draw = (wanted) => { drawn(wanted); pictures.push([performance.now(), last.spent, wanted]); };
}"""


def measure() -> None:
    """Print pictures per second, the time of one, and its effort."""
    from playwright.sync_api import sync_playwright

    print(f"the page of {SPHERES:,} spheres and {CONTACTS:,} contacts, drawn by the processor")
    print(f"load of the machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder) / "packing.html"
        started = time.perf_counter()
        write_view(path, _crystal())
        size = path.stat().st_size / 1e6
        print(f"written in {time.perf_counter() - started:.2f} s: {size:.2f} MB")
        browser = playwright.chromium.launch(executable_path=shutil.which(BROWSER), args=OPTIONS)
        page = browser.new_page(viewport={"width": 1100, "height": 800})
        page.goto(path.as_uri())
        page.locator("canvas[data-state='at rest']").wait_for()
        page.evaluate(NOTE)
        for share in SIZES:
            page.locator("#size").fill(f"{share:g}")
            _report(share, _dragged(page))
        browser.close()


def _crystal() -> PackingView:
    cells = range(14)
    corners = np.array([*product(cells, cells, cells)], dtype=float)
    inside = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    places = (corners[:, None] + inside).reshape(-1, 3)
    places = places[np.argsort(places[:, 1], kind="stable")][:SPHERES]
    spheres = Spheres(places, np.full(SPHERES, np.sqrt(0.125)))
    touching = contacts_by_distance(spheres, 1e-6).sides
    random = np.random.default_rng(1)
    chosen = touching[random.permutation(len(touching))[:CONTACTS]]
    return PackingView(
        spheres,
        contacts=places[chosen],
        forces=random.exponential(1, CONTACTS),
        numbers={"contacts": np.bincount(chosen.ravel(), minlength=SPHERES)},
    )


def _dragged(page: Any) -> np.ndarray[Any, Any]:
    """Drag to and fro; return moment, milliseconds and effort of each picture, (k, 3)."""
    page.mouse.move(700, 400)
    page.mouse.down()
    page.evaluate("pictures.length = 0")
    end, step = time.monotonic() + WARM_UP + SECONDS, 0
    while time.monotonic() < end:
        page.mouse.move(700 + 100 * np.sin(step / 10), 400)
        step += 1
    pictures = np.array(page.evaluate("pictures"))
    page.mouse.up()
    page.locator("canvas[data-state='at rest']").wait_for()
    kept: np.ndarray[Any, Any] = pictures[pictures[:, 0] > pictures[0, 0] + 1000 * WARM_UP]
    return kept


def _report(share: float, pictures: np.ndarray[Any, Any]) -> None:
    seconds = (pictures[-1, 0] - pictures[0, 0]) / 1000
    _, milliseconds, effort = np.median(pictures, axis=0)
    print(
        f"sphere size {share:g}: {(len(pictures) - 1) / seconds:.1f} pictures a second, "
        f"{milliseconds:.0f} ms each, effort {effort:.2f}"
    )
