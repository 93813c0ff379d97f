"""One operation of a pair by an adaptive Runge-Kutta method with events."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ringbalance.reduced_model.injection.dynamics import Event
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.reference.transfers import Drive, Integrator, Transfer


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
