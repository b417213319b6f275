"""Beds in small curved containers, poured and settled, by seed: every step is checked.

python -m tests.random_scenes.curved_beds --beds 2000 --out beds.jsonl     goes on where it ended
python -m tests.random_scenes.curved_beds --seed 17 --beds 1 --keep        one again

Tubes, annuli, cones and balls of 1.5 to 8 diameters; spheres of one and two sizes, and dimers; EPS
from 1e-3 to 1e-6 of a radius; with and without `shorten`. Some steps are compared with the exact
projection, which gives no overlap back.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tests.helpers.bodies import dimer
from tests.random_scenes.exact_steps import against_exact
from tests.random_scenes.scene_checker import read_tables
from tests.random_scenes.scene_generator import (
    CONTACTS,
    FREE,
    FROZEN,
    OUTSIDE,
    NoPlaceError,
    Scene,
    SceneDraw,
    computes,
    numbers,
)
from tests.random_scenes.scene_loop import Programs, Verdict, installed, judge

STEPS = 500
RECORD_EVERY = 25
# Then it goes on until it rests, for so many steps at most.
SETTLING_STEPS, SETTLING_TIMES = 250, 40
AT_REST = 0.05
# In so many steps forces are added up: where EPS is much of g h^2 grains still jitter in a step.
WEIGHED_STEPS = 20
# [s] A bed that never comes to rest takes 10,500 steps, of up to 30 ms each.
LONGEST = 400.0
GRAVITY = 1.0
# At the start grains fill this part of the container, and are so many at most.
FILLED, MOST_GRAINS = 0.33, 120
# In the time in which a sphere falls by its radius, of which a step is a part.
STEP = (0.05, 0.2)
# Without `shorten`, in which a fall from the top ends within so many of the smallest radii.
STEP_AT_MOST = (0.3, 1.0)
# Of the weight, what floor and walls may be off by at the end.
CARRIED = 0.01


# What place() draws, and these beds have not.
NOT_HERE = (
    "densities differ",
    "mass ratio",
    "size ratio",
    "frozen",
    "frozen moving",
    "outside of the group",
    "bodies and free spheres",
    "fast",
)


@dataclass
class CurvedBed(SceneDraw):
    """The drawing of one bed."""

    kind: str = ""
    centre: list[float] = field(default_factory=lambda: [0.0, 0.0])

    def scene(self) -> Scene:
        self.units = "lj"
        self.radius, self.gravity, self.density = 0.5, GRAVITY, 1.0
        self.shorten = self.chance(0.5)
        self.timestep = np.sqrt(self.radius / self.gravity) * float(self.random.uniform(*STEP))
        self.solver, self.bad, self.periodic = "sweeps", False, [False] * 3
        self.grains = self.one("one size", "two sizes", "dimers")
        self.note(self.grains)
        self.bodies = self.grains == "dimers"
        self.inertia = "solid" if self.bodies else None
        self.spread = 1.0
        self.ratio = float(self.random.uniform(1.2, 3)) if self.grains == "two sizes" else 1.0
        self.tolerance = self.radius / self.ratio * self.log(-6, -3)
        self.draw_bed()
        self.place()
        self.start_tolerance = self.tolerance
        self.draw_commands()
        self.draw_timeline()
        return self.finished()

    def draw_bed(self) -> None:
        """The container, and as many grains as fill it by a third at most."""
        self.width = float(self.random.uniform(1.5, 8)) * 2 * self.radius
        self.kind = self.one("tube", "annulus", "cone", "ball")
        if self.bodies:
            self.width = max(self.width, 2.2 * 2 * self.radius)
        if self.kind == "annulus":
            self.width = max(self.width, (5 if self.bodies else 4) * 2 * self.radius)
        self.note(self.kind)
        outer = self.width / 2
        of_grain = 4 / 3 * np.pi * self.radius**3 * (1.6 if self.bodies else 1)
        # Across the axis, on the average over the height.
        narrow, inner = outer, 0.0
        if self.kind == "cone":
            narrow = outer * float(self.random.uniform(0, 1))
        if self.kind == "annulus":
            most = outer - 1.1 * 2 * self.radius * (2 if self.bodies else 1)
            inner = most * float(self.random.uniform(0.2, 1))
        area = np.pi * ((outer**2 + outer * narrow + narrow**2) / 3 - inner**2)
        # No higher than the grains need: a fall takes time.
        height = self.width * float(self.random.uniform(2, 5))
        height = min(height, max(MOST_GRAINS * of_grain / (FILLED * area), 3 * 2 * self.radius))
        volume = area * height
        tube = {"axis_name": "y", "centre": self.centre, "ends": [0.0, height]}
        shape = {"kind": "cylinder", "radius": outer, "inside": True, **tube}
        if self.kind == "ball":
            height = self.width
            volume = np.pi / 6 * self.width**3
            centre = [0.0, outer, 0.0]
            shape = {"kind": "sphere", "centre": centre, "radius": outer, "inside": True}
        elif self.kind == "cone":
            shape = {"kind": "cone", "radii": [narrow, outer], "inside": True, **tube}
        self.low = np.array([-outer, 0.0, -outer])
        self.high = np.array([outer, height, outer])
        self.single("wall", shape, motion=False)
        if self.kind == "annulus":
            core = {"kind": "cylinder", "radius": inner, "inside": False, **tube}
            core["ends"] = [-1.0, height + 1.0]
            self.single("core", core, motion=False)
        self.count = min(max(1, int(FILLED * volume / of_grain)), MOST_GRAINS)
        self.to_place = []
        for k in range(self.count):
            small = self.ratio > 1 and k % 2 == 1
            radius = self.radius / self.ratio if small else self.radius
            sphere = np.zeros((1, 3))
            shape_of = dimer(float(self.random.uniform(1.1, 2))) if self.bodies else sphere
            offsets = 2 * radius * (shape_of - shape_of.mean(axis=0))
            self.to_place.append((offsets, np.full(len(offsets), radius)))
        self.extent = 2 * self.radius
        self.smallest, self.largest = self.radius / self.ratio, self.radius
        self.skin = 2 * self.radius * float(self.random.uniform(0.5, 1))
        if not self.shorten:
            # As far as two go in a step that fall from the top and meet.
            fall = float(np.sqrt(2 * self.gravity * height))
            most = self.smallest * float(self.random.uniform(*STEP_AT_MOST)) / fall
            self.timestep = min(self.timestep, most)
            self.skin = max(self.skin, 3 * self.timestep * fall)
        self.arm = max(float(np.linalg.norm(o, axis=1).max()) for o, _ in self.to_place)
        self.ghosts = 2 * self.largest + self.skin + 4.1 * self.arm
        self.flags = ["m", "m", "m"]
        self.closing = self.created = self.open_sides = False
        self.number_walls()

    def place(self) -> None:
        super().place()
        self.spheres.kind = [FREE] * len(self.spheres.r)
        self.words = [word for word in self.words if word not in NOT_HERE]
        self.spheres.density[:] = self.density
        # Where steps may be shorter the grains fly about at first; others fall.
        if not self.shorten:
            self.spheres.v[:] = self.spheres.w[:] = 0.0
        self.frozen = self.outside = False
        self.frozen_moves = ""

    def draw_commands(self) -> None:
        self.ranks, self.setup, self.map = 1, [], "array"
        self.contact_first = False
        lines = [text for text, _ in self.regions]
        lines += [f"pair_style zero {numbers(2 * self.largest)}", "pair_coeff * *"]
        lines += [f"neighbor {numbers(self.skin)} bin", "neigh_modify delay 0 every 1 check yes"]
        lines += [f"comm_modify cutoff {numbers(self.ghosts)}", "timestep ${step}"]
        lines += [f"group frozen type {FROZEN}", f"group outside type {OUTSIDE}"]
        lines += [f"group grains type {FREE}", "group mobile subtract all frozen outside"]
        still = "frozen outside"
        if self.has_bodies:
            lines.append("group bodies molecule > 0")
            still += " bodies"
        lines.append(f"group free subtract all {still}")
        lines.append(f"fix gravity mobile gravity {numbers(self.gravity)} vector 0 -1 0")
        mass = 4 / 3 * np.pi * self.smallest**3
        drag = 0.3 * mass / np.sqrt(self.radius / self.gravity)
        lines.append(f"fix drag mobile viscous {numbers(drag)}")
        lines.append("fix motion free nve")
        if self.has_bodies:
            lines.append("fix bodies bodies rigid/small molecule")
        self.warn = False
        words = " ".join(name for _, names in self.regions for name in names)
        options = " rigid bodies solid" if self.has_bodies else ""
        if self.shorten:
            options += " shorten yes"
            self.note("shorten")
        lines.append("fix before all store/force")
        options += f" record problem.*.npz every {RECORD_EVERY}"
        lines.append(f"fix contact all inelastic ${{eps}} region {words}{options}")
        lines += computes(self.has_bodies, self.walls)
        self.settings = "\n".join(lines) + "\n"

    def draw_timeline(self) -> None:
        self.body = ["include redump.in", f"run {STEPS}"]
        # What still moves then goes on, without dumps.
        self.body += ["undump particles", "undump contacts"]
        self.body += ["undump bodies"] if self.has_bodies else []
        self.body += [
            'print "@settling"',
            f"thermo {SETTLING_STEPS}",
            f"variable moves equal f_contact[16]>{AT_REST}||f_contact[17]>{CARRIED / 2}",
            f"variable time loop {SETTLING_TIMES}",
            "label settling",
            'if "${moves} == 0" then "jump SELF settled"',
            f"run {SETTLING_STEPS}",
            "next time",
            "jump SELF settling",
            "label settled",
            "thermo 1",
            "include redump.in",
            f"run {WEIGHED_STEPS}",
        ]


def curved_bed(seed: int) -> Scene:
    """Draw a bed."""
    for attempt in range(100):
        with suppress(NoPlaceError):
            return CurvedBed(seed, attempt).scene()
    raise NoPlaceError


def carried(folder: Path) -> float:
    """By what part of the weight the forces of walls are off, on the average of the last steps.

    NaN of a run without these steps.
    """
    frames = read_tables(folder / "particles.02.dump")
    if not frames:
        # It was cut off before, which is a finding by itself.
        return np.nan
    weight = GRAVITY * frames[-1]["mass"].sum()
    lifted = []
    # The first frame is that of a half kick.
    for contacts in read_tables(folder / "contacts.02.dump", CONTACTS)[1:]:
        walls = contacts["id2"] < 0
        lifted.append((contacts["force"] * contacts["ny"])[walls].sum())
    return float(abs(np.mean(lifted) / weight - 1))


@dataclass(frozen=True)
class Judged:
    """A bed: what its steps showed, and what is left of it.

    Attributes
    ----------
    carried : by what part of its weight the walls miss it; NaN after an error
    compared : how many steps were compared with exact projections
    off : the largest velocity error of a grain there, over what it may be
    """

    verdict: Verdict
    carried: float
    compared: int
    off: float


def judge_bed(seed: int, folder: Path, programs: Programs) -> Judged:
    """Run a bed and check each of its steps."""
    scene = curved_bed(seed)
    verdict = judge(seed, folder, programs, scene=scene, keep=True)
    assert verdict is not None
    exact = against_exact(
        folder,
        scene.facts["shapes"],
        GRAVITY,
        scene.facts["timestep"],
        not_accurate="the accuracy was not reached" in (folder / "screen.txt").read_text(),
    )
    verdict = replace(verdict, problems=[*verdict.problems, *exact.problems])
    missed = carried(folder) if verdict.ended == "ended" else np.nan
    return Judged(verdict, missed, exact.compared, exact.worst)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--seed", type=int, default=1, help="the first seed (1)")
    parser.add_argument("--beds", type=int, default=60, help="how many (60)")
    parser.add_argument("--out", type=Path, help="a file of results; seeds in it are done")
    parser.add_argument("--keep", action="store_true", help="keep the files of right beds, too")
    given = parser.parse_args()
    done: dict[int, dict[str, object]] = {}
    if given.out is not None and given.out.exists():
        rows = [json.loads(line) for line in given.out.read_text().splitlines()]
        done = {row["seed"]: row for row in rows}
    folder = Path(tempfile.mkdtemp(prefix="curved_beds."))
    programs = replace(installed(), timeout=LONGEST)
    for seed in range(given.seed, given.seed + given.beds):
        if seed in done:
            continue
        bed = judge_bed(seed, folder / str(seed), programs)
        verdict = bed.verdict
        row = {
            "seed": seed,
            "words": list(verdict.words),
            "ended": verdict.ended,
            "problems": list(verdict.problems),
            "carried": bed.carried,
            "compared": bed.compared,
            "off": bed.off,
            "seconds": verdict.seconds,
        }
        done[seed] = row
        if given.out is not None:
            with given.out.open("a") as file:
                file.write(json.dumps(row) + "\n")
        print(
            f"{verdict.line()}; walls carry the weight to {bed.carried:.3g}; in {bed.compared} "
            f"steps a grain is off by up to {bed.off:.3g} of what it may",
            flush=True,
        )
        if not (given.keep or verdict.problems):
            for path in (folder / str(seed)).iterdir():
                path.unlink()
    rows = [done[seed] for seed in range(given.seed, given.seed + given.beds)]
    bad = [row["seed"] for row in rows if row["problems"]]
    errors = [row["seed"] for row in rows if row["ended"] != "ended"]
    moving = [row["seed"] for row in rows if row["ended"] == "ended" and row["carried"] > CARRIED]
    print(
        f"{len(rows)} beds; with problems {bad}; ended in an error {errors}; not at rest {moving}"
    )
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
