"""What pressure starts a flow at all, and what to do about liquid that runs back or does not suffice."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.scene.arrays import BoolArray, FloatArray

NEAR_RESIDUAL: Final = 1e-6
"""Fill ratio to which a chamber counts as at its residual fill, which a run and an ensemble know as well:
what is left above it changes no vibration."""
_MAX_DOUBLINGS: Final = 40
_REFINEMENTS: Final = 6
"""Each leaves a 256th of the range."""
_PRESSURES: Final = 257
"""Few calls of the law with many pressures cost least."""
NEARLY_EMPTY: Final = 1e-6
"""Fill ratio at which a chamber's last liquid is looked at."""
LEAST_PRESSURE: Final = 1.0
"""Gauge, Pa, at which the search for a pressure that starts a flow begins without one."""
BEYOND_CAPACITY: Final = (
    "balance the rotor first, use a denser liquid, or a larger or differently clocked disc"
)
"""What to do about an unbalance that the disc cannot cancel."""
RUNS_BACK: Final = "raise rotor.speed or lower tube.hump_radius so that the column breaks, or vent the tube"
"""What to do about a full tube that lets liquid run back while the gas is off."""


def starting_pressure(
    *, law: FlowLaw, fill: float, opposite_fill: float, primed: bool, above: float
) -> float | None:
    """Smallest gauge pressure at which liquid leaves a chamber, Pa, to 12 digits, searched from `above` on.

    None when no pressure found does.
    """

    def flows(pressure: FloatArray) -> BoolArray:
        one = np.ones_like(pressure)
        flow = law.evaluate(
            fill_ratio=fill * one,
            opposite_fill_ratio=opposite_fill * one,
            gas_pressure=pressure,
            primed=primed,
        )
        return flow.velocity > 0

    if flows(np.array([above]))[0]:
        return above
    for doubled in range(_MAX_DOUBLINGS):
        low = above * 2.0**doubled
        found = _least_pressure(flows, low, 2.0 * low)
        if found is not None:
            return found
    return None


def _least_pressure(flows: Callable[[FloatArray], BoolArray], low: float, high: float) -> float | None:
    """Smallest pressure from `low` on from which on liquid flows up to `high`; None where it does not."""
    for _ in range(_REFINEMENTS):
        p = np.linspace(low, high, _PRESSURES)
        dry = np.flatnonzero(~flows(p))
        if dry.size == 0:
            return low
        if dry[-1] == p.size - 1:
            return None
        low, high = float(p[dry[-1]]), float(p[dry[-1] + 1])
    return high
