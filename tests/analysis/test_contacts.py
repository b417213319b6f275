"""Contact dumps: exact numbers, empty frames, and errors that name the line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lammps_inelastic.analysis import ContactFrame, DumpError, iterate_contact_frames
from tests.helpers.written_dumps import Writer

PAIR = [3, 8, 0.1, 0.2, 0.3, 0.0, 1.0, 0.0, -1.0000000000000001e-05, 1.0 / 3.0]
WALL = [8, -3, 0.5, 0.0, 0.5, 0.0, 1.0, 0.0, 2e-6, 0.25]


def read(path: Path) -> list[ContactFrame]:
    return list(iterate_contact_frames(path))


def test_numbers_survive(write_contacts: Writer) -> None:
    (frame,) = read(write_contacts({40: [PAIR, WALL]}))
    # Equality, not closeness: 17 digits give a float64 back.
    assert frame.step == 40
    assert frame.ids.tolist() == [[3, 8], [8, -3]]
    assert frame.points.tolist() == [PAIR[2:5], WALL[2:5]]
    assert frame.normals.tolist() == [PAIR[5:8], WALL[5:8]]
    assert frame.gaps.tolist() == [PAIR[8], WALL[8]]
    assert frame.forces.tolist() == [PAIR[9], WALL[9]]


def test_contacts_that_pull(write_contacts: Writer) -> None:
    """With what they have stored, forces may be of any sign; without it, they must push."""
    columns = "id1 id2 x y z nx ny nz gap force stored"
    rows = [[*PAIR[:9], -2.0, -0.5], [*WALL[:9], 0.0, -1.5]]
    (frame,) = read(write_contacts({40: rows}, columns))
    assert frame.forces.tolist() == [-2.0, 0.0]
    assert frame.stored is not None
    assert frame.stored.tolist() == [-0.5, -1.5]
    with pytest.raises(DumpError, match="stored must not be positive"):
        read(write_contacts({40: [[*PAIR, 0.5]]}, columns))
    with pytest.raises(DumpError, match="the force of a contact must be positive"):
        read(write_contacts({40: [[*PAIR[:9], -2.0]]}))
    (frame,) = read(write_contacts({40: [PAIR]}))
    assert frame.stored is None


def test_frames_without_contacts(write_contacts: Writer) -> None:
    frames = read(write_contacts({0: [], 1: [PAIR], 2: []}))
    assert [frame.step for frame in frames] == [0, 1, 2]
    assert [frame.ids.shape for frame in frames] == [(0, 2), (1, 2), (0, 2)]
    assert frames[0].normals.shape == (0, 3)


def test_columns_are_found_by_name(write_contacts: Writer) -> None:
    columns = "index force id1 id2 x y z nx ny nz gap"
    (frame,) = read(write_contacts({0: [[1, PAIR[9], *PAIR[:9]]]}, columns))
    assert frame.ids.tolist() == [[3, 8]]
    assert frame.forces.tolist() == [PAIR[9]]


def test_label_may_differ(write_contacts: Writer) -> None:
    path = write_contacts({0: [PAIR]})
    path.write_text(path.read_text().replace("ENTRIES", "CONTACTS"))
    assert len(read(path)) == 1


def test_frames_come_one_by_one(write_contacts: Writer) -> None:
    frames = iterate_contact_frames(write_contacts({0: [PAIR], 1: [[*PAIR[:9], np.nan]]}))
    assert next(frames).step == 0
    with pytest.raises(DumpError, match="line 20: force is nan"):
        next(frames)


def test_dump_written_by_lammps(lammps_dumps: tuple[Path, Path]) -> None:
    touching, *_, apart = read(lammps_dumps[1])
    assert sorted(touching.ids[0].tolist()) == [1, 2]
    # 16 digits, and a difference of two coordinates near 0.5: a few units of the last place.
    assert touching.gaps.tolist() == pytest.approx([0.18], rel=1e-14)
    # k times the overlap, 100 x 0.02, with the rounding of that difference: 1e-16 / 0.02.
    assert touching.forces.tolist() == pytest.approx([2.0], rel=1e-13)
    assert (apart.step, len(apart.ids)) == (4000, 0)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(DumpError, match="no such file"):
        read(tmp_path / "nowhere")


def test_empty_file(tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    with pytest.raises(DumpError, match="the file is empty"):
        read(tmp_path / "empty")


def test_missing_column(write_contacts: Writer) -> None:
    with pytest.raises(DumpError, match="line 9: no column gap, force; there is id1 id2 x y z nx"):
        read(write_contacts({0: [PAIR[:8]]}, "id1 id2 x y z nx ny nz"))


def test_truncated(write_contacts: Writer) -> None:
    path = write_contacts({0: [PAIR], 1: [PAIR, WALL]})
    path.write_bytes(path.read_bytes()[:-4])
    with pytest.raises(DumpError, match=r"line 21: .* the frame of step 1: 1 of 2 rows"):
        read(path)


@pytest.mark.parametrize("announced", [0, 1])
def test_too_many_rows(write_contacts: Writer, announced: int) -> None:
    path = write_contacts({0: [PAIR, WALL]}, announced=announced)
    with pytest.raises(DumpError, match=f"line {10 + announced}: expected 'ITEM: TIMESTEP'"):
        read(path)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ([*PAIR[:9], 0.0], "line 11: the force of a contact must be positive"),
        ([*PAIR[:8], np.inf, 1.0], "line 11: gap is inf"),
        ([0, *PAIR[1:]], "line 11: id1 must be a sphere's id"),
        ([3, 0, *PAIR[2:]], "line 11: id1 must be a sphere's id"),
        ([3.5, *PAIR[1:]], "line 11: id1 must be a sphere's id"),
        ([8, *PAIR[1:]], "line 11: a sphere is in contact with itself"),
        (PAIR, "line 11: this pair of spheres is listed twice"),
        ([8, 3, *PAIR[2:]], "line 11: this pair of spheres is listed twice"),
        (PAIR[:9], "line 11: expected 10 values, found 9"),
        ([*PAIR, 1.0], "line 11: expected 10 values, found 11"),
    ],
)
def test_bad_row(write_contacts: Writer, row: str, message: str) -> None:
    with pytest.raises(DumpError, match=message):
        read(write_contacts({0: [PAIR, row, WALL]}))


def test_word_instead_of_number(write_contacts: Writer) -> None:
    path = write_contacts({0: [WALL, PAIR]})
    path.write_text(path.read_text().replace("0.25", "a quarter", 1).replace(" quarter", ""))
    with pytest.raises(DumpError, match="line 10: force = 'a' is no number"):
        read(path)


def test_a_curved_wall_may_be_touched_twice(write_contacts: Writer) -> None:
    (frame,) = read(write_contacts({0: [WALL, WALL]}))
    assert frame.ids.tolist() == [[8, -3], [8, -3]]
