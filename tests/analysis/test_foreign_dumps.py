"""Dumps of others: what is measured of them is right, or one line says what is wrong with them.

The spheres of all of them are eight on a cubic lattice in a cube, each in contact with three. The
layouts are those of LAMMPS since 2005, of LIGGGHTS, of OVITO and of ASE.
"""

from __future__ import annotations

import gzip
import json
import math
import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from lammps_inelastic.workflow.main import main

Rows = Sequence[Sequence[object]]
PLACES = list(product((0.25, 0.75), repeat=3))
FIXED = ("ITEM: BOX BOUNDS ff ff ff", "0 1", "0 1", "0 1")
TILTS = ("0 1 0", "0 1 0", "0 1 0")
NAMES = "id type x y z radius"
SPHERES = [[number, 1, *place, 0.25] for number, place in enumerate(PLACES, 1)]


def frame(
    names: str = NAMES,
    rows: Rows = SPHERES,
    box: Sequence[str] = FIXED,
    *,
    step: object = 100,
    label: str = "ATOMS",
    before: str = "",
    after_step: str = "",
) -> str:
    """Return one frame; `before` and `after_step` are lines at these places of its header."""
    head = f"{before}ITEM: TIMESTEP\n{step}\n{after_step}ITEM: NUMBER OF {label}\n{len(rows)}\n"
    lines = [*box, f"ITEM: {label} {names}".rstrip(), *(" ".join(map(str, row)) for row in rows)]
    return head + "\n".join(lines) + "\n"


def bounds(letters: str, *lines: str) -> tuple[str, ...]:
    return (f"ITEM: BOX BOUNDS {letters}".rstrip(), *(lines or FIXED[1:]))


def scaled(wide: float) -> Rows:
    return [[number, 1, *(x / wide for x in place)] for number, place in enumerate(PLACES, 1)]


WIDE = bounds("ff ff ff", "0 2", "0 2", "0 2")
PLAIN = [row[:5] for row in SPHERES]
BODIES = [[*row[:2], 0, *row[2:]] for row in SPHERES]
UNIT = "ITEM: UNITS\nlj\n"
TIME = "ITEM: TIME\n0.125\n"
WHOLE = frame()
ONE = SPHERES[:1]
OWN = ("--radius", "0.25")

# A dump, and what is added to the command: these are read.
RIGHT: dict[str, tuple[str | bytes, tuple[str, ...]]] = {
    "LAMMPS 2010: names of columns, no boundaries": (frame(box=bounds("")), ()),
    "LAMMPS 2011: boundaries": (WHOLE, ()),
    "LAMMPS: shrink-wrapped": (frame(box=bounds("ss mm fs")), ()),
    "LAMMPS: %g with exponents": (frame(box=bounds("ff ff ff", *["0e+00 1.0e+00"] * 3)), ()),
    "LAMMPS: style atom": (frame("id type xs ys zs", scaled(2), WIDE), OWN),
    "LAMMPS: unwrapped": (frame("id type xu yu zu radius"), ()),
    "LAMMPS: unwrapped shares": (frame("id type xsu ysu zsu", scaled(2), WIDE), OWN),
    "LAMMPS: diameter": (frame("id x y z diameter", [[r[0], *r[2:5], 0.5] for r in SPHERES]), ()),
    "LAMMPS: words in a column": (
        frame("id element x y z radius", [[r[0], "Fe", *r[2:]] for r in SPHERES]),
        (),
    ),
    "LAMMPS: rows in any order": (frame(rows=SPHERES[::-1]), ()),
    "LAMMPS: computes and image flags": (
        frame(
            "id ix iy iz c_1[1] v_a x y z radius", [[r[0], 0, 0, 0, 7, 8, *r[2:]] for r in SPHERES]
        ),
        (),
    ),
    "LAMMPS: no bodies": (frame("id type mol x y z radius", BODIES), ()),
    "LAMMPS: more than 2^31 steps": (frame(step=3_000_000_000), ()),
    "LAMMPS 2018: units": (frame(before=UNIT, step=0) + WHOLE, ()),
    "LAMMPS 2020: time": (frame(before=TIME, step=0) + frame(before=TIME), ()),
    "LAMMPS 2020: units and time": (frame(before=UNIT + TIME, step=0) + frame(before=TIME), ()),
    "units and time after the step": (frame(after_step=UNIT + TIME), ()),
    "LAMMPS: box that may be tilted": (frame(box=bounds("xy xz yz ff ff ff", *TILTS)), ()),
    "names of tilts last": (frame(box=bounds("ff ff ff xy xz yz", *TILTS)), ()),
    "LAMMPS 2024: general box": (
        frame(box=bounds("abc origin ff ff ff", "1 0 0 0", "0 1 0 0", "0 0 1 0")),
        (),
    ),
    "general box, not at the origin": (
        frame(box=bounds("abc origin ff ff ff", "3 0 0 -1", "0 2 0 0", "0 0 4 -3")),
        (),
    ),
    "general box without boundaries": (
        frame(box=bounds("abc origin", "1 0 0 0", "0 1 0 0", "0 0 1 0")),
        (),
    ),
    "poured": (frame(rows=[], step=0) + frame(rows=ONE, step=50) + WHOLE, ()),
    "poured, an earlier frame": (WHOLE + frame(rows=ONE, step=200), ("--frame", "0")),
    "evaporated, a frame by its step": (WHOLE + frame(rows=[], step=200), ("--step", "100")),
    "cut off in the rows": (WHOLE + WHOLE[:-9], ()),
    "cut off in the header": (WHOLE + WHOLE[:40], ()),
    "compressed": (gzip.compress(WHOLE.encode()), ()),
    "ends of lines of Windows": (WHOLE.replace("\n", "\r\n"), ()),
    "tabulators, and empty lines at the end": (WHOLE.replace(" 1 ", "\t1\t") + "\n\n", ()),
    "LIGGGHTS: a column twice": (
        frame("id type type x y z radius", [[*r[:2], 1, *r[2:]] for r in SPHERES]),
        (),
    ),
    "LIGGGHTS: no boundaries": (
        frame(
            "id type x y z vx vy vz fx fy fz radius",
            [[*r[:5], *[0] * 6, r[5]] for r in SPHERES],
            bounds(""),
        ),
        (),
    ),
    "ASE: its box may be tilted": (
        frame("id type x y z", PLAIN, bounds("xy xz yz ss ss ss", *TILTS)),
        OWN,
    ),
    "OVITO: orthogonal box": (
        frame("id x y z radius mass", [[r[0], *r[2:], 1] for r in SPHERES]),
        (),
    ),
}

# A dump, what is added to the command, and the contacts of each sphere: six on all sides of which
# there is an image. A lattice that is moved by a whole step along x at each period is the same.
ACROSS: dict[str, tuple[str, tuple[str, ...], int]] = {
    "LAMMPS: periodic": (frame(box=bounds("pp ff ff")), (), 4),
    "LAMMPS: periodic, unwrapped": (
        frame("id type xu yu zu radius", [[*r[:2], r[2] + 3, *r[3:]] for r in SPHERES]).replace(
            "ff ff ff", "pp ff ff"
        ),
        (),
        4,
    ),
    "LAMMPS: tilted": (frame(box=bounds("xy xz yz ff ff ff", "0 1 0", "0 1 0.25", "0 1 0")), (), 3),
    "LAMMPS: tilted, periodic": (
        frame(box=bounds("xy xz yz pp pp pp", "0 1.5 0.5", "0 1 0", "0 1 0")),
        (),
        6,
    ),
    "LAMMPS: tilted, shares of the edges": (
        frame(
            "id type xs ys zs",
            [[*r[:2], r[2] - r[3] / 2, *r[3:5]] for r in SPHERES],
            bounds("xy xz yz pp pp pp", "0 1.5 0.5", "0 1 0", "0 1 0"),
        ),
        OWN,
        6,
    ),
    "LAMMPS 2024: turned": (
        frame(box=bounds("abc origin pp pp pp", "0 1 0 0", "-1 0 0 0", "0 0 1 0")),
        (),
        6,
    ),
    "ASE: periodic": (frame("id type x y z", PLAIN, bounds("xy xz yz pp pp pp", *TILTS)), OWN, 6),
}

# A dump, what is added to the command, and what is said of it.
REFUSED: dict[str, tuple[str | bytes, tuple[str, ...], str]] = {
    "LAMMPS 2005": (frame("", box=bounds("")), (), "line 9: the columns have no names"),
    "LAMMPS: no radius": (frame("id type x y z", PLAIN), (), "line 9: no column radius"),
    "LAMMPS 2024: left-handed": (
        frame(box=bounds("abc origin ff ff ff", "0 1 0 0", "1 0 0 0", "0 0 1 0")),
        (),
        "line 5: the box has no volume, or its edges are left-handed",
    ),
    "LAMMPS: flat": (
        frame(box=bounds("abc origin ff ff ff", "1 0 0 0", "1 0 0 0", "0 0 1 0")),
        (),
        "line 5: the box has no volume",
    ),
    "LAMMPS: dump local": (
        frame("id1 id2 x y z nx ny nz gap force", [], label="ENTRIES"),
        (),
        "its rows are ENTRIES, as in a dump local",
    ),
    "LAMMPS: dump local with a label": (frame(label="PAIRS"), (), "its rows are PAIRS"),
    "LAMMPS: dump grid": (
        "ITEM: TIMESTEP\n0\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: DIMENSION\n3\n",
        (),
        "line 3: expected 'ITEM: NUMBER OF'",
    ),
    "LAMMPS: dump yaml": ("---\ncreator: LAMMPS\n", (), "line 1: .* no text dump custom or local"),
    "LAMMPS: dump xyz": ("8\nAtoms. Timestep: 0\n", (), "line 1: .* no text dump"),
    "LAMMPS: binary": (b"\xf6\xff\xff\xff\xff\xff\xff\xff", (), "line 1: "),
    "LIGGGHTS: mesh": (frame(label="TRIANGLES"), (), "its rows are TRIANGLES"),
    "OVITO: no ids": (frame("x y z radius", [r[2:] for r in SPHERES]), (), "no column id"),
    "OVITO: numbers that run together": (
        frame(box=bounds("abc origin ff ff ff", "1 0 00", "0 1 00", "0 0 10")),
        (),
        "line 6: expected an edge of the box and a component of its origin",
    ),
    "poured, nothing yet": (frame(rows=[]), (), "line 9: the frame of step 100 has no spheres"),
    "poured, no such frame": (WHOLE, ("--frame", "1"), "no frame 1; there are 1"),
    "poured, no such step": (WHOLE, ("--step", "7"), "no step 7; the steps are 100"),
    "cut off, no whole frame": (WHOLE[:-9], (), "inside the frame of step 100: 7 of 8 rows"),
    "last digits lost": (WHOLE[:-1], (), "inside the frame of step 100: 7 of 8 rows"),
    "22 digits: step": (frame(step=10**22), (), r"line 2: expected an integer below 2\^63"),
    "22 digits: body": (
        frame("id type mol x y z radius", [[*r[:2], 10**22, *r[3:]] for r in BODIES]),
        (),
        r"line 10: step 100, sphere 1: mol must be a body's number or 0, not 1e\+22",
    ),
    "22 digits: id": (frame(rows=[[10**22, *ONE[0][1:]]]), (), "line 10: .* ids must be positive"),
    "step that is no whole number": (frame(step=1.5), (), "line 2: expected an integer"),
}


def look(dump: str | bytes, added: Sequence[str], folder: Path) -> int:
    path = folder / "grains.dump"
    path.write_bytes(dump if isinstance(dump, bytes) else dump.encode())
    command = ["look", str(path), "--contact-gap", "1e-9", "--box", *"010101"]
    return main([*command, "--no-picture", "--json", "--points", "10", *added])


@pytest.mark.parametrize("layout", RIGHT)
def test_measured_right(layout: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dump, added = RIGHT[layout]
    assert measured(dump, added, tmp_path, capsys) == 3


@pytest.mark.parametrize("layout", ACROSS)
def test_measured_across_periodic_faces(
    layout: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dump, added, contacts = ACROSS[layout]
    assert measured(dump, added, tmp_path, capsys) == contacts


def measured(
    dump: str | bytes,
    added: Sequence[str],
    folder: Path,
    capsys: pytest.CaptureFixture[str],
) -> float:
    """See that the eight spheres fill pi / 6 of the cube; return their coordination number."""
    status = look(dump, added, folder)
    out, err = capsys.readouterr()
    assert (status, err) == (0, "")
    found: dict[str, Any] = json.loads(out)
    assert found["particles"] == 8
    # Spheres cut by no face have an exact volume: a sum of eight terms in float64; images, and
    # places by tilted edges, have round-off of their own.
    assert found["packing_fraction"]["value"] == pytest.approx(math.pi / 6, rel=1e-13)
    number: float = found["coordination_number"]["mean"]
    return number


@pytest.mark.parametrize("layout", REFUSED)
def test_refused_in_one_true_line(
    layout: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dump, added, said = REFUSED[layout]
    status = look(dump, added, tmp_path)
    out, err = capsys.readouterr()
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert re.search(said, err), err


@pytest.mark.parametrize(
    ("layout", "note"),
    [
        ("cut off in the rows", "only whole frames are read, 1 of them: .* 7 of 8 rows"),
        ("LIGGGHTS: no boundaries", "does not say whether its box is periodic"),
    ],
)
def test_what_a_dump_lacks_is_said(
    layout: str, note: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert look(*RIGHT[layout], tmp_path) == 0
    (said,) = json.loads(capsys.readouterr().out)["notes"]
    assert re.search(note, said), said


def test_contacts_of_the_frame_that_is_chosen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of the other frames are not of it."""
    (tmp_path / "particles.lammpsdump").write_text(frame(step=0) + WHOLE)
    names = "id1 id2 x y z nx ny nz gap force"
    rest = [0.5, 0.25, 0.25, 1, 0, 0, 0, 1]
    steps = {0: [[5, 1, *rest]], 100: [[5, 1, *rest], [6, 2, *rest]]}
    contacts = [frame(names, rows, step=step, label="ENTRIES") for step, rows in steps.items()]
    (tmp_path / "contacts.lammpsdump").write_text("".join(contacts))
    command = ["look", str(tmp_path), "--no-picture", "--json", "--points", "10"]
    command += ["--box", *"010101"]
    for chosen, mean in (["--frame", "0"], 2 / 8), (["--step", "100"], 4 / 8), ([], 3 / 8):
        assert main([*command, *chosen]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["coordination_number"]["mean"] == mean


def test_no_contacts_of_the_frame_that_is_chosen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "particles.lammpsdump").write_text(frame(step=0) + WHOLE)
    (tmp_path / "contacts.lammpsdump").write_text(
        frame("id1 id2 x y z nx ny nz gap force", [], label="ENTRIES")
    )
    assert main(["look", str(tmp_path), "--no-picture", "--frame", "0"]) == 2
    assert "no contacts of step 0; --contact-gap GAP counts them" in capsys.readouterr().err
