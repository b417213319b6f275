"""The shipped decks with this code and with that of earlier commits, in turn, over several seeds.

Each runs its own decks with its own plugin, built from what git has, so that changed defaults
count, too. Seconds are those of the processor for a whole deck. Each run is a line of `runs.jsonl`,
and what is there is not run again. Two of these programs may share a folder, with seeds of their
own, once the plugins are there.
"""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.helpers import building
from tests.helpers.pouring import NO_STEPS, projections, run_deck, summed

ROOT = Path(__file__).parents[2]
# What is compared. A commit is named by the last one that has changed it.
COMPARED = ("CMakeLists.txt", "src_fix", "inputs")


class EarlierError(Exception):
    """A commit that git does not know, or whose decks cannot be compared."""


@dataclass(frozen=True)
class Took:
    """What a run took.

    Attributes
    ----------
    code : commit
    scene : its name
    seed : of the start and of the random force
    steps, iterations : of the deck's runs in all, with their setups
    seconds : of the processor, for the whole deck
    """

    code: str
    scene: str
    seed: int
    steps: int
    iterations: int
    seconds: float


@dataclass(frozen=True)
class Code:
    """The plugin of a commit, in this folder, and the decks that belong to it."""

    commit: str
    plugin: Path
    decks: Path

    def run(self, folder: Path, name: str, variables: dict[str, object]) -> tuple[int, int, float]:
        """Run a deck in `folder`; return its steps, iterations and seconds of the processor."""
        text = (self.decks / f"{name}.in").read_text()
        if '\nparameters """' not in text:
            raise EarlierError(f"{name}.in of this commit has no table of parameters")
        # An earlier deck may have fewer parameters, and refuses what it does not know.
        known = {key: value for key, value in variables.items() if f"\n  {key} " in text}
        before = _seconds_of_children()
        runs = projections(run_deck(folder, text, known, self.plugin))
        seconds = _seconds_of_children() - before
        # A deck that only makes a start may have no run.
        every = summed(runs) if runs else None
        return (every.projections, every.iterations, seconds) if every else (0, 0, seconds)


def _seconds_of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _git(*arguments: str) -> bytes:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, check=False)
    if done.returncode != 0:
        said, _, _ = done.stderr.decode().partition("\n")
        raise EarlierError(f"git {arguments[0]}: {said}")
    return done.stdout


def check_out(commit: str, folder: Path) -> None:
    """Write the files of a commit into `folder`. Raises EarlierError if git does not know it."""
    archive = _git("archive", commit, "--", *COMPARED)
    folder.mkdir(exist_ok=True)
    subprocess.run(["tar", "-x"], cwd=folder, input=archive, check=True)


def prepare(commit: str, folder: Path) -> Code:
    """Check out a commit and build its plugin, in folders of its own in `folder`."""
    sources = folder / f"code-{commit}"
    check_out(commit, sources)
    plugin = building.plugin(sources, folder / f"build-{commit}")
    return Code(commit, plugin, sources / "inputs")


@dataclass(frozen=True)
class Scene:
    """A deck and its variables.

    Attributes
    ----------
    deck : its name without .in
    variables : of the deck
    start : the deck that makes the start which this one reads, if any
    """

    deck: str
    variables: dict[str, object]
    start: str | None = None


# Before it was a variable of settling.in, its accuracy was that of the fix.
SETTLINGS: dict[str, dict[str, object]] = {
    "0.0005 r": {},
    "0.005 r": {"tolerance": 0.005},
    "accuracy 0.001": {"accuracy": 0.001},
}


def scenes(particles: int, diameter: float) -> dict[str, Scene]:
    """Return name -> scene."""
    size: dict[str, object] = {"particles": particles, "diameter": diameter}
    settling = {
        f"settling.in, {kind}, {name}": Scene(
            "settling", {"particle": kind, "diameter": diameter, **variables}, start=kind
        )
        for kind in ("spheres", "dimers")
        for name, variables in SETTLINGS.items()
    }
    return {
        "spheres.in": Scene("spheres", size),
        **settling,
        "dimers.in, L/d 1.5": Scene("dimers", {**size, "aspect_ratio": 1.5}),
        "dimers.in, L/d 1.01": Scene("dimers", {**size, "aspect_ratio": 1.01}),
    }


def run_scene(code: Code, name: str, scene: Scene, seed: int, particles: int, work: Path) -> Took:
    """Run a scene in `work`; return what it took, its start not counted."""
    variables = {**scene.variables, "seed": seed}
    if scene.start is not None:
        start = work / f"start-{code.commit}-{scene.start}-{seed}"
        if not start.exists():
            size = {"particles": particles, "diameter": scene.variables["diameter"], "seed": seed}
            code.run(start, scene.start, {**size, **NO_STEPS})
        variables["packing"] = str(start / "packing.restart")
    return Took(code.commit, name, seed, *code.run(work / "run", scene.deck, variables))


def read(path: Path) -> dict[tuple[str, str, int], Took]:
    """Return the runs that a file holds, by code, scene and seed; none where there is no file."""
    if not path.exists():
        return {}
    runs = [Took(**json.loads(line)) for line in path.read_text().splitlines()]
    return {(run.code, run.scene, run.seed): run for run in runs}


def measure(
    commits: Sequence[str], particles: int, diameter: float, seeds: Sequence[int], out: Path
) -> None:
    """Print how many times as fast this code is as each commit: medians over the seeds, and ranges.

    Parameters
    ----------
    commits : earlier ones, as git names them
    particles, diameter : of the scenes; length
    seeds : of the starts and of the random forces
    out : where runs are kept

    Raises EarlierError for a commit that git does not know, and where this code is not committed:
    its runs could not be told from others.
    """
    if _git("status", "--porcelain", "--", *COMPARED):
        raise EarlierError("src_fix or inputs have changes: commit them first")
    short = {
        one: _git("log", "-1", "--format=%h", one, "--", *COMPARED).decode().strip()
        for one in ("HEAD", *commits)
    }
    out.mkdir(parents=True, exist_ok=True)
    path = out / "runs.jsonl"
    codes = [prepare(commit, out.absolute()) for commit in dict.fromkeys(short.values())]
    with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
        work = Path(name)
        for seed in seeds:
            for scene_name, scene in scenes(particles, diameter).items():
                for code in codes:
                    if (code.commit, scene_name, seed) in read(path):
                        continue
                    took = run_scene(code, scene_name, scene, seed, particles, work)
                    with path.open("a") as file:
                        file.write(json.dumps(asdict(took)) + "\n")
                    print(
                        f"{took.scene}, seed {seed}, {took.code}: {took.steps:,} steps, "
                        f"{took.iterations:,} iterations, {took.seconds:.1f} s",
                        flush=True,
                    )
    report(read(path), short["HEAD"], [short[commit] for commit in commits])


def report(runs: dict[tuple[str, str, int], Took], now: str, commits: Sequence[str]) -> None:
    """Print a line for each scene and commit."""
    for scene in dict.fromkeys(scene for _, scene, _ in runs):
        for commit in commits:
            pairs = [
                (runs[commit, scene, seed], one)
                for (code, name, seed), one in runs.items()
                if code == now and name == scene and (commit, scene, seed) in runs
            ]
            if not pairs:
                continue
            times = sorted(earlier.seconds / one.seconds for earlier, one in pairs)
            iterations = statistics.median(a.iterations / b.iterations for a, b in pairs)
            print(
                f"{scene}: {statistics.median(times):.2f} times as fast as {commit} "
                f"({times[0]:.2f} to {times[-1]:.2f}, {len(pairs)} seeds), which makes "
                f"{iterations:.2f} times as many iterations",
                flush=True,
            )
