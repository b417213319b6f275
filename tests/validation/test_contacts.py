"""The contacts that the decks measure are those of statics, by linear algebra that is not ours."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.pouring import run_deck, shipped_deck
from tests.statics import statics_of_run

pytestmark = pytest.mark.validation

# The most floppy modes per thousand degrees of freedom. 0.0 to 1.0 were measured of spheres, 0.0 to
# 1.2 of dimers, made with time steps of 0.005 to 0.02 (python -m tests.tables network). Then the
# most contacts per degree of freedom: gaps below the tolerance count as closed, and dimers of 1.01,
# of which two touch at up to four places, have many: 1.012 to 1.026 in five beds; 1.009 at most of
# the others.
SCENES: dict[str, tuple[str, dict[str, object], float, float]] = {
    "spheres": ("spheres", {"particles": 2000, "diameter": 0.087}, 1.0, 1.02),
    "dimers, 1.01": ("dimers", {"aspect_ratio": 1.01}, 1.2, 1.04),
    "dimers, 1.3": ("dimers", {"aspect_ratio": 1.3}, 1.2, 1.02),
    "dimers, 1.8": ("dimers", {"aspect_ratio": 1.8}, 1.2, 1.02),
}


@pytest.mark.parametrize("name", SCENES)
def test_floppy_modes(name: str, tmp_path: Path) -> None:
    """They are few, and there are hardly more contacts than degrees of freedom."""
    deck, variables, floppy, contacts = SCENES[name]
    run_deck(tmp_path, shipped_deck(deck), {"dump_every": 100000, **variables})
    one = statics_of_run(tmp_path)
    print(
        f"{name}: {one.degrees} degrees of freedom, {one.contacts} contacts, {one.floppy} "
        f"floppy modes, {one.self_stress} states of self-stress, {one.bulk_stress:.1f} of "
        "their weight in the bulk"
    )
    assert one.floppy <= floppy * one.degrees / 1000
    assert one.contacts <= contacts * one.degrees
