"""Limits of linear sloshing: how high its waves may be, and how well it knows a natural frequency."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray

SMALL: Final = 0.3
"""Displacement of the surface over the depth of the ring up to which waves count as small."""
FREQUENCY_UNCERTAINTY: Final = 0.06
"""U (95 %), relative, of a natural frequency by linear theory for waves of the height that experiments have.

Bias of 2.2 % and twice the scatter of 2.8 % over every second tank of Addington, Dynamics of fuel in tanks,
College of Aeronautics report CoA/N-99 (1960), without the scatter of the measurements themselves: real waves
are slower in deep liquid and faster in shallow one.  The case `measured_waves` calculates it again.
"""
LOWEST_TRUE: Final = 1 - FREQUENCY_UNCERTAINTY
"""Lower end of a natural frequency, over that of linear theory."""
HIGHEST_TRUE: Final = 1 + FREQUENCY_UNCERTAINTY
_GRID: Final = 25
_ROUNDS: Final = 3
_WITHIN: Final = 9
"""Points between the neighbours of an extreme, in each round."""


def swept(
    response: Callable[[FloatArray], FloatArray], *, frequency_ratio: float, natural: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Extremes of a forced response while all natural frequencies vary within `FREQUENCY_UNCERTAINTY`.

    Frequencies that are q times as high answer to a force at s as those of the theory do at s/q.
    Args:
        response: takes frequency ratios of the force, shape (m,), to values, shape (m, quantities).
        frequency_ratio: s of the force, over the speed.
        natural: natural frequencies over the speed: peaks are looked for there.
    Returns: Lower and upper ends, shape (quantities,) each: seldom as far from the value on both sides.
    """
    low, high = frequency_ratio / HIGHEST_TRUE, frequency_ratio / LOWEST_TRUE
    peaks = natural[(natural > low) & (natural < high)]
    places = np.unique([*np.linspace(low, high, _GRID), *peaks])
    values = response(places)
    for _ in range(_ROUNDS):
        found = np.unique([*values.argmin(axis=0), *values.argmax(axis=0)])
        ends = zip(
            places[np.maximum(found - 1, 0)], places[np.minimum(found + 1, places.size - 1)], strict=True
        )
        between = np.setdiff1d([x for end in ends for x in np.linspace(*end, _WITHIN)], places)
        order = np.argsort(np.append(places, between))
        values = np.concatenate([values, response(between)])[order]
        places = np.append(places, between)[order]
    return values.min(axis=0), values.max(axis=0)
