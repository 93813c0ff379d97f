"""Pure functions of numbers that a single run interprets and an ensemble compiles.

One formula, one place: each calls nothing but `math`, so that it is compiled as it stands.  Tables are cubic
between two nodes; the target-vector algorithm goes from what a sensor shows to valve-open times; and the loop
stops cycling for a cause, by what counts as a rise, a turn and a movement.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import Final, TypeVar

from ringbalance.scene.arrays import FloatArray

Number = TypeVar("Number", float, FloatArray)


def piece_rise(part: Number, rise: Number, d0: Number, d1: Number) -> Number:
    """Change of x after a part of a piece's time; `d0` and `d1` are dx/dt at its ends times its duration."""
    return part * (d0 + part * (3.0 * rise - 2.0 * d0 - d1 + part * (d0 + d1 - 2.0 * rise)))


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


NOTICEABLE: Final = 1e-12
"""Change of a fill ratio that counts as movement."""


class Cause(IntEnum):
    """Why the loop stopped cycling."""

    NONE = 0
    """It goes on."""
    RISING = 1
    """The amplitude rose after more operations in a row than the algorithm can explain."""
    IDLE = 2
    """Several commands in a row whose longest injection moved no liquid."""
    AT_REST = 3
    """The controller rests, the sensor is exact and no liquid can move: nothing will change."""
    TIME = 4
    SAMPLES = 5
    """The bound on the number of samples."""
    HELD = 6
    """The amplitude has been within its limit for the hold time and is expected to stay."""


NONE: Final = int(Cause.NONE)
RISING: Final = int(Cause.RISING)
IDLE: Final = int(Cause.IDLE)
AT_REST: Final = int(Cause.AT_REST)
TIME: Final = int(Cause.TIME)
SAMPLES: Final = int(Cause.SAMPLES)
HELD: Final = int(Cause.HELD)
"""The same as whole numbers, which is what compiled code knows."""


def stop_cause(
    held: bool,
    rises: int,
    rises_tolerated: int,
    above_first: bool,
    idle: int,
    idle_tolerated: int,
    final: bool,
    time_left: float,
) -> int:
    """Number of the cause for which a loop ends after a sample; zero: it continues."""
    if held:
        return HELD
    if rises > rises_tolerated or (rises == rises_tolerated and above_first):
        return RISING
    if idle >= idle_tolerated:
        return IDLE
    if final:
        return AT_REST
    return TIME if time_left <= 0.0 else NONE


def has_held(time: float, since: float, hold_time: float) -> bool:
    """Whether an amplitude within its limit since an instant, infinite for none, has held, all in s."""
    return time - since >= hold_time * (1.0 - 1e-9)


def has_grown(cause: int, higher: bool) -> bool:
    """Whether a run that has not settled made the vibration worse: it ended rising, or idle and `higher`."""
    return cause == RISING or (cause == IDLE and higher)


def has_risen(before: float, after: float, floor: float) -> bool:
    """Whether an amplitude rose by more than the noise floor, all in m."""
    return after - before > floor


def has_turned(before: float, after: float) -> bool:
    """Whether a phase turned by more than 90 degrees, rad; a jump by a whole turn is no turn."""
    return math.cos(after - before) < 0.0
