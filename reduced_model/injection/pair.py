"""State of one pair of chambers, its way through an interval of time, and one injection into a pair at rest.

**Shortest injection.**  Nothing flows before the gas has filled the chamber up to the pressure that starts
the flow and lifted the liquid to the crest, and until the tube is primed liquid at most spills.  A valve that
shuts then leaves a primed column, which runs until the chamber has vented: this amount is the smallest that
can be relied upon; what spills before is less, and depends on every millisecond.

**Dead time.**  Valve-open time that an injection loses against the steady velocity: T - s/u0 where an opening
T moves the column by s.  A controller that counts on the steady velocity adds it to every valve-open time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from ringbalance.reduced_model.injection.dynamics import (
    EVENTS,
    MOTION,
    WORK,
    WORKSPACE,
    Dynamics,
    Event,
    P,
    U,
)
from ringbalance.reduced_model.injection.lift import resume, stands
from ringbalance.reduced_model.injection.march import advance
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.scene.arrays import FloatArray

Two = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Switch:
    """A valve that has been commanded to move and has not moved yet."""

    after: float
    """s from now."""
    chamber: int
    """0 or 1."""
    opens: bool


@dataclass(frozen=True, kw_only=True)
class Record:
    """What the last command to a pair has done so far."""

    chamber: int = 0
    """0 or 1: the driven one."""
    fill: float = 0.0
    """x of the driven chamber at the command."""
    work: float = 0.0
    """Of the driven chamber's gas, integral of (p - ambient) dV, J."""
    regime_start: Regime = Regime.BLOCKED
    regime_end: Regime = Regime.BLOCKED
    event: Event = Event.BLOCKED
    closing_pressure: float = 0.0
    """Gauge, of the driven chamber's gas when its valve closed, Pa."""
    run_dry: float = 0.0
    """Time for which the valve stayed open to an empty chamber, s."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """State of a chamber pair other than its fills."""

    velocity: float = 0.0
    """In the tube, m/s, positive out of chamber 0."""
    gases: Two = (0.0, 0.0)
    """Gauge pressure in chambers 0 and 1, Pa."""
    contents: Two | None = None
    """m R = p V/T of the gas in chambers 0 and 1, J/K; None: at ambient pressure and temperature."""
    valves: tuple[bool, bool] = (False, False)
    """Which valves are open."""
    pending: tuple[Switch, ...] = ()
    """At most an opening and a closing of one valve."""
    record: Record = field(default_factory=Record)
    lifted: tuple[float, float, int] = (0.0, 0.0, 0)
    """Fractions of the path up to which liquid stood in the tube as it began to move, and stands now, and the
    direction in which they count; 0: both legs stand at their chambers' levels."""

    @property
    def rests(self) -> bool:
        """Whether nothing moves, no gas is under pressure, and no valve is about to move."""
        return self.velocity == 0 and self.gases == (0.0, 0.0) and not any(self.valves) and not self.pending


@dataclass(frozen=True, kw_only=True)
class PairState:
    """Liquid of two opposite chambers: one fill is stored, the other follows from the total."""

    fill: float
    """x of the chamber on the positive side of the pair's axis (A, B, ...)."""
    total: float
    """Sum of the two fill ratios, constant."""
    primed: bool = False
    """Whether the connecting tube holds a continuous column."""
    motion: Motion = field(default_factory=Motion)
    """Velocity, gas and valves, where the plant models them; at rest otherwise."""

    @property
    def opposite_fill(self) -> float:
        """x of the chamber on the negative side, total - x."""
        return self.total - self.fill


@dataclass(frozen=True, kw_only=True)
class Passage:
    """A pair after an interval of time."""

    fills: FloatArray
    """x of chamber 0 at the given instants, shape (m,)."""
    fill: float
    """x of chamber 0 at the end."""
    primed: bool
    motion: Motion
    """At the end; its record's event is UNFINISHED when the bound on the number of steps was reached."""
    ended: float
    """s, at which the flow out of the chamber that was driven last ended; zero where it has not."""
    filled: float | None
    """s, at which the tube was first primed; None where it has not been."""
    ran_back: float
    """Change of x by flow out of the chamber that was not driven last, with both valves closed."""


def pass_time(dynamics: Dynamics, pair: PairState, *, instants: FloatArray) -> Passage:
    """Let time pass for one pair. Args: `instants`: s from now, ascending, the last one the end."""
    total = pair.total
    plant = dynamics.kept_plant(total=total)
    state = packed(plant, fill=pair.fill, primed=pair.primed, motion=pair.motion)
    notes = np.stack([instants, instants])
    advance(plant[0], state[0], float(instants[-1]), notes, 1, instants.size, np.zeros(WORKSPACE))
    lowest, highest = max(0.0, total - dynamics.max_fill_ratio), min(total, dynamics.max_fill_ratio)
    return Passage(
        fills=np.clip(notes[1], lowest, highest),
        fill=stands(plant[0], state[0])[1],
        primed=bool(state["primed"][0]),
        motion=_unpacked(plant, state),
        ended=float(state["ended"][0]),
        filled=float(state["filled"][0]) if state["filled"][0] >= 0 else None,
        ran_back=float(state["ran_back"][0]),
    )


def opened(dynamics: Dynamics, *, chamber: int, duration: float) -> tuple[Switch, Switch]:
    """What a command to open a valve for a time, s, does to it: both movements come a lag late."""
    lag = dynamics.valve_lag
    return (
        Switch(after=lag, chamber=chamber, opens=True),
        Switch(after=lag + duration, chamber=chamber, opens=False),
    )


def packed(plant: npt.NDArray[np.void], *, fill: float, primed: bool, motion: Motion) -> npt.NDArray[np.void]:
    """Record of type `MOTION`, shape (1,), of a pair; `fill` is x of chamber 0."""
    known, ambient, total = plant[0], float(plant["ambient_pressure"][0]), float(plant["total"][0])
    state = np.zeros(1, dtype=MOTION)
    volumes = [
        max(1 - x, 1e-3) * known["chamber_volume"] + known["dead_volume"] for x in (fill, total - fill)
    ]
    contents = motion.contents or [ambient * volume / known["temperature"] for volume in volumes]
    record = motion.record
    state["state"][0, :6] = fill, motion.velocity, *(p + ambient for p in motion.gases), *contents
    state["state"][0, WORK + record.chamber] = record.work
    state["opens"], state["closes"] = math.inf, math.inf
    chamber = record.chamber
    for switch in motion.pending:
        state["opens" if switch.opens else "closes"], chamber = switch.after, switch.chamber
    begun, place, side = motion.lifted
    direction = int(np.sign(motion.velocity)) or (side if place > begun else 0)
    stop = float(known["crest_end" if side > 0 else "return_crest_end"])
    for name, value in {
        "length": known["first_step"],
        "started": fill,
        "fill_before": record.fill,
        "least_fill": total - fill if chamber else fill,
        "residual": known["residual"],
        "closing_pressure": record.closing_pressure,
        "run_dry": record.run_dry,
        "filled": -1.0,
        "primed": primed,
        "valve_0": motion.valves[0],
        "valve_1": motion.valves[1],
        "direction": direction,
        "front": begun,
        "side": side,
        "lifting": direction != 0 and side == direction and not primed and place < stop,
        "chamber": chamber,
        "regime_start": record.regime_start,
        "regime_end": record.regime_end,
        "event": EVENTS.index(record.event),
    }.items():
        state[name] = value
    if state["lifting"][0]:
        resume(known, state[0], place)
    return state


def _unpacked(plant: npt.NDArray[np.void], state: npt.NDArray[np.void]) -> Motion:
    """What `packed` was made of, some time later."""
    one, ambient = state[0], float(plant["ambient_pressure"][0])
    y, chamber = one["state"], int(one["chamber"])
    waiting = ((float(one["opens"]), True), (float(one["closes"]), False))
    return Motion(
        velocity=float(y[U]) if one["direction"] else 0.0,
        gases=(float(y[P]) - ambient, float(y[P + 1]) - ambient),
        contents=(float(y[P + 2]), float(y[P + 3])),
        valves=(bool(one["valve_0"]), bool(one["valve_1"])),
        pending=tuple(
            Switch(after=after, chamber=chamber, opens=opens) for after, opens in waiting if after < math.inf
        ),
        lifted=(float(one["front"]), stands(plant[0], one)[0], int(one["side"])),
        record=Record(
            chamber=chamber,
            fill=float(one["fill_before"]),
            work=float(y[WORK + chamber]),
            regime_start=Regime(int(one["regime_start"])),
            regime_end=Regime(int(one["regime_end"])),
            event=EVENTS[int(one["event"])],
            closing_pressure=float(one["closing_pressure"]),
            run_dry=float(one["run_dry"]),
        ),
    )


_RELATIVE_ERROR: Final = 1e-7
"""Allowed to one step: an amount is then right to 1e-5 of it."""
_TAIL: Final = 10.0
"""s after a valve has closed: the gas has vented and the liquid rests."""
_TIME_ERROR: Final = 1e-6
"""s, of a valve-open time."""
_DOUBLINGS: Final = 12
"""Of the time by which an opening may be longer than the steady velocity has it."""
_RUN_BACK: Final = 0.01
"""Part of what an injection has moved that may run back as its column swings out."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Injections:
    """Injections into one chamber of a pair at rest, its tube not primed, timed from the valve's opening."""

    dynamics: Dynamics
    pair: PairState
    chamber: int
    """0 or 1: the driven one."""
    steady: float
    """Fill ratio that leaves the driven chamber per second by a primed column under the supply's gas, 1/s."""

    @classmethod
    def of(
        cls, dynamics: Dynamics, model: BalancerModel, *, fill: float, total: float, chamber: int = 0
    ) -> Injections:
        """Into the chamber of a pair that has a fill ratio."""
        flow = model.flow.evaluate(
            fill_ratio=fill,
            opposite_fill_ratio=total - fill,
            gas_pressure=dynamics.gas_pressure,
            primed=True,
        )
        return cls(
            dynamics=replace(dynamics, valve_lag=0.0, relative_error=_RELATIVE_ERROR),
            pair=PairState(fill=total - fill if chamber else fill, total=total),
            chamber=chamber,
            steady=float(flow.velocity) * model.tube_area / model.chamber_volume,
        )

    def _passed(self, opening: float, until: float) -> Passage:
        valve = opened(self.dynamics, chamber=self.chamber, duration=opening)
        return pass_time(
            self.dynamics,
            replace(self.pair, motion=Motion(pending=valve)),
            instants=np.array([until]),
        )

    @cached_property
    def shortest(self) -> float | None:
        """Valve-open time that just primes the tube, s; None where the gas starts no flow.

        Where the tube is never primed, the time in which the chamber fills and liquid has passed the crest.
        """
        path = self._passed(2 * _TAIL, _TAIL)
        blocked = path.motion.record.event is Event.BLOCKED or path.fill == self.pair.fill
        if blocked or self.steady <= 0:
            return None
        if path.filled is not None:
            # Shut at the very instant, round-off would decide whether the tube is primed.
            return path.filled + _TIME_ERROR
        return max(self._filling_time, self._arrival)

    @property
    def _filling_time(self) -> float:
        """Of the driven chamber without flow, s."""
        line, supply = self.dynamics.line, self.dynamics.gas_pressure + self.dynamics.ambient_pressure
        fill = self.pair.opposite_fill if self.chamber else self.pair.fill
        volume = (1 - fill) * self.dynamics.chamber_volume + self.dynamics.dead_volume
        return 0.0 if line is None else float(line.filling_time(supply, volume=volume))

    @property
    def _arrival(self) -> float:
        """When lifted liquid reaches the end of the crest under a valve that stays open, s."""
        if self.dynamics.lift is None:
            return 0.0
        early, late = 0.0, _TAIL
        while late - early > _TIME_ERROR:
            middle = (early + late) / 2
            _, place, side = self._passed(2 * _TAIL, middle).motion.lifted
            if side != 0 and place >= self.dynamics.column.crest_ends[self.chamber]:
                late = middle
            else:
                early = middle
        return late

    def moved(self, opening: float) -> float:
        """Fill ratio that has left the driven chamber when all is at rest after an opening, s."""
        end = self._passed(opening, opening + _TAIL)
        return end.fill - self.pair.fill if self.chamber else self.pair.fill - end.fill

    def opening(self, amount: float, *, least: float) -> float:
        """Valve-open time, s, that moves a fill ratio; at least `least`, infinite where none does."""
        if self.moved(least) >= amount:
            return least
        longest, more = least + amount / self.steady, 0.05
        for _ in range(_DOUBLINGS):
            if self.moved(longest + more) >= amount:
                break
            more *= 2.0
        else:
            return np.inf
        return float(brentq(lambda time: self.moved(time) - amount, least, longest + more, xtol=_TIME_ERROR))

    def dead_time(self, amount: float) -> float | None:
        """Of the injection that moves a fill ratio, or of the shortest sure one that moves more, s.

        Zero where the gas cannot move so much; None where what it has moved runs back with the valves shut.
        """
        if self.shortest is None:
            return 0.0
        opening = self.opening(amount, least=self.shortest)
        held = opening if np.isfinite(opening) else self.shortest
        moved, back = self.moved(held), self._passed(held, held + _TAIL).ran_back
        if back > _RUN_BACK * (abs(moved) + back):
            return None
        return opening - moved / self.steady if np.isfinite(opening) else 0.0
