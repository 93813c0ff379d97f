"""A long compiled run in short pieces, so that progress is shown and Ctrl-C acts soon."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Final

FIRST: Final = 64
MOST: Final = 10_000
SHORT: Final = 0.05
"""A piece that took less is followed by one of twice the samples, s."""
LONG: Final = 0.2
"""A piece that took more is followed by one of half the samples, s."""


def stretches(samples: int) -> Iterator[tuple[int, int]]:
    """Divide samples into pieces by the time that the caller takes for each.

    Args: `samples`: in all.
    Yields: Number of the first sample of a piece, and the number after its last.
    """
    begin, size = 0, FIRST
    while begin < samples:
        end = min(begin + size, samples)
        started = time.perf_counter()
        yield begin, end
        elapsed = time.perf_counter() - started
        if elapsed > LONG:
            size = max(size // 2, 1)
        elif elapsed < SHORT:
            size = min(2 * size, MOST)
        begin = end
