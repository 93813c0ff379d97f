"""Rules for two eccentric masses: each takes SI values and says what is wrong, or None."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

from ringbalance.scene.rules.finding import Finding, deg, mm, seconds
from ringbalance.scene.units import format_quantity

_ROUNDING = 1e-9


class Corner(Protocol):
    """One corner of a speed profile."""

    @property
    def time(self) -> float:
        """Time, s."""


def imbalance_in_rotor(imbalance: float, rotor: float) -> Finding | None:
    """m_im <= m_r, since the imbalance is a part of the rotor.

    Args: `imbalance`: m_im, kg. `rotor`: m_r, kg.
    Returns: None when it holds.
    """
    if imbalance <= rotor:
        return None
    whole = format_quantity(rotor, "mass", "kg")
    return Finding(
        problem=f"the imbalance is a part of the rotor's mass ({whole}), so it cannot be heavier",
        allowed=f"at least 0 kg and at most {whole}",
    )


def masses_fit_track(arc: float, radius: float) -> Finding | None:
    """Both masses fit on the track: l <= pi r_b.

    Args: `arc`: l, m. `radius`: r_b, m.
    Returns: None when it holds.
    """
    limit = math.pi * radius
    if arc <= limit * (1 + _ROUNDING):
        return None
    return Finding(
        problem="two masses of this length do not fit on the track",
        allowed=f"above 0 mm and at most pi * guide_radius = {mm(limit)}",
    )


def masses_apart(angles: tuple[float, float], arc: float, radius: float) -> Finding | None:
    """The masses do not overlap at the start: |phi_1 - phi_2| >= l / r_b around the circle.

    Args: `angles`: phi_1 and phi_2, rad. `arc`: l, m. `radius`: r_b, m.
    Returns: None when it holds.
    """
    apart = abs(math.remainder(angles[0] - angles[1], 2 * math.pi))
    least = arc / radius
    if apart >= least * (1 - _ROUNDING):
        return None
    return Finding(
        problem=f"the masses overlap: they are {deg(apart)} apart, each {deg(least)} wide",
        allowed=f"angles at least arc_length / guide_radius = {deg(least)} apart",
    )


def profile_in_order(profile: Sequence[Corner]) -> Finding | None:
    """The profile has a corner, and its times increase. Returns: None when it holds."""
    times = [corner.time for corner in profile]
    allowed = "at least one { time, speed }, in order of time, each time once"
    if not times:
        return Finding(problem="it has no entry", allowed=allowed)
    for place, (before, after) in enumerate(pairwise(times), start=2):
        if after <= before:
            problem = (
                f"entry {place} ({seconds(after)}) does not come after the one before ({seconds(before)})"
            )
            return Finding(problem=problem, allowed=allowed)
    return None


def step_is_multiple(step: float, base: float) -> Finding | None:
    """A step is a whole multiple of the sensor's. Returns: None when it holds."""
    times = round(step / base)
    if times >= 1 and abs(step / base - times) <= 1e-6 * times:
        return None
    return Finding(
        problem=f"it is not a whole multiple of the step of [sensor] ({seconds(base)})",
        allowed=f"{seconds(base)}, {seconds(2 * base)}, {seconds(3 * base)} ...",
    )


def moves_in_order(stop: float, step: float) -> Finding | None:
    """The smallest trial move is not longer than the first.

    Args: `stop`: rad. `step`: rad.
    Returns: None when it holds.
    """
    if stop <= step:
        return None
    return Finding(
        problem=f"the smallest trial move must not be longer than the first, step ({deg(step)})",
        allowed=f"above 0 deg and at most {deg(step)}",
    )


def limit_above_position_noise(limit: float, noise: float) -> Finding | None:
    """The limit is above the standard deviation of a measured coordinate.

    Args: `limit`: m. `noise`: m.
    Returns: None when it holds.
    """
    if limit > noise:
        return None
    return Finding(
        problem=f"the limit is below the sensor noise (position_noise {mm(noise)})",
        allowed=f"above {mm(noise)}",
    )
