"""A short injection at constant fills: gas fills the chamber, liquid starts to move, the chamber vents.

**Opening.**  Without a column in the tube nothing flows before the gas has filled the chamber up to the
pressure that starts the flow, and liquid only spills over the crest up to the one that primes the tube.  A
valve that shuts at that moment leaves a primed column, which runs until the chamber has vented to the
pressure that stops it: this amount is the smallest that the line can be relied upon to deliver; what spills
before is less, and depends on every millisecond.  A valve is not expected to open for less than its own lag.

**Lift.**  The gas lifts the liquid in the leg as it fills the chamber; what it then pushes to the middle of
the crest falls back in the end, so it is taken off what the column has moved.

**Movement.**  With isothermal gas the times belong to the pressure (`physics.gas`), so the liquid
moved is the integral of rho S u dt over filling and venting.  The column has its mass and moves by
    du/dt = B - c(u) u^2,
c such that it keeps the flow law's steady velocity, B = c(u0) u0^2.  A full siphon of length L is driven by
the pressure above the one at which it stalls, B = (p - p_stall)/(rho L).  A separated one is driven by the
pressure above the one that stops it at the crest, p_stop, and only its part upstream of the crest's end is
accelerated: B = (p - p_stop)/(rho L_up).  The smaller of the two counts, and below p_stop it brakes.

**Dead time.**  Valve-open time that an injection loses against the steady velocity: T - s/u0 where an opening
T moves the column by s.  A controller that counts on the steady velocity adds it to every valve-open time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.physics.gas import GasLine
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Flow
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.tube.path import crest_middle, crest_span
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene, Tube

_PRESSURES: Final = 257
"""Per refinement of a threshold: few calls of the law with many pressures cost least."""
_SLOWEST_RISE: Final = 100.0
"""Times longer than without liquid that a pressure may take to rise."""
_STEPS: Final = 33
"""Of filling or venting."""
_INSTANT: Final = 2e-4
"""s, to which it is known when the front has passed the crest."""
_LIFTING: Final = 100
"""Instants that this may take."""
_SLOWEST: Final = 1e-9
"""m/s."""
_LEAST_PUSH: Final = 1e-9
"""m/s^2."""
_ROUNDS: Final = 3
"""After which the dead time, which hardly depends on the opening, is known to 0.1 ms."""


@dataclass(frozen=True, kw_only=True)
class _Moved:
    """How far a column has come."""

    metres: float = 0.0
    time: float = 0.0
    """s."""
    pressure: float = 0.0
    """Absolute, Pa, of the driven chamber."""
    velocity: float = 0.0
    """m/s."""


@dataclass(frozen=True, kw_only=True)
class Fills:
    """A pair of chambers at constant fills under a law."""

    model: BalancerModel
    driven: float
    opposite: float

    @property
    def hold(self) -> bool:
        """Whether what an injection moves stays moved with the gas off."""
        law = self.model.flow
        if isinstance(law, CalibratedLaw | PaperLaw):
            return law.holds(max(self.driven, self.opposite))
        return True

    def gas_volume(self, scene: Scene) -> float:
        """Of the driven chamber, with the scene's dead volume, m^3."""
        return (1 - self.driven) * self.model.chamber_volume + (scene.gas.dead_volume or 0.0)

    def flow(self, pressure: FloatArray, *, primed: bool) -> Flow:
        """At gauge pressures, Pa."""
        return self.model.flow.evaluate(
            fill_ratio=np.full(pressure.shape, self.driven),
            opposite_fill_ratio=np.full(pressure.shape, self.opposite),
            gas_pressure=pressure,
            primed=np.full(pressure.shape, primed),
        )

    def steady_velocity(self, pressure: float) -> float:
        """Of a primed column under a gauge pressure, Pa, m/s."""
        return float(self.flow(np.array([pressure]), primed=True).velocity[0])


@dataclass(frozen=True, kw_only=True)
class _Edges:
    """Gauge pressures, Pa."""

    starts: float
    """From which on liquid flows or spills."""
    primes: float
    """From which on the tube is primed; the supply's where it never is."""
    stops: float
    """Down to which a primed column flows."""
    stalls: float
    """At which a full siphon would stall."""


def _edges_of(fills: Fills, pressure: float) -> _Edges | None:
    """Up to a supply's gauge pressure, Pa; None where the gas starts no flow."""
    starts = least_pressure(lambda p: fills.flow(p, primed=False).velocity > 0, 0.0, pressure)
    if starts is None:
        return None
    primes = least_pressure(lambda p: fills.flow(p, primed=False).primed, 0.0, pressure)
    stops = least_pressure(lambda p: fills.flow(p, primed=True).velocity > 0, 0.0, starts) or 0.0
    stalls, law = stops, fills.model.flow
    if isinstance(law, CalibratedLaw):
        ends = law.ends(fill_ratio=fills.driven, opposite_fill_ratio=fills.opposite)
        stalls = float(ends.stall_pressure()) / law.gas_factor
    return _Edges(
        starts=starts,
        primes=pressure if primes is None else max(primes, starts),
        stops=stops,
        stalls=min(stalls, stops),
    )


def least_pressure(
    flows: Callable[[FloatArray], BoolArray], low: float, high: float, *, refinements: int = 3
) -> float | None:
    """Smallest pressure from `low` on from which on liquid flows up to `high`; None where it does not there.

    Args: `refinements`: each leaves a 256th of the range.
    """
    for _ in range(refinements):
        p = np.linspace(low, high, _PRESSURES)
        dry = np.flatnonzero(~flows(p))
        if dry.size == 0:
            return low
        if dry[-1] == p.size - 1:
            return None
        low, high = float(p[dry[-1]]), float(p[dry[-1] + 1])
    return high


@dataclass(frozen=True, kw_only=True)
class _Crest:
    """What the crest does to a column; as it stands, without one or under a law that knows none."""

    part: float = 1.0
    """L_up/L, of a separated column that is accelerated."""
    way: float = 0.0
    """By which the column moves until its front reaches the crest's end, m."""
    passed: float = 0.0
    """From the crest's middle to its end: of the way, what does not fall back, m."""


def _crest_of(tube: Tube, model: BalancerModel) -> _Crest:
    """The lift of a leg that has followed the filling gas up to the crest.

    The column that starts from rest is taken as long as up to the crest's end.  The one that is lifted is as
    long as up to the crest's middle, in the mean, and comes further in the same time: by the inverse ratio.
    """
    if tube.hump_radius is None or not isinstance(model.flow, CalibratedLaw):
        return _Crest()
    (start, stop), middle = crest_span(tube), crest_middle(tube)
    return _Crest(
        part=stop, way=(stop - start) * middle / stop * tube.length, passed=(stop - middle) * tube.length
    )


def short_injections(scene: Scene, lines: Sequence[GasLine], fills: Fills) -> tuple[ShortInjection, ...]:
    """Injections by each of several gas lines; none where the gas starts no flow, or its liquid runs back."""
    edges, model = _edges_of(fills, scene.gas.pressure), fills.model
    if edges is None or not fills.hold:
        return ()
    crest = _crest_of(scene.tube, model)
    mass = model.density * scene.tube.length
    volume = fills.gas_volume(scene)
    return tuple(
        ShortInjection(fills=fills, line=line, volume=volume, edges=edges, mass=mass, crest=crest)
        for line in lines
    )


@dataclass(frozen=True, kw_only=True)
class ShortInjection:
    """Injections of one line into the driven chamber of a pair."""

    fills: Fills
    line: GasLine
    volume: float
    """Of the gas, m^3."""
    edges: _Edges
    mass: float
    """rho L, kg/m^2."""
    crest: _Crest

    def shortest(self, least: float) -> _Moved:
        """By the shortest valve-open time that primes the tube and is not below `least`, s."""
        now = self._primed
        return self._least if now.time >= least else self._closed(self._open(now, least))

    def dead_time(self, metres: float, *, least: float = 0.0) -> float:
        """Of the injection that moves the column by `metres`, or of the shortest that moves more, s."""
        supply = self.line.supply_pressure - self.line.ambient_pressure
        steady, opening = self.fills.steady_velocity(supply), least
        dead = 0.0
        for _ in range(_ROUNDS):
            done = self.shortest(opening)
            dead = done.time - done.metres / steady
            opening = max(dead + metres / steady, least)
        return dead

    @cached_property
    def _primed(self) -> _Moved:
        """When the tube is primed, with its front past the crest."""
        ambient = self.line.ambient_pressure
        rising = np.linspace(ambient + self.edges.starts, ambient + self.edges.primes, _STEPS)
        filled = float(self.line.filling_time(rising[0], volume=self.volume))
        begun = self.crest.passed - self.crest.way
        now = _Moved(metres=begun, time=filled, pressure=float(rising[0]))
        now = self._passed(rising, now, primed=False)
        for _ in range(_LIFTING):
            if now.metres >= self.crest.passed or begun == 0.0:
                break
            now = self._open(now, now.time + _INSTANT)
        return now

    @cached_property
    def _least(self) -> _Moved:
        """With the valve shut as the tube is primed."""
        return self._closed(self._primed)

    def _open(self, now: _Moved, until: float) -> _Moved:
        """Of a primed tube, up to a time, s."""
        rising = np.linspace(now.pressure, self.line.supply_pressure, _STEPS)
        now = self._passed(rising, now, primed=True, until=until)
        return self._held(now, until - now.time) if now.time < until else now

    def _closed(self, before: _Moved) -> _Moved:
        """At rest, with the chamber vented; its time stays that of the opening."""
        ambient = self.line.ambient_pressure
        stop = ambient + min(self.edges.stops, before.pressure - ambient)
        now = self._passed(np.linspace(before.pressure, stop, _STEPS), before, primed=True)
        if self.edges.stops > 0:
            now = self._passed(np.linspace(stop, ambient, _STEPS), now, primed=True)
            now = self._braked(now)
        return replace(now, metres=max(now.metres, 0.0), time=before.time)

    def _passed(
        self, pressure: FloatArray, before: _Moved, *, primed: bool, until: float = math.inf
    ) -> _Moved:
        """Along an absolute pressure that rises or falls, V dp = (f - p S u) dt, f = V dp/dt of the line, up
        to a time."""
        falls = pressure[-1] < pressure[0]
        times = (self.line.venting_time if falls else self.line.filling_time)(pressure, volume=self.volume)
        middle, alone = (pressure[1:] + pressure[:-1]) / 2, np.abs(np.diff(times))
        steady, push = self._driven(middle - self.line.ambient_pressure, primed=primed)
        by_line, gives = self.volume * np.diff(pressure), middle * self.fills.model.tube_area * alone
        now = before
        for i in range(middle.size):
            total = by_line[i] - gives[i] * now.velocity
            slower = by_line[i] / total if total * by_line[i] > 0 else math.inf
            lasting, left = float(alone[i]) * min(slower, _SLOWEST_RISE), until - now.time
            part = 1.0 if lasting <= left else left / lasting
            now = self._moved(now, float(steady[i]), float(push[i]), part * lasting)
            now = replace(now, pressure=float(pressure[i] + part * (pressure[i + 1] - pressure[i])))
            if part < 1.0:
                break
        return now

    def _held(self, before: _Moved, time: float) -> _Moved:
        gauge = np.array([before.pressure - self.line.ambient_pressure])
        steady, push = self._driven(gauge, primed=True)
        return self._moved(before, float(steady[0]), float(push[0]), time)

    def _driven(self, gauge: FloatArray, *, primed: bool) -> tuple[FloatArray, FloatArray]:
        """Steady velocity u0, m/s, and B, m/s^2."""
        steady = np.maximum(self.fills.flow(gauge, primed=primed).velocity, 0.0)
        pressure, velocity, _ = self._losses
        # A column that spills is driven as a primed one that is as fast.
        alike = gauge if primed else np.interp(steady, velocity, pressure)
        return steady, self._push(gauge, alike)

    def _push(self, gauge: FloatArray, alike: FloatArray) -> FloatArray:
        broken = (alike - self.edges.stops) / self.crest.part
        return np.asarray(np.minimum(broken, gauge - self.edges.stalls) / self.mass)

    @cached_property
    def _losses(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gauge pressures, Pa, the steady velocities u of a primed column under them, m/s, and c(u), 1/m."""
        highest = self.line.supply_pressure - self.line.ambient_pressure
        p = np.linspace(self.edges.stops, highest, _STEPS)[1:]
        u = np.maximum.accumulate(np.maximum(self.fills.flow(p, primed=True).velocity, _SLOWEST))
        # Where supply and stop coincide, round-off would leave no push, or one below zero.
        return p, u, np.maximum(self._push(p, p), _LEAST_PUSH) / u**2

    def _moved(self, before: _Moved, steady: float, push: float, time: float) -> _Moved:
        _, velocities, frictions = self._losses
        friction = float(np.interp(max(before.velocity, steady), velocities, frictions))
        velocity, metres = _ridden(velocity=before.velocity, push=push, friction=friction, time=time)
        return replace(before, metres=before.metres + metres, time=before.time + time, velocity=velocity)

    def _braked(self, before: _Moved) -> _Moved:
        """To rest without gas."""
        push = -self.edges.stops / (self.crest.part * self.mass)
        return self._moved(before, 0.0, push, math.inf) if push and before.velocity else before


def _ridden(*, velocity: float, push: float, friction: float, time: float) -> tuple[float, float]:
    """Velocity, m/s, and way, m, after a time under du/dt = B - c u^2, until it rests.

    With q = sqrt(B c), w = sqrt(B/c) and v = u/w, u becomes w (v + tanh qt)/(1 + v tanh qt) on a way
    ln(cosh qt + v sinh qt)/c; with B < 0, u = w tan a with a falling at q, on a way ln(cos a'/cos a)/c.
    """
    if time == 0:
        return velocity, 0.0
    rate, speed = math.sqrt(abs(push) * friction), math.sqrt(abs(push) / friction)
    if push > 0 and speed > 0:
        share, turned = velocity / speed, time * rate
        grown = math.tanh(turned)
        way = turned + math.log((1 + share + (1 - share) * math.exp(-2 * turned)) / 2)
        return speed * (share + grown) / (1 + share * grown), way / friction
    # A push below what numbers hold, over the friction, is none.
    if push == 0 or speed == 0:
        return velocity / (1 + friction * velocity * time), math.log1p(friction * velocity * time) / friction
    angle = math.atan(velocity / speed)
    left = max(angle - rate * time, 0.0)
    return speed * math.tan(left), math.log(math.cos(left) / math.cos(angle)) / friction
