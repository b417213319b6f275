"""Contact forces: whose they are, and densities that are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from lammps_inelastic.analysis import (
    InputError,
    contacts_of,
    force_distribution,
    group_spheres,
    plot_force_distribution,
)

CONTACTS = [[10, 20], [30, 20], [10, -3], [40, -1], [40, 30]]
IDS = [10, 20, 30, 40]


def test_contacts_of_chosen_particles() -> None:
    chosen = [True, False, False, False]
    assert contacts_of(chosen, CONTACTS, IDS).tolist() == [True, False, False, False, False]
    with_walls = contacts_of(chosen, CONTACTS, IDS, walls=True)
    assert with_walls.tolist() == [True, False, True, False, False]


def test_contacts_of_chosen_bodies() -> None:
    particles = group_spheres([5, 5, 0, 0])
    contacts = [[20, 30], [30, 40], [10, -3]]
    chosen = [True, False, False]
    assert contacts_of(chosen, contacts, IDS, particles).tolist() == [True, False, False]


def test_four_forces() -> None:
    found = force_distribution([1, 1, 1, 5], bins=4, largest=2)
    assert (found.mean, found.contacts) == (2, 4)
    assert found.edges.tolist() == [0, 0.5, 1, 1.5, 2]
    # Three at half the mean, in a bin 0.5 wide; the fourth, at 2.5, is beyond the last bin.
    assert found.density.tolist() == [0, 3 / 4 / 0.5, 0, 0]
    assert found.standard_errors == pytest.approx([0, np.sqrt(3) / 2, 0, 0], rel=1e-15)


def test_exponential_distribution() -> None:
    forces = np.random.default_rng(1).exponential(7.0, 100_000)
    found = force_distribution(forces, bins=20, largest=4)
    assert found.mean == pytest.approx(7, rel=4 / np.sqrt(100_000))
    exact = (np.exp(-found.edges[:-1]) - np.exp(-found.edges[1:])) / np.diff(found.edges)
    # Twenty bins: one in 16,000 is beyond four standard errors by chance; the seed is fixed. The
    # mean is measured too, which moves f / <f> by 0.3 %.
    assert np.abs(found.density - exact).max() < 4 * found.standard_errors.max()
    # What is stronger than four times the mean is missing.
    integral = (found.density * np.diff(found.edges)).sum()
    assert integral == pytest.approx(1 - np.exp(-4), abs=0.003)


def test_plot() -> None:
    ax = Figure().add_subplot()
    found = force_distribution([1, 1, 1, 5], bins=4, largest=4)
    assert plot_force_distribution(ax, found) is ax
    assert ax.get_yscale() == "log"
    # Empty bins are left out.
    assert ax.lines[0].get_xdata().tolist() == [0.5, 2.5]
    # An error as large as its value ends at 0, which is not on this axis: the bar is cut, it stays.
    (bars,) = ax.collections
    for (_, low), (_, high) in bars.get_segments():
        assert 0 < low < high
    # Nothing within the range: nothing to draw.
    none = force_distribution([1, 1], bins=1, largest=0.5)
    assert len(plot_force_distribution(Figure().subplots(), none).lines[0].get_xdata()) == 0


def test_forces_that_pull() -> None:
    """The mean is that of the strengths, and as many bins go down as up."""
    both = force_distribution([1, 1, -2, 4], bins=2, largest=4)
    assert both.mean == 2.0
    assert both.edges.tolist() == [-4, -2, 0, 2, 4]
    # Three of the four in [0, 2) or [2, 4], in mean forces: 0.5, 0.5 and 2; -1 pulls.
    assert both.density.tolist() == [0.0, 0.125, 0.25, 0.125]


@pytest.mark.parametrize(
    ("forces", "options", "message"),
    [
        ([], {}, r"forces must have shape \(m,\) with m >= 1, not \(0,\)"),
        ([1, np.inf], {}, "finite, and not all of them 0"),
        ([1, np.nan], {}, "finite, and not all of them 0"),
        ([0, 0], {}, "not all of them 0"),
        ([1], {"bins": 0}, "number of bins must be at least 1"),
        ([1], {"largest": 0}, "the largest force must be positive"),
    ],
)
def test_wrong_input(forces: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        force_distribution(forces, **options)


def test_wrong_choice() -> None:
    with pytest.raises(InputError, match=r"chosen must have shape \(4,\), not \(3,\)"):
        contacts_of([True] * 3, CONTACTS, IDS)
