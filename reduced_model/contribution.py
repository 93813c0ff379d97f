"""Estimated contribution of one physical term."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

_NO_BASIS: Final = "the scene gives no basis for an estimate"


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """What leaving one thing out is worth, judged before anything is solved."""

    value: float | None
    """Relative to the quantity that it changes; None where the scene gives no basis for an estimate."""
    formula: str
    """How it is estimated, with its numbers."""
    time: float | None = None
    """Valve-open time that it costs of a long injection, s; None for a term that is no time."""
    default_range: tuple[float, float] | None = None
    """Value at both ends of a default range, where the scene does not give the numbers."""

    def above(self, tolerance: float) -> bool:
        """Whether it exceeds a tolerance."""
        return self.value is not None and self.value > tolerance

    def reason(self, tolerance: float | None) -> str:
        """Formula and value, compared with a tolerance where one is given; the same text in every command."""
        return f"{self.formula}; {self._comparison(tolerance)}"

    def _comparison(self, tolerance: float | None) -> str:
        if self.default_range is not None:
            low, high = (percent(end) for end in self.default_range)
            return f"not in the scene: {low if low == high else f'{low} to {high}'} over a default range"
        if self.value is None:
            return _NO_BASIS
        if not tolerance:
            return percent(self.value)
        side = "above" if self.above(tolerance) else "below"
        return f"{percent(self.value)} is {side} the tolerance of {percent(tolerance)}"


def percent(fraction: float) -> str:
    """A fraction in per cent, to two digits."""
    value = 100 * fraction
    return f"{value:.0f} %" if 99.5 <= abs(value) < 1e6 else f"{value:.2g} %"
