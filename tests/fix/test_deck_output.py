"""What the shipped decks say: where a run is, what comes next, and that one is overwritten."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from pathlib import Path

import pytest

from lammps_inelastic.workflow.main import main
from lammps_inelastic.workflow.shipped import DECKS, PACK
from tests.helpers.lammps_run import Runner, run_lmp

POURED = {
    "particles": 20,
    "steps_agitated": 2,
    "steps_settling": 2,
    "steps_resting": 2,
    "waiting": 0,
    "steps_tightening": 2,
    "steps_measuring": 1,
}
SHORT: dict[str, dict[str, object]] = {
    "response": {"steps_changing": 2, "steps_tightening": 1, "steps_measuring": 1},
    "gluey": {"steps_pressed": 2, "steps_turned": 3, "dump_every": 1},
    "settling": {"time_settling": 0.05},
}
# A bed of few particles does not reach the usual measuring box.
ALL = ("--box", "0", "1", "0", "5", "0", "1", "--no-picture")


def shipped(name: str) -> str:
    return (files("lammps_inelastic.inputs") / f"{name}.in").read_text()


@pytest.fixture(scope="module")
def packing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("poured")
    run_lmp(folder, shipped("spheres"), variables=POURED)
    return folder / "out" / "packing.restart"


def variables_of(name: str, packing: Path) -> dict[str, object]:
    return {**SHORT[name], "packing": packing} if name in SHORT else {**POURED}


@pytest.mark.parametrize("name", [*DECKS, PACK])
def test_the_last_lines_name_the_files_and_the_next_command(
    name: str, packing: Path, lmp: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the screen and in the log; the files are there, and the command runs as it is printed."""
    run = lmp(shipped(name), variables={**variables_of(name, packing), "out": "mine"})
    says_where = r"^Written to mine: (.+)\nNext: inelastic (look mine.*)$"
    ((names, command),) = re.findall(says_where, run.screen, re.MULTILINE)
    assert {path.name for path in (run.folder / "mine").iterdir()} >= set(names.split(", "))
    assert {"particles.lammpsdump", "log.lammps"} <= set(names.split(", "))
    log = (run.folder / "mine" / "log.lammps").read_text().splitlines()
    assert {f"Written to mine: {names}", f"Next: inelastic {command}"} <= set(log)
    assert "overwritten" not in run.screen
    monkeypatch.chdir(run.folder)
    assert main([*command.split(), *ALL, "--json"]) == 0


def test_soft_contacts_are_looked_at_by_distance(
    packing: Path, lmp: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They leave no dump of contacts."""
    variables = {**variables_of("settling", packing), "contacts": "soft", "out": "soft"}
    run = lmp(shipped("settling"), variables=variables)
    (names,) = re.findall(r"^Written to soft: (.+)$", run.screen, re.MULTILINE)
    left = {path.name for path in (run.folder / "soft").iterdir()}
    assert set(names.split(", ")) == left
    (command,) = re.findall(r"^Next: inelastic (.+)$", run.screen, re.MULTILINE)
    monkeypatch.chdir(run.folder)
    assert main([*command.split(), *ALL, "--json"]) == 0


@pytest.mark.parametrize(
    ("name", "ranks"), [*((name, 1) for name in [*DECKS, PACK]), ("spheres", 2)]
)
def test_a_second_run_in_a_folder_says_once_that_it_overwrites_the_first(
    name: str, ranks: int, packing: Path, lmp: Runner
) -> None:
    variables = {**variables_of(name, packing), "out": "a-b_c.d+e=f@g^h:i"}
    line = f"The run in {variables['out']} is overwritten"
    assert line not in lmp(shipped(name), variables=variables).screen
    second = lmp(shipped(name), ranks=ranks, variables=variables).screen
    assert second.splitlines().count(line) == 1
    # It comes before any step.
    assert second.index(line) < second.index("Step ")


def test_a_comma_in_the_folders_name_is_refused(tmp_path: Path) -> None:
    run = run_lmp(tmp_path, shipped("spheres"), variables={**POURED, "out": "a,b"}, must_pass=False)
    (error,) = run.errors
    assert "Parameter out must be a folder for output, not a,b: its name must be without" in error
    assert not (tmp_path / "a,b").exists()


def looked_at(folder: Path, capsys: pytest.CaptureFixture[str], *options: str) -> dict[str, float]:
    """Return the numbers that the command at the end of minimal.in prints."""
    capsys.readouterr()
    assert main(["look", str(folder / "minimal"), *options, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    return {
        "particles": found["particles"],
        "phi": found["packing_fraction"]["value"],
        "z": found["coordination_number"]["mean"],
        "overlap": found["largest_pair_overlap"]["depth"],
    }


def test_the_smallest_deck_has_20_lines_and_leaves_a_packing(
    lmp: Runner, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a tenth of its spheres here, with its own tolerance."""
    deck = shipped("minimal")
    assert len(deck.splitlines()) <= 20
    assert "random 1000 1" in deck
    few = deck.replace("random 1000 1", "random 100 1")
    run = lmp(few)
    assert "Next: inelastic look minimal" in run.screen
    assert "overwritten" not in run.screen
    found = looked_at(run.folder, capsys, *ALL)
    assert found["particles"] == 100
    assert found["overlap"] <= 2.5e-6
    assert "The run in minimal is overwritten" in lmp(few).screen


@pytest.mark.slow
def test_the_smallest_deck_as_it_is(lmp: Runner, capsys: pytest.CaptureFixture[str]) -> None:
    """As dense as any packing that is poured at random, and with nearly 2 d = 6 contacts a sphere.

    Some rattlers have fewer, none has more in the mean: the packing is isostatic.
    """
    found = looked_at(lmp(shipped("minimal")).folder, capsys)
    assert found["particles"] == 1000
    assert 0.60 < found["phi"] < 0.65
    assert 5.6 < found["z"] < 6.2
    assert found["overlap"] <= 2.5e-6
