"""What public functions do not take: each says so in one line, as InputError."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from lammps_inelastic import analysis
from lammps_inelastic.analysis import InputError

BOX = [[0, 1]] * 3
CENTRE, RADIUS = [[0.5, 0.5, 0.5]], [0.3]
ONE = (analysis.Spheres(CENTRE, RADIUS), BOX)
FRAME = analysis.ParticleFrame(
    0,
    np.array([1]),
    np.array(CENTRE),
    None,
    np.array(RADIUS),
    None,
    analysis.Cell.of_box(BOX),
    None,
)
TEN = np.full(10, 0.5)
NOISE = analysis.RadialDistribution(np.array([0.0, 1.0]), np.array([1.0]), 1.0, 1)
NAN = math.nan

WRONG: dict[str, tuple[Callable[[], Any], str]] = {
    "points": (
        lambda: analysis.packing_fraction(*ONE, points=1.5),
        "the number of points must be a whole number, not 1.5",
    ),
    "no points": (
        lambda: (
            analysis.best_packing_fraction(*ONE, points=0)
            and analysis.measure_packing_fraction(*ONE, points=0)
        ),
        "the number of points must be at least 1, not 0",
    ),
    "seed": (
        lambda: analysis.packing_fraction(*ONE, seed=-1),
        "the seed must be at least 0, not -1",
    ),
    "seed of a function": (
        lambda: analysis.measure_evolution([FRAME], BOX, packing=analysis.monte_carlo(seed=-1)),
        "the seed must be at least 0",
    ),
    "seed of necks": (
        lambda: analysis.packing_fraction_with_necks(*ONE, seed=-1),
        "the seed must be at least 0",
    ),
    "seed of a profile": (
        lambda: analysis.wall_profile_monte_carlo(*ONE, wall="xlo", thickness=0.1, seed=-1),
        "the seed must be at least 0",
    ),
    "slabs": (
        lambda: analysis.wall_profile(*ONE, wall="xlo", thickness=1e-300),
        "slabs of 1e-300 are more than 1000000 in the box",
    ),
    "words": (
        lambda: analysis.packing_fraction(analysis.Spheres([["a", "b", "c"]], [1]), BOX),
        "positions must be",
    ),
    "rows": (
        lambda: analysis.packing_fraction(analysis.Spheres([[1, 2, 3], [4]], [1]), BOX),
        "an array of numbers",
    ),
    "parts of a contact": (
        lambda: analysis.contact_counts([[1, 2.5]], [1, 2]),
        "contact ids must be whole numbers",
    ),
    "a contact of nothing": (
        lambda: analysis.contact_counts([[1, NAN]], [1, 2]),
        "contact ids must be whole numbers",
    ),
    "a contact with itself": (
        lambda: analysis.contact_counts([[2, 1], [1, 1]], [1, 2]),
        "sphere 1 is in contact with itself",
    ),
    "the same id": (
        lambda: analysis.contact_counts([[1, 2]], [2, 1, 2]),
        "sphere 2 is there twice among the sphere ids",
    ),
    "a body's number": (lambda: analysis.group_spheres([0.5]), "bodies must be whole numbers"),
    "normals": (lambda: analysis.fabric_tensor([[NAN, 0, 0]]), "normals hold NaN or infinity"),
    "weights": (lambda: analysis.fabric_tensor([[1, 0, 0]], [math.inf]), "positive and finite"),
    "forces of a graph": (
        lambda: analysis.contact_graph(
            [[1, 2]], [1, 2], analysis.Spheres(np.eye(3)[:2], [0.1, 0.1]), [NAN]
        ),
        "forces hold NaN or infinity",
    ),
    "ids by distance": (
        lambda: analysis.contacts_by_distance(analysis.Spheres(np.eye(3), [1] * 3), 1).ids([1, 2]),
        "sphere ids must be those of all spheres",
    ),
    "bins": (lambda: analysis.force_distribution([1], bins=2.5), "bins must be a whole number"),
    "shells": (
        lambda: analysis.radial_distribution(ONE[0], BOX, largest=0.1, bins=0),
        "the number of shells must be at least 1",
    ),
    "bounds": (lambda: analysis.logarithmic_density([1], 1, 0.5), "must be 0 < low < high, not 1"),
    "far bounds": (lambda: analysis.power_law(TEN, 1e-300, 1e300), "must be 0 < low < high"),
    "near bounds": (lambda: analysis.power_law(TEN, 0.5, 0.5 + 1e-15), "power law"),
    "one end": (lambda: analysis.power_law(np.full(10, 1e-16), 1e-16, 1), "follow no power law"),
    "density of nothing": (lambda: analysis.logarithmic_density([NAN], 1, 2), "be finite"),
    "bins a decade": (lambda: analysis.logarithmic_density([1], 1, 2, 0), "must be at least 1"),
    "middles": (lambda: analysis.binned_exponent([1, 2], [1], 0, 3), "the same shape"),
    "middles that fall": (lambda: analysis.binned_exponent([2, 1], [1, 1], 0, 3), "ascending"),
    "heights": (lambda: analysis.local_ratios([1, 2], [0, NAN], 1), "heights hold NaN or infinity"),
    "layers": (lambda: analysis.local_ratios([1, 2], [0, 1], 1.5), "layers must be a whole number"),
    "left out": (
        lambda: analysis.small_gaps(
            analysis.Spheres(np.eye(3), [1] * 3), 1, left_out=np.array([True])
        ),
        "left_out must have shape (3,), not (1,)",
    ),
    "series": (
        lambda: analysis.plot_evolution(Figure().subplots(), [1, 2], [1]),
        "must have the same shape (k,)",
    ),
    "diameter": (
        lambda: analysis.plot_radial_distribution(Figure().subplots(), NOISE, diameter=0),
        "a diameter must be positive and finite, not 0",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_input(name: str) -> None:
    call, said = WRONG[name]
    with pytest.raises(InputError) as raised:
        call()
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


def test_wrong_input_of_files(tmp_path: Path) -> None:
    small = np.array(BOX) * 1e-9
    for name, write in {
        "voxels of 1e-10: they must be from": lambda: analysis.write_tiff(
            tmp_path / "a.tif", analysis.Spheres([[5e-10] * 3], [3e-10]), small, 1e-10
        ),
        "subdivisions must be a whole number": lambda: analysis.write_stl(
            tmp_path / "a.stl", ONE[0], subdivisions=1.5
        ),
        "more than 1e+08 faces": lambda: analysis.write_stl(
            tmp_path / "a.stl", ONE[0], subdivisions=10**12
        ),
        "id must be whole numbers": lambda: analysis.write_xyz(
            tmp_path / "a.xyz", ONE[0], ids=[1.5]
        ),
        "pixels must be at least 1": lambda: analysis.draw_packing(
            tmp_path / "a.png", *ONE, pixels=0
        ),
    }.items():
        with pytest.raises(InputError) as raised:
            write()
        assert name in str(raised.value)
    assert list(tmp_path.iterdir()) == []


def test_values_at_all_places_between_far_bounds_follow_a_power_law() -> None:
    """One whose exponentials would overflow: the mean of the logarithm is in the middle."""
    found = analysis.power_law(np.geomspace(1e-16, 1, 101), 1e-16, 1)
    assert found.exponent == pytest.approx(-1, abs=1e-9)
