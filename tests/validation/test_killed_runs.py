"""Runs that are killed at any moment go on from their restart files as if nothing had happened.

Contacts amplify round-off; at a tolerance of 5e-9 r, 100 steps must agree within 0.0005 r.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.fix import test_bodies_continuation as of_bodies
from tests.fix import test_continuation as of_spheres
from tests.helpers.lammps_run import BIN, OF_A_LAUNCHER, run_lmp
from tests.helpers.scenes import FloatArray

pytestmark = pytest.mark.validation

STEPS = of_spheres.STEPS
SCENES: dict[str, Callable[[Path], str]] = {
    "spheres": of_spheres.cloud,
    # These amplify more than the others: a difference of 5e-9 r to 0.001 r.
    "point": lambda folder: of_bodies.cloud(folder, "point", tolerance=of_bodies.EXACT / 100),
    "solid": lambda folder: of_bodies.cloud(folder, "solid"),
}
# [s] Of a run of a second on a busy machine.
PATIENCE = 60.0


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, FloatArray]:
    """Return the positions after 100 steps in one go, on one rank."""
    ends = {}
    for kind, cloud in SCENES.items():
        folder = tmp_path_factory.mktemp(kind)
        run_lmp(folder, cloud(folder) + of_spheres.DUMP_LAST + f"run {STEPS}\n")
        ends[kind] = of_spheres.last_positions(folder)
    return ends


def killed_at(folder: Path, deck: str, step: int, ranks: int) -> None:
    """Run a deck, and kill all of it with SIGKILL once a restart file of a step is there."""
    (folder / "deck.in").write_text(deck)
    command = [str(BIN / "lmp"), "-in", "deck.in", "-log", "none"]
    if ranks > 1:
        command = [str(BIN / "mpiexec"), "-bind-to", "core", "-n", str(ranks), *command]
    process = subprocess.Popen(
        command,
        cwd=folder,
        env={
            name: value for name, value in os.environ.items() if not name.startswith(OF_A_LAUNCHER)
        },
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    deadline = time.monotonic() + PATIENCE
    while not (folder / f"killed.{step}.restart").exists():
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.0005)
    # mpiexec gives each rank a group of its own, so that the group is not enough.
    for pid in [*_of_folder(folder), process.pid]:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue
    process.wait(PATIENCE)


def _of_folder(folder: Path) -> list[int]:
    """The processes that work in a folder."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and os.readlink(entry / "cwd") == str(folder):
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def gone_on(folder: Path, deck: str, ranks: int) -> int:
    """Go on from the newest restart file that is whole, up to step 100; return its step."""
    files = {int(path.name.split(".")[1]): path for path in folder.glob("killed.*.restart")}
    steps = sorted((step for step in files if step < STEPS), reverse=True)
    for step in steps[:2]:
        path = files[step]
        second = deck.replace("read_data spheres.data", f"read_restart {path.name}")
        second += of_spheres.DUMP_LAST + f"run {STEPS - step}\n"
        result = run_lmp(folder, second, ranks=ranks, must_pass=False)
        if result.status == 0:
            return step
        # What was being written when the run was killed is refused, and never taken for whole.
        assert step == steps[0], result.screen[-2000:]
    raise AssertionError("no restart file is whole")


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("kind", SCENES)
def test_killed_at_random_steps(
    kind: str, ranks: int, undisturbed: dict[str, FloatArray], tmp_path: Path
) -> None:
    random = np.random.default_rng(sum(map(ord, kind)) + ranks)
    far, steps = [], []
    for number, step in enumerate(random.integers(1, STEPS - 5, size=4)):
        folder = tmp_path / f"{number}"
        folder.mkdir()
        deck = SCENES[kind](folder)
        # So long that it is still running when it is killed.
        killed_at(folder, f"{deck}restart 1 killed.*.restart\nrun 100000\n", int(step), ranks)
        # From one rank to two and back, too.
        from_step = gone_on(folder, deck, ranks if number % 2 == 0 else 3 - ranks)
        apart = np.abs(of_spheres.last_positions(folder) - undisturbed[kind]).max()
        far.append(apart / of_spheres.RADIUS)
        steps.append(str(from_step))
        assert step <= from_step < STEPS or from_step == step - 1
    print(
        f"{kind}, {ranks} ranks, killed after steps {', '.join(steps)}: at most {max(far):.2g} r "
        "apart"
    )
    assert max(far) <= 0.0005


@pytest.mark.parametrize("kind", SCENES)
def test_from_the_restart_file_of_any_step(
    kind: str, undisturbed: dict[str, FloatArray], tmp_path: Path
) -> None:
    """A run starts with half a kick: it must find the same step from another prediction."""
    deck = SCENES[kind](tmp_path)
    run_lmp(tmp_path, f"{deck}restart 1 whole.*.restart\nrun {STEPS}\n")
    far = []
    for step in range(1, STEPS):
        second = deck.replace("read_data spheres.data", f"read_restart whole.{step}.restart")
        run_lmp(tmp_path, second + of_spheres.DUMP_LAST + f"run {STEPS - step}\n")
        apart = np.abs(of_spheres.last_positions(tmp_path) - undisturbed[kind]).max()
        far.append(apart / of_spheres.RADIUS)
    worst = int(np.argmax(far))
    print(f"{kind}, from each of {STEPS - 1} steps: at most {far[worst]:.2g} r apart ({worst + 1})")
    assert max(far) <= 0.0005
