"""Builds parts of the project with CMake, as its own files say, and with more compiler options."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
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


def plugin(sources: Path, build: Path) -> Path:
    """Build the plugin of these sources in a folder; return the folder that holds it."""
    options = ["-DINELASTIC_PYTHON=OFF", "-DINELASTIC_PLUGIN=ON"]
    options += [f"-DPython_EXECUTABLE={sys.executable}", *generator()]
    run(*cmake(), "-S", str(sources), "-B", str(build), *options)
    run(*cmake(), "--build", str(build), "--target", "inelasticplugin")
    return build / "src_fix" / "lammps"


def sanitized_plugin(build: Path) -> Path:
    """Build the plugin with both sanitizers in a folder; return the folder that holds it."""
    run(
        *cmake(),
        *("-S", str(REPOSITORY), "-B", str(build)),
        *generator(),
        "-DINELASTIC_PYTHON=OFF",
        "-DINELASTIC_PLUGIN=ON",
        "-DINELASTIC_SANITIZE=ON",
        f"-DPython_EXECUTABLE={sys.executable}",
        # To optimise more would take most of the time of the build.
        *("-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=-O1"),
    )
    run(*cmake(), "--build", str(build), "--target", "inelasticplugin")
    (plugin,) = build.glob("src_fix/lammps/inelasticplugin.so")
    return plugin.parent


def sanitizer_libraries() -> str:
    """Return the libraries to be loaded first, for LD_PRELOAD; LAMMPS itself was built without.

    Raises FileNotFoundError with the name of one that the compiler does not have: others than GCC
    link theirs into the program, and LAMMPS's program is not ours.
    """
    found = []
    for name in ("libasan.so", "libubsan.so"):
        said = subprocess.run(
            ["c++", f"-print-file-name={name}"], capture_output=True, text=True, check=True
        )
        path = Path(said.stdout.strip())
        if not path.is_absolute():
            raise FileNotFoundError(f"the compiler has no {name} to be loaded first (GCC has)")
        found.append(str(path.resolve()))
    return " ".join(found)
