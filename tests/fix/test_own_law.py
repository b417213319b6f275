"""A contact law that is not ours: the example of the documentation, built as readers build it."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from lammps_inelastic.plugin import include_folder
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import DUMP_PARTICLES, read_dump, scene

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "laws.md"
RADIUS = 0.5


def build(source: str, folder: Path, name: str = "own.so") -> Path:
    """Compile a law as the page says; return its plugin."""
    compiler = shutil.which("g++")
    assert compiler is not None
    (folder / "own.cpp").write_text(source)
    plugin = folder / name
    command = [compiler, "-std=c++17", "-O1", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror"]
    command += ["-I", include_folder(), str(folder / "own.cpp"), "-o", str(plugin)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return plugin


def example() -> str:
    found = re.search(r"```cpp\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert found is not None
    return found[1]


def deck(folder: Path, law: str, speed: float) -> str:
    return scene(
        [[0.0, RADIUS + 0.1, 0.0]],
        RADIUS,
        folder,
        tolerance=1e-6,
        velocities=[[0.0, -speed, 0.0]],
        box=((-5.0, 5.0), (0.0, 5.0), (-5.0, 5.0)),
        timestep=0.01,
        gravity=False,
        options=f"region container law {law}",
        setup="plugin load ./own.so",
    )


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_example_of_the_page(ranks: int, tmp_path: Path, lmp: Runner) -> None:
    build(example(), tmp_path)
    for speed, after in ((0.5, 0.4), (0.2, 0.0)):
        text = deck(tmp_path, "restitution/above 0.8 0.3", speed)
        lmp(text + DUMP_PARTICLES + "run 100\n", ranks=ranks)
        last = read_dump(tmp_path / "particles.dump")[-1]
        # Velocities are solved to a thousandth of what contacts change.
        assert last.velocities[0, 1] == pytest.approx(after, abs=2e-3 * speed)


def test_its_words_are_checked(tmp_path: Path, refused: Callable[..., str]) -> None:
    build(example(), tmp_path)
    line = refused(deck(tmp_path, "restitution/above 0.8", 1.0) + "run 1\n")
    assert "needs law restitution/above E V, with E from 0 to 1 and a speed V" in line
    line = refused(deck(tmp_path, "restitution/below 0.8", 1.0) + "run 1\n")
    assert "must be inelastic, gluey, restitution or restitution/above, not" in line


def test_the_name_of_another_law(tmp_path: Path, refused: Callable[..., str]) -> None:
    build(example().replace('LAW("restitution/above"', 'LAW("gluey"'), tmp_path)
    line = refused(deck(tmp_path, "gluey", 1.0) + "run 1\n")
    assert "a contact law of fix inelastic has the name gluey already" in line


def test_a_law_of_another_version(tmp_path: Path, refused: Callable[..., str]) -> None:
    source = example().replace('#include "contact_law_plugin.h"', "", 1)
    header = (Path(include_folder()) / "contact_law_plugin.h").read_text()
    other = header.replace("inelastic::CONTACT_LAW_VERSION", "0")
    build(other.replace("#pragma once", "") + source, tmp_path)
    line = refused(deck(tmp_path, "restitution/above 0.8 0.3", 1.0) + "run 1\n")
    assert "was built for version 0 of contact laws" in line
