"""Builds parts of the project with CMake, as its own files say, and with more compiler options."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
# This Python's own tools (such as those of the packages cmake and ninja), then the system's.
TOOLS = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])


def cmake() -> list[str]:
    found = shutil.which("cmake", path=TOOLS)
    if found:
        return [found]
    if importlib.util.find_spec("cmake"):
        return [sys.executable, "-m", "cmake"]
    pytest.fail("CMake is missing: pip install cmake, or install it with the system's packages")


def generator() -> list[str]:
    for name, tool in (("Ninja", "ninja"), ("Unix Makefiles", "make")):
        found = shutil.which(tool, path=TOOLS)
        if found:
            return ["-G", name, f"-DCMAKE_MAKE_PROGRAM={found}"]
    pytest.fail("Ninja and make are missing: pip install ninja, or install either of them")


def run(*command: str) -> None:
    environment = {**os.environ, "PATH": TOOLS, "CTEST_OUTPUT_ON_FAILURE": "1"}
    done = subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    if done.returncode:
        pytest.fail(f"{' '.join(command)}\n{done.stdout}", pytrace=False)
