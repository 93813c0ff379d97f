"""How far gas drives liquid, how long a valve opens for that, and what pressure starts a flow at all."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.transfer import Drive, Event, Integrator
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.short_injection import least_pressure
from ringbalance.scene.arrays import BoolArray, FloatArray

FILL_ERROR: Final = 1e-9
"""Error in fill ratio at which a valve-open time is good enough."""
TIME_ERROR: Final = 1e-13
"""Of a shortened valve-open time, relative to the commanded one."""
NEAR_RESIDUAL: Final = 1e-6
"""Fill ratio to which a chamber counts as at its residual fill, which a run and an ensemble know as well:
what is left above it changes no vibration."""
_SCAN: Final = 33
_MAX_NEWTON: Final = 30


def gas_time(*, drive: Drive, fill: float, integrator: Integrator, longest: float) -> float:
    """Valve-open time, s, that lowers the driven chamber to a fill ratio, t = (V/S) integral dx/u(x).

    Found by inverting an integrator's x(t) with Newton's method, dx/dt = -(S/V) u, within a bracket. At most
    `longest`; zero when the fill is not below the present one or nothing flows; the time of the stall when
    the flow stalls before; below the smallest possible fill the last velocity is kept.
    Source: section 5.1 of the liquid-ring paper in the limit of small segments, solved for the time.
    """
    if fill >= drive.fill:
        return 0.0
    instants = np.linspace(0.0, longest, _SCAN)
    path = integrator(drive, instants)
    if path.event is Event.BLOCKED:
        return 0.0
    reached = path.fill <= fill
    if not np.any(reached):
        return _time_to_the_end(drive, fill, path.event, path.event_time, longest)
    first = int(np.argmax(reached))
    before, after = float(instants[first - 1]), float(instants[first])
    if path.event_time is not None:
        after = min(after, path.event_time)
    above, below = float(path.fill[first - 1]), float(path.fill[first])
    guess = before + (after - before) * (above - fill) / (above - below)
    return _inverted(drive, fill, integrator, (before, guess, after))


def _time_to_the_end(
    drive: Drive, fill: float, event: Event, event_time: float | None, longest: float
) -> float:
    if event_time is None:
        return longest
    if event not in {Event.EMPTY, Event.FULL}:
        return min(event_time, longest)
    velocity = float(drive.flow(drive.lowest).velocity)
    more = (drive.lowest - fill) / (drive.exchange_rate * velocity) if velocity > 0 else 0.0
    return min(event_time + more, longest)


def _inverted(
    drive: Drive, fill: float, integrator: Integrator, bracket: tuple[float, float, float]
) -> float:
    low, t, high = bracket
    for _ in range(_MAX_NEWTON):
        x = float(integrator(drive, np.array([t])).fill[-1])
        if abs(x - fill) <= FILL_ERROR or high - low <= 4e-16 * high:
            break
        low, high = (t, high) if x > fill else (low, t)
        rate = drive.exchange_rate * float(drive.flow(x).velocity)
        step = t + (x - fill) / rate if rate > 0 else high
        t = step if low < step < high else (low + high) / 2
    return t


def opening_within(*, drive: Drive, least: float, duration: float, integrator: Integrator) -> float:
    """Longest valve-open time, at most `duration`, s, that leaves the driven chamber a fill ratio."""

    def after(time: float) -> float:
        return float(integrator(drive, np.array([time])).fill[-1])

    if after(duration) >= least:
        return duration
    low, high = 0.0, duration
    while high - low > TIME_ERROR * duration:
        middle = (low + high) / 2
        # An error of the time still leaves that fill.
        low, high = (middle, high) if after(middle) >= least + FILL_ERROR else (low, middle)
    return low


_MAX_DOUBLINGS: Final = 40
_REFINEMENTS: Final = 6
NEARLY_EMPTY: Final = 1e-6
"""Fill ratio at which a chamber's last liquid is looked at."""
LEAST_PRESSURE: Final = 1.0
"""Gauge, Pa, at which the search for a pressure that starts a flow begins without one."""
BEYOND_CAPACITY: Final = (
    "balance the rotor first, use a denser liquid, or a larger or differently clocked disc"
)
"""What to do about an unbalance that the disc cannot cancel."""
RUNS_BACK: Final = "raise rotor.speed or lower tube.hump_radius so that the column breaks, or vent the tube"
"""What to do about a full tube that lets liquid run back while the gas is off."""


def starting_pressure(
    *, law: FlowLaw, fill: float, opposite_fill: float, primed: bool, above: float
) -> float | None:
    """Smallest gauge pressure at which liquid leaves a chamber, Pa, to 12 digits, searched from `above` on.

    None when no pressure found does.
    """

    def flows(pressure: FloatArray) -> BoolArray:
        one = np.ones_like(pressure)
        flow = law.evaluate(
            fill_ratio=fill * one,
            opposite_fill_ratio=opposite_fill * one,
            gas_pressure=pressure,
            primed=primed,
        )
        return flow.velocity > 0

    if flows(np.array([above]))[0]:
        return above
    for doubled in range(_MAX_DOUBLINGS):
        low = above * 2.0**doubled
        found = least_pressure(flows, low, 2.0 * low, refinements=_REFINEMENTS)
        if found is not None:
            return found
    return None
