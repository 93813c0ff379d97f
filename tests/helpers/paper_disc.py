"""The paper's disc by hand formulas and quadrature: levels, pressures, arms and the crest's arc."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

WALL, INNER, CREST, PLATE, HALF = 44.5e-3, 20.5e-3, 31.5e-3, 2.777e-3, math.pi / 4
"""Radii, and plates beside a chamber of 90 degrees; m, rad."""
WIDTH, BORE, LENGTH = 30e-3, 1.5e-3, 0.12
"""B; of the tube, whose ports lie at the wall; m."""
DENSITY = 998.2
PULL = DENSITY * (10_000 * math.pi / 30) ** 2 / 2
"""rho omega^2/2, Pa/m^2."""
VAPOUR = 2339.0 - 101_325.0
"""Of water at 20 degC, gauge, Pa."""
INFLUENCE = 10e-6 / 926e-6
"""Vibration over unbalance, m/(kg m)."""


def _area(radius: float) -> float:
    """Between a radius and the wall, m^2."""
    r = np.linspace(radius, WALL, 2001)
    return float(np.trapezoid(2 * r * (HALF - np.arcsin(PLATE / r)), r))


def level(fill: float) -> float:
    """Radius of the surface over a fill, m."""
    return float(brentq(lambda r: _area(r) - fill * _area(INNER), INNER, WALL))


def pressure(radius: float) -> float:
    """Of a column from a radius to the wall, Pa."""
    return PULL * (WALL**2 - radius**2)


def arm(radius: float) -> float:
    """Distance from the shaft of the middle of an arc from plate to plate, m."""
    half = HALF - math.asin(PLATE / radius)
    return radius * math.sin(half) / half


def crest_volume() -> float:
    """On the far half of the crest's circle, m^3: tangents from both ports touch it, all stretched alike."""
    leg, arc = math.sqrt(WALL**2 - CREST**2), CREST * math.asin(CREST / WALL)
    return math.pi / 4 * BORE**2 * LENGTH * arc / (2 * leg + 2 * arc)
