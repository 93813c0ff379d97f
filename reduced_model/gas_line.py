"""What the valve and line of a chamber let through at the least, and at what valve-open time.

A line that a scene does not give is a range, not an absence: conductances of small valves behind a rotary
distributor and their switching times, of which both ends are answered for.

**The smallest correction.**  Without a column in the tube nothing flows before the gas has filled the chamber
up to the pressure that starts the flow, and liquid only spills over the crest up to the one that primes the
tube.  A valve that shuts at that moment leaves a primed column, which runs until the chamber has vented to
the pressure that stops it: this amount is the smallest that the line can be relied upon to deliver; what
spills before is less, and depends on every millisecond.  A valve is not expected to open for less than its
own lag.  With isothermal gas the times belong to the pressure (`physics.gas.supply`), so the liquid moved is
the integral of rho S u dt over filling and venting, at constant fills.  The column has its mass: in so short
an injection it stays behind the steady velocity u0(p) while the pressure rises, and does not get that back.
A run of the plant in time moves the same within 10 % where the opening is longer than 20 ms or set by the
valve's lag; for a faster line without a lag, which starts a separated column, the estimate is up to 1.7 times
as large.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.physics.gas.supply import GasLine, line_with
from ringbalance.reduced_model.law.flow_law import Flow
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Gas, Scene

DEFAULT_CONDUCTANCES: Final = (0.2e-8, 1e-8)
"""C of small valves with a rotary distributor, slow and fast, m^3/(s Pa): 0.2 and 1 l/(s bar)."""
DEFAULT_LAGS: Final = (10e-3, 5e-3)
"""Of small solenoid valves, slow and fast, s."""
DEFAULT_CRITICAL_RATIO: Final = 0.3
"""Between 0.5 of a nozzle and 0.2 of a long line."""
_PRESSURES: Final = 65
"""Per refinement of a threshold, and of the integral over filling and venting."""
_REFINEMENTS: Final = 4
_SLOWEST_RISE: Final = 100.0
"""Times longer than without liquid that a pressure may take to rise."""


@dataclass(frozen=True, kw_only=True)
class LineEnd:
    """One gas line that answers are given for."""

    name: str
    """ "given", or "slow" and "fast", the ends of the default range."""
    line: GasLine
    valve_lag: float
    """s."""


@dataclass(frozen=True, kw_only=True)
class LineAnswer:
    """What a pair at equal fills can do with one gas line."""

    end: str
    conductance: float
    """C, m^3/(s Pa)."""
    critical_ratio: float
    valve_lag: float
    """s."""
    filling_time: float
    """From ambient to the supply's pressure, s."""
    choked_filling_time: float
    """The same if the line were choked to the end, a lower bound, s."""
    venting_time: float
    """Back to ambient, s."""
    shortest_opening: float | None
    """Valve-open time below which nothing moves, s; None: the gas starts no flow."""
    smallest_correction: float | None
    """Change of the vibration by the shortest opening, m."""
    limit: float
    """Of the vibration, m."""

    @property
    def above_limit(self) -> bool:
        """Whether no correction as small as the controller's limit can be made."""
        return self.smallest_correction is not None and self.smallest_correction > self.limit


def line_ends(scene: Scene) -> tuple[LineEnd, ...]:
    """The scene's gas line, or the slow and the fast end of the default range of what it does not give."""
    gas = scene.gas
    if gas.conductance is not None and gas.valve_lag is not None:
        return (_end(gas, "given", 0),)
    return _end(gas, "slow", 0), _end(gas, "fast", 1)


def _end(gas: Gas, name: str, place: int) -> LineEnd:
    line = line_with(
        gas,
        conductance=DEFAULT_CONDUCTANCES[place] if gas.conductance is None else gas.conductance,
        critical_ratio=DEFAULT_CRITICAL_RATIO if gas.critical_ratio is None else gas.critical_ratio,
    )
    return LineEnd(
        name=name, line=line, valve_lag=DEFAULT_LAGS[place] if gas.valve_lag is None else gas.valve_lag
    )


def line_answers(scene: Scene, model: BalancerModel, *, inertia: bool = True) -> tuple[LineAnswer, ...]:
    """What the balancer's gas line can deliver, for each of `line_ends`, at equal fills of a pair.

    Args: `inertia`: whether the column in the tube has its mass, or follows the pressure at once.
    """
    fill = model.flow.max_fill_ratio / 2
    edges = _edges(model, fill, scene.gas.pressure)
    mass = model.density * scene.tube.length if inertia else 0.0
    return tuple(_answer(scene, model, end, fill, edges, mass) for end in line_ends(scene))


def _answer(
    scene: Scene, model: BalancerModel, end: LineEnd, fill: float, edges: _Edges | None, mass: float
) -> LineAnswer:
    volume = (1 - fill) * model.chamber_volume + (scene.gas.dead_volume or 0.0)
    line, opening, metres = end.line, None, None
    if edges is not None:
        opening, metres = _shortest(model, fill, end, volume, edges, mass)
    correction = None
    if metres is not None:
        moment = model.moment
        correction = metres * model.tube_area / model.chamber_volume
        moved = moment.pair_moment(fill_ratio=fill - correction, opposite_fill_ratio=fill + correction)
        correction = abs(float(moved)) * scene.rotor.influence_coefficient
    return LineAnswer(
        end=end.name,
        conductance=line.conductance,
        critical_ratio=line.critical_ratio,
        valve_lag=end.valve_lag,
        filling_time=float(line.filling_time(line.supply_pressure, volume=volume)),
        choked_filling_time=line.choked_filling_time(volume=volume),
        venting_time=float(line.venting_time(line.supply_pressure, volume=volume)),
        shortest_opening=opening,
        smallest_correction=correction,
        limit=scene.controller.limit,
    )


def _flow(model: BalancerModel, fill: float, pressure: FloatArray, *, primed: bool) -> Flow:
    return model.flow.evaluate(
        fill_ratio=np.full(pressure.shape, fill),
        opposite_fill_ratio=np.full(pressure.shape, fill),
        gas_pressure=pressure,
        primed=np.full(pressure.shape, primed),
    )


@dataclass(frozen=True, kw_only=True)
class _Edges:
    """Gauge pressures, Pa."""

    starts: float
    """From which on liquid flows or spills."""
    primes: float
    """From which on the tube is primed; the supply's where it never is."""
    stops: float
    """Down to which a primed column flows."""


def _edges(model: BalancerModel, fill: float, pressure: float) -> _Edges | None:
    """None where the gas starts no flow."""
    starts = _edge(lambda p: _flow(model, fill, p, primed=False).velocity > 0, pressure)
    if starts is None:
        return None
    primes = _edge(lambda p: _flow(model, fill, p, primed=False).primed, pressure)
    stops = _edge(lambda p: _flow(model, fill, p, primed=True).velocity > 0, starts)
    return _Edges(
        starts=starts,
        primes=pressure if primes is None else max(primes, starts),
        stops=0.0 if stops is None else stops,
    )


def _edge(flows: Callable[[FloatArray], BoolArray], highest: float) -> float | None:
    """Smallest pressure from which on liquid flows up to `highest`, where it must."""
    low, high = 0.0, highest
    for _ in range(_REFINEMENTS):
        p = np.linspace(low, high, _PRESSURES)
        dry = np.flatnonzero(~flows(p))
        if dry.size == 0:
            return low
        if dry[-1] == p.size - 1:
            return None
        low, high = float(p[dry[-1]]), float(p[dry[-1] + 1])
    return high


def _shortest(
    model: BalancerModel, fill: float, end: LineEnd, volume: float, edges: _Edges, mass: float
) -> tuple[float, float]:
    """Shortest valve-open time that primes the tube, s, and the length of column that it moves, m."""
    line, ambient, supply = end.line, end.line.ambient_pressure, end.line.supply_pressure
    primed = ambient + edges.primes
    column = _Column(model=model, fill=fill, line=line, volume=volume, edges=edges, mass=mass)
    rising = np.linspace(ambient + edges.starts, primed, _PRESSURES)
    passed = column.passed(rising, _Passed(), primed=False)
    opening, reached = float(line.filling_time(rising[0], volume=volume)) + passed.time, primed
    if opening < end.valve_lag:
        filled = np.linspace(primed, supply, _PRESSURES)
        ahead = opening + line.filling_time(filled, volume=volume) - line.filling_time(primed, volume=volume)
        # Beyond the end of filling the pressure stays the supply's.
        reached, opening = float(np.interp(end.valve_lag, ahead, filled)), end.valve_lag
        passed = column.passed(np.linspace(primed, reached, _PRESSURES), passed, primed=True)
        passed = column.held(reached, max(opening - float(ahead[-1]), 0.0), passed)
    falling = np.linspace(reached, ambient + min(edges.stops, reached - ambient), _PRESSURES)
    return opening, column.coasted(column.passed(falling, passed, primed=True)).metres


@dataclass(frozen=True, kw_only=True)
class _Passed:
    """How far a column has come."""

    metres: float = 0.0
    time: float = 0.0
    """s."""
    velocity: float = 0.0
    """m/s."""
    friction: float = 0.0
    """Of its deceleration c u^2 when last it was driven, 1/m."""


@dataclass(frozen=True, kw_only=True)
class _Column:
    """The column in the tube at constant and equal fills, while the gas pressure changes.

    rho L du/dt = p (1 - (u/u0)^2) towards the steady velocity u0; at equal fills the gas alone drives.
    """

    model: BalancerModel
    fill: float
    line: GasLine
    volume: float
    """Of the gas, m^3."""
    edges: _Edges
    mass: float
    """rho L, kg/m^2; zero: the column follows the pressure at once."""

    def passed(self, pressure: FloatArray, before: _Passed, *, primed: bool) -> _Passed:
        """Along an absolute pressure that rises or falls, V dp = (f - p S u) dt, f = V dp/dt of the line."""
        falls = pressure[-1] < pressure[0]
        times = (self.line.venting_time if falls else self.line.filling_time)(pressure, volume=self.volume)
        middle, alone = (pressure[1:] + pressure[:-1]) / 2, np.abs(np.diff(times))
        gauge = middle - self.line.ambient_pressure
        steady = np.maximum(_flow(self.model, self.fill, gauge, primed=primed).velocity, 0.0)
        by_line, gives = self.volume * np.diff(pressure), middle * self.model.tube_area * alone
        now = before
        for i in range(middle.size):
            # Where the line does not move the pressure nothing passes; a slow rise takes its time.
            total = by_line[i] - gives[i] * (now.velocity if self.mass else steady[i])
            slower = by_line[i] / total if total * by_line[i] > 0 else 0.0
            lasting = float(alone[i]) * min(slower, _SLOWEST_RISE)
            now = self._moved(now, float(gauge[i]), float(steady[i]), lasting)
        return now

    def held(self, pressure: float, time: float, before: _Passed) -> _Passed:
        """Under a constant absolute pressure."""
        gauge, now = pressure - self.line.ambient_pressure, before
        steady = float(_flow(self.model, self.fill, np.array([gauge]), primed=True).velocity[0])
        for _ in range(_PRESSURES):
            now = self._moved(now, gauge, steady, time / _PRESSURES)
        return now

    def coasted(self, before: _Passed) -> _Passed:
        """To rest, where the pressure that stops a primed column holds it back: ln(1 + c u^2/B)/(2 c)."""
        if before.friction == 0 or self.edges.stops == 0:
            return before
        back = self.edges.stops / self.mass
        more = math.log1p(before.friction * before.velocity**2 / back) / (2 * before.friction)
        return replace(before, metres=before.metres + more, velocity=0.0)

    def _moved(self, before: _Passed, gauge: float, steady: float, time: float) -> _Passed:
        velocity, friction = steady, before.friction
        if self.mass and steady > 0:
            push = gauge / self.mass
            share, grown = before.velocity / steady, math.tanh(time * push / steady)
            velocity, friction = steady * (share + grown) / (1 + share * grown), push / steady**2
        mean = (before.velocity + velocity) / 2 if self.mass else steady
        return _Passed(
            metres=before.metres + mean * time,
            time=before.time + time,
            velocity=velocity,
            friction=friction,
        )


def line_text(answers: tuple[LineAnswer, ...]) -> str:
    """The smallest correction that the line can deliver, in one phrase."""
    if any(answer.smallest_correction is None for answer in answers):
        return "the gas starts no flow at equal fills"
    whose = "the scene's" if answers[0].end == "given" else "not in the scene, default range"
    each = [f"{1e6 * (answer.smallest_correction or 0.0):.2g} um{_which(answer)}" for answer in answers]
    return f"{whose}: smallest correction {' or '.join(each)}"


def line_warning(answers: tuple[LineAnswer, ...]) -> str:
    """Empty where the line can deliver corrections as small as the limit."""
    above = [answer for answer in answers if answer.above_limit]
    if not above:
        return ""
    which = "" if above[0].end == "given" else " over its default range" if len(above) > 1 else " if slow"
    return (
        f"the smallest correction that the gas line can deliver{which}, {_sizes(above)} um, is "
        f"above the limit of {1e6 * above[0].limit:.2g} um: no run is sure to settle; take a faster valve, "
        "less dead volume or a higher limit"
    )


def _sizes(answers: Sequence[LineAnswer]) -> str:
    """In um, the smaller one first."""
    return " to ".join(f"{1e6 * size:.2g}" for size in sorted(a.smallest_correction or 0.0 for a in answers))


def line_document(answers: tuple[LineAnswer, ...]) -> dict[str, Any]:
    """For JSON, in SI."""
    return {
        "given": answers[0].end == "given",
        "limit_m": answers[0].limit,
        "ends": [
            {
                "end": answer.end,
                "conductance_m3_per_s_Pa": answer.conductance,
                "critical_ratio": answer.critical_ratio,
                "valve_lag_s": answer.valve_lag,
                "filling_time_s": answer.filling_time,
                "choked_filling_time_s": answer.choked_filling_time,
                "venting_time_s": answer.venting_time,
                "shortest_opening_s": answer.shortest_opening,
                "smallest_correction_m": answer.smallest_correction,
                "above_limit": answer.above_limit,
            }
            for answer in answers
        ],
        "text": line_text(answers),
        "warning": line_warning(answers),
    }


def _which(answer: LineAnswer) -> str:
    if answer.end == "given":
        return ""
    numbers = f"{1e8 * answer.conductance:.2g} l/(s bar), {1e3 * answer.valve_lag:.2g} ms lag"
    return f" ({answer.end}: {numbers})"
