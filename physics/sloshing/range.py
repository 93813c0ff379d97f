"""Limit of validity of linear sloshing."""

from typing import Final

SMALL: Final = 0.3
"""Displacement of the surface over the depth of the ring up to which waves count as small."""
