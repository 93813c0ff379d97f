"""Limit of validity of linear sloshing."""

from typing import Final

SMALL: Final = 0.3
"""Displacement of the surface over the depth of the ring up to which waves count as small."""
FREQUENCY_UNCERTAINTY: Final = 0.06
"""U (95 %), relative, of a natural frequency by linear theory for waves of the height that experiments have.

Bias of 2.2 % and twice the scatter of 2.8 % over every second tank of Addington, Dynamics of fuel in tanks,
College of Aeronautics report CoA/N-99 (1960), without the scatter of the measurements themselves: real waves
are slower in deep liquid and faster in shallow one.
"""
