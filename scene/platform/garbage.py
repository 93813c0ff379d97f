"""How often the interpreter looks for garbage while a command runs."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
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
