"""The target-vector algorithm's law: from what a sensor shows to valve-open times of valves."""

from __future__ import annotations

import math
from collections.abc import Sequence


def vector_gas_time(
    amplitude: float,
    phase: float,
    time: float,
    integral: float,
    before_amplitude: float,
    before_phase: float,
    before_time: float,
    proportional: float,
    integral_time: float,
    derivative_time: float,
    maximum_gas_time: float,
    resets: bool,
) -> tuple[float, float]:
    """PID on the amplitude, T = Kc (e + 1/Ti int e dt + Td de/dt), s, not limited yet, and the new integral.

    An infinite `before_time`: there was no sample before; an infinite Ti: no integral part. While T is above
    `maximum_gas_time` the integral stands still; with `resets` it is dropped when the residual has turned by
    more than 90 degrees.
    """
    dt = time - before_time
    if not dt > 0.0:
        return proportional * amplitude, integral
    turned = resets and math.cos(phase - before_phase) < 0.0
    summed = 0.0 if turned else integral + (amplitude + before_amplitude) / 2.0 * dt
    slope = derivative_time * (amplitude - before_amplitude) / dt
    wanted = proportional * (amplitude + summed / integral_time + slope)
    if turned or wanted <= maximum_gas_time:
        return wanted, summed
    return wanted, integral


def vector_shares(
    chambers: int, angle: float, length: float, at_residual: Sequence[bool]
) -> tuple[int, float, int, float]:
    """Split a vector over the two chamber directions on either side of it; see `target_vector.components`.

    Args: `at_residual`: of every chamber, whether it is passed over for the next one.
    Returns: Chamber index and share of either; a share of zero where one chamber takes all.
    """
    if chambers == 2:
        along = length * math.cos(angle)
        return (0, along, 1, 0.0) if along >= 0.0 else (1, -along, 0, 0.0)
    spacing = 2.0 * math.pi / chambers
    turn = angle % (2.0 * math.pi)
    nearest = min(int(turn / spacing), chambers - 1)
    before, after = nearest, nearest + 1
    while at_residual[before % chambers] and after - before < chambers:
        before -= 1
    while at_residual[after % chambers] and after - before < chambers:
        after += 1
    if 2 * (after - before) >= chambers:
        before, after = nearest, nearest + 1
    between, past = (after - before) * spacing, turn - before * spacing
    scale = length / math.sin(between)
    return (
        before % chambers,
        scale * max(math.sin(between - past), 0.0),
        after % chambers,
        scale * max(math.sin(past), 0.0),
    )


def valve_time(share: float, offset: float, minimum_gas_time: float, maximum_gas_time: float) -> float:
    """Time for which a valve opens, s: the share and its offset, at most the maximum; none for a share below
    the minimum.
    """
    return min(share + offset, maximum_gas_time) if share > 0.0 and share >= minimum_gas_time else 0.0
