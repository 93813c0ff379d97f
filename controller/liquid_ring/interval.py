"""A pair of chambers through time: fill, velocity and gas as one system, with its events.

States are x of chamber 0, the velocity u out of it, pressure and content (m R) of the gas in chambers 0 and
1, and the work of either gas.  x of chamber 1 is total - x, here as everywhere, so liquid is conserved.
The liquid either rests or moves in one direction; what changes that ends a step: the column comes to rest,
begins to move, separates or closes at the crest, a chamber empties or is full, its level leaves the port, or
a valve moves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.events import (
    Now,
    Pair,
    chamber_limit,
    changes,
    flow_end,
    is_separated,
    outward,
    seen,
    start_direction,
    steady,
)
from ringbalance.controller.liquid_ring.motion import Dynamics, Motion, Two
from ringbalance.controller.liquid_ring.steps import RELATIVE_ERROR, Allowed, Taken, take
from ringbalance.controller.liquid_ring.transfer import Event
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.scene.arrays import FloatArray

MAX_STEPS: Final = 200_000
BISECTIONS: Final = 48
LITTLE_MOVED: Final = 1e-9
"""Fill ratio, ten times the error allowed to a step, below which a flow that ends either was the last swing
of a column about its balance, or never ended: a creep, cut off by the explicit steps' error in velocity."""
NOTHING_MOVED: Final = 1e-13
"""Fill ratio below which a start has come to nothing but round-off."""
AT_REST: Final = 1e-6
"""Relative distance of a gas from its end pressure that counts as there, with the liquid at rest."""


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
    ran_back: float
    """Change of x by flow out of the chamber that was not driven last, with both valves closed."""


def pass_time(
    dynamics: Dynamics, *, fill: float, total: float, primed: bool, motion: Motion, instants: FloatArray
) -> Passage:
    """Let time pass for one pair.

    Args:
        fill: x of chamber 0.
        total: sum of the two fill ratios.
        primed: whether the tube holds a continuous column.
        instants: s from now, ascending, the last one the end.
    """
    pair, now = _begin(dynamics, fill, total, primed, motion)
    fills = np.empty(instants.shape)
    for place, instant in enumerate(instants):
        now = _until(pair, now, float(instant))
        fills[place] = now.state[0]
    return _passage(pair, now, fills)


def _begin(dynamics: Dynamics, fill: float, total: float, primed: bool, motion: Motion) -> tuple[Pair, Now]:
    ambient, line = dynamics.ambient_pressure, dynamics.line
    volumes = (dynamics.gas_volume(fill), dynamics.gas_volume(total - fill))
    temperature = 1.0 if line is None else line.temperature
    contents = motion.contents or (ambient * volumes[0] / temperature, ambient * volumes[1] / temperature)
    (p, q), (m, n) = motion.gases, contents
    pair = Pair(
        dynamics=dynamics,
        total=total,
        lowest=max(0.0, total - dynamics.max_fill_ratio),
        highest=min(total, dynamics.max_fill_ratio),
        allowed=_allowed(dynamics, contents),
    )
    now = Now(
        state=np.array([fill, motion.velocity, p + ambient, m, q + ambient, n, 0.0, 0.0], dtype=np.float64),
        primed=primed,
        valves=motion.valves,
        pending=motion.pending,
        record=motion.record,
        direction=int(np.sign(motion.velocity)),
        started=fill,
    )
    return pair, replace(now, separated=is_separated(pair, now, now.state))


def _allowed(dynamics: Dynamics, contents: Two) -> Allowed:
    """The works are integrals of the other states and ask for nothing."""
    pressure = dynamics.gas_pressure + dynamics.ambient_pressure
    part = RELATIVE_ERROR / 10
    work = part * pressure * dynamics.chamber_volume
    own = [part, 1e2 * part, part * pressure, part * contents[0], part * pressure, part * contents[1]]
    return Allowed(explicit=np.array([*own, np.inf, np.inf]), implicit=np.array([*own, work, work]))


def _until(pair: Pair, now: Now, stop: float) -> Now:
    """To an instant, through the valves' movements on the way."""
    while now.pending and now.pending[0].after <= stop:
        now = _flip(pair, _march(pair, now, now.pending[0].after))
    return _march(pair, now, stop)


def _passage(pair: Pair, now: Now, fills: FloatArray) -> Passage:
    now = _note_regime(pair, _settle(pair, now))
    moving = pair.dynamics.inertia and now.direction != 0
    coasts = now.direction == 0 or moving
    record = now.record
    motion = Motion(
        velocity=float(now.state[1]) if moving else 0.0,
        gases=seen(pair, now.state)[1],
        contents=(float(now.state[3]), float(now.state[5])),
        valves=now.valves,
        pending=tuple(replace(s, after=s.after - now.time) for s in now.pending),
        record=replace(record, work=record.work + float(now.state[6 + record.chamber])),
    )
    return Passage(
        fills=np.clip(fills, pair.lowest, pair.highest),
        fill=float(now.state[0]),
        primed=now.primed if coasts else steady(pair, now.state, primed=True).primed,
        motion=motion,
        ran_back=now.ran_back,
    )


# --- what moves it ---


def _rates(pair: Pair, direction: int, valves: tuple[bool, bool], state: FloatArray) -> list[float]:
    """Rates of all states with the liquid at rest, or moving in one direction."""
    x, u, p, m, q, n, _, _ = state.tolist()
    plant, ambient = pair.dynamics, pair.dynamics.ambient_pressure
    fills, gases = (x, pair.total - x), (p - ambient, q - ambient)
    speed, acceleration = 0.0, 0.0
    if direction and plant.inertia:
        speed = max(u * direction, 0.0)
        push = plant.column.acceleration(fills, gases, speed=speed, direction=direction)
        acceleration = push * direction
    elif direction:
        speed = max(plant.column.steady(fills, gases, primed=True).velocity * direction, 0.0)
    flow = plant.tube_area * speed * direction
    growth = flow / plant.chamber_volume
    works = (gases[0] * flow, -gases[1] * flow)
    if plant.line is None:
        return [-growth, acceleration, 0.0, 0.0, 0.0, 0.0, *works]
    first, second = plant.gas_volume(x), plant.gas_volume(pair.total - x)
    dp, dm = plant.line.rates(pressure=p, content=m, volume=first, growth=flow, is_open=valves[0])
    dq, dn = plant.line.rates(pressure=q, content=n, volume=second, growth=-flow, is_open=valves[1])
    return [-growth, acceleration, dp, dm, dq, dn, *works]


# --- the march ---


def _march(pair: Pair, now: Now, stop: float) -> Now:
    while now.time < stop:
        now = _settle(pair, now)
        if now.stepping.steps >= MAX_STEPS:
            now = replace(now, record=replace(now.record, event=Event.UNFINISHED), time=stop)
        elif _quiet(pair, now):
            now = replace(now, state=_gases_at_end(pair, now), time=stop)
        else:
            now = _step(pair, now, stop)
    return now


def _step(pair: Pair, now: Now, stop: float) -> Now:
    """One accepted step, cut at the first event within it."""
    taken = take(
        now.stepping,
        rates=partial(_rates, pair, now.direction, now.valves),
        allowed=pair.allowed,
        state=now.state,
        time=now.time,
        stop=stop,
        most=MAX_STEPS,
    )
    end, length = taken.end, taken.length
    last = now.time + length >= stop
    if changes(pair, now, end):
        end, length = _first_change(pair, now, taken)
        last = False
    separated = is_separated(pair, now, end)
    return replace(
        now,
        state=end,
        time=stop if last else now.time + length,
        stepping=taken.after,
        ran_back=now.ran_back + _back(now, float(end[0] - now.state[0])),
        separated=separated,
        separations=now.separations + (separated != now.separated),
    )


def _first_change(pair: Pair, now: Now, taken: Taken) -> tuple[FloatArray, float]:
    """State and time just behind the event, by bisection of the step's length."""
    low, high, end = 0.0, 1.0, taken.end
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        found = taken.within(middle)
        if changes(pair, now, found):
            high, end = middle, found
        else:
            low = middle
    return end, high * taken.length


def _back(now: Now, change: float) -> float:
    against = now.direction == -outward(now) and not any(now.valves)
    return abs(change) if against else 0.0


def _settle(pair: Pair, now: Now) -> Now:
    """Let moving liquid come to rest, and resting liquid start, where it has to."""
    if now.direction:
        event = flow_end(pair, now, now.state)
        if event is None:
            return now
        now = _stop(pair, now, event)
    found = steady(pair, now.state, primed=now.primed)
    if now.primed and found.velocity == 0 and not found.primed:
        now = replace(now, primed=False)
        found = steady(pair, now.state, primed=False)
    wanted = int(np.sign(found.velocity))
    limit = chamber_limit(pair, float(now.state[0]), wanted)
    if limit is not None:
        now = _note(pair, replace(now, primed=now.primed and limit is not Event.EMPTY), limit, wanted)
    direction = start_direction(pair, now, now.state, found)
    if not direction:
        return now
    now = replace(
        now, direction=direction, primed=True, stepping=now.stepping.reset(), started=float(now.state[0])
    )
    return _note(pair, replace(now, separated=is_separated(pair, now, now.state)), Event.NONE, direction)


def _stop(pair: Pair, now: Now, event: Event) -> Now:
    """At rest: at a limit exactly, and with a column only where the law has one."""
    now = _weigh(pair, _note(pair, now, event, now.direction))
    state = now.state.copy()
    if event in {Event.EMPTY, Event.FULL}:
        state[0] = pair.lowest if now.direction > 0 else pair.highest
    fills, gases = seen(pair, state)
    gone = event is Event.EMPTY or pair.dynamics.column.open_to_gas(fills, gases, direction=now.direction)
    primed = not gone and steady(pair, state, primed=True).primed
    state[1] = 0.0
    return replace(now, state=state, primed=primed, direction=0, stepping=now.stepping.reset())


def _weigh(pair: Pair, now: Now) -> Now:
    """Whether the next start can be more than round-off, and whether it asks for implicit steps."""
    moved = abs(float(now.state[0]) - now.started)
    creeping = now.stopped != -now.direction and not now.stepping.stiff
    still = moved < (NOTHING_MOVED if creeping else LITTLE_MOVED)
    stiff = now.stepping.stiff or (creeping and moved < LITTLE_MOVED)
    return replace(
        now,
        # A start that moved nothing will move nothing again, until a valve or a gas pressure does.
        balanced=pair.dynamics.line is None and still,
        stepping=replace(now.stepping, stiff=stiff),
        stopped=now.direction,
    )


def _flip(pair: Pair, now: Now) -> Now:
    """The next pending valve moves."""
    switch, pending = now.pending[0], now.pending[1:]
    plant = pair.dynamics
    if now.direction and not plant.inertia:
        now = _note_regime(pair, now)
        now = replace(now, primed=steady(pair, now.state, primed=True).primed, direction=0)
    state, record = now.state.copy(), now.record
    if not switch.opens and switch.chamber == record.chamber:
        record = replace(record, closing_pressure=seen(pair, state)[1][switch.chamber])
    if plant.line is None:
        pressure = plant.gas_pressure if switch.opens else 0.0
        state[2 + 2 * switch.chamber] = plant.ambient_pressure + pressure
    first, second = now.valves
    return replace(
        now,
        state=state,
        record=record,
        pending=pending,
        valves=(first, switch.opens) if switch.chamber else (switch.opens, second),
        balanced=False,
        stopped=0,
        stepping=replace(now.stepping.reset(), stiff=False),
    )


def _quiet(pair: Pair, now: Now) -> bool:
    """Whether nothing changes any more until a valve moves."""
    ends = _gases_at_end(pair, now)[[2, 4]]
    return not now.direction and bool(np.all(np.abs(now.state[[2, 4]] - ends) <= AT_REST * ends))


def _gases_at_end(pair: Pair, now: Now) -> FloatArray:
    """The state with the gases at the pressures that they tend to."""
    line, state = pair.dynamics.line, now.state.copy()
    if line is not None:
        state[[2, 4]] = [line.supply_pressure if v else line.ambient_pressure for v in now.valves]
    return state


# --- the record ---


def _note(pair: Pair, now: Now, event: Event, direction: int) -> Now:
    """Keep what happens to the flow out of the driven chamber."""
    record = now.record
    if direction == outward(now):
        first = record.regime_start is Regime.BLOCKED and event is Event.NONE
        closed = event is Event.STALLED and not now.valves[record.chamber]
        record = replace(
            record,
            event=record.event if closed else event,
            regime_start=_regime(pair, now) if first else record.regime_start,
            run_dry=_open_for(now) if event is Event.EMPTY is not record.event else record.run_dry,
        )
    return _note_regime(pair, replace(now, record=record))


def _open_for(now: Now) -> float:
    """Time for which the driven chamber's valve will stay open, s."""
    chamber = now.record.chamber
    if not now.valves[chamber]:
        return 0.0
    return max(s.after for s in now.pending if s.chamber == chamber and not s.opens) - now.time


def _note_regime(pair: Pair, now: Now) -> Now:
    if not now.direction:
        return now
    return replace(now, record=replace(now.record, regime_end=_regime(pair, now)))


def _regime(pair: Pair, now: Now) -> Regime:
    if now.direction != outward(now):
        return Regime.REVERSE
    return Regime.SEPARATED if is_separated(pair, now, now.state) else Regime.SIPHON
