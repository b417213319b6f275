"""The job-array script for Slurm."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.running.folder import Folder
from lammps_inelastic.workflow.running.slurm import _ranges, job_script
from lammps_inelastic.workflow.study import read_study

STUDY = 'title = "t"\ndeck = "spheres"\n[parameters]\nseed = { from = 1, to = 3 }\n'


def test_numbers_as_slurm_writes_them() -> None:
    assert _ranges([1, 2, 3, 5, 8, 9]) == "1-3,5,8-9"
    assert _ranges([4]) == "4"


def test_script(write_study: Callable[..., Path], tmp_path: Path) -> None:
    path = write_study(STUDY)
    text = job_script(read_study(path), path, Folder(tmp_path / "a b"), ranks=2, time="1:00:00")
    lines = text.splitlines()
    assert lines[0] == "#!/bin/bash"
    assert {"#SBATCH --array=1-3", "#SBATCH --ntasks=2", "#SBATCH --time=1:00:00"} <= set(lines)
    words = shlex.split(lines[-1])
    assert words[0] == "exec"
    assert words[2:4] == ["run", str(path)]
    assert words[words.index("--out") + 1] == str(tmp_path / "a b")
    assert words[-2:] == ["--case", "$SLURM_ARRAY_TASK_ID"]


def test_one_study_at_a_time(
    write_study: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(write_study(STUDY))
    assert main(["slurm", path, path]) == 2
    assert capsys.readouterr().err == "inelastic: slurm: one study at a time\n"


@pytest.mark.parametrize(
    ("time", "fine"),
    [
        *((time, True) for time in ("90", "5:00", "1:00:00", "2-0", "2-12:30:00", "UNLIMITED")),
        *(
            (time, False)
            for time in ("", "1h", "1:00\n#SBATCH --x", "'1'", "$(id)", "1:2:3:4", "٣")
        ),
    ],
)
def test_limits_of_time(
    write_study: Callable[..., Path],
    tmp_path: Path,
    time: str,
    fine: bool,
    capsys: pytest.CaptureFixture[str],
) -> None:
    arguments = ["slurm", str(write_study(STUDY)), "--out", str(tmp_path / "out")]
    assert main([*arguments, f"--time={time}"]) == (0 if fine else 2)
    captured = capsys.readouterr()
    assert captured.err.count("\n") == (0 if fine else 1)
    assert (f"#SBATCH --time={time}\n" in captured.out) == fine
    # There the job writes what it says.
    assert (tmp_path / "out").is_dir() == fine


@pytest.mark.parametrize(
    ("name", "fine"),
    [
        ("a b", True),
        ("a%j", True),
        ("$(id);x", True),
        ("a\nb", False),
        ("a'b", False),
        ('a"', False),
    ],
)
def test_names_in_a_script(
    tmp_path: Path, name: str, fine: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither a line nor a word of a name is taken for an option or a command."""
    folder = tmp_path / name
    folder.mkdir()
    path = folder / f"{name}.toml"
    path.write_text(STUDY)
    assert main(["slurm", str(path), "--out", str(folder)]) == (0 if fine else 2)
    captured = capsys.readouterr()
    assert captured.err.count("\n") == (0 if fine else 1)
    if not fine:
        return
    lines = captured.out.splitlines()
    assert [line.split("=")[0] for line in lines[1:-1]] == [
        f"#SBATCH --{key}"
        for key in ("job-name", "array", "ntasks", "nodes", "cpus-per-task", "time", "output")
    ]
    options = dict(line.split("=", 1) for line in lines[1:-1])
    assert re.fullmatch(r"[\w.+-]+", options["#SBATCH --job-name"])
    (output,) = shlex.split(options["#SBATCH --output"])
    assert output.replace("%%", "%") == f"{folder}/slurm-%A_%a.out"
    words = shlex.split(lines[-1])
    assert words[words.index("run") + 1] == str(path)
