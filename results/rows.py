"""A quantity as one record: what every output is made of."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from ringbalance.results.numbers import Width, given, shown


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Expanded uncertainties (95 %) of a quantity by cause, in its SI unit."""

    numerical: float = 0.0
    input: float = 0.0
    model: float = 0.0

    @property
    def total(self) -> float:
        """Root of the sum of their squares (ASME V&V 20-2009)."""
        return math.hypot(self.numerical, self.input, self.model)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number with its name, unit and interval; SI throughout."""

    key: str
    """Stable, such as "stall_pressure"."""
    name: str
    """As a reader knows it, such as "pressure to empty a chamber"."""
    value: float | None
    """None: there is none, as `status` says."""
    unit: str = "1"
    """SI."""
    symbol: str = ""
    lower: float | None = None
    upper: float | None = None
    """Ends of the 95 % interval; None: not known, or no end on this side."""
    parts: Parts | None = None
    origin: str = "computed"
    """ "computed", "simulated", "fitted", "given", "inferred", "assumed", "measured" or "default"."""
    status: str = "ok"
    """ "ok" or the code of the finding that limits it."""
    digits: int = 4
    """Of the value as text, where no uncertainty is known."""

    @property
    def width(self) -> Width:
        """What lies between the value and both ends; None without an interval."""
        if self.value is None or (self.lower is None and self.upper is None):
            return None
        below = math.inf if self.lower is None else self.value - self.lower
        above = math.inf if self.upper is None else self.upper - self.value
        return max(below, 0.0), max(above, 0.0)

    @property
    def text(self) -> str:
        """Value and interval in the unit that suits them, such as (72.043 ± 0.032) mm."""
        if self.width is not None:
            return shown(self.value, self.unit, self.width)
        return given(self.value, self.unit, digits=self.digits)

    def document(self) -> dict[str, Any]:
        """For JSON."""
        document = asdict(self)
        del document["digits"]
        return document


def around(value: float, total: float) -> tuple[float | None, float | None]:
    """Ends of an interval as wide on both sides; none without an uncertainty."""
    return (value - total, value + total) if total else (None, None)
