"""The transfer under any law by the quadrature t = (V/S) integral dx/u(x), inverted for x(t)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.controller.closed_form import boundary_event
from ringbalance.controller.gauss_panel import ABSCISSA, WEIGHT, Panel, nodes, three_panels
from ringbalance.controller.transfer import (
    Drive,
    Event,
    FloatArray,
    Transfer,
    checked_instants,
    finished,
    still,
)
from ringbalance.reduced_model.flow_law import Regime

FILL_TOLERANCE: Final = 1e-12
"""Error in fill ratio allowed to one panel, and distance to a stall that counts as there."""
SCAN: Final = 33
"""Points at which a window is searched for a stall or a change of regime."""
MAX_WINDOWS: Final = 64
MAX_PANELS: Final = 512
MAX_NEWTON: Final = 40


@dataclass(frozen=True, kw_only=True)
class _Stretch:
    """x from `start` to `end` without a kink of u(x) inside, travelled as x = end + (start - end) z^2."""

    start: float
    end: float
    stalls: bool

    def fill(self, z: FloatArray) -> FloatArray:
        return np.asarray(self.end + (self.start - self.end) * z**2, dtype=np.float64)


class _Work:
    """Counts the law's evaluations of one transfer and refuses to go on for ever."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.evaluations = 0

    def velocity(self, fill: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocity and regime at fills of any shape."""
        self.evaluations += fill.size
        flow = self.drive.flow(fill)
        return flow.velocity, np.asarray(flow.regime, dtype=np.float64)

    def pace(self, stretch: _Stretch, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """-dt/dz and the travel's rate |dx/dt| at z; the former stays finite where u vanishes like z."""
        speed = np.abs(self.velocity(stretch.fill(z))[0])
        # At a stall itself u is round-off of zero; nodes never fall on z = 0, so a floor suffices.
        rate = self.drive.exchange_rate * np.maximum(speed, np.finfo(np.float64).tiny ** 0.5)
        return 2 * abs(stretch.start - stretch.end) * z / rate, rate


def quadrature(drive: Drive, instants: FloatArray) -> Transfer:
    """Transfer under any law, to about 1e-11 in fill.

    The way is cut where the regime changes and where the velocity falls to zero; each cut is travelled in a
    variable z with x - x_end proportional to z^2, in which a velocity that vanishes like the square root of
    the distance leaves a smooth integrand, with adaptive Gauss panels; x at an instant by Newton's method.
    A velocity that vanishes like the distance itself is followed until 1e-12 of fill is left.

    Args:
        drive: law, fills, pressure and priming.
        instants: s from the start, shape (m,), ascending.

    Returns:
        Transfer; its event is UNFINISHED when the bounds on windows or panels were reached.

    Raises:
        ValueError: instants that do not ascend from zero.

    Source: section 5.1 of the liquid-ring paper in the limit of small segments, dx/dt = -u S/V.
    """
    t = checked_instants(instants)
    before = drive.flow(drive.fill, primed=drive.primed)
    u0, regime = float(before.velocity), Regime(int(before.regime))
    if u0 == 0:
        return still(drive, t, flow=before)
    journey = _Journey(drive=drive, instants=t)
    journey.travel(u0)
    return finished(
        drive,
        t,
        journey.fill,
        regime_start=regime,
        event=journey.event,
        event_time=None if journey.event is Event.NONE else journey.time,
        evaluations=journey.work.evaluations + 1,
    )


class _Journey:
    """The march of one transfer; lives inside one call of `quadrature`."""

    def __init__(self, *, drive: Drive, instants: FloatArray) -> None:
        self.drive = drive
        self.instants = instants
        self.work = _Work(drive)
        self.fill = np.full(instants.shape, drive.fill)
        self.time = 0.0
        self.position = drive.fill
        self.event = Event.NONE

    @property
    def remaining(self) -> float:
        return float(self.instants[-1]) - self.time

    def travel(self, u0: float) -> None:
        """Window after window, each as long as the present velocity would carry, until time or flow ends."""
        sense = -1.0 if u0 > 0 else 1.0
        limit = self.drive.lowest if u0 > 0 else self.drive.highest
        velocity = u0
        for _ in range(MAX_WINDOWS):
            if (limit - self.position) * sense <= 0:
                self._end(boundary_event(self.drive, limit), limit)
                return
            if self.remaining <= 0:
                return
            reach = abs(velocity) * self.drive.exchange_rate * self.remaining * 1.05 + FILL_TOLERANCE
            window = limit if abs(limit - self.position) <= reach else self.position + sense * reach
            stalled = self._cross(window)
            if self.remaining <= 0 or self.event is not Event.NONE:
                return
            if self.position != limit:
                velocity = float(self.work.velocity(np.asarray(self.position))[0])
                if stalled or velocity * sense >= 0:
                    self._end(Event.STALLED, self.position)
                    return
        self._end(Event.UNFINISHED, self.position)

    def _end(self, event: Event, fill: float) -> None:
        self.event = event
        self.position = fill
        self.fill[self.instants >= self.time] = fill

    def _cross(self, window: float) -> bool:
        """Travel to `window`, or as far as time, flow or bounds allow; True when the flow stalls there."""
        for stretch in _stretches(self.work, self.position, window):
            self._follow(stretch)
            if self.remaining <= 0 or self.event is not Event.NONE:
                return False
            self.position = stretch.end
            if stretch.stalls:
                return True
        return False

    def _follow(self, stretch: _Stretch) -> None:
        """Adaptive panels along one stretch, taking the instants that fall into each."""
        waiting = [(1.0, 0.0)]
        for _ in range(MAX_PANELS):
            if not waiting or self.remaining <= 0:
                return
            top, bottom = waiting.pop()
            ends = three_panels(top, bottom)
            pace, rate = self.work.pace(stretch, nodes(ends))
            whole, upper, lower = (
                Panel(top=a, bottom=b, integrand=row) for (a, b), row in zip(ends, pace, strict=True)
            )
            error = abs(whole.integral - upper.integral - lower.integral) * float(rate.max())
            if min(error, abs(stretch.start - stretch.end) * top**2) <= FILL_TOLERANCE:
                self._take(stretch, upper)
                self._take(stretch, lower)
            else:
                waiting += [ends[2], ends[1]]
        self._end(Event.UNFINISHED, self.position)

    def _take(self, stretch: _Stretch, panel: Panel) -> None:
        """Fills at the instants within one accepted panel, then the clock moves on."""
        duration = panel.integral
        inside = (self.instants >= self.time) & (self.instants < self.time + duration)
        if np.any(inside):
            z = self._invert(stretch, panel, self.instants[inside] - self.time)
            self.fill[inside] = stretch.fill(z)
        self.time += duration
        self.position = float(stretch.fill(np.asarray(panel.bottom)))
        self.fill[self.instants >= self.time] = self.position

    def _invert(self, stretch: _Stretch, panel: Panel, wanted: FloatArray) -> FloatArray:
        """Solve integral from z to top of pace = wanted, by Newton steps held within a shrinking bracket."""
        low, high = np.full(wanted.shape, panel.bottom), np.full(wanted.shape, panel.top)
        z = panel.reached(wanted)
        for _ in range(MAX_NEWTON):
            width = panel.top - z
            at = np.concatenate([z[:, None] + width[:, None] * ABSCISSA, z[:, None]], axis=1)
            pace, rate = self.work.pace(stretch, at)
            excess = pace[:, :-1] @ WEIGHT * width - wanted
            found = np.abs(excess) * rate[:, -1] <= FILL_TOLERANCE / 10
            if np.all(found | (high - low <= 4 * np.finfo(np.float64).eps)):
                break
            low, high = np.where(excess > 0, z, low), np.where(excess > 0, high, z)
            step = z + excess / np.maximum(pace[:, -1], np.finfo(np.float64).tiny ** 0.5)
            within = (step >= low) & (step <= high)
            z = np.where(found, z, np.where(within, step, (low + high) / 2))
        return z


def _stretches(work: _Work, start: float, end: float) -> tuple[_Stretch, ...]:
    """Cut the way from start to end at changes of regime, and end it at the first stall."""
    sense = np.sign(end - start)
    x = np.linspace(start, end, SCAN)
    cuts: list[float] = [start]
    while True:
        velocity, regime = work.velocity(x)
        stalled = velocity * sense >= 0
        stalled[0] = False
        changed = stalled | (regime != regime[0])
        if not np.any(changed):
            return _joined(cuts, float(x[-1]), stalls=False)
        first = int(np.argmax(changed))
        cut = _narrow(work, float(x[first - 1]), float(x[first]), float(regime[0]), float(sense))
        stalls = bool(work.velocity(np.asarray(cut))[0] * sense >= 0)
        if stalls or len(cuts) > SCAN or cut == end:
            return _joined(cuts, cut, stalls=stalls)
        cuts.append(cut)
        x = np.linspace(cut, end, SCAN)


def _narrow(work: _Work, before: float, after: float, regime: float, sense: float) -> float:
    """The first fill beyond the end of a regime or of the flow, to round-off."""
    for _ in range(16):
        x = np.linspace(before, after, SCAN)
        if abs(after - before) <= 4 * np.finfo(np.float64).eps:
            break
        velocity, regimes = work.velocity(x)
        changed = (velocity * sense >= 0) | (regimes != regime)
        changed[0], changed[-1] = False, True
        first = int(np.argmax(changed))
        before, after = float(x[first - 1]), float(x[first])
    return after


def _joined(cuts: list[float], end: float, *, stalls: bool) -> tuple[_Stretch, ...]:
    ends = [*cuts[1:], end]
    pairs = [(a, b) for a, b in zip(cuts, ends, strict=True) if a != b]
    return tuple(
        _Stretch(start=a, end=b, stalls=stalls and index == len(pairs) - 1)
        for index, (a, b) in enumerate(pairs)
    )
