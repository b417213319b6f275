"""Random scenes for fix inelastic, one after the other, each checked.

python -m tests.random_scenes --minutes 20 --seed 1000     seeds from 1000 on, for 20 minutes
python -m tests.random_scenes --scenes 100 --sanitize      100 scenes, under the address sanitizer
python -m tests.random_scenes --seed 17 --scenes 1         one again; its files are kept
python -m tests.random_scenes --minutes 9 --seed 5000000 --only "mass ratio"
                                                           drawn from that seed on, as "size ratio"
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from tests.random_scenes.scene_loop import Programs, Verdict, installed, judge, sanitized, summary


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.random_scenes", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--seed", type=int, default=0, help="the first seed (0)")
    parser.add_argument("--scenes", type=int, help="how many")
    parser.add_argument("--minutes", type=float, help="how long")
    parser.add_argument("--sanitize", action="store_true", help="build with sanitizers, run so")
    parser.add_argument("--ranks", type=int, choices=(1, 2), help="instead of those drawn")
    parser.add_argument("--without", nargs="*", default=[], help="leave out scenes with a word")
    parser.add_argument("--only", nargs="*", default=[], help="only scenes with all these words")
    parser.add_argument("--folder", type=Path, help="for the scenes (a temporary one)")
    parser.add_argument("--keep", action="store_true", help="keep the files of right scenes, too")
    given = parser.parse_args()
    if given.scenes is None and given.minutes is None:
        parser.error("give --scenes or --minutes")
    return given


def main() -> int:
    given = options()
    folder = given.folder or Path(tempfile.mkdtemp(prefix="random_scenes."))
    folder.mkdir(parents=True, exist_ok=True)
    programs: Programs = sanitized(folder / "build") if given.sanitize else installed()
    print(f"scenes in {folder}", flush=True)
    end = time.monotonic() + 60 * (given.minutes if given.minutes is not None else 1e9)
    seed, verdicts = given.seed, list[Verdict]()
    skipped: Counter[str] = Counter()
    while time.monotonic() < end and (given.scenes is None or len(verdicts) < given.scenes):
        verdict = judge(
            seed,
            folder / str(seed),
            programs,
            ranks=given.ranks,
            without=given.without,
            only=given.only,
            keep=given.keep or given.scenes == 1,
        )
        seed += 1
        if verdict is None:
            skipped["scenes"] += 1
            continue
        verdicts.append(verdict)
        print(verdict.line(), flush=True)
    print(summary(verdicts), flush=True)
    return int(any(verdict.problems for verdict in verdicts))


if __name__ == "__main__":
    sys.exit(main())
