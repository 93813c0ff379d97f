"""The path of a flow whose squared velocity is linear in the fill ratio: a parabola in time."""

from __future__ import annotations

import math


def linear_course(
    fill: float,
    squared_per_pressure: float,
    pressure_per_fill: float,
    gas_pressure: float,
    exchange_rate: float,
    total: float,
    lowest: float,
) -> tuple[float, float, float, bool]:
    """Initial velocity (m/s, zero where nothing flows), decrease (m/s^2), end (s), whether it stalls there.

    u^2 = a (p + b (2x - total)) gives du/dt = -a b S/V; it ends at a velocity of zero or at the lowest fill,
    where D = (S/V) t (u0 + u_end)/2 with u_end^2 = u0^2 - 2 a b D.
    """
    squared = squared_per_pressure * (gas_pressure + pressure_per_fill * (2.0 * fill - total))
    slowing = squared_per_pressure * pressure_per_fill * exchange_rate
    if squared <= 0.0 or gas_pressure <= 0.0:
        return 0.0, slowing, 0.0, True
    u0 = math.sqrt(squared)
    distance = (fill - lowest) / exchange_rate
    left = squared - 2.0 * slowing * distance
    if left <= 0.0:
        return u0, slowing, u0 / slowing, True
    return u0, slowing, 2.0 * distance / (u0 + math.sqrt(left)), False
