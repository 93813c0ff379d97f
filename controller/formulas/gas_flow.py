"""The flow of gas through a valve or line by ISO 6358."""

from __future__ import annotations

import math
from typing import Final

LAMINAR_RATIO: Final = 0.999
"""Pressure ratio above which the conductance is taken as laminar."""


def flow_shape(ratio: float, critical_ratio: float) -> float:
    """phi(r), the mass flow over its choked value: 1 up to b, 0 at r = 1.

    An ellipse above b, and straight from r = 0.999 on, where the flow is laminar and its slope infinite.
    """
    if ratio <= critical_ratio:
        return 1.0
    held = min(ratio, max(LAMINAR_RATIO, critical_ratio))
    ellipse = math.sqrt(max(1.0 - ((held - critical_ratio) / (1.0 - critical_ratio)) ** 2, 0.0))
    return ellipse if ratio == held else ellipse * (1.0 - ratio) / (1.0 - held)


def flow_shape_slope(ratio: float, critical_ratio: float, shape: float) -> float:
    """dphi/dr, with phi(r) given."""
    if ratio <= critical_ratio:
        return 0.0
    if ratio > max(LAMINAR_RATIO, critical_ratio):
        return -shape / max(1.0 - ratio, 1e-300)
    return -(ratio - critical_ratio) / (1.0 - critical_ratio) ** 2 / max(shape, 1e-300)
