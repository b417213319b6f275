"""The stored results of the repository: what they are of, and what the documents say of them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lammps_inelastic.workflow.provenance.same_runs import same_runs
from lammps_inelastic.workflow.report import all_sections, read_data, render_markdown
from lammps_inelastic.workflow.results.store import StoredStudy, write_studies
from lammps_inelastic.workflow.running.folder import Folder
from lammps_inelastic.workflow.running.gather import adopt_results, gather_results
from lammps_inelastic.workflow.shipped import STUDIES, STUDIES_FOLDER
from lammps_inelastic.workflow.study import read_study

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "results"
TABLES = KEPT / "report.md"


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> list[StoredStudy]:
    """Return all studies with those of the stored results that fit today's decks and studies."""
    folder = Folder(tmp_path_factory.mktemp("kept"))
    found = []
    for name in STUDIES:
        study = read_study(STUDIES_FOLDER / f"{name}.toml")
        adopt_results(study, folder, KEPT, of_any_code=True)
        found.append(gather_results(study, folder, of_any_code=True))
    return found


@pytest.mark.slow
def test_every_stored_result_is_of_a_study_of_today(studies: list[StoredStudy]) -> None:
    """And of one case alone."""
    taken = [f"{study.name}/{result.case}.h5" for study in studies for result in study.results]
    assert sorted(taken) == sorted(str(path.relative_to(KEPT)) for path in KEPT.rglob("*.h5"))


@pytest.mark.slow
def test_they_are_of_fixes_with_the_same_runs_which_the_page_names(
    studies: list[StoredStudy], tmp_path: Path
) -> None:
    """Where the fix has changed since, the page says so: `reproduce --stored` takes none then."""
    codes = {
        (result.record["code"]["version"], result.record["code"]["sources"])
        for study in studies
        for result in study.results
    }
    same = same_runs(KEPT)
    page = (KEPT / "README.md").read_text()
    for version, sources in codes:
        assert same.has_fix(sources, same.made_by)
        assert f"of {version}" in page
    study = read_study(STUDIES_FOLDER / "protocol.toml")
    taken = adopt_results(study, Folder(tmp_path / "out"), KEPT)
    assert taken == len(study.cases) or "an earlier fix" in page


@pytest.mark.slow
def test_the_tables_are_drawn_from_the_results(studies: list[StoredStudy], tmp_path: Path) -> None:
    """As `inelastic report paper/paper.h5 --markdown results/report.md` writes them."""
    store = tmp_path / "paper.h5"
    write_studies(store, studies)
    data = read_data([store])
    assert render_markdown(data, all_sections(data, [store.name])) == TABLES.read_text()


def test_the_numbers_of_the_front_page_stand_in_the_tables() -> None:
    rows = re.findall(
        r"^\| .* \| (.*) \| `make report` \|$", (ROOT / "README.md").read_text(), re.M
    )
    assert len(rows) >= 3
    tables = TABLES.read_text()
    for ours in rows:
        assert ours in tables, ours
