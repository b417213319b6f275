"""The entry point of the command line `inelastic`, which may be interrupted from its first moment.

The import of the subcommands takes a second, and extension modules turn an interrupt at that time
into errors of their own. Nothing is running yet that would have to be stopped.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from types import FrameType

from .errors import INTERRUPTED


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `inelastic`; return its exit status, as `command_line.run` says."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    try:
        from .cli.command_line import run
    finally:
        signal.signal(signal.SIGINT, before)
    return run(arguments)


def _leave(number: int, frame: FrameType | None) -> None:
    os.write(2, b"inelastic: interrupted\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    sys.exit(main())
