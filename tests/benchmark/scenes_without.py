"""Only what a scene requires: what code that a scene does not use costs it.

Free spheres without walls, bodies or output are run with the plugin as it is and with plugins in
which a few functions, found by their names, say from the start what is so in this scene: that it
has no bodies, that it has no walls, and so on. The compiler removes what can then not be reached.
(The random force is a fix of its own: where a deck does not define it, it is not there.)

Where valgrind is installed it counts instructions, which differ by less than a thousandth from run
to run. Seconds are those of a machine that may do something else, and differ by a tenth.
"""

from __future__ import annotations

import os
import re
import shutil
import statistics
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from tests.helpers import building
from tests.helpers.cpp_functions import give_bodies
from tests.helpers.lammps_run import without_launcher

ROOT = Path(__file__).parents[2]
REPEATS = 9

# Each function, and the statements that take the place of its own.
BODIES = {
    "Settings::has_bodies": "return false;",
    "Step::is_member": "return false;",
    "Movers::any_turns": "return false;",
    "RigidBodies::empty": "return true;",
}
WALLS = {"Walls::empty": "return true;"}
OUTPUT = {"ContactOutput::list_contact": "", "ContactOutput::add_virial": ""}
# Bodies that turn are followed to the end of the step by these; tests/tables.py shows their work.
TURNING = {
    "PairConstraints::relinearise": "return 0;",
    "WallConstraints::need_relinearising": "return false;",
    "Step::motion": "return velocity;",
}
PARTS = {
    "bodies, walls and output together": BODIES | WALLS | OUTPUT,
    "bodies": BODIES,
    "walls": WALLS,
    "lists of contacts for output, and the virial": OUTPUT,
}

# [length] Of the box; that of 10,000 spheres.
WIDTH, STEPS = 1.0, 250
# 900 spheres, and fewer steps, since valgrind takes fifty times as long.
COUNTED_WIDTH, COUNTED_STEPS = 0.3, 100


def scene(width: float, steps: int, output: str = "") -> str:
    """Return a deck: spheres fall on a floor of frozen ones.

    Parameters
    ----------
    width : of the box [length], a multiple of 0.05
    steps : of the run
    output : commands before the run
    """
    return f"""units lj
atom_style sphere
boundary p f p
region box block 0 {width} 0 5 0 {width} units box
region above block 0 {width} 0.1 4.9 0 {width} units box
create_box 2 box
pair_style zero 0.052
pair_coeff * *
neighbor 0.03 bin
neigh_modify delay 0 every 1 check yes
lattice sc 8000
region floor block 0 {width} 0.02 0.06 0 {width} units box
create_atoms 2 region floor
create_atoms 1 random {round(10000 * width**2)} 1 above
set group all diameter 0.052 density 1
group floor type 2
group mobile type 1
timestep 0.01
fix gravity mobile gravity 9.81 vector 0 -1 0
fix contact all inelastic 1.3e-4 frozen floor shorten yes
fix motion mobile nve
thermo 1000
{output}
run {steps}
"""


def build(folder: Path, bodies: Mapping[str, str]) -> Path:
    """Build the plugin with other bodies of some functions; return the folder that holds it.

    Raises LookupError: the sources define no such function.
    """
    sources = folder / "sources"
    shutil.copytree(ROOT / "src_fix", sources / "src_fix")
    shutil.copy(ROOT / "CMakeLists.txt", sources)
    give_bodies(sources / "src_fix", bodies)
    return building.plugin(sources, folder / "build")


def run(plugin: Path, deck: str, *, under: Sequence[str] = ()) -> str:
    """Run a deck with a plugin, `under` another program or none; return all that is printed."""
    program, environment = without_launcher(plugin)
    return subprocess.run(
        [*under, program, "-log", "none"],
        input=deck,
        env=os.environ | environment | {"OMP_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=True,
    ).stdout


def seconds(plugin: Path) -> float:
    """Return the seconds of the time loop of 10,000 spheres with a plugin."""
    printed = run(plugin, scene(WIDTH, STEPS))
    loop = re.search(r"^Loop time of (\S+)", printed, re.MULTILINE)
    assert loop is not None, printed
    return float(loop[1])


def instructions(plugin: Path, steps: int) -> int:
    """Return the instructions that LAMMPS runs for steps of 900 spheres, as valgrind counts."""
    under = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]
    printed = run(plugin, scene(COUNTED_WIDTH, steps), under=under)
    counted = re.search(r"I +refs: +([\d,]+)", printed)
    assert counted is not None, printed
    return int(counted[1].replace(",", ""))


def measure(*, each: bool) -> None:
    """Print what unused parts cost a scene, all together and, if wanted, each."""
    parts = PARTS if each else dict([next(iter(PARTS.items()))])
    with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
        whole, *others = [
            build(Path(name) / str(number), bodies)
            for number, bodies in enumerate([{}, *parts.values()])
        ]
        plugins = dict(zip(parts, others, strict=True))
        if shutil.which("valgrind") is not None:
            count = instructions(whole, COUNTED_STEPS)
            for part, plugin in plugins.items():
                ratio = count / instructions(plugin, COUNTED_STEPS)
                print(
                    f"900 free spheres with the code of {part} take {ratio:.4f} times as many "
                    "instructions as without it",
                    flush=True,
                )
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
