"""Stored results of an earlier fix whose runs are those of today are the same, to the bit."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from lammps_inelastic.workflow.decks import Deck
from lammps_inelastic.workflow.provenance.run_record import code
from lammps_inelastic.workflow.provenance.same_runs import FILE
from tests.benchmark.earlier import check_out
from tests.helpers import building
from tests.helpers.pouring import FEW_STEPS, NO_STEPS, run_deck, shipped_deck

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


class Code:
    """A fix and its decks: today's, or those of the commit that made the results.

    Attributes
    ----------
    plugin : folder of the fix; None for the one that is installed
    """

    def __init__(self, plugin: Path | None, decks: Path | None) -> None:
        self.plugin = plugin
        self._decks = decks

    def run(self, folder: Path, name: str, variables: dict[str, object]) -> None:
        """Run one of the decks in a folder."""
        deck = (
            shipped_deck(name) if self._decks is None else (self._decks / f"{name}.in").read_text()
        )
        run_deck(folder, deck, variables, self.plugin)


TODAYS = Code(None, None)


@pytest.fixture(scope="module")
def earlier(tmp_path_factory: pytest.TempPathFactory) -> Code:
    """Return the fix and the decks of the commit that made the results."""
    content = tomllib.loads((RESULTS / FILE).read_text())
    if code()["sources"] == content["made_by"]:
        # There is no other fix to compare with: after a release whose results are all run again.
        pytest.skip("the results are of this fix")
    if code()["sources"] not in content["same"]:
        # They stay those of version 0.2 until the studies are run again: results/README.md.
        pytest.skip("the stored results are of an earlier fix")
    folder = tmp_path_factory.mktemp("earlier")
    check_out(content["commit"], folder / "sources")
    decks = folder / "sources" / "inputs"
    for name, fingerprints in content["decks"].items():
        text = (decks / f"{name}.in").read_text()
        assert Deck(name, text, shipped=True).fingerprint in fingerprints
    return Code(building.plugin(folder / "sources", folder / "build"), decks)


def dumps(folder: Path) -> dict[str, bytes]:
    found = {path.name: path.read_bytes() for path in folder.glob("*.lammpsdump")}
    assert found
    return found


@pytest.mark.parametrize("scene", POURED)
def test_poured_packings_are_the_same(scene: str, earlier: Code, tmp_path: Path) -> None:
    deck, variables = POURED[scene]
    for name, code_of in (("then", earlier), ("now", TODAYS)):
        code_of.run(tmp_path / name, deck, {**SIZE, **FEW_STEPS, **variables})
    assert dumps(tmp_path / "then") == dumps(tmp_path / "now")


@pytest.mark.parametrize("particle", ["spheres", "dimers"])
def test_packings_that_settle_and_respond_are_the_same(
    particle: str, earlier: Code, tmp_path: Path
) -> None:
    TODAYS.run(tmp_path / "start", particle, {**SIZE, **NO_STEPS})
    common = {"packing": str(tmp_path / "start" / "packing.restart"), "diameter": SIZE["diameter"]}
    settling = {**common, "particle": particle, "time_settling": 1.2}
    response = {**common, "change": "tilt", "angle": 20, "steps_changing": 60}
    for name, code_of in (("then", earlier), ("now", TODAYS)):
        code_of.run(tmp_path / name / "settling", "settling", settling)
        if particle == "spheres":
            code_of.run(tmp_path / name / "response", "response", response)
    for deck in ("settling", "response") if particle == "spheres" else ("settling",):
        assert dumps(tmp_path / "then" / deck) == dumps(tmp_path / "now" / deck)
