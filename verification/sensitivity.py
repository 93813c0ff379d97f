"""Input uncertainty by central differences: what a number owes to what it was calculated from."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence


def input_uncertainty(contributions: Sequence[tuple[Callable[[float], float], float, float]]) -> float:
    """Standard uncertainty of a number from those of its inputs.

    u^2 = sum over inputs of [(f(v + u_v) - f(v - u_v))/2]^2
    Args: `contributions`: for each input its function, its value v and its standard uncertainty u_v; an input
        whose uncertainty is zero is not evaluated.
    Returns: Standard uncertainty, in the unit of the functions' results.
    Source: GUM (JCGM 100:2008), 5.1; independent inputs.
    """
    effects = [
        (function(value + standard_uncertainty) - function(value - standard_uncertainty)) / 2
        for function, value, standard_uncertainty in contributions
        if standard_uncertainty > 0
    ]
    return math.hypot(*effects)
