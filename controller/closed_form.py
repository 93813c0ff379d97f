"""The exact transfer under a law whose squared velocity is linear in the fill ratio, such as the paper's."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol, cast, runtime_checkable

import numpy as np

from ringbalance.controller.transfer import (
    Drive,
    Event,
    FloatArray,
    Transfer,
    checked_instants,
)
from ringbalance.reduced_model.flow_law import FlowLaw, Regime


@runtime_checkable
class LinearSquaredVelocity(Protocol):
    """A flow law with u^2 = a (p + b (x_A - x_C)), a full siphon while that and p are positive.

    Otherwise it is blocked, with no column in the tube.
    """

    @property
    def velocity_squared_per_pressure(self) -> float:
        """a, m^3/kg."""
        ...

    @property
    def pressure_per_fill_difference(self) -> float:
        """b, Pa."""
        ...


def has_closed_form(law: FlowLaw) -> bool:
    """Whether `closed_form` applies to a law.

    Args:
        law: the law.

    Returns:
        True when it offers the two coefficients of `LinearSquaredVelocity`.
    """
    return hasattr(law, "velocity_squared_per_pressure") and hasattr(law, "pressure_per_fill_difference")


def closed_form(drive: Drive, instants: FloatArray) -> Transfer:
    """Transfer with the velocity linear in time, exact to round-off.

    u^2 = a (p + b (2x - total)) gives du/dt = -a b S/V, so
    x(t) = x0 - (S/V) (u0 t - a b (S/V) t^2/2) until the velocity is zero or a chamber empty or full.

    Args:
        drive: its law must have a closed form.
        instants: s from the start, shape (m,), ascending.

    Returns:
        Transfer.

    Raises:
        ValueError: a law without a closed form, or instants that do not ascend from zero.

    Source: Eqs. 19 and 20 of the liquid-ring paper in the limit of small segments.
    """
    law = drive.law
    if not has_closed_form(law):
        raise ValueError(f"the law {law.name!r} has no closed form: use the quadrature")
    t = checked_instants(instants)
    line = _line(drive)
    u0 = _velocity(drive, line, drive.fill)
    if u0 <= 0:
        return _blocked(drive, t)
    end, event = _end(drive, u0, line.deceleration)
    flowing = np.minimum(t, end)
    fill = drive.fill - drive.exchange_rate * flowing * (u0 - line.deceleration * flowing / 2)
    ended = bool(t[-1] >= end)
    if ended and event is not Event.STALLED:
        fill[t >= end] = drive.lowest
    held = np.minimum(np.maximum(fill, drive.lowest), drive.highest)
    flows = _velocity(drive, line, float(held[-1])) > 0
    return Transfer(
        instants=t,
        fill=held,
        regime_start=Regime.SIPHON,
        regime_end=Regime.SIPHON if flows else Regime.BLOCKED,
        event=event if ended else Event.NONE,
        event_time=end if ended else None,
        primed=flows and not (ended and event is Event.EMPTY),
        evaluations=2,
    )


class _Line(NamedTuple):
    """u^2 as a straight line over the driven chamber's fill."""

    per_pressure: float
    """a, m^3/kg."""
    per_fill: float
    """b, Pa."""
    deceleration: float
    """-du/dt while it flows, a b S/V, m/s^2."""


def _line(drive: Drive) -> _Line:
    law = cast(LinearSquaredVelocity, drive.law)
    a, b = law.velocity_squared_per_pressure, law.pressure_per_fill_difference
    return _Line(per_pressure=a, per_fill=b, deceleration=a * b * drive.exchange_rate)


def _velocity(drive: Drive, line: _Line, fill: float) -> float:
    squared = line.per_pressure * (drive.gas_pressure + line.per_fill * (2 * fill - drive.total))
    return math.sqrt(squared) if squared > 0 and drive.gas_pressure > 0 else 0.0


def _blocked(drive: Drive, t: FloatArray) -> Transfer:
    return Transfer(
        instants=t,
        fill=np.full(t.shape, drive.fill),
        regime_start=Regime.BLOCKED,
        regime_end=Regime.BLOCKED,
        event=Event.BLOCKED,
        event_time=0.0,
        primed=False,
        evaluations=1,
    )


def _end(drive: Drive, u0: float, deceleration: float) -> tuple[float, Event]:
    """Time at which the flow ends by itself, and why: D = (S/V) t (u0 + u_end)/2 with u_end^2 = u0^2 - ..."""
    distance = (drive.fill - drive.lowest) / drive.exchange_rate
    left = u0**2 - 2 * deceleration * distance
    if left <= 0:
        return u0 / deceleration, Event.STALLED
    return 2 * distance / (u0 + math.sqrt(left)), boundary_event(drive, drive.lowest)


def boundary_event(drive: Drive, fill: float) -> Event:
    """Which event it is to reach an end of the range of x.

    Args:
        drive: the drive.
        fill: the end reached, `drive.lowest` or `drive.highest`.

    Returns:
        EMPTY when the giving chamber has no liquid left, else FULL.
    """
    if fill == drive.lowest:
        return Event.EMPTY if drive.lowest == 0 else Event.FULL
    return Event.EMPTY if drive.highest == drive.total else Event.FULL
