"""Particle dumps: what is read is exactly what was written, and nothing wrong is read silently."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import DumpError, InputError, ParticleDump, read_particle_frame
from tests.helpers.written_dumps import Writer

FIRST = [1, 1, 0.12345678901234567, 0.1, 0.5, 0.0, -1.0 / 3.0, 0.0, 0.055]
SECOND = [2, 1, 0.7, 1e-17, 0.5, 1e-300, 0.0, 2.0, 0.11]


def test_float64_survives(write_particles: Writer) -> None:
    frame = read_particle_frame(write_particles({7: [FIRST, SECOND]}))
    # Equality, not closeness: 17 digits give a float64 back.
    assert frame.positions.tolist() == [FIRST[2:5], SECOND[2:5]]
    assert frame.velocities.tolist() == [FIRST[5:8], SECOND[5:8]]
    assert frame.radii.tolist() == [0.055, 0.11]
    assert frame.ids.tolist() == [1, 2]
    assert frame.box.tolist() == [[0, 1], [0, 5], [0, 1]]
    assert frame.boundaries == ("ff", "ff", "ff")
    assert frame.step == 7
    assert frame.bodies is None
    assert frame.contacts is None


# A box that starts elsewhere than at the origin, and a place in it that float32 does not hold.
BOX = np.array([[-2.0, 1.0], [0.5, 5.5], [1e3, 1.001e3]])
SHARES = np.array([0.1234567890123456, -0.25, 1.75])
PLACE = BOX[:, 0] + SHARES * (BOX[:, 1] - BOX[:, 0])


@pytest.mark.parametrize(
    ("names", "values"),
    [("x y z", PLACE), ("xu yu zu", PLACE), ("xs ys zs", SHARES), ("xsu ysu zsu", SHARES)],
)
def test_positions_in_any_convention(
    write_particles: Writer, names: str, values: tuple[float, ...]
) -> None:
    path = write_particles({0: [[3, *values, 0.4]]}, f"id {names} diameter")
    text = path.read_text().splitlines(keepends=True)
    text[5:8] = [f"{lower:.17g} {upper:.17g}\n" for lower, upper in BOX]
    path.write_text("".join(text))
    frame = read_particle_frame(path)
    # The same float64 operations on numbers that 17 digits give back.
    assert frame.positions.tolist() == [PLACE.tolist()]
    assert frame.radii.tolist() == [0.2]
    assert frame.velocities is None


def test_lengths_come_before_shares_of_the_box(write_particles: Writer) -> None:
    path = write_particles({0: [[1, 0.9, 0.9, 0.9, 7, 8, 9, 1]]}, "id xs ys zs x y z radius")
    assert read_particle_frame(path).positions.tolist() == [[7, 8, 9]]


def test_radius_comes_before_diameter_and_both_before_a_given_one(write_particles: Writer) -> None:
    path = write_particles({0: [[1, 0, 0, 0, 8, 3]]}, "id x y z diameter radius")
    assert read_particle_frame(path, radius=1.0).radii.tolist() == [3]
    path = write_particles({0: [[1, 0, 0, 0]], 5: [[1, 0, 0, 1]]}, "id x y z")
    assert read_particle_frame(path, radius=0.125).radii.tolist() == [0.125]
    assert [frame.radii.tolist() for frame in ParticleDump(path, radius=2)] == [[2], [2]]


@pytest.mark.parametrize("radius", [0, -1, np.nan, np.inf])
def test_radius_that_is_none(write_particles: Writer, radius: Any) -> None:
    with pytest.raises(InputError, match="a radius must be positive and finite, not"):
        ParticleDump(write_particles({0: [FIRST]}), radius=radius)


def test_two_of_three_velocities_are_none(write_particles: Writer) -> None:
    path = write_particles({0: [[1, 0, 0, 0, 5, 6, 1]]}, "id x y z vx vy radius")
    assert read_particle_frame(path).velocities is None


def test_contacts_of_each_sphere(write_particles: Writer) -> None:
    rows = [[2, 0, 0, 0, 1, 7], [1, 0, 0, 0, 1, 0]]
    frame = read_particle_frame(write_particles({0: rows}, "id x y z radius contacts"))
    assert frame.contacts is not None
    assert frame.contacts.tolist() == [0, 7]


@pytest.mark.parametrize("contacts", [-1, 2.5])
def test_contacts_that_are_no_number_of_contacts(write_particles: Writer, contacts: Any) -> None:
    path = write_particles({0: [[1, 0, 0, 0, 1, contacts]]}, "id x y z radius contacts")
    message = f"sphere 1: contacts must be a number of contacts, not {contacts}"
    with pytest.raises(DumpError, match=message):
        read_particle_frame(path)


def test_a_frame_keeps_its_numbers_when_the_next_is_read(write_particles: Writer) -> None:
    frames = {step: [[1, 1, step, 0, 0, step, 0, 0, 1 + step]] for step in (0, 1)}
    dump = ParticleDump(write_particles(frames))
    first, _ = dump[0], dump[1]
    assert (first.positions[0, 0], first.velocities[0, 0], first.radii[0]) == (0, 0, 1)


def compressed(path: Path) -> Path:
    target = path.with_name("dump.gz")
    target.write_bytes(gzip.compress(path.read_bytes()))
    return target


def test_compressed_dump(write_particles: Writer) -> None:
    frames = {step: [[1, 1, step / 8, 0, 0, 0, 0, 0, 1]] for step in (0, 3, 5)}
    dump = ParticleDump(compressed(write_particles(frames)))
    assert [frame.positions[0, 0] for frame in dump] == [0, 3 / 8, 5 / 8]
    assert dump[0].step == 0


def test_compressed_dump_that_was_cut_off(write_particles: Writer) -> None:
    path = compressed(write_particles({step: [FIRST, SECOND] for step in range(100)}))
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(DumpError, match=r"dump\.gz: cannot be unpacked: Compressed file ended"):
        read_particle_frame(path)


def test_rows_come_ordered_by_id(write_particles: Writer) -> None:
    frame = read_particle_frame(write_particles({0: [SECOND, FIRST]}))
    assert frame.ids.tolist() == [1, 2]
    assert frame.radii.tolist() == [0.055, 0.11]


def test_molecules_are_bodies(write_particles: Writer) -> None:
    rows = [[1, 4, *FIRST[1:]], [2, 0, *SECOND[1:]]]
    frame = read_particle_frame(write_particles({0: rows}, "id mol type x y z vx vy vz radius"))
    assert frame.bodies is not None
    assert frame.bodies.tolist() == [4, 0]


def test_spheres_of_a_molecule_are_one_particle(write_particles: Writer) -> None:
    rows = [[1, 4, *FIRST[1:]], [2, 0, *SECOND[1:]], [3, 4, *FIRST[1:]]]
    frame = read_particle_frame(write_particles({0: rows}, "id mol type x y z vx vy vz radius"))
    assert frame.particles.index.tolist() == [0, 1, 0]
    assert frame.particles.bodies.tolist() == [4, 0]


def test_without_molecules_every_sphere_is_a_particle(write_particles: Writer) -> None:
    frame = read_particle_frame(write_particles({0: [FIRST, SECOND]}))
    assert frame.particles.index.tolist() == [0, 1]


@pytest.mark.parametrize("mol", [-1, 1.5])
def test_molecule_that_is_no_body(write_particles: Writer, mol: Any) -> None:
    rows = [[1, 0, *FIRST[1:]], [2, mol, *SECOND[1:]]]
    path = write_particles({0: rows}, "id mol type x y z vx vy vz radius")
    with pytest.raises(DumpError, match=f"sphere 2: mol must be a body's number or 0, not {mol}"):
        read_particle_frame(path)


def test_frames_by_index_and_in_order(write_particles: Writer) -> None:
    frames = {step: [[1, 1, step / 8, 0, 0, 0, 0, 0, 1]] for step in (0, 3, 5)}
    dump = ParticleDump(write_particles(frames))
    assert dump.steps == (0, 3, 5)
    assert [frame.positions[0, 0] for frame in dump] == [0, 3 / 8, 5 / 8]
    assert [dump[index].step for index in (1, -1, 0)] == [3, 5, 0]
    with pytest.raises(IndexError, match="no frame 3, there are 3"):
        dump[3]


def test_a_frame_is_read_only_when_asked_for(write_particles: Writer) -> None:
    bad = [*FIRST[:-1], np.nan]
    dump = ParticleDump(write_particles({0: [FIRST], 1: [bad]}))
    assert dump[0].radii.tolist() == [0.055]
    with pytest.raises(DumpError, match="step 1, sphere 1: radius is nan"):
        dump[1]


def test_dump_written_by_lammps(lammps_dumps: tuple[Path, Path]) -> None:
    first, *_, last = ParticleDump(lammps_dumps[0])
    # 16 digits are one short of a float64: half a unit of the sixteenth.
    assert first.positions == pytest.approx(
        np.array([[0.60, 0.123456789012345, 0.5], [0.42, 0.123456789012345, 0.5]]), rel=5e-16
    )
    assert first.radii.tolist() == [0.1, 0.1]
    assert (first.step, last.step) == (0, 4000)
    # Elastic: the energy k overlap^2 / 2 of the spring becomes kinetic, half in each sphere.
    # Velocity Verlet, and a release between two steps, err by (omega dt)^2 = 5e-6 at most.
    speed = np.sqrt(100 * 0.02**2 / 2 / (np.pi / 6 * 0.2**3))
    assert last.velocities[:, 0] == pytest.approx([speed, -speed], rel=1e-5)


def edited(path: Path, old: str, new: str) -> Path:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return path


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(DumpError, match=r"nowhere\.lammpsdump: no such file"):
        read_particle_frame(tmp_path / "nowhere.lammpsdump")


def test_folder_instead_of_file(tmp_path: Path) -> None:
    with pytest.raises(DumpError, match="cannot be read"):
        read_particle_frame(tmp_path)


def test_empty_file(tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    with pytest.raises(DumpError, match="the file is empty"):
        read_particle_frame(tmp_path / "empty")


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ("type x y z radius", "no column id; there is type x y z radius"),
        (
            "id x y xs ys",
            r"no column x, y, z \(nor xu, yu, zu; xs, ys, zs; xsu, .*\); there is id x y xs ys",
        ),
        (
            "id x y z vx",
            r"no column radius \(nor diameter\), and no radius is given; there is id x",
        ),
    ],
)
def test_missing_column_names_what_is_there(
    write_particles: Writer, columns: str, message: str
) -> None:
    path = write_particles({0: [[1, 0.5, 0.5, 0.5, 0.5]]}, columns)
    with pytest.raises(DumpError, match=f"line 9: {message}"):
        read_particle_frame(path)


@pytest.mark.parametrize(
    ("cut", "line", "rows"),
    [(1, 22, "1 of 2"), (12, 22, "1 of 2"), (70, 21, "0 of 2")],
    ids=["end of line only", "last digits", "a row and more"],
)
def test_truncated_rows(write_particles: Writer, cut: int, line: int, rows: int) -> None:
    path = write_particles({0: [FIRST, SECOND], 1: [FIRST, SECOND]})
    path.write_bytes(path.read_bytes()[:-cut])
    with pytest.raises(DumpError, match=f"line {line}: .* inside the frame of step 1: {rows} rows"):
        read_particle_frame(path, 0)


def test_truncated_header(write_particles: Writer) -> None:
    path = write_particles({0: [FIRST], 1: [FIRST]})
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:14]))
    with pytest.raises(DumpError, match="line 14: the file ends inside this frame's header"):
        read_particle_frame(path, 0)


@pytest.mark.parametrize("announced", [1, 3])
def test_wrong_number_of_rows(write_particles: Writer, announced: int) -> None:
    path = write_particles({0: [FIRST, SECOND], 1: [FIRST, SECOND]}, announced=announced)
    with pytest.raises(DumpError, match=f"line {10 + announced}: expected 'ITEM: TIMESTEP'"):
        read_particle_frame(path)


def test_frame_without_particles(write_particles: Writer) -> None:
    """A container that is still empty: the frames after it are read."""
    path = write_particles({5: [], 6: [FIRST]})
    assert read_particle_frame(path).ids.tolist() == [1]
    with pytest.raises(DumpError, match="line 9: the frame of step 5 has no spheres"):
        read_particle_frame(path, 0)


def test_number_of_particles_changes(write_particles: Writer) -> None:
    dump = ParticleDump(write_particles({0: [FIRST], 1: [SECOND, FIRST], 2: [SECOND]}))
    assert dump.spheres == (1, 2, 1)
    assert [frame.ids.tolist() for frame in dump] == [[1], [1, 2], [2]]


def test_whole_frames_of_a_file_that_is_cut_off(write_particles: Writer) -> None:
    path = write_particles({0: [FIRST], 1: [SECOND]})
    path.write_bytes(path.read_bytes()[:-1])
    dump = ParticleDump(path, whole=False)
    assert [frame.ids.tolist() for frame in dump] == [[1]]
    assert dump.cut_off is not None
    assert "the file ends inside the frame of step 1: 0 of 1 rows" in dump.cut_off
    # No frame of this one is whole.
    path.write_text(path.read_text().partition("ITEM: TIMESTEP\n1")[0][:-1])
    with pytest.raises(DumpError, match="line 10: the file ends inside the frame of step 0"):
        ParticleDump(path, whole=False)


def test_columns_change(write_particles: Writer) -> None:
    path = write_particles({0: [FIRST], 1: [FIRST]})
    text = path.read_text()
    path.write_text(text[::-1].replace(" y z vx"[::-1], " z y vx"[::-1], 1)[::-1])
    with pytest.raises(DumpError, match="line 19: the columns are not those"):
        read_particle_frame(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (" 0.11 ", " 0.1x1 ", "line 11: radius = '0.1x1' is no number"),
        (" 0.11 ", " ", "line 11: expected 9 values, found 8"),
        (" 0.11 ", " inf ", "step 0, sphere 2: radius is inf"),
        (" 0.11 ", " 0 ", "step 0, sphere 2: radius is not positive"),
        (" 0.11 ", " \xe9 ", "line 11: radius = .* is no number"),
        ("\n2 1", "\n2.5 1", r"line 11: id = '2\.5' is no whole number"),
        ("\n2 1", "\n2e0 1", "line 11: id = '2e0' is no whole number"),
        ("\n2 1", "\n1 1", "step 0: ids must be positive and each there once"),
        ("ff ff ff", "xy xz yz ff ff ff", "line 6: expected two bounds and a tilt, found"),
        ("ff ff ff", "ff ff", "line 5: expected two letters for each axis of the box, or none"),
        ("e+00 5.0", "e+00 -5.0", "line 7: box bounds 0 -5 are not in order"),
        ("e+00 5.0", "e+00 5.0 5.0", "line 7: expected two bounds"),
        ("ATOMS\n2", "ATOMS\ntwo", "line 4: expected an integer, found 'two'"),
        ("ITEM: ATOMS", "ITEM: ENTRIES", "line 9: expected 'ITEM: ATOMS'"),
        ("ITEM: TIMESTEP", "ITEM: UNITS\nITEM: TIMESTEP", "line 2: expected a value"),
        ("ITEM: TIMESTEP", "ITEM: GRID", r"line 1: .*\(it is no text dump custom or local"),
    ],
)
def test_malformed(write_particles: Writer, old: str, new: str, message: str) -> None:
    path = edited(write_particles({0: [FIRST, SECOND]}), old, new)
    with pytest.raises(DumpError, match=message):
        read_particle_frame(path)
