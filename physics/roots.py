"""Root and minimum of a function of one variable between two ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

_STEPS: Final = 200
_GOLDEN: Final = (math.sqrt(5) - 1) / 2


def bracketed_root(
    function: Callable[[float], float], low: float, high: float, *, tolerance: float = 1e-13
) -> float:
    """Root by false position with halved ends, bisecting every third step.

    Args: `low`, `high`: ends with opposite signs of the function. `tolerance`: of the root, relative to the
        distance of the ends.
    Raises: ValueError: both ends have one sign.
    Source: the Illinois variant of regula falsi, Dowell and Jarratt, BIT 11 (1971) 168.
    """
    at_low, at_high, width = function(low), function(high), tolerance * abs(high - low)
    if at_low * at_high > 0:
        raise ValueError("the function must change sign between the ends")
    for step in range(_STEPS):
        if at_low == 0 or at_high == 0 or abs(high - low) <= width:
            break
        middle = (low + high) / 2 if step % 3 == 2 else high - at_high * (high - low) / (at_high - at_low)
        value = function(middle)
        if value * at_high > 0:
            at_low, high, at_high = at_low / 2, middle, value
        else:
            low, at_low, at_high = middle, value, at_high / 2
    return low if abs(at_low) < abs(at_high) else high


def bracketed_minimum(
    function: Callable[[float], float], low: float, high: float, *, tolerance: float
) -> float:
    """Place of the minimum of a function with one valley between two ends, by golden section.

    Args: `tolerance`: of the place, absolute.
    Source: Kiefer, Proc. Amer. Math. Soc. 4 (1953) 502.
    """
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_left, at_right = function(left), function(right)
    while high - low > tolerance:
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - _GOLDEN * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + _GOLDEN * (high - low)
            at_right = function(right)
    return (low + high) / 2
