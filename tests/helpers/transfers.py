"""One operation of a pair under its flow law alone: by the program's own march, the paper's closed form and
an adaptive solver.

The driven chamber's fill ratio x obeys dx/dt = -(S/V) u(x_A, x_C, p) with x_C = total - x, which is taken in
`Drive.opposite` and nowhere else: liquid is conserved by construction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast

import numpy as np
import numpy.typing as npt
from pairs import Motion, PairState, opened, pass_time
from scipy.integrate import solve_ivp

from ringbalance.reduced_model.injection.dynamics import Dynamics, Event
from ringbalance.reduced_model.law.flow_law import Flow, FlowLaw, Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.arrays import FloatArray, clipped
from ringbalance.scene.models import Tube


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


Integrator = Callable[[Drive, FloatArray], Transfer]
"""Takes a drive and ascending instants, s from the start, at least one; the last is the duration."""


def closed_form(drive: Drive, instants: FloatArray) -> Transfer:
    """Transfer by the paper's law with the velocity linear in time, exact to round-off.

    u^2 = a (p + b (2x - total)) gives du/dt = -a b S/V, so
    x(t) = x0 - (S/V) (u0 t - a b (S/V) t^2/2) until the velocity is zero or a chamber empty or full.
    Source: Eqs. 19 and 20 of the liquid-ring paper in the limit of small segments.
    """
    t = np.asarray(instants, dtype=np.float64)
    u0, deceleration, end, stalls = _parabola(drive, drive.fill)
    if u0 == 0:
        return drive.still(t, flow=drive.flow(drive.fill))
    flowing = np.minimum(t, end)
    fill = drive.fill - drive.exchange_rate * flowing * (u0 - deceleration * flowing / 2)
    ended = bool(t[-1] >= end)
    event = Event.STALLED if stalls else drive.boundary_event(drive.lowest)
    if ended and not stalls:
        fill[t >= end] = drive.lowest
    held = np.minimum(np.maximum(fill, drive.lowest), drive.highest)
    flows = _parabola(drive, float(held[-1]))[0] > 0
    return Transfer(
        instants=t,
        fill=held,
        regime_start=Regime.SIPHON,
        regime_end=Regime.SIPHON if flows else Regime.BLOCKED,
        event=event if ended else Event.NONE,
        event_time=end if ended else None,
        primed=flows and not (ended and event is Event.EMPTY),
    )


def _parabola(drive: Drive, fill: float) -> tuple[float, float, float, bool]:
    """Path of a flow whose squared velocity is linear in the fill ratio: a parabola in time.

    It ends at a velocity of zero or at the lowest fill, where D = (S/V) t (u0 + u_end)/2 with
    u_end^2 = u0^2 - 2 a b D.
    Returns: Initial velocity (m/s, zero where nothing flows), decrease (m/s^2), end (s), whether it stalls.
    """
    law = cast(PaperLaw, drive.law)
    squared_per_pressure, pressure_per_fill = (
        law.velocity_squared_per_pressure,
        law.pressure_per_fill_difference,
    )
    squared = squared_per_pressure * (drive.gas_pressure + pressure_per_fill * (2.0 * fill - drive.total))
    slowing = squared_per_pressure * pressure_per_fill * drive.exchange_rate
    if squared <= 0.0 or drive.gas_pressure <= 0.0:
        return 0.0, slowing, 0.0, True
    u0 = math.sqrt(squared)
    distance = (fill - drive.lowest) / drive.exchange_rate
    left = squared - 2.0 * slowing * distance
    if left <= 0.0:
        return u0, slowing, u0 / slowing, True
    return u0, slowing, 2.0 * distance / (u0 + math.sqrt(left)), False


def marched(tube: Tube) -> Integrator:
    """The march that every run takes, without a term beyond the flow law; its error is that of one run."""

    def integrate(drive: Drive, t: FloatArray) -> Transfer:
        dynamics = Dynamics(
            law=drive.law,
            tube=tube,
            inertia=False,
            line=None,
            valve_lag=0.0,
            gas_pressure=drive.gas_pressure,
            ambient_pressure=1e5,
            dead_volume=0.0,
            tube_area=drive.exchange_rate,
            chamber_volume=1.0,
            max_fill_ratio=drive.law.max_fill_ratio,
        )
        valve = opened(dynamics, chamber=0, duration=2 * float(t[-1]) + 1)
        pair = PairState(
            fill=drive.fill,
            total=drive.total,
            primed=drive.primed,
            motion=Motion(pending=valve if drive.gas_pressure > 0 else ()),
        )
        path = pass_time(dynamics, pair, instants=t)
        record = path.motion.record
        return Transfer(
            instants=t,
            fill=path.fills,
            regime_start=record.regime_start,
            regime_end=record.regime_end,
            event=record.event,
            event_time=path.ended if record.event is not Event.NONE else None,
            primed=path.primed,
        )

    return integrate


def adaptive_ode(*, tolerance: float = 1e-10) -> Integrator:
    """An integrator by scipy's DOP853 with events at the ends of the range and at a stall.

    Args: `tolerance`: on the fill ratio; a stall is where its square root of the first velocity is left.
    """
    return partial(_solve, tolerance=tolerance)


def _solve(drive: Drive, t: FloatArray, *, tolerance: float) -> Transfer:
    before = drive.flow(drive.fill, primed=drive.primed)
    u0, regime = float(before.velocity), Regime(int(before.regime))
    end = drive.lowest if u0 > 0 else drive.highest
    if u0 == 0:
        return drive.still(t, flow=before)
    if t[-1] == 0 or drive.fill == end:
        event = drive.boundary_event(end) if drive.fill == end else Event.NONE
        time = None if event is Event.NONE else 0.0
        fill = np.full(t.shape, drive.fill)
        return drive.finished(t, fill, regime_start=regime, event=event, event_time=time)

    primed = drive.primed or bool(before.primed)
    solved = _path(drive, u0, end, float(t[-1]), tolerance, primed=primed)
    last = float(solved.t[-1])
    fill = np.asarray(solved.sol(np.minimum(t, last))[0], dtype=np.float64)
    at_end, at_stall, at_priming = (bool(times.size) for times in solved.t_events)
    if at_priming:
        return _once_primed(drive, t, fill, float(solved.y[0, -1]), last, tolerance)
    event = Event.STALLED if at_stall else Event.NONE
    if solved.status < 0:
        event = Event.UNFINISHED
    elif at_end:
        event = drive.boundary_event(end)
    if event in {Event.EMPTY, Event.FULL}:
        fill = np.where(t >= last, end, fill)
    return drive.finished(
        t,
        fill,
        regime_start=regime,
        event=event,
        event_time=None if event is Event.NONE else last,
        primed=primed,
    )


def _once_primed(
    drive: Drive, t: FloatArray, fill: FloatArray, reached: float, at: float, tolerance: float
) -> Transfer:
    """The rest of a transfer that spilled until it primed its tube."""
    rest = np.concatenate([[0.0], np.maximum(t - at, 0.0)])
    after = _solve(replace(drive, fill=reached, primed=True), rest, tolerance=tolerance)
    return replace(
        after,
        instants=t,
        fill=np.where(t > at, after.fill[1:], fill),
        regime_start=Regime(int(drive.flow(drive.fill, primed=False).regime)),
        event_time=None if after.event_time is None else at + after.event_time,
    )


def _path(drive: Drive, u0: float, end: float, duration: float, tolerance: float, *, primed: bool) -> Any:
    def slope(_: float, x: FloatArray) -> FloatArray:
        return np.asarray(-drive.exchange_rate * drive.flow(x, primed=primed).velocity, dtype=np.float64)

    def at_end(_: float, x: FloatArray) -> float:
        return float(x[0] - end)

    def at_stall(_: float, x: FloatArray) -> float:
        return float(drive.flow(x[0], primed=primed).velocity / u0 - tolerance**0.5)

    def at_priming(_: float, x: FloatArray) -> float:
        return 1.0 if not primed and bool(drive.flow(x[0], primed=False).primed) else -1.0

    at_end.terminal = at_stall.terminal = at_priming.terminal = True  # type: ignore[attr-defined]
    return solve_ivp(
        slope,
        (0.0, duration),
        [drive.fill],
        method="DOP853",
        rtol=max(tolerance, 1e-13),
        atol=tolerance * 1e-2,
        dense_output=True,
        events=(at_end, at_stall, at_priming),
    )
