"""The comparison of a found number with a reference: error against validation uncertainty (ASME V&V 20).

E = S - D is compared with u_val = sqrt(u_num^2 + u_input^2 + u_D^2).  All u are standard uncertainties; the
half-width 2 u_val covers 95 %.  An error inside it cannot be distinguished from none; one outside it can.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

COVERAGE_FACTOR = 2.0
"""Half-widths at 95 % per standard uncertainty."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A found number against a reference."""

    error: float
    """E = S - D."""
    validation_uncertainty: float
    """u_val, standard."""

    @property
    def half_width(self) -> float:
        """2 u_val, the expanded uncertainty (95 %) that |E| is compared with."""
        return COVERAGE_FACTOR * self.validation_uncertainty

    @property
    def consistent(self) -> bool:
        """Whether |E| <= 2 u_val: the comparison sees no difference."""
        return abs(self.error) <= self.half_width


def compare(
    *,
    found: float,
    reference: float,
    numerical: float = 0.0,
    input_: float = 0.0,
    reference_uncertainty: float = 0.0,
) -> Comparison:
    """Compare a found number S with a reference D: E = S - D, u_val = sqrt(u_num^2 + u_input^2 + u_D^2).

    A few units in the last place of the larger number are added for round-off.
    Args: `numerical`, `input_` and `reference_uncertainty` are standard uncertainties in the unit of S.
    Raises: ValueError: a number that is not finite, or a negative uncertainty.
    Source: ASME V&V 20-2009, sections 1 and 6; independent uncertainties.
    """
    parts = (numerical, input_, reference_uncertainty)
    if not all(math.isfinite(value) for value in (found, reference, *parts)) or min(parts) < 0:
        raise ValueError("a comparison needs finite numbers and uncertainties that are not negative")
    round_off = 4 * math.ulp(max(abs(found), abs(reference)))
    return Comparison(error=found - reference, validation_uncertainty=math.hypot(*parts, round_off))


def from_half_width(half_width: float) -> float:
    """Standard uncertainty from an expanded uncertainty (95 %)."""
    return half_width / COVERAGE_FACTOR


def from_range(values: Iterable[float]) -> float:
    """Standard uncertainty of a number equally likely between the least and the largest value: GUM, 4.3.7."""
    ends = sorted(values)
    return (ends[-1] - ends[0]) / (2 * math.sqrt(3))


def from_rounding(last_digit: float) -> float:
    """Standard uncertainty of a printed number from one unit of its last digit: u = last_digit/(2 sqrt(3)).

    All within half a unit is equally likely. The expanded uncertainty, 0.58 of the last digit, covers that.
    Source: rectangular distribution, GUM (JCGM 100:2008), 4.3.7.
    """
    return last_digit / (2 * math.sqrt(3))


def input_uncertainty(contributions: Sequence[tuple[Callable[[float], float], float, float]]) -> float:
    """Standard uncertainty from independent inputs: u^2 = sum of [(f(v + u_v) - f(v - u_v))/2]^2.

    Args: `contributions`: f, v and u_v of each input; one whose uncertainty is zero is not evaluated.
    Source: GUM (JCGM 100:2008), 5.1.
    """
    effects = [
        (function(value + standard_uncertainty) - function(value - standard_uncertainty)) / 2
        for function, value, standard_uncertainty in contributions
        if standard_uncertainty > 0
    ]
    return math.hypot(*effects)
