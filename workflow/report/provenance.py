"""How the numbers of a report were made, and how to make them again."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..shipped import QUICK_FOLDER, STUDIES_FOLDER
from ..store import Result, StoredStudy
from .blocks import DASH, Block, Listing, Section, Table, Text, as_short, cells
from .data import Data
from .statistics import computing_seconds

_GRAVITY = re.compile(r"^variable\s+gravity\s+equal\s+(\S+)", re.MULTILINE)

# What the paper does not state, in the decks' names, with its unit.
NOT_STATED = (
    ("dt", "time step h", "time"),
    ("random_force", "largest random acceleration, per direction", "length/time²"),
    ("drag", "drag per mass, after the random force", "1/time"),
    ("steps_agitated", "steps with random force", "steps"),
    ("steps_settling", "steps with drag", "steps"),
    ("tolerance_measuring", "ε / r while contacts are counted", "1"),
)


def commands(data: Data, name: str) -> list[str]:
    """Return the commands that make a study's part of a report."""
    report = f"inelastic report DIR/{name}.h5"
    study = data.studies.get(name)
    if study is not None and not _is_shipped(study, STUDIES_FOLDER):
        if _is_shipped(study, QUICK_FOLDER):
            return ["inelastic reproduce --quick --out DIR"]
        return [f"inelastic run {name}.toml --out DIR", report]
    return [f"inelastic run {name} --out DIR", report]


def _is_shipped(study: StoredStudy, folder: Path) -> bool:
    path = folder / f"{study.name}.toml"
    return path.is_file() and path.read_text(encoding="utf-8") == study.text


def provenance_section(data: Data, files: Sequence[str]) -> Section:
    """Return the section on what was run when, with what, and what the paper does not state."""
    blocks: list[Block] = []
    results = [result for study in data.studies.values() for result in study.results]
    if data.studies:
        blocks.append(_runs_table(data.studies.values()))
    lines = [line for name in data.studies for line in commands(data, name)]
    blocks.append(
        Listing("\n".join(dict.fromkeys(lines)))
        if data.studies
        else Text("No study has results.", missing=True)
    )
    blocks.append(
        Text(f"Everything in this report is drawn from these files alone: {', '.join(files)}.")
    )
    if results:
        blocks.append(_not_stated_table(results))
        blocks += [_versions_table(results)]
        blocks += _decks(results)
    for study in data.studies.values():
        blocks.append(Listing(study.text.strip(), f"Study {study.name}"))
    return Section("provenance", "How to repeat all of it", blocks)


def _runs_table(studies: Iterable[StoredStudy]) -> Table:
    rows = []
    total = 0.0
    for study in studies:
        seconds = computing_seconds(study.results)
        total += seconds
        dates = sorted(str(result.record["started"])[:10] for result in study.results)
        when = DASH if not dates else dates[0]
        if dates and dates[-1] != dates[0]:
            when += f" to {dates[-1]}"
        rows.append(cells(study.name, study.title, len(study.results), when, as_time(seconds)))
    rows.append(cells("all", "", sum(int(row[2].text) for row in rows), "", as_time(total)))
    return Table(
        "Runs",
        ("study", "title", "cases", "run on", "computing time"),
        rows,
        (
            "Computing time: wall time of LAMMPS times its ranks; measuring is not in it. A case "
            "that is in several studies is run once, and its time stands in each of them.",
        ),
    )


def as_time(seconds: float) -> str:
    """Write a time in hours, minutes or seconds."""
    if seconds >= 3600:
        return f"{seconds / 3600:.1f} h"
    return f"{seconds / 60:.1f} min" if seconds >= 60 else f"{seconds:.0f} s"


def _not_stated_table(results: Sequence[Result]) -> Table:
    rows = [
        cells("gravity g", "length/time²", _values(_gravity(result) for result in results)),
    ]
    for name, meaning, unit in NOT_STATED:
        found = [result.variables[name] for result in results if name in result.variables]
        if found:
            rows.append(cells(f"{meaning} ({name})", unit, _values(found)))
    return Table(
        "What the paper does not state: our values",
        ("what", "unit", "values in these results"),
        rows,
        (
            "Lengths are in widths of the container, and the spheres have density 1. A free fall "
            "from the top takes about one unit of time. The paper does not state computing times "
            "either.",
        ),
    )


def _gravity(result: Result) -> float | None:
    for stage in result.record["stages"]:
        found = _GRAVITY.search(stage["text"])
        if found is not None:
            try:
                return float(found.group(1))
            except ValueError:  # a formula
                return None
    return None


def _values(values: Iterable[object]) -> str:
    known = dict.fromkeys(value for value in values if value is not None)
    numbers = sorted(float(v) for v in known if isinstance(v, int | float))
    return ", ".join(as_short(value) for value in numbers) or DASH


def _versions_table(results: Sequence[Result]) -> Table:
    found: dict[str, dict[str, None]] = {}
    for result in results:
        for package, version in result.record["versions"].items():
            found.setdefault(package, {})[str(version)] = None
    rows = [cells(package, ", ".join(versions)) for package, versions in found.items()]
    return Table("Versions that made and measured the packings", ("package", "version"), rows)


def _decks(results: Sequence[Result]) -> list[Listing]:
    """Return the decks that were run, each version once."""
    decks: dict[tuple[str, str], int] = {}
    for result in results:
        for stage in result.record["stages"]:
            key = stage["deck"], stage["text"]
            decks[key] = decks.get(key, 0) + 1
    return [
        Listing(text.strip(), f"Deck {name}.in, of {count} run{'' if count == 1 else 's'}")
        for (name, text), count in decks.items()
    ]
