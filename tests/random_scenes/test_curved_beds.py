"""Beds in small curved containers, each checked at every step; more: curved_beds.py."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.random_scenes.curved_beds import CARRIED, judge_bed
from tests.random_scenes.scene_loop import Programs, installed

pytestmark = pytest.mark.validation


@pytest.fixture(scope="module")
def programs() -> Programs:
    return installed()


@pytest.mark.parametrize("seed", range(1, 61))
def test_a_bed_in_a_curved_container(seed: int, tmp_path: Path, programs: Programs) -> None:
    """No step adds more energy than it may, and in the end walls carry the weight.

    Of 2,000 one in a hundred may end in an error; of these seeds none does.
    """
    verdict, off = judge_bed(seed, tmp_path / "bed", programs)
    assert not verdict.problems, verdict.line()
    assert verdict.ended == "ended", verdict.line()
    assert off <= CARRIED
