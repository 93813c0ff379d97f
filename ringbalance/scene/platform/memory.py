"""Memory of a process: how often garbage is looked for, and a bound on what a block of code may allocate."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

COLLECTED_AT: Final = (50_000, 50, 1000)
"""Objects between two collections, then collections of one generation for one of the next.  The interpreter's
own 700, 10, 10 look through all that stays (modules, meshes, results): 4 % of a report's processor time."""


@contextmanager
def seldom_collected() -> Iterator[None]:
    """Look for garbage more seldom within a block that makes much and keeps most of it."""
    before = gc.get_threshold()
    gc.set_threshold(*COLLECTED_AT)
    try:
        yield
    finally:
        gc.set_threshold(*before)


if sys.platform == "linux":
    import resource

_STATM: Final = Path("/proc/self/statm")


@contextmanager
def bounded_memory(more: int) -> Iterator[None]:
    """Let a block take at most so many bytes of addresses more than there are: beyond, it has a MemoryError.

    For code of others that reads a file and believes the counts in it. No bound where the system does not
    tell how many there are, as where /proc is not mounted.
    """
    if sys.platform != "linux" or not _STATM.exists():
        yield
        return
    before = resource.getrlimit(resource.RLIMIT_AS)
    taken = int(_STATM.read_text(encoding="ascii").split()[0]) * os.sysconf("SC_PAGE_SIZE")
    bound = taken + more
    if before[0] != resource.RLIM_INFINITY:
        bound = min(bound, before[0])
    resource.setrlimit(resource.RLIMIT_AS, (bound, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
