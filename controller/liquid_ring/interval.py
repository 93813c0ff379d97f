"""A pair of chambers through time: fill, velocity and gas as one system, with its events.

States are x of chamber 0, the velocity u out of it, pressure and content (m R) of the gas in chambers 0 and
1, and the work of either gas.  x of chamber 1 is total - x, here as everywhere, so liquid is conserved.
The liquid either rests or moves in one direction; what changes that ends a step: the column comes to rest,
begins to move, separates or closes at the crest, a chamber empties or is full, its level leaves the port, or
a valve moves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.column import Steady
from ringbalance.controller.liquid_ring.motion import Dynamics, Motion, Two
from ringbalance.controller.liquid_ring.steps import RELATIVE_ERROR, Stepper, Taken
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
MOST_SEPARATIONS: Final = 16
"""Crossings of the edge of separation, within one stretch, that are found to the instant."""
AT_REST: Final = 1e-6
"""Relative distance of a gas from its end pressure that counts as there, with the liquid at rest."""


@dataclass(frozen=True, kw_only=True)
class Passage:
    """A pair after a stretch of time."""

    fills: FloatArray
    """x of chamber 0 at the instants asked for, shape (m,)."""
    fill: float
    """x of chamber 0 at the end."""
    primed: bool
    """Whether the tube holds a continuous column at the end."""
    motion: Motion
    """At the end."""
    ran_back: float
    """Change of x by flow out of the chamber that was not driven last, with both valves closed."""


def pass_time(
    dynamics: Dynamics, *, fill: float, total: float, primed: bool, motion: Motion, instants: FloatArray
) -> Passage:
    """Let time pass for one pair.

    Args: `dynamics`: the pair's forces, gas lines and valves. `fill`: x of chamber 0. `total`: sum of the two
        fill ratios. `primed`: whether the tube holds a continuous column. `motion`: all else that the pair is
        about. `instants`: s from now, shape (m,), ascending, the last one the end.
    Returns: Passage; the record's event is UNFINISHED when the bound on the number of steps was reached.
    """
    run = _Run(dynamics, fill=fill, total=total, primed=primed, motion=motion)
    fills = np.empty(instants.shape)
    for place, instant in enumerate(instants):
        run.until(float(instant))
        fills[place] = run.state[0]
    return run.passage(fills)


class _Run:
    """The march of one pair; lives inside one call of `pass_time`."""

    def __init__(
        self, dynamics: Dynamics, *, fill: float, total: float, primed: bool, motion: Motion
    ) -> None:
        self.dynamics = dynamics
        self.total = total
        self.lowest = max(0.0, total - dynamics.max_fill_ratio)
        self.highest = min(total, dynamics.max_fill_ratio)
        self.primed = primed
        self.valves = list(motion.valves)
        self.pending = list(motion.pending)
        self.record = motion.record
        self.direction = int(np.sign(motion.velocity))
        self.state = np.array(
            [fill, motion.velocity, *self._gas_states(fill, motion), 0.0, 0.0], dtype=np.float64
        )
        self.time = 0.0
        self.stepper = self._new_stepper()
        self.ran_back = 0.0
        self.separated = self._separated(self.state)
        self.separations = 0
        self.started = fill
        self.balanced = False
        self.stopped = 0

    def _gas_states(self, fill: float, motion: Motion) -> list[float]:
        """Pressure and content of either gas."""
        ambient, line = self.dynamics.ambient_pressure, self.dynamics.line
        volumes = (self.dynamics.gas_volume(fill), self.dynamics.gas_volume(self.total - fill))
        warmth = 1.0 if line is None else line.temperature
        contents = motion.contents or (ambient * volumes[0] / warmth, ambient * volumes[1] / warmth)
        (p, q), (m, n) = motion.gases, contents
        return [p + ambient, m, q + ambient, n]

    def _new_stepper(self) -> Stepper:
        """With errors allowed to each state; the works are integrals of the others and ask for nothing."""
        pressure = self.dynamics.gas_pressure + self.dynamics.ambient_pressure
        share = RELATIVE_ERROR / 10
        gas = [share * pressure, share * self.state[3], share * pressure, share * self.state[5]]
        return Stepper(
            rates=self._rates,
            allowed=np.array([share, 1e2 * share, *gas, np.inf, np.inf]),
            integral_error=share * pressure * self.dynamics.chamber_volume,
        )

    def until(self, stop: float) -> None:
        """To an instant, through the valves' movements on the way."""
        while self.pending and self.pending[0].after <= stop:
            self._march(self.pending[0].after)
            self._flip()
        self._march(stop)

    def passage(self, fills: FloatArray) -> Passage:
        """What has become of the pair."""
        self._settle()
        self._note_regime()
        x, moving = float(self.state[0]), self.dynamics.inertia and self.direction != 0
        if self.direction and not moving:
            self.primed = self._found(self.state, primed=True).primed
        motion = Motion(
            velocity=float(self.state[1]) if moving else 0.0,
            gases=self._seen(self.state)[1],
            contents=(float(self.state[3]), float(self.state[5])),
            valves=(self.valves[0], self.valves[1]),
            pending=tuple(replace(s, after=s.after - self.time) for s in self.pending),
            record=replace(self.record, work=self.record.work + float(self.state[6 + self.record.chamber])),
        )
        return Passage(
            fills=np.clip(fills, self.lowest, self.highest),
            fill=x,
            primed=self.primed,
            motion=motion,
            ran_back=self.ran_back,
        )

    # --- what moves it ---

    def _rates(self, state: FloatArray) -> list[float]:
        """Rates of all states with the liquid at rest, or moving in the present direction."""
        x, u, p, m, q, n, _, _ = state.tolist()
        plant, ambient, direction = self.dynamics, self.dynamics.ambient_pressure, self.direction
        fills, gases = (x, self.total - x), (p - ambient, q - ambient)
        speed, acceleration = 0.0, 0.0
        if direction and plant.inertia:
            speed = max(u * direction, 0.0)
            push = plant.column.acceleration(fills, gases, speed=speed, direction=direction)
            acceleration = push * direction
        elif direction:
            found = plant.column.steady(fills, gases, primed=True).velocity
            speed = max(found * direction, 0.0)
        flow = plant.tube_area * speed * direction
        growth = flow / plant.chamber_volume
        works = (gases[0] * flow, -gases[1] * flow)
        if plant.line is None:
            return [-growth, acceleration, 0.0, 0.0, 0.0, 0.0, *works]
        first, second = plant.gas_volume(x), plant.gas_volume(self.total - x)
        dp, dm = plant.line.rates(pressure=p, content=m, volume=first, growth=flow, is_open=self.valves[0])
        dq, dn = plant.line.rates(pressure=q, content=n, volume=second, growth=-flow, is_open=self.valves[1])
        return [-growth, acceleration, dp, dm, dq, dn, *works]

    # --- the march ---

    def _march(self, stop: float) -> None:
        while self.time < stop:
            self._settle()
            if self.stepper.steps >= MAX_STEPS:
                self.record = replace(self.record, event=Event.UNFINISHED)
                self.time = stop
            elif self._quiet():
                self.time = stop
            else:
                self._step(stop)

    def _step(self, stop: float) -> None:
        """One accepted step, cut at the first event within it."""
        taken = self.stepper.take(self.state, time=self.time, stop=stop, most=MAX_STEPS)
        end, length = taken.end, taken.length
        last = self.time + length >= stop
        if self._changes(end):
            end, length = self._first_change(taken)
            last = False
        self._ran_back(float(end[0] - self.state[0]))
        self.state = end
        separated = self._separated(end)
        self.separations += separated != self.separated
        self.separated = separated
        self.time = stop if last else self.time + length

    def _first_change(self, taken: Taken) -> tuple[FloatArray, float]:
        """State and time just behind the event, by bisection of the step's length."""
        low, high, end = 0.0, 1.0, taken.end
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            found = taken.within(middle)
            if self._changes(found):
                high, end = middle, found
            else:
                low = middle
        return end, high * taken.length

    def _ran_back(self, change: float) -> None:
        driven = 1 if self.record.chamber == 0 else -1
        if self.direction == -driven and not any(self.valves):
            self.ran_back += abs(change)

    # --- events ---

    def _seen(self, state: FloatArray) -> tuple[Two, Two]:
        """Fills and gauge pressures of a state."""
        x, ambient = float(state[0]), self.dynamics.ambient_pressure
        return (x, self.total - x), (float(state[2]) - ambient, float(state[4]) - ambient)

    def _found(self, state: FloatArray, *, primed: bool) -> Steady:
        fills, gases = self._seen(state)
        return self.dynamics.column.steady(fills, gases, primed=primed)

    def _changes(self, state: FloatArray) -> bool:
        if not self.direction:
            return self._begins(state)
        if self._ends(state) is not None:
            return True
        # Flow that keeps to the edge of separation crosses it again and again; its rates are continuous
        # there, so that a crossing need not be found to be stepped over.
        return self.separations < MOST_SEPARATIONS and self._separated(state) != self.separated

    def _begins(self, state: FloatArray) -> bool:
        """Whether resting liquid starts to flow, or its column separates."""
        found = self._found(state, primed=self.primed)
        separated = self.primed and found.velocity == 0 and not found.primed
        return separated or self._start(state, found) != 0

    def _start(self, state: FloatArray, found: Steady) -> int:
        """Direction in which resting liquid starts to flow; zero for none."""
        direction = int(np.sign(found.velocity))
        if direction == 0 or self.balanced or self._limit(float(state[0]), direction) is not None:
            return 0
        if not self.dynamics.inertia:
            return direction
        fills, gases = self._seen(state)
        push = self.dynamics.column.acceleration(fills, gases, speed=0.0, direction=direction)
        return direction if push > 0 else 0

    def _limit(self, x: float, direction: int) -> Event | None:
        """Whether a chamber is in the way of flow in a direction."""
        if direction > 0 and x <= self.lowest:
            return Event.EMPTY if self.lowest == 0 else Event.FULL
        if direction < 0 and x >= self.highest:
            return Event.EMPTY if self.highest == self.total else Event.FULL
        return None

    def _ends(self, state: FloatArray) -> Event | None:
        """What ends the flow in the present direction, if anything does."""
        limit = self._limit(float(state[0]), self.direction)
        if limit is not None:
            return limit
        fills, gases = self._seen(state)
        column = self.dynamics.column
        if column.open_to_gas(fills, gases, direction=self.direction):
            return Event.STALLED
        if self.dynamics.inertia:
            return Event.STALLED if state[1] * self.direction < 0 else None
        stalled = column.steady(fills, gases, primed=True).velocity * self.direction <= 0
        return Event.STALLED if stalled else None

    def _settle(self) -> None:
        """Let moving liquid come to rest, and resting liquid start, where it has to."""
        if self.direction:
            event = self._ends(self.state)
            if event is None:
                return
            self._stop(event)
        found = self._found(self.state, primed=self.primed)
        if self.primed and found.velocity == 0 and not found.primed:
            self.primed = False
            found = self._found(self.state, primed=False)
        limit = self._limit(float(self.state[0]), int(np.sign(found.velocity)))
        if limit is not None:
            self.primed = self.primed and limit is not Event.EMPTY
            self._note(limit, int(np.sign(found.velocity)))
        self.direction = self._start(self.state, found)
        if self.direction:
            self.primed = True
            self.stepper.reset()
            self.started = float(self.state[0])
            self.separated = self._separated(self.state)
            self._note(Event.NONE, self.direction)

    def _stop(self, event: Event) -> None:
        """At rest: at a limit exactly, and with a column only where the law has one."""
        self._note(event, self.direction)
        self._weigh(abs(float(self.state[0]) - self.started))
        if event in {Event.EMPTY, Event.FULL}:
            self.state[0] = self.lowest if self.direction > 0 else self.highest
        fills, gases = self._seen(self.state)
        gone = event is Event.EMPTY or self.dynamics.column.open_to_gas(
            fills, gases, direction=self.direction
        )
        self.primed = not gone and self._found(self.state, primed=True).primed
        self.state[1] = 0.0
        self.direction = 0
        self.stepper.reset()

    def _weigh(self, moved: float) -> None:
        """Whether the next start can be more than round-off, and whether it asks for implicit steps."""
        creeping = self.stopped != -self.direction and not self.stepper.stiff
        still = moved < (NOTHING_MOVED if creeping else LITTLE_MOVED)
        # A start that moved nothing will move nothing again, until a valve or a gas pressure does.
        self.balanced = self.dynamics.line is None and still
        self.stepper.stiff |= creeping and moved < LITTLE_MOVED
        self.stopped = self.direction

    def _flip(self) -> None:
        """The next pending valve moves."""
        switch = self.pending.pop(0)
        self.valves[switch.chamber] = switch.opens
        self.balanced, self.stopped = False, 0
        self.stepper.stiff = False
        if self.direction and not self.dynamics.inertia:
            self._note_regime()
            self.primed = self._found(self.state, primed=True).primed
            self.direction = 0
        if self.dynamics.line is None:
            pressure = self.dynamics.gas_pressure if switch.opens else 0.0
            self.state[2 + 2 * switch.chamber] = self.dynamics.ambient_pressure + pressure
        self.stepper.reset()

    def _quiet(self) -> bool:
        """Whether nothing changes any more until a valve moves: then the gases are put to their ends."""
        line = self.dynamics.line
        if self.direction or line is None:
            return not self.direction
        ends = [line.supply_pressure if v else line.ambient_pressure for v in self.valves]
        off = [abs(self.state[2 + 2 * i] - end) > AT_REST * end for i, end in enumerate(ends)]
        if any(off):
            return False
        self.state[2], self.state[4] = ends
        return True

    # --- the record ---

    def _note(self, event: Event, direction: int) -> None:
        """Keep what happens to the flow out of the driven chamber."""
        chamber = self.record.chamber
        if direction == (1 if chamber == 0 else -1):
            first = self.record.regime_start is Regime.BLOCKED and event is Event.NONE
            kept = self.record.event if event is Event.STALLED and not self.valves[chamber] else event
            self.record = replace(self.record, event=kept)
            if first:
                self.record = replace(self.record, regime_start=self._regime())
        self._note_regime()

    def _note_regime(self) -> None:
        if self.direction:
            self.record = replace(self.record, regime_end=self._regime())

    def _regime(self) -> Regime:
        if self.direction != (1 if self.record.chamber == 0 else -1):
            return Regime.REVERSE
        return Regime.SEPARATED if self._separated(self.state) else Regime.SIPHON

    def _separated(self, state: FloatArray) -> bool:
        """Whether moving liquid is separated at the crest."""
        if not self.direction:
            return False
        fills, gases = self._seen(state)
        column, speed = self.dynamics.column, max(float(state[1]) * self.direction, 0.0)
        if self.dynamics.inertia:
            return column.separated(fills, gases, speed=speed, direction=self.direction)
        return column.steady(fills, gases, primed=True).separated
