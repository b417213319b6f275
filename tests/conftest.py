"""What all tests need, and a browser for those that look at pages."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Iterator
from typing import Any

import pytest

from tests.helpers.programs import BROWSER, OPTIONS, missing

# A shell that starts the tests in the background has made interrupts ignored, also for the programs
# that tests start and interrupt.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


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
