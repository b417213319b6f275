"""The shipped decks with this code and with that of an earlier commit, in turn.

Each runs its own decks with its own plugin, so that changed defaults count, too. The plugin of the
earlier commit is built from what git has.
"""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.helpers import building
from tests.helpers.pouring import NO_STEPS, Projections, projections, run_deck, summed

ROOT = Path(__file__).parents[2]


class EarlierError(Exception):
    """A commit that git does not know, or whose decks cannot be compared."""


@dataclass(frozen=True)
class Code:
    """A plugin, in this folder, and the decks that belong to it."""

    plugin: Path
    decks: Path

    def run(self, folder: Path, name: str, variables: dict[str, object]) -> Projections:
        """Run a deck in `folder`; return the sum of its runs, starts included."""
        text = (self.decks / f"{name}.in").read_text()
        if '\nparameters """' not in text:
            raise EarlierError(f"{name}.in of this commit has no table of parameters")
        # An earlier deck may have fewer parameters, and refuses what it does not know.
        known = {key: value for key, value in variables.items() if f"\n  {key} " in text}
        return summed(projections(run_deck(folder, text, known, self.plugin)))


def check_out(commit: str, folder: Path) -> None:
    """Write the files of a commit into `folder`. Raises EarlierError if git does not know it."""
    archive = subprocess.run(
        ["git", "archive", commit, "--", "CMakeLists.txt", "src_fix", "inputs"],
        cwd=ROOT,
        capture_output=True,
        check=False,
    )
    if archive.returncode != 0:
        raise EarlierError(f"{commit}: {archive.stderr.decode().strip()}")
    folder.mkdir()
    subprocess.run(["tar", "-x"], cwd=folder, input=archive.stdout, check=True)


def scenes(particles: int, diameter: float) -> dict[str, tuple[str, dict[str, object]]]:
    """Return name -> deck and variables."""
    size: dict[str, object] = {"particles": particles, "diameter": diameter}
    return {
        "spheres.in": ("spheres", size),
        "dimers.in, L/d 1.5": ("dimers", {**size, "aspect_ratio": 1.5}),
        "dimers.in, L/d 1.01": ("dimers", {**size, "aspect_ratio": 1.01}),
    }


# Before it was a variable of settling.in, its accuracy was that of the fix.
SETTLINGS: dict[str, dict[str, object]] = {
    "settling.in": {},
    "settling.in, 0.005 r": {"tolerance": 0.005},
    "settling.in, accuracy 0.001": {"accuracy": 0.001},
    "settling.in, 0.005 r, accuracy 0.001": {"tolerance": 0.005, "accuracy": 0.001},
}


def settle(code: Code, folder: Path, size: dict[str, object]) -> dict[str, Projections]:
    """Let a start of spheres settle in each of the SETTLINGS; return what settling.in took."""
    code.run(folder / "start", "spheres", {**size, **NO_STEPS})
    common = {"packing": str(folder / "start" / "packing.restart"), "diameter": size["diameter"]}
    return {
        name: code.run(folder / "run", "settling", {**common, **variables})
        for name, variables in SETTLINGS.items()
    }


def measure(commit: str, particles: int, diameter: float) -> None:
    """Print iterations and seconds of both, and how many times as fast this code is."""
    with tempfile.TemporaryDirectory(prefix="inelastic-") as name:
        folder = Path(name)
        check_out(commit, folder / "earlier")
        codes = {
            which: Code(building.plugin(sources, folder / f"build-{which}"), sources / "inputs")
            for which, sources in ((commit, folder / "earlier"), ("now", ROOT))
        }
        for scene, (deck, variables) in scenes(particles, diameter).items():
            report(
                scene,
                {which: code.run(folder / "run", deck, variables) for which, code in codes.items()},
            )
        size: dict[str, object] = {"particles": particles, "diameter": diameter}
        settled = {which: settle(code, folder / which, size) for which, code in codes.items()}
        for name in SETTLINGS:
            report(name, {which: took[name] for which, took in settled.items()})


def report(scene: str, took: dict[str, Projections]) -> None:
    """Print a line."""
    words = [
        f"{which} {one.projections:,} steps, {one.iterations:,} iterations, {one.seconds:.1f} s"
        for which, one in took.items()
    ]
    earlier, now = took.values()
    print(f"{scene}: {'; '.join(words)}: {earlier.seconds / now.seconds:.2f} times", flush=True)
