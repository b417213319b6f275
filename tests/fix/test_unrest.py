"""How far a scene is from rest: what the fix says of it, beside closed forms.

f_contact[16] is the rms speed / that of the velocities that forces from outside give in a step,
f_contact[17] the sum of all forces / the sum of those from outside.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.bodies import body_scene, dimer, placed
from tests.helpers.lammps_run import Runner
from tests.helpers.scenes import scene

RADIUS, EPS = 0.05, 1e-5
THERMO = "step f_contact[16] f_contact[17]"
SPEED, NET = "f_contact[16]", "f_contact[17]"
SETTINGS: dict[str, Any] = {"tolerance": EPS, "thermo": THERMO, "skin": 0.1}
# Eight digits of thermo output.
DIGITS = 1e-7


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_falls_has_the_speed_of_its_steps(lmp: Runner, tmp_path: Path, ranks: int) -> None:
    """After n steps from rest it is n g h, and nothing carries the weight; half falls: 1/sqrt 2."""
    falling = scene([[0.2, 0.8, 0.5]], RADIUS, tmp_path, **SETTINGS)
    result = lmp(falling + "run 20\n", ranks=ranks)
    assert result.thermo[SPEED] == pytest.approx(np.arange(21), abs=20 * DIGITS)
    assert result.thermo[NET] == pytest.approx(np.ones(21), abs=DIGITS)
    points = [[0.2, 0.8, 0.5], [0.7, RADIUS, 0.5]]
    half = scene(points, RADIUS, tmp_path, **SETTINGS)
    result = lmp(half + "run 20\n", ranks=ranks)
    assert result.thermo[SPEED] == pytest.approx(np.arange(21) / np.sqrt(2), abs=20 * DIGITS)
    # To the accuracy of the sphere on the floor.
    assert result.thermo[NET] == pytest.approx(np.full(21, 0.5), abs=1e-3)
    assert "NOT AT REST: rms speed 14.1 g h, net force 0.5 of the weight" in result.screen


@pytest.mark.parametrize("ranks", [1, 2])
def test_what_lies_is_at_rest(lmp: Runner, tmp_path: Path, ranks: int) -> None:
    """A sphere, or a dimer, on the floor: no speed, and the floor carries the weight."""
    lying = scene([[0.5, RADIUS, 0.5]], RADIUS, tmp_path, **SETTINGS)
    body = placed(2 * RADIUS * dimer(1.8), [0.5, RADIUS, 0.5])
    settings = {**SETTINGS, "skin": None}
    lying_dimer = body_scene(body, RADIUS, tmp_path / "dimer", inertia="solid", **settings)
    for deck, folder in ((lying, "."), (lying_dimer, "dimer")):
        result = lmp(deck + "run 20\n", ranks=ranks, into=folder)
        # To the accuracy of a step, a thousandth.
        assert result.thermo[SPEED][1:].max() < 1e-3
        assert result.thermo[NET][1:].max() < 1e-3
        assert "at its end the scene is at rest: rms speed " in result.screen


def test_without_forces_there_is_nothing_to_compare_with(lmp: Runner, tmp_path: Path) -> None:
    """Spheres that drift in empty space: no word, and zeros."""
    deck = scene(
        [[0.3, 0.5, 0.5]], RADIUS, tmp_path, velocities=[0.1, 0, 0], gravity=False, **SETTINGS
    )
    result = lmp(deck + "run 5\n")
    assert not re.search("at its end the scene is", result.screen)
    assert not result.thermo[SPEED].any()
    assert not result.thermo[NET].any()


@pytest.mark.parametrize("deck", ["spheres", "dimers", "clusters"])
def test_a_deck_warns_at_its_end(lmp: Runner, deck: str) -> None:
    """A bed that is stopped while it falls says so in its last lines; one that rests does not."""
    text = (Path(__file__).parents[2] / "inputs" / f"{deck}.in").read_text()
    few = {"particles": 30, "diameter": 0.2}
    stopped = {"steps_agitated": 30, "steps_settling": 0, "steps_resting": 0, "steps_measuring": 1}
    warning = "WARNING: NOT AT REST: rms speed "
    moving = lmp(text, variables={**few, **stopped, "steps_tightening": 0})
    assert [line for line in moving.warnings if line.startswith(warning)]
    resting = lmp(text, variables={**few, "seed": 2})
    assert not [line for line in resting.warnings if line.startswith(warning)]
