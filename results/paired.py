"""Two fractions of the same devices: whether their difference is more than chance."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

from ringbalance.scene.arrays import BoolArray


@dataclass(frozen=True, kw_only=True)
class Paired:
    """How many devices meet something under the first of two, the second, both or neither."""

    both: int
    first_alone: int
    second_alone: int
    neither: int

    @classmethod
    def of(cls, first: BoolArray, second: BoolArray) -> Paired:
        """Args: `first`, `second`: of each device, shape (n,)."""
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

    def better(self, level: float) -> int | None:
        """0 or 1, the one under which more devices do; None: no difference is shown at a level."""
        if self.p_value > level:
            return None
        return 0 if self.first_alone > self.second_alone else 1

    def document(self) -> dict[str, float | int]:
        """For JSON."""
        return {**vars(self), "p_value": self.p_value}
