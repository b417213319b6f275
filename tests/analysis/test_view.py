"""The page of a packing holds what it was given, in one file; bad input is one line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    Cell,
    InputError,
    PackingView,
    PictureError,
    Spheres,
    group_spheres,
    write_view,
)
from tests.helpers.view_page import array_of, packing_in


def some_spheres(count: int, seed: int = 1, scale: float = 1.0) -> Spheres:
    random = np.random.default_rng(seed)
    cell = Cell([-scale, 0, 0], np.diag([3, 2, 1]) * scale, (True, False, True))
    return Spheres(
        random.random((count, 3)) * scale, random.uniform(0.02, 0.05, count) * scale, cell=cell
    )


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e30])
def test_arrays_in_the_file_are_those_given(tmp_path: Path, scale: float) -> None:
    spheres = some_spheres(300, scale=scale)
    random = np.random.default_rng(2)
    contacts = random.random((700, 2, 3)) * scale
    walls = random.random((40, 2, 3)) * scale
    forces = random.normal(1, 1, 740)
    view = PackingView(
        spheres,
        ids=np.arange(300) * 1000 + 7,
        contacts=contacts,
        walls=walls,
        forces=forces,
        numbers={"speed": random.random(300), "contacts": random.integers(0, 12, 300)},
        title="a <b> & c",
    )
    path = tmp_path / "packing.html"
    write_view(path, view)
    packing = packing_in(path)
    assert packing["title"] == "a <b> & c"
    centre, size = np.array(packing["centre"]), packing["scale"]
    # Numbers of four bytes have a round-off of 6e-8, and coordinates are within half of the scale.
    places = centre + size * array_of(packing["positions"]).reshape(-1, 3).astype(float)
    np.testing.assert_allclose(places, spheres.positions, atol=6e-8 * size)
    np.testing.assert_allclose(
        size * array_of(packing["radii"]).astype(float), spheres.radii, rtol=1e-7
    )
    np.testing.assert_array_equal(array_of(packing["ids"]), np.arange(300) * 1000 + 7)
    assert packing["particle"] is None
    # Ends of lines are rounded to 1/65535 of their range, which is less than the scale.
    low, high = np.array(packing["range"]).T
    ends = low + (high - low) * array_of(packing["lines"]).reshape(-1, 2, 3) / 65535
    given = np.concatenate([contacts, walls])
    np.testing.assert_allclose(centre + size * ends, given, atol=0.51 / 65535 * size)
    assert packing["walls"] == 40
    strengths = array_of(packing["forces"]).astype(float) * packing["meanForce"]
    np.testing.assert_allclose(strengths, forces, rtol=1e-6)
    assert packing["pulls"]
    speed, counted = packing["numbers"]
    np.testing.assert_array_equal(array_of(speed), np.float32(view.numbers["speed"]))
    np.testing.assert_array_equal(array_of(counted), view.numbers["contacts"])
    assert (counted["type"], counted["whole"], counted["low"], counted["high"]) == ("u1", 1, 0, 11)
    assert spheres.cell is not None
    np.testing.assert_allclose(
        size * np.array(packing["cell"]["vectors"]), spheres.cell.vectors, atol=1e-12 * size
    )
    np.testing.assert_allclose(
        centre + size * np.array(packing["cell"]["origin"]), [-scale, 0, 0], atol=1e-12 * size
    )
    assert packing["cell"]["periodic"] == [True, False, True]


def test_spheres_of_a_body_have_its_number_and_free_ones_their_own(tmp_path: Path) -> None:
    places = np.random.default_rng(1).random((5, 3))
    spheres = Spheres(places, np.full(5, 0.1), group_spheres([7, 0, 7, 0, 0]))
    write_view(tmp_path / "packing.html", PackingView(spheres))
    packing = packing_in(tmp_path / "packing.html")
    np.testing.assert_array_equal(array_of(packing["particle"]), [7, 8, 7, 9, 10])
    assert packing["cell"] is None
    assert packing["forces"] is None


def test_the_page_needs_nothing_else_and_is_small(tmp_path: Path) -> None:
    """Ten thousand spheres with 28,000 contacts are below a megabyte."""
    count, contacts = 10_000, 28_000
    random = np.random.default_rng(1)
    view = PackingView(
        some_spheres(count),
        ids=np.arange(1, count + 1),
        contacts=random.random((contacts, 2, 3)),
        forces=random.random(contacts),
        numbers={"contacts": random.integers(0, 12, count), "speed": random.random(count)},
    )
    path = tmp_path / "packing.html"
    write_view(path, view)
    text = path.read_text()
    # 23 bytes a sphere and 16 a contact, four thirds of that in base64, and the page itself.
    assert 4 / 3 * (23 * count + 16 * contacts) < len(text) < 1e6
    without_data = re.sub(r'"data": "[^"]*"', "", text)
    assert len(without_data) < 70_000
    assert not re.search(r"https?:|//[a-z]|@import|src=|href=|fetch\(|import\(", without_data)
    assert "default-src 'none'" in text
    assert "{{" not in text


def test_few_high_values_do_not_use_up_the_colours(tmp_path: Path) -> None:
    values = np.linspace(0, 1, 100)
    values[-1] = 1000
    view = PackingView(some_spheres(100), numbers={"speed": values, "even": np.arange(100)})
    write_view(tmp_path / "packing.html", view)
    speed, even = packing_in(tmp_path / "packing.html")["numbers"]
    assert (speed["low"], speed["above"]) == (0, True)
    # 98 of 100 values are at most the 98th.
    assert speed["high"] == pytest.approx(values[98])
    assert (even["low"], even["high"], even["above"]) == (0, 99, False)


FOUR = some_spheres(4)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"ids": [1, 2]}, r"ids must have shape \(4,\), not \(2,\)"),
        ({"ids": [1, 2, 3, -4]}, "ids must not be negative, not -4"),
        ({"ids": [1, 2, 3, 4.5]}, "ids must be whole numbers"),
        ({"contacts": [[1, 2]]}, r"contacts must have shape \(m, 2, 3\), not \(1, 2\)"),
        ({"walls": np.full((1, 2, 3), np.nan)}, "walls hold NaN or infinity"),
        ({"forces": [1.0]}, r"forces must have shape \(0,\), not \(1,\)"),
        (
            {"contacts": np.zeros((1, 2, 3)), "forces": [np.inf]},
            r"forces must be finite and below 1e\+38",
        ),
        ({"numbers": {"speed": [1, 2]}}, r"speed must have shape \(4,\), not \(2,\)"),
        ({"numbers": {"speed": [1, 2, 3, np.nan]}}, "speed must be finite"),
        ({"numbers": {"speed": ["a"] * 4}}, "speed must be an array of numbers"),
    ],
)
def test_wrong_input(tmp_path: Path, wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as raised:
        write_view(tmp_path / "packing.html", PackingView(FOUR, **wrong))
    assert "\n" not in str(raised.value)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match=r"none/packing.html: cannot be written: No such file"):
        write_view(tmp_path / "none" / "packing.html", PackingView(FOUR))
