"""Only what a scene requires: what code that a scene does not use costs it.

Free spheres without walls, bodies or output are run with the plugin as it is and with plugins from
whose sources that code is cut, in turn. Each cut is a replacement in a copy of the sources; the
compiler removes what can then not be reached. (The random force is a fix of its own: where a deck
does not define it, it is not there.)
"""

from __future__ import annotations

import os
import re
import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path

from tests import building
from tests.fix.lammps_run import without_launcher

ROOT = Path(__file__).parents[2]
REPEATS = 9

LAMMPS = "src_fix/lammps"
PACKED = "src_fix/core/packed_iterations.cpp"
# File, what is there, and what takes its place.
Cut = tuple[str, str, str]

BODIES: list[Cut] = [
    (f"{LAMMPS}/fix_settings.h", "return !rigid_fix.empty();", "return false;"),
    (
        f"{LAMMPS}/step.h",
        "return has_bodies && problem.bodies.body[i] >= 0;",
        "return false;",
    ),
    ("src_fix/core/rigid_bodies.h", "return inverse_mass.empty();", "return true;"),
    (PACKED, "if (!rods_.empty() || !bodies_.empty())", "if (false)"),
]
WALLS: list[Cut] = [(f"{LAMMPS}/region_walls.h", "return ids_.empty();", "return true;")]
OUTPUT: list[Cut] = [
    (
        f"{LAMMPS}/contact_output.cpp",
        "double *const out = local_[local_rows_++];",
        "static double out[LOCAL_COLUMNS];",
    ),
    (
        f"{LAMMPS}/contact_output.cpp",
        "if (virial.global || virial.per_atom) {",
        "if (false) {",
    ),
]
# Bodies that turn are followed to the end of the step by this code; tests/tables.py shows its work.
TURNING: list[Cut] = [
    (
        f"{LAMMPS}/constraints.cpp",
        "if (bodies_ || wall_constraints_.need_relinearising()) {",
        "if (false) {",
    ),
    (
        f"{LAMMPS}/pair_constraints.cpp",
        "!(bodies_ && square_at_end(i, j) < distance * distance)",
        "true",
    ),
]
CUTS = {
    "bodies, walls and output together": BODIES + WALLS + OUTPUT,
    "bodies": BODIES,
    "walls": WALLS,
    "lists of contacts for output, and the virial": OUTPUT,
}

SCENE = """units lj
atom_style sphere
boundary p f p
region box block 0 1 0 5 0 1 units box
region above block 0 1 0.1 4.9 0 1 units box
create_box 2 box
pair_style zero 0.052
pair_coeff * *
neighbor 0.03 bin
neigh_modify delay 0 every 1 check yes
lattice sc 8000
region floor block 0 1 0.02 0.06 0 1 units box
create_atoms 2 region floor
create_atoms 1 random 10000 1 above
set group all diameter 0.052 density 1
group floor type 2
group mobile type 1
timestep 0.01
fix gravity mobile gravity 9.81 vector 0 -1 0
fix contact all inelastic 1.3e-4 frozen floor shorten yes
fix motion mobile nve
thermo 1000
run 250
"""


def build(folder: Path, cuts: list[Cut]) -> Path:
    """Build the plugin from a copy of the sources with some code cut; return its folder."""
    sources = folder / "sources"
    shutil.copytree(ROOT / "src_fix", sources / "src_fix")
    shutil.copy(ROOT / "CMakeLists.txt", sources)
    for name, there, instead in cuts:
        path = sources / name
        text = path.read_text()
        assert text.count(there) == 1, f"{name} has not one {there!r}"
        path.write_text(text.replace(there, instead))
    return building.plugin(sources, folder / "build")


def seconds(plugin: Path) -> float:
    """Return the seconds of the scene's time loop with a plugin."""
    program, environment = without_launcher(plugin)
    done = subprocess.run(
        [program, "-log", "none"],
        input=SCENE,
        env=os.environ | environment | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    loop = re.search(r"^Loop time of (\S+)", done.stdout, re.MULTILINE)
    assert loop is not None, done.stdout
    return float(loop[1])


def measure(*, each: bool) -> None:
    """Print what unused parts cost a scene, all together and, if wanted, each."""
    cuts = CUTS if each else dict([next(iter(CUTS.items()))])
    with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
        plugins = {
            part: build(Path(name) / str(number), cuts)
            for number, (part, cuts) in enumerate({"nothing": [], **cuts}.items())
        }
        whole = plugins.pop("nothing")
        # Warm-up.
        seconds(whole)
        ratios: dict[str, list[float]] = {part: [] for part in plugins}
        for _ in range(REPEATS):
            for part, plugin in plugins.items():
                first = seconds(whole)
                ratios[part].append(first / seconds(plugin))
    for part, values in ratios.items():
        quartiles = statistics.quantiles(values, n=4)
        print(
            f"10,000 free spheres with the code of {part} take {quartiles[1]:.3f} times as long as "
            f"without it (quartiles {quartiles[0]:.3f} and {quartiles[2]:.3f})",
            flush=True,
        )
