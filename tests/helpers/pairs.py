"""A pair of chambers as records that tests can write and read, and its way through an interval of time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.injection.dynamics import (
    EVENTS,
    WORK,
    Dynamics,
    Event,
    P,
    U,
    X,
)
from ringbalance.reduced_model.injection.lift import _passed, stands
from ringbalance.reduced_model.injection.pair import at_rest, fills_at
from ringbalance.reduced_model.law.flow_law import Regime
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
    plant = dynamics.kept_plant(total=pair.total)
    state = packed(plant, fill=pair.fill, primed=pair.primed, motion=pair.motion)
    return Passage(
        fills=fills_at(plant, state, instants),
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
    known, state, record = plant[0], at_rest(plant, fill=fill), motion.record
    gases = [p + known["ambient_pressure"] for p in motion.gases]
    state["state"][0, :4] = fill, motion.velocity, *gases
    if motion.contents is not None:
        state["state"][0, 4:6] = motion.contents
    state["state"][0, WORK + record.chamber] = record.work
    chamber = record.chamber
    for switch in motion.pending:
        state["opens" if switch.opens else "closes"], chamber = switch.after, switch.chamber
    begun, place, side = motion.lifted
    direction = int(np.sign(motion.velocity)) or (side if place > begun else 0)
    stop = float(known["crest_end" if side > 0 else "return_crest_end"])
    for name, value in {
        "fill_before": record.fill,
        "least_fill": float(known["total"]) - fill if chamber else fill,
        "closing_pressure": record.closing_pressure,
        "run_dry": record.run_dry,
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
        # From the fill that is shown, with the front at `place`.
        one = state[0]
        one["started"] = one["state"][X] + direction * _passed(known, one, place)
        one["state"][X] = one["started"] - direction * (place - begun) * float(known["hold_up"])
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
