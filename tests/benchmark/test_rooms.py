"""The benchmark of the parts of a step reads all phases of a log, and shares out all its time."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.benchmark.rooms import FEW, phases, pour
from tests.helpers.pouring import FEW_STEPS


def test_the_parts_of_all_phases(tmp_path: Path) -> None:
    log = pour(tmp_path, {"particles": 60, "diameter": 0.2, **FEW_STEPS, "dump_every": 1000})
    found = list(phases(log))
    # Of 5 + 3 steps at the end 4, 1 and 3 are runs of their own, too few to tell anything.
    assert [(phase.first, phase.last) for phase in found] == [
        (1, 61),
        (62, 100),
        (101, 150),
        (151, 200),
    ]
    loops = re.findall(r"Loop time of (\S+) on .* for (\d+) steps", log)
    long = [float(seconds) for seconds, steps in loops if int(steps) >= FEW]
    # The start has no thermo output of constraints.
    for phase, loop in zip(found, long[-len(found) :], strict=True):
        # LAMMPS prints six digits.
        assert sum(phase.seconds.values()) == pytest.approx(loop, rel=1e-4)
        assert min(phase.seconds.values()) >= 0
        assert phase.constraints > 0
        assert phase.visits > 0
