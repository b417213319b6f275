"""One scene from its seed to a verdict, and what many of them have in common."""

from __future__ import annotations

import re
import shutil
import traceback
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tests.helpers.building import sanitized_plugin, sanitizer_libraries
from tests.helpers.lammps_run import plugin_file, without_launcher
from tests.random_scenes.scene_checker import Report, check
from tests.random_scenes.scene_generator import ITERATIONS, Scene, random_scene
from tests.random_scenes.scene_run import TIMEOUT, answer, finding

MANY_ITERATIONS = "maxiter 1000000"


@dataclass(frozen=True)
class Programs:
    """How LAMMPS is started with the plugin."""

    program: Sequence[str]
    environment: Mapping[str, str]
    timeout: float = TIMEOUT


@dataclass(frozen=True)
class Verdict:
    """What came of one scene.

    Attributes
    ----------
    problems : findings, one line each; empty if all is well
    ended : `ended`, or the refusal with which LAMMPS stopped
    """

    seed: int
    words: Sequence[str]
    ranks: int
    seconds: float
    problems: Sequence[str]
    ended: str
    report: Report = field(default_factory=Report)

    def line(self) -> str:
        """One line, and one more for each problem."""
        said = "FINDING" if self.problems else "ok" if self.ended == "ended" else "refused"
        seen = self.report.seen
        text = (
            f"{self.seed} {said} {self.seconds:.1f} s, {self.ranks} rank(s): "
            f"{', '.join(self.words)}; {seen['frames']} frames, {seen['contacts']} contacts"
        )
        if self.ended != "ended" and not self.problems:
            text += f"; {self.ended[:110]}"
        return "\n".join([text, *(f"    {problem}" for problem in self.problems)])


def installed() -> Programs:
    """LAMMPS with the plugin of this Python's package."""
    program, environment = without_launcher(plugin_file().parent)
    return Programs([program], environment)


def sanitized(build: Path) -> Programs:
    """LAMMPS with a plugin that is built with the address sanitizer, in a folder."""
    plugin = sanitized_plugin(build)
    program, environment = without_launcher(plugin)
    # Leaks are those of the scenes that LAMMPS ends with an error: test_memory.py looks for others.
    return Programs(
        ["env", f"LD_PRELOAD={sanitizer_libraries()}", program],
        {**environment, "ASAN_OPTIONS": "detect_leaks=0"},
        4 * TIMEOUT,
    )


def judge(
    seed: int,
    folder: Path,
    programs: Programs,
    *,
    ranks: int | None = None,
    without: Sequence[str] = (),
    only: Sequence[str] = (),
    keep: bool = False,
    scene: Scene | None = None,
) -> Verdict | None:
    """Draw, run and check a scene in a folder, which stays only where something is wrong.

    None if it has one of the words `without`, or lacks one of `only`. `scene` is that of the seed
    unless given.
    """
    if scene is None:
        scene = random_scene(seed)
    if any(word in scene.words for word in without) or any(w not in scene.words for w in only):
        return None
    if folder.exists():
        shutil.rmtree(folder)
    scene.write(folder)
    processes = ranks or scene.ranks
    if processes != scene.ranks:
        # A grid of ranks is for the number that was drawn.
        deck = folder / "deck.in"
        deck.write_text(re.sub(r"^processors .*\n", "", deck.read_text(), flags=re.MULTILINE))
    result = answer(folder, processes, programs.program, programs.environment, programs.timeout)
    longer = 4 * programs.timeout
    if result.status is None:
        # Ranks that wait for a core on a busy machine are no hang.
        result = answer(folder, processes, programs.program, programs.environment, longer)
    if finding(result, scene.facts) and any("iterations left" in text for text in result.errors):
        # Some scenes need more iterations than others; where there is room, so many are enough.
        deck = folder / "deck.in"
        deck.write_text(deck.read_text().replace(ITERATIONS, MANY_ITERATIONS))
        result = answer(folder, processes, programs.program, programs.environment, longer)
    problems = [text] if (text := finding(result, scene.facts)) else []
    report = Report()
    try:
        report = check(folder, scene.facts, result.screen)
        problems += report.problems
    except Exception:
        problems.append(f"the checker failed: {traceback.format_exc()}")
    if not (problems or keep):
        shutil.rmtree(folder)
    ended = "ended" if not result.errors else result.errors[0]
    return Verdict(seed, scene.words, processes, result.seconds, problems, ended, report)


def summary(verdicts: Sequence[Verdict]) -> str:
    """How many scenes of which kind, and the seeds of the findings."""
    words = Counter(word for verdict in verdicts for word in verdict.words)
    seen = sum((verdict.report.seen for verdict in verdicts), Counter[str]())
    bad = [verdict.seed for verdict in verdicts if verdict.problems]
    refused = Counter(
        verdict.ended[:60]
        for verdict in verdicts
        if verdict.ended != "ended" and not verdict.problems
    )
    lines = [f"{len(verdicts)} scenes, {sum(v.seconds for v in verdicts):.0f} s"]
    lines.append("  with " + ", ".join(f"{word} {count}" for word, count in words.most_common()))
    lines.append("  checked " + ", ".join(f"{name} {count}" for name, count in seen.most_common()))
    lines += [f"  refused {count}: {text}" for text, count in refused.most_common()]
    lines.append(f"  {len(bad)} findings" + (f": seeds {' '.join(map(str, bad))}" if bad else ""))
    return "\n".join(lines)
