"""A packing frame by frame, by hand; and the step from which on a series stays where it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lammps_inelastic.analysis import (
    InputError,
    ParticleDump,
    ParticleFrame,
    iterate_contact_frames,
    measure_evolution,
    monte_carlo,
    plateau,
    plot_evolution,
)
from tests.helpers.written_dumps import Rows, Writer

BOX = [[0, 1], [0, 1], [0, 1]]


def rows_at(height: float, speed: float, contacts: int) -> Rows:
    """Two spheres, the second twice as large and so eight times as heavy, and outside the box."""
    return [
        [1, 0.5, height, 0.5, speed, 0, 0, 0.1, contacts],
        [2, 0.5, 2.0, 0.5, 0, 0, -speed, 0.2, 9],
    ]


COLUMNS = "id x y z vx vy vz radius contacts"


def seen(frame: ParticleFrame, box: NDArray[np.float64]) -> float:
    """Return a packing fraction that says what it was given."""
    assert frame.positions.shape == (2, 3)
    return float(box[0, 1])


def test_each_frame(write_particles: Writer) -> None:
    dump = ParticleDump(
        write_particles({0: rows_at(0.9, 4.0, 0), 50: rows_at(0.45, 0.0, 6)}, COLUMNS)
    )
    found = measure_evolution(dump, BOX, packing=seen)
    assert found.steps.tolist() == [0, 50]
    assert found.packing_fraction.tolist() == [1, 1]
    # Only the first sphere's centre is in the box.
    assert found.coordination.tolist() == [0, 6]
    # Sums of a few numbers near 1 in float64.
    assert found.height == pytest.approx([(0.9 + 8 * 2) / 9, (0.45 + 8 * 2) / 9], rel=1e-15)
    assert found.kinetic_energy == pytest.approx([8, 0], rel=1e-15)


def test_what_is_not_known_is_nan(write_particles: Writer) -> None:
    rows = [[1, 0.5, 0.5, 0.5, 0.1]]
    dump = ParticleDump(write_particles({0: rows}, "id x y z radius"))
    found = measure_evolution(dump, BOX, up=2)
    assert np.isnan(found.coordination).all()
    assert np.isnan(found.kinetic_energy).all()
    assert found.height.tolist() == [0.5]
    # 4 pi / 3 10^-3, from 100,000 points: four standard deviations.
    assert found.packing_fraction[0] == pytest.approx(4e-3 * np.pi / 3, abs=4 * 0.0002)


def test_no_particle_in_the_box(write_particles: Writer) -> None:
    dump = ParticleDump(write_particles({0: rows_at(3, 0, 6)}, COLUMNS))
    assert np.isnan(measure_evolution(dump, BOX, packing=seen).coordination).all()


def test_contact_dump_comes_before_the_column(
    write_particles: Writer, write_contacts: Writer
) -> None:
    dump = ParticleDump(
        write_particles({step: rows_at(0.5, 0, 6) for step in (0, 10, 20, 30)}, COLUMNS)
    )
    one = [1, 2, 0, 0, 0, 1, 0, 0, 0, 1]
    # Contact frames also at steps that the particle dump lacks.
    contacts = write_contacts({9: [], 10: [one], 11: [], 20: [], 31: []})
    found = measure_evolution(dump, BOX, contacts=iterate_contact_frames(contacts), packing=seen)
    assert found.coordination.tolist() == [6, 1, 0, 6]


def test_spheres_of_a_body_add_up(write_particles: Writer) -> None:
    rows = [
        [1, 7, 0.5, 0.4, 0.5, 0.1, 3],
        [2, 7, 0.5, 0.6, 0.5, 0.1, 5],
        [3, 0, 0.5, 0.5, 0, 0.1, 1],
    ]
    dump = ParticleDump(write_particles({0: rows}, "id mol x y z radius contacts"))
    # Eight contacts of the body and one of the free sphere.
    assert measure_evolution(dump, BOX, packing=monte_carlo(10)).coordination.tolist() == [4.5]


def test_plateau_of_a_decay() -> None:
    steps = np.arange(0, 1000, 10)
    values = 0.64 * (1 - np.exp(-steps / 50))
    found = plateau(steps, values, band=0.001, last=0.25)
    # exp(-t / 50) <= 0.001 from t = 345.4 on; the final mean is that of the limit to 1e-7.
    assert found.step == 350
    assert found.mean == pytest.approx(0.64, rel=1e-6)


def test_plateau_that_is_left_again() -> None:
    # Near the final mean of 1 from the second value on, but for the fourth.
    values = [0, 1, 1, 2, 1, 1, 1, 1]
    assert plateau(range(8), values, band=0.01).step == 4
    assert plateau(range(8), [1] * 8, band=0.01).step == 0


def test_no_plateau() -> None:
    found = plateau(range(4), [1, 2, 3, 5], band=0.01, last=0.5)
    assert (found.step, found.mean) == (None, 4)


def test_nan_is_before_the_plateau() -> None:
    assert plateau(range(8), [np.nan, 1, np.nan, *[1] * 5], band=0.1).step == 3


@pytest.mark.parametrize(
    ("steps", "values", "options", "message"),
    [
        ([], [], {}, "the same shape"),
        ([1, 2], [1], {}, r"not \(2,\) and \(1,\)"),
        ([1, 2], [1, np.nan], {}, "the last values"),
        ([1], [1], {"band": 0}, "band must be positive"),
        ([1], [1], {"last": 0}, r"last in \(0, 1\]"),
    ],
)
def test_wrong_series(steps: Any, values: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        plateau(steps, values, **options)


def test_wrong_input() -> None:
    with pytest.raises(InputError, match="at least one particle frame"):
        measure_evolution([], BOX)
    with pytest.raises(InputError, match="up must be the axis 0, 1 or 2, not 3"):
        measure_evolution([], BOX, up=3)


def test_plot() -> None:
    ax = Figure().add_subplot()
    steps, values = [0, 10, 20, 30], [0.0, np.nan, 0.6, 0.6]
    reached = plateau(steps, values)
    assert plot_evolution(ax, steps, values, reached=reached, label="packing fraction") is ax
    assert ax.lines[0].get_xdata().tolist() == steps
    # Beside the series the final mean and the step where it is reached.
    assert len(ax.lines) == 3
    assert ax.get_legend_handles_labels()[1] == ["packing fraction"]
