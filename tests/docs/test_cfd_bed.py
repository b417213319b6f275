"""The packed bed of docs/how-to/cfd-bed.md is the one of which the page tells."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.blocks import blocks_of

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "cfd-bed.md"
# Beyond the range of eight seeds, on another processor: half of its width.
BEYOND = 0.5


@pytest.mark.slow
def test_the_bed_is_at_rest_and_as_porous_as_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = PAGE.read_text()
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in [block for block in blocks_of(text) if block.language == "python"][:2]:
        exec(block.text, names)
    assert names["bed"].at_rest
    printed = [float(n) for n in re.findall(r"porosity .* (0\.\d+)", capsys.readouterr().out)]
    ranges = re.findall(r"(0\.\d+) to\s+(0\.\d+)", text)[:2]
    assert len(printed) == len(ranges) == 2
    for porosity, (low, high) in zip(printed, ranges, strict=True):
        margin = BEYOND * (float(high) - float(low))
        assert float(low) - margin <= porosity <= float(high) + margin
