"""A scene drawn at random in which uzawa once left 1.4 tolerances: 7357 of commit a33e2a6."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import DUMP_PARTICLES, deepest_pair, read_dump

EPS = 0.017641176236424871
DIAMETER = 5.8242453498381188
STEP = 2.2054925550343514
BOX = ((-141.27011542639087, 166.10414578785276), (0.42787760234569899, 13.532429639481467),
       (-217.20688245182421, 249.85603161927696))  # fmt: skip
SPHERES = """
1 9.371340683518067 3.5316635777417469 22.862121765557418
2 14.552469446896174 7.6128391747553854 24.185741632521648
3 14.636328701688864 5.8338326905688556 8.6226238897894021
4 10.486347334050027 5.9386532986958063 15.000770394095831
5 11.897757430966472 12.798500063806722 10.080688373464756
6 12.426769470576772 12.297923679926292 16.82467543384217
7 9.3467958349595186 7.8368233264824081 6.34207915681234
"""
VELOCITIES = """
1 0.039709354549220276 -0.17814477685172356 0.07139060931683508
2 -0.097394925678527075 0.50122547850196741 -0.03927528365811387
3 -0.17153110752996595 0.26828183889463603 -0.19504491170742444
4 0.61360519639856581 -0.24052845487228128 -0.023823190326157918
5 0.20919540657916977 0.57457714708297025 0.094040493255798663
6 0.64188875007305091 1.1183630335828429 0.29747158969629089
7 -0.14201336142405893 0.34901475271618687 0.063272824088314833
"""
# A point of each wall, its normal (axis, sign), and how it moves along x and z.
WALLS: dict[str, tuple[float, int, int, str, str]] = {
    "right": (18.446419758871844, 0, -1, "-0.0014498754850209409*time",
              "0.00029263231132843658*time"),
    "bottom": (3.0365948757283006, 2, 1, "-0.0018370732746817767*time",
               "-0.0018346154307554107*time"),
    "top": (29.61255429172445, 2, -1, "0.62886958466498366*sin(2*PI*time/170.89074118078017)",
            "-0.35192363986101338*sin(2*PI*time/170.89074118078017)"),
    "left": (6.387610602590021, 0, 1, "-0.0044419307246973327*time",
             "0.0053923780614311267*time"),
}  # fmt: skip


def motion(formula: str, time: float) -> float:
    """Return the value of a LAMMPS formula of the time."""
    return float(eval(formula, {"sin": np.sin, "PI": np.pi, "time": time}))


def scene(folder: Path, solver: str) -> str:
    """Return the deck, and write its spheres."""
    density = 0.47923335870749129
    lines = ["# spheres", "", "7 atoms", "1 atom types", ""]
    lines += [f"{a:.17g} {b:.17g} {x}lo {x}hi" for (a, b), x in zip(BOX, "xyz", strict=True)]
    lines += ["", "Atoms", ""]
    for line in SPHERES.split("\n")[1:-1]:
        name, centre = line.split(maxsplit=1)
        lines.append(f"{name} 1 {DIAMETER} {density} {centre}")
    lines += ["", "Velocities", "", *(f"{line} 0 0 0" for line in VELOCITIES.split("\n")[1:-1])]
    (folder / "spheres.data").write_text("\n".join(lines) + "\n")
    walls = []
    for name, (place, axis, sign, along_x, along_z) in WALLS.items():
        point, normal = [0.0, 0.0, 0.0], [0, 0, 0]
        point[axis], normal[axis] = place, sign
        numbers = " ".join(f"{value:.17g}" for value in [*point, *normal])
        walls += [f"variable {name}x equal {along_x}", f"variable {name}z equal {along_z}"]
        walls += [f"region {name} plane {numbers} move v_{name}x NULL v_{name}z"]
    return "\n".join(
        [
            "units lj",
            "atom_style sphere",
            "boundary s p s",
            "read_data spheres.data",
            *walls,
            f"pair_style zero {DIAMETER}",
            "pair_coeff * *",
            "neighbor 13.104552037135768 nsq",
            "neigh_modify delay 0 every 1 check yes",
            f"timestep {STEP}",
            "fix gravity all gravity 3.1577985343652903 vector 0.001 0 0.001",
            "fix motion all nve",
            f"fix contact all inelastic {EPS} region {' '.join(WALLS)} shorten yes solver {solver}",
            "thermo 1",
            "thermo_style custom step time",
            "thermo_modify format float %.17g",
        ]
    )


@pytest.mark.parametrize("solver", ["sweeps", "apgd", "uzawa"])
def test_flat_walls_that_move(solver: str, tmp_path: Path, lmp: Runner) -> None:
    """Free spheres overlap one another and flat walls by at most EPS, after a new start, too."""
    deck = scene(tmp_path, solver) + DUMP_PARTICLES
    end = "run 5\ndelete_atoms random fraction 0.3 yes all NULL 2 compress yes\nrun 6\n"
    result = lmp(deck + end)
    times = {
        int(step): float(time)
        for run in result.runs
        for step, time in zip(run["Step"], run["Time"], strict=True)
    }
    deepest = 0.0
    for frame in read_dump(tmp_path / "particles.dump"):
        x = frame.positions
        deepest = max(deepest, deepest_pair(x, frame["radius"], [0, BOX[1][1] - BOX[1][0], 0]))
        for place, axis, sign, along_x, along_z in WALLS.values():
            moved = motion(along_z if axis == 2 else along_x, times[frame.step])
            away = sign * (x[:, axis] - place - moved)
            deepest = max(deepest, float((DIAMETER / 2 - away).max()))
    # The round-off of coordinates.
    assert deepest <= EPS * (1 + 1e-9)
