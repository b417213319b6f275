"""What all tests need."""

from __future__ import annotations

import signal

# A shell that starts the tests in the background has made interrupts ignored, also for the programs
# that tests start and interrupt.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
