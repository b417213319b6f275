"""fix random/force: the same numbers on any number of ranks, after a restart, and in Python."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic import core
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import FloatArray, mass, read_dump, scene

COUNT = 300
RADII = np.linspace(0.01, 0.03, COUNT)
POINTS = np.random.default_rng(1).uniform(0.05, 0.95, (COUNT, 3))
DUMP = """
dump forces all custom 1 forces.dump id fx fy fz
dump_modify forces sort id format float %.17g
"""


def deck(folder: Path, force: str, **options: object) -> str:
    """Return a scene without contacts and gravity."""
    text = scene(
        POINTS,
        RADII,
        folder,
        tolerance=1.0,
        gravity=False,
        thermo="step ke",
        fixes=force,
        **options,  # type: ignore[arg-type]
    )
    return "\n".join(line for line in text.splitlines() if not line.startswith("fix contact"))


def forces(folder: Path) -> FloatArray:
    """Return (steps, atoms, 3)."""
    return np.array([frame.vectors("fx fy fz") for frame in read_dump(folder / "forces.dump")])


def expected(amplitude: float, seed: int, steps: range) -> FloatArray:
    """Return the forces that the core's generator gives."""
    uniform = [[core.uniform_vector(seed, i + 1, step) for i in range(COUNT)] for step in steps]
    return amplitude * mass(RADII)[:, None] * np.array(uniform)


def test_force_is_amplitude_times_mass_times_the_cores_numbers(tmp_path: Path, lmp: Runner) -> None:
    lmp(deck(tmp_path, "fix shake all random/force 2.5 987654321") + DUMP + "run 3\n")
    # Equal but for the order of two multiplications.
    assert forces(tmp_path) == pytest.approx(expected(2.5, 987654321, range(4)), rel=1e-14)


def test_two_ranks_and_a_restart_give_the_same(tmp_path: Path, lmp: Runner) -> None:
    fix = "fix shake all random/force 2.5 42"
    text = deck(tmp_path, fix)
    lmp(text + DUMP + "run 6\n")
    whole = forces(tmp_path)
    lmp(deck(tmp_path / "two", fix) + DUMP + "run 6\n", ranks=2, into="two")
    assert (forces(tmp_path / "two") == whole).all()
    lmp(text + "\nrun 3\nwrite_restart half.restart\n")
    second = text.replace("read_data spheres.data", "read_restart half.restart")
    lmp(second + DUMP + "run 3\n")
    assert (forces(tmp_path) == whole[3:]).all()


def test_bounds_mean_and_spread(tmp_path: Path, lmp: Runner) -> None:
    lmp(deck(tmp_path, "fix shake all random/force 2.0 1") + DUMP + "run 30\n")
    acceleration = forces(tmp_path) / mass(RADII)[:, None]
    assert np.abs(acceleration).max() <= 2.0 * (1 + 1e-15)  # round-off of the division
    # 28,000 numbers, uniform in [-2, 2]: five standard errors of the mean and of the variance.
    count = acceleration.size
    assert abs(acceleration.mean()) <= 5 * 2 / np.sqrt(3 * count)
    assert acceleration.var() == pytest.approx(4 / 3, abs=5 * 4 * np.sqrt(4 / 45 / count))
    # Neither from step to step nor from atom to atom are they the same.
    flat = acceleration.reshape(31, -1)
    assert abs(np.corrcoef(flat[0], flat[1])[0, 1]) < 5 / np.sqrt(flat.shape[1])
    assert len(np.unique(acceleration)) == count


def test_zero_does_nothing_and_groups_are_respected(tmp_path: Path, lmp: Runner) -> None:
    lmp(deck(tmp_path, "fix shake all random/force 0 1") + DUMP + "run 2\n")
    assert not forces(tmp_path).any()
    fix = "group some id 1:10\nfix shake some random/force 1 1"
    lmp(deck(tmp_path, fix) + DUMP + "run 2\n")
    shaken = forces(tmp_path).any(axis=(0, 2))
    assert shaken[:10].all()
    assert not shaken[10:].any()


def test_forces_of_other_fixes_are_kept(tmp_path: Path, lmp: Runner) -> None:
    fixes = "fix push all addforce 1e-6 2e-6 3e-6\nfix shake all random/force 2.5 42"
    lmp(deck(tmp_path, fixes) + DUMP + "run 1\n")
    assert forces(tmp_path) - [1e-6, 2e-6, 3e-6] == pytest.approx(
        expected(2.5, 42, range(2)),
        abs=1e-19,  # round-off of the sum
    )


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ("-1 5", "-1"),
        ("nan 5", "nan"),
        ("inf 5", "inf"),
        ("1 -5", "-5"),
        ("1 x", "x"),
        ("1 1.5", "1.5"),
        ("1 5 6", "6"),
        ("1", "random/force"),
        ("", "random/force"),
    ],
)
def test_bad_arguments(
    arguments: str, word: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    error = refused(deck(tmp_path, f"fix shake all random/force {arguments}") + "\nrun 1\n")
    assert word in error


def test_respa_is_refused(tmp_path: Path, refused: Callable[..., str]) -> None:
    text = deck(tmp_path, "fix shake all random/force 1 1")
    assert "respa" in refused(text + "\nrun_style respa 2 2 pair 1\nrun 1\n")
