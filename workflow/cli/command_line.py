"""The command line `inelastic`: all subcommands together, and what becomes of their errors."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NoReturn

from lammps_inelastic.analysis import AnalysisError

from ..errors import INTERRUPTED, StudyError, WorkflowError
from ..provenance import run_record
from . import (
    collect,
    deck,
    export,
    look,
    new,
    report,
    reproduce,
    slurm,
    status,
    tradeoff,
    validate,
)
from . import run as run_cases

# The help lists them in this order. Each adds a parser, whose default `run` is called.
SUBCOMMANDS = (
    deck,
    look,
    new,
    validate,
    run_cases,
    status,
    collect,
    slurm,
    reproduce,
    tradeoff,
    export,
    report,
)

# The last line of each help names the page of the repository that has all commands.
PAGE = "docs/reference/commands.md"
SEE = f"More: {PAGE} of lammps-inelastic."


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; 0 if all went well, else one line on stderr for each thing that did not.

    1: cases of a study have failed; 2: bad input; 130: interrupted; 141: whoever reads the
    output has gone.
    """
    with suppress(AttributeError):
        # A name may have bytes that no encoding knows, and a terminal an encoding of few letters.
        sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        if options.command is None:
            parser.print_help()
            return 0
        code = int(options.run(options))
        sys.stdout.flush()
        return code
    except StudyError as error:
        # Every rank of an MPI job finds the same mistakes.
        for mistake in error.mistakes if os.environ.get("PMI_RANK", "0") == "0" else ():
            _complain(mistake)
        return 2
    except BrokenPipeError:
        # A reader such as `head` has what it wanted. What is still buffered would fail at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + signal.SIGPIPE
    except (AnalysisError, WorkflowError, OSError) as error:
        _complain(str(error))
        return 2
    except KeyboardInterrupt:
        if arguments is None:
            # The process ends; another interrupt has nothing to add.
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        _complain("interrupted")
        return INTERRUPTED


class _Parser(argparse.ArgumentParser):
    """An argument parser that reports a wrong argument like every other error, in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"inelastic: {message} (see {self.prog} --help)\n")


class _Version(argparse.Action):
    """Print which code this is, as it stands in every result, and end."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any, **__: Any) -> NoReturn:
        code, versions = run_record.code(), run_record.versions()
        print(
            f"lammps-inelastic {code['version']} (fix {code['sources'][:12]}, "
            f"{code['compiler']}), LAMMPS {versions['lammps']}"
        )
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="inelastic",
        description="Packings of hard spheres, and of rigid bodies of them, with LAMMPS.",
        epilog=SEE,
    )
    parser.add_argument(
        "--version", action=_Version, nargs=0, help="print which code this is, and leave"
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for subcommand in SUBCOMMANDS:
        subcommand.add_parser(commands)
    for each in commands.choices.values():
        each.epilog = SEE
    return parser


def _complain(message: str) -> None:
    print(f"inelastic: {' '.join(message.split())}", file=sys.stderr)
