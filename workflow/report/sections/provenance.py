"""How the numbers of a report were made, and how to make them again."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...decks import gravity_of
from ...provenance.finished import MEASURED_BY
from ...provenance.run_record import version_in
from ...results.store import Result, StoredStudy
from ...shipped import QUICK_FOLDER, STUDIES_FOLDER
from ...shipped import STUDIES as OF_THE_PAPER
from ..blocks import Block, Listing, Section, Table, Text, nothing_run
from ..columns import Column, table
from ..data import Data
from ..statistics import computing_seconds
from ..text import DASH, as_runs, as_short, as_time

# The paper does not state these variables of the decks: name, meaning, unit.
NOT_STATED = (
    ("dt", "time step h", "time"),
    ("random_force", "largest random acceleration, per direction", "length/time²"),
    ("drag", "drag per mass, after the random force", "1/time"),
    ("steps_agitated", "steps with random force", "steps"),
    ("steps_settling", "steps with drag", "steps"),
    ("dt_resting", "time step at rest, with drag", "time"),
    ("steps_resting", "steps at rest", "steps"),
    ("dt_measuring", "time step while contacts are counted", "time"),
    ("tolerance_measuring", "ε / r while contacts are counted", "1"),
)


def commands(data: Data, names: Iterable[str]) -> list[str]:
    """Return the commands that make the parts of some studies in a report, each once."""
    lines: dict[str, None] = {}
    for name in names:
        study = data.studies.get(name)
        lines |= dict.fromkeys(_commands_of_shipped(name) if study is None else commands_of(study))
    return list(lines)


def commands_of(study: StoredStudy) -> list[str]:
    """Return the commands that make one study's part of a report; the first one runs it."""
    # The runs of a tradeoff have the command that asks for them in the place of a study file.
    if study.text.startswith("inelastic "):
        return [f"{study.text} --out DIR", "inelastic report DIR/tradeoff.h5"]
    if _is_shipped(study, STUDIES_FOLDER):
        return _commands_of_shipped(study.name)
    if _is_shipped(study, QUICK_FOLDER):
        return ["inelastic reproduce --quick --out DIR"]
    file = shlex.quote(f"{study.name}.toml")
    return [f"inelastic run {file} --out DIR", _reported(study.name)]


def _commands_of_shipped(name: str) -> list[str]:
    return [f"inelastic run {name} --out DIR", _reported(name)]


def _reported(name: str) -> str:
    return f"inelastic report DIR/{shlex.quote(f'{name}.h5')}"


def _is_shipped(study: StoredStudy, folder: Path) -> bool:
    path = folder / f"{study.name}.toml"
    return path.is_file() and path.read_text(encoding="utf-8") == study.text


def codes_line(results: Sequence[Result]) -> str:
    """Say which versions of the code made the packings, and whether they are of one code."""
    if not results:
        return ""
    made = Counter(version_in(result.record) for result in results)
    sources = {result.record.get("code", {}).get("sources") for result in results}
    if len(made) == 1:
        return f"All packings are of version {next(iter(made))}."
    versions = ", ".join(f"{version} ({count})" for version, count in made.most_common())
    # Version 0.1 did not note the code.
    if len(sources) == 1 and None not in sources:
        return f"The packings are of several versions, all with the same fix: {versions}."
    return f"The packings are of several versions of the fix: {versions}."


def provenance_section(data: Data, files: Sequence[str]) -> Section:
    """Return the section on what was run when, with what; of the paper also what it leaves open.

    Parameters
    ----------
    data : what the files hold
    files : names of the files
    """
    blocks: list[Block] = []
    results = [result for study in data.studies.values() for result in study.results]
    if data.studies:
        blocks.append(_runs_table(data.studies.values()))
        blocks.append(
            Listing("\n".join(commands(data, data.studies)), "The commands of all studies")
        )
    else:
        blocks.append(nothing_run())
    blocks.append(
        Text(f"Everything in this report is drawn from these files alone: {', '.join(files)}.")
    )
    if results:
        if any(name in data.studies for name in OF_THE_PAPER):
            blocks.append(_not_stated_table(results))
        blocks += [_versions_table(results), *_decks(results)]
    blocks += [
        Listing(study.text.strip(), f"Study {study.name}") for study in data.studies.values()
    ]
    return Section("provenance", "How to repeat all of it", blocks)


@dataclass(frozen=True)
class _StudyRuns:
    """The runs of one study, or of all.

    Attributes
    ----------
    study, title : of the study
    cases : number of cases
    dates : first and last day, or one of both, or none
    seconds : computing time
    """

    study: str
    title: str
    cases: int
    dates: str
    seconds: float


RUNS_COLUMNS: Sequence[Column[_StudyRuns]] = (
    Column("study", lambda runs: runs.study),
    Column("title", lambda runs: runs.title),
    Column("cases", lambda runs: runs.cases),
    Column("run on", lambda runs: runs.dates),
    Column("computing time", lambda runs: as_time(runs.seconds)),
)


def _runs_table(studies: Iterable[StoredStudy]) -> Table:
    rows = [
        _StudyRuns(
            study.name,
            study.title,
            len(study.results),
            _dates(study.results),
            computing_seconds(study.results),
        )
        for study in studies
    ]
    total = sum((row.seconds for row in rows), 0.0)
    return table(
        "Runs",
        RUNS_COLUMNS,
        [*rows, _StudyRuns("all", "", sum(row.cases for row in rows), "", total)],
        (
            "Computing time: wall time of LAMMPS times its ranks; measuring is not in it. A case "
            "that is in several studies is run once, and its time stands in each of them.",
        ),
    )


def _dates(results: Sequence[Result]) -> str:
    days = sorted(str(result.record["started"])[:10] for result in results)
    if not days:
        return DASH
    return days[0] if days[-1] == days[0] else f"{days[0]} to {days[-1]}"


@dataclass(frozen=True)
class _NotStated:
    """A quantity that the paper does not state, and its values in some results."""

    what: str
    unit: str
    values: Sequence[float]


NOT_STATED_COLUMNS: Sequence[Column[_NotStated]] = (
    Column("what", lambda one: one.what),
    Column("unit", lambda one: one.unit),
    Column("values in these results", lambda one: ", ".join(map(as_short, one.values)) or DASH),
)


def _not_stated_table(results: Sequence[Result]) -> Table:
    gravity = [found for result in results if (found := _gravity(result)) is not None]
    rows = [_NotStated("gravity g", "length/time²", sorted(set(gravity)))]
    for name, meaning, unit in NOT_STATED:
        known = [result.variables[name] for result in results if name in result.variables]
        if known:
            values = sorted({float(value) for value in known if isinstance(value, int | float)})
            rows.append(_NotStated(f"{meaning} ({name})", unit, values))
    return table(
        "What the paper does not state: our values",
        NOT_STATED_COLUMNS,
        rows,
        (
            "Lengths are in widths of the container, and the spheres have density 1. A free fall "
            "from the top takes about one unit of time. The paper does not state computing times "
            "either.",
        ),
    )


def _gravity(result: Result) -> float | None:
    """Return the gravity that the first of a result's decks sets that sets one; None if none does.

    A formula is not taken for a number.
    """
    found = (gravity_of(stage["text"]) for stage in result.record["stages"])
    return next((gravity for gravity in found if gravity is not None), None)


@dataclass(frozen=True)
class _Package:
    """A package and its versions in some results."""

    name: str
    versions: Iterable[str]


VERSIONS_COLUMNS: Sequence[Column[_Package]] = (
    Column("package", lambda package: package.name),
    Column("version", lambda package: ", ".join(package.versions)),
)


def _versions_table(results: Sequence[Result]) -> Table:
    found: dict[str, dict[str, None]] = {}
    for result in results:
        for package, version in result.record["versions"].items():
            found.setdefault(package, {})[str(version)] = None
        for what, name in (("plugin", "plugin (SHA-256)"), ("compiler", "compiler")):
            if what in result.record.get("code", {}):
                found.setdefault(name, {})[result.record["code"][what]] = None
        if MEASURED_BY in result.record:
            found.setdefault(MEASURED_BY, {})[result.record[MEASURED_BY]] = None
    return table(
        "Versions that made and measured the packings",
        VERSIONS_COLUMNS,
        [_Package(name, versions) for name, versions in found.items()],
    )


def _decks(results: Sequence[Result]) -> list[Listing]:
    """Return the decks that were run, each version once."""
    decks: dict[tuple[str, str], int] = {}
    for result in results:
        for stage in result.record["stages"]:
            key = stage["deck"], stage["text"]
            decks[key] = decks.get(key, 0) + 1
    return [
        Listing(text.strip(), f"Deck {name}.in, of {as_runs(count)}")
        for (name, text), count in decks.items()
    ]
