"""Columns of a log over all of its runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lammps_inelastic.analysis import read_run_log
from lammps_inelastic.workflow.results.thermo import cumulated, read_thermo

LOG = """LAMMPS (22 Jul 2025)
run 20
   Step          Time            CPU
         0   0              0
        10   0.1            1.5
        20   0.2            2
Loop time of 2 on 1 procs for 20 steps with 3 atoms
run 10
   Step          Time            CPU
        20   0.2            0
        30   0.4            4
Loop time of 4 on 1 procs for 10 steps with 3 atoms
Total wall time: 0:00:06
"""


def test_what_each_run_counts_from_zero_is_counted_through(tmp_path: Path) -> None:
    path = tmp_path / "log.lammps"
    path.write_text(LOG)
    log = read_run_log(path)
    found = cumulated(log, "CPU")
    assert found["Step"].tolist() == [0, 10, 20, 30]
    assert found["CPU"].tolist() == [0, 1.5, 2, 6]
    # Time goes on by itself.
    assert read_thermo(log, "Time")["Time"].tolist() == [0, 0.1, 0.2, 0.4]
    nothing = cumulated(log, "Temp")
    assert len(nothing["Step"]) == 0
    assert np.asarray(nothing["Temp"]).size == 0
