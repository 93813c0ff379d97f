"""A fraction of drawn devices with its bounds, and what it says of a fraction that is asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from ringbalance.results.requirements import MET, MISSED, OPEN

_NORMAL_95: Final = 1.959963984540054


@dataclass(frozen=True, kw_only=True)
class Proportion:
    """`count` of `of` devices, with the 95 % interval of a binomial fraction.

    Source: Wilson, "Probable Inference, the Law of Succession, and Statistical Inference", JASA 22 (1927).
    """

    count: int
    of: int

    @property
    def value(self) -> float:
        """Fraction; not a number where none was drawn."""
        return self.count / self.of if self.of else math.nan

    @property
    def low(self) -> float:
        """Lower 95 % bound."""
        return self._ends()[0]

    @property
    def high(self) -> float:
        """Upper 95 % bound."""
        return self._ends()[1]

    def verdict(self, asked: float) -> str:
        """`MET` where the lower bound is at least the fraction asked for, `MISSED` where the upper bound is
        below it, else `OPEN`."""
        low, high = self._ends()
        if low >= asked:
            return MET
        return MISSED if high < asked else OPEN

    def _ends(self) -> tuple[float, float]:
        if self.of == 0:
            return 0.0, 1.0
        p, z2 = self.value, _NORMAL_95**2 / self.of
        centre = (p + z2 / 2) / (1 + z2)
        half = math.sqrt(p * (1 - p) * z2 + z2**2 / 4) / (1 + z2)
        return max(centre - half, 0.0), min(centre + half, 1.0)

    def document(self) -> dict[str, float | int]:
        """For JSON."""
        return {"value": self.value, "low": self.low, "high": self.high, "count": self.count, "of": self.of}
