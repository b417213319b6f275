"""Time against accuracy: when a start is at rest, how packings are compared, the whole command."""

from __future__ import annotations

import csv
import math
import subprocess
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from matplotlib.figure import Figure

from lammps_inelastic import core
from lammps_inelastic.analysis import (
    Cell,
    InputError,
    ParticleFrame,
    at_steps,
    network_difference,
    read_run_log,
)
from lammps_inelastic.analysis.geometry import FloatArray
from lammps_inelastic.workflow.cli import tradeoff as tradeoff_command
from lammps_inelastic.workflow.decks import find_deck
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.results.settling import first_at_rest, overlaps_as_contacts
from lammps_inelastic.workflow.results.store import Result, read_studies
from lammps_inelastic.workflow.results.thermo import read_thermo
from lammps_inelastic.workflow.running.locks import held
from lammps_inelastic.workflow.running.processes import cores
from lammps_inelastic.workflow.shipped import SETTLING
from lammps_inelastic.workflow.study import Case
from lammps_inelastic.workflow.tradeoff import settling_runs
from lammps_inelastic.workflow.tradeoff.advice import recommendations
from lammps_inelastic.workflow.tradeoff.comparison import compare, reference_of
from lammps_inelastic.workflow.tradeoff.figure import plot_cost, plot_errors
from lammps_inelastic.workflow.tradeoff.plan import Configuration, Plan, Run, command_line, runs_of
from lammps_inelastic.workflow.tradeoff.settling_runs import Settled
from lammps_inelastic.workflow.tradeoff.states import (
    EXACT,
    WAYS,
    Solved,
    curves_of,
    errors,
    from_zero,
    problems_of,
    read_states,
    write_states,
)
from lammps_inelastic.workflow.tradeoff.table import as_csv, as_markdown, out_of_bed
from tests.helpers.contact_problems import Problem, no_bodies
from tests.helpers.few_spheres import write_data
from tests.helpers.reference_solver import reference
from tests.helpers.study_run import (
    ENVIRONMENT,
    PATIENCE,
    command,
    killed_when,
    numbers_of,
    same,
)

# Deep enough to fill the measuring box, few enough for a second a run.
FEW = ["--particles", "60", "--diameter", "0.3"]


# When a start is at rest

TIMES = np.arange(41) * 0.05
DIAMETER = 0.1


def fallen_by(time: Any) -> FloatArray:
    """Height of the centre of mass in a fall from 2.5 that a floor ends at 0.5."""
    return np.maximum(2.5 - 9.81 * time**2 / 2, 0.5)


def test_at_rest_when_fallen_and_steady() -> None:
    landed = math.sqrt(2 * 2 / 9.81)
    share = np.where(landed + 0.1 < TIMES, 0.6, 0.14)
    index = first_at_rest(TIMES, share, fallen_by(TIMES), DIAMETER)
    # The step from 0.14 to 0.6, at 0.74, is 0.25 ago.
    assert TIMES[index] == pytest.approx(1.0)


def test_a_falling_cloud_keeps_its_packing_fraction_and_is_not_at_rest() -> None:
    share = np.full(len(TIMES), 0.14)
    index = first_at_rest(TIMES, share, fallen_by(TIMES), DIAMETER)
    # It lands at 0.64.
    assert TIMES[index] == pytest.approx(0.9)


def test_a_change_that_is_too_large_is_not_at_rest() -> None:
    height = np.full(len(TIMES), 0.5)
    slow, fast = (0.6 * (1 + rate * TIMES) for rate in (0.0039, 0.0042))
    assert first_at_rest(TIMES, slow, height, DIAMETER) == 5
    assert first_at_rest(TIMES, fast, height, DIAMETER) is None


def test_a_packing_that_is_shaken_is_not_at_rest() -> None:
    # The period is 0.25, so that the packing fraction is always that of 0.25 ago.
    swing = np.where(np.arange(len(TIMES)) % 5 == 2, 1.0, 0.0)
    share, height = 0.6 + 0.02 * swing, 0.5 + 0.05 * DIAMETER * swing
    assert first_at_rest(TIMES, share, height, DIAMETER) is None
    assert first_at_rest(TIMES, share, 0.5 + 0.9 * (height - 0.5), DIAMETER) == 5


def test_never_at_rest() -> None:
    still = np.full(len(TIMES), 0.5)
    # An empty box, a run that is too short, and times that are not known.
    assert first_at_rest(TIMES, np.zeros(len(TIMES)), still, DIAMETER) is None
    assert first_at_rest(TIMES[:5], still[:5], still[:5], DIAMETER) is None
    assert first_at_rest(np.full(len(TIMES), np.nan), still, still, DIAMETER) is None


def test_frames_need_not_be_evenly_spaced() -> None:
    times = np.array([0.0, 0.3, 0.5, 0.6])
    share = np.array([0.5, 0.6, 0.6, 0.6])
    # At 0.5 the time 0.25 before lies within the rise from 0 to 0.3.
    assert first_at_rest(times, share, np.full(4, 0.5), DIAMETER) == 3


# What is read from logs and frames


def test_a_log_between_and_after_its_lines(tmp_path: Path) -> None:
    log = tmp_path / "log.lammps"
    runs = [
        "   Step  \n     0\nLoop time of 1 on 1 procs for 0 steps with 3 atoms\n",
        "   Step          Time   \n     0   0\n   100   1.0\nLoop time of 1 on 1 procs "
        "for 100 steps with 3 atoms\n",
        "   Step          Time   \n   100   1.0\n   200   3.0\nLoop time of 1 on 1 procs "
        "for 110 steps with 3 atoms\n",
    ]
    log.write_text("".join(runs))
    read = read_run_log(log)
    table = read_thermo(read, "Time")
    assert table["Step"].tolist() == [0, 100, 200]
    times = at_steps([50, 100, 150, 200, 210, -1], table["Step"], table["Time"])
    assert times[:5] == pytest.approx([0.5, 1, 2, 3, 3.2])
    assert math.isnan(times[5])
    assert np.isnan(at_steps([1], *read_thermo(read, "CPU").values())).all()


def test_overlaps_are_the_contacts_of_soft_spheres() -> None:
    frame = ParticleFrame(
        step=7,
        ids=np.array([4, 2, 9]),
        positions=np.array([[0.5, 0.24, 0.5], [0.5, 0.72, 0.5], [0.3, 2.0, 0.5]]),
        velocities=None,
        radii=np.full(3, 0.25),
        bodies=None,
        cell=Cell.of_box([[0, 1], [0, 5], [0, 1]]),
        boundaries=("ff", "ff", "ff"),
    )
    contacts = overlaps_as_contacts(frame)
    assert contacts.ids.tolist() == [[4, 2], [4, -3]]
    assert contacts.forces == pytest.approx([0.02, 0.01])


# How networks and packings are compared


def test_networks_that_are_the_same_up_to_units_and_order() -> None:
    one = network_difference([[1, 2], [3, -1]], [1, 3], [[-1, 3], [2, 1]], [30, 10])
    assert (one.forces, one.shared) == (0, 1)


def test_networks_that_differ() -> None:
    # Shares 1/4, 3/4, 0 against 1/2, 0, 1/2
    one = network_difference([[1, 2], [2, 3]], [1, 3], [[1, 2], [3, 4]], [2, 2])
    assert one.forces == pytest.approx(1 / 4 + 3 / 4 + 1 / 2)
    assert one.shared == pytest.approx(1 / 3)
    nothing = network_difference([[1, 2]], [1], [[3, 4]], [1])
    assert (nothing.forces, nothing.shared) == (2, 0)


@pytest.mark.parametrize(
    ("ids", "forces", "message"),
    [
        ([[1, 2]], [1, 2], "must have shape"),
        ([1, 2], [1, 2], "must have shape"),
        ([[1, 2]], [0], "finite, and not all of them 0"),
        ([[1, 2]], [math.nan], "finite, and not all of them 0"),
        (np.empty((0, 2)), [], "finite, and not all of them 0"),
        ([[1, 2], [7, 7]], [1, 1], "sphere 7 is in contact with itself"),
    ],
)
def test_networks_that_cannot_be_compared(ids: Any, forces: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        network_difference([[1, 2]], [1], ids, forces)


def configuration(
    contacts: Literal["hard", "soft"] = "hard",
    tolerance: float = 0.005,
    dt: float = 0.01,
    ranks: int = 1,
    accuracy: float = 0.03,
) -> Configuration:
    if contacts == "soft":
        return Configuration("soft", tolerance, None, None, None, ranks)
    return Configuration("hard", tolerance, "sweeps", dt, accuracy, ranks)


def made_up(
    one: Configuration, start: str, seconds: float = 1.0, share: float = 0.6, contacts: float = 6.0
) -> tuple[Run, Result]:
    """A run and its result, with a network that is the same for all."""
    numbers = {
        "plateau_seconds": seconds,
        "plateau_time": seconds,
        "overlap_at_rest": one.tolerance,
        "packing_fraction": share,
        "coordination_number": contacts,
    }
    values = {f"numbers/{name}": np.array(value) for name, value in numbers.items()}
    values |= {"network/ids": np.array([[1, 2]]), "network/forces": np.array([1.0])}
    return Run(one, start, Case((), {})), Result(values, {}, {}, "{}")


def made_up_study() -> list[tuple[Run, Result]]:
    """Three starts; the loose tolerance is off in contacts alone; soft spheres take six times."""
    tight, loose, soft = (
        configuration(tolerance=0.0005),
        configuration(tolerance=0.005),
        configuration("soft", 0.005),
    )
    results = []
    for number, start in enumerate("123"):
        share = 0.6 + 0.01 * number
        results += [
            made_up(tight, start, 4.0, share, 6.0 + 0.1 * number),
            made_up(loose, start, 1.0 + number, share + 0.005, 5.0),
            made_up(soft, start, 6.0, share, 7.0),
        ]
    return results


def test_rows_errors_and_ratios() -> None:
    comparison = compare(made_up_study())
    tight, loose, _ = comparison.rows
    assert comparison.reference() is tight
    assert math.isnan(tight.median("packing_fraction_error"))
    assert loose.median("packing_fraction_error") == pytest.approx(0.005)
    assert loose.median("coordination_number_error") == pytest.approx(1.1)
    assert loose.median("network_error") == 0
    assert sorted(loose.slower) == pytest.approx([2, 3, 6])
    assert comparison.scatter("packing_fraction") == pytest.approx(0.01)
    assert len(tight.slower) == 0


def test_a_box_that_reaches_out_of_the_bed_is_said() -> None:
    """What is compared there is partly empty space."""
    study = made_up_study()
    assert out_of_bed(compare(study)) == []
    values = {**study[0][1].values, "numbers/box_in_bed": np.array(0.4)}
    study[0] = study[0][0], replace(study[0][1], values=values)
    (line,) = out_of_bed(compare(study))
    assert line.startswith("out of the bed: after 1 of 9 runs the measuring box, [0.25, 0.75]^3,")
    assert "40% of it in the worst" in line


def test_recommendations() -> None:
    share, contacts, speed = recommendations(compare(made_up_study()))
    assert "a tolerance of 0.005 r is enough as far as 3 starts can tell, and takes 2 s" in share
    assert "+0.0050 from that of the tightest, 0.0005 r, which takes 4 s" in share
    assert contacts.startswith("Contacts per particle: nothing but the tightest, 0.0005 r")
    assert speed.endswith("take: 3 (2 to 6) times as long at 0.005 r.")


def test_recommendations_that_the_numbers_do_not_carry() -> None:
    one = [pair for pair in made_up_study() if pair[0].start == "1"]
    share, contacts, _ = recommendations(compare(one))
    assert "cannot be judged by one start" in share
    assert "cannot be judged by one start" in contacts
    hard = [pair for pair in made_up_study() if pair[0].configuration.contacts == "hard"]
    assert "cannot be compared" in recommendations(compare(hard))[2]
    assert all("no run with hard contacts" in line for line in recommendations(compare([]))[:2])


def test_a_start_without_a_reference_or_not_at_rest_counts_where_it_can() -> None:
    results = made_up_study()
    # Of start 1 the reference has failed, and start 2 never comes to rest at the loose tolerance.
    results = [p for p in results if (p[0].start, p[0].configuration.tolerance) != ("1", 0.0005)]
    for run, result in results:
        if (run.start, run.configuration) == ("2", configuration(tolerance=0.005)):
            result.values["numbers/plateau_seconds"] = np.array(np.nan)
            result.values["numbers/plateau_time"] = np.array(np.nan)
    comparison = compare(results)
    loose = next(row for row in comparison.rows if row.configuration.tolerance == 0.005)
    assert not loose.all_at_rest
    # What is not at rest from every start is not recommended, nor compared with.
    assert "nothing but the tightest" in recommendations(comparison)[0]
    tight = next(r for run, r in results if run.configuration.tolerance == 0.0005)
    tight.values["numbers/plateau_seconds"] = np.array(np.nan)
    assert "has not come to rest from every start" in recommendations(compare(results))[0]
    assert len(loose.values("packing_fraction_error")) == 1
    assert sorted(loose.slower) == pytest.approx([2, 6])
    assert (len(loose.runs), len(loose.values("plateau_time"))) == (3, 2)


def test_no_errors_against_a_reference_that_still_moves() -> None:
    results = made_up_study()
    for run, result in results:
        if (run.start, run.configuration) == ("1", configuration(tolerance=0.0005)):
            result.values["numbers/plateau_time"] = np.array(np.nan)
    comparison = compare(results)
    _, loose, soft = comparison.rows
    names = ("packing_fraction_error", "coordination_number_error", "network_error", "shared")
    for row in (loose, soft):
        for one in row.runs:
            known = [name for name in names if math.isfinite(one.numbers[name])]
            assert known == ([] if one.run.start == "1" else [*names])
        assert len(comparison.shifts(row, "packing_fraction")) == 2
    # The starts 2 and 3 have 0.61 and 0.62.
    assert comparison.scatter("packing_fraction") == pytest.approx(0.01 / math.sqrt(2))
    lines = list(csv.DictReader(as_csv(comparison).splitlines()))
    assert [line["start"] for line in lines if line["network_error"]] == ["2", "3", "2", "3"]
    ax = Figure().subplots()
    plot_errors(ax, comparison, "packing_fraction")
    runs, medians, *_ = (line.get_xydata().tolist() for line in ax.lines)
    assert len(runs) == 2
    assert medians == [[0.005, pytest.approx(0.005)]]


def test_the_reference_is_the_tightest_with_the_smallest_accuracy_and_the_shortest_step() -> None:
    best = configuration(tolerance=1e-6, dt=0.005, accuracy=0.001)
    others = [
        configuration(tolerance=1e-6, accuracy=0.001),
        configuration(tolerance=1e-6, dt=0.002),
        configuration("soft", 1e-7),
        configuration(accuracy=1e-4),
    ]
    assert reference_of([*others, best, configuration(tolerance=1e-8, ranks=2)], 1) == best
    assert reference_of([configuration("soft")], 1) is None


def a_plan(**changed: Any) -> Plan:
    plan = Plan(
        "spheres", {"time_settling": 1}, [1], [0.005], [0.005], [0.02], [0.1], ["sweeps"], [1]
    )
    return replace(plan, **changed)


def test_accuracies_are_a_dimension_of_hard_contacts() -> None:
    plan = a_plan(accuracies=[0.001, 0.1])
    runs = runs_of(plan)
    assert [run.configuration.accuracy for run in runs] == [0.1, 0.001, None]
    settling = [run.case.stages[1].values for run in runs]
    assert [values.get("accuracy") for values in settling] == [0.1, 0.001, None]
    commands = [run.case.commands()[1] for run in runs]
    assert [command[command.index("accuracy") + 1] for command in commands[:2]] == ["0.1", "0.001"]
    assert "accuracy" not in commands[2]
    assert len({run.case.name for run in runs}) == 3
    assert ["accuracy=0.1" in run.case.name for run in runs] == [True, False, False]
    assert "--accuracies 0.001,0.1" in command_line(plan)


def test_the_default_accuracy_is_that_of_the_deck(monkeypatch: pytest.MonkeyPatch) -> None:
    """So runs without the option keep their names."""
    plans: list[Plan] = []

    def keep(plan: Plan, *_: object) -> int:
        plans.append(plan)
        return 0

    monkeypatch.setattr(tradeoff_command, "_compare", keep)
    monkeypatch.setattr(tradeoff_command, "held", lambda *_: nullcontext())
    assert main(["tradeoff"]) == 0
    default = find_deck(SETTLING, Path()).parameters["accuracy"]
    assert plans[0].accuracies == [default]
    assert all("accuracy" not in run.case.stages[1].values for run in runs_of(plans[0]))


def with_accuracies() -> list[tuple[Run, Result]]:
    """Three starts at one tolerance; the largest accuracy is fastest, and off in contacts alone."""
    results = []
    for number, start in enumerate("123"):
        for accuracy, seconds, off in ((0.1, 1.0, 1.0), (0.01, 2.0, 0.01), (0.001, 4.0, 0.0)):
            one = configuration(accuracy=accuracy)
            share, contacts = 0.6 + 0.01 * number, 6.0 + 0.1 * number + off
            results.append(made_up(one, start, seconds, share, contacts))
    return results


def test_accuracies_in_table_advice_and_figure() -> None:
    comparison = compare(with_accuracies())
    share, contacts, _ = recommendations(comparison)
    assert "a tolerance of 0.005 r, accuracy 0.1 is enough" in share
    assert "a tolerance of 0.005 r, accuracy 0.01 is enough" in contacts
    assert "of the tightest, 0.005 r, accuracy 0.001, which takes 4 s" in contacts
    page = as_markdown(a_plan(), comparison, [])
    assert "| hard | sweeps | 0.005 | 0.01 | 0.001 | 1 |" in page
    assert "Reference: hard contacts, sweeps, 0.005 r, dt 0.01, accuracy 0.001." in page
    rows = csv.DictReader(as_csv(comparison).splitlines())
    assert [row["accuracy"] for row in rows] == ["0.1"] * 3 + ["0.01"] * 3 + ["0.001"] * 3
    ax = plot_cost(Figure().subplots(), comparison)
    assert ax.get_legend_handles_labels()[1] == [
        f"hard contacts, accuracy {accuracy}" for accuracy in (0.1, 0.01, 0.001)
    ]


def test_soft_contacts_have_no_accuracy_and_one_alone_is_not_in_the_legend() -> None:
    comparison = compare(made_up_study())
    assert "| soft | - | 0.005 | - | - | 1 |" in as_markdown(a_plan(), comparison, [])
    (*_, soft) = csv.DictReader(as_csv(comparison).splitlines())
    assert soft["accuracy"] == ""
    ax = plot_cost(Figure().subplots(), comparison)
    assert ax.get_legend_handles_labels()[1] == ["hard contacts", "soft spheres"]


def test_results_of_a_version_without_accuracy_are_told() -> None:
    hard, soft = configuration(), configuration("soft")
    known = {"stages": [{"deck": SETTLING, "variables": {"accuracy": 0.03}}]}
    before = {"stages": [{"deck": SETTLING, "variables": {}}]}
    results = [
        (run, replace(result, record=record))
        for (run, result), record in (
            (made_up(hard, "1"), known),
            (made_up(hard, "2"), before),
            (made_up(soft, "1"), before),
        )
    ]
    (line,) = Settled(results=results).before_accuracy
    assert line.startswith("accuracy not known: 1 of 2 runs with hard contacts are of a version")
    assert Settled(results=results[:1]).before_accuracy == []


# The command


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--particle", "cubes"], "--particle: cubes is not allowed: it must be spheres or dimers"),
        (["--particles", "0"], "--particles: 0 is not allowed: it must be a whole number from 1 t"),
        (["--diameter", "2"], "--diameter: 2 is not allowed: it must be a number from 0.005 to"),
        (["--aspect-ratio", "1.5"], "--aspect-ratio: only dimers have one (--particle dimers)"),
        (
            ["--particle", "dimers", "--aspect-ratio", "3"],
            "--aspect-ratio: 3 is not allowed: it must be a number above 1 and up to 2",
        ),
        (["--tolerances", "0.05,"], "--tolerances:  is not allowed: it must be a number from 1e-1"),
        (["--tolerances", "nan"], "--tolerances: nan is not allowed: it must be a number from 1e"),
        (["--soft-tolerances", "0.05,no"], "--soft-tolerances: no is not allowed: it must be a nu"),
        (["--dts", "-1"], "--dts: -1 is not allowed: it must be a number from 1e-6 t"),
        (
            ["--accuracies", "0"],
            "--accuracies: 0 is not allowed: it must be a number above 0 and up to 1",
        ),
        (["--accuracies", "0.1,1.5"], "--accuracies: 1.5 is not allowed: it must be a number abov"),
        (["--accuracies", "0.1,"], "--accuracies:  is not allowed: it must be a number above 0"),
        (["--accuracies", "loose"], "--accuracies: loose is not allowed: it must be a number abo"),
        (
            ["--solvers", "sweeps,sor"],
            "--solvers: sor is not allowed: it must be sweeps, apgd or uzawa",
        ),
        (["--ranks", "1,9999"], "--ranks: 9999 is not allowed: it must be a whole number from 1 t"),
        (["--seeds", "1.5"], "--seeds: 1.5 is not allowed: it must be a whole number from 1 to 1"),
        (["--time", "0"], "--time: 0 is not allowed: it must be a number above 0"),
        (["--start", "no.data"], "--start: no.data: no such file"),
        (["--start", "no data"], "--start: no data: a file's name must be one word, without spa"),
        (["--timeout", "0"], "argument --timeout: '0' is no number of seconds above 0"),
        (["--start", "a", "--seeds", "2"], "argument --seeds: not allowed with argument --start"),
    ],
)
def test_bad_options(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status: object
    try:
        status = main(["tradeoff", "--out", str(tmp_path / "out"), *arguments])
    except SystemExit as end:  # argparse's own
        status = end.code
    assert status == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert " ".join(message.split()) in line
    assert not (tmp_path / "out").exists()


def test_a_line_for_each_bad_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--tolerances", "0,-1", "--seeds", "x", "--dts", "0", "--accuracies", "2,x"]
    assert main(["tradeoff", "--out", str(tmp_path), *arguments]) == 2
    names = [line.split(":")[1].strip() for line in capsys.readouterr().err.splitlines()]
    assert names == ["--seeds", *["--tolerances"] * 2, "--dts", *["--accuracies"] * 2]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[str], Path]:
    """Return the arguments and the folder of a small comparison."""
    out = tmp_path_factory.mktemp("tradeoff") / "out"
    arguments = ["tradeoff", "--out", str(out), *FEW, "--seeds", "2", "--time", "3"]
    arguments += ["--tolerances", "0.005,5e-5", "--soft-tolerances", "0.005"]
    assert main(arguments) == 0
    return arguments, out


@pytest.fixture
def again(finished: tuple[list[str], Path], tmp_path: Path) -> tuple[list[str], Path]:
    """Return the arguments that run half of it, that of seed 1, in another folder."""
    arguments, undisturbed = finished
    words = [str(tmp_path / "out") if word == str(undisturbed) else word for word in arguments]
    words[words.index("--seeds") + 1] = "1"
    return words, tmp_path / "out"


def rows_of(out: Path) -> list[dict[str, str]]:
    with (out / "tradeoff.csv").open() as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_what_a_comparison_writes(finished: tuple[list[str], Path]) -> None:
    _, out = finished
    assert {path.name for path in out.iterdir()} == {
        ".locks",
        "ranks-1",
        "states",
        "states.csv",
        "states.png",
        "states.svg",
        "tradeoff.csv",
        "tradeoff.h5",
        "tradeoff.md",
        "tradeoff.png",
        "tradeoff.svg",
    }
    rows = rows_of(out)
    assert [(r["contacts"], r["tolerance"], r["start"]) for r in rows] == [
        ("hard", "0.005", "1"),
        ("hard", "0.005", "2"),
        ("hard", "5e-05", "1"),
        ("hard", "5e-05", "2"),
        ("soft", "0.005", "1"),
        ("soft", "0.005", "2"),
    ]
    page = (out / "tradeoff.md").read_text()
    assert page.count("| hard | sweeps |") == 2
    assert "Soft spheres" in page


@pytest.mark.slow
def test_numbers_of_a_comparison(finished: tuple[list[str], Path]) -> None:
    _, out = finished
    for row in rows_of(out):
        words = ("contacts", "solver", "case")
        number = {name: float(text) for name, text in row.items() if text and name not in words}
        assert 0.4 < number["packing_fraction"] < 0.75
        assert number["settling_seconds"] > 0
        if row["contacts"] == "hard":
            # The projection bounds the overlap of free spheres at flat walls at every step; the
            # dump's digits add 1e-12.
            assert number["overlap_falling"] <= number["tolerance"] * (1 + 1e-6)
            assert number["iterations"] > 0
        else:
            assert row["solver"] == row["dt"] == row["accuracy"] == row["iterations"] == ""
        if "plateau_time" in number:
            assert 0.25 <= number["plateau_time"] <= 3.05
            assert 0 < number["plateau_seconds"] <= number["settling_seconds"] * 1.05
            # The stiffness of soft contacts gives it about: it is the largest of few forces. Of
            # twelve starts eleven had 0.9 to 1.4 tolerances, one, where a sphere is a wedge, 3.
            most = 1 + 1e-6 if row["contacts"] == "hard" else 4
            assert number["overlap_at_rest"] <= most * number["tolerance"]
        compared = row["tolerance"] != "5e-05" and "plateau_time" in number
        assert (row["network_error"] != "") == compared


@pytest.mark.slow
def test_recorded_states_show_the_accuracy(finished: tuple[list[str], Path]) -> None:
    """Tighter is more accurate, in velocities, forces and contacts, and takes more iterations."""
    _, out = finished
    with (out / "states.csv").open() as file:
        rows = list(csv.DictReader(file))
    # Two starts, three moments, and six values of each way.
    assert len(rows) == 2 * 3 * 6 * len(WAYS)
    for way in WAYS:
        for start, moment in product(("1", "2"), ("impact", "settling", "rest")):
            chosen = {"way": way.name, "start": start, "moment": moment}
            mine = [row for row in rows if chosen.items() <= row.items()]
            first, last = mine[0], mine[-1]
            assert int(last["iterations"]) > int(first["iterations"])
            # Errors are in proportion to the residual, which falls by five decades, to 5e-7 r. From
            # the start at rest the forces of the last step are within 3e-2; there 5e-7 r is 3e-5
            # g h^2, of which a bed, whose contacts are just as many as it needs, makes some hundred
            # times as much.
            least = 1e-2 if moment == "rest" else 1e-3
            for name in ("velocity_error", "force_error"):
                assert 0 <= float(last[name]) <= max(1e-2 * float(first[name]), least), chosen
            assert float(last["missed"]) + float(last["false"]) <= 0.01
    page = (out / "tradeoff.md").read_text()
    for solver in ("sweeps", "apgd"):
        assert f"| {solver} from the last forces | 0.0005 |" in page


@pytest.mark.slow
def test_the_exact_solution_is_that_of_another_solver(finished: tuple[list[str], Path]) -> None:
    """Clarabel, an interior-point method, solves the recorded problems of free spheres."""
    _, out = finished
    (folder, *_) = (path.parent for path in out.glob("states/cases/*/problem.*.npz"))
    unique = 0
    for record in problems_of(folder).values():
        problem = record.problem
        first, second, normal = problem.first, problem.second, problem.normal
        number = problem.inverse_mass.size
        given = Problem(
            problem.predicted_velocity,
            problem.inverse_mass,
            first,
            second,
            normal,
            problem.gap,
            problem.timestep,
            no_bodies(number),
        )
        reference_velocity, impulse = reference(given, None, 1e-12)
        limits = core.Limits(EXACT * float(record.arrays["radius"].min()))
        exact = core.project(from_zero(problem), limits)
        found = errors(
            exact.velocity,
            exact.impulse,
            reference_velocity,
            np.where(impulse > 1e-6 * impulse.max(), impulse, 0.0),
            problem.predicted_velocity,
        )
        # Clarabel's objective, half of a square of velocities, is known to 1e-12: they to 4e-6 of
        # what contacts change, which is the less of them (with 1e-11 to 1.8e-5; solved a thousand
        # times further ours change by 6e-10). Forces are not told as well.
        assert found["velocity_error"] <= 1e-5
        # Forces are unique where those contacts that carry some are independent.
        loaded = np.flatnonzero(impulse > 1e-6 * impulse.max())
        directions = np.zeros((number + 1, 3, len(loaded)))
        columns = np.arange(len(loaded))
        directions[first[loaded], :, columns] += normal[loaded]
        directions[second[loaded], :, columns] -= normal[loaded]
        moved = directions[:number].reshape(3 * number, -1)
        if np.linalg.matrix_rank(moved, tol=1e-6) == len(loaded):
            assert found["force_error"] <= 1e-4
            unique += 1
    assert unique > 0


@pytest.mark.slow
def test_damaged_records_are_named(
    finished: tuple[list[str], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """A damaged record costs its own start; the solutions of the other one are kept."""
    arguments, out = finished
    (one, *_) = out.glob("states/cases/spheres+*")
    saved = {path: path.read_bytes() for path in [*one.glob("*.npz"), *one.glob("solved-*")]}
    for path, content in saved.items():
        path.write_bytes(content[:100])
    try:
        assert main(arguments) == 1
    finally:
        for path, content in saved.items():
            path.write_bytes(content)
    output = capsys.readouterr().out
    assert f"left out: {one.name}: " in output
    assert "no recorded contact problem, or a damaged one" in output
    with (out / "states.csv").open() as file:
        assert len({row["start"] for row in csv.DictReader(file)}) == 1
    assert main(arguments) == 0


@pytest.mark.slow
def test_a_cut_off_log_of_a_recorded_run(
    finished: tuple[list[str], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """Nobody needs it once all is solved; without it, what is not solved is left out."""
    arguments, out = finished
    (one, *_) = out.glob("states/cases/spheres+*")
    saved = {path: path.read_bytes() for path in (one / "log.lammps", one / "solved-rest.json")}
    cut = saved[one / "log.lammps"]
    (one / "log.lammps").write_bytes(cut[: cut.rindex(b"Loop time of")])
    before = (out / "states.csv").read_text()
    try:
        assert main(arguments) == 0
        assert (out / "states.csv").read_text() == before
        (one / "solved-rest.json").unlink()
        (one / "log.lammps").write_bytes(cut[: cut.rindex(b"   Step")])
        capsys.readouterr()
        assert main(arguments) == 1
    finally:
        for path, content in saved.items():
            path.write_bytes(content)
    said = f"left out: {one.name}: {one / 'log.lammps'}: tells of no run that settles and then ends"
    assert said in capsys.readouterr().out
    assert len((out / "states.csv").read_text().splitlines()) < len(before.splitlines())
    assert main(arguments) == 0


def test_logs_that_tell_of_no_settling(tmp_path: Path) -> None:
    end = "Loop time of 1 on 1 procs for 0 steps with 3 atoms\n"
    for text in ("", f"   Step   Time\n  0   0\n{end}", 2 * f"   Step\n  0\n{end}"):
        (tmp_path / "log.lammps").write_text(text)
        with pytest.raises(ValueError, match=r"log\.lammps: tells of no run that settles"):
            problems_of(tmp_path)


def test_solutions_are_written_and_read(tmp_path: Path) -> None:
    path = tmp_path / "solved-rest.json"
    state = Solved("1", "rest", 7, "apgd from zero", 5e-7, 12, 1 / 3, 0.1, math.pi, 0.0, 1e-300)
    write_states(path, [state])
    assert read_states(path) == [state]
    for text in ("[" * 100_000, "{}", "null", '[{"start": "1"}]', path.read_text()[:-9]):
        path.write_text(text)
        with pytest.raises(ValueError, match=r"solved-rest\.json: no JSON|validation error"):
            read_states(path)


def test_errors_of_a_solution() -> None:
    exact, other = np.array([[1.0, 0, 0], [0, 0, 0]]), np.array([[1.0, 0.5, 0], [0, 0, 0]])
    predicted = np.array([[1.0, 0, 1.0], [0, 0, 0]])
    found = errors(other, np.array([1.0, 0, 2, 1]), exact, np.array([2.0, 1, 1, 0]), predicted)
    assert found == {"velocity_error": 0.5, "force_error": 1.0, "missed": 1 / 3, "false": 1 / 3}
    # The sweeps leave forces of 1e-16 of the others where there is none.
    found = errors(exact, np.array([1.0, 0, 1e-16]), exact, np.array([1.0, 1e-15, 0]), predicted)
    assert found["missed"] == found["false"] == 0
    nothing = np.zeros(2)
    found = errors(exact, nothing, exact, nothing, exact)
    assert all(math.isnan(value) for value in found.values())


def test_what_some_state_has_not_reached_is_left_out() -> None:
    def solved(moment: str, value: float, seconds: float) -> Solved:
        return Solved("1", moment, 5, WAYS[0].name, value, 10, seconds, 0.1, 0.1, 0.0, 0.0)

    (curve,) = curves_of(
        [solved("impact", 0.5, 1), solved("impact", 0.1, 4), solved("rest", 0.5, 3)]
    )
    assert curve.way == WAYS[0].name
    assert curve.values.tolist() == [0.5]
    assert curve.medians["seconds"].tolist() == [2.0]


@pytest.mark.slow
def test_all_runs_of_a_seed_have_the_same_start(finished: tuple[list[str], Path]) -> None:
    _, out = finished
    (study,) = read_studies(out / "tradeoff.h5")
    heights: dict[object, set[float]] = {}
    for result in study.results:
        key = result.variables["seed"]
        heights.setdefault(key, set()).add(float(result.values["evolution/centre_height"][0]))
    assert {key: len(found) for key, found in heights.items()} == {1: 1, 2: 1}
    assert heights[1] != heights[2]


@pytest.mark.slow
def test_nothing_is_left_to_do(
    finished: tuple[list[str], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, out = finished
    before = numbers_of(out / "tradeoff.h5"), (out / "tradeoff.csv").read_text()
    assert main(arguments) == 0
    output = capsys.readouterr().out
    assert "ranks-1: 6 there before" in output
    assert "states: 2 there before" in output
    assert "solves" not in output
    assert same(before[0], numbers_of(out / "tradeoff.h5"))
    assert before[1] == (out / "tradeoff.csv").read_text()


@pytest.mark.slow
def test_two_comparisons_in_a_folder_follow_one_another(
    finished: tuple[list[str], Path],
) -> None:
    """The second waits, and says so: it does not write over the tables of the first."""
    arguments, out = finished
    table = out / "tradeoff.csv"
    with held(out / tradeoff_command.LOCK):
        second = subprocess.Popen(
            command(*arguments), env=ENVIRONMENT, stdout=subprocess.PIPE, text=True
        )
        assert second.stdout is not None
        assert second.stdout.readline() == f"{out}: somebody else compares there; this one waits\n"
        # The first is to write it yet: what stands there is not of the second.
        table.unlink()
        time.sleep(1)
        assert second.poll() is None
        assert not table.exists()
    assert "ranks-1: 6 there before" in second.communicate(timeout=PATIENCE)[0]
    assert second.returncode == 0
    assert table.exists()


@pytest.mark.slow
def test_killed_and_run_again(
    finished: tuple[list[str], Path],
    again: tuple[list[str], Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    arguments, out = again
    killed_when(lambda: list(out.glob("ranks-1/results/*/*.h5")), *arguments)
    done = len(list(out.glob("ranks-1/results/*/*.h5")))
    assert 1 <= done < 3
    assert main(arguments) == 0
    assert f"{done} there before" in capsys.readouterr().out
    times = ("plateau_seconds", "settling_seconds")
    one, other = (
        [
            {name: text for name, text in row.items() if name not in times}
            for row in rows_of(folder)
            if row["start"] == "1"
        ]
        for folder in (out, finished[1])
    )
    assert one == other


@pytest.mark.slow
def test_a_failed_run_is_left_out_and_said(
    again: tuple[list[str], Path],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    arguments, out = again
    runs_of = settling_runs.runs_of

    def with_a_bad_one(plan: Plan) -> list[Run]:
        runs = runs_of(plan)
        # A variable that the deck refuses.
        runs[0].case.stages[1].values["particle"] = "cubes"
        return runs

    monkeypatch.setattr(settling_runs, "runs_of", with_a_bad_one)
    assert main(arguments) == 1
    output = capsys.readouterr().out
    assert "ranks-1: 2 done, 1 failed" in output
    assert "left out: " in output
    assert "exit status 1" in output
    assert len(rows_of(out)) == 2
    assert "left out: " in (out / "tradeoff.md").read_text()


@pytest.mark.slow
def test_dimers_and_time_steps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--particle", "dimers", "--particles", "30", "--diameter", "0.3", "--seeds", "1"]
    arguments += ["--tolerances", "0.005", "--dts", "0.01,0.005", "--soft-tolerances", "0.05"]
    assert main(["tradeoff", "--out", str(tmp_path / "out"), *arguments]) == 0
    rows = rows_of(tmp_path / "out")
    assert [row["dt"] for row in rows] == ["0.01", "0.005", ""]
    assert all(float(row["coordination_number"]) > 0 for row in rows)
    # The shorter step is the reference.
    assert [row["network_error"] != "" for row in rows] == [
        row["dt"] != "0.005" and row["plateau_time"] != "" for row in rows
    ]
    assert "cannot be judged by one start" in capsys.readouterr().out


@pytest.mark.slow
def test_starts_from_data_files(tmp_path: Path) -> None:
    for name in ("a.data", "b.data"):
        write_data(tmp_path / name, diameter=0.28)
    files = [str(tmp_path / name) for name in ("a.data", "b.data")]
    arguments = ["--diameter", "0.28", "--tolerances", "0.005", "--soft-tolerances", "none"]
    out = tmp_path / "out"
    assert main(["tradeoff", "--out", str(out), *arguments, "--start", *files]) == 0
    assert [row["start"] for row in rows_of(out)] == ["a.data", "b.data"]
    # One configuration is the reference, and has no error to plot.
    assert (out / "tradeoff.png").stat().st_size > 0


@pytest.mark.slow
def test_two_ranks_are_kept_apart(tmp_path: Path) -> None:
    if cores() < 2:
        # The command refuses more ranks than cores, whose times would say nothing.
        pytest.skip("two ranks need two cores")
    out = tmp_path / "out"
    arguments = [*FEW, "--seeds", "1", "--tolerances", "0.005", "--soft-tolerances", "none"]
    assert main(["tradeoff", "--out", str(out), *arguments, "--ranks", "1,2"]) == 0
    assert [row["ranks"] for row in rows_of(out)] == ["1", "2"]
    assert {path.name for path in Path(out).glob("ranks-*")} == {"ranks-1", "ranks-2"}
    assert [study.name for study in read_studies(out / "tradeoff.h5")] == ["ranks-1", "ranks-2"]


@pytest.mark.slow
def test_settling_in_a_study(write_study: Callable[..., Path], tmp_path: Path) -> None:
    study = write_study(
        'title = "t"\ndeck = ["spheres", "settling"]\n[parameters]\nparticles = 60\n'
        "diameter = 0.3\nsteps_agitated = 0\nsteps_settling = 0\nsteps_resting = 0\n"
        "steps_tightening = 0\n"
        'steps_measuring = 0\ncontacts = ["hard", "soft"]\n[outputs]\nnetwork = true\n'
    )
    assert main(["run", str(study), "--out", str(tmp_path / "out")]) == 0
    numbers = numbers_of(tmp_path / "out" / "few.h5")
    assert (numbers["few/summary/coordination_number"] > 2).all()
