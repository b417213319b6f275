"""The numbers of one run as text for a terminal, and as JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich import filesize

from lammps_inelastic.analysis import (
    BoxInBed,
    Cell,
    CoordinationNumber,
    Orientation,
    ParticleFrame,
)

from ..wide_table import wrapped
from .look import Look, as_ranges

NO_WALLS = "the box is not fixed: give --container or --walls"

# A row of the table has a name, a value and a note.
Row = tuple[str, str, str]


def as_text(found: Look) -> str:
    """Return the numbers as a table, and below it where they come from."""
    composite = found.frame.particles.composite
    spheres = [("  spheres", f"{len(found.frame.ids)}", _sizes(found.frame))] if composite else []
    rows = [
        ("particles", f"{len(found.frame.particles)}", f"step {found.frame.step}"),
        *spheres,
        *_rest_rows(found),
        _packing_row(found),
        *_coordination_rows(found),
        *(_body_rows(found) if composite else []),
        *_overlap_rows(found),
    ]
    left, right = (max(len(row[column]) for row in rows) for column in (0, 1))
    lines = [wrapped(f"{name:<{left}}  {value:<{right}}  ", note) for name, value, note in rows]
    files = [
        ("particle dump", found.dump),
        ("contact dump", found.contact_dump)
        if found.contact_gap is None
        else ("contacts", f"gaps below {found.contact_gap / found.smallest_radius:.3g} r"),
        ("picture", found.picture or "none"),
        ("page", "none" if found.page is None else f"{found.page} ({_size(found.page)})"),
    ]
    return "\n".join(
        [
            *lines,
            "",
            f"{'box':<{left}}  {_box(found)}",
            f"{'  ends of the bed':<{left}}  {as_ranges(found.packing.bed.bed)}",
            f"{'  in the bed':<{left}}  {_part_in_bed(found.packing.bed)}",
            f"{'r':<{left}}  {found.smallest_radius:.6g}, the smallest radius",
            *(f"{name:<{left}}  {path}" for name, path in files),
            *(wrapped(f"{'note':<{left}}  ", note) for note in found.notes),
        ]
    )


def _size(path: Path) -> str:
    return filesize.decimal(path.stat().st_size)


def _box(found: Look) -> str:
    """Say where numbers are measured, and what kind of simulation box that is in."""
    cell = found.frame.cell
    periods = [name for name, flag in zip(_edges(cell), cell.periodic, strict=True) if flag]
    return "; ".join(
        [
            "the whole simulation box" if found.box is None else as_ranges(found.box),
            *(["two-dimensional"] if cell.flat else []),
            *([f"periodic along {', '.join(periods)}"] if periods else []),
        ]
    )


def _edges(cell: Cell) -> str:
    """Return the names of a cell's edges: those of the axes, or LAMMPS's where some are oblique."""
    return "xyz" if np.array_equal(cell.vectors, np.diag(np.diag(cell.vectors))) else "abc"


def _part_in_bed(bed: BoxInBed) -> str:
    """Say how much of the box lies in the bed, and with which --box all of it would."""
    if bed.is_inside:
        return "all of the box"
    if bed.inside is None:
        return "no part of the box"
    inside = " ".join(f"{bound:g}" for bound in bed.inside.ravel())
    return f"{bed.share:.0%} of the box, --box {inside}"


def _rest_rows(found: Look) -> list[Row]:
    """Say whether the packing is at rest, where that is known."""
    if found.unrest is None:
        return []
    return [("at rest", "yes" if found.unrest.at_rest else "NOT AT REST", found.unrest.words)]


def _packing_row(found: Look) -> Row:
    measured = found.packing.packing_fraction
    by_points = f"{measured.drawn.value:.4f} ± {measured.drawn.uncertainty:.4f}"
    points = f"{measured.drawn.points:,} random points, seed {found.seed}"
    bed = found.packing.bed
    note = "" if bed.is_inside else f"PARTLY OF EMPTY SPACE: the bed ends at {bed.ends}; "
    if measured.exact is None:
        return ("packing fraction", by_points, note + points)
    return ("packing fraction", f"{measured.value:.4f}", f"{note}exact; {by_points} by {points}")


def _coordination_rows(found: Look) -> list[Row]:
    coordination = found.coordination
    first, last = found.contact_steps
    if coordination.scatter is None:
        over = f"one frame, step {first}"
    else:
        over = f"{coordination.frames} frames, steps {first} to {last}; ± is their scatter"
    return [
        ("coordination number", _as_mean(coordination), over),
        (
            "  0 or 1 contacts",
            f"{coordination.particles_with(0, 1):.1f} particles",
            f"of the {coordination.particles} in the box",
        ),
    ]


def _overlap_rows(found: Look) -> list[Row]:
    pair, wall, ids = found.packing.pair_overlap, found.packing.wall_overlap, found.frame.ids
    # Overlaps are between spheres; where every particle is a sphere, they are between particles.
    one = "sphere" if found.frame.particles.composite else "particle"
    where_pair = f"{one}s {ids[pair.pair[0]]} and {ids[pair.pair[1]]}" if pair.pair else "none"
    if wall is None:
        with_wall = ("-", NO_WALLS)
    elif found.frame.spheres.endless.all():
        with_wall = ("-", "the box has no walls")
    else:
        touched = "none" if wall.particle is None else f"{one} {ids[wall.particle]}, {wall.face}"
        with_wall = (f"{wall.depth / found.smallest_radius:.3g} r", touched)
    return [
        ("largest overlap", f"{pair.depth / found.smallest_radius:.3g} r", where_pair),
        ("  with a wall", *with_wall),
    ]


def _as_mean(number: CoordinationNumber | None) -> str:
    if number is None:
        return "-"
    return f"{number.mean:.3f}" + ("" if number.scatter is None else f" ± {number.scatter:.3f}")


def _sizes(frame: ParticleFrame) -> str:
    sizes = frame.particles.sizes
    fewest, most = int(sizes.min()), int(sizes.max())
    return f"{most} in each" if fewest == most else f"{fewest} to {most} in each"


def _body_rows(found: Look) -> list[Row]:
    """Return the rows that a packing has only if some of its particles are of several spheres."""
    packing = found.packing
    note = "several contacts with one count once"
    rows = [("  neighbours", _as_mean(packing.neighbours), note)]
    if found.walls_known:
        in_all = f"in the box; {found.wall_contacts_in_all:.1f} contacts with walls in all"
        rows.append(("  wall contacts", _as_mean(packing.wall_contacts), in_all))
    else:
        rows.append(("  wall contacts", "-", NO_WALLS))
    return [*rows, *([] if packing.orientation is None else _orientation_rows(packing.orientation))]


def _orientation_rows(lie: Orientation) -> list[Row]:
    errors: Sequence[float | None] = [None] * 3
    if lie.standard_errors is not None:
        errors = lie.standard_errors.tolist()
    notes = (
        f"root mean square of x_i - x_j in the {lie.dimers} dimers in the box",
        "of y_i - y_j; ± is the standard error",
        f"of z_i - z_j; isotropic: {lie.isotropic:.4g}",
    )
    rows = []
    for axis, mean, error, note in zip("xyz", lie.components, errors, notes, strict=True):
        value = f"{mean:.4g}" if error is None else f"{mean:.4g} ± {error:.2g}"
        rows.append((f"a_{axis}", value, note))
    return rows


def as_json(found: Look) -> str:
    """Return the numbers as JSON, with all digits."""
    report: dict[str, Any] = {
        "step": found.frame.step,
        "particles": len(found.frame.particles),
        "smallest_radius": found.smallest_radius,
        "box": None if found.box is None else found.box.tolist(),
        "periodic": list(found.frame.cell.periodic),
        "dimensions": 2 if found.frame.cell.flat else 3,
        "at_rest": None
        if found.unrest is None
        else {
            "value": found.unrest.at_rest,
            "rms_speed": found.unrest.speed,
            "net_force": found.unrest.net_force,
        },
        "bed": _bed_report(found.packing.bed),
        "packing_fraction": _packing_report(found),
        "coordination_number": _coordination_report(found),
        **_overlaps_report(found),
        "notes": list(found.notes),
        "files": {
            "particles": str(found.dump),
            "contacts": None if found.contact_dump is None else str(found.contact_dump),
            "picture": None if found.picture is None else str(found.picture),
            "page": None if found.page is None else str(found.page),
        },
    }
    if found.frame.particles.composite:
        report |= _bodies_report(found)
    return json.dumps(report, indent=2, allow_nan=False)


def _bed_report(bed: BoxInBed) -> dict[str, Any]:
    return {
        # A bed has no end along what is periodic, and JSON no infinite numbers.
        "ends": [[end if np.isfinite(end) else None for end in ends] for ends in bed.bed.tolist()],
        "share_of_box": bed.share,
        "box_inside": None if bed.inside is None else bed.inside.tolist(),
    }


def _packing_report(found: Look) -> dict[str, Any]:
    measured = found.packing.packing_fraction
    exact, drawn = measured.exact, measured.drawn
    return {
        "value": measured.value,
        "method": "monte carlo" if exact is None else "exact",
        "common_volume": None if exact is None else exact.overlap,
        "monte_carlo": {
            "value": drawn.value,
            "uncertainty": drawn.uncertainty,
            "points": drawn.points,
            "seed": found.seed,
        },
    }


def _coordination_report(found: Look) -> dict[str, Any]:
    coordination = found.coordination
    report: dict[str, Any] = {
        "mean": coordination.mean,
        "scatter": coordination.scatter,
        "frames": coordination.frames,
        "steps": list(found.contact_steps),
        "particles": coordination.particles,
        "particles_with_0_or_1": coordination.particles_with(0, 1),
        "distribution": coordination.distribution.tolist(),
    }
    if found.contact_gap is not None:
        report["contact_gap"] = found.contact_gap
    return report


def _overlaps_report(found: Look) -> dict[str, Any]:
    pair, wall, ids = found.packing.pair_overlap, found.packing.wall_overlap, found.frame.ids
    return {
        "largest_pair_overlap": {
            "depth": pair.depth,
            "ids": [int(ids[index]) for index in pair.pair or ()],
        },
        "largest_wall_overlap": None
        if wall is None
        else {
            "depth": wall.depth,
            "id": None if wall.particle is None else int(ids[wall.particle]),
            "face": wall.face,
        },
    }


def _bodies_report(found: Look) -> dict[str, Any]:
    """Return what a packing has only if some of its particles are of several spheres."""
    packing, lie = found.packing, found.packing.orientation
    errors = None if lie is None else lie.standard_errors
    walls = packing.wall_contacts if found.walls_known else None
    return {
        "spheres": len(found.frame.ids),
        "neighbours": _mean_report(packing.neighbours),
        "wall_contacts": None
        if walls is None
        else {**_mean_report(walls), "in_all": found.wall_contacts_in_all},
        "orientation": None
        if lie is None
        else {
            "components": lie.components.tolist(),
            "standard_errors": None if errors is None else errors.tolist(),
            "isotropic": lie.isotropic,
            "dimers": lie.dimers,
        },
    }


def _mean_report(number: CoordinationNumber | None) -> dict[str, Any]:
    assert number is not None
    return {"mean": number.mean, "scatter": number.scatter}
