"""What goes wrong on one rank ends the run on all, within seconds."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.fix.test_plugin import ELSEWHERE, HERE
from tests.fix.test_refusals import BOX, EPS, POINTS, RADIUS, deck
from tests.helpers.bodies import body_scene, dimer, placed
from tests.helpers.lammps_run import BIN, OF_A_LAUNCHER, Runner, plugin_file
from tests.helpers.scenes import scene

Refused = Callable[..., str]
# [s] A run takes one; a rank that waited for another would wait for ever.
SOON = 20.0
HALVES = "processors 1 2 1"

# One sphere of thirty, which one rank of the two owns.
MISTAKES = {
    "not finite": ("set atom 7 vx 1e300", ["atom 7", "finite"]),
    "outside": ("set atom 7 y -0.01", ["atom 7", "region container"]),
    "moved": ("fix push one addforce 1e-3 0 0", ["atom 7", "did not move as predicted"]),
    "held": ("fix hold one setforce 0 0 0", ["fix hold (setforce)", "keyword frozen"]),
    "no radius": ("set atom 7 diameter 0", ["radius"]),
    "wide": ("set atom 7 diameter 0.5", ["neighbour list"]),
    "fast": ("set atom 7 vx 30", ["neighbour list"]),
    "coincident": (
        "set atom 7 x 0.2 y 0.5 z 0.2\nset atom 8 x 0.2 y 0.5 z 0.2",
        ["atoms 7 and 8 coincide"],
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_one_sphere(name: str, tmp_path: Path, refused: Refused) -> None:
    what, words = MISTAKES[name]
    text = deck(tmp_path, setup=HALVES) + f"group one id 7\n{what}\nrun 5\n"
    error = refused(text, ranks=2, timeout=SOON)
    for word in words:
        assert word in error, error


def test_one_body(tmp_path: Path, refused: Refused) -> None:
    """A body of the lower rank is pushed."""
    shape = 2 * RADIUS * dimer(1.5)
    bodies = placed(shape, (0.3, 0.3, 0.3)).joined(placed(shape, (0.3, 1.5, 0.3)))
    text = body_scene(
        bodies, RADIUS, tmp_path, inertia="point", tolerance=EPS, box=BOX, setup=HALVES
    )
    text += "group one molecule 1\nfix push one addforce 1e-2 0 0\nrun 5\n"
    error = refused(text, ranks=2, timeout=SOON)
    assert "did not move as predicted" in error


def test_a_record_that_only_the_first_rank_writes(tmp_path: Path, refused: Refused) -> None:
    text = deck(tmp_path, setup=HALVES, options="region container record no/step*.npz every 2")
    assert "no/step2.npz" in refused(text + "run 5\n", ranks=2, timeout=SOON)


def test_an_error_of_lammps_itself(tmp_path: Path, refused: Refused) -> None:
    """One rank loses an atom; LAMMPS's message is its own."""
    text = deck(tmp_path, setup=HALVES, options="", gravity=False)
    error = refused(text + "set atom 7 vy -300\nrun 200\n", ranks=2, timeout=SOON)
    assert "ERROR" in error


@pytest.mark.parametrize("victim", [0, 1])
def test_a_rank_that_is_killed(victim: int, tmp_path: Path) -> None:
    text = scene(POINTS, RADIUS, tmp_path, tolerance=EPS, box=BOX, setup=HALVES)
    (tmp_path / "deck.in").write_text(text + "thermo 10000\nrun 100000000\n")
    process = subprocess.Popen(
        [str(BIN / "mpiexec"), "-n", "2", str(BIN / "lmp"), "-in", "deck.in", "-log", "none"],
        cwd=tmp_path,
        env={k: v for k, v in os.environ.items() if not k.startswith(OF_A_LAUNCHER)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        deadline = time.monotonic() + SOON
        while len(ranks := ranks_in(tmp_path)) < 2:
            assert time.monotonic() < deadline
            time.sleep(0.02)
        # Until both are past their start.
        time.sleep(0.5)
        os.kill(ranks[victim], signal.SIGKILL)
        assert process.wait(SOON) != 0
        while ranks_in(tmp_path):
            assert time.monotonic() < deadline + SOON
            time.sleep(0.02)
    finally:
        for pid in ranks_in(tmp_path):
            os.kill(pid, signal.SIGKILL)
        process.kill()
        process.wait()


def ranks_in(folder: Path) -> list[int]:
    """The processes of LAMMPS's own program that work in a folder, the launchers apart."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and os.readlink(entry / "cwd") == str(folder):
                program = (entry / "cmdline").read_bytes().split(b"\0")[0]
                if program.endswith(b"/lammps/lmp"):
                    found.append(int(entry.name))
        except OSError:
            continue
    return sorted(found)


def test_the_plugin_is_refused_once_by_all(tmp_path: Path, lmp: Runner) -> None:
    other = tmp_path / "otherplugin.so"
    other.write_bytes(plugin_file().read_bytes().replace(HERE, ELSEWHERE))
    text = "plugin clear\nplugin load ./otherplugin.so\n"
    result = lmp(text + deck(tmp_path), ranks=2, must_pass=False, timeout=SOON)
    assert result.status != 0
    assert len([line for line in result.warnings if "is not available" in line]) == 1
    # And the deck does not go on without it.
    (error,) = result.errors
    assert "inelastic" in error
