"""What the fix says in the log after a run."""

import re
from pathlib import Path

import pytest

from tests.fix.test_record import pile
from tests.helpers.lammps_run import Runner

PHASES = ("collect", "solve", "communicate", "check", "apply")


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_summary_tells_where_the_time_went(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    result = lmp(pile(tmp_path, "") + "run 200\n", ranks=ranks)
    line = re.search(r"^  seconds: (.*); solve takes (.*)$", result.screen, re.MULTILINE)
    assert line is not None
    seconds = {name: float(value) for name, value in re.findall(r"(\w+) ([\d.]+)", line[1])}
    assert tuple(seconds) == PHASES
    loop = re.search(r"^Loop time of ([\d.e+-]+)", result.screen, re.MULTILINE)
    assert loop is not None
    # Each phase is rounded to a millisecond, and the first projection is not in LAMMPS's loop.
    assert 0 < sum(seconds.values()) < float(loop[1]) + 0.1
    assert seconds["solve"] > 0
    assert (seconds["communicate"] > 0) == (ranks > 1)
    iterations = re.search(r"(\d+) iterations, largest", result.screen)
    assert iterations is not None
    an_iteration, a_constraint = map(float, re.findall(r"[\d.]+", line[2]))
    # Both are rounded as they are printed: the seconds to 0.5 ms, an iteration's to 0.05 us.
    rounded = 0.51e-3 + 0.051e-6 * int(iterations[1])
    assert an_iteration * int(iterations[1]) * 1e-6 == pytest.approx(
        seconds["solve"], abs=rounded, rel=0
    )
    # Between one and some hundred constraints.
    assert an_iteration * 1e3 / 1000 < a_constraint < an_iteration * 1e3
