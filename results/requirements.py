"""A requirement as one record: what is asked of a machine, what it comes to, and whether that can be told."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import KW_ONLY, asdict, dataclass, field
from typing import Any, Final

MET: Final = "met"
MISSED: Final = "not met"
OPEN: Final = "undecided"
UNASKED: Final = "none stated"
"""Verdicts on a requirement."""
AT_LEAST: Final = "at least"
AT_MOST: Final = "at most"
Interval = tuple[float, float]


@dataclass(frozen=True)
class Requirement:
    """Intervals are 95 %, from stated uncertainties."""

    quantity: str
    unit: str
    """SI; empty for a ratio."""
    sense: str
    """`AT_LEAST` or `AT_MOST`."""
    required: float
    set_by: str
    """Where the requirement comes from."""
    achieved: float | None
    """None: no run comes to it."""
    _: KW_ONLY
    required_interval: Interval | None = None
    achieved_interval: Interval | None = None
    """None: no uncertainty is stated, or it does not move the number."""
    effects: Mapping[str, Interval] = field(default_factory=dict)
    """By how much each cause alone lowers and raises `excess`, by the input's path."""
    lost: tuple[str, ...] = ()
    """Causes with which a run does not come to it at all."""
    excess_interval: Interval | None = None
    """None: as `achieved_interval`."""
    reached: float = 1.0
    """Fraction of the drawn runs that come to it at all."""
    held: float = 1.0
    """Fraction of the drawn runs that meet the requirement."""

    @property
    def excess(self) -> float:
        """By which the requirement is more than met; minus infinity where no run comes to it."""
        if self.achieved is None:
            return -math.inf
        more = self.achieved - self.required
        return more if self.sense == AT_LEAST else -more

    @property
    def met(self) -> bool:
        """Whether it is, as the scene says."""
        return self.excess >= 0

    @property
    def verdict(self) -> str:
        """Whether it is with 95 % of what the inputs may be: `MET`, `MISSED` or `OPEN`.

        It is missed where none of the drawn runs meets it, though the run as the scene says may.
        """
        least, most = self.excess_interval or (self.excess, self.excess)
        if most < 0 or self.held == 0.0:
            return MISSED
        always = self.reached == 1.0 and not self.lost
        return MET if least >= 0 and always else OPEN

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return {**asdict(self), "met": self.met, "verdict": self.verdict}
