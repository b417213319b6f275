"""Whole studies of 30 spheres: run as processes, killed, run again, in an MPI job."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.results.schema import SCHEMA
from lammps_inelastic.workflow.running.folder import Folder
from lammps_inelastic.workflow.study import Case, read_study
from tests.helpers.few_spheres import TINY, write_data
from tests.helpers.study_run import (
    ENVIRONMENT,
    PATIENCE,
    command,
    inelastic,
    killed_when,
    numbers_of,
    processes_in,
    same,
    wait_for,
    warning,
)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a study of two cases that was run without trouble."""
    folder = tmp_path_factory.mktemp("undisturbed")
    study = folder / "few.toml"
    study.write_text(TINY.replace("{seeds}", "[1, 2]"))
    done = inelastic("run", study, "--out", folder / "out", "--at-once", 2)
    assert (done.returncode, done.stderr) == (0, warning(study))
    assert "few: 2 done" in done.stdout
    return folder


def one_case(folder: Path, seed: int = 1) -> Path:
    path = folder / "few.toml"
    path.write_text(TINY.replace("{seeds}", f"{seed}"))
    return path


def test_studies_run_together(undisturbed: Path, tmp_path: Path) -> None:
    """No case waits for the last one of another study; a run that two share is made once."""
    long, few = tmp_path / "long.toml", tmp_path / "few.toml"
    longer = re.sub(r"steps_settling = \d+", "steps_settling = 20000", TINY)
    assert longer != TINY
    long.write_text(longer.replace("{seeds}", "1"))
    few.write_text(TINY.replace("{seeds}", "[1, 2]"))
    again = tmp_path / "again.toml"
    again.write_text(TINY.replace("{seeds}", "2"))
    out = tmp_path / "out"
    done = inelastic("run", long, few, again, "--out", out, "--at-once", 2)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    said = ["few: 2 done", "again: 1 done", "long: 1 done"]
    assert [line for line in lines if line in said] == said
    assert sum(" running " in line for line in lines) == 3
    assert [line.split(": ")[0][-12:] for line in lines if " study " in line] == [
        f"study {number} of 3" for number in (1, 2, 3)
    ]
    assert same(numbers_of(out / "few.h5"), numbers_of(undisturbed / "out" / "few.h5"))


@pytest.mark.slow
@pytest.mark.parametrize("options", [[], ["--mpi"]])
def test_what_cannot_be_measured_is_said(options: list[str], tmp_path: Path) -> None:
    path = one_case(tmp_path)
    few = TINY.replace("{seeds}", "1").replace("structure = false", "structure = true")
    path.write_text(few.replace("particles = 30", "particles = 10"))
    done = inelastic("run", path, "--out", tmp_path / "out", *options, ranks=len(options))
    assert (done.returncode, done.stderr) == (0, warning(path))
    # Ten spheres of 0.2 are a layer on the floor: the outermost centres are below the box's top.
    assert [line for line in done.stdout.splitlines() if "out of the bed: the bed ends at " in line]
    said = [line.partition("not measured: ")[2] for line in done.stdout.splitlines()]
    assert [": ".join(line.split(": ")[:2]) for line in said if line] == [
        "radial distribution: the box is too near to the outermost particles",
        "q4, q6, crystalline: more than 12 particles are needed, not 10",
    ]
    names = numbers_of(tmp_path / "out" / "few.h5").keys()
    assert not any("q6" in name or "structure/" in name for name in names)


@pytest.mark.slow
def test_what_still_moves_is_said(tmp_path: Path) -> None:
    """A bed that is stopped while it falls: by `run`, and among its numbers."""
    path = one_case(tmp_path)
    hasty = "steps_settling = 0\nsteps_resting = 0\nsteps_tightening = 0\nsteps_agitated = 30\n"
    lines = [line for line in path.read_text().splitlines() if not line.startswith("steps_")]
    at = lines.index("[parameters]") + 1
    path.write_text("\n".join([*lines[:at], hasty, *lines[at:], ""]))
    done = inelastic("run", path, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert re.search(r"NOT AT REST: rms speed [\d.e+-]+ g h, net force", done.stdout)
    found = numbers_of(tmp_path / "out" / "few.h5")
    (at_rest,) = (value for name, value in found.items() if name.endswith("numbers/at_rest"))
    assert at_rest == 0


def of_case(numbers: dict[str, Any], case: Case) -> dict[str, Any]:
    """The numbers of one case in a study's file."""
    start = f"few/cases/{case.name}/"
    return {name.removeprefix(start): v for name, v in numbers.items() if name.startswith(start)}


def equals_undisturbed(undisturbed: Path, study_path: Path, out: Path) -> bool:
    (case,) = read_study(study_path).cases
    wanted = of_case(numbers_of(undisturbed / "out" / "few.h5"), case)
    assert wanted
    return same(of_case(numbers_of(out / "few.h5"), case), wanted)


def test_every_dataset_is_in_the_schema(undisturbed: Path) -> None:
    with h5py.File(undisturbed / "out" / "few.h5") as file:
        cases = file["few/cases"]
        assert len(cases) == 2
        for case in cases.values():
            found: dict[str, Any] = {}
            case.visititems(
                lambda name, item, found=found: found.update(
                    {name: item} if isinstance(item, h5py.Dataset) else {}
                )
            )
            assert "numbers/packing_fraction" in found
            for name, dataset in found.items():
                assert dataset.attrs["unit"] == SCHEMA[name].unit
                assert dataset.attrs["meaning"] == SCHEMA[name].meaning
                assert (dataset.ndim == 0) == (SCHEMA[name].shape == "")
            record = json.loads(case.attrs["record"])
            assert record["stages"][0]["variables"]["seed"] in (1, 2)


@pytest.mark.slow
def test_what_is_measured_of_dimers(tmp_path: Path, write_study: Callable[..., Path]) -> None:
    dimers = TINY.replace('deck = "spheres"', 'deck = "dimers"').replace("{seeds}", "1")
    # Long enough to land on one another
    dimers = dimers.replace("settling = 40", "settling = 230").replace(
        "points = 1000", "points = 20000"
    )
    study = write_study(dimers)
    done = inelastic("run", study, "--out", tmp_path / "out")
    assert (done.returncode, done.stderr) == (0, "")
    (case,) = read_study(study).cases
    found = of_case(numbers_of(tmp_path / "out" / "few.h5"), case)
    number = {name.removeprefix("numbers/"): float(v) for name, v in found.items() if v.ndim == 0}
    assert number["particles"] == 30
    # The necks of dimers of L/d = 1.5 are 1 % of them.
    necks = number["packing_fraction_with_necks"] / number["packing_fraction"] - 1
    assert 0.003 < necks < 0.03
    assert (
        number["packing_fraction_with_necks_error"] < number["packing_fraction_monte_carlo_error"]
    )
    # Two dimers that touch at several places are neighbours once.
    assert 0 < number["neighbours"] <= number["coordination_number"]
    assert number["a_x"] ** 2 + number["a_y"] ** 2 + number["a_z"] ** 2 == pytest.approx(
        3 * number["a_isotropic"] ** 2,
        rel=1e-6,  # what LAMMPS's integrator leaves of the dimers' length
    )


def test_the_summary_is_a_table(undisturbed: Path) -> None:
    pandas = pytest.importorskip("pandas")
    with h5py.File(undisturbed / "out" / "few.h5") as file:
        table = pandas.DataFrame({name: v[()] for name, v in file["few/summary"].items()})
    assert table["seed"].tolist() == [1, 2]
    assert table["particles"].tolist() == table["particles_measured"].tolist() == [30, 30]
    assert table["packing_fraction"].between(0.2, 0.7).all()


def test_nothing_is_left_to_do(undisturbed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = undisturbed / "out"
    before = numbers_of(out / "few.h5")
    assert main(["run", str(undisturbed / "few.toml"), "--out", str(out)]) == 0
    assert "few: 2 there before" in capsys.readouterr().out
    assert same(before, numbers_of(out / "few.h5"))


def test_status_tells_whole_names(undisturbed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = undisturbed / "few.toml", undisturbed / "out"
    assert main(["status", str(path), "--out", str(out)]) == 0
    output = capsys.readouterr().out
    assert all(case.name in output for case in read_study(path).cases)
    assert "few: 2 measured" in output


@pytest.mark.parametrize(
    "moment",
    [
        pytest.param("part", marks=pytest.mark.slow),
        "dump",
        pytest.param("finished", marks=pytest.mark.slow),
        pytest.param("result", marks=pytest.mark.slow),
    ],
)
def test_killed_and_run_again(
    undisturbed: Path, tmp_path: Path, moment: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = one_case(tmp_path), tmp_path / "out"
    study = read_study(path)
    folder, (case,) = Folder(out), study.cases
    there = {
        "part": folder.part(case).is_dir,
        "dump": (folder.part(case) / "particles.lammpsdump").exists,
        "finished": folder.case(case).is_dir,
        "result": lambda: folder.result(study, case).parent.is_dir(),
    }[moment]
    # On a slow machine the moment may have passed: then the next one.
    killed_when(
        lambda: there() or folder.case(case).is_dir(), "run", path, "--out", out, by=signal.SIGKILL
    )
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert equals_undisturbed(undisturbed, path, out)
    assert not list(out.glob("cases/*.part"))
    assert not list(out.glob("cases/*.failed"))


SLOW = 'title = "slow"\ndeck = "slow.in"\n'


@pytest.fixture
def slow(tmp_path: Path) -> Path:
    """Return a study of a deck that never ends."""
    (tmp_path / "slow.in").write_text("variable x index 1\nprint 'here'\nshell sleep 1000\n")
    path = tmp_path / "slow.toml"
    path.write_text(SLOW)
    return path


def test_sigterm_kills_what_runs(slow: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    status = killed_when(
        lambda: len(processes_in(out)) > 1, "run", slow, "--out", out, by=signal.SIGTERM
    )
    assert status == 130
    wait_for(lambda: not processes_in(out))


def mapped(process: subprocess.Popen[str], part: str) -> bool:
    """Whether a process has a library mapped whose path has this part: how far it has come."""
    try:
        return part in Path(f"/proc/{process.pid}/maps").read_text()
    except OSError:
        return False


@pytest.mark.parametrize(
    "moment",
    [
        "imports",
        pytest.param("imports, late", marks=pytest.mark.slow),
        "pool",
        pytest.param("twice", marks=pytest.mark.slow),
        pytest.param("together", marks=pytest.mark.slow),
    ],
)
def test_interrupted(moment: Any, tmp_path: Path) -> None:
    """At whatever moment: one line, and nothing is left running."""
    out = tmp_path / "out"
    (tmp_path / "slow.in").write_text("variable x index 1\nshell sleep 1000\n")
    path = tmp_path / "slow.toml"
    path.write_text(SLOW + "[parameters]\nx = { from = 1, to = 40 }\n")
    process = subprocess.Popen(
        command("run", path, "--out", out, "--at-once", 20),
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    there = {
        "imports": lambda: mapped(process, "/numpy/"),
        "imports, late": lambda: mapped(process, "/h5py/"),
        "pool": lambda: len(processes_in(out)) > 0,
        "twice": lambda: len(processes_in(out)) > 10,
        "together": lambda: len(processes_in(out)) > 10,
    }[moment]
    wait_for(lambda: there() or process.poll() is not None)
    process.send_signal(signal.SIGINT)
    for pause in {"twice": [0.01] * 20, "together": [0.0] * 20}.get(moment, []):
        time.sleep(pause)
        process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=PATIENCE)[1]
    assert (process.returncode, said) == (130, "inelastic: interrupted\n")
    assert processes_in(out) == []


def test_what_nohup_ignores_stays_ignored(slow: Path, tmp_path: Path) -> None:
    """A study goes on when the terminal is closed, and ends for another signal."""
    out = tmp_path / "out"
    process = subprocess.Popen(
        ["nohup", *command("run", slow, "--out", out)],
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_for(lambda: len(processes_in(out)) > 0)
        process.send_signal(signal.SIGHUP)
        time.sleep(0.5)
        assert process.poll() is None
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE) == 130


def test_what_a_killed_workflow_leaves_is_stopped(
    slow: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    killed_when(lambda: len(processes_in(out)) > 1, "run", slow, "--out", out)
    orphans = processes_in(out)
    assert orphans
    assert main(["run", str(slow), "--out", str(out), "--timeout", "0.5"]) == 1
    assert "FAILED (timed out after 0.5 s)" in capsys.readouterr().out
    wait_for(lambda: not processes_in(out))


def test_failures_do_not_stop_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    decks = {
        "wrong": "print 'so far so good'\nnonsense 5\n",
        "quits": "print 'bad input'\nif '1 > 0' then 'quit 1'\n",
        "slow": "shell sleep 1000\n",
        "killed": f"shell exec sh {tmp_path}/die.sh\nshell sleep 1000\n",
    }
    (tmp_path / "die.sh").write_text("kill -9 $PPID\n")
    for name, text in decks.items():
        (tmp_path / f"{name}.in").write_text(f"variable x index 1\n{text}")
    path = tmp_path / "bad.toml"
    rows = "".join(f"[[rows]]\ndeck = '{name}.in'\n" for name in decks)
    path.write_text(f"title = 'bad'\ndeck = 'wrong.in'\n{rows}")
    out = tmp_path / "out"
    assert main(["run", str(path), "--out", str(out), "--timeout", "3"]) == 1
    output = capsys.readouterr().out
    assert "bad: 4 failed" in output
    assert "ERROR: Unknown command: nonsense 5" in output
    assert "bad input" in output
    assert main(["status", str(path), "--out", str(out)]) == 0
    table = [line.split() for line in capsys.readouterr().out.splitlines()]
    reasons = {line[1].rpartition("_")[0]: " ".join(line[3:]) for line in table if len(line) > 3}
    assert reasons["wrong"] == reasons["quits"] == "exit status 1"
    assert reasons["slow"] == "timed out after 3 s"
    assert reasons["killed"] == "killed by SIGKILL"
    wait_for(lambda: not processes_in(out))


def test_somebody_else_runs_it(
    undisturbed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = one_case(tmp_path), tmp_path / "out"
    (case,) = read_study(path).cases
    with Folder(out).lock(case) as mine:
        assert mine
        assert main(["run", str(path), "--out", str(out)]) == 0
    assert "few: 1 run by somebody else" in capsys.readouterr().out


def test_starts_from_a_data_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_data(tmp_path / "my.data", diameter=0.2)
    path = tmp_path / "few.toml"
    text = TINY.replace("{seeds}", "1").replace("particles = 30", "start = 'my.data'")
    path.write_text(text)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    numbers = numbers_of(tmp_path / "out" / "few.h5")
    # The file says how many there are.
    assert numbers["few/summary/particles_measured"].tolist() == [27]
    assert numbers["few/summary/start"].tolist() == [b"inputs/my.data"]


@pytest.mark.slow
def test_groups_of_one_rank_give_the_same_numbers(undisturbed: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = inelastic("run", undisturbed / "few.toml", "--out", out, "--mpi", ranks=2)
    assert done.returncode == 0, done.stderr
    assert "few: 2 done" in done.stdout
    # The same deck on one rank: LAMMPS takes the same steps in the same order.
    assert same(numbers_of(out / "few.h5"), numbers_of(undisturbed / "out" / "few.h5"))


@pytest.mark.slow
def test_a_group_of_two_ranks(undisturbed: Path, tmp_path: Path) -> None:
    path, out = one_case(tmp_path), tmp_path / "out"
    done = inelastic("run", path, "--out", out, "--mpi", "--ranks", 2, ranks=2)
    assert done.returncode == 0, done.stderr
    (case,) = read_study(path).cases
    alone = of_case(numbers_of(undisturbed / "out" / "few.h5"), case)
    together = of_case(numbers_of(out / "few.h5"), case)
    # Whether two of the few spheres touch in the box, so that there are forces, is chance, and
    # so is whether one of them is held there.
    chance = "forces/", "numbers/fabric", "numbers/coordination_number_without_rattlers"
    by_chance = {name for name in together.keys() ^ alone.keys()}
    assert all(name.startswith(chance) for name in by_chance), by_chance
    # Two ranks add the same numbers in another order, and a packing that is shaken amplifies the
    # last digit: only what does not depend on the spheres' places is equal.
    for name in ("numbers/particles", "numbers/steps", "evolution/step"):
        assert np.array_equal(together[name], alone[name])


def test_an_error_on_one_rank_ends_the_job(tmp_path: Path) -> None:
    start = time.monotonic()
    done = inelastic(
        # Where nobody can make a folder.
        *("run", one_case(tmp_path), "--out", "/proc/out", "--mpi", "--ranks", 2),
        ranks=2,
    )
    assert done.returncode != 0
    assert "cannot be written: No such file or directory" in done.stderr
    # A job that hangs is given up much later.
    assert time.monotonic() - start < 60


@pytest.mark.slow
@pytest.mark.parametrize("timeout", ["0.3", "1.4"])
def test_in_a_job_a_run_that_is_cut_short_is_late(tmp_path: Path, timeout: float) -> None:
    path = one_case(tmp_path)
    path.write_text(path.read_text().replace("steps_settling = 40", "steps_settling = 1000000"))
    done = inelastic("run", path, "--out", tmp_path / "out", "--mpi", "--timeout", timeout, ranks=1)
    assert done.returncode == 1
    assert f"timed out after {timeout} s" in done.stdout
    assert not list((tmp_path / "out" / "cases").glob("*/finished.json"))


def test_a_look_does_not_keep_a_run_from_its_case(tmp_path: Path) -> None:
    (case,) = read_study(one_case(tmp_path)).cases
    folder = Folder(tmp_path / "out")
    looks = threading.Event()

    def look() -> None:
        with folder.lock(case) as mine:
            assert mine
            looks.set()
            # Longer than `status` takes.
            time.sleep(0.02)

    looker = threading.Thread(target=look)
    looker.start()
    looks.wait()
    with folder.lock(case) as mine:
        assert mine
    looker.join()


@pytest.mark.slow
@pytest.mark.parametrize("options", [[], ["--mpi"]])
def test_a_start_that_is_missing_fails_its_case_alone(
    options: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first case deletes the start of the second one, and the third one runs."""
    names = ["a.data", "b.data", "c.data"]
    for name in names:
        (tmp_path / name).write_text(name)
    deck = f"variable start index none\nprint 'here'\nshell rm -f {tmp_path / 'b.data'}\n"
    (tmp_path / "own.in").write_text(deck)
    path = tmp_path / "own.toml"
    path.write_text(f"title = 't'\ndeck = 'own.in'\n[parameters]\nstart = {names}\n")
    out = tmp_path / "out"
    done = inelastic("run", path, "--out", out, "--at-once", 1, *options, ranks=len(options))
    assert (done.returncode, done.stderr) == (1, "")
    gone = f"{tmp_path / 'b.data'}: has gone since the study was read"
    failed = [line for line in done.stdout.splitlines() if line.startswith("  failed: own_")]
    assert sum(line.endswith(f": {gone}") for line in failed) == 1
    # The deck leaves nothing to measure, but has run.
    assert sum(": cannot be measured: " in line for line in failed) == 2
    (tmp_path / "b.data").write_text("b.data")
    assert main(["status", str(path), "--out", str(out)]) == 0
    assert gone in capsys.readouterr().out
