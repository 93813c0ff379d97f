"""Why the loop stops cycling, and what counts as a rise, a turn and a movement."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Final

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
