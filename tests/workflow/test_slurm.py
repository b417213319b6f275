"""The job-array script for Slurm."""

from __future__ import annotations

import shlex

from lammps_inelastic.workflow.folder import Folder
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.slurm import _ranges, job_script
from lammps_inelastic.workflow.study import read_study

STUDY = 'title = "t"\ndeck = "spheres"\n[parameters]\nseed = { from = 1, to = 3 }\n'


def test_numbers_as_slurm_writes_them():
    assert _ranges([1, 2, 3, 5, 8, 9]) == "1-3,5,8-9"
    assert _ranges([4]) == "4"


def test_script(write_study, tmp_path):
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


def test_one_study_at_a_time(write_study, capsys):
    path = str(write_study(STUDY))
    assert main(["slurm", path, path]) == 2
    assert capsys.readouterr().err == "inelastic: slurm: one study at a time\n"
