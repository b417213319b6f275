"""What a log of LAMMPS tells of the frames of its dumps, and what it does not."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lammps_inelastic.analysis import LogError, ParticleDump, UnfinishedRunError, Unrest, open_run
from lammps_inelastic.analysis.run_log import read_run_log

DUMP = "dump all all custom {} out/a.dump id x y z radius\n"
FIX = "fix touch all inelastic 1e-4\n"


def run(first: int, steps: int, columns: str = "", last: bool = True, end: bool = True) -> str:
    """Return what a log holds of a run: a line of thermo output at either end."""
    rows = [first, first + steps] if last and steps else [first]
    lines = [f"   Step          Time    {columns}", *(f"{n:10} {n * 0.1:g}   " for n in rows)]
    loop = [f"Loop time of 0.5 on 2 procs for {steps} steps with 3 atoms"] if end else []
    return "\n".join([*lines, *loop, ""])


def written(path: Path, text: str) -> list[int] | None:
    (path / "log.lammps").write_text(text)
    found = read_run_log(path / "log.lammps").written(path / "moved" / "a.dump")
    return None if found is None else found.steps.tolist()


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        (DUMP.format(3) + run(0, 7), [0, 3, 6]),
        (DUMP.format(3) + run(1, 7), [3, 6]),
        (DUMP.format(3) + "dump_modify all sort id first yes\n" + run(1, 7), [1, 3, 6]),
        # A step that ends one run and begins the next is written once.
        (DUMP.format(3) + run(0, 6) + run(6, 3) + run(9, 0), [0, 3, 6, 9]),
        (run(0, 6) + DUMP.format(2) + run(6, 3), [6, 8]),
        (DUMP.format(2) + run(0, 3) + "undump all\n" + run(3, 5), [0, 2]),
        (DUMP.format(2) + run(0, 3) + "reset_timestep 100\n" + run(100, 3), [0, 2, 100, 102]),
        # A run that a fix has ended: no line of its last step, here or in the columns.
        (DUMP.format(2) + run(0, 5, last=False), [0, 2, 4]),
        (
            DUMP.format(4)
            + run(0, 6)
            + "undump all\nwrite_dump all custom out/a.dump id modify append yes\n",
            [0, 4, 6],
        ),
        (DUMP.format(4) + run(0, 6) + "write_dump all custom out/a.dump id modify sort id\n", [6]),
        # With variables in place, and comments.
        (
            "dump all all custom ${n} ${out}/a.dump id\ndump all all custom 5 ${out}/a.dump id\n"
            "dump all all custom 5 out/a.dump id # radius\n" + run(0, 5),
            [0, 5],
        ),
        (DUMP.format(1) + "dump_modify all every/time 0.35\n" + run(0, 10), [0, 4, 7]),
        # Times that fall together with steps.
        (DUMP.format(1) + "dump_modify all every/time 0.3\n" + run(0, 9), [0, 3, 6, 9]),
        # A run under way: as far as the log tells.
        (DUMP.format(3) + run(0, 6, end=False), [0, 3, 6]),
        # Of these it does not tell all.
        (DUMP.format(3) + "dump_modify all every v_when\n" + run(0, 7), None),
        (DUMP.format(3) + "dump_modify all append yes\n" + run(0, 7), None),
        (DUMP.format(3) + "dump_modify all delay 5\n" + run(0, 7), [6]),
        (DUMP.format(3) + "dump_modify all delay v_when\n" + run(0, 7), None),
        (DUMP.format(3) + "dump_modify all skip v_dull\n" + run(0, 7), None),
        (DUMP.format(1) + "dump_modify all every/time 0.15\n" + run(0, 7), None),
        # Runs of more than ten million steps.
        (
            DUMP.format(1) + "dump_modify all every/time 1e6\n" + run(0, 30_000_000),
            [0, 10_000_000, 20_000_000, 30_000_000],
        ),
        (DUMP.format(20_000_000) + run(5, 40_000_000), [20_000_000, 40_000_000]),
        (
            DUMP.format(1)
            + "dump_modify all every/time 0.3\nthermo_modify format float %.2g\n"
            + run(0, 9),
            None,
        ),
        (DUMP.format(3) + run(0, 7) + "rerun other.dump dump x y z\n" + run(0, 7), None),
        (DUMP.format(3) + DUMP.format(5).replace("out/", "other/") + run(0, 7), None),
        (DUMP.format(3) + "keywords: ['Step']\n" + run(0, 7)[-60:], None),
        (run(0, 7), None),
        ("", None),
        # Killed, and continued from step 4 in the same files.
        (
            DUMP.format(3)
            + run(0, 6, end=False)
            + "read_restart a\n"
            + DUMP.format(3)
            + "dump_modify all append yes\n"
            + run(4, 8),
            None,
        ),
    ],
)
def test_frames_of_which_a_log_tells(tmp_path: Path, text: str, steps: list[int] | None) -> None:
    assert written(tmp_path, text) == steps


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (run(0, 5) + run(7, 5), "line 5: a run begins at step 7, but the one before it ended at"),
        ("thermo 2\n" + run(0, 5), "line 2: a line of thermo output of step 2 is missing"),
        (run(0, 9).replace("for 9", "for 4"), "line 1: the lines of thermo output do not follow"),
        (run(5, 5).replace("    10 ", "     4 "), "the lines of thermo output do not follow one"),
        ("   Step Time\nLoop time of 1 on 1 procs for 0 steps with 3 atoms\n", "a run has no line"),
        # Numbers that are damaged: far more steps than there is memory for, and what is no number.
        (
            "thermo 1\n" + run(0, 1).replace("for 1", "for 40000000000"),
            "line 2: a line of thermo output of step 2 is missing, in the run from step 0 to 400",
        ),
        (run(0, 5).replace("of 0.5", "of 0.00.1"), "line 4: 'Loop time of 0.00.1 on 2 procs f"),
        (run(0, 5).replace("for 5", "for " + "9" * 5000), "line 4: 'Loop time of 0.5 on 2 procs"),
        (run(0, 5).replace("with 3", "with " + "9" * 5000), "line 4: .* is damaged: it must hold"),
        (run(0, 5).replace("     5 ", "5" * 400 + " "), "line 3: '5+\\.\\.\\.' is no step"),
    ],
)
def test_a_log_that_contradicts_itself(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(LogError, match=f"log.lammps, .*{said}"):
        written(tmp_path, text)


@pytest.mark.parametrize("when", ["every 1", "every/time 0.2"])
def test_more_frames_than_are_compared_are_said(tmp_path: Path, when: str) -> None:
    """It is said of the dump that is asked for, and of no other in the same log."""
    text = DUMP.format(1) + f"dump_modify all {when}\n" + run(0, 40_000_000)
    with pytest.raises(LogError, match=r"tells of more than 10000000 frames in a\.dump: too many"):
        written(tmp_path, text)
    assert read_run_log(tmp_path / "log.lammps").written(tmp_path / "other.dump") is None


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    start=st.floats(0, 10),
    lengths=st.lists(st.floats(0.01, 0.1), min_size=1, max_size=10),
    apart=st.integers(1, 20),
    interval=st.floats(0.21, 3),
)
def test_frames_at_times_are_those_of_each_step(
    start: float, lengths: list[float], apart: int, interval: float, tmp_path_factory: Any
) -> None:
    """Looked for between the lines, they are where the time of a step passes a multiple."""
    ends = start + np.concatenate([[0], np.cumsum(apart * np.array(lengths))])
    rows = [f"{n * apart} {end!r}" for n, end in enumerate(ends.tolist())]
    steps = apart * len(lengths)
    text = "\n".join(
        ["Step Time", *rows, f"Loop time of 1 on 1 procs for {steps} steps with 3 atoms"]
    )
    folder = tmp_path_factory.mktemp("log")
    found = written(folder, DUMP.format(1) + f"dump_modify all every/time {interval!r}\n{text}\n")
    times = np.interp(np.arange(steps + 1), np.arange(len(ends)) * apart, ends)
    shares = times / interval
    # Where a time is a multiple but for round-off, either side is right.
    assume(np.abs(shares - np.rint(shares)).min() > 1e-5)
    expected = 1 + np.flatnonzero(np.diff(np.floor(shares)))
    assert (found or []) == expected.tolist()


def test_what_is_no_log(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"log\.lammps: no such file"):
        read_run_log(tmp_path / "log.lammps")
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path, tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(LogError, match="cannot be read: it is a folder, a pipe or a device"):
            read_run_log(path)
    (tmp_path / "picture").write_bytes(bytes(range(256)) * 10)
    assert read_run_log(tmp_path / "picture").runs == []


def test_the_end_of_a_log(tmp_path: Path) -> None:
    path = tmp_path / "log.lammps"
    for text, ended in (
        (run(0, 5) + "Total wall time: 0:00:01\n", True),
        (run(0, 5) + "quit\n", True),
        (run(0, 5) + "log other.log\n", True),
        (run(0, 5), False),
        (run(0, 5) + "quit\nundump all\n", False),
    ):
        path.write_text(text)
        assert read_run_log(path).ended == ended


def test_contacts_that_a_log_counts(tmp_path: Path) -> None:
    path = tmp_path / "log.lammps"
    named = "thermo_modify colname f_touch[5] contacts colname f_other[6] walls\n"
    for text, counts in (
        (FIX + named + run(0, 0, "contacts").replace("0   ", "0   4"), {5: "contacts"}),
        (FIX + run(0, 0, "f_touch[6]").replace("0   ", "0   4"), {6: "f_touch[6]"}),
        # A style of its own puts names back.
        (FIX + named + "thermo_style custom step\n" + run(0, 0), {}),
        (FIX + FIX.replace("touch", "two") + named + run(0, 0), {}),
        (named + run(0, 0), {}),
        (
            FIX
            + named
            + "thermo_modify format float %.3g\n"
            + run(0, 0, "contacts").replace("0   ", "0   4"),
            {},
        ),
    ):
        path.write_text(text)
        (only,) = read_run_log(path).runs
        assert only.counts == counts


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        # A dump that no log explains: a run that goes on from a restart file repeats its step.
        ([0, 5, 5, 7], ""),
        ([0, 1, 10, 100], ""),
        ([0, 5, 3], "the frame of step 3 comes after that of step 5; run it again"),
    ],
)
def test_a_dump_of_which_no_log_tells(tmp_path: Path, steps: list[int], said: str) -> None:
    head = "ITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff ff\n" + "0 1\n" * 3
    frames = [f"ITEM: TIMESTEP\n{n}\n{head}ITEM: ATOMS id x y z radius\n1 0 0 0 1\n" for n in steps]
    (tmp_path / "own.dump").write_text("".join(frames))
    dump = ParticleDump(tmp_path / "own.dump")
    (tmp_path / "log.lammps").write_text(DUMP.format(5) + run(0, 20) + "quit\n")
    log = read_run_log(tmp_path / "log.lammps")
    for known in (None, log):
        if said:
            with pytest.raises(ValueError, match=said):
                open_run(dump, None, known)
        else:
            assert open_run(dump, None, known).log is None
    # The log of a run that was cut off before it told of the dump.
    if not said:
        (tmp_path / "log.lammps").write_text(run(0, 20))
        log = read_run_log(tmp_path / "log.lammps")
        assert open_run(dump, None, log, over=False).log is None
        with pytest.raises(UnfinishedRunError, match=r"its end is missing, .* tell of own\.dump"):
            open_run(dump, None, log)


AT_REST = "  at its end the scene is at rest: rms speed 0.002 g h, net force 7e-05 of the weight\n"
MOVES = "  at its end the scene is NOT AT REST: rms speed 0.232 g h, net force 1 of the weight\n"


def ends(first: int, steps: int, said: str) -> str:
    """Return what a log holds of a run at whose end the fix says something."""
    return run(first, steps).replace("Loop time", f"{said}Loop time")


def test_how_far_a_run_ends_from_rest(tmp_path: Path) -> None:
    """It is known at the steps at which runs end, of the last one that tells."""
    text = ends(0, 6, MOVES) + ends(6, 3, AT_REST) + run(9, 2) + ends(11, 0, MOVES) + run(11, 0)
    (tmp_path / "log.lammps").write_text(text)
    log = read_run_log(tmp_path / "log.lammps")
    assert log.unrest_at(6) == Unrest(at_rest=False, speed=0.232, net_force=1.0)
    assert log.unrest_at(9) == Unrest(at_rest=True, speed=0.002, net_force=7e-5)
    assert log.unrest_at(7) is None
    assert log.unrest_at(11) == log.unrest_at(6)
    assert log.unrest_at(9).words == "rms speed 0.002 g h, net force 7e-05 of the weight"


def test_damaged_numbers_of_rest(tmp_path: Path) -> None:
    """No number, or none that is finite, is an error that names the line."""
    (tmp_path / "log.lammps").write_text(ends(0, 6, MOVES.replace("0.232", "0.2x2")))
    with pytest.raises(LogError, match=r"log\.lammps, line 4: 'at its end .* is damaged"):
        read_run_log(tmp_path / "log.lammps")
