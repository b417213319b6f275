"""Runs the blocks of a page, or writes them to files, in the folder where it is started.

    python -m tests.helpers.page_run BLOCKS.json RESULTS.json

Blocks are lists of language, text, and file or null. Results are lists of the exit code and of what
was printed; they end with the first block that fails.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import traceback
from pathlib import Path
from typing import Any


def main() -> None:
    """Run all blocks, python ones in one namespace."""
    blocks: list[tuple[str, str, str | None]] = json.loads(Path(sys.argv[1]).read_text())
    results: list[tuple[int, str]] = []
    namespace: dict[str, Any] = {"__name__": "__main__"}
    screen = os.dup(1), os.dup(2)
    printed = Path(sys.argv[2]).with_suffix(".printed")
    for language, text, written in blocks:
        with printed.open("w") as file:
            # LAMMPS as a library prints past Python's streams.
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
            if written:
                Path(written).write_text(text)
                code = 0
            elif language == "sh":
                code = subprocess.run(["sh", "-e", "-c", text], check=False).returncode
            else:
                code = _run_python(text, namespace)
            os.dup2(screen[0], 1)
            os.dup2(screen[1], 2)
        results.append((code, printed.read_text(errors="replace")))
        Path(sys.argv[2]).write_text(json.dumps(results))
        if code:
            break


def _run_python(text: str, namespace: dict[str, Any]) -> int:
    """Run a block as a reader does who types it; return 1 where it raises."""
    try:
        exec(compile(text, "block", "exec"), namespace)
    except BaseException:
        traceback.print_exc()
        return 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
    return 0


main()
