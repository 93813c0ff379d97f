"""Memory of a process: frequency of garbage collection, and a bound on the allocation of a block of code."""

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
700, 10, 10 check all lasting objects (modules, meshes, results): 4 % of a report's processor time."""


@contextmanager
def seldom_collected() -> Iterator[None]:
    """Collect garbage less often within a block that makes many objects and keeps most of them."""
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
    """Let a block use at most so many more bytes of address space; beyond, a MemoryError is raised.

    For libraries that read a file and trust the counts in it. Without effect where the system does not report
    the present size, such as without /proc.
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
