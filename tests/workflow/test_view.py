"""What `inelastic look` and studies put into the page of a packing, and the report with it."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lammps_inelastic.analysis import Cell, ParticleDump, ParticleFrame
from lammps_inelastic.workflow.looking import look
from lammps_inelastic.workflow.looking.view import (
    KnownContacts,
    packing_values,
    page_of_values,
    view_of,
)
from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.report import all_sections, read_data, render
from lammps_inelastic.workflow.results.store import (
    Result,
    StoredStudy,
    read_result,
    write_result,
    write_studies,
)
from lammps_inelastic.workflow.study import Outputs
from tests.helpers.few_spheres import TINY
from tests.helpers.view_page import array_of, packing_in
from tests.helpers.written_dumps import frame_text

# Two dimers: one lies along x, on the floor, the other stands on it, and moves.
COLUMNS = "id mol type x y z vx vy vz radius"
SPHERES = [
    [1, 1, 1, 0.3, 0.1, 0.5, 0, 0, 0, 0.1],
    [2, 1, 1, 0.4, 0.1, 0.5, 0, 0, 0, 0.1],
    [5, 4, 1, 0.3, 0.3, 0.5, 0.3, 0, 0, 0.1],
    [9, 4, 1, 0.3, 0.4, 0.5, 0.3, 0.8, 0, 0.1],
]
CONTACTS = [
    [1, -3, 0.3, 0.0, 0.5, 0, 1, 0, 0, 3],
    [5, 1, 0.3, 0.2, 0.5, 0, 1, 0, 0, 2],
    [2, -3, 0.4, 0.0, 0.5, 0, 1, 0, 0, 1],
]
BOX = ["--box", "0", "1", "0", "1", "0", "1", "--points", "1000"]


@pytest.fixture
def run(tmp_path: Path) -> Path:
    folder = tmp_path / "two dimers"
    folder.mkdir()
    text = frame_text("ATOMS", 7, COLUMNS, SPHERES, None)
    (folder / "particles.lammpsdump").write_text(text)
    columns = "id1 id2 x y z nx ny nz gap force"
    text = frame_text("ENTRIES", 7, columns, CONTACTS, None)
    (folder / "contacts.lammpsdump").write_text(text)
    return folder


def numbers_in(packing: dict[str, Any]) -> dict[str, list[float]]:
    return {one["name"]: array_of(one).tolist() for one in packing["numbers"]}


def test_look_writes_the_page(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["look", str(run), *BOX]) == 0
    said = capsys.readouterr().out
    page = run / "packing.html"
    assert f"page                 {page} (" in said
    packing = packing_in(page)
    assert packing["title"] == "two dimers"
    assert packing["caption"].startswith("2 bodies, step 7, packing fraction 0.0")
    assert array_of(packing["ids"]).tolist() == [1, 2, 5, 9]
    assert array_of(packing["particle"]).tolist() == [1, 1, 4, 4]
    numbers = numbers_in(packing)
    # Numbers of a dimer are those of both of its spheres: the second moves by 0.3 and 0.4.
    assert numbers["contacts"] == [1, 1, 1, 1]
    assert numbers["sum of forces"] == pytest.approx([6, 6, 2, 2])
    assert numbers["speed"] == pytest.approx([0, 0, 0.5, 0.5])
    assert numbers["orientation: 1 stands, 0 lies"] == pytest.approx([0, 0, 1, 1])
    # The contact between spheres comes first, then those with the floor.
    assert packing["walls"] == 2
    forces = array_of(packing["forces"]) * packing["meanForce"]
    np.testing.assert_allclose(forces, [2, 3, 1], rtol=1e-6)
    low, high = np.array(packing["range"]).T
    ends = low + (high - low) * array_of(packing["lines"]).reshape(-1, 2, 3) / 65535
    places = np.array(packing["centre"]) + packing["scale"] * ends
    wanted = [
        [[0.3, 0.3, 0.5], [0.3, 0.1, 0.5]],
        [[0.3, 0.1, 0.5], [0.3, 0.0, 0.5]],
        [[0.4, 0.1, 0.5], [0.4, 0.0, 0.5]],
    ]
    np.testing.assert_allclose(places, wanted, atol=1e-5)


@pytest.mark.parametrize(
    ("options", "drawn"), [([], (1, 1)), (["--no-page"], (1, 0)), (["--no-picture"], (0, 0))]
)
def test_what_look_draws(
    run: Path, options: list[str], drawn: tuple[int, int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["look", str(run), *BOX, *options, "--json"]) == 0
    files = json.loads(capsys.readouterr().out)["files"]
    names = ("packing.png", "packing.html")
    for key, name, there in zip(("picture", "page"), names, drawn, strict=True):
        assert (run / name).exists() == bool(there)
        assert files[key] == (str(run / name) if there else None)


def test_contacts_by_distance_have_no_forces(run: Path) -> None:
    (run / "contacts.lammpsdump").unlink()
    assert main(["look", str(run), *BOX, "--contact-gap", "0.01"]) == 0
    packing = packing_in(run / "packing.html")
    assert packing["forces"] is None
    assert numbers_in(packing)["contacts"] == [1, 1, 1, 1]
    assert len(array_of(packing["lines"])) == 6 * (1 + packing["walls"])


def test_of_too_many_spheres_there_is_no_page(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(look, "MOST_SPHERES", 3)
    assert main(["look", str(run), *BOX]) == 0
    said = capsys.readouterr().out
    assert "page                 none" in said
    assert "no packing.html: it has at most 3 spheres" in said
    assert (run / "packing.png").exists()
    assert not (run / "packing.html").exists()


def test_a_page_that_cannot_be_written_is_told_behind_the_numbers(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (run / "packing.html").mkdir()
    assert main(["look", str(run), *BOX]) != 0
    output = capsys.readouterr()
    assert "packing fraction" in output.out
    assert output.err.count("\n") == 1
    assert "packing.html: cannot be written: Is a directory" in output.err


def periodic_frame() -> ParticleFrame:
    """Two spheres that touch through the faces of a tilted cell."""
    return ParticleFrame(
        3,
        np.array([1, 2]),
        np.array([[0.1, 0.5, 0.5], [0.95, 0.5, 0.5]]),
        None,
        np.array([0.1, 0.05]),
        None,
        Cell([0, 0, 0], np.array([[1, 0, 0], [0.3, 1, 0], [0, 0, 1]]), (True, False, False)),
        None,
    )


TOUCHING = KnownContacts(np.array([[1, 2]]), np.array([[0.0, 0.5, 0.5]]), np.array([1.5]))


def test_a_contact_through_a_periodic_face_leads_to_the_image() -> None:
    view = view_of(periodic_frame(), TOUCHING, "title", "caption")
    ((one, other),) = np.asarray(view.contacts)
    assert np.linalg.norm(other - one) == pytest.approx(0.15)


def test_a_result_keeps_a_packing(tmp_path: Path, run: Path) -> None:
    """Written and read again it makes the same page."""
    for frame, contacts in (
        (periodic_frame(), TOUCHING),
        (
            ParticleDump(run / "particles.lammpsdump")[0],
            KnownContacts(
                np.array(CONTACTS)[:, :2].astype(np.int64), np.array(CONTACTS)[:, 2:5], None
            ),
        ),
    ):
        values = packing_values(frame, contacts)
        write_result(tmp_path / "one.h5", Result(values, {}, {"case": "one"}, "{}"))
        read = read_result(tmp_path / "one.h5").values
        assert read.keys() == values.keys()
        page = page_of_values(values, "one", 0.6)
        assert page_of_values(read, "one", 0.6) == page
        assert "packing fraction 0.6000" in page


def test_without_packing_a_study_measures_what_it_did() -> None:
    """Results of before there was this key are still those of their studies."""
    assert "packing" not in json.loads(Outputs().measured)
    assert json.loads(Outputs(packing=True).measured)["packing"]


def report_of(folder: Path, spheres: int) -> Path:
    """Write the report of a study of two cases that keep packings of so many spheres."""
    random = np.random.default_rng(1)
    frame = ParticleFrame(
        824,
        np.arange(1, spheres + 1),
        random.random((spheres, 3)),
        None,
        np.full(spheres, 0.05),
        None,
        Cell.of_box([[0, 1]] * 3),
        ("ff", "ff", "ff"),
    )
    none = KnownContacts(np.zeros((0, 2), dtype=np.int64), np.zeros((0, 3)), np.zeros(0))
    values = {**packing_values(frame, none), "numbers/packing_fraction": np.array(0.61)}
    results = []
    for seed in (1, 2):
        variables = {"seed": seed}
        stage = {"deck": "own", "folder": ".", "text": "", "values": {}, "variables": variables}
        record = {
            "case": f"own_seed={seed}",
            "deck": "own",
            "stages": [stage],
            "commands": [],
            "ranks": 1,
            "started": "2026-01-02T03:04:05+00:00",
            "wall_seconds": 1.0,
            "versions": {"python": "3.11", "lammps": "2025"},
        }
        results.append(Result(values, {}, record, "{}"))
    path = folder / "own.h5"
    write_studies(path, [StoredStudy("own", "Own", "title = 'x'\n", results)])
    data = read_data([path])
    page = folder / "report.html"
    page.write_text(render(data, all_sections(data, [path.name])))
    return page


def test_a_report_shows_one_packing_of_a_study(tmp_path: Path) -> None:
    text = report_of(tmp_path, 300).read_text()
    assert text.count("<iframe") == 1
    assert "The packing of own_seed=1, to turn and to look into" in text
    text = report_of(tmp_path, 20_001).read_text()
    assert text.count("<iframe") == 0
    assert "Packings of more than 20,000 spheres are in the HDF5 file alone." in text


@pytest.mark.slow
def test_a_packing_in_a_report_is_drawn_when_it_is_unfolded(browser: Any, tmp_path: Path) -> None:
    page = browser.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: errors.append(message.text))
    page.goto(report_of(tmp_path, 300).as_uri())
    page.locator("details.packing summary").click()
    frame = page.frame_locator("details.packing iframe")
    frame.locator("canvas[data-state='at rest']").wait_for()
    caption = frame.locator("#caption").text_content()
    assert caption == "300 spheres, step 824, packing fraction 0.6100"
    # What was folded had no size when it began: now it is large, and the packing fills its height.
    inner = page.locator("details.packing iframe")
    image = Image.open(io.BytesIO(inner.screenshot())).convert("HSV")
    colourful = np.asarray(image)[:, 300:, 1] > 80
    assert colourful.shape[1] > 500
    assert np.ptp(np.nonzero(colourful)[0]) > 0.5 * len(colourful)
    assert errors == []
    page.close()


@pytest.mark.slow
def test_a_study_that_keeps_its_packing(tmp_path: Path) -> None:
    """From the deck to the report: thirty spheres, each with its contacts."""
    (tmp_path / "few.toml").write_text(TINY.replace("{seeds}", "1") + "packing = true\n")
    out = tmp_path / "out"
    assert main(["run", str(tmp_path / "few.toml"), "--out", str(out)]) == 0
    (result,) = (out / "results" / "few").glob("*.h5")
    values = read_result(result).values
    assert values["packing/positions"].shape == (30, 3)
    assert len(values["packing/contact_ids"]) == len(values["packing/contact_forces"]) > 10
    assert main(["report", str(out / "few.h5"), "--out", str(tmp_path / "report.html")]) == 0
    assert (tmp_path / "report.html").read_text().count("<iframe") == 1
