"""Some hundred random scenes, each checked at every step; the seeds are printed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.random_scenes.scene_generator import UNEQUAL_FROM, random_scene
from tests.random_scenes.scene_loop import Programs, Verdict, installed, judge, summary

pytestmark = pytest.mark.validation

SCENES = 400
IN_A_BLOCK = 50
# Those of unequal grains begin later.
BLOCKS = [*range(0, SCENES, IN_A_BLOCK), UNEQUAL_FROM, UNEQUAL_FROM + IN_A_BLOCK]
# Seeds, with the generator as it is, that the fix or the checker has failed on.
FOUND = (
    3022,
    5010,
    7092,
    10138,
    10163,
    10181,
    20322,
    20429,
    41021,
    41023,
    50044,
    50151,
    50243,
    50418,
    60078,
    77420,
    91163,
    700280,
    700361,
    777491,
    810093,
    810761,
    811156,
    900409,
    900629,
    901652,
    910442,
    910478,
    910555,
    910662,
    910859,
    920003,
    925066,
    931960,
    934153,
    941646,
    950581,
    972143,
    972730,
    974364,
    1000081,
    1000253,
    1302561,
    1401134,
    1401257,
    1401616,
    1503165,
    1505845,
    1509772,
    1511362,
    1516422,
    1700013,
    1811776,
    1813780,
    1833818,
    1836569,
    1837366,
    2000368,
    2000698,
    3000000,
    3000043,
    3000182,
    4210699,
    4213279,
    5010243,
    5010323,
    5010555,
    5100385,
    5201546,
    5300393,
    5301116,
    5301183,
    6000532,
    6000545,
    6200579,
    6200750,
    6200795,
    6201834,
    6202911,
    6405905,
    6700338,
    6700642,
    7003488,
    7003752,
    7204793,
    7215198,
    8000392,
    8001049,
    8001240,
    9000020,
    9000539,
    9100121,
    9100182,
    9100367,
    9100475,
    9100559,
    9500024,
    9500050,
    9500248,
    9700477,
    10001375,
    10001626,
    11001752,
    11003289,
    11103524,
    11305733,
    14003776,
    16000102,
    16002913,
    16004465,
    18004721,
    20002108,
    21002278,
    22000542,
    23000912,
    31001735,
    31003967,
    35003098,
    36000096,
    41000098,
    41001748,
    43000079,
)


@pytest.fixture(scope="module")
def programs() -> Programs:
    return installed()


@pytest.mark.parametrize("first", BLOCKS)
def test_random_scenes(first: int, tmp_path: Path, programs: Programs) -> None:
    verdicts: list[Verdict] = []
    for seed in range(first, first + IN_A_BLOCK):
        verdict = judge(seed, tmp_path / str(seed), programs)
        assert verdict is not None
        verdicts.append(verdict)
    print(f"seeds {first} to {first + IN_A_BLOCK - 1}: {summary(verdicts)}")
    assert not [verdict.line() for verdict in verdicts if verdict.problems]


@pytest.mark.parametrize("seed", FOUND)
def test_scenes_that_have_found_something(seed: int, tmp_path: Path, programs: Programs) -> None:
    verdict = judge(seed, tmp_path / "scene", programs)
    assert verdict is not None
    print(verdict.line())
    assert not verdict.problems


@pytest.mark.parametrize("seed", range(4))
def test_more_ghosts_than_spheres(seed: int, tmp_path: Path, programs: Programs) -> None:
    """LAMMPS's buffers begin with room for a thousand numbers, which small scenes never fill."""
    scene = random_scene(seed, crowded=True)
    verdict = judge(seed, tmp_path / "scene", programs, scene=scene)
    assert verdict is not None
    print(f"crowded seed {verdict.line()}")
    assert not verdict.problems
