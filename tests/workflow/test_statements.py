"""Statements of the documentation about stored results, computed again from their files alone.

Nothing of the report is used: numbers are read with h5py, and every mean and error is made here.
"""

from __future__ import annotations

import json
import math
import re
from typing import Any

import h5py
import numpy as np
import pytest

from tests.workflow.test_links import ROOT, documents

RESULTS = ROOT / "results"
# What the deck has where a result does not tell another value.
FORCE, STEP = 30.0, 0.01


def said() -> str:
    """Return the text of all documents but the changelog, each line break a space."""
    pages = (path for path in documents() if path.name != "CHANGELOG.md")
    return " ".join(" ".join((ROOT / path).read_text().split()) for path in pages)


def read(study: str) -> list[dict[str, Any]]:
    """Return of each result of a study its variables, its numbers and the contacts' shares."""
    found = []
    for path in sorted((RESULTS / study).glob("*.h5")):
        with h5py.File(path) as file:
            record = json.loads(file.attrs["record"])
            row = {"deck": record["deck"]} | record["stages"][0]["variables"]
            row |= {name: float(value[()]) for name, value in file["numbers"].items()}
            if "distribution/contacts" in file:
                row["shares"] = file["distribution/contacts"][()]
            found.append(row)
    assert found
    return found


def standard_error(values: Any) -> float:
    return float(np.std(values, ddof=1)) / math.sqrt(len(values))


def test_the_packing_depends_on_the_random_force() -> None:
    """By more than three standard errors, which is no chance in one comparison (Gauss: 0.3 %)."""
    phi: dict[float, list[float]] = {0.0: [], FORCE: []}
    for row in read("more-seeds"):
        phi[float(row["random_force"])].append(100 * row["packing_fraction"])
    assert [len(values) for values in phi.values()] == [36, 36]
    more = float(np.mean(phi[FORCE]) - np.mean(phi[0.0]))
    error = math.hypot(*(standard_error(values) for values in phi.values()))
    assert more > 3 * error
    text = said()
    assert "no trend with the force" not in text
    assert f"denser by {more:.2f} ± {error:.2f} percentage points" in text


def test_contacts_while_agitated_depend_on_the_time_step() -> None:
    drops: dict[float, list[float]] = {}
    for row in read("protocol"):
        if (float(row["random_force"]), float(row["drag"])) == (FORCE, 0.5):
            drop = row["coordination_number"] - row["coordination_number_agitated"]
            drops.setdefault(float(row["dt"]), []).append(drop)
    short, usual, long = (float(np.mean(drops[dt])) for dt in (STEP / 2, STEP, 2 * STEP))
    wanted = f"{short:.2f}, {usual:.2f} and {long:.2f} with steps of 0.005, 0.01 and 0.02"
    assert wanted in said()


def test_nobody_has_0_or_1_contacts_in_the_measuring_box() -> None:
    """The shares are those of the box: of the other spheres the files tell nothing."""
    runs = [row for row in read("dimers") if row["deck"] == "spheres"]
    assert len(runs) == 2
    for row in runs:
        assert row["particles_in_box"] < 0.2 * row["particles"]
        assert not np.pad(row["shares"], (0, 13))[[0, 1, 11, 12]].any()
    text = said()
    assert "None of 10,000 spheres has" not in text
    assert "No sphere in the measuring box has 0, 1, 11 or 12 contacts" in text


QUANTITIES = (
    ("packing_fraction", 100, 2, 3),
    ("packing_fraction_with_necks", 100, 2, 3),
    ("coordination_number", 1, 3, 4),
    ("neighbours", 1, 3, 4),
)


def by_aspect_ratio(name: str, factor: float) -> dict[float, list[float]]:
    """Return the values of a number at each aspect ratio; spheres are at 1."""
    found: dict[float, list[float]] = {}
    for row in read("dimers"):
        if name in row:
            aspect = 1.0 if row["deck"] == "spheres" else float(row["aspect_ratio"])
            found.setdefault(aspect, []).append(factor * row[name])
    return dict(sorted(found.items()))


def pooled_scatter(groups: dict[float, list[float]]) -> float:
    """Return the standard deviation that all groups share; each has two values."""
    assert {len(values) for values in groups.values()} == {2}
    return math.sqrt(float(np.mean([np.var(values, ddof=1) for values in groups.values()])))


def test_errors_of_two_runs_are_pooled() -> None:
    """Of two runs alone the scatter is near zero by chance in some rows: 0.0011 stood there."""
    text = said()
    cells: dict[float, list[str]] = {}
    for name, factor, digits, more in QUANTITIES:
        groups = by_aspect_ratio(name, factor)
        std = pooled_scatter(groups)
        scatter = f"± {std:.{digits}f} ({std / math.sqrt(2):.{more}f})"
        for aspect, values in groups.items():
            cells.setdefault(aspect, []).append(f"{np.mean(values):.{digits}f} {scatter}")
    assert len(cells) == 12
    for aspect, row in cells.items():
        if aspect == 1.0:
            # The necks are those of dimers.
            label, row = "1 (spheres)", [row[0], "\N{EN DASH}", *row[1:]]
        else:
            label = f"{aspect:g}"
        assert f"| {label} | 2 | {' | '.join(row)} |" in text


@pytest.mark.parametrize(("reach", "points"), [(1, "three"), (2, "five")])
def test_where_the_curve_with_necks_is_largest(reach: int, points: str) -> None:
    """By a parabola through as many points, with the pooled error of each."""
    groups = by_aspect_ratio("packing_fraction_with_necks", 100)
    x = np.array(list(groups))
    y = np.array([np.mean(values) for values in groups.values()])
    error = pooled_scatter(groups) / math.sqrt(2)
    middle = int(np.argmax(y))
    near = slice(middle - reach, middle + reach + 1)

    def top(values: Any) -> float:
        a, b, _ = np.polyfit(x[near], values, 2)
        return float(-b / (2 * a))

    # The error of a function of independent values: its slopes times their errors. A step of 1e-5
    # percentage points is small beside both; slopes by differences are known to far more digits.
    steps = 1e-5 * np.eye(2 * reach + 1)
    slopes = [(top(y[near] + step) - top(y[near] - step)) / 2e-5 for step in steps]
    uncertain = error * float(np.linalg.norm(slopes))
    words = f"through {points} points has its top at" if reach == 1 else f"through {points} at"
    assert f"{words} {top(y[near]):.2f} ± {uncertain:.2f}" in said()


# The page of the fix


def page() -> str:
    return " ".join((ROOT / "src_fix/doc/fix_inelastic.md").read_text().split())


def test_what_is_said_of_velocities_is_said_with_the_accuracy() -> None:
    """tests/fix/test_slow_contacts.py measures it."""
    text = page()
    assert "Nothing bounces: " not in text
    said = "a rigid contact of any speed separates with at most the part `accuracy`, a thousandth,"
    assert said in text


def test_the_number_of_contacts_shows_no_trend_with_the_time_step() -> None:
    """The page's own table, at each tolerance; rows of two time steps are independent."""
    lines = (ROOT / "src_fix/doc/fix_inelastic.md").read_text().splitlines()
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    number = re.compile(r"([\d.]+) ± [\d.]+ \(([\d.]+)\)")
    found: dict[str, list[tuple[float, float]]] = {}
    for row in cells:
        if len(row) == 6 and row[0] == "apgd" and (z := number.fullmatch(row[5])) is not None:
            found.setdefault(row[2], []).append((float(z[1]), float(z[2])))
    assert len(found) == 3
    for at_steps in found.values():
        assert len(at_steps) == 3
        low, high = min(at_steps), max(at_steps)
        assert high[0] - low[0] <= 2 * math.hypot(low[1], high[1])
    assert "z shows no trend with h." in page()


def test_newton_off_is_not_said_to_need_nothing() -> None:
    """What the fix does for it stands with it; tests/fix/test_scene_changes.py runs it."""
    text = page()
    assert "and any `newton`." not in text
    assert "LAMMPS then sizes its messages for the pair style alone" in text
