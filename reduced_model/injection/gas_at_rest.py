"""Gases of a pair after a time while its liquid rests, in closed form: one step where a march takes ten."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.physics.gas import LAMINAR_RATIO, flow_shape
from ringbalance.reduced_model.injection.column import end_pressure, gas_volume
from ringbalance.reduced_model.injection.dynamics import P, Record, X
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import in_place, inlined

_STRAIGHT: Final = 1e-5
"""Below which tanh, tan and their inverses are straight to round-off."""
_flow_shape: Final = inlined(flow_shape)


@in_place
def rest_after(plant: Record, motion: Record, h: float, w: FloatArray, row: int) -> None:
    """State after a time with the liquid at rest, of isothermal gases, into a row."""
    for i in range(8):
        w[row, i] = motion.state[i]
    for chamber in range(2):
        p, is_open = w[row, P + chamber], motion.valve_0 > 0 if chamber == 0 else motion.valve_1 > 0
        volume = gas_volume(plant, w[row, X] if chamber == 0 else plant.total - w[row, X])
        time, end = h * plant.passing / volume, end_pressure(plant, is_open)
        if p < end:
            w[row, P + chamber] = end * _ratio_after(p / end, time, plant.critical_ratio, False)
        elif p > end:
            w[row, P + chamber] = end / _ratio_after(end / p, time, plant.critical_ratio, True)
        w[row, P + 2 + chamber] = w[row, P + chamber] * volume / plant.temperature


@in_place
def _ratio_after(ratio: float, time: float, critical_ratio: float, vents: bool) -> float:
    """Pressure ratio r, downstream over upstream, of a constant volume after a time in units of its tau.

    The gas keeps its temperature.  Filling, dr/dt = phi(r); venting, dr/dt = r phi(r); tau = V/(C p_0)
    sqrt(T_0/T), as in `physics.gas`, which has the times between two pressures.  Along the ellipse
    r = b + (1 - b) sin q with dq/dt = 1/(1 - b), or with y = tan(q/2) and c = 1 - b while venting
        dy/ds = (b y^2 + 2 c y + b)/2,  s = t/c,
    whose solution is a ratio of two linear functions of y(0).
    """
    b, r, left = critical_ratio, ratio, time
    if r < b:
        needed = math.log(b / r) if vents else b - r
        if left <= needed:
            return r * math.exp(left) if vents else r + left
        r, left = b, left - needed
    c, last = 1.0 - b, max(LAMINAR_RATIO, b)
    if r < last:
        ending = math.asin((last - b) / c)
        angle = math.asin((r - b) / c)
        if not vents:
            needed = c * (ending - angle)
            if left <= needed:
                return b + c * math.sin(angle + left / c)
        else:
            y, end = math.tan(angle / 2.0), math.tan(ending / 2.0)
            part = (end - y) / (c * y + b + end * (b * y + c))
            needed = c * _moebius_time(part, c * c - b * b)
            if left <= needed:
                part = _moebius_part(left / c, c * c - b * b)
                y = (y + part * (c * y + b)) / (1.0 - part * (b * y + c))
                return b + c * 2.0 * y / (1.0 + y * y)
        r, left = last, left - needed
    pace = _flow_shape(last, b) / (1.0 - last)
    rest = (1.0 - r) / (r if vents else 1.0) * math.exp(-min(left * pace, 700.0))
    return 1.0 / (1.0 + rest) if vents else 1.0 - rest


@in_place
def _moebius_part(time: float, square: float) -> float:
    """tanh(w s/2)/w with w^2 = `square`, which may be negative."""
    root = math.sqrt(abs(square))
    if root * time < _STRAIGHT:
        return time / 2.0
    return math.tanh(root * time / 2.0) / root if square > 0.0 else math.tan(root * time / 2.0) / root


@in_place
def _moebius_time(part: float, square: float) -> float:
    """s of the above."""
    root = math.sqrt(abs(square))
    if root * part < _STRAIGHT:
        return 2.0 * part
    return 2.0 * (math.atanh(root * part) if square > 0.0 else math.atan(root * part)) / root
