"""Verdicts on requirements, a fraction of drawn devices with its bounds, and paired fractions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from math import comb
from typing import Final

from ringbalance.scene.arrays import BoolArray

MET: Final = "met"
MISSED: Final = "not met"
OPEN: Final = "undecided"
UNASKED: Final = "none stated"
"""Verdicts on a requirement."""
AT_LEAST: Final = "at least"
AT_MOST: Final = "at most"


_NORMAL_95: Final = 1.959963984540054


@dataclass(frozen=True, kw_only=True)
class Proportion:
    """`count` of `of` devices, with the 95 % interval of a binomial fraction.

    Source: Wilson, "Probable Inference, the Law of Succession, and Statistical Inference", JASA 22 (1927).
    """

    count: int
    of: int

    @classmethod
    def where(cls, met: BoolArray) -> Proportion:
        """Fraction of the devices for which `met`, shape (n,), is true."""
        return cls(count=int(met.sum()), of=met.size)

    @property
    def value(self) -> float:
        """Fraction of the devices; NaN without devices."""
        return self.count / self.of if self.of else math.nan

    @property
    def low(self) -> float:
        """Lower 95 % bound."""
        return self._ends()[0]

    @property
    def high(self) -> float:
        """Upper 95 % bound."""
        return self._ends()[1]

    def verdict(self, required: float, *, deviations: float = _NORMAL_95) -> str:
        """`MET` where the lower bound is at least the required fraction, `MISSED` where the upper bound is
        below it, else `OPEN`.

        Args: `deviations`: half-width of the interval, in standard deviations; default that of 95 %.
        """
        low, high = self._ends(deviations)
        if low >= required:
            return MET
        return MISSED if high < required else OPEN

    @classmethod
    def least_met(cls, required: float) -> int:
        """Least number of devices of which all may show that a required fraction is met: n/(n + z^2)."""
        return math.ceil(_NORMAL_95**2 * required / (1.0 - required))

    def _ends(self, deviations: float = _NORMAL_95) -> tuple[float, float]:
        if self.of == 0:
            return 0.0, 1.0
        p, z2 = self.value, deviations**2 / self.of
        centre = (p + z2 / 2) / (1 + z2)
        half = math.sqrt(p * (1 - p) * z2 + z2**2 / 4) / (1 + z2)
        return max(centre - half, 0.0), min(centre + half, 1.0)

    def document(self) -> dict[str, float | int]:
        """For JSON."""
        return {"value": self.value, "low": self.low, "high": self.high, "count": self.count, "of": self.of}


@dataclass(frozen=True, kw_only=True)
class Paired:
    """Numbers of devices that meet a requirement under one of two settings, under both or under neither."""

    both: int
    first_alone: int
    second_alone: int
    neither: int

    @classmethod
    def of(cls, first: BoolArray, second: BoolArray) -> Paired:
        """Count devices. Args: `first`, `second`: True for devices that meet the requirement, shape (n,)."""
        return cls(
            both=int((first & second).sum()),
            first_alone=int((first & ~second).sum()),
            second_alone=int((~first & second).sum()),
            neither=int((~first & ~second).sum()),
        )

    @property
    def p_value(self) -> float:
        """Two-sided probability of a difference as large by chance: the exact test of the discordant pairs.

        Source: McNemar, Psychometrika 12 (1947), with the binomial distribution in place of its limit.
        """
        n = self.first_alone + self.second_alone
        tail = sum(comb(n, k) for k in range(min(self.first_alone, self.second_alone) + 1))
        return min(1.0, float(2 * tail) / float(1 << n))

    @property
    def difference(self) -> tuple[float, float]:
        """Fraction of the devices by which the first is better, and its half-width (95 %).

        Source: Wald's interval of the difference of paired proportions, Agresti, "Categorical Data Analysis"
            (2002), section 10.1.
        """
        n = self.both + self.first_alone + self.second_alone + self.neither
        change, differ = self.first_alone - self.second_alone, self.first_alone + self.second_alone
        return change / n, _NORMAL_95 * math.sqrt(differ - change**2 / n) / n

    def better(self, level: float) -> int | None:
        """Index of the significantly better setting, 0 or 1; None: no significant difference at `level`."""
        if self.p_value > level:
            return None
        return 0 if self.first_alone > self.second_alone else 1

    def document(self) -> dict[str, float | int]:
        """For JSON."""
        return {**vars(self), "p_value": self.p_value}
