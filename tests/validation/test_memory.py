"""The whole plugin inside LAMMPS under the sanitizers and valgrind, and whether its memory grows.

Of LAMMPS, MPI and the C library little is asked: the sanitizers watch the plugin alone, but for
leaks, and of what valgrind reports only that counts which has a line of ours in it.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.fix import test_bodies_continuation as of_bodies
from tests.fix import test_continuation as of_spheres
from tests.fix import test_determinism as moving
from tests.fix import test_scene_changes as scene_changes
from tests.fix.test_refusals import deck
from tests.helpers.bodies import DUMP_BODIES
from tests.helpers.building import sanitized_plugin, sanitizer_libraries
from tests.helpers.lammps_run import BIN, plugin_file, run_lmp, without_launcher
from tests.helpers.scenes import DUMP_CONTACTS, DUMP_FORCES, DUMP_PARTICLES

pytestmark = pytest.mark.validation

ALL_DUMPS = DUMP_PARTICLES + DUMP_CONTACTS + DUMP_FORCES


def spheres(folder: Path) -> str:
    """A floor that moves, records, every output, and a restart file that is read."""
    start = moving.spheres(folder).replace("random/force 5", "random/force 20")
    virial = "compute stress all stress/atom NULL virial\ndump s all custom 5 s.dump c_stress[1]"
    first = start + ALL_DUMPS + virial + "\nrun 60\nwrite_restart half.restart\nclear\n"
    return first + start.replace("read_data spheres.data", "read_restart half.restart") + "run 20\n"


def bodies(folder: Path, inertia: str) -> str:
    """Steps that are shortened, a second run, another tolerance, and the fix taken away."""
    start = moving.dimers(folder, inertia) + ALL_DUMPS + DUMP_BODIES
    return f"{start}run 60\nfix_modify contact tolerance 1e-4\nrun 10\nunfix contact\n"


def uzawa(folder: Path) -> str:
    return of_spheres.cloud(folder, tolerance=1e-4, options="region container solver uzawa") + (
        "run 60\ncreate_atoms 1 single 0.4 0.9 0.4\nset atom 121 diameter 0.12\nrun 10\n"
    )


def bad_start(folder: Path) -> str:
    """A restart file that holds what pushes spheres out of a wall."""
    start = of_spheres.cloud(folder)
    first = f"{start}restart 1 here.*.restart\nrun 3\nclear\n"
    return (
        first + start.replace("read_data spheres.data", "read_restart here.2.restart") + "run 5\n"
    )


SCENES: dict[str, Callable[[Path], str]] = {
    "spheres": spheres,
    "point": lambda folder: bodies(folder, "point"),
    "solid": lambda folder: bodies(folder, "solid"),
    "uzawa": uzawa,
    "bad start": bad_start,
    # More than 300 ghosts, for which LAMMPS would make too small buffers.
    "newton off": lambda folder: scene_changes.crowd(folder, "off") + ALL_DUMPS + "run 20\n",
}
REFUSED = {
    "argument": lambda folder: deck(folder) + "fix more all inelastic 1e-5 region nowhere\n",
    "outside": lambda folder: deck(folder) + "set atom 7 y -0.01\nrun 5\n",
    "later force": lambda folder: deck(folder) + "fix wind all addforce 1e-6 0 0\nrun 5\n",
}


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the plugin with both sanitizers; return its folder."""
    return sanitized_plugin(tmp_path_factory.mktemp("build"))


@pytest.fixture(scope="module")
def preloaded() -> str:
    """The sanitizers' libraries of the compiler: LAMMPS itself was built without."""
    try:
        return sanitizer_libraries()
    except FileNotFoundError as error:
        # Other compilers link theirs into the program, and LAMMPS's program is not ours.
        pytest.skip(str(error))


def watched(plugin: Path, preloaded: str, *, leaks: bool) -> dict[str, object]:
    """Return what run_lmp needs to run LAMMPS with a plugin under the sanitizers."""
    program, environment = without_launcher(plugin)
    return {
        # Not for mpiexec, which is not to be watched.
        "program": ("env", f"LD_PRELOAD={preloaded}", program),
        "environment": environment | {"ASAN_OPTIONS": f"detect_leaks={int(leaks)}"},
        "timeout": 120.0,
        "must_pass": False,
    }


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("name", SCENES)
def test_sanitizers(name: str, ranks: int, tmp_path: Path, sanitized: Path, preloaded: str) -> None:
    """Also leaks count: those of LAMMPS and MPI are reachable when they end."""
    result = run_lmp(
        tmp_path,
        SCENES[name](tmp_path),
        ranks=ranks,
        **watched(sanitized, preloaded, leaks=True),  # type: ignore[arg-type]
    )
    assert "runtime error" not in result.screen, result.screen[-5000:]
    assert "Sanitizer" not in result.screen, result.screen[-5000:]
    assert result.status == 0, result.screen[-5000:]
    assert not result.errors
    steps = sum(len(run["Step"]) for run in result.runs)
    print(f"{name}, {ranks} ranks: no report of the sanitizers, {steps} lines of thermo output")


@pytest.mark.parametrize("name", REFUSED)
def test_sanitizers_when_something_is_refused(
    name: str, tmp_path: Path, sanitized: Path, preloaded: str
) -> None:
    """LAMMPS then ends without giving its memory back."""
    result = run_lmp(
        tmp_path,
        REFUSED[name](tmp_path),
        **watched(sanitized, preloaded, leaks=False),  # type: ignore[arg-type]
    )
    assert "runtime error" not in result.screen, result.screen[-5000:]
    assert "Sanitizer" not in result.screen, result.screen[-5000:]
    assert len(result.errors) == 1
    print(f"{name}: refused, no report of the sanitizers")


# A package of the system, which pip cannot install; the sanitizers above need only the compiler.
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
@pytest.mark.parametrize("name", ["spheres", "point"])
def test_valgrind(name: str, tmp_path: Path) -> None:
    """The plugin as it is installed. Sanitizers do not see memory that was never written."""
    program, environment = without_launcher(plugin_file().parent)
    report = tmp_path / "valgrind.xml"
    options = ["--xml=yes", f"--xml-file={report}", "--num-callers=40", "--leak-check=full"]
    # What is known of the plugin must outlive it: leaks are looked for when it has been unloaded.
    options.append("--keep-debuginfo=yes")
    run_lmp(
        tmp_path,
        SCENES[name](tmp_path),
        program=("valgrind", *options, program),
        environment=environment,
        timeout=300.0,
    )
    tree = ElementTree.parse(report)
    assert tree.find(".//status/state") is not None
    ours = [
        ElementTree.tostring(error, encoding="unicode")
        for error in tree.findall("error")
        if any("inelastic" in (frame.findtext("obj") or "") for frame in error.iter("frame"))
    ]
    assert not ours, ours[0][:3000]
    print(f"{name}: {len(tree.findall('error'))} reports of memcheck, none of the plugin")


GROWTH = """
import json, sys
from mpi4py import MPI
from lammps import lammps

def resident():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))

engine = lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])
engine.file("deck.in")
engine.command("run 1000")
before = resident()
engine.command("run 9000")
with open(f"{MPI.COMM_WORLD.rank}.json", "w") as file:
    json.dump([before, resident()], file)
"""
# [kB] Of 9,000 steps of 120 spheres: one double per step and sphere would be 8,400.
GROWN = 1000


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("kind", ["spheres", "solid"])
def test_memory_does_not_grow(kind: str, ranks: int, tmp_path: Path) -> None:
    """From 1,000 to 10,000 steps of a packing at rest."""
    if kind == "spheres":
        scene = of_spheres.cloud(tmp_path, tolerance=1e-4, fixes="fix drag all viscous 0.01")
    else:
        scene = of_bodies.cloud(tmp_path, kind, tolerance=1e-4)
    (tmp_path / "deck.in").write_text(scene + "thermo 1000\n")
    command = [sys.executable, "-c", GROWTH]
    if ranks > 1:
        command = [str(BIN / "mpiexec"), "-bind-to", "core", "-n", str(ranks), *command]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    memory = [json.loads((tmp_path / f"{rank}.json").read_text()) for rank in range(ranks)]
    each = "; ".join(f"{before} and {after} kB" for before, after in memory)
    print(f"{kind}, {ranks} ranks: memory after 1,000 and 10,000 steps {each}")
    for before, after in memory:
        assert after - before <= GROWN
