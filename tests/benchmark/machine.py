"""What this machine's memory gives one core."""

from __future__ import annotations

import statistics
import time

import numpy as np

NUMBERS = 20_000_000  # 160 MB an array: more than any cache gives a core
REPEATS = 7
# What a sweep reads and writes for a constraint of spheres, in single precision, beside the
# particles (inelastic_sweep_kernels.h): two places, row, gap, compliance, the least change, the
# inverse of the target, and twice (read and written) the change now and before.
BYTES_A_CONSTRAINT = 8 + 16 + 4 + 4 + 4 + 4 + 2 * 8


def bandwidth() -> float:
    """Return bytes per second of the sum of two large arrays: two read, one written."""
    first, second = np.ones(NUMBERS), np.ones(NUMBERS)
    total = np.empty(NUMBERS)
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        np.add(first, second, out=total)
        seconds.append(time.perf_counter() - start)
    return 3 * total.nbytes / statistics.median(seconds)


def measure() -> None:
    """Print the bandwidth, and how fast it lets a constraint be."""
    speed = bandwidth()
    print(
        f"memory: {speed / 1e9:.1f} GB/s for one core; a sweep moves {BYTES_A_CONSTRAINT} "
        f"bytes a constraint, which takes {1e9 * BYTES_A_CONSTRAINT / speed:.2f} ns from memory",
        flush=True,
    )
