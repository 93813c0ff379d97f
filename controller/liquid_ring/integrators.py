"""The transfer by the flow law alone, in closed form or by a quadrature.

Exact under a law whose squared velocity is linear in the fill ratio, such as the paper's; under any other by
t = (V/S) integral dx/u(x), tabulated by gas pressure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Protocol, cast, runtime_checkable

import numpy as np

from ringbalance.controller.formulas import linear_course, piece_part, piece_rise
from ringbalance.controller.liquid_ring.pair_path import FlowPaths, UntabulatedError
from ringbalance.controller.liquid_ring.transfer import (
    Drive,
    Event,
    Integrator,
    Transfer,
    checked_instants,
    floods,
)
from ringbalance.reduced_model.law.flow_law import FlowLaw, Regime
from ringbalance.scene.arrays import FloatArray

_KEPT: Final = 16
"""Tables kept: a run needs one without gas, and two with it, primed and unprimed."""


@runtime_checkable
class LinearSquaredVelocity(Protocol):
    """A flow law with u^2 = a (p + b (x_A - x_C)), a full siphon while that and p are positive.

    Otherwise it is blocked, with no column in the tube; one that lets liquid run back has no closed form.
    """

    @property
    def velocity_squared_per_pressure(self) -> float:
        """a, m^3/kg."""
        ...

    @property
    def pressure_per_fill_difference(self) -> float:
        """b, Pa."""
        ...


def integrator_of(law: FlowLaw) -> Integrator:
    """The closed form when the law has one for all of its flows, else the quadrature."""
    closed = _has_closed_form(law) and not floods(law, total=law.max_fill_ratio)
    return closed_form if closed else quadrature


def _has_closed_form(law: FlowLaw) -> bool:
    return hasattr(law, "velocity_squared_per_pressure") and hasattr(law, "pressure_per_fill_difference")


def closed_form(drive: Drive, instants: FloatArray) -> Transfer:
    """Transfer with the velocity linear in time, exact to round-off.

    u^2 = a (p + b (2x - total)) gives du/dt = -a b S/V, so
    x(t) = x0 - (S/V) (u0 t - a b (S/V) t^2/2) until the velocity is zero or a chamber empty or full.
    Raises: ValueError: a law without a closed form, or instants that do not ascend from zero.
    Source: Eqs. 19 and 20 of the liquid-ring paper in the limit of small segments.
    """
    law = drive.law
    if not _has_closed_form(law):
        raise ValueError(f"the law {law.name!r} has no closed form: use the quadrature")
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
    law = cast(LinearSquaredVelocity, drive.law)
    return linear_course(
        fill,
        law.velocity_squared_per_pressure,
        law.pressure_per_fill_difference,
        drive.gas_pressure,
        drive.exchange_rate,
        drive.total,
        drive.lowest,
    )


@dataclass(frozen=True, eq=False)
class _SameLaw:
    """A law that equals itself alone, whatever its own equality says."""

    law: FlowLaw

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _SameLaw) and other.law is self.law

    def __hash__(self) -> int:
        return id(self.law)


@dataclass(frozen=True, kw_only=True)
class _Way:
    """The part of a path that lies ahead of a pair."""

    fill: FloatArray
    """x at the instants."""
    end: float
    """x at which the flow ends by itself."""
    duration: float
    """s until then."""
    primed: bool
    """Whether the tube is primed on its last part."""


def quadrature(drive: Drive, instants: FloatArray) -> Transfer:
    """Transfer under any law, to about 1e-11 in fill.

    All flows under one gas pressure are tabulated at the first call, as `pair_path` describes; an ensemble
    walks along the same tables.  A velocity that vanishes like the distance to a stall is followed until
    1e-12 of fill is left.
    Its event is UNFINISHED, and nothing moves, under a law that cannot be tabulated.
    Raises: ValueError: instants that do not ascend from zero.
    Source: section 5.1 of the liquid-ring paper in the limit of small segments, dx/dt = -u S/V.
    """
    t = checked_instants(instants)
    before = drive.flow(drive.fill, primed=drive.primed)
    if float(before.velocity) == 0:
        return drive.still(t, flow=before)
    try:
        way = _course(drive, t)
        event = _event(drive, way, float(t[-1]))
    except UntabulatedError:
        way = _Way(fill=np.full(t.shape, drive.fill), end=drive.fill, duration=0.0, primed=drive.primed)
        event = Event.UNFINISHED
    return drive.finished(
        t,
        way.fill,
        regime_start=Regime(int(before.regime)),
        event=event,
        event_time=None if event is Event.NONE else way.duration,
        primed=way.primed,
    )


def _course(drive: Drive, instants: FloatArray) -> _Way:
    """The path that a pair follows: an unprimed tube spills along one of its own until it is primed."""
    key = (_SameLaw(drive.law), drive.total, drive.exchange_rate, drive.gas_pressure)
    running = _paths(*key, primed=True)
    if drive.primed:
        return _way(running, drive.fill, instants, primed=True)
    spilling = _paths(*key, primed=False)
    if spilling.primes(drive.fill):
        return _way(running, drive.fill, instants, primed=True)
    first = _way(spilling, drive.fill, instants, primed=False)
    if not spilling.primes(first.end) or instants[-1] <= first.duration:
        return first
    later = np.maximum(instants - first.duration, 0.0)
    second = _way(running, first.end, later, primed=True)
    fill = np.where(instants > first.duration, second.fill, first.fill)
    return replace(second, fill=fill, duration=first.duration + second.duration)


@lru_cache(maxsize=_KEPT)
def _paths(
    law: _SameLaw, total: float, exchange_rate: float, gas_pressure: float, *, primed: bool
) -> FlowPaths:
    drive = Drive(
        law=law.law,
        fill=total / 2,
        total=total,
        exchange_rate=exchange_rate,
        gas_pressure=gas_pressure,
        primed=primed,
    )
    return FlowPaths.of(drive, primed=primed)


def _way(paths: FlowPaths, fill: float, instants: FloatArray, *, primed: bool) -> _Way:
    """Follow the path on which a fill lies."""
    interval = int(np.searchsorted(paths.edges, fill, side="right"))
    number, sign = int(paths.path[interval]), -float(paths.sense[interval])
    if number < 0:
        return _Way(fill=np.full(instants.shape, fill), end=fill, duration=0.0, primed=primed)
    time, x, after, before = paths.nodes[:, paths.begin[number] : paths.begin[number + 1]]
    span, rise = np.diff(time), np.diff(x)
    d0, d1 = after[:-1] * span, before[1:] * span
    start = _piece(sign * x, np.array(sign * fill))
    part = piece_part(fill - x[start], float(rise[start]), float(d0[start]), float(d1[start]))
    begun = time[start] + part * span[start]
    clock = begun + instants
    flowing, reached = clock < time[-1], np.full(clock.shape, x[-1])
    at = _piece(time, clock[flowing])
    moved = piece_rise((clock[flowing] - time[at]) / span[at], rise[at], d0[at], d1[at])
    reached[flowing] = sign * np.maximum(sign * (x[at] + moved), sign * fill)
    duration = max(float(time[-1] - begun), 0.0)
    return _Way(fill=reached, end=float(x[-1]), duration=duration, primed=primed)


def _piece(ascending: FloatArray, wanted: FloatArray) -> FloatArray:
    """The last node that is not above what is wanted; never the very last one."""
    return np.clip(np.searchsorted(ascending, wanted, side="right") - 1, 0, ascending.size - 2)


def _event(drive: Drive, way: _Way, duration: float) -> Event:
    if duration < way.duration:
        return Event.NONE
    ended = way.end in {drive.lowest, drive.highest}
    return drive.boundary_event(way.end) if ended else Event.STALLED
