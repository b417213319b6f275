"""Damaged dumps: what is read is what was written, or one line says what is wrong, and where."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lammps_inelastic.analysis import DumpError, ParticleDump, iterate_contact_frames
from lammps_inelastic.workflow.main import main
from tests.helpers.written_dumps import CONTACT_COLUMNS, PARTICLE_COLUMNS, frame_text

# The same examples on every machine; a folder may serve all examples of a test, each writes anew.
FUZZED = settings(
    derandomize=True,
    deadline=None,
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)

PARTICLES = [
    [1, 1, 0.4123456789012345, 0.1, 0.5, 0.0, -1.0 / 3.0, 0.0, 0.05],
    [2, 1, 0.7, 1e-17, 0.5, 1e-300, 0.0, 2.0, 0.06],
    [3, 1, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.05],
]
CONTACTS = [
    [3, 1, 0.1, 0.2, 0.3, 0.0, 1.0, 0.0, -1.0000000000000001e-05, 1.0 / 3.0],
    [2, -3, 0.5, 0.0, 0.5, 0.0, 1.0, 0.0, 2e-6, 0.25],
]
STEPS = (0, 7, 20)

KINDS = {
    "particles": ("ATOMS", PARTICLE_COLUMNS, PARTICLES),
    "contacts": ("ENTRIES", CONTACT_COLUMNS, CONTACTS),
}
# Columns that are not read may hold anything.
UNREAD = {"type"}


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return request.param


def text_of(kind: str) -> bytes:
    label, columns, rows = KINDS[kind]
    return "".join(frame_text(label, step, columns, rows, None) for step in STEPS).encode()


def read_particles(path: Path) -> list[list[Any]]:
    """All numbers of all frames."""
    return [
        [f.step, f.ids, f.positions, f.velocities, f.radii, f.box, f.bodies, f.contacts]
        for f in ParticleDump(path)
    ]


def read_contacts(path: Path) -> list[list[Any]]:
    return [
        [f.step, f.ids, f.points, f.normals, f.gaps, f.forces] for f in iterate_contact_frames(path)
    ]


READERS: dict[str, Callable[[Path], list[list[Any]]]] = {
    "particles": read_particles,
    "contacts": read_contacts,
}


def same(some: list[list[Any]], others: list[list[Any]]) -> bool:
    """Whether all numbers are equal, bit for bit."""
    return len(some) == len(others) and all(
        np.array_equal(one, other)
        for frame, same_frame in zip(some, others, strict=True)
        for one, other in zip(frame, same_frame, strict=True)
        if one is not None or other is not None
    )


def read_or_refused(kind: str, path: Path, content: bytes) -> list[list[Any]] | str:
    """Return the frames, or the error's text after the name of the file: one line of it."""
    path.write_bytes(content)
    try:
        return READERS[kind](path)
    except DumpError as error:
        text = str(error)
        assert text.startswith(f"{path}")
        assert text.isprintable()
        return text.removeprefix(f"{path}")


def refused(kind: str, path: Path, content: bytes) -> str:
    """Return what the error says, which must name a line."""
    said = read_or_refused(kind, path, content)
    assert isinstance(said, str), f"read without an error: {content!r}"
    assert re.match(r", line \d+: ", said), said
    return said


def line_named(said: str) -> int:
    found = re.match(r", line (\d+): ", said)
    assert found, said
    return int(found.group(1))


@pytest.mark.slow
def test_cut_off_anywhere(kind: str, tmp_path: Path) -> None:
    """After every single byte."""
    path, whole = tmp_path / "cut.dump", text_of(kind)
    (tmp_path / "whole.dump").write_bytes(whole)
    frames = READERS[kind](tmp_path / "whole.dump")
    assert len(frames) == len(STEPS)
    one = len(whole) // len(STEPS)  # not exactly: the steps have one digit or two
    for length in range(1, len(whole)):
        ends_with_a_frame = whole[:length].endswith(b"\n") and whole[length:].startswith(
            b"ITEM: TIMESTEP"
        )
        if ends_with_a_frame:
            read = read_or_refused(kind, path, whole[:length])
            assert same(read, frames[: round(length / one)])
        else:
            said = refused(kind, path, whole[:length])
            # It is the last line there is, or the row that is not there at all.
            assert 0 <= line_named(said) - whole[:length].count(b"\n") <= 1
    assert read_or_refused(kind, path, b"") == ": the file is empty"


def test_compressed_and_cut_off_anywhere(kind: str, tmp_path: Path) -> None:
    path, whole = tmp_path / "cut.gz", gzip.compress(text_of(kind))
    # The first two bytes say that it is compressed.
    for length in range(2, len(whole)):
        said = read_or_refused(kind, path, whole[:length])
        assert isinstance(said, str)
        assert "cannot be unpacked" in said


@FUZZED
@given(data=st.data())
def test_columns_in_any_order(data: st.DataObject, kind: str, tmp_path: Path) -> None:
    label, columns, rows = KINDS[kind]
    names = columns.split()
    order = data.draw(st.permutations(range(len(names))))
    text = frame_text(
        label,
        STEPS[0],
        " ".join(names[k] for k in order),
        [[row[k] for k in order] for row in rows],
        None,
    )
    usual = frame_text(label, STEPS[0], columns, rows, None)
    read = read_or_refused(kind, tmp_path / "a.dump", text.encode())
    assert same(read, read_or_refused(kind, tmp_path / "b.dump", usual.encode()))


NO_NUMBERS = ["nan", "-nan", "inf", "-INF", "1e999", "", "x", "0.1.2", "--1", "1,5", "NULL", "\x00"]


@FUZZED
@given(data=st.data())
def test_a_value_that_is_no_finite_number(data: st.DataObject, kind: str, tmp_path: Path) -> None:
    _, columns, rows = KINDS[kind]
    lines = text_of(kind).split(b"\n")
    frame = data.draw(st.integers(0, len(STEPS) - 1))
    number = frame * (9 + len(rows)) + 9 + data.draw(st.integers(0, len(rows) - 1))
    names = columns.split()
    column = data.draw(st.sampled_from([k for k, name in enumerate(names) if name not in UNREAD]))
    fields = lines[number].split()
    fields[column] = data.draw(st.sampled_from(NO_NUMBERS)).encode()
    lines[number] = b" ".join(fields)
    said = refused(kind, tmp_path / "a.dump", b"\n".join(lines))
    assert line_named(said) == number + 1, said


@FUZZED
@given(data=st.data())
def test_a_wrong_count(data: st.DataObject, kind: str, tmp_path: Path) -> None:
    _, _, rows = KINDS[kind]
    lines = text_of(kind).split(b"\n")
    frame = data.draw(st.integers(0, len(STEPS) - 1))
    counts = st.integers() | st.integers(-2, 2 * len(rows)) | st.sampled_from([2**63, 10**5000])
    count = data.draw(counts.filter(lambda count: count != len(rows)))
    lines[frame * (9 + len(rows)) + 3] = b"9" * 5000 if count == 10**5000 else b"%d" % count
    refused(kind, tmp_path / "a.dump", b"\n".join(lines))


@FUZZED
@given(data=st.data())
def test_lines_that_are_gone_or_there_twice(data: st.DataObject, kind: str, tmp_path: Path) -> None:
    lines = text_of(kind).splitlines(keepends=True)
    at = data.draw(st.integers(0, len(lines) - 1))
    lines = lines[:at] + data.draw(st.sampled_from([[], [lines[at]] * 2])) + lines[at + 1 :]
    refused(kind, tmp_path / "a.dump", b"".join(lines))


@FUZZED
@given(data=st.data())
def test_bytes_that_were_changed(data: st.DataObject, kind: str, tmp_path: Path) -> None:
    """Another digit is another number, which nobody can see. But nothing ends in a traceback."""
    content = bytearray(text_of(kind))
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    read_or_refused(kind, tmp_path / "a.dump", bytes(content))


@FUZZED
@given(content=st.binary(min_size=1, max_size=300))
def test_junk(content: bytes, kind: str, tmp_path: Path) -> None:
    said = read_or_refused(kind, tmp_path / "a.dump", content)
    assert isinstance(said, str)


OTHERS = {
    "xyz": b"2\ncomment\nX 0 0 0\nX 1 1 1\n",
    "data file": b"spheres\n\n2 atoms\n1 atom types\n\n0 1 xlo xhi\n0 1 ylo yhi\n0 1 zlo zhi\n\n"
    b"Atoms\n\n1 1 0.1 1 0 0 0\n2 1 0.1 1 1 1 1\n",
    "log": b"LAMMPS (22 Jul 2025)\nStep Temp\n0 1\n",
    "picture": b"\x89PNG\r\n\x1a\n" + bytes(range(256)),
    "HDF5": b"\x89HDF\r\n\x1a\n" + bytes(300),
    "yaml dump": b"---\ncreator: LAMMPS\ntimestep: 0\n",
    "comma separated": b"id,x,y,z\n1,0,0,0\n",
    "UTF-16": "ITEM: TIMESTEP\n0\n".encode("utf-16"),
}


@pytest.mark.parametrize("other", OTHERS)
def test_files_of_other_programs(other: str, kind: str, tmp_path: Path) -> None:
    said = refused(kind, tmp_path / "a.dump", OTHERS[other])
    assert line_named(said) == 1


def test_one_dump_for_the_other(kind: str, tmp_path: Path) -> None:
    (other,) = KINDS.keys() - {kind}
    said = refused(kind, tmp_path / "a.dump", text_of(other))
    assert "its rows are " in said


@pytest.mark.parametrize("identity", ["9007199254740993", "1e300", "99999999999999999999"])
def test_ids_that_are_rounded(identity: str, kind: str, tmp_path: Path) -> None:
    """Numbers of more digits than a float64 holds would become another sphere's."""
    lines = text_of(kind).splitlines()
    lines[10] = b" ".join([identity.encode(), *lines[10].split()[1:]])
    assert line_named(refused(kind, tmp_path / "a.dump", b"\n".join(lines) + b"\n")) == 11


@pytest.mark.slow
@FUZZED
@given(data=st.data())
def test_the_command_line_says_one_line(data: st.DataObject, tmp_path: Path) -> None:
    """`inelastic look` on a folder in which one of the two dumps was damaged."""
    damaged = data.draw(st.sampled_from(sorted(KINDS)))
    for kind in KINDS:
        content = bytearray(text_of(kind))
        if kind == damaged:
            at = data.draw(st.integers(0, len(content) - 1))
            content[at : at + data.draw(st.integers(0, 40))] = data.draw(st.binary(max_size=3))
        (tmp_path / f"{kind}.lammpsdump").write_bytes(content)
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = main(["look", str(tmp_path), "--no-picture", "--points", "10"])
    if status == 0:
        assert "nan" not in out.getvalue()
        assert err.getvalue() == ""
    else:
        assert status == 2
        assert out.getvalue() == ""
        assert re.fullmatch(r"inelastic: [^\n]+\n", err.getvalue())
