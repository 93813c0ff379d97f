"""One operation of many pairs at once: the closed form where the law has it, else one exact path as a table.

All members share the law, the gas pressure and the liquid of a pair; a member whose flow is faster or slower
by a factor lives through the same path in another time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from ringbalance.controller.closed_form import LinearSquaredVelocity
from ringbalance.controller.quadrature import quadrature
from ringbalance.controller.transfer import Drive, Event
from ringbalance.reduced_model.model import BalancerModel

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

NODES: Final = 4097
"""Of a path's table over time."""
FILLS: Final = 2049
"""At which start and end of a flow are looked for."""
BISECTIONS: Final = 40
NEWTON: Final = 2


class PairTransfer(Protocol):
    """Gas into one chamber of a pair, for arrays of pairs."""

    def starts(self, fill: FloatArray) -> BoolArray:
        """Whether an empty tube starts to flow.

        Args:
            fill: x of the driven chamber, any shape.

        Returns:
            Of that shape.
        """
        ...

    def after(self, fill: FloatArray, time: FloatArray) -> FloatArray:
        """Fill of the driven chamber after a time of flow.

        Args:
            fill: x at the start, from which a flow starts, any shape.
            time: s, broadcast with `fill`.

        Returns:
            x, of the broadcast shape.
        """
        ...

    def holds(self, fill: FloatArray) -> BoolArray:
        """Whether liquid could run back, or a column stand, once the gas is off.

        Args:
            fill: x of the chamber driven last, any shape.

        Returns:
            Of that shape.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class LinearTransfer:
    """The closed form of `closed_form`, for arrays."""

    velocity_squared_per_pressure: float
    """a, m^3/kg."""
    pressure_per_fill_difference: float
    """b, Pa."""
    gas_pressure: float
    """Gauge, Pa."""
    exchange_rate: float
    """S/V, 1/m."""
    total: float
    """x_A + x_C."""
    lowest: float
    """Smallest x."""

    def starts(self, fill: FloatArray) -> BoolArray:
        """Whether Eq. 19's bracket is positive.

        Args:
            fill: x of the driven chamber, any shape.

        Returns:
            Of that shape.
        """
        return np.asarray((self._squared(fill) > 0) & (self.gas_pressure > 0))

    def after(self, fill: FloatArray, time: FloatArray) -> FloatArray:
        """x(t) = x0 - (S/V) (u0 t - a b (S/V) t^2/2) until the velocity is zero or a chamber empty or full.

        Args:
            fill: x at the start, any shape.
            time: s, broadcast with `fill`.

        Returns:
            x, of the broadcast shape.
        """
        rate = self.exchange_rate
        slowing = self.velocity_squared_per_pressure * self.pressure_per_fill_difference * rate
        u0 = np.sqrt(np.maximum(self._squared(fill), 0.0))
        distance = (fill - self.lowest) / rate
        left = u0**2 - 2 * slowing * distance
        # A floor for members that do not flow, whose time nobody asks for.
        arrives = 2 * distance / np.maximum(u0 + np.sqrt(np.maximum(left, 0.0)), 1e-100)
        end = np.where(left <= 0, u0 / slowing, arrives)
        flowing = np.minimum(time, end)
        x = fill - rate * flowing * (u0 - slowing * flowing / 2)
        return np.asarray(np.maximum(x, self.lowest), dtype=np.float64)

    def holds(self, fill: FloatArray) -> BoolArray:
        """Never: this law knows no column with the gas off.

        Args:
            fill: any shape.

        Returns:
            False, of that shape.
        """
        return np.zeros(np.shape(fill), dtype=np.bool_)

    def _squared(self, fill: FloatArray) -> FloatArray:
        level = self.pressure_per_fill_difference * (2 * fill - self.total)
        return np.asarray(self.velocity_squared_per_pressure * (self.gas_pressure + level))


@dataclass(frozen=True, kw_only=True, eq=False)
class TableTransfer:
    """x(t) of one flow from the fullest chamber on, cubic between nodes; every operation is a part of it."""

    step: float
    """s between the nodes."""
    fill: FloatArray
    """x at the nodes, descending, shape (n,)."""
    slope: FloatArray
    """dx/dt at the nodes times the step, shape (n,)."""
    starting_fill: float
    """Smallest x at which an empty tube starts to flow; infinite for none."""
    lowest: float
    """Smallest x."""
    holding: BoolArray
    """Whether a column may hold with the gas off, in equal cells of x from `lowest` on."""
    cell: float
    """Width of those cells."""

    def starts(self, fill: FloatArray) -> BoolArray:
        """Whether the driven chamber is full enough.

        Args:
            fill: x of the driven chamber, any shape.

        Returns:
            Of that shape.
        """
        return np.asarray(fill >= self.starting_fill)

    def after(self, fill: FloatArray, time: FloatArray) -> FloatArray:
        """x at the path's own time of `fill` plus `time`.

        Args:
            fill: x at the start, any shape.
            time: s, broadcast with `fill`.

        Returns:
            x, of the broadcast shape.
        """
        place = self._place(np.asarray(fill, dtype=np.float64))
        x = self._at(place + time / self.step)[0]
        return np.asarray(np.minimum(x, fill), dtype=np.float64)

    def holds(self, fill: FloatArray) -> BoolArray:
        """Whether x lies in a cell where a column may hold.

        Args:
            fill: x of the chamber driven last, any shape.

        Returns:
            Of that shape.
        """
        if not self.holding.any():
            return np.zeros(np.shape(fill), dtype=np.bool_)
        cell = ((fill - self.lowest) / self.cell).astype(np.intp)
        return np.asarray(self.holding[np.clip(cell, 0, self.holding.size - 1)])

    def _place(self, fill: FloatArray) -> FloatArray:
        """Where in the table a fill is, in steps, by Newton's method from straight lines."""
        nodes = np.arange(self.fill.size, dtype=np.float64)
        place = np.interp(fill, self.fill[::-1], nodes[::-1])
        for _ in range(NEWTON):
            x, slope = self._at(place)
            change = (fill - x) / np.minimum(slope, -1e-300)
            place = place + np.clip(change, -1.0, 1.0)
        return np.asarray(np.clip(place, 0.0, nodes[-1]), dtype=np.float64)

    def _at(self, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        return _cubic(self.fill, self.slope, place)


def pair_transfer(
    *, model: BalancerModel, total: float, gas_pressure: float, longest: float
) -> LinearTransfer | TableTransfer:
    """The vectorised transfer of a balancer model.

    Args:
        model: the balancer.
        total: sum of the two fill ratios of a pair.
        gas_pressure: gauge, Pa.
        longest: s that any operation or chain of operations may flow.

    Returns:
        The closed form when the law has one, else the table.

    Raises:
        ValueError: a law that flows backwards against the gas, or that an empty tube starts at several
            separate ranges of fill; run `simulate` member by member for it.
    """
    rate = model.tube_area / model.chamber_volume
    law = model.flow
    drive = Drive(law=law, fill=0.0, total=total, exchange_rate=rate, gas_pressure=gas_pressure, primed=True)
    if isinstance(law, LinearSquaredVelocity):
        return LinearTransfer(
            velocity_squared_per_pressure=law.velocity_squared_per_pressure,
            pressure_per_fill_difference=law.pressure_per_fill_difference,
            gas_pressure=gas_pressure,
            exchange_rate=rate,
            total=total,
            lowest=drive.lowest,
        )
    return _table(drive, longest)


def _table(drive: Drive, longest: float) -> TableTransfer:
    highest = Drive(
        law=drive.law,
        fill=drive.highest,
        total=drive.total,
        exchange_rate=drive.exchange_rate,
        gas_pressure=drive.gas_pressure,
        primed=True,
    )
    whole = quadrature(highest, np.array([longest]))
    end = longest if whole.event_time is None else min(longest, max(whole.event_time, 1e-9))
    instants = np.linspace(0.0, end, NODES)
    path = quadrature(highest, instants)
    velocity = np.maximum(drive.flow(path.fill).velocity, 0.0)
    if path.event is Event.STALLED:
        velocity[-1] = 0.0
    step = end / (NODES - 1)
    return TableTransfer(
        step=step,
        fill=np.minimum.accumulate(path.fill),
        slope=-drive.exchange_rate * velocity * step,
        starting_fill=_starting_fill(drive),
        lowest=drive.lowest,
        holding=_holding(drive),
        cell=(drive.highest - drive.lowest) / (FILLS - 1),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class MomentTable:
    """Moment of a pair over the fill of its positive chamber, cubic between equally spaced nodes."""

    lowest: float
    """Smallest x."""
    step: float
    """Distance of the nodes."""
    value: FloatArray
    """kg m, shape (n,)."""
    slope: FloatArray
    """kg m per step, shape (n,)."""

    def __call__(self, fill: FloatArray) -> FloatArray:
        """Moment along the pair's axis.

        Args:
            fill: x of the positive chamber, any shape.

        Returns:
            kg m, of that shape.
        """
        return _cubic(self.value, self.slope, (fill - self.lowest) / self.step)[0]


def moment_table(*, model: BalancerModel, total: float) -> MomentTable:
    """Tabulate a balancer's moment of a pair.

    Args:
        model: the balancer.
        total: sum of the two fill ratios of a pair.

    Returns:
        MomentTable.
    """
    largest = model.flow.max_fill_ratio
    lowest, highest = max(0.0, total - largest), min(total, largest)
    step = (highest - lowest) / (NODES - 1)

    def of(x: FloatArray) -> FloatArray:
        held = np.clip(x, lowest, highest)
        return model.moment.pair_moment(fill_ratio=held, opposite_fill_ratio=total - held)

    x = np.linspace(lowest, highest, NODES)
    before, after = np.maximum(x - step / 2, lowest), np.minimum(x + step / 2, highest)
    return MomentTable(
        lowest=lowest, step=step, value=of(x), slope=(of(after) - of(before)) / (after - before) * step
    )


def _cubic(value: FloatArray, slope: FloatArray, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cubic Hermite pieces on a unit grid: value and slope, held at the ends."""
    held = np.clip(place, 0.0, value.size - 1.0)
    cell = np.minimum(held.astype(np.intp), value.size - 2)
    t = held - cell
    y0, d0 = value[cell], slope[cell]
    rise, d1 = value[cell + 1] - y0, slope[cell + 1]
    a2, a3 = 3 * rise - 2 * d0 - d1, d0 + d1 - 2 * rise
    y = y0 + t * (d0 + t * (a2 + t * a3))
    return np.asarray(y), np.asarray(d0 + t * (2 * a2 + t * 3 * a3))


def _starting_fill(drive: Drive) -> float:
    x = np.linspace(drive.lowest, drive.highest, FILLS)
    velocity = drive.flow(x, primed=False).velocity
    flows = velocity > 0
    if np.any(velocity < 0) or np.any(flows[:-1] & ~flows[1:]):
        raise ValueError("this law cannot be tabled for an ensemble: run the members one by one")
    if not np.any(flows):
        return float("inf")
    first = int(np.argmax(flows))
    if first == 0:
        return drive.lowest
    low, high = float(x[first - 1]), float(x[first])
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        flowing = float(drive.flow(middle, primed=False).velocity) > 0
        low, high = (low, middle) if flowing else (middle, high)
    return high


def _holding(drive: Drive) -> BoolArray:
    """For each cell whether a column may hold at either end of it."""
    x = np.linspace(drive.lowest, drive.highest, FILLS)
    still = drive.law.evaluate(
        fill_ratio=x, opposite_fill_ratio=drive.opposite(x), gas_pressure=0.0, primed=True
    )
    held = (still.velocity != 0) | still.primed
    return np.asarray(held[:-1] | held[1:])
