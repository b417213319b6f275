"""What all tests need, and a browser for those that look at pages."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from typing import Any, NoReturn

import pytest

# A shell that starts the tests in the background has made interrupts ignored, also for the programs
# that tests start and interrupt.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

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


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Start the system's Chromium, with nobody at its screen."""
    path = shutil.which(BROWSER)
    if path is None:
        missing(f"{BROWSER} is not installed (apt-get install {BROWSER})")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("playwright is not installed (pip install playwright)")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=OPTIONS)
        yield started
        started.close()
