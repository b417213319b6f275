"""The stored results are of an earlier fix: today's must make the same runs, to the last bit."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from lammps_inelastic.workflow.provenance import code
from lammps_inelastic.workflow.same_runs import FILE, as_good_as_todays
from tests import building
from tests.benchmark.earlier import check_out
from tests.pouring import FEW_STEPS, NO_STEPS, run_deck, shipped_deck

pytestmark = pytest.mark.validation

RESULTS = Path(__file__).parents[2] / "results"
SIZE: dict[str, object] = {"particles": 1000, "diameter": 0.11}
# What the studies vary: deck -> variables.
POURED: dict[str, tuple[str, dict[str, object]]] = {
    "spheres": ("spheres", {}),
    "spheres, loose": ("spheres", {"tolerance": 0.005}),
    "spheres, no force": ("spheres", {"random_force": 0}),
    "spheres, uzawa": ("spheres", {"tolerance": 0.005, "solver": "uzawa", "steps_agitated": 30}),
    "dimers": ("dimers", {"aspect_ratio": 1.5, "random_force": 200}),
    "dimers, nearly spheres": ("dimers", {"aspect_ratio": 1.01, "tolerance_agitated": 0.005}),
}


@pytest.fixture(scope="module")
def earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the plugin of the commit that made the results."""
    content = tomllib.loads((RESULTS / FILE).read_text())
    if code()["sources"] == content["made_by"]:
        # There is no other fix to compare with: after a release whose results are all run again.
        pytest.skip("the results are of this fix")
    assert content["made_by"] in as_good_as_todays(RESULTS)
    folder = tmp_path_factory.mktemp("earlier")
    check_out(content["commit"], folder / "sources")
    return building.plugin(folder / "sources", folder / "build")


def dumps(folder: Path) -> dict[str, bytes]:
    found = {path.name: path.read_bytes() for path in folder.glob("*.lammpsdump")}
    assert found
    return found


@pytest.mark.parametrize("scene", POURED)
def test_poured_packings_are_the_same(scene: str, earlier: Path, tmp_path: Path) -> None:
    deck, variables = POURED[scene]
    all_variables = {**SIZE, **FEW_STEPS, **variables}
    for name, plugin in (("then", earlier), ("now", None)):
        run_deck(tmp_path / name, shipped_deck(deck), all_variables, plugin)
    assert dumps(tmp_path / "then") == dumps(tmp_path / "now")


@pytest.mark.parametrize("particle", ["spheres", "dimers"])
def test_packings_that_settle_and_respond_are_the_same(
    particle: str, earlier: Path, tmp_path: Path
) -> None:
    run_deck(tmp_path / "start", shipped_deck(particle), {**SIZE, **NO_STEPS})
    common = {"packing": str(tmp_path / "start" / "packing.restart"), "diameter": SIZE["diameter"]}
    settling = {**common, "particle": particle, "time_settling": 1.2}
    response = {**common, "change": "tilt", "angle": 20, "steps_changing": 60}
    for name, plugin in (("then", earlier), ("now", None)):
        run_deck(tmp_path / name / "settling", shipped_deck("settling"), settling, plugin)
        if particle == "spheres":
            run_deck(tmp_path / name / "response", shipped_deck("response"), response, plugin)
    for deck in ("settling", "response") if particle == "spheres" else ("settling",):
        assert dumps(tmp_path / "then" / deck) == dumps(tmp_path / "now" / deck)
