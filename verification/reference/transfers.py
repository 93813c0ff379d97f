"""One operation of a pair under its flow law alone, in ways other than the program's own: the paper's closed
form, Eq. 20's explicit segments and an adaptive Runge-Kutta method with events.

The driven chamber's fill ratio x obeys dx/dt = -(S/V) u(x_A, x_C, p) with x_C = total - x, which is taken in
`Drive.opposite` and nowhere else: liquid is conserved by construction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from ringbalance.reduced_model.injection.dynamics import Event
from ringbalance.reduced_model.law.flow_law import Flow, FlowLaw, Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.arrays import FloatArray, clipped


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
"""Takes a drive and ascending instants (s from the start, shape (m,), the last one the duration)."""


def checked_instants(instants: npt.ArrayLike) -> FloatArray:
    """Instants as an array; ValueError when there are none, or negative, descending or infinite ones."""
    t = np.asarray(instants, dtype=np.float64)
    # A NaN fails every comparison, an infinity stands last.
    if t.ndim != 1 or t.size == 0 or not (t[0] >= 0 and t[-1] < np.inf and bool(np.all(t[1:] >= t[:-1]))):
        raise ValueError("instants must be at least one finite time >= 0, in ascending order")
    return t


def closed_form(drive: Drive, instants: FloatArray) -> Transfer:
    """Transfer with the velocity linear in time, exact to round-off.

    u^2 = a (p + b (2x - total)) gives du/dt = -a b S/V, so
    x(t) = x0 - (S/V) (u0 t - a b (S/V) t^2/2) until the velocity is zero or a chamber empty or full.
    Raises: ValueError: a law without a closed form, or instants that do not ascend from zero.
    Source: Eqs. 19 and 20 of the liquid-ring paper in the limit of small segments.
    """
    if not isinstance(drive.law, PaperLaw):
        raise ValueError(f"the law {drive.law.name!r} has no closed form")
    t = checked_instants(instants)
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
    law = cast(PaperLaw, drive.law)
    return _linear_course(
        fill,
        law.velocity_squared_per_pressure,
        law.pressure_per_fill_difference,
        drive.gas_pressure,
        drive.exchange_rate,
        drive.total,
        drive.lowest,
    )


def _linear_course(
    fill: float,
    squared_per_pressure: float,
    pressure_per_fill: float,
    gas_pressure: float,
    exchange_rate: float,
    total: float,
    lowest: float,
) -> tuple[float, float, float, bool]:
    """Path of a flow whose squared velocity is linear in the fill ratio: a parabola in time.

    u^2 = a (p + b (2x - total)) gives du/dt = -a b S/V; it ends at a velocity of zero or at the lowest fill,
    where D = (S/V) t (u0 + u_end)/2 with u_end^2 = u0^2 - 2 a b D.
    Returns: Initial velocity (m/s, zero where nothing flows), decrease (m/s^2), end (s), whether it stalls.
    """
    squared = squared_per_pressure * (gas_pressure + pressure_per_fill * (2.0 * fill - total))
    slowing = squared_per_pressure * pressure_per_fill * exchange_rate
    if squared <= 0.0 or gas_pressure <= 0.0:
        return 0.0, slowing, 0.0, True
    u0 = math.sqrt(squared)
    distance = (fill - lowest) / exchange_rate
    left = squared - 2.0 * slowing * distance
    if left <= 0.0:
        return u0, slowing, u0 / slowing, True
    return u0, slowing, 2.0 * distance / (u0 + math.sqrt(left)), False


def paper_drive(law: PaperLaw, *, gas_pressure: float, fill: float, total: float) -> Drive:
    """One chamber that gives liquid away from a fill ratio, by the paper's law, its tube empty."""
    return Drive(
        law=law,
        fill=fill,
        total=total,
        exchange_rate=law.tube_area / law.chamber_volume,
        gas_pressure=gas_pressure,
        primed=False,
    )


def explicit_segments(segments: int) -> Integrator:
    """An integrator with n equal explicit segments, x_i = x_(i-1) - u_(i-1) S dt/V; first order in dt.

    Near a stall, where u goes like the square root of the distance, a segment may step over it; the law then
    answers with zero and the fill stays where it landed. Between segments fills lie on the straight line.
    Raises: ValueError: fewer than one segment.
    Source: Eq. 20 of the liquid-ring paper.
    """
    if segments < 1:
        raise ValueError(f"segments must be at least 1, not {segments}")

    def integrate(drive: Drive, instants: FloatArray) -> Transfer:
        return _segments_of(drive, checked_instants(instants), segments)

    return integrate


def _segments_of(drive: Drive, t: FloatArray, segments: int) -> Transfer:
    before = drive.flow(drive.fill, primed=drive.primed)
    velocity, regime = float(before.velocity), Regime(int(before.regime))
    if velocity == 0:
        return drive.still(t, flow=before)
    edges = np.linspace(0.0, t[-1], segments + 1)
    x = np.full(segments + 1, drive.fill)
    event, event_time = Event.NONE, None
    for i, step in enumerate(np.diff(edges)):
        x[i + 1 :] = min(max(x[i] - velocity * drive.exchange_rate * step, drive.lowest), drive.highest)
        event = _end_event(drive, float(x[i + 1]), velocity)
        velocity = float(drive.flow(x[i + 1]).velocity) if event is Event.NONE else velocity
        event = Event.STALLED if velocity == 0 else event
        if event is not Event.NONE:
            event_time = float(edges[i + 1])
            break
    return drive.finished(t, np.interp(t, edges, x), regime_start=regime, event=event, event_time=event_time)


def _end_event(drive: Drive, fill: float, velocity: float) -> Event:
    end = drive.lowest if velocity > 0 else drive.highest
    return drive.boundary_event(end) if fill == end else Event.NONE


def adaptive_ode(*, tolerance: float = 1e-10) -> Integrator:
    """An integrator by scipy's DOP853 with events at the ends of the range and at a stall.

    Args: `tolerance`: on the fill ratio; a stall is where its square root of the first velocity is left.
    Raises: ValueError: a tolerance outside (0, 1).
    """
    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance must lie within (0, 1), not {tolerance}")

    def integrate(drive: Drive, instants: FloatArray) -> Transfer:
        return _solve(drive, checked_instants(instants), tolerance)

    return integrate


def _solve(drive: Drive, t: FloatArray, tolerance: float) -> Transfer:
    before = drive.flow(drive.fill, primed=drive.primed)
    u0, regime = float(before.velocity), Regime(int(before.regime))
    end = drive.lowest if u0 > 0 else drive.highest
    if u0 == 0:
        return drive.still(t, flow=before)
    if t[-1] == 0 or drive.fill == end:
        event = drive.boundary_event(end) if drive.fill == end else Event.NONE
        return _unmoved(drive, t, regime, event)

    primed = drive.primed or bool(before.primed)
    solved = _march(drive, u0, end, float(t[-1]), tolerance, primed=primed)
    last = float(solved.t[-1])
    fill = np.asarray(solved.sol(np.minimum(t, last))[0], dtype=np.float64)
    if solved.t_events[2].size:
        return _once_primed(drive, t, fill, float(solved.y[0, -1]), last, tolerance)
    event = _event(drive, end, [bool(times.size) for times in solved.t_events], finished_=solved.status >= 0)
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
    after = _solve(replace(drive, fill=reached, primed=True), rest, tolerance)
    return replace(
        after,
        instants=t,
        fill=np.where(t > at, after.fill[1:], fill),
        regime_start=Regime(int(drive.flow(drive.fill, primed=False).regime)),
        event_time=None if after.event_time is None else at + after.event_time,
    )


def _march(drive: Drive, u0: float, end: float, duration: float, tolerance: float, *, primed: bool) -> Any:
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


def _unmoved(drive: Drive, t: FloatArray, regime: Regime, event: Event) -> Transfer:
    return drive.finished(
        t,
        np.full(t.shape, drive.fill),
        regime_start=regime,
        event=event,
        event_time=None if event is Event.NONE else 0.0,
    )


def _event(drive: Drive, end: float, hit: list[bool], *, finished_: bool) -> Event:
    if not finished_:
        return Event.UNFINISHED
    if hit[0]:
        return drive.boundary_event(end)
    return Event.STALLED if hit[1] else Event.NONE
