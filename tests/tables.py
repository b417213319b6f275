"""Prints the measured tables of the documentation: `make tables`.

`python -m tests.tables NAME` prints one of them. `contacts` shows the coordination number of
spheres against time step, tolerance and solver, `loose` the same at a loose tolerance against
solver and accuracy, `accuracy` the time of a run and the error of each grain against the accuracy,
`forces` the error of single contact forces against tolerance and accuracy, `shaken` packings
against those of the phase that shakes, `settled` the height of beds against the time step,
`near` the coordination number of dimers that are almost spheres against the tolerance, `network`
the floppy modes and states of self-stress of measured contacts, `start` a regular start of dimers
beside a random one, `inertia` point masses beside solid spheres, `turning` the look at the end of
the step beside a program without it, which is built for this,
`convergence` the error of exactly known motions against time step and tolerance, `rest` what motion
is left in a bed, `gluey` how long glued packings hang that were pressed for a time, with a picture.
Every row is nine seeds unless --seeds says otherwise; `convergence` needs none.
The paper's numbers are studies.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image

from lammps_inelastic import core
from lammps_inelastic.analysis import (
    ParticleDump,
    draw_packing,
    read_particle_frame,
    read_run_log,
)
from lammps_inelastic.analysis.pictures import few_colours
from lammps_inelastic.analysis.run_log import Run as RunOfLog
from lammps_inelastic.workflow.tradeoff.states import records_in
from tests.benchmark.scenes_without import TURNING, build
from tests.helpers.beds import BEDS, at_rest
from tests.helpers.convergence import ACCURACIES, STEPS, TOLERANCES
from tests.helpers.convergence import SCENES as EXACT
from tests.helpers.grainwise import FEW, compare_folder, largest_but, solve
from tests.helpers.pouring import (
    DeckError,
    Packing,
    Projections,
    measure,
    measuring_at,
    projections,
    recording,
    run_deck,
    shipped_deck,
    summed,
)
from tests.helpers.statics import bulk_stress, statics_of_run

GRAVITY, RADIUS = 9.81, 0.055
# So that every bed of dimers covers the paper's box
DIMERS: dict[str, object] = {"particles": 2000, "diameter": 0.085}


def pour(variables: Mapping[str, object], seeds: int, deck: str | None = None) -> list[Packing]:
    """Pour the deck's particles (the spheres') once for every seed."""
    packings = []
    for seed in range(1, seeds + 1):
        with tempfile.TemporaryDirectory() as folder:
            run_deck(
                Path(folder),
                deck or shipped_deck("spheres"),
                {"dump_every": 100000, "seed": seed, **variables},
            )
            packings.append(measure(Path(folder)))
    return packings


def spread(values: list[float], digits: int) -> str:
    """Mean ± standard deviation (standard error)."""
    if len(values) == 1:
        return f"{values[0]:.{digits}f}"
    deviation = statistics.stdev(values)
    return (
        f"{statistics.mean(values):.{digits}f} ± {deviation:.{digits}f} "
        f"({deviation / len(values) ** 0.5:.{digits}f})"
    )


def row(packings: list[Packing]) -> str:
    phi = [100 * packing.packing_fraction.value for packing in packings]
    z = [packing.coordination_number.mean for packing in packings]
    return f"{spread(phi, 2)} | {spread(z, 3)}"


# The default of the decks.
SOLVER = "sweeps"
# Time steps and tolerances [radii] of each solver. Uzawa takes minutes for a run at a lower one.
MEASURED_AT = {
    SOLVER: ((0.005, 0.01, 0.02), (0.0005, 0.0001, 0.00002)),
    "uzawa": ((0.01,), (0.0005, 0.0001)),
}


def shaken_alike(
    force: float, agitated: float, settling: float, timestep: float
) -> dict[str, object]:
    """Variables of a deck for shaking of the same strength and the same times, whatever the step.

    `force` is the random force at a time step of 0.01: one that changes in every step shakes as
    force^2 h. `agitated` and `settling` are times.
    """
    return {
        "dt": timestep,
        "random_force": force * (0.01 / timestep) ** 0.5,
        "steps_agitated": round(agitated / timestep),
        "steps_settling": round(settling / timestep),
    }


# Phases in which a bed gives way to the end: what decks have by default is shorter, and less exact.
TO_THE_END: dict[str, object] = {
    "accuracy": 0.001,
    "dt_resting": 0.02,
    "steps_resting": 200,
    "steps_tightening": 20,
    "steps_measuring": 4,
}


def contacts(seeds: int) -> Iterator[str]:
    yield "| solver | h | eps / r | eps / (g h^2) | packing fraction % | coordination number |"
    yield "|---|---|---|---|---|---|"
    for solver, (timesteps, tolerances) in MEASURED_AT.items():
        deck = shipped_deck("spheres")
        if solver == "uzawa":
            # The packing is made by sweeps: Uzawa only measures.
            deck = deck.replace(
                "fix_modify      contact tolerance ${eps_last}",
                "fix contact all inelastic ${eps_last} region container "
                "solver uzawa maxiter 10000000",
            ).replace(" pre no", "")
        for timestep in timesteps:
            for tolerance in tolerances:
                variables = shaken_alike(30, 4, 8, timestep) | {
                    "solver": SOLVER,
                    # One time step from start to end
                    "steps_resting": 0,
                    "dt_resting": timestep,
                    "dt_measuring": timestep,
                    "steps_tightening": 50,
                    "steps_measuring": 20,
                    "tolerance_measuring": tolerance,
                }
                resolution = tolerance * RADIUS / (GRAVITY * timestep**2)
                yield (
                    f"| {solver} | {timestep} | {tolerance} | {resolution:.3f} | "
                    f"{row(pour(variables, seeds, deck))} |"
                )


# Solver and accuracy: the fix stops at the accuracy or at the tolerance, whichever is tighter, and
# with an accuracy of 1 at the tolerance alone. (The default before was apgd.)
LOOSE = ((SOLVER, 0.001), (SOLVER, 0.1), (SOLVER, 1), ("apgd", 1), ("uzawa", 1))


def loose(seeds: int) -> Iterator[str]:
    yield "| solver | accuracy | packing fraction % | coordination number |"
    yield "|---|---|---|---|"
    for solver, accuracy in LOOSE:
        variables = {
            "solver": solver,
            "accuracy": accuracy,
            "accuracy_agitated": accuracy,
            "accuracy_measuring": accuracy,
            "tolerance": 0.005,
            "tolerance_measuring": 0.005,
            # One time step from start to end
            "dt_resting": 0.01,
            "dt_measuring": 0.01,
        }
        yield f"| {solver} | {accuracy} | {row(pour(variables, seeds))} |"


def accuracy(seeds: int) -> Iterator[str]:
    """Print what a larger accuracy saves of a run, and leaves of the grains' velocities."""
    yield (
        "| A | iterations a step | seconds | error, root mean square [g h] | "
        "of 99.9 % of the grains | packing fraction % | coordination number |"
    )
    yield "|---|---|---|---|---|---|---|"
    for value in (0.001, 0.003, 0.01, 0.03, 0.1, 0.3):
        deck = recording(shipped_deck("spheres"), 10)
        variables = {
            "accuracy": value,
            "accuracy_agitated": value,
            "accuracy_measuring": value,
            "dump_every": 100000,
        }
        packings, compared = [], []
        for seed in range(1, seeds + 1):
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                log = run_deck(folder, deck, {**variables, "seed": seed})
                packings.append((summed(projections(log)), measure(folder)))
                compared += compare_folder(folder)
        iterations = statistics.mean(run.iterations / run.projections for run, _ in packings)
        seconds = statistics.median(run.seconds for run, _ in packings)
        error = statistics.median(float(np.sqrt(np.mean(one.error**2))) for one in compared)
        nearly = max(largest_but(one.error, FEW) for one in compared)
        yield (
            f"| {value:g} | {iterations:.0f} | {seconds:.1f} | {error:.4f} | {nearly:.2f} | "
            f"{row([packing for _, packing in packings])} |"
        )


# Accuracy and tolerance [radii] while spheres are shaken: those of the decks, and of later phases.
SHAKEN_WITH = ((0.3, 0.005), (0.03, 0.0005))


def shaken(seeds: int) -> Iterator[str]:
    yield "| accuracy_agitated | tolerance_agitated | packing fraction % | coordination number |"
    yield "|---|---|---|---|"
    for value, tolerance in SHAKEN_WITH:
        variables = {"accuracy_agitated": value, "tolerance_agitated": tolerance}
        yield f"| {value:g} | {tolerance:g} | {row(pour(variables, seeds))} |"


# Longest time steps of hard contacts, and how far the neighbour list reaches then [diameters]. The
# first is the one with which the others are compared.
SETTLED_WITH = ((0.0025, 0.4), (0.005, 0.5), (0.01, 0.8), (0.02, 1.2))
# Of soft contacts: overlaps at rest [radii].
SETTLED_SOFTLY = (0.0005, 0.005)
PHASES = ("agitated", "settling", "resting", "tightening", "measuring")


def settled(seeds: int) -> Iterator[str]:
    """Print how high spheres lie that fell and settled by themselves, against the time step."""
    ways: dict[str, dict[str, object]] = {
        f"hard, h = {h:g}": {"dt": h, "reach": reach} for h, reach in SETTLED_WITH
    }
    ways |= {
        f"soft, {tolerance:g} r": {"contacts": "soft", "tolerance": tolerance}
        for tolerance in SETTLED_SOFTLY
    }
    unmoved = {f"steps_{phase}": 0 for phase in PHASES}
    heights: dict[str, list[float]] = {way: [] for way in ways}
    for seed in range(1, seeds + 1):
        with tempfile.TemporaryDirectory() as name:
            start = Path(name) / "start"
            run_deck(start, shipped_deck("spheres"), unmoved | {"seed": seed})
            packing = {"packing": start / "packing.restart", "time_settling": 3}
            for number, (way, variables) in enumerate(ways.items()):
                folder = Path(name) / str(number)
                run_deck(folder, shipped_deck("settling"), packing | variables)
                spheres = read_particle_frame(folder / "particles.lammpsdump").spheres
                heights[way].append(float(spheres.positions[:, 1].mean()) / (2 * RADIUS))
    yield "| contacts | mean height / d | more than the first, with the same starts |"
    yield "|---|---|---|"
    first = next(iter(heights.values()))
    for way, found in heights.items():
        more = [one - other for one, other in zip(found, first, strict=True)]
        difference = spread(more, 4) if found is not first else ""
        yield f"| {way} | {spread(found, 4)} | {difference} |"


# Of forces: tolerances of the count [radii], with the deck's accuracy there; and accuracies up to
# the end of the resting phase, at the deck's tolerance.
COUNTED_AT = (1e-4, 1e-5, 1e-6, 1e-7)
RESTED_WITH = (0.001, 0.03, 0.1)


def forces(seeds: int) -> Iterator[str]:
    """Print how exact single contact forces are, at rest and in the count."""
    yield (
        "| moment | eps / r | A | sum of errors / sum of forces % | largest error [weights] | "
        "false contacts % | missed % | seconds |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    deck = recording(shipped_deck("spheres"), 1)
    for tolerance in COUNTED_AT:
        variables = {"tolerance_measuring": tolerance}
        yield forces_row(f"count | {tolerance:g} | 0.001", deck, variables, seeds, counts=True)
    for value in RESTED_WITH:
        variables = {"accuracy": value}
        yield forces_row(f"rest | 0.0005 | {value:g}", deck, variables, seeds, counts=False)


def forces_row(
    title: str, deck: str, variables: Mapping[str, object], seeds: int, *, counts: bool
) -> str:
    """Return a row of medians over the seeds: of the last step of the count, or of rest."""
    found: list[tuple[float, ...]] = []
    for seed in range(1, seeds + 1):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            log = run_deck(folder, deck, {**variables, "dump_every": 100000, "seed": seed})
            seconds = sum(run.seconds for run in projections(log)[-3:])
            records = [core.read_record(path) for path in records_in(folder)]
            # Rest is before the last phase, whose steps are the longest.
            longest = max(record.problem.timestep for record in records)
            record = [one for one in records if counts or one.problem.timestep < longest][-1]
            found.append((*force_errors(record), seconds))
    return (
        f"| {title} | "
        + " | ".join(f"{statistics.median(one):.2g}" for one in zip(*found, strict=True))
        + " |"
    )


def force_errors(record: core.Record) -> tuple[float, float, float, float]:
    """Return the errors of the impulses of a record against the exact ones.

    The sum of their sizes over that of the exact impulses, percent; the largest, weights of a
    sphere times the step; and contacts that are there in one of both alone, above a thousandth of
    that, percent of the exact ones.
    """
    weight = 4 / 3 * np.pi * RADIUS**3 * GRAVITY * record.problem.timestep
    exact, ours = solve(record).impulse, record.arrays["impulse"]
    error = np.abs(ours - exact)
    pushes, pushed = ours > 1e-3 * weight, exact > 1e-3 * weight
    return (
        100 * float(error.sum() / exact.sum()),
        float(error.max() / weight),
        100 * float((pushes & ~pushed).sum() / pushed.sum()),
        100 * float((pushed & ~pushes).sum() / pushed.sum()),
    )


def dimer_row(packings: list[Packing], distance: float) -> str:
    """Give a_x, a_y, a_z in units of what an isotropic packing has."""
    neighbours = [packing.neighbours.mean for packing in packings]
    orientations = [packing.orientation for packing in packings if packing.orientation]
    components = [
        spread([float(o.components[axis]) / distance * 3**0.5 for o in orientations], 3)
        for axis in range(3)
    ]
    return " | ".join([row(packings), spread(neighbours, 3), *components])


DIMER_COLUMNS = "packing fraction % | contacts | neighbours | a_x | a_y | a_z |"


def distance(aspect_ratio: float) -> float:
    return (aspect_ratio - 1) * float(str(DIMERS["diameter"]))


def near(seeds: int) -> Iterator[str]:
    yield "| L/d | eps / r | eps / arm | contacts | neighbours |"
    yield "|---|---|---|---|---|"
    tolerances = (5e-4, 5e-5, 2e-5, 5e-6, 5e-7)
    for ratio in (1.01, 1.001, 1.0001):
        found: dict[float, list[Packing]] = {tolerance: [] for tolerance in tolerances}
        for seed in range(1, seeds + 1):
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                deck = measuring_at(shipped_deck("dimers"), tolerances)
                variables = {"aspect_ratio": ratio, "seed": seed, "dump_every": 100000}
                run_deck(folder, deck, DIMERS | variables)
                for number, tolerance in enumerate(tolerances):
                    found[tolerance].append(measure(folder, f"contacts.{number}.lammpsdump"))
        for tolerance, packings in found.items():
            z = [packing.coordination_number.mean for packing in packings]
            neighbours = [packing.neighbours.mean for packing in packings]
            yield (
                f"| {ratio} | {tolerance:g} | {tolerance / (ratio - 1):.2g} | "
                f"{spread(z, 3)} | {spread(neighbours, 3)} |"
            )


def start(seeds: int) -> Iterator[str]:
    yield f"| L/d | start | {DIMER_COLUMNS}"
    yield "|---|---|" + "---|" * 6
    for ratio in (1.5, 1.8):
        for arrangement in ("random", "regular"):
            variables = DIMERS | {"aspect_ratio": ratio, "start": arrangement}
            packings = pour(variables, seeds, shipped_deck("dimers"))
            yield f"| {ratio} | {arrangement} | {dimer_row(packings, distance(ratio))} |"


def inertia(seeds: int) -> Iterator[str]:
    yield "| L/d | inertia | packing fraction % | contacts | iterations |"
    yield "|---|---|---|---|---|"
    for ratio in (1.01, 1.1, 1.5):
        for kind in ("point", "solid"):
            packings, iterations = [], []
            for seed in range(1, seeds + 1):
                with tempfile.TemporaryDirectory() as folder:
                    variables = {"aspect_ratio": ratio, "inertia": kind, "seed": seed}
                    log = run_deck(
                        Path(folder),
                        shipped_deck("dimers"),
                        DIMERS | variables | {"dump_every": 100000},
                    )
                    packings.append(measure(Path(folder)))
                    iterations.append(float(sum(run.iterations for run in projections(log))))
            yield f"| {ratio} | {kind} | {row(packings)} | {spread(iterations, 0)} |"


def turning(seeds: int) -> Iterator[str]:
    yield "| L/d | iterations without | with | largest overlap / `EPS` without | with |"
    yield "|---|---|---|---|---|"
    # The dimers are shaken and slowed, at one tolerance.
    phases = {"steps_agitated": 400, "steps_settling": 200}
    phases |= {"steps_resting": 0, "steps_tightening": 0, "steps_measuring": 0}
    with tempfile.TemporaryDirectory() as name:
        plugins = [build(Path(name) / "without", TURNING), build(Path(name) / "with", {})]
        for ratio in (1.05, 1.5, 2.0):
            runs: list[list[Projections]] = [[], []]
            for seed in range(1, seeds + 1):
                variables = {"aspect_ratio": ratio, "seed": seed, "dump_every": 100000} | phases
                for plugin, found in zip(plugins, runs, strict=True):
                    with tempfile.TemporaryDirectory() as folder:
                        log = run_deck(Path(folder), shipped_deck("dimers"), variables, plugin)
                    # The start is pushed apart before the steps are counted from 0.
                    found.append(summed(projections(log.rpartition("reset_timestep")[2])))
            iterations = [spread([float(run.iterations) for run in found], 0) for found in runs]
            eps = 0.0005 * RADIUS
            overlaps = [spread([run.overlap / eps for run in found], 2) for found in runs]
            yield f"| {ratio} | {' | '.join([*iterations, *overlaps])} |"


def convergence(_: int) -> Iterator[str]:
    yield f"| scene | accuracy | `EPS` / d | {' | '.join(f'{n} steps' for n in STEPS)} |"
    yield "|---|---|---|" + "---|" * len(STEPS)
    for name, make in EXACT.items():
        exact = make()
        for accuracy in ACCURACIES:
            for tolerance in TOLERANCES:
                with tempfile.TemporaryDirectory() as folder:
                    errors = [exact.error(Path(folder), tolerance, n, accuracy) for n in STEPS]
                cells = " | ".join(f"{error:.1e}" for error in errors)
                yield f"| {name} | {accuracy:g} | {tolerance:g} | {cells} |"


def rest(seeds: int) -> Iterator[str]:
    yield "| bed | `EPS` / d | h | time until at rest | v_rms / (g h) | iterations a step |"
    yield "|---|---|---|---|---|---|"
    for bed in BEDS:
        for tolerance in (1e-3, 1e-5, 1e-7):
            for timestep in (0.01, 0.0025, 0.0005):
                found = []
                for seed in range(1, seeds + 1):
                    with tempfile.TemporaryDirectory() as folder:
                        found.append(at_rest(Path(folder), bed, tolerance, timestep, seed))
                columns = [
                    spread([one.rested for one in found], 0),
                    spread([one.speed for one in found], 4),
                    spread([one.iterations for one in found], 0),
                ]
                yield f"| {bed} | {tolerance:g} | {timestep:g} | {' | '.join(columns)} |"


# What is poured, by which deck, with which random force; time steps and tolerances / r: the default
# at three time steps, others at one.
NETWORKS: list[tuple[str, str, dict[str, float], float, list[tuple[float, float]]]] = [
    (
        "2,000 spheres",
        "spheres",
        {"particles": 2000, "diameter": 0.087},
        30,
        [(0.005, 1e-5), (0.01, 1e-5), (0.02, 1e-5), (0.01, 1e-4), (0.01, 1e-6)],
    ),
    *(
        (
            f"1,000 dimers, {aspect_ratio}",
            "dimers",
            {"aspect_ratio": aspect_ratio},
            200,
            [(0.005, 2e-5), (0.01, 2e-5), (0.02, 2e-5), (0.01, 2e-6)],
        )
        for aspect_ratio in (1.01, 1.3, 1.8)
    ),
]


def network(seeds: int) -> Iterator[str]:
    yield (
        "| packing | h | eps / r | iterations | floppy modes | of them swings | "
        "most others in a frame | self-stress | of it in the bulk |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for name, deck, scene, force, measured in NETWORKS:
        for timestep, tolerance in measured:
            # Of each packing; the frames of one share nearly all of their contacts.
            floppy, most, swings, stress, bulk, iterations = [], [], [], [], [], []
            for seed in range(1, seeds + 1):
                variables = {
                    **scene,
                    **shaken_alike(force, 4, 2, timestep),
                    **TO_THE_END,
                    "tolerance_measuring": tolerance,
                    "seed": seed,
                    "dump_every": 100000,
                }
                with tempfile.TemporaryDirectory() as name_of_folder:
                    folder = Path(name_of_folder)
                    log = run_deck(folder, shipped_deck(deck), variables)
                    frames = statics_of_run(folder)
                    bulk.append(1000 * bulk_stress(folder) / frames[-1].degrees)
                floppy.append(
                    statistics.mean(1000 * frame.floppy / frame.degrees for frame in frames)
                )
                most.append(
                    max(1000 * (frame.floppy - frame.swings) / frame.degrees for frame in frames)
                )
                swings.append(
                    statistics.mean(1000 * frame.swings / frame.degrees for frame in frames)
                )
                stress.append(
                    statistics.mean(1000 * frame.self_stress / frame.degrees for frame in frames)
                )
                iterations.append(float(sum(run.iterations for run in projections(log))))
            columns = [
                f"{statistics.mean(iterations):.0f}",
                spread(floppy, 1),
                spread(swings, 1),
                f"{max(most):.1f}",
                spread(stress, 1),
                spread(bulk, 1),
            ]
            yield f"| {name} | {timestep:g} | {tolerance:g} | {' | '.join(columns)} |"


def gluey(seeds: int) -> Iterator[str]:
    """Print how long packings hang, and draw one of them into gluey.png."""
    yield "| pressed for | hang for | contacts that hold: pressed | hanging | after letting go |"
    yield "|---|---|---|---|---|"
    timestep = 0.005
    for steps in (20, 60, 180):
        hung, counts = [], []
        for seed in range(1, seeds + 1):
            with tempfile.TemporaryDirectory() as name_of_folder:
                folder = Path(name_of_folder)
                run_deck(folder / "spheres", shipped_deck("spheres"), {"seed": seed})
                variables: dict[str, object] = {
                    "packing": folder / "spheres" / "packing.restart",
                    "steps_pressed": steps,
                    "steps_turned": 2 * steps + 20,
                    "dt": timestep,
                    "dump_every": 1,
                }
                run_deck(folder / "gluey", shipped_deck("gluey"), variables)
                pressed, turned = read_run_log(folder / "gluey" / "log.lammps").runs[1:3]
                held, floor = turned.thermo["held"], turned.thermo["force_floor"]
                # The floor pulls until its contacts have let go.
                let_go = int(np.flatnonzero(floor == 0.0)[0])
                hung.append(float(turned.thermo["Time"][let_go] - turned.thermo["Time"][0]))
                counts.append([pressed.thermo["held"][-1], held[let_go // 2], held[-1]])
                if steps == 60 and seed == 1:
                    draw_gluey(Path("gluey.png"), folder / "gluey", pressed, turned)
        columns = [spread(list(column), 0) for column in zip(*counts, strict=True)]
        yield f"| {steps * timestep:g} | {spread(hung, 3)} | {' | '.join(columns)} |"


def draw_gluey(path: Path, folder: Path, pressed: RunOfLog, turned: RunOfLog) -> None:
    """Draw frames of a run of gluey.in, and the contacts that hold against time."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    steps = (40, 100, 140, 160)
    figure, axes = pyplot.subplots(
        1, 5, figsize=(13, 4), layout="constrained", width_ratios=(1, 1, 1, 1, 2.2)
    )
    dump = ParticleDump(folder / "particles.lammpsdump")
    for frame in dump:
        if frame.step not in steps:
            continue
        ax = axes[steps.index(frame.step)]
        picture = folder / f"{frame.step}.png"
        draw_packing(picture, frame.spheres, pixels=700)
        ax.imshow(pyplot.imread(picture))
        ax.set_axis_off()
        ax.set_title(f"t = {0.005 * frame.step:g}")
    for run, name in ((pressed, "pressed"), (turned, "turned over")):
        axes[4].plot(run.thermo["Time"], run.thermo["held"], label=name)
    axes[4].set_xlabel("time")
    axes[4].set_ylabel("contacts that hold")
    axes[4].set_ylim(0)
    axes[4].legend()
    figure.savefig(path, dpi=100)
    pyplot.close(figure)
    with Image.open(path) as drawn:
        few_colours(drawn.convert("RGB")).save(path, optimize=True)


TABLES = {
    "gluey": gluey,
    "contacts": contacts,
    "loose": loose,
    "accuracy": accuracy,
    "forces": forces,
    "shaken": shaken,
    "settled": settled,
    "near": near,
    "network": network,
    "start": start,
    "inertia": inertia,
    "turning": turning,
    "convergence": convergence,
    "rest": rest,
}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.tables", description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[[], *TABLES], help="default: all")
    parser.add_argument("--seeds", type=int, default=9)
    arguments = parser.parse_args()
    for name in arguments.tables or TABLES:
        try:
            for line in TABLES[name](arguments.seeds):
                print(line, flush=True)
        except DeckError as error:
            print(f"{parser.prog}: {name}: {error.reason}", file=sys.stderr)
            return 1
        print(flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
