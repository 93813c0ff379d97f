"""Verdicts on what is required, and the senses of a requirement."""

from __future__ import annotations

from typing import Final

MET: Final = "met"
MISSED: Final = "not met"
OPEN: Final = "undecided"
UNASKED: Final = "none stated"
"""Verdicts on a requirement."""
AT_LEAST: Final = "at least"
AT_MOST: Final = "at most"
