"""`inelastic report` on made-up results whose numbers have a known outcome."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from PIL import Image

from lammps_inelastic.analysis import InputError
from lammps_inelastic.analysis.plots import (
    STYLES,
    draw_dimer,
    draw_dimer_section,
    plot_distribution,
    plot_wall_profile,
)
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.report.blocks import Block, Cell, Section, Table, Text
from lammps_inelastic.workflow.report.columns import Column, table
from lammps_inelastic.workflow.report.contents import all_sections
from lammps_inelastic.workflow.report.data import Data, paper_numbers, profile, read_data
from lammps_inelastic.workflow.report.figures import Figure, Panel, curve
from lammps_inelastic.workflow.report.markdown import render_markdown
from lammps_inelastic.workflow.report.page import MOST_ROWS, render, side_by_side, summarise
from lammps_inelastic.workflow.report.sections.any_study import study_section
from lammps_inelastic.workflow.report.sections.checks import checks
from lammps_inelastic.workflow.report.sections.dimer_orientation import ratio_apart
from lammps_inelastic.workflow.report.statistics import (
    Stated,
)
from lammps_inelastic.workflow.report.text import (
    as_short,
    as_span,
    as_stated,
    as_text,
    as_value,
)
from lammps_inelastic.workflow.report.verdict import TOPICS, verdict
from lammps_inelastic.workflow.results.store import Result, StoredStudy, write_studies
from lammps_inelastic.workflow.shipped import QUICK_FOLDER, STUDIES, STUDIES_FOLDER

ANCHORS = {
    "summary",
    "figure-4",
    "figure-5",
    "table-1",
    "counting",
    "agitated",
    "table-2",
    *(f"figure-{number}" for number in range(6, 15)),
    "anisotropy",
    "dimers-agitation",
    "dimers-soft",
    "reference",
    "repose",
    "structure",
    "forces",
    "response",
    "protocol",
    "checks",
    "provenance",
}
# Elements without an end.
VOID = {"meta", "img", "br", "hr", "link", "input"}


def png(colour: str = "red") -> bytes:
    buffer = io.BytesIO()
    image = Image.new("RGB", (40, 30), "white")
    image.paste(colour, (15, 10, 25, 20))
    image.save(buffer, format="PNG")
    return buffer.getvalue()


def result(
    deck: str = "spheres",
    pictures: Sequence[str] = (),
    before: Result | None = None,
    wall_seconds: float = 30.0,
    **given: Any,
) -> Result:
    """Return a result; names of schema.py with a slash as __ are values, others variables."""
    values = {
        name.replace("__", "/"): np.asarray(value, dtype=float)
        for name, value in given.items()
        if "__" in name
    }
    variables = {
        "particles": 1000,
        "diameter": 0.11,
        "tolerance": 0.0005,
        "dt": 0.01,
        "random_force": 30.0,
        "drag": 0.5,
        "seed": 1,
        "steps_agitated": 400,
        "steps_settling": 800,
    } | {name: value for name, value in given.items() if "__" not in name}
    values.setdefault("numbers/resolution", np.asarray(0.005))
    words = "_".join(f"{name}={value}" for name, value in variables.items())
    record = {
        "case": f"{deck}_{hashlib.sha256(words.encode()).hexdigest()[:8]}",
        "deck": deck,
        "fingerprint": "0",
        "stages": [
            {
                "deck": deck,
                "text": f"# deck {deck}\nvariable gravity equal 9.81\n",
                "folder": ".",
                "values": {},
                "variables": variables,
            }
        ],
        "commands": [],
        "ranks": 2,
        "started": "2026-01-02T03:04:05+00:00",
        "wall_seconds": wall_seconds,
        "versions": {"python": "3.11", "lammps": "2025"},
    }
    return Result(values, {name: png() for name in pictures}, record, "{}", before)


def measured(phi: float = 0.63, z: float = 6.0, **given: Any) -> Result:
    """Return a result with some of everything in it."""
    distance = np.linspace(0.5, 9.5, 10) * 0.1
    diameter = given.get("diameter", 0.11)
    shares = np.zeros(13)
    shares[5:8] = 0.25, 0.5, 0.25
    aspect = given.get("aspect_ratio", 0.0)
    ratio = {"numbers__a_x": 1.08, "numbers__a_y": 0.8, "numbers__a_z": 1.09} if aspect else {}
    return result(
        **{
            "numbers__packing_fraction": phi,
            "numbers__coordination_number": z,
            "numbers__coordination_number_agitated": z - 0.4,
            "numbers__neighbours": z - 1 if aspect else z,
            "numbers__particles_in_box": 100,
            "numbers__largest_overlap_of_all_steps": 0.0004,
            "numbers__rattlers": 0.02,
            "numbers__fabric_x": 0.34,
            "numbers__fabric_y": 0.33,
            "numbers__fabric_z": 0.33,
            "numbers__q4": 0.14,
            "numbers__q6": 0.4,
            "numbers__crystalline": 0.01,
            "distribution__contacts": shares,
            "distribution__neighbours": shares,
            "profile__distance": distance * diameter,
            "profile__packing_fraction": 0.6 + 0.1 * np.cos(distance),
            "structure__distance": distance * diameter,
            "structure__radial_distribution": distance,
            "forces__ratio": distance,
            "forces__density": np.exp(-distance),
            "evolution__step": np.arange(0, 1300, 100),
            "evolution__packing_fraction": np.where(np.arange(13) < 3, 0.3, phi),
            "evolution__coordination_number": np.where(np.arange(13) < 3, np.nan, z),
            "evolution__centre_height": np.linspace(1, 0.5, 13),
        }
        | ({f"{name}_error": 0.01 for name in ratio} | {"numbers__a_isotropic": 1.0} | ratio)
        | given
    )


def study(
    name: str, results: list[Result], title: str | None = None, text: str = "title = 'x'\n"
) -> StoredStudy:
    return StoredStudy(name, title or f"Study {name}", text, results)


def whole_paper() -> list[StoredStudy]:
    """Return all studies of the paper, in miniature."""
    table_1 = [
        measured(phi=phi, tolerance=tolerance, random_force=force, seed=seed)
        for tolerance, force in ((0.005, 30.0), (0.0005, 30.0), (0.0005, 0.0), (0.00005, 30.0))
        for seed, phi in enumerate((0.62, 0.63, 0.64), 1)
    ]
    more_seeds = [
        measured(phi=0.632 + 0.001 * (seed % 5), random_force=force, seed=seed)
        for force in (30.0, 0.0)
        for seed in range(1, 7)
    ]
    more_seeds += [measured(phi=0.5, tolerance=0.005, seed=seed) for seed in range(1, 7)]
    counting = [
        measured(z=z, tolerance=0.005, seed=seed, solver=solver, dt_resting=step, dt_measuring=step)
        for solver, step, z in (("sweeps", 0.01, 6.2), ("sweeps", 0.02, 6.4), ("uzawa", 0.01, 6.3))
        for seed in (1, 2, 3)
    ]
    table_2 = [measured(seed=seed) for seed in (1, 2)]
    table_2 += [measured(particles=10_000, diameter=0.052, seed=seed) for seed in (1, 2)]
    table_2.append(measured(particles=100_000, diameter=0.024, tolerance=0.005))
    falling = ("00000000", "00000100", "00000200", "00001270")
    dimers = [measured(seed=seed) for seed in (1, 2)] + [
        measured(
            phi=0.71 - (aspect - 1.45) ** 2 + 0.0002 * seed,
            z=9.9,
            deck="dimers",
            aspect_ratio=aspect,
            random_force=force,
            seed=seed,
        )
        for force in (30.0, 200.0)
        for aspect in (1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 1.95)
        for seed in (-1, 1)
    ]
    shaken = [
        measured(deck="dimers", aspect_ratio=1.8, random_force=force, start=start, seed=seed)
        for start in ("random", "regular")
        for force in (0, 30.0, 200.0)
        for seed in (1, 2)
    ]
    response = [
        measured(deck="spheres+response", change="walls", pictures=falling, before=measured()),
        measured(deck="spheres+response", change="tilt", angle=20, before=measured(z=6.1)),
    ]
    soft = [
        measured(phi=phi, deck="dimers+settling", aspect_ratio=aspect, contacts=contacts, seed=seed)
        for contacts in ("hard", "soft")
        for aspect, phi in ((1.2, 0.68), (1.4, 0.7), (1.6, 0.69))
        for seed in (1, 2)
    ]
    tilted = [
        measured(
            deck="spheres+response",
            change="tilt",
            angle=angle,
            seed=seed,
            numbers__centre_x=0.5 + angle / 2000,
            numbers__centre_y=0.5,
        )
        for angle in (4, 12, 20)
        for seed in (1, 2)
    ]
    sizes = np.geomspace(1e-4, 0.1, 10)
    kinds: list[dict[str, Any]] = [{}, {"deck": "dimers", "aspect_ratio": 1.5}]
    reference = [
        measured(
            seed=seed,
            numbers__excess_contacts=0.5 + 0.1 * seed,
            numbers__gap_exponent=-0.41,
            numbers__weak_force_exponent=0.15,
            gaps__size=sizes,
            layers__height=np.arange(10) + 0.5,
            layers__coordination_number=np.full(10, 6.0),
            gaps__density=sizes**-0.4,
            forces__local_ratio=sizes,
            forces__local_density=sizes**0.2,
            **other,
        )
        for other in kinds
        for seed in (1, 2)
    ]
    protocol = [
        measured(phi=phi, z=phi * 10, seed=seed, **other)
        for other in ({}, {"random_force": 10.0}, {"drag": 1.0}, {"dt": 0.005})
        for seed, phi in enumerate((0.62, 0.63, 0.64), 1)
    ]
    return [
        study("table-1", table_1),
        study("more-seeds", more_seeds),
        study("counting", counting),
        study("table-2", table_2),
        study("figure-4", [measured(pictures=falling)]),
        study("figure-8", [measured(pictures=("network",))]),
        study("dimers", dimers),
        study("figure-10", [measured(deck="dimers", aspect_ratio=1.5, pictures=falling)]),
        study("dimers-agitation", shaken),
        study("dimers-soft", soft),
        study("response", response),
        study("repose", tilted),
        study("reference", reference),
        study("protocol", protocol),
    ]


def own_study() -> StoredStudy:
    return study(
        "friction",
        [
            measured(phi=0.6 + 0.01 * size, particles=1000 * size, seed=seed, pictures=("network",))
            for size in (1, 2, 3)
            for seed in (1, 2)
        ],
        title="Size & shape",
    )


class Page(HTMLParser):
    """What a page links to and shows; fails where its elements do not match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str | None] = []
        self.links: list[str | None] = []
        self.sources: list[str | None] = []
        self.opened: list[str] = []
        self.text = ""
        # The style sheet; of each table, listing and figure its own rule's name and its parents'.
        self.text_of_style = ""
        # The text of each folded part, and whether it is open.
        self.folded: list[tuple[str, bool]] = []
        self._folds: list[int] = []
        self.wide: list[list[str]] = []
        self._names: list[list[str]] = []
        self.feed(text)
        self.close()
        assert self.opened == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        names = [tag, *(f".{word}" for word in (values.get("class") or "").split())]
        if tag not in VOID:
            self.opened.append(tag)
            self._names.append(names)
        if tag in {"table", "pre"} or ".plot" in names:
            self.wide.append([name for names in self._names[-2:] for name in names])
        assert tag not in {"script", "link", "iframe", "object"}
        if tag == "details":
            self._folds.append(len(self.folded))
            self.folded.append(("", "open" in values))
        if "id" in values:
            self.ids.append(values["id"])
        if "href" in values:
            self.links.append(values["href"])
        if "src" in values:
            assert values["alt"]
            self.sources.append(values["src"])

    def handle_endtag(self, tag: str) -> None:
        assert self.opened.pop() == tag
        if tag == "details":
            self._folds.pop()
        self._names.pop()

    def handle_data(self, data: str) -> None:
        if self.opened[-1:] != ["style"]:
            self.text += data
            for number in self._folds:
                text, is_open = self.folded[number]
                self.folded[number] = (text + data, is_open)
        else:
            self.text_of_style += data
            # Nothing is loaded from anywhere.
            assert "url(" not in data
            assert "@import" not in data


def write(path: Path, *studies: StoredStudy) -> Path:
    write_studies(path, studies)
    return path


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Page:
    """Return the page of all studies and one more."""
    folder = tmp_path_factory.mktemp("report")
    file = write(folder / "all.h5", *whole_paper(), own_study())
    assert main(["report", str(file), "--out", str(folder / "r.html")]) == 0
    return Page((folder / "r.html").read_text(encoding="utf-8"))


def sections_of(*studies: StoredStudy) -> dict[str, Section]:
    """Return the sections of a report by their anchors."""
    data = Data({one.name: one for one in studies}, paper_numbers())
    return {section.anchor: section for section in all_sections(data, ["all.h5"])}


@pytest.fixture(scope="module")
def sections() -> dict[str, Section]:
    return sections_of(*whole_paper(), own_study())


def rows_of(section: Section, name: str) -> list[dict[str, Any]]:
    """Return what the CSV file of a figure holds, as dictionaries."""
    (figure,) = (b for b in section.blocks if isinstance(b, Figure) and b.name == name)
    head, *rows = figure.rows()
    return [dict(zip(head, row, strict=True)) for row in rows]


def test_every_section_is_there_and_in_the_contents(page: Page) -> None:
    wanted = ANCHORS | {"study-friction"}
    assert wanted <= set(page.ids)
    assert {f"#{anchor}" for anchor in wanted} <= set(page.links)
    assert len(page.ids) == len(set(page.ids))
    assert "not run yet" not in page.text.lower()


def test_nothing_is_loaded_from_elsewhere(page: Page) -> None:
    assert all(link.startswith("#") for link in page.links)
    assert all(source.startswith("data:image/") for source in page.sources)
    assert {link[1:] for link in page.links} <= set(page.ids)


def test_pictures_can_be_decoded(page: Page) -> None:
    kinds = {"svg+xml": 0, "png": 0}
    for source in page.sources:
        head, data = source.split(",", 1)
        kind = head.removeprefix("data:image/").removesuffix(";base64")
        kinds[kind] += 1
        content = base64.b64decode(data, validate=True)
        if kind == "png":
            Image.open(io.BytesIO(content)).verify()
        else:
            assert b"</svg>" in content
    # Three series of four pictures, the network, and a network each of the own study's cases.
    assert kinds["png"] == 3 * 4 + 1 + 3
    assert kinds["svg+xml"] >= 15


def test_words_of_a_study_do_not_become_elements(page: Page) -> None:
    assert "Size & shape (friction)" in page.text


def test_how_to_repeat_is_said(page: Page) -> None:
    assert "inelastic run table-1.toml --out DIR" in page.text
    assert "inelastic run friction.toml --out DIR" in page.text
    assert "inelastic report DIR/friction.h5" in page.text
    assert "2026-01-02" in page.text
    assert "# deck dimers" in page.text


def test_computing_time_counts_ranks(page: Page) -> None:
    # 12 cases of 30 s with two ranks.
    assert "12.0 min" in page.text


def test_what_the_paper_does_not_state(page: Page) -> None:
    for word in ("9.81", "largest random acceleration, per direction (random_force)", "drag per"):
        assert word in page.text


def test_each_figure_as_pdf_png_and_csv(tmp_path: Path) -> None:
    wanted = ("figure-8", "protocol")
    file = write(tmp_path / "a.h5", *(one for one in whole_paper() if one.name in wanted))
    figures = tmp_path / "figures"
    arguments = ["--out", str(tmp_path / "r.html"), "--figures", str(figures)]
    assert main(["report", str(file), *arguments]) == 0
    names = {path.stem for path in figures.iterdir()}
    assert names == {*wanted, "figure-9"}
    for name in names:
        assert (figures / f"{name}.pdf").read_bytes().startswith(b"%PDF")
        Image.open(figures / f"{name}.png").verify()
    # Figure 9 is a drawing: it has no numbers.
    assert not (figures / "figure-9.csv").exists()
    with (figures / "protocol.csv").open(encoding="utf-8", newline="") as lines:
        first = next(csv.DictReader(lines))
    assert first["protocol"] == "standard"
    assert float(first["packing fraction"]) == pytest.approx(0.63, rel=1e-9)  # round-off
    # The network's white margins are gone: what is red, and ten pixels around it.
    assert Image.open(figures / "figure-8.png").size == (30, 30)


def test_numbers_of_a_figure(sections: dict[str, Section]) -> None:
    rows = rows_of(sections["figure-11"], "figure-11")
    raw = {float(row["aspect ratio L/d"]): row for row in rows if row["curve"] == "raw, force 30"}
    assert list(raw) == [1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 1.95]
    assert float(raw[1.5]["packing fraction [%]"]) == pytest.approx(70.75, rel=1e-12)  # round-off
    # 16 pairs of runs that are 0.04 % apart, and one of spheres whose two are the same.
    error = float(raw[1.5]["standard error of packing fraction [%]"])
    assert error == pytest.approx(0.02 * math.sqrt(16 / 17), rel=1e-9)  # round-off


def test_evolution_has_both_panels_in_one_file(sections: dict[str, Section]) -> None:
    rows = rows_of(sections["figure-5"], "figure-5")
    # Two runs of 13 frames, twice: packing fraction, and contacts, not known in three frames.
    assert len(rows) == 4 * 13
    assert sum(row["packing fraction"] != "" for row in rows) == 2 * 13
    assert sum(row["coordination number"] != "" for row in rows) == 2 * 10


def test_every_row_has_a_cell_for_each_column(sections: dict[str, Section]) -> None:
    for section in sections.values():
        for block in section.blocks:
            if isinstance(block, Table):
                assert {len(row) for row in block.rows} == {len(block.head)}, block.caption


def test_comparison_with_a_series(sections: dict[str, Section]) -> None:
    first = sections["table-1"].comparisons[0]
    # 62, 63 and 64 %: standard deviation 1, standard error 1 / sqrt(3); the paper's 63.39 and
    # 0.41 / 3.
    wanted = (63 - 63.39) / math.sqrt(1 / 3 + (0.41 / 3) ** 2)
    assert first.difference.in_errors == pytest.approx(wanted, rel=1e-9)  # round-off
    assert not first.difference.is_significant
    assert first.note == "3 runs, not 9"


def test_large_difference_is_marked() -> None:
    runs = [measured(z=z, seed=seed) for seed, z in enumerate((6.9, 7.0, 7.1), 1)]
    summary = summarise(list(sections_of(study("table-1", runs)).values()))
    # Packing fraction and z.
    assert (summary.compared, summary.significant, summary.remaining) == (2, 1, 1)
    phi, z = (row[4] for row in summary.numbers.rows)
    assert not phi.marked
    # (7 - 5.97) / sqrt(0.01 / 3 + (0.12 / 3)^2) = 14.7
    assert (z.text, z.marked) == ("+14.7", True)


def test_why_is_said_of_large_differences_alone() -> None:
    runs = [
        measured(phi=phi, z=5.97, seed=seed) for seed, phi in enumerate((0.62, 0.6322, 0.644), 1)
    ]
    far = [measured(phi=0.7 + 0.001 * seed, z=5.97, seed=seed) for seed in (1, 2, 3)]
    for group, said in ((runs, False), (far, True)):
        summary = summarise(list(sections_of(study("table-1", group)).values()))
        phi, z = (row[7].text for row in summary.numbers.rows)
        assert ("more seeds" in phi) == said
        assert "solver" not in z


def table_1(z: float, tolerance: float = 0.0005) -> list[Result]:
    """Return three runs of a row of Table 1 with the paper's packing fraction at 0.0005 r."""
    return [
        measured(phi=0.6322 + 0.001 * more, z=z + 0.05 * more, tolerance=tolerance, seed=2 + more)
        for more in (-1, 0, 1)
    ]


def test_the_verdict_says_what_agrees_and_within_what() -> None:
    found = verdict(list(sections_of(study("table-1", table_1(5.99))).values()))
    # The paper has 63.22 % and 5.97.
    assert found.text.startswith("Yes: packing fraction (within 0 percentage points), contacts (")
    assert "within 0.02)" in found.text
    assert found.text.endswith(" agree with the paper.")
    assert found.exceptions == []


def test_the_verdict_says_what_differs_by_how_much() -> None:
    found = verdict(list(sections_of(study("table-1", table_1(6.97))).values()))
    assert found.text.startswith("In part: packing fraction")
    assert found.text.endswith(" agree with the paper. Ours differs in contacts.")
    assert found.exceptions == ["contacts: at ε = 0.0005 r, 1 above the paper's 5.97"]
    # At the loosest tolerance the way to count is known to matter.
    loose = verdict(list(sections_of(study("table-1", table_1(6.68, 0.005))).values()))
    (line,) = loose.exceptions
    assert line.startswith("contacts: at ε = 0.005 r, 0.5 above the paper's 6.18; at a loose ε")


def test_the_verdict_has_a_line_for_each_sentence_that_does_not_hold(
    sections: dict[str, Section],
) -> None:
    found = verdict(list(sections.values()))
    broken = [
        one for section in sections.values() for one in section.statements if one.holds is False
    ]
    assert len(found.exceptions) >= len(broken) > 0
    for one in broken:
        assert any((one.otherwise or one.text) in line for line in found.exceptions), one.text
    # Every line names what it is about, and so does the verdict.
    named = {line.partition(":")[0] for line in found.exceptions}
    assert named <= set(TOPICS)
    assert all(name in found.text.lower() for name in named)


def test_the_verdict_of_nothing_is_not_known() -> None:
    found = verdict(list(sections_of(own_study()).values()))
    assert found.text.startswith("Not known")
    assert found.exceptions == []


def test_the_verdict_is_the_first_thing_on_the_page(
    page: Page, sections: dict[str, Section]
) -> None:
    text = " ".join(page.text.split())
    said = verdict(list(sections.values())).text
    assert said in text
    assert text.index(said) < text.index("Contents") < text.index("The paper's numbers and ours")


def test_contents_are_closed_and_long_tables_folded(
    page: Page, sections: dict[str, Section]
) -> None:
    contents = [is_open for text, is_open in page.folded if text.split()[:1] == ["Contents"]]
    assert contents == [False]
    tables = [
        block
        for section in sections.values()
        for block in section.blocks
        if isinstance(block, Table)
    ]
    starts = [" ".join(text.split()) for text, _ in page.folded]
    for block in tables:
        title = f"{block.caption}: {len(block.rows)} rows"
        assert any(text.startswith(title) for text in starts) == (len(block.rows) > MOST_ROWS)
    assert any(len(block.rows) > MOST_ROWS for block in tables)


def test_a_plot_stands_beside_what_belongs_to_it() -> None:
    narrow, other, wide = (
        Figure(name, "", [Panel("x", "y", [curve("a", [0], [1])])] * panels)
        for name, panels in (("narrow", 1), ("other", 1), ("wide", 2))
    )
    text, rows = Text("words"), table("table", [Column("number", str)], [1, 2])
    blocks: list[Block] = [text, narrow, rows, text, wide, rows, narrow, other, text]
    assert side_by_side(blocks) == [
        [text],
        [narrow, rows, text],
        [wide],
        [rows],
        [narrow, other, text],
    ]


def test_the_papers_points_are_in_the_figures(sections: dict[str, Section]) -> None:
    drawn = {
        float(row["number of spheres"]): float(row["packing fraction [%]"])
        for row in rows_of(sections["table-2"], "table-2")
        if row["curve"] == "paper"
    }
    # The last column of the paper's Table 2, with the decimals that Table 1 has for 1,000 spheres.
    assert drawn == {1000: 63.22, 10_000: 63.6, 100_000: 63.7}
    z = [
        float(row["coordination number"])
        for row in rows_of(sections["table-1"], "table-1")
        if row["curve"] == "paper, random force" and row.get("coordination number")
    ]
    # The miniature has more seeds at two tolerances.
    assert sorted(z) == [5.97, 6.18]
    lying = [
        row for row in rows_of(sections["anisotropy"], "anisotropy") if "paper" in row["curve"]
    ]
    assert {float(row["aspect ratio L/d"]) for row in lying} == {1.8}
    assert {round(float(row["a / isotropic a"]), 3) for row in lying} == {1.083, 0.796, 1.092}


def statements_of(section: Section) -> dict[str, bool | None]:
    return {one.text: one.holds for one in section.statements}


def test_the_sentences_of_the_paper_hold_or_do_not(sections: dict[str, Section]) -> None:
    """In the miniature of its studies, in which each is decided by numbers of a few lines above."""
    # 10,000 and 100,000 spheres have the same packing fraction, of one run.
    assert list(statements_of(sections["table-2"]).values()) == [None]
    # 0.4 contacts fewer with every force, always the same: there is no scatter to judge it by.
    assert list(statements_of(sections["agitated"]).values()) == [None]
    # All runs of 13 frames are at rest from the fourth on.
    assert list(statements_of(sections["figure-5"]).values()) == [True, True]
    contacts = statements_of(sections["figure-13"])
    # 9.9 contacts, 8.9 neighbours.
    assert list(contacts.values()) == [True, True]
    assert all("10" in text for text in contacts)
    # 6 is the most frequent number of all particles; a dimer's should be 10.
    assert list(statements_of(sections["figure-7"]).values()) == [True, True]
    shares = statements_of(sections["figure-14"])
    assert shares["The most probable number of contacts is 10."] is False
    # Largest at 1.45; no necks.
    assert list(statements_of(sections["figure-11"]).values()) == [True, None]
    lying = statements_of(sections["anisotropy"])
    # Two runs that agree exactly have the scatter that their number of dimers leaves.
    assert lying["a_y is smaller: dimers lie down."] is True
    # a_y is 0.8 at each aspect ratio.
    assert lying["They lie down more the longer they are."] is None


def test_a_curve_that_goes_on_growing_is_no_peak() -> None:
    runs = [
        measured(phi=0.6 + 0.1 * aspect, deck="dimers", aspect_ratio=aspect, random_force=30.0)
        for aspect in (1.1, 1.3, 1.5, 1.7, 1.9)
    ]
    section = sections_of(study("dimers", runs))["figure-11"]
    assert section.statements[0].holds is False
    # Where nothing longer than 1.5 has been run, nothing is known.
    shorter = [
        measured(phi=0.6 + 0.1 * aspect, deck="dimers", aspect_ratio=aspect, random_force=30.0)
        for aspect in (1.1, 1.2, 1.3, 1.4, 1.5)
    ]
    section = sections_of(study("dimers", shorter))["figure-11"]
    assert section.statements[0].holds is None


def test_the_summary_counts_sentences(sections: dict[str, Section]) -> None:
    summary = summarise(list(sections.values()))
    said = [one.holds for section in sections.values() for one in section.statements]
    assert (summary.held, summary.told) == (said.count(True), len(said) - said.count(None))
    assert len(summary.statements.rows) == len(said)
    verdicts = [row[1] for row in summary.statements.rows]
    assert [cell.marked for cell in verdicts] == [holds is False for holds in said]


def test_the_surface_of_a_tilted_bed(sections: dict[str, Section]) -> None:
    """Its slope and height are those whose centre of mass the runs have."""
    rows = rows_of(sections["repose"], "repose")
    bed = {float(row["gravity tilted by [°]"]): row for row in rows if row["curve"] == "bed"}
    slope = math.tan(math.radians(float(bed[4.0]["surface turned by [°]"])))
    # y = height + slope (x - 0.5), integrated over x and below the surface.
    x = np.linspace(0, 1, 10_001)
    surface = slope / (12 * 0.002) + slope * (x - 0.5)
    # The sums are off by 1e-8.
    assert (x * surface).sum() / surface.sum() == pytest.approx(0.502, rel=1e-6)
    assert (surface**2 / 2).sum() / surface.sum() == pytest.approx(0.5, rel=1e-6)


def test_why_contacts_at_a_loose_tolerance_differ() -> None:
    """By runs counted otherwise: with one time step in all phases, and at a tight tolerance."""
    steps = {"dt": 0.01, "dt_resting": 0.02, "dt_measuring": 0.1}
    steps |= {"tolerance": 0.005, "tolerance_measuring": 0.005}
    of_deck = [measured(z=7 + 0.01 * seed, seed=seed, **steps) for seed in (1, 2, 3)]
    of_one_step = [
        measured(z=6.17 + 0.005 * seed, seed=seed, **steps | {n: 0.01 for n in list(steps)[:3]})
        for seed in (1, 2, 3)
    ]
    tight = measured(z=6.02, **steps | {"tolerance_measuring": 1e-5})
    sections = sections_of(study("table-1", of_deck), study("counting", [*of_one_step, tight]))
    z = next(one for one in sections["table-1"].comparisons if one.what.startswith("z, ε = 0.005"))
    assert z.difference.is_significant
    # 6.18 of both; the paper has 6.18.
    assert "the packings counted at 0.00001 r have 6.02" in z.why
    assert "with one time step throughout (0.01) it is 6.18 ± 0.00" in z.why
    table = sections["counting"].blocks[0]
    assert isinstance(table, Table)
    assert [[cell.text for cell in row][:5] for row in table.rows] == [
        ["0.01", "0.02", "0.1", "0.00001", "sweeps"],
        ["0.01", "0.01", "0.01", "0.005", "sweeps"],
        ["0.01", "0.02", "0.1", "0.005", "sweeps"],
    ]


def test_scatter_is_no_difference_of_wall_profiles() -> None:
    """Two runs of each size, 0.04 apart all along: their means differ, but by no more than that."""

    def shifted(by: float, **of_size: Any) -> Result:
        one = measured(**of_size)
        one.values["profile/packing_fraction"] = one.values["profile/packing_fraction"] + by
        return one

    def verdict(of_large: tuple[float, float]) -> bool | None:
        large = {"particles": 10_000, "diameter": 0.052}
        runs = [shifted(by, seed=seed) for seed, by in enumerate((-0.02, 0.02))]
        runs += [shifted(by, seed=seed, **large) for seed, by in enumerate(of_large)]
        return statements_of(sections_of(study("table-2", runs))["figure-6"])[
            "The packing fraction oscillates near a wall, and the curves of several diameters "
            "collapse."
        ]

    assert verdict((-0.01, 0.03)) is True
    assert verdict((0.08, 0.12)) is False


def test_dimers_have_too_many_contacts_only_beyond_their_error() -> None:
    def verdict(*z: float) -> bool | None:
        runs = [
            measured(z=value, deck="dimers", aspect_ratio=1.1, random_force=30.0, seed=seed)
            for seed, value in enumerate(z)
        ]
        section = sections_of(study("dimers", runs))["figure-13"]
        return next(iter(statements_of(section).values()))

    assert verdict(10.20, 10.22) is True
    assert verdict(10.3, 10.3) is False


def test_runs_that_reach_no_plateau_take_longest() -> None:
    """Without force the runs that come to rest are the faster ones, but half of them do not."""
    moving = np.where(np.arange(13) < 12, np.linspace(0.62, 0.66, 13), 0.65)

    def run(force: float, seed: int, rests: bool) -> Result:
        seconds = np.arange(13) * (1.0 if force else 0.8) * (1 + 0.01 * seed)
        given: dict[str, Any] = {"evolution__seconds": seconds, "evolution__time": np.arange(13.0)}
        given |= {} if rests else {"evolution__packing_fraction": moving}
        return measured(random_force=force, seed=seed, **given)

    runs = [run(30.0, seed, rests=True) for seed in range(1, 9)]
    runs += [run(0.0, seed, rests=seed == 1) for seed in range(1, 9)]
    section = sections_of(study("table-2", [measured(particles=10_000)]), study("more-seeds", runs))
    (said,) = (one for one in section["figure-5"].statements if "computing time" in one.text)
    assert said.holds is True
    assert "(8 of 8 runs reach it) with, not reached (1 of 8 runs reach it)" in said.evidence


def test_medians_of_an_even_number_of_runs() -> None:
    """The mean of the two middle ones; one that is not reached is longer than all others."""
    moving = np.where(np.arange(13) < 12, np.linspace(0.62, 0.66, 13), 0.65)

    def run(force: float, seed: int) -> Result:
        frames = np.arange(13.0)
        given: dict[str, Any] = {"evolution__seconds": frames, "evolution__time": frames * seed}
        given |= {} if force or seed < 3 else {"evolution__packing_fraction": moving}
        return measured(random_force=force, seed=seed, **given)

    runs = [run(force, seed) for force in (30.0, 0.0) for seed in (1, 2, 3, 4)]
    section = sections_of(study("table-2", [measured(particles=10_000)]), study("more-seeds", runs))
    table = section["figure-5"].blocks[-1]
    assert isinstance(table, Table)
    # The plateau begins with the fourth frame.
    assert [row[3].text for row in table.rows] == [
        "not reached (3.00 to not reached)",
        "7.50 (3.00 to 9.00)",
    ]


def test_runs_of_one_start_are_compared_in_pairs() -> None:
    """Starts differ by far more than the force changes, which is seen in pairs alone."""
    runs = [
        measured(phi=0.6 + 0.01 * seed + more, random_force=force, seed=seed)
        for seed in range(1, 7)
        for force, more in ((30.0, 0.001 + 0.0001 * (seed % 3)), (0.0, 0.0))
    ]
    # What is of another tolerance is no part of a pair.
    runs += [measured(phi=0.5, tolerance=0.005, seed=seed) for seed in range(1, 7)]
    found = statements_of(sections_of(study("more-seeds", runs))["table-1"])
    denser, same = found.values()
    assert denser is True
    assert same is True
    runs = [
        measured(z=6 + 0.1 * seed + more * (1 + 0.01 * seed), random_force=force, seed=seed)
        for seed in range(1, 7)
        for force, more in ((30.0, 0.3), (0.0, 0.0))
    ]
    # 0.3 is more than the paper's errors leave.
    assert (
        list(statements_of(sections_of(study("more-seeds", runs))["table-1"]).values())[1] is False
    )


def test_contacts_are_compared_at_the_tolerance_of_each_packing() -> None:
    steps = {"dt": 0.01, "dt_resting": 0.02, "dt_measuring": 0.1}

    def of(z: float, tolerance: float, counted: float) -> list[Result]:
        given = {"tolerance": tolerance, "tolerance_measuring": counted, **steps}
        return [measured(z=z + 0.01 * seed, seed=seed, **given) for seed in (1, 2, 3)]

    def verdict(z: float) -> bool | None:
        loose, tight = of(6.4, 0.005, 0.005), of(6.0, 5e-5, 1e-5)
        table = [*loose, *of(6.0, 5e-4, 1e-5), *tight]
        counting = [*of(z, 5e-4, 5e-4), *of(6.0, 5e-5, 5e-5)]
        section = sections_of(study("table-1", table), study("counting", counting))["table-1"]
        (said,) = (one for one in section.statements if "is needed" in one.text)
        return said.holds

    assert verdict(6.005) is True
    assert verdict(6.3) is False


def test_a_scatter_does_not_make_an_effect_negligible() -> None:
    """Runs that differ much from one another cannot tell that the tolerance has none."""

    def verdict(scatter: float, shift: float) -> bool | None:
        runs = [
            measured(tolerance=one, seed=seed, phi=0.632 + shift * k + scatter * (seed - 2))
            for k, one in enumerate((5e-5, 5e-4, 5e-3))
            for seed in (1, 2, 3)
        ]
        section = sections_of(study("table-1", runs))["table-1"]
        (said,) = (one for one in section.statements if "negligible" in one.text)
        return said.holds

    assert verdict(0.0002, 0.0) is True
    assert verdict(0.02, 0.0) is None
    assert verdict(0.0002, 0.01) is False


def test_dimers_that_remember_how_they_started() -> None:
    def verdict(more: float) -> bool | None:
        part = {0.0: -0.6, 30.0: more}
        runs = [
            measured(
                deck="dimers",
                aspect_ratio=1.8,
                random_force=force,
                start=start,
                seed=seed,
                numbers__a_y=0.8 + 0.001 * seed + (part[force] if start == "regular" else 0.0),
            )
            for force in (0.0, 30.0)
            for start in ("random", "regular")
            for seed in (1, 2, 3)
        ]
        section = sections_of(study("dimers-agitation", runs))["dimers-agitation"]
        return next(iter(statements_of(section).values()))

    # Up to a fifth of 0.6 counts as none, beyond the scatter that the number of dimers leaves.
    assert verdict(-0.01) is True
    assert verdict(-0.5) is False


def test_more_seeds_are_compared_as_well() -> None:
    section = sections_of(*whole_paper())["table-1"]
    what = "ε = 0.0005 r, with random force, 6 seeds"
    more = next(one for one in section.comparisons if what in one.what)
    # Seeds 1 to 6 of 0.632 + 0.001 (seed mod 5): 0.001 x 11 / 6 above.
    assert more.ours.mean == pytest.approx(63.2 + 1.1 / 6, rel=1e-12)  # round-off


def test_table_2_has_the_scatter_of_table_1(sections: dict[str, Section]) -> None:
    whats = {one.what: one for one in sections["table-2"].comparisons}
    assert whats["φ, 1,000 spheres"].stated.error == pytest.approx(0.44 / 3, rel=1e-12)  # round-off
    assert math.isnan(whats["φ, 10,000 spheres"].stated.error)


def test_orientation_of_runs_that_agree_by_chance() -> None:
    runs = [measured(deck="dimers", aspect_ratio=1.8, seed=seed) for seed in (1, 2)]
    x = sections_of(study("dimers", runs))["anisotropy"].comparisons[0]
    # The runs have the same a_x; 0.01 is what the number of dimers leaves of each.
    assert x.ours.error == pytest.approx(0.01 / math.sqrt(2), rel=1e-12)  # round-off
    assert x.stated.error == 0.01


def test_components_of_the_same_dimers_are_not_independent() -> None:
    """Of 300 runs of isotropic dimers a_x and a_z differ in as many as the level of a test says."""
    draw = np.random.default_rng(1)
    false = 0
    for _ in range(300):
        along = draw.normal(size=(400, 3))
        squares = (along / np.linalg.norm(along, axis=1)[:, None]) ** 2
        a = np.sqrt(squares.mean(axis=0))
        errors = squares.std(axis=0, ddof=1) / 20 / (2 * a)
        named = {f"numbers__a_{axis}": value for axis, value in zip("xyz", a, strict=True)}
        named |= {f"numbers__a_{axis}_error": e for axis, e in zip("xyz", errors, strict=True)}
        run = measured(deck="dimers", aspect_ratio=1.8, **named, numbers__a_isotropic=3**-0.5)
        false += ratio_apart([run], "x", "z").p < 0.05
    # 15 of 300, four binomial standard deviations of 3.8; as independent ones it would be 33.
    assert abs(false - 15) < 15


def test_overlap_is_compared_with_the_loosest_tolerance() -> None:
    runs = [measured(tolerance_agitated=0.005, numbers__largest_overlap_of_all_steps=0.004)]
    (table,) = sections_of(study("table-1", runs))["checks"].blocks
    assert [cell.text for cell in table.rows[0][3:6]] == ["0.005", "0.004", "0.800"]
    assert not table.rows[0][5].marked


@pytest.mark.parametrize(
    ("deck", "bodies", "marked"),
    [
        ("spheres", False, True),
        ("spheres+settling", False, True),
        ("spheres+gluey", False, True),
        ("dimers+settling", True, False),
        ("clusters", True, False),
        # Its walls may be curved.
        ("own", False, False),
    ],
)
def test_free_spheres_at_flat_walls_overlap_by_one_tolerance(
    deck: str, bodies: bool, marked: bool
) -> None:
    run = measured(
        deck=deck,
        numbers__particles=1000,
        numbers__spheres=2000 if bodies else 1000,
        numbers__largest_overlap_of_all_steps=1.5 * 0.0005,
    )
    (stage,) = run.record["stages"]
    run.record["stages"][:] = [{**stage, "deck": name} for name in deck.split("+")]
    (table,) = sections_of(study("table-1", [run]))["checks"].blocks
    assert isinstance(table, Table)
    assert [table.rows[0][5].text, table.rows[0][5].marked] == ["1.500", marked]


def test_results_of_an_older_deck_group_with_newer_ones(tmp_path: Path) -> None:
    old = measured(seed=1)
    new = measured(seed=2, solver="apgd", tolerance_measuring=0.00001)
    data = read_data([write(tmp_path / "a.h5", study("own", [old, new]))])
    first, second = (result.variables for result in data.studies["own"].results)
    assert first["solver"] == "apgd"
    assert first | {"seed": 2} == second


@pytest.mark.slow
@pytest.mark.parametrize("value", [None, "word"])
def test_other_decks_under_the_names_of_the_paper(value: str | None) -> None:
    """Their parameters are not ours, or words: no number stands for them."""
    one = measured(deck="own", numbers__particles=1000)
    (stage,) = one.record["stages"]
    variables = {name: value for name in stage["variables"] if value is not None}
    own = replace(one, record={**one.record, "stages": [{**stage, "variables": variables}]})
    data = Data({name: study(name, [own]) for name in STUDIES}, paper_numbers())
    page = Page(render(data, all_sections(data, ["own.h5"])))
    assert ANCHORS - {"summary"} <= set(page.ids)
    assert not re.search(r"\bnan\b", page.text, re.IGNORECASE)


@pytest.mark.parametrize("ours", ["sweeps", "apgd"])
def test_solvers_are_not_mixed(ours: str) -> None:
    """Ours is the default of today's decks, or that of the earlier ones that made the results."""
    runs = [
        measured(z=z, tolerance=0.005, solver=solver, seed=seed)
        for solver, z in ((ours, 5.8), ("uzawa", 6.2))
        for seed in (1, 2)
    ]
    section = sections_of(study("table-1", runs))["table-1"]
    assert {one.what: one.ours.mean for one in section.comparisons if one.what[0] == "z"} == {
        "z, ε = 0.005 r, with random force": 5.8,
        "z, ε = 0.005 r, with random force, uzawa": 6.2,
    }


def test_anisotropy_is_compared_with_the_consistent_aspect_ratio(
    sections: dict[str, Section],
) -> None:
    whats = [one.what for one in sections["anisotropy"].comparisons]
    assert whats == [
        f"a_{axis} over isotropic, L/d = 1.8, random force {force}"
        for force in (30, 200)
        for axis in "xyz"
    ]
    x = sections["anisotropy"].comparisons[0]
    # 0.0260 / 0.0240
    assert x.stated.value == pytest.approx(1.0833, abs=1e-4)  # as many digits as are written
    assert x.ours.mean == 1.08


def test_table_2_takes_paper_and_ours_of_one_size(sections: dict[str, Section]) -> None:
    whats = {one.what: one for one in sections["table-2"].comparisons}
    assert whats["φ, 10,000 spheres"].ours.n == 2
    assert math.isnan(whats["φ, 100,000 spheres"].difference.in_errors)


@pytest.mark.parametrize("name", STUDIES)
def test_any_single_study_is_enough(name: str) -> None:
    (one,) = (each for each in whole_paper() if each.name == name)
    sections = sections_of(one)
    assert set(sections) == ANCHORS - {"summary"}
    assert any(section.is_missing for section in sections.values())
    shown_in = {"dimers": "figure-11", "more-seeds": "table-1"}
    assert not sections[shown_in.get(name, name)].is_missing


def test_studies_without_any_result(tmp_path: Path) -> None:
    file = write(tmp_path / "a.h5", *(study(name, []) for name in STUDIES), study("own", []))
    out = tmp_path / "r.html"
    assert main(["report", str(file), "--out", str(out)]) == 0
    page = Page(out.read_text(encoding="utf-8"))
    assert ANCHORS - {"summary"} <= set(page.ids)
    # Figure 9 and the two sections on the report itself need no runs.
    assert "To make it: inelastic run dimers.toml --out DIR" in page.text
    assert "To make it: inelastic run own.toml --out DIR" in page.text


def test_result_with_nothing_but_its_record() -> None:
    sections = sections_of(*(study(n, [result(), result(seed=2)]) for n in (*STUDIES, "own")))
    assert sections["figure-11"].blocks


def test_studies_of_similar_names_keep_their_figures(tmp_path: Path) -> None:
    """Their anchors are links, and the names of the figures' files."""
    runs = [measured(evolution=size, seed=seed) for size in (1, 2) for seed in (1, 2)]
    names = ("a_b", "a-b", "A-B", "ä", "ö")
    sections = sections_of(*(study(name, runs) for name in names))
    assert len(sections) == len(names) + 1
    figures = [b.name for one in sections.values() for b in one.blocks if isinstance(b, Figure)]
    # Against the parameter, the evolution, the contacts, the profile.
    assert len(figures) == len(set(figures)) == 4 * len(names)
    assert "study-a-b-evolution" in figures


def test_a_profile_is_in_the_diameters_with_which_it_was_measured() -> None:
    given: dict[str, Any] = {
        "profile__distance": [0.125, 0.375],
        "profile__packing_fraction": [0.5, 0.6],
    }

    def distances(one: Result) -> list[float] | None:
        found = profile(one)
        return None if found is None else found[0].tolist()

    assert distances(result(diameter=0.5, profile__diameter=0.25, **given)) == [0.5, 1.5]
    # Older results have that of their deck alone.
    assert distances(result(diameter=0.25, **given)) == [0.5, 1.5]
    assert distances(result(diameter="word", **given)) is None


def test_own_study_alone_has_no_sections_of_the_paper() -> None:
    sections = sections_of(own_study())
    assert list(sections) == ["study-friction", "provenance"]
    table = sections["study-friction"].blocks[0]
    assert [row[0].text for row in table.rows] == [
        "particles = 1,000",
        "particles = 2,000",
        "particles = 3,000",
    ]
    assert table.rows[0][1].text == "2"

    def has_gaps_of_the_paper(section: Section) -> bool:
        captions = [block.caption for block in section.blocks if isinstance(block, Table)]
        return "What the paper does not state: our values" in captions

    assert not has_gaps_of_the_paper(sections["provenance"])
    both = sections_of(own_study(), study("table-1", [measured()]))
    assert has_gaps_of_the_paper(both["provenance"])


def test_parts_of_a_study_in_several_files(tmp_path: Path) -> None:
    one = write(tmp_path / "1.h5", study("own", [measured(seed=1), measured(seed=2)]))
    other = write(tmp_path / "2.h5", study("own", [measured(seed=2), measured(seed=3)]))
    data = read_data([one, other])
    assert len(data.studies["own"].results) == 3


def test_two_studies_of_one_name_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = write(tmp_path / "1.h5", study("own", [measured()]))
    other = write(tmp_path / "2.h5", study("own", [measured()], text="title = 'y'\n"))
    assert main(["report", str(one), str(other), "--out", str(tmp_path / "r.html")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "r.html").exists()


@pytest.mark.parametrize(
    ("content", "named"), [(None, "no such file"), (b"no HDF5", "not a file of studies")]
)
def test_file_that_is_no_study_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: Any, named: str
) -> None:
    path = tmp_path / "a.h5"
    if content is not None:
        path.write_bytes(content)
    assert main(["report", str(path), "--out", str(tmp_path / "r.html")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"inelastic: {path}: {named}")
    assert error.count("\n") == 1
    assert not (tmp_path / "r.html").exists()


def test_numbers_as_text() -> None:
    assert as_text(-0.001, 2) == "0.00"
    assert as_text(-1.5, 1) == "\N{MINUS SIGN}1.5"
    assert as_text(math.nan, 2) == "\N{EN DASH}"
    assert [as_short(v) for v in (5e-05, 0.11, 12345.0, 0.0)] == ["0.00005", "0.11", "12345", "0"]
    tiny = [as_short(v).replace("\N{MINUS SIGN}", "-") for v in (5.6e-10, 2e-10, -1e-20, 1e200)]
    assert tiny == ["5.6e-10", "2e-10", "-1e-20", "1e+200"]
    assert as_short(math.inf) == as_text(math.inf, 3) == "inf"
    # No row of zeros before two digits and more; a tolerance stays as decks have it.
    small = [as_short(v).replace("\N{MINUS SIGN}", "-") for v in (5.607e-6, -2.65e-5, 1e-6, 1.2e-4)]
    assert small == ["5.6e-6", "-2.7e-5", "0.000001", "0.00012"]


def test_the_span_of_numbers_as_text() -> None:
    assert as_span([0.24, 0.218], 2) == "0.22 to 0.24"
    assert as_span([1.351, 1.349], 2) == "1.35"
    assert as_span([], 2) == ""


def test_numbers_of_the_paper_have_as_many_decimals_as_their_error() -> None:
    stated = Stated(63.7, 0.2), Stated(6, 0.05), Stated(1.0833, 0.0123), Stated(3, 0), Stated(0.5)
    assert [as_stated(one) for one in stated] == [
        "63.7 ± 0.2",
        "6.00 ± 0.05",
        "1.083 ± 0.012",
        "3 ± 0",
        "0.5",
    ]
    assert as_stated(Stated.of_series(63.39, 0.41, 9)) == "63.39 ± 0.41"


def test_a_column_has_its_heading_and_its_cells() -> None:
    columns: list[Column[float]] = [
        Column("length", lambda row: as_text(row, 1), "d"),
        Column("is long", lambda row: Cell("yes" if row > 1 else "no", marked=row > 1)),
    ]
    made = table("Lengths", columns, [0.5, 2.0])
    assert made.head == ["length [d]", "is long"]
    assert [[cell.text for cell in row] for row in made.rows] == [["0.5", "no"], ["2.0", "yes"]]
    assert [row[1].marked for row in made.rows] == [False, True]


def test_parameters_as_text() -> None:
    values = (5e-05, 0.0005, 0.11, 10_000, 2.0, "point")
    assert list(map(as_value, values)) == ["0.00005", "0.0005", "0.11", "10,000", "2", "point"]
    # All of their digits, but what round-off has added.
    assert list(map(as_value, (1e-11, 123456789012, 0.1 + 0.2, 1e-30, math.inf))) == [
        "0.00000000001",
        "123,456,789,012",
        "0.3",
        "1e-30",
        "Infinity",
    ]


def test_every_value_of_a_parameter_has_its_row() -> None:
    """Also where two of them cannot be told apart as they are written."""
    values = (1e-15, 2e-15, 0.1, 0.1 * (1 + 1e-15), 0)
    runs = [measured(force=value, seed=seed) for value in values for seed in (1, 2)]
    table = sections_of(study("own", runs))["study-own"].blocks[0]
    assert isinstance(table, Table)
    assert [row[1].text for row in table.rows] == ["2"] * len(values)


def test_paper_numbers_are_in_the_package() -> None:
    paper = paper_numbers()
    assert [row["z"]["mean"] for row in paper["table1"]] == [6.18, 5.97, 5.99, 5.93]


def axis() -> Axes:
    return Canvas().subplots()


def test_curves_differ_in_more_than_colour() -> None:
    assert len({style.line for style in STYLES}) == len(STYLES)
    assert len({style.marker for style in STYLES}) == len(STYLES)


def test_plots_return_their_axis_and_name_it() -> None:
    ax = axis()
    assert plot_wall_profile(ax, [0.5, 1.5], [0.1, 0.6], errors=[0.1, 0.1], label="a") is ax
    assert ax.get_xlabel() == "distance from the wall / d"
    ax = plot_distribution(axis(), [0, 0, 0.5, 0.5, 0, 0, 0])
    # The numbers with particles, and one on either side.
    assert ax.lines[0].get_xdata().tolist() == [1, 2, 3, 4]
    with pytest.raises(InputError):
        plot_distribution(axis(), [0, 0])


@pytest.mark.parametrize("kind", ["curve", "profile", "points", "distribution"])
def test_errors_on_a_logarithmic_axis_leave_no_wedge(kind: Any) -> None:
    """A corner at 0 or below has no place there: others would be joined across the figure."""
    y = np.array([1, 0.1, 0.01, 0.002, 0.001])
    error = np.array([0.1, 0.05, 0.01, 0.003, math.nan])
    panel = Panel("x", "y", [curve("a", np.arange(5), y, error, kind)], log=True)
    canvas = Figure("wedge", "Wedge.", [panel])._canvas
    (ax,) = canvas.axes
    (drawn,) = ax.collections
    parts = drawn.get_paths() if hasattr(drawn, "get_paths") else drawn.get_segments()
    corners = np.vstack([part.vertices for part in parts])
    corners = corners[np.isfinite(corners).all(axis=1)]
    assert (corners[:, 1] > 0).all()
    for place, value, width in zip(range(4), y, error, strict=False):
        at = corners[corners[:, 0] == place, 1]
        assert at.max() == pytest.approx(value + width)
        # Down to its end, or out of the figure.
        assert at.min() == pytest.approx(value - width) or at.min() < ax.get_ylim()[0]


def test_what_is_wider_than_the_page_scrolls_in_a_box_of_its_own(page: Page) -> None:
    style = page.text_of_style
    rules = dict(re.findall(r"^([.\w][^{}@]*?) \{([^{}]*)\}", style, re.MULTILINE))
    assert page.wide
    for parents in page.wide:
        # A table stands in a box that scrolls; what else may be wide scrolls itself.
        assert any("overflow-x: auto" in rules.get(name, "") for name in parents), parents
    assert "max-width: 100%" in rules[".pictures img"]
    assert "width: 100%" in rules[".plot img"]
    # Beside the contents a column may become narrower than what it holds.
    assert re.search(r"grid-template-columns: \w+ minmax\(0, 1fr\)", style)


def test_tables_have_the_whole_page_at_1200_pixels(page: Page) -> None:
    """Table 1 is cut off there where the contents stand beside it, at 16 pixels a rem."""
    beside = re.findall(
        r"@media \(min-width: ([\d.]+)rem\) \{\s*\.layout \{ display: grid;", page.text_of_style
    )
    assert len(beside) == page.text_of_style.count(".layout { display: grid;") == 1
    assert 16 * float(beside[0]) > 1200


def test_neck_touches_the_rolling_sphere() -> None:
    ax = draw_dimer_section(axis(), 1.8)
    upper = max(ax.patches[:2], key=lambda patch: patch.get_xy()[:, 1].max()).get_xy()
    low, high = (
        upper[np.abs(upper[:, 0]) < 0.01, 1].min(),
        upper[np.abs(upper[:, 0]) < 0.01, 1].max(),
    )
    # At the waist: up to the rolling sphere, down to where the two spheres cut each other. The
    # outline has a point every 0.007, and the section is steep there.
    assert high == pytest.approx(math.sqrt(1 - 0.16) - 0.5, abs=1e-3)
    assert low == pytest.approx(math.sqrt(0.25 - 0.16), abs=1e-2)


def test_dimer_is_as_long_as_it_is_said_to_be() -> None:
    image = draw_dimer(axis(), 1.5, pixels=400).images[0]
    seen = np.flatnonzero(image.get_array()[..., 3].max(axis=0) > 0.5)
    left, right, *_ = image.get_extent()
    # Two pixels.
    assert (seen[-1] - seen[0] + 1) * (right - left) / 400 == pytest.approx(1.5, abs=0.012)
    with pytest.raises(InputError):
        draw_dimer(axis(), 2.1)


@pytest.mark.slow
def test_the_tables_as_text(tmp_path: Path) -> None:
    """They hold the page's tables, and depend on the results alone."""
    file = write(tmp_path / "all.h5", *whole_paper())
    text = tmp_path / "texts" / "r.md"
    arguments = ["report", str(file), "--out", str(tmp_path / "r.html"), "--markdown", str(text)]
    assert main([*arguments, "--figures", str(tmp_path / "figures")]) == 0
    lines = text.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "# Does it reproduce the paper?"
    # z of 10,000 spheres: the mean of two runs, whose error is not told.
    assert any(line.startswith("| z, spheres | 6.00 ± 0.05 | 6.000 ± 0.000") for line in lines)
    assert any("does not hold" in line for line in lines)
    shown = [line for line in lines if line.startswith("![")]
    assert shown
    for line in shown:
        path = line.rpartition("](")[2].removesuffix(")")
        assert (text.parent / path).resolve().is_file(), path
    # As many cells in each row of a table as in its head.
    for above, line in itertools.pairwise(lines):
        if above.startswith("|") and line.startswith("|"):
            assert len(re.findall(r"(?<!\\)\|", above)) == len(re.findall(r"(?<!\\)\|", line))


@pytest.mark.slow
def test_the_commands_of_the_tables_are_those_of_the_page() -> None:
    """Of the paper's studies, of their quick versions, of a study of one's own, of a tradeoff."""

    def text_of(*studies: StoredStudy) -> str:
        data = Data({one.name: one for one in studies}, paper_numbers())
        sections = all_sections(data, ["all.h5"])
        text, page = render_markdown(data, sections), Page(render(data, sections)).text
        found = [line for line in text.splitlines() if line.startswith("inelastic ")]
        assert found
        assert all(line in page for line in found)
        return text

    def shipped(name: str, folder: Path) -> StoredStudy:
        text = (folder / f"{name}.toml").read_text(encoding="utf-8")
        return study(name, [measured()], text=text)

    paper = text_of(shipped("table-1", STUDIES_FOLDER))
    assert paper.startswith("# Does it reproduce the paper?")
    assert "inelastic run table-1 --out DIR\ninelastic report DIR/table-1.h5" in paper
    quick = text_of(*(shipped(name, QUICK_FOLDER) for name in ("table-1", "more-seeds")))
    assert "```sh\ninelastic reproduce --quick --out DIR\n```" in quick
    own = text_of(own_study())
    assert own.startswith("# Hard random packings: results\n")
    assert "inelastic run friction.toml --out DIR" in own
    asked = "inelastic tradeoff --particle spheres --seeds 1"
    tradeoff = text_of(study("ranks-1", [measured()], text=asked))
    assert f"{asked} --out DIR\ninelastic report DIR/tradeoff.h5" in tradeoff


@pytest.mark.parametrize("option", ["--out", "--markdown"])
@pytest.mark.parametrize("name", ["a.h5", "other.h5", "link.html"])
def test_a_page_replaces_no_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str, name: str
) -> None:
    file = write(tmp_path / "a.h5", own_study())
    write(tmp_path / "other.h5", own_study())
    (tmp_path / "link.html").symlink_to(file)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    target = tmp_path / name
    page = [] if option == "--out" else ["--out", str(tmp_path / "r.html")]
    assert main(["report", str(file), *page, option, str(target)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"inelastic: {target}: this file is an HDF5 file, and is not replaced"
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_page_and_tables_need_a_file_each(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, target = write(tmp_path / "a.h5", own_study()), str(tmp_path / "r.html")
    assert main(["report", str(file), "--out", target, "--markdown", target]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"inelastic: {target}: page and tables need a file each")


def test_a_box_that_reaches_out_of_the_bed_is_marked_and_not_drawn() -> None:
    """A packing fraction of empty space stands in the table, marked, and in no plot."""
    box = [[0.25, 0.75], [0.25, 0.75], [0.25, 0.75]]
    low = [[0.25, 0.75], [0.25, 0.5], [0.25, 0.75]]
    given: dict[int, dict[str, Any]] = {
        500: {"numbers__box_in_bed": 0.5, "bed__box": low},
        1000: {"numbers__box_in_bed": 1.0, "bed__box": box},
        2000: {"numbers__box_in_bed": 1.0, "bed__box": box},
    }
    results = [
        measured(phi=0.4 if n == 500 else 0.63, particles=n, seed=seed, **more)
        for n, more in given.items()
        for seed in (1, 2)
    ]
    # A case of before this was measured does not tell, and is drawn.
    results.append(measured(particles=3000))
    section = study_section(StoredStudy("own", "Own", "", results))
    first = next(block for block in section.blocks if isinstance(block, Table))
    assert [row[0].marked for row in first.rows] == [True, False, False, False]
    assert any("are partly of empty space" in note for note in first.notes)
    assert any("No box is known to lie inside in all runs" in note for note in first.notes)
    figures = [block for block in section.blocks if isinstance(block, Figure)]
    assert figures
    for figure in figures:
        for panel in figure.panels:
            for drawn in panel.curves:
                assert "500" not in drawn.label
                if panel.x == "particles":
                    assert list(drawn.x) == [1000, 2000, 3000]
    whole = study_section(StoredStudy("own", "Own", "", results[:-1]))
    (said,) = (n for b in whole.blocks if isinstance(b, Table) for n in b.notes if "Marked" in n)
    assert "box = [0.25, 0.75, 0.25, 0.5, 0.25, 0.75]" in said


@pytest.mark.parametrize(
    ("number", "heading", "values", "cells"),
    [
        ("box_in_bed", "box in the bed [%]", [1.0, 0.48], [("100", False), ("48", True)]),
        ("at_rest", "at rest [% of the runs]", [1, 0], [("100", False), ("NOT AT REST: 0", True)]),
    ],
)
def test_checks_show_beds_that_are_too_low_or_move(
    number: str, heading: str, values: list[float], cells: list[tuple[str, bool]]
) -> None:
    """Results of before this was measured leave the table as it was."""

    def shown(results: list[Result]) -> Table:
        content = checks(Data({"own": StoredStudy("own", "Own", "", results)}, paper_numbers()))
        (found,) = (block for block in content.blocks if isinstance(block, Table))
        return found

    assert heading not in shown([measured(particles=1000)]).head
    told = [
        measured(particles=1000 + n, **{f"numbers__{number}": value})
        for n, value in enumerate(values)
    ]
    assert heading in shown(told).head
    assert [(row[-1].text, row[-1].marked) for row in shown(told).rows] == cells
