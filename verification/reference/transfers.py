"""Transfers integrated in other ways: by Eq. 20's explicit segments, the paper's own way, and by an adaptive
Runge-Kutta method with events, an independent reference."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ringbalance.controller.liquid_ring.transfer import Drive, Event, Integrator, Transfer, checked_instants
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.arrays import FloatArray


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
