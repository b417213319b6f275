"""The errors of velocities and forces of `inelastic tradeoff`, against exact solutions of steps."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from lammps_inelastic import core
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.results.store import Result
from lammps_inelastic.workflow.tradeoff.comparison import Comparison, compare
from lammps_inelastic.workflow.tradeoff.figure import draw_errors, plot_errors_in_time
from lammps_inelastic.workflow.tradeoff.plan import Plan, runs_of
from lammps_inelastic.workflow.tradeoff.recorded_steps import RECORD_EVERY, recording_case
from lammps_inelastic.workflow.tradeoff.states import records_in
from lammps_inelastic.workflow.tradeoff.step_errors import (
    StepErrors,
    errors_of,
    read_errors,
    write_errors,
)
from lammps_inelastic.workflow.tradeoff.table import as_csv, as_markdown
from tests.helpers.grainwise import GRAVITY, solve

MASS, FLOOR = 2.0, -1
PLAN = Plan(
    "spheres",
    {"time_settling": 1},
    starts=[1],
    tolerances=[0.005],
    soft_tolerances=[0.005],
    dts=[0.01],
    accuracies=[0.1, 0.001],
    solvers=["sweeps"],
    ranks=[1],
)


def sphere_on_a_floor(timestep: float, left: float, gap: float = 0.0) -> core.Record:
    """One step of a sphere under gravity, of whose approach a part is left over."""
    fall = GRAVITY * timestep
    arrays: dict[str, Any] = {
        "step": 10.0,
        "timestep": timestep,
        "tolerance": 1e-3,
        "iterations": 1.0,
        "id": np.array([1]),
        "inverse_mass": np.array([1 / MASS]),
        "mass": np.array([MASS]),
        "radius": np.array([0.5]),
        "position": np.array([[0.0, 0.5, 0.0]]),
        "predicted_velocity": np.array([[0.0, -fall, 0.0]]),
        "velocity": np.array([[0.0, -left * fall, 0.0]]),
        "id1": np.array([1]),
        "id2": np.array([FLOOR]),
        "normal": np.array([[0.0, 1.0, 0.0]]),
        "gap": np.array([gap]),
        "impulse": np.array([(1 - left) * MASS * fall]),
        "impulse_guess": np.array([0.0]),
    }
    return core.Record({name: np.asarray(value) for name, value in arrays.items()})


def test_errors_of_steps_of_a_sphere_at_rest() -> None:
    one = errors_of([sphere_on_a_floor(0.1, 0.2)], GRAVITY)
    assert one.steps == 1
    # The exact velocity is 0, and the exact force the weight, to a part of 1e-9.
    assert one.velocity_error == pytest.approx(0.2, rel=1e-9)
    assert one.force_error == pytest.approx(0.2, rel=1e-9)
    # A step that was shortened counts as much: its unit of velocity is smaller, its force the same.
    two = errors_of([sphere_on_a_floor(0.1, 0.2), sphere_on_a_floor(0.01, 0.0)], GRAVITY)
    assert two.velocity_error == pytest.approx(0.2 / math.sqrt(2), rel=1e-9)  # as above
    assert two.force_error == pytest.approx(0.1, rel=1e-9)  # as above


def test_steps_without_forces_or_records() -> None:
    falling = errors_of([sphere_on_a_floor(0.1, 1.0, gap=9.0)], GRAVITY)
    assert falling.velocity_error == 0
    assert math.isnan(falling.force_error)
    with pytest.raises(ValueError, match="no recorded contact problem is there"):
        errors_of([], GRAVITY)


def test_errors_are_written_and_read(tmp_path: Path) -> None:
    path = tmp_path / "errors.json"
    for found in (StepErrors(7, 1 / 3, 1e-300), StepErrors(1, 0.0, math.nan)):
        write_errors(path, found)
        assert repr(read_errors(path)) == repr(found)
    for text in ("{}", "null", "[", path.read_text()[:-9]):
        path.write_text(text)
        with pytest.raises(ValueError, match=r"errors\.json: no JSON|validation error"):
            read_errors(path)


def test_what_records_differs_in_that_alone() -> None:
    run = runs_of(PLAN)[0]
    case = recording_case(run)
    assert case.stages[0] == run.case.stages[0]
    before = run.case.stages[1].values
    assert case.stages[1].values == {**before, "record_every": RECORD_EVERY}
    assert case.name != run.case.name


def comparison_of(ranks: int) -> Comparison:
    """Two accuracies, whose steps were recorded on so many ranks, and soft contacts."""
    runs = runs_of(PLAN)
    results = []
    for run, share in zip(runs, (0.61, 0.6, 0.62), strict=True):
        numbers = {"plateau_seconds": 2.0, "plateau_time": 1.0, "packing_fraction": share}
        values = {f"numbers/{name}": np.array(value) for name, value in numbers.items()}
        values |= {"network/ids": np.array([[1, 2]]), "network/forces": np.array([1.0])}
        results.append((run, Result(values, {}, {}, "{}")))
    found = {(ranks, runs[0].case.name): (0.02, 0.1), (ranks, runs[1].case.name): (4e-4, 2e-3)}
    return compare(results, found)


def test_errors_of_steps_in_table_and_figure(tmp_path: Path) -> None:
    comparison = comparison_of(ranks=1)
    page = as_markdown(replace(PLAN, step_errors=True), comparison, [])
    assert "--ranks 1 --step-errors`" in page
    assert "| of velocities / g h | of forces |" in page
    assert "| 2.0e-02 | 1.0e-01 |" in page
    assert "against the exact solutions of these steps" in page
    rows = list(csv.DictReader(as_csv(comparison).splitlines()))
    assert [row["velocity_error"] for row in rows] == ["0.02", "0.0004", ""]
    assert [row["force_error"] for row in rows] == ["0.1", "0.002", ""]
    ax = plot_errors_in_time(Figure().subplots(), comparison, "velocity")
    # A small point of the run and one of the median for each accuracy, none for soft contacts.
    points = [line.get_xydata().tolist() for line in ax.lines]
    assert points == [[[2.0, 0.02]]] * 2 + [[[2.0, 4e-4]]] * 2
    assert [path.name for path in draw_errors(comparison, tmp_path / "errors")] == [
        "errors.png",
        "errors.svg",
    ]


def test_errors_of_another_number_of_ranks_are_not_taken() -> None:
    """Without any the table has no column of them."""
    comparison = comparison_of(ranks=2)
    assert not comparison.has_steps
    assert "of velocities" not in as_markdown(PLAN, comparison, [])


@pytest.mark.slow
def test_step_errors_of_a_comparison(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    arguments = ["tradeoff", "--out", str(out), "--particles", "60", "--diameter", "0.3"]
    arguments += ["--seeds", "1", "--tolerances", "0.005", "--soft-tolerances", "0.05"]
    arguments += ["--accuracies", "0.1,0.001", "--step-errors", "--no-states"]
    assert main(arguments) == 0
    assert (out / "errors.png").stat().st_size > 0
    rows = list(csv.DictReader((out / "tradeoff.csv").open()))
    assert [row["accuracy"] for row in rows] == ["0.1", "0.001", ""]
    loose, tight, soft = rows
    assert soft["velocity_error"] == soft["force_error"] == ""
    for name in ("velocity_error", "force_error"):
        # Errors are about in proportion to the accuracy, a hundredth here.
        assert 0 < float(tight[name]) < 0.2 * float(loose[name])
    # Another exact solution, judged by NumPy alone, gives the same root mean square.
    (folder,) = out.glob("steps/ranks-1/cases/*accuracy=0.1_*")
    squares = []
    for record in map(core.read_record, records_in(folder)):
        apart = record.arrays["velocity"] - solve(record).velocity
        squares.append(((apart / (GRAVITY * record.problem.timestep)) ** 2).sum(axis=1))
    # That one has velocities to 0.004 g h at worst, and far closer on the whole.
    assert math.sqrt(np.concatenate(squares).mean()) == pytest.approx(
        float(loose["velocity_error"]), rel=1e-3
    )
    capsys.readouterr()
    assert main(arguments) == 0
    assert "steps-1: 2 there before" in capsys.readouterr().out
    # A damaged record costs the errors of its run alone.
    (folder / "errors.json").unlink()
    records_in(folder)[0].write_bytes(b"no record")
    assert main(arguments) == 1
    assert f"steps left out: {folder.name}: " in capsys.readouterr().out
    rows = list(csv.DictReader((out / "tradeoff.csv").open()))
    assert [row["velocity_error"] != "" for row in rows] == [False, True, False]
