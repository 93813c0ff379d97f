"""Numbers that the standards of balancing and of rotors define.

Unbalance in kg m, speed in rad/s, vibration in m zero-to-peak.
"""

from __future__ import annotations

import math
from typing import Final

ZONES: Final = ((3.0, "A"), (4.0, "B"), (5.0, "C"), (math.inf, "D"))
"""Largest peak sensitivity of each zone of ISO 14839-3: A as new, B acceptable, C not for long;
9.5 and 12 dB as the documentation of ROSS (its tutorial on magnetic bearings) reports them, 14 dB recalled;
the standard itself was not read."""
_API_RPM_M: Final = 6350e-6
"""4 oz in rpm/lb, which is 6350 g mm rpm/kg, in kg m rpm/kg."""


def unbalance_reduction_ratio(*, before: float, after: float) -> float:
    """Unbalance reduction ratio of one correction, URR = 1 - U1/U0.

    Source: ISO 21940-21:2012, not read; Hofmann's glossary of balancing: "ratio between the reduction of the
    unbalance caused by a correction and the unbalance before that".
    """
    return 1.0 - after / before


def balance_grade(*, unbalance: float, mass: float, speed: float) -> float:
    """Balance quality grade of an unbalance of a whole rigid rotor, G = U W/M, m/s.

    Source: ISO 21940-11:2016.
    """
    return unbalance * speed / mass


def api_617_unbalance(*, mass: float, speed: float) -> float:
    """Sum over both planes of the residual unbalance that API 617 allows, kg m: 6350 L/N g mm in each, L the
    static load of its journal in kg and N the speed in rpm; both loads together are the rotor's mass.

    Source: 4 L/N oz in with L in lb for each plane, as Energy-Tech quotes API 617, and Kane's dictionary
        API 610; the standards were not read.
    """
    return _API_RPM_M * mass / (speed * 30.0 / math.pi)


def rms_velocity(*, amplitude: float, speed: float) -> float:
    """Root-mean-square velocity of a sine at the running speed, A W / sqrt(2), m/s.

    Source: the quantity that ISO 20816-1:2016 judges.
    """
    return amplitude * speed / math.sqrt(2.0)


def critical_speed(*, mass: float, stiffness: float) -> float:
    """Undamped critical speed of a rotor on isotropic bearings, sqrt(K/M), rad/s: there the lag is 90 deg."""
    return math.sqrt(stiffness / mass)


def amplification_factor(*, mass: float, stiffness: float, damping: float) -> float | None:
    """Amplification factor sqrt(K M)/C = 1/(2 zeta); None without damping, or with too much for a peak.

    Source: the limit of API 617's N_c/(N_2 - N_1) for light damping, which is within 3 % of it from 7 on.
    """
    if damping <= 0 or 2.0 * stiffness * mass <= damping**2:
        return None
    return math.sqrt(stiffness * mass) / damping


def zone(sensitivity: float) -> str:
    """Zone A to D of ISO 14839-3:2006 for a peak sensitivity, max |1/(1 + L)|.

    A standard for magnetic bearings, of limited meaning for a loop that is closed once in a period.
    """
    return next(name for most, name in ZONES if sensitivity <= most)
