"""One interval of flow through the tube of one pair: what is asked of an integrator, and what it returns.

The driven chamber's fill ratio x obeys dx/dt = -(S/V) u(x_A, x_C, p) with x_C = total - x, which is taken in
`Drive.opposite` and nowhere else: liquid is conserved by construction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.law.flow_law import Flow, FlowLaw, Regime
from ringbalance.scene.arrays import FloatArray, clipped


class Event(StrEnum):
    """What ended the flow before its time."""

    NONE = "none"
    BLOCKED = "blocked"
    """Nothing flowed from the start."""
    STALLED = "stalled"
    """The velocity fell to zero."""
    EMPTY = "empty"
    """The giving chamber ran empty."""
    FULL = "full"
    """The receiving chamber reached its largest fill."""
    UNFINISHED = "unfinished"
    """The integrator's bound on its work was reached; the fills after that are the last ones found."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """One chamber under a constant gas pressure, its opposite chamber vented."""

    law: FlowLaw
    fill: float
    """x of the driven chamber at the start."""
    total: float
    """x_A + x_C, constant."""
    exchange_rate: float
    """S/V, 1/m: fill ratio that passes per metre of flow in the tube."""
    gas_pressure: float
    """Gauge, Pa; zero with the valve closed."""
    primed: bool
    """Whether the tube holds a continuous column at the start."""

    @property
    def lowest(self) -> float:
        """Smallest x that the pair's liquid allows."""
        return max(0.0, self.total - self.law.max_fill_ratio)

    @property
    def highest(self) -> float:
        """Largest x that the pair's liquid allows."""
        return min(self.total, self.law.max_fill_ratio)

    def opposite(self, fill: npt.ArrayLike) -> FloatArray:
        """Fill ratio of the opposite chamber, x_C = total - x, held within the law's range."""
        other = self.total - np.asarray(fill, dtype=np.float64)
        return clipped(other, 0.0, self.law.max_fill_ratio)

    def flow(self, fill: npt.ArrayLike, *, primed: bool = True) -> Flow:
        """The law's answer for fill ratios of the driven chamber, any shape."""
        return self.law.evaluate(
            fill_ratio=clipped(fill, 0.0, self.law.max_fill_ratio),
            opposite_fill_ratio=self.opposite(fill),
            gas_pressure=self.gas_pressure,
            primed=primed,
        )

    def still(self, instants: FloatArray, *, flow: Flow) -> Transfer:
        """An interval in which nothing flows."""
        regime = Regime(int(flow.regime))
        return Transfer(
            instants=instants,
            fill=np.full(instants.shape, self.fill),
            regime_start=regime,
            regime_end=regime,
            event=Event.BLOCKED,
            event_time=0.0,
            primed=bool(flow.primed),
        )

    def finished(
        self,
        instants: FloatArray,
        fill: FloatArray,
        *,
        regime_start: Regime,
        event: Event,
        event_time: float | None,
        primed: bool = True,
    ) -> Transfer:
        """An interval that flowed, at its end in a primed tube or not.

        Gas that has blown through an emptied chamber leaves no column.
        """
        held = np.clip(fill, self.lowest, self.highest)
        after = self.flow(held[-1], primed=primed)
        return Transfer(
            instants=instants,
            fill=held,
            regime_start=regime_start,
            regime_end=Regime(int(after.regime)),
            event=event,
            event_time=event_time,
            primed=bool(after.primed) and event is not Event.EMPTY,
        )

    def boundary_event(self, fill: float) -> Event:
        """EMPTY or FULL: which event it is to reach `drive.lowest` or `drive.highest`."""
        if fill == self.lowest:
            return Event.EMPTY if self.lowest == 0 else Event.FULL
        return Event.EMPTY if self.highest == self.total else Event.FULL


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """Fills of the driven chamber over one interval of flow."""

    instants: FloatArray
    """s from the start, ascending."""
    fill: FloatArray
    """x at those instants."""
    regime_start: Regime
    regime_end: Regime
    event: Event
    event_time: float | None
    """s from the start; None without an event."""
    primed: bool
    """Whether the tube holds a continuous column at the end, under the same gas pressure."""


def floods(law: FlowLaw, *, total: float) -> bool:
    """Whether liquid of a pair leaves its fullest chamber through an unprimed tube with the gas off.

    So it does where the crest lies outside that chamber's level, and without a crest.
    """
    lowest = max(0.0, total - law.max_fill_ratio)
    flow = law.evaluate(fill_ratio=lowest, opposite_fill_ratio=total - lowest, gas_pressure=0.0)
    return float(flow.velocity) != 0.0


Integrator = Callable[[Drive, FloatArray], Transfer]
"""Takes a drive and ascending instants (s from the start, shape (m,), the last one the duration)."""


def checked_instants(instants: npt.ArrayLike) -> FloatArray:
    """Instants as an array; ValueError when there are none, or negative, descending or infinite ones."""
    t = np.asarray(instants, dtype=np.float64)
    # A NaN fails every comparison, an infinity stands last.
    if t.ndim != 1 or t.size == 0 or not (t[0] >= 0 and t[-1] < np.inf and bool(np.all(t[1:] >= t[:-1]))):
        raise ValueError("instants must be at least one finite time >= 0, in ascending order")
    return t
