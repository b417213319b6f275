"""The command line `inelastic`: one subcommand for each thing that a user does."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import NoReturn

from lammps_inelastic.analysis import AnalysisError

from . import (
    export_command,
    look_command,
    report_command,
    reproduce_command,
    study_commands,
    tradeoff_command,
)
from .errors import StudyError, WorkflowError
from .main import INTERRUPTED


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; 0 if all went well, else one line on stderr for each thing that did not.

    1: cases of a study have failed; 2: bad input; 130: interrupted; 141: whoever reads the
    output has gone.
    """
    with suppress(AttributeError):
        # A name may have bytes that no encoding knows, and a terminal an encoding of few letters.
        sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    options = _parser().parse_args(arguments)
    try:
        status = _run(options)
        sys.stdout.flush()
        return status
    except StudyError as error:
        # Every rank of an MPI job finds the same mistakes.
        for mistake in error.mistakes if os.environ.get("PMI_RANK", "0") == "0" else ():
            _complain(mistake)
        return 2
    except BrokenPipeError:
        # Such as `| head`, which has what it wanted. What is still buffered would fail at exit.
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


def _run(options: argparse.Namespace) -> int:
    if options.command == "look":
        return look_command.run(options)
    if options.command == "export":
        return export_command.run(options)
    if options.command == "report":
        return report_command.run(options)
    if options.command == "reproduce":
        return reproduce_command.run(options)
    if options.command == "tradeoff":
        return tradeoff_command.run(options)
    return study_commands.run_command(options)


class _Parser(argparse.ArgumentParser):
    """Reports a wrong argument like every other error, in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"inelastic: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="inelastic", description="Packings of inelastic spheres with LAMMPS.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    look_command.add_parser(commands)
    study_commands.add_parsers(commands)
    reproduce_command.add_parser(commands)
    tradeoff_command.add_parser(commands)
    export_command.add_parser(commands)
    report_command.add_parser(commands)
    return parser


def _complain(message: str) -> None:
    print(f"inelastic: {' '.join(message.split())}", file=sys.stderr)
