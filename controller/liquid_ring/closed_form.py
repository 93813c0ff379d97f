"""The exact transfer under a law whose squared velocity is linear in the fill ratio, such as the paper's."""

from __future__ import annotations

from typing import Protocol, cast, runtime_checkable

import numpy as np

from ringbalance.controller.formulas.paths import linear_course
from ringbalance.controller.liquid_ring.transfer import Drive, Event, Transfer, checked_instants
from ringbalance.reduced_model.law.flow_law import FlowLaw, Regime
from ringbalance.scene.arrays import FloatArray


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
    """Whether a law offers the two coefficients of `LinearSquaredVelocity`."""
    return hasattr(law, "velocity_squared_per_pressure") and hasattr(law, "pressure_per_fill_difference")


def closed_form(drive: Drive, instants: FloatArray) -> Transfer:
    """Transfer with the velocity linear in time, exact to round-off.

    u^2 = a (p + b (2x - total)) gives du/dt = -a b S/V, so
    x(t) = x0 - (S/V) (u0 t - a b (S/V) t^2/2) until the velocity is zero or a chamber empty or full.
    Raises: ValueError: a law without a closed form, or instants that do not ascend from zero.
    Source: Eqs. 19 and 20 of the liquid-ring paper in the limit of small segments.
    """
    law = drive.law
    if not has_closed_form(law):
        raise ValueError(f"the law {law.name!r} has no closed form: use the quadrature")
    t = checked_instants(instants)
    u0, deceleration, end, stalls = _course(drive, drive.fill)
    if u0 == 0:
        return drive.still(t, flow=drive.flow(drive.fill))
    flowing = np.minimum(t, end)
    fill = drive.fill - drive.exchange_rate * flowing * (u0 - deceleration * flowing / 2)
    ended = bool(t[-1] >= end)
    event = Event.STALLED if stalls else drive.boundary_event(drive.lowest)
    if ended and not stalls:
        fill[t >= end] = drive.lowest
    held = np.minimum(np.maximum(fill, drive.lowest), drive.highest)
    flows = _course(drive, float(held[-1]))[0] > 0
    return Transfer(
        instants=t,
        fill=held,
        regime_start=Regime.SIPHON,
        regime_end=Regime.SIPHON if flows else Regime.BLOCKED,
        event=event if ended else Event.NONE,
        event_time=end if ended else None,
        primed=flows and not (ended and event is Event.EMPTY),
    )


def _course(drive: Drive, fill: float) -> tuple[float, float, float, bool]:
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
