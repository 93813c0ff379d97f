"""TOML as `tomllib` reads it, but for keys so long that reading them takes gigabytes."""

from __future__ import annotations

import re
import tomllib
from typing import Any, Final

MOST_PARTS: Final = 50
"""Of a dotted key. Time and memory of `tomllib` grow with the square: 3.5 GB for one key of 30,000 parts."""
_QUOTED: Final = re.compile(r'"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'')
_LONG_KEY: Final = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}")


def read_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML document.

    Raises: ValueError: not TOML, or a key of more than `MOST_PARTS` parts. RecursionError: nested too deeply.
    """
    long_key = _LONG_KEY.search(_QUOTED.sub("q", text))
    if long_key is not None:
        # Quoted texts hold no line break, so that lines count as in the file.
        line = long_key.string.count("\n", 0, long_key.start()) + 1
        raise ValueError(f"line {line} has a key of more than {MOST_PARTS} parts")
    return tomllib.loads(text)
