"""Programs that some tests need: how the browser starts, and what happens where one is missing."""

from __future__ import annotations

import os
from typing import NoReturn

import pytest

BROWSER = "chromium"
# Newer versions of Chromium draw WebGL without a graphics card only if they are told to.
OPTIONS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
# Where this is set, as in CI, tests that lack a browser or another program fail.
REQUIRED = "INELASTIC_PROGRAMS_REQUIRED"


def missing(reason: str) -> NoReturn:
    """Skip a test that cannot be run here, and fail where all must run."""
    # A browser and these programs are a gigabyte, which few changes need.
    if os.environ.get(REQUIRED):
        pytest.fail(f"{REQUIRED} is set, but {reason}")
    pytest.skip(f"NOT TESTED HERE: {reason}")
