"""Packings in periodic cells as LAMMPS dumps them, read and measured: against all images."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lammps_inelastic.analysis import (
    ContactFrame,
    DumpError,
    ParticleDump,
    contact_counts,
    contacts_by_distance,
    iterate_contact_frames,
    measure_evolution,
    measure_packing,
    read_particle_frame,
)
from lammps_inelastic.analysis.geometry import FloatArray
from tests.helpers.replicas import CELLS, PLANES, Packing, in_plane, in_space, size_of_box, union
from tests.helpers.written_dumps import CONTACT_COLUMNS

COORDINATES = ("x y z", "xu yu zu", "xs ys zs", "xsu ysu zsu")
EVERY = [
    *((in_space, cell, "dimers") for cell in CELLS),
    *((in_space, cell, "clusters") for cell in ("narrow", "oblique", "ppf", "tilted pfp")),
    *((in_plane, cell, "dimers") for cell in PLANES),
]
each_packing = pytest.mark.parametrize(("make", "cell", "shapes"), EVERY)


def box_lines(packing: Packing) -> list[str]:
    """Return the lines of the box as LAMMPS writes them, which depend on its shape."""
    flags = ["pp" if flag else "ff" for flag in packing.periodic]
    if packing.flat:
        flags[2] = "pp"
    (a, b, c), (xlo, ylo, zlo) = packing.vectors, packing.origin
    (xy, xz, yz), (xhi, yhi, zhi) = (b[0], c[0], c[1]), packing.origin + np.diag(packing.vectors)
    if a[1] or a[2] or b[2]:
        rows: list[Any] = [
            [*edge, place] for edge, place in zip((a, b, c), packing.origin, strict=True)
        ]
        item = "abc origin "
    elif xy or xz or yz:
        rows = [
            [xlo + min(0, xy, xz, xy + xz), xhi + max(0, xy, xz, xy + xz), xy],
            [ylo + min(0, yz), yhi + max(0, yz), xz],
            [zlo, zhi, yz],
        ]
        item = "xy xz yz "
    else:
        rows, item = [[xlo, xhi], [ylo, yhi], [zlo, zhi]], ""
    return [
        f"ITEM: BOX BOUNDS {item}{' '.join(flags)}",
        *(" ".join(f"{value:.16e}" for value in row) for row in rows),
    ]


def coordinates_of(packing: Packing, names: str) -> FloatArray:
    """Return the spheres' places as LAMMPS writes them: wrapped into the cell, or some way away."""
    shares = np.linalg.solve(packing.vectors.T, (packing.positions - packing.origin).T).T
    if "u" in names:
        away = np.random.default_rng(2).integers(-3, 4, shares.shape)
        shares = shares + away * packing.periodic
    else:
        shares = np.where(packing.periodic, shares % 1, shares)
    places: FloatArray = packing.origin + shares @ packing.vectors
    return np.asarray(shares) if "s" in names else places


def dump(path: Path, packing: Packing, names: str = "x y z", **more: Any) -> Path:
    """Add a frame to a particle dump, whose rows are in any order."""
    count = len(packing.radii)
    velocities = more.get("velocities", np.zeros((count, 3)))
    table = np.column_stack([coordinates_of(packing, names), velocities, packing.radii])
    lines = [
        "ITEM: TIMESTEP",
        f"{more.get('step', 0)}",
        "ITEM: NUMBER OF ATOMS",
        f"{count}",
        *box_lines(packing),
        f"ITEM: ATOMS id mol {names} vx vy vz radius",
        *(
            " ".join([f"{row + 1} {packing.bodies[row]}", *(f"{x:.17g}" for x in table[row])])
            for row in np.random.default_rng(1).permutation(count)
        ),
    ]
    with path.open("a") as file:
        file.write("".join(line + " \n" for line in lines))
    return path


def contacts_as_dumped(packing: Packing, gap: float) -> FloatArray:
    """Return the rows of a contact dump: two ids, the point, the normal, the gap and a force."""
    rows = []
    for (one, other, *move), distance in packing.pairs(gap).items():
        apart = packing.positions[one] - packing.positions[other] - np.array(move) @ packing.vectors
        unit = apart / np.linalg.norm(apart)
        point = packing.positions[one] - (packing.radii[one] + distance / 2) * unit
        rows.append([one + 1, other + 1, *point, *unit, distance, 1.0])
    return np.array(rows).reshape(-1, 10)


def dump_contacts(path: Path, packing: Packing, rows: FloatArray, step: int = 0) -> Path:
    lines = [
        "ITEM: TIMESTEP",
        f"{step}",
        "ITEM: NUMBER OF ENTRIES",
        f"{len(rows)}",
        *box_lines(packing),
        f"ITEM: ENTRIES {CONTACT_COLUMNS}",
        *(" ".join(f"{value:.17g}" for value in row) for row in rows),
    ]
    with path.open("a") as file:
        file.write("".join(line + " \n" for line in lines))
    return path


@pytest.mark.parametrize("names", COORDINATES)
@each_packing
def test_frames(make: Any, cell: str, shapes: str, names: str, tmp_path: Path) -> None:
    packing = make(cell, shapes)
    frame = read_particle_frame(dump(tmp_path / "dump", packing, names))
    assert frame.cell.periodic == packing.periodic
    assert frame.cell.flat == packing.flat
    # The bounds of a tilted box are read, and its tilts taken off; a few operations.
    np.testing.assert_allclose(frame.cell.vectors, packing.vectors, atol=1e-13)
    np.testing.assert_allclose(frame.cell.origin, packing.origin, atol=1e-13)
    spheres = frame.spheres
    moved = np.linalg.solve(packing.vectors.T, (spheres.positions - packing.positions).T).T
    assert np.abs(moved - np.rint(moved)).max() < 1e-12
    for particle, members in enumerate(packing.members):
        assert (spheres.particles.index[members] == particle).all()
        assert np.ptp(np.rint(moved[members]), axis=0).max() == 0
    walls = np.isfinite(frame.walls)
    open_faces = np.array([not flag for flag in packing.periodic])
    open_faces[2] &= not packing.flat
    leaning = cell == "tilted fpf"
    assert (walls == (open_faces & [not leaning, True, True])[:, None]).all()


@each_packing
def test_measurement(make: Any, cell: str, shapes: str, tmp_path: Path) -> None:
    packing = make(cell, shapes)
    gap = 0.2
    frame = read_particle_frame(dump(tmp_path / "dump", packing))
    contacts = dump_contacts(tmp_path / "contacts", packing, contacts_as_dumped(packing, gap))
    (known,) = iterate_contact_frames(contacts)
    counts = contact_counts(known.ids, frame.ids, frame.particles, images=True)
    by_distance = contacts_by_distance(frame.spheres, gap)
    again = contact_counts(by_distance.ids(frame.ids), frame.ids, frame.particles, images=True)
    assert (counts.particles == again.particles).all()

    low = packing.origin + packing.vectors.sum(axis=0) / 2 - np.array([0.9, 0.8, 0.7])
    box = np.column_stack([low, low + np.array([1.7, 1.9, 1.5])])
    box += np.array(packing.periodic)[:, None] * 0.9
    found = measure_packing(frame, [counts], box, points=5_000)
    centres, span = packing.centres, 20.0
    images = centres[:, None] + packing.shifts(span)
    inside = (images >= box[:, 0]) & (images <= box[:, 1])
    if packing.flat:
        inside[..., 2] = True
    chosen = inside.all(axis=2).any(axis=1)
    assert (found.in_box == chosen).all()
    number = np.zeros(len(packing.members))
    for one, other, *_ in packing.pairs(gap):
        np.add.at(number, packing.owner[[one, other]], 1)
    if chosen.any():
        # A mean of whole numbers.
        assert found.coordination.mean == pytest.approx(number[chosen].mean(), rel=1e-14)
        assert found.coordination.particles == chosen.sum()
    assert found.pair_overlap.depth == 0
    if shapes == "dimers":
        total, _ = packing.size_in(box)
        share = total / size_of_box(box, flat=packing.flat)
        # The error of the integration over cut spheres.
        assert found.packing_fraction.value == pytest.approx(share, abs=1e-9)
        drawn = found.packing_fraction.drawn
        assert abs(drawn.value - share) < 4 * drawn.uncertainty
        dimers = [
            m for m, there in zip(packing.members, chosen, strict=True) if there and len(m) == 2
        ]
        assert (found.orientation is None) == (not dimers)
        if dimers:
            arms = np.array([np.diff(packing.positions[m], axis=0)[0] for m in dimers])
            np.testing.assert_allclose(
                found.orientation.components, np.sqrt((arms**2).mean(axis=0)), atol=1e-12
            )
    if all(packing.periodic[: 2 if packing.flat else 3]):
        assert found.bed.is_inside
        whole = measure_packing(frame, [counts], points=5_000)
        assert whole.in_box.all()
        assert whole.coordination.mean == pytest.approx(number.mean(), rel=1e-14)
        if shapes == "dimers":
            x = packing.positions[:, : 2 if packing.flat else 3]
            total = sum(union(x[m], packing.radii[m]) for m in packing.members)
            share = total / packing.volume
            assert whole.packing_fraction.value == pytest.approx(share, rel=1e-12)
            drawn = whole.packing_fraction.drawn
            assert abs(drawn.value - share) < 4 * drawn.uncertainty


@pytest.mark.parametrize("cell", ["ppp", "pff", "ppf", "tilted", "tilted fpf"])
def test_evolution(cell: str, tmp_path: Path) -> None:
    packing = in_space(cell, "dimers")
    generator = np.random.default_rng(9)
    velocities = generator.normal(size=packing.positions.shape)
    particles, contacts = tmp_path / "dump", tmp_path / "contacts"
    gaps = [0.1, 0.3]
    for step, gap in enumerate(gaps):
        dump(particles, packing, step=step, velocities=velocities)
        dump_contacts(contacts, packing, contacts_as_dumped(packing, gap), step)
    mass = packing.radii**3 / (packing.radii**3).sum()
    for up in range(3):
        found = measure_evolution(
            ParticleDump(particles), contacts=iterate_contact_frames(contacts), up=up
        )
        for step, gap in enumerate(gaps):
            mean = 2 * len(packing.pairs(gap)) / len(packing.members)
            assert found.coordination[step] == pytest.approx(mean, rel=1e-13)
        energy = (mass @ (velocities**2).sum(axis=1)) / 2
        assert found.kinetic_energy == pytest.approx(energy, rel=1e-13)
        if (packing.edges[:, up] != 0).any():
            # A sphere that leaves through one face comes back through the other.
            assert np.isnan(found.height).all()
        else:
            assert found.height == pytest.approx(mass @ packing.positions[:, up], rel=1e-12)
        if all(packing.periodic):
            total = sum(union(packing.positions[m], packing.radii[m]) for m in packing.members)
            share = total / packing.volume
            # 100,000 points: four standard errors.
            error = math.sqrt(share * (1 - share) / 100_000)
            assert np.abs(found.packing_fraction - share).max() < 4 * error


@pytest.mark.parametrize("names", COORDINATES)
def test_two_dimensions(names: str, tmp_path: Path) -> None:
    packing = in_plane("tilted", "spheres")
    assert read_particle_frame(dump(tmp_path / "flat", packing, names)).cell.flat
    # A plane that is not periodic across itself is one of balls; so are spheres of any height.
    text = (tmp_path / "flat").read_text()
    solid = tmp_path / "solid"
    solid.write_text(text.replace("pp pp pp", "pp pp ff"))
    assert not read_particle_frame(solid).cell.flat
    assert read_particle_frame(solid).cell.periodic == (True, True, False)
    packing = in_space("tilted", "spheres")
    assert not read_particle_frame(dump(tmp_path / "high", packing, names)).cell.flat


def test_a_contact_that_is_there_twice(tmp_path: Path) -> None:
    packing = in_space("narrow", "spheres")
    rows = contacts_as_dumped(packing, 1.1)
    pairs = [tuple(pair) for pair in rows[:, :2].tolist()]
    several = [pair for pair in pairs if pairs.count(pair) > 1]
    own = [pair for pair in pairs if pair[0] == pair[1]]
    assert several or own
    (frame,) = iterate_contact_frames(dump_contacts(tmp_path / "all", packing, rows))
    assert isinstance(frame, ContactFrame)
    assert len(frame.gaps) == len(rows)
    # The same contact from the other side, as another rank would write it.
    again = rows[3].copy()
    again[[0, 1]] = again[[1, 0]]
    again[5:8] *= -(1 + 1e-12)
    with pytest.raises(DumpError, match="listed twice"):
        [
            *iterate_contact_frames(
                dump_contacts(tmp_path / "two", packing, np.vstack([rows, again]))
            )
        ]
    # A cell without periods has no images that could touch.
    text = (tmp_path / "all").read_text().replace("pp pp pp", "ff ff ff")
    (tmp_path / "open").write_text(text)
    with pytest.raises(DumpError, match=r"listed twice|with itself"):
        [*iterate_contact_frames(tmp_path / "open")]
