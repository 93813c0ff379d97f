"""A smooth table read one number at a time: what `HermiteTable` holds, without arrays."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable

from ringbalance.reduced_model.tables.hermite import HermiteTable

NEWTON_STEPS = 5
Cell = tuple[float, float, float, float, float, float]


class ScalarTable:
    """y(x) by the same quintic pieces as the table it is made from; it continues straight beyond the ends."""

    def __init__(self, table: HermiteTable) -> None:
        """Work the pieces' coefficients out once."""
        self.start = float(table.start)
        self.step = float(table.step)
        self.values: list[float] = table.value.tolist()
        pieces = table.coefficients
        self.cells: list[Cell] = list(zip(*(c.tolist() for c in pieces), strict=True))

    def __call__(self, x: float) -> float:
        """Value at any x.

        Args: `x`: the place.
        Returns: y.
        """
        place = (x - self.start) / self.step
        cell = min(max(int(place), 0), len(self.cells) - 1)
        t = place - cell
        c0, c1, c2, c3, c4, c5 = self.cells[cell]
        if 0.0 <= t <= 1.0:
            return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
        held = 0.0 if t < 0.0 else 1.0
        slope = c1 + held * (2 * c2 + held * (3 * c3 + held * (4 * c4 + held * 5 * c5)))
        inside = c0 + held * (c1 + held * (c2 + held * (c3 + held * (c4 + held * c5))))
        return inside + (t - held) * slope

    def inverse(self, y: float) -> float:
        """The x of a value, for a table that grows from node to node. Returns: x, to round-off."""
        cell = min(max(bisect_left(self.values, y) - 1, 0), len(self.cells) - 1)
        c0, c1, c2, c3, c4, c5 = self.cells[cell]
        low = self.values[cell]
        t = min(max((y - low) / (self.values[cell + 1] - low), 0.0), 1.0)
        found, slope = c0, c1
        for step in range(NEWTON_STEPS + 1):
            found = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
            slope = c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5)))
            if step < NEWTON_STEPS:
                t = min(max(t + (y - found) / slope, 0.0), 1.0)
        return self.start + self.step * (cell + t + (y - found) / slope)


def line(*, at_zero: float, slope: float) -> Callable[[float], float]:
    """A straight line in place of a table.

    Args: `at_zero`: y at x = 0. `slope`: dy/dx.
    Returns: y(x) = at_zero + slope x.
    """

    def along(x: float) -> float:
        return at_zero + slope * x

    return along
