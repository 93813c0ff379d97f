"""Time that a command has taken so far, with the interpreter's start and all imports."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Final

_LOADED: Final = time.perf_counter()
_STAT: Final = Path("/proc/self/stat")
_STARTED_AT: Final = 19
"""Of the fields behind the program's name in brackets: ticks from the machine's start to the process's."""


def since_start() -> float:
    """Wall time since this process began, s; where the system does not tell, since this module was loaded."""
    try:
        fields = _STAT.read_text(encoding="utf-8").rpartition(")")[2].split()
        begun = int(fields[_STARTED_AT]) / os.sysconf("SC_CLK_TCK")
        return time.clock_gettime(time.CLOCK_BOOTTIME) - begun
    except (OSError, ValueError, IndexError, AttributeError):
        return time.perf_counter() - _LOADED
